"""Checks of steel members by EN 1993-1-1:2005, each with its clause, for every load case and combination.

Hollow sections of class 1 to 3 and solid rectangles. A member between two nodes is one buckling length, times a factor. A
utilization above 1 means that the clause is not met.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from .catalogue import Material, Section
from .statics import CaseResult
from .truss import Truss

CLAUSES = (
    "6.2.3 tension",
    "6.2.4 compression",
    "6.2.6 shear",
    "6.2.1(7) bending and axial force",
    "6.3.1 flexural buckling",
    "6.3.3 bending and compression",
)
#: imperfection factors of the buckling curves, table 6.1
IMPERFECTION = {"a0": 0.13, "a": 0.21, "b": 0.34, "c": 0.49, "d": 0.76}
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
    else:
        return 1
    return 1 + sum(ratio > limit for limit in limits)


def buckling_curve(section: Section, material: Material) -> str:
    """Return the buckling curve (EN 1993-1-1 table 6.2)."""
    if section.finish == "hot":
        return "a0" if material.yield_strength >= 460e6 else "a"
    return "c"


def reduction(slenderness: np.ndarray, curve: str) -> np.ndarray:
    """Return chi for relative slendernesses (EN 1993-1-1 6.3.1.2, equation 6.49)."""
    alpha = IMPERFECTION[curve]
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
    relative: np.ndarray  #: (M, 2) relative slenderness about y and z
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
    curves = [buckling_curve(section, material) for section in truss.sections]
    chi = np.empty_like(relative)
    for number, curve in enumerate(curves):
        mine = truss.section_of == number
        chi[mine] = reduction(relative[mine], curve)
    modulus = np.stack([np.where(plastic, of(f"plastic_{axis}"), of(f"elastic_{axis}")) for axis in "yz"], axis=1)
    return Strength(
        truss=truss,
        settings=settings,
        axial=area * strength / settings.gamma_m0,
        buckling=chi.min(axis=1) * area * strength / settings.gamma_m1,
        relative=relative,
        moment=modulus * strength / settings.gamma_m0,
        shear=_shear_areas(truss) * strength / math.sqrt(3) / settings.gamma_m0,
        classes=classes,
    )


def utilizations(strength: Strength, result: CaseResult) -> np.ndarray:
    """Return the (M, 6) utilizations of the members by the clauses of `CLAUSES`.

    On the safe side: the greatest forces along a member act at one place, sums are linear, and the factors of equivalent moment of
    EN 1993-1-1 annex B are 1.
    """
    low, high = result.axial.T
    tension, compression = np.maximum(high, 0.0), np.maximum(-low, 0.0)
    shear = result.greatest[:, 1:3] / strength.shear
    cut = np.hypot(*shear.T)
    weaker = np.maximum(1 - np.where(cut > 0.5, (2 * cut - 1) ** 2, 0.0), 1e-9)  # 6.2.8(3)
    bending = (result.greatest[:, 4:6] / strength.moment).sum(axis=1) / weaker
    axial = np.maximum(tension, compression) / strength.axial
    buckling = compression / strength.buckling
    plastic = np.array([cls < 3 for cls in strength.classes])[strength.truss.section_of]
    slender = strength.relative.max(axis=1)
    growth = np.where(plastic, np.minimum(slender - NO_BUCKLING, 0.8), np.minimum(0.6 * slender, 0.6))  # tables B.1
    factor = 1 + np.maximum(growth, 0.0) * buckling
    moments = (result.greatest[:, 4:6] / strength.moment).sum(axis=1) * strength.settings.gamma_m1
    moments /= strength.settings.gamma_m0
    both = np.where(compression > 0, buckling + factor * moments, 0.0)
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
    """Return the (M, 2) shear areas along y and z: 6.2.6(3) of hollow sections, two thirds of solid ones by 6.2.6(4)."""
    share = {"CHS": 2 / math.pi, "SHS": 0.5, "R": 2 / 3}
    areas = np.array([share[section.shape] * section.area for section in truss.sections])[truss.section_of]
    return np.stack([areas, areas], axis=1)
