"""The advancing front leaves a right grid behind: manifold, of the right topology, facing outwards, from boundary to boundary."""

from collections.abc import Callable, Iterable
from functools import cache
from typing import Any, Never

import naive
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as strategies
from marks import compiled_only
from small_clouds import HandFront, ball, cap, ring, sheet, tire, turn_of
from steps import boundary_of, front_of, steps_of

import scantruss as st
from scantruss.boundary.find import characteristic_points
from scantruss.front import advance as driver
from scantruss.front import start
from scantruss.front.orientation_field import FieldStart
from scantruss.kernels.front import front as lists
from scantruss.kernels.front import gaps
from scantruss.kernels.front.cases import choose_by_case
from scantruss.kernels.front.fits import near_nodes
from scantruss.kernels.front.front import Front
from scantruss.kernels.geometry.boxes import new_boxes
from scantruss.kernels.geometry.triangles import shape_quality
from scantruss.surface.samples import SurfaceSamples

METHODS = ("default", "paper")


def advanced(points: np.ndarray, length: float = 1.0, **others: Any) -> tuple[st.Grid, st.Boundary]:
    """Grid and boundary of points; the nodes of the grid relative to its origin."""
    cloud, own = st.PointCloud.from_array(points), st.Settings(length=length, **others)
    return front_of(cloud, own, FieldStart() if own.method == "default" else None), boundary_of(cloud, own)


def jittered(points: np.ndarray, amount: float = 0.02, seed: int = 7) -> np.ndarray:
    """No two distances alike, so that rounding decides nothing."""
    return points + amount * np.random.default_rng(seed).uniform(-1, 1, points.shape)


CLOUDS: dict[str, tuple[Callable[[], np.ndarray], int, int, int]] = {  # points, components, loops, Euler number
    "plate": (lambda: sheet(9, 7, 0.2), 1, 1, 1),
    "annulus": (lambda: ring(2.0, 6.0, 0.2), 1, 2, 0),
    "dome": (lambda: cap(5.0, 1.2, 0.2), 1, 1, 1),
    "ball": (lambda: ball(4.0, 6000, noise=0.01), 1, 0, 2),
    "torus": (lambda: tire(5.0, 2.0, 0.2), 1, 0, 0),
    "pieces": (lambda: np.concatenate([sheet(6, 5, 0.2), ring(1.5, 4.0, 0.2) + np.array([9.0, 0, 2.0])]), 2, 3, 1),
    "ball and plate": (lambda: np.concatenate([ball(2.5, 3000), sheet(6, 5, 0.2) + np.array([9.0, 0, 0])]), 2, 1, 3),
}


@cache
def example(name: str, method: str) -> tuple[st.Grid, st.Boundary, np.ndarray]:
    """Grid, boundary and cloud of one of the clouds."""
    points = CLOUDS[name][0]()
    return *advanced(points, method=method), points


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", CLOUDS)
def test_the_grid_is_manifold_and_its_topology_that_of_the_cloud(name: str, method: str) -> None:
    grid, _, _ = example(name, method)
    assert naive.faults(grid.triangles) == []
    assert naive.topology(grid.triangles) == CLOUDS[name][1:]
    assert set(grid.triangles.ravel().tolist()) == set(range(len(grid.nodes)))


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("tube", [0.55, 0.7])
def test_a_thin_tube_stays_open(tube: float, method: str) -> None:
    """Three or four members round: what faces a triangle from across the tube does not stop it."""
    grid, _ = advanced(tire(5.0, tube, 0.15), method=method)
    assert naive.faults(grid.triangles) == []
    assert naive.topology(grid.triangles) == (1, 0, 0)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", CLOUDS)
