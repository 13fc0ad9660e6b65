"""Distances of places from the nearest of other places, such as given lengths from the samples of a scan."""

from __future__ import annotations

import math

import numpy as np

from ...runtime.jit import kernel
from ..geometry.boxes import SearchBoxes, nearest, put
from ..geometry.vectors import norm, row, subtract

MOST_DOUBLINGS = 50  # times that a reach is doubled at most: from any box to all of them


@kernel
def put_places(boxes: SearchBoxes, places: np.ndarray) -> None:
    """Put all places (P, 3) into search boxes that are empty and have room for them."""
    for p in range(len(places)):
        put(boxes, p, places[p, 0], places[p, 1], places[p, 2])


@kernel
def nearest_distances(
    others: np.ndarray, places: np.ndarray, boxes: SearchBoxes, near: float, distance: np.ndarray
) -> None:
    """Fill in the distance (Q,) of each of the others (Q, 3) from the nearest place; the search radius is doubled from `near` on.

    boxes : the places (P, 3) by box, at least one. Inf if the nearest is beyond `MOST_DOUBLINGS` of the first radius.
    """
    for q in range(len(others)):
        x, y, z = row(others, q)
        reach = near
        found = nearest(boxes, places, x, y, z, reach)
        for _ in range(MOST_DOUBLINGS):
            if found >= 0:
                break
            reach *= 2.0
            found = nearest(boxes, places, x, y, z, reach)
        distance[q] = norm(subtract(row(places, found), (x, y, z))) if found >= 0 else math.inf
