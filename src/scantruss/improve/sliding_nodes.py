"""Nodes of lines in an opened grid: which of them slide, and on which curves."""

from __future__ import annotations

import numpy as np

from ..constraints.network import Lines, WholeLine, curves_of
from ..grid.grid import Grid
from ..grid.line_sets import FIXED_LINE, RIDGE, LineSet
from ..kernels.boundary.curves import Curves, nearest_on_curves
from ..kernels.mesh.grid import LOCKED, ON_CURVE, Net

SNAP_DISTANCE = 0.4  # distance within which the nearest node of a line is the end of the line [member lengths]
ON_LINE = 0.35  # a node within this distance of a line is its own: lines are bent by up to 0.3 where they meet others [member lengths]


def joined(first: Curves, second: Curves) -> Curves:
    """Return the curves of both, those of the second numbered after those of the first."""
    return Curves(
        np.concatenate([first.points, second.points]),
        np.concatenate([first.arc, second.arc]),
        np.concatenate([first.start, second.start[1:] + first.start[-1]]),
        np.concatenate([first.total, second.total]),
    )


def inner_lines(grid: Grid) -> np.ndarray:
    """Members (K, 2) of lines that are not on the boundary, where nothing can be flipped anyway."""
    kept: np.ndarray = grid.edges[grid.edge_on_line & (grid.edge_uses > 1)] if len(grid.lines) else grid.lines
    return kept


def with_boundary_members(grid: Grid, lines: Lines, length: float) -> Grid:
    """Return the grid with the members of the boundary that lines run along among its lines."""
    if not lines.along:
        return grid
    track = curves_of(lines.along, [False] * len(lines.along))
    ends = grid.edges[grid.edge_uses == 1]

    def is_near(place: np.ndarray) -> bool:
        return nearest_on_curves(track, *place.tolist())[2] < SNAP_DISTANCE * length

    near = [is_near(a) and is_near(b) and is_near(0.5 * (a + b)) for a, b in grid.nodes[ends]]
    return grid.replace(lines=np.unique(np.concatenate([grid.lines, ends[np.array(near, np.bool_)]]), axis=0))


def with_line_sets(grid: Grid, lines: Lines, length: float) -> Grid:
    """Return the grid with the nodes on each fixed line and each ridge; lines of one name have one set."""
    parts: dict[tuple[str, bool], list[WholeLine]] = {}
    for line in lines.whole:
        parts.setdefault((line.name, line.ridge), []).append(line)
    sets = []
    for (name, ridge), own in parts.items():
        nodes = _nodes_along(grid, curves_of([line.points for line in own], [line.closed for line in own]), length)
        if len(nodes):
            sets.append(LineSet(name, RIDGE if ridge else FIXED_LINE, nodes))
    return grid.replace(line_sets=tuple(sets))


def _nodes_along(grid: Grid, track: Curves, length: float) -> np.ndarray:
    """Return the nodes (K,) of members of lines that lie along some curves, in their order there."""
    on_lines = np.unique(grid.lines)
    found = [nearest_on_curves(track, *place) for place in grid.nodes[on_lines].tolist()]
    is_near = np.zeros(len(grid.nodes), np.bool_)
    is_near[on_lines] = [distance < ON_LINE * length for _, _, distance in found]
    own = np.isin(on_lines, grid.lines[is_near[grid.lines].all(axis=1)])
    order = np.lexsort((np.array([f[1] for f in found]), np.array([f[0] for f in found])))
    nodes: np.ndarray = on_lines[order][own[order]]
    return nodes


def find_on_lines(net: Net, lines: Lines, first: int, fixed: np.ndarray, length: float) -> None:
    """Let the nodes of lines slide on the nearest curve; ends, corners, crossings and fixed nodes (C,) stay at rest.

    The curves of the lines are numbered from `first` on.
    """
    used = net.used
    nodes = np.flatnonzero((net.line[:used] != 0) & (net.is_open[:used] == 0) & (net.kind[:used] != LOCKED))
    inside = nodes[[int(line).bit_count() == 2 for line in net.line[nodes].tolist()]] if len(nodes) else nodes
    at_stop = set()
    for place in lines.stops if len(nodes) else ():
        squares = ((net.nodes[nodes] - place) ** 2).sum(axis=1)
        if squares.min() <= (SNAP_DISTANCE * length) ** 2:
            at_stop.add(int(nodes[squares.argmin()]))
    curves = lines.arrays
    for v in inside.tolist():
        if v not in at_stop:
            curve, arc, distance = nearest_on_curves(curves, *net.nodes[v].tolist())
            if distance <= SNAP_DISTANCE * length:
                net.curve[v], net.arc[v] = first + curve, arc
                if not fixed[v]:
                    net.kind[v] = ON_CURVE
