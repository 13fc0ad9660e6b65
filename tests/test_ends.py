"""Every step ends, whatever it is given: loops by a law, whole runs on clouds that nobody means to scan."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some
from marks import compiled_only
from nasty_clouds import CLOUDS

import scantruss as st
from scantruss.check.distances import boxes_of
from scantruss.kernels.geometry import kd_tree
from scantruss.kernels.geometry.boxes import is_wide, nearest, search
from scantruss.kernels.mesh.coverage import nearest_distances
from scantruss.kernels.mesh.distances import nearest_points, plane_distances
from scantruss.scan.member_length import length_range

kernels = pytest.mark.kernels


@kernels
@given(some.integers(0, 10**6), some.floats(0.5, 300.0))
def test_a_wide_search_finds_what_looking_at_all_finds(seed: int, reach: float) -> None:
    """Also where the reach spans more boxes than there are items."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(0, 100, (40, 3))
    boxes = boxes_of(points, 1.0)
    x, y, z = place = rng.uniform(-20, 120, 3)
    away = np.linalg.norm(points - place, axis=1)
    found = np.empty(40, np.int64)
    count = search(boxes, points, x, y, z, reach, found)
    assert sorted(found[:count].tolist()) == np.flatnonzero(away <= reach).tolist()
    assert nearest(boxes, points, x, y, z, reach) == (int(away.argmin()) if away.min() < reach else -1)
    near, squares = np.empty(5, np.int64), np.empty(5)
    count = nearest_points(boxes, points, (x, y, z), reach, near, squares)
    assert near[:count].tolist() == [k for k in np.argsort(away)[:5].tolist() if away[k] <= reach]
    assert is_wide(boxes, x, y, z, 300.0) and not is_wide(boxes, x, y, z, 0.5)


@kernels
@pytest.mark.parametrize("near", [0.0, 1e-300, 1.0])
def test_a_place_that_is_nowhere_is_infinitely_far(near: float) -> None:
    points = np.random.default_rng(1).uniform(0, 10, (50, 3))
    boxes, places = boxes_of(points, 1.0), np.array([[np.nan, 0.0, 0.0], [5.0, 5.0, 5.0]])
    distance, off, noise = np.empty(2), np.empty(2), np.empty(2)
    nearest_distances(places, points, boxes, near, distance)
    plane_distances(places, points, boxes, 6, near, off, noise)
    assert distance[0] == off[0] == np.inf
    assert near < 1.0 or (distance[1] < 10.0 and off[1] < 10.0)


@kernels
@given(
    some.lists(some.sampled_from([0.0, 1.0, 1.0 + 2**-52, -1e300, 1e300, 5e-324]) | some.floats(-9, 9), min_size=2),
    some.data(),
)
def test_points_are_selected_by_halving_their_range_too(values: list[float], data: some.DataObject) -> None:
    """What is done where the median of three does not help, from the first turn on."""
    points = np.column_stack([values, np.arange(len(values)), np.zeros(len(values))])
    tree, middle = kd_tree.empty_kd_tree(points), data.draw(some.integers(1, len(values) - 1))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(kd_tree, "QUICK_TURNS", 0)
        getattr(kd_tree._select, "py_func", kd_tree._select)(tree, 0, 0, len(values), middle)
    assert tree.points[:middle, 0].max() <= tree.points[middle:, 0].min()
    assert sorted(tree.points[:, 0]) == sorted(values) and (tree.points == points[tree.ids]).all()


ENDED = {  # clouds, and the share of the range of lengths that is tried, in logarithms
    "each point fifty times": 1.0,
    "a lattice": 0.5,
    "a triangular lattice": 0.0,
    "whole coordinates on a sphere": 0.7,
    "coarse coordinates": 0.5,
    "clusters": 0.5,
    "there and back": 0.5,
    "crossing planes": 0.7,
    "shells in each other": 0.8,
    "a spiral": 0.5,
    "rays": 1.0,
    "a ball": 1.0,
    "far apart": 0.5,
    "one far away": 0.5,
    "huge coordinates": 0.5,
    "tiny coordinates": 0.5,
    "far from zero": 0.5,
    "a needle": 0.5,
}
WAYS: tuple[dict[str, Any], ...] = {"effort": "quick"}, {"method": "paper"}


@compiled_only
@pytest.mark.parametrize("name", ENDED)
def test_a_grid_or_a_refusal_comes_of_any_cloud(name: str) -> None:
    points = CLOUDS[name]()
    for settings in WAYS:
        try:
            low, high = length_range(st.PointCloud.from_array(points))
            length = low ** (1 - ENDED[name]) * high ** ENDED[name]
            grid = st.grid_from_points(points, st.Settings(length=length, **settings))
        except st.ScanTrussError as error:
            assert str(error)
        else:
            assert grid.certificate is not None and grid.certificate.passed


@pytest.mark.parametrize("name", ["one place", "two places", "a line"])
def test_what_is_no_surface_is_refused_before_any_look_at_it(name: str) -> None:
    with pytest.raises(st.InputError, match=r"same place|on a line"):
        length_range(st.PointCloud.from_array(CLOUDS[name]()))
