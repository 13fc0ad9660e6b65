"""Columns, scaffold and floor: what is too thin for a grid is left out where nothing passes with it, and pieces can be chosen."""

from __future__ import annotations

from itertools import islice
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from typed import known

import scantruss as st
from scantruss.attempts.looks import stands_on_columns
from scantruss.attempts.table import attempts
from scantruss.check.distances import boxes_of
from scantruss.check.gaps import openings_closed
from scantruss.cli.main import main
from scantruss.cli.shared import box_around
from scantruss.grid.certificate import LeftOut
from scantruss.kernels.surface.rods import spreads_around
from scantruss.scan.member_length import length_range
from scantruss.surface.chosen_samples import KEPT, ROD
from scantruss.surface.linked_samples import link_samples
from scantruss.surface.pieces import by_size
from scantruss.surface.rods import LENGTH_STEP, _widens, lengths_of_rods, rod_points
from scantruss.surface.samples import SurfaceSamples, sample_surface
from scantruss.surface.supports import free_columns, support_samples

LENGTH = 1.4


def roof(rng: np.random.Generator, count: int = 12_000) -> np.ndarray:
    x, y = rng.uniform(-9, 9, count), rng.uniform(-6, 6, count)
    return np.column_stack([x, y, 6.0 - 0.03 * x * x - 0.04 * y * y]) + rng.normal(0.0, 0.004, (count, 3))


def pole(
    rng: np.random.Generator, x: float, y: float, low: float, high: float, radius: float, count: int
) -> np.ndarray:
    turn = rng.uniform(0, 2 * np.pi, count)
    return np.column_stack([x + radius * np.cos(turn), y + radius * np.sin(turn), rng.uniform(low, high, count)])


@pytest.fixture(scope="module")
def hall() -> tuple[np.ndarray, np.ndarray]:
    """A roof, a floor under it and four columns between them; and which points are of the columns."""
    rng = np.random.default_rng(2)
    floor = np.column_stack([rng.uniform(-11, 11, 9000), rng.uniform(-8, 8, 9000), rng.normal(0.0, 0.004, 9000)])
    columns = np.concatenate([pole(rng, x, y, 0.0, 4.0, 0.2, 900) for x in (-6, 6) for y in (-4, 4)])
    parts = [roof(rng), floor, columns]
    return np.concatenate(parts), np.repeat([False, False, True], [len(part) for part in parts])


def rods_of(points: np.ndarray, length: float) -> np.ndarray:
    cloud = st.PointCloud.from_array(points)
    return rod_points(link_samples(cloud.points, 0.2 * length, length, cloud.spacing), len(points), length)


@pytest.mark.parametrize("length", [1.0, 1.2, LENGTH])
def test_a_column_that_goes_on_above_its_roof_is_left_out_there_too(length: float) -> None:
    rng = np.random.default_rng(7)
    columns = np.concatenate([pole(rng, x, y, 0.0, 6.2, 0.25, 1200) for x in (-6, 6) for y in (-4, 4)])
    floor = np.column_stack([rng.uniform(-11, 11, 9000), rng.uniform(-8, 8, 9000), rng.normal(0.0, 0.004, 9000)])
    points = np.concatenate([roof(rng), floor, columns])
    above = points[:, 2] > 6.4 - 0.03 * points[:, 0] ** 2 - 0.04 * points[:, 1] ** 2
    above[: -len(columns)] = False
    rod = rods_of(points, length)
    assert above.sum() > 500 and rod[above].all()
    assert rod[: -len(columns)].mean() < 0.01
    x, y, z = st.grid_from_points(points, st.Settings(length=length, effort="quick")).scan_nodes.T
    assert np.minimum(np.abs(z), np.abs(z - 6.0 + 0.03 * x * x + 0.04 * y * y)).max() < 0.15


def test_columns_are_rods_and_roof_and_floor_are_none(hall: tuple[np.ndarray, np.ndarray]) -> None:
    points, column = hall
    rod = rods_of(points, LENGTH)
    clear = (points[:, 2] > 0.5 * LENGTH) & (points[:, 2] < 3.0)
    assert rod[column & clear].mean() > 0.95
    assert rod[~column].mean() < 0.01


def strut(rng: np.random.Generator, foot: tuple[float, ...], top: tuple[float, ...], points: int) -> np.ndarray:
    along = rng.random(points)[:, None] * np.subtract(top, foot) + foot
    turn = rng.uniform(0.0, 2.0 * np.pi, points)
    round_it = np.column_stack([np.cos(turn), np.sin(turn), 0.0 * turn])
    return np.asarray(along + 0.1 * round_it)


