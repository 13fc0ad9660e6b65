"""Boundary points: the points of the scan that a disc touches as it slides along a boundary from outside (Sec. 3.3)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..kernels.boundary import loops as kernels
from ..kernels.surface.local_surface import Surface
from ..runtime.parallel import in_parts
from ..surface.samples import SurfaceSamples, with_whole_boundary
from ..surface.scratch import with_own_scratch
from .curves import resample, smooth_turns
from .density import SlidingDisc, density_along, reach_of_density

STEPS_BACK = 16  # a boundary point touched again within this many steps was never left
PLACES_PER_THREAD = 500  # fewest places of a loop that are worth a thread


def boundary_points(
    samples: SurfaceSamples, surface: Surface, loops: Sequence[np.ndarray], disc: SlidingDisc, step: float
) -> tuple[list[np.ndarray], Surface]:
    """Return the boundary points (M, 3) along each loop of samples, in order, and the surface with all points of the scan beside them.

    They are what a disc slid from outside touches.

    If the surface was thinned, the disc slides once more, against all points near those that it touched first.
    """
    along = [_places_along(surface, loop, step) for loop in loops]
    if samples.smooth:
        # a loop of larger samples cuts re-entrant corners; on a rough scan its own samples are the ones to trust
        for places, near in along:
            kernels.come_nearer(surface, places, near)
    reach = reach_of_density(surface, samples.area)
    radii = [disc.radii(density_along(surface, places, reach)) for places, _ in along]
    touched = [_touch_points(surface, *each, wide, 8) for each, wide in zip(along, radii, strict=True)]
    dense = with_whole_boundary(samples, surface, np.concatenate(touched)) if touched else surface
    if dense is not surface:
        touched = [_touch_points(dense, *each, wide, 8) for each, wide in zip(along, radii, strict=True)]
    touched = [
        _touch_points(dense, smooth_turns(points), near, wide, 4)
        for points, (_, near), wide in zip(touched, along, radii, strict=True)
    ]
    return [_in_order(points, step) for points in touched], dense


def _places_along(surface: Surface, loop: np.ndarray, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Return places (M, 3) one step apart along a loop of samples, and the sample near each (M,)."""
    turns = smooth_turns(surface.mean[loop])
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.roll(turns, -1, axis=0) - turns, axis=1))])
    places = resample(turns, step)
    at = (np.arange(len(places)) + 0.5) * (arc[-1] / len(places))
    return places, loop[np.searchsorted(arc, at, side="right").clip(1, len(loop)) - 1]


def _in_order(touched: np.ndarray, step: float) -> np.ndarray:
    """Return the points that advance along a loop, without those hardly beyond the one before."""
    touched = touched[_onwards(touched)]
    forward = np.linalg.norm(touched - np.roll(touched, 1, axis=0), axis=1) > 0.2 * step
    return touched[forward]


def _touch_points(surface: Surface, places: np.ndarray, near: np.ndarray, radii: np.ndarray, reach: int) -> np.ndarray:
    """Return the points (M, 3) that a disc of radii (M,) touches along a loop, which is directed from `reach` places before to after."""
    touched, ahead = np.empty_like(places), np.roll(places, -reach, axis=0) - np.roll(places, reach, axis=0)

    def touch(part: int, begin: int, end: int) -> None:
        own = surface if part == 0 else with_own_scratch(surface)
        kernels.touch_points(own, places, ahead, near, radii, touched, begin, end)

    in_parts(len(places), PLACES_PER_THREAD, touch)
    return touched


def _onwards(touched: np.ndarray) -> list[int]:
    """Which touched points (M, 3) advance along the loop; where one is touched again soon after, those between do not."""
    ahead = np.zeros(len(touched), np.int64)
    x, y, z = touched.T.copy()
    for k in range(1, STEPS_BACK + 1):
        ahead[:-k][(x[:-k] == x[k:]) & (y[:-k] == y[k:]) & (z[:-k] == z[k:])] = k
    kept, at = [], 0
    while at < len(touched):
        kept.append(at)
        at += int(ahead[at]) + 1
    return kept
