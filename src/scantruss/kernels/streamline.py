"""One point of each search box."""

from __future__ import annotations

import numpy as np

from .boxes import SearchBoxes, box_index, slot_of
from .compile import kernel


@kernel
def choose_first(
    points: np.ndarray, boxes: SearchBoxes, among: np.ndarray, chosen: np.ndarray, begin: int, end: int, count: int
) -> tuple[int, int]:
    """Choose the first of the points `among` (M,), of those before `end` where M is 0, in each box that is not taken yet.

    Parameters
    ----------
    points : (N, 3)
    boxes : SearchBoxes, of which only the keys are used
    chosen : (capacity,) int64, filled with the points
    begin, end, count : where to go on and to stop in `among`, and the points so far

    Returns
    -------
    begin, count : begin < end where `chosen` is full
    """
    for m in range(begin, end):
        p = among[m] if len(among) > 0 else m
        i, j, k = (
            box_index(boxes, 0, points[p, 0]),
            box_index(boxes, 1, points[p, 1]),
            box_index(boxes, 2, points[p, 2]),
        )
        slot = slot_of(boxes, i, j, k)
        if boxes.keys[slot] == -1:
            if count == len(chosen):
                return m, count
            boxes.keys[slot] = (i * boxes.counts[1] + j) * boxes.counts[2] + k
            chosen[count] = p
            count += 1
    return end, count
