"""Figures of a grid: Table 2 of the paper and more."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..kernels.mesh import figures

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
    stretch_mean: float | None = (
        None  #: mean of member lengths over those desired there; None where one length is desired
    )
    stretch_cv: float | None = None  #: their standard deviation over their mean

    def __str__(self) -> str:
        """Return shape and length in one line."""
        shape = f"shape {self.shape_mean:.3f} +- {self.shape_std:.3f}"
        if self.stretch_mean is not None and self.stretch_cv is not None:
            return (
                f"{shape}, length {self.stretch_mean:.3f} +- {self.stretch_mean * self.stretch_cv:.3f} of the desired"
            )
        return f"{shape}, length {self.length_mean:.4g} +- {self.length_std:.2g} {self.unit}".rstrip()

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, ready for JSON."""
        values = asdict(self)
        del values["unit"]
        if self.stretch_mean is None:
            del values["stretch_mean"], values["stretch_cv"]
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


def corner_angles(nodes: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return the angle of each triangle at each of its nodes, (T, 3) [degree]."""
    angles = np.empty((len(triangles), 3))
    figures.angles_of(nodes, triangles, angles)
    return angles


def _mean(values: np.ndarray) -> float:
    return float(values.mean()) if len(values) else 0.0


def measure_quality(grid: Grid) -> GridQuality:
    """Return the figures of Table 2 and more; NaN-free, zeros for an empty grid."""
    edges, lengths = grid.edges, grid.lengths
    some = len(grid.triangles) > 0
    shape = shape_qualities(grid.nodes, grid.triangles) if some else np.zeros(1)
    angles = grid.angles if some else np.zeros(1)
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
        angle_min=float(angles.min()),
        angle_max=float(angles.max()),
        valence6=_mean(valence[interior] == 6),
        node_deviation_mean=float(deviation.mean()) if len(deviation) else None,
        node_deviation_max=float(deviation.max()) if len(deviation) else None,
        unit=grid.unit,
        stretch_mean=None if stretches is None else float(stretches.mean()),
        stretch_cv=None if stretches is None else float(stretches.std() / stretches.mean()),
    )


def labels(count: int, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return for each of `count` things the smallest thing that the links first-second join it with."""
    label = np.arange(count)
    figures.join(label, np.ascontiguousarray(first), np.ascontiguousarray(second))
    return label


def _links(grid: Grid) -> tuple[np.ndarray, np.ndarray]:
    """Return the pairs of half-edges that lie on one edge, each half-edge with the next of its edge."""
    order = np.argsort(grid.half_edge_edges, kind="stable")
    sorted_edges = grid.half_edge_edges[order]
    same = np.flatnonzero(sorted_edges[1:] == sorted_edges[:-1])
    return order[same], order[same + 1]


def _is_orientable(grid: Grid) -> bool:
    """Whether the triangles can be turned so that neighbours run along their edge in opposite directions.

    Each triangle is put on two sheets, as it stands and turned over; links join what agrees. The grid is one-sided if
    a triangle is joined with itself turned over.
    """
    count = len(grid.triangles)
    one, other = _links(grid)
    starts = grid.triangles.T.ravel()
    turned = starts[one] == starts[other]
    a, b = one % count, other % count
    label = labels(2 * count, np.concatenate([a, a + count]), np.concatenate([b + count * turned, b + count * ~turned]))
    return not np.any(label[:count] == label[count:])


def pinched_nodes(grid: Grid) -> np.ndarray:
    """Return the nodes whose triangles are more than one fan, joined over edges at the node."""
    count = len(grid.triangles)
    corners = grid.triangles.T.ravel()  # corner k of triangle t stands at k * count + t, as does the half-edge k
    one, other = _links(grid)
    lower, upper = grid.edges[grid.half_edge_edges[one]].T
    first: list[np.ndarray] = []
    second: list[np.ndarray] = []
    for node in (lower, upper):
        for half, found in ((one, first), (other, second)):
            starts = corners[half] == node
            found.append(np.where(starts, half, (half + count) % (3 * count)))
    label = labels(3 * count, np.concatenate(first), np.concatenate(second))
    fans = np.bincount(corners[np.unique(label)], minlength=len(grid.nodes))
    return np.flatnonzero(fans > 1)


def measure_topology(grid: Grid) -> Topology:
    """Return components, loops, Euler number; whether manifold and orientable (both by the triangles alone).

    Nodes without a triangle do not count. Manifold: no edge has more than two triangles, the triangles at each node
    are one fan, and no triangle is there twice or has a node twice.
    """
    triangles, edges, uses = grid.triangles, grid.edges, grid.edge_uses
    if len(triangles) == 0:
        return Topology(components=0, boundary_loops=0, euler=0, manifold=True, orientable=True)
    node = labels(len(grid.nodes), edges[:, 0], edges[:, 1])
    used = np.unique(triangles)
    boundary_edges = edges[uses == 1]
    boundary_label = labels(len(grid.nodes), boundary_edges[:, 0], boundary_edges[:, 1])
    passages = np.bincount(boundary_edges.ravel(), minlength=len(grid.nodes)) // 2
    loops = len(np.unique(boundary_label[boundary_edges[:, 0]])) + int(np.maximum(passages - 1, 0).sum())
    a, b, c = np.sort(triangles, axis=1).T
    order = np.lexsort((c, b, a))
    twice = (np.diff(a[order]) == 0) & (np.diff(b[order]) == 0) & (np.diff(c[order]) == 0)
    whole = not np.any((a == b) | (b == c)) and not twice.any()
    return Topology(
        components=len(np.unique(node[used])),
        boundary_loops=loops,
        euler=len(used) - len(edges) + len(triangles),
        manifold=bool(whole and uses.max() <= 2 and len(pinched_nodes(grid)) == 0),
        orientable=_is_orientable(grid),
    )
