"""PointCloud: measured points relative to a local origin."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import InputError


@dataclass(frozen=True, eq=False)
class PointCloud:
    """The points of a scan, clean and near the origin of their own frame."""

    points: np.ndarray  #: (N, 3) float64 [scan unit], relative to `origin`
    origin: np.ndarray  #: (3,) float64 [scan unit], so that national-grid coordinates lose nothing
    unit: str = ""  #: mm, cm, m, inch, foot, or "" where it is not known
    dropped: int = 0  #: points left out because a coordinate was NaN or infinite
    name: str = ""  #: file the points came from

    @classmethod
    def from_array(cls, points: np.ndarray, unit: str = "", name: str = "") -> PointCloud:
        """Return a cloud from an (N, 3) array; checks shape and values, moves to a local origin.

        Raises
        ------
        InputError
            Wrong shape, no numbers, too few points, or all of them on a line.
        """
        raise NotImplementedError
