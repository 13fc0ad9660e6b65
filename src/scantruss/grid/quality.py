"""Figures of a grid: Table 2 of the paper and more."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from .grid import Grid


@dataclass(frozen=True)
class GridQuality:
    """Shape quality, member lengths, angles, valence and deviation of a grid."""

    shape_mean: float  #: mean of G = 4 sqrt(3) area / (sum of squared edges), Lo's coefficient
    shape_std: float
    shape_min: float
    length_mean: float  #: [scan unit]
    length_std: float  #: [scan unit]
    length_cv: float  #: length_std / length_mean
    angle_min: float  #: [degree]
    angle_max: float  #: [degree]
    valence6: float  #: share of interior nodes with six members
    node_deviation_mean: float | None  #: distance of the nodes from the scanned surface [scan unit]
    node_deviation_max: float | None
    unit: str = ""

    def __str__(self) -> str:
        """Return shape and length in one line."""
        return (
            f"shape {self.shape_mean:.3f} +- {self.shape_std:.3f}, length {self.length_mean:.4g} +- {self.length_std:.2g} {self.unit}".rstrip()
        )

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, ready for JSON."""
        values = asdict(self)
        del values["unit"]
        return values


@dataclass(frozen=True)
class Topology:
    """What the grid is, apart from where it lies."""

    components: int
    boundary_loops: int
    euler: int
    manifold: bool
    orientable: bool

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, ready for JSON."""
        return asdict(self)


def measure_quality(grid: Grid) -> GridQuality:
    """Return the figures of Table 2 and more; NaN-free, zeros for an empty grid."""
    raise NotImplementedError


def measure_topology(grid: Grid) -> Topology:
    """Return components, loops, Euler number; whether manifold and orientable (both by the triangles alone)."""
    raise NotImplementedError
