"""What the report of a structure says and shows, in its order."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from ...export.drawing.structure import FORCES, USED, MemberPicture, draw_members, mode_picture, moved_picture
from ...structure.checks import CLAUSES, MemberChecks, span_of
from ...structure.modes import Modes
from ...structure.options import StructureSettings, settings_text
from ...structure.path_report import path_words
from ...structure.report import STRUCTURE_HEAD, CaseFigures, StructureReport, structure_lines, use_words
from ...structure.statics import CaseResult, Solution
from ...structure.truss import Truss
from .charts import draw_nonlinear_path, draw_rounds, draw_weights
from .parts import DataTable, Frame, Headline, Illustration, Listing, PointList, ReportPart, SectionHead, Sentence

LISTED_MEMBERS = 20  #: of the table of the members that are used most
LISTED_SUPPORTS = 60  #: of the table of reactions
LISTED_CASES = 60  #: about, of the table of load cases
MODES_SHOWN = 4  #: of buckling, and of vibration
CLAUSES_USED = (
    ("EN 1993-1-1 table 5.2", "class of the section"),
    ("EN 1993-1-1 5.2.1(3)", "least factor of linear buckling"),
    *((f"EN 1993-1-1 {clause.partition(' ')[0]}", clause.partition(" ")[2]) for clause in CLAUSES),
    ("EN 1990 6.10, table A1.2(B)", "ULS, psi 0 of table A1.1"),
    ("EN 1990 6.14b", "SLS, characteristic"),
)
OF_I_SECTIONS = ("EN 1993-1-1 6.3.2.2", "lateral torsional buckling")


@dataclass(frozen=True, eq=False)
class ReportSource:
    """What a report is made from."""

    name: str  #: of the grid's file
    command: str  #: that makes it again, "" where none does
    settings: StructureSettings
    solution: Solution
    report: StructureReport


def report_parts(source: ReportSource) -> list[ReportPart]:
    """Return all parts of the report of a structure."""
    return [*_first_page(source), *_pictures(source), *_tables(source), *_repeated(source)]


def overview_picture(solution: Solution, report: StructureReport) -> MemberPicture:
    """Return the picture that stands for a structure: its utilization, or its axial forces where no member is checked."""
    if report.utilization is not None:
        most = float(report.utilization.max())
        return MemberPicture(f"utilization, {use_words(most)} at most", "utilization", report.utilization, USED)
    result = _most_pressed(solution)
    return MemberPicture(f"axial forces under {result.name}", "axial force [kN]", _axial(result) / 1e3, FORCES)


def _first_page(source: ReportSource) -> Iterator[ReportPart]:
    """Yield what was found, warnings, assumptions and clauses."""
    report, truss, settings = source.report, source.solution.truss, source.settings
    values = report.to_dict()
    service = max(_states(report, "SLS"), key=lambda case: case.displacement_max)
    yield Headline(
        f"Structure of {source.name}",
        f"{len(truss.nodes):,} nodes, {len(truss.members):,} members, {truss.mass:,.0f} kg without nodes",
    )
    span = span_of(truss)
    used, moves = values["utilization_max"], service.displacement_max
    rows = [
        ("greatest utilization", use_words(used), _governing(report)),
        (
            "greatest displacement",
            f"{1e3 * moves:.3g} mm",
            f"span/{span / max(moves, 1e-12):.0f} of the span {span:.3g} m, {service.name}",
        ),
        ("axial forces", f"{_range_of_forces(values)} kN", "all cases and combinations"),
    ]
    if report.buckling is not None and len(report.buckling.values):
        rows.append(("buckling factor", f"{report.buckling.values[0]:.3g}", report.buckling.of))
    if report.vibration is not None and len(report.vibration.values):
        rows.append(
            ("lowest natural frequency", f"{report.vibration.values[0]:.3g} Hz", "masses of the permanent loads")
        )
    if (path := report.path) is not None:
        limit = f"over {path.factors.max():.3g}" if path.limit_factor is None else f"{path.limit_factor:.3g}"
        rows.append(("limit factor, nonlinear", limit, f"{path.name}, imperfection {path.imperfection.kind}"))
    yield DataTable(("result", "value", "where"), tuple(rows), words=(0, 2))
    for words in report.warnings:
        yield Sentence(f"Warning: {words}", warns=True)
    yield SectionHead("Assumptions")
    yield PointList(tuple(_assumptions(truss, settings)))
    if report.utilization is not None:
        yield SectionHead("Clauses")
        used_clauses = [*CLAUSES_USED, *[OF_I_SECTIONS] * any(section.shape == "I" for section in truss.sections)]
        half = -(-len(used_clauses) // 2)
        pairs = zip(used_clauses[:half], [*used_clauses[half:], ("", "")][:half], strict=True)
        head = ("clause", "what for", "clause", "what for")
        yield DataTable(head, tuple((*left, *right) for left, right in pairs), words=(0, 1, 2, 3))


def _repeated(source: ReportSource) -> Iterator[ReportPart]:
    """Yield the command and the settings that make it again."""
    yield SectionHead("To make it again")
    yield Sentence(f"{'The command, and the' if source.command else 'The'} file structure.toml with all settings:")
    yield Listing(f"{source.command}\n\n# structure.toml\n{settings_text(source.settings)}".lstrip())


def _range_of_forces(values: dict[str, Any]) -> str:
    """Return the smallest and greatest axial force in words [kN]."""
    return f"{values['force_min'] / 1e3:.4g} to {values['force_max'] / 1e3:.4g}"


def _governing(report: StructureReport) -> str:
    """Return which member is used most, and by what."""
    if report.utilization is None:
        return "no clause is checked"
    most = int(report.utilization.argmax())
    return f"{report.truss.member_marks[most]}, {report.governing[most]}"


def _assumptions(truss: Truss, settings: StructureSettings) -> Iterator[str]:
    """Yield what was taken for granted, one sentence each."""
    checks: MemberChecks = settings.checks
    joints = {"rigid": "rigid joints", "pinned": "pinned joints, axial forces only"}.get(
        settings.joints or ("pinned" if settings.double_layer else "rigid"),
        f"rotational springs of {settings.joints} Nm/rad at the member ends",
    )
    more = " The nonlinear path is elastic too, of large displacements." if settings.path else ""
    yield f"Linear elastic analysis of small displacements; straight members between nodes, {joints}.{more}"
    yield f"Scale {settings.scale:g} of the structure to the grid; lengths in m, forces in N, masses in kg; z is up."
    of = truss.material
    strength = "yield strength" if of.kind == "steel" else "characteristic strength"
    yield (
        f"{of.name}: E {of.young / 1e9:g} GPa, G {of.shear / 1e9:g} GPa, {strength} {of.yield_strength / 1e6:g} MPa,"
        f" {of.density:g} kg/m3 ({of.source or 'own'})."
    )
    sources = sorted({section.source for section in truss.sections if section.source})
    yield f"Sections: {', '.join(section.name for section in truss.sections)} ({'; '.join(sources) or 'own'})."
    held = int(truss.supports.any(axis=1).sum())
    yield f"{held:,} supports, {settings.support_type}: {settings.supports}."
    loads = [
        str(load) if not isinstance(load, dict) else str(load.get("case", load.get("load", "load")))
        for load in settings.loads
    ]
    yield f"Loads: {', '.join(loads)}; {100 * settings.node_allowance:g} % of the weight of the members for the nodes."
    given = "those of EN 1990" if settings.combinations is None else "those of the settings file"
    yield f"Combinations: {given}, {len(truss.combinations)} of them."
    yield (
        f"Buckling length {checks.effective_length:g} times the system length; gamma M0 {checks.gamma_m0:g}, gamma M1"
        f" {checks.gamma_m1:g}; limits: slenderness {checks.slenderness:g}, displacement span/{checks.deflection:g}."
    )
    yield "Not looked at: plasticity, the size and strength of joints, fire, earthquakes. It does not replace the judgement of an engineer."


def _pictures(source: ReportSource) -> Iterator[ReportPart]:
    """Yield pictures of forces, utilization, displacements, modes and the weight curve."""
    solution, report, truss = source.solution, source.report, source.solution.truss
    yield SectionHead("Forces and displacements")
    pressed = _most_pressed(solution)
    words = "axial force of the greatest size in each member; tension is positive, blue"
    yield _image(
        truss,
        MemberPicture(f"Axial forces under {pressed.name}: {words}", "axial force [kN]", _axial(pressed) / 1e3, FORCES),
    )
    if report.utilization is not None:
        yield _image(truss, MemberPicture(
            "Utilization, the greatest of all ULS combinations and clauses", "utilization", report.utilization, USED))  # fmt: skip
    name = max(_states(report, "SLS"), key=lambda case: case.displacement_max).name
    shown = moved_picture(truss, f"Displacements under {name}", solution[name].displacements[:, :3])
    yield _image(truss, shown)
    if report.buckling is not None and len(report.buckling.values):
        yield SectionHead(f"Buckling under {report.buckling.of}")
        yield from _modes(truss, report.buckling, "Buckling mode {}, factor {:.4g}")
    if report.vibration is not None and len(report.vibration.values):
        yield SectionHead("Vibration")
        yield from _modes(truss, report.vibration, "Vibration mode {}, {:.4g} Hz")
    if report.path is not None:
        yield SectionHead("Nonlinear path")
        yield Illustration(path_words(report.path), partial(_draw, draw_nonlinear_path, report.path), 0.5)
    if report.rounds:
        yield SectionHead("Sizing")
        yield Illustration(
            "Mass and greatest utilization from round to round of sizing",
            partial(_draw, draw_rounds, report.rounds),
            0.42,
        )
        rows = [
            (str(number), f"{each.mass:,.0f}", str(each.sections), use_words(each.utilization),
             "-" if each.buckling is None else f"{each.buckling:.3g}")
            for number, each in enumerate(report.rounds, 1)
        ]  # fmt: skip
        yield DataTable(("round", "mass [kg]", "sections", "utilization", "buckling factor"), tuple(rows))
    if report.weights and len(report.weights) > 1:
        yield Illustration(
            "Mass by the number of different sections that may be chosen",
            partial(_draw, draw_weights, report.weights),
            0.42,
        )


def _draw(draw: Callable[[Any, Frame, Any], None], what: Any, figure: Any, place: Frame) -> None:
    draw(figure, place, what)


def _image(truss: Truss, shown: MemberPicture) -> Illustration:
    """Return a picture of members as a part."""
    more = f", drawn {shown.factor:g} times" if shown.factor != 1.0 else ""
    return Illustration(shown.title + more, lambda figure, place: draw_members(figure, place, truss, shown))


def _modes(truss: Truss, modes: Modes, words: str) -> Iterator[Illustration | Sentence]:
    """Yield pictures of the first modes, and the values of all."""
    if len(modes.values) > MODES_SHOWN:
        yield Sentence(f"All values: {', '.join(f'{value:.4g}' for value in modes.values)}.")
    for number, (value, shape) in enumerate(zip(modes.values[:MODES_SHOWN], modes.shapes, strict=False), 1):
        yield _image(truss, mode_picture(truss, words.format(number, value), shape))


def _tables(source: ReportSource) -> Iterator[ReportPart]:
    """Yield tables of load cases, reactions, governing members and sections."""
    solution, report, truss = source.solution, source.report, source.solution.truss
    yield SectionHead("Load cases and combinations")
    lines = structure_lines(report, most=LISTED_CASES)
    note = f"Those that use the members or move the nodes most, {len(lines)} of {len(report.cases)}."
    yield DataTable(STRUCTURE_HEAD, tuple(lines), note=note if len(lines) < len(report.cases) else "")
    errors = max(case.equilibrium_error for case in report.cases)
    yield Sentence(f"Equilibrium of forces and moments holds to {errors:.1e} in every one.")
    yield SectionHead("Reactions")
    yield _reactions(solution)
    if report.utilization is not None:
        yield SectionHead("Members that are used most")
        yield _members(solution, report)
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
    judged = [result for result in solution.all_results() if result.state == "ULS"] or list(solution.cases)
    made = np.stack([result.reactions[held] for result in judged]) / 1e3
    up, size = made[:, :, 2], np.linalg.norm(made[:, :, :3], axis=2)
    columns = {
        "least up [kN]": up.min(axis=0),
        "most up [kN]": up.max(axis=0),
        "most across [kN]": np.linalg.norm(made[:, :, :2], axis=2).max(axis=0),
    }
    if (moments := np.linalg.norm(made[:, :, 3:], axis=2).max(axis=0)).any():
        columns["most moment [kNm]"] = moments
    places = truss.nodes[held] + truss.origin
    order = np.argsort(-size.max(axis=0), kind="stable")
    kept = order if len(order) <= LISTED_SUPPORTS else np.sort(order[:LISTED_SUPPORTS])
    rows = [
        (truss.node_marks[held[k]], *(f"{c:.3f}" for c in places[k]), *(f"{values[k]:.1f}" for values in columns.values()),
         judged[int(size[:, k].argmax())].name)
        for k in kept
    ]  # fmt: skip
    head = ("support", "x [m]", "y [m]", "z [m]", *columns, "greatest under")
    note = f"The {len(kept)} greatest of {len(order):,}; the .json of the structure has all, of every load case."
    return DataTable(head, tuple(rows), words=(0, len(head) - 1), note=note if len(kept) < len(order) else "")


def _members(solution: Solution, report: StructureReport) -> DataTable:
    """Return the members of the greatest utilization."""
    truss, used = report.truss, report.utilization
    assert used is not None
    rows = []
    for member in np.argsort(-used, kind="stable")[:LISTED_MEMBERS]:
        start, end = truss.members[member]
        clause, _, load = report.governing[member].partition(", ")
        axial = _axial(solution[load])[member] / 1e3
        rows.append(
            (truss.member_marks[member], f"{truss.node_marks[start]} {truss.node_marks[end]}", f"{truss.lengths[member]:.3f}",
             truss.sections[truss.section_of[member]].name, f"{axial:.1f}", f"{used[member]:.3f}", clause.split(" ")[0], load)
        )  # fmt: skip
    head = ("member", "nodes", "length [m]", "section", "N [kN]", "utilization", "clause", "load")
    return DataTable(head, tuple(rows), words=(0, 1, 3, 6, 7))


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


def _states(report: StructureReport, state: str) -> list[CaseFigures]:
    """Return the figures of a state, those of the load cases where it has none."""
    return [case for case in report.cases if case.state == state] or [
        case for case in report.cases if case.state == "case"
    ]


def _most_pressed(solution: Solution) -> CaseResult:
    """Return the ULS combination (else the load case) with the greatest compression."""
    every = list(solution.all_results())
    return min((each for each in every if each.state == "ULS"), key=_compression, default=min(every, key=_compression))


def _compression(result: CaseResult) -> float:
    return float(result.axial.min())


def _axial(result: CaseResult) -> np.ndarray:
    """Return the (M,) axial force of the greatest size in each member [N]."""
    low, high = result.axial.T
    return np.where(-low > high, low, high)
