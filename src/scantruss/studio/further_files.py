"""What a studio gives away besides the formats: reports, schedules and a model to print."""

from __future__ import annotations

from pathlib import Path

from ..errors import InputError
from ..export.formats import GRID, STRUCTURE
from ..runtime.files import temporary_folder
from ..settings import UNITS
from .outputs import Note, command_of_project, model_to_show, unsaid
from .state import StudioState

SCHEDULES = "schedules .xlsx"
GRID_REPORT = "report of the grid .html"
STRUCTURE_REPORTS = ("report of the structure .html", "report of the structure .pdf")
PRINTED = "model to print .3mf"
FURTHER_FILES = (SCHEDULES, GRID_REPORT, *STRUCTURE_REPORTS, PRINTED)
PRINTED_MEMBER, PRINTED_BALL = 1.2, 2.0  #: diameters of a model that is printed [mm]


def further_files(state: StudioState, what: str, printed_size: float, note: Note = unsaid) -> dict[str, bytes]:
    """Return the files of one of `FURTHER_FILES` by their names.

    Parameters
    ----------
    printed_size : float
        Longest side of the model to print [mm].
    note : callable
        ``note(words)`` takes what the command line would say of them.

    Raises
    ------
    ScanTrussError
        There is nothing to write, or it cannot be made.
    """
    if what == SCHEDULES:
        return _schedules(state, note)
    if what == PRINTED:
        return _printed(state, printed_size, note)
    if what == GRID_REPORT:
        from ..report.grid_page import encode_grid_report

        model_to_show(state, GRID)
        assert state.grid is not None and state.cloud is not None
        return {"grid-report.html": encode_grid_report(state.grid, state.cloud, command_of_project(state))}
    return _structure_report(state, Path(what).suffix)


def _schedules(state: StudioState, note: Note) -> dict[str, bytes]:
    from ..schedules.files import write_schedules
    from ..schedules.lines import schedule_lines
    from ..schedules.make import schedule
    from ..schedules.settings import ScheduleSettings

    model_to_show(state, GRID)
    assert state.grid is not None
    what = state.grid if state.solution is None else state.solution.truss
    unit = state.settings.unit if state.solution is None and not state.grid.unit else ""
    settings = ScheduleSettings(unit=unit)
    made = schedule(what, settings)
    for words in schedule_lines(made, settings, what.alike):
        note(words)
    with temporary_folder() as folder:
        write_schedules(made, folder / "schedules.xlsx")
        return {"schedules.xlsx": (folder / "schedules.xlsx").read_bytes()}


def _structure_report(state: StudioState, suffix: str) -> dict[str, bytes]:
    from ..export.page import encode_page
    from ..export.style import FileStyle
    from ..report.structural.contents import report_parts
    from ..report.structural.html import encode_html
    from ..report.structural.pdf import encode_pdf
    from ..report.structural.source import ReportSource
    from ..structure.doubts import certificate_words

    model = model_to_show(state, STRUCTURE)
    assert state.solution is not None and state.report is not None
    command = command_of_project(state).splitlines()[-1]
    of_grid = certificate_words(state.grid) if state.grid is not None else []
    parts = report_parts(
        ReportSource("grid.json", command, state.shown_structure, state.solution, state.report, of_grid)
    )
    if suffix == ".pdf":
        return {"structure-report.pdf": encode_pdf(parts)}
    return {"structure-report.html": encode_html(parts, encode_page(model, FileStyle()))}


def _printed(state: StudioState, size: float, note: Note) -> dict[str, bytes]:
    from ..export.printed.apart import print_apart
    from ..structure.layered import grid_in_metres

    model_to_show(state, GRID)
    grid = state.grid
    if state.solution is not None and state.solution.truss.layers is not None:
        grid = grid_in_metres(state.solution.truss)
    assert grid is not None
    if not grid.unit:
        raise InputError("a model to print needs the unit of the scan; choose it in the Scan tab and generate again")
    if not size > 0:
        raise InputError(f"the longest side of a model needs to be positive, got {size:g} mm")
    metres = UNITS[grid.unit]
    assert metres is not None
    millimetre = 1e-3 / metres
    scale = size * millimetre / float((grid.nodes.max(axis=0) - grid.nodes.min(axis=0)).max())
    with temporary_folder() as folder:
        solid = print_apart(
            grid, folder / "model.3mf", scale=scale, member_diameter=PRINTED_MEMBER * millimetre,
            node_diameter=PRINTED_BALL * millimetre,
        )  # fmt: skip
        for words in solid.notes:
            note(words)
        return {"model.3mf": (folder / "model.3mf").read_bytes()}
