"""Sharp ridges of the scan: found where there are some, straight and in place, and nowhere else."""

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from edged_surfaces import edged_surface
from hypothesis import given
from hypothesis import strategies as st
from marks import compiled_only
from numpy.typing import ArrayLike
from shapes import make
from steps import steps_of
from typed import known

from scantruss import Grid, PointCloud, Settings, grid_from_points
from scantruss.boundary.curves import length_along
from scantruss.boundary.find import find_boundary
from scantruss.check.certify import Judged, judge
from scantruss.constraints.find import find_constraints, wanted_ridges
from scantruss.constraints.fold_tracing import Tracer
from scantruss.constraints.lines_of_folds import (
    GAIN_OF_SURE,
    is_clear_on_rough,
    is_even,
    is_long_edge,
    is_made,
    parts_of_fold,
)
from scantruss.constraints.ridge_ends import Ridge, join_ends
from scantruss.constraints.ridges import find_ridges
from scantruss.errors import FrontError
from scantruss.kernels.geometry.quadric import FIT_POINT
from scantruss.kernels.surface.ridges import (
    FOLD,
    TERMS_OF_FOLD,
    fit_fold,
    fold_error,
    turned_frame,
)
from scantruss.kernels.surface.turned_folds import smooth_part, turned_fold_error
from scantruss.runtime.jit import new_record
from scantruss.surface.near_scan import noise_of_points
from scantruss.surface.samples import sample_surface

SIZE = 5.0  # member length of all shapes here


def groin(count: int = 40_000, radius: float = 40.0, half: float = 28.0, noise: float = 0.02) -> np.ndarray:
    """Two barrel vaults that cross: ridges along both diagonals, which fade towards the middle."""
    rng = np.random.default_rng(3)
    xy = rng.uniform(-half, half, (count, 2))
    z = np.maximum(*np.sqrt(radius**2 - xy**2).T)
    return np.column_stack([xy, z]) + noise * rng.normal(size=(count, 3))


