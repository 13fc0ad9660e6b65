"""The smoothed boundary curves of the scan, on which the nodes of the rim slide."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .compile import kernel


class Rim(NamedTuple):
    """Closed polylines, one a boundary loop; the last point of each joins its first."""

    points: np.ndarray  #: (M, 3) points of all curves
    arc: np.ndarray  #: (M,) arc length of each point from the start of its curve
    start: np.ndarray  #: (L + 1,) int64 points of curve c are start[c]:start[c + 1]
    total: np.ndarray  #: (L,) length of each curve


@kernel
def _foot(rim: Rim, curve: int, i: int, x: float, y: float, z: float) -> tuple[float, float]:
    """Squared distance of a place from segment i of a curve, and how far along the segment its foot lies."""
    j = i + 1
    end = rim.arc[j] if j < rim.start[curve + 1] else rim.total[curve]
    if j == rim.start[curve + 1]:
        j = rim.start[curve]
    px, py, pz = x - rim.points[i, 0], y - rim.points[i, 1], z - rim.points[i, 2]
    ux, uy, uz = (
        rim.points[j, 0] - rim.points[i, 0],
        rim.points[j, 1] - rim.points[i, 1],
        rim.points[j, 2] - rim.points[i, 2],
    )
    square = ux * ux + uy * uy + uz * uz
    t = 0.0 if square == 0.0 else min(max((px * ux + py * uy + pz * uz) / square, 0.0), 1.0)
    px, py, pz = px - t * ux, py - t * uy, pz - t * uz
    return px * px + py * py + pz * pz, rim.arc[i] + t * (end - rim.arc[i])


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
    arc = arc % total
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
    total = rim.total[curve]
    i = segment_at(rim, curve, arc)
    best, found = np.inf, arc
    for step in (1, -1):
        at, gone = i, 0.0
        for _ in range(last - first):
            square, along = _foot(rim, curve, at, x, y, z)
            if square < best:
                best, found = square, along
            end = rim.arc[at + 1] if at + 1 < last else total
            gone = ((end - arc) if step == 1 else (arc - rim.arc[at])) % total if total > 0.0 else np.inf
            if gone >= reach:
                break
            at += step
            if at == last:
                at = first
            elif at < first:
                at = last - 1
    ahead = (found - arc) % total if total > 0.0 else 0.0
    if ahead > 0.5 * total:
        ahead -= total
    return at_arc(rim, curve, arc + min(max(ahead, -reach), reach))


@kernel
def nearest_on_rim(rim: Rim, x: float, y: float, z: float) -> tuple[int, float, float]:
    """Curve, arc length and distance of the place on any curve nearest to a position; curve -1 where there is no curve."""
    best, curve, arc = np.inf, -1, 0.0
    for c in range(len(rim.total)):
        for i in range(rim.start[c], rim.start[c + 1]):
            square, along = _foot(rim, c, i, x, y, z)
            if square < best:
                best, curve, arc = square, c, along
    return curve, arc, np.sqrt(best)
