"""Streamlining: of a scan much denser than the grid needs, one point per small search box is kept (Sec. 2 leaves that to the scanner).

Nodes are projected onto patches of some hundred points, so denser points are not needed; where the scan is sparse every point is kept.
"""

from __future__ import annotations

import numpy as np

from ...kernels.geometry.boxes import new_boxes
from ...kernels.scan import nearby
from ...kernels.scan import streamline as kernels
from ...runtime.jit import new_record
from ...runtime.parallel import in_parts, processors
from ..cloud import Bounds

DENSE_SPACING = 0.35  # point spacing below which a scan is streamlined [box size]
CHOSEN_POINTS_PER_THREAD = 200_000  # fewest points worth a thread of their own
EVERY_POINT = np.zeros(0, np.int64)  # stands for the numbers of all points
BOX_MARKS = 1 << 20  # marks for boxes near a place; of some thousands of boxes two hardly ever share one
LEAST_ROOM, MOST_ROOM = 1 << 16, 1 << 19  # bounds of the number of points that there is room for at first
FILLED_BOXES = 64  # boxes of a block that are expected to be occupied


def is_dense(spacing: float, size: float) -> bool:
    """Whether points of a spacing lie so dense in boxes of a size that one point of a box is enough."""
    return 0.0 < spacing < DENSE_SPACING * size


def streamlined(points: np.ndarray, bounds: Bounds, size: float) -> np.ndarray:
    """Return the first point in each occupied search box, in their order.

    Parameters
    ----------
    points : (N, 3) float64 [scan unit]
    bounds : the lowest and the highest coordinates, (3,) each [scan unit]
    size : about the distance of the points that stay [scan unit]

    Returns
    -------
    (K,) int64
        Which points stay; the same for any number of processors.
    """
    lower, upper = bounds
    room = min(max(len(points) // 2, LEAST_ROOM), MOST_ROOM)
    parts: dict[int, _First] = {}

    def choose(part: int, begin: int, end: int) -> None:
        parts[part] = _First(points, lower, upper, size, room)
        parts[part].choose(EVERY_POINT, begin, end)

    in_parts(len(points), CHOSEN_POINTS_PER_THREAD, choose)
    first, *others = (parts[part] for part in sorted(parts))
    for other in others:
        first.choose(other.chosen, 0, len(other.chosen))
    return first.chosen


class _First:
    """The first point in each box, of the points looked at so far."""

    def __init__(self, points: np.ndarray, lower: np.ndarray, upper: np.ndarray, size: float, room: int) -> None:
        self.points, self.boxes = points, new_boxes(lower, upper, size, 0, 0)
        self.found, self.counts = np.empty(0, np.int64), new_record(kernels.CHOSEN_COUNTS)
        self._make_room(room)

    @property
    def chosen(self) -> np.ndarray:
        """The points found so far (K,) int64."""
        return self.found[: self.counts.points]

    def choose(self, among: np.ndarray, begin: int, end: int) -> None:
        """Look at the points `among` (M,) from `begin` to `end` - 1, or among all points for EVERY_POINT."""
        while begin < end:
            begin = self._choose(among, begin, end)
            if begin < end:
                self._make_room(4 * len(self.found))

    def _choose(self, among: np.ndarray, begin: int, end: int) -> int:
        return kernels.choose_first(
            self.points, self.boxes, self.blocks, self.taken, among, self.found, begin, end, self.counts
        )

    def _make_room(self, room: int) -> None:
        """Make room for so many points and their blocks, at least four times as many blocks as there are."""
        old, rows = self.chosen, max(room // FILLED_BOXES, 4 * int(self.counts.blocks), 1)
        self.found, self.counts = np.empty(room, np.int64), new_record(kernels.CHOSEN_COUNTS)
        self.taken = np.zeros((rows, kernels.BLOCK_BYTES), np.uint8)
        table = new_boxes(np.zeros(3), np.ones(3), 1.0, rows, rows)
        self.blocks = table._replace(counts=self.boxes.counts // kernels.BLOCK_SIDE + 1)
        self._choose(old, 0, len(old))


def points_near(points: np.ndarray, places: np.ndarray, reach: float) -> np.ndarray:
    """Return, in order, the points (N, 3) within `reach` of any of the places (K, 3), and a few more, (M,) int64."""
    boxes = new_boxes(places.min(axis=0), places.max(axis=0), reach, 0, 0)
    marked = np.zeros(BOX_MARKS, np.bool_)
    nearby.mark_around(boxes, places, reach, marked)
    parts: list[np.ndarray] = [np.zeros(0, np.int64)] * processors()

    def look(part: int, begin: int, end: int) -> None:
        found = np.empty((end - begin) // 4 + 1024, np.int64)
        count = nearby.list_marked(points, boxes, marked, begin, end, found)
        if count > len(found):
            found = np.empty(count, np.int64)
            nearby.list_marked(points, boxes, marked, begin, end, found)
        parts[part] = found[:count]

    in_parts(len(points), CHOSEN_POINTS_PER_THREAD, look)
    return np.concatenate(parts)
