"""What was scanned: lines and volumes are refused at once, two layers are said, and a floor under a shell is left out."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from typed import known

import scantruss as st
from scantruss.cli.main import main
from scantruss.report.advice import Advice
from scantruss.scan.member_length import length_range, suggest_length
from scantruss.surface.floor import find_floor


def plate(rng: np.random.Generator, count: int = 12_000, side: float = 10.0) -> np.ndarray:
    x, y = rng.uniform(-side, side, count), rng.uniform(-side, side, count)
    return np.column_stack([x, y, 0.02 * x * y])


def helix(rng: np.random.Generator) -> np.ndarray:
    turn = np.sort(rng.uniform(0, 60, 6000))
    return np.column_stack([5 * np.cos(turn), 5 * np.sin(turn), 1.5 * turn]) + rng.normal(0, 0.004, (6000, 3))


def three_lines(rng: np.random.Generator) -> np.ndarray:
    along, which = rng.uniform(-20, 20, 5000), rng.integers(0, 3, 5000)
    return np.column_stack([along, 12.0 * which, 0.1 * along]) + rng.normal(0, 0.004, (5000, 3))


@pytest.mark.parametrize("make", [helix, three_lines])
def test_points_along_lines_are_refused(make: Callable[[np.random.Generator], np.ndarray]) -> None:
    with pytest.raises(st.InputError, match="the points lie along lines, not on a surface"):
        st.grid_from_points(make(np.random.default_rng(1)), st.Settings(length=1.2))


@pytest.mark.parametrize("shape", ["box", "ball"])
@pytest.mark.parametrize("length", [None, 0.6, 1.0, 1.5, 2.2])
def test_points_that_fill_a_volume_are_refused_at_every_length(shape: str, length: float | None) -> None:
    points = np.random.default_rng(2).uniform(-5, 5, (30_000, 3))
    if shape == "ball":
        points = points[(points**2).sum(axis=1) < 25]
    cloud = st.PointCloud.from_array(points)
    length = length_range(cloud)[0] if length is None else length  # None: the least
    with pytest.raises(st.InputError, match="the points fill a volume and lie on no surface"):
        st.sample_surface(cloud, st.Settings(length=length))


@pytest.mark.parametrize("length", [1.0, 2.0, 4.0])
def test_a_surface_among_strays_is_no_volume_however_long_the_members(length: float) -> None:
    rng = np.random.default_rng(9)
    points = np.concatenate([plate(rng, 40_000), rng.uniform(-10, 10, (4000, 3))])
    st.sample_surface(st.PointCloud.from_array(points), st.Settings(length=length))


def test_a_rough_surface_is_no_volume_and_a_narrow_strip_no_line() -> None:
    rng = np.random.default_rng(3)
    rough = plate(rng) + rng.normal(0, 0.1, (12_000, 3))
    strip = np.column_stack([rng.uniform(0, 40, 8000), rng.uniform(0, 2.5, 8000), np.zeros(8000)])
    for points in (rough, strip):
        cloud = st.PointCloud.from_array(points)
        st.sample_surface(cloud, st.Settings(length=1.2))


@pytest.mark.parametrize(("apart", "said"), [(0.15, True), (0.4, True), (0.0, False), (3.0, False)])
def test_two_layers_closer_than_half_a_member_are_told_with_their_distance(apart: float, said: bool) -> None:
    rng = np.random.default_rng(4)
    points = np.concatenate([plate(rng), plate(rng) + [0, 0, apart]]) + rng.normal(0, 0.004, (24_000, 3))
    samples = st.sample_surface(st.PointCloud.from_array(points), st.Settings(length=1.2))
    distance, share = samples.layers
    assert (share > 0.8) == said
    assert not said or distance == pytest.approx(apart, rel=0.1)


@pytest.mark.parametrize("length", [1.5, 2.0])
def test_two_layers_are_told_where_the_scan_is_so_dense_that_it_looks_smooth(length: float) -> None:
    rng = np.random.default_rng(4)
    points = np.concatenate([plate(rng, 60_000), plate(rng, 60_000) + [0, 0, 0.15]]) + rng.normal(
        0, 0.004, (120_000, 3)
    )
    samples = st.sample_surface(st.PointCloud.from_array(points), st.Settings(length=length))
    assert samples.smooth
    distance, share = samples.layers
    assert share > 0.5 and distance == pytest.approx(0.15, rel=0.1)


def scan_lines(rng: np.random.Generator) -> np.ndarray:
    """Twelve lines of a scanner over a vault, far apart, with many points on each."""
    along, across = rng.uniform(0, 30, 6000), 2.5 * rng.integers(0, 12, 6000)
    return np.column_stack([along, across, 0.004 * (across - 14.0) ** 2]) + rng.normal(0, 0.002, (6000, 3))


def test_lines_of_a_scanner_get_a_length_that_spans_them_and_three_lines_get_none() -> None:
    rng = np.random.default_rng(8)
    cloud = st.PointCloud.from_array(scan_lines(rng))
    advice = Advice(cloud, st.Settings(length=1.0))
    with pytest.raises(st.InputError, match="the points lie along lines"):
        st.sample_surface(cloud, st.Settings(length=suggest_length(cloud)))
    length = advice.suggest()
    assert known(advice.try_length(length)).passed and length > 2.5
    short = known(advice.try_length(1.5))
    assert not short.passed and "the points lie along lines" in str(short.fault)
    with pytest.raises(st.InputError, match="the points lie along lines"):
        Advice(st.PointCloud.from_array(three_lines(rng)), st.Settings(length=1.0))


@pytest.mark.parametrize(
    ("length", "way_on"), [("1.2", "a grid passes with --length"), ("9", "use at most 8.5; a grid passes")]
)
def test_lines_of_a_scanner_are_refused_with_a_length_that_passes(
    length: str, way_on: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    np.savetxt("lines.xyz", scan_lines(np.random.default_rng(8)), fmt="%.4f")
    assert main(["grid", "lines.xyz", "a.obj", "--length", length, "--effort", "quick"]) == 2
    assert way_on in capsys.readouterr().err


def test_a_sheet_that_was_not_asked_for_is_listed_though_it_lies_near_the_grid(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Nor is it rounded off, too small, or apart from the other in a box."""
    rng = np.random.default_rng(4)
    points = np.concatenate([plate(rng, 30_000), plate(rng, 30_000) + [0, 0, 0.62]]) + rng.normal(0, 0.004, (60_000, 3))
    monkeypatch.chdir(tmp_path)
    np.savetxt("two.xyz", points, fmt="%.4f")
    assert main(["grid", "two.xyz", "a.json", "--length", "1.3", "--effort", "quick", "--piece", "1"]) == 0
    said = capsys.readouterr()
    assert "--piece 2 takes it alone" in said.err and "--crop" not in said.err
    assert "too small" not in said.err and "rounds off" not in said.out
    certificate = known(st.read_grid("a.json").certificate)
    (part,) = [part for part in certificate.left_out if part.kind == "not chosen"]
    assert part.points == 30_000 and part.asked and certificate.missing == 0.0