@pytest.mark.parametrize("length", [0.8, 1.0, 1.2])
def test_struts_between_two_walls_in_one_plane_are_no_patch_of_these(length: float) -> None:
    """They are flat together, but not filled."""
    rng = np.random.default_rng(2)
    walls = np.column_stack([rng.uniform(0, 24, 12_000), rng.normal(0, 0.01, 12_000), rng.uniform(0, 5, 12_000)])
    walls[6_000:, 2] += 9.0
    legs = [strut(rng, (x, 0.0, 5.0), (x + step, 0.0, 9.0), 200) for x in range(3, 22, 4) for step in (-2.0, 2.0)]
    rod = rods_of(np.concatenate([walls, *legs]), length)
    assert rod[12_000:].mean() > 0.6 and not rod[:12_000].mean() > 0.01


def shell_on_struts(rng: np.random.Generator) -> np.ndarray:
    """A round wall over 16 pairs of struts, each a V upside down."""
    turn, z = rng.uniform(0, 2 * np.pi, 14_000), rng.uniform(6.0, 20.0, 14_000)
    girth = 24.0 - 0.2 * z
    parts = [np.column_stack([girth * np.cos(turn), girth * np.sin(turn), z]) + rng.normal(0, 0.03, (14_000, 3))]
    for k in np.arange(16):
        for side in (-0.5, 0.5):
            a, b = 2 * np.pi * k / 16, 2 * np.pi * (k + side) / 16
            foot, top = (24 * np.cos(b), 24 * np.sin(b), 0.0), (22.8 * np.cos(a), 22.8 * np.sin(a), 6.0)
            parts.append(strut(rng, foot, top, 260))
    return np.concatenate(parts)


def test_a_grid_that_spans_from_strut_to_strut_below_a_shell_is_followed_by_one_without_them() -> None:
    length = 6.0
    grid = st.grid_from_points(shell_on_struts(np.random.default_rng(3)), st.Settings(length=length, effort="quick"))
    assert any(part.kind == "rods" for part in known(grid.certificate).left_out)


@pytest.mark.parametrize("width", [0.8, 2.0])
def test_a_sheet_is_no_rod_however_its_edge_runs(width: float) -> None:
    """Nor is a strip as wide as .8 members."""
    rng = np.random.default_rng(0)
    x, y = rng.uniform(0, 12, 8000), rng.uniform(0, width * LENGTH, 8000)
    assert not rods_of(np.column_stack([x, y, 0.05 * x * x]), LENGTH).any()


@pytest.mark.parametrize("seed", range(4))
def test_thin_spots_of_a_sparse_sheet_are_no_rods(seed: int) -> None:
    """However short the members."""
    points = roof(np.random.default_rng(seed))
    low, _ = length_range(st.PointCloud.from_array(points))
    assert not any(rods_of(points, share * low).any() for share in (1.0, 1.1, 1.2, 1.4, 1.6))


@pytest.mark.parametrize("length", [12.0, 18.0, 25.0])
def test_a_sparse_part_of_a_sheet_is_no_scaffold(length: float) -> None:
    """The face of a head with a thirtieth of the points of its hair: it left as columns, a fifth of the surface."""
    rng = np.random.default_rng(4)
    head = rng.normal(0.0, 1.0, (40_000, 3))
    head /= np.linalg.norm(head, axis=1)[:, None]
    head = head[(head[:, 0] < 0.55) | (rng.random(len(head)) < 0.03)]
    cloud = st.PointCloud.from_array(100.0 * head * (1.0, 0.85, 1.25) + rng.normal(0.0, 0.15, head.shape))
    samples = sample_surface(cloud, st.Settings(length=length, keep_rods=False))
    assert (samples.judged == ROD).mean() < 0.001  # the face has eight times as many


def test_a_hall_gets_grids_of_roof_and_floor_and_the_columns_are_told(hall: tuple[np.ndarray, np.ndarray]) -> None:
    points, column = hall
    grid = st.grid_from_points(points, st.Settings(length=LENGTH, effort="quick"))
    assert known(grid.certificate).passed and grid.topology.components == 2 and not known(grid.settings).keep_rods
    (part,) = (part for part in known(grid.certificate).left_out if part.kind == "rods")
    assert 0.8 * column.sum() < part.points < 1.1 * column.sum() and not part.asked
    assert any(warning.kind == "left out" for warning in known(grid.certificate).warnings)


def test_the_edge_of_a_roof_does_not_run_down_its_columns() -> None:
    """A part of a torus on six columns near its edges, without a floor: the grid went down to their feet, with seven warnings."""
    rng = np.random.default_rng(2411)
    turn, slope = rng.uniform(0, np.radians(110), 20_000), rng.uniform(np.radians(20), np.radians(160), 20_000)
    radius = 25 + 8 * np.cos(slope)
    parts = [np.column_stack([radius * np.cos(turn), radius * np.sin(turn), 8 * np.sin(slope) + 3])]
    for turned in np.radians([15, 55, 95]):
        for at in np.radians([40, 140]):
            away = 25 + 8 * np.cos(at)
            parts.append(
                pole(rng, away * np.cos(turned), away * np.sin(turned), 0.0, 8 * np.sin(at) + 3, radius=0.3, count=500)
            )
    points = np.concatenate(parts) + rng.normal(0.0, 0.004, (23_000, 3))
    grid = st.grid_from_points(points, st.Settings(length=5.0, effort="quick"))
    assert not known(grid.settings).keep_rods
    assert grid.nodes[:, 2].min() + grid.origin[2] > 5.5
    assert {warning.kind for warning in known(grid.certificate).warnings} == {"left out"}


