"""The cloud loses nothing, refuses what cannot be a surface, and knows its spacing."""

from __future__ import annotations

import subprocess
import sys
from typing import Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy.spatial import cKDTree

from scantruss.errors import InputError
from scantruss.kernels.geometry.bounds import POINTS_PER_BLOCK, move_points, widen_bounds
from scantruss.report.figures import cloud_lines
from scantruss.scan import cloud as clouds
from scantruss.scan.cloud import PointCloud, bounds_of, measure_spacing


def bowl(count: int, seed: int = 0) -> np.ndarray:
    """Return points on a shallow bowl, (count, 3)."""
    plan = np.random.default_rng(seed).uniform(-50, 50, (count, 2))
    return np.column_stack([plan, (plan**2).sum(axis=1) / 200])


def true_spacing(points: np.ndarray) -> float:
    """Return the median distance to the nearest distinct point, over all points."""
    distinct, times = np.unique(points, axis=0, return_counts=True)
    nearest = cKDTree(distinct).query(distinct, k=2)[0][:, 1]
    return float(np.median(np.repeat(nearest, times)))


@given(
    hnp.arrays(np.float64, (5, 3), elements=st.floats(-1, 1, width=32)),
    hnp.arrays(np.float64, 3, elements=st.floats(-1e9, 1e9)),
    st.sampled_from([1e-6, 1.0, 1234.5, 1e8]),
)
def test_every_coordinate_comes_back_to_the_last_bit(shape: np.ndarray, shift: np.ndarray, scale: float) -> None:
    points = np.vstack([np.eye(3), shape]) * scale + shift
    try:
        cloud = PointCloud.from_array(points)
    except InputError:
        return
    assert np.array_equal(cloud.points + cloud.origin, points)
    extent = np.ptp(points, axis=0).max()
    assert np.abs(cloud.points).max() <= 2.5 * extent


def test_national_grid_coordinates_move_to_a_round_origin_nearby() -> None:
    points = bowl(500) * 0.2 + [500_000, 4_500_000, 100]
    cloud = PointCloud.from_array(points, unit="m")
    assert np.abs(cloud.points).max() < 40
    assert np.array_equal(cloud.origin, np.round(cloud.origin))
    assert np.array_equal(cloud.points + cloud.origin, points)


def test_a_cloud_near_zero_keeps_its_coordinates() -> None:
    points = bowl(100)
    cloud = PointCloud.from_array(points)
    assert np.array_equal(cloud.origin, np.zeros(3))
    assert np.array_equal(cloud.points, points)
    assert not np.shares_memory(cloud.points, points)


@pytest.mark.parametrize("dtype", [np.float16, np.float32, np.float64, np.longdouble, np.int16, np.int64, np.uint8])
@pytest.mark.parametrize("order", ["C", "F"])
def test_any_number_type_becomes_ordered_float64(dtype: type, order: Literal["C", "F"]) -> None:
    points: np.ndarray = np.array([[0, 0, 0], [100, 0, 0], [0, 90, 0], [9, 9, 80]], dtype=dtype, order=order)
    cloud = PointCloud.from_array(points, unit="cm", name="a.ply")
    assert cloud.points.dtype == np.float64
    assert cloud.points.flags.c_contiguous
    assert np.array_equal(cloud.points + cloud.origin, points)
    assert (cloud.unit, cloud.name, cloud.dropped) == ("cm", "a.ply", 0)


def test_points_that_are_not_finite_are_dropped_and_counted() -> None:
    points = bowl(100)
    points[[3, 50, 99], [0, 1, 2]] = [np.nan, np.inf, -np.inf]
    cloud = PointCloud.from_array(points)
    assert cloud.dropped == 3
    assert np.array_equal(cloud.points + cloud.origin, np.delete(points, [3, 50, 99], axis=0))


def plane(count: int) -> np.ndarray:
    """Return points on a plane, (count, 3)."""
    return bowl(count) * [1, 1, 0]


