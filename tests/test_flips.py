"""Delaunay optimization: the smallest angle never falls, and in the end no flip is left that makes it larger."""

from collections.abc import Callable

import naive_grid as naive
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some
from rough import Rough, rough_disc, rough_sphere, same_topology
from scipy.spatial import Delaunay
from small_grids import dome, fan, flipped_edges, make_grid

from scantruss import Grid
from scantruss.improve.flips import LEAST_COSINE, flip_edges
from scantruss.improve.working_mesh import open_net
from scantruss.kernels.mesh import flips as kernels
from scantruss.kernels.mesh.grid import Net, flip, may_flip


def scrambled(grid: Grid, seed: int, count: int = 40) -> Grid:
    """The grid with random flips, none of which folds it."""
    from scantruss.improve.working_mesh import close_net

    net, source = open_net(grid)
    rng = np.random.default_rng(seed)
    for _ in range(count):
        v = int(rng.integers(len(grid.nodes)))
        u = int(net.ring[v, rng.integers(net.degree[v])])
        if may_flip(net, v, u) and kernels.gain_of_flip(net, v, u, 0.9) > -1:
            flip(net, v, u)
    return close_net(net, source, grid)


@pytest.mark.parametrize("make", [rough_disc, rough_sphere])
@pytest.mark.parametrize("seed", range(3))
def test_flips_end_where_none_pays(make: Callable[..., Rough], seed: int) -> None:
    grid = scrambled(make(seed=seed, points=500).grid, seed)
    flipped, count = flipped_edges(grid)
    assert count > 0
    assert same_topology(grid, flipped)
    assert np.array_equal(grid.nodes, flipped.nodes)
    smallest = [min(min(naive.angles(*g.nodes[t])) for t in g.triangles) for g in (grid, flipped)]
    assert smallest[1] >= smallest[0] - 1e-9
    around = naive.neighbors(flipped)
    on_boundary = {v for edge, third in naive.wings(flipped).items() if len(third) == 1 for v in edge}
    for a, b in naive.flips_that_pay(flipped):  # what is left is kept by a guard: an interior node keeps four members
        assert min(len(around[v]) for v in (a, b) if v not in on_boundary) <= 4 or {a, b} <= on_boundary


def flipped_one_by_one(net: Net) -> int:
    """Flip what pays, looking at all edges in each round; returns the flips."""
    count, before = 0, -1
    while count > before:
        before = count
        for v in range(net.used):
            i = 0
            while i < net.degree[v]:
                u = int(net.ring[v, i])
                i += 1
                if v < u and may_flip(net, v, u) and kernels.gain_of_flip(net, v, u, LEAST_COSINE) > 1e-9:
                    flip(net, v, u)
                    count += 1
    return count


@pytest.mark.kernels
@pytest.mark.parametrize("make", [rough_disc, rough_sphere])
@pytest.mark.parametrize("seed", range(4))
def test_edges_that_are_not_looked_at_again_would_not_have_been_flipped(make: Callable[..., Rough], seed: int) -> None:
    grid = scrambled(make(seed=seed, points=500).grid, seed, count=80)
    net, other = open_net(grid)[0], open_net(grid)[0]
    assert flip_edges(net) == flipped_one_by_one(other) > 0
    for one, two in zip(net, other, strict=True):
        assert one.tobytes() == two.tobytes()


def test_in_the_plane_the_flips_give_delaunay() -> None:
    rng = np.random.default_rng(3)
    grid = rough_disc(bulge=0.0, jitter=0.2, points=500).grid
    grid = grid.replace(nodes=grid.nodes + [0, 0, 1] * rng.uniform(-1e-9, 1e-9, (len(grid.nodes), 1)))
    flipped, _ = flipped_edges(scrambled(grid, 1))
    expected = {tuple(sorted(t)) for t in Delaunay(grid.nodes[:, :2]).simplices.tolist()}
    found = {tuple(sorted(t)) for t in flipped.triangles.tolist()}
    assert len(found - expected) <= 0.02 * len(found)


@given(some.lists(some.tuples(some.floats(-1, 1), some.floats(-1, 1), some.floats(-1, 1)), min_size=3, max_size=3))
def test_smallest_angle_agrees_with_its_twin(corners: list[tuple[float, float, float]]) -> None:
    a, b, c = (np.array(p) for p in corners)
    if min(np.linalg.norm(b - a), np.linalg.norm(c - b), np.linalg.norm(a - c)) < 1e-3:
        return
    found = np.degrees(kernels.smallest_angle(*(tuple(p.tolist()) for p in (a, b, c))))
    assert found == pytest.approx(min(naive.angles(a, b, c)), abs=1e-4)


@pytest.mark.parametrize("seed", range(2))
def test_the_gain_of_a_flip_agrees_with_its_twin(seed: int) -> None:
    grid = rough_disc(seed=seed, points=500).grid
    net, _ = open_net(grid)
    expected = naive.flips_that_pay(grid)
    for a, b in naive.wings(grid):
        if may_flip(net, a, b):
            gain = kernels.gain_of_flip(net, a, b, -1.0)
            assert (np.degrees(gain) > 1e-6) == ((a, b) in expected)
            if gain > 1e-6:
                assert np.degrees(gain) == pytest.approx(expected[a, b], abs=1e-6)


def test_a_flip_does_not_fold_the_grid() -> None:
    nodes = [(0, 0, 0), (1, 0, 0), (0.5, 0.3, 0.9), (0.5, 0.3, -0.9), (-1, 0, 0), (2, 0, 0)]
    grid = make_grid(nodes, [(0, 1, 2), (1, 0, 3), (0, 2, 4), (1, 5, 2), (0, 4, 3), (1, 3, 5)])
    net, _ = open_net(grid)
    assert kernels.gain_of_flip(net, 0, 1, 0.0) <= 0.0 or grid.topology == flipped_edges(grid)[0].topology


def test_good_and_empty_grids_stay() -> None:
    for grid in (fan(), dome(5)):
        flipped, _ = flipped_edges(grid)
        assert same_topology(grid, flipped)
    assert flipped_edges(fan())[1] == 0
    empty = make_grid([], [])
    assert flipped_edges(empty) == (empty, 0)
