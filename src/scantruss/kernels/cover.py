"""How much of a scan a grid covers, and of a grid the scan."""

from __future__ import annotations

import numpy as np

from .boxes import SearchBoxes, put, search
from .compile import kernel


@kernel
def mark_far(places: np.ndarray, others: np.ndarray, boxes: SearchBoxes, reach: float, far: np.ndarray) -> int:
    """Mark the places (P, 3) that have none of the others (Q, 3) within `reach`; returns their number.

    boxes : empty, with room for Q items. far : (P,) bool, filled.
    """
    for n in range(len(others)):
        put(boxes, n, others[n, 0], others[n, 1], others[n, 2])
    found = np.empty(1, np.int64)
    count = 0
    for s in range(len(places)):
        far[s] = search(boxes, others, places[s, 0], places[s, 1], places[s, 2], reach, found) == 0
        count += far[s]
    return count
