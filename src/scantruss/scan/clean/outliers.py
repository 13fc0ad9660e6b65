"""Outliers: measured points that belong to no surface, and loose small pieces.

`surface.samples` calls this if it finds isolated samples, `scan.clean.steps` on request.
"""

from __future__ import annotations

import hashlib

import numpy as np

from ...kernels.geometry.components import component_labels
from ...kernels.geometry.kd_tree import nearest_of_places
from ...kernels.scan import outliers as kernels
from ...runtime.parallel import in_parts, run_in_parts
from ..cloud import bounds_of
from .nearby import NEIGHBORS_OF_A_POINT, REACH_TO, SEARCHES_PER_THREAD, Nearby, build_kd_tree
from .streamline import streamlined
from .thinning import MOST_BOXES, number_in_boxes

ROUNDS_OF_OUTLIERS = 5  # outliers close together hide each other: each round reveals some more
FARTHEST_REACH = 4.5  # reach, over the upper quartile of all, above which a point is an outlier whatever is near it
CLOUD_REACH = 2.5  # reach, over the upper quartile of all, above which a point is an outlier if the points around it form no surface
MOST_OF_CLOUDS = 0.1  # share of points without a surface above which they are no cloud of outliers but the scan itself
CLOUD_SHARE = 0.18  # share of the spread across the plane above which points are a cloud and no crease
CLOUD_STEPS = 3  # steps from neighbour to neighbour by which a cloud extends beyond its interior
# power with which the number of points around a place grows with the distance, below which a part is a surface: 2 there, 3 in clouds
POWER_OF_SURFACE = 2.5
CLOUD_NEIGHBORS = 4  # neighbours in a cloud with which a point is examined together with it
DOUBT_DISTANCE = 2.0  # distance from the plane of its neighbours, in their thickness, above which a point is examined
FARTHEST_APART = 1.1  # reach above which points are too far apart for a grid [member lengths]
# distance to the third neighbour, in reaches of those around and of `distance`, at which a point is an outlier
LONE_DISTANCE = 0.5
# distance of such a point from the mean of its neighbours, in that of the last, up to which it has them on all sides
AMONG_OTHERS = 0.5
THIN_AROUND = 0.14  # thickness of these neighbours, in radii, up to which they are a surface on which the point may lie
# rank, from the smallest and counted from 0, of the reach around a point that others are compared with
DENSEST_AROUND = 4
POINTS_OF_PATCH = 28  # points of the surface from which the distance of a point is measured
STANDS_OFF = 5.0  # distance from that surface, in multiples of the expected one, above which a point is off it
WIDER_PATCH = 2  # times as many points as tell whether that holds: of few the noise is often underestimated
LEAST_EXPECTED = 0.01  # least expected distance, in radii of that surface
SMALLEST_PART = 8  # fewest doubted points that make a part of a sheet
# share of them at a free edge above which they are a fringe of the scan, unless they are many and compact
OPEN_EDGE = 0.05
# fewest of these; most at a free edge, in square roots of their number: hardly more than three sides of a square
MANY_OF_PART, EDGE_OF_COMPACT = 200, 3.3
# the same of a part of fewer points, of which some lie so deep in it that it is no fringe: distance from the rest of the scan [reaches]
SOME_OF_PART, EDGE_OF_CORNER, DEEP_IN_PART, SHARE_DEEP = 80, 1.55, 3.0, 0.2
# where a part is the scan grown sparse, most of its points that lie within so many reaches of others are about as far apart as those
BESIDE_OTHERS, GRADED_REACHES = 2.0, 1.7
LONE_SHARE = 3e-4  # share of samples without neighbours above which outliers are sought
ENOUGH_AROUND = 6  # neighbours with which a sample is not alone
# distance between samples where no member length is given, and within which they have neighbours [spacings of the points]: as those
# of a grid with members of 20 spacings
SAMPLES_APART, NEIGHBORS_WITHIN = 4.0, 28.0


def has_outliers(neighbors: np.ndarray) -> bool:
    """Whether enough samples are isolated to look for outliers; neighbors (S, K) as `kernels.nearest_samples`."""
    return bool((neighbors[:, ENOUGH_AROUND - 1] < 0).mean() > LONE_SHARE)