def rounded_groin(
    seed: int, width: float = 0.3, radius: float = 4.4, half: float = 4.0, count: int = 30_000
) -> np.ndarray:
    """Two barrel vaults that cross with rounded groins, evenly scanned with noise of a tenth of the spacing."""

    def height(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        one, other = np.sqrt(radius**2 - x**2), np.sqrt(radius**2 - y**2)
        share = np.clip(0.5 + 0.5 * (one - other) / width, 0.0, 1.0)
        blended: np.ndarray = other + share * (one - other) + width * share * (1.0 - share)
        return blended

    rng, step = np.random.default_rng(seed), 1e-4
    x, y = rng.uniform(-half, half, (2, 4 * count))
    slope = np.hypot(height(x + step, y) - height(x - step, y), height(x, y + step) - height(x, y - step)) / (2 * step)
    area = np.hypot(1.0, slope)
    kept = np.flatnonzero(rng.uniform(size=len(x)) * area.max() < area)[:count]
    return np.column_stack([x, y, height(x, y)])[kept] + rng.normal(0.0, 0.002, (len(kept), 3))


def box(count: int = 40_000, half: float = 15.0, noise: float = 0.02) -> np.ndarray:
    """A cube: twelve ridges that meet by three."""
    rng = np.random.default_rng(4)
    places = rng.uniform(-half, half, (count, 3))
    places[np.arange(count), rng.integers(0, 3, count)] = rng.choice([-half, half], count)
    return places + noise * rng.normal(size=places.shape)


def ridges_of(points: np.ndarray, length: float = SIZE, **others: Any) -> list[Ridge]:
    settings = Settings(length=length, **others)
    return find_ridges(sample_surface(PointCloud.from_array(points), settings), settings)


def line_nodes(grid: Grid) -> np.ndarray:
    return grid.nodes[np.unique(grid.lines)] + grid.origin


def valences(grid: Grid) -> list[int]:
    """How many nodes of lines have 1, 2, 3... members of lines."""
    return np.bincount(np.bincount(grid.lines.ravel()))[1:].tolist()


@compiled_only
def test_the_ridge_of_a_gable_is_a_straight_chain_from_rim_to_rim() -> None:
    shape = make("gable", 50_000)
    grid = grid_from_points(shape.points, Settings(length=shape.length))
    nodes = line_nodes(grid)
    assert np.abs(nodes[:, 0]).max() < 0.05 * shape.length and np.abs(nodes[:, 2] - 30).max() < 0.05 * shape.length
    assert len(grid.lines) in (11, 12, 13) and valences(grid) == [2, len(grid.lines) - 1]
    counts = np.bincount(grid.lines.ravel(), minlength=len(grid.nodes))
    assert set(np.flatnonzero(counts == 1)) <= set(grid.boundary_loops[0].tolist())
    quality = grid.quality
    assert quality.shape_mean >= 0.985 and quality.length_cv <= 0.08 and grid.topology.euler == 1


def folded_plate(noise: float, to_member: int, seed: int) -> np.ndarray:
    """A plate of 24 by 16 with five folds across, of 84 degrees, and so many points on the square of a member of 1."""
    rng = np.random.default_rng(seed)
    xy = rng.uniform(0.0, (24.0, 16.0), (to_member * 24 * 16, 2))
    places = np.column_stack([xy, np.abs(xy[:, 0] / 8.0 % 1.0 - 0.5) * 7.2])
    return places + noise * rng.normal(size=places.shape)


@pytest.mark.parametrize(("noise", "to_member"), [(0.02, 60), (0.035, 60), (0.035, 150), (0.045, 300)])
def test_noise_of_points_cuts_no_ridge_short(noise: float, to_member: int) -> None:
    """Of folds that all fit but for noise, that of the smallest radius, which fits fewest points, was taken for the best."""
    found = ridges_of(folded_plate(noise, to_member, 0), 1.0)
    assert len(found) == 5
    assert all(length_along(ridge.places) > 12.0 for ridge in found)


def test_noise_is_that_of_points_and_not_of_their_means() -> None:
    settings = Settings(length=1.0)
    samples = sample_surface(PointCloud.from_array(folded_plate(0.03, 150, 1)), settings)
    assert noise_of_points(samples) == pytest.approx(0.03, rel=0.1)


@compiled_only
def test_the_ridges_of_a_groin_vault_cross_in_its_middle() -> None:
    grid = grid_from_points(groin(), Settings(length=SIZE))
    nodes = line_nodes(grid)
    assert (np.abs(np.abs(nodes[:, 0]) - np.abs(nodes[:, 1])) / np.sqrt(2)).max() < 0.05 * SIZE
    ends = valences(grid)
    assert ends[0] == 4 and ends[2:] == [0, 1]
    assert np.linalg.norm(nodes[:, :2], axis=1).min() < 0.1 * SIZE and np.linalg.norm(nodes[:, :2], axis=1).max() > 39
    assert grid.quality.shape_mean > 0.97 and grid.topology.euler == 1


@compiled_only
def test_the_ridges_of_a_cube_meet_in_its_corners() -> None:
    grid = grid_from_points(box(), Settings(length=SIZE))
    off = np.sort(np.abs(np.abs(line_nodes(grid)) - 15.0), axis=1)
    assert off[:, 1].max() < 0.05 * SIZE
    ends = valences(grid)
    assert ends[0] == 0 and len(ends) == 3 and ends[2] == 8
    assert grid.topology.euler == 2 and grid.topology.boundary_loops == 0


@pytest.mark.parametrize("name", ["limpet", "torus", "pantheon", "l_plate", "flat_plate"])
def test_smooth_shapes_have_no_ridge(name: str) -> None:
    shape = make(name, 20_000)
    assert ridges_of(shape.points, 1.3 * shape.length) == []


@pytest.mark.parametrize("name", ["scallop", "saddle", "fold_over"])
def test_ribs_bumps_and_bends_are_no_ridges(name: str) -> None:
    shape = make(name, 30_000)
    assert ridges_of(shape.points, shape.length) == []


def test_without_a_ridge_nothing_changes_and_zero_turns_the_search_off() -> None:
    shape = make("saddle", 10_000)
    settings = Settings(length=2 * shape.length)
    first = grid_from_points(shape.points, settings)
    second = grid_from_points(shape.points, settings.replace(ridge_angle=0.0))
    assert np.array_equal(first.nodes, second.nodes) and np.array_equal(first.triangles, second.triangles)
    gable = PointCloud.from_array(make("gable", 20_000).points)
    for others in ({"ridge_angle": 0.0}, {"ridge_angle": 100.0}, {"method": "paper"}):
        assert len(steps_of(gable, Settings(length=5.0, **others)).constraints.lines.curves) == 0


def test_a_ridge_is_found_through_noise_and_in_any_pose() -> None:
    for noise in (0.1, 0.2):
        shape = make("gable", 50_000, noise=noise, pose=True, seed=2)
        (found,) = ridges_of(shape.points)
        places = found.places
        ends = shape.corners[[1, 4]]
        ahead = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
        off = np.linalg.norm(np.cross(places - ends[0] - _origin(shape.points), ahead), axis=1)
        assert off.mean() < 0.05 * SIZE and np.ptp(places @ ahead) > 0.9 * 60


def _origin(points: np.ndarray) -> np.ndarray:
    return -PointCloud.from_array(points).origin


@compiled_only
def test_a_grid_that_fails_with_its_ridges_is_made_without(monkeypatch: pytest.MonkeyPatch) -> None:
    shape = make("gable", 20_000)

    def refuse_lines(grid: Grid, *others: Any) -> Judged:
        if len(grid.lines):
            raise FrontError("no", grid)
        return judge(grid, *others)

    monkeypatch.setattr("scantruss.improve.candidate.judge", refuse_lines)
    grid = grid_from_points(shape.points, Settings(length=shape.length))
    assert len(grid.lines) == 0 and known(grid.settings).ridge_angle == 0.0


def folds(count: int = 30, angle: float = 60.0, wiggle: float = 0.0, jitter: float = 0.0, gain: float = 1000.0) -> Any:
    """A row of folds a quarter member apart, as `Tracer` finds them."""
    rng = np.random.default_rng(5)
    found = np.zeros(count, FOLD)
    found["place"][:, 0] = 0.25 * np.arange(count)
    found["place"][:, 1] = wiggle * rng.normal(size=count)
    found["bend"] = np.radians(angle + jitter * rng.normal(size=count))
    found["gain"] = gain
    return found


def test_what_is_short_blunt_or_uneven_is_no_ridge() -> None:
    asked = np.radians(40.0)
    assert is_even(folds(), asked)
    assert not is_even(folds(count=3), asked)
    assert not is_even(folds(angle=39.0), asked)
    assert not is_even(folds(angle=140.0), asked)  # a sheet that turns back
    assert not is_even(folds(gain=15.0), asked)  # hardly better than a smooth surface
    assert not is_even(folds(angle=45.0, wiggle=0.006), asked)
    assert is_even(folds(angle=75.0, wiggle=0.006), asked)  # sharp ones need not be as even
    assert not is_even(folds(angle=75.0, wiggle=0.05), asked)


@compiled_only
@pytest.mark.parametrize("length", [0.65, 0.7])
def test_all_groins_of_a_vault_are_ridges_where_most_are_even(length: float) -> None:
    found = [len(ridges_of(rounded_groin(seed), length)) for seed in range(6)]
    assert found.count(4) >= 5  # by their own evenness those of three and of two


def test_a_few_even_folds_among_many_that_are_not_make_no_others_ridges() -> None:
    tracer = Tracer.__new__(Tracer)
    tracer.length, tracer.angle, tracer.sharpest, tracer.wide = 1.0, np.radians(40.0), 125.0, False
    even, less, far = (folds(angle=60.0, wiggle=wiggle) for wiggle in (0.0, 0.006, 0.02))
    less["place"] += 20.0
    assert tracer._is_even(even) and not tracer._is_even(less) and tracer._is_even(less, 1.5)
    assert not tracer._is_even(far, 1.5)
    assert [id(each) for each in tracer._also_ridges([even, even], [less, far])] == [id(less)]
    assert tracer._also_ridges([even, even], [less, far, far]) == []  # three of five are uneven
    assert tracer._also_ridges([even], [less]) == []  # two say little
    assert tracer._also_ridges([even, even], [even]) == []  # it is followed already


def test_what_bends_evenly_is_even() -> None:
    ring = folds(60, angle=45.0)
    turn = 0.25 * np.arange(60)
    ring["place"][:, 0], ring["place"][:, 1] = np.cos(turn), np.sin(turn)
    assert is_even(ring, np.radians(40.0))


@pytest.mark.parametrize(
    ("members", "bend", "gain", "is_clear"),
    [
        (13.0, 50.0, 2.0, True),
        (11.0, 50.0, 2.0, False),
        (13.0, 50.0, 0.5, False),
        (7.0, 60.0, 0.5, True),
        (13.0, 30.0, 2.0, False),
        (5.0, 60.0, 2.0, False),
    ],
)
def test_among_places_that_only_look_folded_a_long_sure_line_is_a_ridge(
    members: float, bend: float, gain: float, is_clear: bool
) -> None:
    """The foot of a pot turns by 50 degrees; its lip looks folded in hundreds of places. Gain in that of a sure line."""
    folds = np.zeros(int(4 * members), FOLD)
    folds["bend"], folds["gain"] = np.radians(bend), gain * GAIN_OF_SURE
    assert is_clear_on_rough(folds, np.radians(40.0)) is is_clear


@pytest.mark.parametrize(
    ("bend", "gain", "count", "made"),
    [(45, 1300, 20, True), (45, 1000, 20, False), (110, 600, 20, True), (110, 600, 12, False), (130, 600, 20, False)],
)
def test_a_wide_fold_is_an_edge_where_it_is_even_or_steep_along_four_members(
    bend: float, gain: float, count: int, made: bool
) -> None:
    """As the lip of a cave, which is neither as even as one that was made nor turned back as a wave or an ear is."""
    folds = np.zeros(count, FOLD)
    folds["bend"], folds["gain"] = np.radians(bend), gain
    assert is_made(folds) == made


@pytest.mark.parametrize(
    ("bend", "gain", "count", "long"),
    [(68, 900, 80, True), (68, 900, 40, False), (40, 900, 80, False), (68, 700, 80, False), (136, 900, 80, False)],
)
def test_a_steep_wide_fold_that_goes_on_is_an_edge(bend: float, gain: float, count: int, long: bool) -> None:
    """As the base of a hand, 20 members around; the legs of a bunny have folds of 11, the crown of a bust a blunt one of 19."""
    folds = np.zeros(count, FOLD)
    folds["bend"], folds["gain"] = np.radians(bend), gain
    assert is_long_edge(folds) == long and not is_made(folds)


def test_lines_of_folds_are_parted_at_their_corners() -> None:
    line = folds(40)
    line["place"][20:, :2] = [4.75, 0.0] + 0.25 * np.arange(1, 21)[:, None] * [np.cos(0.9), np.sin(0.9)]
    first, last = parts_of_fold(line)
    assert np.allclose(first["place"][-1], [4.75, 0.0, 0.0], atol=0.26) and len(first) + len(last) == 41
    (whole,) = parts_of_fold(folds(40))
    assert len(whole) == 40


def row(a: ArrayLike, b: ArrayLike, count: int = 20) -> Ridge:
    return Ridge(np.array(a) + np.linspace(0, 1, count)[:, None] * (np.array(b, float) - a), True)


def test_ends_that_face_each_other_or_one_corner_are_joined() -> None:
    (whole,) = join_ends([row((0, 0, 0), (5, 0, 0)), row((12, 0.1, 0), (7, 0, 0))], 1.0)
    assert sorted([whole.places[0, 0], whole.places[-1, 0]]) == [0, 12] and len(whole.places) == 40
    assert len(join_ends([row((0, 0, 0), (5, 0, 0)), row((7, 0, 0), (7, 5, 0))], 1.0)) == 2
    met = join_ends([row((5, 0, 0), (1, 0, 0)), row((0, 5, 0), (0, 1, 0)), row((0, 0, 5), (0, 0, 0.5))], 1.0)
    assert len(met) == 3 and all(np.linalg.norm(ridge.places, axis=1).min() < 1e-9 for ridge in met)


def test_an_end_is_led_to_the_ridge_that_it_makes_for_and_short_loose_ends_go() -> None:
    through, end = join_ends([row((-5, 0, 0), (5, 0, 0), 80), row((0, 6, 0), (0, 0.6, 0))], 1.0)
    assert np.abs(end.places[-1] - through.places).sum(axis=1).min() < 1e-9
    assert join_ends([row((0, 0, 0), (2, 0, 0))], 1.0) == []


def test_most_of_a_ring_is_a_ring() -> None:
    turn = np.linspace(0.3, 2.0 * np.pi - 0.3, 60)
    (ring,) = join_ends([Ridge(3.0 * np.column_stack([np.cos(turn), np.sin(turn), 0.0 * turn]), True)], 1.0)
    assert ring.ring and len(ring.places) == 60


def can(count: int = 40_000, radius: float = 15.0, height: float = 30.0) -> np.ndarray:
    """A closed can: two rings of 90 degrees."""
    rng = np.random.default_rng(6)
    side = height / (height + radius)
    turn, lid = rng.uniform(0, 2 * np.pi, count), rng.random(count) > side
    out = np.where(lid, radius * np.sqrt(rng.random(count)), radius)
    z = np.where(lid, rng.choice([0.0, height], count), rng.uniform(0, height, count))
    return np.column_stack([out * np.cos(turn), out * np.sin(turn), z]) + 0.02 * rng.normal(size=(count, 3))


def rounded_box(radius: float, half: float = 20.0) -> np.ndarray:
    """A cube whose edges are fillets."""
    core = half - radius
    points = box(60_000, half, 0.0)
    nearest = np.clip(points, -core, core)
    away = points - nearest
    rng = np.random.default_rng(7)
    return nearest + radius * away / np.linalg.norm(away, axis=1)[:, None] + 0.02 * rng.normal(size=points.shape)


@compiled_only
def test_both_rings_of_a_can_are_chains() -> None:
    grid = grid_from_points(can(), Settings(length=SIZE, effort="quick"))
    nodes = line_nodes(grid)
    off = np.abs(np.linalg.norm(nodes[:, :2], axis=1) - 15.0)
    assert np.quantile(off, 0.9) < 0.05 * SIZE and off.max() < 0.1 * SIZE
    assert set(np.round(nodes[:, 2] / 30.0, 1)) == {0.0, 1.0}
    assert valences(grid) == [0, len(nodes)] and abs(len(nodes) / (2 * 2 * np.pi * 15.0 / SIZE) - 1.0) < 0.15
    distance = known(known(grid.certificate).scan_distance)
    assert distance.p95 < 0.06 * SIZE and grid.topology.euler == 2


@compiled_only
def test_fillets_have_their_ridge_on_their_crest() -> None:
    radius = 0.3 * SIZE
    points = rounded_box(radius)
    places = np.concatenate([ridge.places for ridge in ridges_of(points)]) - _origin(points)
    crest = 20.0 - radius * (1.0 - np.sqrt(0.5))
    edges = [
        np.insert(np.array([one, two]) * crest, axis, 0.0) for axis in range(3) for one in (-1, 1) for two in (-1, 1)
    ]
    followed = 0
    for middle in edges:
        away = np.linalg.norm((places - middle)[:, np.abs(middle) > 0.0], axis=1)
        along = places[away < 0.08 * SIZE][:, middle == 0.0].ravel()
        followed += np.histogram(along, np.linspace(-15, 15, 7))[0].min() > 0
    assert followed >= 11


@compiled_only
def test_a_hip_roof_has_all_of_its_ridges() -> None:
    """The ridge folds by 40 degrees, the hips by 28, which counts because they come to it."""
    rng = np.random.default_rng(8)
    x, y = rng.uniform(0, 80, 50_000), rng.uniform(0, 48, 50_000)
    z = np.tan(np.radians(20.0)) * np.minimum.reduce([x, 80 - x, y, 48 - y])
    roof = np.column_stack([x, y, z]) + 0.02 * rng.normal(size=(50_000, 3))
    assert len(ridges_of(roof)) == 5
    nodes = line_nodes(grid_from_points(roof, Settings(length=SIZE, effort="quick")))
    on_two = np.sort(np.stack([nodes[:, 0], 80 - nodes[:, 0], nodes[:, 1], 48 - nodes[:, 1]]), axis=0)
    assert (on_two[1] - on_two[0]).max() < 0.08 * SIZE
    for corner in ([0, 0], [80, 0], [0, 48], [80, 48], [24, 24], [56, 24]):
        assert np.linalg.norm(nodes[:, :2] - corner, axis=1).min() < 0.1 * SIZE


@pytest.mark.kernels
@given(st.integers(0, 10_000), st.booleans())
def test_the_error_of_a_fold_is_that_of_least_squares(seed: int, folded: bool) -> None:
    rounding = 0.1 * (seed % 4)
    rng = np.random.default_rng(seed)
    buffer = np.zeros(60, FIT_POINT)
    buffer["place"] = rng.uniform(-1, 1, (60, 3)) * [0.8, 0.8, 0.3]
    buffer["weight"] = rng.uniform(0.1, 1, 60)
    shift = rng.uniform(-0.3, 0.3)
    frame = turned_frame((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), rng.uniform(-0.3, 0.3))
    c, e, n = map(np.array, frame)
    matrix = np.empty((TERMS_OF_FOLD, TERMS_OF_FOLD + 1))
    error = fold_error(buffer, 60, frame, shift, 1.0, folded, rounding, matrix)
    u, t, h = buffer["place"] @ c - shift, buffer["place"] @ e, buffer["place"] @ n
    size = np.hypot(u, rounding)
    last = [size, u * size] if folded else [u**3]
    terms = np.stack([np.ones(60), t, t * t, u, u * u, u * t, *last], axis=1)
    root = np.sqrt(buffer["weight"])
    solution, squares, *_ = np.linalg.lstsq(root[:, None] * terms, root * h, rcond=None)
    assert error == pytest.approx(float(squares[0]), rel=1e-4)
    assert np.allclose(matrix[: terms.shape[1], TERMS_OF_FOLD], solution, rtol=1e-3, atol=1e-3)


@pytest.mark.kernels
@given(st.integers(0, 10_000))
def test_the_error_of_a_turned_fold_is_the_same_once_the_quadrics_are_taken_out(seed: int) -> None:
    rng = np.random.default_rng(seed)
    buffer = np.zeros(60, FIT_POINT)
    buffer["place"] = rng.uniform(-1, 1, (60, 3)) * [0.8, 0.8, 0.3]
    buffer["weight"] = rng.uniform(0.1, 1, 60)
    across, normal, radius = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0), rng.uniform(0.7, 1.0)
    freed, squares = smooth_part(buffer, 60, turned_frame(across, normal, 0.0), radius)
    matrix = np.empty((TERMS_OF_FOLD, TERMS_OF_FOLD + 1))
    for rounding in (0.0, 0.1, 0.3):
        angle, shift = rng.uniform(-1.5, 1.5), rng.uniform(-0.4, 0.4)
        whole = fold_error(buffer, 60, turned_frame(across, normal, angle), shift, radius, True, rounding, matrix)
        assert turned_fold_error(freed, squares, angle, shift, rounding) == pytest.approx(whole, rel=1e-4)


