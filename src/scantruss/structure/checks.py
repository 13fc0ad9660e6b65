"""Checks of steel members by EN 1993-1-1:2005, each with its clause, for every load case and combination.

Hollow and rolled I sections of class 1 to 3, and solid rectangles. A member between two nodes is one buckling length, times a factor. A
utilization above 1 means that the clause is not met.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from .catalogue import Material, Section
from .results import MOMENT_Y, MOMENT_Z, SHEAR_Y, SHEAR_Z, CaseResult
from .truss import Truss

CLAUSES_CHECKED = (
    "6.2.3 tension",
    "6.2.4 compression",
    "6.2.6 shear",
    "6.2.1(7) bending and axial force",
    "6.3.1 flexural buckling",
    "6.3.3 bending and compression",
)
#: imperfection factors of the buckling curves, table 6.1
IMPERFECTION_FACTORS = {"a0": 0.13, "a": 0.21, "b": 0.34, "c": 0.49, "d": 0.76}
MOST_UTILIZATION = 1000  #: that is written as a number
NO_BUCKLING = 0.2  #: relative slenderness up to which a member does not buckle, 6.3.1.2(4)


@dataclass(frozen=True)
class MemberChecks:
    """What the checks take for granted."""

    effective_length: float = 1.0  #: buckling length over system length
    gamma_m0: float = 1.0  #: partial factor of cross-sections, EN 1993-1-1 6.1
    gamma_m1: float = 1.0  #: partial factor of members that buckle, EN 1993-1-1 6.1
    buckling_factor: float = 10.0  #: least factor of linear buckling for analysis of first order, EN 1993-1-1 5.2.1(3)
    slenderness: float = 200.0  #: greatest buckling length over radius of gyration; practice, no clause
    deflection: float = (
        300.0  #: span over the greatest displacement of SLS; practice, EN 1990 A1.4 leaves it to the client
    )

    def __post_init__(self) -> None:
        """Refuse what is no positive number."""
        for name, value in vars(self).items():
            if not (isinstance(value, int | float) and 0 < value < math.inf):
                raise InputError(f"{name} must be a positive number, got {value!r}")


def section_class(section: Section, material: Material) -> int:
    """Return the class of a section in compression and bending, 1 to 4 (EN 1993-1-1 table 5.2)."""
    epsilon = math.sqrt(235e6 / material.yield_strength)
    if section.shape == "CHS":
        ratio, limits = section.width / section.thickness, [limit * epsilon**2 for limit in (50, 70, 90)]
    elif section.shape == "SHS":
        ratio, limits = section.width / section.thickness - 3, [limit * epsilon for limit in (33, 38, 42)]
    elif section.shape == "I":  # all in compression: the web, and the outstand flanges
        web = (section.depth - 2 * section.flange - 2 * section.fillet) / section.thickness
        flange = (section.width - section.thickness - 2 * section.fillet) / (2 * section.flange)
        return 1 + sum(web > w * epsilon or flange > f * epsilon for w, f in ((33, 9), (38, 10), (42, 14)))
    else:
        return 1
    return 1 + sum(ratio > limit for limit in limits)


def buckling_curve(section: Section, material: Material, axis: str = "y") -> str:
    """Return the buckling curve about an axis (EN 1993-1-1 table 6.2)."""
    strong = material.yield_strength >= 460e6
    if section.shape == "I":
        tall = section.depth / section.width > 1.2
        if strong:
            return "a0" if tall else "a"
        return ("a" if tall else "b") if axis == "y" else ("b" if tall else "c")
    if section.finish == "hot":
        return "a0" if strong else "a"
    return "c"


def reduction(slenderness: np.ndarray, alpha: np.ndarray | float) -> np.ndarray:
    """Return chi for relative slendernesses and imperfection factors (EN 1993-1-1 6.3.1.2, equation 6.49)."""
    phi = 0.5 * (1 + alpha * (slenderness - NO_BUCKLING) + slenderness**2)
    chi = 1 / (phi + np.sqrt(np.maximum(phi**2 - slenderness**2, 0.0)))
    return np.where(slenderness <= NO_BUCKLING, 1.0, np.minimum(chi, 1.0))


@dataclass(frozen=True, eq=False)
class Strength:
    """What the members of a structure resist [N, Nm]; made once for all load cases."""

    truss: Truss
    settings: MemberChecks
    axial: np.ndarray  #: (M,) N,pl,Rd
    buckling: np.ndarray  #: (M,) N,b,Rd, axes y and z, the smaller
    relative: np.ndarray  #: (M, 2) relative slenderness about y and z; of I sections also by twisting, 6.3.1.4
    lateral: np.ndarray  #: (M,) reduction of M,Rd about y where it buckles sideways, 6.3.2.2; 1 of sections that cannot
    moment: np.ndarray  #: (M, 2) M,Rd about y and z
    shear: np.ndarray  #: (M, 2) V,Rd along y and z
    classes: tuple[int, ...]  #: of the sections

    @property
    def known(self) -> bool:
        """Whether the checks apply: to steel of class 1 to 3."""
        return self.truss.material.kind == "steel" and max(self.classes) < 4


def strengths(truss: Truss, settings: MemberChecks | None = None) -> Strength:
    """Return what the members resist."""
    settings = settings or MemberChecks()
    material, of = truss.material, truss.of_section
    strength, area = material.yield_strength, of("area")
    classes = tuple(section_class(section, material) for section in truss.sections)
    plastic = np.array([cls < 3 for cls in classes])[truss.section_of]
    length = settings.effective_length * truss.lengths
    inertia = np.stack([of("inertia_y"), of("inertia_z")], axis=1)
    critical = math.pi**2 * material.young * inertia / length[:, None] ** 2
    relative = np.sqrt(area[:, None] * strength / critical)  # 6.3.1.3
    open_ = np.array([section.shape == "I" for section in truss.sections])[truss.section_of]
    if open_.any():
        twisting = _twisting_load(truss, length)
        relative[:, 1] = np.maximum(relative[:, 1], np.where(open_, np.sqrt(area * strength / twisting), 0.0))
    curves = [
        [IMPERFECTION_FACTORS[buckling_curve(section, material, axis)] for axis in "yz"] for section in truss.sections
    ]
    chi = reduction(relative, np.array(curves)[truss.section_of])
    modulus = np.stack([np.where(plastic, of(f"plastic_{axis}"), of(f"elastic_{axis}")) for axis in "yz"], axis=1)
    lateral = np.ones(len(length))
    if open_.any():
        moment = np.sqrt(
            critical[:, 1] * twisting * (of("inertia_y") + of("inertia_z")) / area
        )  # critical, all along the member
        slender = np.sqrt(modulus[:, 0] * strength / moment)
        tall = np.array([section.depth > 2 * section.width for section in truss.sections])[truss.section_of]
        alpha = np.where(tall, IMPERFECTION_FACTORS["b"], IMPERFECTION_FACTORS["a"])  # tables 6.3, 6.4
        lateral = np.where(open_, reduction(slender, alpha), 1.0)
    return Strength(
        truss=truss,
        settings=settings,
        axial=area * strength / settings.gamma_m0,
        buckling=chi.min(axis=1) * area * strength / settings.gamma_m1,
        relative=relative,
        lateral=lateral,
        moment=modulus * strength / settings.gamma_m0,
        shear=_shear_areas(truss) * strength / math.sqrt(3) / settings.gamma_m0,
        classes=classes,
    )


def utilizations(strength: Strength, result: CaseResult) -> np.ndarray:
    """Return the (M, 6) utilizations of the members by the clauses of `CLAUSES_CHECKED`.

    On the safe side: the greatest forces along a member act at one place, sums are linear, and the factors of equivalent moment of
    EN 1993-1-1 annex B are 1.
    """
    low, high = result.axial.T
    tension, compression = np.maximum(high, 0.0), np.maximum(-low, 0.0)
    shear = result.greatest[:, [SHEAR_Y, SHEAR_Z]] / strength.shear
    cut = np.hypot(*shear.T)
    weaker = np.maximum(1 - np.where(cut > 0.5, (2 * cut - 1) ** 2, 0.0), 1e-9)  # 6.2.8(3)
    bending = (result.greatest[:, [MOMENT_Y, MOMENT_Z]] / strength.moment).sum(axis=1) / weaker
    axial = np.maximum(tension, compression) / strength.axial
    buckling = compression / strength.buckling
    plastic = np.array([cls < 3 for cls in strength.classes])[strength.truss.section_of]
    slender = strength.relative.max(axis=1)
    growth = np.where(plastic, np.minimum(slender - NO_BUCKLING, 0.8), np.minimum(0.6 * slender, 0.6))  # tables B.1
    open_ = np.array([section.shape == "I" for section in strength.truss.sections])[strength.truss.section_of]
    weak = np.maximum(growth, np.minimum(2 * slender - 0.6, 1.4))  # k,zz of I sections
    growth = np.where(open_ & plastic, weak, growth)
    factor = 1 + np.maximum(growth, 0.0) * buckling
    about_y = result.greatest[:, MOMENT_Y] / (strength.lateral * strength.moment[:, 0])
    moments = (about_y + result.greatest[:, MOMENT_Z] / strength.moment[:, 1]) * strength.settings.gamma_m1
    moments /= strength.settings.gamma_m0
    both = np.where((compression > 0) | open_, buckling + factor * moments, 0.0)  # without compression 6.3.2
    return np.stack(
        [tension / strength.axial, compression / strength.axial, cut, axial + bending, buckling, both], axis=1
    )


def span_of(truss: Truss) -> float:
    """Return the span: twice the greatest distance of a node from the nearest support, in plan [m]."""
    held = truss.nodes[truss.supports[:, :3].any(axis=1), :2]
    nearest = np.full(len(truss.nodes), math.inf)
    for place in held:
        nearest = np.minimum(nearest, np.linalg.norm(truss.nodes[:, :2] - place, axis=1))
    return 2 * float(nearest.max())


def _shear_areas(truss: Truss) -> np.ndarray:
    """Return the (M, 2) shear areas along y and z: 6.2.6(3) of hollow and I sections, two thirds of solid ones by 6.2.6(4)."""
    return np.array([_shear_area(section) for section in truss.sections])[truss.section_of]


def _shear_area(section: Section) -> tuple[float, float]:
    if section.shape == "I":
        web = (section.depth - 2 * section.flange) * section.thickness
        flanges = 2 * section.width * section.flange
        rest = section.area - flanges + (section.thickness + 2 * section.fillet) * section.flange
        return section.area - web, max(rest, web)
    share = {"CHS": 2 / math.pi, "SHS": 0.5, "R": 2 / 3}[section.shape]
    return share * section.area, share * section.area


def _twisting_load(truss: Truss, length: np.ndarray) -> np.ndarray:
    """Return the (M,) critical forces of torsional buckling of doubly symmetric sections [N] (Timoshenko and Gere, 5.4)."""
    of, material = truss.of_section, truss.material
    polar = (of("inertia_y") + of("inertia_z")) / of("area")
    return (material.shear * of("torsion") + math.pi**2 * material.young * of("warping") / length**2) / polar


def use_words(utilization: float | None) -> str:
    """Return a utilization in words: of absurd loads only that it is beyond all measure."""
    if utilization is None:
        return "-"
    return f"{utilization:.2f}" if utilization <= MOST_UTILIZATION else f"> {MOST_UTILIZATION:g}"
