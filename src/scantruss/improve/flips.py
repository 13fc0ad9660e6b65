"""Delaunay optimization: flips that raise the smallest angle (Sec. 4.1)."""

from __future__ import annotations

import numpy as np

from ..kernels.mesh.flips import flip_by_angle
from ..kernels.mesh.grid import Net

LEAST_COSINE = 0.0  # least cosine between the normals of two triangles after a flip, unless it was lower before
MOST_FLIP_ROUNDS = 100  # most rounds over all edges; a few are enough


def flip_edges(net: Net) -> int:
    """Flip each edge of an opened grid where that raises the smallest angle of its two triangles, until no flip does.

    Boundary edges are kept, no edge is duplicated, the grid is not folded, and no interior node is left with fewer than four
    members, so the topology cannot change. Returns the flips made.
    """
    return int(flip_by_angle(net, LEAST_COSINE, MOST_FLIP_ROUNDS, np.full(len(net.arc), -1, np.int64)))
