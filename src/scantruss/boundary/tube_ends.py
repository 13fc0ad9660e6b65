"""Open ends of thin tubes, as of legs and spouts: a front that ran over one as over a hole would leave the scan there."""

from __future__ import annotations

import numpy as np

from ..kernels.surface.local_surface import Surface
from ..scan.vectors import dots
from ..surface.limbs import POINTS_OF_RING
from .curves import length_around, normals_along, resample, smooth_turns

STEEP_END = 0.5  # largest mean cosine between the scan's normals along a curve and the axis of a tube that ends there
SMOOTHINGS_OF_END = 8  # passes in which the zigzag of the end is halved
SMALLEST_END = 2.0  # length of an end below which the front runs over it as over a hole [desired lengths]


def end_of_tube(surface: Surface, curve: np.ndarray) -> np.ndarray | None:
    """Return the smooth closed curve (K, 3) at which a tube ends, None where a curve (M, 3) bounds a hole or is too short for a ring.

    Around a hole the scan lies in the plane of its boundary, at the end of a tube it stands on it.
    """
    if len(curve) < 3:
        return None
    ring = resample(curve, length_around(curve) / POINTS_OF_RING)
    for _ in range(SMOOTHINGS_OF_END):
        ring = smooth_turns(ring)
    arms = ring - ring.mean(axis=0)
    area = np.cross(arms, np.roll(arms, -1, axis=0)).sum(axis=0)
    normals = normals_along(surface, ring)
    axis = area / max(float(np.linalg.norm(area)), 1e-300)
    steep = abs(float((normals @ axis).mean())) < STEEP_END
    outwards = float(dots(arms, normals).mean()) > 0.0
    desired = surface.length * float(surface.field[((surface.mean - ring[0]) ** 2).sum(axis=1).argmin()])
    return ring if steep and outwards and length_around(ring) > SMALLEST_END * desired else None