@pytest.mark.kernels
def test_a_fold_is_measured_where_it_is() -> None:
    """Planes that meet at a known angle: place, direction and angle, from samples to both sides of it."""
    rng = np.random.default_rng(1)
    for degrees in (30.0, 60.0, 90.0):
        slope = np.tan(np.radians(0.5 * degrees))
        xy = rng.uniform(-3, 3, (6000, 2))
        points = np.column_stack([xy, -slope * np.abs(xy[:, 0])])
        settings = Settings(length=1.0)
        cloud = PointCloud.from_array(points)
        tracer = Tracer(sample_surface(cloud, settings), settings)
        found = new_record(FOLD)
        for x in (-0.2, 0.0, 0.25):
            place = np.array([x, 0.3, -slope * abs(x)]) - cloud.origin
            sample = int(((tracer.surface.mean - place) ** 2).sum(axis=1).argmin())
            assert fit_fold(tracer.surface, sample, tuple(place), (0.0, 0.0, 0.0), 0.8, tracer.buffer, found)
            assert np.abs((found.place + cloud.origin)[[0, 2]]).max() < 0.02
            assert abs(found.ahead[1]) > 0.999 and np.degrees(found.bend) == pytest.approx(degrees, abs=5.0)
            assert found.gain > 1000 and found.off < 0.02


