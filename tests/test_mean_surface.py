"""The mean surface of a rough scan, and how far nodes lie from the points around them."""

from dataclasses import replace

import numpy as np
import pytest
from shapes import make
from small_clouds import cap, sheet
from small_grids import dome
from typed import known

import scantruss as st
from scantruss.attempts.table import Attempt, attempts
from scantruss.check.distances import offsets_from_points
from scantruss.grid.certificate import Certificate, Fault, LeftOut
from scantruss.kernels.geometry.boxes import new_boxes
from scantruss.kernels.geometry.quadric import TERMS_OF_PLANE, TERMS_OF_QUADRIC
from scantruss.kernels.surface.mean_surface import FIT_TURNS, KNOWN_TURNS, OFF_THE_FIT, mean_offsets, move_to_mean
from scantruss.kernels.surface.samples import put_all
from scantruss.scan.cloud import PointCloud, bounds_of
from scantruss.surface.mean_surface import RADIUS_OF_BALLS, mean_surface
from scantruss.surface.samples import sample_surface


def ball(seed: int, count: int, noise: float, radius: float = 4.0) -> np.ndarray:
    """Points on a sphere, with noise along the radius."""
    rng = np.random.default_rng(seed)
    way = rng.normal(size=(count, 3))
    way /= np.linalg.norm(way, axis=1)[:, None]
    found: np.ndarray = way * (radius + noise * rng.normal(size=count))[:, None]
    return found


def folded(half: float = 4.0) -> np.ndarray:
    """A plate with waves of one member, .6 members high, that lean over each other by as much."""
    rng = np.random.default_rng(3)
    x, y = rng.uniform(-half, half, (2, round(625 * (2 * half) ** 2)))
    phase = 2 * np.pi * x
    return np.stack([x + 0.3 * np.sin(phase), y, 0.3 * np.cos(phase)], axis=1)


@pytest.mark.kernels
@pytest.mark.parametrize("terms", [TERMS_OF_PLANE, TERMS_OF_QUADRIC])
def test_points_move_as_by_the_slow_twin(terms: int) -> None:
    rng = np.random.default_rng(0)
    points = ball(0, 300, 0.1, 1.0)
    boxes = new_boxes(*bounds_of(points), 1.0, len(points), len(points))
    put_all(boxes, points, np.arange(len(points)))
    which = rng.choice(len(points), 6, replace=False)
    moved = points[which].copy()
    move_to_mean(moved, points, boxes, 0.9, terms, 0, len(moved))
    for place, found in zip(points[which], moved, strict=True):
        d = points - place
        near = d[(d**2).sum(axis=1) <= 0.81]
        first = (1.0 - (near**2).sum(axis=1) / 0.81) ** 2
        weight = first.copy()
        for turn in range(FIT_TURNS):
            if turn < KNOWN_TURNS:
                centre = weight @ near / weight.sum()
                normal = np.linalg.eigh((near - centre).T * weight @ (near - centre))[1][:, 0]
            u = np.cross(normal, [1.0, 0.3, 0.2])
            u /= np.linalg.norm(u)
            a, b, h = near @ u, near @ np.cross(normal, u), near @ normal
            columns = [np.ones_like(a), a, b, a * a, a * b, b * b][:terms]
            root = np.sqrt(weight)[:, None]
            fit = np.linalg.lstsq(np.stack(columns, axis=1) * root, h * root[:, 0], rcond=None)[0]
            off = np.abs(h - np.stack(columns, axis=1) @ fit)
            weight = first / (1.0 + (off / (OFF_THE_FIT * (first @ off) / first.sum())) ** 2)
        assert np.linalg.norm(found - (place + fit[0] * normal)) < 1e-6


def test_a_smooth_scan_hardly_moves_and_roughness_vanishes() -> None:
    """A sphere of four members: the plane of the first pass cuts off R^2 / 8 r; noise of a tenth falls to less than a fifth."""
    smooth = np.linalg.norm(mean_surface(ball(1, 20_000, 0.0), 0.5, 1.0), axis=1)
    assert abs(smooth - 4.0).max() < (RADIUS_OF_BALLS * 0.5) ** 2 / (8 * 4.0)
    rough = np.linalg.norm(mean_surface(ball(1, 20_000, 0.1), 0.5, 1.0), axis=1)
    assert rough.std() < 0.02 and abs(rough.mean() - 4.0) < 0.02


