"""A narrow gap that a grid bridges is said, with its place, width and length: a cut, a slit, two parts that stand close together."""

from __future__ import annotations

import numpy as np
import pytest
from marks import compiled_only
from small_clouds import sheet
from test_places_to_look_at import NOTHING, SETTINGS, lattice, scanned
from typed import known

import scantruss as st
from scantruss.check.certify import certify
from scantruss.grid.certificate import Certificate, Fault
from scantruss.pipeline import grid_from_points


def certified(points: np.ndarray) -> Certificate:
    """Return what the certificate of a plate over a scan says."""
    samples, grid = scanned(points, lattice())
    return certify(grid, samples, NOTHING, SETTINGS)


def gap_of(found: Certificate) -> Fault | None:
    """Return the warning of gaps."""
    each = [fault for fault in found.warnings if fault.kind == "gap"]
    assert len(each) <= 1
    return each[0] if each else None


@pytest.mark.parametrize("half", [0.1, 0.14, 0.18])
def test_a_slit_a_fifth_of_a_member_wide_is_named_with_width_length_and_place(half: float) -> None:
    found = certified(sheet(13, 8, 0.03, keep=lambda x, y: (abs(x) > half) | (abs(y) > 1.5)))
    gap = known(gap_of(found))
    assert abs(known(gap.where)[0]) < 0.1 and abs(known(gap.where)[1]) < 1.6
    width, length = (float(gap.words.split(f" {word}")[0].split()[-1]) for word in ("wide", "long"))
    assert width == pytest.approx(2 * half, abs=0.1) and length == pytest.approx(3.0, abs=0.4)
    (listed,) = [part for part in found.left_out if part.kind == "gap"]
    assert listed.where == gap.where


def test_a_cut_that_narrows_from_its_mouth_on_is_named() -> None:
    found = certified(sheet(13, 8, 0.04, keep=lambda x, y: (abs(x) > 0.2 * np.minimum(2.0 - y, 4.0) / 4.0) | (y > 2.0)))
    gap = known(gap_of(found))
    assert abs(known(gap.where)[0]) < 0.1


def test_a_short_slit_a_narrow_one_and_a_small_hole_are_nothing() -> None:
    for keep in (
        lambda x, y: (abs(x) > 0.1) | (abs(y) > 0.2),
        lambda x, y: (abs(x) > 0.02) | (abs(y) > 1.5),
        lambda x, y: np.hypot(x - 0.4, y) > 0.15,
    ):
        assert gap_of(certified(sheet(13, 8, 0.03, keep=keep))) is None


@pytest.mark.parametrize("seed", range(4))
def test_points_at_random_on_lines_ever_sparser_or_half_as_dense_bridge_nothing(seed: int) -> None:
    rng = np.random.default_rng(seed)
    places = rng.uniform([-6.5, -4], [6.5, 4], (9000, 2))
    lines = np.column_stack([rng.uniform(-6.5, 6.5, 9000), 0.25 * rng.integers(-16, 17, 9000)])
    sparser = places[rng.random(len(places)) < np.exp(0.25 * places[:, 0] - 1.7)]
    step = places[(places[:, 0] > 0.3) | (rng.random(len(places)) < 0.1)]
    for flat in (places, lines, sparser, step):
        assert gap_of(certified(np.column_stack([flat, 0.01 * rng.normal(size=len(flat))]))) is None, seed


@pytest.mark.parametrize(("seed", "count"), [(308, 4000), (82, 3000), (188, 3000)])
def test_an_empty_place_nearly_round_with_few_points_around_is_an_accident(seed: int, count: int) -> None:
    """One such place is on every hundredth sheet of so many points at random."""
    rng = np.random.default_rng(seed)
    flat = rng.uniform([-6.5, -4], [6.5, 4], (count, 2))
    assert gap_of(certified(np.column_stack([flat, 0.01 * rng.normal(size=count)]))) is None


