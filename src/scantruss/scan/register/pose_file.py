"""Files of poses: what a splice writes, and what it can start from."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import FormatError
from .poses import make_pose, quaternion_of

LARGEST_SKEW = 1e-3  # deviation from a rotation above which the file is refused


def read_poses(path: str | Path) -> dict[str, np.ndarray]:
    """Return the poses (4, 4) in a JSON file by the name of the scan.

    It may be one that a splice has written, or an object of scans by name, each a 4 x 4 matrix or an object with a ``matrix``, or with a
    rotation ``R`` (3 x 3) and a translation ``t`` (3). A pose takes a place in the scan's own frame to the common one.

    Raises
    ------
    FormatError
        The file cannot be read or holds something else.
    """
    try:
        values = json.loads(Path(path).read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise FormatError(f"cannot read poses {path}: {error.strerror}") from None
    except (ValueError, RecursionError) as error:
        raise FormatError(f"{path} is not a JSON file of poses: {error}") from None
    scans = values.get("scans", values) if isinstance(values, dict) else None
    if not isinstance(scans, dict) or not scans:
        raise FormatError(f'{path} holds no poses; it needs an object of scans by name, each with a 4 x 4 "matrix"')
    return {name: _pose_of(value, f"{path}, {name}") for name, value in scans.items()}


def _pose_of(value: Any, where: str) -> np.ndarray:
    """Return the pose that a value of a file stands for."""
    try:
        if isinstance(value, dict) and "R" in value:
            pose = make_pose(np.array(value["R"], float).reshape(3, 3), np.array(value["t"], float).reshape(3))
        else:
            pose = np.array(value["matrix"] if isinstance(value, dict) else value, float)
    except (KeyError, TypeError, ValueError):
        pose = np.empty(0)
    if pose.shape != (4, 4) or not np.isfinite(pose).all():
        raise FormatError(f"{where}: needs a 4 x 4 matrix of numbers, or a rotation R (3 x 3) and a translation t (3)")
    u, _, v = np.linalg.svd(pose[:3, :3])
    if (
        np.abs(u @ v - pose[:3, :3]).max() > LARGEST_SKEW
        or np.linalg.det(u @ v) < 0.0
        or np.abs(pose[3] - [0, 0, 0, 1]).max() > LARGEST_SKEW
    ):
        raise FormatError(
            f"{where}: the matrix is not a rigid motion; it needs a rotation and a translation, without scale"
        )
    return make_pose(u @ v, pose[:3, 3])


def pose_values(pose: np.ndarray) -> dict[str, Any]:
    """Return a pose as plain values: the matrix, and the same as quaternion (x, y, z, w) and translation."""
    return {
        "matrix": [[float(value) for value in row] for row in pose],
        "quaternion": [float(value) for value in quaternion_of(pose)],
        "translation": [float(value) for value in pose[:3, 3]],
    }
