"""Points of NPY and NPZ files: an (N, 3) array, or the first three columns of a wider one."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import FormatError
from .kinds import read_head, unreadable, wrong_kind


def read_npy(path: Path) -> np.ndarray:
    """Return the points of an NPY file, (N, 3) [scan unit]."""
    head = read_head(path)
    if not head.startswith(b"\x93NUMPY"):
        raise wrong_kind(path, head, "an NPY file")
    try:
        with path.open("rb") as file:
            array = np.load(file, allow_pickle=False)
    except Exception as error:  # a damaged header ends in many ways
        raise unreadable(path, "NPY", error) from None
    points = _coordinates(array)
    if points is None:
        raise FormatError(f"{path} must hold numbers of shape (N, 3) or wider, got {array.dtype} {array.shape}")
    return points


def read_npz(path: Path) -> np.ndarray:
    """Return the first array of an NPZ file that can be points, (N, 3) [scan unit]."""
    head = read_head(path)
    if not head.startswith(b"PK"):
        raise wrong_kind(path, head, "an NPZ file")
    held = []
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as arrays:
            for name in arrays.files:
                array = _member(arrays, name)
                points = _coordinates(array) if array is not None else None
                if points is not None:
                    return points
                held.append(f"{name} {'' if array is None else array.shape}".strip())
    except Exception as error:  # a damaged archive ends in many ways
        raise unreadable(path, "NPZ", error) from None
    raise FormatError(f"{path} must hold an array of shape (N, 3) or wider, got {', '.join(held)[:200] or 'none'}")


def _member(arrays: Mapping[str, Any], name: str) -> np.ndarray | None:
    """Return an array of an archive; None where it holds Python objects or is no array."""
    try:
        array = arrays[name]
    except ValueError as error:
        if "allow_pickle" in str(error):
            return None
        raise
    return array if isinstance(array, np.ndarray) else None


def _coordinates(array: np.ndarray) -> np.ndarray | None:
    """Return x, y, z of an array with columns or with fields of these names; None where it has neither."""
    if array.dtype.names and array.ndim == 1 and {"x", "y", "z"} <= set(array.dtype.names):
        if any(array.dtype[axis].kind not in "fiu" or array.dtype[axis].shape for axis in "xyz"):
            return None
        return np.column_stack([array[axis] for axis in "xyz"])
    if array.ndim == 2 and array.shape[1] >= 3 and array.dtype.kind in "fiu":
        return array[:, :3]
    return None