@compiled_only
@pytest.mark.parametrize("length", [1.5, 2.0, 3.2])
def test_the_grid_of_a_sail_with_a_cut_says_so(length: float) -> None:
    rng = np.random.default_rng(11)
    x, y = rng.uniform([-8.0, 0.0], [8.0, 14.0], (60_000, 2)).T
    inside = (abs(x) < 8.1 - 8.0 * y / 14.0) & ((abs(x - 1.0) > np.maximum(0.7 * (1.0 - y / 8.0), 0.06)) | (y > 8.0))
    x, y = x[inside], y[inside]
    points = np.column_stack([x, y, 2.0 * np.cos(x / 6.0) * np.sin(y / 5.0)]) + rng.normal(0.0, 0.005, (len(x), 3))
    grid = grid_from_points(points, st.Settings(length=length, effort="quick"))
    said = [fault for fault in known(grid.certificate).warnings if fault.kind in ("gap", "closed")]
    assert any(fault.where and abs(fault.where[0] - 1.0) < 0.5 for fault in said)


def star() -> np.ndarray:
    """A shell with five slender arms."""
    rng = np.random.default_rng(11)
    turn, radius = rng.uniform(0.0, 2.0 * np.pi, 160_000), 14.0 * np.sqrt(rng.uniform(0.0, 1.0, 160_000))
    inside = radius < 5.0 + 8.0 * np.maximum(np.cos(5.0 * turn), 0.0) ** 6
    turn, radius = turn[inside][:40_000], radius[inside][:40_000]
    points = np.column_stack([radius * np.cos(turn), radius * np.sin(turn), 4.0 - 0.02 * radius**2])
    return points + rng.normal(0.0, 0.005, points.shape)


@pytest.mark.parametrize(("bays", "passes"), [(1, True), (5, False)])
def test_a_grid_that_covers_the_bays_of_a_plate_fails_and_one_with_a_small_bay_does_not(
    bays: int, passes: bool
) -> None:
    points = sheet(13, 8, 0.05)
    middles = 2.0 * np.arange(bays) - (bays - 1.0)
    in_bay = (abs(points[:, :1] - middles) < 0.45).any(axis=1) & (points[:, 1] < (3.0 if bays > 1 else -1.0))
    found = certified(points[~in_bay])
    assert any("covers nothing on" in fault.words for fault in found.faults) != passes


def test_a_part_with_few_points_is_covered() -> None:
    """A third of it has one point in twenty, two and a half spacings to a member."""
    rng = np.random.default_rng(4)
    points = rng.uniform(-9.0, 9.0, (50_000, 2))
    points = points[((points < -1.0).any(axis=1)) | (rng.random(len(points)) < 0.05)]
    points = np.column_stack([points, 0.3 * np.cos(0.2 * points[:, 0]) + 0.004 * rng.normal(size=len(points))])
    grid = grid_from_points(points, st.Settings(length=1.0, effort="quick"))
    assert known(grid.certificate).passed and known(grid.certificate).missing < 0.001


@pytest.mark.parametrize(("height", "named"), [(0.5, True), (0.2, False)])
def test_a_slender_peak_that_members_cut_off_is_named_with_its_place(height: float, named: bool) -> None:
    points = sheet(13, 8, 0.03, keep=lambda x, y: (abs(y) < 3.4) & (abs(x - y / 3**0.5) < 4.0))
    points[:, 2] += height * np.exp(-np.hypot(points[:, 0] - 0.5, points[:, 1] - 0.3) / 0.25)
    loose = np.random.default_rng(0).uniform([-2.0, -3.0, 0.3], [2.0, 3.0, 0.5], (40, 3))
    found = [fault for fault in certified(np.concatenate([points, loose])).warnings if fault.kind == "peak"]
    assert bool(found) == named
    if named:
        assert known(found[0].where) == pytest.approx((0.5, 0.3, height), abs=0.1) and not found[0].also


@compiled_only
def test_no_grid_of_a_star_passes_that_spans_from_arm_to_arm() -> None:
    try:
        grid = grid_from_points(star(), st.Settings(length=7.0, effort="quick"))
    except st.CertificateError as error:
        assert "covers nothing" in str(error) or known(error.where)
        return
    assert not [each for each in known(grid.certificate).warnings if each.kind == "gap"]
