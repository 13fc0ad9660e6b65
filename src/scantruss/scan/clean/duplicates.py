"""Duplicate points: stored twice, or measured again at the same place."""

from __future__ import annotations

import numpy as np

from ...kernels.geometry.kd_tree import nearest_of_places
from ...kernels.scan import duplicates as kernels
from ...runtime.parallel import in_parts
from .nearby import build_kd_tree

POINTS_CHECKED_FIRST = 500  # points checked for duplicates before all are
REPEATED_SHARE = 0.01  # share of these that must be repeated
COMPARED_POINTS_PER_THREAD = 50_000  # fewest points that are worth a thread
REPEATS_MEASURED = 16  # the spacing is still measured if points are repeated almost this often
POINTS_FOR_SPACING_OF_REPEATED = 300  # points at which the spacing is measured
DENSEST_SHARE = 0.05  # share of the points that lie closer than what counts as the spacing here


def find_repeated(points: np.ndarray) -> np.ndarray:
    """Return which points are repeats of an earlier one, to the last bit (N,) bool."""
    repeated = np.zeros(len(points), np.bool_)
    slots = np.full(1 << max(int(2 * len(points) - 1).bit_length(), 4), -1, np.int64)
    points = np.ascontiguousarray(points, np.float64)
    kernels.mark_repeats(points, points.view(np.int64), slots, repeated)
    return repeated


def has_repeats(points: np.ndarray) -> bool:
    """Whether enough points are repeated to check all; takes a hundredth of the time of checking all."""
    points = np.ascontiguousarray(points, np.float64)
    chosen = np.linspace(0, len(points) - 1, min(len(points), POINTS_CHECKED_FIRST)).astype(np.int64)
    slots = np.full(1 << 12, -1, np.int64)
    bits = points.view(np.int64)
    repeats = [kernels.enter_points(points, bits, np.unique(chosen), slots)]
    in_parts(
        len(points),
        COMPARED_POINTS_PER_THREAD,
        lambda _, begin, end: repeats.append(kernels.count_repeats(points, bits, slots, begin, end)),
    )
    return sum(repeats) > REPEATED_SHARE * len(chosen)


def find_near_duplicates(points: np.ndarray, share: float) -> np.ndarray:
    """Return which points lie within a share of the spacing from an earlier one that stays (N,) bool.

    The spacing is that of the densest part, so that no dense part of an uneven scan is thinned.
    """
    radius = share * _densest_spacing(points)
    left_out = np.zeros(len(points), np.bool_)
    if radius <= 0.0 or len(points) < 3:
        return left_out
    lower = points.min(axis=0)
    size = np.ptp(points, axis=0).max() / radius
    if size > 1e15:  # boxes could not be numbered, and no two float64 lie that close
        return left_out
    slots = np.full(1 << max(int(2 * len(points) - 1).bit_length(), 4), -1, np.int64)
    following = np.full(len(points), -1, np.int64)
    kernels.mark_near(np.ascontiguousarray(points), lower, radius, slots, following, left_out)
    return left_out


def _densest_spacing(points: np.ndarray) -> float:
    """Mean spacing in the densest twentieth of a scan, from the sixteenth nearest point, so that a few copies do not matter."""
    rank = min(REPEATS_MEASURED, len(points) - 1)
    if rank < 1:
        return 0.0
    places = np.ascontiguousarray(
        points[np.linspace(0, len(points) - 1, min(len(points), POINTS_FOR_SPACING_OF_REPEATED)).astype(np.int64)]
    )
    squares, which = np.empty(len(places)), np.empty(len(places), np.int64)
    nearest_of_places(build_kd_tree(points), places, rank + 1, squares, which)
    return float(np.sqrt(np.quantile(squares, DENSEST_SHARE) * np.pi / rank))
