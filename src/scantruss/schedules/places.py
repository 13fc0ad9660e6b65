"""Where nodes and members belong: the building frame, groups of members, rings of assembly."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Protocol

import numpy as np

from ..kernels.geometry.components import component_labels

if TYPE_CHECKING:
    from ..grid.grid import Grid


class BuildingFrame(Protocol):
    """Settings that say where the building frame lies in the scan."""

    @property
    def origin(self) -> tuple[float, float, float] | None:
        """Its origin, None: the lowest corner of the nodes [scan unit]."""

    @property
    def rotation(self) -> float:
        """From the scan's x axis to the building's, anticlockwise about z [degree]."""


def into_building(vectors: np.ndarray, settings: BuildingFrame) -> np.ndarray:
    """Return vectors of the scan (N, 3) in the directions of the building frame, turned about z."""
    c, s = math.cos(math.radians(settings.rotation)), math.sin(math.radians(settings.rotation))
    turned: np.ndarray = np.einsum("ij,vj->vi", np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]), vectors)
    return turned


def building_places(grid: Grid, settings: BuildingFrame) -> np.ndarray:
    """Return the nodes in the building frame (V, 3) [scan unit, not scaled]."""
    if settings.origin is not None:
        shift = np.asarray(grid.origin, float) - np.asarray(settings.origin, float)
        return into_building(grid.nodes + shift, settings)
    places = into_building(grid.nodes, settings)
    return places - places[np.unique(grid.edges)].min(axis=0)


def boundary_nodes(grid: Grid) -> np.ndarray:
    """(V,) bool, the nodes on the boundary."""
    found = np.zeros(len(grid.nodes), bool)
    found[grid.edges[grid.edge_uses == 1]] = True
    return found


def rings(grid: Grid, height: np.ndarray, start: np.ndarray | None = None) -> np.ndarray:
    """Return the ring of each node (V,): members on the way to the boundary, or to nodes (V,) to start at; -1 without members.

    A piece that has none of these starts at its lowest node.
    """
    ring = np.full(len(grid.nodes), -1, np.int64)
    used = np.unique(grid.edges)
    reached = np.zeros(len(ring), bool)
    reached[used] = (boundary_nodes(grid) if start is None else start)[used]
    piece = component_labels(len(grid.nodes), grid.edges[:, 0], grid.edges[:, 1])
    closed = used[~np.isin(piece[used], piece[reached])]
    closed = closed[np.lexsort((height[closed], piece[closed]))]
    reached[closed[np.unique(piece[closed], return_index=True)[1]]] = True
    number = 0
    while reached.any():  # each turn numbers nodes that had no number
        ring[reached] = number
        near = reached[grid.edges].any(axis=1)
        reached = np.zeros(len(ring), bool)
        reached[grid.edges[near]] = True
        reached &= ring < 0
        number += 1
    return ring
