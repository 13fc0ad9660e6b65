"""Distances between the points that were read and a grid, each way: never from samples, nor from a surface that nodes were put on."""

from __future__ import annotations

import weakref
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from ..kernels.geometry.boxes import SearchBoxes, new_boxes
from ..kernels.mesh.coverage import nearest_distances, put_places
from ..kernels.mesh.distances import nearest_triangles, plane_distances, put_feet, triangle_boxes
from ..kernels.surface.mean_surface import mean_offsets
from ..runtime.parallel import in_parts, side_by_side
from ..scan.cloud import bounds_of

if TYPE_CHECKING:
    from ..grid.grid import Grid
    from ..surface.samples import SurfaceSamples

# reach of the first search for the nearest triangle; most points have theirs nearer [member lengths]
FIRST_REACH = 0.05
REACH_GROWTHS = 50  # times that the reach is made four times as large at most: from any place to all of them
TRIANGLE_BOX = 0.8  # width of the boxes of triangles [member lengths]
POINT_BOX = 0.2  # width of the boxes of points [member lengths]
AROUND_NODE = 1.0  # radius within which points are compared with a node [member lengths]
COMPARED_WITH_NODE = 30  # points a node that are compared with it
POINTS_OF_PLANE = 12  # points through which the plane at a node goes
PLACES_MEASURED_PER_THREAD = 20_000  # fewest points for a thread of their own

_KEPT_BOXES: weakref.WeakKeyDictionary[SurfaceSamples, dict[tuple[bool, int, float], SearchBoxes]] = (
    weakref.WeakKeyDictionary()
)


@dataclass(frozen=True, eq=False)
class Distances:
    """Distances between a scan and a grid [scan unit]."""

    scan: np.ndarray  #: (N,) of every point that was read from the nearest triangle
    triangle: np.ndarray  #: (N,) int64, that triangle
    triangles: (
        np.ndarray
    )  #: (T,) of the middle or a corner of each triangle, the farther, from the nearest point; NaN over closed holes
    nodes: np.ndarray  #: (V,) of each node from the plane of the points around it; NaN over closed holes
    noise: np.ndarray  #: (V,) rms distance of those points from their plane


def measure_distances(grid: Grid, samples: SurfaceSamples, length: float) -> Distances:
    """Return how far all points that were read lie from a grid, and the grid from those that are no outliers.

    Parameters
    ----------
    length : desired member length [scan unit]
    """
    (scan, triangle), (triangles, nodes, noise) = side_by_side(
        lambda: distances_to_grid(samples.scan, grid, length), lambda: distances_to_points(grid, samples, length)
    )
    return Distances(scan, triangle, triangles, nodes, noise)


def nearest_point_distances(places: np.ndarray, samples: SurfaceSamples, length: float) -> np.ndarray:
    """Return the distance of each place (..., 3) from the nearest measured point of a scan; desired member length given [scan unit]."""
    points, flat = samples.measured_points, np.ascontiguousarray(places.reshape(-1, 3))
    boxes = kept_boxes_of(points, max(POINT_BOX * length, 2.0 * samples.spacing), samples)
    away = np.empty(len(flat))
    nearest_distances(flat, points, boxes, 2.0 * samples.spacing, away)
    return away.reshape(places.shape[:-1])


