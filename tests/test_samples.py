"""Sites: the scan at the scale of a member, with oriented normals and links that stay on one sheet."""

import gc
from concurrent.futures import ThreadPoolExecutor
from functools import cache

import naive
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from marks import compiled_only
from shapes import make
from small_clouds import ball, cap, samples_of, sheet, tire, turn_of
from steps import boundary_of

from scantruss import InputError, PointCloud, Settings, grid_from_points
from scantruss.grid.upward import facing_of
from scantruss.kernels.geometry.boxes import new_boxes
from scantruss.kernels.surface.local_surface import Surface
from scantruss.kernels.surface.normals import (
    cut_steep_links_of,
    link_weights,
    orient_normals,
    sample_normals,
    smooth_normals,
)
from scantruss.kernels.surface.samples import choose_samples, group_points, nearest_samples, put_all, settle_points
from scantruss.scan.cloud import bounds_of
from scantruss.surface import linked_samples as module
from scantruss.surface.given_normals import NO_NORMALS
from scantruss.surface.samples import sample_surface


@pytest.mark.parametrize("effort", ["quick", "normal"])
def test_a_run_leaves_no_memory_to_be_collected(effort: str) -> None:
    points, chosen = make("cloth", 4000).points, Settings(length=25.0, effort=effort)
    grid_from_points(points, chosen)  # loading kernels leaves some
    gc.collect()
    gc.disable()
    try:
        grid_from_points(points, chosen)
        gc.set_debug(gc.DEBUG_SAVEALL)
        gc.collect()
        assert not [type(left) for left in gc.garbage if type(left).__module__.startswith("scantruss")]
    finally:
        gc.set_debug(0)
        gc.garbage.clear()
        gc.enable()


def thinned(points: np.ndarray, radius: float, capacity: int | None = None) -> tuple[np.ndarray, np.ndarray]:
    """A sample within the radius of each point, and the point of each sample; a small capacity lets the table fill up on the way."""
    capacity = capacity or len(points)
    lower, upper = points.min(axis=0), points.max(axis=0)
    owner, begin, count = np.full(len(points), -1, np.int64), 0, 0
    chosen, places = np.full(capacity, -1, np.int64), np.empty((capacity, 3))
    boxes = new_boxes(lower, upper, 1.3 * radius, capacity, capacity)
    while True:
        begin, count = choose_samples(points, radius, boxes, owner, chosen, places, begin, count, NO_NORMALS)
        if begin == len(points):
            assert np.array_equal(places[:count], points[chosen[:count]])
            return owner, chosen[:count]
        capacity *= 2
        chosen = np.concatenate([chosen[:count], np.full(capacity - count, -1, np.int64)])
        places = np.concatenate([places[:count], np.empty((capacity - count, 3))])
        boxes = new_boxes(lower, upper, 1.3 * radius, capacity, capacity)
        put_all(boxes, points, chosen[:count])


def linked(points: np.ndarray, length: float = 1.0) -> tuple[Surface, np.ndarray]:
    """Sites of a cloud and their (S, K) neighbours by brute force over the means."""
    surface = samples_of(points, length).surface
    pairs = [(s, int(n)) for s, row in enumerate(surface.neighbors) for n in row if n >= 0]
    return surface, np.array(pairs).reshape(-1, 2)


@cache
def small_ball() -> Surface:
    """Sites of a ball, prepared once."""
    return samples_of(ball(2.0, 400)).surface


@st.composite
def clouds(draw: st.DrawFn) -> np.ndarray:
    """Random points, flat ones and repeated ones among them, anywhere."""
    rng = np.random.default_rng(draw(st.integers(0, 10_000)))
    extent = np.array([1.0, draw(st.sampled_from([0.0, 0.2, 1.0])), draw(st.sampled_from([0.0, 0.1, 1.0]))])
    points = draw(st.sampled_from([-50.0, 0.0, 3.0])) + extent * rng.random((draw(st.integers(2, 80)), 3))
    return np.concatenate([points, points[: draw(st.integers(0, 5))]])