def test_steps_that_fold_over_become_one_sheet_and_the_boundary_stays() -> None:
    points = folded()
    mean = mean_surface(points, 1.0, 1.0)
    inner = np.abs(mean[:, :2]).max(axis=1) < 3.0
    assert mean[inner, 2].std() < 0.1 * points[:, 2].std()
    assert np.allclose(bounds_of(mean)[0][:2], bounds_of(points)[0][:2], atol=0.15)


def test_a_scan_that_folds_over_gets_a_grid_of_its_mean_surface_and_the_settings_say_so() -> None:
    points, settings = folded(2.8), st.Settings(length=1.0, effort="quick")
    grid = st.grid_from_points(points, settings)
    made, found = known(grid.settings), known(grid.certificate)
    assert made.smooth_scale in (0.5, 1.0) and made.ridge_angle == 0.0 and found.passed
    inner = np.abs((grid.nodes + grid.origin)[:, :2]).max(axis=1) < 1.8
    assert grid.nodes[inner, 2].std() < 0.03 and abs(found.node_scatter - points[:, 2].std()) < 0.05
    with pytest.raises(st.ScanTrussError):
        st.grid_from_points(folded(2.0), settings.replace(smooth_scale=0.0))


def test_two_layers_that_became_one_are_still_reported() -> None:
    low = sheet(6, 6, 0.1)
    points = np.concatenate([low, low + np.array([0.03, 0.04, 0.3])])
    samples = sample_surface(PointCloud.from_array(points), st.Settings(length=1.0, smooth_scale=0.5))
    assert abs(samples.surface.mean[:, 2] - 0.15).mean() < 0.03
    distance, share = samples.layers
    assert abs(distance - 0.3) < 0.05 and share > 0.5


def test_two_sheets_are_never_made_one_unasked() -> None:
    """A sheet folded over at .6 members: its attempts are not smoothed, so it is refused rather than halved."""
    shape = make("fold_over", 20_000)
    tried = attempts(PointCloud.from_array(shape.points), st.Settings(length=shape.length))
    assert not any(attempt.settings.smooth_scale for attempt in tried)


def test_a_smooth_scan_is_not_smoothed() -> None:
    points, settings = cap(4.0, 1.0, 0.25), st.Settings(length=1.0)
    one, other = (st.grid_from_points(points, settings.replace(smooth_scale=scale)) for scale in (None, 0.0))
    assert one.nodes.tobytes() == other.nodes.tobytes() and one.triangles.tobytes() == other.triangles.tobytes()
    assert known(one.settings).smooth_scale is None


@pytest.mark.kernels
def test_bias_is_how_far_outside_of_the_nodes_the_points_lie_and_scatter_their_noise() -> None:
    points = ball(2, 40_000, 0.05)
    boxes = new_boxes(*bounds_of(points), 0.2, len(points), len(points))
    put_all(boxes, points, np.arange(len(points)))
    normals = ball(3, 50, 0.0, 1.0)
    bias, scatter = np.empty(50), np.empty(50)
    mean_offsets(3.9 * normals, normals, points, boxes, np.full(50, 1.0), bias, scatter, 0, 50)
    assert abs(bias - 0.1).max() < 0.02 and abs(scatter - 0.05).max() < 0.01


def test_a_node_without_points_around_it_has_no_bias() -> None:
    cloud, settings = PointCloud.from_array(sheet(4, 4, 0.1)), st.Settings(length=1.0)
    samples = sample_surface(cloud, settings)
    nodes = np.array([[0.0, 0.0, 9.0], [1.0, 0.0, 9.0], [0.0, 1.0, 9.0]])
    grid = st.Grid(nodes, np.array([[0, 1, 2]]), np.zeros(3, bool), cloud.origin)
    assert np.isnan(offsets_from_points(grid, samples, 1.0)[0]).all()


@pytest.mark.parametrize("smooth", [True, False])
def test_advice_says_what_the_grid_that_it_names_leaves_out(smooth: bool) -> None:
    part = LeftOut("far", 2100, 0.09, (1.0, 2.0, 3.5), 5.0, 9.0)
    lacks = Certificate("", 1.0, True, True, 1, 1, 1, 1, 1, 0, (Fault("cover", "leaves out 9% of the scan"),))
    grid = dome().replace(certificate=replace(lacks, missing=0.09, left_out=(part,)))
    settings = st.Settings(length=1.0, **({"smooth_scale": 0.5} if smooth else {"plain_body": True}))
    said = Attempt(settings).advice(st.CertificateError("fails", grid))
    assert said.endswith("passes, but 9% of the scan is not in it, most of it near (1, 2, 3.5)")
