"""Grids that are exactly the same when they are turned over about straight lines of the surface: one part and its images.

Rows of members run along every other one of the lines and lie square across those between, as a triangular lattice may.
"""

from __future__ import annotations

import math

import numpy as np

from ..boundary.curves import length_along
from ..grid.grid import Grid
from ..scan.rotation import Rotation, turn_about
from ..scan.symmetry import MirrorPlane, three_of
from .mirrored import LEAST_PIECE, ON_PLANE, Wedge, beyond_axis, refuse_rows, section_of, united, wedge_of

NEAR_IMAGE = 0.4  #: farthest that a node beyond a line may be from the image of its own [member lengths]
OF_HALF_TURNS = "the lines of the half turns"


def half_turned_wedge(rotation: Rotation, half_turn: Rotation, origin: np.ndarray) -> Wedge:
    """Return the part that is kept of a surface with straight lines about which half a turn leaves it as it is, relative to an origin.

    Parameters
    ----------
    rotation : Rotation
        About an axis that pierces the surface.
    half_turn : Rotation
        About a line of the surface square to that axis: the first wall is along it.
    """
    axis, first = np.array(rotation.axis), np.cross(rotation.axis, half_turn.axis)
    normals = [turn_about(axis, math.pi * k / rotation.order) @ first for k in range(rotation.order)]
    planes = [MirrorPlane(half_turn.point, three_of(normal), 0.0) for normal in normals]
    return wedge_of(planes, origin, half_turns=True)


def rows_of(grid: Grid, wedge: Wedge, length: float) -> list[np.ndarray]:
    """Return the lines (K, 3) along which rows run, from the axis outwards, in the frame of the scan."""
    (normal, _), ray = wedge.walls[0], wedge.rays[0]
    assert ray is not None
    lines = []
    for matrix in wedge.matrices()[::2]:
        across, along = matrix @ normal, matrix @ ray
        for line in section_of(grid, across, float(across @ wedge.centre)):
            for piece in beyond_axis(line, wedge.centre, along):
                if length_along(piece) >= LEAST_PIECE * length:
                    away = piece - wedge.centre
                    lines.append(np.outer(away @ along, along) + wedge.centre + grid.origin)
    return lines


def half_turned_grid(grid: Grid, wedge: Wedge, length: float) -> Grid:
    """Return the grid of the part that is kept and its images, of triangles or quads.

    Nodes near the first wall come onto the line along it, and those near the second; other members and panels lie square across that.

    Raises
    ------
    FrontError
        The rows do not follow the first line, or do not lie square across the second.
    """
    assert wedge.axis is not None
    nodes, panels = grid.nodes.copy(), grid.panel_table
    (first, offset), (second, second_offset) = wedge.walls
    above = nodes[panels].mean(axis=1) @ first > offset
    height = nodes @ second - second_offset
    side = np.where(np.abs(height) < ON_PLANE * length, 0, np.sign(height)).astype(np.int64)
    kept = panels[above & (side[panels] > 0).any(axis=1)]
    used = np.unique(kept)
    uses = np.bincount(grid.panel_members[above].ravel(), minlength=len(grid.edges))
    row = np.intersect1d(used, grid.edges[(uses == 1) & (grid.edge_uses == 2)])
    on = used[side[used] == 0]
    for own, ray in zip((row, on), wedge.rays, strict=True):
        assert ray is not None
        away = nodes[own] - wedge.centre
        off = away - np.outer(away @ ray, ray)
        far = np.linalg.norm(off, axis=1)
        if len(far) and far.max() > ON_PLANE * length:
            refuse_rows(grid, own[int(far.argmax())], OF_HALF_TURNS)
        nodes[own] -= off
    both = np.intersect1d(row, on)
    nodes[both] = wedge.centre
    beyond = _images_beyond(grid, nodes, kept, side, wedge, length)
    at_wall = np.full(len(nodes), -1)
    at_wall[row], at_wall[on] = 0, 1
    at_axis = np.zeros(len(nodes), bool)
    at_axis[both] = True
    return united(grid, nodes, kept, at_wall, at_axis, wedge, beyond)


def _images_beyond(
    grid: Grid, nodes: np.ndarray, kept: np.ndarray, side: np.ndarray, wedge: Wedge, length: float
) -> np.ndarray:
    """Return of each node beyond the second wall the node that it is the image of, -1 of the others; both are moved to agree."""
    used = np.unique(kept)
    beyond = np.full(len(nodes), -1)
    theirs, turn = used[side[used] < 0], wedge.matrices()[1]
    across = kept[(side[kept] < 0).any(axis=1)]
    own = np.unique(across[side[across] > 0])
    if len(theirs) == 0:
        return beyond
    image = (nodes[theirs] - wedge.centre) @ turn.T + wedge.centre
    apart = np.linalg.norm(image[:, None] - nodes[own], axis=2)
    near = apart.argmin(axis=1)
    far = apart.min(axis=1)
    if far.max() > NEAR_IMAGE * length or len(np.unique(near)) < len(near):
        refuse_rows(grid, theirs[int(far.argmax())], OF_HALF_TURNS)
    beyond[theirs] = own[near]
    image_of = np.arange(len(nodes))
    image_of[theirs], image_of[own[near]] = own[near], theirs
    same = (np.sort(image_of[across], axis=1) == np.sort(across, axis=1)).all(axis=1)
    if not same.all():
        refuse_rows(grid, across[int(same.argmin())][0], OF_HALF_TURNS)
    nodes[own[near]] = (nodes[own[near]] + image) / 2.0
    return beyond
