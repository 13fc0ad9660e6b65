"""Folds of a scan across which the members of its grid run are said; where ridges follow them, or there are none, nothing is."""

import numpy as np
import pytest

import scantruss as st
from scantruss.attempts.lost_ridges import lost_ridges
from scantruss.boundary.curves import length_along
from scantruss.constraints.fold_tracing import TANGLED_RIDGES
from scantruss.errors import FrontError
from scantruss.report.length_trial import LengthTrial

LONG, WIDE, RISE = 12.0, 8.0, 0.7  # a hip roof, its rise for each unit across


def roof(spacing: float = 0.1, noise: float = 0.004, rise: float = RISE) -> st.PointCloud:
    random = np.random.default_rng(4)
    x, y = (np.arange(-0.5 * side, 0.5 * side, spacing) for side in (LONG, WIDE))
    plan = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2) + random.uniform(
        0.0, 0.5 * spacing, (len(x) * len(y), 2)
    )
    inwards = np.minimum(0.5 * LONG - np.abs(plan[:, 0]), 0.5 * WIDE - np.abs(plan[:, 1]))
    points = np.column_stack([plan, rise * inwards])
    return st.PointCloud.from_array(points + random.normal(0.0, noise, points.shape), unit="m")


def lost_of(grid: st.Grid) -> list[str]:
    assert grid.certificate is not None and grid.certificate.passed
    return [warning.words for warning in grid.certificate.warnings if warning.kind == "lost"]


def test_the_hips_of_a_roof_are_lost_at_long_members_and_said_with_length_and_ends() -> None:
    cloud = roof()
    settings = st.Settings(length=2.8, effort="quick", unit="m")
    grid = st.grid_from_points(cloud, settings)
    (words,) = lost_of(grid)
    assert words.startswith("cuts across ridges of the scan: ") and " m in " in words and " from (" in words
    hips = np.hypot(np.hypot(4.0, 4.0), 4.0 * RISE)
    parts = lost_ridges(grid, cloud, settings)
    assert all(length_along(part) <= 1.1 * hips for part in parts)
    assert LengthTrial(2.8, grid).follows_less == 1
    assert not lost_ridges(grid, cloud, settings, parts)  # what is said already is not said again
    assert not lost_ridges(grid, cloud, settings.replace(ridge_angle=0.0))


def test_nothing_is_lost_where_ridges_follow_the_hips() -> None:
    grid = st.grid_from_points(roof(), st.Settings(length=1.2, effort="quick", unit="m"))
    assert not lost_of(grid) and len(grid.lines)
    assert LengthTrial(1.2, grid).follows_less == 0


def test_what_of_a_ridge_members_leave_is_lost_from_where_it_ends() -> None:
    """The ridge line of a roof, of whose nodes most are let down."""
    cloud = roof(rise=0.6)
    settings = st.Settings(length=1.0, effort="quick", unit="m")
    grid = st.grid_from_points(cloud, settings)
    nodes, high = grid.nodes.copy(), grid.nodes[:, 2] + grid.origin[2] > 0.5 * WIDE * 0.6 - 0.1
    let_down = high & (grid.nodes[:, 0] + grid.origin[0] > -0.9)
    nodes[let_down, 2] -= 0.3
    assert not lost_ridges(grid, cloud, settings)
    part, *_ = lost_ridges(grid.replace(nodes=nodes), cloud, settings)
    assert part[:, 0].min() > -2.2 and length_along(part) == pytest.approx(3.0, abs=1.0)


def test_a_smooth_scan_loses_no_ridges_however_long_its_members() -> None:
    cloud = roof()
    points = cloud.points + cloud.origin
    points[:, 2] = 3.0 * np.cos(0.2 * points[:, 0]) * np.cos(0.25 * points[:, 1])
    smooth = st.PointCloud.from_array(points, unit="m")
    grid = st.grid_from_points(smooth, st.Settings(length=2.0, effort="quick", unit="m"))
    assert not lost_of(grid)


def test_a_scan_whose_folds_are_a_tangle_at_shorter_members_loses_none(monkeypatch: pytest.MonkeyPatch) -> None:
    def tangled(*_: object) -> None:
        raise FrontError(TANGLED_RIDGES)

    cloud, settings = roof(), st.Settings(length=2.8, effort="quick", unit="m")
    grid = st.grid_from_points(cloud, settings)
    assert lost_ridges(grid, cloud, settings)
    monkeypatch.setattr("scantruss.attempts.lost_ridges.fold_lines", tangled)
    assert not lost_ridges(grid, cloud, settings)


def niche(random: np.random.Generator) -> np.ndarray:
    """A wall with a niche 0.3 deep, two of whose back edges are shorter than three members."""
    front = random.uniform((0.0, 0.0), (6.0, 4.0), (26_000, 2))
    front = front[~((np.abs(front[:, 0] - 3.0) < 0.5) & (np.abs(front[:, 1] - 2.0) < 0.4))]
    back = random.uniform((2.5, 1.6), (3.5, 2.4), (900, 2))
    sides = [
        np.column_stack([np.full(260, x), random.uniform(0.0, 0.3, 260), random.uniform(1.6, 2.4, 260)])
        for x in (2.5, 3.5)
    ]
    sides += [
        np.column_stack([random.uniform(2.5, 3.5, 320), random.uniform(0.0, 0.3, 320), np.full(320, z)])
        for z in (1.6, 2.4)
    ]
    flat = [
        np.column_stack([part[:, 0], np.full(len(part), depth), part[:, 1]])
        for part, depth in ((front, 0.0), (back, 0.3))
    ]
    points = np.concatenate([*flat, *sides])
    return points + random.normal(0.0, 0.003, points.shape)


def test_a_fold_is_said_however_short_where_it_is_cut_off_deeply() -> None:
    cloud = st.PointCloud.from_array(niche(np.random.default_rng(1)))
    settings = st.Settings(length=0.32, effort="quick")
    grid = st.grid_from_points(cloud, settings)
    nodes = grid.nodes.copy()
    edge = (np.abs(nodes[:, 0] + grid.origin[0] - 3.5) < 0.25) & (nodes[:, 1] + grid.origin[1] > 0.1)
    nodes[edge, 1] -= 0.16
    lost = lost_ridges(grid.replace(nodes=nodes), cloud, settings)
    assert 0.3 < sum(map(length_along, lost)) < 2.0 * 0.32 * 2.0
