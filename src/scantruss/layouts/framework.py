"""A grid of which some members are sides of no panel: those of lower layers and webs, and those that others drew."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ..grid.grid import Grid
from .double_layer import Layers

NO_PANELS_NORMAL = (0.0, 0.0, 1.0)  #: of a node without panels: up


@dataclass(frozen=True, eq=False, repr=False)
class Framework(Grid):
    """A grid of which some members are sides of no panel; its tables hold all members, in their own order."""

    own_members: np.ndarray = field(default_factory=lambda: np.zeros((0, 2), np.int64))  #: (E, 2) all members
    own_normals: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))  #: (V, 3) unit normals of the nodes
    own_groups: tuple[str, ...] = ()  #: (E,) the layer or webs that each member belongs to, where there are layers
    layers: Layers | None = None

    @cached_property
    def _half_edges(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        ends = np.concatenate([self.triangles[:, [0, 1]], self.triangles[:, [1, 2]], self.triangles[:, [2, 0]]])
        keys, half = (np.sort(each, axis=1) @ [len(self.nodes), 1] for each in (self.own_members, ends))
        diagonals = np.unique(half[~np.isin(half, keys)])  # of panels of more than three nodes
        keys = np.concatenate([keys, diagonals])
        order = np.argsort(keys, kind="stable")
        sides = np.concatenate([self.own_members, np.stack(np.divmod(diagonals, len(self.nodes)), axis=1)])
        return ends, sides, order[np.searchsorted(keys[order], half)]

    @cached_property
    def _member_of_side(self) -> np.ndarray:
        number = np.arange(len(self._half_edges[1]))
        return np.where(number < len(self.own_members), number, -1)

    def is_chord(self) -> np.ndarray:
        """Return whether each member (E,) is no web between layers."""
        if self.layers is None:
            return np.ones(len(self.own_members), bool)
        return np.array([group in self.layers.names for group in self.own_groups], bool)


def outer_normals(grid: Grid) -> np.ndarray:
    """Return the unit normal of each node (V, 3); up where it has none."""
    if isinstance(grid, Framework):
        return grid.own_normals
    a, b, c = grid.nodes[grid.triangles].transpose(1, 0, 2)
    total = np.zeros((len(grid.nodes), 3))
    for corner in grid.triangles.T:
        np.add.at(total, corner, np.cross(b - a, c - a))
    length = np.linalg.norm(total, axis=1, keepdims=True)
    return np.where(length > 0, total / np.where(length > 0, length, 1.0), NO_PANELS_NORMAL)
