"""The command ``scantruss convert``: a grid or a structure in other formats."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from .grids import add_grid, check_drawing_passed
from .outputs import Taken, claim, outs_of
from .styles import add_styles, style_of

if TYPE_CHECKING:
    from ..export.model import Model
    from ..export.style import FileStyle
    from ..report.terminal import Bars
    from ..runtime.files import SaveTogether
    from .options import Parser


def convert_parser() -> Parser:
    """Options of ``scantruss convert``."""
    from ..export.style import IFC_EDITIONS, IFC_VIEWS, INP_PROGRAMS, STEP_PARTS
    from ..settings import UNITS
    from .options import Parser, add_outs, number
    from .schedule import tube

    parser = Parser(
        "convert",
        "FILE OUT [OUT ...] [options]",
        "Write a grid or a structure in other formats, such as .dxf, .ifc or .saf.xlsx.",
    )
    add_grid(parser, "saved as .json by scantruss grid or scantruss structure", "source", "FILE")
    add_outs(parser, "results; the suffix names the format", "*")
    parser.add_argument("--unit", metavar="|".join(filter(None, UNITS)), help="unit of a grid that has none")
    parser.add_argument(
        "--tube",
        metavar="DxT",
        type=tube,
        help="diameter and wall of the members of a grid, e.g. 60x3 [mm], for bodies in IFC and STEP",
    )
    parser.add_argument(
        "--ball", metavar="D", type=number, help="diameter of the nodes [mm] (default: twice that of the members)"
    )
    parser.add_argument(
        "--ifc", metavar="|".join(IFC_VIEWS), default="auto", help="what .ifc holds of a structure (default: both)"
    )
    parser.add_argument(
        "--ifc-schema", metavar="|".join(IFC_EDITIONS), default="IFC4", help="version of .ifc (default: IFC4)"
    )
    parser.add_argument("--step", metavar="|".join(STEP_PARTS), default="axes", help="what .step holds (default: axes)")
    parser.add_argument(
        "--inp", metavar="|".join(INP_PROGRAMS), default="abaqus", help="program that .inp is for (default: abaqus)"
    )
    parser.add_argument(
        "--system", metavar="EPSG:CODE", help="reference system, for .geojson and .ifc, of a scan that names none"
    )
    parser.add_argument("--keep-failed", action="store_true", help="also accept a grid that failed its certificate")
    add_styles(parser)
    return parser


def convert(values: Namespace) -> None:
    """Write what a file holds in other formats."""
    from ..export.formats import GRID, STRUCTURE, check_output, read_model
    from ..export.model import with_system, with_unit
    from ..grid.certificate import check_passed
    from ..report.terminal import Bars, print_lines
    from ..runtime.files import SaveTogether

    outs = [check_output(out, "") for out in outs_of(values)]
    style = style_of(
        values,
        tube=values.tube,
        ball=values.ball,
        ifc=values.ifc,
        ifc_schema=values.ifc_schema,
        step=values.step,
        inp=values.inp,
    )
    taken = {Path(values.source).resolve(): "file that is read"}
    claim_models(outs, taken, force=values.force)
    there = [str(out) for out in outs if out.is_file() and out.stat().st_size]
    with Bars() as bars, SaveTogether("" if values.force else "result") as save:
        bars("read", 0.0)
        check_drawing_passed(values.source, values.keep_failed)
        model = read_model(values.source, values.merge)
        for note in model.notes:
            bars.note(note)
        if values.unit is not None:
            model = with_unit(model, values.unit)
        if values.system is not None:
            model = with_system(model, values.system)
        if model.truss is None and model.grid is not None:
            check_passed(model.grid, values.keep_failed)
        for out in outs:
            check_output(out, GRID if model.truss is None else STRUCTURE)
        if model.truss is not None and any(out.suffix.lower() == ".json" for out in outs):
            bars.note("the checks of the members are not written again; scantruss structure writes them")
        written = write_models(model, outs, save, bars, style)
    panels = "panels" if model.grid is None else model.grid.panels_are
    size = f"{len(model.local):,} nodes, {len(model.members):,} members, {len(model.panels):,} {panels}"
    replaced = [f"in place of what ScanTruss wrote there before: {' '.join(there)}"] if there else []
    print_lines([size, f"wrote {' '.join(map(str, written))}", *replaced])


def claim_models(outs: list[Path], taken: Taken, *, force: bool, what: str = "result") -> None:
    """Claim the places of grids and structures, with those of the files that are written beside them."""
    from ..export.csv import nodes_path

    for out in outs:
        claim(out, what, taken, force=force)
        if out.suffix.lower() == ".csv":
            claim(nodes_path(out), "table of nodes", taken, force=force)


def write_models(
    model: Model,
    outs: list[Path],
    save: SaveTogether,
    bars: Bars,
    style: FileStyle | None = None,
    *,
    say_losses: bool = True,
) -> list[Path]:
    """Write a model in several formats, say once what each does not hold if that is wanted, and return the places of all files."""
    from ..export.formats import losses, shown_otherwise, write

    written: list[Path] = []
    for number, out in enumerate(outs):
        bars("write", number / len(outs))
        written += [out.with_name(file.name) for file in write(model, save.beside(out), style=style)]
        for note in (*(losses(model, out) if say_losses else ()), *shown_otherwise(model, out)):
            bars.note_once(note)
    return written
