"""Relief: a grid taken apart for the kernels, on the scanned surface and its boundary curves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..kernels import grid as kernels
from ..kernels.equalize import seat_nodes
from ..kernels.grid import INTERIOR, LOCKED, REST, RIM, Net
from ..kernels.rim import Rim, nearest_on_rim
from ..kernels.surface import PATCH, Surface
from .grid import Grid

WIDTH = 12  # neighbours a node may have while the grid is improved, unless it had more


def no_rim() -> Rim:
    """Return the curves of a closed scan: none."""
    return Rim(np.zeros((0, 3)), np.zeros(0), np.zeros(1, np.int64), np.zeros(0))


@dataclass(frozen=True, eq=False)
class Relief:
    """What the improvement works on: the net, the scan below it, its boundary curves."""

    net: Net
    source: np.ndarray  #: (C,) int64 node of the grid that each node of the net stands for, -1 new
    surface: Surface
    patches: np.ndarray  #: (C, PATCH) local surface of each node
    rim: Rim
    length: float  #: desired member length [scan unit]

    @classmethod
    def from_grid(cls, grid: Grid, surface: Surface, rim: Rim, corners: np.ndarray, length: float) -> Relief:
        """Take a grid apart; every node finds its place on the scan and on the boundary curves.

        Parameters
        ----------
        grid : Grid
        surface : Surface
        rim : Rim
        corners : (K, 3) float64 corners of the boundary; boundary nodes at them stay at rest [scan unit]
        length : desired member length [scan unit]
        """
        corner_node, partner = _half_edges(grid.triangles, len(grid.nodes))
        valence = int(np.bincount(grid.edges.ravel(), minlength=1).max()) if len(grid.edges) else 0
        capacity = len(grid.nodes) + len(corner_node) // 3 // 2 + 64
        net = Net(
            nodes=np.zeros((capacity, 3)),
            ring=np.zeros((capacity, max(WIDTH, valence + 2)), np.int64),
            degree=np.zeros(capacity, np.int64),
            is_open=np.zeros(capacity, np.int64),
            kind=np.full(capacity, INTERIOR, np.int64),
            curve=np.full(capacity, -1, np.int64),
            arc=np.zeros(capacity),
            free=np.zeros(capacity, np.int64),
            count=np.zeros(2, np.int64),
        )
        source = np.full(capacity, -1, np.int64)
        used = kernels.fill_rings(corner_node, partner, net.ring, net.degree, net.is_open, source, len(grid.nodes))
        net.nodes[:used] = grid.nodes[source[:used]]
        spare = np.arange(capacity - 1, used - 1, -1)
        net.free[: len(spare)] = spare
        net.count[:] = len(spare), used
        relief = cls(net, source, surface, np.zeros((capacity, PATCH)), rim, length)
        relief._hold_boundary(corners)
        relief._hold_defects(len(grid.nodes))
        net.kind[: len(grid.nodes)][grid.fixed & (net.kind[: len(grid.nodes)] != LOCKED)] = REST
        seat_nodes(net, surface, relief.patches, length)
        return relief

    def _hold_boundary(self, corners: np.ndarray) -> None:
        """Boundary nodes slide along the nearest curve; corners and nodes far from every curve are at rest."""
        net = self.net
        for v in np.flatnonzero(net.is_open).tolist():
            curve, arc, distance = nearest_on_rim(self.rim, *net.nodes[v])
            near = curve >= 0 and distance <= 0.5 * self.length
            net.kind[v] = RIM if near else REST
            net.curve[v], net.arc[v] = (curve, arc) if near else (-1, 0.0)
            if len(corners) and np.min(((corners - net.nodes[v]) ** 2).sum(axis=1)) <= (1e-6 * self.length) ** 2:
                net.kind[v] = REST

    def _hold_defects(self, count: int) -> None:
        """Nodes with several fans and nodes on a seam stay as they are."""
        net, used = self.net, int(self.net.count[1])
        several = np.bincount(self.source[:used], minlength=count) > 1
        net.kind[:used][several[self.source[:used]]] = LOCKED
        ring = np.sort(np.where(np.arange(net.ring.shape[1]) < net.degree[:used, None], net.ring[:used], -1), axis=1)
        twice = ((ring[:, 1:] == ring[:, :-1]) & (ring[:, 1:] >= 0)).any(axis=1)
        net.kind[:used][twice] = LOCKED

    def to_grid(self, grid: Grid) -> Grid:
        """Put the net together again, with all else as in `grid`; nodes without a triangle are dropped."""
        net, used = self.net, int(self.net.count[1])
        room = np.empty((2 * int(net.degree[:used].sum()) + 1, 3), np.int64)
        triangles = room[: kernels.list_triangles(net, room)]
        merged = np.arange(used)
        copies = np.flatnonzero(self.source[:used] >= 0)
        merged[copies] = self.source[copies]
        triangles = merged[triangles]
        kept, inverse = np.unique(triangles, return_inverse=True)
        fixed = np.zeros(used, bool)
        fixed[: len(grid.fixed)] = grid.fixed
        return grid.replace(
            nodes=np.ascontiguousarray(net.nodes[kept]),
            triangles=np.ascontiguousarray(inverse.reshape(-1, 3).astype(np.int64)),
            fixed=fixed[kept],
            deviation=None,
        )


def _half_edges(triangles: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the node of each corner (3 T,) and the half-edge opposite to each half-edge (3 T,), -1 where there is none.

    Half-edge 3 t + k runs from corner k of triangle t to the next. Two are partners only if they are the only ones on
    their edge and run in opposite directions: the grid is cut along all other edges.
    """
    start = np.ascontiguousarray(triangles).reshape(-1).copy()
    end = np.ascontiguousarray(triangles[:, [1, 2, 0]]).reshape(-1)
    key = np.minimum(start, end) * count + np.maximum(start, end)
    order = np.argsort(key, kind="stable")
    ordered = key[order]
    new = np.ones(len(key), bool)
    new[1:] = ordered[1:] != ordered[:-1]
    first = np.flatnonzero(new)
    pairs = first[np.diff(np.append(first, len(key))) == 2]
    a, b = order[pairs], order[pairs + 1]
    opposite = start[a] == end[b]
    a, b = a[opposite & (start[a] != end[a])], b[opposite & (start[a] != end[a])]
    partner = np.full(len(key), -1, np.int64)
    partner[a], partner[b] = b, a
    return start, partner
