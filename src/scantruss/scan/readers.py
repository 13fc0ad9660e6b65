"""From a file to a PointCloud: the table of formats and `read_points`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from ..errors import FormatError, InputError
from ..settings import UNITS
from .arrays import read_npy, read_npz
from .cloud import PointCloud
from .extras import read_e57, read_pcd
from .kinds import read_head
from .las import read_las
from .ply import read_ply
from .solids import read_obj, read_off, read_stl
from .text import read_text

Reader = Callable[[Path], np.ndarray]

#: suffix -> function that returns the points of a file, (N, 3) numbers [scan unit]
READERS: dict[str, Reader] = {
    ".ply": read_ply,
    ".xyz": read_text, ".txt": read_text, ".csv": read_text, ".pts": read_text, ".asc": read_text,
    ".las": read_las, ".laz": read_las,
    ".obj": read_obj, ".stl": read_stl, ".off": read_off,
    ".npy": read_npy, ".npz": read_npz,
    ".e57": read_e57, ".pcd": read_pcd,
}  # fmt: skip


def read_points(path: str | Path, unit: str = "") -> PointCloud:
    """Return the points of a scan; the format is that of the suffix.

    Parameters
    ----------
    path : str or Path
        A file with one of the suffixes in `READERS`.
    unit : str
        Unit of the coordinates: mm, cm, m, inch, foot, or "" where it is not known.

    Returns
    -------
    PointCloud
        All points of the file in its order; faces, normals, colours and other properties are left aside.

    Raises
    ------
    FormatError
        The file is missing, empty, damaged, or of another kind than its suffix says.
    InputError
        Its points cannot be used: too few, mostly NaN, all on a line; or the unit is not known.
    """
    path = Path(path)
    if unit not in UNITS:
        raise InputError(f"unit must be one of {' '.join(u for u in UNITS if u)}, got {unit!r}")
    read_head(path)
    try:
        reader = READERS[path.suffix.lower()]
    except KeyError:
        known = " ".join(sorted(READERS))
        raise FormatError(f'no reader for "{path.suffix}" ({path.name}); use one of {known}') from None
    try:
        points = reader(path)
    except OSError as error:
        raise FormatError(f"{path} cannot be read: {error.strerror or ' '.join(str(error).split())}") from None
    except MemoryError:
        raise FormatError(f"{path} does not fit into the memory of this computer; thin the scan first") from None
    if not len(points):
        raise FormatError(f"{path} holds no points")
    return PointCloud.from_array(points, unit=unit, name=path.name)
