"""Sharp ridges of the scan: found where there are some, straight and in place, and nowhere else."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from marks import compiled_only
from numpy.typing import ArrayLike
from shapes import make
from steps import steps_of
from typed import known

from scantruss import Grid, PointCloud, Settings, candidates, grid_from_points
from scantruss.check.certify import certified
from scantruss.constraints.ridges import Tracer, find_ridges, is_ridge, join_ends
from scantruss.errors import FrontError
from scantruss.kernels.geometry.quadric import COLUMNS, WEIGHT
from scantruss.kernels.surface.ridges import FOUND, TERMS, fit_fold, fold_error, turned_frame
from scantruss.surface.samples import sample_surface

SIZE = 5.0  # member length of all shapes here


def groin(count: int = 40_000, radius: float = 40.0, half: float = 28.0, noise: float = 0.02) -> np.ndarray:
    """Two barrel vaults that cross: ridges along both diagonals, which fade towards the middle."""
    rng = np.random.default_rng(3)
    xy = rng.uniform(-half, half, (count, 2))
    z = np.maximum(*np.sqrt(radius**2 - xy**2).T)
    return np.column_stack([xy, z]) + noise * rng.normal(size=(count, 3))


def box(count: int = 40_000, half: float = 15.0, noise: float = 0.02) -> np.ndarray:
    """A cube: twelve ridges that meet by three."""
    rng = np.random.default_rng(4)
    places = rng.uniform(-half, half, (count, 3))
    places[np.arange(count), rng.integers(0, 3, count)] = rng.choice([-half, half], count)
    return places + noise * rng.normal(size=places.shape)


def ridges_of(points: np.ndarray, length: float = SIZE, **others: Any) -> list[tuple[np.ndarray, bool]]:
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
        places, _ = found
        ends = shape.corners[[1, 4]]
        ahead = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
        off = np.linalg.norm(np.cross(places - ends[0] - _origin(shape.points), ahead), axis=1)
        assert off.mean() < 0.05 * SIZE and np.ptp(places @ ahead) > 0.9 * 60


def _origin(points: np.ndarray) -> np.ndarray:
    return -PointCloud.from_array(points).origin


@compiled_only
def test_a_grid_that_fails_with_its_ridges_is_made_without(monkeypatch: pytest.MonkeyPatch) -> None:
    shape = make("gable", 20_000)

    def refuse_lines(grid: Grid, *others: Any) -> Grid:
        if len(grid.lines):
            raise FrontError("no", grid)
        return certified(grid, *others)

    monkeypatch.setattr(candidates, "certified", refuse_lines)
    grid = grid_from_points(shape.points, Settings(length=shape.length))
    assert len(grid.lines) == 0 and known(grid.settings).ridge_angle == 0.0


def folds(count: int = 30, angle: float = 60.0, wiggle: float = 0.0, jitter: float = 0.0, gain: float = 1000.0) -> Any:
    """A row of folds a quarter member apart, as `Tracer` finds them."""
    rng = np.random.default_rng(5)
    found = np.zeros((count, FOUND))
    found[:, 0] = 0.25 * np.arange(count)
    found[:, 1] = wiggle * rng.normal(size=count)
    found[:, 6] = np.radians(angle + jitter * rng.normal(size=count))
    found[:, 7] = gain
    return found


def test_what_is_short_blunt_or_uneven_is_no_ridge() -> None:
    asked = np.radians(40.0)
    assert is_ridge(folds(), asked)
    assert not is_ridge(folds(count=11), asked)
    assert not is_ridge(folds(angle=39.0), asked)
    assert not is_ridge(folds(angle=140.0), asked)  # a sheet that turns back
    assert not is_ridge(folds(wiggle=0.02), asked)
    assert not is_ridge(folds(jitter=3.0), asked)
    assert is_ridge(folds(jitter=3.0, gain=40.0), asked)  # what the noise explains


def test_ends_that_face_each_other_or_one_corner_are_joined() -> None:
    def row(a: ArrayLike, b: ArrayLike) -> np.ndarray:
        return np.array(a) + np.linspace(0, 1, 20)[:, None] * (np.array(b, float) - a)

    (whole,) = join_ends([row((0, 0, 0), (5, 0, 0)), row((12, 0.1, 0), (7, 0, 0))], 1.0)
    assert sorted([whole[0, 0], whole[-1, 0]]) == [0, 12] and len(whole) == 40
    assert len(join_ends([row((0, 0, 0), (5, 0, 0)), row((7, 0, 0), (7, 5, 0))], 1.0)) == 2
    met = join_ends([row((5, 0, 0), (1, 0, 0)), row((0, 5, 0), (0, 1, 0)), row((0, 0, 5), (0, 0, 0.5))], 1.0)
    assert len(met) == 3 and all(np.linalg.norm(line, axis=1).min() < 1e-9 for line in met)


@pytest.mark.kernels
@given(st.integers(0, 10_000), st.booleans())
def test_the_error_of_a_fold_is_that_of_least_squares(seed: int, folded: bool) -> None:
    rng = np.random.default_rng(seed)
    buffer = np.zeros((60, COLUMNS))
    buffer[:, :3] = rng.uniform(-1, 1, (60, 3)) * [0.8, 0.8, 0.3]
    buffer[:, WEIGHT] = rng.uniform(0.1, 1, 60)
    shift = rng.uniform(-0.3, 0.3)
    frame = turned_frame((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), rng.uniform(-0.3, 0.3))
    c, e, n = map(np.array, frame)
    matrix = np.empty((TERMS, TERMS + 1))
    error = fold_error(buffer, 60, frame, shift, 1.0, folded, matrix)
    u, t, h = buffer[:, :3] @ c - shift, buffer[:, :3] @ e, buffer[:, :3] @ n
    last = [np.abs(u), u * np.abs(u)] if folded else [u**3]
    terms = np.stack([np.ones(60), t, t * t, u, u * u, u * t, *last], axis=1)
    root = np.sqrt(buffer[:, WEIGHT])
    solution, squares, *_ = np.linalg.lstsq(root[:, None] * terms, root * h, rcond=None)
    assert error == pytest.approx(float(squares[0]), rel=1e-4)
    assert np.allclose(matrix[: terms.shape[1], TERMS], solution, rtol=1e-3, atol=1e-3)


@pytest.mark.kernels
def test_a_fold_is_measured_where_it_is() -> None:
    """Planes that meet at a known angle: place, direction and angle, from sites to both sides of it."""
    rng = np.random.default_rng(1)
    for degrees in (30.0, 60.0, 90.0):
        slope = np.tan(np.radians(0.5 * degrees))
        xy = rng.uniform(-3, 3, (6000, 2))
        points = np.column_stack([xy, -slope * np.abs(xy[:, 0])])
        settings = Settings(length=1.0)
        cloud = PointCloud.from_array(points)
        tracer = Tracer(sample_surface(cloud, settings), settings)
        found = np.zeros(FOUND)
        for x in (-0.2, 0.0, 0.25):
            place = np.array([x, 0.3, -slope * abs(x)]) - cloud.origin
            sample = int(((tracer.surface.mean - place) ** 2).sum(axis=1).argmin())
            assert fit_fold(tracer.surface, sample, tuple(place), (0.0, 0.0, 0.0), 0.8, tracer.buffer, found)
            assert np.abs(found[[0, 2]] + cloud.origin[[0, 2]]).max() < 0.02
            assert abs(found[4]) > 0.999 and np.degrees(found[6]) == pytest.approx(degrees, abs=5.0)
            assert found[7] > 1000 and found[8] < 0.02
