"""A grid of more layers: the outer one has panels, the others and the webs are members alone."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ..grid.grid import Grid
from .double_layer import Layers


@dataclass(frozen=True, eq=False)
class LayeredGrid(Grid):
    """A grid of which some members are sides of no panel; its tables hold all members, in their own order."""

    own_members: np.ndarray = field(default_factory=lambda: np.zeros((0, 2), np.int64))  #: (E, 2) all members
    own_normals: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))  #: (V, 3) unit normals of the nodes
    own_groups: tuple[str, ...] = ()  #: (E,) the layer or webs that each member belongs to
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
        """Return whether each member (E,) lies in a layer and is no web."""
        names = () if self.layers is None else self.layers.names
        return np.array([group in names for group in self.own_groups], bool)
