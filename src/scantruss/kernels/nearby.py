"""Points of a large scan that lie near a few places, in one pass over all points."""

from __future__ import annotations

import numpy as np

from .boxes import SearchBoxes, box_index, nearest, search
from .compile import kernel


@kernel
def mark_around(boxes: SearchBoxes, sample: np.ndarray, marked: np.ndarray) -> None:
    """Mark the 27 search boxes around each place (K, 3); marked (2^m,) bool, several boxes may share a mark."""
    for s in range(len(sample)):
        i, j, k = (
            box_index(boxes, 0, sample[s, 0]),
            box_index(boxes, 1, sample[s, 1]),
            box_index(boxes, 2, sample[s, 2]),
        )
        for a in range(max(i - 1, 0), min(i + 2, boxes.counts[0])):
            for b in range(max(j - 1, 0), min(j + 2, boxes.counts[1])):
                for c in range(max(k - 1, 0), min(k + 2, boxes.counts[2])):
                    marked[_mark_of(boxes, a, b, c) & (len(marked) - 1)] = True


@kernel
def _mark_of(boxes: SearchBoxes, i: int, j: int, k: int) -> int:
    key = (i * boxes.counts[1] + j) * boxes.counts[2] + k
    return (key * 613) ^ (key >> 17)


@kernel
def lower_to_nearest(
    points: np.ndarray,
    boxes: SearchBoxes,
    sample: np.ndarray,
    marked: np.ndarray,
    size: float,
    same: float,
    square: np.ndarray,
    begin: int,
    end: int,
) -> None:
    """Lower the squared distance (K,) of each point of a sample to that of the nearest of points[begin:end] within a box's size.

    Points nearer than `same` coincide and do not count. boxes : of the sample, no smaller than `size`.
    """
    found = np.empty(len(sample), np.int64)
    mask = len(marked) - 1
    for p in range(begin, end):
        x, y, z = points[p, 0], points[p, 1], points[p, 2]
        i, j, k = box_index(boxes, 0, x), box_index(boxes, 1, y), box_index(boxes, 2, z)
        if marked[_mark_of(boxes, i, j, k) & mask]:
            for f in range(search(boxes, sample, x, y, z, size, found)):
                s = found[f]
                dx, dy, dz = sample[s, 0] - x, sample[s, 1] - y, sample[s, 2] - z
                dd = dx * dx + dy * dy + dz * dz
                if same * same < dd < square[s]:
                    square[s] = dd


@kernel
def list_marked(
    points: np.ndarray, boxes: SearchBoxes, marked: np.ndarray, begin: int, end: int, found: np.ndarray
) -> int:
    """List the points from `begin` to `end` - 1 that lie in a marked box; returns how many, which may be more than `found` has room for."""
    count, mask = 0, len(marked) - 1
    for p in range(begin, end):
        i, j, k = (
            box_index(boxes, 0, points[p, 0]),
            box_index(boxes, 1, points[p, 1]),
            box_index(boxes, 2, points[p, 2]),
        )
        if marked[_mark_of(boxes, i, j, k) & mask]:
            if count < len(found):
                found[count] = p
            count += 1
    return count


@kernel
def nearest_places(
    points: np.ndarray,
    boxes: SearchBoxes,
    places: np.ndarray,
    reach: float,
    number: np.ndarray,
    begin: int,
    end: int,
) -> None:
    """The place (S, 3) nearest to each point from `begin` to `end` - 1 within reach, -1 where there is none; boxes : of the places."""
    for p in range(begin, end):
        number[p] = nearest(boxes, places, points[p, 0], points[p, 1], points[p, 2], reach)
