"""The grid of a structure, with members on no panel too, for what is made of grids: schedules, setting out, printed models, files."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..grid.grid import Grid
from ..layouts.framework import NO_PANELS_NORMAL, Framework
from .truss import Truss


def framework_of(truss: Truss, scale: float = 1.0) -> Framework:
    """Return the grid of a structure of which some members are on no panel, all in their order, lengths in metres over a scale."""
    groups = np.full(len(truss.members), "", object)
    for name, members in truss.member_sets.items():
        groups[members] = name
    fixed = np.zeros(len(truss.nodes), bool)
    fixed[truss.node_sets.get("fixed", np.zeros(0, np.int64))] = True
    return Framework(
        nodes=truss.nodes / scale,
        triangles=truss.triangles,
        panels=truss.panels,
        fixed=fixed,
        origin=truss.origin / scale,
        unit="m",
        own_members=truss.members,
        own_normals=np.where(truss.node_normals.any(axis=1, keepdims=True), truss.node_normals, NO_PANELS_NORMAL),
        own_groups=tuple(groups.tolist()) if truss.layers is not None else (),
        layers=truss.layers,
    )


def grid_of_triangles(truss: Truss, scale: float = 1.0) -> Grid:
    """Return the grid of the triangles of a structure, lengths in metres over a scale."""
    return Grid(
        nodes=truss.nodes / scale,
        triangles=truss.triangles,
        panels=truss.panels,
        fixed=np.zeros(len(truss.nodes), bool),
        origin=truss.origin / scale,
        unit="m",
        alike=None if truss.alike is None else replace(truss.alike, member=truss.alike.member / scale),
    )


def grid_in_metres(truss: Truss) -> Grid:
    """Return the grid of a structure with all its members, in metres as it is built."""
    grid = grid_of_triangles(truss)
    count = len(truss.nodes)
    if truss.layers is None and np.array_equal(
        np.sort(np.sort(truss.members, axis=1) @ [count, 1]), grid.edges @ [count, 1]
    ):
        return grid
    return framework_of(truss)
