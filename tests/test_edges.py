"""Surfaces with edges: the front ends on all of them, because its segments are closed loops from the start on."""

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as strategies
from marks import compiled_only
from small_clouds import HandFront, sheet
from steps import steps_of
from typed import known

import scantruss as st
from scantruss.constraints.embedded_lines import add_half_edges, check_links, link_around
from scantruss.errors import FrontError
from scantruss.front.start import new_front, start_front
from scantruss.kernels.front import advance as kernels
from scantruss.kernels.front import front as lists
from scantruss.kernels.front import gaps
from scantruss.kernels.front.front import Front
from scantruss.kernels.surface.local_surface import Surface
from scantruss.surface.samples import SurfaceSamples


def groin_vault(rise: float, noise: float = 0.02, half: float = 36.0, count: int = 25_000, seed: int = 0) -> np.ndarray:
    """Two barrels that cross over a square: creases along both diagonals."""
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(-half, half, (2, count))
    radius = (half**2 + rise**2) / (2 * rise)
    z = np.maximum(np.sqrt(radius**2 - x**2), np.sqrt(radius**2 - y**2)) - radius + rise
    return np.column_stack([x, y, z]) + noise * rng.normal(size=(count, 3))


def folded(
    step: float, height: float, saw: float = 0.5, noise: float = 0.05, count: int = 20_000, seed: int = 0
) -> np.ndarray:
    """A plate of parallel folds; with saw near 0 or 1 a sawtooth roof."""
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(0, 60, count), rng.uniform(0, 40, count)
    part = (x / step) % 1.0
    z = height * np.where(part < saw, part / saw, (1 - part) / (1 - saw))
    return np.column_stack([x, y, z]) + noise * rng.normal(size=(count, 3))


SURFACES: dict[str, tuple[Callable[[], np.ndarray], float]] = {
    "groin vault 30": (lambda: groin_vault(30.0), 5.0),
    "groin vault 36": (lambda: groin_vault(36.0), 6.0),
    "groin vault 20": (lambda: groin_vault(20.0), 4.0),
    "folded plate": (lambda: folded(15.0, 6.0), 3.0),
    "sawtooth roof": (lambda: folded(20.0, 10.0, saw=0.85), 4.0),
}


def initial_front(name: str) -> tuple[Front, SurfaceSamples, st.Settings]:
    points, length = SURFACES[name]
    settings = st.Settings(length=length)
    samples, boundary, constraints = steps_of(st.PointCloud.from_array(points()), settings)
    return (
        start_front(new_front(samples, settings), samples, boundary, constraints, settings),
        samples,
        settings,
    )


def assert_closed_loops(front: Front) -> None:
    """Each segment is followed by one that begins where it ends, and no two by the same; each is listed at its tail."""
    count = int(front.counts.segments)
    live = np.flatnonzero(front.state[:count] != lists.GONE)
    following = front.next[live]
    assert sorted(following.tolist()) == live.tolist()
    assert (front.previous[following] == live).all()
    assert (front.tail[following] == front.head[live]).all()
    for s in live.tolist():
        at = front.out[front.tail[s]]
        while at != s:
            at = front.out_next[at]


@pytest.mark.parametrize("name", SURFACES)
def test_the_segments_of_an_initial_front_are_closed_loops(name: str) -> None:
    front, _, _ = initial_front(name)
    assert_closed_loops(front)
    check_links(front, np.zeros(3))


def test_an_initial_front_that_is_not_closed_is_refused() -> None:
    front, _, _ = initial_front("folded plate")
    lists.link(front, 0, int(front.next[int(front.next[0])]))
    with pytest.raises(FrontError, match="two lines meet"):
        check_links(front, np.zeros(3))


def test_each_gap_that_is_closed_or_cut_out_leaves_fewer_segments_in_closed_loops() -> None:
    """The whole number that falls until nothing is left."""
    front, _, settings = initial_front("groin vault 30")
    loop, left = np.empty(int(front.counts.segments) + 1, np.int64), np.inf
    while len(live := np.flatnonzero(front.state[: front.counts.segments] != lists.GONE)):
        assert len(live) < left
        left = len(live)
        count = gaps.gap_loop(front, int(live[0]), loop)
        assert count >= 1
        if left % 2 or not gaps.close_gap(front, loop[:count].copy(), count, settings.length):
            gaps.cut_out(front, loop[:count].copy())
        assert_closed_loops(front)


