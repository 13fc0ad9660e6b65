"""The net of rings and its three moves: the topology of a grid never changes."""

from collections import Counter
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some
from rough import Rough, rough_disc, rough_sphere, same_topology, strip_of
from small_grids import dome, fan, icosahedron, make_grid, two_pieces

from scantruss import Grid
from scantruss.improve.working_mesh import close_net, join_again, open_net
from scantruss.kernels.mesh import grid as kernels
from scantruss.kernels.mesh.grid import Net

CORNERS = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0.2), (2, 1, 0), (3, 0, 1)]
SOUND: dict[str, Callable[[], Grid]] = {
    "fan": fan,
    "icosahedron": icosahedron,
    "dome": lambda: dome(6),
    "ring": lambda: strip_of(9),
}
BROKEN: dict[str, Callable[[], Grid]] = {
    "pinched": lambda: make_grid(CORNERS, [(0, 1, 2), (2, 3, 4)]),
    "three at an edge": lambda: make_grid(CORNERS, [(0, 1, 2), (1, 0, 3), (0, 1, 4)]),
    "moebius": lambda: strip_of(9, 1),
    "one turned over": lambda: make_grid(
        fan().nodes, [t if k else t[::-1] for k, t in enumerate(fan().triangles.tolist())]
    ),
    "two cones": lambda: make_grid(
        [(0, 0, 0), (1, 0, 1), (-1, 1, 1), (-1, -1, 1), (1, 0, -1), (-1, 1, -1), (-1, -1, -1)],
        [(0, 1, 2), (0, 2, 3), (0, 3, 1), (0, 5, 4), (0, 6, 5), (0, 4, 6)],
    ),
}


def facing(grid: Grid) -> Counter[tuple[int, ...]]:
    """Triangles, each from its smallest node on."""
    return Counter(tuple(np.roll(t, -int(np.argmin(t))).tolist()) for t in grid.triangles)


def test_edges_and_their_triangles() -> None:
    grid = fan()
    assert grid.edges.tolist() == sorted(grid.edges.tolist()) and len(grid.edges) == 12
    for (a, b), (one, other) in zip(grid.edges.tolist(), grid.edge_triangles.tolist(), strict=True):
        at = {t for t, triangle in enumerate(grid.triangles.tolist()) if a in triangle and b in triangle}
        assert {one, other} - {-1} == at and (other == -1) == (len(at) == 1)
    assert grid.edge_uses.tolist() == [2 if other >= 0 else 1 for other in grid.edge_triangles[:, 1]]


OF_TRIANGLES = "edges", "edge_uses", "edge_triangles", "boundary_loops", "topology"


@pytest.mark.parametrize("name", [*SOUND, *BROKEN])
def test_what_follows_from_the_triangles_alone_goes_along_with_them(name: str) -> None:
    grid = (SOUND | BROKEN)[name]()
    before = [getattr(grid, each) for each in OF_TRIANGLES]
    moved = grid.replace(nodes=grid.nodes + grid.nodes[::-1] ** 2)
    assert all(getattr(moved, each) is known for each, known in zip(OF_TRIANGLES, before, strict=True))
    afresh = make_grid(moved.nodes, moved.triangles).replace(unit=grid.unit)
    assert (moved.lengths == afresh.lengths).all() and moved.quality == afresh.quality
    fewer, more = grid.replace(triangles=grid.triangles[1:]), grid.replace(nodes=np.append(grid.nodes, [[9, 9, 9]], 0))
    for other in (fewer, more):
        assert other.topology == make_grid(other.nodes, other.triangles).topology
        assert other.edge_uses.sum() == 3 * len(other.triangles)


def test_boundary_loops_run_with_their_triangles() -> None:
    (loop,) = fan().boundary_loops
    assert sorted(loop.tolist()) == [1, 2, 3, 4, 5, 6]
    assert all((b - a) % 6 == 1 for a, b in zip(loop, np.roll(loop, -1), strict=True))
    assert [len(loop) for loop in strip_of(9).boundary_loops] == [9, 9]
    assert icosahedron().boundary_loops == []


@pytest.mark.parametrize("name", [*SOUND, *BROKEN])
def test_a_net_closes_to_the_grid_it_was_opened_from(name: str) -> None:
    grid = (SOUND | BROKEN)[name]()
    net, source = open_net(grid)
    back = close_net(net, source, grid)
    used = np.unique(grid.triangles)
    assert np.array_equal(back.nodes, grid.nodes[used])
    assert facing(back.replace(triangles=used[back.triangles])) == facing(grid)


