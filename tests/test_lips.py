"""Lips of thin bodies, wide fillets and fillets under noise are followed by chains of members."""

from __future__ import annotations

import numpy as np
import pytest
from marks import compiled_only
from test_wide_ridges import ALL_TWELVE, HALF, SIZE, rounded_box

from scantruss import Grid, Settings, grid_from_points
from scantruss.constraints.ridges import find_ridges
from scantruss.grid.line_sets import RIDGE, sets_of
from scantruss.kernels.mesh.point_location import facing_sample
from scantruss.scan.cloud import PointCloud
from scantruss.surface.samples import sample_surface

RADIUS = 5.0  # of a bowl, in members of length 1


def bowl(wall: float, rounded: bool, noise: float = 0.0, count: int = 30_000) -> np.ndarray:
    """Points (N, 3) on a half ball with a wall, and a lip that is flat or round."""
    rng = np.random.default_rng(7)
    down = np.linspace(-0.5 * np.pi, 0.0, 80)
    middle, turn = RADIUS - 0.5 * wall, np.linspace(0.0, np.pi, 40)
    lip = np.column_stack([middle + 0.5 * wall * np.cos(turn), 0.5 * wall * np.sin(turn)])
    profile = np.concatenate(
        [
            RADIUS * np.column_stack([np.cos(down), np.sin(down)]),
            lip if rounded else np.array([[RADIUS, 0.0], [RADIUS - wall, 0.0]]),
            (RADIUS - wall) * np.column_stack([np.cos(down), np.sin(down)])[::-1],
        ]
    )
    steps = np.diff(profile, axis=0)
    weight = np.linalg.norm(steps, axis=1) * (profile[:-1, 0] + profile[1:, 0])
    k = rng.choice(len(steps), count, p=weight / weight.sum())
    across, up = (profile[k] + rng.random((count, 1)) * steps[k]).T
    around = rng.uniform(0.0, 2.0 * np.pi, count)
    places = np.column_stack([across * np.cos(around), across * np.sin(around), up])
    return places + noise * rng.normal(size=(count, 3))


def ridge_lengths(grid: Grid) -> list[float]:
    return [float(each["length"]) for each in sets_of(grid, RIDGE)]


@pytest.mark.parametrize(
    ("wall", "rounded", "noise"), [(0.5, False, 0.0), (0.5, True, 0.0), (0.5, False, 0.03), (0.8, True, 0.0)]
)
def test_a_narrow_lip_is_one_line_along_its_middle(wall: float, rounded: bool, noise: float) -> None:
    cloud = PointCloud.from_array(bowl(wall, rounded, noise))
    settings = Settings(length=1.0)
    samples = sample_surface(cloud, settings)
    (lip,) = find_ridges(samples, settings)
    places = lip.places + samples.origin
    assert lip.ring and lip.lip
    off = np.abs(np.linalg.norm(places[:, :2], axis=1) - (RADIUS - 0.5 * wall))
    assert np.quantile(off, 0.9) < 0.1
    assert np.abs(places[:, 2] - (0.5 * wall if rounded else 0.0)).max() < 0.15


@compiled_only
@pytest.mark.parametrize(("wall", "rounded", "noise"), [(0.5, True, 0.0), (0.5, False, 0.03), (0.8, True, 0.0)])
def test_a_bowl_has_its_lip_as_a_chain(wall: float, rounded: bool, noise: float) -> None:
    """It was refused with a wall of half a member, as nodes beside the lip went to the far side, and a round lip was a zigzag."""
    grid = grid_from_points(bowl(wall, rounded, noise), Settings(length=1.0))
    (length,) = ridge_lengths(grid)
    assert abs(length / (2.0 * np.pi * (RADIUS - 0.5 * wall)) - 1.0) < 0.03
    assert grid.quality.length_cv < 0.07 and grid.topology.boundary_loops == 0


def test_a_node_lies_on_the_side_of_a_wall_that_faces_as_it_does() -> None:
    cloud = PointCloud.from_array(bowl(0.5, False))
    samples = sample_surface(cloud, Settings(length=1.0))
    surface, place = samples.surface, np.array([0.0, RADIUS - 0.3, -1.0]) - samples.origin
    far, near = np.linalg.norm(surface.mean - place, axis=1), (0.0, 1.0, 0.0)
    inner = int(np.where(surface.normals @ near < -0.5, far, np.inf).argmin())
    found = facing_sample(surface, (place[0], place[1], place[2]), near, inner)
    assert surface.normals[found] @ near > 0.5
    assert facing_sample(surface, (place[0], place[1], place[2]), near, found) == found


@pytest.mark.parametrize("noise", [0.0, 0.03])
def test_the_edges_of_a_wide_lip_are_its_lines(noise: float) -> None:
    cloud = PointCloud.from_array(bowl(0.8, False, noise))
    settings = Settings(length=1.0)
    ridges = find_ridges(sample_surface(cloud, settings), settings)
    assert len(ridges) >= 2 and not any(ridge.lip for ridge in ridges)
    assert noise or all(ridge.ring for ridge in ridges)


@compiled_only
@pytest.mark.parametrize("noise", [0.02, 0.03 * SIZE])
def test_fillets_as_wide_as_a_member_are_edges(noise: float) -> None:
    """They turn by 57 degrees within a member; members that follow them without ridges cut no crest off."""
    points = rounded_box(SIZE, 50_000, noise)
    lengths = ridge_lengths(grid_from_points(points, Settings(length=SIZE)))
    assert len(lengths) == ALL_TWELVE and min(lengths) > 1.7 * HALF
