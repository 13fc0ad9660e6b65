"""Which sample of the surface stands for a point, and which points no sample stands for."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..kernels.scan.nearby import nearest_places

if TYPE_CHECKING:
    from .samples import SurfaceSamples


def owners_of(samples: SurfaceSamples, points: np.ndarray) -> np.ndarray:
    """Return the sample nearest to each point (N, 3), -1 where none is near."""
    owner = np.empty(len(points), np.int64)
    near = 2.0 * max(samples.surface.radius, samples.spacing)
    nearest_places(np.ascontiguousarray(points), samples.boxes, samples.surface.mean, near, owner, 0, len(points))
    return owner
