"""Nodes that the last projection leaves off the scan, where its patches see two bends at once: each is put on the plane of its points."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..check.distances import POINT_BOX, POINTS_OF_PLANE, distances_to_planes, kept_boxes_of, points_of_planes
from ..check.limits import NOISES_OFF

if TYPE_CHECKING:
    from ..settings import Settings
    from ..surface.samples import SurfaceSamples
    from .working_mesh import WorkingMesh

SHARE_OF_LIMIT = 0.95  # share of the largest distance allowed above which a node is put on the plane of its points
FARTHEST_OFF = 0.6  # what is farther away is left to the certificate [member lengths]
MOST_OFF = 60  # nodes that are put on the scan at most; more of them are no exception
# times that they are, as other points are the nearest then; the last time on the nearest point itself
TURNS_OFF_SCAN = 3


def put_on_scan(mesh: WorkingMesh, samples: SurfaceSamples, settings: Settings) -> None:
    """Put the nodes that lie farther off the scan than is allowed on the plane of the points around each, except fixed ones.

    Measured as the certificate does (`check.distances`): from the points, their noise aside.
    """
    net, points = mesh.net, points_of_planes(samples)
    boxes = kept_boxes_of(points, max(POINT_BOX * settings.length, 2.0 * samples.spacing), samples)
    movable = (net.degree > 0) & ~mesh.fixed & np.isfinite(mesh.projection_distance)
    if settings.boundary:
        movable &= net.is_open == 0
    waiting = np.flatnonzero(movable)
    for turn in range(TURNS_OFF_SCAN):
        distance, noise = distances_to_planes(np.ascontiguousarray(net.nodes[waiting]), samples, boxes)
        off = (distance - NOISES_OFF * noise) / (mesh.length * net.desired[waiting])
        waiting = waiting[(off > SHARE_OF_LIMIT * settings.max_offset) & (off < FARTHEST_OFF)]
        if not len(waiting) or len(waiting) > MOST_OFF:
            return
        for v in waiting:
            net.nodes[v] = _on_points(net.nodes[v], points, on_plane=turn + 1 < TURNS_OFF_SCAN)


def _on_points(place: np.ndarray, points: np.ndarray, *, on_plane: bool) -> np.ndarray:
    """Return the foot of a place (3,) on the plane of the points (N, 3) around it, or the nearest of these."""
    squares = ((points - place) ** 2).sum(axis=1)
    count = min(POINTS_OF_PLANE, len(points))
    if not on_plane:
        nearest: np.ndarray = points[squares.argmin()]
        return nearest
    around = points[np.argpartition(squares, count - 1)[:count]]
    mean = around.mean(axis=0)
    normal = np.linalg.svd(around - mean, full_matrices=False)[2][-1]
    foot: np.ndarray = place - ((place - mean) @ normal) * normal
    return foot
