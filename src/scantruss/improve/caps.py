"""Caps on the rings where thin limbs were cut off."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from ..boundary.find import Boundary
    from ..grid.grid import Grid

NEAR = 0.25  # median distance of the nodes of a loop from the ring that it is [girth of the ring]


def with_caps(grid: Grid, boundary: Boundary) -> Grid:
    """Return a grid whose loops at rings that are to be closed have a cap: the triangles between their nodes.

    A ring of three nodes, as is usual, is closed by one triangle and gets no further member. Nodes rest where they are.
    """
    caps = [np.zeros((0, 3), np.int64)]
    for loop in boundary.loops:
        if loop.cut != "close":
            continue
        away = [
            float(np.median(np.linalg.norm(grid.nodes[nodes][:, None] - loop.points, axis=2).min(axis=1)))
            for nodes in grid.boundary_loops
        ]
        if away and min(away) < NEAR * loop.length:
            caps.append(_cap(grid, grid.boundary_loops[int(np.argmin(away))]))
    triangles = np.concatenate(caps)
    return grid.replace(triangles=np.concatenate([grid.triangles, triangles])) if len(triangles) else grid


def _cap(grid: Grid, nodes: np.ndarray) -> np.ndarray:
    """Return triangles (K - 2, 3) between the nodes of a loop (K,): the fan of the node from which they are shortest."""
    own = np.array(nodes)
    if (np.roll(grid.triangles, -1, axis=1) == own[1])[
        grid.triangles == own[0]
    ].any():  # triangles run along the loop too
        own = own[::-1]
    places = grid.nodes[own]
    longest = [
        np.linalg.norm(np.delete(places, (k - 1, k, (k + 1) % len(own)), axis=0) - places[k], axis=1).sum()
        for k in range(len(own))
    ]
    own = np.roll(own, -int(np.argmin(longest)))
    return np.array([(own[0], own[k], own[k + 1]) for k in range(1, len(own) - 1)], np.int64)
