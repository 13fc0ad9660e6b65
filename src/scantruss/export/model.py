"""Model: the record that the files of all formats are made of, from a grid or from a structure."""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING
from uuid import NAMESPACE_URL, UUID, uuid5

import numpy as np

from ..errors import FormatError
from ..grid.grid import Grid
from ..grid.groups import member_groups
from ..grid.line_sets import FIXED_LINE, LineSet
from ..grid.marks import member_marks, node_marks, numbered, panel_marks
from ..grid.panels import loops_of
from ..settings import UNITS

if TYPE_CHECKING:
    from ..scan.cloud import PointCloud
    from ..structure.report import StructureReport
    from ..structure.results import Solution
    from ..structure.truss import LoadCase, Truss


STATIONS_WRITTEN = (0, 4, 8)  #: of those along a member, in files that hold forces: start, middle, end
SYSTEM_UNITS = ("m", "foot")  #: of plane reference systems
SYSTEM_CODE = re.compile(r"EPSG:\d{4,6}")


@dataclass(frozen=True, eq=False)
class Model:
    """A grid or a structure as other programs need it; all lengths are in `unit`, up is z."""

    local: np.ndarray  #: (V, 3) float64, the nodes relative to `origin`
    origin: np.ndarray  #: (3,) float64, in the frame of the scan
    members: np.ndarray  #: (M, 2) int64, start and end
    triangles: np.ndarray  #: (T, 3) int64, anticlockwise seen from outside
    panels: np.ndarray  #: (P, K) int64 nodes of the panels, filled up with -1: the triangles, or quads or hexagons
    unit: str  #: mm, cm, m, inch, foot, or "" where it is not known; m of a structure
    node_marks: tuple[str, ...]
    member_marks: tuple[str, ...]
    panel_marks: tuple[str, ...]
    groups: tuple[str, ...]  #: names of the groups of members, sorted
    group_of: np.ndarray  #: (M,) int64, which group
    node_sets: dict[str, np.ndarray] = field(default_factory=dict)  #: such as fixed, boundary, line:NAME: int64
    grid: Grid | None = None  #: None of a structure with members on no panel
    truss: Truss | None = None  #: sections, material, supports and loads, of a structure
    solution: Solution | None = None  #: of the structure, where it is solved
    report: StructureReport | None = None  #: of the solution
    utilization: np.ndarray | None = None  #: (M,) of the members, where they are checked
    cloud: PointCloud | None = None  #: the scan, which some formats draw
    notes: tuple[str, ...] = ()  #: what a user should know of a file that others made
    system: str = ""  #: reference system of the coordinates, such as EPSG:25833; "" where it is not known

    @cached_property
    def nodes(self) -> np.ndarray:
        """(V, 3) float64 the nodes in the frame of the scan."""
        return self.local + self.origin

    @cached_property
    def lengths(self) -> np.ndarray:
        """(M,) system lengths."""
        return np.linalg.norm(self.local[self.members[:, 1]] - self.local[self.members[:, 0]], axis=1)

    @cached_property
    def panel_loops(self) -> list[list[int]]:
        """The nodes of each panel."""
        return loops_of(self.panels)

    @property
    def supported(self) -> np.ndarray:
        """(K,) ids of the nodes that a support holds; the fixed nodes of a grid."""
        if self.truss is not None:
            return np.flatnonzero(self.truss.supports.any(axis=1))
        return self.node_sets.get("fixed", np.zeros(0, np.int64))

    @cached_property
    def _namespace(self) -> UUID:
        return uuid5(NAMESPACE_URL, f"scantruss {self.unit} {self.origin.tolist()}")

    def guid(self, what: str, mark: str = "") -> UUID:
        """Return the identifier of a part, the same for the same mark of the same kind at the same origin."""
        return uuid5(self._namespace, f"{what} {mark}")

    @property
    def metres(self) -> float:
        """Metres of one `unit`, where it is known; else 1."""
        return UNITS.get(self.unit) or 1.0

    def as_grid(self, what: str) -> Grid:
        """Return the grid.

        Raises
        ------
        FormatError
            Some members are sides of no panel, which the format `what` cannot hold.
        """
        if self.grid is None or type(self.grid) is not Grid:  # else it is a `Framework`, which usual grids do not load
            way = (
                "use another format"
                if self.truss
                else "make a structure of it (scantruss structure), or use another format"
            )
            raise FormatError(f"{what} holds panels and their sides, and some members here are on no panel; {way}")
        return self.grid


def members_of(model: Model) -> Grid:
    """Return the grid of a model with all its members, those on no panel too."""
    if model.grid is not None:
        return model.grid
    if model.truss is None:
        raise TypeError("a model is of a grid or of a structure")
    from ..structure.layered import framework_of

    return framework_of(model.truss)


def model_of_grid(grid: Grid, cloud: PointCloud | None = None) -> Model:
    """Return the model of a grid, in its own unit."""
    names, group_of = np.unique(np.array(member_groups(grid), dtype=str), return_inverse=True)
    lines = {f"line:{line.name}": line.nodes for line in grid.line_sets}
    return Model(
        local=np.ascontiguousarray(grid.nodes, np.float64).reshape(-1, 3),
        origin=np.asarray(grid.origin, np.float64),
        members=np.asarray(grid.edges, np.int64),
        triangles=np.asarray(grid.triangles, np.int64),
        panels=np.asarray(grid.panel_table, np.int64),
        unit=grid.unit,
        node_marks=tuple(node_marks(grid)),
        member_marks=tuple(member_marks(grid)),
        panel_marks=tuple(panel_marks(grid)),
        groups=tuple(names.tolist()),
        group_of=group_of.astype(np.int64),
        node_sets={"fixed": np.flatnonzero(grid.fixed), **lines},
        grid=grid,
        cloud=cloud,
        system=grid.system,
    )


