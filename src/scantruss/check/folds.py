"""Folds of a grid: the angles between its triangles."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..kernels.mesh.figures import folds_of

if TYPE_CHECKING:
    from ..grid.grid import Grid


def fold_angles(grid: Grid) -> np.ndarray:
    """Return the angle between the first two triangles at each member, (E,) [degree]: 180 level, 0 folded flat; NaN at the boundary."""
    angles = np.empty(len(grid.edges))
    folds_of(grid.nodes, grid.triangles, grid.edge_triangles, angles)
    return angles
