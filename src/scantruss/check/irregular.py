"""Irregular nodes: how many a grid has, and how many its Euler number and its boundary force.

A node is regular where as many members meet as have room at 60 degrees: six inside; k + 1 on the boundary, where k is the
angle of its triangles over 60 degrees, rounded, at least one. Each member too few is a charge of +1, each too many of -1. For any
manifold grid, with d members at a node,

    sum over the interior (6 - d) + sum over the boundary (k + 1 - d) = 6 * Euler number - sum over the boundary (3 - k)

so at least as many members must be missing or too many as the right side says, in each piece for itself. That is what is forced;
what is there beyond it may still pay, where the surface is strongly curved.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..kernels.geometry.components import component_labels

if TYPE_CHECKING:
    from ..grid.grid import Grid


def count_irregular(grid: Grid) -> tuple[int, int]:
    """Return the members too few or too many at all nodes, and how many of them the topology and the boundary force."""
    count = len(grid.nodes)
    edges, uses = grid.edges, grid.edge_uses
    members = np.bincount(edges.ravel(), minlength=count)
    angle = np.bincount(grid.triangles.ravel(), grid.angles.ravel(), minlength=count)
    room = np.maximum(np.floor(angle / 60.0 + 0.5), 1.0).astype(np.int64)
    on_boundary = np.zeros(count, bool)
    on_boundary[edges[uses != 2].ravel()] = True
    charge = np.where(on_boundary, room + 1, 6) - members
    charge[members == 0] = 0
    piece = component_labels(count, edges[:, 0], edges[:, 1])
    forced = np.bincount(piece, charge)
    return int(np.abs(charge).sum()), int(np.abs(forced).sum())
