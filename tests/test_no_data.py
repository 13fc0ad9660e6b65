"""A frame of no-data values around a raster is found, said and left out; a lake and a terrace are none."""

from __future__ import annotations

import numpy as np
import pytest
from shapes import make
from typed import known

import scantruss as st


def terrain(wide: int = 90, high: int = 70, roughness: float = 8.0) -> np.ndarray:
    x, y = (axis.ravel() for axis in np.meshgrid(np.arange(wide) * 1.0, np.arange(high) * 1.0))
    return np.column_stack([x, y, 690.0 + roughness * np.sin(x / 18) * np.cos(y / 15) + 0.01 * x])


def frame_of(points: np.ndarray, width: int = 2) -> np.ndarray:
    x, y = points[:, 0], points[:, 1]
    inside = (x >= width) & (x <= x.max() - width) & (y >= width) & (y <= y.max() - width)
    return ~inside


@pytest.mark.parametrize("value", [0.0, -9999.0, 681.0, 1200.0, 3.4e38, -1e30])
def test_a_frame_is_left_out_and_told_with_its_value(value: float) -> None:
    """Even where the value is hardly below the ground."""
    points = terrain()
    frame = frame_of(points)
    points[frame, 2] = value
    cloud = st.PointCloud.from_array(points)
    assert len(cloud.points) == (~frame).sum()
    assert cloud.left_out == (("with a height that stands for no data", frame.sum()),)
    assert any(f"{frame.sum()} points have exactly z = {value:g}, a value for no data" in note for note in cloud.notes)
    grid = st.grid_from_points(points, st.Settings(length=6.0, effort="quick"))
    assert known(grid.certificate).passed and grid.topology.boundary_loops == 1
    (part,) = known(grid.certificate).left_out
    assert part.points == frame.sum() and part.asked


def test_a_lake_stays() -> None:
    points = terrain(roughness=20.0)
    points[:, 2] = np.maximum(points[:, 2], 680.0)
    lake = points[:, 2] == 680.0
    assert 0.05 < lake.mean() < 0.4
    assert len(st.PointCloud.from_array(points).points) == len(points)


@pytest.mark.parametrize("name", ["terrain", "flat_plate", "gable", "scallop"])
def test_a_scan_that_is_no_raster_stays_whole(name: str) -> None:
    points = make(name, 5000).points.copy()
    points[:100, 2] = points[:, 2].min() - 50.0
    assert len(st.PointCloud.from_array(points).points) == len(points)


@pytest.mark.parametrize("value", [-99.0, -9999.0, 0.0])
def test_a_usual_value_for_no_data_far_from_a_scan_that_is_no_raster_is_left_out(value: float) -> None:
    """Its area made the members that were suggested several times too long."""
    points = make("cloth", 5000).points + [0.0, 0.0, 400.0]
    points[:, 2] -= 0.0 if value == 0.0 else 400.0
    at = np.random.default_rng(1).random(len(points)) < 0.04
    points[at, 2] = value
    cloud = st.PointCloud.from_array(points)
    assert cloud.left_out == (("with a height that stands for no data", at.sum()),)
    points[at, 2] = points[~at, 2].min() - 3.0  # as a floor that is level to the last digit
    assert len(st.PointCloud.from_array(points).points) == len(points)


@pytest.mark.parametrize("share", [0.02, 0.4])
@pytest.mark.parametrize("place", [(-9999.0, -9999.0, -9999.0), (0.0, 0.0, 0.0)])
def test_points_at_one_place_far_away_are_left_out_and_told(place: tuple[float, float, float], share: float) -> None:
    """As an organized scan in national coordinates has them where no echo came back."""
    points = make("cloth", 5000).points + [500_000.0, 4_500_000.0, 300.0]
    at = np.random.default_rng(0).random(len(points)) < share
    points[at] = place
    cloud = st.PointCloud.from_array(points)
    assert len(cloud.points) == (~at).sum()
    assert cloud.left_out == (("at a place that stands for no data", at.sum()),)
    said = f"{at.sum():,} points stand at ({place[0]:g}, {place[1]:g}, {place[2]:g})"
    assert any(said in note for note in cloud.notes)


def test_one_point_far_away_and_points_at_one_place_of_the_scan_stay() -> None:
    points = make("cloth", 5000).points.copy()
    points[:100] = points[100]
    points[200] = 1e4
    assert len(st.PointCloud.from_array(points).points) == len(points)


def test_a_valley_floor_in_heights_of_whole_metres_stays() -> None:
    points = terrain()
    points[:, 2] = np.round(points[:, 2])
    floor = points[:, 2] == points[:, 2].min()
    assert floor.mean() > 0.002
    assert len(st.PointCloud.from_array(points).points) == len(points)


@pytest.mark.filterwarnings("error")
def test_a_raster_with_every_point_twice_gives_no_warning() -> None:
    points = np.round(np.repeat(terrain(), 2, axis=0))
    points[:, 2] = np.maximum(points[:, 2], 685.0)
    assert len(st.PointCloud.from_array(points).points) == len(points)