@pytest.mark.kernels
@given(clouds(), st.floats(0.02, 0.8))
def test_every_point_has_a_sample_within_the_radius_and_samples_keep_it(points: np.ndarray, radius: float) -> None:
    owner, chosen = thinned(points, radius)
    assert chosen.tolist() == naive.thin(points, radius)
    assert (np.linalg.norm(points - points[chosen[owner]], axis=1) < radius).all()
    apart = np.linalg.norm(points[chosen][:, None] - points[chosen][None], axis=2)
    assert (apart[~np.eye(len(chosen), dtype=bool)] >= radius).all()
    assert (owner[chosen] == np.arange(len(chosen))).all()


@pytest.mark.kernels
@given(clouds(), st.floats(0.02, 0.8))
def test_points_belong_to_the_nearest_sample_that_the_links_lead_to(points: np.ndarray, radius: float) -> None:
    """With links to all the others that is the nearest of all, the first of several that are as near but for rounding."""
    owner, chosen = thinned(points, radius)
    places, all_others = points[chosen], np.arange(len(chosen))
    links = np.stack([np.append(np.delete(all_others, s), -1) for s in all_others])
    settle_points(points, places, links, owner, NO_NORMALS, chosen, 0, len(points))
    squares = ((points[:, None] - places) ** 2).sum(axis=2)
    assert owner.tolist() == (squares <= squares.min(axis=1, keepdims=True) * (1 + 1e-6)).argmax(axis=1).tolist()


@pytest.mark.kernels
@given(clouds(), st.floats(0.02, 0.8), st.integers(0, 50))
def test_samples_move_with_the_cloud(points: np.ndarray, radius: float, seed: int) -> None:
    """A turn and a shift of the cloud change nothing, unless rounding decides which of two distances is the larger."""
    distance = np.linalg.norm(points[:, None] - points[None], axis=2)
    for row in distance:
        assume(np.diff(np.unique(np.append(row, radius))).min(initial=1.0) > 1e-9)
    moved = points @ turn_of(seed).T + [3.0, -7.0, 0.5]
    owner, chosen = thinned(points, radius)
    other, same = thinned(moved, radius)
    assert same.tolist() == chosen.tolist()
    links = np.stack([np.append(np.delete(np.arange(len(chosen)), s), -1) for s in range(len(chosen))])
    settle_points(points, points[chosen], links, owner, NO_NORMALS, chosen, 0, len(points))
    settle_points(moved, moved[chosen], links, other, NO_NORMALS, chosen, 0, len(points))
    assert other.tolist() == owner.tolist()


@pytest.mark.kernels
@given(clouds(), st.floats(0.02, 0.3))
def test_room_that_runs_out_on_the_way_makes_no_difference(points: np.ndarray, radius: float) -> None:
    assert thinned(points, radius, 2)[1].tolist() == thinned(points, radius)[1].tolist()


@pytest.mark.kernels
@given(clouds(), st.integers(0, 99))
def test_points_are_grouped_by_sample_with_their_means(points: np.ndarray, seed: int) -> None:
    owner = np.random.default_rng(seed).permutation(np.arange(len(points)) % 7)
    samples = int(owner.max()) + 1
    start, mean = np.zeros(samples + 1, np.int64), np.zeros((samples, 3))
    grouped = np.empty_like(points)
    group_points(points, owner, start, grouped, mean)
    assert start[-1] == len(points)
    for s in range(samples):
        assert (grouped[start[s] : start[s + 1]] == points[owner == s]).all()
        assert mean[s] == pytest.approx(points[owner == s].mean(axis=0))


@pytest.mark.kernels
@given(st.integers(0, 1000), st.integers(8, 60), st.floats(0.3, 3.0))
def test_nearest_samples_are_the_nearest(seed: int, count: int, far: float) -> None:
    places = np.random.default_rng(seed).random((count, 3)) * [2.0, 2.0, 0.2]
    boxes = new_boxes(places.min(axis=0), places.max(axis=0), 0.2, count, count)
    put_all(boxes, places, np.arange(count))
    found = np.full((count, 6), -1, np.int64)
    nearest_samples(places, boxes, 0.1, far, found, NO_NORMALS, 0, len(places))
    for s in range(count):
        own = [n for n in found[s].tolist() if n >= 0]
        full = naive.nearest(places, s, 6, far)
        assert own == (full if len(full) >= 6 else naive.nearest(places, s, 6, 2 * far))


