"""Points of a large scan that lie near a few places, in one pass over all points."""

from __future__ import annotations

import numpy as np

from ...runtime.jit import kernel
from ..geometry.boxes import SearchBoxes, box_index, nearest, put_into, slot_of

BOXES_OF_A_PLACE = 27  # boxes that a place may be put into


@kernel
def mark_around(boxes: SearchBoxes, places: np.ndarray, reach: float, marked: np.ndarray) -> None:
    """Mark the search boxes within reach of each place (K, 3); marked (2^m,) bool, several boxes may share a mark."""
    for s in range(len(places)):
        x, y, z = places[s, 0], places[s, 1], places[s, 2]
        for i in range(box_index(boxes, 0, x - reach), box_index(boxes, 0, x + reach) + 1):
            for j in range(box_index(boxes, 1, y - reach), box_index(boxes, 1, y + reach) + 1):
                for k in range(box_index(boxes, 2, z - reach), box_index(boxes, 2, z + reach) + 1):
                    marked[_mark_of(boxes, i, j, k) & (len(marked) - 1)] = True


@kernel
def _mark_of(boxes: SearchBoxes, i: int, j: int, k: int) -> int:
    key = (i * boxes.counts[1] + j) * boxes.counts[2] + k
    return (key * 613) ^ (key >> 17)


@kernel
def spread_sample(boxes: SearchBoxes, sample: np.ndarray, size: float, marked: np.ndarray) -> None:
    """Put each place (K, 3) into all boxes within `size` of it, and mark these.

    boxes : no smaller than `size`, so that a place reaches at most three along an axis, with room for BOXES_OF_A_PLACE * K items; item i
    stands for place i // BOXES_OF_A_PLACE. marked : (2^m,) bool, several boxes may share a mark.
    """
    for s in range(len(sample)):
        x, y, z = sample[s, 0], sample[s, 1], sample[s, 2]
        item = BOXES_OF_A_PLACE * s
        for i in range(box_index(boxes, 0, x - size), box_index(boxes, 0, x + size) + 1):
            for j in range(box_index(boxes, 1, y - size), box_index(boxes, 1, y + size) + 1):
                for k in range(box_index(boxes, 2, z - size), box_index(boxes, 2, z + size) + 1):
                    put_into(boxes, item, i, j, k)
                    marked[_mark_of(boxes, i, j, k) & (len(marked) - 1)] = True
                    item += 1


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
    """Lower the squared distance (K,) of each point of a sample to that of the nearest of points[begin:end] within `size`.

    Points nearer than `same` coincide and do not count. boxes, marked : of `spread_sample`.
    """
    mask = len(marked) - 1
    for p in range(begin, end):
        x, y, z = points[p, 0], points[p, 1], points[p, 2]
        i, j, k = box_index(boxes, 0, x), box_index(boxes, 1, y), box_index(boxes, 2, z)
        if marked[_mark_of(boxes, i, j, k) & mask]:
            item = boxes.first[slot_of(boxes, i, j, k)]
            while item >= 0:
                s = item // BOXES_OF_A_PLACE
                dx, dy, dz = sample[s, 0] - x, sample[s, 1] - y, sample[s, 2] - z
                dd = dx * dx + dy * dy + dz * dz
                if same * same < dd < square[s] and dd <= size * size:
                    square[s] = dd
                item = boxes.next[item]


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
    """The place (S, 3) nearest to each point from `begin` to `end` - 1 within reach, -1 if there is none; boxes : of the places."""
    for p in range(begin, end):
        x, y, z = points[p, 0], points[p, 1], points[p, 2]
        number[p] = nearest(boxes, places, x, y, z, 0.5 * reach)  # most points have one
        if number[p] < 0:
            number[p] = nearest(boxes, places, x, y, z, reach)
