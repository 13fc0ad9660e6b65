"""The command ``scantruss print``: watertight solids of a saved grid or structure."""

from __future__ import annotations

from argparse import ArgumentTypeError, Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import InputError, words_of_number
from .grids import add_grid, read_grid_or_structure
from .outputs import claim, outs_of

if TYPE_CHECKING:
    from ..export.printed.plates import Bed
    from ..grid.grid import Grid
    from .options import Parser


def print_parser() -> Parser:
    """Options of ``scantruss print``."""
    from .options import Parser, add_outs, number, scale

    usage = "GRID|STRUCTURE OUT.3mf|OUT.stl --member-diameter D --node-diameter D [--scale S] [--marks] [--bed WxDxH] [--sockets]"
    about = (
        "Make watertight solids of members and nodes for a 3D printer: one solid, or parts with plug joints that fit the bed,\n"
        "or balls with sockets for rods. Lengths are those of the model, in the unit of the grid."
    )
    parser = Parser("print", usage, about)
    add_grid(parser, "grid or structure saved as .json by scantruss grid or structure (a structure is in metres)")
    add_outs(parser, "model, .3mf or .stl", "?")
    parser.add_argument(
        "--member-diameter",
        metavar="D",
        type=number,
        required=True,
        help="diameter of the members of the model",
    )
    parser.add_argument("--node-diameter", metavar="D", type=number, required=True, help="diameter of the nodes")
    parser.add_argument(
        "--scale", metavar="S", type=scale, default=1.0, help="scale of the model, 0.01 or 1:100 (default 1)"
    )
    parser.add_argument(
        "--marks", action="store_true", help="engrave the marks of nodes on their balls, and of members along them"
    )
    parser.add_argument(
        "--bed",
        metavar="WxDxH",
        type=bed,
        help="cut the model into parts that fit the bed, with plug joints; each full bed is a file OUT_1, OUT_2, ...",
    )
    parser.add_argument(
        "--sockets",
        action="store_true",
        help="make a ball with sockets for each node, OUT_N001, ..., and a list of rods",
    )
    parser.add_argument(
        "--clearance",
        metavar="C",
        type=number,
        help="gap between a peg or rod and its socket, all around (default 0.15 members)",
    )
    parser.add_argument("--keep-failed", action="store_true", help="also print a grid that failed its certificate")
    return parser


def bed(text: str) -> Bed:
    """Return width, depth and height of "200x200x180"."""
    try:
        wide, deep, high = (float(side) for side in text.lower().split("x"))
    except ValueError:
        raise ArgumentTypeError(f"needs width, depth and height such as 200x200x200, got {text!r}") from None
    return wide, deep, high


def print_solid(values: Namespace) -> None:
    """Make the printable model of a saved grid."""
    from ..export.printed.apart import print_apart
    from ..report.terminal import Bars, print_lines
    from ..runtime.files import SaveTogether
    from ..runtime.places import check_place
    from ..structure.layered import grid_in_metres
    from ..structure.truss import Truss

    outs = [check_place(out, (".3mf", ".stl")) for out in outs_of(values)]
    if not Path(values.grid).exists():
        raise InputError(f"there is no file {values.grid}; print needs a grid saved as .json by scantruss grid")
    taken = {Path(values.grid).resolve(): "grid"}
    for out in outs:
        claim(out, "model", taken, force=values.force)
    what, _ = read_grid_or_structure(values.grid, values.merge, values.keep_failed)
    result = grid_in_metres(what) if isinstance(what, Truss) else what
    if values.bed is not None or values.sockets:
        _print_parts(result, outs, values)
        return
    if values.clearance is not None:
        raise InputError("--clearance is between pegs or rods and their sockets; give --bed or --sockets too")
    with Bars() as bars, SaveTogether("" if values.force else "result") as save:
        for number, out in enumerate(outs):
            bars("solid", number / len(outs))
            solid = print_apart(
                result,
                save.beside(out),
                member_diameter=values.member_diameter,
                node_diameter=values.node_diameter,
                scale=values.scale,
                marks=values.marks,
                keep_failed=values.keep_failed,
            )
    size = " x ".join(words_of_number(side, 4) for side in solid.vertices.max(axis=0) - solid.vertices.min(axis=0))
    bodies = "one watertight solid" if solid.components == 1 else f"{solid.components} watertight solids"
    notes = [note for out in outs for note in model_note(out, solid.unit)]
    print_lines([*solid.notes, *notes, f"wrote {' '.join(map(str, outs))}: {bodies}, {size} {solid.unit}".rstrip()])


def _print_parts(grid: Grid, outs: list[Path], values: Namespace) -> None:
    """Make the printable model in parts."""
    from ..export.printed.apart import print_parts_apart
    from ..report.terminal import Bars, print_lines
    from ..runtime.files import SaveTogether

    names = ("member_diameter", "node_diameter", "scale", "bed", "sockets", "clearance", "marks", "keep_failed")
    options = {name: getattr(values, name) for name in names}
    with Bars() as bars, SaveTogether("" if values.force else "result") as save:
        for number, out in enumerate(outs):
            bars("solids", number / len(outs))
            made = print_parts_apart(grid, save.beside(out), **options)
    size = " x ".join(words_of_number(side, 4) for side in made.size)
    what = "balls with sockets" if values.sockets else "parts with plug joints"
    notes = [note for out in outs for note in model_note(out, made.unit)]
    files = f"{len(made.files):,} files, {made.files[0]} to {made.files[-1]}"
    print_lines([*made.notes, *notes, f"wrote {files}: {made.parts:,} {what}, the largest {size} {made.unit}".rstrip()])


def model_note(out: Path, unit: str) -> list[str]:
    """Note on the unit that a printer will assume."""
    if out.suffix.lower() == ".stl" and unit != "mm":
        return [f"STL holds no unit and printers assume mm; its numbers are {unit or 'of a unit that is not known'}"]
    if not unit:
        return ["the unit of the grid is not known, so the model says mm; give it with scantruss grid --unit"]
    return []
