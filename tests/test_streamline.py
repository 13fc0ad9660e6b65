"""One point of each small box where a scan is much denser than its grid needs."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st_
from shapes import make
from steps import boundary_of

import scantruss as st
from scantruss.runtime import parallel
from scantruss.scan.clean import streamline
from scantruss.scan.clean.streamline import is_dense, points_near, streamlined
from scantruss.scan.cloud import bounds_of
from scantruss.surface.samples import sample_surface


def slow(points: np.ndarray, size: float) -> list[int]:
    """The first point of each box, by a dictionary; boxes as search boxes divide the extent."""
    lower, extent = points.min(axis=0), np.ptp(points, axis=0)
    step = np.where(extent > 0.5 * size, extent / np.maximum(np.ceil(extent / size), 1), size)
    first: dict[tuple[int, ...], int] = {}
    for number, box in enumerate(np.floor((points - lower) * (1.0 / step)).astype(int).tolist()):
        first.setdefault(tuple(box), number)
    return sorted(first.values())


@pytest.mark.kernels
@given(st_.integers(0, 1000), st_.sampled_from([0.2, 0.5, 3.0]))
@settings(max_examples=10)
def test_the_first_point_of_each_box_stays(seed: int, size: float) -> None:
    points = np.random.default_rng(seed).uniform(0, 4, (400, 3)) * [1.0, 0.7, 0.01]
    assert streamlined(points, bounds_of(points), size).tolist() == slow(points, size)


@pytest.mark.parametrize("room", [1, 64, 1 << 16])
def test_the_same_points_stay_for_any_processors_and_room(monkeypatch: pytest.MonkeyPatch, room: int) -> None:
    points = np.random.default_rng(7).uniform(0, 1, (3000, 3))
    monkeypatch.setattr(streamline, "CHOSEN_POINTS_PER_THREAD", 500)
    monkeypatch.setattr(streamline, "LEAST_ROOM", room)
    monkeypatch.setattr(streamline, "MOST_ROOM", room)
    found = []
    for count in (1, 2, 5):
        monkeypatch.setattr(parallel, "processors", lambda count=count: count)
        monkeypatch.setattr(streamline, "processors", lambda count=count: count)
        found.append(streamlined(points, bounds_of(points), 0.1).tolist())
    assert found[0] == found[1] == found[2] == slow(points, 0.1)


def test_a_scan_as_dense_as_its_patches_need_is_taken_whole() -> None:
    assert not is_dense(0.5, 1.0) and is_dense(0.3, 1.0) and not is_dense(0.0, 1.0)
    shape = make("cloth", 20_000, seed=0)
    samples = sample_surface(st.PointCloud.from_array(shape.points), st.Settings(length=shape.length))
    assert len(samples.surface.points) == 20_000


def test_a_grid_of_a_dense_scan_is_that_of_the_surface() -> None:
    """Eight times as many points as patches take: fewer are kept, corners, boundary and surface are as true."""
    shape = make("l_plate", 300_000, seed=2)
    settings = st.Settings(length=1.5 * shape.length, effort="quick")
    cloud = st.PointCloud.from_array(shape.points)
    samples = sample_surface(cloud, settings)
    assert len(samples.surface.points) < 100_000
    grid = st.grid_from_points(shape.points, settings)
    assert (grid.topology.boundary_loops, grid.topology.euler) == (len(shape.loops), shape.euler)
    nodes = grid.nodes + grid.origin
    assert shape.distance(nodes).max() < 0.02 * settings.length
    for corner in shape.corners:
        assert np.linalg.norm(nodes - corner, axis=1).min() < 0.05 * settings.length


def test_the_rim_of_a_dense_scan_is_found_with_all_its_points() -> None:
    """A disc: its boundary lies no farther inside than that of a scan that is taken whole, though patches have few of the points."""
    rng = np.random.default_rng(5)
    angle, radius = rng.uniform(0, 2 * np.pi, 400_000), 10.0 * np.sqrt(rng.uniform(0, 1, 400_000))
    points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros(400_000)])
    cloud, settings = st.PointCloud.from_array(points), st.Settings(length=2.0)
    samples = sample_surface(cloud, settings)
    assert samples.whole is not None and len(samples.surface.points) < 60_000
    (loop,) = boundary_of(cloud, settings).loops
    inside = 10.0 - np.linalg.norm((loop.points + cloud.origin)[:, :2], axis=1)
    assert -0.001 < inside.mean() < 0.012  # a spacing is .016


def test_points_near_some_places_are_all_listed() -> None:
    rng = np.random.default_rng(3)
    points, places = rng.uniform(0, 1, (5000, 3)), rng.uniform(0, 1, (7, 3))
    near = points_near(points, places, 0.05)
    away = np.linalg.norm(points[:, None] - places, axis=2).min(axis=1)
    assert set(np.flatnonzero(away <= 0.05)) <= set(near.tolist()) and len(near) < 1500
    assert (np.diff(near) > 0).all()
