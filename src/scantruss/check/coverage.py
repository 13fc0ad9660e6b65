"""How far the scan lies from the triangles of a grid, and the triangles from the scan."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..kernels.geometry.boxes import SearchBoxes, new_boxes
from ..kernels.mesh.coverage import lower_distances, nearest_distances, put_places

if TYPE_CHECKING:
    from ..grid.grid import Grid
    from ..surface.samples import SurfaceSamples

FIRST_REACH = 0.1  # reach of the first search; most of a scan is closer to its grid [member lengths]


def places_to_reach(samples: SurfaceSamples, length: float) -> tuple[np.ndarray, SearchBoxes]:
    """Return the parts of the scan that a grid must reach, (P, 3) [scan unit], and these by box: all pieces that are no debris."""
    places = np.ascontiguousarray(samples.surface.mean[samples.kept])
    return places, boxes_of(places, 0.5 * length)


def boxes_of(places: np.ndarray, box: float) -> SearchBoxes:
    """Return places (P, 3) by box, the boxes no larger than `box` [scan unit]."""
    boxes = new_boxes(places.min(axis=0), places.max(axis=0), box, len(places), len(places))
    put_places(boxes, places)
    return boxes


def distances_to_grid(places: np.ndarray, boxes: SearchBoxes, grid: Grid, length: float) -> np.ndarray:
    """Return the distance of each place (P, 3) to the nearest triangle, (P,) [scan unit].

    Far places are looked for again with ever more reach, so the distances are those to the nearest of all triangles.
    """
    distance, reach = np.full(len(places), np.inf), FIRST_REACH * length
    lower_distances(places, boxes, grid.nodes, grid.triangles, reach, distance)
    waiting = np.flatnonzero(np.isinf(distance))
    while len(waiting):
        reach *= 4.0
        some, found = np.ascontiguousarray(places[waiting]), np.full(len(waiting), np.inf)
        lower_distances(some, boxes_of(some, max(reach, length)), grid.nodes, grid.triangles, reach, found)
        distance[waiting] = found
        waiting = waiting[np.isinf(found)]
    return distance


def distances_to_scan(others: np.ndarray, places: np.ndarray, boxes: SearchBoxes, length: float) -> np.ndarray:
    """Return the distance of each of some positions (Q, 3) to the nearest place of the scan (P, 3), (Q,) [scan unit]."""
    distance = np.empty(len(others))
    nearest_distances(others, places, boxes, 0.25 * length, distance)
    return distance