def test_ridges_are_found_once_for_the_same_samples_and_settings() -> None:
    settings = Settings(length=SIZE)
    samples = sample_surface(PointCloud.from_array(box()), settings)
    first, again = (find_ridges(samples, settings) for _ in range(2))
    assert len(first) == 12
    assert all(one is other for one, other in zip(first, again, strict=True))
    first.clear()  # what a caller does with the list is its own business
    assert len(find_ridges(samples, settings)) == 12
    assert find_ridges(samples, settings.replace(ridge_angle=120.0)) == []


def test_only_ridges_of_the_pieces_that_get_a_grid_are_followed() -> None:
    both = np.concatenate([box(), 0.9 * box() + [100.0, 0.0, 0.0]])
    for piece, middle in (("1", 0.0), ("2", 100.0)):
        settings = Settings(length=SIZE, piece=piece)
        ridges = wanted_ridges(sample_surface(PointCloud.from_array(both), settings), settings)
        assert len(ridges) == 12
        places = np.concatenate([ridge.places for ridge in ridges])
        origin = PointCloud.from_array(both).origin
        assert np.abs(places[:, 0] + origin[0] - middle).max() < 20.0
    everything = Settings(length=SIZE, piece="all")
    assert len(wanted_ridges(sample_surface(PointCloud.from_array(both), everything), everything)) == 24


