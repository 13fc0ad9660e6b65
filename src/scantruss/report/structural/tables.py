"""Tables of the report of a structure: load cases, reactions, members, sections and masses."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...structure.checks import use_words
from ...structure.report import CaseFigures, StructureReport
from ...structure.report_lines import chosen_cases
from ...structure.results import MOMENT_Y, MOMENT_Z, CaseResult, Solution
from ...structure.truss import Truss
from .parts import DataTable, ReportPart, SectionHead, Sentence
from .source import ReportSource, axial_force, greatest_stresses
from .words import fixed

LISTED_MEMBERS = 20  #: of the table of the members that are used most
LISTED_SUPPORTS = 60  #: of the table of reactions
LISTED_CASES = 60  #: about, of the table of load cases
CASE_HEAD = (
    "load case", "applied, vertical [kN]", "reaction, vertical [kN]", "greatest displacement [mm]", "compression [kN]", "tension [kN]",
    "utilization",
)  # fmt: skip
MEMBER_HEAD = ("member", "nodes", "length [m]", "section", "N [kN]", "My [kNm]", "Mz [kNm]")
FORCE_NOTE = "N: tension is positive. My and Mz: the greatest along the member, about its own axes."


def report_tables(source: ReportSource) -> Iterator[ReportPart]:
    """Yield tables of load cases, reactions, governing members and sections."""
    solution, report, truss = source.solution, source.report, source.solution.truss
    yield SectionHead("Load cases and combinations")
    cases = chosen_cases(report, LISTED_CASES)
    note = f"Those that use the members or move the nodes most, {len(cases)} of {len(report.cases)}."
    listed = tuple(_case_row(case) for case in cases)
    yield DataTable(CASE_HEAD, listed, note=note if len(cases) < len(report.cases) else "")
    errors = max(case.equilibrium_error for case in report.cases)
    yield Sentence(f"Equilibrium of forces and moments holds to {errors:.1e} in every one.")
    yield SectionHead("Reactions")
    yield _reactions(solution)
    if report.utilization is not None:
        yield SectionHead("Members that are used most")
        yield _members(solution, report)
    else:
        yield SectionHead("Members with the greatest stresses")
        yield _stressed_members(solution)
    yield SectionHead("Sections and masses")
    yield _sections(truss, report)
    rows = [
        (name, f"{each['members']:,}", f"{each['mass']:,.0f}", " ".join(each["sections"]),
         use_words(each["utilization_max"]))
        for name, each in report.to_dict()["groups"].items()
    ]  # fmt: skip
    yield DataTable(("group", "members", "mass [kg]", "sections", "utilization"), tuple(rows), words=(0, 3))


def _reactions(solution: Solution) -> DataTable:
    """Return extremes of the reactions of every support under the ULS combinations, or all cases where there are none."""
    truss = solution.truss
    held = np.flatnonzero(truss.supports.any(axis=1))
    judged = solution.judged_results()
    made = np.stack([result.reactions[held] for result in judged]) / 1e3
    up, size = made[:, :, 2], np.linalg.norm(made[:, :, :3], axis=2)
    columns = {
        "vertical, least [kN]": up.min(axis=0),
        "vertical, greatest [kN]": up.max(axis=0),
        "horizontal, greatest [kN]": np.linalg.norm(made[:, :, :2], axis=2).max(axis=0),
    }
    if (moments := np.linalg.norm(made[:, :, 3:], axis=2).max(axis=0)).any():
        columns["moment, greatest [kNm]"] = moments
    places = truss.nodes[held] + truss.origin
    order = np.argsort(-size.max(axis=0), kind="stable")
    kept = order if len(order) <= LISTED_SUPPORTS else np.sort(order[:LISTED_SUPPORTS])
    rows = [
        (truss.node_marks[held[k]], *(fixed(c, 3) for c in places[k]), *(fixed(values[k], 1) for values in columns.values()),
         judged[int(size[:, k].argmax())].name)
        for k in kept
    ]  # fmt: skip
    head = ("support", "x [m]", "y [m]", "z [m]", *columns, "greatest under")
    note = f"The {len(kept)} greatest of {len(order):,}; the .json of the structure has all, of every load case."
    return DataTable(head, tuple(rows), words=(0, len(head) - 1), note=note if len(kept) < len(order) else "")


def _case_row(case: CaseFigures) -> tuple[str, ...]:
    """Return the row of a load case or combination, with as many decimals in every row."""
    forces = (case.applied[2], case.reactions[2], min(case.force_min, 0.0), max(case.force_max, 0.0))
    applied, reaction, compression, tension = (fixed(value / 1e3, 1) for value in forces)
    moves = fixed(1e3 * case.displacement_max, 2)
    return case.name, applied, reaction, moves, compression, tension, use_words(case.utilization_max)


def _members(solution: Solution, report: StructureReport) -> DataTable:
    """Return the members of the greatest utilization."""
    used = report.utilization
    assert used is not None
    rows = []
    for member in np.argsort(-used, kind="stable")[:LISTED_MEMBERS]:
        clause, _, load = report.governing[member].partition(", ")
        rows.append((*_member_cells(solution[load], member, 1), f"{used[member]:.3f}", clause.partition(" ")[0], load))
    head = (*MEMBER_HEAD, "utilization", "clause", "load")
    return DataTable(head, tuple(rows), words=(0, 1, 3, 8, 9), note=FORCE_NOTE)


def _stressed_members(solution: Solution) -> DataTable:
    """Return the members of the greatest stresses, for whoever checks a material that is not steel."""
    stresses, causes = greatest_stresses(solution)
    rows = []
    for member in np.argsort(-stresses, kind="stable")[:LISTED_MEMBERS]:
        result = solution[causes[member]]
        axial, bending = (f"{abs(stress) / 1e6:.2f}" for stress in result.stresses[member])
        rows.append((*_member_cells(result, member, 2), axial, bending, causes[member]))
    head = (*MEMBER_HEAD, "axial stress [MPa]", "bending stress [MPa]", "load")
    return DataTable(head, tuple(rows), words=(0, 1, 3, 9), note=FORCE_NOTE)


def _member_cells(result: CaseResult, member: int, decimals: int) -> tuple[str, ...]:
    """Return mark, nodes, length, section and forces of a member."""
    truss = result.truss
    start, end = truss.members[member]
    forces = (axial_force(result)[member], *result.greatest[member, [MOMENT_Y, MOMENT_Z]])
    return (
        truss.member_marks[member],
        f"{truss.node_marks[start]} {truss.node_marks[end]}",
        f"{truss.lengths[member]:.3f}",
        truss.sections[truss.section_of[member]].name,
        *(fixed(value / 1e3, decimals) for value in forces),
    )


def _sections(truss: Truss, report: StructureReport) -> DataTable:
    """Return counts, lengths and masses by section."""
    rows = []
    for number, section in enumerate(truss.sections):
        mine = truss.section_of == number
        used = "-" if report.utilization is None or not mine.any() else use_words(report.utilization[mine].max())
        rows.append(
            (section.name, truss.material.name, f"{mine.sum():,}", f"{truss.lengths[mine].sum():,.1f}",
             f"{section.area * truss.material.density:.2f}", f"{truss.member_mass[mine].sum():,.0f}", used)
        )  # fmt: skip
    total = (
        "all",
        truss.material.name,
        f"{len(truss.members):,}",
        f"{truss.lengths.sum():,.1f}",
        "",
        f"{truss.mass:,.0f}",
        "",
    )
    head = ("section", "material", "members", "length [m]", "kg/m", "mass [kg]", "utilization")
    return DataTable(head, (*rows, total), words=(0, 1), note="System lengths, without nodes.")
