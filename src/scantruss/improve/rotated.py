"""Grids that are exactly the same when turned: the part between two half planes through the axis, and its images."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from ..boundary.curves import length_along
from ..errors import FrontError
from ..grid.grid import Grid
from ..grid.panels import sides_of
from .mirrored import (
    ON_PLANE,
    beyond_axis,
    images_of_lines,
    images_of_members,
    section_of,
    with_panels,
    without_edge_lines,
)

if TYPE_CHECKING:
    from ..scan.rotation import Rotation

WAYS_TRIED_AROUND = 36  #: directions in which half planes are tried, in one part of the turn
SEAMS_TRIED = 4  #: of them, where the rows are not alike
WAYS_APART = 5  #: of these directions, between two that are tried
LEAST_SEAM = 0.5  #: shorter pieces of the line in which a half plane meets the grid are left out [member lengths]
AT_ONE_PLACE = 0.5  #: farthest that a node of one seam may be from the image of its own on the other [member lengths]


def seams_of(grid: Grid, rotation: Rotation, length: float) -> list[list[np.ndarray]]:
    """Return choices of the lines (K, 3) along which the part that is kept is cut off, and their images, in the frame of the scan.

    They lie in half planes, that which meets the grid in the shortest lines first: square to the boundary, if it may.
    """
    found = []
    for k in range(WAYS_TRIED_AROUND):
        lines = _lines_towards(grid, rotation, 2.0 * math.pi * k / (WAYS_TRIED_AROUND * rotation.order), length)
        total = sum(length_along(line) for line in lines)
        if lines:
            found.append((round(total / length, 3), k, lines))
    if not found:
        raise FrontError("no half plane through the axis of the rotation meets the grid; leave --symmetry out", grid)
    centre = np.array(rotation.point)
    chosen: list[list[np.ndarray]] = []
    taken: list[int] = []
    for _, k, lines in sorted(found, key=lambda each: each[:2]):
        apart = [min((k - j) % WAYS_TRIED_AROUND, (j - k) % WAYS_TRIED_AROUND) for j in taken]
        if len(chosen) < SEAMS_TRIED and min(apart, default=WAYS_TRIED_AROUND) >= WAYS_APART:
            taken.append(k)
            chosen.append(lines + [(line - centre) @ rotation.matrix().T + centre for line in lines])
    return chosen


def rotated_grid(grid: Grid, rotation: Rotation, seams: list[np.ndarray], length: float) -> Grid:
    """Return the grid of the part between the seams and its images, which share the nodes on the seams.

    Parameters
    ----------
    grid : Grid
        With rows of members on the seams.
    rotation : Rotation
    seams : list of (K, 3) float64
        One choice of `seams_of`.
    length : float
        Desired member length [scan unit].

    Raises
    ------
    FrontError
        The rows do not follow the seams, or not in the same steps.
    """
    centre, axis = np.array(rotation.point) - grid.origin, np.array(rotation.axis)
    way = np.array(seams[0][-1]) - grid.origin - centre
    way -= (way @ axis) * axis
    way /= np.linalg.norm(way)
    aside = np.cross(axis, way)
    part = 2.0 * math.pi / rotation.order

    def around(places: np.ndarray) -> np.ndarray:
        away = places - centre
        return np.asarray(np.arctan2(away @ aside, away @ way))

    panels = grid.panel_table
    kept = panels[(around(grid.nodes[panels].mean(axis=1)) % (2.0 * math.pi)) < part]
    if len(kept) == 0:
        raise FrontError("no grid lies in the part of the turn that is kept; leave --symmetry out", grid)
    nodes, base, shift, middle = _joined(grid, kept, rotation, around, length)
    return _all_parts(grid, nodes, kept, rotation, base, shift, middle)


def _lines_towards(grid: Grid, rotation: Rotation, angle: float, length: float) -> list[np.ndarray]:
    """Return the lines in which a half plane through the axis meets a grid, in the frame of the scan."""
    axis, centre = np.array(rotation.axis), np.array(rotation.point) - grid.origin
    first = np.linalg.svd(axis[None])[2][1]
    ray = math.cos(angle) * first + math.sin(angle) * np.cross(axis, first)
    normal = np.cross(axis, ray)
    pieces = [
        piece for line in section_of(grid, normal, float(normal @ centre)) for piece in beyond_axis(line, centre, ray)
    ]
    return [piece + grid.origin for piece in pieces if length_along(piece) >= LEAST_SEAM * length]


def _joined(
    grid: Grid, kept: np.ndarray, rotation: Rotation, around: Callable[[np.ndarray], np.ndarray], length: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return the nodes (V, 3), those of the seams at one place with their images, and of each node the one that it is an image of.

    Also by how many parts it is turned (V,), and which is on the axis (V,) bool.
    """
    axis, centre = np.array(rotation.axis), np.array(rotation.point) - grid.origin
    part = 2.0 * math.pi / rotation.order
    pairs = np.sort(sides_of(kept), axis=1)
    edges, uses = np.unique(pairs, axis=0, return_counts=True)
    outer = grid.edges[grid.edge_uses == 1]
    keys = {tuple(each) for each in np.sort(outer, axis=1).tolist()}
    cut = np.array(sorted({v for e in edges[uses == 1].tolist() if tuple(e) not in keys for v in e}), np.int64)
    nodes, count = grid.nodes.copy(), len(grid.nodes)
    base, shift, middle = np.arange(count), np.zeros(count, np.int64), np.zeros(count, bool)
    away = nodes[cut] - centre
    radius = np.linalg.norm(away - np.outer(away @ axis, axis), axis=1)
    poles = radius < ON_PLANE * length
    middle[cut[poles]] = True
    nodes[middle] = centre + np.outer((nodes[middle] - centre) @ axis, axis)
    cut, radius = cut[~poles], radius[~poles]
    angle = (around(nodes[cut]) + math.pi / rotation.order) % (2.0 * math.pi) - math.pi / rotation.order
    first = np.abs(angle) < np.abs(angle - part)
    off = radius * np.sin(np.minimum(np.abs(np.where(first, angle, angle - part)), math.pi / 2))
    if len(off) and off.max() > ON_PLANE * length:
        _refuse(grid, cut[off.argmax()])
    one, other = cut[first], cut[~first]
    turn = rotation.matrix()
    back = (nodes[other] - centre) @ turn + centre  # by the inverse
    if len(one) != len(other):
        _refuse(grid, (one if len(one) > len(other) else other)[0])
    apart = np.linalg.norm(nodes[one][:, None] - back, axis=2)
    own = apart.argmin(axis=1)
    far = apart[np.arange(len(one)), own]
    if len(np.unique(own)) < len(own) or far.max(initial=0.0) > AT_ONE_PLACE * length:
        _refuse(grid, one[far.argmax()])
    nodes[one] = (nodes[one] + back[own]) / 2.0
    nodes[other[own]] = (nodes[one] - centre) @ turn.T + centre
    base[other[own]], shift[other] = one, 1
    return nodes, base, shift, middle


