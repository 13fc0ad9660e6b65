"""Sharp edges of bodies: where two sides meet at less than a right angle, samples face away from both."""

from __future__ import annotations

from dataclasses import replace

import naive
import numpy as np
import pytest
from marks import compiled_only
from numpy.typing import NDArray

import scantruss as st
from scantruss.attempts.better import follows_more_edges
from scantruss.attempts.table import attempts
from scantruss.grid.certificate import Fault
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


def pyramid(count: int, seed: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Points on a closed pyramid on five sides, whose sides meet its base at 48 degrees, and its six corners."""
    rng, turn = np.random.default_rng(seed), 2 * np.pi * np.arange(5) / 5
    corners = np.vstack([np.column_stack([np.cos(turn), np.sin(turn), 0 * turn]), [0.0, 0.0, 0.9]])
    sides = corners[np.array([*((k, (k + 1) % 5, 5) for k in range(5)), (0, 2, 1), (0, 3, 2), (0, 4, 3)])]
    one, other = sides[:, 1] - sides[:, 0], sides[:, 2] - sides[:, 0]
    area = np.linalg.norm(np.cross(one, other), axis=1)
    side = rng.choice(len(sides), count, p=area / area.sum())
    u, w = rng.random((2, count, 1))
    u, w = np.where(u + w > 1.0, 1.0 - u, u), np.where(u + w > 1.0, 1.0 - w, w)
    points = sides[side, 0] + u * one[side] + w * other[side]
    return np.asarray(points + 0.002 * rng.normal(size=points.shape)), corners


@compiled_only
@pytest.mark.parametrize("seed", [0, 2])
def test_all_edges_of_a_pyramid_are_chains(seed: int) -> None:
    """A grid across some of them passes too, or none does with the usual samples.

    They are no lips, which run along the middle of both sides.
    """
    points, corners = pyramid(8_000, seed)
    grid = st.grid_from_points(points, st.Settings(length=0.18, effort="quick"))
    assert grid.settings is not None and grid.settings.sharp_edges and len(grid.line_sets) == 10
    ends = [(k, (k + 1) % 5) for k in range(5)] + [(k, 5) for k in range(5)]
    whole = sum(np.linalg.norm(corners[a] - corners[b]) for a, b in ends)
    assert sum(each.length(grid) for each in grid.line_sets) == pytest.approx(whole, rel=0.03)
    nodes = grid.nodes + grid.origin
    on_edges = nodes[np.unique(np.concatenate([each.nodes for each in grid.line_sets]))]
    off = np.array([min(naive.distance_to_segment(node, corners[a], corners[b]) for a, b in ends) for node in on_edges])
    assert off.mean() < 0.03 * 0.18 and off.max() < 0.12 * 0.18
    assert grid.certificate is not None and grid.certificate.scan_distance is not None
    assert grid.certificate.scan_distance.p95 < 0.04 * 0.18


def test_a_grid_along_more_edges_is_taken_where_it_is_as_near_and_as_even() -> None:
    points, _ = pyramid(8_000, 1)
    grid = st.grid_from_points(points, st.Settings(length=0.4, effort="quick", sharp_edges=True))
    fewer = grid.replace(line_sets=grid.line_sets[:3])
    found = grid.certificate
    assert found is not None and found.scan_distance is not None and len(grid.line_sets) > 3
    assert follows_more_edges(grid, fewer) and not follows_more_edges(fewer, grid)
    assert not follows_more_edges(grid, grid)
    spread = replace(found.scan_distance, p99=1.2 * found.scan_distance.p99)
    for worse in (
        replace(found, scan_distance=spread),
        replace(found, missing=found.missing + 0.01),
        replace(found, warnings=(*found.warnings, Fault("angle", "", None), Fault("long", "", None))),
    ):
        assert not follows_more_edges(grid.replace(certificate=worse), fewer)
    uneven = grid.nodes.copy()
    uneven[::2] *= 1.2
    assert not follows_more_edges(grid.replace(nodes=uneven), fewer)
