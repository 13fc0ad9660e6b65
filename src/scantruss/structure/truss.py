"""Truss: the record of a structure in metres, newtons and kilograms, and how a grid becomes one."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from ..grid.marks import member_marks, node_marks
from ..settings import UNITS
from .catalogue import Material, Section, find_material, find_section

if TYPE_CHECKING:
    from ..grid.grid import Grid

GRAVITY = 9.80665  #: standard acceleration of free fall, ISO 80000-3 [m/s2]
USUAL_MEMBER = (0.1, 30.0)  #: members outside of this length are said to be odd [m]


@dataclass(frozen=True, eq=False)
class LoadCase:
    """Loads that act together; what is None is not there."""

    name: str
    action: str = "variable"  #: permanent, snow, wind, temperature or variable: its factors in the combinations
    self_weight: float = 0.0  #: weight of the members times this; 1.15 allows 15 % for the nodes
    nodal: np.ndarray | None = None  #: (V, 6) forces and moments [N, Nm]
    line: np.ndarray | None = None  #: (M, 3) forces along the members, in global axes [N/m]
    temperature: np.ndarray | None = None  #: (M,) change of temperature [K]
    strain: np.ndarray | None = None  #: (M,) strain without force, positive where a member is made too long
    settlement: np.ndarray | None = None  #: (V, 3) displacement imposed on supports, NaN where none is [m]


@dataclass(frozen=True)
class Combination:
    """Load cases with factors, as EN 1990 combines them."""

    name: str
    state: str  #: ULS or SLS
    factors: tuple[tuple[str, float], ...]  #: name of a case, its factor


@dataclass(frozen=True, eq=False)
class Truss:
    """A structure of straight members between nodes [m, N, kg]; z is up."""

    nodes: np.ndarray  #: (V, 3) [m], relative to `origin`
    members: np.ndarray  #: (M, 2) int64, start and end
    triangles: np.ndarray  #: (T, 3) int64, which carry the loads on areas, anticlockwise seen from outside
    node_normals: np.ndarray  #: (V, 3) unit normals of the surface
    member_normals: np.ndarray  #: (M, 3) unit normals at the members; the local z axis is the nearest to them
    sections: tuple[Section, ...]
    section_of: np.ndarray  #: (M,) int64, which section
    material: Material
    supports: np.ndarray  #: (V, 6) stiffness of the supports; inf is held, 0 is free [N/m, Nm/rad]
    end_stiffness: np.ndarray  #: (M, 2, 2) rotational springs at start and end, about y and z; inf is rigid [Nm/rad]
    pinned: bool = False  #: members carry axial forces only, and nodes do not turn
    cases: tuple[LoadCase, ...] = ()
    combinations: tuple[Combination, ...] = ()
    node_sets: dict[str, np.ndarray] = field(default_factory=dict)  #: fixed nodes, boundary loops, lines: int64
    origin: np.ndarray = field(default_factory=lambda: np.zeros(3))  #: (3,) [m]
    node_marks: tuple[str, ...] = ()
    member_marks: tuple[str, ...] = ()
    scale: float = 1.0  #: of the structure to the grid

    def __repr__(self) -> str:
        """Say what it is made of."""
        size = f"{len(self.nodes):,} nodes, {len(self.members):,} members"
        names = ", ".join(section.name for section in self.sections)
        return f"Truss({size} of {names}, {self.material.name}, {self.mass:,.0f} kg, {len(self.cases)} load cases)"

    @cached_property
    def lengths(self) -> np.ndarray:
        """(M,) system lengths [m]."""
        return np.linalg.norm(self.nodes[self.members[:, 1]] - self.nodes[self.members[:, 0]], axis=1)

    @cached_property
    def axes(self) -> np.ndarray:
        """(M, 3, 3) local axes as rows: x along the member, z nearest to the normal, y = z x x."""
        x = (self.nodes[self.members[:, 1]] - self.nodes[self.members[:, 0]]) / self.lengths[:, None]
        z = self.member_normals - (self.member_normals * x).sum(axis=1, keepdims=True) * x
        poor = np.linalg.norm(z, axis=1) < 1e-6  # no normal, or along the member: take the axis that differs most
        other = np.eye(3)[np.abs(x).argmin(axis=1)]
        z[poor] = (other - (other * x).sum(axis=1, keepdims=True) * x)[poor]
        z /= np.linalg.norm(z, axis=1, keepdims=True)
        return np.stack([x, np.cross(z, x), z], axis=1)

    def of_section(self, name: str) -> np.ndarray:
        """(M,) a property of the section of each member, such as `area`."""
        return np.array([getattr(section, name) for section in self.sections], float)[self.section_of]

    @property
    def member_mass(self) -> np.ndarray:
        """(M,) mass of each member over its system length [kg]."""
        return self.lengths * self.of_section("area") * self.material.density

    @property
    def mass(self) -> float:
        """Mass of all members, without an allowance for the nodes [kg]."""
        return float(self.member_mass.sum())

    @cached_property
    def triangle_areas(self) -> np.ndarray:
        """(T, 3) area vectors of the triangles, along their outer normals [m2]."""
        return area_vectors(self.nodes, self.triangles)

    def replace(self, **changes: Any) -> Truss:
        """Return a copy with some fields changed."""
        return replace(self, **changes)

    @classmethod
    def from_grid(
        cls,
        grid: Grid,
        *,
        scale: float = 1.0,
        unit: str = "",
        section: str | Section = "CHS114.3x5",
        material: str | Material = "S355",
        supports: str | np.ndarray = "boundary",
        support_type: str = "pinned",
        loads: str | Sequence[Any] = "self",
        joints: str | float = "rigid",
        node_allowance: float = 0.0,
        combinations: Sequence[Combination] | None = None,
    ) -> Truss:
        """Return the structure of a grid; the grid's unit is turned into metres here and nowhere else.

        Parameters
        ----------
        grid : Grid
            Its edges become members, its triangles carry the loads on areas.
        scale : float
            Of the structure to the grid: 100 makes metres of centimetres.
        unit : str
            Unit of the grid, where the grid does not know it.
        section, material : str, Section, Material
            Name in the catalogue, `FILE.csv` or `FILE.csv:NAME`, or the record itself.
        supports : str or (K,) array of int
            corners, boundary, lowest:H [m], fixed, line:NAME, several joined by "+"; or node ids.
        support_type : str
            pinned, fixed, roller (free in plan), or springs:K, with K such as 5MN/m.
        loads : str or sequence of (str, LoadCase or dict)
            Such as "self,cladding:0.5kN/m2,snow:1kN/m2"; see `structure.loads`.
        joints : str or float
            rigid, pinned (axial forces only), or the stiffness of rotational springs at the member ends [Nm/rad].
        node_allowance : float
            Share of the members' weight that the nodes add to it.
        combinations : sequence of Combination, optional
            In place of those of EN 1990, equation 6.10.

        Raises
        ------
        InputError
            The unit is not known, a name is not known, there is no support, or a load cannot be understood.
        """
        from .loads import cases_of, usual_combinations
        from .supports import node_sets, support_nodes, support_stiffness

        if grid.unit and unit and unit != grid.unit:
            raise InputError(f"the grid is in {grid.unit}, not in {unit}; leave --unit out")
        metres = scale_of(grid.unit or unit, scale)
        pinned, spring = _joints(joints)
        nodes = np.ascontiguousarray(grid.nodes, float) * metres
        members, triangles = np.asarray(grid.edges, np.int64), np.asarray(grid.triangles, np.int64)
        if len(members) == 0:
            raise InputError("the grid has no members; a structure needs some")
        lengths = np.linalg.norm(nodes[members[:, 0]] - nodes[members[:, 1]], axis=1)
        if lengths.min() <= 0:
            a, b = members[lengths.argmin()]
            raise InputError(f"member {member_marks(grid)[lengths.argmin()]} between nodes {a} and {b} has no length")
        areas = area_vectors(nodes, triangles)
        if areas[:, 2].sum() < -1e-9 * np.abs(areas).sum():  # a shell is loaded from above
            triangles, areas = triangles[:, ::-1].copy(), -areas
        node_normals = np.zeros_like(nodes)
        for corner in triangles.T:
            np.add.at(node_normals, corner, areas)
        node_normals = _unit(node_normals)
        truss = cls(
            nodes=nodes,
            members=members,
            triangles=triangles,
            node_normals=node_normals,
            member_normals=_unit(_at_members(grid, _unit(areas))),
            sections=(find_section(section) if isinstance(section, str) else section,),
            section_of=np.zeros(len(members), np.int64),
            material=find_material(material) if isinstance(material, str) else material,
            supports=np.zeros((len(nodes), 6)),
            end_stiffness=np.full((len(members), 2, 2), spring),
            pinned=pinned,
            node_sets=node_sets(grid),
            origin=np.asarray(grid.origin, float) * metres,
            node_marks=tuple(node_marks(grid)),
            member_marks=tuple(member_marks(grid)),
            scale=float(scale),
        )
        held = support_nodes(truss, supports)
        truss = truss.replace(supports=support_stiffness(len(nodes), held, support_type))
        cases = cases_of(truss, loads, node_allowance)
        return truss.replace(
            cases=cases, combinations=usual_combinations(cases) if combinations is None else tuple(combinations)
        )

    @property
    def warnings(self) -> list[str]:
        """What is odd about the size, in words."""
        low, high = USUAL_MEMBER
        said = []
        if (middle := float(np.median(self.lengths))) < low or middle > high:
            said.append(
                f"members of {_readable(middle)} (median) at scale {self.scale:g}: usual are {low:g} to {high:g} m;"
                " check --scale and the unit of the grid"
            )
        return said


def area_vectors(nodes: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return the (T, 3) area vectors of triangles, along their normals."""
    a, b, c = (nodes[corner] for corner in triangles.T)
    return np.cross(b - a, c - a) / 2