def _all_parts(
    grid: Grid,
    nodes: np.ndarray,
    kept: np.ndarray,
    rotation: Rotation,
    base: np.ndarray,
    shift: np.ndarray,
    middle: np.ndarray,
) -> Grid:
    """Return all images of the part as one grid."""
    used, order = np.unique(kept), rotation.order
    keys = np.array([np.where(middle, base * order, base * order + (k + shift) % order) for k in range(order)])
    distinct, first, inverse = np.unique(keys[:, used].ravel(), return_index=True, return_inverse=True)
    rank = np.empty(len(distinct), np.int64)
    by_first = np.argsort(first, kind="stable")
    rank[by_first] = np.arange(len(distinct))
    number_of = np.full((order, len(nodes)), -1)
    number_of[:, used] = rank[inverse.ravel()].reshape(order, -1)
    source, times = np.divmod(distinct[by_first], order)
    centre = np.array(rotation.point) - grid.origin
    turns = np.array([rotation.matrix(k) for k in range(order)])
    made = np.einsum("vij,vj->vi", turns[times], nodes[source] - centre) + centre
    made[times == 0] = nodes[source[times == 0]]
    own = without_edge_lines(grid)
    return with_panels(
        grid,
        made,
        np.concatenate([number_of[k][kept] for k in range(order)]),
        fixed=grid.fixed[source],
        lines=images_of_members(own.lines, number_of),
        line_sets=images_of_lines(own.line_sets, number_of),
        deviation=None if grid.deviation is None else grid.deviation[source],
        desired=None if grid.desired is None else grid.desired[source],
    )


def _refuse(grid: Grid, node: int) -> None:
    """Refuse a grid of which the rows do not follow the seams alike."""
    where = ", ".join(f"{c:.5g}" for c in grid.scan_nodes[node])
    raise FrontError(
        f"the rows are not alike on both seams at ({where}); try another --length, or leave --symmetry out", grid
    )
