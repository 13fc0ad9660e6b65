"""Points that belong to no surface: isolated ones, and those that lie off the surface around them."""

from __future__ import annotations

import math

import numpy as np

from ...runtime.jit import kernel
from ..geometry.kd_tree import STACK_LEVELS, KDTree, nearest_in_tree
from ..geometry.planes import plane_of
from ..geometry.quadric import FIT_POINT
from ..geometry.vectors import Vector, across, cross, dot, norm, put_vector, row, subtract
from ..surface.patches import POINTS_FOR_PLANE, POINTS_FOR_QUADRIC, empty_patches, fit, height_variance, terms_for

OUTLIER_PATCH_FITS = 3  # fits of a patch, each with less weight for points off the one before
POINTS_OF_CLOUD = 40  # points around a place that distinguish a cloud from a crease
POINTS_OF_THIN_SHEET, POINTS_OF_SHEET = 10, 16  # points by which a sheet through a point is found: a thin one, any
# thickness of that sheet and distance of the point from it; 1 of 5,000 random points are as flat [radii]
THIN_SHEET, OFF_SHEET = 0.08, 0.15
SIMILAR_REACHES = 3.0  # largest ratio of the reaches of two points that are about equally dense
MOST_LOOKED_AT = 512  # most points searched for those
# sectors around a point on a sheet, and those side by side without any point where it ends
SECTORS_AROUND, EMPTY_SECTORS = 12, 5
THICK_CLOUD = 0.2  # thickness, in radii, above which the points around a place form no surface
FARTHER_AROUND = 8  # times as many points as are needed are looked at, at most, where many are left out
PATCH_BEYOND_LAST = 1.1  # radius of a patch, in the distance of its last point


@kernel
def nearest_alive(
    tree: KDTree, alive: np.ndarray, which: np.ndarray, neighbors: np.ndarray, squares: np.ndarray
) -> None:
    """Refill the rows of some points in the table of `nearest_others` from the points that are alive (N,) bool."""
    most = neighbors.shape[1]
    stack, found, away = np.empty(2 * STACK_LEVELS, np.int64), np.empty(3 * most, np.int64), np.empty(3 * most)
    for i in range(len(which)):
        p = which[i]
        count = nearest_in_tree(
            tree, tree.points[p, 0], tree.points[p, 1], tree.points[p, 2], 3 * most, stack, found, away
        )
        held = 0
        for k in range(count):
            if found[k] != p and alive[found[k]] and held < most:
                neighbors[p, held], squares[p, held] = found[k], away[k]
                held += 1
        for k in range(held, most):
            neighbors[p, k], squares[p, k] = -1, np.inf