def room(rng: np.random.Generator, floor_at: float = 0.0, sides: tuple[float, float] = (9, 6)) -> np.ndarray:
    """A curved roof over a level floor, and which points are of the floor."""
    x, y = rng.uniform(-9, 9, 12_000), rng.uniform(-6, 6, 12_000)
    roof = np.column_stack([x, y, 6.0 - 0.03 * x * x - 0.04 * y * y])
    x, y = rng.uniform(-sides[0], sides[0], 9000), rng.uniform(-sides[1], sides[1], 9000)
    floor = np.column_stack([x, y, np.full(9000, floor_at)])
    return np.concatenate([roof, floor]) + rng.normal(0, 0.004, (21_000, 3))


@pytest.mark.parametrize(("unit", "piece", "pieces"), [("m", "auto", 1), ("m", "all", 2), ("", "auto", 2)])
def test_a_floor_under_a_roof_is_left_out_and_listed_where_up_is_known(unit: str, piece: str, pieces: int) -> None:
    points = room(np.random.default_rng(5), sides=(11, 8))
    grid = st.grid_from_points(points, st.Settings(length=1.4, unit=unit, piece=piece, effort="quick"))
    assert grid.topology.components == pieces and known(grid.certificate).passed
    left = {part.kind: part for part in known(grid.certificate).left_out}
    assert ("floor" in left) == (pieces == 1)
    if pieces == 1:
        assert left["floor"].points > 8500 and not left["floor"].asked and grid.scan_nodes[:, 2].min() > 1.0


