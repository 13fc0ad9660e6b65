"""Which sample of the surface stands for a point, and which points no sample stands for."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..kernels.geometry.kd_tree import nearest_of_places
from ..kernels.scan.nearby import nearest_places
from ..scan.clean.nearby import build_kd_tree

if TYPE_CHECKING:
    from ..kernels.surface.local_surface import Surface
    from .samples import SurfaceSamples


def owners_of(samples: SurfaceSamples, points: np.ndarray) -> np.ndarray:
    """Return the sample nearest to each point (N, 3), -1 where none is near."""
    owner = np.empty(len(points), np.int64)
    near = 2.0 * max(samples.surface.radius, samples.spacing)
    nearest_places(np.ascontiguousarray(points), samples.boxes, samples.surface.mean, near, owner, 0, len(points))
    return owner


def far_from_rest(points: np.ndarray, gone: np.ndarray, owner: np.ndarray, surface: Surface) -> int:
    """Return how many of the points (N, 3) of samples (N,) that are left out (K,) lie more than half a member from the others."""
    owned = owner[owner >= 0]
    rest = 2 * np.bincount(owner[gone], minlength=len(surface.mean)) <= np.bincount(owned, minlength=len(surface.mean))
    if not len(gone) or not rest.any():
        return len(gone)
    squares, nearest = np.empty(len(gone)), np.empty(len(gone), np.int64)
    others = build_kd_tree(np.ascontiguousarray(surface.mean[rest]))
    nearest_of_places(others, np.ascontiguousarray(points[gone]), 1, squares, nearest)
    return int((4.0 * squares > (surface.length * surface.field[owner[gone]]) ** 2).sum())