def some_stand_alone(points: np.ndarray, spacing: float) -> bool:
    """Whether enough points (N, 3) are isolated to look for outliers, as `has_outliers` says of the samples of a grid.

    spacing : of the points [scan unit]
    """
    if spacing <= 0.0:
        return False
    bounds = bounds_of(points)
    if (bounds[1] - bounds[0]).max() > MOST_BOXES * SAMPLES_APART * spacing:  # some lie far from all others
        return True
    some = points[streamlined(points, bounds, SAMPLES_APART * spacing)]
    within = NEIGHBORS_WITHIN * spacing
    box = number_in_boxes(some, within / np.sqrt(3.0))  # as wide as that points of a box are no farther apart
    in_doubt = some[np.bincount(box)[box] <= ENOUGH_AROUND]
    if len(in_doubt) <= LONE_SHARE * len(some):
        return False
    squares, which = np.empty(len(in_doubt)), np.empty(len(in_doubt), np.int64)
    nearest_of_places(build_kd_tree(some), in_doubt, ENOUGH_AROUND + 1, squares, which)  # the first is the point itself
    alone = (squares > within * within).sum() if len(some) > ENOUGH_AROUND else len(some)
    return bool(alone > LONE_SHARE * len(some))


def find_outliers(points: np.ndarray, distance: float) -> np.ndarray:
    """Return which points are outliers (N,) bool: those that lie off every sheet.

    A point is doubted if its reach is more than `distance` times that of its neighbours, if few points lie around it within what
    is a full neighbourhood for those, or if it lies off the surface by far more than the points there do. It is an outlier unless
    it lies on a sheet of points about as far apart as it is: a sparse part of a scan stays.

    Parameters
    ----------
    points : (N, 3) [scan unit]
    distance : as `Settings.outlier_distance`
    """
    return _judged(points, distance)[0]


#: what was found of the last points, by their contents and the distance
_LAST_JUDGED: dict[tuple[bytes, float], tuple[np.ndarray, np.ndarray]] = {}


def judge_points(points: np.ndarray, distance: float, length: float) -> tuple[np.ndarray, np.ndarray]:
    """Return which points are outliers, and which others lie too far apart for a member length [scan unit]; (N,) bool each.

    What was found of the last points is kept, as several lengths of one scan are often tried; they are known by their contents.
    """
    asked = hashlib.sha256(np.ascontiguousarray(points).data).digest(), distance
    if asked not in _LAST_JUDGED:
        _LAST_JUDGED.clear()
        _LAST_JUDGED[asked] = _judged(points, distance)
    outlier, reach = _LAST_JUDGED[asked]
    far = reach > max(FARTHEST_APART * length, distance * float(np.median(reach))) if len(reach) else outlier
    return outlier, ~outlier & far


def _judged(points: np.ndarray, distance: float) -> tuple[np.ndarray, np.ndarray]:
    """Return which points are outliers (N,) bool, and the reach of each with all others there (N,) [scan unit]."""
    if len(points) <= NEIGHBORS_OF_A_POINT:
        return np.zeros(len(points), np.bool_), np.zeros(len(points))
    near = Nearby.of(points)
    alive = np.ones(len(points), np.bool_)
    which = np.arange(len(points))
    reach = near.reach
    first_reach = reach.copy()
    usual = float(np.quantile(reach, 0.75))
    limit = FARTHEST_REACH * usual
    spared = np.zeros(len(points), np.bool_)
    for _ in range(ROUNDS_OF_OUTLIERS):
        thick, aside = _planes(near, which)
        outlier, in_gap = _stand_alone(near, which, reach, distance, limit, thick)
        outlier |= (thick > kernels.THICK_CLOUD) & (reach[which] > CLOUD_REACH * usual)
        outlier |= _stand_off(near, alive, which, ~outlier & (in_gap | (aside > DOUBT_DISTANCE)))
        found = which[outlier]
        spared[which[in_gap & ~outlier]] = True
        if not len(found):
            break
        alive[found] = False
        which = np.flatnonzero(alive & ~alive[near.neighbors].all(axis=1))
        kernels.nearest_alive(near.tree, alive, which, near.neighbors, near.squares)
        reach[which] = np.sqrt(near.squares[which, REACH_TO - 1])
    cloud = np.zeros(len(points), np.bool_)
    for _ in range(ROUNDS_OF_OUTLIERS):
        cloud |= _clouds(near, alive)
        beside = np.where(near.neighbors >= 0, cloud[near.neighbors], False).sum(axis=1) >= CLOUD_NEIGHBORS
        found = _in_clouds(near, alive, np.flatnonzero(alive & (cloud | beside)))
        if not len(found):
            break
        for _ in range(2):  # without the outliers found the surface is known better
            alive[found] = False
            which = np.flatnonzero(alive & ~alive[near.neighbors].all(axis=1))
            kernels.nearest_alive(near.tree, alive, which, near.neighbors, near.squares)
            found = which[_stand_off(near, alive, which, _planes(near, which)[1] > 0.5 * DOUBT_DISTANCE)]
        alive[found] = False
    doubted = np.flatnonzero(~alive)
    alive[doubted[_on_sheets(near, alive, spared, first_reach, doubted)]] = True
    return near.in_order(~alive), near.in_order(first_reach)