def scale_of(unit: str, scale: float) -> float:
    """Return the metres of the structure for one unit of the grid.

    Raises
    ------
    InputError
        The unit is not known, or the scale is no positive number.
    """
    if not (isinstance(scale, int | float) and 0 < scale < math.inf):
        raise InputError(f"scale must be a positive number, got {scale!r}")
    metres = UNITS.get(unit)
    if not metres:
        known = " ".join(name for name in UNITS if name)
        got = f"no unit {unit!r}" if unit else "the unit of the grid is not known"
        raise InputError(f"{got}, and a structure needs lengths in metres; give --unit, one of {known}")
    return metres * scale


def _joints(joints: str | float) -> tuple[bool, float]:
    """Return whether members carry axial forces only, and the stiffness of the springs at their ends."""
    if joints == "pinned":
        return True, 0.0
    if joints == "rigid":
        return False, math.inf
    try:
        stiffness = float(joints)
    except (TypeError, ValueError):
        stiffness = -1.0
    if not stiffness > 0:
        raise InputError(f"joints must be rigid, pinned or a rotational stiffness in Nm/rad, got {joints!r}")
    return False, stiffness


def _at_members(grid: Grid, normals: np.ndarray) -> np.ndarray:
    """Return the (E, 3) sums of the normals of the triangles at each member."""
    total = np.zeros((len(grid.edges), 3))
    np.add.at(total, grid.half_edge_edges, np.tile(normals, (3, 1)))
    return total


def _unit(vectors: np.ndarray) -> np.ndarray:
    """Return vectors of length 1; those without length stay as they are."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0)


def _readable(length: float) -> str:
    """Return a length as people say it."""
    return f"{length * 1e3:.3g} mm" if length < 1 else f"{length:.4g} m"
