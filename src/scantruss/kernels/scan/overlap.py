"""Two overlapping scans: nearest places, the sums of a generalized ICP step, and how well the scans agree."""

from __future__ import annotations

import math

import numpy as np

from ...runtime.jit import kernel
from ..geometry.boxes import SearchBoxes, nearest, search
from ..geometry.vectors import Vector, cross, dot, row, subtract

# numbers of a motion: three of rotation, three of translation; in the sums of a step the residual follows
MOTION_NUMBERS = 6
SLOPE_OF_PAIR = 0.6  # cosine of the angle between the normals of two places above which they make a pair
SAME_SLOPE = 0.75  # cosine of the angle between two surfaces above which they agree
OTHER_SIDE = -0.2  # cosine of that angle below which a point lies on the other side of a thin body
OVER_PLACE = 1.5  # distance from a place along its surface within which a point lies over it [spacings]
MOST_PLACES_NEAR_POINT = 256  # most places around a point


@kernel
def first_places(points: np.ndarray, boxes: SearchBoxes, places: np.ndarray, reach: float, owner: np.ndarray) -> None:
    """The first of the places (S, 3) within reach of each point (N, 3), -1 if there is none; boxes : of the places."""
    found = np.empty(MOST_PLACES_NEAR_POINT, np.int64)
    for p in range(len(points)):
        owner[p] = -1
        for f in range(search(boxes, places, points[p, 0], points[p, 1], points[p, 2], reach, found)):
            if owner[p] < 0 or found[f] < owner[p]:
                owner[p] = found[f]


@kernel
def mark_boundary(places: np.ndarray, normals: np.ndarray, neighbors: np.ndarray, aside: np.ndarray) -> None:
    """Offset of the mean of its neighbours from each place, as a share of their reach; about 0.4 at a straight boundary."""
    for s in range(len(places)):
        o = row(places, s)
        x = y = z = far = 0.0
        count = 0
        for k in range(neighbors.shape[1]):
            n = neighbors[s, k]
            if n >= 0:
                d = subtract(row(places, n), o)
                x, y, z = x + d[0], y + d[1], z + d[2]
                far = max(far, dot(d, d))
                count += 1
        aside[s] = 1.0
        if count > 0 and far > 0.0:
            m = (x / count, y / count, z / count)
            rise = dot(m, row(normals, s))
            aside[s] = math.sqrt(max(dot(m, m) - rise * rise, 0.0) / far)


@kernel
def face_like(
    points: np.ndarray,
    normals: np.ndarray,
    places: np.ndarray,
    place_normals: np.ndarray,
    boxes: SearchBoxes,
    reach: float,
) -> None:
    """Turn each normal to the side of the nearest place's normal; it stays if none is near."""
    for p in range(len(points)):
        n = nearest(boxes, places, points[p, 0], points[p, 1], points[p, 2], reach)
        if n >= 0 and dot(row(normals, p), row(place_normals, n)) < 0.0:
            for c in range(3):
                normals[p, c] = -normals[p, c]


@kernel
def moved(pose: np.ndarray, p: Vector) -> Vector:
    """Return the place that a (4, 4) pose gives to p."""
    return (
        pose[0, 0] * p[0] + pose[0, 1] * p[1] + pose[0, 2] * p[2] + pose[0, 3],
        pose[1, 0] * p[0] + pose[1, 1] * p[1] + pose[1, 2] * p[2] + pose[1, 3],
        pose[2, 0] * p[0] + pose[2, 1] * p[1] + pose[2, 2] * p[2] + pose[2, 3],
    )


@kernel
def turned_by_motion(pose: np.ndarray, v: Vector) -> Vector:
    """Return the direction that a (4, 4) pose gives to v."""
    return (
        pose[0, 0] * v[0] + pose[0, 1] * v[1] + pose[0, 2] * v[2],
        pose[1, 0] * v[0] + pose[1, 1] * v[1] + pose[1, 2] * v[2],
        pose[2, 0] * v[0] + pose[2, 1] * v[1] + pose[2, 2] * v[2],
    )


