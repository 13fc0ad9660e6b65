"""Triangles that cut each other: exact against a linear program, and found wherever they are in a grid."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some
from numpy.typing import ArrayLike
from rough import strip_of
from scipy.optimize import linprog
from small_grids import dome, fan, icosahedron, make_grid

from scantruss import Grid
from scantruss.check import crossings
from scantruss.check.crossings import find_crossings, triangles_meet
from scantruss.kernels.mesh import crossings as kernels

pytestmark = pytest.mark.kernels

whole = some.integers(-3, 3).map(float)
places = some.lists(some.tuples(whole, whole, whole), min_size=6, max_size=6, unique=True)
flat_places = some.lists(some.tuples(whole, whole, some.just(0.0)), min_size=6, max_size=6, unique=True)


def has_inside(nodes: np.ndarray, triangle: list[int]) -> bool:
    a, b, c = nodes[triangle]
    return bool(np.linalg.norm(np.cross(b - a, c - a)) > 0)


def common(nodes: np.ndarray, first: list[int], second: list[int]) -> float:
    """The largest weight that a common place of two triangles has on nodes they do not share; 0 where there is nothing else.

    Common places are those with nonnegative weights that sum up to one on either triangle: a linear program.
    """
    one = np.ones((1, 3))
    weights = np.block([[nodes[first].T, -nodes[second].T], [one, 0 * one], [0 * one, one]])
    goal = [-float(v not in second) for v in first] + [0.0] * 3
    found = linprog(goal, A_eq=weights, b_eq=[0, 0, 0, 1, 1], bounds=(0, None), method="highs")
    return -found.fun if found.status == 0 else 0.0


def agrees(places: ArrayLike, first: list[int], second: list[int]) -> None:
    """Exact and compiled answers agree with the linear program; the compiled one may be in doubt, but never wrong."""
    nodes = np.array(places)
    if not (has_inside(nodes, first) and has_inside(nodes, second)):
        return
    meet = common(nodes, first, second) > 1e-9 or sorted(first) == sorted(second)
    assert triangles_meet(nodes, first, second) == triangles_meet(nodes, second, first) == meet
    both = np.array([first, second])
    assert not (meet and kernels.proved_apart(nodes, both, 0, 1))
    assert len(find_crossings(nodes, both)) == meet


@settings(max_examples=60)
@given(places)
def test_two_triangles_without_a_common_node(nodes: list[tuple[float, float, float]]) -> None:
    agrees(nodes, [0, 1, 2], [3, 4, 5])


@settings(max_examples=40)
@given(flat_places)
def test_two_triangles_in_one_plane(nodes: list[tuple[float, float, float]]) -> None:
    agrees(nodes, [0, 1, 2], [3, 4, 5])
    agrees(nodes, [0, 1, 2], [3, 4, 0])
    agrees(nodes, [0, 1, 2], [3, 1, 0])


@settings(max_examples=40)
@given(places, some.permutations(range(3)), some.permutations(range(3)))
def test_two_triangles_with_common_nodes(
    nodes: list[tuple[float, float, float]], one: list[int], other: list[int]
) -> None:
    for second in ((0, 3, 4), (0, 1, 3)):
        agrees(nodes, [one[k] for k in range(3)], [second[k] for k in other])


def test_the_same_triangle_twice_is_no_grid() -> None:
    assert triangles_meet(np.eye(3), (0, 1, 2), (2, 1, 0))
    assert len(find_crossings(np.eye(3), np.array([(0, 1, 2), (2, 1, 0)]))) == 1


def jittered(grid: Grid, seed: int, share: float = 0.15) -> Grid:
    rng = np.random.default_rng(seed)
    return grid.replace(nodes=grid.nodes + share * 4.0 * rng.normal(size=grid.nodes.shape))


@settings(max_examples=5)
@given(some.integers(0, 10_000), some.sampled_from([0.0, 0.1, 0.3]))
def test_all_pairs_of_a_grid_are_looked_at(seed: int, share: float) -> None:
    """Search boxes leave out none that every pair would have."""
    grid = jittered(dome(5), seed, share)
    slow = {
        (t, u)
        for t, u in combinations(range(len(grid.triangles)), 2)
        if triangles_meet(grid.nodes, *grid.triangles[[t, u]])
    }
    assert {tuple(sorted(pair)) for pair in find_crossings(grid.nodes, grid.triangles).tolist()} == slow
    assert share > 0 or not slow


@pytest.mark.parametrize(
    "grid", [fan(), icosahedron(), dome(9), strip_of(9), dome(9, 1e-3), dome(9).replace(nodes=dome(9).nodes + 1e5)]
)
def test_right_grids_have_none_and_floats_are_enough_to_say_so(grid: Grid) -> None:
    assert len(find_crossings(grid.nodes, grid.triangles)) == 0
    assert len(crossings._doubtful(grid.nodes, grid.triangles)) == 0


def test_a_flat_grid_needs_no_fractions() -> None:
    flat = dome(12)
    flat.nodes[:, 2] = 0.0
    assert len(crossings._doubtful(flat.nodes, flat.triangles)) == 0
    flat.nodes[:, 2] = 0.3 * flat.nodes[:, 0] + 0.1 * flat.nodes[:, 1]
    assert len(crossings._doubtful(flat.nodes, flat.triangles)) == 0


def test_a_node_pushed_over_its_neighbours_is_found() -> None:
    grid = dome(8)
    grid.nodes[27] += 1.7 * (grid.nodes[28] - grid.nodes[27])
    found = find_crossings(grid.nodes, grid.triangles)
    assert len(found) and all(27 in grid.triangles[pair] for pair in found)


def test_a_touch_counts_and_the_last_bit_less_does_not() -> None:
    """A node exactly in another triangle, and one float above it: no tolerance decides."""
    nodes = [(0, 0, 0), (2, 0, 0), (0, 2, 0), (0.5, 0.5, 0), (0.5, 0.5, 1), (1, 1, 1)]
    grid = make_grid(nodes, [(0, 1, 2), (3, 4, 5)])
    assert len(find_crossings(grid.nodes, grid.triangles)) == 1
    grid.nodes[3, 2] = 5e-324
    assert len(find_crossings(grid.nodes, grid.triangles)) == 0


def test_a_neighbour_folded_flat_counts_and_one_degree_less_does_not() -> None:
    for angle, count in ((0.0, 1), (1e-9, 0), (1.0, 0), (90.0, 0), (180.0, 0)):
        turn = np.radians(angle)
        nodes = np.array([(0, 0, 0), (1, 0, 0), (0.5, 1, 0), (0.5, np.cos(turn), np.sin(turn))], float)
        assert len(find_crossings(nodes, np.array([(0, 1, 2), (1, 0, 3)]))) == count


def test_many_cuts_stop_the_count() -> None:
    rng = np.random.default_rng(0)
    nodes = rng.normal(size=(180, 3))
    assert len(find_crossings(nodes, np.arange(180).reshape(-1, 3))) == crossings.MOST_CROSSINGS


def test_more_pairs_than_there_is_room_for(monkeypatch: pytest.MonkeyPatch) -> None:
    grid = jittered(dome(7), 1, 0.5)
    many = find_crossings(grid.nodes, grid.triangles)
    monkeypatch.setattr(crossings, "ROOM_FOR_PAIRS", 1)
    assert len(many) > 3 and np.array_equal(find_crossings(grid.nodes, grid.triangles), many)


def test_a_triangle_with_a_node_twice_does_not_count() -> None:
    assert len(find_crossings(np.eye(3), np.array([(0, 0, 1), (0, 1, 2)]))) == 0
    assert len(find_crossings(np.zeros((0, 3)), np.zeros((0, 3), int))) == 0