def test_the_whole_cloud_is_covered_once(name: str, method: str) -> None:
    """No point is farther from the nearest node than 1.2 members, and the areas of the triangles add up to that of the cloud."""
    grid, _, points = example(name, method)
    area = {"plate": 63.0, "annulus": 32 * np.pi, "dome": 50 * np.pi * (1 - np.cos(1.2)), "ball": 64 * np.pi,
            "torus": 40 * np.pi**2, "pieces": 30 + 13.75 * np.pi, "ball and plate": 25 * np.pi + 30}  # fmt: skip
    a, b, c = (grid.nodes[grid.triangles[:, k]] for k in range(3))
    assert np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2 == pytest.approx(area[name], rel=0.05)
    for p in points[:: len(points) // 300]:
        assert np.linalg.norm(grid.nodes + grid.origin - p, axis=1).min() < 1.2


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", CLOUDS)
def test_triangles_are_anticlockwise_seen_from_outside(name: str, method: str) -> None:
    grid, _, _ = example(name, method)
    a, b, c = (grid.nodes[grid.triangles[:, k]] + grid.origin for k in range(3))
    face, middle = np.cross(b - a, c - a), (a + b + c) / 3
    if name in ("ball", "dome"):
        out = middle
    elif name == "torus":
        around = middle * [1, 1, 0]
        out = middle - 5.0 * around / np.linalg.norm(around, axis=1)[:, None]
    else:  # plates face upwards
        out = (
            np.where(np.linalg.norm(middle, axis=1)[:, None] < 3.5, middle, [0, 0, 1]) if "ball" in name else [0, 0, 1]
        )
    assert ((face * out).sum(axis=1) > 0).all()


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", CLOUDS)
def test_every_boundary_segment_is_an_edge_with_one_triangle(name: str, method: str) -> None:
    """And nothing else is open: the boundary of the grid is the divided boundary."""
    grid, boundary, _ = example(name, method)
    edges = naive.directed_edges(grid.triangles)
    rim = {e for e in edges if (e[1], e[0]) not in edges}
    expected = set()
    for loop in boundary.loops:
        nodes, _ = characteristic_points(loop, 1.0)
        ids = [int(((grid.nodes - place) ** 2).sum(axis=1).argmin()) for place in nodes]
        assert grid.nodes[ids] == pytest.approx(nodes, abs=1e-9)
        expected |= set(zip(ids, ids[1:] + ids[:1], strict=True))
    assert rim == expected


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", CLOUDS)
def test_members_are_about_as_long_as_desired(name: str, method: str) -> None:
    grid, _, _ = example(name, method)
    assert grid.lengths.mean() == pytest.approx(1.0, abs=0.15)
    assert grid.lengths.max() < 2.5
    assert grid.quality.shape_mean > 0.88


@pytest.mark.kernels
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    "points", [sheet(4, 3, 0.25), ring(1.2, 3.0, 0.25), ball(1.5, 450)], ids=["plate", "ring", "ball"]
)
def test_small_clouds(points: np.ndarray, method: str) -> None:
    grid, boundary = advanced(points, method=method)
    assert naive.faults(grid.triangles) == []
    loops = len(boundary.loops)
    assert naive.topology(grid.triangles) == (1, loops, 2 - loops)