@pytest.mark.kernels
@given(st.integers(0, 1000))
def test_normals_agree_with_those_of_numpy(seed: int) -> None:
    rng = np.random.default_rng(seed)
    mean = rng.normal(size=(13, 3)) * [1.0, 0.8, 0.2] @ turn_of(seed).T + [100.0, -40.0, 7.0]
    neighbors = np.full((13, 12), -1, np.int64)
    neighbors[0], neighbors[1, :5] = np.arange(1, 13), [0, 2, 3, 4, 5]
    normals, thickness = np.empty((13, 3)), np.empty(13)
    sample_normals(mean, neighbors, normals, thickness, 0, len(mean))
    for s, ring in ((0, list(range(13))), (1, [1, 0, 2, 3, 4, 5])):
        expected = naive.plane_normal(mean[ring])
        assert abs(normals[s] @ expected) == pytest.approx(1, abs=1e-6)
        heights = (mean[ring] - mean[ring].mean(axis=0)) @ expected
        assert thickness[s] == pytest.approx(np.sqrt((heights**2).mean()), abs=1e-6)


@pytest.mark.kernels
def test_the_normals_of_a_plate_are_those_of_the_plate() -> None:
    turn = turn_of(4)
    surface = samples_of(sheet(5, 4, 0.25) @ turn.T).surface
    assert abs(surface.normals @ turn[:, 2]) == pytest.approx(1, abs=1e-9)
    assert len({bool(up) for up in surface.normals @ turn[:, 2] > 0}) == 1


@pytest.mark.kernels
@pytest.mark.parametrize("seed", range(4))
def test_the_normals_of_a_ball_point_outwards_from_its_centre(seed: int) -> None:
    points = ball(2.0, 500, seed=seed) @ turn_of(seed) + [50.0, -20.0, 3.0]
    surface = samples_of(points).surface
    outwards = surface.mean + samples_origin(points) - [50.0, -20.0, 3.0]
    outwards /= np.linalg.norm(outwards, axis=1)[:, None]
    assert ((surface.normals * outwards).sum(axis=1) > np.cos(np.radians(6))).all()


def samples_origin(points: np.ndarray) -> np.ndarray:
    return PointCloud.from_array(points).origin


def test_the_normals_of_a_torus_point_outwards_even_in_its_hole() -> None:
    surface = samples_of(tire(4.0, 1.5, 0.2), 0.8).surface
    around = surface.mean * [1, 1, 0]
    centre = 4.0 * around / np.linalg.norm(around, axis=1)[:, None]
    outwards = (surface.mean - centre) / np.linalg.norm(surface.mean - centre, axis=1)[:, None]
    assert ((surface.normals * outwards).sum(axis=1) > 0.97).all()


@pytest.mark.parametrize("name", ["saddle", "gable", "pantheon", "thin_strip", "terrain"])
def test_all_normals_of_a_two_sided_surface_are_on_one_side(name: str) -> None:
    """Linked neighbours face the same way everywhere; the helical strip turns round twice and is still two-sided."""
    shape = make(name, 20_000)
    surface, pairs = linked(shape.points, shape.length)
    agree = (surface.normals[pairs[:, 0]] * surface.normals[pairs[:, 1]]).sum(axis=1)
    assert (agree > 0).all()
    boundary_of(PointCloud.from_array(shape.points), Settings(length=shape.length))  # is not refused


def test_one_sided_surfaces_are_refused() -> None:
    shape = make("moebius", 20_000)
    with pytest.raises(InputError, match="one-sided"):
        boundary_of(PointCloud.from_array(shape.points), Settings(length=shape.length))


@pytest.mark.parametrize("seed", range(3))
def test_one_sided_surfaces_are_refused_in_any_pose_and_size(seed: int) -> None:
    shape = make("moebius", 12_000, seed=seed, pose=True, scale=0.01)
    with pytest.raises(InputError, match="one-sided"):
        boundary_of(PointCloud.from_array(shape.points), Settings(length=1.2 * shape.length))


