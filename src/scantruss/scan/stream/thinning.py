"""Thinning to one point per search box, with memory for the boxes only: at once, in parts, or by several workers.

Sums are whole numbers and ties are settled by the coordinates, so the result is the same to the byte for any order and size of the
parts.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from ...errors import InputError
from ...kernels.scan.thinning import (
    BOX_COUNTS,
    BoxTable,
    add_points,
    add_rows,
    choose_boundary_points,
    fill_slots,
    middles,
    take_nearest,
)
from ...runtime.jit import new_record
from ...runtime.parallel import run_in_parts
from ..checks import LIKELY_CAUSE

FIRST_ROWS = 4096  # rows of a new table
TABLE_GROWTH = 1.5  # factor by which a full table grows
BOXES_PER_THREAD = 20_000  # fewest boxes that are worth a thread


class BoxRows(NamedTuple):
    """The boxes of a part of a scan, in the order of their numbers; the result of a worker."""

    rows: np.ndarray  #: (C, 7) int64, see `BoxTable`
    extremes: np.ndarray  #: (C, 18) float64, or (0, 18)
    points: int  #: points that were looked at
    dropped: int  #: of these, points with NaN or infinite coordinates


class Nearest(NamedTuple):
    """The points of a part of a scan nearest to the means of some boxes."""

    row: np.ndarray  #: (K,) int64 numbers of the boxes
    best: np.ndarray  #: (K, 4) float64 squared distance, x, y, z


class Thinning:
    """Boxes to which points are added, part by part.

    Parameters
    ----------
    spacing : float
        Side of a box [scan unit].
    boundary : bool
        Keep the extremes of each box too, so that `points_at_boundary` can find the boundary.
    """

    def __init__(self, spacing: float, *, boundary: bool = False) -> None:
        self.spacing = check_spacing(spacing)
        self.boundary = boundary
        self.points = 0
        self._table = _new_table(FIRST_ROWS, boundary)

    @property
    def dropped(self) -> int:
        """Points left out because a coordinate was NaN or infinite."""
        return int(self._table.counts.not_finite)

    def add(self, points: np.ndarray) -> None:
        """Add points (N, 3) float64 in the scan's own frame [scan unit].

        Raises
        ------
        InputError
            The spacing is too small for coordinates so far from zero.
        """
        points = np.ascontiguousarray(points, np.float64)
        begin = 0
        while (begin := add_points(self._table, points, begin, self.spacing)) < len(points):
            self._grow()
        if self._table.counts.too_far:
            most = np.abs(points[np.isfinite(points).all(axis=1)]).max(initial=0.0)
            raise InputError(
                f"spacing {self.spacing:g} is too small for points so far from zero, up to {most:.3g}; use a larger one, or where"
                f" no part of the scan lies there {LIKELY_CAUSE} (--crop leaves these out)"
            )
        self.points += len(points)

    def add_rows(self, part: BoxRows) -> None:
        """Add the boxes of another worker."""
        begin = 0
        while (begin := add_rows(self._table, part.rows, part.extremes, begin)) < len(part.rows):
            self._grow()
        self._table.counts.not_finite += part.dropped
        self.points += part.points

    def _grow(self) -> None:
        """Make room for more boxes; old arrays are released as early as possible."""
        slots, rows, extremes, counts = self._table
        del self._table
        count, capacity = int(counts.rows), int(TABLE_GROWTH * len(rows))
        few = _slots_for(capacity) > len(slots)
        if few:
            del slots
        rows = _longer(rows, count, capacity)
        extremes = _longer(extremes, count, capacity if self.boundary else 0)
        if few:
            slots = np.full(_slots_for(capacity), -1, np.int64)
            fill_slots(slots, rows, count)
        self._table = BoxTable(slots, rows, extremes, counts)

    def take_rows(self) -> BoxRows:
        """Return all boxes sorted by their numbers i, j, k, the same for any order of the points; none are left here."""
        table, count = self._table, int(self._table.counts.rows)
        rows, extremes = table.rows[:count], table.extremes[:count]
        order = np.lexsort((rows[:, 2], rows[:, 1], rows[:, 0]))
        for column in (*rows.T, *extremes.T):  # in place: they may fill the memory
            column[:] = column[order] if len(column) else 0
        found = BoxRows(rows, extremes, self.points, self.dropped)
        self._table, self.points = _new_table(FIRST_ROWS, self.boundary), 0
        return found


def thin_points(points: np.ndarray, spacing: float, *, keep: str = "mean", boundary: bool = False) -> np.ndarray:
    """Return one point for each box of points in memory, (C, 3) [scan unit].

    Parameters
    ----------
    points : (N, 3) array [scan unit]
        In the frame whose zero is a corner of the boxes.
    spacing : side of a box [scan unit]
    keep : "mean" of the points in a box, or the one "nearest" to it
    boundary : also keep the outermost points of boxes at the boundary
    """
    thinning = Thinning(spacing, boundary=boundary)
    thinning.add(points)
    rows = thinning.take_rows()
    chosen = means_of(rows.rows, spacing)
    if keep == "nearest":
        found = nearest_in([np.ascontiguousarray(points, np.float64)], rows.rows, spacing)
        chosen = nearest_of_parts(len(rows.rows), [found])
    return np.concatenate([chosen, points_at_boundary(rows, spacing)]) if boundary else chosen


def check_spacing(spacing: float) -> float:
    """Return the spacing, or refuse it."""
    if not (isinstance(spacing, int | float) and math.isfinite(spacing) and spacing > 0):
        raise InputError(f"spacing must be a positive number in the scan's unit, got {spacing}")
    return float(spacing)


def means_of(rows: np.ndarray, spacing: float) -> np.ndarray:
    """Return the mean of the points in each box, (C, 3) [scan unit]."""
    means = np.empty((len(rows), 3))
    middles(rows, spacing, means)
    return means


def points_at_boundary(rows: BoxRows, spacing: float) -> np.ndarray:
    """Return the points that represent the boundary of the scan, each once, (R, 3) [scan unit].

    The mean of a box at the boundary lies up to half a box inside; its outermost points do not.
    """
    kept = np.zeros((len(rows.rows), 6), np.int64)
    counts = new_record(BOX_COUNTS)
    counts.rows = len(rows.rows)
    table = BoxTable(_filled_slots(rows.rows), rows.rows, rows.extremes, counts)
    means = means_of(rows.rows, spacing)
    run_in_parts(len(kept), BOXES_PER_THREAD, choose_boundary_points, table, means, spacing, kept)
    several = rows.rows[:, 3] > 1  # a single point is its own mean
    return np.unique(rows.extremes.reshape(-1, 6, 3)[kept.astype(bool) & several[:, None]], axis=0)


def nearest_in(chunks: Iterable[np.ndarray], rows: np.ndarray, spacing: float) -> Nearest:
    """Return the points of a part of a scan that are nearest to the means of their boxes.

    Parameters
    ----------
    chunks : iterable of (N, 3) float64 arrays [scan unit]
        The part.
    rows : (C, 7) int64 array
        All boxes of the whole scan.
    spacing : side of a box [scan unit]
    """
    best = np.full((len(rows), 4), np.inf)
    slots, means = _filled_slots(rows), means_of(rows, spacing)
    for points in chunks:
        take_nearest(slots, rows, means, points, spacing, best)
    found = np.flatnonzero(np.isfinite(best[:, 0]))
    return Nearest(found, best[found])


def nearest_of_parts(count: int, parts: Iterable[Nearest]) -> np.ndarray:
    """Return the nearest point of each of `count` boxes, (count, 3), from those of the parts of a scan.

    Raises
    ------
    InputError
        A box has none: the file has changed since its boxes were found.
    """
    best = np.full((count, 4), np.inf)
    for part in parts:
        held, new = best[part.row], part.best
        better = np.zeros(len(new), bool)
        same = np.ones(len(new), bool)
        for c in range(4):
            better |= same & (new[:, c] < held[:, c])
            same &= new[:, c] == held[:, c]
        best[part.row[better]] = new[better]
    if not np.isfinite(best[:, 0]).all():
        raise InputError("the scan has changed while it was read; thin it again while nothing writes to it")
    return np.ascontiguousarray(best[:, 1:])


def _new_table(capacity: int, boundary: bool) -> BoxTable:
    return BoxTable(
        np.full(_slots_for(capacity), -1, np.int64),
        np.empty((capacity, 7), np.int64),
        np.empty((capacity if boundary else 0, 18)),
        new_record(BOX_COUNTS),
    )


def _slots_for(capacity: int) -> int:
    return 1 << max(int(1.5 * capacity - 1).bit_length(), 4)


def _longer(array: np.ndarray, count: int, capacity: int) -> np.ndarray:
    longer = np.empty((capacity, array.shape[1]), array.dtype)
    longer[: min(count, capacity)] = array[: min(count, capacity)]
    return longer


def _filled_slots(rows: np.ndarray) -> np.ndarray:
    slots = np.full(_slots_for(len(rows)), -1, np.int64)
    fill_slots(slots, rows, len(rows))
    return slots