@kernel
def _add(sums: np.ndarray, arm: Vector, d: Vector, n: Vector, m: Vector, sharp: float, weight: float) -> None:
    """Add one pair of places to the (7, 7) sums: difference d, normals n and m, lever arm from the centre.

    Plane-to-plane (Segal, Haehnel and Thrun 2009): the difference is weighted by the inverse of C = 2 I - (1 - e)(n n' + m m'),
    here by the two parts that matter, along the sum and the difference of the normals; `sharp` is 1 / e.
    """
    cosine = min(max(dot(n, m), -1.0), 1.0)
    for part in range(3):
        if part == 0:  # along both normals
            a = (n[0] + m[0], n[1] + m[1], n[2] + m[2])
            stiffness = 1.0 / (1.0 - cosine + (1.0 + cosine) / sharp)
        elif part == 1:  # in the plane of the normals, across their mean
            a = subtract(n, m)
            stiffness = 1.0 / (1.0 + cosine + (1.0 - cosine) / sharp)
        else:
            a = cross(n, m)
            stiffness = 0.5
        size = dot(a, a)
        if size < 1e-12:
            continue
        size = math.sqrt(size)
        a = (a[0] / size, a[1] / size, a[2] / size)
        t = cross(arm, a)
        rest = dot(a, d)
        w = weight * stiffness
        for i in range(MOTION_NUMBERS + 1):
            u = rest if i == MOTION_NUMBERS else (t[i] if i < 3 else a[i - 3])
            for j in range(MOTION_NUMBERS + 1):
                v = rest if j == MOTION_NUMBERS else (t[j] if j < 3 else a[j - 3])
                sums[i, j] += w * u * v


@kernel
def step_sums(
    points: np.ndarray,
    normals: np.ndarray,
    places: np.ndarray,
    place_normals: np.ndarray,
    place_at_boundary: np.ndarray,
    boxes: SearchBoxes,
    pose: np.ndarray,
    back: np.ndarray,
    turn: float,
    every: int,
    reach: float,
    soft: float,
    sharp: float,
    centre: np.ndarray,
    sums: np.ndarray,
) -> int:
    """Add the pairs of every `every`-th point with its nearest place within `reach` to the (7, 7) sums; returns their number.

    pose : (4, 4) of the points into the common frame, where the sums are taken around `centre`; back : (4, 4) of the points into
    the frame of the places. turn : 1, or -1 if the normals of the scans face opposite sides. soft : distance across the surface
    at which a pair has half its weight [scan unit]. Rows and columns of the sums: rotation, translation, residual.
    """
    count = 0
    for p in range(0, len(points), every):
        q = moved(back, row(points, p))
        n = nearest(boxes, places, q[0], q[1], q[2], reach)
        if n < 0 or place_at_boundary[n]:
            continue
        v = turned_by_motion(back, row(normals, p))
        m = row(place_normals, n)
        v = (turn * v[0], turn * v[1], turn * v[2])
        if dot(v, m) < SLOPE_OF_PAIR:
            continue
        d = subtract(q, row(places, n))
        across = dot(d, m) / soft
        weight = 1.0 / (1.0 + across * across)
        # the difference and the normals in the common frame: pose @ inverse(back) turns them
        w = turned_by_motion(pose, row(normals, p))
        w = (turn * w[0], turn * w[1], turn * w[2])
        common = moved(pose, row(points, p))
        d = _into(pose, back, d)
        m = _into(pose, back, m)
        _add(sums, subtract(common, row(centre, 0)), d, w, m, sharp, weight)
        count += 1
    return count


@kernel
def _into(pose: np.ndarray, back: np.ndarray, v: Vector) -> Vector:
    """Turn a direction from the frame of the places into the common one: by the inverse of `back`, then by `pose`."""
    return turned_by_motion(
        pose,
        (
            back[0, 0] * v[0] + back[1, 0] * v[1] + back[2, 0] * v[2],
            back[0, 1] * v[0] + back[1, 1] * v[1] + back[2, 1] * v[2],
            back[0, 2] * v[0] + back[1, 2] * v[1] + back[2, 2] * v[2],
        ),
    )


@kernel
def judge_overlap(
    points: np.ndarray,
    normals: np.ndarray,
    places: np.ndarray,
    place_normals: np.ndarray,
    place_at_boundary: np.ndarray,
    boxes: SearchBoxes,
    back: np.ndarray,
    turn: float,
    spacing: float,
    near: float,
    reach: float,
) -> tuple[int, int, float]:
    """Compare every point with the surface of the other scan under a pose; returns how many agree, how many do not, and squares.

    Those agree that lie over the surface of the other scan and within `near` of it; the squares are of their distances from it. Those
    between `near` and `reach`, or tilted, do not: both surfaces cannot be there. Points that by their normals lie on the other side of a
    thin body count as neither.
    """
    agreeing, against, squares = 0, 0, 0.0
    for p in range(len(points)):
        q = moved(back, row(points, p))
        n = nearest(boxes, places, q[0], q[1], q[2], reach)
        if n < 0 or place_at_boundary[n]:
            continue
        m = row(place_normals, n)
        d = subtract(q, row(places, n))
        off = dot(d, m)
        if dot(d, d) - off * off > OVER_PLACE * OVER_PLACE * spacing * spacing:
            continue  # beside the surface of the other scan, not over it
        cosine = turn * dot(turned_by_motion(back, row(normals, p)), m)
        if cosine < OTHER_SIDE:
            continue
        if abs(off) <= near and cosine > SAME_SLOPE:
            agreeing += 1
            squares += off * off
        else:
            against += 1
    return agreeing, against, squares
