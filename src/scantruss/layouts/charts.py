"""Charts: the surface of a finished grid around each of its nodes, along which the node may move."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix

from ..grid.grid import Grid
from .double_layer import smoothed_normals

FARTHEST_MOVE = 0.35  #: of a node along the surface, over the mean member
HIGHEST_RISE = 0.05  #: of a node off its tangent plane, over the mean member; by how far its quadric may rise
STAYING_TURN = 36.0  #: turn of the boundary or of a line from which a node may be a corner; a little below that of `Settings` [degree]
SURE_TURN = 70.0  #: turn from which it is one, whatever is beside it [degree]
SHARPER_CORNER = 1.5  #: turn of a corner over the mean of those beside it; round holes of few members have no corners
LEAST_FITTED = 5  #: nodes around one, to which a quadric is fitted


@dataclass(frozen=True, eq=False)
class Charts:
    """Frames and quadrics at the nodes of a grid, of least squares through their neighbours and theirs.

    Nodes of the boundary and of lines move along a parabola through the two beside them. Corners, fixed nodes, and ends and crossings
    of lines stay.
    """

    nodes: np.ndarray  #: (V, 3) where the nodes were [unit of the grid]
    frames: np.ndarray  #: (V, 3, 3) rows u, v, n
    free: np.ndarray  #: (V, 2) bool, which of u and v are free
    quadrics: np.ndarray  #: (V, 3) heights of u u, u v and v v along n [1 / unit of the grid]
    mean: float  #: mean member [unit of the grid]

    @classmethod
    def of_grid(cls, grid: Grid) -> Charts:
        """Return the charts of a grid."""
        frames, free, quadrics = _frames_of(grid)
        return cls(grid.nodes, frames, free, quadrics, float(grid.lengths.mean()))

    def moved(self, place: np.ndarray) -> np.ndarray:
        """Return where nodes (V, 3) are that have moved by (V, 2) along their charts."""
        u, v = place.T
        height = (self.quadrics * np.stack([u * u, u * v, v * v], axis=1)).sum(axis=1)
        most = HIGHEST_RISE * self.mean
        offset = np.stack([u, v, np.clip(height, -most, most)], axis=1)
        return np.asarray(self.nodes + np.einsum("vk,vkc->vc", offset, self.frames))

    def ways(self, place: np.ndarray) -> np.ndarray:
        """Return how nodes move (V, 2, 3) with u and v; nil for what is not free."""
        u, v = place.T
        a, b, c = self.quadrics.T
        rise = np.stack([2 * a * u + b * v, b * u + 2 * c * v], axis=1)
        return np.asarray((self.frames[:, :2] + rise[:, :, None] * self.frames[:, 2:]) * self.free[:, :, None])

    def place_of(self, nodes: np.ndarray) -> np.ndarray:
        """Return by how much nodes (V, 3) have moved along what is free (V, 2)."""
        return np.asarray(np.einsum("vkc,vc->vk", self.frames[:, :2], nodes - self.nodes) * self.free)

    def within(self, place: np.ndarray) -> np.ndarray:
        """Return moves (V, 2) none of which is farther than is allowed."""
        return shortened(place, FARTHEST_MOVE * self.mean)


def shortened(moves: np.ndarray, most: float) -> np.ndarray:
    """Return moves (V, D) of which those longer than `most` are as long as that."""
    return np.asarray(moves * np.minimum(1.0, most / np.maximum(np.linalg.norm(moves, axis=1, keepdims=True), 1e-300)))


def _frames_of(grid: Grid) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return frames, which ways are free, and quadrics; see `Charts`."""
    count = len(grid.nodes)
    normal = smoothed_normals(grid)
    axis = np.eye(3)[np.abs(normal).argmin(axis=1)]
    u = axis - (axis * normal).sum(axis=1, keepdims=True) * normal
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    free = np.ones((count, 2), bool)
    frames, quadrics = _fitted(grid, np.stack([u, np.cross(normal, u), normal], axis=1))
    rails, beside = _rails(grid)
    free[rails] = False
    on = np.flatnonzero(beside[:, 0] >= 0)
    turn = np.zeros(count)
    for node in on.tolist():
        turn[node] = _lay_along(grid.nodes[[beside[node, 0], node, beside[node, 1]]], frames[node], quadrics[node])
    around = turn[beside[on]].mean(axis=1)
    free[on, 0] = (turn[on] < STAYING_TURN) | ((turn[on] < SURE_TURN) & (turn[on] < SHARPER_CORNER * around))
    free[grid.fixed] = False
    return frames, free, quadrics


