"""Lines and faces that others drew become a grid: ends merged to nodes, panels found among the lines, all wound alike.

Lines on no panel, such as props, ties and what a space frame is made of, are its members too.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import combinations

import numpy as np

from ..errors import FormatError
from ..grid.grid import Grid
from ..grid.panels import first_triangles, loops_of, sides_of, table_of, triangles_of
from ..grid.topology import wound_alike
from ..kernels.geometry.components import component_labels
from ..layouts.framework import Framework, outer_normals
from .drawing_ends import check_ends
from .drawing_panels import (
    TooManyCyclesError,
    lines_on_no_panel,
    panels_among_lines,
    place_in_drawing,
    sides_on_no_line,
    without_diagonals,
)

MERGE_DISTANCE = 1e-3  #: distance within which ends are one node, in median lengths of lines
FAR_FROM_ZERO = 1e5  #: coordinates from which on nodes are kept relative to an origin [unit]
NEARLY_JOINED = 0.05  #: distance within which nodes that no line joins, and nodes and lines, are taken for badly drawn, in median lengths


@dataclass(frozen=True, eq=False)
class Drawing:
    """What a file of lines and faces holds, in the frame of the file."""

    points: np.ndarray  #: (N, 3) ends and corners, each as often as the file has it
    lines: np.ndarray = field(default_factory=lambda: np.zeros((0, 2), np.int64))  #: (L, 2) points
    faces: np.ndarray = field(default_factory=lambda: np.zeros((0, 3), np.int64))  #: (F, K) points, filled up with -1
    loops: np.ndarray = field(
        default_factory=lambda: np.zeros((0, 3), np.int64)
    )  #: (C, K) points of closed polylines, whose sides are among the lines
    nodes: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))  #: (K, 3) nodes that are drawn, in their order
    unit: str = ""
    left: str = ""  #: what else the file holds and is not read, in words
    system: str = ""  #: reference system of the points


def grid_of_drawing(drawing: Drawing, name: str, merge: float | None = None) -> tuple[Grid, tuple[str, ...]]:
    """Return the grid of a drawing, a `Framework` where some lines are on no panel, and notes on what it was made of.

    Parameters
    ----------
    drawing : Drawing
        Where it has faces, these are the panels; else closed polylines, if all lines are sides of these; else the cycles of three
        lines, and of four, if they are a surface.
    name : str
        Of the file, for messages.
    merge : float, optional
        Distance within which ends are one node; by default a thousandth of the median length of the lines [unit].

    Raises
    ------
    FormatError
        There is nothing, faces are no surface, or lines nearly meet and are not joined.
    """
    if merge is not None and not 0 <= merge < np.inf:
        raise FormatError(f"--merge must be a distance of 0 or more, got {merge!r}")
    pairs = np.concatenate([drawing.lines, sides_of(drawing.faces)]).astype(np.int64)
    if not len(pairs):
        raise FormatError(
            f"{name} has no lines and no faces{drawing.left}; a grid needs them (scantruss grid makes one of a scan)"
        )
    if not np.isfinite(drawing.points[pairs]).all():
        raise FormatError(f"{name} has an end that is not a number; export it again")
    median = float(np.median(np.linalg.norm(drawing.points[pairs[:, 1]] - drawing.points[pairs[:, 0]], axis=1)))
    reach = MERGE_DISTANCE * median if merge is None else merge
    points, number = _merged(drawing, np.unique(pairs), reach)
    if (short := number[pairs[:, 0]] == number[pairs[:, 1]]).any():
        where = place_in_drawing(drawing.points[pairs[short][0, 0]])
        raise FormatError(
            f"{name} has {short.sum():,} lines or sides no longer than {reach:.3g}, one at {where}; use a smaller --merge"
        )
    lines = np.unique(np.sort(number[drawing.lines], axis=1), axis=0)
    far = float(np.abs(points).max()) > FAR_FROM_ZERO
    origin = np.round((points.min(axis=0) + points.max(axis=0)) / 2) if far else np.zeros(3)
    nodes = points - origin
    panels, how = _surface(drawing, lines, number, nodes, origin, name)
    loose = lines[lines_on_no_panel(lines, panels)]
    grid = _grid(nodes, panels, origin, drawing)
    if len(loose):
        members = np.unique(np.concatenate([np.sort(sides_of(panels), axis=1), loose]), axis=0)
        check_ends(members, points, reach, max(NEARLY_JOINED * median, reach), name)
        grid = _framework(grid, members, name)
        if len(panels):
            how += f"; {len(loose):,} of its {len(lines):,} lines are on no panel, and members all the same, one at "
            how += place_in_drawing(points[loose[0]].mean(axis=0))
    return grid, (f"{name} has no certificate: it was compared with no scan{how}{drawing.left}",)


def _surface(
    drawing: Drawing, lines: np.ndarray, number: np.ndarray, nodes: np.ndarray, origin: np.ndarray, name: str
) -> tuple[np.ndarray, str]:
    """Return the panels (P, K), wound alike, and how they were found in words; none where lines enclose no surface."""
    try:
        panels, how = _panels(drawing, lines, number, nodes + origin, name)
    except TooManyCyclesError as error:
        return np.zeros((0, 3), np.int64), f"; it has no panels, as loads on areas need: {error}"
    if twice := [loop for loop in loops_of(panels) if len(set(loop)) < len(loop)]:
        raise FormatError(
            f"{name} has a face that meets itself at {place_in_drawing((nodes + origin)[twice[0][0]])}; split it"
        )
    if not len(panels):
        return panels, "; it has no panels, as loads on areas need"
    grid = _grid(nodes, panels, origin, drawing)
    why = ""
    if not grid.topology.manifold:
        why = f"{name} is no surface: an edge has more than two panels, or panels meet at a node only; take out what is double"
    elif not grid.topology.orientable:
        why = f"{name} is a surface with one side only; cut it open"
    if why and len(drawing.faces):
        raise FormatError(why)
    if why:
        return panels[:0], f"; it has no panels, as loads on areas need: {why}"
    panels = _turned(panels, (wound_alike(grid) != grid.triangles).any(axis=1))
    if not len(drawing.faces):
        panels = _turned(panels, _looks_inwards(_grid(nodes, panels, origin, drawing)))
    return panels, how


def _panels(
    drawing: Drawing, lines: np.ndarray, number: np.ndarray, points: np.ndarray, name: str
) -> tuple[np.ndarray, str]:
    """Return the panels by their nodes (P, K), filled up with -1, and how they were found in words."""
    if len(drawing.faces):
        faces = np.where(drawing.faces < 0, -1, number[drawing.faces])
        panels = without_diagonals(faces, lines) if len(lines) else faces
        missing = len(sides_on_no_line(panels, lines)) if len(lines) else 0
        how = f"; {missing:,} sides of its faces are no lines, and members all the same" if missing else ""
        joined = len(faces) - len(panels)
        return (
            panels,
            f"; {joined:,} sides of its faces are no lines: faces beside them are one panel" if joined else how,
        )
    loops = np.where(drawing.loops < 0, -1, number[drawing.loops])
    if len(loops) and not len(lines_on_no_panel(lines, loops)):
        return loops, f"; its panels are all {len(loops):,} closed polylines"
    panels = panels_among_lines(lines, points, name)
    quads = int((panels[:, 3:] >= 0).sum())
    found = f"{len(panels) - quads:,} cycles of three" + f" and {quads:,} of four" * bool(quads)
    return panels, f"; its panels are all {found} lines"


def _grid(nodes: np.ndarray, panels: np.ndarray, origin: np.ndarray, drawing: Drawing) -> Grid:
    cells = panels.shape[1] > 3
    return Grid(
        nodes=nodes,
        triangles=triangles_of(nodes, panels) if cells else panels,
        panels=panels if cells else None,
        fixed=np.zeros(len(nodes), bool),
        origin=origin,
        unit=drawing.unit,
        system=drawing.system,
    )


def _framework(grid: Grid, members: np.ndarray, name: str) -> Framework:
    """Return a grid with members (E, 2), of which some are sides of no panel; nodes without panels have normals that point up."""
    table = grid.panel_table
    corners = np.concatenate([table[:, pair] for pair in map(list, combinations(range(table.shape[1]), 2))])
    corners = corners[(corners >= 0).all(axis=1)]
    across = corners[lines_on_no_panel(corners, table)]
    if len(wrong := np.delete(members, lines_on_no_panel(members, across), axis=0)):
        where = place_in_drawing((grid.nodes + grid.origin)[wrong[0]].mean(axis=0))
        raise FormatError(f"{name} has lines across its faces, one at {where}; draw what they divide as faces")
    return Framework(
        nodes=grid.nodes,
        triangles=grid.triangles,
        panels=grid.panels,
        fixed=grid.fixed,
        origin=grid.origin,
        unit=grid.unit,
        system=grid.system,
        own_members=members,
        own_normals=outer_normals(grid),
    )


def _merged(drawing: Drawing, used: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the nodes, each at its first point, and the node of each point (-1 where it is not used).

    They are in the order of those that are drawn, then in that of the file.
    """
    from scipy.spatial import cKDTree

    points = drawing.points
    close = cKDTree(points[used]).query_pairs(reach, output_type="ndarray").astype(np.int64)
    label = component_labels(len(used), np.ascontiguousarray(close[:, 0]), np.ascontiguousarray(close[:, 1]))
    _, first, inverse = np.unique(label, return_index=True, return_inverse=True)
    place = first + len(drawing.nodes)
    if len(drawing.nodes):
        far, drawn = cKDTree(drawing.nodes).query(points[used[first]], distance_upper_bound=np.nextafter(reach, np.inf))
        place = np.where(np.isfinite(far), drawn, place)
    order = np.lexsort((first, place))
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order))
    number = np.full(len(points), -1, np.int64)
    number[used] = rank[inverse.ravel()]
    return points[used[first[order]]], number


