"""The frame of the scene: scans of any size and place come out about as large, around the origin, as the camera expects."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..scan.cloud import PointCloud

DRAWN_EXTENT = 10.0  #: of the scan in the scene, whose camera is made for such sizes


@dataclass(frozen=True, eq=False)
class SceneFrame:
    """Turns places in the frame of the scan into those of the scene, and back."""

    middle: np.ndarray  #: (3,) of the scan [scan unit]
    factor: float  #: scene units of one scan unit

    @classmethod
    def of(cls, cloud: PointCloud) -> SceneFrame:
        """Return the frame of a scan."""
        return cls(cloud.origin + (cloud.bounds[0] + cloud.bounds[1]) / 2, DRAWN_EXTENT / (cloud.extent or 1.0))

    def to_scene(self, places: np.ndarray) -> np.ndarray:
        """Return places (N, 3) [scan unit] in the scene, float32."""
        found: np.ndarray = ((places - self.middle) * self.factor).astype(np.float32)
        return found

    def from_scene(self, places: np.ndarray) -> np.ndarray:
        """Return places (N, 3) of the scene in the frame of the scan [scan unit]."""
        found: np.ndarray = np.asarray(places, np.float64) / self.factor + self.middle
        return found


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