def test_a_ring_closes_though_it_comes_back_a_little_beside_its_start() -> None:
    """A noisy drum: the first place of a trace lies a fifth of a member aside, and the trace once went round seventy times."""
    surface = edged_surface(7019)
    settings = Settings(length=surface.length)
    ridges = find_ridges(sample_surface(PointCloud.from_array(surface.points), settings), settings)
    rings = [ridge.places for ridge in ridges if ridge.ring]
    assert len(rings) >= 1
    for places in rings:
        radius = np.linalg.norm(places - places.mean(axis=0), axis=1).mean()
        around = np.linalg.norm(np.roll(places, -1, axis=0) - places, axis=1).sum()
        assert around < 1.05 * 2.0 * np.pi * radius


def bow(opening: float) -> PointCloud:
    """Two planes that meet at an angle in degrees; its stem is 1.2 long."""
    rng = np.random.default_rng(8)
    along, up, side = rng.uniform(0, 4, 30_000), rng.uniform(0, 1.2, 30_000), rng.choice([-1.0, 1.0], 30_000)
    half = np.radians(0.5 * opening)
    points = np.column_stack([along * np.cos(half), side * along * np.sin(half), up])
    return PointCloud.from_array(points + rng.normal(0.0, 0.002, points.shape))


@pytest.mark.parametrize("length", [0.6, 0.7])
def test_an_acute_stem_is_a_ridge_though_it_is_short(length: float) -> None:
    """Triangles ran across it, inside the bow. A blunt one of that length is none."""
    settings = Settings(length=length)
    cloud = bow(80.0)
    (stem,) = find_ridges(sample_surface(cloud, settings), settings)
    assert np.abs(stem.places[:, :2]).max() < 0.15 * length and np.ptp(stem.places[:, 2]) > 0.9
    assert not find_ridges(sample_surface(bow(125.0), settings), settings)


