"""From points to a file of a cloud: the table of formats and `write_points`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...errors import FormatError, InputError
from ...runtime.files import SaveTogether, check_place
from ...settings import UNITS
from ..units import check_unit
from .las_writer import write_las

CUT_SHORT = "only a part of it could be written; the disk may be full"


class Cloud(NamedTuple):
    """What a writer is given."""

    points: np.ndarray  #: (N, 3) float64 [unit], in the scan's own frame
    normals: np.ndarray | None  #: (N, 3)
    unit: str
    origin: np.ndarray | None  #: (3,) a place near the points

    @property
    def columns(self) -> np.ndarray:
        """Coordinates and, where they are known, normals; (N, 3) or (N, 6)."""
        return self.points if self.normals is None else np.column_stack([self.points, self.normals])

    def names(self, *normal: str) -> list[str]:
        """Names of the columns."""
        return ["x", "y", "z", *(() if self.normals is None else normal)]


def write_points(
    path: str | Path,
    points: np.ndarray,
    *,
    normals: np.ndarray | None = None,
    unit: str = "",
    origin: np.ndarray | None = None,
) -> None:
    """Write a cloud to exactly this path, whole or not at all; the format is that of the suffix.

    Parameters
    ----------
    path : str or Path
        One of the suffixes in `WRITERS`; `check_cloud_output` says beforehand whether it can be.
    points : (N, 3) array [unit]
        In the scan's own frame. Doubles are kept as they are, but for LAS and LAZ (to less than a thousandth of the
        spacing) and E57 (always metres).
    normals : (N, 3) array, optional
        Kept by all formats.
    unit : str
        Written where the format can say it; text files say it in the names of their columns (CSV) or in a comment.
    origin : (3,) array, optional
        A place near the points, from which LAS counts.

    Raises
    ------
    FormatError
        No writer for the suffix, or the file cannot be written.
    InputError
        Arrays of wrong shape, no points, or not finite.
    """
    path = Path(path)
    writer = _writer(path)
    cloud = Cloud(_checked(points, "points"), None if normals is None else _checked(normals, "normals"), unit, origin)
    if cloud.normals is not None and len(cloud.normals) != len(cloud.points):
        raise InputError(f"{len(cloud.points):,} points need as many normals, got {len(cloud.normals):,}")
    check_unit(unit)
    try:
        with SaveTogether() as save:
            writer(save.beside(path), cloud)
    except OSError as error:
        raise FormatError(f"cannot write {path}: {error.strerror or CUT_SHORT}") from None


def check_cloud_output(path: str | Path) -> Path:
    """Return the path of a cloud to be written; FormatError where its suffix or its folder will not do."""
    path = Path(path)
    _writer(path)
    return check_place(path, WRITERS)


def _writer(path: Path) -> Callable[[Path, Cloud], None]:
    try:
        return WRITERS[path.suffix.lower()]
    except KeyError:
        known = " ".join(sorted(WRITERS))
        raise FormatError(f'no format for a cloud "{path.suffix}" ({path.name}); use one of {known}') from None


def _checked(values: np.ndarray, what: str) -> np.ndarray:
    array = np.asarray(values, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != 3 or not len(array):
        raise InputError(f"{what} must have shape (N, 3), got {array.shape}")
    if not np.isfinite(array).all():
        raise InputError(f"{what} must be finite numbers")
    return array


def _write_ply(path: Path, cloud: Cloud) -> None:
    names = cloud.names("nx", "ny", "nz")
    unit = f"comment unit {cloud.unit}\n" if cloud.unit else ""
    properties = "".join(f"property double {name}\n" for name in names)
    head = f"ply\nformat binary_little_endian 1.0\n{unit}element vertex {len(cloud.points)}\n{properties}end_header\n"
    with path.open("wb") as file:
        file.write(head.encode())
        file.write(np.ascontiguousarray(cloud.columns, dtype="<f8").data)


def _write_pcd(path: Path, cloud: Cloud) -> None:
    names = cloud.names("normal_x", "normal_y", "normal_z")
    count, many = len(cloud.points), len(names)
    unit = f"# unit {cloud.unit}\n" if cloud.unit else ""
    head = (
        f"# .PCD v0.7 - Point Cloud Data file format\n{unit}VERSION 0.7\nFIELDS {' '.join(names)}\n"
        f"SIZE{' 8' * many}\nTYPE{' F' * many}\nCOUNT{' 1' * many}\nWIDTH {count}\nHEIGHT 1\n"
        f"VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {count}\nDATA binary\n"
    )
    with path.open("wb") as file:
        file.write(head.encode())
        file.write(np.ascontiguousarray(cloud.columns, dtype="<f8").data)


def _write_text(path: Path, cloud: Cloud) -> None:
    """Write numbers with as many digits as give back the same doubles."""
    sign = "," if path.suffix.lower() == ".csv" else " "
    with path.open("w", encoding="utf-8", newline="\n") as file:
        if sign == ",":
            unit = f" [{cloud.unit}]" if cloud.unit else ""
            axes, normal = (cloud.names("nx", "ny", "nz")[part] for part in (slice(3), slice(3, None)))
            file.write(sign.join([*(axis + unit for axis in axes), *normal]) + "\n")
        elif cloud.unit:
            file.write(f"# unit: {cloud.unit}\n")
        columns = cloud.columns
        for begin in range(0, len(columns), 1 << 16):
            rows = columns[begin : begin + (1 << 16)].tolist()
            file.writelines(sign.join(map(repr, row)) + "\n" for row in rows)


def _write_npy(path: Path, cloud: Cloud) -> None:
    with path.open("wb") as file:
        np.save(file, np.ascontiguousarray(cloud.columns))


def _write_npz(path: Path, cloud: Cloud) -> None:
    arrays: dict[str, Any] = {"points": cloud.points, "unit": np.array(cloud.unit)}
    if cloud.normals is not None:
        arrays["normals"] = cloud.normals
    with path.open("wb") as file:
        np.savez_compressed(file, **arrays)


def _write_las(path: Path, cloud: Cloud) -> None:
    write_las(path, cloud.points, cloud.normals, cloud.unit, cloud.origin)


def _write_e57(path: Path, cloud: Cloud) -> None:
    from .e57_writer import write_e57

    scale = UNITS[cloud.unit] or 1.0
    write_e57(path, cloud.points if scale == 1.0 else cloud.points * scale, cloud.normals)


#: suffix -> function that writes a cloud
WRITERS: dict[str, Callable[[Path, Cloud], None]] = {
    ".ply": _write_ply, ".pcd": _write_pcd, ".e57": _write_e57,
    ".las": _write_las, ".laz": _write_las,
    ".xyz": _write_text, ".txt": _write_text, ".csv": _write_text,
    ".npy": _write_npy, ".npz": _write_npz,
}  # fmt: skip