@pytest.mark.kernels
@given(st.integers(0, 1000))
@settings(max_examples=6)
def test_orientation_does_not_depend_on_the_signs_it_starts_from(seed: int) -> None:
    """Whatever the signs of the normals, all of a piece end on one side: that of its first sample or the other."""
    surface = small_ball()
    signs = np.random.default_rng(seed).choice([-1.0, 1.0], len(surface.mean))
    normals = surface.normals * signs[:, None]
    weights = np.empty(surface.neighbors.shape, np.uint8)
    link_weights(surface.mean, normals, surface.neighbors, weights, 0, len(weights))
    order = np.argsort(weights, axis=None, kind="stable")[: int((surface.neighbors >= 0).sum())]
    piece = np.empty(len(signs), np.int64)
    orient_normals(surface.mean, normals, surface.neighbors, order, piece)
    same = (normals * surface.normals).sum(axis=1)
    assert abs(same) == pytest.approx(1)
    assert len(set(np.sign(same))) == 1
    assert (piece == 0).all()


@pytest.mark.kernels
def test_link_weights_are_0_between_mirrored_normals_and_most_without_a_link() -> None:
    """Two places of a circle: each normal is the other one mirrored at the plane half-way, however far apart they are."""
    angle = np.radians([0.0, 70.0])
    mean = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    weights = np.empty((2, 2), np.uint8)
    link_weights(mean, mean.copy(), np.array([[1, -1], [0, -1]]), weights, 0, 2)
    assert weights[:, 0].max() == 0
    assert (weights[:, 1] == 255).all()
    link_weights(mean, np.array([[1.0, 0, 0], [0, 0, 1]]), np.array([[1, -1], [0, -1]]), weights, 0, 2)
    assert weights[:, 0].min() == 254  # at right angles, mirrored or not


@pytest.mark.kernels
def test_links_to_another_sheet_are_cut_and_links_around_a_ridge_stay() -> None:
    up, side = (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)
    mean = np.array([(0, 0, 0), (0, 0, 1), (1, 0, 0), (0.1, 0, -1)], float)
    normals = np.array([up, up, up, side])
    neighbors = np.array([[1, 2, 3], [0, -1, -1], [0, -1, -1], [0, -1, -1]])
    cut_steep_links_of(mean, normals, neighbors, 0.75, 0, len(mean))
    assert neighbors.tolist() == [[2, 3, -1], [-1, -1, -1], [0, -1, -1], [0, -1, -1]]


@pytest.mark.kernels
def test_smoothed_normals_leave_out_neighbours_that_face_elsewhere() -> None:
    normals = np.array([(0, 0, 1), (0, 0.6, 0.8), (0, 0, -1), (1, 0, 0)], float)
    neighbors = np.array([[1, 2, 3], [-1, -1, -1], [-1, -1, -1], [-1, -1, -1]])
    smoothed = np.empty((4, 3))
    smooth_normals(normals, neighbors, 0.7, smoothed, 0, len(normals))
    expected = np.array([0, 0.6, 2.8]) / np.hypot(0.6, 2.8)
    assert smoothed[0] == pytest.approx(expected)
    assert smoothed[1:] == pytest.approx(normals[1:])


@pytest.mark.parametrize("gap", [0.6, 0.7])
def test_links_do_not_lead_to_a_second_sheet(gap: float) -> None:
    """Two plates less than a member apart: no sample that is a member away from the boundary is linked to the other plate."""
    plate = sheet(4, 4, 0.1)
    surface = samples_of(np.concatenate([plate, plate[:, [1, 0, 2]] + [0, 0, gap]])).surface
    upper = surface.mean[:, 2] > surface.mean[:, 2].mean()
    inner = np.flatnonzero((abs(surface.mean[:, :2]) < 1).all(axis=1))
    assert len(inner) > 50
    for s in inner:
        assert all(upper[n] == upper[s] for n in surface.neighbors[s] if n >= 0)