@pytest.mark.parametrize(("reason", "words"), [(ROD, "where a column"), (KEPT, "shorter members leave it open")])
def test_a_place_that_was_closed_under_a_column_is_no_opening(reason: int, words: str) -> None:
    """Shorter members do not open it."""
    below = np.linspace([0.0, 0.0, -2.0], [0.0, 0.0, -0.5], 5)
    samples = cast(SurfaceSamples, SimpleNamespace(scan=below, judged=np.full(5, reason), origin=np.ones(3)))
    hole = LeftOut("hole", 1, 0.0, (1.2, 1.0, 1.0), 0.8)
    (warning,) = openings_closed([hole], [], samples, LENGTH, "m")
    assert words in warning.words and "0.8 m" in warning.words and warning.where == hole.where


def test_a_place_under_a_column_and_an_opening_are_said_apart() -> None:
    """An opening beside a column is not that of the column."""
    below = np.linspace([0.0, 0.0, -4.0], [0.0, 0.0, -0.5], 50)
    samples = cast(SurfaceSamples, SimpleNamespace(scan=below, judged=np.full(50, ROD), origin=np.ones(3)))
    holes = [LeftOut("hole", 1, 0.0, (x, 1.0, 1.3), 0.8) for x in (1.1, 1.6)]
    column, opening = openings_closed(holes, [], samples, LENGTH, "")
    assert column.words == "closes a place 0.8 across, where a column or the like was left out"
    assert opening.words == "closes an opening 0.8 across; shorter members leave it open"


def test_of_a_large_opening_that_is_closed_shorter_members_may_leave_it_open() -> None:
    """One that is four members around or more is no small hole: another length need not."""
    samples = cast(SurfaceSamples, SimpleNamespace(scan=np.zeros((1, 3)), judged=np.array([KEPT]), origin=np.zeros(3)))
    (warning,) = openings_closed([LeftOut("hole", 1, 0.0, (1.5, 1.0, 1.0), 2.0)], [], samples, LENGTH, "m")
    assert warning.words == "closes an opening 2 m across; shorter members may leave it open"


def test_a_hall_is_tried_without_its_columns_right_after_the_first_grid(hall: tuple[np.ndarray, np.ndarray]) -> None:
    """So that `info` finds its lengths with the few grids that it makes of each."""
    cloud = st.PointCloud.from_array(hall[0])
    first, second = islice(attempts(cloud, st.Settings(length=LENGTH, effort="quick")), 2)
    assert first.settings.keep_rods and not second.settings.keep_rods
    roof_alone = cloud.points[hall[0][:, 2] > 4.5]
    all_of_it = list(attempts(st.PointCloud.from_array(roof_alone), st.Settings(length=LENGTH, effort="quick")))
    assert all(attempt.settings.keep_rods for attempt in all_of_it)


@pytest.mark.parametrize("step", [0.01, 0.012])
def test_rows_of_a_scan_far_apart_are_no_rods(step: float) -> None:
    """A roof from one position, its rows four times as far apart as the points in them: four fifths of it were left out as cables."""
    rise, turn = np.meshgrid(np.arange(0.15, 1.45, 4.0 * step), np.arange(-np.pi, np.pi, step), indexing="ij")
    x, y = 6.0 + 4.0 * np.tan(rise) * np.cos(turn), -8.0 + 4.0 * np.tan(rise) * np.sin(turn)
    z = 6.0 + 0.03 * x * y + np.random.default_rng(0).normal(0.0, 0.004, x.shape)
    roof = np.stack([x, y, z], axis=-1)[(np.abs(x) < 10.0) & (np.abs(y) < 9.0)]
    samples = st.sample_surface(st.PointCloud.from_array(roof), st.Settings(length=2.7, keep_rods=False))
    assert not (samples.judged == ROD).any()


@pytest.mark.parametrize(("piece", "height"), [("2", (2.0, 6.5)), ("largest", (-0.2, 0.6)), ("1", (-0.2, 0.6))])
def test_one_piece_is_taken_alone(hall: tuple[np.ndarray, np.ndarray], piece: str, height: tuple[float, float]) -> None:
    settings = st.Settings(length=LENGTH, effort="quick", keep_rods=False, piece=piece)
    grid = st.grid_from_points(hall[0], settings)
    assert grid.topology.components == 1
    assert height[0] < grid.nodes[:, 2].min() and grid.nodes[:, 2].max() < height[1]
    assert any(part.kind == "not chosen" and part.asked for part in known(grid.certificate).left_out)