def test_a_ridge_that_curls_up_to_a_tip_ends_in_its_corner() -> None:
    """The straight continuation of a hip leaves the scan before the tip of its eaves, which was cut off by a third of a member."""
    rng = np.random.default_rng(2)
    x, y = rng.uniform(-20.0, 20.0, (2, 60_000))
    far, near = np.maximum(np.abs(x), np.abs(y)) / 20.0, np.minimum(np.abs(x), np.abs(y)) / 20.0
    points = np.column_stack([x, y, 14.0 + 16.0 * (1.0 - far) ** 1.5 + 3.0 * far**4 * near**4])
    cloud, settings = PointCloud.from_array(points + rng.normal(0.0, 0.012, points.shape)), Settings(length=4.2)
    samples, boundary = find_boundary(sample_surface(cloud, settings), settings)
    boundary, constraints = find_constraints(samples, boundary, settings)
    assert sum(line.ridge for line in constraints.lines.whole) >= 4
    tips = np.array([[x, y, 17.0] for x in (-20.0, 20.0) for y in (-20.0, 20.0)]) - cloud.origin
    away = np.linalg.norm(boundary.loops[0].corners[:, None] - tips, axis=2).min(axis=0)
    assert away.max() < 0.1 * settings.length


# half width and height of a square pier of 40 edges, from its foot to its top: plinth, splay, shaft, splay, capital
PROFILE_OF_PIER = ((6.0, 0.0), (6.0, 4.0), (4.5, 5.5), (4.5, 16.0), (6.0, 18.0), (6.0, 21.0), (0.0, 21.0))
EDGES_OF_PIER = 308.0  # length of all of them


