"""Thinning a scan of any size: sums, extremes and nearest points of search boxes (Sec. 2, streamlining).

Boxes are cubes on a lattice through the zero of the scan's own frame, so that every part of a scan knows the same boxes. Sums are
integers (2**32 steps along the side of a box), so that they do not depend on the order of the points, nor on which worker adds
them.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...runtime.jit import kernel, record_type

STEPS_OF_BOX = 4294967296.0  # along the side of a box; 2**31 points fit into a box
FARTHEST_BOX = 4503599627370496.0  # boxes from the zero of the frame; beyond, a box is finer than float64
COUNT, SUMS = 3, 4  # columns of a row, behind the three numbers of the box
LARGEST_INT64 = 9223372036854775807  # int64
BOX_COUNTS = record_type(rows=np.int64, not_finite=np.int64, too_far=np.int64)  # rows in use; points left out
BOUNDARY_BOXES = 2  # boxes to every side that show whether a box is at the boundary
BLEND_RADIUS = 2.0  # radius about its mean within which the means of others count [box]
BOUNDARY_SHIFT = 0.25  # distance of their centre from its own mean above which a box is at the boundary [box]


class BoxTable(NamedTuple):
    """Occupied boxes in a hash table."""

    slots: np.ndarray  #: (H,) int64 row of the box in each slot, -1 free; H is a power of two, at least 1.5 C
    rows: np.ndarray  #: (C, 7) int64 box i, j, k; points in it; sums of their x, y, z from its lower corner [step]
    extremes: np.ndarray  #: (C, 18) float64 points farthest to -x, +x, -y, +y, -z, +z; (0, 18) where not wanted
    counts: np.record  #: BOX_COUNTS


@kernel
def slot_of_box(slots: np.ndarray, rows: np.ndarray, i: int, j: int, k: int) -> int:
    """Slot of a box, or the free slot for it. Eight boxes along x are stored side by side, as scans are ordered that way."""
    mask = len(slots) - 1
    mixed = ((i >> 3) * 73856093 + j * 19349669 + k * 83492791) & LARGEST_INT64
    mixed = ((mixed ^ (mixed >> 23)) * 668265263) & LARGEST_INT64
    slot = (8 * (mixed ^ (mixed >> 19)) + (i & 7)) & mask
    while slots[slot] >= 0:  # a third of the slots are free
        row = slots[slot]
        if rows[row, 0] == i and rows[row, 1] == j and rows[row, 2] == k:
            break
        slot = (slot + 1) & mask
    return slot


@kernel
def is_farther(points: np.ndarray, n: int, extremes: np.ndarray, row: int, side: int) -> bool:
    """Whether point n lies farther to a side than the extreme of a row; ties go to the first by x, y, z."""
    axis, begin = side // 2, 3 * side
    ahead = points[n, axis] - extremes[row, begin + axis]
    if ahead != 0.0:
        return (ahead > 0.0) == (side % 2 == 1)
    for c in range(3):
        if points[n, c] != extremes[row, begin + c]:
            return points[n, c] < extremes[row, begin + c]
    return False


@kernel
def take_extremes(table: BoxTable, row: int, points: np.ndarray, n: int, fresh: bool) -> None:
    """Make point n an extreme of a row on the sides where it is one."""
    for side in range(6):
        if fresh or is_farther(points, n, table.extremes, row, side):
            for c in range(3):
                table.extremes[row, 3 * side + c] = points[n, c] + 0.0  # -0.0 is the same place as 0.0


@kernel
def new_row(table: BoxTable, slot: int, i: int, j: int, k: int) -> int:
    """Begin a row for a box."""
    row = table.counts.rows
    table.counts.rows += 1
    table.slots[slot] = row
    table.rows[row, 0], table.rows[row, 1], table.rows[row, 2] = i, j, k
    for c in range(COUNT, SUMS + 3):
        table.rows[row, c] = 0
    return row


@kernel
def step_in_box(t: float, i: int) -> int:
    """Place t along a side [box] as steps from the lower corner of box i."""
    return min(int((t - i) * STEPS_OF_BOX + 0.5), 4294967295)


@kernel
def add_points(table: BoxTable, points: np.ndarray, begin: int, size: float) -> int:
    """Add points (N, 3) from number `begin` on to their boxes of a size; returns the first that found the table full, else N."""
    last_i, last_j, last_k, row = 0, 0, 0, -1
    for n in range(begin, len(points)):
        x, y, z = points[n, 0] / size, points[n, 1] / size, points[n, 2] / size
        if not (abs(x) < FARTHEST_BOX and abs(y) < FARTHEST_BOX and abs(z) < FARTHEST_BOX):
            if math.isfinite(points[n, 0]) and math.isfinite(points[n, 1]) and math.isfinite(points[n, 2]):
                table.counts.too_far += 1
            else:
                table.counts.not_finite += 1
            continue
        i, j, k = int(math.floor(x)), int(math.floor(y)), int(math.floor(z))
        fresh = False
        if row < 0 or i != last_i or j != last_j or k != last_k:
            slot = slot_of_box(table.slots, table.rows, i, j, k)
            row = table.slots[slot]
            if row < 0:
                if table.counts.rows == len(table.rows):
                    return n
                row = new_row(table, slot, i, j, k)
                fresh = True
            last_i, last_j, last_k = i, j, k
        table.rows[row, COUNT] += 1
        table.rows[row, SUMS] += step_in_box(x, i)
        table.rows[row, SUMS + 1] += step_in_box(y, j)
        table.rows[row, SUMS + 2] += step_in_box(z, k)
        if len(table.extremes) > 0:
            take_extremes(table, row, points, n, fresh)
    return len(points)


@kernel
def add_rows(table: BoxTable, rows: np.ndarray, extremes: np.ndarray, begin: int) -> int:
    """Add rows of another table from number `begin` on; returns the first that found this table full, else their number."""
    point = np.empty((1, 3))
    for n in range(begin, len(rows)):
        slot = slot_of_box(table.slots, table.rows, int(rows[n, 0]), int(rows[n, 1]), int(rows[n, 2]))
        row = table.slots[slot]
        fresh = row < 0
        if fresh:
            if table.counts.rows == len(table.rows):
                return n
            row = new_row(table, slot, int(rows[n, 0]), int(rows[n, 1]), int(rows[n, 2]))
        for c in range(COUNT, SUMS + 3):
            table.rows[row, c] += rows[n, c]
        if len(table.extremes) > 0:
            for side in range(6):
                for c in range(3):
                    point[0, c] = extremes[n, 3 * side + c]
                take_extremes(table, row, point, 0, fresh and side == 0)
    return len(rows)


@kernel
def fill_slots(slots: np.ndarray, rows: np.ndarray, count: int) -> None:
    """Enter the first `count` rows into free slots."""
    for row in range(count):
        slots[slot_of_box(slots, rows, int(rows[row, 0]), int(rows[row, 1]), int(rows[row, 2]))] = row


@kernel
def middles(rows: np.ndarray, size: float, means: np.ndarray) -> None:
    """Mean of the points of each row, into (C, 3) [scan unit]."""
    for row in range(len(rows)):
        for c in range(3):
            means[row, c] = (rows[row, c] + rows[row, SUMS + c] / (STEPS_OF_BOX * rows[row, COUNT])) * size


@kernel
def take_nearest(
    slots: np.ndarray, rows: np.ndarray, means: np.ndarray, points: np.ndarray, size: float, best: np.ndarray
) -> int:
    """Put the points nearest to the means of their boxes into `best` (C, 4): squared distance, x, y, z.

    Ties go to the first by x, y, z. Returns how many points are in no box (not finite, or changed since).
    """
    missed = 0
    for n in range(len(points)):
        x, y, z = points[n, 0] / size, points[n, 1] / size, points[n, 2] / size
        if not (abs(x) < FARTHEST_BOX and abs(y) < FARTHEST_BOX and abs(z) < FARTHEST_BOX):
            missed += 1
            continue
        slot = slot_of_box(slots, rows, int(math.floor(x)), int(math.floor(y)), int(math.floor(z)))
        row = slots[slot]
        if row < 0:
            missed += 1
            continue
        dx, dy, dz = points[n, 0] - means[row, 0], points[n, 1] - means[row, 1], points[n, 2] - means[row, 2]
        squared = dx * dx + dy * dy + dz * dz
        if squared > best[row, 0]:
            continue
        nearer = squared < best[row, 0]
        for c in range(3):
            if nearer:
                best[row, 1 + c] = points[n, c] + 0.0
            elif points[n, c] != best[row, 1 + c]:
                if points[n, c] > best[row, 1 + c]:
                    break
                nearer = True
                for d in range(c + 1):
                    best[row, 1 + d] = points[n, d] + 0.0
        best[row, 0] = squared
    return missed


@kernel
def choose_boundary_points(
    table: BoxTable, means: np.ndarray, size: float, kept: np.ndarray, begin: int, end: int
) -> int:
    """Mark in `kept` (C, 6), of the rows from `begin` to `end`, the extremes of boxes at the boundary that lie on its outer side.

    Returns their number. A box is at the boundary if the weighted centre of the points around it is far from its own mean. The
    extremes on the opposite side represent the boundary, which a mean misses by up to half a box.
    """
    count = 0
    for row in range(begin, end):
        around, x, y, z = 0.0, 0.0, 0.0, 0.0
        i, j, k = int(table.rows[row, 0]), int(table.rows[row, 1]), int(table.rows[row, 2])
        for di in range(-BOUNDARY_BOXES, BOUNDARY_BOXES + 1):
            for dj in range(-BOUNDARY_BOXES, BOUNDARY_BOXES + 1):
                for dk in range(-BOUNDARY_BOXES, BOUNDARY_BOXES + 1):
                    other = table.slots[slot_of_box(table.slots, table.rows, i + di, j + dj, k + dk)]
                    if other < 0:
                        continue
                    dx, dy, dz = (
                        means[other, 0] - means[row, 0],
                        means[other, 1] - means[row, 1],
                        means[other, 2] - means[row, 2],
                    )
                    weight = table.rows[other, COUNT] * (
                        1.0 - (dx * dx + dy * dy + dz * dz) / (BLEND_RADIUS * size) ** 2
                    )
                    if weight > 0.0:
                        around += weight
                        x, y, z = x + weight * dx, y + weight * dy, z + weight * dz
        x, y, z = x / around, y / around, z / around
        if x * x + y * y + z * z < (BOUNDARY_SHIFT * size) ** 2:
            continue
        for side in range(6):
            a, b, c = (
                table.extremes[row, 3 * side],
                table.extremes[row, 3 * side + 1],
                table.extremes[row, 3 * side + 2],
            )
            outwards = (a - means[row, 0]) * x + (b - means[row, 1]) * y + (c - means[row, 2]) * z
            if outwards < 0.0:
                kept[row, side] = 1
                count += 1
    return count
