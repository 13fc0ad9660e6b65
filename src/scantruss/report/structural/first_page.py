"""The first page of the report of a structure: results beside their limits, warnings, assumptions and clauses."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...structure.checks import CLAUSES_CHECKED, MemberChecks, span_of, use_words
from ...structure.options import StructureSettings
from ...structure.report import StructureReport
from ...structure.truss import Truss
from .parts import DataTable, Headline, PointList, ReportPart, SectionHead, Sentence
from .source import ReportSource, cases_of_state, greatest_stress
from .words import load_words, supports_in_words

CLAUSES_USED = (
    ("EN 1993-1-1 table 5.2", "class of the section"),
    *((f"EN 1993-1-1 {clause.partition(' ')[0]}", clause.partition(" ")[2]) for clause in CLAUSES_CHECKED),
    ("EN 1990 6.10, table A1.2(B)", "ULS, psi 0 of table A1.1"),
    ("EN 1990 6.14b", "SLS, characteristic"),
)
OF_BUCKLING = ("EN 1993-1-1 5.2.1(3)", "least factor of linear buckling")
OF_I_SECTIONS = ("EN 1993-1-1 6.3.2.2", "lateral torsional buckling")


def first_page(source: ReportSource) -> Iterator[ReportPart]:
    """Yield what was found, warnings, assumptions and clauses."""
    report, truss, settings = source.report, source.solution.truss, source.settings
    size = np.ptp(truss.nodes, axis=0)
    yield Headline(
        f"Structure of {source.name}",
        f"{len(truss.nodes):,} nodes, {len(truss.members):,} members, {truss.mass:,.0f} kg without nodes;"
        f" {size[0]:.1f} x {size[1]:.1f} m in plan, {size[2]:.1f} m high",
    )
    yield DataTable(("result", "value", "limit", "where"), tuple(_results(source)), words=(0, 3))
    for words in report.warnings:
        yield Sentence(f"Warning: {words}", warns=True)
    if report.utilization is not None and not report.warnings:
        yield Sentence("Every check that is listed below is met.")
    if source.of_grid:
        yield SectionHead("Certificate of the grid")
        yield Sentence("Warning: the grid of which the structure was made has places to look at:", warns=True)
        yield PointList(tuple(source.of_grid))
    yield SectionHead("Assumptions")
    stability = report.buckling is not None or report.path is not None
    yield PointList(tuple(_assumptions(truss, settings, stability)))
    if report.utilization is not None:
        yield SectionHead("Clauses")
        used_clauses = [*CLAUSES_USED, *[OF_BUCKLING] * (report.buckling is not None)]
        used_clauses += [OF_I_SECTIONS] * any(section.shape == "I" for section in truss.sections)
        half = -(-len(used_clauses) // 2)
        pairs = zip(used_clauses[:half], [*used_clauses[half:], ("", "")][:half], strict=True)
        head = ("clause", "what for", "clause", "what for")
        yield DataTable(head, tuple((*left, *right) for left, right in pairs), words=(0, 1, 2, 3))


def _results(source: ReportSource) -> Iterator[tuple[str, str, str, str]]:
    """Yield the rows of the greatest results: what, value, limit, where."""
    report, truss, checks = source.report, source.solution.truss, source.settings.checks
    values = report.to_dict()
    if report.utilization is None:
        stress, member, name = greatest_stress(source.solution)
        yield "greatest stress", f"{stress / 1e6:.3g} MPa", "not checked", f"{truss.member_marks[member]}, {name}"
    else:
        yield "greatest utilization", use_words(values["utilization_max"]), "1.00", _governing(report)
    service = max(cases_of_state(report, "SLS"), key=lambda case: case.displacement_max)
    span, moves = span_of(truss), service.displacement_max
    yield (
        "greatest displacement",
        f"{1e3 * moves:.3g} mm",
        f"{1e3 * span / checks.deflection:.3g} mm",
        f"span/{span / max(moves, 1e-12):.0f} of the span {span:.3g} m, {service.name}",
    )
    yield from _extreme_forces(source)
    if report.buckling is not None and len(report.buckling.values):
        least = f"{checks.buckling_factor:g} or more"
        yield "buckling factor", f"{report.buckling.values[0]:.3g}", least, report.buckling.of
    if report.vibration is not None and len(report.vibration.values):
        of = "masses of the permanent loads"
        yield "lowest natural frequency", f"{report.vibration.values[0]:.3g} Hz", "", of
    if (path := report.path) is not None:
        limit = f"over {path.factors.max():.3g}" if path.limit_factor is None else f"{path.limit_factor:.3g}"
        yield "limit factor, nonlinear", limit, "1 or more", f"{path.name}, imperfection {path.imperfection.kind}"


def _extreme_forces(source: ReportSource) -> Iterator[tuple[str, str, str, str]]:
    """Yield the greatest tension and compression of all cases and combinations."""
    marks = source.solution.truss.member_marks
    every = [(result.name, result.axial) for result in source.solution.all_results()]
    for words, column, sign in (("greatest compression", 0, -1.0), ("greatest tension", 1, 1.0)):
        name, axial = max(every, key=lambda each: float((sign * each[1][:, column]).max()))
        member = int((sign * axial[:, column]).argmax())
        force = sign * float(axial[member, column])
        if force > 0:
            yield words, f"{force / 1e3:.4g} kN", "", f"{marks[member]}, {name}"


def _governing(report: StructureReport) -> str:
    """Return which member is used most, and by what."""
    if report.utilization is None:
        return "no clause is checked"
    most = int(report.utilization.argmax())
    return f"{report.truss.member_marks[most]}, {report.governing[most]}"


def _assumptions(truss: Truss, settings: StructureSettings, stability: bool) -> Iterator[str]:
    """Yield what was taken for granted, one sentence each; stability : whether that of the whole was looked at."""
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
    yield f"{held:,} supports, {settings.support_type}: {supports_in_words(settings.supports)}."
    loads = [load_words(load) for load in settings.loads]
    nodes = (
        f"{100 * settings.node_allowance:g} % of the weight of the members is added for the nodes"
        if settings.node_allowance
        else "the weight of the nodes, as of balls, is not counted"
    )
    yield f"Loads: {'; '.join(loads)}; {nodes}."
    given = "those of EN 1990" if settings.combinations is None else "those of the settings file"
    yield f"Combinations: {given}, {len(truss.combinations)} of them."
    yield (
        f"Buckling length {checks.effective_length:g} times the system length; gamma M0 {checks.gamma_m0:g}, gamma M1"
        f" {checks.gamma_m1:g}; limits: slenderness {checks.slenderness:g}, displacement span/{checks.deflection:g}."
    )
    whole = "" if stability else "the stability of the whole (buckling modes), "
    yield (
        f"Not looked at: {whole}plasticity, the size and strength of joints, fire, earthquakes."
        " It does not replace the judgement of an engineer."
    )
