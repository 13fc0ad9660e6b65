"""Ridges along folds that turn over nearly a member: found by the normals of both sides, kept where the grid follows better."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from marks import compiled_only

from scantruss import Grid, PointCloud, Settings, grid_from_points
from scantruss.attempts.better import follows_better
from scantruss.attempts.lost_ridges import lost_ridges
from scantruss.attempts.table import Attempt
from scantruss.boundary.curves import length_along
from scantruss.boundary.find import find_boundary
from scantruss.check.unfollowed import crests_cut_off
from scantruss.constraints.find import wide_folds
from scantruss.constraints.ridges import find_ridges, fold_lines
from scantruss.errors import FrontError
from scantruss.grid.certificate import Fault
from scantruss.pipeline import make_grid, with_wide_ridges
from scantruss.surface.samples import sample_surface

SIZE, HALF = 5.0, 20.0  # member length, half the side of the box
ALL_TWELVE = 12


def rounded_box(radius: float, count: int = 40_000, noise: float = 0.02, half: float = HALF) -> np.ndarray:
    """Points (N, 3) on a cube whose edges are rounded by a radius."""
    rng = np.random.default_rng(5)
    places = rng.uniform(-half, half, (count, 3))
    places[np.arange(count), rng.integers(0, 3, count)] = half * rng.choice([-1.0, 1.0], count)
    inner = np.clip(places, radius - half, half - radius)
    outward = (places - inner) / np.linalg.norm(places - inner, axis=1)[:, None]
    return inner + (radius + noise * rng.normal(size=(count, 1))) * outward


@pytest.fixture(scope="module")
def cloud() -> PointCloud:
    return PointCloud.from_array(rounded_box(0.57 * SIZE))


@compiled_only
def test_wide_fillets_have_their_crests(cloud: PointCloud) -> None:
    """They turn by 90 degrees over nine tenths of a member; the whole cube has twelve edges."""
    settings, radius = Settings(length=SIZE), 0.57 * SIZE
    samples = sample_surface(cloud, settings)
    lines = fold_lines(samples, settings)
    ridges = find_ridges(samples, settings, tuple(range(len(lines.wide))))
    assert len(ridges) == ALL_TWELVE
    crest = HALF - radius * (1.0 - np.sqrt(0.5))
    for ridge in ridges:
        places = np.abs(ridge.places + cloud.origin)
        beside = np.sort(places, axis=1)[:, 1:]
        inner = places.min(axis=1) < HALF - 5.0
        assert np.abs(beside[inner] - crest).max() < 0.15 * SIZE


@compiled_only
def test_a_box_has_all_of_its_wide_edges_or_none(cloud: PointCloud) -> None:
    """Where a grid cuts off one of them, those that meet it are ridges too, and those that meet these."""
    settings = Settings(length=SIZE)
    samples, _ = find_boundary(sample_surface(cloud, settings), settings)
    plain = make_grid(cloud, Attempt(settings))
    crests = wide_folds(samples, settings)
    assert len(crests) > 0 and crests_cut_off(plain, crests, SIZE) == tuple(range(len(crests)))
    assert wide_folds(samples, settings.replace(ridge_angle=0.0)) == []


@pytest.fixture(scope="module")
def made(cloud: PointCloud) -> Grid:
    return grid_from_points(cloud, Settings(length=SIZE))


@compiled_only
def test_a_grid_with_wide_ridges_is_nearer_to_the_scan(cloud: PointCloud, made: Grid) -> None:
    settings = Settings(length=SIZE)
    plain = make_grid(cloud, Attempt(settings))
    assert made.certificate is not None and made.certificate.passed
    assert len(made.lines) > len(plain.lines) and follows_better(made, plain)
    assert not follows_better(plain, made)
    assert not lost_ridges(made, cloud, settings)
    lost = lost_ridges(plain, cloud, settings)  # what no ridge follows is said
    assert sum(map(length_along, lost)) > 2.0 * (2.0 * HALF)


@compiled_only
def test_more_effort_does_not_leave_the_wide_ridges(made: Grid) -> None:
    small = PointCloud.from_array(rounded_box(0.57 * SIZE, 16_000, half=0.6 * HALF))
    best = grid_from_points(small, Settings(length=SIZE, effort="best"))
    # twelve edges of seven members and more, and of four of the smaller box
    assert len(made.lines) > 60 and len(best.lines) > 36


def _with(grid: Grid, p99: float, kinds: tuple[str, ...] = ()) -> Grid:
    assert grid.certificate is not None and grid.certificate.scan_distance is not None
    spread = replace(grid.certificate.scan_distance, p99=p99)
    warnings = tuple(Fault(kind, "", None) for kind in kinds)
    return grid.replace(certificate=replace(grid.certificate, scan_distance=spread, warnings=warnings))


def test_nearer_counts_against_poorer_and_unevener() -> None:
    rng = np.random.default_rng(2)
    flat = np.column_stack([rng.uniform(0.0, 40.0, (6_000, 2)), 0.02 * rng.normal(size=6_000)])
    grid = grid_from_points(flat, Settings(length=SIZE))
    near, far = _with(grid, 0.1 * SIZE), _with(grid, 0.2 * SIZE)
    assert follows_better(near, far) and not follows_better(far, near) and not follows_better(near, near)
    assert not follows_better(_with(grid, 0.1 * SIZE, ("angle",)), far)
    assert follows_better(_with(grid, 0.1 * SIZE, ("gap",)), far)
    longer = grid.nodes.copy()
    longer[::2, 0] *= 1.3  # members far less even
    uneven = near.replace(nodes=longer)
    assert not follows_better(uneven, far)
    assert not follows_better(grid.replace(certificate=None), far)


@pytest.mark.parametrize("fails", [True, False])
def test_the_wide_folds_beside_which_a_grid_fails_or_is_poor_are_given_up_alone(
    fails: bool, cloud: PointCloud, monkeypatch: pytest.MonkeyPatch
) -> None:
    settings = Settings(length=SIZE)
    attempt = Attempt(settings)
    folds = wide_folds(find_boundary(sample_surface(cloud, settings), settings)[0], settings)
    bad = tuple((folds[0][len(folds[0]) // 2] + cloud.origin).tolist())
    made: list[tuple[int, ...]] = []

    def grid_with(*warnings: Fault) -> Grid:
        return cast(Grid, SimpleNamespace(certificate=SimpleNamespace(warnings=warnings)))

    good, poor = grid_with(), grid_with(Fault("angle", "has an angle of 20 degrees", bad))

    def make(_: PointCloud, tried: Attempt, **__: object) -> Grid:
        made.append(tried.wide)
        if 0 in tried.wide and fails:
            raise FrontError("it fails", None, bad)
        return poor if 0 in tried.wide else good

    monkeypatch.setattr("scantruss.pipeline.make_grid", make)
    every = tuple(range(len(folds)))
    grid, taken = with_wide_ridges(cloud, replace(attempt, wide=every), lambda grid: grid is good, None)
    assert grid is good and made == [every, taken.wide] and 0 not in taken.wide and len(taken.wide) >= len(every) - 3
    assert with_wide_ridges(cloud, replace(attempt, wide=(0,)), lambda grid: grid is good, None)[0] is None
    made.clear()
    assert with_wide_ridges(cloud, taken, lambda _: False, None)[0] is None and made == [taken.wide]


def test_a_grid_that_is_poor_away_from_its_wide_folds_is_laid_out_otherwise_once(
    cloud: PointCloud, monkeypatch: pytest.MonkeyPatch
) -> None:
    settings = Settings(length=SIZE)
    far = tuple((cloud.points.max(axis=0) + cloud.origin + 20.0 * SIZE).tolist())
    fault = Fault("short", "has a member of 0.58 desired lengths", far)
    grid = cast(Grid, SimpleNamespace(certificate=SimpleNamespace(warnings=(fault,))))
    made: list[Attempt] = []

    def make(_: PointCloud, tried: Attempt, **__: object) -> Grid:
        made.append(tried)
        return grid

    monkeypatch.setattr("scantruss.pipeline.make_grid", make)
    attempt = Attempt(settings, wide=(0,))
    found, taken = with_wide_ridges(cloud, attempt, lambda _: len(made) == 2, None)
    assert found is grid and made == [attempt, taken] and taken.wide == (0,) and taken.starts is not None
    made.clear()
    assert with_wide_ridges(cloud, attempt, lambda _: False, None)[0] is None and len(made) == 2