def test_pieces_that_are_not_there_and_words_that_are_none_are_refused(hall: tuple[np.ndarray, np.ndarray]) -> None:
    with pytest.raises(
        st.InputError, match=r"piece 7 is asked for, but the scan has 2.*; choose a number up to 2, largest or all"
    ):
        st.grid_from_points(hall[0], st.Settings(length=LENGTH, keep_rods=False, piece="7"))
    for piece in ("some", "0", "1,", "-1", ""):
        with pytest.raises(st.InputError, match="piece must be auto, all, largest or numbers"):
            st.Settings(length=1.0, piece=piece)


def sheets(*sizes: tuple[float, float, int]) -> np.ndarray:
    """Level sheets beside one another, each with its sides and points."""
    rng, at, parts = np.random.default_rng(4), 0.0, []
    for width, depth, count in sizes:
        parts.append(rng.uniform([at, 0, 0], [at + width, depth, 0.01], (count, 3)))
        at += width + 8.0
    return np.concatenate(parts)


def test_no_length_changes_the_number_of_a_piece() -> None:
    """Two are nearly as large, one of these has twice the points; a small one is dense."""
    cloud = st.PointCloud.from_array(sheets((12, 9, 12_000), (12.2, 9, 6_000), (6, 6, 5_000)))
    found: list[list[float]] = []
    for length in (1.0, 1.2, 1.4, 1.7, 2.0, 2.4, 3.2):
        settings = st.Settings(length=length)
        samples = sample_surface(cloud, settings)
        named = samples.named_pieces
        found.append([float(samples.surface.mean[samples.piece == named[number], 0].min()) for number in sorted(named)])
        for number, at in enumerate(found[-1], 1):
            chosen = sample_surface(cloud, settings.replace(piece=str(number)))
            assert chosen.surface.mean[chosen.kept, 0].min() == pytest.approx(at, abs=1e-9)
    assert {len(each) for each in found} == {2, 3}
    for each in found:
        assert each == pytest.approx(found[0][: len(each)], abs=0.5)


def test_pieces_of_as_large_an_area_are_numbered_by_place() -> None:
    places = np.array([[5.0, 0, 0], [1.0, 3, 0], [1.0, 2, 0], [9.0, 0, 0]])
    assert by_size(np.array([0, 1, 2, 3, 3, -1]), places, np.arange(4)) == [3, 2, 1, 0]


