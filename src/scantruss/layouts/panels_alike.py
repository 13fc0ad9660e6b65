"""Few panels: panels drawn towards few kinds, nodes on the surface of the grid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..grid.alike import PANELS, Alike
from ..grid.grid import Grid
from ..grid.panels import sizes_of
from ..runtime.progress import Progress
from .alike import PartKinds, check_alike, few_kinds
from .part_vectors import PartVectors


def few_panels(
    grid: Grid,
    tolerance: float = 0.01,
    count: int = 1,
    *,
    mirrored: bool = False,
    progress: Progress | None = None,
) -> PartKinds:
    """Return the grid with its nodes moved along its surface so that there are few different panels.

    Two panels are of one kind if one, laid on the other whatever way it is turned, has its corners within the tolerance of those of the
    other; see `few_kinds`. Triangles, quads and hexagons are taken, with what is among them of more or fewer nodes. Nodes move as in
    `few_lengths`, and the symmetry of the grid is kept.

    Parameters
    ----------
    grid : Grid
    tolerance : float
        Root mean square of what is between the corners of two panels over the mean member, 0.0001 to 0.2.
    count : int
        Kinds that are few enough.
    mirrored : bool
        Whether mirror images are of one kind, as flat panels are that may be turned over.
    progress : callable, optional
        See `few_kinds`.

    Raises
    ------
    InputError
        A value cannot be used, or the grid has no members or too many panels.
    """
    check_alike(grid, tolerance, count, "panels", len(grid.panel_table))
    asked = Alike(PANELS, tolerance, count, float(grid.lengths.mean()), mirrored)
    return few_kinds(grid, corners_of(grid), asked, progress)


@dataclass(frozen=True, eq=False)
class Corners(PartVectors):
    """Panels as vectors from their middles to their corners."""

    called, size_is, over = "panel", "nodes", False

    mean: float  #: mean member [unit of the grid]

    def vectors(self, nodes: np.ndarray) -> np.ndarray:
        """Return the vectors over the mean member, see `PartVectors`."""
        there = (self.nodes_of >= 0)[..., None]
        corners = np.where(there, nodes[self.nodes_of], 0.0)
        middle = corners.sum(axis=1) / self.count[:, None]
        return np.asarray(np.where(there, corners - middle[:, None], 0.0) / self.mean)

    def slopes(self, nodes: np.ndarray, ways: np.ndarray) -> np.ndarray:
        """Return how the vectors change, see `PartVectors`."""
        there = self.nodes_of >= 0
        both = there[:, :, None] & there[:, None]
        shares = np.where(both, np.eye(there.shape[1]) - 1.0 / self.count[:, None, None], 0.0) / self.mean
        return np.asarray(np.einsum("nwm,nmkc->nwcmk", shares, ways[self.nodes_of]))


def corners_of(grid: Grid, member: float | None = None) -> Corners:
    """Return the panels of a grid as vectors to their corners, over its mean member or a given one [unit of the grid]."""
    table = grid.panel_table
    mean = float(grid.lengths.mean()) if member is None else member
    return Corners(table, sizes_of(table), np.zeros(len(table), np.int64), mean)
