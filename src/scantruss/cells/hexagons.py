"""Grids of hexagons: the dual of a grid of triangles, a node on the scan for each triangle, evened out.

The boundary is closed by a node on each member of the triangles' boundary, and by their corners.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..errors import FrontError
from ..grid.grid import Grid
from ..grid.panels import sides_of, sizes_of, table_of, triangles_of
from ..improve.optimize import project_onto_scan
from ..improve.working_mesh import WorkingMesh
from ..kernels.mesh.grid import AT_REST
from ..runtime.progress import Progress
from ..surface.scratch import with_own_scratch
from .stops import at_stops, slide_back

if TYPE_CHECKING:
    from ..boundary.find import Boundary
    from ..constraints.find import Constraints
    from ..settings import Settings
    from ..surface.samples import SurfaceSamples

TRIANGLE_MEMBER = 3.0**0.5  # member of the triangles whose dual has members of 1
HEXAGON_ROUNDS, HEXAGON_STEPS = 12, 12  # times that nodes return to the scan, and steps between
HEXAGON_ANGLES = 0.35  # weight of the angles, 120 degrees, against the lengths
HEXAGON_STEP = 0.22  # of the step to the least energy of a node whose neighbours rest


class Dual(NamedTuple):
    """The dual of a grid of triangles."""

    nodes: np.ndarray  #: (V, 3) [scan unit]
    panels: np.ndarray  #: (P, K) int64, filled up with -1
    fixed: np.ndarray  #: (V,) bool, nodes at corners


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
    grid = at_stops(grid, boundary.stops, settings.length)
    dual = dual_of(grid, boundary.stops, 1e-6 * settings.length)
    first = grid.replace(
        nodes=dual.nodes, triangles=triangles_of(dual.nodes, dual.panels), panels=dual.panels,
        fixed=np.zeros(len(dual.nodes), np.bool_), lines=np.zeros((0, 2), np.int64), line_sets=(), deviation=None, desired=None,
    )  # fmt: skip

    def opened(some: Grid) -> WorkingMesh:
        surface = with_own_scratch(samples.surface)
        return WorkingMesh.from_grid(some, surface, boundary.curves, boundary.stops, settings.length)

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
    report(1.0)
    return made.replace(before=before)


def dual_of(grid: Grid, corners: np.ndarray, near: float) -> Dual:
    """Return the dual of a grid of triangles.

    Parameters
    ----------
    grid : Grid
        An oriented manifold of triangles.
    corners : (K, 3) places at which nodes of its boundary become nodes
    near : distance within which they do [scan unit]
    """
    triangles, count = grid.triangles, len(grid.triangles)
    boundary_members = np.flatnonzero(grid.edge_uses == 1)
    of_boundary_member = {int(edge): count + number for number, edge in enumerate(boundary_members.tolist())}
    middles = grid.nodes[triangles].mean(axis=1)
    middles_of_members = grid.nodes[grid.edges[boundary_members]].mean(axis=1)
    boundary_nodes = np.unique(grid.edges[boundary_members])
    at_corner = np.array(
        [len(corners) > 0 and np.linalg.norm(corners - grid.nodes[v], axis=1).min() <= near for v in boundary_nodes]
    )
    kept = boundary_nodes[at_corner] if len(boundary_nodes) else boundary_nodes
    own = {int(v): count + len(boundary_members) + number for number, v in enumerate(kept.tolist())}
    sides = grid.half_edge_edges.reshape(3, -1).T
    after: list[dict[int, int]] = [{} for _ in grid.nodes]  # at each node: from member to member, over a triangle
    over: list[dict[int, int]] = [{} for _ in grid.nodes]
    for t, (corner, side) in enumerate(zip(triangles.tolist(), sides.tolist(), strict=True)):
        for k in range(3):
            after[corner[k]][side[k]] = side[k - 1]
            over[corner[k]][side[k]] = t
    loops = []
    for v, following in enumerate(after):
        if not following:
            continue
        starts = set(following) - set(following.values())
        edge = starts.pop() if starts else min(following)
        loop = [of_boundary_member[edge]] if edge in of_boundary_member else []
        for _ in range(len(following)):
            loop.append(over[v][edge])
            edge = following[edge]
        if edge in of_boundary_member:
            loop.append(of_boundary_member[edge])
            if v in own:
                loop.append(own[v])
        if len(loop) > 2:
            loops.append(loop)
    nodes = np.concatenate([middles, middles_of_members, grid.nodes[kept]])
    fixed = np.zeros(len(nodes), np.bool_)
    fixed[count + len(boundary_members) :] = True
    return Dual(nodes, table_of(loops), fixed)


def even_out(mesh: WorkingMesh, grid: Grid, length: float) -> None:
    """Move the nodes of an opened grid towards members of one length and angles of 120 degrees; those on curves slide."""
    net, count = mesh.net, len(grid.nodes)
    nodes, kind = net.nodes[:count], net.kind[:count]
    target = length * net.desired[:count]
    a, b = grid.edges.T
    panels = grid.panel_table
    before, after = _corners(panels)
    normals = mesh.patches[:count, 3:6]
    at_boundary = np.zeros(count, np.bool_)
    at_boundary[grid.edges[grid.edge_uses == 1].ravel()] = True
    for _ in range(HEXAGON_STEPS):
        way = nodes[b] - nodes[a]
        size = np.linalg.norm(way, axis=1, keepdims=True)
        wanted = 0.5 * (target[a] + target[b])[:, None]
        pull = (size / wanted - 1.0) * way / np.maximum(size, 1e-12 * wanted)
        move = np.zeros_like(nodes)
        np.add.at(move, a, pull)
        np.add.at(move, b, -pull)
        _add_turns(move, nodes, before, after, at_boundary, length)
        move *= HEXAGON_STEP * target[:, None]
        move -= (move * normals).sum(axis=1, keepdims=True) * normals
        move[kind >= AT_REST] = 0.0
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