def _turned(panels: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return panels (P, K), those turned over of whose triangles (T,) the first is to be."""
    turn = triangles[first_triangles(panels)].tolist()
    return table_of(
        [loop[:1] + loop[:0:-1] if over else loop for loop, over in zip(loops_of(panels), turn, strict=True)]
    )


def _looks_inwards(grid: Grid) -> np.ndarray:
    """Return which triangles (T,) are of a piece that looks down, or inwards where it is closed."""
    corners = grid.nodes[grid.triangles]
    areas = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    label = component_labels(len(grid.nodes), *np.ascontiguousarray(grid.edges.T))
    piece, open_pieces = label[grid.triangles[:, 0]], set(label[grid.edges[grid.edge_uses == 1, 0]].tolist())
    wrong = np.zeros(len(piece), bool)
    for number in np.unique(piece).tolist():
        own = piece == number
        total = areas[own].sum(axis=0)
        if number not in open_pieces:
            middle = corners[own].mean(axis=(0, 1))
            side = float(((corners[own, 0] - middle) * areas[own]).sum())
        else:
            steep = abs(total[2]) < 1e-3 * np.linalg.norm(areas[own], axis=1).sum()
            side = float(total[np.abs(total).argmax()] if steep else total[2])
        wrong[own] = side < 0
    return wrong
