"""Lone points: measured points with nothing else of the scan around them, as dust in the beam or a bird leaves."""

from __future__ import annotations

import math

import numpy as np

from ...kernels.geometry.boxes import new_boxes
from ...kernels.geometry.kd_tree import nearest_of_places
from ...kernels.scan.lone import mark_lone
from ...kernels.scan.outliers import usual_reaches
from ...runtime.parallel import run_in_parts
from ..cloud import Bounds
from .nearby import NEIGHBORS_OF_A_POINT, SEARCHES_PER_THREAD, Nearby, build_kd_tree
from .streamline import points_near, streamlined
from .thinning import MOST_BOXES

MOST_COMPARED = 100_000  # about the most points that are compared with each other; of more some are taken, evenly
COINCIDING = 0.5  # distance within which points count as one [spacings]
REACH_OF_SPACING = 1.5  # distance to the eighth neighbour [spacings]
OTHERS_NEAR = 1  # points that may lie near a lone one: a beam that grazes dust returns twice
RANK_OF_REACH = 4  # as `outliers.DENSEST_AROUND`
# points as far apart that show a sparse part, and within which distance [its own]
SPARSE_AROUND, SPARSE_WITHIN = 3, 2.0
BOX_OF_REACH = 1.0  # width of the boxes in which points near each other are looked for [that distance]
SPARSE_STEP = 2.0  # step from one such distance to the next
SPARSE_ROUNDS = 3  # times that points beside those of a sparse part are looked at, from its inside outwards


def find_lone(points: np.ndarray, bounds: Bounds, spacing: float, distance: float) -> np.ndarray:
    """Return which points (N,) bool are lone, whatever member length is wanted: at most one other lies near.

    Near is within `distance` times the reach of the points around it, and within as much of the usual one. Points of a sparse part
    that begins beside a dense one have others as far apart beside them and are not lone.

    Parameters
    ----------
    points : (N, 3) [scan unit]
    bounds : of the points [scan unit]
    spacing : of the points [scan unit]
    distance : as `Settings.outlier_distance`, at least 1
    """
    lone = np.zeros(len(points), np.bool_)
    size = spacing * max(COINCIDING, math.sqrt(len(points) / MOST_COMPARED))
    extent = float((bounds[1] - bounds[0]).max())
    if size <= 0.0 or extent > MOST_BOXES * size:  # then all outliers are looked for
        return lone
    some = np.ascontiguousarray(points[streamlined(points, bounds, size)])
    least = distance * REACH_OF_SPACING * max(spacing, size)
    if len(some) <= NEIGHBORS_OF_A_POINT or not _some_are_far(some, least):
        return lone
    found = _lone_of(Nearby.of(some), least, distance)
    for place in some[found]:
        near = points_near(points, place[None], COINCIDING * least)
        near = near[((points[near] - place) ** 2).sum(axis=1) <= 3.0 * size * size]
        lone[near] = len(np.unique(points[near], axis=0)) <= 1 + OTHERS_NEAR
    return lone


def _some_are_far(points: np.ndarray, least: float) -> bool:
    """Whether any of the points (N, 3) has no more others within a distance than a lone one may have."""
    boxes = new_boxes(points.min(axis=0), points.max(axis=0), BOX_OF_REACH * least, len(points), len(points))
    lone = np.zeros(len(points), np.bool_)
    mark_lone(points, boxes, least, OTHERS_NEAR, lone)
    return bool(lone.any())


def _lone_of(near: Nearby, least: float, distance: float) -> np.ndarray:
    """Return which points (N,) bool, in the order in which they were given, are lone; `least` as in `_some_are_far`."""
    reach, away = near.reach, np.sqrt(near.squares[:, OTHERS_NEAR])
    low, middle = np.empty((2, len(reach)))
    run_in_parts(len(reach), SEARCHES_PER_THREAD, usual_reaches, near.neighbors, reach, RANK_OF_REACH, low, middle)
    lone = away > np.maximum(least, distance * low)
    level = np.full(len(reach), -1)
    level[lone] = np.floor(np.log(away[lone] / least) / math.log(SPARSE_STEP))
    for _ in range(SPARSE_ROUNDS):
        for each in np.unique(level[lone]):
            sparse = np.ascontiguousarray(near.tree.points[(reach >= least * SPARSE_STEP**each) & ~lone])
            own = np.flatnonzero(lone & (level == each))
            if len(sparse) < SPARSE_AROUND:
                continue
            squares, which = np.empty(len(own)), np.empty(len(own), np.int64)
            places = np.ascontiguousarray(near.tree.points[own])
            nearest_of_places(build_kd_tree(sparse), places, SPARSE_AROUND, squares, which)
            lone[own] = np.sqrt(squares) > SPARSE_WITHIN * away[own]
    return near.in_order(lone)
