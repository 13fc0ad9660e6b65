"""Struts between parts of a scan that only face each other and tunnels through what is closed, told from handles that the scan has."""

import numpy as np
import pytest
from marks import compiled_only
from small_clouds import ball, samples_of, tire
from steps import steps_of
from typed import known

import scantruss as st
from scantruss.check.certify import certify
from scantruss.check.handles import (
    COVERED_ACROSS,
    cuts_of_members,
    false_handles,
    has_sheets_within,
    rings_around_handles,
    share_covered,
)

RADIUS, TUBE, HALF_GAP = 4.0, 1.2, 0.15


@pytest.fixture(scope="module")
def whole() -> st.Grid:
    return st.grid_from_points(tire(RADIUS, TUBE, 0.1), st.Settings(length=1.0, effort="quick"))


def two_balls() -> np.ndarray:
    """Points (N, 3) on two large balls, a third of a member apart where the tire passes from one to the other."""
    one = ball(3.0, 20_000)
    return np.concatenate([one + [RADIUS, 3.0 + HALF_GAP, 0.0], one + [RADIUS, -3.0 - HALF_GAP, 0.0]])


@compiled_only
def test_a_strut_between_parts_that_face_each_other_is_said_and_a_handle_of_the_scan_is_none(whole: st.Grid) -> None:
    assert known(whole.certificate).handles == 1
    assert known(whole.certificate).passed
    samples = samples_of(two_balls(), effort="quick")
    (fault,) = false_handles(
        whole.replace(origin=samples.origin, nodes=whole.nodes + whole.origin - samples.origin),
        samples,
        np.zeros(len(samples.scan)),
        known(whole.certificate),
        1.0,
    )
    assert fault.kind == "strut"
    assert np.linalg.norm(np.array(known(fault.where)) - [RADIUS, 0.0, 0.0]) < 1.0


@compiled_only
def test_a_grid_with_such_a_strut_fails(whole: st.Grid) -> None:
    """A block with a slit passed with two struts across it."""
    settings = st.Settings(length=1.0, effort="quick")
    samples, boundary = steps_of(st.PointCloud.from_array(two_balls()), settings)[:2]
    grid = whole.replace(origin=samples.origin, nodes=whole.nodes + whole.origin - samples.origin)
    assert "strut" in {fault.kind for fault in certify(grid, samples, boundary, settings).faults}


@compiled_only
def test_a_short_tunnel_is_no_strut() -> None:
    """Its sides face each other, and rings around it lie aslope: this grid was refused."""
    grid = st.grid_from_points(tire(2.0, 1.6, 0.1), st.Settings(length=0.5, effort="quick"))
    assert known(grid.certificate).passed and known(grid.certificate).handles == 1


@compiled_only
@pytest.mark.parametrize("closed", [True, False])
@pytest.mark.parametrize("height", [0.0, 1.0])
def test_a_tunnel_across_which_the_scan_has_points_is_a_fault(closed: bool, height: float) -> None:
    """Plates with blind holes passed with tunnels through their floors, as these are near enough to the grid around."""
    hole = 1.1
    settings = st.Settings(length=1.0, effort="quick")
    scan = tire(hole + 1.6, 1.6, 0.1)
    grid = st.grid_from_points(scan, settings)
    assert known(grid.certificate).handles == 1 and known(grid.certificate).passed
    plan = np.random.default_rng(1).uniform(-hole, hole, (400, 2))
    floor = np.column_stack([plan, np.full(len(plan), height)])[np.hypot(*plan.T) < hole]
    samples, boundary = steps_of(st.PointCloud.from_array(scan), settings)[:2]
    if closed:
        scan = np.concatenate([scan, floor])
        samples = samples_of(scan, effort="quick")
    found = certify(
        grid.replace(origin=samples.origin, nodes=grid.nodes + grid.origin - samples.origin),
        samples,
        boundary,
        settings,
    )
    assert ("tunnel" in {fault.kind for fault in found.faults}) == closed
    if closed:
        (fault,) = (fault for fault in found.faults if fault.kind == "tunnel")
        assert np.linalg.norm(known(fault.where)) < 1.0


@pytest.mark.parametrize(("radius", "is_closed"), [(0.6, False), (0.45, False), (0.0, True)])
def test_the_walls_of_a_tunnel_narrower_than_its_ring_do_not_close_it_and_a_cone_of_points_does(
    radius: float, is_closed: bool
) -> None:
    turn = np.linspace(0.0, 2.0 * np.pi, 6, endpoint=False)
    ring = 0.9 * np.column_stack([np.cos(turn), np.sin(turn), np.zeros(6)])
    rng = np.random.default_rng(0)
    around, height = rng.uniform(0.0, 2.0 * np.pi, 2_000), rng.uniform(-1.0, 1.0, 2_000)
    out = radius + np.abs(height) * (0.65 if radius == 0.0 else 0.1)
    walls = np.column_stack([out * np.cos(around), out * np.sin(around), height])
    assert (share_covered(ring, walls, 1.0) > COVERED_ACROSS) == is_closed


@compiled_only
def test_a_ring_around_a_wide_joint_has_a_sheet_on_either_side_within_and_one_around_a_limb_has_none() -> None:
    """Two legs passed as joined at their feet, around which nothing faces the other side."""
    turn = np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False)
    circle = np.column_stack([np.cos(turn), np.zeros(8), np.sin(turn)])
    joined, limb = samples_of(two_balls(), effort="quick"), samples_of(tire(RADIUS, TUBE, 0.1), effort="quick")
    assert has_sheets_within([RADIUS, 0.0, 0.0] - joined.origin + 1.3 * circle, joined, 1.0)
    assert not has_sheets_within([RADIUS, 2.0, 0.0] - joined.origin + 1.3 * circle, joined, 1.0)
    assert not has_sheets_within([RADIUS, 0.0, 0.0] - limb.origin + TUBE * circle, limb, 1.0)


def test_rings_around_a_handle_are_short_and_no_part_of_the_grid_lies_in_them(whole: st.Grid) -> None:
    rings = rings_around_handles(whole)
    members = set(map(frozenset, whole.edges.tolist()))
    assert rings and all(len(ring) <= 12 for ring in rings)
    assert all(
        frozenset(pair) in members
        for ring in rings
        for pair in zip(ring.tolist(), np.roll(ring, 1).tolist(), strict=True)
    )
    assert max(cuts_of_members(whole)).bit_length() == 2  # two cuts open one handle


def test_a_ball_has_no_ring() -> None:
    grid = st.grid_from_points(ball(3.0, 4000), st.Settings(length=1.5, effort="quick"))
    assert rings_around_handles(grid) == []
