"""Grids of hexagons: the dual of a grid of triangles, a node on the scan for each triangle, evened out.

The boundary is closed by a node on each member of the triangles' boundary, and by their corners. Lines cut the panels in the same way
and so become chains of members.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..constraints.fixed_nodes import check_fixed_positions
from ..errors import FrontError
from ..grid.grid import Grid
from ..grid.panels import sides_of, sizes_of, table_of, triangles_of
from ..improve.images import Images
from ..improve.optimize import project_onto_scan
from ..improve.sliding_nodes import with_boundary_members, with_line_sets
from ..improve.working_mesh import WorkingMesh
from ..kernels.boundary.curves import nearest_on_curves
from ..kernels.mesh.grid import AT_REST, INTERIOR, ON_CURVE
from ..runtime.progress import Progress
from ..surface.scratch import with_own_scratch
from .stops import at_stops, slide_back, ways_along

if TYPE_CHECKING:
    from ..boundary.find import Boundary
    from ..constraints.find import Constraints
    from ..settings import Settings
    from ..surface.samples import SurfaceSamples

TRIANGLE_MEMBER = 3.0**0.5  # member of the triangles whose dual has members of 1
HEXAGON_ROUNDS, HEXAGON_STEPS = 12, 12  # times that nodes return to the scan, and steps between
HEXAGON_ANGLES = 0.35  # weight of the angles, 120 degrees, against the lengths
# distance of a fixed position from the boundary or a line up to which one of its nodes goes there [members]
ON_SEAM = 0.25
HEXAGON_STEP = 0.22  # of the step to the least energy of a node whose neighbours rest


class Dual(NamedTuple):
    """The dual of a grid of triangles."""

    nodes: np.ndarray  #: (V, 3) [scan unit]
    panels: np.ndarray  #: (P, K) int64, filled up with -1
    lines: np.ndarray  #: (K, 2) members along lines, not on the boundary


def hexagons_of(
    grid: Grid,
    samples: SurfaceSamples,
    boundary: Boundary,
    constraints: Constraints,
    settings: Settings,
    *,
    progress: Progress | None = None,
) -> Grid:
    """Return a grid of hexagons over the surface of one of triangles; pentagons, heptagons and what the boundary cuts among them.

    Parameters
    ----------
    grid : Grid
        Of triangles of `TRIANGLE_MEMBER` times the desired length, on the scan.
    samples, boundary, constraints
        What it was made with.
    settings : Settings
        `length`, of the hexagons.

    Returns
    -------
    Grid
        With `panels`; not checked.

    Raises
    ------
    FrontError
        The triangles are no oriented manifold.
    """
    report: Callable[[float], None] = (lambda share: progress("cells", share)) if progress else (lambda share: None)
    report(0.0)
    if not (grid.topology.manifold and grid.topology.orientable):
        raise FrontError("the grid is no oriented manifold of triangles, which hexagons are made of", grid)
    positions = check_fixed_positions(settings.fixed, samples, settings.length)
    images = Images.of_grid(grid)
    corners = np.concatenate([boundary.stops.reshape(-1, 3), constraints.lines.stops])

    def with_corners(some: Grid) -> Grid:
        some = at_stops(some, boundary.stops, settings.length)
        return at_stops(some, constraints.lines.stops, settings.length, np.unique(some.lines))

    if images.some:
        kept = np.flatnonzero(_at(with_corners(grid).nodes, corners, 1e-6 * settings.length))
        corners = grid.nodes[np.unique(images.of[:, kept])]
        positions = images.of_places(positions, ON_SEAM * settings.length)
    else:
        grid = with_corners(grid)
    dual = dual_of(grid, corners, 1e-6 * settings.length)
    found = images.of_nodes(dual.nodes, 1e-6 * settings.length)
    if found is None:
        raise FrontError("the hexagons would not be symmetric; leave --symmetry out", grid)
    images = found
    first = grid.replace(
        nodes=dual.nodes, triangles=triangles_of(dual.nodes, dual.panels), panels=dual.panels,
        fixed=np.zeros(len(dual.nodes), np.bool_), lines=dual.lines, line_sets=(), deviation=None, desired=None,
    )  # fmt: skip

    def opened(some: Grid) -> WorkingMesh:
        surface = with_own_scratch(samples.surface)
        return WorkingMesh.from_grid(some, surface, boundary.curves, boundary.stops, settings.length, constraints.lines)

    first = with_corners(first) if images.some else first
    first = with_fixed_nodes(first, opened(first), positions, settings.length)

    mesh, count = opened(first), len(dual.nodes)
    mesh.return_to_scan(1.0)
    before = first.replace(nodes=mesh.net.nodes[:count].copy()).quality
    for number in range(HEXAGON_ROUNDS):
        report(0.1 + 0.8 * number / HEXAGON_ROUNDS)
        even_out(mesh, first, settings.length)
        mesh.return_to_scan(0.2)
    made = first.replace(nodes=mesh.net.nodes[:count].copy())
    mesh = opened(made)
    project_onto_scan(mesh, samples, boundary=not settings.boundary)
    made = made.replace(
        nodes=mesh.net.nodes[:count].copy(),
        deviation=mesh.deviation()[:count].copy(),
        desired=mesh.length * mesh.net.desired[:count] if mesh.graded else None,
    )
    made = made_alike(made, images, opened)
    made = with_boundary_members(made, constraints.lines, settings.length)
    report(1.0)
    return with_line_sets(made, constraints.lines, settings.length).replace(before=before)


def made_alike(grid: Grid, images: Images, opened: Callable[[Grid], WorkingMesh]) -> Grid:
    """Return a grid whose nodes are exactly images of each other: each at the mean of what its images say."""
    if not images.some or grid.deviation is None:
        return grid
    moved = grid.replace(nodes=images.alike(grid.nodes))
    away = opened(moved).deviation()[: len(moved.nodes)]
    return moved.replace(deviation=np.where(np.isnan(grid.deviation), np.nan, away))


def with_fixed_nodes(grid: Grid, mesh: WorkingMesh, positions: np.ndarray, length: float) -> Grid:
    """Return a grid with the nearest node to each position (K, 3) there, of the boundary or a line if it is on one.

    mesh : the grid opened, whose node k is its node k
    """
    nodes, fixed, kind = grid.nodes.copy(), grid.fixed.copy(), mesh.net.kind[: len(grid.nodes)]
    for place in positions:
        on_curve = len(mesh.curves.total) > 0 and nearest_on_curves(mesh.curves, *place.tolist())[2] < ON_SEAM * length
        away = np.linalg.norm(nodes - place, axis=1)
        free = ~fixed & ((kind == ON_CURVE) if on_curve else (kind == INTERIOR))
        at_corner = np.flatnonzero((kind == AT_REST) & ~fixed & (away < ON_SEAM * length))
        v = at_corner[0] if len(at_corner) else int(np.where(free, away, np.inf).argmin())
        nodes[v], fixed[v] = place, True
    return grid.replace(nodes=nodes, fixed=fixed)


def dual_of(grid: Grid, corners: np.ndarray, near: float) -> Dual:
    """Return the dual of a grid of triangles, cut along its boundary and lines by a node on each of their members.

    Parameters
    ----------
    grid : Grid
        An oriented manifold of triangles.
    corners : (K, 3) places at which nodes of its boundary and lines become nodes
    near : distance within which they do [scan unit]
    """
    triangles, count = grid.triangles, len(grid.triangles)
    seam = (grid.edge_uses == 1) | grid.edge_on_line
    seams = np.flatnonzero(seam)
    on_seam = {edge: count + number for number, edge in enumerate(seams.tolist())}
    kept = _kept_nodes(grid, seams, corners, near)
    own = {v: count + len(seams) + number for number, v in enumerate(kept)}
    sides = grid.half_edge_edges.reshape(3, -1).T
    after: list[dict[int, tuple[int, int]]] = [
        {} for _ in grid.nodes
    ]  # at each node: triangle after a member, member after that
    for t, (corner, side) in enumerate(zip(triangles.tolist(), sides.tolist(), strict=True)):
        for k in range(3):
            after[corner[k]][side[k]] = (t, side[k - 1])
    loops, lines = [], []
    for v, following in enumerate(after):
        if not following:
            continue
        mine = [own[v]] if v in own else []
        sectors = _sectors(following, on_seam)
        if len(sectors) == 1 and sectors[0].first == sectors[0].last and mine:
            loops += _around_end(mine[0], sectors[0])
        else:
            loops += [loop for sector in sectors if len(loop := [*mine, *sector.nodes]) > 2]
        inner = sorted({at for sector in sectors for at in (sector.first, sector.last) if at >= 0})
        inner = [at for at in inner if grid.edge_uses[seams[at - count]] == 2]
        lines += [(mine[0], at) for at in inner] if mine else [(inner[0], inner[1])] if len(inner) == 2 else []
    middles = grid.nodes[triangles].mean(axis=1)
    nodes = np.concatenate([middles, grid.nodes[grid.edges[seams]].mean(axis=1), grid.nodes[kept]])
    return Dual(nodes, table_of(loops), np.unique(np.sort(np.array(lines, np.int64).reshape(-1, 2), axis=1), axis=0))


class Sector(NamedTuple):
    """What lies at a node between two members of the boundary or a line, or all around it."""

    first: int  #: node of the dual on the one member, -1 all around
    nodes: list[int]  #: those of the panel, both on the members among them
    last: int


def _sectors(following: dict[int, tuple[int, int]], on_seam: dict[int, int]) -> list[Sector]:
    """Return the sectors at a node; following: triangle and member after each member around it."""
    starts = set(following) - {edge for _, edge in following.values()}
    cuts = [edge for edge in following if edge in on_seam]
    edge = starts.pop() if starts else min(cuts or following)
    found, nodes, first = [], [], on_seam.get(edge, -1)
    for _ in range(len(following)):
        t, edge = following[edge]
        nodes.append(t)
        if edge in on_seam:
            last = on_seam[edge]
            found.append(Sector(first, [first, *nodes, last] if first != last else [first, *nodes], last))
            nodes, first = [], last
    return [*found, Sector(-1, nodes, -1)] if nodes else found


def _around_end(end: int, around: Sector) -> list[list[int]]:
    """Return three panels around the end of a line, from which two members more go on."""
    on_line, *ring = around.nodes
    i = len(ring) // 2
    j = len(ring) + 1 - i
    return [[end, on_line, *ring[:i]], [end, *ring[i - 1 : j]], [end, *ring[j - 1 :], on_line]]


def _kept_nodes(grid: Grid, seams: np.ndarray, corners: np.ndarray, near: float) -> list[int]:
    """Return the nodes that stay nodes: at corners, and where other than two members of the boundary and lines meet."""
    meeting = np.bincount(grid.edges[seams].ravel(), minlength=len(grid.nodes))
    kept = set(np.flatnonzero((meeting > 0) & (meeting != 2)).tolist())
    for v in np.flatnonzero(meeting == 2).tolist():
        if _at(grid.nodes[[v]], corners, near)[0]:
            kept.add(v)
    return sorted(kept)


def _at(nodes: np.ndarray, places: np.ndarray, near: float) -> np.ndarray:
    """Whether each node (V, 3) is at one of some places (K, 3)."""
    apart = np.linalg.norm(nodes[:, None] - places, axis=2)
    return np.asarray((apart <= near).any(axis=1))


def even_out(mesh: WorkingMesh, grid: Grid, length: float) -> None:
    """Move the nodes of an opened grid towards members of one length and angles of 120 degrees; those on curves slide."""
    net, count = mesh.net, len(grid.nodes)
    nodes, kind = net.nodes[:count], net.kind[:count]
    target = length * net.desired[:count]
    a, b = grid.edges.T
    seam = (grid.edge_uses == 1) | grid.edge_on_line
    usual = np.where(seam, TRIANGLE_MEMBER, 1.0)
    panels = grid.panel_table
    before, after = _corners(panels)
    normals = mesh.patches["normal"][:count]
    at_boundary = np.zeros(count, np.bool_)
    seam_members = grid.edges[seam]
    at_boundary[seam_members.ravel()] = True
    slides = np.flatnonzero(kind == ON_CURVE)
    for _ in range(HEXAGON_STEPS):
        way = nodes[b] - nodes[a]
        size = np.linalg.norm(way, axis=1, keepdims=True)
        wanted = (0.5 * usual * (target[a] + target[b]))[:, None]
        pull = (size / wanted - 1.0) * way / np.maximum(size, 1e-12 * wanted)
        move = np.zeros_like(nodes)
        np.add.at(move, a, pull)
        np.add.at(move, b, -pull)
        _add_turns(move, nodes, before, after, at_boundary, length)
        move *= HEXAGON_STEP * target[:, None]
        move -= (move * normals).sum(axis=1, keepdims=True) * normals
        move[kind >= AT_REST] = 0.0
        along = ways_along(nodes, seam_members)[slides]
        move[slides] = (move[slides] * along).sum(axis=1, keepdims=True) * along
        nodes += move
    slide_back(mesh, count)


def _corners(panels: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return for each corner of each panel its node and the one before, and its node and the one after (C, 2)."""
    sides, size = sides_of(panels), sizes_of(panels)
    start = np.concatenate([[0], np.cumsum(size)[:-1]])
    place = np.arange(len(sides)) - np.repeat(start, size)
    last = np.repeat(start + size - 1, size)
    before = np.where(place > 0, np.arange(len(sides)) - 1, last)
    return np.stack([sides[:, 0], sides[before, 0]], axis=1), sides


def _add_turns(
    move: np.ndarray, nodes: np.ndarray, before: np.ndarray, after: np.ndarray, at_boundary: np.ndarray, length: float
) -> None:
    """Add what opens or closes the angles to 120 degrees, those at the boundary to 90: the ends of both sides move along their bisector."""
    v, one, two = before[:, 0], before[:, 1], after[:, 1]
    e, f = nodes[one] - nodes[v], nodes[two] - nodes[v]
    e /= np.maximum(np.linalg.norm(e, axis=1, keepdims=True), 1e-12 * length)
    f /= np.maximum(np.linalg.norm(f, axis=1, keepdims=True), 1e-12 * length)
    cosine = (e * f).sum(axis=1, keepdims=True)
    wanted = np.where(at_boundary[v], 0.0, -0.5)[:, None]
    off = HEXAGON_ANGLES * (cosine - wanted)
    np.add.at(move, one, -off * (f - cosine * e))
    np.add.at(move, two, -off * (e - cosine * f))
    np.add.at(move, v, off * ((f - cosine * e) + (e - cosine * f)))
