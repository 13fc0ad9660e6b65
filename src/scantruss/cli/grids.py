"""Grids and structures that commands read: saved by ScanTruss, or drawn in other programs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..grid.grid import Grid
    from ..report.terminal import Bars
    from ..schedules.forces import Checked
    from ..structure.truss import Truss
    from .options import Parser

BYTES_OF_COMMENTS = 4_000  # bytes in which the comments of an OBJ or PLY of ours stand
BYTES_OF_HEAD = 200  # bytes of a file in which its format stands
DRAWN_SUFFIXES = ".obj .ply .dxf .3dm .ifc .compas.json"  # that `read_model` reads


def add_grid(parser: Parser, about: str, name: str = "grid", metavar: str = "GRID") -> None:
    """Add the argument of a grid, and how one that others drew is read."""
    from .options import number

    parser.add_argument(
        name, metavar=metavar, help=f"{about}, or lines or faces from another program: {DRAWN_SUFFIXES}"
    )
    parser.add_argument(
        "--merge",
        metavar="D",
        type=number,
        help="for lines from another program: ends closer than this become one node (default: median length/1000)",
    )


def read_saved_grid(path: str, merge: float | None, keep_failed: bool, bars: Bars | None = None) -> Grid:
    """Return the grid of a file; what is to be known of one that others drew is noted.

    Raises
    ------
    CertificateError
        It is a drawing of a grid that failed, which is not to be used all the same.
    """
    from ..export.formats import FORMATS, read_model
    from ..export.json import read_grid
    from ..report.terminal import print_lines
    from ..runtime.places import suffix_of

    if (row := FORMATS.get(suffix_of(Path(path), FORMATS))) is None or row.draw is None:
        return read_grid(path)
    check_drawing_passed(path, keep_failed)
    model = read_model(path, merge)
    for note in model.notes:
        bars.note(note) if bars else print_lines([note])
    assert model.grid is not None  # drawings are no structures
    return model.grid


def read_grid_or_structure(
    path: str, merge: float | None, keep_failed: bool, bars: Bars | None = None
) -> tuple[Grid | Truss, Checked | None]:
    """Return what a file holds, and of a structure what it says of the checks."""
    from ..structure.json import STRUCTURE_FORMAT, read_checked

    with Path(path).open("rb") as file:
        if f'"{STRUCTURE_FORMAT}"'.encode() in file.read(BYTES_OF_HEAD):
            return read_checked(path)
    return read_saved_grid(path, merge, keep_failed, bars), None


def check_drawing_passed(path: str, keep_failed: bool) -> None:
    """Refuse an OBJ or PLY of a grid that failed its certificate, as its first lines say; what is no file is refused elsewhere.

    Raises
    ------
    CertificateError
        It did, and is not to be used all the same.
    """
    from ..errors import CertificateError
    from ..export.obj import FAILED_LINE

    if keep_failed or not Path(path).is_file():
        return
    with Path(path).open("rb") as file:
        first = file.read(BYTES_OF_COMMENTS).decode("latin-1").splitlines()
    if said := next((line for line in first if FAILED_LINE in line), ""):
        words = said.partition(FAILED_LINE)[2]
        raise CertificateError(f"{path} is of a grid that {FAILED_LINE}{words}; --keep-failed uses it anyway")