def _on_sheets(
    near: Nearby, alive: np.ndarray, spared: np.ndarray, reach: np.ndarray, doubted: np.ndarray
) -> np.ndarray:
    """Return which of the doubted points (D,) lie on a sheet that they form with each other and those spared: a sparse part in the scan.

    A few in one plane may be random, and a sparse fringe beyond the edge of the scan is no part of it; a wide sparse part there is,
    as what lies far from the scanner: there the points are hardly farther apart than those of the scan beside them.
    """
    company, at_edge = np.empty((len(doubted), kernels.POINTS_OF_SHEET), np.int64), np.zeros(len(doubted), np.bool_)
    number = np.full(len(alive), -1)
    number[doubted] = np.arange(len(doubted))
    in_parts(
        len(doubted),
        SEARCHES_PER_THREAD,
        lambda _, begin, end: kernels.find_sheets(
            near.tree, alive, spared | (number >= 0), reach, doubted, company, at_edge, begin, end
        ),
    )
    on = company[:, 0] >= 0
    beside = np.where(company >= 0, number[company], -1)
    one, other = np.nonzero((beside >= 0) & on[:, None] & on[beside])
    part = component_labels(len(doubted), one, beside[one, other])
    size, edges = np.bincount(part, on, len(doubted)), np.bincount(part, on & at_edge, len(doubted))
    compact = (size >= MANY_OF_PART) & (edges <= EDGE_OF_COMPACT * np.sqrt(size))
    few = (size >= SOME_OF_PART) & ~compact & (edges <= EDGE_OF_CORNER * np.sqrt(size))
    if on.any() and alive.any():
        which, squares, nearest = np.flatnonzero(on), np.empty(int(on.sum())), np.empty(int(on.sum()), np.int64)
        places = np.ascontiguousarray(near.tree.points[doubted[which]])
        living = np.flatnonzero(alive)
        others = build_kd_tree(np.ascontiguousarray(near.tree.points[living]))
        nearest_of_places(others, places, 1, squares, nearest)
        away, own = np.sqrt(squares), reach[doubted[which]]
        deep = np.bincount(part[which], away > DEEP_IN_PART * own, len(doubted))
        compact |= few & (deep >= SHARE_DEEP * size)
        beside_others = away < BESIDE_OTHERS * own
        alike = beside_others & (own < GRADED_REACHES * reach[living[nearest]])
        touching = np.bincount(part[which], beside_others, len(doubted))
        compact |= (touching >= SMALLEST_PART) & (2 * np.bincount(part[which], alike, len(doubted)) > touching)
    found: np.ndarray = on & ((size >= SMALLEST_PART) & (edges <= OPEN_EDGE * size) | compact)[part]
    return found


def _clouds(near: Nearby, alive: np.ndarray) -> np.ndarray:
    """Return which points belong to dense clouds (N,) bool: inside these, points spread to all sides, unlike in a crease."""
    which = np.flatnonzero(alive)
    cloud, bulk = np.zeros(len(alive), np.bool_), np.zeros(len(alive))
    thick = which[_planes(near, which)[0] > kernels.THICK_CLOUD]
    if not 0 < len(thick) < MOST_OF_CLOUDS * len(which):
        return cloud
    found = np.empty(len(thick))
    run_in_parts(len(thick), SEARCHES_PER_THREAD, kernels.measure_bulk, near.tree, alive, thick, found)
    bulk[thick] = found
    around = near.neighbors[thick]
    cloud[thick] = np.where(around >= 0, bulk[around], 0.0).mean(axis=1) > CLOUD_SHARE
    for _ in range(CLOUD_STEPS):
        cloud[thick] |= np.where(around >= 0, cloud[around], False).any(axis=1)
    return cloud


