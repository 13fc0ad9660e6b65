"""Irregular nodes: how many a grid has, and how many its Euler number and its boundary force.

A node is regular where as many members meet as have room at 60 degrees: six inside; k + 1 on the boundary, where k is the
angle of its triangles over 60 degrees, rounded, at least one. Each member too few is a charge of +1, each too many of -1. For any
manifold grid, with d members at a node,

    sum over the interior (6 - d) + sum over the boundary (k + 1 - d) = 6 * Euler number - sum over the boundary (3 - k)

of triangles, and the same with 4 and 2 for 6 and 3, and 90 degrees, of quads; so at least as many members must be missing or too many
as the right side says, in each piece for itself. That is what is forced; what is there beyond it may still pay, where the surface is
strongly curved. Of hexagons, the sides of the panels inside are counted.
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
    if grid.cells == "hexagon":
        return _irregular_panels(grid)
    regular, right = (6, 60.0) if grid.panels is None else (4, 90.0)
    angle = np.bincount(grid.panel_table.ravel(), grid.corner_angles.ravel(), minlength=count)
    room = np.maximum(np.floor(angle / right + 0.5), 1.0).astype(np.int64)
    on_boundary = np.zeros(count, bool)
    on_boundary[edges[uses != 2].ravel()] = True
    charge = np.where(on_boundary, room + 1, regular) - members
    charge[members == 0] = 0
    piece = component_labels(count, edges[:, 0], edges[:, 1])
    forced = np.bincount(piece, charge)
    return int(np.abs(charge).sum()), int(np.abs(forced).sum())


def _irregular_panels(grid: Grid) -> tuple[int, int]:
    """Return the sides too few or too many of the panels that lie inside, and how many of them the sum of all charges forces."""
    on_boundary = np.zeros(len(grid.nodes), bool)
    on_boundary[grid.edges[grid.edge_uses != 2].ravel()] = True
    panels = grid.panel_table
    inside = ~(on_boundary[panels] & (panels >= 0)).any(axis=1)
    charge = 6 - (panels[inside] >= 0).sum(axis=1)
    forced = int(abs(charge.sum())) if inside.all() else 0  # what the boundary bears is not known
    return int(np.abs(charge).sum()), forced
