"""Points of NPY and NPZ files: an (N, 3) array, or the first three columns of a wider one."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import IO, Any

import numpy as np

from ...errors import FormatError
from ...runtime.ours import CLOUD_MARK
from ..units import metres_of
from .columns import find_attributes
from .content import Cloud, Content
from .kinds import read_head, reading_as, wrong_kind
from .packed import check_size

UNNAMED_ARRAY = "arr_0"  # the first array that was saved without a name
#: names of arrays of points, cleaned; the first that is there
POINTS = (
    "points", "xyz", "positions", "vertices", "coords", "coordinates", "pts", "position", "pos", "verts", "cloud", "pointcloud",
    "scan", "arr0",
)  # fmt: skip
NO_POINTS = re.compile("normal|nxyz|colou?r|rgb|face|triangle|cell|edge")  # somewhere in a name
LARGEST_MATRIX = 4  # rows of a camera, a rotation or a pose
MOST_TURNED = 6  # rows of an array whose columns are points, perhaps with normals


def read_npy(path: Path, wanted: Sequence[str] = ()) -> Content:
    """Return the points of an NPY file, and the wanted attributes where it has fields of these names."""
    head = read_head(path)
    if not head.startswith(b"\x93NUMPY"):
        raise wrong_kind(path, head, "an NPY file")
    with reading_as(path, "NPY"), path.open("rb") as file:
        check_claim(path, file, path.stat().st_size)
        array = np.load(file, allow_pickle=False)
    content = _content(array, wanted)
    if content is None:
        if is_turned(array.shape):
            raise FormatError(f"{path} has points in columns, shape {array.shape}; transpose it to (N, 3)")
        raise FormatError(f"{path} must hold numbers of shape (N, 3) or wider, got {array.dtype} {array.shape}")
    return content


def read_array_header(file: IO[bytes]) -> tuple[tuple[int, ...], bool, np.dtype[Any]]:
    """Return shape, whether the columns stand one after the other, and type of an NPY file that is open at its start."""
    version = np.lib.format.read_magic(file)
    read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, by_columns, kind = read(file)
    return shape, by_columns, kind


def check_claim(path: Path, file: IO[bytes], size: int) -> None:
    """Refuse an array whose header promises more than the `size` bytes there are, before room is made for it; rewinds."""
    shape, _, kind = read_array_header(file)
    promised, got = math.prod(shape) * kind.itemsize, size - file.tell()
    if promised > got and not kind.hasobject:
        raise FormatError(
            f"{path} ends early: its header promises an array {shape} of {promised:,} bytes, got {got:,}; copy it again"
        )
    file.seek(0)


def read_npz(path: Path, wanted: Sequence[str] = ()) -> Content:
    """Return the points of an NPZ file: the array with a fitting name, or the only one with a fitting shape.

    An array `unit` gives the unit.
    """
    head = read_head(path)
    if not head.startswith(b"PK"):
        raise wrong_kind(path, head, "an NPZ file")
    with reading_as(path, "NPZ"), path.open("rb") as file, np.load(file, allow_pickle=False) as arrays:
        check_size(path, sum(member.file_size for member in arrays.zip.infolist()))
        name, notes = _name_of_points(arrays, path)
        content = _content(_member(arrays, name, path), wanted)
        assert content is not None
        return replace(content, metres=_metres(arrays, path), notes=notes)


def _name_of_points(arrays: Any, path: Path) -> tuple[str, tuple[str, ...]]:
    """Return the name of the array that holds the points, and notes; only names and headers are read, as arrays may be large."""
    fitting, held = [], []
    for name in arrays.files:
        shape, kind = _shape_of(arrays, name, path)
        held.append(f"{name} {'' if shape is None else shape}".strip())
        if shape is not None and kind is not None and holds_points(shape, kind) and not NO_POINTS.search(_plain(name)):
            fitting.append((name, shape))
    by_name = {_plain(name): name for name, _ in reversed(fitting)}
    best = next((by_name[known] for known in POINTS if known in by_name), None)
    large = [name for name, shape in fitting if shape[0] > LARGEST_MATRIX] or [name for name, _ in fitting]
    if best is None and len(large) == 1:
        best = large[0]
    if best is not None:
        others = [name for name in large if name != best]
        known = best != UNNAMED_ARRAY or not others
        return best, () if known else (f"the points of {path.name} are taken from {best}, and not {' '.join(others)}",)
    if large:
        raise FormatError(
            f"{path} has several arrays that may be the points, {', '.join(large)[:200]}; name the one that is `points`"
        )
    got = ", ".join(held)[:200] or "none"
    raise FormatError(f"{path} must hold an array of shape (N, 3) or wider that may be points, got {got}")


def _plain(name: str) -> str:
    return re.sub(r"[^0-9a-z]", "", name.lower())


def _shape_of(arrays: Any, name: str, path: Path) -> tuple[tuple[int, ...] | None, np.dtype[Any] | None]:
    """Return shape and type of an array of an archive by its header; None if it is no array."""
    if (inside := f"{name}.npy") not in arrays.zip.namelist():
        return None, None
    with arrays.zip.open(inside) as file:
        check_claim(path, file, arrays.zip.getinfo(inside).file_size)
        shape, _, kind = read_array_header(file)
    return shape, kind


def metres_of_npz(path: Path) -> float | None:
    """Return the metres of the unit that an NPZ file names, without reading its points; None if it names none."""
    with suppress(Exception), path.open("rb") as file, np.load(file, allow_pickle=False) as arrays:
        return _metres(arrays, path)
    return None  # damaged: reading its points reports how


def _member(arrays: Any, name: str, path: Path) -> np.ndarray | None:
    """Return an array of an archive; None if it holds Python objects or is no array."""
    if (inside := f"{name}.npy") in arrays.zip.namelist():
        with arrays.zip.open(inside) as file:
            check_claim(path, file, arrays.zip.getinfo(inside).file_size)
    try:
        array = arrays[name]
    except ValueError as error:
        if "allow_pickle" in str(error):
            return None
        raise
    return array if isinstance(array, np.ndarray) else None


def _metres(arrays: Any, path: Path) -> float | None:
    """Return the unit that an archive names in an array `unit`."""
    unit = _member(arrays, "unit", path) if "unit" in arrays else None
    return metres_of(str(unit)) if unit is not None and unit.dtype.kind == "U" and unit.ndim == 0 else None


def holds_points(shape: tuple[int, ...], kind: np.dtype[Any]) -> bool:
    """Whether an array has x, y, z of points in its columns or in fields of these names."""
    if kind.names:
        named = all(axis in kind.names and kind[axis].kind in "fiu" and not kind[axis].shape for axis in "xyz")
        return len(shape) == 1 and named
    return len(shape) == 2 and shape[1] >= 3 and kind.kind in "fiu" and not is_turned(shape)


def is_turned(shape: tuple[int, ...]) -> bool:
    """Whether x, y, z are the rows of an array, one column a point."""
    return len(shape) == 2 and 3 <= shape[0] <= MOST_TURNED < shape[1]


def _content(array: np.ndarray | None, wanted: Sequence[str]) -> Content | None:
    """Return x, y, z of an array with columns or with fields of these names; None if it has neither."""
    if array is None or not holds_points(array.shape, array.dtype):
        return None
    if not (names := array.dtype.names):
        return Content(array[:, :3])
    found = {attribute: names[place] for attribute, place in find_attributes(names, wanted).items()}
    if any(array.dtype[name].kind not in "fiu" or array.dtype[name].shape for name in found.values()):
        return None
    points = np.column_stack([array[axis] for axis in "xyz"])
    return Content(points, {attribute: array[name] for attribute, name in found.items()})


def write_npy(path: Path, cloud: Cloud) -> None:
    """Write coordinates and normals as columns; the format has no place for the unit."""
    with path.open("wb") as file:
        np.save(file, np.ascontiguousarray(cloud.columns))


def write_npz(path: Path, cloud: Cloud) -> None:
    """Write the arrays points, normals and unit."""
    arrays: dict[str, Any] = {"points": cloud.points, "unit": np.array(cloud.unit), "made_by": np.array(CLOUD_MARK)}
    if cloud.normals is not None:
        arrays["normals"] = cloud.normals
    with path.open("wb") as file:
        np.savez_compressed(file, **arrays)
