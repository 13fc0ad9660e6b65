"""How far a scan lies from a grid, and a grid from the scan."""

from __future__ import annotations

import math

import numpy as np

from ...runtime.jit import kernel
from ..geometry.boxes import SearchBoxes, box_index, nearest, put, slot_of
from ..geometry.triangles import distance_to_triangle
from ..geometry.vectors import norm, row, subtract

DOUBLINGS = 50  # times that a reach is doubled at most: from any box to all of them


@kernel
def put_places(boxes: SearchBoxes, places: np.ndarray) -> None:
    """Put all places (P, 3) into empty boxes with room for them."""
    for p in range(len(places)):
        put(boxes, p, places[p, 0], places[p, 1], places[p, 2])


@kernel
def lower_distances(
    places: np.ndarray, boxes: SearchBoxes, nodes: np.ndarray, triangles: np.ndarray, reach: float, distance: np.ndarray
) -> None:
    """Lower the distance (P,) of each place to that of the nearest triangle, where that is at most `reach`.

    boxes : the places (P, 3) by box.
    """
    for t in range(len(triangles)):
        a, b, c = row(nodes, triangles[t, 0]), row(nodes, triangles[t, 1]), row(nodes, triangles[t, 2])
        x0, x1 = min(a[0], b[0], c[0]) - reach, max(a[0], b[0], c[0]) + reach
        y0, y1 = min(a[1], b[1], c[1]) - reach, max(a[1], b[1], c[1]) + reach
        z0, z1 = min(a[2], b[2], c[2]) - reach, max(a[2], b[2], c[2]) + reach
        for i in range(box_index(boxes, 0, x0), box_index(boxes, 0, x1) + 1):
            for j in range(box_index(boxes, 1, y0), box_index(boxes, 1, y1) + 1):
                for k in range(box_index(boxes, 2, z0), box_index(boxes, 2, z1) + 1):
                    p = boxes.first[slot_of(boxes, i, j, k)]
                    while p >= 0:
                        x, y, z = places[p, 0], places[p, 1], places[p, 2]
                        if x0 <= x <= x1 and y0 <= y <= y1 and z0 <= z <= z1:
                            d = distance_to_triangle((x, y, z), a, b, c)
                            if d <= reach and d < distance[p]:
                                distance[p] = d
                        p = boxes.next[p]


@kernel
def nearest_distances(
    others: np.ndarray, places: np.ndarray, boxes: SearchBoxes, near: float, distance: np.ndarray
) -> None:
    """Distance (Q,) of each of the others (Q, 3) to the nearest place; the search starts with `near` and goes on to twice as far.

    boxes : the places (P, 3) by box, one at least. Inf where the nearest is beyond `DOUBLINGS` of the first reach.
    """
    for q in range(len(others)):
        x, y, z = row(others, q)
        reach = near
        found = nearest(boxes, places, x, y, z, reach)
        for _ in range(DOUBLINGS):
            if found >= 0:
                break
            reach *= 2.0
            found = nearest(boxes, places, x, y, z, reach)
        distance[q] = norm(subtract(row(places, found), (x, y, z))) if found >= 0 else math.inf