@pytest.mark.parametrize(
    ("points", "words"),
    [
        (np.zeros((4, 2)), r"points must have shape \(N, 3\), got \(4, 2\)"),
        (np.zeros((4, 6)), r"points must have shape \(N, 3\), got \(4, 6\)"),
        (np.zeros(9), r"points must have shape \(N, 3\), got \(9,\)"),
        ([[1, 2, 3], [1, 2]], r"points must have shape \(N, 3\), got rows of different lengths"),
        (np.array([["a", "b", "c"]] * 4), "real numbers"),
        (np.zeros((4, 3), complex), "real numbers"),
        (np.zeros((0, 3)), "at least 3 points are needed, got 0"),
        (bowl(2), "at least 3 points are needed, got 2"),
        (np.full((10, 3), 7.5), "same place"),
        (np.outer(np.linspace(0, 5, 1000), [1, 2, 3]), "on a line"),
        (np.outer(np.linspace(0, 5, 100), [1, 2, 3]).round(6) + np.array([5e5, 4e6, 100]), "on a line"),
        (np.outer(np.linspace(0, 5, 100), [1, 2, 3]).astype(np.float32), "on a line"),
        (np.array([[0, 0, 0], [1, 0, 0], [1, 0, 0], [3, 0, 0]]), "on a line"),
        (np.where(np.arange(100)[:, None] < 60, np.nan, bowl(100)), "60 of 100 points have NaN or infinite"),
        (np.full((5, 3), np.nan), "5 of 5 points have NaN or infinite"),
        (plane(5) * 1e150, "smaller than"),
        (plane(5) * 1e-150, "same place"),
        (plane(5) * 1e-40, "as no scan does; .* its byte order wrong"),
        (plane(5) * 1e40, "as no scan does; .* its byte order wrong"),
        (bowl(1000).astype(">f4").view("<f4"), "farther away than half of the scan is wide, .* byte order"),
        (bowl(1000).astype(">f8").view("<f8"), "byte order"),
        (
            np.where(np.arange(1000)[:, None] < 11, -3.4e38, bowl(1000)),
            r"11 of 1,000 points .* up to 3.4e\+38; .* no-data",
        ),
    ],
)
def test_refusals_say_what_is_needed_in_one_line(points: np.ndarray, words: str) -> None:
    with pytest.raises(InputError, match=words) as caught:
        PointCloud.from_array(points, name="a.xyz")
    assert str(caught.value).startswith("a.xyz: ")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("value", [-3.4028235e38, 1e10, 1e300])
@pytest.mark.parametrize("shift", [0.0, 5e6])
def test_a_few_values_that_no_scan_has_are_left_out_and_said(value: float, shift: float) -> None:
    points = bowl(1000) + shift
    invalid = points.copy()
    invalid[[3, 500], 2] = value
    invalid[999] = value * np.array([1.0, -0.5, 0.3])
    cloud = PointCloud.from_array(invalid)
    assert np.array_equal(cloud.points + cloud.origin, np.delete(points, [3, 500, 999], axis=0))
    assert cloud.dropped == 0 and cloud.notes[0].startswith("3 points with coordinates up to")
    assert PointCloud.from_array(points).notes == ()


def test_far_points_that_a_scan_may_have_are_kept() -> None:
    points = bowl(1000)
    points[7] = [0.0, 1e6, 0.0]
    assert len(PointCloud.from_array(points).points) == 1000


def test_an_unknown_unit_is_refused() -> None:
    with pytest.raises(InputError, match="unit must be one of mm cm m inch foot, got 'yard'"):
        PointCloud.from_array(bowl(10), unit="yard")


@pytest.mark.parametrize("count", [3, 10, 1000, 100_000])
def test_a_plane_and_a_strip_two_rows_wide_are_not_a_line(count: int) -> None:
    row = np.arange(count)
    strip = np.column_stack([row * 0.5, row % 2, np.zeros(count)])
    assert len(PointCloud.from_array(strip).points) == count
    assert len(PointCloud.from_array(plane(count)).points) == count


