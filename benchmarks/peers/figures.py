"""Figures of any triangle net against the truth of its shape; nothing of how it was made counts."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from scantruss.grid.grid import Grid

from ..measure import right_topology

if TYPE_CHECKING:
    from shapes import Shape

NEAR = 0.5  #: the scan is covered where a triangle is nearer than this [members]
BOUNDARY_STEP = 1 / 200  #: boundaries are compared at positions this far apart [members]
SURFACE_STEP = 1 / 6  #: triangles are looked at through positions this far apart [members]
SEEN = 100_000  #: at most so many points of the scan are asked whether they are covered


@dataclass(frozen=True)
class Figures:
    """What is told of one net; lengths in desired members."""

    right: bool  #: manifold, orientable, with the loops, components and Euler number of the shape
    manifold: bool
    loops: int
    true_loops: int
    euler: int
    true_euler: int
    components: int
    nodes: int
    triangles: int
    shape_mean: float  #: G
    shape_std: float
    cv: float
    length: float  #: mean
    angle_min: float  #: [degree]
    valence6: float
    deviation: float  #: mean distance of the nodes from the true surface
    deviation_max: float
    boundary: (
        float | None
    )  #: largest distance between the net's boundary and the true one, either way; None: neither has a boundary
    uncovered: float  #: share of the scan with no triangle within half a member

    def to_dict(self) -> dict[str, Any]:
        return asdict(self)


def net(nodes: np.ndarray, triangles: np.ndarray) -> Grid:
    """Return the nodes that triangles use and the triangles, those with a node twice left out."""
    triangles = np.asarray(triangles, np.int64).reshape(-1, 3)
    triangles = triangles[(triangles != np.roll(triangles, 1, axis=1)).all(axis=1)]
    used, triangles = np.unique(triangles, return_inverse=True)
    return Grid(
        nodes=np.ascontiguousarray(np.asarray(nodes, np.float64)[used]).reshape(-1, 3),
        triangles=np.ascontiguousarray(triangles.reshape(-1, 3)),
        fixed=np.zeros(len(used), bool),
        origin=np.zeros(3),
    )


def along(start: np.ndarray, end: np.ndarray, step: float) -> np.ndarray:
    """Return positions on the segments (K, 3)-(K, 3), at most `step` apart, with their ends, (P, 3)."""
    parts = np.maximum(1, np.ceil(np.linalg.norm(end - start, axis=1) / step)).astype(int)
    which = np.repeat(np.arange(len(parts)), parts + 1)
    share = (np.arange(len(which)) - np.repeat(np.cumsum(parts + 1) - parts - 1, parts + 1)) / parts[which]
    return np.asarray(start[which] + share[:, None] * (end - start)[which])


def boundary_distance(grid: Grid, loops: list[np.ndarray], length: float) -> float | None:
    """Return the largest distance between the boundary of a net and the true loops (K, 3), either way [members]."""
    from scipy.spatial import cKDTree

    ends = grid.nodes[grid.edges[grid.edge_uses == 1]]
    if not len(ends) or not loops:
        return None if not len(ends) and not loops else float("inf")
    ours = along(ends[:, 0], ends[:, 1], BOUNDARY_STEP * length)
    truth = np.concatenate([along(loop, np.roll(loop, -1, axis=0), BOUNDARY_STEP * length) for loop in loops])
    there, back = cKDTree(truth).query(ours)[0].max(), cKDTree(ours).query(truth)[0].max()
    return float(max(there, back)) / length


def on_triangles(nodes: np.ndarray, triangles: np.ndarray, step: float) -> np.ndarray:
    """Return positions all over the triangles (T, 3), about `step` apart, (P, 3)."""
    corners = nodes[triangles]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    parts = np.clip(np.ceil(longest / step), 1, 60).astype(int)
    found = []
    for count in np.unique(parts):
        first, second = np.meshgrid(np.arange(count + 1), np.arange(count + 1), indexing="ij")
        inside = first + second <= count
        share = np.stack([first[inside], second[inside], count - first[inside] - second[inside]], axis=1) / count
        found.append(np.einsum("pk,tkd->tpd", share, corners[parts == count]).reshape(-1, 3))
    return np.concatenate(found)


def uncovered(grid: Grid, points: np.ndarray, length: float) -> float:
    """Return the share of the points (N, 3) that are farther than half a member from every triangle."""
    from scipy.spatial import cKDTree

    seen = points[:: -(-len(points) // SEEN)]
    tree = cKDTree(on_triangles(grid.nodes, grid.triangles, SURFACE_STEP * length))
    return float((tree.query(seen, distance_upper_bound=NEAR * length)[0] > NEAR * length).mean())


def figures(shape: Shape, nodes: np.ndarray, triangles: np.ndarray) -> Figures:
    """Return the figures of a net (V, 3), (T, 3) made for `shape`, whose `length` was wanted."""
    grid = net(nodes, triangles)
    if not len(grid.triangles):
        raise ValueError("no triangles")
    quality, found, distance = grid.quality, grid.topology, shape.distance(grid.nodes) / shape.length
    return Figures(
        right=right_topology(shape, grid),
        manifold=found.manifold and found.orientable,
        loops=found.boundary_loops,
        true_loops=len(shape.loops),
        euler=found.euler,
        true_euler=shape.euler,
        components=found.components,
        nodes=len(grid.nodes),
        triangles=len(grid.triangles),
        shape_mean=quality.shape_mean,
        shape_std=quality.shape_std,
        cv=quality.length_cv,
        length=quality.length_mean / shape.length,
        angle_min=quality.angle_min,
        valence6=quality.valence6,
        deviation=float(distance.mean()),
        deviation_max=float(distance.max()),
        boundary=boundary_distance(grid, shape.loops, shape.length),
        uncovered=uncovered(grid, shape.points, shape.length),
    )
