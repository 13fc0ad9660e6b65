"""An opening with four straight sides has four corners, however short the sides are; a round one has none."""

from collections.abc import Callable

import numpy as np
import pytest

from scantruss import Settings
from scantruss.boundary.find import Loop, find_boundary
from scantruss.scan.cloud import PointCloud
from scantruss.surface.samples import sample_surface


def opening_of(outside: Callable[[np.ndarray, np.ndarray], np.ndarray], seed: int, count: int = 16000) -> Loop:
    """Return the boundary of an opening in a curved roof of 12 by 12 members, outside of which `outside` (x, y) is true."""
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(-6.0, 6.0, (2, count))
    x, y = x[outside(x, y)], y[outside(x, y)]
    points = np.column_stack([x, y, 1.0 - 0.02 * x**2 + 0.01 * y**2]) + rng.normal(0.0, 0.01, (len(x), 3))
    settings = Settings(length=1.0)
    _, boundary = find_boundary(sample_surface(PointCloud(points=points, origin=np.zeros(3)), settings), settings)
    assert len(boundary.internal) == 1
    return boundary.internal[0]


@pytest.mark.parametrize("size", [(2.1, 1.2), (1.3, 1.3), (2.4, 1.1), (3.0, 2.0)])
@pytest.mark.parametrize("angle", [0.2, 0.7])
def test_the_corners_of_a_window_are_where_its_sides_meet(size: tuple[float, float], angle: float) -> None:
    c, s = np.cos(angle), np.sin(angle)
    loop = opening_of(lambda x, y: (abs(c * x + s * y) > size[0] / 2) | (abs(c * y - s * x) > size[1] / 2), 3)
    true = np.array(
        [[c * a - s * b, s * a + c * b] for a in (-size[0] / 2, size[0] / 2) for b in (-size[1] / 2, size[1] / 2)]
    )
    away = np.linalg.norm(loop.corners[:, None, :2] - true, axis=2)
    assert len(loop.corners) == 4 and away.min(axis=0).max() < 0.25
    assert (
        np.abs(loop.corners[:, 2] - (1.0 - 0.02 * loop.corners[:, 0] ** 2 + 0.01 * loop.corners[:, 1] ** 2)).max()
        < 0.05
    )


@pytest.mark.parametrize("radius", [0.75, 1.1, 1.6])
def test_a_round_opening_has_no_corners(radius: float) -> None:
    assert len(opening_of(lambda x, y: np.hypot(x, y) > radius, 4).corners) == 0


def test_an_opening_with_rounded_corners_has_none_where_points_show_that_they_are_rounded() -> None:
    loop = opening_of(lambda x, y: np.hypot(np.maximum(abs(x) - 1.0, 0.0), np.maximum(abs(y) - 0.8, 0.0)) > 0.9, 5)
    assert len(loop.corners) == 0


def test_the_method_of_the_paper_looks_for_no_four_sides(monkeypatch: pytest.MonkeyPatch) -> None:
    looked: list[int] = []

    def look(*_: object) -> np.ndarray:
        looked.append(1)
        return np.zeros((0, 3))

    monkeypatch.setattr("scantruss.boundary.offset.corners_of_four_sides", look)
    x, y = (each.ravel() for each in np.meshgrid(np.arange(-6.0, 6.0, 0.1), np.arange(-6.0, 6.0, 0.1)))
    window = (abs(x) < 1.0) & (abs(y) < 0.8)
    cloud = PointCloud(points=np.column_stack([x, y, 0 * x])[~window], origin=np.zeros(3))
    for method, found in (("paper", False), ("default", True)):
        settings = Settings(length=1.0, method=method)
        find_boundary(sample_surface(cloud, settings), settings)
        assert bool(looked) == found
