"""Fixed nodes: nodes at fixed positions (Sec. 4.2)."""

from __future__ import annotations

import numpy as np

from ..errors import InputError
from ..kernels.boundary.curves import nearest_on_curves
from ..kernels.mesh.grid import AT_REST, ON_CURVE, Net, may_split, split
from ..kernels.mesh.point_location import nearest_sample
from ..kernels.mesh.trial import Scratch
from ..surface.near_scan import local_field, place_text
from .equalize import FARTHEST_ON_THE_WAY, energy_of_grid, new_scratch, search_once, settle
from .working_mesh import WorkingMesh

# distance from the boundary up to which a fixed node becomes a boundary node [member lengths]
BOUNDARY_NODE_REACH = 0.33
SAME_PLACE = 1e-6  # distance up to which a node is already at a position [member lengths]
RINGS_SEARCHED = 2  # rings around a fixed node in which moves are tried
RINGS_SETTLED = 5  # rings around it that settle where only these do
NEAREST_TRIED = 3  # number of the nearest nodes, and of the nearest edges, that are tried for a fixed node


def _candidates(mesh: WorkingMesh, place: np.ndarray) -> np.ndarray:
    """Nodes that may be moved to a place, nearest first: no corners or fixed nodes; only those of a boundary or line that it is on.

    For a place close to a corner it is the corner alone: two nodes so close to each other would spoil the triangles between them.
    """
    net = mesh.net
    free = (net.degree > 0) & (net.kind < AT_REST)
    corners = np.flatnonzero((net.degree > 0) & (net.kind == AT_REST) & ~mesh.fixed)
    away = np.linalg.norm(net.nodes[corners] - place, axis=1)
    if len(away) and away.min() < BOUNDARY_NODE_REACH * mesh.length:
        return corners[[away.argmin()]]
    curve, _, distance = nearest_on_curves(mesh.curves, *place.tolist())
    local = mesh.length * local_field(mesh.surface, place)
    on_line = (net.kind == ON_CURVE) & (net.is_open == 0)
    near = (net.kind == ON_CURVE) & (~on_line | (net.curve == curve))
    if curve >= 0 and distance <= BOUNDARY_NODE_REACH * local and np.any(free & near):
        free &= near
    else:
        free &= ~on_line  # a line may not be bent farther than that
    nodes = np.flatnonzero(free)
    order = np.argsort(((net.nodes[nodes] - place) ** 2).sum(axis=1), kind="stable")
    return nodes[order]


def _node_at(mesh: WorkingMesh, place: np.ndarray) -> int:
    """Node that is already at a place, -1 if there is none."""
    net = mesh.net
    squares = np.where(net.degree > 0, ((net.nodes - place) ** 2).sum(axis=1), np.inf)
    v = int(squares.argmin())
    return v if squares[v] <= (SAME_PLACE * mesh.length) ** 2 else -1


def _put_node(mesh: WorkingMesh, v: int, place: np.ndarray) -> None:
    """Move a node to a fixed position, where it stays at rest."""
    net = mesh.net
    if net.kind[v] == ON_CURVE:
        net.curve[v], net.arc[v], _ = nearest_on_curves(mesh.curves, *place.tolist())
    net.nodes[v] = place
    net.kind[v] = AT_REST
    mesh.fixed[v] = True


def fix_nearest_nodes(mesh: WorkingMesh, positions: np.ndarray) -> None:
    """Move the nearest node to each position, as the paper does (Sec. 4.2); the rest is left to the smoothing."""
    for place in positions:
        v = _node_at(mesh, place)
        nodes = _candidates(mesh, place)
        if v < 0 and len(nodes):
            v = int(nodes[0])
        if v < 0:
            raise _no_node(place)
        _put_node(mesh, v, place)


def _no_node(place: np.ndarray) -> InputError:
    return InputError(f"the grid has no node that could be moved to {place_text(place)}; use a smaller length")


def hold_nodes(mesh: WorkingMesh, positions: np.ndarray) -> None:
    """Keep nodes at rest that are already at fixed positions because the front has used them."""
    for place in positions:
        if (v := _node_at(mesh, place)) >= 0:
            _put_node(mesh, v, place)


def fix_nodes(mesh: WorkingMesh, positions: np.ndarray) -> None:
    """Make a node at each position in the way that disturbs the grid least.

    Moving one of the nearest nodes and splitting one of the nearest edges are tried in turn; after each, the grid around is settled and
    searched, and the result of least energy is kept.
    """
    if not len(positions):
        return
    scratch = new_scratch(mesh)
    scratch.tried[:] = 1
    for place in positions:
        if (v := _node_at(mesh, place)) >= 0:
            _put_node(mesh, v, place)
            continue
        start, best, least = mesh.copied(), None, np.inf
        for way in ways_to_place(mesh, place):
            mesh.restore(start)
            take_place(mesh, scratch, way, place)
            energy = energy_of_grid(mesh, scratch)
            if energy < least:
                best, least = mesh.copied(), energy
        if best is None:
            raise _no_node(place)
        mesh.restore(best)


def ways_to_place(mesh: WorkingMesh, place: np.ndarray) -> list[tuple[int, int]]:
    """Return ways to a node at a place: (node, -1) to be moved, (a, b) an edge to be split."""
    net = mesh.net
    nodes = _candidates(mesh, place)[:NEAREST_TRIED].tolist()
    edges = []
    for a in nodes:
        for b in net.ring[a, : net.degree[a]].tolist():
            if may_split(net, a, b) and (b, a) not in edges:
                edges.append((a, b))
    on_boundary = [net.kind[v] == ON_CURVE for v in nodes[:1]]
    if on_boundary == [True]:
        edges = [(a, b) for a, b in edges if net.curve[a] >= 0 and net.curve[a] == net.curve[b]]
    middle = [((0.5 * (net.nodes[a] + net.nodes[b]) - place) ** 2).sum() for a, b in edges]
    order = np.argsort(middle, kind="stable")[:NEAREST_TRIED]
    return [(v, -1) for v in nodes] + [edges[i] for i in order]


def take_place(
    mesh: WorkingMesh, scratch: Scratch, way: tuple[int, int], place: np.ndarray, *, around: bool = False
) -> None:
    """Make a node at a place in one way, and improve the grid; `around`: only the nodes around it settle."""
    net = mesh.net
    v, b = way
    if b >= 0:
        a, v = v, split(net, v, b)
        mesh.patches[v] = mesh.patches[a]
        mesh.patches[v].sample = nearest_sample(mesh.surface, *place.tolist())
        net.ideal[v] = 4 if net.is_open[v] else 6
    _put_node(mesh, v, place)
    scratch.tried[nodes_around(net, v, RINGS_SEARCHED)] = 0
    for _ in range(3):
        mesh.renew(FARTHEST_ON_THE_WAY)
        settle(
            mesh,
            mesh.length_weight,
            1e-3,
            6,
            independent_sets=[nodes_around(net, v, RINGS_SETTLED)] if around else None,
        )
        if search_once(mesh, scratch) == 0:
            break


def nodes_around(net: Net, v: int, rings: int) -> np.ndarray:
    """Return the nodes within some members of a node, (K,) int64."""
    near, marked = np.array([v]), np.zeros(len(net.degree), np.bool_)
    marked[v] = True
    for _ in range(rings):
        around = net.ring[near]
        marked[around[np.arange(around.shape[1]) < net.degree[near, None]]] = True
        near = np.flatnonzero(marked)
    return near
