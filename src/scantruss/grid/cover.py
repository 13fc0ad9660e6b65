"""How far the scan lies from the triangles of a grid, and the triangles from the scan."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..kernels.boxes import SearchBoxes, new_boxes
from ..kernels.cover import lower_distances, nearest_distances, put_places

if TYPE_CHECKING:
    from ..scan.sites import Sites
    from .grid import Grid

NEAR = 0.1  #: the first reach of a search, in lengths; most of a scan lies nearer to its grid


def scan_places(sites: Sites) -> np.ndarray:
    """Return the parts of the scan that a grid must reach (P, 3): the sites of all pieces that are no debris [scan unit]."""
    return np.ascontiguousarray(sites.surface.mean[np.isin(sites.piece, sites.pieces)])


def _boxes_of(places: np.ndarray, box: float) -> SearchBoxes:
    boxes = new_boxes(places.min(axis=0), places.max(axis=0), box, len(places), len(places))
    put_places(boxes, places)
    return boxes


def distances_to_grid(places: np.ndarray, grid: Grid, length: float) -> np.ndarray:
    """Return the distance of each place (P, 3) to the nearest triangle, (P,) [scan unit].

    Far places are looked for again with ever more reach, so the distances are those to the nearest of all triangles.
    """
    distance = np.full(len(places), np.inf)
    waiting, reach = np.arange(len(places)), NEAR * length
    while len(waiting):
        some = np.ascontiguousarray(places[waiting])
        found = np.full(len(some), np.inf)
        lower_distances(some, _boxes_of(some, max(reach, 0.5 * length)), grid.nodes, grid.triangles, reach, found)
        distance[waiting] = found
        waiting, reach = waiting[np.isinf(found)], 4.0 * reach
    return distance


def distances_to_scan(middles: np.ndarray, places: np.ndarray, length: float) -> np.ndarray:
    """Return the distance of each middle of a triangle (T, 3) to the nearest place of the scan (P, 3), (T,) [scan unit]."""
    distance = np.empty(len(middles))
    nearest_distances(middles, places, _boxes_of(places, 0.5 * length), 0.25 * length, distance)
    return distance
