"""Thinning to one point a box: against slow twins, and the same to the byte for any order and parts."""

from collections.abc import Sequence
from typing import Any

import naive
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some

from scantruss.errors import InputError
from scantruss.scan.stream.thinning import (
    BoxRows,
    Thinning,
    nearest_in,
    nearest_of_parts,
    points_at_boundary,
    thin_points,
)

pytestmark = pytest.mark.kernels


@some.composite
def scans(draw: some.DrawFn) -> tuple[np.ndarray, float]:
    """Points of any place and proportion, some twice, some on the sides of boxes, and a spacing."""
    rng = np.random.default_rng(draw(some.integers(0, 10_000)))
    count, spacing = draw(some.integers(1, 80)), draw(some.sampled_from([0.25, 0.3, 2.0]))
    centre = np.array([draw(some.sampled_from([-4e6, -1.0, 0.0, 5e5])) for _ in range(3)])
    points = centre + draw(some.sampled_from([0.0, 1.0, 6.0])) * rng.random((count, 3))
    on_sides = np.round(points[: count // 3] / spacing) * spacing
    return np.concatenate([points, points[: count // 4], on_sides]), spacing


def in_parts(
    points: np.ndarray, spacing: float, cuts: Sequence[int] | np.ndarray, *, merged: bool, boundary: bool = False
) -> BoxRows:
    """Rows of points that are added in parts, or thinned part by part and then put together."""
    whole = Thinning(spacing, boundary=boundary)
    for part in np.split(points, cuts):
        if merged:
            own = Thinning(spacing, boundary=boundary)
            own.add(part)
            whole.add_rows(own.take_rows())
        else:
            whole.add(part)
    return whole.take_rows()


def same_rows(one: BoxRows, other: BoxRows) -> bool:
    return all(a.tobytes() == b.tobytes() for a, b in zip(one[:2], other[:2], strict=True)) and one[2:] == other[2:]


@given(scans())
def test_each_box_has_the_mean_of_its_points(scan: tuple[np.ndarray, float]) -> None:
    points, spacing = scan
    found, wanted = thin_points(points, spacing), naive.means_by_box(points, spacing)
    assert found.shape == wanted.shape
    assert np.abs(found - wanted).max() <= 1e-9 * spacing + 4 * np.spacing(np.abs(points).max())


@given(scans())
def test_the_nearest_point_of_each_box_is_the_nearest_to_its_mean(scan: tuple[np.ndarray, float]) -> None:
    points, spacing = scan
    found = thin_points(points, spacing, keep="nearest")
    means, boxes = thin_points(points, spacing), np.floor(points / spacing)
    for mean, nearest in zip(means, found, strict=True):
        mates = points[(boxes == np.floor(nearest / spacing)).all(axis=1)]
        assert (mates == nearest).all(axis=1).any()
        distance = ((mates - mean) ** 2).sum(axis=1)
        assert ((nearest - mean) ** 2).sum() == distance.min()


@given(scans(), some.integers(0, 1000))
def test_any_order_and_any_parts_give_the_same_bytes(scan: tuple[np.ndarray, float], seed: int) -> None:
    points, spacing = scan
    rng = np.random.default_rng(seed)
    mixed = points[rng.permutation(len(points))]
    cuts = np.sort(rng.integers(0, len(points), rng.integers(0, 5)))
    wanted = in_parts(points, spacing, [], merged=False, boundary=True)
    assert same_rows(wanted, in_parts(mixed, spacing, cuts, merged=False, boundary=True))
    assert same_rows(wanted, in_parts(mixed, spacing, cuts, merged=True, boundary=True))
    parts = [nearest_in([part], wanted.rows, spacing) for part in np.split(mixed, cuts)]
    whole = nearest_in([points], wanted.rows, spacing)
    count = len(wanted.rows)
    assert nearest_of_parts(count, parts).tobytes() == nearest_of_parts(count, [whole]).tobytes()


@given(scans())
def test_extremes_are_the_outermost_points_of_a_box(scan: tuple[np.ndarray, float]) -> None:
    points, spacing = scan
    rows = in_parts(points, spacing, [], merged=False, boundary=True)
    boxes = np.floor(points / spacing).astype(np.int64)
    for row, extremes in zip(rows.rows, rows.extremes.reshape(-1, 6, 3), strict=True):
        mates = points[(boxes == row[:3]).all(axis=1)]
        assert len(mates) == row[3]
        for side in range(6):
            ahead = (1 if side % 2 else -1) * mates[:, side // 2]
            ties = mates[ahead == ahead.max()]
            assert extremes[side].tolist() == min(ties.tolist())


def test_a_table_grows_as_it_fills() -> None:
    points = np.random.default_rng(5).uniform(-40, 40, (9000, 3))
    found = thin_points(points, 1.0)
    assert len(found) > 8000
    assert np.allclose(found, naive.means_by_box(points, 1.0), atol=1e-9)


def test_points_that_are_no_numbers_are_left_out_and_counted() -> None:
    points = np.array([[0.1, 0.2, 0.3], [np.nan, 0, 0], [0, np.inf, 0], [0.3, 0.2, 0.1]])
    thinning = Thinning(1.0)
    thinning.add(points)
    assert (thinning.points, thinning.dropped) == (4, 2)
    assert np.allclose(thin_points(points, 1.0), [[0.2, 0.2, 0.2]])


@pytest.mark.parametrize("spacing", [0, -1.0, np.nan, np.inf, "1"])
def test_a_spacing_that_does_not_do_is_refused(spacing: Any) -> None:
    with pytest.raises(InputError, match="spacing must be a positive number"):
        Thinning(spacing)


def test_a_spacing_too_small_for_the_coordinates_is_refused() -> None:
    with pytest.raises(InputError, match="too small for points so far from zero"):
        thin_points(np.array([[1e9, 0.0, 0.0]]), 1e-8)


def test_a_scan_that_has_changed_between_two_readings_is_refused() -> None:
    rows = in_parts(np.array([[0.5, 0.5, 0.5], [3.5, 0.5, 0.5]]), 1.0, [], merged=False)
    with pytest.raises(InputError, match="changed while it was read"):
        nearest_of_parts(2, [nearest_in([np.array([[0.5, 0.5, 0.5]])], rows.rows, 1.0)])


def plate(count: int, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Points on an inclined plate of 20 x 15 with a round hole; their distance inside the boundary."""
    rng = np.random.default_rng(seed)
    flat = rng.uniform(0, (20, 15), (count, 2))
    inside = np.hypot(flat[:, 0] - 11, flat[:, 1] - 7) - 3
    flat, inside = flat[inside > 0], inside[inside > 0]
    inside = np.minimum.reduce([inside, flat[:, 0], flat[:, 1], 20 - flat[:, 0], 15 - flat[:, 1]])
    turn, _ = np.linalg.qr(np.array([[1.0, 0.3, 0.2], [0.2, 1.0, -0.4], [0.1, 0.5, 1.0]]))
    return np.column_stack([flat, np.zeros(len(flat))]) @ turn.T, inside


def test_the_rim_is_kept_and_nothing_but_the_rim() -> None:
    points, inside = plate(12_000)
    rows = in_parts(points, 1.0, [], merged=False, boundary=True)
    kept = points_at_boundary(rows, 1.0)
    place = {tuple(point): depth for point, depth in zip(points.tolist(), inside, strict=True)}
    depth = np.array([place[tuple(point)] for point in kept.tolist()])  # each is a point of the scan
    assert depth.max() < 2.5
    outermost = points[inside < 0.05]
    gap = np.sqrt(((outermost[:, None] - kept) ** 2).sum(axis=2)).min(axis=1)
    means = thin_points(points, 1.0)
    without = np.sqrt(((outermost[:, None] - means) ** 2).sum(axis=2)).min(axis=1)
    assert np.median(gap) < 0.7 * np.median(without)
    assert len(np.unique(kept, axis=0)) == len(kept)


def test_a_single_point_is_its_own_mean_and_not_kept_twice() -> None:
    points = np.array([[0.5, 0.5, 0.5], [1.5, 0.5, 0.5], [2.5, 0.6, 0.5]])
    assert np.allclose(thin_points(points, 1.0, boundary=True), points, atol=1e-9)