def _rails(grid: Grid) -> tuple[np.ndarray, np.ndarray]:
    """Return the nodes of the boundary and of lines, and of each node (V, 2) the two beside it there, -1 where these are not two."""
    edges = grid.edges[(grid.edge_uses == 1) | grid.edge_on_line]
    ends = np.concatenate([edges, edges[:, ::-1]])
    ends = ends[np.lexsort((ends[:, 1], ends[:, 0]))]
    nodes, first, counts = np.unique(ends[:, 0], return_index=True, return_counts=True)
    beside = np.full((len(grid.nodes), 2), -1)
    two = counts == 2
    beside[nodes[two]] = ends[first[two][:, None] + np.arange(2), 1]
    return nodes, beside


def _lay_along(three: np.ndarray, frame: np.ndarray, quadric: np.ndarray) -> float:
    """Lay the frame and the quadric of the middle one of three nodes along the parabola through them; return its turn [degree]."""
    back, on = three[1] - three[0], three[2] - three[1]
    s, t = float(np.linalg.norm(back)), float(np.linalg.norm(on))
    slope = (back / s * t + on / t * s) / (s + t)  # of the parabola, at the middle one
    bend = (on / t - back / s) / (s + t)
    frame[0] = slope / max(float(np.linalg.norm(slope)), 1e-300)
    bend = bend - (bend @ frame[0]) * frame[0]
    size = float(np.linalg.norm(bend))
    if size > 1e-12 / (s + t):
        frame[2] = bend / size
    else:
        frame[2] -= (frame[2] @ frame[0]) * frame[0]
        frame[2] /= np.linalg.norm(frame[2])
    frame[1] = np.cross(frame[2], frame[0])
    quadric[:] = size, 0.0, 0.0
    return math.degrees(math.acos(min(1.0, max(-1.0, float(back @ on) / (s * t)))))


def _fitted(grid: Grid, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the frames (V, 3, 3) turned to the normals of quadrics fitted to the neighbours and theirs, and the quadrics (V, 3)."""
    count = len(grid.nodes)
    ends = np.concatenate([grid.edges, grid.edges[:, ::-1]])
    near = csr_matrix((np.ones(len(ends)), tuple(ends.T)), (count, count))
    near = near + near @ near
    near.setdiag(0)
    near.eliminate_zeros()
    near.sort_indices()
    node, place = np.repeat(np.arange(count), np.diff(near.indptr)), np.arange(near.nnz)
    local = np.einsum("kij,kj->ki", frames[node], grid.nodes[near.indices] - grid.nodes[node])
    around = np.zeros((count, int(np.diff(near.indptr).max(initial=1)), 3))  # rows of nil weigh nothing in the fit
    around[node, place - near.indptr[node]] = local
    x, y, z = around.transpose(2, 0, 1)
    table = np.stack([x, y, x * x, x * y, y * y], axis=2)
    fitted = (np.linalg.pinv(table) @ z[..., None])[..., 0]
    fitted[np.diff(near.indptr) < LEAST_FITTED] = 0.0
    u, v, normal = (frames[:, k] for k in range(3))
    normal = normal - fitted[:, [0]] * u - fitted[:, [1]] * v
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    u = u - (u * normal).sum(axis=1, keepdims=True) * normal
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    return np.stack([u, np.cross(normal, u), normal], axis=1), fitted[:, 2:]
