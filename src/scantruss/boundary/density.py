"""How densely points lie beside a boundary, and the disc that finds it: wider where they are sparse."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..kernels.boundary import room as kernels
from ..kernels.mesh.point_location import nearest_sample
from ..kernels.surface.local_surface import Surface
from ..surface.samples import BESIDE_SAMPLES, SurfaceSamples
from .corners import CURVE_STEP
from .curves import outward

POINTS_BESIDE = 40.0  # points on average beside a place of the boundary from which its density is counted
# radius of the disc where points are sparse, in the sides of a square that holds one point: it seldom falls between them
SIDES_IN_DISC = 1.5


class SlidingDisc(NamedTuple):
    """The disc that is slid along a boundary from outside."""

    least: float  #: its radius where points are dense [scan unit]
    widest: float  #: and where they are sparse [scan unit]
    reach: float  #: distance from a place within which points are counted [scan unit]
    length: float  #: desired member length [scan unit]

    def radii(self, density: np.ndarray) -> np.ndarray:
        """Return its radius (M,) at places with so many points to an area (M,) [scan unit]."""
        return np.clip(SIDES_IN_DISC / np.sqrt(density), self.least, self.widest)


def disc_beside(samples: SurfaceSamples, surface: Surface, radius: float, *, widens: bool) -> SlidingDisc:
    """Return the disc for a boundary along which one of radius `radius` was rolled; `widens` where points are sparse, or stays the same."""
    least = max(0.5 * radius, 2.5 * samples.spacing)
    reach = reach_of_density(surface, samples.area)
    if samples.whole is not None:  # all its points are there only so near to the boundary
        reach = min(reach, BESIDE_SAMPLES * samples.sample_spacing)
    return SlidingDisc(least, max(least, radius) if widens else least, reach, surface.length)


def reach_of_density(surface: Surface, area: float) -> float:
    """Return the distance within which enough points lie on average to count them; at most a member [scan unit]."""
    return min(surface.length, float(np.sqrt(POINTS_BESIDE * area / (0.5 * np.pi * len(surface.points)))))


def density_along(surface: Surface, curve: np.ndarray, reach: float) -> np.ndarray:
    """Return how many points there are to an area inside of each place of a closed curve of equal steps (M, 3), at least one in reach.

    They are counted in half discs of radius `reach` [scan unit], and averaged over about a member to both sides.
    """
    counts, half = np.empty(len(curve)), min(round(1.0 / CURVE_STEP), len(curve) // 2)
    first = nearest_sample(surface, *curve[0].tolist())
    kernels.points_beside(surface, curve, outward(surface, curve), first, reach, counts)
    around = counts[np.arange(-half, len(curve) + half) % len(curve)]
    mean = np.convolve(around, np.full(2 * half + 1, 1.0 / (2 * half + 1)), "valid")
    found: np.ndarray = np.maximum(mean, 1.0) / (0.5 * np.pi * reach**2)
    return found
