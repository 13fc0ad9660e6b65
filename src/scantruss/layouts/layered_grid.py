"""A grid of more layers: the outer one has triangles, the others and the webs are members alone."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ..grid.grid import Grid
from .double_layer import Layers


@dataclass(frozen=True, eq=False)
class LayeredGrid(Grid):
    """A grid of which some members are sides of no triangle; its tables hold all members, in their own order."""

    own_members: np.ndarray = field(default_factory=lambda: np.zeros((0, 2), np.int64))  #: (E, 2) all members
    own_normals: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))  #: (V, 3) unit normals of the nodes
    own_groups: tuple[str, ...] = ()  #: (E,) the layer or webs that each member belongs to
    layers: Layers | None = None

    @cached_property
    def _half_edges(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        ends = np.concatenate([self.triangles[:, [0, 1]], self.triangles[:, [1, 2]], self.triangles[:, [2, 0]]])
        keys, half = (np.sort(each, axis=1) @ [len(self.nodes), 1] for each in (self.own_members, ends))
        order = np.argsort(keys, kind="stable")
        return ends, self.own_members, order[np.searchsorted(keys[order], half)]

    def is_chord(self) -> np.ndarray:
        """Return whether each member (E,) lies in a layer and is no web."""
        names = () if self.layers is None else self.layers.names
        return np.array([group in names for group in self.own_groups], bool)
