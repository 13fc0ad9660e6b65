"""What a grid is, apart from where it lies: pieces, boundary loops, Euler number, manifold, orientable."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from ..kernels.geometry.components import component_labels
from .tables import GridTables


@dataclass(frozen=True)
class Topology:
    """What the grid is, whatever its shape and place."""

    components: int
    boundary_loops: int
    euler: int
    manifold: bool
    orientable: bool

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, ready for JSON."""
        return asdict(self)


def _links(grid: GridTables) -> tuple[np.ndarray, np.ndarray]:
    """Return the pairs of half-edges that lie on one edge, each half-edge with the next of its edge."""
    grid = grid.triangulated
    order = np.argsort(grid.half_edge_edges, kind="stable")
    sorted_edges = grid.half_edge_edges[order]
    same = np.flatnonzero(sorted_edges[1:] == sorted_edges[:-1])
    return order[same], order[same + 1]


def _sheets(grid: GridTables) -> np.ndarray:
    """Return the (2 T,) pieces of two sheets: each triangle as it stands, then turned over; links join what agrees."""
    count = len(grid.triangles)
    one, other = _links(grid)
    starts = grid.triangles.T.ravel()
    turned = starts[one] == starts[other]
    a, b = one % count, other % count
    return component_labels(
        2 * count, np.concatenate([a, a + count]), np.concatenate([b + count * turned, b + count * ~turned])
    )


def _is_orientable(grid: GridTables) -> bool:
    """Whether the triangles can be turned so that neighbours run along their edge in opposite directions.

    The grid is one-sided if a triangle is joined with itself turned over, as always where an edge has three.
    """
    if (grid.edge_uses > 2).any():
        return False
    label, count = _sheets(grid), len(grid.triangles)
    return not np.any(label[:count] == label[count:])


def wound_alike(grid: GridTables) -> np.ndarray:
    """Return the (T, 3) triangles of a grid with two sides, each turned to agree with the first of those it is joined to."""
    label, count = _sheets(grid), len(grid.triangles)
    own, other = label[:count], label[count:]
    _, first, piece = np.unique(np.minimum(own, other), return_index=True, return_inverse=True)
    turned = own != own[first[piece.ravel()]]
    return np.where(turned[:, None], grid.triangles[:, [0, 2, 1]], grid.triangles)


def pinched_nodes(grid: GridTables) -> np.ndarray:
    """Return the nodes whose triangles are more than one fan, joined over edges at the node."""
    grid = grid.triangulated
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
    label = component_labels(3 * count, np.concatenate(first), np.concatenate(second))
    fans = np.bincount(corners[np.unique(label)], minlength=len(grid.nodes))
    return np.flatnonzero(fans > 1)


def measure_topology(grid: GridTables) -> Topology:
    """Return components, loops, Euler number; whether manifold and orientable (both by the triangles alone).

    Nodes without a triangle do not count. Manifold: no edge has more than two triangles, the triangles at each node
    are one fan, and no triangle is there twice or has a node twice.
    """
    grid = grid.triangulated
    triangles, edges, uses = grid.triangles, grid.edges, grid.edge_uses
    if len(triangles) == 0:
        return Topology(components=0, boundary_loops=0, euler=0, manifold=True, orientable=True)
    node = component_labels(len(grid.nodes), edges[:, 0], edges[:, 1])
    used = np.unique(triangles)
    boundary_edges = edges[uses == 1]
    boundary_label = component_labels(len(grid.nodes), boundary_edges[:, 0], boundary_edges[:, 1])
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