def test_the_command_names_the_pieces_and_how_to_take_one(
    hall: tuple[np.ndarray, np.ndarray], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    np.save(tmp_path / "hall.npy", hall[0])
    words = ["grid", str(tmp_path / "hall.npy"), str(tmp_path / "a.obj"), "--length", str(LENGTH), "--effort", "quick"]
    assert main(words) == 0
    said = "".join(capsys.readouterr())
    assert "piece 2: " in said and "--no-keep-rods --piece 2 takes it alone, --crop box:" in said
    assert said.index("of the scan, ") < said.index("shape quality")


@pytest.mark.parametrize("at", [(0.0, 0.0, 0.0), (674521.92, 1206740.08, 627.53), (3.5e6, 5.4e6, -0.02)])
@pytest.mark.parametrize("margin", [0.004, 0.3, 25.0])
def test_the_box_of_a_piece_holds_it_and_little_else_wherever_it_lies(at: tuple[float, ...], margin: float) -> None:
    low = np.array(at)
    high = low + 100 * margin
    box = np.reshape([float(word) for word in box_around(low, high, margin).split(",")], (2, 3))
    assert np.allclose(box, [low - margin, high + margin], rtol=0, atol=0.1 * margin)


@pytest.fixture(scope="module")
def scaffolded() -> tuple[np.ndarray, np.ndarray]:
    """A roof and a scaffold close under it; and which points are of the scaffold."""
    rng = np.random.default_rng(5)
    poles = [pole(rng, x, y, 0.0, 4.4, 0.03, 250) for x in (-5, -2.5, 0, 2.5, 5) for y in (-2.5, 0, 2.5)]
    ledgers = [
        np.column_stack([rng.uniform(-5, 5, 500), rng.normal(y, 0.02, 500), rng.normal(z, 0.02, 500)])
        for y in (-2.5, 0, 2.5)
        for z in (1.6, 3.0, 4.2)
    ]
    parts = [roof(rng), *poles, *ledgers]
    return np.concatenate(parts), np.repeat([False, *([True] * (len(parts) - 1))], [len(part) for part in parts])


@pytest.mark.parametrize("length", [1.3, 2.1, 3.3])
def test_a_scaffold_is_known_however_long_the_members(scaffolded: tuple[np.ndarray, np.ndarray], length: float) -> None:
    """Members as long as the poles are apart see a thick layer of roof and scaffold."""
    points, scaffold = scaffolded
    samples = sample_surface(st.PointCloud.from_array(points), st.Settings(length=length, keep_rods=False))
    rods = samples.judged == ROD
    assert not rods[~scaffold].any() and rods[scaffold].mean() > 0.99


def test_a_grid_over_a_scaffold_keeps_to_its_roof(scaffolded: tuple[np.ndarray, np.ndarray]) -> None:
    grid = st.grid_from_points(scaffolded[0], st.Settings(length=2.6, effort="quick"))
    assert known(grid.certificate).passed and grid.topology.boundary_loops == 1
    x, y, z = grid.scan_nodes.T
    assert np.abs(z - 6.0 + 0.03 * x * x + 0.04 * y * y).max() < 0.1


@pytest.mark.parametrize("length", [1.6, 3.0, 4.5])
@pytest.mark.parametrize("bend", [0.0, 0.02])
def test_flat_arms_of_a_shell_are_no_rods_however_long_the_members(length: float, bend: float) -> None:
    """A member is wider than the arms, as than the posts below: of these, scanned from one side, it sees a flat face too."""
    rng = np.random.default_rng(7)
    xy = rng.uniform(-12, 12, (60_000, 2))
    on_disc = np.hypot(*xy.T) < 5.0
    xy = xy[on_disc | (np.abs(xy).min(axis=1) < 0.6)]
    shell = np.column_stack([xy, 6.0 - bend * (xy**2).sum(axis=1)])
    faces = [
        np.column_stack([rng.uniform(x - 0.3, x + 0.3, 400), np.full(400, y), rng.uniform(0.0, 6.0 - 18 * bend, 400)])
        for x in (-3.0, 3.0)
        for y in (-3.0, 3.0)
    ]
    points = np.concatenate([shell, *faces]) + rng.normal(0.0, 0.004, (len(shell) + 1600, 3))
    samples = sample_surface(st.PointCloud.from_array(points), st.Settings(length=length, keep_rods=False))
    rods = samples.judged == ROD
    assert not rods[: len(shell)][np.hypot(*xy.T) > 5.0].any() and rods[: len(shell)].sum() < 10  # where posts end
    assert rods[len(shell) :].mean() > 0.9


def test_what_is_nothing_but_rods_is_a_scan_nevertheless() -> None:
    """A wing, a boom and a tail, all narrower than the members."""
    rng = np.random.default_rng(3)
    wing, tail = (
        rng.uniform([x, -w, 0.0], [x + c, w, 0.0], (n, 3))
        for x, w, c, n in ((0.0, 8.0, 1.5, 30_000), (6.5, 1.5, 0.7, 3000))
    )
    turn = rng.uniform(0.0, 2.0 * np.pi, 4000)
    boom = np.column_stack([rng.uniform(1.5, 7.0, 4000), 0.12 * np.cos(turn), 0.12 * np.sin(turn)])
    cloud = st.PointCloud.from_array(np.concatenate([wing, boom, tail]) + rng.normal(0.0, 0.003, (37_000, 3)))
    samples = sample_surface(cloud, st.Settings(length=4.5, keep_rods=False))
    assert (samples.judged == KEPT).mean() > 0.99


def test_rods_are_looked_for_from_a_few_spacings_up_to_the_length_asked_for() -> None:
    assert lengths_of_rods(1.0, 0.05) == [1.0]
    lengths = lengths_of_rods(5.0, 0.05)
    steps = np.divide(lengths[1:], lengths[:-1])
    assert lengths[0] == pytest.approx(1.2) and lengths[-1] == 5.0
    assert steps.max() == pytest.approx(LENGTH_STEP) and steps.min() > 1.0
    assert lengths_of_rods(5.0, 0.0) == [5.0]


@pytest.mark.parametrize("length", [1.0, 3.0])
def test_strays_are_left_out_however_long_the_members(length: float) -> None:
    """Long members reach from outlier to outlier: then nothing passes until the outliers are looked for."""
    rng = np.random.default_rng(4)
    strays = rng.uniform([-12, -9, -3], [12, 9, 10], (1500, 3))
    points = np.concatenate([roof(rng), strays])
    grid = st.grid_from_points(points, st.Settings(length=length, effort="quick"))
    assert known(grid.certificate).passed and (grid.topology.components, grid.topology.boundary_loops) == (1, 1)
    (part,) = (part for part in known(grid.certificate).left_out if part.kind == "outliers")
    assert 1350 < part.points <= 1530


@pytest.mark.kernels
def test_spreads_around_are_those_of_plain_sums() -> None:
    rng = np.random.default_rng(1)
    mean, alive = rng.normal(size=(150, 3)), rng.random(150) < 0.7
    which = rng.permutation(150)[:100]
    moments, middle, counts = np.empty((100, 3, 3)), np.empty((100, 3)), np.empty(100, np.int64)
    spreads_around(mean, boxes_of(mean, 0.4), alive, 0.8, which, moments, middle, counts, 0, 100)
    for s, at in enumerate(which):
        near = mean[alive & (np.linalg.norm(mean - mean[at], axis=1) <= 0.8)]
        assert counts[s] == len(near)
        if len(near):
            assert middle[s] == pytest.approx(near.mean(axis=0))
            assert moments[s] == pytest.approx(np.cov(near.T, bias=True), abs=1e-9) if len(near) > 1 else True


def thick_hall(rng: np.random.Generator, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """A roof over a floor with four columns, and which points are of the columns."""
    floor = np.column_stack([rng.uniform(-11, 11, 9000), rng.uniform(-8, 8, 9000), rng.normal(0.0, 0.004, 9000)])
    columns = np.concatenate([pole(rng, x, y, 0.0, 4.2, radius, 1500) for x in (-6, 6) for y in (-4, 4)])
    parts = [roof(rng), floor, columns]
    return np.concatenate(parts), np.repeat([False, False, True], [len(part) for part in parts])


@pytest.mark.parametrize("radius", [0.42, 0.6])
def test_columns_as_thick_as_a_member_are_cut_off_with_the_floor(radius: float) -> None:
    points, column = thick_hall(np.random.default_rng(3), radius)
    grid = st.grid_from_points(points, st.Settings(length=LENGTH, effort="quick", unit="m"))
    certificate = known(grid.certificate)
    assert certificate.passed and grid.topology.components == 1 and not known(grid.settings).keep_rods
    assert grid.scan_nodes[:, 2].min() > 1.5
    left = {part.kind: part.points for part in certificate.left_out}
    assert left["floor"] > 8500 and 0.75 * column.sum() < left["rods"] < 1.2 * column.sum()


@pytest.mark.parametrize("shape", ["dome", "roof", "foot"])
def test_a_shell_that_comes_down_to_the_floor_has_no_supports(shape: str) -> None:
    """Nor has one without a floor."""
    rng = np.random.default_rng(4)
    floor = np.column_stack([rng.uniform(-11, 11, 9000), rng.uniform(-8, 8, 9000), np.zeros(9000)])
    if shape == "dome":
        height, turn = rng.uniform(0, 6, 15_000), rng.uniform(0, 2 * np.pi, 15_000)
        away = np.sqrt(36 - height**2)
        points = np.concatenate([np.column_stack([away * np.cos(turn), away * np.sin(turn), height]), floor])
    elif shape == "roof":
        points = roof(rng)
    else:
        x, y = rng.uniform(-9, 9, 20_000), rng.uniform(-5, 5, 20_000)
        points = np.concatenate([np.column_stack([x, y, 5 * (1 - (x / 9) ** 2)]), floor])
    cloud = st.PointCloud.from_array(points)
    assert not support_samples(link_samples(cloud.points, 0.2 * LENGTH, LENGTH, cloud.spacing), LENGTH).any()


def vault_on_pillars(radius: float) -> np.ndarray:
    """A groin vault of a bay of 8 x 8 on four pillars as high as half of it, without floor and unit."""
    rng = np.random.default_rng(5)
    x, y = rng.uniform(-4, 4, (2, 20_000))
    z = 4.0 + np.sqrt(36.0 - (np.minimum(np.abs(x), np.abs(y)) + 2.0) ** 2)
    vault = np.column_stack([x, y, z])[z > 4.6]
    pillars = [pole(rng, x, y, 0.0, 4.6, radius, 1200) for x in (-4, 4) for y in (-4, 4)]
    points = np.concatenate([vault, *pillars])
    return points + rng.normal(0.0, 0.004, points.shape)


@pytest.mark.parametrize("length", [0.5, 0.7, 1.0])
def test_all_pillars_of_a_vault_are_left_out_alike_and_its_groins_are_ridges(length: float) -> None:
    """They were closed cans, or missed, and hid the groins as so many false folds."""
    points = vault_on_pillars(0.35)
    grid = st.grid_from_points(points, st.Settings(length=length, effort="quick"))
    certificate = known(grid.certificate)
    assert certificate.passed and grid.topology.components == 1 and not known(grid.settings).smooth_scale
    assert grid.scan_nodes[:, 2].min() > 4.4
    left = {part.kind: part.points for part in certificate.left_out}
    assert 4800 <= left["rods"] < 6000
    assert len(grid.line_sets) >= 4


@pytest.mark.parametrize("axes", [[0, 1, 2], [1, 2, 0], [2, 0, 1]])
def test_legs_of_a_body_are_no_columns_whichever_way_is_up(axes: list[int]) -> None:
    rng = np.random.default_rng(6)
    body = rng.normal(size=(20_000, 3))
    body = body / np.linalg.norm(body, axis=1)[:, None] * [4.0, 2.0, 1.8] + [0.0, 0.0, 6.0]
    legs = [pole(rng, x, y, 0.0, 4.8, 0.35, 1500) for x in (-2.5, 2.5) for y in (-0.8, 0.8)]
    points = np.concatenate([body, *legs])[:, axes]
    found = link_samples(points, 0.1, 0.8, st.PointCloud.from_array(points).spacing)
    for length in (0.5, 0.8, 1.2):
        assert not free_columns(found.mean, 0.1, length).any()


def test_neither_a_chimney_nor_a_tapering_foot_is_a_column() -> None:
    """A chimney stands on its roof; a foot of a shell is as wide above as its bay."""
    rng = np.random.default_rng(7)
    chimney = np.concatenate([roof(rng), pole(rng, 2.0, 1.0, 5.8, 9.0, 0.5, 2000)])
    foot = vault_on_pillars(0.35)
    for points in (chimney, foot[foot[:, 2] > 4.62]):
        found = link_samples(points, 0.15, 1.0, st.PointCloud.from_array(points).spacing)
        assert not free_columns(found.mean, 0.15, 1.0).any()


def groin_vault_to_its_springings(noise: float) -> np.ndarray:
    """A groin vault of a bay of 8 x 8 whose four feet come down to points, without unit; denser at its feet, as a vault is measured."""
    rng = np.random.default_rng(8)
    x, y = rng.uniform(-1.0, 1.0, (2, 150_000))
    z = 4.0 * np.maximum(np.sqrt(1.0 - x * x), np.sqrt(1.0 - y * y))
    points = np.column_stack([4.0 * x, 4.0 * y, z])[z > 0.4]
    steep = np.minimum(np.abs(points[:, 0]), np.abs(points[:, 1])) > 3.5
    feet = points[steep]
    again = np.concatenate([points, feet[rng.integers(0, len(feet), 3 * len(feet))]])
    return again + rng.normal(0.0, noise, again.shape)


@pytest.mark.parametrize("length", [0.3, 0.45, 0.63])
def test_the_feet_of_a_vault_are_no_columns(length: float) -> None:
    """They stand where its supports are."""
    cloud = st.PointCloud.from_array(groin_vault_to_its_springings(0.012))
    samples = sample_surface(cloud, st.Settings(length=length, keep_rods=False))
    assert not (samples.judged == ROD).any()
    assert not free_columns(samples.surface.mean, samples.surface.radius, length).any()


@pytest.mark.parametrize(
    ("widths", "tapers"), [((1, 2, 3, 4), True), ((1, 1, 1, 1), False), ((1, 1, 1, 3), False), ((3, 1, 1, 1), False)]
)
def test_a_strip_that_widens_evenly_is_a_foot_and_a_pole_with_a_capital_none(
    widths: tuple[int, ...], tapers: bool
) -> None:
    rng = np.random.default_rng(9)
    z = rng.uniform(0.0, 4.0, 2000)
    girth = 0.1 * (np.interp(z, [0.5, 1.5, 2.5, 3.5], widths) if tapers else np.array(widths)[z.astype(int)])
    turn = rng.uniform(0.0, 2.0 * np.pi, len(z))
    points = np.column_stack([girth * np.cos(turn), girth * np.sin(turn), z])
    assert _widens(points, points[z > 3.9], np.zeros((0, 3))) == tapers
    level = np.column_stack([rng.uniform(-2.0, 2.0, (2000, 2)), np.full(2000, 4.2)])
    assert not _widens(points[z < 3.0] if tapers else points, points[z > 3.9], level) or tapers


def test_no_place_that_was_closed_is_none_of_a_column() -> None:
    """Of many openings those without a place of their own are one entry: nothing is known of where they are."""
    samples = cast(SurfaceSamples, SimpleNamespace(scan=np.zeros((5, 3)), judged=np.full(5, ROD), origin=np.ones(3)))
    (warning,) = openings_closed([LeftOut("hole", 1, 0.0, None, 0.8, number=6)], [], samples, LENGTH, "m")
    assert warning.words == "closes an opening 0.8 m across (6 such places); shorter members leave it open"


def hall_on_a_wide_floor() -> np.ndarray:
    """Six bays of a groin vault on two columns, over a floor that is larger and denser than the vault."""
    rng = np.random.default_rng(12)
    x, y = rng.uniform(0, 18, 30_000), rng.uniform(0, 12, 30_000)
    a, b = x % 6 - 3, y % 6 - 3
    vault = np.column_stack([x, y, 4 + np.sqrt(9 - np.minimum(np.abs(a), np.abs(b)) ** 2)])
    floor = np.column_stack([rng.uniform(-1, 19, 70_000), rng.uniform(-1, 13, 70_000), np.zeros(70_000)])
    columns = [pole(rng, x, 6, 0.0, 4.3, 0.35, 2500) for x in (6, 12)]
    points = np.concatenate([vault, floor, *columns])
    return points + rng.normal(0.0, 0.01, points.shape)


@pytest.mark.parametrize("length", [0.6, 0.9, 1.1, 1.12, 1.3])
def test_whether_a_hall_stands_on_columns_does_not_hang_on_its_floor_or_the_length(length: float) -> None:
    cloud = st.PointCloud.from_array(hall_on_a_wide_floor(), unit="m")
    settings = st.Settings(length=length)
    without = sample_surface(cloud, settings.replace(keep_rods=False))
    assert stands_on_columns(cloud, settings) and without.floor is not None and len(without.pieces) == 1


def umbrellas(thick: float) -> np.ndarray:
    """Four inverted umbrellas on columns of one diameter, of more and of fewer points; the shells come down to them."""
    rng = np.random.default_rng(13)
    parts = []
    for x, y, count in ((0, 0, 1400), (9, 0, 900), (0, 9, 700), (9, 9, 1800)):
        u, v = rng.uniform(-4, 4, (2, 8000))
        z = 4 + 1.8 * (1 - (1 - np.abs(u) / 4) * (1 - np.abs(v) / 4))
        parts += [np.column_stack([x + u, y + v, z]), pole(rng, x, y, 0.0, 4.0, thick / 2, count)]
    points = np.concatenate(parts)
    return points + rng.normal(0.0, 0.02, points.shape)


@pytest.mark.parametrize("length", [0.4, 0.5, 0.6, 0.85])
def test_columns_of_one_diameter_are_all_left_out(length: float) -> None:
    points = umbrellas(0.5)
    cloud = st.PointCloud.from_array(points)
    samples = sample_surface(cloud, st.Settings(length=length, keep_rods=False))
    column = points[:, 2] < 3.5
    assert stands_on_columns(cloud, st.Settings(length=length))
    assert (samples.judged[column] == ROD).mean() > 0.97
    assert (samples.judged[points[:, 2] > 4.8] == ROD).mean() < 0.01


def test_a_flat_strip_in_the_plane_of_a_sheet_is_no_rod_and_one_across_it_is() -> None:
    """A table beyond the shadow of what stands on it, and one side of a column that stands on it."""
    rng = np.random.default_rng(14)
    table = np.column_stack([rng.uniform(-6, 6, (40_000, 2)), np.zeros(40_000)])
    table = table[(np.abs(table[:, 0]) > 1.2) | (np.abs(table[:, 1]) > 3.0)]
    strip = np.column_stack([rng.uniform(-0.25, 0.25, 800), rng.uniform(-2, 2, 800), np.zeros(800)])
    post = strip[:, [0, 2, 1]] + [3.5, 3.5, 2.0]
    points = np.concatenate([table, strip, post])
    rods = rods_of(points + rng.normal(0.0, 0.004, points.shape), 1.0)
    assert not rods[: len(table) + len(strip)].any(where=np.abs(points[: -len(post), 0]) < 1.0)
    assert rods[-len(post) :][post[:, 2] > 0.3].mean() > 0.95


def test_legs_below_the_edge_of_a_sheet_are_rods_though_they_lie_in_its_plane() -> None:
    rng = np.random.default_rng(15)
    shell = np.column_stack([rng.uniform(-6, 6, 30_000), np.zeros(30_000), rng.uniform(0, 6, 30_000)])
    along = rng.uniform(0.0, 3.0, 3000)
    legs = np.column_stack([rng.uniform(-0.06, 0.06, 3000) + np.tile([-4, -2, 0, 2, 4], 600), np.zeros(3000), -along])
    legs[:, 0] += np.repeat([-0.3, 0.3], 1500) * along
    points = np.concatenate([shell, legs])
    rods = rods_of(points + rng.normal(0.0, 0.004, points.shape), 1.0)
    assert rods[-len(legs) :].mean() > 0.5 and not rods[: len(shell)][shell[:, 2] > 0.5].any()


def test_a_few_points_that_look_like_a_column_are_none_where_z_may_not_be_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """As on the steep face of a quarry: 34 of 33,000."""
    cloud, settings = st.PointCloud.from_array(umbrellas(0.5)), st.Settings(length=0.85)
    monkeypatch.setattr("scantruss.attempts.looks.free_columns", lambda mean, *_: np.zeros(len(mean), np.int64))
    assert stands_on_columns(cloud, settings) and not cloud.z_is_up
    monkeypatch.setattr("scantruss.attempts.looks.LEAST_IN_COLUMNS", 0.5)
    assert not stands_on_columns(cloud, settings)
