"""Nodes at corners and on the boundary curves, which projections move off them."""

from __future__ import annotations

import numpy as np

from ..grid.grid import Grid
from ..improve.working_mesh import WorkingMesh
from ..kernels.boundary.curves import slide
from ..kernels.mesh.grid import ON_CURVE

AT_STOP = 0.6  # distance up to which a node of the boundary is that of a corner [members]


def at_stops(grid: Grid, stops: np.ndarray, length: float, some: np.ndarray | None = None) -> Grid:
    """Return a grid whose nodes at corners and ends of lines lie where these are on the curve, which projection left.

    some : nodes that may, those of the boundary if not given
    """
    some = np.unique(grid.edges[grid.edge_uses == 1]) if some is None else some
    if not len(stops) or not len(some):
        return grid
    nodes = grid.nodes.copy()
    for place in stops:
        away = np.linalg.norm(grid.nodes[some] - place, axis=1)
        if away.min() < AT_STOP * length:
            nodes[some[away.argmin()]] = place
    return grid.replace(nodes=nodes)


def slide_back(mesh: WorkingMesh, count: int) -> None:
    """Bring those of the first `count` nodes that slide back onto their curves."""
    net = mesh.net
    for v in np.flatnonzero(net.kind[:count] == ON_CURVE).tolist():
        reach = 0.5 * mesh.length * net.desired[v]
        net.arc[v], *place = slide(mesh.curves, net.curve[v], net.arc[v], reach, *net.nodes[v].tolist())
        net.nodes[v] = place


def ways_along(nodes: np.ndarray, members: np.ndarray) -> np.ndarray:
    """Return a unit vector along the boundary or a line at each of its nodes (V, 3), either way; members: their members (B, 2)."""
    nearest, total = np.full(len(nodes), -1), np.zeros_like(nodes)
    for v, w in (*members.tolist(), *members[:, ::-1].tolist()):
        sign = -1.0 if nearest[v] >= 0 else 1.0
        nearest[v] = w
        total[v] += sign * (nodes[w] - nodes[v])
    return total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-300)
