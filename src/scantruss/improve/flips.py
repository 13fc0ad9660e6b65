"""Delaunay optimization: flips that raise the smallest angle (Sec. 4.1)."""

from __future__ import annotations

import numpy as np

from ..grid.grid import Grid
from ..kernels.mesh import flips as kernels
from ..kernels.mesh.grid import Net
from .working_mesh import close_net, open_net

LEAST_COSINE = 0.0  # least cosine between the normals of two triangles after a flip, unless it was lower before
MOST_FLIP_ROUNDS = 100  # most rounds over all edges; a few are enough


def flip_edges(grid: Grid) -> tuple[Grid, int]:
    """Flip each edge where that raises the smallest angle of its two triangles, until no flip does.

    Boundary edges are kept, no edge is duplicated, the grid is not folded, and no interior node is left with fewer than four
    members, so the topology cannot change.

    Returns
    -------
    Grid
        Same nodes, other triangles.
    int
        Flips made.
    """
    if len(grid.triangles) == 0:
        return grid, 0
    net, source = open_net(grid)
    count = flip_by_angle(net)
    return close_net(net, source, grid), count


def flip_by_angle(net: Net) -> int:
    """Flip the edges of an opened grid in place; returns the flips made."""
    return int(kernels.flip_by_angle(net, LEAST_COSINE, MOST_FLIP_ROUNDS, np.full(len(net.arc), -1, np.int64)))