def distances_to_grid(points: np.ndarray, grid: Grid, length: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the distance of each point (N, 3) from the nearest triangle (N,), and that triangle (N,) int64.

    Far points are looked at again with ever more reach, so the nearest of all triangles is found.
    """
    distance, nearest = np.empty(len(points)), np.empty(len(points), np.int64)
    waiting, reach = np.arange(len(points)), FIRST_REACH * length
    for _ in range(REACH_GROWTHS):
        index = triangle_boxes(grid.nodes, grid.triangles, max(TRIANGLE_BOX * length, reach), reach)
        look_up = partial(nearest_triangles, points, index, grid.nodes, grid.triangles, waiting, distance, nearest)
        in_parts(len(waiting), PLACES_MEASURED_PER_THREAD, lambda _, begin, end: look_up(begin, end))  # noqa: B023
        waiting = waiting[nearest[waiting] < 0]
        if not len(waiting):
            break
        reach *= 4.0
    return distance, nearest


def distances_to_points(
    grid: Grid, samples: SurfaceSamples, length: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the distances of the triangles and of the nodes from the scan, and its noise there; see `Distances`."""
    points = samples.points_of_surface
    boxes = kept_boxes_of(points, max(POINT_BOX * length, 2.0 * samples.spacing), samples)
    a, b, c = (grid.nodes[grid.triangles[:, k]] for k in range(3))
    middles = (a + b + c) / 3.0
    to_middles, to_corners = np.empty(len(middles)), np.empty(len(grid.nodes))
    nearest_distances(middles, points, boxes, 2.0 * samples.spacing, to_middles)
    nearest_distances(grid.nodes, points, boxes, 2.0 * samples.spacing, to_corners)
    if samples.moved:  # nodes lie on the mean surface
        boxes = kept_boxes_of(samples.surface.points, POINT_BOX * length, samples)
    to_nodes, noise = distances_to_planes(grid.nodes, samples, boxes)
    if samples.measured < len(samples.surface.mean):
        to_middles[is_over_holes(middles, samples)] = np.nan
        over = is_over_holes(grid.nodes, samples)
        to_nodes[over] = to_corners[over] = np.nan
    if grid.deviation is not None:
        to_nodes[np.isnan(grid.deviation)] = np.nan
    return np.fmax(to_middles, np.fmax.reduce(to_corners[grid.triangles], axis=1)), to_nodes, noise


def distances_to_planes(
    places: np.ndarray, samples: SurfaceSamples, boxes: SearchBoxes
) -> tuple[np.ndarray, np.ndarray]:
    """Return the distance of places (Q, 3) from the plane of the points around each, and the rms distance of these from it (Q,).

    boxes : the points by box
    """
    points = points_of_planes(samples)
    distance, noise = np.empty(len(places)), np.empty(len(places))
    plane_distances(places, points, boxes, POINTS_OF_PLANE, 2.5 * samples.spacing, distance, noise)
    return distance, noise


def points_of_planes(samples: SurfaceSamples) -> np.ndarray:
    """Return the points (N, 3) from which nodes are measured: those that were read, or of the mean surface where nodes lie on that."""
    return samples.surface.points if samples.moved else samples.points_of_surface


def offsets_from_points(grid: Grid, samples: SurfaceSamples, length: float) -> tuple[np.ndarray, np.ndarray]:
    """Return how far outside of each node the surface of the points within a member lies, and their rms distance from that (V,).

    Measured points, never those of the mean surface; NaN over closed holes.
    """
    every = len(samples.measured_points) // (COMPARED_WITH_NODE * len(grid.nodes)) + 1
    points = np.ascontiguousarray(samples.measured_points[::every])
    desired = np.full(len(grid.nodes), length) if grid.desired is None else grid.desired
    bias, scatter = np.empty(len(grid.nodes)), np.empty(len(grid.nodes))
    boxes = boxes_of(points, POINT_BOX * length)
    mean_offsets(grid.nodes, normals_at_nodes(grid), points, boxes, AROUND_NODE * desired, bias, scatter, 0, len(bias))
    if grid.deviation is not None:
        bias[np.isnan(grid.deviation)] = np.nan
    return bias, scatter


def shares_of_corners(on_side: int) -> np.ndarray:
    """Return the shares (P, 3) of its corners in places all over a triangle, so many along a side."""
    shares: np.ndarray = (
        np.array([[a, b, on_side - a - b] for a in range(on_side) for b in range(on_side - a)]) + 1.0 / 3.0
    )
    return shares / shares.sum(axis=1, keepdims=True)


def normals_of(grid: Grid) -> np.ndarray:
    """Return the unit normals of the triangles (T, 3), zero where they have none."""
    a, b, c = grid.nodes[grid.triangles.T]
    normal: np.ndarray = np.cross(b - a, c - a)
    return normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)


def feet_over(grid: Grid, triangle: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return how high points (K, 3) are over the planes of some triangles (K,), outside positive, and their feet on these (K, 3)."""
    height, feet = np.empty(len(points)), np.empty((len(points), 3))
    put_feet(np.ascontiguousarray(points), triangle, grid.nodes[grid.triangles[:, 0]], normals_of(grid), height, feet)
    return height, feet


def normals_at_nodes(grid: Grid) -> np.ndarray:
    """Return the unit normal of each node (V, 3), the mean of its triangles by their areas."""
    a, b, c = (grid.nodes[grid.triangles[:, k]] for k in range(3))
    own, corners = np.repeat(np.cross(b - a, c - a), 3, axis=0), grid.triangles.ravel()
    sums = np.stack([np.bincount(corners, own[:, k], len(grid.nodes)) for k in range(3)], axis=1)
    normals: np.ndarray = sums / np.maximum(np.linalg.norm(sums, axis=1), 1e-300)[:, None]
    return normals


def kept_boxes_of(points: np.ndarray, box: float, samples: SurfaceSamples) -> SearchBoxes:
    """Return the measured points of a scan, or those of its mean surface, by box; they are kept for as long as its samples exist."""
    kept, asked = _KEPT_BOXES.setdefault(samples, {}), (points is samples.surface.points, len(points), box)
    if asked not in kept:
        kept[asked] = boxes_of(points, box)
    return kept[asked]


def boxes_of(points: np.ndarray, box: float) -> SearchBoxes:
    """Return points (N, 3) by box, the boxes no larger than `box` [scan unit]."""
    boxes = new_boxes(*bounds_of(points), box, len(points), len(points))
    put_places(boxes, points)
    return boxes


def is_over_holes(places: np.ndarray, samples: SurfaceSamples) -> np.ndarray:
    """Return which places (Q, 3) lie over closed holes: a sample of made-up points is nearer than any other."""
    mean, away = samples.surface.mean, []
    for part in (mean[: samples.measured], mean[samples.measured :]):
        distance = np.empty(len(places))
        nearest_distances(places, part, boxes_of(part, samples.surface.length), 0.5 * samples.surface.length, distance)
        away.append(distance)
    over: np.ndarray = away[1] < away[0]
    return over
