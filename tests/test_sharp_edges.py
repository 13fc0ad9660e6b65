"""Sharp edges of bodies: where two sides meet at less than a right angle, samples face away from both."""

from __future__ import annotations

import numpy as np
import pytest
from marks import compiled_only
from numpy.typing import NDArray

import scantruss as st
from scantruss.attempts.table import attempts
from scantruss.surface.samples import sample_surface

LENGTH = 1.0


def lens(half_angle: float, noise: float = 0.0, seed: int = 0) -> NDArray[np.float64]:
    """Points of two flat cones, base on base: a body with one edge, a circle of radius 6, at which they meet at twice an angle [degree]."""
    rng, steep = np.random.default_rng(seed), np.tan(np.radians(half_angle))
    away, turn, side = (
        6.0 * np.sqrt(rng.random(16_000)),
        2 * np.pi * rng.random(16_000),
        rng.choice([-1.0, 1.0], 16_000),
    )
    points = np.column_stack([away * np.cos(turn), away * np.sin(turn), side * steep * (6.0 - away)])
    return np.asarray(points + noise * rng.normal(size=points.shape))


@pytest.mark.parametrize(("half_angle", "noise"), [(18.0, 0.0), (20.0, 0.01), (24.0, 0.02)])
def test_samples_on_an_edge_face_outwards_and_both_sides_away_from_each_other(half_angle: float, noise: float) -> None:
    samples = sample_surface(
        st.PointCloud.from_array(lens(half_angle, noise)), st.Settings(length=LENGTH, sharp_edges=True)
    )
    mean, normals = samples.surface.mean + samples.origin, samples.surface.normals
    outwards = mean[:, :2] / np.linalg.norm(mean[:, :2], axis=1)[:, None]
    inside = 6.0 - np.linalg.norm(mean[:, :2], axis=1)
    edge = samples.on_edge
    assert edge.sum() > 100 and inside[edge].max() < 0.6
    assert ((normals[edge, :2] * outwards[edge]).sum(axis=1) > 0.8).mean() > 0.95
    flank = inside > 0.7
    assert (np.sign(normals[flank, 2]) == np.sign(mean[flank, 2])).all()


def test_smooth_and_open_surfaces_have_no_sharp_edges() -> None:
    rng = np.random.default_rng(1)
    plan = 12.0 * rng.random((12_000, 2))
    for heights in (0.05 * plan[:, 0] ** 2, np.abs(plan[:, 0] - 6.0), 0.03 * rng.normal(size=12_000)):
        cloud = st.PointCloud.from_array(np.column_stack([plan, heights]))
        samples = sample_surface(cloud, st.Settings(length=LENGTH, sharp_edges=True))
        assert samples.on_edge.mean() < 0.005


def test_sharp_edges_are_tried_where_there_are_some() -> None:
    settings = st.Settings(length=LENGTH)
    tried = [attempt.settings.sharp_edges for attempt in attempts(st.PointCloud.from_array(lens(20.0)), settings)]
    assert tried[:3] == [False, False, True]


@compiled_only
def test_a_body_with_a_sharp_edge_gets_a_grid() -> None:
    grid = st.grid_from_points(lens(20.0, 0.01), st.Settings(length=LENGTH, effort="quick"))
    assert grid.certificate is not None and grid.certificate.passed
    assert (grid.topology.boundary_loops, grid.topology.euler) == (0, 2)
