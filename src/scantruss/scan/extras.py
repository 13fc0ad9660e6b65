"""Points of E57 and PCD files, by packages that the core install does not hold."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import FormatError
from .kinds import kind_of, read_head, unreadable, wrong_kind


def read_e57(path: Path) -> np.ndarray:
    """Return the points of all scans of an E57 file in their common frame, (N, 3) float64 [m]."""
    head = read_head(path)
    if not head.startswith(b"ASTM-E57"):
        raise wrong_kind(path, head, "an E57 file")
    package = _package("e57", path)
    try:
        return np.asarray(package.read_points(str(path)).points, dtype=np.float64)
    except BaseException as error:
        raise unreadable(path, "E57", error) from None


def read_pcd(path: Path) -> np.ndarray:
    """Return the points of a PCD file (ascii, binary, compressed), (N, 3) float64 [scan unit]."""
    head = read_head(path)
    if kind_of(head) != "a PCD file":
        raise wrong_kind(path, head, "a PCD file")
    package = _package("pypcd4", path)
    try:
        cloud = package.PointCloud.from_path(path)
        points = np.asarray(cloud.numpy(("x", "y", "z")), dtype=np.float64)
        promised = int(cloud.metadata.points)
    except BaseException as error:
        raise unreadable(path, "PCD", error) from None
    if len(points) < promised:
        raise FormatError(
            f"{path} ends early: its header promises {promised:,} points, got {len(points):,}; copy it again"
        )
    return points


def _package(name: str, path: Path) -> Any:
    try:
        return importlib.import_module(name)
    except ImportError:
        raise FormatError(
            f'{path}: reading {path.suffix} needs the package {name}; python -m pip install "scantruss[scan]"'
        ) from None
