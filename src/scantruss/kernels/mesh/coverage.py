"""Distances of places from the nearest of other places, such as given lengths from the samples of a scan."""

from __future__ import annotations

import math

import numpy as np

from ...runtime.jit import kernel
from ..geometry.boxes import SearchBoxes, nearest, put, search
from ..geometry.vectors import Vector, along, norm, row, subtract

MOST_DOUBLINGS = 50  # times that a reach is doubled at most: from any box to all of them
PLACES_COMPARED = 200  # fewer places near a quarter of a triangle are compared with all points in it


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

    For dozens of points in a triangle: the places near a quarter of it, if few, are compared with all points in that, several at once.
    Only points that none is near search by themselves.

    corners : (T, 3, 3) of the triangles; shares : (Q, 3) of these in each point
    """
    found, least = np.empty(PLACES_COMPARED, np.int64), np.empty(len(shares))
    x, y, z, own = np.empty(len(shares)), np.empty(len(shares)), np.empty(len(shares)), np.empty(len(shares), np.int64)
    for t in range(begin, end):
        a, b, c = row(corners[t], 0), row(corners[t], 1), row(corners[t], 2)
        centre = _mixed(1.0 / 3.0, a, 1.0 / 3.0, b, 1.0 / 3.0, c)
        radius = 0.5 * max(norm(subtract(a, centre)), norm(subtract(b, centre)), norm(subtract(c, centre)))
        reach = 1.001 * (near + radius)
        for quarter in range(4):  # the first three at the corners
            count = 0
            for q in range(len(shares)):
                u, v, w = row(shares, q)
                if (0 if u > 0.5 else 1 if v > 0.5 else 2 if w > 0.5 else 3) == quarter:
                    x[count], y[count], z[count] = _mixed(u, a, v, b, w, c)
                    least[count], own[count] = math.inf, q
                    count += 1
            middle = centre if quarter == 3 else along(centre, 0.5, subtract(row(corners[t], quarter), centre))
            around = search(boxes, places, middle[0], middle[1], middle[2], reach, found)
            if around < len(found):
                for i in range(around):
                    place = row(places, found[i])
                    for k in range(count):
                        dx, dy, dz = place[0] - x[k], place[1] - y[k], place[2] - z[k]
                        least[k] = min(least[k], dx * dx + dy * dy + dz * dz)
            for k in range(count):
                away = math.sqrt(least[k])
                far = away > near  # perhaps than one that was not compared
                distance[t, own[k]] = _nearest_distance((x[k], y[k], z[k]), places, boxes, near) if far else away


@kernel
def _mixed(u: float, a: Vector, v: float, b: Vector, w: float, c: Vector) -> Vector:
    """Return u a + v b + w c."""
    return u * a[0] + v * b[0] + w * c[0], u * a[1] + v * b[1] + w * c[1], u * a[2] + v * b[2] + w * c[2]
