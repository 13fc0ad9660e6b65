"""Write a setting out: tables as .csv and .xlsx, drawings as .dxf and, to scale, as .pdf."""

from __future__ import annotations

import io
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import FormatError, how_to_install
from ..export.csv import encode_table
from ..runtime.files import write_files
from ..runtime.ours import MADE_BY
from ..runtime.places import check_place
from ..schedules.files import encode_xlsx
from .make import TABLES
from .settings import PAPERS
from .sheets import LAYERS, MEMBER_MARKS, Sheet, make_sheets

if TYPE_CHECKING:
    from .make import SettingOut

SETOUT_SUFFIXES = (".csv", ".dxf", ".pdf", ".xlsx")
NEEDS_EZDXF = f"writing .dxf needs ezdxf; install it with: {how_to_install('cad')}"
LAYER_COLOURS = (8, 1, 5, 7, 8, 3, 6, 9)  # of the layers, AutoCAD colour index
LAYER_INKS = ("0.55", "#c0202a", "#2040c0", "0", "0.45", "#208030", "#803090", "0.75")  # of the layers
USUAL_SCALES = [base * 10**power for power in range(6) for base in (1, 2, 2.5, 5)]  # 1 : so much
SHEET_MARGIN, SHEET_FOOT = 10.0, 14.0  # of a page [mm]
POINT_LENGTH = 25.4 / 72  # [mm]
LEAST_WORD, LARGEST_WORD = 0.6, 3.0  # height on paper [mm]


def setout_paths(path: Path) -> list[Path]:
    """Return the files of a setting out: of a .csv one for each table, supports in the named one, `roof.csv`, `roof_heights.csv`, ..."""
    if path.suffix.lower() != ".csv":
        return [path]
    return [path if name == TABLES[0] else path.with_name(f"{path.stem}_{name}{path.suffix}") for name in TABLES]


def check_setout_place(path: str | Path) -> Path:
    """Return the path if a setting out can be written there.

    Raises
    ------
    FormatError
        It cannot, or ezdxf is not installed.
    """
    place = check_place(path, SETOUT_SUFFIXES)
    if place.suffix.lower() == ".dxf":
        _ezdxf()
    return place


def _ezdxf() -> Any:
    """Return the package ezdxf, or say that it is needed."""
    try:
        return import_module("ezdxf")
    except ImportError:
        raise FormatError(NEEDS_EZDXF) from None


def write_setting_out(
    made: SettingOut, path: str | Path, *, decimal_comma: bool = False, force: bool = False
) -> list[Path]:
    """Write a setting out; the same one gives the same bytes.

    Parameters
    ----------
    made : SettingOut
    path : str or Path
        File ending in .csv (supports, other tables beside it), .xlsx, .dxf or .pdf.
    decimal_comma : bool
        Whether a .csv has decimal commas, and semicolons between the columns.
    force : bool
        Whether to write over files that ScanTruss did not write.

    Raises
    ------
    FormatError
        The file cannot be written, or ezdxf is not installed.
    """
    path = check_setout_place(path)
    if (suffix := path.suffix.lower()) == ".csv":
        pairs = zip(setout_paths(path), made.tables, strict=True)
        return write_files(
            {place: encode_table(table.heads, table.rows, decimal_comma=decimal_comma) for place, table in pairs},
            force=force,
        )
    if suffix == ".xlsx":
        return write_files({path: encode_xlsx(made)}, force=force)
    sheets = make_sheets(made)
    return write_files(
        {path: encode_plan_dxf(sheets) if suffix == ".dxf" else encode_plan_pdf(sheets, made.settings.paper)},
        force=force,
    )


