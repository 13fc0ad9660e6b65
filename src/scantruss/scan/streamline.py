"""Streamlining: of a scan much denser than the grid needs, one point in each small search box (Sec. 2 leaves that to the scanner).

Nodes come down on patches of some hundred points. What lies denser than that is not looked at; where the scan is sparse every
point stays.
"""

from __future__ import annotations

import numpy as np

from ..kernels import nearby
from ..kernels import streamline as kernels
from ..kernels.boxes import new_boxes
from ..kernels.sites import put_all
from ..machine import in_parts, processors
from .cloud import bounds_of

DENSE = 0.35  # spacing of the points, in sizes of a box, from which on a scan is streamlined
PART = 200_000  # fewest points for a thread of their own
ALL = np.zeros(0, np.int64)  # stands for all points
MARKS = 1 << 18  # of boxes near a place
ROOM = 1 << 16  # boxes that the first table has room for


def is_dense(spacing: float, size: float) -> bool:
    """Whether so many points lie in a box of this size that one of them serves as well."""
    return 0.0 < spacing < DENSE * size


def streamlined(points: np.ndarray, size: float) -> np.ndarray:
    """Return the first point in each occupied search box, in their order.

    Parameters
    ----------
    points : (N, 3) float64 [scan unit]
    size : about the distance of the points that stay [scan unit]

    Returns
    -------
    (K,) int64
        Which points stay; the same for any number of processors.
    """
    lower, upper = bounds_of(points)
    parts: list[np.ndarray] = [np.zeros(0, np.int64)] * processors()

    def choose(part: int, begin: int, end: int) -> None:
        parts[part] = _first_of_boxes(points, lower, upper, size, ALL, begin, end)

    in_parts(len(points), PART, choose)
    found = [part for part in parts if len(part)]
    if len(found) == 1:
        return found[0]
    both = np.concatenate(found)
    return _first_of_boxes(points, lower, upper, size, both, 0, len(both))


def _first_of_boxes(
    points: np.ndarray, lower: np.ndarray, upper: np.ndarray, size: float, among: np.ndarray, begin: int, end: int
) -> np.ndarray:
    """The first in each box of the points `among` (M,) from `begin` to `end` - 1."""
    room, count = ROOM, 0
    chosen = np.empty(room, np.int64)
    boxes = new_boxes(lower, upper, size, 0, room)
    while True:
        begin, count = kernels.choose_first(points, boxes, among, chosen, begin, end, count)
        if begin == end:
            return chosen[:count].copy()
        room *= 4
        chosen = np.concatenate([chosen[:count], np.empty(room - count, np.int64)])
        boxes = new_boxes(lower, upper, size, 0, room)
        kernels.choose_first(points, boxes, chosen[:count].copy(), chosen, 0, count, 0)


def points_near(points: np.ndarray, places: np.ndarray, reach: float) -> np.ndarray:
    """Return which points (N, 3) lie within `reach` of any of the places (K, 3), and some more, (M,) int64 in order."""
    boxes = new_boxes(places.min(axis=0), places.max(axis=0), 2.0 * reach, len(places), len(places))
    put_all(boxes, places, np.arange(len(places)))
    marked = np.zeros(MARKS, np.bool_)
    nearby.mark_around(boxes, places, marked)
    parts: list[np.ndarray] = [np.zeros(0, np.int64)] * processors()

    def look(part: int, begin: int, end: int) -> None:
        found = np.empty((end - begin) // 8 + 1024, np.int64)
        count = nearby.list_marked(points, boxes, marked, begin, end, found)
        if count > len(found):
            found = np.empty(count, np.int64)
            nearby.list_marked(points, boxes, marked, begin, end, found)
        parts[part] = found[:count]

    in_parts(len(points), PART, look)
    return np.concatenate(parts)
