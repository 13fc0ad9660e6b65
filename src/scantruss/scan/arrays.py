"""Points of NPY and NPZ files: an (N, 3) array, or the first three columns of a wider one."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np

from ..errors import FormatError
from .kinds import read_head, wrong_kind


def read_npy(path: Path) -> np.ndarray:
    """Return the points of an NPY file, (N, 3) [scan unit]."""
    head = read_head(path)
    if not head.startswith(b"\x93NUMPY"):
        raise wrong_kind(path, head, "an NPY file")
    try:
        array = np.load(path, allow_pickle=False)
    except (ValueError, EOFError, SyntaxError) as error:
        raise FormatError(f"{path} cannot be read as NPY ({str(error).splitlines()[0][:120]})") from None
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
        with np.load(path, allow_pickle=False) as arrays:
            for name in arrays.files:
                try:
                    array = arrays[name]
                except ValueError as error:
                    if "allow_pickle" not in str(error):
                        raise
                    continue
                points = _coordinates(array) if isinstance(array, np.ndarray) else None
                if points is not None:
                    return points
                held.append(f"{name} {getattr(array, 'shape', '')}")
    except (ValueError, EOFError, SyntaxError, zipfile.BadZipFile, NotImplementedError) as error:
        raise FormatError(
            f"{path} cannot be read as NPZ ({(str(error).splitlines() or ['damaged'])[0][:120]})"
        ) from None
    raise FormatError(f"{path} must hold an array of shape (N, 3) or wider, got {', '.join(held)[:200] or 'none'}")


def _coordinates(array: np.ndarray) -> np.ndarray | None:
    """Return x, y, z of an array with columns or with fields of these names; None where it has neither."""
    if array.dtype.names and array.ndim == 1 and {"x", "y", "z"} <= set(array.dtype.names):
        if any(array.dtype[axis].kind not in "fiu" or array.dtype[axis].shape for axis in "xyz"):
            return None
        return np.column_stack([array[axis] for axis in "xyz"])
    if array.ndim == 2 and array.shape[1] >= 3 and array.dtype.kind in "fiu":
        return array[:, :3]
    return None