def encode_plan_dxf(sheets: list[Sheet]) -> bytes:
    """Return the drawings as DXF in millimetres: the plan in the building frame, the others below it, a layer for each kind of line."""
    ezdxf = _ezdxf()
    from ezdxf.enums import TextEntityAlignment

    fixed = ezdxf.options.write_fixed_meta_data_for_testing
    ezdxf.options.write_fixed_meta_data_for_testing = True  # no dates, no random ids
    try:
        document = ezdxf.new("R2010", units=ezdxf.units.MM)
        document.header["$MEASUREMENT"] = 1
        for name, colour in zip(LAYERS, LAYER_COLOURS, strict=True):
            document.layers.add(name, color=colour)
        document.layers.add("TITLES", color=7)
        space = document.modelspace()
        floor = 0.0
        for number, sheet in enumerate(sheets):
            low, high = sheet.extent
            shift = np.zeros(2) if number == 0 else np.array([sheets[0].extent[0][0] - low[0], floor - high[1]])
            floor = float(low[1] + shift[1]) - 10 * sheet.height
            for layer, line in sheet.lines:
                space.add_lwpolyline((line + shift).tolist(), dxfattribs={"layer": layer})
            for word in sheet.words:
                at = {"layer": word.layer, "rotation": word.angle}
                text = space.add_text(word.text, height=_word(sheet, word.layer), dxfattribs=at)
                text.set_placement(tuple(word.place + shift), align=TextEntityAlignment.MIDDLE_CENTER)
            title = space.add_text(sheet.title, height=3 * sheet.height, dxfattribs={"layer": "TITLES"})
            title.set_placement((float(low[0] + shift[0]), floor + 5 * sheet.height))
        stream = io.StringIO()
        document.write(stream)
    finally:
        ezdxf.options.write_fixed_meta_data_for_testing = fixed
    return f"999\n{MADE_BY}\n{stream.getvalue()}".encode()


def _word(sheet: Sheet, layer: str) -> float:
    """Return the height of words."""
    return sheet.height * (0.7 if layer == MEMBER_MARKS else 1.0)


def scale_on(sheet: Sheet, paper: str) -> tuple[float, tuple[float, float]]:
    """Return the largest usual scale (1 : so much) at which a drawing fits on a page, and the page's width and height [mm]."""
    wide, tall = PAPERS[paper]
    size = np.subtract(*sheet.extent[::-1])
    room = np.array([wide - 2 * SHEET_MARGIN, tall - 2 * SHEET_MARGIN - SHEET_FOOT])
    need = float((size / room).max())
    return next((scale for scale in USUAL_SCALES if scale >= need), need), (float(wide), float(tall))


def encode_plan_pdf(sheets: list[Sheet], paper: str) -> bytes:
    """Return the drawings as PDF, a page each, to scale."""
    from matplotlib.backends.backend_pdf import PdfPages

    stream = io.BytesIO()
    with PdfPages(stream, metadata={"Creator": MADE_BY, "Producer": MADE_BY, "CreationDate": None}) as pages:
        for sheet in sheets:
            pages.savefig(_page(sheet, paper))
    return stream.getvalue()


def _page(sheet: Sheet, paper: str) -> Any:
    from matplotlib.collections import LineCollection
    from matplotlib.figure import Figure

    scale, (wide, tall) = scale_on(sheet, paper)
    low, high = sheet.extent
    shift = np.array([wide, tall + SHEET_FOOT]) / 2 - (low + high) / 2 / scale
    figure = Figure(figsize=(wide / 25.4, tall / 25.4))
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set(xlim=(0, wide), ylim=(0, tall))
    axes.set_axis_off()
    for layer, ink in zip(LAYERS, LAYER_INKS, strict=True):
        lines = [line / scale + shift for name, line in sheet.lines if name == layer]
        axes.add_collection(LineCollection(lines, colors=ink, linewidths=0.5))
    inks = dict(zip(LAYERS, LAYER_INKS, strict=True))
    for word in sheet.words:
        size = float(np.clip(_word(sheet, word.layer) / scale, LEAST_WORD, LARGEST_WORD))
        x, y = np.asarray(word.place) / scale + shift
        look: dict[str, Any] = {
            "rotation": word.angle,
            "rotation_mode": "anchor",
            "family": "DejaVu Sans",
            "color": inks[word.layer],
        }
        axes.text(x, y, word.text, fontsize=size / POINT_LENGTH / 0.73, ha="center", va="center", **look)
    whole = f"1:{scale:g}"
    axes.text(
        SHEET_MARGIN,
        SHEET_MARGIN,
        f"{sheet.title}   {whole}   lengths in mm   {MADE_BY}",
        fontsize=8,
        family="DejaVu Sans",
    )
    bar = 10 ** np.floor(np.log10(60 * scale)) / scale  # a round length, at most 60 mm on paper
    axes.plot([wide - SHEET_MARGIN - bar, wide - SHEET_MARGIN], [SHEET_MARGIN, SHEET_MARGIN], color="0", linewidth=2)
    axes.text(
        wide - SHEET_MARGIN, SHEET_MARGIN + 2, f"{bar * scale:g} mm", fontsize=8, ha="right", family="DejaVu Sans"
    )
    return figure
