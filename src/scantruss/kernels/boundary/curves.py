"""The smoothed boundary curves of the scan, on which the nodes of the boundary slide."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...runtime.jit import kernel
from ..geometry.vectors import norm, row, subtract


class Curves(NamedTuple):
    """Polylines: one closed one for each boundary loop, whose last point joins its first; and those of lines, which may be open.

    An open one is as long as the arc length of its last point.
    """

    points: np.ndarray  #: (M, 3) points of all curves
    arc: np.ndarray  #: (M,) arc length of each point from the start of its curve
    start: np.ndarray  #: (L + 1,) int64 points of curve c are start[c]:start[c + 1]
    total: np.ndarray  #: (L,) length of each curve


@kernel
def foot_on_segment(
    curves: Curves, curve: int, i: int, low: float, high: float, x: float, y: float, z: float
) -> tuple[float, float]:
    """Squared distance of a place from a part of segment i of a curve, and the share of the segment at its foot.

    The part is `low` to `high` of arc length from the start of the segment.
    """
    j, span = i + 1, 0.0
    if j < curves.start[curve + 1]:
        span = curves.arc[j] - curves.arc[i]
    else:
        j = curves.start[curve]
        span = curves.total[curve] - curves.arc[i]
    px, py, pz = x - curves.points[i, 0], y - curves.points[i, 1], z - curves.points[i, 2]
    ux = curves.points[j, 0] - curves.points[i, 0]
    uy = curves.points[j, 1] - curves.points[i, 1]
    uz = curves.points[j, 2] - curves.points[i, 2]
    square = ux * ux + uy * uy + uz * uz
    t = 0.0
    if square > 0.0 and span > 0.0:
        t = min(max((px * ux + py * uy + pz * uz) / square, low / span), min(high / span, 1.0))
    px, py, pz = px - t * ux, py - t * uy, pz - t * uz
    return px * px + py * py + pz * pz, t * span


@kernel
def is_open(curves: Curves, curve: int) -> bool:
    """Whether a curve ends at its last point."""
    return curves.total[curve] <= curves.arc[curves.start[curve + 1] - 1]


@kernel
def segment_at(curves: Curves, curve: int, arc: float) -> int:
    """Segment of a curve in which an arc length (0 to total) lies, by bisection."""
    low, high = curves.start[curve], curves.start[curve + 1]
    while high - low > 1:  # each turn halves what is left
        middle = (low + high) // 2
        if curves.arc[middle] <= arc:
            low = middle
        else:
            high = middle
    return low


@kernel
def at_arc(curves: Curves, curve: int, arc: float) -> tuple[float, float, float, float]:
    """Arc length brought within the curve, and the place there: (arc, x, y, z)."""
    total = curves.total[curve]
    if total <= 0.0:
        i = curves.start[curve]
        return 0.0, curves.points[i, 0], curves.points[i, 1], curves.points[i, 2]
    arc = min(max(arc, 0.0), total) if is_open(curves, curve) else arc % total
    i = segment_at(curves, curve, arc)
    j = i + 1
    end = curves.arc[j] if j < curves.start[curve + 1] else total
    if j == curves.start[curve + 1]:
        j = curves.start[curve]
    span = end - curves.arc[i]
    t = 0.0 if span <= 0.0 else (arc - curves.arc[i]) / span
    return (
        arc,
        curves.points[i, 0] + t * (curves.points[j, 0] - curves.points[i, 0]),
        curves.points[i, 1] + t * (curves.points[j, 1] - curves.points[i, 1]),
        curves.points[i, 2] + t * (curves.points[j, 2] - curves.points[i, 2]),
    )


@kernel
def slide(
    curves: Curves, curve: int, arc: float, reach: float, x: float, y: float, z: float
) -> tuple[float, float, float, float]:
    """Place on a curve nearest to a position, within `reach` of arc length to both sides: (arc, x, y, z)."""
    first, last = curves.start[curve], curves.start[curve + 1]
    home, ends = segment_at(curves, curve, arc), is_open(curves, curve)
    best, found = np.inf, arc
    for way in (1, -1):
        i, begin = home, curves.arc[home] - arc  # the segment and where it starts, seen from `arc`
        for _ in range(last - first):
            end = begin + (curves.arc[i + 1] if i + 1 < last else curves.total[curve]) - curves.arc[i]
            low, high = max(0.0, -reach - begin), max(0.0, reach - begin)
            square, along = foot_on_segment(curves, curve, i, low, high, x, y, z)
            if square < best:
                best, found = square, arc + begin + along
            if way == 1:
                begin = end
                i = i + 1 if i + 1 < last else first
                if begin >= reach or (ends and i == first):
                    break
            else:
                if begin <= -reach or (ends and i == first):
                    break
                i = i - 1 if i > first else last - 1
                begin -= (curves.arc[i + 1] if i + 1 < last else curves.total[curve]) - curves.arc[i]
    return at_arc(curves, curve, found)


@kernel
def nearest_on_curves(curves: Curves, x: float, y: float, z: float) -> tuple[int, float, float]:
    """Curve, arc length and distance of the place on any curve nearest to a position; curve -1 if there is no curve."""
    return _nearest_within(curves, x, y, z, np.inf)


@kernel
def _nearest_within(curves: Curves, x: float, y: float, z: float, within: float) -> tuple[int, float, float]:
    """The same of places that are nearer than `within`; curve -1 if there is none."""
    best, curve, arc = within * within, -1, 0.0
    for c in range(len(curves.total)):
        i, last = curves.start[c], curves.start[c + 1]
        while i < last:  # each turn goes on by a segment or more
            square, along = foot_on_segment(curves, c, i, 0.0, np.inf, x, y, z)
            here = curves.arc[i] + along
            if square < best:
                best, curve, arc = square, c, here
            spare = here + np.sqrt(square) - np.sqrt(best)  # no place before this is nearer
            i += 1
            while i + 1 < last and curves.arc[i + 1] < spare:  # and so does each of these
                i += 1
    return curve, arc, np.sqrt(best)


@kernel
def distances_from_curves(curves: Curves, places: np.ndarray, distance: np.ndarray) -> None:
    """Fill in the distance (K,) of each place (K, 3) from the nearest curve; soon done where each place is near the one before."""
    within = np.inf
    for k in range(len(places)):
        x, y, z = row(places, k)
        if k > 0:  # where the one before has its nearest place, up to rounding
            within = 1.001 * (distance[k - 1] + norm(subtract((x, y, z), row(places, k - 1))))
        curve, _, distance[k] = _nearest_within(curves, x, y, z, within)
        if curve < 0:
            distance[k] = _nearest_within(curves, x, y, z, np.inf)[2]
