"""The grid of a structure, of one layer or more, for what is made of grids: schedules, setting out, printed models, files."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..errors import InputError
from ..grid.grid import Grid
from ..layouts.layered_grid import LayeredGrid
from .truss import Truss


def grid_of_layers(truss: Truss, scale: float = 1.0) -> LayeredGrid:
    """Return the grid of a structure that has layers, its members in their order, lengths in metres over a scale."""
    groups = np.full(len(truss.members), "", object)
    for name, members in truss.member_sets.items():
        groups[members] = name
    fixed = np.zeros(len(truss.nodes), bool)
    fixed[truss.node_sets.get("fixed", np.zeros(0, np.int64))] = True
    return LayeredGrid(
        nodes=truss.nodes / scale,
        triangles=truss.triangles,
        panels=truss.panels,
        fixed=fixed,
        origin=truss.origin / scale,
        unit="m",
        own_members=truss.members,
        own_normals=truss.node_normals,
        own_groups=tuple(groups.tolist()),
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
    """Return the grid of a structure with all its members, in metres as it is built.

    Raises
    ------
    InputError
        Some members are neither sides of triangles nor of layers.
    """
    if truss.layers is not None:
        return grid_of_layers(truss)
    grid = grid_of_triangles(truss)
    count = len(truss.nodes)
    if not np.array_equal(np.sort(np.sort(truss.members, axis=1) @ [count, 1]), grid.edges @ [count, 1]):
        raise InputError("some members of the structure are neither sides of its panels nor of layers; print the grid")
    return grid