def test_three_points_make_a_cloud() -> None:
    assert len(PointCloud.from_array(np.eye(3)).points) == 3


UNEVEN = np.vstack([bowl(30_000), bowl(45_000, 1) * [0.1, 0.1, 0.1]])


@pytest.mark.parametrize(
    "points",
    [
        bowl(10),
        bowl(1999),
        bowl(2001),
        bowl(60_000),
        UNEVEN,
        np.repeat(bowl(20_000), 3, axis=0),
        np.concatenate([bowl(20_000)] * 4),
        np.vstack([bowl(40_000), np.zeros((35_000, 3))]),
        np.vstack([bowl(40_000), np.random.default_rng(0).normal(0, 1e6, (400, 3))]),
        np.stack(np.meshgrid(np.arange(200.0), np.arange(200.0), [3.0]), axis=-1).reshape(-1, 3),
        np.random.default_rng(0).random((50_000, 3)),
        bowl(50_000) * 1e-5,
    ],
    ids=["few", "sample", "more", "many", "uneven", "tripled", "tiled", "heap", "outliers", "raster", "volume", "tiny"],
)
def test_spacing_is_that_of_a_tree_search(points: np.ndarray) -> None:
    spacing = measure_spacing(points)
    assert spacing == pytest.approx(true_spacing(points), rel=0.06)
    assert spacing == measure_spacing(points)


@given(hnp.arrays(np.int64, st.tuples(st.integers(2, 40), st.just(3)), elements=st.integers(-3, 3)))
def test_spacing_of_few_points_is_exact(lattice: np.ndarray) -> None:
    points = lattice.astype(float)
    distance = np.linalg.norm(points[:, None] - points[None], axis=2)
    nearest = np.where(distance > 0, distance, np.inf).min(axis=1)
    expected = float(np.median(nearest))
    assert measure_spacing(points) == pytest.approx(expected if np.isfinite(expected) else 0.0)


def test_spacing_grows_with_the_cloud() -> None:
    points = bowl(20_000)
    assert measure_spacing(points * 1000) == pytest.approx(1000 * measure_spacing(points))


@pytest.mark.parametrize("points", [np.zeros((0, 3)), np.zeros((1, 3)), np.ones((5000, 3))])
def test_spacing_is_zero_where_there_are_no_neighbours(points: np.ndarray) -> None:
    assert measure_spacing(points) == 0.0


def test_spacing_finds_the_few_points_beside_a_heap() -> None:
    points = np.zeros((50_000, 3))
    points[1] = [0, 3, 4]
    assert measure_spacing(points) == pytest.approx(5.0)


def test_importing_the_cloud_needs_numpy_only() -> None:
    code = "import sys, scantruss.scan.cloud; print(sorted({'numba', 'scipy', 'laspy', 'trimesh'} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("count", [8, 150, 20_000])
def test_the_gap_is_the_median_distance_to_the_sixth_neighbour(count: int) -> None:
    points = bowl(count)
    sixth = cKDTree(points).query(points, k=7)[0][:, 6]
    close = 1e-12 if count < clouds.POINTS_FOR_GAP else 0.15  # of many points only some are looked at
    assert PointCloud.from_array(points).gap == pytest.approx(float(np.median(sixth**2)) ** 0.5, rel=close)