@pytest.mark.parametrize("name", [*SOUND, *BROKEN])
def test_a_net_that_was_closed_before_its_nodes_came_to_rest_is_the_same_grid(name: str) -> None:
    grid = (SOUND | BROKEN)[name]()
    net, source = open_net(grid)
    closed, kept = join_again(net, source, grid)
    net.nodes[:] = np.random.default_rng(0).normal(size=net.nodes.shape)
    later, at_once = closed.replace(nodes=net.nodes[kept]), close_net(net, source, grid)
    assert later.nodes.tobytes() == at_once.nodes.tobytes()
    assert later.triangles.tobytes() == at_once.triangles.tobytes()


def test_nodes_without_a_triangle_are_dropped() -> None:
    grid = two_pieces(fixed=(1, 12))
    back = close_net(*open_net(grid), grid)
    assert len(back.nodes) == len(grid.nodes) - 1
    assert np.flatnonzero(back.fixed).tolist() == [1, 12]


@pytest.mark.parametrize("name", sorted(BROKEN))
def test_nothing_changes_at_a_defect(name: str) -> None:
    grid = BROKEN[name]()
    net, source = open_net(grid)
    locked = source[: net.used][net.kind[: net.used] == kernels.LOCKED]
    assert len(locked) > 0
    for v in range(net.used):
        for u in net.ring[v, : net.degree[v]].tolist():
            touched = {v, u} | {w for w in kernels.wings(net, v, u) if w >= 0}
            if any(net.kind[w] == kernels.LOCKED for w in touched):
                assert not kernels.may_flip(net, v, u)
                assert not kernels.may_collapse(net, v, u)
                assert not kernels.may_split(net, v, u)


def slid(net: Net) -> Net:
    """Every boundary node on one curve, all free to move: the moves of the boundary become possible."""
    net.kind[:] = net.is_open
    net.curve[:] = np.where(net.is_open == 1, 0, -1)
    return net


@settings(max_examples=60)
@given(
    some.sampled_from(sorted(SOUND)),
    some.lists(some.tuples(some.integers(0, 2), some.integers(0, 999), some.integers(0, 99)), max_size=25),
)
def test_no_sequence_of_moves_changes_the_topology(name: str, moves: list[tuple[int, int, int]]) -> None:
    grid = SOUND[name]()
    net, source = open_net(grid)
    slid(net)
    before = net.degree.copy()
    for move, v, i in moves:
        v %= net.used
        if net.degree[v] == 0:
            continue
        u = int(net.ring[v, i % net.degree[v]])
        if move == 0 and kernels.may_flip(net, v, u):
            kernels.flip(net, v, u)
        elif move == 1 and kernels.may_collapse(net, v, u):
            kernels.collapse(net, v, u)
        elif move == 2 and kernels.may_split(net, v, u):
            m = kernels.split(net, v, u)
            net.nodes[m] = 0.5 * (net.nodes[v] + net.nodes[u])
    after = close_net(net, source, grid)
    assert same_topology(grid, after)
    interior = (net.degree > 0) & (net.is_open == 0)
    assert (net.degree[interior] >= np.minimum(before[interior], 4)).all()
    assert all(len(loop) >= 3 for loop in after.boundary_loops)


@pytest.mark.parametrize("make", [rough_disc, rough_sphere])
def test_a_move_and_its_opposite_leave_the_grid_as_it_was(make: Callable[..., Rough]) -> None:
    grid = make(points=500).grid
    net, source = open_net(grid)
    slid(net)
    pairs = [(v, u) for v in range(0, len(grid.nodes), 7) for u in net.ring[v, : net.degree[v]].tolist()]
    for v, u in pairs:
        if kernels.may_flip(net, v, u):
            right, left = kernels.wings(net, v, u)
            kernels.flip(net, v, u)
            assert kernels.place_in_ring(net, v, u) < 0 and kernels.place_in_ring(net, right, left) >= 0
            kernels.flip(net, right, left)
        if kernels.may_split(net, v, u):
            m = kernels.split(net, v, u)
            net.nodes[m] = net.nodes[v]
            kernels.collapse(net, v, m)
    assert facing(close_net(net, source, grid)) == facing(grid)


def test_corners_and_fixed_nodes_are_never_drawn_in() -> None:
    grid = dome(5, fixed=(12,))
    net, _ = open_net(grid)
    assert not any(
        kernels.may_collapse(net, u, v)
        for v in np.flatnonzero(net.kind == kernels.AT_REST).tolist()
        for u in net.ring[v, : net.degree[v]].tolist()
    )