def model_of_truss(
    truss: Truss,
    solution: Solution | None = None,
    report: StructureReport | None = None,
    utilization: np.ndarray | None = None,
) -> Model:
    """Return the model of a structure, in metres."""
    from ..structure.groups import member_groups_of

    grid = _grid_of(truss)
    model = model_of_grid(grid) if np.array_equal(grid.edges, np.sort(truss.members, axis=1)) else None
    groups, group_of = (model.groups, model.group_of) if model else member_groups_of(truss)
    return Model(
        local=truss.nodes,
        origin=truss.origin,
        members=truss.members,
        triangles=truss.triangles,
        panels=truss.panel_table,
        unit="m",
        node_marks=truss.node_marks,
        member_marks=truss.member_marks,
        panel_marks=tuple(numbered("P", len(truss.panel_table), 4)),
        groups=groups,
        group_of=group_of,
        node_sets=truss.node_sets,
        grid=grid if model else None,
        truss=truss,
        solution=solution,
        report=report,
        utilization=report.utilization if report is not None else utilization,
        system=truss.system,
    )


def with_unit(model: Model, unit: str) -> Model:
    """Return a model that has a unit, where it had none.

    Raises
    ------
    FormatError
        It has another one, or there is no such unit.
    """
    if not UNITS.get(unit):
        raise FormatError(f"unit must be one of {' '.join(name for name in UNITS if name)}, got {unit!r}")
    if model.unit not in ("", unit):
        raise FormatError(f"the unit is {model.unit}, not {unit}; leave --unit out")
    return replace(model, unit=unit, grid=None if model.grid is None else model.grid.replace(unit=unit))


def with_system(model: Model, system: str) -> Model:
    """Return a model in a reference system, where it had none.

    Raises
    ------
    FormatError
        It has another one, or lengths that no such system has; or this is no code of one.
    """
    if not SYSTEM_CODE.fullmatch(system):
        raise FormatError(f"the reference system must be the code of a plane one such as EPSG:25833, got {system!r}")
    if model.system not in ("", system):
        raise FormatError(f"the reference system is {model.system}, not {system}; leave --system out")
    if model.unit not in SYSTEM_UNITS:
        raise FormatError(
            f"a reference system is in metres or feet, and the coordinates are in {model.unit or 'a unit that is not known'}"
        )
    if model.truss is not None and model.truss.scale != 1.0:
        raise FormatError(
            f"the structure is {model.truss.scale:g} times its scan, so its coordinates are in no reference system"
        )
    grid = None if model.grid is None else model.grid.replace(system=system)
    truss = None if model.truss is None else model.truss.replace(system=system)
    return replace(model, system=system, grid=grid, truss=truss)


def line_loads(truss: Truss, case: LoadCase, *, weight: bool = True) -> np.ndarray:
    """Return the (M, 3) loads along the members in global axes, with or without their weight [N/m]."""
    from ..structure.truss import GRAVITY

    line = np.zeros((len(truss.members), 3)) if case.line is None else case.line.copy()
    if weight and case.self_weight:
        line[:, 2] -= truss.of_section("area") * truss.material.density * GRAVITY * case.self_weight
    return line


def nodal_loads(truss: Truss, case: LoadCase) -> np.ndarray:
    """Return the (V, 3 or 6) loads on nodes [N, Nm], with forces E A strain at the ends for strains without force.

    Of a pinned structure these are all loads, those along members at their ends.
    """
    nodal = np.zeros((len(truss.nodes), 3 if truss.pinned else 6))
    if case.nodal is not None:
        nodal += case.nodal[:, : nodal.shape[1]]
    strain = np.zeros(len(truss.members))
    if case.temperature is not None:
        strain += truss.material.alpha * case.temperature
    if case.strain is not None:
        strain += case.strain
    push = (truss.material.young * truss.of_section("area") * strain)[:, None] * truss.axes[:, 0]
    half = line_loads(truss, case) * truss.lengths[:, None] / 2 if truss.pinned else np.zeros_like(push)
    np.add.at(nodal[:, :3], truss.members[:, 0], half - push)
    np.add.at(nodal[:, :3], truss.members[:, 1], half + push)
    return nodal


def temperatures(truss: Truss, case: LoadCase, what: str) -> np.ndarray:
    """Return the (M,) changes of temperature, with those that lengthen members as strains without force do [K].

    Raises
    ------
    FormatError
        There are strains, which the format `what` holds in this way only, and the material does not expand.
    """
    change = np.zeros(len(truss.members)) if case.temperature is None else case.temperature
    if case.strain is None:
        return change
    if truss.material.alpha == 0:
        raise FormatError(f"{what} holds strains as changes of temperature, and {truss.material.name} does not expand")
    return change + case.strain / truss.material.alpha


def _grid_of(truss: Truss) -> Grid:
    """Return the grid of the triangles of a structure, in metres."""
    lines = [
        LineSet(name.removeprefix("line:"), FIXED_LINE, nodes)
        for name, nodes in truss.node_sets.items()
        if name.startswith("line:")
    ]
    pairs = [
        np.stack([line.nodes, np.roll(line.nodes, -1)], axis=1)[: len(line.nodes) - (len(line.nodes) < 4)]
        for line in lines
    ]
    fixed = np.zeros(len(truss.nodes), bool)
    fixed[truss.node_sets.get("fixed", np.zeros(0, np.int64))] = True
    return Grid(
        nodes=truss.nodes,
        triangles=truss.triangles,
        panels=truss.panels,
        fixed=fixed,
        origin=truss.origin,
        unit="m",
        system=truss.system,
        lines=np.concatenate([np.zeros((0, 2), np.int64), *pairs]),
        line_sets=tuple(lines),
    )
