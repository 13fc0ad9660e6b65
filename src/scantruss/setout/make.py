"""Set out a grid or a structure: supports, heights along sections, boundaries, steps of the assembly."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..grid.certificate import check_passed
from ..runtime.progress import Progress
from ..schedules.forces import grid_of_structure
from ..schedules.joints import check_grid
from ..schedules.places import building_places, rings
from ..schedules.records import Column, Schedule, column
from ..structure.build import scale_of
from ..structure.truss import Truss
from .assembly import AssemblyStep, assembly_steps
from .lines import SectionLine, Unrolled, section_lines, unroll
from .settings import SetoutSettings

if TYPE_CHECKING:
    from ..grid.grid import Grid


@dataclass(frozen=True, eq=False)
class SettingOut:
    """Everything that is set out; places in the building frame [mm]."""

    grid: Grid
    unit: str  #: of the scan
    places: np.ndarray  #: (V, 3)
    node_marks: tuple[str, ...]
    member_marks: tuple[str, ...]  #: in the order of the grid's members
    held: np.ndarray  #: (V, 6) bool, directions that supports hold
    section_lines: list[SectionLine]
    boundaries: list[Unrolled]
    steps: list[AssemblyStep]  #: members by their number in the grid
    settings: SetoutSettings

    @property
    def tables(self) -> list[Schedule]:
        """All tables in the order of the sheets of a workbook."""
        return [_supports(self), _heights(self), _boundary(self), _assembly(self), _order(self), _props(self)]


TABLES = ("supports", "heights", "boundary", "assembly", "order", "props")  #: names of their files


def set_out(
    what: Grid | Truss,
    settings: SetoutSettings | None = None,
    *,
    keep_failed: bool = False,
    progress: Progress | None = None,
) -> SettingOut:
    """Return the setting out of a grid or a structure.

    Parameters
    ----------
    what : Grid or Truss
        A grid, whose size and supports are in the settings, or a structure, which has its own.
    settings : SetoutSettings, optional
        Building frame, sections, paper.
    keep_failed : bool
        Accept a grid that failed its certificate.
    progress : callable, optional
        Called with what is done, and which share of it.

    Raises
    ------
    InputError
        There is no support, the unit is not known, or a section meets no member.
    CertificateError
        The grid failed its certificate.
    """
    settings = settings or SetoutSettings()
    if isinstance(what, Truss):
        truss = what
        grid, order = grid_of_structure(truss)
        scale = truss.scale
    else:
        check_passed(what, keep_failed)
        grid, scale = what, settings.scale
        truss = Truss.from_grid(
            what, scale=scale, unit=settings.unit, supports=settings.supports, joints=settings.joints, loads="self"
        )
        order = np.arange(len(grid.edges))
    check_grid(grid)
    unit = grid.unit or settings.unit
    places = building_places(grid, settings) * scale_of(unit, scale) * 1000.0
    held = (truss.supports != 0).any(axis=1)
    number = np.empty(len(order), np.int64)
    number[order] = np.arange(len(order))
    steps = [
        AssemblyStep(step.nodes, np.sort(number[step.members]), step.props, step.moves)
        for step in assembly_steps(truss, rings(grid, places[:, 2], held), progress)
    ]
    return SettingOut(
        grid=grid,
        unit=unit,
        places=places,
        node_marks=truss.node_marks,
        member_marks=tuple(truss.member_marks[k] for k in order.tolist()),
        held=truss.supports != 0,
        section_lines=section_lines(grid, places, settings),
        boundaries=unroll(grid, places),
        steps=steps,
        settings=settings,
    )


def _where(made: SettingOut, nodes: np.ndarray) -> list[Column]:
    """Return the columns of nodes and where they are, in the scan and in the building."""
    scan = made.grid.scan_nodes[nodes]
    return [
        column("node", "", [made.node_marks[k] for k in nodes.tolist()]),
        *(column(f"scan {axis}", made.unit, scan[:, k]) for k, axis in enumerate("xyz")),
        *(column(axis, "mm", made.places[nodes, k]) for k, axis in enumerate("xyz")),
    ]


def _supports(made: SettingOut) -> Schedule:
    nodes = np.flatnonzero(made.held.any(axis=1))
    moves, turns = (
        ["".join(axis for axis, is_held in zip("xyz", row, strict=True) if is_held) or None for row in part]
        for part in (made.held[nodes, :3].tolist(), made.held[nodes, 3:].tolist())
    )
    return Schedule("Supports", (*_where(made, nodes), column("held", "", moves), column("turns held", "", turns)))


def _heights(made: SettingOut) -> Schedule:
    lines = made.section_lines
    marks = [
        made.node_marks[node] if node >= 0 else made.member_marks[member]
        for line in lines
        for node, member in zip(line.nodes.tolist(), line.members.tolist(), strict=True)
    ]
    points = np.concatenate([np.zeros((0, 3)), *(line.points for line in lines)])
    return Schedule(
        "Heights",
        (
            column("section", "", [line.name for line in lines for _ in line.points]),
            column("at", "", marks),
            *(column(axis, "mm", points[:, k]) for k, axis in enumerate("xyz")),
        ),
    )


def _boundary(made: SettingOut) -> Schedule:
    found = made.boundaries
    nodes = np.concatenate([each.nodes for each in found]) if found else np.zeros(0, np.int64)

    def joined(name: str) -> np.ndarray:
        parts = [getattr(each, name)[: len(each.nodes)] for each in found]
        return np.concatenate(parts) if parts else np.zeros(0)

    return Schedule(
        "Boundary",
        (
            column("boundary", "", [number for number, each in enumerate(found, 1) for _ in each.nodes]),
            *_where(made, nodes),
            column("developed length", "mm", joined("along")),
            column("true length", "mm", joined("length")),
            column("turn", "degree", joined("turn")),
        ),
    )


def _assembly(made: SettingOut) -> Schedule:
    steps = made.steps
    return Schedule(
        "Assembly",
        (
            column("step", "", range(len(steps))),
            column("nodes", "", [len(step.nodes) for step in steps], summed=True),
            column("members", "", [len(step.members) for step in steps], summed=True),
            column("state", "", ["needs props" if len(step.props) else "stable" for step in steps]),
            column("props", "", [len(step.props) for step in steps]),
            column("moves", "mm", [1000.0 * step.moves for step in steps]),
        ),
    )


def _order(made: SettingOut) -> Schedule:
    number = [k for k, step in enumerate(made.steps) for _ in step.members]
    members = np.concatenate([step.members for step in made.steps])
    return Schedule(
        "Order",
        (
            column("step", "", number),
            column("member", "", [made.member_marks[k] for k in members.tolist()]),
            *(
                column(name, "", [made.node_marks[k] for k in ends.tolist()])
                for name, ends in zip(("start", "end"), made.grid.edges[members].T, strict=True)
            ),
        ),
    )


def _props(made: SettingOut) -> Schedule:
    """One row for each prop: the steps in which it is set and released; nothing where it stays."""
    placed: dict[int, int] = {}
    rows: list[tuple[int, int, int | None]] = []
    for number, step in enumerate(made.steps):
        now = set(step.props.tolist())
        rows += [(node, placed.pop(node), number) for node in sorted(placed.keys() - now)]
        placed |= dict.fromkeys(sorted(now - placed.keys()), number)
    rows += [(node, since, None) for node, since in placed.items()]
    rows.sort(key=lambda row: (row[1], row[0]))
    nodes = np.array([row[0] for row in rows], np.int64)
    return Schedule(
        "Props",
        (
            *_where(made, nodes),
            column("set at step", "", [row[1] for row in rows]),
            column("released at step", "", [row[2] for row in rows]),
        ),
    )
