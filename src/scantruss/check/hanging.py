"""Nodes that hang on points off the surface, as on a scaffold under a roof: most of their members cross empty space to get there."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..grid.certificate import Fault, place_of
from ..kernels.mesh.coverage import nearest_distances
from .distances import POINT_BOX, boxes_of
from .gaps import by_x, points_within
from .limits import PLACES_KEPT

if TYPE_CHECKING:
    from ..grid.grid import Grid
    from ..surface.samples import SurfaceSamples
    from .distances import Distances

HALF_EMPTY = 0.2  # distance from the nearest point at which the middle of a member is in empty space [member lengths]
SPACINGS_EMPTY = 10.0  # ... and in spacings of the points
AROUND_END = (
    0.35  # radius around an end of a member within which points tell how the surface lies there [member lengths]
)
FEWEST_AT_END = 6  # fewest such points
FLAT_AT_END = 0.1  # variance across the surface there, in the next one, above which they are none
STEEP = 0.6  # sine of the angle between a member and the surface above which it leaves it
FEWEST_MEMBERS = (
    3  # such members at a node, and half of all, from which on it hangs: at a cliff or a horn there are fewer
)


def hanging_nodes(grid: Grid, samples: SurfaceSamples, found: Distances, length: float) -> list[Fault]:
    """Return a fault where nodes hang on points off the surface, with their places; nothing where there is none.

    Parameters
    ----------
    found : how far the triangles of the grid lie from the points
    length : desired member length where the grid has none of its own [scan unit]
    """
    desired = np.full(len(grid.nodes), length) if grid.desired is None else grid.desired
    members, uses = desired[grid.edges].mean(axis=1), np.bincount(grid.edges.ravel(), minlength=len(grid.nodes))
    least = np.maximum(HALF_EMPTY * members, SPACINGS_EMPTY * samples.spacing)
    away = np.where(np.isfinite(found.triangles), found.triangles, 0.0)[grid.edge_triangles]
    doubted = np.where(grid.edge_triangles >= 0, away, np.inf).min(axis=1) > least
    doubted &= _hangs(grid, doubted, uses)[grid.edges].any(axis=1)
    which = np.flatnonzero(doubted)
    if not len(which):
        return []
    middles, distance = np.ascontiguousarray(grid.nodes[grid.edges[which]].mean(axis=1)), np.empty(len(which))
    points = samples.measured_points
    nearest_distances(
        middles, points, boxes_of(points, max(POINT_BOX * length, 2.0 * samples.spacing)), length, distance
    )
    doubted[which[distance <= least[which]]] = False
    hanging = _hangs(grid, doubted, uses)
    which = np.flatnonzero(doubted & hanging[grid.edges].any(axis=1))
    if not len(which):
        return []
    points = by_x(points)
    normals = {
        node: _normal(grid.nodes[node], AROUND_END * desired[node], points) for node in set(grid.edges[which].flat)
    }
    for member in which.tolist():
        one, other = grid.edges[member]
        way = (grid.nodes[other] - grid.nodes[one]) / np.linalg.norm(grid.nodes[other] - grid.nodes[one])
        doubted[member] = max(abs(normals[one] @ way), abs(normals[other] @ way)) > STEEP
    nodes = np.flatnonzero(_hangs(grid, doubted, uses))
    if not len(nodes):
        return []
    where, *others = (place_of(grid.nodes[node] + grid.origin) for node in nodes[:PLACES_KEPT])
    more = f" ({len(nodes)} such places)" if len(nodes) > 1 else ""
    return [Fault("hanging", f"hangs on points off the surface, across empty space{more}", where, tuple(others))]


def _hangs(grid: Grid, chosen: np.ndarray, uses: np.ndarray) -> np.ndarray:
    """Return at which nodes (V,) bool enough of all members (V,) are chosen (E,) bool."""
    count = np.bincount(grid.edges[chosen].ravel(), minlength=len(uses))
    enough: np.ndarray = (count >= FEWEST_MEMBERS) & (2 * count >= uses)
    return enough


def _normal(place: np.ndarray, reach: float, points: np.ndarray) -> np.ndarray:
    """Return the normal (3,) of the surface of the points by ascending x (N, 3) around a place, (0, 0, 0) where they form none."""
    around = points_within(place, reach, points)
    if len(around) < FEWEST_AT_END:
        return np.zeros(3)
    variances, axes = np.linalg.eigh(np.cov(around.T))
    normal: np.ndarray = axes[:, 0] if variances[0] < FLAT_AT_END * variances[1] else np.zeros(3)
    return normal