@pytest.mark.parametrize("case", ["above", "inclined", "aside", "curved"])
def test_what_is_not_below_level_flat_and_covered_is_no_floor(case: str) -> None:
    rng = np.random.default_rng(6)
    points = room(rng, floor_at=9.0 if case == "above" else 0.0)
    low = np.arange(len(points)) >= 12_000
    points[low, 2] += {"inclined": 0.2, "curved": 0.0}.get(case, 0.0) * points[low, 0]
    points[low, 2] += (0.02 if case == "curved" else 0.0) * points[low, 0] ** 2
    points[low, 0] += 25.0 if case == "aside" else 0.0
    assert find_floor(points, low.astype(np.int64), (0, 1), 1.4) is None
    if case != "above":
        assert find_floor(room(rng), low.astype(np.int64), (0, 1), 1.4) == 1


def test_the_command_says_what_it_left_out_and_how_to_keep_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    np.savetxt("room.xyz", room(np.random.default_rng(7)), fmt="%.4f")
    assert main(["grid", "room.xyz", "a.json", "--length", "1.4", "--effort", "quick", "--unit", "m"]) == 0
    said = capsys.readouterr()
    assert "taken for the floor and left out; --piece all keeps it" in said.err
    assert "too small for this length" not in said.err  # as the floor, which is told by itself
    assert "of the scan," in said.out.splitlines()[0] and "in a floor under the others" in said.out.splitlines()[0]


@pytest.mark.parametrize(("cell", "is_floor"), [(1.4, True), (4.0, True), (6.5, False)])
def test_a_floor_is_one_where_members_are_longer_than_the_room_is_high_at_its_sides(
    cell: float, is_floor: bool
) -> None:
    """The roof stands 3 to 5 over the floor: half a member at least, and a member somewhere."""
    rng = np.random.default_rng(5)
    points = room(rng)
    low = points[:, 2] < 1.0
    points[~low, 2] += 3.0 - points[~low, 2].min()
    points[~low, 2] = 3.0 + (points[~low, 2] - 3.0) * 2.0 / np.ptp(points[~low, 2])
    assert (find_floor(points, low.astype(np.int64), (0, 1), cell) == 1) == is_floor


def test_where_a_small_piece_spoils_a_scan_the_largest_is_tried_alone_and_info_takes_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A saddle beside a Moebius strip, which gets no grid at any length."""
    rng = np.random.default_rng(3)
    saddle = plate(rng, 9000, 6.0)
    turn, across = rng.uniform(0, 2 * np.pi, 5000), rng.uniform(-1, 1, 5000)
    out = 3 + across * np.cos(turn / 2)
    strip = np.column_stack([out * np.cos(turn) + 16, out * np.sin(turn), across * np.sin(turn / 2)])
    monkeypatch.chdir(tmp_path)
    np.savetxt("two.xyz", np.concatenate([saddle, strip]) + rng.normal(0, 0.003, (14_000, 3)), fmt="%.4f")
    assert main(["grid", "two.xyz", "a.obj", "--length", "1", "--effort", "quick"]) == 2
    (said,) = re.findall(r"one-sided.*; the largest piece alone gets a grid with (.*)$", capsys.readouterr().err, re.M)
    assert said == "--piece 1 --length 1"
    assert main(["info", "two.xyz", *said.split()]) == 0
    assert "try --length 1\n" in capsys.readouterr().out
    assert main(["grid", "two.xyz", "a.obj", *said.split(), "--effort", "quick"]) == 0
    assert main(["info", "two.xyz"]) == 0
    assert f"the largest piece alone gets a grid with {said}\n" in capsys.readouterr().out
