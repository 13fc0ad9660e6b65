"""Truss: the record of a structure in metres, newtons and kilograms, and how a grid becomes one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from ..layouts.double_layer import BEND_WAYS, DEPTH_WAYS, Layers
from ..layouts.layer_parts import SECOND_LAYERS
from .catalogue import Material, Section

if TYPE_CHECKING:
    from ..grid.alike import Alike
    from ..grid.grid import Grid

GRAVITY = 9.80665  #: standard acceleration of free fall, ISO 80000-3 [m/s2]
HELD_LAYERS = ("outer", "inner")  #: of a double layer, on which the supports are
USUAL_MEMBER = (0.1, 30.0)  #: members outside of this length are said to be odd [m]


@dataclass(frozen=True, eq=False)
class LoadCase:
    """Loads that act together; None for those that are absent."""

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
    panels: np.ndarray | None = None  #: (P, K) int64 nodes of quads or hexagons, filled up with -1; None: the triangles
    pinned: bool = False  #: members carry axial forces only, and nodes do not turn
    cases: tuple[LoadCase, ...] = ()
    combinations: tuple[Combination, ...] = ()
    node_sets: dict[str, np.ndarray] = field(default_factory=dict)  #: fixed nodes, boundary loops, lines: int64
    member_sets: dict[str, np.ndarray] = field(default_factory=dict)  #: top, bottom and web of a double layer: int64
    origin: np.ndarray = field(default_factory=lambda: np.zeros(3))  #: (3,) [m]
    system: str = ""  #: reference system in metres that the coordinates are in; "" where it is not known
    node_marks: tuple[str, ...] = ()
    member_marks: tuple[str, ...] = ()
    scale: float = 1.0  #: of the structure to the grid
    layers: Layers | None = None  #: of a double layer or more
    alike: Alike | None = None  #: which parts of the grid were made alike, its mean member in metres

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
        return local_axes(x, self.member_normals)

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

    @property
    def panel_table(self) -> np.ndarray:
        """(P, K) the nodes of each panel, filled up with -1."""
        return self.triangles if self.panels is None else self.panels

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
        supports: str | np.ndarray,
        support_type: str = "pinned",
        loads: str | Sequence[Any] = "self",
        joints: str | float = "",
        node_allowance: float = 0.0,
        combinations: Sequence[Combination] | None = None,
        double_layer: str | float | Sequence[float] = "",
        second_layer: str = SECOND_LAYERS[0],
        depth_along: str = DEPTH_WAYS[0],
        held_layer: str = HELD_LAYERS[0],
        layer_edges: str = "",
        sharp_bends: str = BEND_WAYS[0],
    ) -> Truss:
        """Return the structure of a grid; the grid's unit is converted to metres here and nowhere else.

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
            rigid, pinned (axial forces only), or the stiffness of rotational springs at the member ends [Nm/rad]; by default
            rigid, of a double layer pinned.
        node_allowance : float
            Share of the members' weight that the nodes add to it.
        combinations : sequence of Combination, optional
            In place of those of EN 1990, equation 6.10.
        double_layer : str, float or sequence of float
            Depth of a double layer such as 1.5m, or in metres of the structure; "" for a single layer. The grid is the outer layer.
            Several, as in "1.2,0.8", make more layers, each so far below the one before.
        second_layer : str
            dual (nodes under the triangles) or same (nodes under the nodes); see `layouts.double_layer`.
        depth_along : str
            normal or vertical.
        held_layer : str
            outer: the supports are on the grid; inner: on the nodes of the last layer that are nearest to them.
        layer_edges : str
            tapered or closed; "" is tapered of the dual, else closed.
        sharp_bends : str
            refuse a depth where the grid bends too sharply, or reduce it there.

        Raises
        ------
        InputError
            The unit is not known, a name is not known, there is no support, or a load cannot be understood.
        """
        build = import_module("scantruss.structure.build")  # it needs this record
        truss: Truss = build.truss_of_grid(
            grid,
            scale=scale,
            unit=unit,
            section=section,
            material=material,
            supports=supports,
            support_type=support_type,
            loads=loads,
            joints=joints,
            node_allowance=node_allowance,
            combinations=combinations,
            double_layer=double_layer,
            second_layer=second_layer,
            depth_along=depth_along,
            held_layer=held_layer,
            layer_edges=layer_edges,
            sharp_bends=sharp_bends,
        )
        return truss

    @property
    def warnings(self) -> list[str]:
        """What is odd about the size, in words."""
        low, high = USUAL_MEMBER
        warnings = []
        if (middle := float(np.median(self.lengths))) < low or middle > high:
            warnings.append(
                f"members of {_readable(middle)} (median) at scale {self.scale:g}: usual are {low:g} to {high:g} m;"
                " check --scale and the unit of the grid"
            )
        return warnings


def local_axes(x: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Return the (M, 3, 3) local axes of members along unit vectors as rows: x, y = z x x, z nearest to the normal."""
    z = normals - (normals * x).sum(axis=1, keepdims=True) * x
    poor = np.linalg.norm(z, axis=1) < 1e-6  # no normal, or along the member: take the axis that differs most
    other = np.eye(3)[np.abs(x).argmin(axis=1)]
    z[poor] = (other - (other * x).sum(axis=1, keepdims=True) * x)[poor]
    z /= np.linalg.norm(z, axis=1, keepdims=True)
    return np.stack([x, np.cross(z, x), z], axis=1)


def area_vectors(nodes: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return the (T, 3) area vectors of triangles, along their normals."""
    a, b, c = (nodes[corner] for corner in triangles.T)
    return np.cross(b - a, c - a) / 2


def _readable(length: float) -> str:
    """Return a length as people say it."""
    return f"{length * 1e3:.3g} mm" if length < 1 else f"{length:.4g} m"
