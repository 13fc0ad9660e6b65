"""Points with hardly another one near them."""

from __future__ import annotations

import numpy as np

from ...runtime.jit import kernel
from ..geometry.boxes import SearchBoxes, box_index, put, slot_of
from ..geometry.vectors import dot, row, subtract


@kernel
def mark_lone(points: np.ndarray, boxes: SearchBoxes, reach: float, most: int, lone: np.ndarray) -> None:
    """Mark the points (N, 3) that have at most so many others within reach.

    boxes : empty, with room for all points
    lone : (N,) bool, filled
    """
    for p in range(len(points)):
        put(boxes, p, points[p, 0], points[p, 1], points[p, 2])
    for p in range(len(points)):
        x, y, z = row(points, p)
        own = slot_of(boxes, box_index(boxes, 0, x), box_index(boxes, 1, y), box_index(boxes, 2, z))
        found = _more_in_box(points, boxes, own, p, reach, most, 0)
        for i in range(box_index(boxes, 0, x - reach), box_index(boxes, 0, x + reach) + 1):
            for j in range(box_index(boxes, 1, y - reach), box_index(boxes, 1, y + reach) + 1):
                for k in range(box_index(boxes, 2, z - reach), box_index(boxes, 2, z + reach) + 1):
                    if found > most:
                        break
                    slot = slot_of(boxes, i, j, k)
                    if slot != own:
                        found = _more_in_box(points, boxes, slot, p, reach, most, found)
        lone[p] = found <= most


@kernel
def _more_in_box(points: np.ndarray, boxes: SearchBoxes, slot: int, p: int, reach: float, most: int, found: int) -> int:
    """How many other points than p are found within reach of it, with those in a box; more than `most` are not counted on."""
    other = boxes.first[slot]
    while other >= 0 and found <= most:  # ends with the items of the box
        d = subtract(row(points, other), row(points, p))
        found += other != p and dot(d, d) <= reach * reach
        other = boxes.next[other]
    return found
