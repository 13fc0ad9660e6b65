"""The smoothed boundary curves of the scan, on which the nodes of the rim slide."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...runtime.jit import kernel


class Rim(NamedTuple):
    """Polylines: closed ones, one a boundary loop, the last point of each joins its first; and those of lines, which may be open.

    An open one is as long as the arc length of its last point.
    """

    points: np.ndarray  #: (M, 3) points of all curves
    arc: np.ndarray  #: (M,) arc length of each point from the start of its curve
    start: np.ndarray  #: (L + 1,) int64 points of curve c are start[c]:start[c + 1]
    total: np.ndarray  #: (L,) length of each curve


@kernel
def foot_on_segment(
    rim: Rim, curve: int, i: int, low: float, high: float, x: float, y: float, z: float
) -> tuple[float, float]:
    """Squared distance of a place from a part of segment i of a curve, and the share of the segment at its foot.

    The part is `low` to `high` of arc length from the start of the segment.
    """
    j, span = i + 1, 0.0
    if j < rim.start[curve + 1]:
        span = rim.arc[j] - rim.arc[i]
    else:
        j = rim.start[curve]
        span = rim.total[curve] - rim.arc[i]
    px, py, pz = x - rim.points[i, 0], y - rim.points[i, 1], z - rim.points[i, 2]
    ux = rim.points[j, 0] - rim.points[i, 0]
    uy = rim.points[j, 1] - rim.points[i, 1]
    uz = rim.points[j, 2] - rim.points[i, 2]
    square = ux * ux + uy * uy + uz * uz
    t = 0.0
    if square > 0.0 and span > 0.0:
        t = min(max((px * ux + py * uy + pz * uz) / square, low / span), min(high / span, 1.0))
    px, py, pz = px - t * ux, py - t * uy, pz - t * uz
    return px * px + py * py + pz * pz, t * span


@kernel
def is_open(rim: Rim, curve: int) -> bool:
    """Whether a curve ends at its last point."""
    return rim.total[curve] <= rim.arc[rim.start[curve + 1] - 1]


@kernel
def segment_at(rim: Rim, curve: int, arc: float) -> int:
    """Segment of a curve in which an arc length (0 to total) lies, by halving."""
    low, high = rim.start[curve], rim.start[curve + 1]
    while high - low > 1:
        middle = (low + high) // 2
        if rim.arc[middle] <= arc:
            low = middle
        else:
            high = middle
    return low


@kernel
def at_arc(rim: Rim, curve: int, arc: float) -> tuple[float, float, float, float]:
    """Arc length brought within the curve, and the place there: (arc, x, y, z)."""
    total = rim.total[curve]
    if total <= 0.0:
        i = rim.start[curve]
        return 0.0, rim.points[i, 0], rim.points[i, 1], rim.points[i, 2]
    arc = min(max(arc, 0.0), total) if is_open(rim, curve) else arc % total
    i = segment_at(rim, curve, arc)
    j = i + 1
    end = rim.arc[j] if j < rim.start[curve + 1] else total
    if j == rim.start[curve + 1]:
        j = rim.start[curve]
    span = end - rim.arc[i]
    t = 0.0 if span <= 0.0 else (arc - rim.arc[i]) / span
    return (
        arc,
        rim.points[i, 0] + t * (rim.points[j, 0] - rim.points[i, 0]),
        rim.points[i, 1] + t * (rim.points[j, 1] - rim.points[i, 1]),
        rim.points[i, 2] + t * (rim.points[j, 2] - rim.points[i, 2]),
    )


@kernel
def slide(
    rim: Rim, curve: int, arc: float, reach: float, x: float, y: float, z: float
) -> tuple[float, float, float, float]:
    """Place on a curve nearest to a position, within `reach` of arc length to both sides: (arc, x, y, z)."""
    first, last = rim.start[curve], rim.start[curve + 1]
    home, ends = segment_at(rim, curve, arc), is_open(rim, curve)
    best, found = np.inf, arc
    for way in (1, -1):
        i, begin = home, rim.arc[home] - arc  # the segment and where it starts, seen from `arc`
        for _ in range(last - first):
            end = begin + (rim.arc[i + 1] if i + 1 < last else rim.total[curve]) - rim.arc[i]
            low, high = max(0.0, -reach - begin), max(0.0, reach - begin)
            square, along = foot_on_segment(rim, curve, i, low, high, x, y, z)
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
                begin -= (rim.arc[i + 1] if i + 1 < last else rim.total[curve]) - rim.arc[i]
    return at_arc(rim, curve, found)


@kernel
def nearest_on_rim(rim: Rim, x: float, y: float, z: float) -> tuple[int, float, float]:
    """Curve, arc length and distance of the place on any curve nearest to a position; curve -1 where there is no curve."""
    best, curve, arc = np.inf, -1, 0.0
    for c in range(len(rim.total)):
        i, last = rim.start[c], rim.start[c + 1]
        while i < last:
            square, along = foot_on_segment(rim, c, i, 0.0, np.inf, x, y, z)
            here = rim.arc[i] + along
            if square < best:
                best, curve, arc = square, c, here
            spare = here + np.sqrt(square) - np.sqrt(best)  # no place before this is nearer
            i += 1
            while i + 1 < last and rim.arc[i + 1] < spare:
                i += 1
    return curve, arc, np.sqrt(best)
