"""Measure a grid against the truth of its shape."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from surfaces import distance_to_triangles

from scantruss.grid.grid import Grid

if TYPE_CHECKING:
    from shapes import Shape


@dataclass(frozen=True)
class Measured:
    """What is told of one grid."""

    right: bool  #: manifold, one orientation, and loops, components and Euler number of the shape
    topology: str
    shape_mean: float
    shape_std: float
    shape_min: float
    cv: float
    length: float  #: mean member length in desired lengths
    angle_min: float
    angle_max: float
    valence6: float
    boundary: float  #: largest distance of the true boundary from the boundary of the grid, in members
    corner: float  #: largest distance of a true corner from the nearest node, in members
    distance: (
        float  #: mean distance of the nodes from the true surface, in noise (in thousandths of a member: no noise)
    )
    nodes: int
    distance_in: str = "noise"  #: "member" where there is no noise

    def line(self) -> str:
        """Return the figures in one line."""
        return (
            f"{'right' if self.right else 'WRONG'} {self.topology:18s}"
            f" G {self.shape_mean:.3f} {self.shape_std:.3f} {self.shape_min:.2f}"
            f" cv {self.cv:.3f} L {self.length:.3f} angle {self.angle_min:3.0f}-{self.angle_max:3.0f}"
            f" six {self.valence6:.2f} boundary {self.boundary:.2f} corner {self.corner:.3f}"
            f" dist {self.distance:.2f} V {self.nodes}"
        )


def _boundary_distance(grid: Grid, nodes: np.ndarray, boundary: np.ndarray) -> float:
    """Largest distance of positions on the true boundary (K, 3) from the members on the grid's boundary."""
    ends = nodes[grid.edges[grid.edge_uses == 1]]
    if not len(ends):
        return float("inf")
    from scipy.spatial import cKDTree

    boundary = boundary[:: max(1, len(boundary) // 4000)]
    _, near = cKDTree(ends.mean(axis=1)).query(boundary, k=min(6, len(ends)))
    start, end = ends[near, 0], ends[near, 1]
    return float(distance_to_triangles(boundary[:, None], start, end, end).min(axis=1).max())


def right_topology(shape: Shape, grid: Grid) -> bool:
    """Whether the grid has the loops, components and Euler number of the shape, and is manifold and orientable."""
    found = grid.topology
    known = not shape.known_loops or (found.boundary_loops, found.euler) == (len(shape.loops), shape.euler)
    return bool(found.manifold and found.orientable and known and found.components == shape.components)


def measure(shape: Shape, grid: Grid, length: float) -> Measured:
    """Return the figures of a grid of `shape` made with members of `length`."""
    nodes, found, quality = grid.nodes + grid.origin, grid.topology, grid.quality
    corners = [float(np.linalg.norm(nodes - corner, axis=1).min()) / length for corner in shape.corners]
    boundary = (
        _boundary_distance(grid, nodes, np.concatenate(shape.loops)) / length
        if shape.loops and shape.known_loops
        else 0.0
    )
    return Measured(
        right=right_topology(shape, grid),
        topology=f"l{found.boundary_loops}/{len(shape.loops)} e{found.euler}/{shape.euler} c{found.components}"
        + ("" if found.manifold else " NM")
        + ("" if found.orientable else " NO"),
        shape_mean=quality.shape_mean,
        shape_std=quality.shape_std,
        shape_min=quality.shape_min,
        cv=quality.length_cv,
        length=quality.length_mean / length,
        angle_min=quality.angle_min,
        angle_max=quality.angle_max,
        valence6=quality.valence6,
        boundary=boundary,
        corner=max(corners, default=0.0),
        distance=float(shape.distance(nodes).mean()) / (shape.noise or length / 1000),
        nodes=len(nodes),
        distance_in="noise" if shape.noise else "member",
    )
