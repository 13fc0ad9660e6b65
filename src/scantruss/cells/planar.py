"""Planar panels: corners are drawn to the mean planes of their panels, nodes held near the scan, by projections in turn.

Bouaziz et al. (2012), "Shape-up: shaping discrete geometry with projections". Where the rows do not follow conjugate directions of the
surface, quads cannot be planar and near it at once: what is left is measured and named.
"""

from __future__ import annotations

import numpy as np

from ..grid.grid import Grid
from ..grid.panels import area_vectors_of, sides_of, sizes_of
from ..improve.working_mesh import WorkingMesh
from ..kernels.mesh.grid import AT_REST, INTERIOR
from ..kernels.surface.local_surface import onto_patch
from .stops import slide_back

PLANAR_ENOUGH = 0.003  # distance of a corner from its panel's mean plane below which it is planar [mean diagonals]
FARTHEST_OFF_SCAN = 0.1  # distance of a node from the scan up to which panels are made planar [members]
PLANAR_ROUNDS, PLANAR_STEPS = 60, 20  # times that nodes are held near the scan, and projections between
HOLD = 0.97  # share of `FARTHEST_OFF_SCAN` at which a node is held
EVEN_STEP = 0.06  # of the step to even members in the first round; none in the last


def make_planar(mesh: WorkingMesh, grid: Grid) -> Grid:
    """Return a grid with its panels as planar as nodes within a tenth of a member of the scan allow; its boundary stays.

    Parameters
    ----------
    mesh : WorkingMesh
        The grid opened; its node k is node k of the grid. Its nodes are moved.
    grid : Grid
        Of quads or hexagons, on the scan.
    """
    net, count, panels = mesh.net, len(grid.nodes), grid.panel_table
    nodes = net.nodes[:count]
    owner, corner = np.repeat(np.arange(len(panels)), sizes_of(panels)), sides_of(panels)[:, 0]
    times = np.bincount(corner, minlength=count)[:, None]
    a, b = grid.edges.T
    still = net.kind[:count] >= AT_REST
    target = mesh.length * net.desired[:count]
    wanted = 0.5 * (target[a] + target[b])[:, None]
    for number in range(PLANAR_ROUNDS):
        even = EVEN_STEP * (1.0 - number / (PLANAR_ROUNDS - 1))
        for _ in range(PLANAR_STEPS):
            move = _to_planes(nodes, panels, owner, corner) / times
            way = nodes[b] - nodes[a]
            size = np.linalg.norm(way, axis=1, keepdims=True)
            pull = even * (1.0 - wanted / size) * way
            np.add.at(move, a, pull)
            np.add.at(move, b, -pull)
            move[still] = 0.0
            nodes += move
        _hold(mesh, count, target)
        slide_back(mesh, count)
    return grid.replace(nodes=nodes.copy())


def _to_planes(nodes: np.ndarray, panels: np.ndarray, owner: np.ndarray, corner: np.ndarray) -> np.ndarray:
    """Return the sum of the ways of each node to the mean planes of its panels (V, 3)."""
    normal = area_vectors_of(nodes, panels)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    middle: np.ndarray = np.stack([np.bincount(owner, nodes[corner, k], len(panels)) for k in range(3)], axis=1)
    middle = middle / np.bincount(owner, minlength=len(panels))[:, None]
    off = ((nodes[corner] - middle[owner]) * normal[owner]).sum(axis=1)
    move = np.zeros_like(nodes)
    np.add.at(move, corner, -off[:, None] * normal[owner])
    return move


def _hold(mesh: WorkingMesh, count: int, target: np.ndarray) -> None:
    """Bring nodes inside that are too far from the scan back to within reach of it."""
    net = mesh.net
    mesh.renew(0.3)
    for v in np.flatnonzero(net.kind[:count] == INTERIOR).tolist():
        place = net.nodes[v].copy()
        foot = np.array(onto_patch(mesh.patches[v], tuple(place.tolist())))
        off, most = float(np.linalg.norm(place - foot)), HOLD * FARTHEST_OFF_SCAN * float(target[v])
        if off > most:
            net.nodes[v] = foot + most / off * (place - foot)
