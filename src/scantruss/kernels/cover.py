"""How much of a scan a grid covers."""

from __future__ import annotations

import numpy as np

from .boxes import SearchBoxes, put, search
from .compile import kernel


@kernel
def find_uncovered(
    nodes: np.ndarray, boxes: SearchBoxes, places: np.ndarray, reach: float, uncovered: np.ndarray
) -> int:
    """Mark the places that have no node within `reach`; returns their number.

    Parameters
    ----------
    nodes : (V, 3)
    boxes : SearchBoxes with room for V items, empty
    places : (S, 3)
    uncovered : (S,) bool, filled
    """
    for n in range(len(nodes)):
        put(boxes, n, nodes[n, 0], nodes[n, 1], nodes[n, 2])
    found = np.empty(1, np.int64)
    count = 0
    for s in range(len(places)):
        uncovered[s] = search(boxes, nodes, places[s, 0], places[s, 1], places[s, 2], reach, found) == 0
        count += uncovered[s]
    return count