@kernel
def usual_reaches(
    neighbors: np.ndarray, reach: np.ndarray, rank: int, low: np.ndarray, middle: np.ndarray, begin: int, end: int
) -> None:
    """For each point, the reach of a given rank among its neighbours, from the smallest, and the median one."""
    most = neighbors.shape[1]
    held = np.empty(most)
    for p in range(begin, end):
        for k in range(most):
            value = reach[neighbors[p, k]] if neighbors[p, k] >= 0 else np.inf
            at = k
            while at > 0 and held[at - 1] > value:
                held[at] = held[at - 1]
                at -= 1
            held[at] = value
        low[p], middle[p] = held[min(rank, most - 1)], held[most // 2]


@kernel
def stand_off(
    tree: KDTree,
    alive: np.ndarray,
    which: np.ndarray,
    around: int,
    least: float,
    off: np.ndarray,
    begin: int,
    end: int,
) -> None:
    """Distance of some points (P,) from the surface of those around them, in multiples of the expected one; off (P,), filled.

    The point itself is left out of its surface. The expected distance grows with the thickness of the points there and with the
    uncertainty of the surface, which is large at a boundary. least : least thickness, as a share of the radius.
    """
    room, stack = FARTHER_AROUND * around, np.empty(2 * STACK_LEVELS, np.int64)
    found, away = np.empty(room, np.int64), np.empty(room)
    buffer, matrix, patches = np.zeros(2 * around, FIT_POINT), np.zeros((6, 7)), empty_patches(1)
    for i in range(begin, end):
        p = which[i]
        off[i] = 0.0
        place = row(tree.points, p)
        taken, radius, most = 0, 0.0, around + around // 4
        while taken < around and most <= room:  # farther where many around are left out
            count = nearest_in_tree(tree, place[0], place[1], place[2], most, stack, found, away)
            taken = 0
            for k in range(count):
                if found[k] != p and alive[found[k]] and taken < around:
                    d = subtract(row(tree.points, found[k]), place)
                    put_vector(buffer[taken].place, d)
                    buffer[taken].square = away[k]
                    radius = PATCH_BEYOND_LAST * math.sqrt(away[k])
                    taken += 1
            most *= 2
        if taken < POINTS_FOR_QUADRIC or radius <= 0.0:
            continue
        fit(buffer, taken, radius, OUTLIER_PATCH_FITS, patches, 0, matrix)
        rms = patches.rms[0]
        if rms > THICK_CLOUD * radius:
            continue
        variance = height_variance(buffer, taken, terms_for(patches.points[0]), matrix)
        expected = (rms * rms) * (1.0 + variance) + (least * radius) ** 2
        off[i] = abs(patches.heights[0, 0]) / math.sqrt(max(expected, 1e-300))


@kernel
def find_sheets(
    tree: KDTree,
    alive: np.ndarray,
    like: np.ndarray,
    reach: np.ndarray,
    which: np.ndarray,
    company: np.ndarray,
    at_edge: np.ndarray,
    begin: int,
    end: int,
) -> None:
    """For each point of `which` (P,) look for a thin sheet of points as far apart as it is, however dense the rest of the scan.

    Parameters
    ----------
    like : (N,) bool, points that the sheet may consist of
    reach : (N,) distance of each point to its eighth neighbour [scan unit]
    company : (P, POINTS_OF_SHEET) int64, filled with the points of the sheet, -1 if there are none
    at_edge : (P,) bool, filled: on one side of that sheet no living point lies beyond the point
    """
    stack, found, away = (
        np.empty(2 * STACK_LEVELS, np.int64),
        np.empty(MOST_LOOKED_AT, np.int64),
        np.empty(MOST_LOOKED_AT),
    )
    offsets = np.empty((POINTS_OF_SHEET, 3))
    for i in range(begin, end):
        p = which[i]
        place = row(tree.points, p)
        most, taken, count, exhausted = POINTS_OF_SHEET, 0, 0, False
        while taken < POINTS_OF_SHEET and not exhausted:  # each turn looks at twice as many, MOST_LOOKED_AT at most
            most *= 2
            count = nearest_in_tree(tree, place[0], place[1], place[2], most, stack, found, away)
            taken = 0
            for k in range(count):
                q = found[k]
                if q != p and like[q] and taken < POINTS_OF_SHEET and SIMILAR_REACHES * reach[q] >= reach[p]:
                    offsets[taken, 0], offsets[taken, 1], offsets[taken, 2] = subtract(row(tree.points, q), place)
                    company[i, taken] = q
                    taken += 1
            exhausted = count < most or 2 * most > MOST_LOOKED_AT
        on = False
        for few, thin in ((POINTS_OF_THIN_SHEET, THIN_SHEET), (POINTS_OF_SHEET, OFF_SHEET)):
            on = taken >= few and _is_on_sheet(offsets, few, thin)
            if on:
                at_edge[i] = _is_at_edge(tree, alive, place, offsets, few, found, count)
                company[i, few:] = -1
                break
        if not on:
            company[i] = -1


@kernel
def _is_on_sheet(offsets: np.ndarray, count: int, thin: float) -> bool:
    """Whether the first of some offsets (K, 3) from a point, nearest first, lie on a plane through it within `thin` [radii]."""
    mean, normal, spread, _ = plane_of(offsets, count)
    radius, rms = norm(row(offsets, count - 1)), math.sqrt(spread / count)
    return rms <= thin * radius and abs(dot(mean, normal)) <= max(2.0 * rms, thin * radius)


@kernel
def _is_at_edge(
    tree: KDTree, alive: np.ndarray, place: Vector, offsets: np.ndarray, few: int, found: np.ndarray, count: int
) -> bool:
    """Whether five of twelve adjacent sectors around a place hold neither points of its sheet nor any other living point."""
    _, normal, _, _ = plane_of(offsets, few)
    x, taken = across(normal), np.zeros(SECTORS_AROUND, np.bool_)
    y = cross(normal, x)
    for k in range(few + count):
        if k >= few and not alive[found[k - few]]:
            continue
        way = row(offsets, k) if k < few else subtract(row(tree.points, found[k - few]), place)
        u, v = dot(way, x), dot(way, y)
        if u != 0.0 or v != 0.0:
            taken[int((math.atan2(v, u) / (2.0 * math.pi) + 0.5) * SECTORS_AROUND) % SECTORS_AROUND] = True
    run = 0
    for k in range(2 * SECTORS_AROUND):
        run = 0 if taken[k % SECTORS_AROUND] else run + 1
        if run >= EMPTY_SECTORS:
            return True
    return False


@kernel
def measure_planes(
    tree: KDTree, which: np.ndarray, neighbors: np.ndarray, thick: np.ndarray, aside: np.ndarray, begin: int, end: int
) -> None:
    """Thickness of the points nearest to each of `which`, in radii, and its distance from their plane, in thicknesses; (P,), filled."""
    offsets = np.empty((neighbors.shape[1], 3))
    for i in range(begin, end):
        p = which[i]
        place = row(tree.points, p)
        count = 0
        for k in range(neighbors.shape[1]):
            if neighbors[p, k] >= 0:
                offsets[count, 0], offsets[count, 1], offsets[count, 2] = subtract(
                    row(tree.points, neighbors[p, k]), place
                )
                count += 1
        radius = norm(row(offsets, count - 1)) if count else 0.0
        thick[i], aside[i] = np.inf, np.inf
        if count < POINTS_FOR_PLANE or radius == 0.0:
            continue
        mean, normal, spread, _ = plane_of(offsets, count)
        rms = math.sqrt(spread / count)
        thick[i] = rms / radius
        aside[i] = abs(dot(mean, normal)) / max(rms, 1e-9 * radius)


@kernel
def measure_bulk(tree: KDTree, alive: np.ndarray, which: np.ndarray, bulk: np.ndarray, begin: int, end: int) -> None:
    """Share of the spread of the living points around each of `which` that is across their plane; bulk (P,), filled.

    0 on a surface, 1/3 where points spread evenly to all sides, and little more than half of that in a sharp crease.
    """
    stack, found, away = (
        np.empty(2 * STACK_LEVELS, np.int64),
        np.empty(2 * POINTS_OF_CLOUD, np.int64),
        np.empty(2 * POINTS_OF_CLOUD),
    )
    offsets = np.empty((POINTS_OF_CLOUD, 3))
    for i in range(begin, end):
        place = row(tree.points, which[i])
        count = 0
        for k in range(nearest_in_tree(tree, place[0], place[1], place[2], 2 * POINTS_OF_CLOUD, stack, found, away)):
            if alive[found[k]] and count < POINTS_OF_CLOUD:
                offsets[count, 0], offsets[count, 1], offsets[count, 2] = subtract(row(tree.points, found[k]), place)
                count += 1
        bulk[i] = 0.0
        if count >= POINTS_FOR_PLANE:
            _, _, off_plane, spread = plane_of(offsets, count)
            bulk[i] = off_plane / max(spread, 1e-300)