def pier(points_per_area: float = 9.0, noise: float = 0.02) -> np.ndarray:
    """Points (N, 3) on a pier that is open below."""
    rng, sides = np.random.default_rng(0), []
    for (below, low), (above, high) in pairwise(PROFILE_OF_PIER):
        height = np.hypot(above - below, high - low)
        up = rng.uniform(0.0, 1.0, int(8.0 * max(below, above) * height * points_per_area))
        half = below + (above - below) * up
        across = rng.uniform(-1.0, 1.0, len(up)) * max(below, above)
        off = noise * rng.normal(size=len(up))
        out, rise = (high - low) / height, (below - above) / height
        side = np.column_stack([half + out * off, across, low + (high - low) * up + rise * off])[np.abs(across) <= half]
        turn = rng.integers(0, 4, len(side)) * (0.5 * np.pi)
        x, y = (
            np.cos(turn) * side[:, 0] - np.sin(turn) * side[:, 1],
            np.sin(turn) * side[:, 0] + np.cos(turn) * side[:, 1],
        )
        sides.append(np.column_stack([x, y, side[:, 2]]))
    return np.concatenate(sides)


@compiled_only
def test_a_body_with_many_edges_is_not_rough() -> None:
    """After half of its edges twelve places in a row at their corners look folded: from there on blunt and short ones were given up."""
    found = sum(length_along(ridge.places) for ridge in ridges_of(pier(), 1.4))
    assert found > 0.6 * EDGES_OF_PIER


@pytest.mark.parametrize("seed", [6, 1, 4])
def test_the_ridge_of_a_sharp_valley_runs_from_edge_to_edge(seed: int) -> None:
    """Its samples lie on both sides, some of them all three tenths of a member and more off the line: it ended there."""
    random = np.random.default_rng(seed)
    x, y = random.uniform(-2, 2, 9000), random.uniform(0, 10, 9000)
    points = np.column_stack([x, y, 1.5 * np.abs(x)]) + 0.008 * random.normal(size=(9000, 3))
    (valley,) = ridges_of(points, 1.3)
    assert length_along(valley.places) > 9.7
