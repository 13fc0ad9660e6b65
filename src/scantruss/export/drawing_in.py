"""Lines and faces that others drew become a grid: ends merged to nodes, panels found among the lines, all wound alike."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..errors import FormatError
from ..grid.grid import Grid
from ..grid.topology import wound_alike
from ..kernels.geometry.components import component_labels

MERGE = 1e-3  #: distance within which ends are one node, in median lengths of lines
FAR = 1e5  #: coordinates from which on nodes are kept relative to an origin [unit]
MOST_WEDGES = 50_000_000  #: pairs of lines at a node that are looked at


@dataclass(frozen=True, eq=False)
class Drawing:
    """What a file of lines and faces holds, in the frame of the file."""

    points: np.ndarray  #: (N, 3) ends and corners, each as often as the file has it
    lines: np.ndarray = field(default_factory=lambda: np.zeros((0, 2), np.int64))  #: (L, 2) points
    faces: np.ndarray = field(default_factory=lambda: np.zeros((0, 3), np.int64))  #: (F, 3) points
    unit: str = ""
    left: str = ""  #: what else the file holds and is not read, in words
    system: str = ""  #: reference system of the points


def grid_of_drawing(drawing: Drawing, name: str, merge: float | None = None) -> tuple[Grid, tuple[str, ...]]:
    """Return the grid of a drawing, and notes on what it was made of.

    Parameters
    ----------
    drawing : Drawing
        Where it has faces, these are the panels; else all cycles of three lines are.
    name : str
        Of the file, for messages.
    merge : float, optional
        Distance within which ends are one node; by default a thousandth of the median length of the lines [unit].

    Raises
    ------
    FormatError
        There is nothing, lines that are on no panel, or panels that are no surface.
    """
    if merge is not None and not 0 <= merge < np.inf:
        raise FormatError(f"--merge must be a distance of 0 or more, got {merge!r}")
    pairs = np.concatenate([drawing.lines, *(drawing.faces[:, [k, (k + 1) % 3]] for k in range(3))]).astype(np.int64)
    if not len(pairs):
        raise FormatError(f"{name} has no lines and no faces of three corners{drawing.left}; a grid needs them")
    if not np.isfinite(drawing.points[pairs]).all():
        raise FormatError(f"{name} has an end that is no number; export it again")
    lengths = np.linalg.norm(drawing.points[pairs[:, 1]] - drawing.points[pairs[:, 0]], axis=1)
    reach = MERGE * float(np.median(lengths)) if merge is None else merge
    points, number = _merged(drawing.points, np.unique(pairs), reach)
    if (short := number[pairs[:, 0]] == number[pairs[:, 1]]).any():
        where = _place(drawing.points[pairs[short][0, 0]])
        raise FormatError(
            f"{name} has {short.sum():,} lines or sides no longer than {reach:.3g}, one at {where}; take a smaller --merge"
        )
    lines = np.unique(np.sort(number[drawing.lines], axis=1), axis=0)
    faces = number[drawing.faces]
    if len(drawing.faces):
        triangles, how = faces, ""
    else:
        triangles, how = _panels(lines, points, name), "; its panels are all {:,} cycles of three lines"
    _check_lines(lines, triangles, points, name)
    far = float(np.abs(points).max()) > FAR
    origin = np.round((points.min(axis=0) + points.max(axis=0)) / 2) if far else np.zeros(3)
    grid = Grid(
        nodes=points - origin,
        triangles=triangles,
        fixed=np.zeros(len(points), bool),
        origin=origin,
        unit=drawing.unit,
        system=drawing.system,
    )
    if not grid.topology.manifold:
        raise FormatError(
            f"{name} is no surface: an edge has more than two panels, or panels meet at a node only; take out what is double"
        )
    if not grid.topology.orientable:
        raise FormatError(f"{name} is a surface with one side only; cut it open")
    triangles = wound_alike(grid)
    if not len(drawing.faces):
        triangles = _outwards(grid.replace(triangles=triangles))
    note = f"{name} has no certificate: it was compared with no scan{how.format(len(triangles))}{drawing.left}"
    return grid.replace(triangles=triangles), (note,)


def _place(point: np.ndarray) -> str:
    return ", ".join(f"{value:.6g}" for value in point)


def _merged(points: np.ndarray, used: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the nodes in the order of the file, each at its first point, and the node of each point (-1 where it is not used)."""
    from scipy.spatial import cKDTree

    close = cKDTree(points[used]).query_pairs(reach, output_type="ndarray").astype(np.int64)
    label = component_labels(len(used), np.ascontiguousarray(close[:, 0]), np.ascontiguousarray(close[:, 1]))
    _, first, inverse = np.unique(label, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order))
    number = np.full(len(points), -1, np.int64)
    number[used] = rank[inverse.ravel()]
    return points[used[first[order]]], number