def _in_clouds(near: Nearby, alive: np.ndarray, doubted: np.ndarray) -> np.ndarray:
    """Return which of the points of clouds, which support each other, lie off the surface around."""
    sure = alive.copy()
    sure[doubted] = False
    off = doubted[_distances_off(near, sure, doubted, WIDER_PATCH * POINTS_OF_PATCH) > STANDS_OFF]
    return off[~_of_small_parts(near, off)]


def _of_small_parts(near: Nearby, which: np.ndarray) -> np.ndarray:
    """Return which of some points (P,) form surfaces with each other that bend within a few spacings, as fingers and ears, and no clouds.

    The number of points within a distance grows with its square on a surface and with its cube in a cloud: the mean logarithm of
    the ratios of the distances to the last and to each other neighbour is the inverse of that power.
    """
    number = np.full(len(near.neighbors), -1)
    number[which] = np.arange(len(which))
    beside = np.where(near.neighbors[which] >= 0, number[near.neighbors[which]], -1)
    one, other = np.nonzero(beside >= 0)
    part = component_labels(len(which), one, beside[one, other])
    squares = near.squares[which]
    known = np.isfinite(squares[:, -1]) & (squares[:, -1] > 0.0)
    ratio = squares[known, -1:] / np.where(squares[known, :-1] > 0.0, squares[known, :-1], squares[known, -1:])
    apart = np.maximum((squares[known, :-1] > 0.0).sum(axis=1) - 1, 1)  # without points that coincide
    inverse = np.zeros(len(which))
    inverse[known] = 0.5 * np.log(ratio).sum(axis=1) / apart
    size = np.bincount(part, known, len(which))
    flat = np.bincount(part, inverse, len(which)) * POWER_OF_SURFACE > size
    return np.asarray((flat & (size >= SMALLEST_PART))[part])


def _planes(near: Nearby, which: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the thickness of the points nearest to each, in radii, and its distance from their plane, in that thickness."""
    thick, aside = np.empty((2, len(which)))
    run_in_parts(
        len(which), SEARCHES_PER_THREAD, kernels.measure_planes, near.tree, which, near.neighbors, thick, aside
    )
    return thick, aside


def _stand_alone(
    near: Nearby, which: np.ndarray, reach: np.ndarray, distance: float, limit: float, thick: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """One round of `find_outliers`, by distances: outliers, and points in gaps, which are none if they lie on the surface around."""
    neighbors = near.neighbors[which]
    low, middle = np.empty((2, len(which)))
    run_in_parts(len(which), SEARCHES_PER_THREAD, kernels.usual_reaches, neighbors, reach, DENSEST_AROUND, low, middle)
    third = np.sqrt(near.squares[which, 2])
    own = reach[which]
    alone, far = third > LONE_DISTANCE * distance * low, (own > distance * middle) | (own > limit)
    in_gap = np.zeros(len(which), np.bool_)
    some = np.flatnonzero(alone & ~far & (thick < THIN_AROUND) & (neighbors >= 0).all(axis=1))
    away = near.tree.points[neighbors[some]].mean(axis=1) - near.tree.points[which[some]]
    in_gap[some] = np.linalg.norm(away, axis=1) < AMONG_OTHERS * np.sqrt(near.squares[which[some], -1])
    return far | (alone & ~in_gap), in_gap


def _stand_off(near: Nearby, alive: np.ndarray, which: np.ndarray, doubted: np.ndarray) -> np.ndarray:
    """One round of `find_outliers`, by the surface of the points around: which of the doubted points lie off it."""
    outlier = np.zeros(len(which), np.bool_)
    looked = np.flatnonzero(doubted)
    looked = looked[_distances_off(near, alive, which[looked], POINTS_OF_PATCH) > STANDS_OFF]
    off = _distances_off(near, alive, which[looked], WIDER_PATCH * POINTS_OF_PATCH)
    outlier[looked[(off > STANDS_OFF) | (off == 0.0)]] = True  # 0 where so many points form no surface
    return outlier


def _distances_off(near: Nearby, alive: np.ndarray, looked: np.ndarray, around: int) -> np.ndarray:
    """Return how far some points (P,) lie off the surface of as many living ones around, in multiples of the expected distance."""
    off = np.empty(len(looked))
    in_parts(
        len(looked),
        SEARCHES_PER_THREAD,
        lambda _, begin, end: kernels.stand_off(near.tree, alive, looked, around, LEAST_EXPECTED, off, begin, end),
    )
    return off
