"""The table of formats a grid can be written in, and `write`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from ..errors import FormatError
from ..grid.grid import Grid
from ..runtime.files import check_place, write_files
from ..scan.cloud import PointCloud
from .csv import encode_csv, nodes_path
from .drawing.picture import encode_picture
from .json import encode_json
from .obj import encode_obj
from .ply import encode_ply
from .style import FileStyle

Encoder = Callable[[Grid, Path, PointCloud | None, FileStyle], dict[Path, bytes]]

#: suffix -> what the files of that format hold: pure functions of the grid, and of the cloud where it is drawn
GRID_FORMATS: dict[str, Encoder] = {
    ".csv": lambda grid, path, cloud, style: encode_csv(grid, path, decimal_comma=style.decimal_comma),
    ".json": lambda grid, path, cloud, style: {path: encode_json(grid)},
    ".obj": lambda grid, path, cloud, style: {path: encode_obj(grid, style.obj)},
    ".ply": lambda grid, path, cloud, style: {path: encode_ply(grid)},
    ".png": lambda grid, path, cloud, style: {path: encode_picture(grid, cloud, style=style)},
}

SOLID_SUFFIXES = (".3mf", ".stl")


def check_output(path: str | Path) -> Path:
    """Return the path if a grid can be written there; called before the long work starts.

    Raises
    ------
    FormatError
        The suffix is unknown, the folder does not exist or cannot be written to, or a folder has this name.
    """
    path = Path(path)
    if path.suffix.lower() in SOLID_SUFFIXES:
        raise FormatError(
            f'no format for "{path.suffix}" of a grid; use one of {" ".join(sorted(GRID_FORMATS))}, '
            f"or write a .json and make the solid from it with: scantruss print"
        )
    path = check_place(path, GRID_FORMATS)
    if path.suffix.lower() == ".csv":
        check_place(nodes_path(path), (".csv", path.suffix))
    return path


def write(
    grid: Grid, path: str | Path, *, cloud: PointCloud | None = None, style: FileStyle | None = None
) -> list[Path]:
    """Write a grid; the suffix of the path tells the format.

    Parameters
    ----------
    grid : Grid
        What to write.
    path : str or Path
        File ending in .csv, .json, .obj, .ply or .png.
    cloud : PointCloud, optional
        The scan, drawn in the picture (.png).
    style : FileStyle, optional
        Views and size of a picture, faces or lines in OBJ, decimal comma in CSV.

    Returns
    -------
    list of Path
        The files written; two for .csv, one otherwise.

    Raises
    ------
    FormatError
        Unknown suffix, no such folder, no space; nothing half-written is left.
    """
    path = check_output(path)
    return write_files(GRID_FORMATS[path.suffix.lower()](grid, path, cloud, style or FileStyle()))