@pytest.mark.parametrize("times", [1, 3])
def test_a_quick_look_counts_places_with_six_others_near(times: int) -> None:
    points = bowl(16)
    squares = ((points[:, None] - points) ** 2).sum(axis=2)
    near = np.sort(np.sqrt(squares), axis=1)[:, 6]
    repeated = np.repeat(points, times, axis=0)
    for reach in np.quantile(near, [0.0, 0.2, 0.5, 0.8, 1.0]) * (1.0 + 1e-9):
        looked = np.linspace(0, len(repeated) - 1, min(len(repeated), clouds.POINTS_FOR_SHARE)).astype(np.int64)
        expected = float((near[looked // times] <= reach).mean())
        assert clouds.share_with_six_near(repeated, float(reach)) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("times", [2, 4])
def test_points_that_are_stored_again_and_again_do_not_narrow_the_gap(times: int) -> None:
    points = bowl(16)
    repeated = np.repeat(points, times, axis=0)
    assert clouds.measure_gap(repeated) == pytest.approx(clouds.measure_gap(points), rel=1e-12)


def test_the_gap_of_a_triangular_pattern_is_its_spacing_and_is_measured_once(monkeypatch: pytest.MonkeyPatch) -> None:
    rows, columns = np.divmod(np.arange(3600), 60)
    cloud = PointCloud.from_array(np.column_stack([columns + 0.5 * (rows % 2), rows * 0.75**0.5, 0 * rows]))
    assert cloud.gap == pytest.approx(1.0, rel=1e-9)
    monkeypatch.setattr(clouds, "measure_gap", lambda _: -1.0)
    assert cloud.gap == pytest.approx(1.0, rel=1e-9)


@pytest.mark.kernels
@given(
    hnp.arrays(np.float64, st.tuples(st.integers(1, 40), st.just(3)), elements=st.floats(-1e6, 1e6)), st.integers(0, 40)
)
def test_bounds_of_parts_are_those_of_all(points: np.ndarray, at: int) -> None:
    bounds = np.array([[np.inf] * 3, [-np.inf] * 3])
    widen_bounds(points, bounds, 0, min(at, len(points)))
    widen_bounds(points, bounds, min(at, len(points)), len(points))
    assert (bounds[0] == points.min(axis=0)).all() and (bounds[1] == points.max(axis=0)).all()


@pytest.mark.kernels
@pytest.mark.parametrize("odd", [np.nan, np.inf, -np.inf])
def test_a_coordinate_that_is_not_finite_shows_in_the_bounds_of_its_axis(odd: float) -> None:
    points = np.random.default_rng(0).random((9, 3))
    points[4, 1] = odd
    lower, upper = bounds_of(points)
    assert np.isfinite(lower).tolist() == np.isfinite(upper).tolist() == [True, False, True]


@pytest.mark.kernels
def test_moved_points_and_their_sums_are_those_of_plain_arrays() -> None:
    points = np.random.default_rng(1).normal(size=(POINTS_PER_BLOCK + 100, 3)) + [10.0, 20.0, -5.0]
    origin = np.array([8.0, 16.0, -4.0])
    moved, sums = np.empty_like(points), np.empty((2, 9))
    move_points(points, origin, moved, sums, 0, 2)
    assert (moved == points - origin).all()
    products = moved.T @ moved
    assert sums[:, :3].sum(axis=0) == pytest.approx(moved.sum(axis=0))
    assert sums[:, 3:].sum(axis=0) == pytest.approx(products[[0, 0, 0, 1, 1, 2], [0, 1, 2, 1, 2, 2]])


def test_the_bounds_of_a_cloud_are_those_of_its_points() -> None:
    points = np.random.default_rng(2).random((500, 3)) * [1.0, 300.0, 7.0] + [4.5e5, 5.4e6, 100.3]
    cloud = PointCloud.from_array(points)
    assert (cloud.bounds[0] == cloud.points.min(axis=0)).all() and (cloud.bounds[1] == cloud.points.max(axis=0)).all()


def test_the_extent_is_without_points_far_away() -> None:
    points = np.concatenate([bowl(2000), [[9000.0, 0.0, 0.0], [0.0, 7000.0, 0.0]]])
    extent = cloud_lines(PointCloud.from_array(points))[1]
    assert "without 2 points far away" in extent and float(extent.split()[1]) < 100.1
    assert "far away" not in cloud_lines(PointCloud.from_array(points[:-2]))[1]
