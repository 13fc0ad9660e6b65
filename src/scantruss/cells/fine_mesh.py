"""Fine mesh: a grid of triangles, each divided into smaller ones on the scan, on which the rows of another lattice are laid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..grid.grid import Grid
from ..improve.working_mesh import WorkingMesh
from ..kernels.boundary.curves import at_arc, nearest_on_curves
from ..kernels.cells.quads import FREE_NODE, RESTING_NODE, SLIDING_NODE
from ..kernels.mesh.grid import INTERIOR, ON_CURVE
from ..kernels.surface.local_surface import onto_patch


@dataclass(frozen=True, eq=False)
class FineMesh:
    """Small triangles on the scan, with what holds their nodes."""

    nodes: np.ndarray  #: (F, 3) [scan unit]
    triangles: np.ndarray  #: (T, 3) int64
    held: np.ndarray  #: (F,) int64 FREE_NODE, SLIDING_NODE or RESTING_NODE
    chains: np.ndarray  #: (C, 2) int64 edges along the boundary and lines
    length: np.ndarray  #: (F,) desired member length [scan unit]
    owners: np.ndarray  #: (F, 3) int64 corners of the triangle of the grid that each node lies in
    shares: np.ndarray  #: (F, 3) their shares in its place
    edges: np.ndarray  #: (E, 2) all edges, smaller node first, sorted
    normals: np.ndarray  #: (F, 3) unit normals, means over the triangles by area


def fine_mesh(grid: Grid, mesh: WorkingMesh, parts: int) -> FineMesh:
    """Return the triangles of a grid, each divided into `parts` squared ones, with all nodes on the scan.

    Parameters
    ----------
    grid : Grid
        Of triangles.
    mesh : WorkingMesh
        The same grid, opened: its node k is node k of the grid.
    parts : int
        Pieces that each member becomes.
    """
    net, count = mesh.net, len(grid.nodes)
    edges, triangles = grid.edges, grid.triangles
    sides = grid.half_edge_edges.reshape(3, -1).T
    on_edge = count + np.arange(len(edges) * (parts - 1)).reshape(len(edges), parts - 1)
    inner = [(i, j) for i in range(1, parts) for j in range(1, parts - i)]
    within = count + on_edge.size + np.arange(len(triangles) * len(inner)).reshape(len(triangles), len(inner))
    share = np.arange(1, parts)[:, None] / parts
    of_edge = np.tile(np.concatenate([1 - share, share, 0 * share], axis=1), (len(edges), 1))
    of_inner = np.tile(
        np.array([(parts - i - j, i, j) for i, j in inner], float).reshape(-1, 3) / parts, (len(triangles), 1)
    )
    shares = np.concatenate([np.tile([1.0, 0.0, 0.0], (count, 1)), of_edge, of_inner])
    owners = np.concatenate(
        [
            np.tile(np.arange(count)[:, None], 3),
            np.repeat(edges[:, [0, 1, 0]], parts - 1, axis=0),
            np.repeat(triangles, len(inner), axis=0),
        ]
    )
    nodes = np.einsum("fc,fcx->fx", shares, grid.nodes[owners])
    own = owners[np.arange(len(owners)), shares.argmax(axis=1)]

    held = np.full(len(nodes), FREE_NODE)
    held[:count] = np.where(
        net.kind[:count] == INTERIOR, FREE_NODE, np.where(net.kind[:count] == ON_CURVE, SLIDING_NODE, RESTING_NODE)
    )
    chain = (grid.edge_uses == 1) | grid.edge_on_line
    held[on_edge[chain].ravel()] = SLIDING_NODE
    for v in range(count, len(nodes)):
        place = tuple(nodes[v].tolist())
        if held[v] == FREE_NODE:
            nodes[v] = onto_patch(mesh.patches[own[v]], place)
    if len(mesh.curves.total):
        _onto_curves(nodes, on_edge[chain].ravel(), mesh, grid)
    table = np.empty((len(triangles), parts + 1, parts + 1), np.int64)
    for corner, (i, j) in enumerate(((0, 0), (parts, 0), (0, parts))):
        table[:, i, j] = triangles[:, corner]
    for k in range(1, parts):
        for side, (i, j), (first, second) in (
            (0, (k, 0), (0, 1)),
            (1, (parts - k, k), (1, 2)),
            (2, (0, parts - k), (2, 0)),
        ):
            forward = triangles[:, first] < triangles[:, second]
            row = sides[:, side]
            table[:, i, j] = np.where(forward, on_edge[row, k - 1], on_edge[row, parts - 1 - k])
    for number, (i, j) in enumerate(inner):
        table[:, i, j] = within[:, number]
    small = [
        np.stack([table[:, i, j], table[:, i + 1, j], table[:, i, j + 1]], axis=1)
        for i in range(parts)
        for j in range(parts - i)
    ]
    small += [
        np.stack([table[:, i + 1, j], table[:, i + 1, j + 1], table[:, i, j + 1]], axis=1)
        for i in range(parts - 1)
        for j in range(parts - 1 - i)
    ]
    along = np.concatenate([edges[chain][:, [0]], on_edge[chain], edges[chain][:, [1]]], axis=1)
    chains = np.stack([along[:, :-1].ravel(), along[:, 1:].ravel()], axis=1)
    desired, all_small = mesh.length * net.desired[own], np.concatenate(small)
    return FineMesh(
        nodes, all_small, held, chains, desired, owners, shares, _edges(all_small, len(nodes)), _normals(nodes, all_small)
    )  # fmt: skip


def _edges(triangles: np.ndarray, count: int) -> np.ndarray:
    """Return the edges of triangles of `count` nodes (E, 2)."""
    starts, ends = triangles.ravel(), triangles[:, [1, 2, 0]].ravel()
    key = np.unique(np.minimum(starts, ends) * count + np.maximum(starts, ends))
    return np.stack(np.divmod(key, count), axis=1)


def _normals(nodes: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return the unit normal at each node (F, 3)."""
    a, b, c = (nodes[corner] for corner in triangles.T)
    areas, at = np.tile(np.cross(b - a, c - a), (3, 1)), triangles.T.ravel()
    total = np.stack([np.bincount(at, areas[:, k], len(nodes)) for k in range(3)], axis=1)
    return total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-300)


def _onto_curves(nodes: np.ndarray, some: np.ndarray, mesh: WorkingMesh, grid: Grid) -> None:
    """Put some nodes onto the nearest curve, where one is near."""
    for v in some.tolist():
        curve, arc, distance = nearest_on_curves(mesh.curves, *nodes[v].tolist())
        if curve >= 0 and distance < 0.35 * mesh.length:
            nodes[v] = at_arc(mesh.curves, curve, arc)[1:]
