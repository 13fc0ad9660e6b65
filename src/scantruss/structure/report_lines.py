"""The report of a structure in words: the table on the terminal and the lines below it."""

from __future__ import annotations

from ..errors import words_of_number
from .checks import use_words
from .path_report import path_words
from .report import CaseFigures, StructureReport
from .truss import Truss

STRUCTURE_HEAD = (
    "load case", "applied z [kN]", "reaction z [kN]", "moves [mm]", "force min [kN]", "force max [kN]", "utilization",
)  # fmt: skip


def chosen_cases(report: StructureReport, most: int = 12) -> list[CaseFigures]:
    """Return each load case, then the combinations that use the members or move the nodes most."""
    cases = [case for case in report.cases if case.state == "case"]
    others = [case for case in report.cases if case.state != "case"]
    others.sort(key=lambda case: (case.state != "ULS", -(case.utilization_max or 0.0), -case.displacement_max))
    chosen = [case for case in others if case.state == "ULS"][: most // 2]
    chosen += sorted((case for case in others if case.state == "SLS"), key=lambda case: -case.displacement_max)[
        : max(most // 12, 1)
    ]
    return cases + chosen


def structure_lines(report: StructureReport) -> list[tuple[str, ...]]:
    """Return rows of a table of `chosen_cases`; see `STRUCTURE_HEAD`."""
    return [
        (
            case.name,
            *(_kilonewtons(force, case) for force in (case.applied[2], case.reactions[2])),
            words_of_number(1e3 * case.displacement_max, 3),
            words_of_number(case.force_min / 1e3, 4),
            words_of_number(case.force_max / 1e3, 4),
            use_words(case.utilization_max),
        )
        for case in chosen_cases(report)
    ]


def _kilonewtons(force: float, case: CaseFigures) -> str:
    """Return a force of a case for a table; 0 where it is rounding beside the forces in the members."""
    rounding = 1e-9 * max(abs(case.force_min), abs(case.force_max))
    return words_of_number(force / 1e3, 4) if abs(force) > rounding else "0"


def unlisted_lines(report: StructureReport) -> list[str]:
    """Return a line on how many combinations `structure_lines` leaves out; nothing where it has all."""
    more = len(report.cases) - len(structure_lines(report))
    which = (
        "combinations, which use the members or move the nodes"
        if more > 1
        else "combination, which uses the members or moves the nodes"
    )
    return [f"and {more:,} more {which} less"] * (more > 0)


def half_lines(report: StructureReport) -> list[str]:
    """Return a line on the worst half of snow, where there are several."""
    part_loaded = [case for case in report.cases if case.state == "case" and case.name.startswith("half-snow ")]
    if len(part_loaded) < 2:
        return []
    moved = max(part_loaded, key=lambda case: case.displacement_max)
    used = max(part_loaded, key=lambda case: case.utilization_max or 0.0)
    which = "and" if used is moved else f"and {used.name}"
    most = f", {which} uses the members most, {use_words(used.utilization_max)}" if used.utilization_max else ""
    return [
        f"of {len(part_loaded)} cases with half the snow, {moved.name} moves the nodes most, {1e3 * moved.displacement_max:.3g} mm{most}"
    ]


def node_lines(truss: Truss) -> list[str]:
    """Return a line on what the nodes weigh in the loads; nothing where the members weigh nothing either."""
    allowed = max((case.self_weight for case in truss.cases), default=0.0) - 1.0
    if allowed < 0.0:
        return []
    if allowed:
        return [f"the weight of the nodes counts with {100 * allowed:.3g} % of that of the members"]
    return [
        "the weight of the nodes, as of balls, is not counted; --node-allowance 0.15 adds 15 % of that of the members"
    ]


def mode_lines(report: StructureReport) -> list[str]:
    """Return lines on buckling and vibration, where they were asked for."""
    lines = []
    if report.buckling is not None:
        factors = ", ".join(f"{value:.4g}" for value in report.buckling.values)
        lines.append(
            f"buckling factors of {report.buckling.of}: {factors}" if factors else "no load makes the structure buckle"
        )
    if report.vibration is not None:
        values = ", ".join(f"{value:.4g}" for value in report.vibration.values)
        lines.append(
            f"natural frequencies: {values} Hz" if values else "no node can move, so there are no natural frequencies"
        )
    if report.path is not None:
        lines.append(path_words(report.path))
    return lines


def sizing_lines(report: StructureReport) -> list[str]:
    """Return a line where the sections are larger than the members need, so that the structure does not buckle too early."""
    passed = [each for each in report.rounds if each.buckling is not None]
    if len(passed) < 2:
        return []
    return [
        f"all members pass at {passed[0].mass:,.0f} kg, but there the structure buckles at {passed[0].buckling:.3g} times its loads;"
        f" larger sections raise that to {passed[-1].buckling:.3g}"
    ]
