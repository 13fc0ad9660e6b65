"""Streamlining (Sec. 2.2): one point stays in each search box."""

from __future__ import annotations

import numpy as np

from ...errors import InputError

MOST_BOXES = 2.0**20  # most boxes along an axis


def thin_to(points: np.ndarray, spacing: float) -> np.ndarray:
    """Return which points stay (N,) bool: of each search box as wide as the spacing the one nearest to the mean of its points."""
    if not spacing > 0:
        raise InputError(f"spacing must be a positive length in the scan's unit, got {spacing:g}")
    extent = float(np.ptp(points, axis=0).max())
    if extent > MOST_BOXES * spacing:
        raise InputError(
            f"spacing {spacing:g} is too small for a scan of {extent:.4g}; use at least {extent / MOST_BOXES:.2g}"
        )
    box = number_in_boxes(points, spacing)
    order = np.argsort(box, kind="stable")
    count = np.bincount(box)
    first = np.cumsum(count) - count
    mean = np.add.reduceat(points[order], first, axis=0) / count[:, None]
    group = box[order]
    away = ((points[order] - mean[group]) ** 2).sum(axis=1)
    best = np.lexsort((away, group))[first]
    stays = np.zeros(len(points), np.bool_)
    stays[order[best]] = True
    return stays


def number_in_boxes(points: np.ndarray, size: float) -> np.ndarray:
    """Return the number of each point's search box among those that hold points (N,) int64; at most `MOST_BOXES` along an axis."""
    box = np.floor((points - points.min(axis=0)) / size).astype(np.int64)
    return np.unique((box[:, 0] << 42) | (box[:, 1] << 21) | box[:, 2], return_inverse=True)[1]
