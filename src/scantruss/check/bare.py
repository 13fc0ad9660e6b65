"""How much of a grid covers nothing: triangles that span from arm to arm of a star, or make a lid over its scan."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..grid.certificate import Fault, place_of
from .distances import is_over_holes, shares_of_corners

if TYPE_CHECKING:
    from ..grid.grid import Grid
    from ..surface.samples import SurfaceSamples
    from .slits import FeetOnGrid

ON_SIDE_FIRST, ON_SIDE = 3, 8  # places along a side of a triangle, at a first look and then
# least distance of a bare place from all points [member lengths, spacings of the points, usual distances: between lines of a scanner
# none is twice as far]
BARE_FROM, SPACINGS_BARE, USUAL_DISTANCES = 0.2, 5.0, 3.0
# ... and in a part with few points, which are this far from a place at random once in 500 times [root of the area of one], but at most:
FEW_POINTS, FARTHEST_OF_FEW = 1.4, 0.5  # [member lengths]
# share of a grid that may be bare: of 228 good ones, of shells, twins and real scans, none has more than 0.016; 0.095 where a grid
# spans the bays of a star, 0.28 under a lid
MOST_BARE = 0.05
LITTLE_BARE, MANY_TRIANGLES = (
    0.02,
    300,
)  # share at a first look up to which no second is taken; triangles from which on there is one


def mostly_bare(grid: Grid, samples: SurfaceSamples, feet: FeetOnGrid | None, length: float) -> list[Fault]:
    """Return a fault where much of a grid covers places of which no point is near; closed holes aside.

    Parameters
    ----------
    feet : the points on the grid; None where there are none
    length : desired member length [scan unit]
    """
    if feet is None:
        return []
    looks = ((ON_SIDE_FIRST, LITTLE_BARE), (ON_SIDE, MOST_BARE))
    for on_side, least_share in looks if len(grid.triangles) >= MANY_TRIANGLES else looks[1:]:
        places, away, area = _bare_places(grid, samples, feet, length, on_side)
        bare = away > 0.0
        if bare.mean(axis=1) @ area <= least_share * area.sum():
            return []
    if samples.measured < len(samples.surface.mean):
        bare[bare] = ~is_over_holes(places[bare], samples)
    share = float(bare.mean(axis=1) @ area / area.sum())
    if share <= MOST_BARE:
        return []
    worst = places[np.unravel_index(np.where(bare, away, -np.inf).argmax(), bare.shape)]
    return [Fault("bridged", f"covers nothing on {share:.0%} of its area", place_of(worst + samples.origin))]


def _bare_places(
    grid: Grid, samples: SurfaceSamples, feet: FeetOnGrid, length: float, on_side: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return places in the triangles (T, P, 3), how much farther each is from all points than a bare one (T, P), and areas (T,)."""
    corners = grid.nodes[grid.triangles]
    members = np.full(len(grid.nodes), length) if grid.desired is None else grid.desired
    members = members[grid.triangles].mean(axis=1)
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    few = np.minimum(FEW_POINTS * np.sqrt(_area_of_a_point(grid, feet, 0.5 * area)), FARTHEST_OF_FEW * members)
    least = np.maximum(np.maximum(BARE_FROM * members, few), SPACINGS_BARE * samples.spacing)
    places = np.einsum("pc,tcx->tpx", shares_of_corners(on_side), corners)
    away = feet.away(places)
    away -= np.maximum(least, USUAL_DISTANCES * float(np.median(away)))[:, None]
    return places, away, area


def _area_of_a_point(grid: Grid, feet: FeetOnGrid, area: np.ndarray) -> np.ndarray:
    """Return the area of a grid for each point on it, around that corner of each triangle (T,) that has most; inf where there are none."""
    at_corners, points = (
        np.bincount(grid.triangles.ravel(), np.repeat(each, 3), len(grid.nodes)) for each in (area, feet.on_triangle)
    )
    each = np.divide(at_corners, points, out=np.full(len(points), np.inf), where=points > 0.0)
    least: np.ndarray = each[grid.triangles].min(axis=1)
    return least
