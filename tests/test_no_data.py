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
