"""Distances of measured points from the triangles of a grid, and of nodes from the planes of the points around them."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...runtime.jit import kernel
from ..geometry.boxes import SearchBoxes, box_index, is_wide, new_boxes, put_into, slot_of
from ..geometry.planes import plane_of
from ..geometry.triangles import distance_to_triangle
from ..geometry.vectors import Vector, along, dot, norm, put_vector, row, subtract

MOST_ENTRIES = 1000  # most entries of a triangle on average, beyond which boxes are larger: some triangles are far longer than others
BOX_GROWTHS = 60  # times that boxes are made twice as large at most: from any size to one box
RADIUS_GROWTHS = 90  # times that a reach grows by half at most: from any box to all of them
REACH_GROWS, LEAST_REACH = 1.5, 1e-3  # a reach grows by this, and is no less than so much of the first


class TriangleBoxes(NamedTuple):
    """The triangles of a grid by search box: each is entered in all boxes within `reach` of it."""

    boxes: SearchBoxes  #: entries by box
    triangle: np.ndarray  #: (entries,) int64 triangle of each entry
    middle: np.ndarray  #: (T, 3) centre of the bounding ball of each triangle [scan unit]
    radius: np.ndarray  #: (T,) radius of that ball [scan unit]
    reach: float  #: [scan unit]


def triangle_boxes(nodes: np.ndarray, triangles: np.ndarray, box: float, reach: float) -> TriangleBoxes:
    """Return triangles (T, 3) of nodes (V, 3) by search boxes no larger than `box` [scan unit], unless some triangles are very long."""
    a, b, c = (
        nodes[triangles[:, k]] for k in range(3)
    )  # by corners, as sums and extremes along rows of three are slow
    middle = (a + b + c) / 3.0
    squares = [(away**2).T for away in (a - middle, b - middle, c - middle)]
    radius = np.sqrt(np.max([x + y + z for x, y, z in squares], axis=0))
    least, most = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
    lower, upper = least.min(axis=0) - reach, most.max(axis=0) + reach
    sides = most - least + 2.0 * reach
    for _ in range(BOX_GROWTHS):
        x, y, z = (sides / box + 1.0).T
        if (x * y * z).sum() <= MOST_ENTRIES * len(triangles):
            break
        box *= 2.0
    empty = new_boxes(lower, upper, box, 1, 1)
    count = enter_triangles(empty, nodes, triangles, reach, np.empty(0, np.int64))
    boxes = new_boxes(lower, upper, box, count, count)
    triangle = np.empty(count, np.int64)
    enter_triangles(boxes, nodes, triangles, reach, triangle)
    return TriangleBoxes(boxes, triangle, middle, radius, reach)


@kernel
def enter_triangles(
    boxes: SearchBoxes, nodes: np.ndarray, triangles: np.ndarray, reach: float, triangle: np.ndarray
) -> int:
    """Enter triangles in all boxes within `reach` of them, as far as `triangle` has room; returns how many entries there are."""
    count = 0
    for t in range(len(triangles)):
        a, b, c = row(nodes, triangles[t, 0]), row(nodes, triangles[t, 1]), row(nodes, triangles[t, 2])
        i0, i1 = box_index(boxes, 0, min(a[0], b[0], c[0]) - reach), box_index(boxes, 0, max(a[0], b[0], c[0]) + reach)
        j0, j1 = box_index(boxes, 1, min(a[1], b[1], c[1]) - reach), box_index(boxes, 1, max(a[1], b[1], c[1]) + reach)
        k0, k1 = box_index(boxes, 2, min(a[2], b[2], c[2]) - reach), box_index(boxes, 2, max(a[2], b[2], c[2]) + reach)
        for i in range(i0, i1 + 1):
            for j in range(j0, j1 + 1):
                for k in range(k0, k1 + 1):
                    if count < len(triangle):
                        triangle[count] = t
                        put_into(boxes, count, i, j, k)
                    count += 1
    return count


@kernel
def nearest_triangles(
    points: np.ndarray,
    index: TriangleBoxes,
    nodes: np.ndarray,
    triangles: np.ndarray,
    which: np.ndarray,
    distance: np.ndarray,
    nearest: np.ndarray,
    begin: int,
    end: int,
) -> None:
    """Find the nearest triangle of some points, `which`, and its distance, if that is within the reach of the index; else -1 and inf."""
    boxes = index.boxes
    for at in range(begin, end):
        p = which[at]
        x, y, z = points[p, 0], points[p, 1], points[p, 2]
        best, found = index.reach, -1
        slot = slot_of(boxes, box_index(boxes, 0, x), box_index(boxes, 1, y), box_index(boxes, 2, z))
        entry = boxes.first[slot]
        while entry >= 0:
            t = index.triangle[entry]
            dx, dy, dz = x - index.middle[t, 0], y - index.middle[t, 1], z - index.middle[t, 2]
            most = index.radius[t] + best
            if dx * dx + dy * dy + dz * dz <= most * most:
                a, b, c = row(nodes, triangles[t, 0]), row(nodes, triangles[t, 1]), row(nodes, triangles[t, 2])
                d = distance_to_triangle((x, y, z), a, b, c)
                if d < best or (d == best and (found < 0 or t < found)):
                    best, found = d, t
            entry = boxes.next[entry]
        distance[p], nearest[p] = best if found >= 0 else math.inf, found


@kernel
def _nearest_of_box(
    boxes: SearchBoxes,
    slot: int,
    points: np.ndarray,
    place: Vector,
    reach: float,
    found: np.ndarray,
    squares: np.ndarray,
    count: int,
) -> int:
    """Put the points of a box among the `count` nearest so far; returns how many there are."""
    p = boxes.first[slot]
    while p >= 0:
        d = subtract(row(points, p), place)
        square = dot(d, d)
        most = len(found)
        near = square <= reach * reach and (count < most or square <= squares[count - 1])
        if near and not (count == most and square == squares[most - 1] and p > found[most - 1]):
            at = min(count, most - 1)
            while at > 0 and (squares[at - 1] > square or (squares[at - 1] == square and found[at - 1] > p)):
                squares[at], found[at] = squares[at - 1], found[at - 1]
                at -= 1
            squares[at], found[at] = square, p
            count = min(count + 1, most)
        p = boxes.next[p]
    return count


@kernel
def nearest_points(
    boxes: SearchBoxes, points: np.ndarray, place: Vector, reach: float, found: np.ndarray, squares: np.ndarray
) -> int:
    """Find the points nearest to a place within reach, nearest first, of equals the first; returns how many, at most len(found)."""
    count = 0
    x, y, z = place
    if is_wide(boxes, x, y, z, reach):
        for slot in range(len(boxes.first)):
            count = _nearest_of_box(boxes, slot, points, place, reach, found, squares, count)
        return count
    for i in range(box_index(boxes, 0, x - reach), box_index(boxes, 0, x + reach) + 1):
        for j in range(box_index(boxes, 1, y - reach), box_index(boxes, 1, y + reach) + 1):
            for k in range(box_index(boxes, 2, z - reach), box_index(boxes, 2, z + reach) + 1):
                slot = slot_of(boxes, i, j, k)
                count = _nearest_of_box(boxes, slot, points, place, reach, found, squares, count)
    return count


@kernel
def plane_distances(
    places: np.ndarray,
    points: np.ndarray,
    boxes: SearchBoxes,
    around: int,
    near: float,
    distance: np.ndarray,
    noise: np.ndarray,
) -> None:
    """Fill in the distance of places (Q, 3) from the plane through the `around` nearest points, or from the nearest if that is less.

    boxes : the points by box. near : first search radius [scan unit]. noise : (Q,), filled with the rms distance of those points
    from their plane. A place that has not `around` points within `RADIUS_GROWTHS` of the radius is inf away.
    """
    wanted = min(around, len(points))
    found, squares, offsets = np.empty(wanted, np.int64), np.empty(wanted), np.empty((wanted, 3))
    reach = near
    for q in range(len(places)):
        place = row(places, q)
        count = nearest_points(boxes, points, place, reach, found, squares)
        for _ in range(RADIUS_GROWTHS):
            if count == wanted:
                break
            reach *= REACH_GROWS
            count = nearest_points(boxes, points, place, reach, found, squares)
        if count < wanted:
            distance[q], noise[q], reach = math.inf, 0.0, near
            continue
        first = row(points, found[0])  # offsets from there stay exact, however far away the place is
        for k in range(wanted):
            offsets[k, 0], offsets[k, 1], offsets[k, 2] = subtract(row(points, found[k]), first)
        mean, normal, off, _ = plane_of(offsets, wanted)
        away = subtract(place, first)
        distance[q] = min(abs(dot(subtract(away, mean), normal)), norm(away))
        noise[q] = math.sqrt(off / wanted)
        reach = max(REACH_GROWS * math.sqrt(squares[wanted - 1]), LEAST_REACH * near)


@kernel
def put_feet(
    points: np.ndarray,
    which: np.ndarray,
    corners: np.ndarray,
    normals: np.ndarray,
    height: np.ndarray,
    feet: np.ndarray,
) -> None:
    """Fill in how high each point (K, 3) is over a plane (K,), `which`, and its foot on that (K, 3).

    corners, normals : (T, 3) a place in each plane, and its unit normal
    """
    for k in range(len(points)):
        point, normal = row(points, k), row(normals, which[k])
        height[k] = dot(subtract(point, row(corners, which[k])), normal)
        put_vector(feet[k], along(point, -height[k], normal))
