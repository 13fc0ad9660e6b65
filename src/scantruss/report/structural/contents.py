"""What the report of a structure says and shows, in its order."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

from ...export.drawing.structure import FORCES, SIZES, USED, MemberPicture, draw_members, mode_picture, moved_picture
from ...structure.checks import use_words
from ...structure.modes import Modes
from ...structure.options import settings_text
from ...structure.path_report import path_words
from ...structure.report import StructureReport
from ...structure.results import Solution
from ...structure.truss import Truss
from .charts import draw_nonlinear_path, draw_rounds, draw_weights
from .first_page import first_page
from .parts import DataTable, Frame, Illustration, Listing, ReportPart, SectionHead, Sentence
from .source import ReportSource, axial_force, cases_of_state, greatest_stresses, most_pressed
from .tables import report_tables

MODES_SHOWN = 4  #: of buckling, and of vibration


def report_parts(source: ReportSource) -> list[ReportPart]:
    """Return all parts of the report of a structure."""
    return [*first_page(source), *_pictures(source), *report_tables(source), *_repeated(source)]


def overview_picture(solution: Solution, report: StructureReport) -> MemberPicture:
    """Return the picture that stands for a structure: its utilization, or its axial forces where no member is checked."""
    if report.utilization is not None:
        most = float(report.utilization.max())
        return MemberPicture(f"utilization, {use_words(most)} at most", "utilization", report.utilization, USED)
    result = most_pressed(solution)
    return MemberPicture(f"axial forces under {result.name}", "axial force [kN]", axial_force(result) / 1e3, FORCES)


def _repeated(source: ReportSource) -> Iterator[ReportPart]:
    """Yield the command and the settings that make it again."""
    yield SectionHead("To make it again")
    yield Sentence(f"{'The command, and the' if source.command else 'The'} file structure.toml with all settings:")
    yield Listing(f"{source.command}\n\n# structure.toml\n{settings_text(source.settings)}".lstrip())


def _pictures(source: ReportSource) -> Iterator[ReportPart]:
    """Yield pictures of forces, utilization, displacements, modes and the weight curve."""
    solution, report, truss = source.solution, source.report, source.solution.truss
    yield SectionHead("Forces and displacements")
    pressed = most_pressed(solution)
    words = "axial force of the greatest size in each member; tension is positive, blue"
    yield _image(
        truss,
        MemberPicture(
            f"Axial forces under {pressed.name}: {words}", "axial force [kN]", axial_force(pressed) / 1e3, FORCES
        ),
    )
    if report.utilization is not None:
        yield _image(truss, MemberPicture(
            "Utilization, the greatest of all ULS combinations and clauses", "utilization", report.utilization, USED))  # fmt: skip
    else:
        stresses, _ = greatest_stresses(solution)
        yield _image(truss, MemberPicture(
            "Stress, axial and bending together, the greatest of all ULS combinations", "stress [MPa]", stresses / 1e6, SIZES))  # fmt: skip
    name = max(cases_of_state(report, "SLS"), key=lambda case: case.displacement_max).name
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
        yield Illustration(_sentence(path_words(report.path)), partial(_draw, draw_nonlinear_path, report.path), 0.5)
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


def _sentence(words: str) -> str:
    return words[:1].upper() + words[1:]


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
