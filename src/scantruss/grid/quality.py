"""Figures of a grid: Table 2 of the paper and more."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from ..errors import words_of_number
from .panels import REGULAR_MEMBERS, planarity_of, shape_qualities_of
from .tables import GridTables


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
    stretch_mean: float | None = (
        None  #: mean of member lengths over those desired there; None where one length is desired
    )
    stretch_cv: float | None = None  #: their standard deviation over their mean
    regular: float | None = (
        None  #: share of interior nodes with four members of quads, three of hexagons; None of triangles
    )
    planarity_max: float | None = (
        None  #: largest distance of a corner from the plane of its panel, over the mean diagonal there
    )

    def __str__(self) -> str:
        """Return shape and length in one line."""
        shape = f"shape {self.shape_mean:.3f} +- {self.shape_std:.3f}"
        if self.stretch_mean is not None and self.stretch_cv is not None:
            return (
                f"{shape}, length {self.stretch_mean:.3f} +- {self.stretch_mean * self.stretch_cv:.3f} of the desired"
            )
        return f"{shape}, length {words_of_number(self.length_mean, 4)} +- {words_of_number(self.length_std, 2)} {self.unit}".rstrip()

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, ready for JSON."""
        values = asdict(self)
        del values["unit"]
        if self.stretch_mean is None:
            del values["stretch_mean"], values["stretch_cv"]
        if self.regular is None:
            del values["regular"], values["planarity_max"]
        return values


def shape_qualities(nodes: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return G of each triangle, 4 sqrt(3) area / (sum of squared edges): 1 equilateral, 0 degenerate.

    Parameters
    ----------
    nodes : (V, 3) float64 [scan unit]
    triangles : (T, 3) int64

    Returns
    -------
    (T,) float64
    """
    a, b, c = (nodes[triangles[:, k]] for k in range(3))
    doubled = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    squares = ((b - a) ** 2 + (c - b) ** 2 + (a - c) ** 2).sum(axis=1)
    return 2 * np.sqrt(3) * doubled / np.where(squares > 0, squares, 1.0)


def _mean(values: np.ndarray) -> float:
    return float(values.mean()) if len(values) else 0.0


def measure_quality(grid: GridTables) -> GridQuality:
    """Return the figures of Table 2 and more; NaN-free, zeros for an empty grid."""
    edges, lengths = grid.edges, grid.lengths
    some = len(grid.triangles) > 0
    shape = np.zeros(1)
    if some:
        shape = (shape_qualities if grid.panels is None else shape_qualities_of)(grid.nodes, grid.panel_table)
    angles = grid.corner_angles if some else np.zeros(1)
    lengths = lengths if some else np.zeros(1)
    valence = np.bincount(edges.ravel(), minlength=len(grid.nodes))
    interior = valence > 0
    interior[edges[grid.edge_uses != 2].ravel()] = False
    mean = float(lengths.mean())
    deviation = grid.measured_deviation
    stretches = grid.stretches(1.0) if grid.desired is not None and some else None
    return GridQuality(
        shape_mean=float(shape.mean()),
        shape_std=float(shape.std()),
        shape_min=float(shape.min()),
        length_mean=mean,
        length_std=float(lengths.std()),
        length_cv=float(lengths.std()) / mean if mean > 0 else 0.0,
        angle_min=float(np.nanmin(angles)),
        angle_max=float(np.nanmax(angles)),
        valence6=_mean(valence[interior] == 6),
        node_deviation_mean=float(deviation.mean()) if len(deviation) else None,
        node_deviation_max=float(deviation.max()) if len(deviation) else None,
        unit=grid.unit,
        stretch_mean=None if stretches is None else float(stretches.mean()),
        stretch_cv=None if stretches is None else float(stretches.std() / stretches.mean()),
        regular=None
        if grid.panels is None
        else _mean(valence[interior] == REGULAR_MEMBERS[min(grid.panels.shape[1], 5)]),
        planarity_max=None if grid.panels is None else float(planarity_of(grid.nodes, grid.panels).max(initial=0.0)),
    )
