"""Distances between a scan and a grid: against every triangle and every place."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some
from scipy.spatial import cKDTree
from small_grids import dome
from surfaces import distance_to_triangles
from typed import xyz

from scantruss.check.distances import boxes_of, distances_to_grid, feet_over, normals_of, shares_of_corners
from scantruss.kernels.geometry.triangles import distance_to_triangle
from scantruss.kernels.mesh.coverage import distances_on_triangles, nearest_distances
from scantruss.kernels.mesh.distances import plane_distances, triangle_boxes

pytestmark = pytest.mark.kernels


@settings(max_examples=20)
@given(some.integers(0, 10_000), some.sampled_from([0.0, 0.05, 1.0, 20.0]))
def test_the_nearest_of_all_triangles_is_found(seed: int, away: float) -> None:
    """On the grid, near it and far from it; places beyond its boundary too."""
    rng = np.random.default_rng(seed)
    grid, length = dome(5), 4.0
    corners = grid.nodes[grid.triangles]
    places = rng.permutation(corners.reshape(-1, 3))[:40] + away * length * rng.normal(size=(40, 3))
    slow = distance_to_triangles(places[:, None], *(corners[None, :, k] for k in range(3))).min(axis=1)
    found, nearest = distances_to_grid(places, grid, length)
    assert found == pytest.approx(slow, abs=1e-12 * (1 + away * length))
    at = distance_to_triangles(places, *(corners[nearest, k] for k in range(3)))
    assert at == pytest.approx(slow, abs=1e-12 * (1 + away * length))


def test_a_node_far_away_takes_no_room_and_the_nearest_triangle_is_found() -> None:
    """Its triangles are thousands of members long; entered in boxes of half a member they filled the memory."""
    grid, length = dome(5), 4.0
    nodes = grid.nodes.copy()
    nodes[0] += [3e3 * length, 2e3 * length, 1e3 * length]
    assert len(triangle_boxes(nodes, grid.triangles, 0.5 * length, 0.1 * length).triangle) <= 2000 * len(grid.triangles)
    corners = nodes[grid.triangles]
    places = np.concatenate([corners.mean(axis=1), np.random.default_rng(0).uniform(0.0, 1e3 * length, (20, 3))])
    slow = distance_to_triangles(places[:, None], *(corners[None, :, k] for k in range(3))).min(axis=1)
    found, _ = distances_to_grid(places, dataclasses.replace(grid, nodes=nodes), length)
    assert found == pytest.approx(slow, abs=1e-8 * length)


@settings(max_examples=20)
@given(some.integers(0, 10_000), some.sampled_from([0.1, 1.0, 30.0]))
def test_the_nearest_of_all_places_is_found(seed: int, spread: float) -> None:
    rng = np.random.default_rng(seed)
    places, others = rng.normal(size=(60, 3)), spread * rng.normal(size=(25, 3))
    found = np.empty(len(others))
    nearest_distances(others, places, boxes_of(places, 0.25), 0.5, found)
    assert found == pytest.approx(cKDTree(places).query(others)[0], rel=1e-12)


@settings(max_examples=20)
@given(some.integers(0, 10_000), some.sampled_from([0.1, 1.0, 30.0]), some.sampled_from([60, 2000]))
def test_all_over_triangles_they_are_to_the_byte_what_the_places_one_by_one_have(
    seed: int, spread: float, count: int
) -> None:
    """Of many places too few are near a triangle, or too many, to be compared with all points in it."""
    rng = np.random.default_rng(seed)
    places, corners, shares = rng.normal(size=(count, 3)), spread * rng.normal(size=(7, 3, 3)), shares_of_corners(9)
    found, slow = np.full((len(corners), len(shares)), -1.0), np.empty(len(corners) * len(shares))
    boxes = boxes_of(places, 0.25)
    distances_on_triangles(corners, shares, places, boxes, 0.5, found, 2, 6)
    nearest_distances(np.einsum("pc,tcx->tpx", shares, corners).reshape(-1, 3), places, boxes, 0.5, slow)
    assert (found[2:6] == slow.reshape(found.shape)[2:6]).all()
    assert (found[[0, 1, 6]] == -1.0).all()  # another part's


@settings(max_examples=20)
@given(some.integers(0, 10_000))
def test_heights_and_feet_over_triangles_are_those_of_plain_arrays(seed: int) -> None:
    rng = np.random.default_rng(seed)
    grid, points = dome(3), 5.0 * rng.normal(size=(40, 3))
    triangle = rng.integers(0, len(grid.triangles), 40)
    normal = normals_of(grid)[triangle]
    slow = ((points - grid.nodes[grid.triangles[triangle, 0]]) * normal).sum(axis=1)
    height, feet = feet_over(grid, triangle, np.asfortranarray(points))
    assert height == pytest.approx(slow, abs=1e-13)
    assert feet == pytest.approx(points - slow[:, None] * normal, abs=1e-13)


@given(some.integers(0, 10_000))
def test_the_distance_to_a_triangle_is_that_of_the_slow_twin(seed: int) -> None:
    rng = np.random.default_rng(seed)
    p, a, b, c = rng.integers(-3, 4, size=(4, 3)).astype(float)  # now and then flat, or one place
    found = distance_to_triangle(xyz(p), xyz(a), xyz(b), xyz(c))
    assert found == pytest.approx(float(distance_to_triangles(p, a, b, c)), abs=1e-12)


@settings(max_examples=20)
@given(some.integers(0, 10_000), some.sampled_from([0.0, 0.3, 30.0]), some.sampled_from([1, 30]))
def test_the_plane_of_the_nearest_points_is_that_of_least_squares(seed: int, spread: float, copies: int) -> None:
    """Far from the points too, and where dozens lie at one place: then the nearest of them counts."""
    rng = np.random.default_rng(seed)
    points = np.repeat(rng.normal(size=(40, 3)) * [1.0, 1.0, 0.1], copies, axis=0)
    places = rng.normal(size=(15, 3)) * [1.0, 1.0, 0.1] + spread * rng.normal(size=(15, 3))
    found, noise = np.empty(15), np.empty(15)
    plane_distances(places, points, boxes_of(points, 0.4), 12, 0.1, found, noise)
    away, which = cKDTree(points).query(places, k=12)
    if copies > 1:
        assert (found <= away[:, 0] + 1e-9).all() and (noise < 1e-7).all()
        return
    near = points[which] - points[which].mean(axis=1, keepdims=True)
    _, sizes, axes = np.linalg.svd(near)
    off = np.abs(np.einsum("qi,qi->q", places - points[which].mean(axis=1), axes[:, 2]))
    assert found == pytest.approx(np.minimum(off, away[:, 0]), abs=1e-7 * (1 + spread))
    assert noise == pytest.approx(sizes[:, 2] / np.sqrt(12), abs=1e-7)