@pytest.mark.kernels
def test_pieces_are_numbered_by_size_and_debris_is_no_piece() -> None:
    large, small = sheet(6, 5, 0.25), sheet(4, 3, 0.25) + np.array([9, 0, 0])
    debris = sheet(0.5, 0.5, 0.25) + np.array([0, 9, 0])
    samples = samples_of(np.concatenate([small, debris, large]))
    assert samples.pieces == (0, 1)
    assert np.ptp(samples.surface.mean[samples.piece == 0], axis=0)[0] == pytest.approx(6, abs=0.3)
    assert np.ptp(samples.surface.mean[samples.piece == 1], axis=0)[0] == pytest.approx(4, abs=0.3)
    assert set(samples.piece) == {0, 1, 2}
    pieces, share = samples.left_out
    assert (
        pieces == 1 and 0.25 / 42.25 < share < 3.0 * 0.25 / 42.25
    )  # a small piece is all boundary, where samples lie closer
    assert samples_of(large).left_out == (0, 0.0)


@pytest.mark.parametrize("noise", [0.05, 0.12])
def test_a_rough_cloud_is_seen_as_a_sheet(noise: float) -> None:
    """Where the points scatter by a tenth of a member, samples lie nearer to the plane than points, and their normals stand on it."""
    points = sheet(12, 10, 0.1, noise=noise)
    surface = samples_of(points).surface
    inside = (abs(surface.mean[:, 0]) < 5) & (abs(surface.mean[:, 1]) < 4)
    assert surface.mean[inside, 2].std() < 0.6 * noise
    assert np.degrees(np.arccos(abs(surface.normals[inside, 2]))).mean() < 4


def test_a_few_thick_samples_along_ridges_do_not_make_a_scan_rough() -> None:
    """They stay where they are: moved to the plane around them they would leave the ridges, and others would be chosen."""
    shape = make("great_court", 100_000)
    length = (2 * shape.area / (3**0.5 * 1000)) ** 0.5
    samples = samples_of(shape.points, length)
    thick = (samples.thickness > module.ROUGH_SAMPLE * length).mean()
    assert module.SOME_ROUGH < thick < module.MANY_ROUGH
    assert (
        shape.distance(samples.surface.mean + PointCloud.from_array(shape.points).origin).max()
        < module.ROUGH_SAMPLE * length
    )


def test_the_area_is_about_right() -> None:
    assert samples_of(sheet(10, 8, 0.15)).area == pytest.approx(80, rel=0.2)
    assert samples_of(ball(3.0, 6000)).area == pytest.approx(36 * np.pi, rel=0.2)


@pytest.mark.kernels
def test_samples_are_kept_as_long_as_their_cloud_and_the_length_stay() -> None:
    cloud = PointCloud.from_array(sheet(4, 3, 0.25))
    first = sample_surface(cloud, Settings(length=1.0))
    assert sample_surface(cloud, Settings(length=1.0, method="paper")) is first
    assert sample_surface(cloud, Settings(length=1.5)) is not first
    assert sample_surface(PointCloud.from_array(sheet(4, 3, 0.25)), Settings(length=1.0)) is not first


def test_the_points_of_samples_are_sorted_once() -> None:
    samples = samples_of(np.random.default_rng(0).permutation(sheet(4, 3, 0.25)))
    ordered = samples.points_by_x
    assert (np.diff(ordered[:, 0]) >= 0.0).all() and samples.points_by_x is ordered
    assert (np.sort(ordered, axis=0) == np.sort(samples.measured_points, axis=0)).all()


@pytest.mark.kernels
def test_same_cloud_same_bytes() -> None:
    a, b = (samples_of(cap(3.0, 1.0, 0.3)) for _ in range(2))
    for x, y in zip(a.surface, b.surface, strict=True):
        assert np.asarray(x).tobytes() == np.asarray(y).tobytes()


def test_repeated_points_change_no_sample() -> None:
    points = sheet(8, 6, 0.2)
    a = samples_of(points).surface
    b = samples_of(np.concatenate([points, points[::3]])).surface
    assert len(a.mean) == len(b.mean)
    assert a.neighbors.tolist() == b.neighbors.tolist() or abs(a.mean - b.mean).max() < 0.1


