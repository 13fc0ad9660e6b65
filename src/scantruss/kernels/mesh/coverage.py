"""Distances of places from the nearest of other places, such as given lengths from the samples of a scan."""

from __future__ import annotations

import math

import numpy as np

from ...runtime.jit import kernel
from ..geometry.boxes import SearchBoxes, nearest, put
from ..geometry.vectors import Vector, norm, row, subtract

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
        distance[q] = _nearest_distance(row(others, q), places, boxes, near)


@kernel
def _nearest_distance(other: Vector, places: np.ndarray, boxes: SearchBoxes, reach: float) -> float:
    """Distance from the nearest place; see `nearest_distances`."""
    found = nearest(boxes, places, other[0], other[1], other[2], reach)
    for _ in range(MOST_DOUBLINGS):
        if found >= 0:
            break
        reach *= 2.0
        found = nearest(boxes, places, other[0], other[1], other[2], reach)
    return norm(subtract(row(places, found), other)) if found >= 0 else math.inf


@kernel
def distances_on_triangles(
    corners: np.ndarray,
    shares: np.ndarray,
    places: np.ndarray,
    boxes: SearchBoxes,
    near: float,
    distance: np.ndarray,
    begin: int,
    end: int,
) -> None:
    """Fill in the distance (T, Q) of points in each triangle from `begin` to `end` - 1 from the nearest place; see `nearest_distances`.

    corners : (T, 3, 3) of the triangles; shares : (Q, 3) of these in each point
    """
    for t in range(begin, end):
        a, b, c = row(corners[t], 0), row(corners[t], 1), row(corners[t], 2)
        for q in range(len(shares)):
            u, v, w = row(shares, q)
            x, y, z = (u * a[0] + v * b[0] + w * c[0], u * a[1] + v * b[1] + w * c[1], u * a[2] + v * b[2] + w * c[2])
            distance[t, q] = _nearest_distance((x, y, z), places, boxes, near)
