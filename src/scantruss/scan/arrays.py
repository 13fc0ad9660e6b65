"""Points of NPY and NPZ files: an (N, 3) array, or the first three columns of a wider one."""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import IO, Any

import numpy as np

from ..errors import FormatError
from .content import Content, find_attributes
from .kinds import read_head, unreadable, wrong_kind
from .packed import check_size
from .units import metres_of


def read_npy(path: Path, wanted: Sequence[str] = ()) -> Content:
    """Return the points of an NPY file, and the wanted attributes where it has fields of these names."""
    head = read_head(path)
    if not head.startswith(b"\x93NUMPY"):
        raise wrong_kind(path, head, "an NPY file")
    try:
        with path.open("rb") as file:
            check_claim(path, file, path.stat().st_size)
            array = np.load(file, allow_pickle=False)
    except FormatError:
        raise
    except Exception as error:  # a damaged header ends in many ways
        raise unreadable(path, "NPY", error) from None
    content = _content(array, wanted)
    if content is None:
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
    """Return the first array of an NPZ file that can be points; an array `unit` says the unit."""
    head = read_head(path)
    if not head.startswith(b"PK"):
        raise wrong_kind(path, head, "an NPZ file")
    held = []
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as arrays:
            check_size(path, sum(member.file_size for member in arrays.zip.infolist()))
            for name in arrays.files:
                array = _member(arrays, name, path)
                content = _content(array, wanted) if array is not None else None
                if content is not None:
                    return replace(content, metres=_metres(arrays, path))
                held.append(f"{name} {'' if array is None else array.shape}".strip())
    except FormatError:
        raise
    except Exception as error:  # a damaged archive ends in many ways
        raise unreadable(path, "NPZ", error) from None
    raise FormatError(f"{path} must hold an array of shape (N, 3) or wider, got {', '.join(held)[:200] or 'none'}")


def metres_of_npz(path: Path) -> float | None:
    """Return the metres of the unit that an NPZ file names, without reading its points; None where it names none."""
    with suppress(Exception), path.open("rb") as file, np.load(file, allow_pickle=False) as arrays:
        return _metres(arrays, path)
    return None  # damaged in some way: reading its points says in which


def _member(arrays: Any, name: str, path: Path) -> np.ndarray | None:
    """Return an array of an archive; None where it holds Python objects or is no array."""
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


def _content(array: np.ndarray, wanted: Sequence[str]) -> Content | None:
    """Return x, y, z of an array with columns or with fields of these names; None where it has neither."""
    names = array.dtype.names
    if names and array.ndim == 1 and {"x", "y", "z"} <= set(names):
        found = {attribute: names[place] for attribute, place in find_attributes(names, wanted).items()}
        if any(array.dtype[name].kind not in "fiu" or array.dtype[name].shape for name in (*"xyz", *found.values())):
            return None
        points = np.column_stack([array[axis] for axis in "xyz"])
        return Content(points, {attribute: array[name] for attribute, name in found.items()})
    if array.ndim == 2 and array.shape[1] >= 3 and array.dtype.kind in "fiu":
        return Content(array[:, :3])
    return None
