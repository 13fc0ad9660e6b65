"""A dense scan that is smooth has larger samples; one with a ridge, noise, outliers or a second sheet near by has not."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings, strategies
from small_clouds import ball, cap, samples_of, sheet
from steps import steps_of
from typed import known

import scantruss as st
from scantruss.kernels.boundary.loops import come_nearer
from scantruss.kernels.surface.normals import mark_uneven
from scantruss.settings import SAMPLE_SPACING, SMOOTH_SAMPLE_SPACING
from scantruss.surface.chosen_samples import SPARSE_SPACING
from scantruss.surface.linked_samples import link_samples, refined
from scantruss.surface.samples import SurfaceSamples, sample_surface, samples_with, with_whole_boundary


def apart(samples: SurfaceSamples) -> float:
    """How far apart the samples are: the smallest distance that they keep [member lengths]."""
    return samples.surface.radius


def roof(angle: float, length: float, points: int, seed: int = 0) -> np.ndarray:
    """Two plates 12 wide that meet at an angle [degree] along a ridge, so many points on each square of a member."""
    rng = np.random.default_rng(seed)
    half, count = np.radians(angle) / 2, int(points * 12 * length)
    u, v = rng.uniform(-6, 6, count), rng.uniform(-length / 2, length / 2, count)
    return np.column_stack([u * np.cos(half), v, -abs(u) * np.sin(half)])


SMOOTH = {
    "plate": lambda: sheet(8, 8, 0.05),
    "noisy plate": lambda: sheet(8, 8, 0.05, noise=0.01),
    "dome": lambda: cap(3.0, 1.2, 0.06),
    "ball": lambda: ball(3.0, 40_000),
    "small ball": lambda: ball(1.8, 20_000),
}
OTHER = {
    "sparse plate": lambda: sheet(8, 8, 1.6 * SPARSE_SPACING),
    "ridge": lambda: roof(40, 12, 250),
    "short ridge": lambda: np.concatenate([roof(45, 4, 250), sheet(8, 8, 0.05) + [30, 0, 0]]),
    "thick plate": lambda: sheet(8, 8, 0.05, noise=0.15),
    "two plates": lambda: np.concatenate([sheet(8, 8, 0.05), sheet(8, 8, 0.05, seed=1) + [0, 0, 0.5]]),
    "strays": lambda: np.concatenate([sheet(8, 8, 0.05), np.random.default_rng(0).uniform(-8, 8, (40, 3))]),
}


@pytest.mark.parametrize("name", SMOOTH)
def test_a_smooth_scan_has_larger_samples(name: str) -> None:
    samples = samples_of(SMOOTH[name]())
    assert samples.smooth and apart(samples) == pytest.approx(SMOOTH_SAMPLE_SPACING)
    finer = samples_of(SMOOTH[name](), box_size=SAMPLE_SPACING)
    assert not finer.smooth and apart(finer) == pytest.approx(SAMPLE_SPACING)
    assert len(finer.surface.mean) > 1.8 * len(samples.surface.mean)


@pytest.mark.parametrize("name", OTHER)
def test_any_other_scan_has_the_usual_ones(name: str) -> None:
    """They are, to the byte, those that are asked for by their size."""
    points = OTHER[name]()
    samples, asked = samples_of(points), samples_of(points, box_size=SAMPLE_SPACING)
    assert not samples.smooth
    assert samples.surface.mean.tobytes() == asked.surface.mean.tobytes()
    assert samples.outliers == asked.outliers


@pytest.mark.parametrize("angle", [42, 50, 70, 110])
@pytest.mark.parametrize("seed", range(3))
def test_no_ridge_is_missed_because_a_scan_looks_smooth(angle: int, seed: int) -> None:
    """One as long as the shortest that is looked for, in a plain scan."""
    steps = steps_of(st.PointCloud.from_array(roof(angle, 3.5, 300, seed)), st.Settings(length=1.0))
    assert not steps.samples.smooth and steps.constraints.lines.sharp.sum() == 1


def test_flatter_ridges_that_are_asked_for_are_seen() -> None:
    points = roof(30, 12, 300)
    assert samples_of(points).smooth
    assert not samples_of(points, ridge_angle=25.0).smooth
    assert samples_of(points, ridge_angle=0.0).smooth  # none is looked for


@pytest.mark.kernels
@settings(max_examples=10)
@given(strategies.integers(0, 10_000), strategies.floats(2.0, 60.0))
def test_uneven_samples_are_those_of_a_plain_loop(seed: int, angle: float) -> None:
    """The normal of a neighbour, mirrored at the plane half-way, against that of the sample; the sign of neither counts."""
    rng = np.random.default_rng(seed)
    points = np.column_stack([rng.uniform(0, 3, (150, 2)), 0.1 * rng.normal(size=150)])
    found, least = link_samples(points, 0.3, 1.0, 0.2), float(np.cos(np.radians(angle)))
    marks = np.zeros(len(found.mean), np.bool_)
    mark_uneven(found.mean, found.normals, found.neighbors, least, marks, 0, len(marks))
    expected = []
    for s, row in enumerate(found.neighbors):
        cosines = [1.0]
        for n in row[row >= 0]:
            ahead = found.mean[n] - found.mean[s]
            mirror = np.eye(3) - 2 * np.outer(ahead, ahead) / (ahead @ ahead)
            cosines.append(abs(found.normals[s] @ mirror @ found.normals[n]))
        expected.append(min(cosines) < least)
    assert marks.tolist() == expected


@pytest.mark.parametrize("effort", ["quick", "normal"])
def test_the_grid_of_larger_samples_lies_on_the_scan_as_that_of_the_usual_ones(effort: str) -> None:
    """Noisy domes: the same topology; nodes no farther from the true sphere, boundary nodes no farther from the true circle."""
    dome, off, rim = cap(6.0, 0.9, 0.06), [], []
    for seed, size in product(range(3), (None, SAMPLE_SPACING)):
        points = dome + 0.01 * np.random.default_rng(seed).normal(size=dome.shape)
        grid = st.grid_from_points(points, st.Settings(length=1.0, effort=effort, box_size=size))
        assert (grid.topology.boundary_loops, grid.topology.euler) == (1, 1) and known(grid.certificate).passed
        nodes = grid.nodes + grid.origin
        off.append(abs(np.linalg.norm(nodes, axis=1) - 6.0).mean())
        ends = nodes[np.unique(grid.edges[grid.edge_uses == 1])]
        rim.append(abs(np.hypot(ends[:, 0], ends[:, 1]) - 6.0 * np.sin(0.9)).mean())
    assert sum(off[::2]) < 1.05 * sum(off[1::2])
    assert sum(rim[::2]) < 1.25 * sum(rim[1::2])


@pytest.mark.kernels
def test_places_find_the_sample_nearest_to_them_from_any_near_by() -> None:
    surface = samples_of(sheet(4, 4, 0.1), box_size=0.4).surface
    rng = np.random.default_rng(0)
    places = np.column_stack([rng.uniform(-1.8, 1.8, (60, 2)), np.zeros(60)])
    nearest = np.linalg.norm(surface.mean - places[:, None], axis=2).argmin(axis=1)
    samples = surface.neighbors[nearest, 0].copy()
    come_nearer(surface, places, samples)
    assert samples.tolist() == nearest.tolist()


def test_what_is_made_up_over_a_hole_leaves_the_rest_as_it_was_thinned() -> None:
    """A dense plate; what is added is no smooth surface. All points near the boundary are still found, and no larger samples tried."""
    cloud, settings = st.PointCloud.from_array(sheet(8, 8, 0.015)), st.Settings(length=1.0)
    samples = sample_surface(cloud, settings)
    assert samples.smooth and samples.whole is not None and len(samples.surface.points) < 0.1 * len(cloud.points)
    rng = np.random.default_rng(1)
    rough = rng.uniform(-0.5, 0.5, (4000, 3)) * [1, 1, 0.6]
    filled = samples_with(samples, rough, settings)
    assert not filled.smooth and filled.sample_spacing == samples.sample_spacing
    rim = np.column_stack([np.full(80, 4.0), np.linspace(-4, 4, 80), np.zeros(80)]) - cloud.origin
    all_points = with_whole_boundary(filled, filled.surface, rim).points
    taken = set(map(tuple, all_points.tolist()))
    assert len(taken) == len(all_points)  # none twice
    near = abs(cloud.points[:, 0] + cloud.origin[0] - 4.0) < samples.sample_spacing
    assert near.sum() > 500 and set(map(tuple, cloud.points[near].tolist())) <= taken


def test_a_body_without_the_underside_of_its_base_faces_outwards() -> None:
    """The base is so wide that most of its volume is not seen from the middle of the scan: a figure on a plinth was inside out."""
    rng = np.random.default_rng(4)
    turn, base, column = 2 * np.pi * rng.random(40_000), 5.0 * np.sqrt(rng.random(14_000)), 26.0 * rng.random(20_000)
    plinth = np.column_stack([base * np.cos(turn[:14_000]), base * np.sin(turn[:14_000]), np.full(14_000, 0.3)])
    rim = np.column_stack(
        [5.0 * np.cos(turn[14_000:20_000]), 5.0 * np.sin(turn[14_000:20_000]), 0.3 * rng.random(6000)]
    )
    around = turn[20_000:]
    shaft = np.column_stack([np.cos(around), np.sin(around), 0.3 + column])
    top = np.sqrt(rng.random(1500))
    lid = np.column_stack([top * np.cos(turn[:1500]), top * np.sin(turn[:1500]), np.full(1500, 26.3)])
    outer = plinth[np.hypot(plinth[:, 0], plinth[:, 1]) > 1.0]
    samples = sample_surface(
        st.PointCloud.from_array(np.concatenate([outer, rim, shaft, lid])), st.Settings(length=0.8)
    )
    mean, normals = samples.surface.mean + samples.origin, samples.surface.normals
    on_shaft = (mean[:, 2] > 2.0) & (mean[:, 2] < 25.0)
    assert ((normals[on_shaft, :2] * mean[on_shaft, :2]).sum(axis=1) > 0.0).all()
    on_base = (np.abs(mean[:, 2] - 0.3) < 0.1) & (np.abs(np.hypot(mean[:, 0], mean[:, 1]) - 3.0) < 0.8)
    assert on_base.any() and (normals[on_base, 2] > 0.9).all()


def test_no_sample_is_without_a_point_where_finer_ones_lie_beside_it() -> None:
    """Samples that were moved off a rough layer lie farther from their points than finer ones do."""
    rng = np.random.default_rng(3)
    points = sheet(6, 6, 0.05, noise=0.02)
    found = link_samples(points, 0.2, 1.0, 0.05)
    coarse = rng.random(len(found.mean)) < 0.7
    moved = found._replace(mean=found.mean + (0.0, 0.0, 0.19))
    finer = refined(moved, points, coarse, 0.1, 1.0, 0.05)
    many = np.diff(finer.start)
    assert many.min() > 0
    assert many.sum() == len(points)
    assert np.array_equal(many, np.bincount(finer.owner, minlength=len(many)))
