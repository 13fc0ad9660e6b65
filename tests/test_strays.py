"""Stray points are found, points of the surface are kept."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some
from scipy.spatial import cKDTree
from shapes import make

import scantruss as st
from scantruss.kernels import normals as facing
from scantruss.kernels import sites as kernels
from scantruss.scan import strays
from scantruss.scan.cloud import measure_gap
from scantruss.scan.sites import prepare_sites


def slow_look(points, distance):
    """One round by a tree of all points."""
    away, near = cKDTree(points).query(points, k=strays.AROUND + 1)
    reach = away[:, -1]
    limit = strays.FAR * measure_gap(points)
    return (reach > distance * np.median(reach[near[:, 1:]], axis=1)) | (reach > limit), reach < limit


@pytest.mark.parametrize("name", ["scallop", "cloth", "sphere", "two_holes"])
@pytest.mark.parametrize("share", [0.01, 0.1])
def test_strays_are_found_and_hardly_a_point_of_the_surface_is_lost(name, share):
    shape = make(name, 20_000, outliers=share)
    true = {point.tobytes() for point in make(name, 20_000).points}
    is_true = np.array([point.tobytes() in true for point in shape.points])
    stray = strays.find_strays(shape.points, 3.0)
    assert is_true.sum() == 20_000 or 0.9 < is_true.mean() < 1
    away, _ = cKDTree(shape.points[is_true]).query(shape.points)
    plain = ~is_true & (away > 4 * measure_gap(shape.points))  # what lies nearer to the surface is noise of it
    assert stray[plain].mean() > 0.98
    assert stray[~is_true].mean() > 0.85
    assert stray[is_true].mean() < 0.001


@settings(max_examples=15, deadline=None)
@given(some.integers(0, 1000), some.floats(1.5, 4.0), some.integers(0, 30))
def test_one_round_agrees_with_a_tree(seed, distance, far):
    rng = np.random.default_rng(seed)
    sheet = np.column_stack([rng.uniform(0, 10, (800, 2)), np.zeros(800)])
    points = np.concatenate([sheet, rng.uniform(-5, 15, (far, 3))])
    expected, settled = slow_look(points, distance)
    found = strays._look(points, distance)
    sure = settled | expected  # a neighbour out of sight counts as infinitely far, a tree knows how far it is
    assert np.array_equal(found[sure], expected[sure])


def test_a_scan_without_strays_is_not_searched(monkeypatch):
    def never(*_):
        raise AssertionError("looked for strays")

    monkeypatch.setattr("scantruss.scan.sites.find_strays", never)
    shape = make("scallop", 20_000)
    assert prepare_sites(st.PointCloud.from_array(shape.points), st.Settings(length=shape.length)).strays == 0


def test_strays_are_counted_left_out_and_kept_if_asked():
    shape = make("scallop", 20_000, outliers=0.05)
    cloud, own = st.PointCloud.from_array(shape.points), st.Settings(length=shape.length)
    cleaned = prepare_sites(cloud, own)
    assert 0.9 * 1000 < cleaned.strays < 1010
    assert len(cleaned.surface.points) == len(shape.points) - cleaned.strays
    kept = prepare_sites(cloud, own.replace(stray_distance=0.0))
    assert kept.strays == 0 and len(kept.surface.points) == len(shape.points)


def test_a_tenth_of_strays_does_not_change_the_topology():
    shape = make("scallop", outliers=0.1)
    grid = st.grid_from_points(shape.points, st.Settings(length=shape.length))
    assert (grid.topology.boundary_loops, grid.topology.euler, grid.topology.components) == (1, 1, 1)
    assert len(grid.boundary_loops) == len(shape.loops)


def test_few_or_coinciding_points_are_no_strays():
    assert not strays.find_strays(np.zeros((5, 3)), 3.0).any()
    assert not strays.find_strays(np.repeat(np.eye(3), 30, axis=0), 3.0)[:0].any()


def test_parts_of_the_sites_find_the_same_neighbours():
    points = np.random.default_rng(0).uniform(0, 1, (500, 3))
    boxes = strays.new_boxes(points.min(axis=0), points.max(axis=0), 0.2, 500, 500)
    kernels.put_all(boxes, points, np.arange(500))
    whole, parts = (np.full((500, 6), -1, np.int64) for _ in range(2))
    kernels.nearest_sites(points, boxes, 0.1, 0.5, whole, 0, 500)
    for begin, end in ((0, 7), (7, 300), (300, 500)):
        kernels.nearest_sites(points, boxes, 0.1, 0.5, parts, begin, end)
    assert np.array_equal(whole, parts)


@pytest.mark.parametrize("seed", range(3))
def test_distances_from_planes_agree_with_those_of_numpy(seed):
    """The plane of the nearest, fitted again without the quarter that lies farthest off it."""
    rng = np.random.default_rng(seed)
    points = np.column_stack([rng.uniform(0, 4, (60, 2)), 0.1 * rng.normal(size=60)])
    points[:6, 2] += 1.5
    near = cKDTree(points).query(points, k=17)[1][:, 1:]
    near[-1, 5:] = -1
    off, thickness = np.full((2, 60), 7.0)
    facing.distances_from_planes(points, near, off, thickness)
    for p in range(59):
        around = points[near[p]]
        normal = np.linalg.svd(around - around.mean(axis=0))[2][2]
        aside = np.abs((around - around.mean(axis=0)) @ normal)
        around = around[aside <= np.sort(aside)[11]]
        middle = around.mean(axis=0)
        normal = np.linalg.svd(around - middle)[2][2]
        assert off[p] == pytest.approx(abs((points[p] - middle) @ normal))
        assert thickness[p] == pytest.approx(np.sqrt((((around - middle) @ normal) ** 2).mean()))
    assert off[59] == thickness[59] == 7.0


@pytest.mark.parametrize("seed", [0, 3])
def test_strays_in_the_flat_box_of_a_terrain_are_told_apart(seed):
    """What stands off the ground by more than a gap is left out, or nearly all of it; the ground stays."""
    shape = make("terrain", 20_000, outliers=0.1, seed=seed)
    away = shape.distance(shape.points)
    true, far = away < 0.5, away > 1.5 * measure_gap(shape.points)
    stray = strays.find_strays(shape.points, 3.0, shape.length)
    assert far.sum() > 800
    assert stray[far].mean() > 0.97
    assert stray[true].mean() < 0.002
