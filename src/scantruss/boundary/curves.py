"""Closed curves: length, equal steps, spikes cut off, smoothed between corners."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from ..kernels.boundary import room as kernels
from ..kernels.mesh.point_location import nearest_sample
from ..kernels.surface.local_surface import Surface
from ..scan.vectors import dots

POINTS_OF_DIRECTION = 4  # points on each side from which the direction of a curve is found


def length_along(line: np.ndarray) -> float:
    """Return the length of a polyline (K, 3)."""
    return float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())


def length_around(turns: np.ndarray) -> float:
    """Length of a closed polyline."""
    return float(np.linalg.norm(np.roll(turns, -1, axis=0) - turns, axis=1).sum())


def area_within(curve: np.ndarray) -> float:
    """Return the area within a closed curve (M, 3), as seen along the direction in which that is largest."""
    spokes = curve - curve.mean(axis=0)
    return 0.5 * float(np.linalg.norm(np.cross(spokes, np.roll(spokes, -1, axis=0)).sum(axis=0)))


def smooth_turns(turns: np.ndarray) -> np.ndarray:
    """A closed polyline with its zigzag halved."""
    return 0.5 * turns + 0.25 * (np.roll(turns, 1, axis=0) + np.roll(turns, -1, axis=0))


def resample(points: np.ndarray, step: float) -> np.ndarray:
    """Return places at equal arc length along a closed polyline, about `step` apart."""
    closed = np.concatenate([points, points[:1]])
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1))])
    count = max(int(round(arc[-1] / step)), 3)
    at = np.arange(count) * (arc[-1] / count)
    return np.stack([np.interp(at, arc, closed[:, c]) for c in range(3)], axis=1)


def heights_along(surface: Surface, turns: np.ndarray) -> np.ndarray:
    """How far each point of a closed polyline (M, 3), the surface to its left, lies outside the line through its two neighbours (M,)."""
    before, span = turns - np.roll(turns, 1, axis=0), np.roll(turns, -1, axis=0) - np.roll(turns, 1, axis=0)
    return dots(before, _outward(surface, turns, span))


def outward(surface: Surface, curve: np.ndarray) -> np.ndarray:
    """Unit vectors (M, 3) along the surface, away from it, square to a closed curve of equal steps (M, 3), the surface to its left."""
    return _outward(
        surface, curve, np.roll(curve, -POINTS_OF_DIRECTION, axis=0) - np.roll(curve, POINTS_OF_DIRECTION, axis=0)
    )


def room_across(curve: np.ndarray, reach: float, step: float) -> np.ndarray:
    """Distance (M,) from each place of a closed curve (M, 3) of steps `step` to another part of it, at most `reach`.

    Parts within three times `reach` along the curve do not count: they are bends, or spikes already cut off.
    """
    room = np.full(len(curve), reach)
    kernels.room_across(curve, round(3.0 * reach / step), room)
    return room


def runs_around(marks: np.ndarray) -> np.ndarray:
    """Number of the run of equal marks that each place of a closed curve (M,) is in, from 0."""
    run = np.cumsum(np.concatenate([[False], marks[1:] != marks[:-1]]))
    if marks[0] == marks[-1]:
        run[run == run[-1]] = 0
    return run


def _outward(surface: Surface, turns: np.ndarray, ahead: np.ndarray) -> np.ndarray:
    """Unit vectors (M, 3) along the surface, square to the direction ahead (M, 3) of a closed polyline, to its right."""
    out = np.cross(ahead, normals_along(surface, turns))
    return out / np.maximum(np.linalg.norm(out, axis=1), 1e-300)[:, None]


def normals_along(surface: Surface, turns: np.ndarray) -> np.ndarray:
    """Normals of the scan along a closed polyline (M, 3)."""
    normals = np.empty_like(turns)
    kernels.normals_along(surface, turns, nearest_sample(surface, *turns[0].tolist()), normals)
    return normals


def smooth_between(
    curve: np.ndarray, at: np.ndarray, places: np.ndarray, halves: Sequence[int]
) -> tuple[list[np.ndarray], np.ndarray]:
    """Smooth a closed curve by local quadratics of some half widths [steps] with tricube weights (Savitzky-Golay has none); corners stay.

    Returns
    -------
    smoothed : (M, 3) for each width
    corner_at : (C,) indices of the corners in it
    """
    if len(at) == 0:
        return [_filtered(curve[np.arange(-half, len(curve) + half) % len(curve)], half) for half in halves], at
    parts, corner_at, size = [], [], 0
    for i in range(len(at)):
        begin, end = at[i], at[(i + 1) % len(at)] + (len(curve) if i + 1 == len(at) else 0)
        middle = curve[np.arange(begin + 1, end) % len(curve)]
        part = np.concatenate([places[i : i + 1], middle, places[(i + 1) % len(at)][None]])
        parts.append(_drop_backsteps(part))
        corner_at.append(size)
        size += len(parts[-1]) - 1
    smoothed = [np.concatenate([_smooth_inside(part, half)[:-1] for part in parts]) for half in halves]
    return smoothed, np.array(corner_at, np.int64)


def _smooth_inside(part: np.ndarray, half: int) -> np.ndarray:
    """Smooth a part of a curve (M, 3) whose ends stay: it is mirrored at both."""
    reach = min(half, len(part) - 1)
    mirrored = np.concatenate([2 * part[0] - part[reach:0:-1], part, 2 * part[-1] - part[-2 : -2 - reach : -1]])
    smooth = _filtered(mirrored, reach)
    smooth[0], smooth[-1] = part[0], part[-1]
    return smooth


def _filtered(places: np.ndarray, half: int) -> np.ndarray:
    """Local quadratics at each place (M, 3) that has `half` others before and after it."""
    filter_ = _quadratic(half)
    return np.stack([np.convolve(places[:, c], filter_, "valid") for c in range(3)], axis=1)


@lru_cache(maxsize=256)
def _quadratic(half: int) -> np.ndarray:
    """The filter (2 half + 1,) of local quadratics."""
    offsets = np.arange(-half, half + 1)
    weights = (1 - (np.abs(offsets) / (half + 1)) ** 3) ** 3
    terms = np.stack([np.ones(len(offsets)), offsets, offsets**2], axis=1)
    found: np.ndarray = np.linalg.solve(terms.T @ (weights[:, None] * terms), (weights[:, None] * terms).T)[0]
    return found


def _drop_backsteps(part: np.ndarray) -> np.ndarray:
    """Drop points next to the ends that lie beyond the exact corner."""
    keep = np.ones(len(part), bool)
    for end, order in ((0, range(1, len(part) - 1)), (len(part) - 1, range(len(part) - 2, 0, -1))):
        for i in order:
            inward = part[i + 1 if end == 0 else i - 1] - part[i]
            if np.dot(part[i] - part[end], inward) > 0.25 * np.dot(inward, inward):
                break
            keep[i] = False
    return part[keep]
