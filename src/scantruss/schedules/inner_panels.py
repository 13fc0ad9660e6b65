"""What only grids of more layers have: the layer of each node, and the panels of the layers under the grid."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..grid.marks import numbered
from ..layouts.framework import Framework
from .clusters import Clusters, cluster_polygons
from .records import Column, Schedule, column

if TYPE_CHECKING:
    from .parts import Parts


def layered_grid(parts: Parts) -> Framework | None:
    """Return the grid of the parts if it has more layers."""
    return parts.grid if isinstance(parts.grid, Framework) and parts.grid.layers is not None else None


def layer_column(parts: Parts, nodes: np.ndarray) -> list[Column]:
    """Return the column of the layers of some nodes, where there are more than one."""
    grid = layered_grid(parts)
    if grid is None or grid.layers is None:
        return []
    return [column("layer", "", [grid.layers.names[k] for k in grid.layers.of_nodes[nodes].tolist()])]


def polygon_figures(corners: np.ndarray) -> tuple[float, float, float]:
    """Return the area of a polygon (K, 3) seen along its mean normal, its perimeter, and the largest distance from its mean plane."""
    middle = corners.mean(axis=0)
    following = np.roll(corners, -1, axis=0)
    area = np.cross(corners - middle, following - middle).sum(axis=0) / 2.0
    size = float(np.linalg.norm(area))
    off = (corners - middle) @ (area / size) if size > 0 else np.zeros(len(corners))
    return size, float(np.linalg.norm(following - corners, axis=1).sum()), float(np.abs(off).max())


def inner_panels(parts: Parts) -> Schedule:
    """One row for each panel of the layers under the grid; of four corners or more they need not be level."""
    grid = layered_grid(parts)
    if grid is None or grid.layers is None:
        raise TypeError("only grids of more layers have inner panels")
    panels = grid.layers.panels
    places = [grid.nodes[panel] * parts.size for panel in panels]
    figures = np.array([polygon_figures(each) for each in places]).reshape(-1, 3)
    types: Clusters = cluster_polygons(places, parts.settings.tolerance)
    marks = numbered("PT", len(types.representative), 3)
    names = numbered("Q", len(panels), 4)
    return Schedule(
        "Inner panels",
        (
            column("panel", "", names),
            column("layer", "", [grid.layers.names[grid.layers.of_nodes[panel].max()] for panel in panels]),
            column("corners", "", [len(panel) for panel in panels]),
            column("nodes", "", [" ".join(parts.node_marks[k] for k in panel.tolist()) for panel in panels]),
            column("panel type", "", [f"I{marks[k]}" for k in types.of.tolist()]),
            column("misfit to type", "mm", types.misfit),
            column("area", "m2", figures[:, 0] / 1e6, summed=True),
            column("perimeter", "mm", figures[:, 1]),
            column("out of plane", "mm", figures[:, 2]),
        ),
    )