def test_points_are_sorted_where_their_samples_are_many(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same points, each near those before it; points of few samples stay as they are."""
    monkeypatch.setattr(module, "SAMPLES_TO_SORT", 1_000)
    points = sheet(20.0, 20.0, 0.3)
    bounds = bounds_of(points)

    def step(places: np.ndarray) -> float:
        return np.linalg.norm(np.diff(places, axis=0), axis=1).mean()

    found = module.thin_dense(points, bounds, 0.2, 0.3)
    assert step(found) < 0.2 * step(points)
    assert np.array_equal(np.unique(found, axis=0), np.unique(points, axis=0))
    assert module.thin_dense(points, bounds, 0.2, 0.05) is points
    few = points[:900]
    assert module.thin_dense(few, bounds_of(few), 0.2, 0.3) is few


def test_samples_without_rods_are_those_with_them_where_a_scan_has_none() -> None:
    plate, wanted = sheet(10.0, 8.0, 0.15, noise=0.06), Settings(length=1.2)
    cloud = PointCloud.from_array(plate)
    usual = sample_surface(cloud, wanted)
    assert not usual.smooth and sample_surface(cloud, wanted.replace(keep_rods=False)) is usual
    alone = sample_surface(PointCloud.from_array(plate), wanted.replace(keep_rods=False))  # found by themselves
    assert np.array_equal(alone.surface.mean, usual.surface.mean) and np.array_equal(alone.judged, usual.judged)
    assert np.array_equal(alone.surface.normals, usual.surface.normals) and alone.pieces == usual.pieces


@compiled_only
@pytest.mark.parametrize("cells", ["triangle", "quad"])
@pytest.mark.parametrize("at", [(495_000.0, 5_420_000.0, 300.0), (0.0, 0.0, 0.0)])
def test_a_pit_gets_a_grid_that_faces_up_on_a_map_or_not(at: tuple[float, float, float], cells: str) -> None:
    """What has no unit is known by its coordinates or likely; only the side that is outside changes."""
    plan = np.random.default_rng(3).uniform(-10.0, 10.0, (8_000, 2))
    pit = np.column_stack([plan, 0.03 * (plan**2).sum(axis=1)]) + at
    grid = grid_from_points(PointCloud.from_array(pit), Settings(length=3.0, effort="quick", cells=cells))
    assert grid.certificate is not None and grid.certificate.passed
    assert facing_of(grid.nodes, grid.triangles)[2] > 0.5
    panels = grid.nodes[grid.panel_table[:, :3]]
    turns = np.cross(panels[:, 1] - panels[:, 0], panels[:, 2] - panels[:, 0])[:, 2]
    assert (turns > 0.0).all()


@pytest.mark.parametrize(("unit", "upwards"), [("m", True), ("", False)])
def test_a_pit_faces_up_where_z_is_up_and_else_away_from_its_centre(unit: str, upwards: bool) -> None:
    plan = np.random.default_rng(3).uniform(-10.0, 10.0, (8_000, 2))
    pit = np.column_stack([plan, 0.03 * (plan**2).sum(axis=1)])
    samples = sample_surface(PointCloud.from_array(pit, unit=unit), Settings(length=1.5))
    facing = samples.surface.normals[:, 2]
    assert ((facing > 0.0) == upwards).all()


def test_threads_that_work_on_one_scan_share_no_scratch_arrays() -> None:
    """Two browsers that open one scan, or a caller with a thread for each length, work on it at the same time."""
    cloud, chosen = PointCloud.from_array(make("cloth", 4000).points), Settings(length=25.0)
    own = sample_surface(cloud, chosen).surface
    with ThreadPoolExecutor(1) as other:
        first, again = (other.submit(lambda: sample_surface(cloud, chosen).surface).result() for _ in range(2))
    assert first is again and sample_surface(cloud, chosen).surface is own
    for name in ("stamp", "queue", "counter"):
        assert not np.shares_memory(getattr(own, name), getattr(first, name)), name
    np.testing.assert_array_equal(first.mean, own.mean)


def test_grids_of_one_scan_that_threads_make_at_once_are_the_same() -> None:
    cloud, chosen = PointCloud.from_array(make("cloth", 4000).points), Settings(length=25.0)
    alone = grid_from_points(cloud, chosen)
    with ThreadPoolExecutor(3) as pool:
        grids = list(pool.map(lambda _: grid_from_points(cloud, chosen), range(3)))
    for grid in grids:
        np.testing.assert_array_equal(grid.nodes, alone.nodes)
        np.testing.assert_array_equal(grid.triangles, alone.triangles)
