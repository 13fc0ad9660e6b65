"""Points with nothing else of the scan near them are found, left out, and never count as surface."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some
from typed import known

import scantruss as st
from scantruss.check.distances import measure_distances
from scantruss.check.left_out import points_left_out
from scantruss.check.missed import largest_patch_missed
from scantruss.kernels.geometry.boxes import new_boxes
from scantruss.kernels.scan.lone import mark_lone
from scantruss.scan.clean.lone import find_lone
from scantruss.scan.cloud import bounds_of, measure_spacing
from scantruss.surface.samples import sample_surface


def sheet(count: int, strays: list[list[float]], seed: int = 1) -> np.ndarray:
    """Return random points of a level square of 10 by 10, and strays behind them."""
    rng = np.random.default_rng(seed)
    return np.concatenate([np.column_stack([rng.random((count, 2)) * 10.0, np.zeros(count)]), np.array(strays)])


def lone_of(points: np.ndarray) -> np.ndarray:
    return find_lone(points, bounds_of(points), measure_spacing(points), 3.0)


STRAYS = [[2.0, 2.0, 1.0], [5.0, 8.0, -2.0], [5.0, 8.02, -2.0], [12.0, 5.0, 0.0], [40.0, 5.0, 30.0]]


@pytest.mark.parametrize("count", [4_000, 300_000])
def test_lone_points_and_pairs_are_found_and_no_other(count: int) -> None:
    assert np.flatnonzero(lone_of(sheet(count, STRAYS))).tolist() == [*range(count, count + len(STRAYS))]


def test_points_that_repeat_are_not_lone_and_repeated_strays_are() -> None:
    points = np.repeat(sheet(4_000, STRAYS[:1]), 3, axis=0)
    assert np.flatnonzero(lone_of(points)).tolist() == [12_000, 12_001, 12_002]


def test_a_sparse_part_beside_a_dense_one_is_not_lone() -> None:
    """Its outermost points have dense ones beside them, but others as far apart too."""
    x, y = (axis.ravel() for axis in np.meshgrid(np.arange(20.0) + 100.0, np.arange(100.0, step=10.0)))
    dense = np.array([(i, j) for i in np.arange(100.0) for j in np.arange(100.0)])
    sparse = np.column_stack([(x - 100.0) * 10.0 + 109.0, y])
    points = np.column_stack([np.concatenate([dense, sparse]), np.zeros(len(dense) + len(sparse))])
    assert not lone_of(points).any()


def test_the_edge_of_a_grid_does_not_run_to_a_lone_point() -> None:
    points = sheet(12_000, [[10.5, 5.0, 0.3]])
    grid = st.grid_from_points(points, st.Settings(length=1.0, effort="quick"))
    assert grid.certificate is not None and not [w for w in grid.certificate.warnings if w.kind == "aside"]
    assert [(part.kind, part.points) for part in grid.certificate.left_out] == [("outliers", 1)]
    assert (grid.nodes + grid.origin)[:, 0].max() < 10.1


def test_a_node_on_a_lone_point_that_was_kept_lies_off_the_scan() -> None:
    points, settings = sheet(12_000, [[5.0, 5.0, 0.6]]), st.Settings(length=1.0, effort="quick", outlier_distance=0.0)
    samples = sample_surface(st.PointCloud.from_array(points), settings)
    assert samples.outliers == 0 and len(samples.measured_points) == len(points)
    grid = st.grid_from_points(points[:-1], settings)
    place = points[-1] - grid.origin
    nodes = grid.nodes.copy()
    node = int(np.linalg.norm(nodes - place, axis=1).argmin())
    nodes[node] = place
    found = measure_distances(replace(grid, nodes=nodes), replace(samples, origin=grid.origin), 1.0)
    assert found.nodes[node] == pytest.approx(0.6, abs=0.01)
    assert found.triangles.max() == pytest.approx(0.6, abs=0.05)


def test_cleaning_leaves_out_lone_points_where_it_looks_no_closer() -> None:
    points = sheet(30_000, STRAYS[:1])
    cleaned = st.clean_points(
        points, smooth=False, normals=False, duplicates=None, loose_pieces=None, layer_distance=None
    )
    assert [step.count for step in cleaned.steps if step.name == "outliers"] == [1]
    kept = st.clean_points(
        points,
        outlier_distance=0.0,
        smooth=False,
        normals=False,
        duplicates=None,
        loose_pieces=None,
        layer_distance=None,
    )
    assert len(kept.points) == len(points)


def test_what_is_missed_is_said_in_the_middle_of_its_largest_patch() -> None:
    """Not where the farthest point is, which may be a stray."""
    points = sheet(12_000, STRAYS)
    samples = sample_surface(st.PointCloud.from_array(points), st.Settings(length=1.0))
    distance = np.where(np.hypot(points[:, 0] - 7.0, points[:, 1] - 3.0) < 1.5, 0.8, 0.0)
    distance[-1] = 30.0
    place = largest_patch_missed(samples, distance, np.ones(len(points)), np.full(len(points), 0.5))
    assert place is not None and np.hypot(place[0] - 7.0, place[1] - 3.0) < 0.3
    assert largest_patch_missed(samples, 0.0 * distance, np.ones(len(points)), np.full(len(points), 0.5)) is None


def test_outliers_are_said_where_most_of_them_are_together() -> None:
    rng = np.random.default_rng(3)
    cluster = [2.0, 7.0, 4.0] + 0.05 * rng.normal(size=(5, 3))
    points = sheet(12_000, [*cluster.tolist(), *STRAYS])
    samples = sample_surface(st.PointCloud.from_array(points), st.Settings(length=1.0, judge_outliers="always"))
    away = np.abs(points[:, 2])
    found = points_left_out(samples, away, np.ones(len(points)), np.full(len(points), 0.5))
    part = next(part for part, _ in found if part.kind == "outliers")
    assert part.points == samples.outliers >= 10 and part.together == 5 and known(part.size) < 0.5
    assert np.linalg.norm(np.array(known(part.where)) - [2.0, 7.0, 4.0]) < 0.2


@pytest.mark.kernels
@settings(max_examples=40, deadline=None)
@given(some.integers(1, 60), some.floats(0.02, 0.6), some.floats(0.3, 3.0), some.integers(0, 3), some.integers(0, 999))
def test_points_with_few_others_near_are_those_of_all_distances(
    count: int, reach: float, box: float, most: int, seed: int
) -> None:
    points = np.random.default_rng(seed).uniform(size=(count, 3)).round(1)
    boxes = new_boxes(points.min(axis=0), points.max(axis=0), box * reach, count, count)
    lone = np.zeros(count, np.bool_)
    mark_lone(points, boxes, reach, most, lone)
    squares = ((points[:, None] - points) ** 2).sum(axis=2)
    assert (lone == ((squares <= reach * reach).sum(axis=1) <= most + 1)).all()