@compiled_only
@pytest.mark.parametrize("effort", ["quick", "normal"])
@pytest.mark.parametrize("name", SURFACES)
def test_a_grid_comes_of_it_or_a_clear_refusal(name: str, effort: str) -> None:
    points, length = SURFACES[name]
    try:
        grid = st.grid_from_points(points(), st.Settings(length=length, effort=effort))
    except FrontError as error:
        assert "the grid" in str(error)
    else:
        assert known(grid.certificate).passed


@compiled_only
@pytest.mark.parametrize("name", SURFACES)
def test_the_segments_are_closed_loops_from_the_start_to_the_last_gap(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """After each slice of the front, and before each gap, of which each leaves fewer segments."""
    points, length = SURFACES[name]
    settings = st.Settings(length=length)
    steps = steps_of(st.PointCloud.from_array(points()), settings)
    advance, find, left = kernels.advance, gaps.gap_loop, []

    def look_after_a_slice(surface: Surface, front: Front, *others: Any) -> int:
        status = advance(surface, front, *others)
        assert_closed_loops(front)
        return status

    def look_before_a_gap(front: Front, *others: Any) -> int:
        assert_closed_loops(front)
        left.append(int((front.state[: front.counts.segments] != lists.GONE).sum()))
        return find(front, *others)

    monkeypatch.setattr(kernels, "advance", look_after_a_slice)
    monkeypatch.setattr(gaps, "gap_loop", look_before_a_gap)
    try:
        st.advance_front(*steps, settings)
    except FrontError as error:
        assert "a line could not be kept" in str(error)
    assert left == sorted(set(left), reverse=True)


PLATE = sheet(8.0, 8.0, 0.25)


def add_lines_from(front: Front, node: int, places: Iterable[int]) -> None:
    """Add lines of one member each from a node to new nodes, these linked, the node not yet."""
    for far in places:
        add_half_edges(front, [node, far])
        link_around(front, far)


@given(strategies.lists(strategies.integers(0, 23), min_size=1, max_size=6), strategies.booleans())
def test_lines_in_any_directions_leave_closed_loops(turns: list[int], on_boundary: bool) -> None:
    """Lines from one node: several in one direction, some of them across the boundary."""
    hand = HandFront([(0.0, 0.0), (3.0, 0.0), (3.0, 3.0), (0.0, 3.0)], points=PLATE)
    x, y = (0.0, 0.0) if on_boundary else (1.5, 1.5)
    node = 0 if on_boundary else hand.add_node(x, y)
    reach, angle = 0.5 + 0.1 * np.arange(len(turns)), np.pi / 12 * np.array(turns)
    add_lines_from(
        hand.front,
        node,
        [hand.add_node(x + r * np.cos(a), y + r * np.sin(a)) for r, a in zip(reach, angle, strict=True)],
    )
    link_around(hand.front, node)
    assert_closed_loops(hand.front)
    check_links(hand.front, np.zeros(3))


@given(strategies.lists(strategies.integers(1, 11), min_size=1, max_size=5, unique=True))
def test_the_rim_goes_out_and_back_along_each_line_in_the_order_in_which_they_stand(turns: list[int]) -> None:
    """What comes along the boundary turns into the line that is nearest, back from it into the next, and goes on along the boundary."""
    hand = HandFront([(0.0, 0.0), (3.0, 0.0), (3.0, 3.0), (-3.0, 0.0)], points=PLATE)
    front, rim = hand.front, hand.segments[0]
    ends = {turn: hand.add_node(np.cos(turn * np.pi / 12), np.sin(turn * np.pi / 12)) for turn in turns}
    add_lines_from(front, 0, ends.values())
    link_around(front, 0)
    met, s = [], rim[-1]
    for _ in turns:
        s = front.next[s]
        met.append(int(front.head[s]))
        s = front.next[s]
    assert met == [ends[turn] for turn in sorted(turns, reverse=True)] and front.next[s] == rim[0]
