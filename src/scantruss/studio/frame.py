"""The frame of the scene: scans of any size and place come out about as large, around the origin, as the camera expects."""

from __future__ import annotations

import weakref
from dataclasses import dataclass

import numpy as np

from ..scan.cloud import PointCloud

DRAWN_EXTENT = 10.0  #: of the scan in the scene, whose camera is made for such sizes
BESIDE_FIRST = 1.15  #: how far a second design is drawn beside the first [extent of the scan]
POINTS_FOR_FRAME = 100_000  #: from which the extent of the bulk is measured
ROOM_AROUND = 1.1  #: what a picture shows over what it must
OUTSIDE_FRAME = 0.005  #: share of the points that may lie beyond each side of the frame


@dataclass(frozen=True, eq=False)
class SceneFrame:
    """Turns places in the frame of the scan into those of the scene, and back."""

    middle: np.ndarray  #: (3,) of the scan [scan unit]
    factor: float  #: scene units of one scan unit
    half: np.ndarray  #: (3,) half of its size [scene]

    @property
    def corners(self) -> np.ndarray:
        """The corners (8, 3) of the box around the scan, in the scene."""
        signs = np.array([[(k >> axis & 1) * 2 - 1 for axis in range(3)] for k in range(8)])
        return np.asarray(signs * self.half)

    @classmethod
    def of(cls, cloud: PointCloud) -> SceneFrame:
        """Return the frame of a scan, measured once: around the bulk of its points, without outliers."""
        if cloud not in _FRAMES:
            every = max(1, len(cloud.points) // POINTS_FOR_FRAME)
            low, high = np.quantile(cloud.points[::every], (OUTSIDE_FRAME, 1.0 - OUTSIDE_FRAME), axis=0)
            extent = float((high - low).max()) or cloud.extent or 1.0
            factor = DRAWN_EXTENT / extent
            _FRAMES[cloud] = cls(cloud.origin + (low + high) / 2, factor, factor * (high - low) / 2)
        return _FRAMES[cloud]

    def to_scene(self, places: np.ndarray) -> np.ndarray:
        """Return places (N, 3) [scan unit] in the scene, float32."""
        found: np.ndarray = ((places - self.middle) * self.factor).astype(np.float32)
        return found

    def from_scene(self, places: np.ndarray) -> np.ndarray:
        """Return places (N, 3) of the scene in the frame of the scan [scan unit]."""
        found: np.ndarray = np.asarray(places, np.float64) / self.factor + self.middle
        return found


def distance_to_see(places: np.ndarray, back: np.ndarray, upright: float, aspect: float) -> float:
    """Return how far from the origin a camera, which looks at it upright, must stand to see all places (N, 3).

    Parameters
    ----------
    back : (3,)
        From the origin to the camera, of any length, not upright.
    upright : float
        Angle of view [rad].
    aspect : float
        Width over height of the picture.
    """
    back = back / np.linalg.norm(back)
    right = np.cross([0.0, 0.0, 1.0], back)
    right /= np.linalg.norm(right)
    wide, high = np.abs(places @ np.stack([right, np.cross(back, right)], axis=1)).T
    half = np.tan(0.5 * upright)
    return float((places @ back + np.maximum(wide / (half * aspect), high / half)).max())


_FRAMES: weakref.WeakKeyDictionary[PointCloud, SceneFrame] = weakref.WeakKeyDictionary()


@dataclass(frozen=True)
class SectionPlane:
    """A plane across an axis, beyond which nothing is drawn."""

    axis: int  #: 0, 1 or 2
    at: float  #: in the scene

    def keeps(self, places: np.ndarray) -> np.ndarray:
        """Whether places (N, 3) of the scene are drawn."""
        kept: np.ndarray = places[:, self.axis] <= self.at
        return kept

    def clipped(self, ends: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the parts of segments (M, 2, 3) that are drawn, and of which each is (K,)."""
        height = ends[:, :, self.axis] - self.at
        kept = np.flatnonzero((height <= 0).any(axis=1))
        ends, height = ends[kept].copy(), height[kept]
        for side in (0, 1):
            cut = np.flatnonzero(height[:, side] > 0)
            share = height[cut, side] / (height[cut, side] - height[cut, 1 - side])
            ends[cut, side] += share[:, None] * (ends[cut, 1 - side] - ends[cut, side])
        return ends, kept
