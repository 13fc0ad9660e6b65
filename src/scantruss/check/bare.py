"""How much of a grid covers nothing: triangles that span from arm to arm of a star, or make a lid over its scan."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..grid.certificate import Fault, place_of
from .distances import is_over_holes
from .slits import feet_on

if TYPE_CHECKING:
    from ..grid.grid import Grid
    from ..surface.samples import SurfaceSamples
    from .distances import Distances

ON_SIDE = 8  # places along a side of a triangle
# least distance of a bare place from all points [member lengths, spacings of the points, usual distances: between lines of a scanner
# none is twice as far]
BARE_FROM, SPACINGS_BARE, USUAL_DISTANCES = 0.2, 5.0, 3.0
# share of a grid that may be bare: of 228 good ones, of shells, twins and real scans, none has more than 0.016; 0.095 where a grid
# spans the bays of a star, 0.28 under a lid
MOST_BARE = 0.05


def mostly_bare(grid: Grid, samples: SurfaceSamples, found: Distances, length: float) -> list[Fault]:
    """Return a fault where much of a grid covers places of which no point is near; closed holes aside.

    Parameters
    ----------
    length : desired member length [scan unit]
    """
    feet = feet_on(grid, samples, found, length)
    if feet is None:
        return []
    shares = np.array([[a, b, ON_SIDE - a - b] for a in range(ON_SIDE) for b in range(ON_SIDE - a)]) + 1.0 / 3.0
    shares /= shares.sum(axis=1, keepdims=True)
    corners = grid.nodes[grid.triangles]
    members = np.full(len(grid.nodes), length) if grid.desired is None else grid.desired
    least = np.maximum(BARE_FROM * members[grid.triangles].mean(axis=1), SPACINGS_BARE * samples.spacing)
    places = np.einsum("pc,tcx->tpx", shares, corners)
    away = feet.away(places)
    away -= np.maximum(least, USUAL_DISTANCES * float(np.median(away)))[:, None]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    bare = away > 0.0
    if bare.mean(axis=1) @ area <= MOST_BARE * area.sum():
        return []
    if samples.measured < len(samples.surface.mean):
        bare[bare] = ~is_over_holes(places[bare], samples)
    share = float(bare.mean(axis=1) @ area / area.sum())
    if share <= MOST_BARE:
        return []
    worst = places[np.unravel_index(np.where(bare, away, -np.inf).argmax(), bare.shape)]
    return [Fault("bridged", f"covers nothing on {share:.0%} of its area", place_of(worst + samples.origin))]
