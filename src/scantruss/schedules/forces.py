"""What a structure says of its members and nodes, in the order of the grid that it is made of."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..errors import InputError
from ..grid.grid import Grid
from ..structure.layered import framework_of, grid_of_triangles
from ..structure.report import report_structure
from ..structure.results import MOMENT_Y, MOMENT_Z
from ..structure.statics import solve

if TYPE_CHECKING:
    from ..structure.truss import Truss

Checked = tuple[np.ndarray, tuple[str, ...]]  # utilization of each member, and its clause and load


@dataclass(frozen=True, eq=False)
class Forces:
    """Greatest forces of the ULS combinations, or of all load cases where there are none; arrays by member of the grid [N, Nm]."""

    truss: Truss
    order: np.ndarray  #: (E,) the structure's member of each member of the grid
    low: np.ndarray  #: (E,) smallest axial force, compression negative
    low_case: tuple[str, ...]
    high: np.ndarray  #: (E,) greatest axial force
    high_case: tuple[str, ...]
    moment: np.ndarray  #: (E,) greatest bending moment
    reaction: np.ndarray  #: (V,) greatest resultant of each support; NaN elsewhere
    utilization: np.ndarray | None  #: (E,); None where the checks do not apply
    governing: tuple[str, ...]  #: (E,) clause and load of that

    @property
    def sections(self) -> list[str]:
        """(E,) the section of each member."""
        names = [section.name for section in self.truss.sections]
        return [names[k] for k in self.truss.section_of[self.order].tolist()]

    @property
    def width(self) -> np.ndarray:
        """(E,) diameter around the section of each member [m]."""
        around = [s.width if s.shape == "CHS" else float(np.hypot(s.width, s.depth)) for s in self.truss.sections]
        return np.array(around)[self.truss.section_of[self.order]]

    @property
    def slenderness(self) -> np.ndarray:
        """(E,) length over the smaller radius of gyration."""
        return (self.truss.lengths / self.truss.of_section("radius"))[self.order]


def grid_of_structure(truss: Truss) -> tuple[Grid, np.ndarray]:
    """Return the grid of a structure [m of the scan, not scaled] and the structure's member for each of its own.

    Raises
    ------
    InputError
        It has layers, and does not say which.
    """
    grid = grid_of_triangles(truss, truss.scale)
    count = len(truss.nodes)
    theirs, mine = np.sort(truss.members, axis=1) @ [count, 1], grid.edges @ [count, 1]
    order = np.argsort(theirs, kind="stable")
    if truss.layers is None and np.array_equal(theirs[order], mine):
        return grid, order
    if truss.layers is None and truss.member_sets:
        raise InputError("this structure of two layers is of an earlier version; make it again")
    return framework_of(truss, truss.scale), np.arange(len(truss.members))


def find_forces(truss: Truss, order: np.ndarray, checked: Checked | None = None) -> Forces:
    """Solve a structure and return its greatest forces; `checked` is what a file says of the checks, else they are made by default.

    Raises
    ------
    InputError
        There is no load case, no support, or the structure is a mechanism.
    """
    if not truss.cases:
        raise InputError("the structure has no load case, so no forces are known; make it with --loads")
    solution = solve(truss)
    judged = [each for each in truss.combinations if each.state == "ULS"]
    results = (solution[each.name] for each in judged) if judged else iter(solution.cases)
    names: list[str] = []
    count = len(truss.members)
    low, high, moment = np.full(count, np.inf), np.full(count, -np.inf), np.zeros(count)
    of_low, of_high, reaction = np.zeros(count, int), np.zeros(count, int), np.zeros(len(truss.nodes))
    for number, result in enumerate(results):
        names.append(result.name)
        less, more = result.axial[:, 0] < low, result.axial[:, 1] > high
        low[less], of_low[less] = result.axial[less, 0], number
        high[more], of_high[more] = result.axial[more, 1], number
        moment = np.maximum(moment, np.hypot(result.along[:, :, MOMENT_Y], result.along[:, :, MOMENT_Z]).max(axis=1))
        reaction = np.maximum(reaction, np.linalg.norm(result.reactions[:, :3], axis=1))
    if checked is None:
        report = report_structure(solution)
        utilization, governing = report.utilization, report.governing
    else:
        utilization, governing = checked
    return Forces(
        truss=truss,
        order=order,
        low=low[order],
        low_case=tuple(names[k] for k in of_low[order].tolist()),
        high=high[order],
        high_case=tuple(names[k] for k in of_high[order].tolist()),
        moment=moment[order],
        reaction=np.where(truss.supports.any(axis=1), reaction, np.nan),
        utilization=None if utilization is None else utilization[order],
        governing=tuple(governing[k] for k in order.tolist()) if utilization is not None else (),
    )