def _panels(lines: np.ndarray, points: np.ndarray, name: str) -> np.ndarray:
    """Return the cycles of three lines that are panels: a cycle that separates panels on both sides of all its lines is none.

    Raises
    ------
    FormatError
        A line is left with more than two.
    """
    count, many = len(points), len(lines)
    low, high = lines.T
    keys = low * count + high
    later = (
        np.searchsorted(low, low, side="right") - np.arange(many) - 1
    )  # lines behind this one that begin at its node
    if later.sum() > MOST_WEDGES:
        raise FormatError(f"{name} has nodes with too many lines to be a grid")
    first = np.repeat(np.arange(many), later)
    second = first + 1 + np.arange(len(first)) - np.repeat(np.cumsum(later) - later, later)
    closing = high[first] * count + high[second]
    third = np.minimum(np.searchsorted(keys, closing), many - 1)
    found = keys[third] == closing
    sides = np.stack([first, second, third], axis=1)[found]
    triangles = np.stack([low[first], high[first], high[second]], axis=1)[found]
    uses = np.bincount(sides.ravel(), minlength=many)
    between = (uses[sides] > 2).all(axis=1)
    uses = np.bincount(sides[~between].ravel(), minlength=many)
    if (wrong := np.flatnonzero(uses > 2)).size or (
        wrong := sides[between][(uses[sides[between]] < 2).any(axis=1)].ravel()
    ).size:
        where = _place(points[lines[wrong[0]]].mean(axis=0))
        raise FormatError(
            f"{name} has lines with more than two cycles of three lines, one at {where}; export its panels as faces"
        )
    return triangles[~between]


def _check_lines(lines: np.ndarray, triangles: np.ndarray, points: np.ndarray, name: str) -> None:
    """Refuse lines that are no side of a panel, which a grid cannot hold."""
    sides = np.concatenate([np.sort(triangles[:, [k, (k + 1) % 3]], axis=1) for k in range(3)])
    count = len(points)
    loose = np.flatnonzero(~np.isin(lines[:, 0] * count + lines[:, 1], sides[:, 0] * count + sides[:, 1]))
    if len(loose):
        where = _place(points[lines[loose[0]]].mean(axis=0))
        raise FormatError(
            f"{name} has {len(loose):,} of {len(lines):,} lines on no panel of three sides, one at {where}; grids are of triangles only:"
            " take them out, split lines at their nodes, or give a larger --merge"
        )


def _outwards(grid: Grid) -> np.ndarray:
    """Return the triangles, those of each piece turned so that they look up, or outwards where it is closed."""
    triangles = grid.triangles.copy()
    corners = grid.nodes[triangles]
    areas = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    piece = component_labels(len(grid.nodes), grid.edges[:, 0], grid.edges[:, 1])[triangles[:, 0]]
    closed = np.setdiff1d(piece, piece[grid.edge_triangles[grid.edge_triangles[:, 1] < 0, 0]])
    for number in np.unique(piece).tolist():
        own = piece == number
        total = areas[own].sum(axis=0)
        if number in closed:
            middle = corners[own].mean(axis=(0, 1))
            side = float(((corners[own, 0] - middle) * areas[own]).sum())
        else:
            steep = abs(total[2]) < 1e-3 * np.linalg.norm(areas[own], axis=1).sum()
            side = float(total[np.abs(total).argmax()] if steep else total[2])
        if side < 0:
            triangles[own] = triangles[own][:, [0, 2, 1]]
    return triangles