@pytest.mark.kernels
@pytest.mark.parametrize("method", METHODS)
def test_same_cloud_same_bytes(method: str) -> None:
    a, b = (advanced(sheet(4, 3, 0.25), method=method)[0] for _ in range(2))
    assert a.nodes.tobytes() == b.nodes.tobytes() and a.triangles.tobytes() == b.triangles.tobytes()


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("budget", [1, 7, 1_000_000])
def test_the_step_budget_makes_no_difference(budget: int, method: str, monkeypatch: pytest.MonkeyPatch) -> None:
    grid, _, points = example("annulus", method)
    monkeypatch.setattr(driver, "SEGMENTS_PER_REPORT", budget)
    again, _ = advanced(points, method=method)
    assert again.nodes.tobytes() == grid.nodes.tobytes() and again.triangles.tobytes() == grid.triangles.tobytes()


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", ["annulus", "ball", "torus", "pieces"])
def test_the_growth_of_the_arrays_makes_no_difference(name: str, method: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A front with hardly more room than its boundary needs grows on the way."""
    grid, boundary, points = example(name, method)
    need = 6 + sum(len(characteristic_points(loop, 1.0)[0]) for loop in boundary.loops)
    large, grow, grown = start.new_front, start.grown, []

    def small(samples: SurfaceSamples, own: st.Settings) -> lists.Front:
        front = large(samples, own)
        room = len(front.nodes)
        arrays = [a[: len(a) * need // room].copy() for a in front[:-3]]
        mean = samples.surface.mean
        boxes = new_boxes(mean.min(axis=0), mean.max(axis=0), own.length, need, need)
        return lists.Front._make([*arrays, front.counts, front.sharp_edges, boxes])

    def count(front: Front) -> lists.Front:
        grown.append(len(front.nodes))
        return grow(front)

    monkeypatch.setattr(driver, "new_front", small)
    for module in (start, driver):  # room for the initial front, then on the way
        monkeypatch.setattr(module, "grown", count)
    again, _ = advanced(points, method=method)
    assert grown
    assert again.nodes.tobytes() == grid.nodes.tobytes() and again.triangles.tobytes() == grid.triangles.tobytes()


@pytest.mark.kernels
def test_a_grown_front_keeps_what_it_holds() -> None:
    """Nodes that were merged away do not come back into the boxes."""
    places = [(0, 0), (1, 0), (0.8, 0.95), (3.2, 1), (3.2, 2.6), (0.5, 3.2), (-2.2, 2.6), (-2.2, 1), (0.2, 0.95)]
    hand = HandFront(places, inner=(2, 8), method="paper")
    assert choose_by_case(hand.surface, hand.front, 0, hand.rules, hand.found, hand.patch)
    larger = start.grown(hand.front)
    assert len(larger.nodes) > len(hand.front.nodes) and len(larger.tail) > len(hand.front.tail)
    for s in range(1, 9):
        if hand.front.state[s] != lists.GONE:
            before = sorted(hand.found[: hand.near(s)].tolist())
            count = near_nodes(hand.surface, larger, s, 2.4, 1.0, hand.found)
            assert sorted(hand.found[:count].tolist()) == before


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", ["dome", "torus"])
def test_a_turned_shifted_scaled_cloud_has_the_same_grid(name: str, method: str) -> None:
    """The same triangles, and nodes that differ by rounding (a millionth of a member).

    This holds where no two distances of the cloud are alike, so that rounding decides nothing, and where the outside is
    told by the shape: a flat plate turns its upper side upwards, whichever it is. Twice as large is the same to the bit.
    """
    points = jittered(CLOUDS[name][0]())
    grid, _ = advanced(points, method=method)
    for turn, shift, scale in (
        (np.eye(3), np.array([812.3, -41.7, 5.5]), 1.0),
        (turn_of(1), np.zeros(3), 1.0),
        (turn_of(2), np.array([30.0, 20.0, 10.0]), 0.37),
    ):
        moved, _ = advanced((points @ turn.T + shift) * scale, scale, method=method)
        assert moved.triangles.tolist() == grid.triangles.tolist()
        back = ((moved.nodes + moved.origin) / scale - shift) @ turn
        assert back == pytest.approx(grid.nodes + grid.origin, abs=1e-6)
    double, _ = advanced(2.0 * points, 2.0, method=method)
    assert double.triangles.tobytes() == grid.triangles.tobytes()
    assert double.nodes.tobytes() == (2.0 * grid.nodes).tobytes()


# Rubbish


def rubbish(seed: int) -> np.ndarray:
    """A few hundred random points: a ball of chance, a thick or crumpled sheet, or several of them through each other."""
    rng = np.random.default_rng(seed)
    parts = []
    for _ in range(rng.integers(1, 4)):
        extent = np.array([4.0, rng.choice([1.0, 4.0]), rng.choice([0.0, 0.1, 0.5, 2.0])])
        points = extent * (rng.random((rng.integers(30, 200), 3)) - 0.5)
        points[:, 2] += rng.choice([0.0, 0.3, 1.0]) * np.sin(2 * points[:, 0])
        parts.append(points @ turn_of(int(rng.integers(100))).T + rng.normal(size=3))
    return np.concatenate(parts)


def assert_sound_or_refused(points: np.ndarray, length: float, method: str) -> None:
    """No edge has more than two triangles, none is used twice in one direction; nothing but our own errors is raised."""
    try:
        grid, _ = advanced(points, length, method=method)
    except st.ScanTrussError:
        return
    assert max(naive.directed_edges(grid.triangles).values(), default=1) == 1
    assert np.isfinite(grid.nodes).all()


@compiled_only
@settings(max_examples=150)
@given(strategies.integers(0, 1_000_000), strategies.sampled_from([0.4, 0.7, 1.2]), strategies.sampled_from(METHODS))
def test_rubbish_leaves_no_edge_with_three_triangles_or_is_refused(seed: int, length: float, method: str) -> None:
    assert_sound_or_refused(rubbish(seed), length, method)


@pytest.mark.kernels
@settings(max_examples=2)
@given(strategies.integers(0, 1_000_000), strategies.sampled_from(METHODS))
def test_rubbish_leaves_no_kernel_out_of_bounds(seed: int, method: str) -> None:
    assert_sound_or_refused(rubbish(seed), 0.7, method)


# Gaps


def polygon(count: int, seed: int) -> np.ndarray:
    """A wavy polygon, star-shaped and anticlockwise."""
    rng = np.random.default_rng(seed)
    turn = 2 * np.pi * (np.arange(count) + rng.uniform(-0.3, 0.3, count)) / count
    away = 0.35 * count / np.pi * rng.uniform(0.7, 1.3, count)
    return np.stack([away * np.cos(turn), away * np.sin(turn)], axis=1)


@cache
def plate_points() -> np.ndarray:
    return sheet(8, 8, 0.5)


def gap_of(hand: HandFront, s: int = 0) -> tuple[np.ndarray, int]:
    loop = np.empty(200, np.int64)
    return loop, gaps.gap_loop(hand.front, s, loop)


@pytest.mark.kernels
@settings(max_examples=30)
@given(strategies.integers(3, 12), strategies.integers(0, 1000))
def test_a_gap_is_filled_with_two_triangles_fewer_than_it_has_nodes(count: int, seed: int) -> None:
    hand = HandFront(polygon(count, seed), points=plate_points(), length=2.0)
    loop, found = gap_of(hand)
    assert found == count
    assert gaps.close_gap(hand.front, loop, found, 2.0) == count - 2
    triangles = hand.front.triangles[: count - 2]
    assert naive.faults(triangles) == []
    assert naive.topology(triangles) == (1, 1, 1)
    edges = naive.directed_edges(triangles)
    assert {e for e in edges if (e[1], e[0]) not in edges} == {(k, (k + 1) % count) for k in range(count)}
    assert not hand.alive


@pytest.mark.kernels
@settings(max_examples=20)
@given(strategies.integers(4, 8), strategies.integers(0, 1000))
def test_no_other_way_of_filling_a_gap_costs_less(count: int, seed: int) -> None:
    hand = HandFront(polygon(count, seed), points=plate_points(), length=2.0)

    def cost(way: Iterable[tuple[int, int, int]]) -> float:
        return sum(gaps.triangle_cost(hand.front, i, k, j, 2.0) for i, k, j in way)

    best = min(cost(way) for way in naive.triangulations(count))
    loop, found = gap_of(hand)
    gaps.close_gap(hand.front, loop, found, 2.0)
    assert cost(hand.front.triangles[: count - 2].tolist()) == pytest.approx(best)


@pytest.mark.kernels
def test_the_cost_of_a_triangle_grows_as_it_gets_worse() -> None:
    """Worse shape, a side of more than one and a half members, facing downwards."""
    hand = HandFront([(0, 0), (1, 0), (0.5, 0.866), (0.5, 0.2), (0, 3)], points=plate_points())
    best = gaps.triangle_cost(hand.front, 0, 1, 2, 1.0)
    assert best == pytest.approx(0, abs=1e-3)
    flat = 1 - shape_quality((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.5, 0.2, 0.0))
    assert gaps.triangle_cost(hand.front, 0, 1, 3, 1.0) == pytest.approx(flat)
    assert gaps.triangle_cost(hand.front, 0, 1, 4, 1.0) > 1.5
    assert gaps.triangle_cost(hand.front, 1, 0, 2, 1.0) == pytest.approx(best + 3.0)


@pytest.mark.kernels
def test_a_gap_never_repeats_an_edge() -> None:
    """The diagonal of this square is an edge of the grid already: the other diagonal is taken."""
    corners = [(0, 0), (2, 0), (2.2, 2.2), (0, 2)]
    free = HandFront(corners, points=plate_points(), length=2.0)
    loop, count = gap_of(free)
    gaps.close_gap(free.front, loop, count, 2.0)
    (taken,) = {(min(e), max(e)) for e in naive.directed_edges(free.front.triangles[:2])} & {(0, 2), (1, 3)}
    hand = HandFront(corners, points=plate_points(), length=2.0)
    lists.add_triangle(hand.front, *taken, hand.add_node(-3, -3))
    loop, count = gap_of(hand)
    assert gaps.close_gap(hand.front, loop, count, 2.0) == 2
    other = ({(0, 2), (1, 3)} - {taken}).pop()
    assert other in {tuple(sorted(e)) for e in naive.directed_edges(hand.front.triangles[1:3])}
    assert set(naive.directed_edges(hand.front.triangles[:3]).values()) == {1}


@pytest.mark.kernels
def test_triangles_at_the_nodes_of_a_gap_do_not_forbid_its_diagonals() -> None:
    corners = [(0, 0), (2, 0), (2.2, 2.2), (0, 2)]
    free, hand = (HandFront(corners, points=plate_points(), length=2.0) for _ in range(2))
    for n in range(4):
        lists.add_triangle(hand.front, n, hand.add_node(-3, -3 + n), hand.add_node(3, -3 + n))
    for each in (free, hand):
        loop, count = gap_of(each)
        assert gaps.close_gap(each.front, loop, count, 2.0) == 2
    assert set(hand.triangles[4:]) == set(free.triangles)


@pytest.mark.kernels
def test_every_edge_of_every_triangle_exists() -> None:
    """Of a fan around node 0 and of the front; nothing else does."""
    angles = np.arange(5) * 2 * np.pi / 5
    hand = HandFront([(-2, -2), (2, -2), (2, 2), (-2, 2)], points=plate_points(), length=2.0)
    ids = [hand.add_node(0, 0)] + [hand.add_node(np.cos(a), np.sin(a)) for a in angles]
    edges = {(0, 1), (1, 2), (2, 3), (0, 3)}
    for k in range(5):
        a, b, c = ids[0], ids[k + 1], ids[(k + 1) % 5 + 1]
        lists.add_triangle(hand.front, a, b, c)
        edges |= {(min(e), max(e)) for e in ((a, b), (b, c), (c, a))}
    for a in range(10):
        for b in range(10):
            if a != b:
                assert lists.edge_exists(hand.front, a, b) == (tuple(sorted((a, b))) in edges)


@pytest.mark.kernels
def test_a_gap_that_no_triangles_fit_stays_open() -> None:
    """Both diagonals are edges already."""
    hand = HandFront([(0, 0), (2, 0), (2, 2), (0, 2)], points=plate_points(), length=2.0)
    lists.add_triangle(hand.front, 0, 2, hand.add_node(-3, -3))
    lists.add_triangle(hand.front, 1, 3, hand.add_node(3, -3))
    loop, count = gap_of(hand)
    assert gaps.close_gap(hand.front, loop, count, 2.0) == 0
    assert len(hand.alive) == 4


@pytest.mark.kernels
def test_a_loop_that_meets_a_node_twice_is_taken_apart_there() -> None:
    """Two triangles that touch at node 2: the gap is the part between two visits of it."""
    hand = HandFront([(0, 0), (2, -1), (2, 1)], [(3, 0), (4, -1), (4, 1)], points=plate_points(), length=2.0)
    front, (a, b) = hand.front, hand.segments
    # join: ... 1 -> 2 -> 3 -> 4 -> 5 -> 2 -> 0: node 2 twice
    lists.remove_segment(front, b[2])
    there = lists.add_segment(front, 2, 3, lists.ACTIVE)
    back = lists.add_segment(front, 5, 2, lists.ACTIVE)
    for s, after in ((a[1], there), (there, b[0]), (b[1], back), (back, a[2])):
        lists.link(front, s, after)
    loop, count = gap_of(hand, int(a[0]))
    nodes = front.tail[loop[:count]].tolist()
    assert len(set(nodes)) == count == 4 and nodes[0] == 2
    assert gaps.close_gap(front, loop, count, 2.0) == 2
    loop, count = gap_of(hand, int(a[0]))
    assert sorted(front.tail[loop[:count]].tolist()) == [0, 1, 2]


class Cancelled(Exception):
    pass


def test_progress_is_reported_and_may_stop_the_front() -> None:
    said = []
    cloud, own = st.PointCloud.from_array(sheet(9, 7, 0.2)), st.Settings(length=1.0)
    steps = steps_of(cloud, own)
    st.advance_front(*steps, own, progress=lambda stage, share: said.append((stage, share)))
    assert {stage for stage, _ in said} == {"front"}
    assert all(0 <= share <= 1 for _, share in said)

    def stop(stage: str, share: float) -> Never:
        raise Cancelled

    with pytest.raises(Cancelled):
        st.advance_front(*steps, own, progress=stop)
