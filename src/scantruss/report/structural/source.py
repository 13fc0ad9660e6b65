"""What a report is made from, and the cases that its parts choose."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...structure.options import StructureSettings
from ...structure.report import CaseFigures, StructureReport
from ...structure.results import CaseResult, Solution


@dataclass(frozen=True, eq=False)
class ReportSource:
    """What a report is made from."""

    name: str  #: of the grid's file
    command: str  #: that makes it again, "" where none does
    settings: StructureSettings
    solution: Solution
    report: StructureReport
    of_grid: Sequence[str] = ()  #: faults and warnings of the certificate of the grid


def cases_of_state(report: StructureReport, state: str) -> list[CaseFigures]:
    """Return the figures of a state, those of the load cases where it has none."""
    return [case for case in report.cases if case.state == state] or [
        case for case in report.cases if case.state == "case"
    ]


def most_pressed(solution: Solution) -> CaseResult:
    """Return the ULS combination (else the load case) with the greatest compression."""
    every = list(solution.all_results())
    return min((each for each in every if each.state == "ULS"), key=_compression, default=min(every, key=_compression))


def _compression(result: CaseResult) -> float:
    return float(result.axial.min())


def axial_force(result: CaseResult) -> np.ndarray:
    """Return the (M,) axial force of the greatest size in each member [N]."""
    low, high = result.axial.T
    return np.where(-low > high, low, high)


def greatest_stresses(solution: Solution) -> tuple[np.ndarray, list[str]]:
    """Return the (M,) greatest sum of axial and bending stress of each member [Pa], and the names of what causes it."""
    judged = solution.judged_results()
    every = np.stack([np.abs(result.stresses).sum(axis=1) for result in judged])
    return every.max(axis=0), [judged[k].name for k in every.argmax(axis=0)]


def greatest_stress(solution: Solution) -> tuple[float, int, str]:
    """Return the greatest stress [Pa], its member and what causes it."""
    stresses, causes = greatest_stresses(solution)
    member = int(stresses.argmax())
    return float(stresses[member]), member, causes[member]
