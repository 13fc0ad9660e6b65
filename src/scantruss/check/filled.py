"""Whether the boundary of a grid runs around a place in which its scan goes on."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..scan.formats.choose import in_polygon
from ..surface.chosen_samples import KEPT

if TYPE_CHECKING:
    from ..surface.samples import SurfaceSamples

PLACES_ALONG_HOLE = 24  # places across the box around a hole that are looked at
# distance of those from the nodes and members around the hole at least, height of points over them at most, and their distance from the
# grid at least, in that of the place from its edge: nearer ones are of a part that the grid follows [member lengths]
FROM_EDGE, NEAR_HOLE, OFF_GRID = 0.1, 0.5, 0.6
# distance from a point within which a place is filled [member lengths], or in spacings of the points
GOES_ON_WITHIN, SPACINGS_FILLED = 0.12, 2.0
# share of the places that are filled where the scan goes on, and how many places there are at least
LEAST_FILLED, FEWEST_PLACES_IN_HOLE = 0.5, 8


def goes_on_within(around: np.ndarray, samples: SurfaceSamples, off_grid: np.ndarray, length: float) -> bool:
    """Return whether points of the scan that the grid does not follow fill most of what lies within some nodes around it (K, 3).

    off_grid : (N,) distance of each point that was read from the grid [scan unit]
    """
    middle = around.mean(axis=0)
    axes = np.linalg.svd(around - middle)[2]
    edge = (around - middle) @ axes[:2].T
    low, high = edge.min(axis=0), edge.max(axis=0)
    steps = [np.linspace(low[k], high[k], PLACES_ALONG_HOLE) for k in (0, 1)]
    places = np.stack(np.meshgrid(*steps), axis=-1).reshape(-1, 2)
    places = places[in_polygon(places, [edge])]
    from_edge = _distance_from_ring(places, edge)
    places, from_edge = places[from_edge > FROM_EDGE * length], from_edge[from_edge > FROM_EDGE * length]
    if len(places) < FEWEST_PLACES_IN_HOLE:
        return False
    reach = float(np.linalg.norm(around - middle, axis=1).max())
    near = np.flatnonzero((np.abs(samples.scan - middle) <= reach).all(axis=1) & (samples.judged == KEPT))
    off = (samples.scan[near] - middle) @ axes.T
    level = np.abs(off[:, 2]) <= NEAR_HOLE * length
    level &= off_grid[near] > OFF_GRID * FROM_EDGE * length  # few are: only those are looked at more closely
    points, away = off[level][:, :2], off_grid[near[level]]
    points = points[away > OFF_GRID * np.maximum(_distance_from_ring(points, edge), FROM_EDGE * length)]
    within = max(GOES_ON_WITHIN * length, SPACINGS_FILLED * samples.spacing)
    filled = [bool((np.linalg.norm(points - place, axis=1) <= within).any()) for place in places]
    return float(np.mean(filled)) >= LEAST_FILLED


def _distance_from_ring(places: np.ndarray, ring: np.ndarray) -> np.ndarray:
    """Return the distance of each place (K, 2) from a closed polygon (M, 2)."""
    ahead = np.roll(ring, -1, axis=0) - ring
    away = places[:, None] - ring
    share = (away * ahead).sum(axis=2) / np.maximum((ahead**2).sum(axis=1), 1e-300)
    off = away - np.clip(share, 0.0, 1.0)[:, :, None] * ahead
    distance: np.ndarray = np.linalg.norm(off, axis=2).min(axis=1, initial=np.inf)
    return distance
