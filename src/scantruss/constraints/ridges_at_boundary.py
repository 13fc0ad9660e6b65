"""Where ridges come to the boundary: the end of the scan along the ridge gives the place better than the smoothed boundary does."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ..boundary.find import Boundary, Loop
from ..surface.near_scan import distance_from_scan

if TYPE_CHECKING:
    from ..surface.samples import SurfaceSamples
    from .ridge_ends import Ridge

BOUNDARY_REACH = 0.9  # a ridge that ends so near to the boundary comes to it [member lengths]
# radius around the continuation of a ridge within which points show where the scan ends [member lengths]
RADIUS_OF_TUBE = 0.12
PLACES_OF_DIRECTION = 3  # places from which the direction at the end of a ridge is taken
# places at the end of a ridge from which its direction is taken, and the last of them that are left out
STEADY_PLACES_OF_DIRECTION, PLACES_LEFT_OUT = 9, 3
# distance of a corner from the continuation of a ridge up to which the corner is kept [member lengths]
CORNER_KEPT_WITHIN = 0.1
# distance from the end of the scan along a ridge within which a corner beyond it is that of the ridge [member lengths]
CORNER_BEYOND_WITHIN = 0.6
# distance of such a corner from the nearest point up to which the scan reaches it [member lengths]
POINTS_AT_CORNER = 0.2
DENSITY_REACH = 0.5  # how far back along the ridge the density of the points is measured [member lengths]
LOOK_FORWARD = 2.0  # how far the scan may go on along it [member lengths]
GAP_AT_END = 14.0  # a gap so many times as long as the usual one between points along the ridge is the end of the scan
FEWEST_ALONG = 8  # fewest points from which that is taken
BENDING_LENGTH = 1.0  # length over which the boundary is bent to the end of a ridge [member lengths]
MOST_BENDING = 0.4  # the boundary is not bent by more than this [member lengths]


def with_ridge_ends(boundary: Boundary, ridges: list[Ridge], samples: SurfaceSamples, length: float) -> Boundary:
    """Return the boundary, bent to the places where ridges leave the scan."""
    loops = list(boundary.loops)
    for ridge in ridges:
        for line in () if ridge.ring or not loops else (ridge.places, ridge.places[::-1]):
            away = [np.linalg.norm(loop.points - line[-1], axis=1).min() for loop in loops]
            k = int(np.argmin(away))
            if away[k] < BOUNDARY_REACH * length and not _makes_for_corner(line, loops[k], length):
                end = scan_end(line, samples, length)
                if end is not None and not _is_short_of_corner(end, line, loops[k], samples, length):
                    loops[k] = _bent(loops[k], end, length)
    return replace(boundary, loops=tuple(loops))


def _makes_for_corner(line: np.ndarray, loop: Loop, length: float) -> bool:
    """Whether a ridge (K, 3), judged by its direction some way back, makes for a corner of the boundary: then it is right."""
    if not len(loop.corner_at) or len(line) < STEADY_PLACES_OF_DIRECTION:
        return False
    from_there = line[-PLACES_LEFT_OUT]
    ahead = from_there - line[-STEADY_PLACES_OF_DIRECTION]
    ahead /= max(float(np.linalg.norm(ahead)), 1e-300)
    corner = loop.corners[np.linalg.norm(loop.corners - line[-1], axis=1).argmin()]
    return bool(np.linalg.norm(np.cross(corner - from_there, ahead)) < CORNER_KEPT_WITHIN * length)


def _is_short_of_corner(end: np.ndarray, line: np.ndarray, loop: Loop, samples: SurfaceSamples, length: float) -> bool:
    """Whether the end of the scan (3,) along a ridge (K, 3) is short of a corner to which its points reach, as at a tip that curls up."""
    if not len(loop.corner_at):
        return False
    corner = loop.corners[np.linalg.norm(loop.corners - end, axis=1).argmin()]
    gap, ahead = corner - end, line[-1] - line[max(len(line) - PLACES_OF_DIRECTION, 0)]
    if np.linalg.norm(gap) > CORNER_BEYOND_WITHIN * length or gap @ ahead <= 0.0:
        return False
    return distance_from_scan(samples.surface, corner) < POINTS_AT_CORNER * length


def scan_end(line: np.ndarray, samples: SurfaceSamples, length: float) -> np.ndarray | None:
    """Return where the scan ends (3,) along the continuation of a line (K, 3); None if too few points show it."""
    from_there = line[-1]
    ahead = from_there - line[max(len(line) - PLACES_OF_DIRECTION, 0)]
    size = float(np.linalg.norm(ahead))
    if size == 0.0:
        return None
    ahead /= size
    surface = samples.surface
    near = np.flatnonzero(np.linalg.norm(surface.mean - line[-1], axis=1) < (LOOK_FORWARD + 1.0) * length)
    parts = [surface.points[surface.start[s] : surface.start[s + 1]] for s in near.tolist()]
    away = np.concatenate([np.zeros((0, 3)), *parts]) - from_there
    way = away @ ahead
    across = np.linalg.norm(away - way[:, None] * ahead, axis=1)
    radius = max(RADIUS_OF_TUBE * length, 2.0 * samples.spacing)
    way = np.sort(way[(across < radius) & (way > -DENSITY_REACH * length) & (way < LOOK_FORWARD * length)])
    if len(way) < FEWEST_ALONG:
        return None
    usual = float(np.median(np.diff(way)))
    gaps = np.flatnonzero(np.diff(way) > max(GAP_AT_END * usual, samples.spacing))
    last = way[gaps[0]] if len(gaps) else way[-1]
    found: np.ndarray = from_there + (last + 0.5 * usual) * ahead
    return found


def _bent(loop: Loop, end: np.ndarray, length: float) -> Loop:
    """A loop led through a place beside it, which bends the points within some distance along it; as it was if the place is too far off."""
    points = loop.points
    away = np.linalg.norm(points - end, axis=1)
    corners = loop.corner_at
    at = int(away.argmin())
    if len(corners) and away[corners].min() < MOST_BENDING * length:
        at = int(corners[away[corners].argmin()])
    if away[at] > MOST_BENDING * length:
        return loop
    steps = np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1)
    arc = np.abs(np.concatenate([[0.0], np.cumsum(steps)[:-1]]) - np.sum(steps[:at]))
    arc = np.minimum(arc, steps.sum() - arc)
    share = np.clip(1.0 - arc / (BENDING_LENGTH * length), 0.0, 1.0)
    return replace(loop, points=points + share[:, None] * (end - points[at]))
