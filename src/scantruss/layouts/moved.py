"""A grid whose nodes have moved along it."""

from __future__ import annotations

import numpy as np

from ..grid.alike import Alike
from ..grid.grid import Grid
from ..grid.panels import triangles_of


def moved_grid(grid: Grid, nodes: np.ndarray, alike: Alike | None = None) -> Grid:
    """Return a grid with its nodes at other places (V, 3); panels of more than three nodes are cut along their shortest diagonals."""
    made = grid.replace(nodes=nodes, deviation=None)
    if made.panels is not None:
        made = made.replace(triangles=triangles_of(nodes, made.panels), panels=made.panels)
    return made.replace(alike=alike)
