"""Overlapping scans become one layer: how far each point lies off the layers of the others, and which scan keeps its points there."""

from __future__ import annotations

import numpy as np

from ...runtime.jit import kernel
from ..geometry.boxes import SearchBoxes, nearest
from ..geometry.vectors import dot, row, subtract
from .overlap import moved, turned_by_motion

SAME_SIDE = 0.3  # cosine between the normals of two scans below which they see two sides of something thin


@kernel
def depths(places: np.ndarray, boundary_points: np.ndarray, boxes: SearchBoxes, most: float, depth: np.ndarray) -> None:
    """Distance of each place (S, 3) from the nearest place at a boundary (R, 3), at most `most`; boxes : of the boundaries."""
    for s in range(len(places)):
        n = nearest(boxes, boundary_points, places[s, 0], places[s, 1], places[s, 2], most)
        depth[s] = most
        if n >= 0:
            d = subtract(row(places, s), row(boundary_points, n))
            depth[s] = np.sqrt(dot(d, d))


@kernel
def own_places(
    points: np.ndarray,
    places: np.ndarray,
    boxes: SearchBoxes,
    depth: np.ndarray,
    reach: float,
    own: np.ndarray,
    deep: np.ndarray,
) -> None:
    """The place of its own scan nearest to each point, -1 if there is none, and how deep inside the scan that is."""
    for p in range(len(points)):
        own[p] = nearest(boxes, places, points[p, 0], points[p, 1], points[p, 2], reach)
        deep[p] = depth[own[p]] if own[p] >= 0 else 0.0


@kernel
def add_layer(
    points: np.ndarray,
    own: np.ndarray,
    normals: np.ndarray,
    deep: np.ndarray,
    places: np.ndarray,
    place_normals: np.ndarray,
    boxes: SearchBoxes,
    depth: np.ndarray,
    back: np.ndarray,
    turn: float,
    first: int,
    beside: float,
    off: float,
    full: float,
    shift: np.ndarray,
    weight: np.ndarray,
    kept: np.ndarray,
) -> None:
    """Add one other scan's layer to the sums of each point (N, 3), and drop the points that the other scan sees better.

    own (N,), deep (N,) : as `own_places` gives them; normals : of the places of the point's scan.
    places to depth : of the other scan. back : (4, 4) from the frame of the points to that of the other scan.
    first : 1 if the other scan wins ties in depth. beside, off : largest distance of the nearest place along and across the
    surface. full : depth beyond which a scan has full weight. shift (N, 3), weight (N,) : sums, added to, in the frame of
    the points. kept (N,) : 0 if the other scan sees that spot better.
    """
    for p in range(len(points)):
        if own[p] < 0:
            continue
        q = moved(back, row(points, p))
        n = nearest(boxes, places, q[0], q[1], q[2], beside)
        if n < 0:
            continue
        m = row(place_normals, n)
        d = subtract(q, row(places, n))
        rise = dot(d, m)
        if abs(rise) > off or turn * dot(turned_by_motion(back, row(normals, own[p])), m) < SAME_SIDE:
            continue
        if depth[n] > deep[p] or (depth[n] == deep[p] and first == 1):
            kept[p] = 0
        w = min(depth[n] / full, 1.0)
        weight[p] += w
        for c in range(3):  # the inverse of a rotation is its transpose
            shift[p, c] -= w * rise * (back[0, c] * m[0] + back[1, c] * m[1] + back[2, c] * m[2])
