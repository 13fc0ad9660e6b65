"""Rows: a lattice of one length along a smooth direction field, which turns and moves with the scan."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as some
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation
from shapes import make
from small_clouds import ball, sheet
from steps import Steps, front_of, rows_of, steps_of
from typed import known

import scantruss as st
from scantruss.front import orientation_field as laying
from scantruss.front.orientation_field import FieldStart, lattice_start, make_levels, orientation_fields
from scantruss.kernels.front.candidate_nodes import CandidateNodes
from scantruss.kernels.surface import orientation_field as kernels
from scantruss.kernels.surface.orientation_field import Level
from scantruss.runtime import parallel

UP = (0.0, 0.0, 1.0)
angles = some.floats(0.0, 6.3)
places = some.tuples(some.floats(-5, 5), some.floats(-5, 5))


def scanned(points: np.ndarray, length: float) -> tuple[st.PointCloud, Steps]:
    """The cloud of some points, and the steps before the front."""
    cloud = st.PointCloud.from_array(points)
    return cloud, steps_of(cloud, st.Settings(length=length))


def direction(angle: float) -> tuple[float, float, float]:
    return np.cos(angle), np.sin(angle), 0.0


def lattice(node: ArrayLike, angle: float, length: float, reach: int = 8) -> np.ndarray:
    """All nodes around, by two loops."""
    u, v = (length * np.array(direction(a)) for a in (angle, angle + np.pi / 3))
    return np.array([np.add(node, i * u + j * v) for i in range(-reach, reach) for j in range(-reach, reach)])


@pytest.mark.kernels
@settings(max_examples=60, deadline=None)
@given(places, places, angles)
def test_the_nearest_node_is_that_of_a_search_through_all(
    node: tuple[float, float], place: tuple[float, float], angle: float
) -> None:
    start, wanted = (*node, 0.0), (*place, 0.0)
    found = kernels.nearest_node(start, direction(angle), UP, wanted, 2.0)
    every = lattice(start, angle, 2.0, 12)
    least = np.linalg.norm(every - wanted, axis=1).min()
    assert np.linalg.norm(np.subtract(found, wanted)) == pytest.approx(least, abs=1e-9)
    assert np.linalg.norm(every - found, axis=1).min() < 1e-9


@pytest.mark.kernels
@settings(max_examples=60, deadline=None)
@given(angles, angles)
def test_the_nearest_of_six_turns_is_that_of_a_search_through_all(angle: float, other: float) -> None:
    found = kernels.nearest_turn(direction(angle), direction(other), UP)
    most = max(np.dot(direction(angle + k * np.pi / 3), direction(other)) for k in range(6))
    assert np.dot(found, direction(other)) == pytest.approx(most, abs=1e-12)


@pytest.mark.kernels
@settings(max_examples=40, deadline=None)
@example((0.0, -2.0), 0.0, 3.0)
@given(places, angles, angles)
def test_the_place_between_two_nodes_lies_in_both_planes(
    place: tuple[float, float], first: float, second: float
) -> None:
    p, q = np.array([0.0, 0.0, 0.0]), np.array([*place, 0.3])
    n = Rotation.from_rotvec([0.2 * np.cos(first), 0.2 * np.sin(first), 0]).apply(UP)
    m = Rotation.from_rotvec([0.2 * np.cos(second), 0.2 * np.sin(second), 0]).apply(UP)
    if np.dot(n, m) > 0.999:
        return
    middle = np.array(kernels.between(tuple(p), tuple(n), tuple(q), tuple(m)))
    size = 1e-4 / (1 - np.dot(n, m) ** 2) * 0.5 * np.linalg.norm(q - p)  # what keeps parallel planes finite moves it
    assert abs((middle - p) @ n) < size + 1e-9 and abs((middle - q) @ m) < size + 1e-9


@pytest.mark.parametrize("name", ["plate", "ball"])
def test_nodes_that_are_smoothed_at_once_are_not_linked(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(laying, "SAMPLES_FOR_THREADS", 300)
    points = sheet(12.0, 8.0, 0.15, seed=1) if name == "plate" else ball(3.0, 8000)
    _, scan = scanned(points, 0.5)
    levels, _, independent_sets = make_levels(scan.samples.surface, 0.5)
    assert len(independent_sets[0]) == 3 and len(independent_sets[-1]) == 1
    for posts, share in zip(levels, independent_sets, strict=True):
        assert sorted(np.concatenate(share).tolist()) == list(range(len(posts.mean)))
        if len(share) == 3:
            first, second, between = (set(some.tolist()) for some in share)
            for p in first | second:
                linked = set(posts.neighbors[p][posts.neighbors[p] >= 0].tolist())
                assert not linked & (second if p in first else first)
            assert len(between) < min(len(first), len(second))


@pytest.mark.parametrize("processors", [1, 4])
def test_rows_are_the_same_for_any_number_of_processors(processors: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(laying, "SAMPLES_FOR_THREADS", 40)
    found = []
    for count in (2, processors):
        monkeypatch.setattr(parallel, "processors", lambda count=count: count)
        _, scan = scanned(sheet(12.0, 8.0, 0.2, seed=3), 1.0)
        found.append(rows_of(scan, 1.0, FieldStart(20.0)))
    assert found[0].places.tobytes() == found[1].places.tobytes()


@pytest.mark.kernels
@pytest.mark.parametrize("seed, left_out", [(0, 0.125), (1, 0.0), (2, 0.125)])
def test_on_a_plate_the_rows_are_a_perfect_lattice_along_its_longest_side(seed: int, left_out: float) -> None:
    """All lie on it. Up to an eighth of its nodes are nearest to no post and are left out: the front makes these itself."""
    _, scan = scanned(sheet(12.0, 8.0, 0.2, seed=seed), 1.0)
    nodes = rows_of(scan, 1.0, FieldStart())
    away, near = cKDTree(nodes.places).query(nodes.places, k=7)
    inside = (np.abs(nodes.places[:, :2]) < [4.5, 2.5]).all(axis=1)
    assert inside.sum() > 40
    away, near = away[inside, 1:], near[inside, 1:]
    beside = away < 1.5
    assert away[beside] == pytest.approx(1.0, abs=1e-6)
    assert away[~beside] == pytest.approx(3**0.5, abs=1e-6)
    assert (~beside).sum() <= 6 * left_out * inside.sum()
    steps = (nodes.places[near] - nodes.places[inside][:, None])[beside]
    turns = np.degrees(np.arctan2(steps[..., 1], steps[..., 0])) % 60.0
    assert np.minimum(turns, 60.0 - turns).max() < 2.0


@pytest.mark.parametrize("turn", [10.0, 30.0])
def test_rows_turn_as_they_are_told(turn: float) -> None:
    _, scan = scanned(sheet(12.0, 8.0, 0.2), 1.0)
    _, straight, node = lattice_start(scan.samples, scan.boundary, 1.0, 0.0)
    _, turned, same = lattice_start(scan.samples, scan.boundary, 1.0, turn)
    assert node == same
    cosine = np.dot(straight, turned) / np.linalg.norm(straight) / np.linalg.norm(turned)
    assert np.degrees(np.arccos(cosine)) == pytest.approx(turn, abs=1e-6)


@pytest.mark.parametrize("name", ["scallop", "sphere", "torus", "two_holes", "saddle"])
def test_directions_of_neighbours_agree_but_at_a_few_singular_places(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    shape = make(name, 20_000)
    _, scan = scanned(shape.points, shape.length)
    found: list[Level] = []
    choose = laying._chosen

    def kept(posts: Level, owner: np.ndarray, length: float) -> CandidateNodes:
        found.append(posts)
        return choose(posts, owner, length)

    monkeypatch.setattr(laying, "_chosen", kept)
    rows_of(scan, shape.length, FieldStart())
    (posts,) = found
    pairs = np.argwhere(posts.neighbors >= 0)
    a, b = pairs[:, 0], posts.neighbors[pairs[:, 0], pairs[:, 1]]
    other = posts.direction[b] - posts.normals[a] * (posts.normals[a] * posts.direction[b]).sum(axis=1)[:, None]
    other /= np.linalg.norm(other, axis=1)[:, None]
    side = np.cross(posts.normals[a], posts.direction[a])
    turned = (np.cos(k * np.pi / 3) * posts.direction[a] + np.sin(k * np.pi / 3) * side for k in range(6))
    best = np.max([(way * other).sum(axis=1) for way in turned], axis=0)
    assert (np.degrees(np.arccos(best.clip(-1, 1))) < 15.0).mean() > 0.85  # half of them would at random
    assert abs((posts.direction * posts.normals).sum(axis=1)).max() < 1e-9
    assert np.linalg.norm(posts.direction, axis=1) == pytest.approx(1.0)


def test_every_sample_has_a_node_within_reach_and_nodes_keep_their_distance() -> None:
    shape = make("cloth", 20_000)
    _, scan = scanned(shape.points, shape.length)
    surface = scan.samples.surface
    levels, owners, _ = make_levels(surface, shape.length)
    assert len(levels) == len(owners) > 2
    places = surface.mean
    for level, (posts, owner) in enumerate(zip(levels, owners, strict=True)):
        radius = laying.LEVEL_SPACING * shape.length * laying.LEVEL_RATIO**level
        assert set(owner.tolist()) == set(range(len(posts.mean)))
        first = places[np.unique(owner, return_index=True)[1]]
        assert np.linalg.norm(places - first[owner], axis=1).max() < radius
        count = (posts.neighbors >= 0).sum(axis=1)
        assert count.min() >= 1 and np.median(count) >= (5 if len(count) > 50 else 3)  # of few most lie at the boundary
        for p in range(len(posts.mean)):
            links = posts.neighbors[p, : count[p]].tolist()
            assert p not in links and len(set(links)) == len(links)
        places = posts.mean


def test_fields_made_together_are_those_made_alone() -> None:
    shape = make("cloth", 20_000)
    _, scan = scanned(shape.points, shape.length)
    starts = [FieldStart(10.0 * turn, scale) for turn in range(3) for scale in (1.0, 1.02)]
    together = orientation_fields(scan.samples, scan.boundary, st.Settings(length=shape.length), starts)
    for way, field in zip(starts, together, strict=True):
        assert field.start == way
        alone = rows_of(scanned(shape.points, shape.length)[1], shape.length, way)
        assert known(field.nodes).places.tobytes() == alone.places.tobytes()
    assert len({known(field.nodes).places.tobytes() for field in together}) == len(starts)


@pytest.mark.parametrize("effort", ["quick", "normal", "best"])
def test_no_rows_are_laid_by_the_paper_or_where_lengths_differ(effort: str) -> None:
    points = sheet(12.0, 8.0, 0.2)
    for asked in (
        st.Settings(length=1.0, method="paper", effort=effort),
        st.Settings(length_field=[(x, 0.0, 0.0, 1.0 + abs(x) / 8) for x in (-5.0, 0.0, 5.0)], effort=effort),
    ):
        scan = steps_of(st.PointCloud.from_array(points), asked)
        assert all(field.nodes is None for field in orientation_fields(scan.samples, scan.boundary, asked))


def test_nodes_of_rows_keep_apart_and_lie_near_the_scan() -> None:
    points = ball(5.0, 20_000)
    _, scan = scanned(points, 1.0)
    nodes = rows_of(scan, 1.0, FieldStart())
    assert len(nodes.places) == pytest.approx(4 * np.pi * 25 / (0.866 * 1.02**2), rel=0.1)
    assert cKDTree(nodes.places).query(nodes.places, k=2)[0][:, 1].min() >= 0.6 * 1.02 - 1e-9
    assert abs(np.linalg.norm(nodes.places + scanned(points, 1.0)[0].origin, axis=1) - 5.0).max() < 0.2
    assert (nodes.normals * (nodes.places / 5.0)).sum(axis=1).min() > 0.9


def test_rows_turn_and_move_with_the_scan() -> None:
    shape = make("clam", 20_000)
    turn = Rotation.from_rotvec([0.3, -0.8, 0.5])
    moved = turn.apply(shape.points) + [10.0, 20.0, -30.0]
    (one, first), (two, second) = (scanned(points, shape.length) for points in (shape.points, moved))
    a, b = (rows_of(scan, shape.length, FieldStart(10.0)) for scan in (first, second))
    expected = turn.apply(a.places + one.origin) + [10.0, 20.0, -30.0]
    assert np.abs(b.places + two.origin - expected).max() < 1e-7 * shape.length


def test_the_front_comes_to_the_rows_and_leaves_fewer_irregular_nodes() -> None:
    shape = make("scallop")
    cloud, scan = scanned(shape.points, shape.length)
    own = st.Settings(length=shape.length)
    nodes = rows_of(scan, shape.length, FieldStart())
    with_rows, without = (front_of(cloud, own, way) for way in (FieldStart(), None))
    away = cKDTree(with_rows.nodes).query(nodes.places)[0]
    assert (away < 1e-9).mean() > 0.8
    assert with_rows.quality.valence6 > without.quality.valence6
    assert with_rows.topology == without.topology


def test_a_closed_surface_begins_with_a_triangle_of_rows() -> None:
    cloud, scan = scanned(ball(5.0, 20_000), 1.0)
    grid = front_of(cloud, st.Settings(length=1.0), FieldStart())
    first = np.linalg.norm(np.diff(grid.nodes[grid.triangles[0]][[0, 1, 2, 0]], axis=0), axis=1)
    assert first == pytest.approx(1.02, abs=0.1)
    nodes = rows_of(scan, 1.0, FieldStart())
    assert cKDTree(nodes.places).query(grid.nodes[grid.triangles[0]])[0].max() < 1e-9


def test_appointed_positions_are_nodes_of_the_front() -> None:
    cloud = st.PointCloud.from_array(sheet(12.0, 8.0, 0.2))
    wanted = [(0.3, 0.2, 0.0), (3.1, -1.7, 0.0), (-4.4, 2.2, 0.0)]
    own = st.Settings(length=1.0, fixed=wanted)
    grid = front_of(cloud, own, FieldStart())
    assert cKDTree(grid.nodes + grid.origin).query(wanted)[0].max() < 1e-12
