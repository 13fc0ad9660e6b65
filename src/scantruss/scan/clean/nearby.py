"""The nearest neighbours of every point, whatever the density: the data of all cleaning steps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...kernels.geometry import kd_tree as kernels
from ...runtime.parallel import in_parts, run_in_parts

NEIGHBORS_OF_A_POINT = 16  # neighbours of each point
REACH_TO = 8  # a point's reach is the distance to this one of them
SEARCHES_PER_THREAD = 2000  # fewest points that are worth a thread


@dataclass(frozen=True, eq=False)
class Nearby:
    """Points in a k-d tree, and a table of the nearest of each; all rows in the order of the tree."""

    tree: kernels.KDTree
    neighbors: np.ndarray  #: (N, NEIGHBORS_OF_A_POINT) int64, nearest first, -1 where there are fewer
    squares: np.ndarray  #: (N, NEIGHBORS_OF_A_POINT) squared distances, inf if there are fewer [scan unit^2]

    @classmethod
    def of(cls, points: np.ndarray) -> Nearby:
        """Look up the nearest of all points (N, 3)."""
        tree = build_kd_tree(points)
        neighbors, squares = (
            np.empty((len(points), NEIGHBORS_OF_A_POINT), np.int64),
            np.empty((len(points), NEIGHBORS_OF_A_POINT)),
        )
        run_in_parts(len(points), SEARCHES_PER_THREAD, kernels.nearest_others, tree, neighbors, squares)
        return cls(tree, neighbors, squares)

    @property
    def reach(self) -> np.ndarray:
        """Distance of each point to its eighth neighbour (N,) [scan unit]; inf if there is none."""
        return np.sqrt(self.squares[:, REACH_TO - 1])

    def in_order(self, values: np.ndarray) -> np.ndarray:
        """Return rows of the tree in the order in which the points were given."""
        ordered = np.empty_like(values)
        ordered[self.tree.ids] = values
        return ordered


def build_kd_tree(points: np.ndarray) -> kernels.KDTree:
    """Return the k-d tree of points (N, 3), N > 0."""
    tree = kernels.empty_kd_tree(points)
    kernels.divide(tree, 0, 1)
    if len(tree.first) > 1:
        in_parts(
            2, 1, lambda _, begin, end: [kernels.divide(tree, 1 + i, kernels.STACK_LEVELS) for i in range(begin, end)]
        )
    return tree
