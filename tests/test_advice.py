"""Advice on member lengths: what is suggested was tried and passes, here and at the next length above."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from marks import compiled_only
from shapes import make
from small_clouds import ball, sheet
from typed import known

import scantruss as st
from scantruss import pipeline
from scantruss.attempts.limit import FAR_FROM_PASSING, MOST_RUNS, AttemptLimit
from scantruss.attempts.table import Attempt
from scantruss.boundary import find
from scantruss.check.crossings import MOST_CROSSINGS
from scantruss.cli.main import main
from scantruss.errors import FrontError, OneSidedError
from scantruss.grid.certificate import Certificate, Fault, LeftOut
from scantruss.grid.line_sets import RIDGE
from scantruss.report import ladder
from scantruss.report.advice import Advice
from scantruss.report.ladder import HOPELESS_NEARBY, LEAST_TRIED, MOST_TRIED, SURE_PER_SPACING, TRIED_AROUND
from scantruss.report.length_trial import LengthTrial, settled
from scantruss.report.lengths import accepted_line, advice_lines, advice_rows, result_of, usual_cause
from scantruss.scan.member_length import length_range, round_length, suggest_length
from scantruss.surface.samples import SurfaceSamples

COUNT = 3000  # points of a scan


@cache
def cloud_of(name: str, count: int = COUNT) -> st.PointCloud:
    return st.PointCloud.from_array(make(name, count).points)


@cache
def suggested() -> float:
    """Return the length that is suggested for the limpet, where nothing is kept from passing."""
    return Advice(cloud_of("limpet"), st.Settings(length=1.0)).suggest()


@pytest.mark.parametrize("name", ["cloth", "limpet", "torus"])
def test_the_suggested_length_and_the_next_above_pass(name: str) -> None:
    cloud = cloud_of(name)
    advice = Advice(cloud, st.Settings(length=1.0))
    length = advice.suggest()
    low, high = length_range(cloud)
    assert low <= length <= high
    for each in (length, advice.next_above(length)):
        grid = st.grid_from_points(cloud.points, st.Settings(length=each))
        assert known(grid.certificate).passed and known(grid.certificate).judged_out <= 0.01


def test_a_length_is_tried_once_and_none_out_of_range() -> None:
    advice = Advice(cloud_of("limpet"), st.Settings(length=1.0))
    length = advice.suggest()
    assert advice.try_length(length) is advice.try_length(length)
    assert advice.try_length(1e-6) is None and advice.try_length(1e6) is None


def test_a_sphere_has_its_own_radius_and_a_plate_none() -> None:
    rng = np.random.default_rng(0)
    ball = rng.normal(size=(20_000, 3))
    ball *= 7.0 / np.linalg.norm(ball, axis=1, keepdims=True)
    assert Advice(st.PointCloud.from_array(ball), st.Settings(length=1.0)).radius == pytest.approx(7.0, rel=0.1)
    flat = np.column_stack([rng.uniform(0, 20, (8000, 2)), np.zeros(8000)])
    assert Advice(st.PointCloud.from_array(flat), st.Settings(length=1.0)).radius > 200.0


def test_members_are_estimated_from_the_area() -> None:
    advice = Advice(cloud_of("limpet"), st.Settings(length=1.0))
    length = advice.suggest()
    trial = advice.try_length(length)
    assert advice.members(length) == pytest.approx(len(known(known(trial).grid).members), rel=0.2)


def test_each_length_says_how_many_warnings_its_grid_gives_and_what_it_closes() -> None:
    parts = (LeftOut("gap", 0, 0.0), LeftOut("gap", 0, 0.0, number=3), LeftOut("hole", 0, 0.0))
    warnings = (Fault("gap", "bridges a gap 0.3 wide"), Fault("closed", "closes an opening"))
    found = Certificate("", 0.5, True, True, 1, 1, 1, 1, 1, 0, warnings=warnings, left_out=parts)

    def said(found: Certificate) -> str:
        return result_of(LengthTrial(1.0, cast(Any, SimpleNamespace(certificate=found))))

    assert said(found) == "passes with 2 warnings, 1 hole closed, 4 gaps bridged"
    assert said(replace(found, warnings=warnings[:1], left_out=())) == "passes with 1 warning"
    assert said(replace(found, warnings=(), left_out=())) == "passes"


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    np.savetxt("limpet.xyz", make("limpet", COUNT).points, fmt="%.5f")
    return tmp_path


def test_grid_without_a_length_takes_the_one_that_info_suggests_and_says_so(
    place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["info", "limpet.xyz"]) == 0
    said = capsys.readouterr().out
    wished = said.split("try --length ")[1].split()[0]
    row = next(line for line in said.splitlines() if line.split()[:1] == [wished])
    assert re.search(r"passes( with \d+ warnings?)?$", row.rstrip())
    assert main(["grid", "limpet.xyz", "a.json", "--effort", "quick"]) == 0
    assert f"no --length is given; using {wished}, as scantruss info suggests" in capsys.readouterr().err
    assert known(st.read_grid("a.json").settings).length == float(wished)


def test_info_prints_three_lengths_with_members_sag_and_spacings(
    place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["info", "limpet.xyz", "--unit", "m"]) == 0
    lines = capsys.readouterr().out.splitlines()
    head = next(number for number, line in enumerate(lines) if line.startswith("length [m]"))
    radius = float(next(line for line in lines if line.startswith("R = ")).split()[2])
    for line in lines[head + 1 : head + 4]:
        length, members, sag = line.split()[:3]
        assert float(sag) == pytest.approx(float(length) ** 2 / (8 * radius), rel=0.1)
        assert int(members.replace(",", "")) > 10


def test_a_refused_length_comes_with_one_that_passes(
    place: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where the grid of one length fails, another is named that was tried."""
    from scantruss.check.certify import Judged, judge
    from scantruss.scan.member_length import suggest_length

    failing = suggest_length(st.read_points("limpet.xyz"))

    def fails_there(grid: st.Grid, samples: SurfaceSamples, boundary: st.Boundary, settings: st.Settings) -> Judged:
        if abs(settings.length - failing) < 0.01 * failing:
            raise st.FrontError("the front cannot close")
        return judge(grid, samples, boundary, settings)

    monkeypatch.setattr("scantruss.improve.candidate.judge", fails_there)
    monkeypatch.setattr("scantruss.attempts.limit.MOST_RUNS", 3)  # there is no use in more where all fail
    words = ["grid", "limpet.xyz", "a.json", "--effort", "quick", "--length"]
    assert main([*words, str(failing)]) == 2
    said = capsys.readouterr().err
    named = said.split("a grid passes with --length ")[1].split()[0]
    assert float(named) != failing
    assert main([*words, named]) == 0


def test_in_place_of_a_length_that_holes_in_the_sampling_spoil_one_is_tried_that_they_do_not(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    cloud = cloud_of("limpet")
    advice = Advice(cloud, st.Settings(length=1.0))
    tried: list[float] = []
    monkeypatch.setattr(Advice, "try_length", lambda _, length, **__: tried.append(length))
    sure = round_length(SURE_PER_SPACING * cloud.spacing, "up")
    assert advice.nearby(4.35 * cloud.spacing) is None
    assert sure in tried
    tried.clear()
    assert advice.nearby(20.0 * cloud.spacing) is None
    assert sure not in tried and min(tried) > sure


def counted_runs(monkeypatch: pytest.MonkeyPatch, passes: Callable[[float], bool]) -> list[float]:
    """Let grids come out only of lengths that pass; returns the lengths of all attempts."""
    made: list[float] = []
    make_grid = pipeline.make_grid

    def tried(cloud: st.PointCloud, attempt: Attempt, **others: Any) -> st.Grid:
        made.append(attempt.settings.length)
        if not passes(attempt.settings.length):
            raise st.FrontError("the front cannot close")
        return make_grid(cloud, attempt, **others)

    monkeypatch.setattr(pipeline, "make_grid", tried)
    return made


def test_the_length_nearby_is_the_nearest_that_passes_and_costs_no_more_than_twenty_quick_runs(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    cloud = cloud_of("limpet")
    failing = suggested()
    made = counted_runs(monkeypatch, lambda length: length > 1.15 * failing)
    assert Advice(cloud, st.Settings(length=1.0)).nearby(failing) == pytest.approx(1.25 * failing, rel=0.03)
    costs = [points_of_run(cloud, length) for length in (failing, *made)]
    assert sum(max(1.0, cost / costs[0]) for cost in costs[1:]) <= MOST_TRIED == 20.0
    made = counted_runs(monkeypatch, lambda length: False)
    assert Advice(cloud, st.Settings(length=1.0)).nearby(failing) is None
    costs = [points_of_run(cloud, length) for length in (failing, *made)]
    assert sum(max(1.0, cost / costs[0]) for cost in costs[1:]) <= 20.0 and len(set(made)) >= 4


def test_from_the_usual_length_steps_lead_towards_one_that_is_far_away(monkeypatch: pytest.MonkeyPatch) -> None:
    cloud = cloud_of("limpet", 6000)
    usual, (_, high) = suggest_length(cloud), length_range(cloud)
    asked = min(6.0 * usual, high)
    assert asked > 4.2 * usual
    counted_runs(monkeypatch, lambda length: length < 2.1 * usual)
    assert Advice(cloud, st.Settings(length=1.0)).nearby(asked) == pytest.approx(1.96 * usual, rel=0.05)


def points_of_run(cloud: st.PointCloud, length: float) -> float:
    """Return the time that a quick grid takes, as points of the scan: a member takes that of nine."""
    return len(cloud.points) + 9 * Advice(cloud, st.Settings(length=1.0)).members(length)


def test_no_sag_is_given_of_a_member_longer_than_the_bend_is_wide(monkeypatch: pytest.MonkeyPatch) -> None:
    cloud = cloud_of("limpet")
    monkeypatch.setattr(Advice, "try_length", lambda *_, **__: None)
    monkeypatch.setattr(Advice, "radius", property(lambda _: 0.5 * suggest_length(cloud)))
    head, rows = advice_rows(Advice(cloud, st.Settings(length=1.0)), suggest_length(cloud), cloud)
    sags = {float(row[0]): row[head.index("sag L^2/8R [mm]" if cloud.unit else "sag L^2/8R")] for row in rows}
    assert len(sags) > 2 and all((sag == "-") == (length > suggest_length(cloud)) for length, sag in sags.items())


def test_a_length_far_too_short_costs_one_look_at_the_usual_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """It was meant in another unit; grids near the shortest possible length have many members and take long."""
    cloud = cloud_of("limpet")
    made = counted_runs(monkeypatch, lambda length: True)
    assert Advice(cloud, st.Settings(length=1.0)).nearby(0.01 * length_range(cloud)[0]) == suggest_length(cloud)
    assert made == [suggest_length(cloud)]


@pytest.mark.parametrize(
    ("suffix", "words"), [(".obj", "divide its triangles first"), (".xyz", "scan it more densely")]
)
def test_a_mesh_of_few_vertices_is_refused_with_a_way_on(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], suffix: str, words: str
) -> None:
    corners = np.array([[x, y, z] for x in (0.0, 9.0) for y in (0.0, 8.0) for z in (0.0, 7.0)])
    path, sign = tmp_path / f"box{suffix}", "v " if suffix == ".obj" else ""
    path.write_text("\n".join(sign + " ".join(map(str, corner)) for corner in corners))
    assert main(["info", str(path)]) == 0
    assert words in capsys.readouterr().out
    assert main(["grid", str(path), str(tmp_path / "grid.json"), "--length", "2"]) == 2
    assert words in capsys.readouterr().err


def below_usual(advice: Advice, steps: int) -> float:
    """Return the length so many steps of a suggestion below the usual one."""
    length = advice._usual
    for _ in range(steps):
        length = advice.next_below(length)
    return length


def test_where_no_length_passes_the_most_frequent_cause_is_said_with_its_place() -> None:
    """Only that no length passes was said, and to clean or crop the scan, not what is wrong with it or where."""

    def failed(length: float, *kinds: str, words: str = "") -> LengthTrial:
        faults = tuple(Fault(kind, f"is {kind}{words}", (length, 0.0, 1.5)) for kind in kinds)
        grid = cast(Any, SimpleNamespace(certificate=SimpleNamespace(faults=faults)))
        return LengthTrial(length, None, FrontError("no grid", grid))

    trials = [failed(1.0, "manifold", "torn"), failed(2.0, "torn"), failed(3.0, "cover"), failed(4.0, "torn")]
    assert usual_cause(trials) == ", 3 of 4 as the grid is torn (near 2, 0, 1.5); clean or crop the scan there first"
    unlike = [failed(2.0 * k, "loops", words=f" {k}") for k in (1, 2, 3)]  # what it says of one holds of that alone
    assert usual_cause(unlike).startswith(
        ", 3 of 3 for faults of one kind, as at 4: the grid is loops 2 (near 4, 0, 1.5);"
    )
    unnamed = [failed(2.0 * k, "angle", "short", "torn") for k in (1, 2)]  # the table names two faults a length
    assert usual_cause([*unnamed, *trials]).startswith(", 3 of 6 as the grid is torn")
    stopped = [LengthTrial(1.0, None, FrontError("the front stopped; try another", None, (0.0, 1.0, 2.0)))]
    assert usual_cause(stopped) == ", 1 of 1 as the front stopped (near 0, 1, 2); clean or crop the scan there first"
    assert usual_cause([]) == "; clean or crop the scan first"


def test_where_no_length_passes_as_walls_are_thinner_than_members_that_is_said() -> None:
    """A clean scan of a bridge with a thin deck was to be cleaned or cropped."""
    trials = [LengthTrial(length, None, FrontError("the front cannot close")) for length in (0.5, 1.0, 2.0)]
    said = usual_cause(trials, (0.8, 0.12))
    assert (
        "; 12% of the scan is walls about 0.8 thick, thinner than most of these members: scan them more densely" in said
    )
    assert "clean" not in said
    for wall in ((0.8, 0.05), (2.5, 0.5), (0.0, 0.0)):  # too little of it, or members are shorter
        assert usual_cause(trials, wall).endswith("; clean or crop the scan there first")


def test_the_wall_of_a_scan_is_measured_where_it_is_a_small_part() -> None:
    """A block with a fin."""
    rng = np.random.default_rng(5)
    block = rng.uniform(-10.0, 10.0, (15_000, 3))
    side = rng.integers(0, 3, len(block))
    block[np.arange(len(block)), side] = rng.choice([-10.0, 10.0], len(block))
    fin = np.column_stack(
        [rng.uniform(10.0, 20.0, 4_000), rng.choice([-0.3, 0.3], 4_000), rng.uniform(-10.0, 10.0, 4_000)]
    )
    thickness, share = Advice(st.PointCloud.from_array(np.vstack([block, fin])), st.Settings(length=1.0)).wall
    assert thickness == pytest.approx(0.6, abs=0.1) and 0.1 < share < 0.3
    assert Advice(st.PointCloud.from_array(block), st.Settings(length=1.0)).wall[1] < 0.05


def test_info_ends_with_why_no_length_passes_and_not_with_another_reason(
    place: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """After a line on triangles that cut each other came one that a scan is one-sided."""

    def one_sided(*_: Any, **__: Any) -> None:
        raise OneSidedError("the scanned surface is one-sided")

    counted_runs(monkeypatch, lambda length: False)
    monkeypatch.setattr(find, "find_boundary", one_sided)
    assert main(["info", "limpet.xyz"]) == 0
    said = capsys.readouterr()
    assert "one-sided" not in said.out + said.err
    assert said.out.splitlines()[-1].startswith("no length passes of those tried")


def test_a_suggestion_and_its_table_cost_no_more_than_so_many_grids_and_points(
    place: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    usual = suggested()
    made = counted_runs(monkeypatch, lambda length: False)
    assert main(["info", "limpet.xyz"]) == 0
    assert "no length passes of those tried" in capsys.readouterr().out
    assert sum(max(1.0, (usual / length) ** 2) for length in made) <= MOST_TRIED + TRIED_AROUND
    made = counted_runs(monkeypatch, lambda length: False)
    monkeypatch.setattr("scantruss.report.ladder.POINTS_LOOKED_AT", 1)
    Advice(cloud_of("limpet"), st.Settings(length=1.0)).suggest()
    assert 1 <= len(made) <= LEAST_TRIED


def test_of_lengths_that_pass_one_is_suggested_that_is_followed_by_another(monkeypatch: pytest.MonkeyPatch) -> None:
    advice = Advice(cloud_of("limpet"), st.Settings(length=1.0))
    monkeypatch.setattr(Advice, "_count_at", lambda *_: None)
    usual, passed = advice._usual, cast(Any, SimpleNamespace(certificate=None))
    shorter = round_length(usual / 1.3, "nearest")
    advice._left = 0.0  # nothing else is tried
    advice._found = {usual: LengthTrial(usual, passed)}
    assert advice.suggest() == usual
    advice._found[shorter] = LengthTrial(shorter, passed)
    assert advice.suggest() == shorter


def test_of_lengths_that_pass_with_the_next_above_one_is_suggested_that_loses_little(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """As of ground with trees: the one nearer to the usual length lost 2 % of it, with twice the warnings."""
    advice = Advice(cloud_of("limpet"), st.Settings(length=1.0))
    monkeypatch.setattr(Advice, "_count_at", lambda *_: None)
    monkeypatch.setattr(Advice, "_ladder", lambda _: iter(()))
    advice._left = 0.0  # nothing else is tried
    lengths = [round_length(share * advice._usual, "nearest") for share in (1.4, 2.0, 2.8)]
    advice._found = {each: trial_of(each) for each in lengths}
    assert advice.suggest() == lengths[0]
    advice._found[lengths[0]] = trial_of(lengths[0], left_out=(LeftOut("far", 9, 0.02),))
    assert advice.suggest() == lengths[1]


def test_a_length_that_only_the_table_tried_and_that_passes_is_suggested_in_place_of_one_that_does_not() -> None:
    cloud = cloud_of("limpet")
    advice = Advice(cloud, st.Settings(length=1.0))
    advice.is_spent = True
    length = advice._usual
    grid = cast(Any, SimpleNamespace(certificate=None))
    advice._found = {
        length: LengthTrial(length, None, st.FrontError("it fails")),
        2.0 * length: LengthTrial(2.0 * length, grid),
    }
    assert advice_lines(advice, length, cloud)[-1] == f"try --length {2.0 * length:g}"


def test_a_length_that_is_tried_again_goes_on_where_it_paused(monkeypatch: pytest.MonkeyPatch) -> None:
    cloud = cloud_of("limpet")
    made: list[Attempt] = []

    def fails(cloud: st.PointCloud, attempt: Attempt, **others: Any) -> st.Grid:
        made.append(attempt)
        raise st.FrontError(f"fault {len(made)}")

    monkeypatch.setattr(pipeline, "make_grid", fails)
    advice, length = Advice(cloud, st.Settings(length=1.0)), length_range(cloud)[1] / 2
    first = known(advice.try_length(length, 2))
    assert first.paused and not first.passed and first.grids == len(made) == 2
    again = known(advice.try_length(length, 5))
    assert again.grids == len(made) == 5 and len(set(map(id, made))) == 5 and str(again.fault) == "fault 1"
    assert known(advice.try_length(length, 5)).grids == 5


def test_the_suggested_length_passes_also_where_the_usual_one_and_its_neighbours_do_not(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    cloud = cloud_of("limpet")
    usual = suggested()
    counted_runs(monkeypatch, lambda length: length > 1.5 * usual)
    advice = Advice(cloud, st.Settings(length=1.0))
    length = advice.suggest()
    assert (
        length > 1.5 * usual
        and known(advice.try_length(length)).passed
        and known(advice.try_length(advice.next_above(length))).passed
    )


def test_a_length_beside_the_usual_one_is_suggested_where_steps_of_the_table_miss_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    cloud = cloud_of("limpet")
    usual = suggested()
    made = counted_runs(monkeypatch, lambda length: 1.05 * usual < length < 1.2 * usual)
    advice = Advice(cloud, st.Settings(length=1.0))
    assert 1.05 * usual < advice.suggest() < 1.2 * usual and advice.passes
    assert len(made) <= MOST_TRIED + TRIED_AROUND


def test_the_length_that_came_nearest_gets_two_more_grids_before_those_beside_the_usual_one(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    cloud = cloud_of("limpet")
    usual = suggested()
    made: list[float] = []
    make_grid = pipeline.make_grid

    def tried(cloud: st.PointCloud, attempt: Attempt, **others: Any) -> st.Grid:
        length = attempt.settings.length
        made.append(length)
        is_near = 1.3 * usual < length < 1.5 * usual
        if is_near and made.count(length) > 4:  # as many as it gets in its turn
            return make_grid(cloud, attempt, **others)
        raise refused_with(3, Fault("long", "has a long member")) if not is_near else refused_with(3)

    monkeypatch.setattr(pipeline, "make_grid", tried)
    advice = Advice(cloud, st.Settings(length=1.0))
    length = advice.suggest()
    assert advice.passes and 1.3 * usual < length < 1.5 * usual
    assert len(made) <= MOST_TRIED + TRIED_AROUND and not any(0.85 * usual < each < 0.95 * usual for each in made)


def test_of_lengths_that_lose_about_as_much_the_usual_one_is_suggested(monkeypatch: pytest.MonkeyPatch) -> None:
    """As of a canopy whose mast is left out at each of them: a few points more or less decide nothing, nor does the unit with them."""

    def tried(advice: Advice, length: float, most: int = 0) -> LengthTrial:
        lost = 0.033 if length >= advice._usual else least
        certificate = SimpleNamespace(judged_out=lost, left_out=(), warnings=())
        trial = advice._found[length] = LengthTrial(length, cast(Any, SimpleNamespace(certificate=certificate)))
        return trial

    monkeypatch.setattr(Advice, "try_length", tried)
    advice = Advice(cloud_of("limpet"), st.Settings(length=1.0))
    monkeypatch.setattr(advice, "next_above", lambda length: 1.3 * length)
    least = 0.0325
    assert advice.suggest() == advice._usual
    least = 0.029  # nearly all of which is lost at any of them
    assert advice.suggest() == advice._usual
    least = 0.02
    assert advice.suggest() < advice._usual


@pytest.mark.parametrize("at_last", [True, False])
def test_a_length_that_loses_little_is_suggested_where_the_next_above_passes_at_last(
    at_last: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As of a range scan in pieces: longer members leave some of them out."""

    def tried(advice: Advice, length: float, most: int = 0) -> LengthTrial:
        lost = 0.002 if length < 1.7 * advice._usual else 0.03
        certificate = SimpleNamespace(judged_out=lost, left_out=(), warnings=())
        share = length / advice._usual
        passes = 0.95 < share < 1.1 or share > 1.7 or (at_last and share > 1.1 and most == MOST_RUNS)
        grid = cast(Any, SimpleNamespace(certificate=certificate)) if passes else None
        trial = advice._found[length] = LengthTrial(length, grid, None if passes else st.FrontError("it fails"))
        return trial

    monkeypatch.setattr(Advice, "try_length", tried)
    advice = Advice(cloud_of("limpet"), st.Settings(length=1.0))
    assert (advice.suggest() == advice._usual) == at_last


@pytest.mark.parametrize("passes_above", [True, False])
def test_a_length_between_is_suggested_where_the_next_above_it_passes_and_that_above_the_usual_one_fails(
    passes_above: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    def tried(advice: Advice, length: float, most: int = 0) -> LengthTrial:
        share = length / advice._usual
        passes = 0.82 < share < 1.05 or (passes_above and 1.1 < share < 1.3)
        certificate = SimpleNamespace(judged_out=0.0, left_out=(), warnings=())
        grid = cast(Any, SimpleNamespace(certificate=certificate)) if passes else None
        trial = advice._found[length] = LengthTrial(length, grid, None if passes else st.FrontError("it fails"))
        return trial

    monkeypatch.setattr(Advice, "try_length", tried)
    advice = Advice(cloud_of("limpet"), st.Settings(length=1.0))
    length = advice.suggest()
    if not passes_above:
        assert length == advice._usual
        return
    assert length < advice._usual
    assert known(advice.try_length(length)).passed
    assert known(advice.try_length(advice.next_above(length))).passed


@pytest.mark.parametrize(
    ("lost", "said"),
    [
        ((0.12, 0.099, 0.095), ["2 --allow-missing 0.1"]),
        ((0.04, 0.09, 0.12), ["1 --allow-missing 0.04"]),
        ((0.4, 0.5), []),
    ],
)
@pytest.mark.parametrize(("kind", "without"), [("limbs", "its thin limbs"), ("sparse", "{:.0%} of the scan")])
def test_where_grids_only_leave_out_too_much_the_option_that_accepts_that_is_named(
    kind: str, without: str, lost: tuple[float, ...], said: list[str]
) -> None:
    """Of lengths that lose about as much the shortest, as it follows more of the rest."""

    def missing(length: float, share: float, *more: Fault) -> LengthTrial:
        found = Certificate(
            "", 0.5, True, True, 1, 1, 1, 1, 1, 0, missing=share, faults=(Fault("cover", "leaves out"), *more)
        )
        found = replace(found, left_out=(LeftOut(kind, 9, share),))
        return LengthTrial(length, None, st.CertificateError("it fails", cast(Any, SimpleNamespace(certificate=found))))

    trials = [missing(0.5, 0.01, Fault(wrong, "is wrong")) for wrong in ("torn", "sheets")]
    trials = [*trials, *(missing(k, share) for k, share in enumerate(lost, 1))]
    parts = [without.format(lost[int(each[0]) - 1]) for each in said]
    assert accepted_line(trials) == [
        f"with --length {each} a grid without {part} passes" for each, part in zip(said, parts, strict=True)
    ]


def refused_with(crossings: int, *others: Fault) -> st.CertificateError:
    """Return the refusal of a grid with so many triangles that cut each other, and two boundaries of three."""
    faults = (Fault("crossing", "cuts itself"), *others)
    found = Certificate("", 0.5, True, True, 1, 1, 2, 3, 1, 0, crossings=crossings, faults=faults)
    return st.CertificateError("it fails", cast(Any, SimpleNamespace(certificate=found, cells="triangle")))


def failing_with(monkeypatch: pytest.MonkeyPatch, crossings: int) -> tuple[float, list[float]]:
    """Return the usual length of a cloud and the lengths of all grids that are made for a suggestion, none of which passes."""
    made: list[float] = []

    def fails(cloud: st.PointCloud, attempt: Attempt, **others: Any) -> st.Grid:
        made.append(attempt.settings.length)
        raise refused_with(crossings)

    monkeypatch.setattr(pipeline, "make_grid", fails)
    advice = Advice(cloud_of("limpet"), st.Settings(length=1.0))
    assert advice.suggest() == advice._usual and not advice.passes
    return advice._usual, made


def test_where_grids_cut_themselves_everywhere_few_lengths_get_a_single_grid_each(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    usual, made = failing_with(monkeypatch, MOST_CROSSINGS)
    grids = [made.count(length) for length in dict.fromkeys(made)]
    assert len(made) <= 10 and grids[0] <= 4 and set(grids[1:]) == {1}
    assert max(made) > 2.0 * usual  # at which sheets may be one


def test_where_grids_are_far_from_passing_other_lengths_get_two_grids(monkeypatch: pytest.MonkeyPatch) -> None:
    usual, made = failing_with(monkeypatch, FAR_FROM_PASSING)
    assert all(made.count(length) <= 2 for length in set(made) - {usual}) and len(made) <= 14


def test_where_grids_nearly_pass_all_lengths_are_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    usual, made = failing_with(monkeypatch, 1)
    assert len(made) > 14 and min(made) < usual and any(made.count(length) > 2 for length in set(made) - {usual})


@pytest.mark.parametrize("kind", ["hole", "gap"])
def test_a_length_that_closes_openings_gives_way_to_the_next_below_that_leaves_them_open(
    kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def tried(advice: Advice, length: float, most: int = 0) -> LengthTrial:
        size = (1.2 if length > closes_from * advice._usual else 0.9) * length
        part = SimpleNamespace(kind=kind, asked=False, size=size)
        found = SimpleNamespace(judged_out=lost if length < advice._usual else 0.0, left_out=(part,), warnings=())
        return LengthTrial(length, cast(Any, SimpleNamespace(certificate=found)))

    monkeypatch.setattr(Advice, "try_length", tried)
    advice = Advice(cloud_of("limpet"), st.Settings(length=1.0))
    closes_from, lost = 0.9, 0.0
    assert advice.suggest() == advice.next_below(advice._usual)
    lost = 0.005  # of the scan, which the usual one does not
    assert advice.suggest() == advice._usual
    closes_from, lost = 0.1, 0.0  # then so does the shorter one
    assert advice.suggest() == advice._usual


@pytest.mark.parametrize("kind", ["lost", "crushed"])
def test_a_length_that_loses_ridges_gives_way_to_the_next_below_that_follows_them(
    kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def tried(advice: Advice, length: float, most: int = 0) -> LengthTrial:
        warnings = (SimpleNamespace(kind=kind if length > loses_from * advice._usual else "peak"),)
        hole = SimpleNamespace(kind="hole", asked=False, size=2.0 * length)
        left_out = (hole,) * (closes and length < advice._usual)
        found = SimpleNamespace(judged_out=0.0, left_out=left_out, warnings=warnings)
        return LengthTrial(length, cast(Any, SimpleNamespace(certificate=found)))

    monkeypatch.setattr(Advice, "try_length", tried)
    advice = Advice(cloud_of("limpet"), st.Settings(length=1.0))
    loses_from, closes = 0.9, False
    assert advice.suggest() == advice.next_below(advice._usual)
    closes = True  # then the shorter one closes an opening
    assert advice.suggest() == advice._usual
    loses_from, closes = 0.1, False  # then it loses ridges too
    assert advice.suggest() == advice._usual
    loses_from = 1.1  # then none of both does
    assert advice.suggest() == advice._usual


@pytest.mark.parametrize(("gap", "steps"), [(0, 1), (1, 3), (2, 4), (3, 0)])
def test_a_length_that_loses_ridges_gives_way_to_one_that_follows_them_below_lengths_that_fail(
    gap: int, steps: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The steps of an amphitheatre are followed by short members, their slope by long ones, nothing by those between.

    The one that is taken passes with the next above it.
    """

    def tried(advice: Advice, length: float, most: int = 0) -> LengthTrial:
        down = round(math.log(advice._usual / length) / math.log(1.4))
        warnings = (SimpleNamespace(kind="lost" if down < 1 else "peak"),)
        found = SimpleNamespace(judged_out=0.0, left_out=(), warnings=warnings)
        passes = not 1 <= down <= gap
        return LengthTrial(length, cast(Any, SimpleNamespace(certificate=found)) if passes else None)

    monkeypatch.setattr(Advice, "try_length", tried)
    advice = Advice(st.PointCloud.from_array(sheet(16, 16, 0.06)), st.Settings(length=1.0))
    assert advice.suggest() == below_usual(advice, steps)


@pytest.mark.parametrize(("idle", "steps"), [(0, 1), (1, 2), (2, 0)])
def test_a_length_that_loses_ridges_gives_way_beyond_one_that_follows_no_more_at_most(
    idle: int, steps: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A fluted valve was suggested members a third as long, seven times as many."""

    def tried(advice: Advice, length: float, most: int = 0) -> LengthTrial:
        down = round(math.log(advice._usual / length) / math.log(1.4))
        warnings = (SimpleNamespace(kind="lost" if down <= idle else "peak"),)
        found = SimpleNamespace(judged_out=0.0, left_out=(), warnings=warnings)
        return LengthTrial(length, cast(Any, SimpleNamespace(certificate=found)))

    monkeypatch.setattr(Advice, "try_length", tried)
    advice = Advice(st.PointCloud.from_array(sheet(16, 16, 0.06)), st.Settings(length=1.0))
    assert advice.suggest() == below_usual(advice, steps)


@pytest.mark.parametrize("columns", [0.0, 0.12])
def test_a_length_that_closes_openings_gives_way_beyond_one_that_follows_no_more(
    columns: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """So it does where columns are left out, which are lost at every length."""

    def tried(advice: Advice, length: float, most: int = 0) -> LengthTrial:
        hole = SimpleNamespace(kind="hole", asked=False, size=2.0 * length)
        found = SimpleNamespace(judged_out=columns, left_out=(hole,) * (length > 0.6 * advice._usual), warnings=())
        trial = advice._found[length] = LengthTrial(length, cast(Any, SimpleNamespace(certificate=found)))
        return trial

    monkeypatch.setattr(Advice, "try_length", tried)
    advice = Advice(st.PointCloud.from_array(sheet(16, 16, 0.06)), st.Settings(length=1.0))
    lowest = 0.6 * advice._usual
    assert advice.suggest() == max(length for length in advice._found if length <= lowest)


def test_info_says_which_lengths_pass_and_why_others_do_not(
    place: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    usual = suggested()
    counted_runs(monkeypatch, lambda length: length < 1.2 * usual)
    assert main(["info", "limpet.xyz"]) == 0
    said = capsys.readouterr().out
    span = next(line for line in said.splitlines() if line.startswith("passes, of the"))
    low, high = (float(word) for word in span.split(": ")[1].split(" to "))
    assert low < usual <= high < 1.2 * usual
    longer = [
        line
        for line in said.splitlines()
        if line.endswith((" passes: the front cannot close", " pass: the front cannot close"))
    ]
    assert longer and all(float(line.split()[0]) > high for line in longer)


def test_a_length_out_of_range_is_refused_with_the_nearest_that_passes(
    place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    low, high = length_range(st.read_points("limpet.xyz"))
    for asked, side in ((0.3 * low, low), (2.0 * high, high)):
        assert main(["grid", "limpet.xyz", "a.json", "--effort", "quick", "--length", f"{asked:.3g}"]) == 2
        said = capsys.readouterr().err
        named = float(said.split("a grid passes with --length ")[1].split()[0])
        assert low <= named <= high and abs(np.log(named / side)) < np.log(1.5)
        assert main(["grid", "limpet.xyz", "a.json", "--effort", "quick", "--length", str(named)]) == 0


def test_why_a_length_is_out_of_range_is_said_before_others_are_tried(
    place: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    before: list[str] = []
    monkeypatch.setattr(Advice, "nearby", lambda *_: before.append(capsys.readouterr().err))
    assert main(["grid", "limpet.xyz", "a.json", "--length", "0.01"]) == 2
    assert "length 0.01 is too small for points that are" in before[0] and "use at least" in before[0]


def test_where_no_length_passes_those_tried_are_named_and_not_tried_again(
    place: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    made = counted_runs(monkeypatch, lambda length: False)
    Advice(cloud_of("limpet"), st.Settings(length=1.0)).suggest()
    for_advice = list(made)
    made.clear()
    assert main(["grid", "limpet.xyz", "a.json", "--effort", "quick"]) == 2
    said = capsys.readouterr().err
    assert "at which no quick run passes" in said
    assert f"no grid passes with the lengths tried, {min(for_advice):g} to {max(for_advice):g}, either" in said
    later = made[len(for_advice) :]
    assert made[: len(for_advice)] == for_advice and len(set(later)) == 1  # the grid itself, at the usual length


def test_a_length_is_found_that_passes_only_far_above_one_that_loses_limbs(monkeypatch: pytest.MonkeyPatch) -> None:
    """As of a hall: its columns are limbs to short members, and known for columns by long ones."""
    cloud = cloud_of("limpet")
    usual = suggested()
    monkeypatch.setattr(LengthTrial, "loses_limbs", property(lambda trial: not trial.passed))
    counted_runs(monkeypatch, lambda length: length > 1.8 * usual)
    advice = Advice(cloud, st.Settings(length=1.0))
    assert advice.suggest() > 1.8 * usual and advice.passes


def test_where_limbs_are_too_thin_a_length_is_found_between_the_usual_one_and_the_next_below(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    cloud = cloud_of("limpet")
    usual = suggested()
    monkeypatch.setattr(LengthTrial, "loses_limbs", property(lambda trial: not trial.passed))
    made: list[float] = counted_runs(
        monkeypatch, lambda length: 0.8 * usual < length < 0.9 * usual and made.count(length) >= 3
    )
    advice = Advice(cloud, st.Settings(length=1.0))
    assert 0.8 * usual < advice.suggest() < 0.9 * usual and advice.passes
    assert len(made) <= MOST_TRIED + TRIED_AROUND


@pytest.mark.parametrize("kind", ["cover", "torn"])
def test_shorter_lengths_come_first_where_members_are_too_long_for_thin_parts(
    kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An atlas vertebra got no length: longer ones, torn at its openings as well, took all grids."""
    cloud = cloud_of("limpet")
    usual = suggested()
    made = counted_runs(monkeypatch, lambda length: length < 0.8 * usual)
    failed = SimpleNamespace(faults=(Fault(kind, "it fails"),), left_out=())
    monkeypatch.setattr(LengthTrial, "_failed", property(lambda trial: None if trial.passed else failed))
    advice = Advice(cloud, st.Settings(length=1.0))
    assert advice.suggest() < 0.8 * usual and advice.passes
    assert max(made) <= 1.45 * usual


def thin_bowl(count: int = 40_000, radius: float = 60.0, wall: float = 6.0) -> np.ndarray:
    """A half sphere that is a thin solid, with a flat lip."""
    rng = np.random.default_rng(3)
    inner = radius - wall
    shares = np.array([2 * radius**2, 2 * inner**2, radius**2 - inner**2])
    part = rng.choice(3, count, p=shares / shares.sum())
    turn, down = rng.uniform(0, 2 * np.pi, count), rng.uniform(0, 1, count)
    size = np.where(part == 0, radius, np.where(part == 1, inner, np.sqrt(rng.uniform(inner**2, radius**2, count))))
    down = np.where(part == 2, 0.0, down)
    flat = size * np.sqrt(1 - down**2)
    return np.column_stack([flat * np.cos(turn), flat * np.sin(turn), -size * down]) + rng.normal(0, 0.05, (count, 3))


@compiled_only
def test_a_thin_solid_gets_a_length_that_keeps_both_of_its_sides() -> None:
    advice = Advice(st.PointCloud.from_array(thin_bowl()), st.Settings(length=1.0))
    length = advice.suggest()
    trial = advice.try_length(length)
    assert trial is not None and trial.grid is not None and length < 6.0
    assert trial.grid.topology.euler == 2 and trial.lost < 0.01


def test_a_length_nearby_that_a_fixed_position_does_not_suit_is_passed_over() -> None:
    """Of shorter lengths the position was farther off than half a member, and that was said in place of why the first failed."""
    points = np.random.default_rng(4).uniform([-5.0, -4.0, 0.0], [5.0, 4.0, 0.01], (8_000, 3))
    settings = st.Settings(length=1.0, fixed=((0.0, 0.0, 0.49),))
    advice = Advice(st.PointCloud.from_array(points), settings)
    advice.nearby(1.0)
    shorter = [trial for trial in advice.tried if trial.length < 0.97]
    assert shorter and not any(trial.passed for trial in shorter)
    with pytest.raises(st.InputError, match="away from the scan"):
        Advice(st.PointCloud.from_array(points), settings).try_length(0.9)


def test_the_next_longer_length_is_tried_before_that_of_a_thin_wall_takes_all_grids(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """As of a vase whose sharp rim has no grid at the length of its wall: none was left for the one that passes."""
    cloud = cloud_of("limpet")
    usual = Advice(cloud, st.Settings(length=1.0))._usual
    wall = 0.5 * usual
    monkeypatch.setattr(ladder, "length_of_wall", lambda *_: wall)
    monkeypatch.setattr(Advice, "_cost", lambda _, length: 1e5 if length < 0.6 * usual else 5e4)
    counted_runs(monkeypatch, lambda length: 1.3 * wall < length < 1.5 * wall)
    advice = Advice(cloud, st.Settings(length=1.0))
    assert 1.3 * wall < advice.suggest() < 1.5 * wall and advice.passes


def test_no_length_nearby_is_longer_than_one_whose_limbs_are_too_thin(monkeypatch: pytest.MonkeyPatch) -> None:
    part: Any = SimpleNamespace(kind="limbs", share=0.3)
    found = SimpleNamespace(
        faults=[SimpleNamespace(kind="cover")],
        missing=0.3,
        left_out=(part,),
        crossings=0,
        boundary_loops=0,
        scan_loops=0,
    )
    fault = st.CertificateError("leaves out 30 %", cast(Any, SimpleNamespace(certificate=found, cells="triangle")))
    tried: list[float] = []

    def refuse(cloud: st.PointCloud, settings: st.Settings, *_: Any, limit: AttemptLimit, **__: Any) -> st.Grid:
        tried.append(settings.length)
        limit.begin()
        raise FrontError("no")

    monkeypatch.setattr("scantruss.report.advice.first_that_passes", refuse)
    advice = Advice(st.PointCloud.from_array(sheet(12, 12, 0.1)), st.Settings(length=1.0))
    assert advice.nearby(1.0, fault) is None
    assert tried and max(tried) < 1.0


def test_beyond_two_lengths_nearby_without_hope_on_each_side_the_usual_one_alone_is_tried(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    found = SimpleNamespace(
        faults=[SimpleNamespace(kind="manifold")],
        missing=0.0,
        left_out=(),
        crossings=50,
        boundary_loops=0,
        scan_loops=0,
    )
    fault = st.CertificateError("is not manifold", cast(Any, SimpleNamespace(certificate=found, cells="triangle")))
    tried: list[float] = []

    def refuse(cloud: st.PointCloud, attempt: Attempt, **_: Any) -> st.Grid:
        tried.append(attempt.settings.length)
        raise fault

    monkeypatch.setattr("scantruss.pipeline.make_grid", refuse)
    monkeypatch.setattr("scantruss.pipeline.make_grid_with_wide_ridges", refuse)
    cloud = st.PointCloud.from_array(sheet(12, 12, 0.15))
    assert Advice(cloud, st.Settings(length=1.0)).nearby(0.5) is None
    shorter = [length for length in set(tried) if length < 0.5]
    longer = [length for length in set(tried) if length > 0.5]
    assert sorted((len(shorter), len(longer))) == [HOPELESS_NEARBY, HOPELESS_NEARBY + 1]


def test_a_length_at_which_no_quick_run_passes_is_begun_as_grid_begins() -> None:
    cloud = st.PointCloud.from_array(ball(5.0, 4000))
    settings = st.Settings(length=2.0, effort="quick")
    failed = LengthTrial(2.0, None, FrontError("no"), 3)
    assert settled(failed, cloud, settings, lambda *_: None).passed
    assert settled(replace(failed, paused=True), cloud, settings, lambda *_: None).fault is failed.fault


def test_info_gives_the_boundaries_of_the_grid_that_passes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As it is the scan may look one-sided: a body was refused after its length had been suggested."""
    np.save(tmp_path / "plate.npy", sheet(12.0, 8.0, 0.25))
    seen, look, tried = list[bool](), find.find_boundary, cast(property, vars(Advice)["tried"]).fget

    def finds(samples: Any, settings: st.Settings, **more: Any) -> Any:
        seen.append(settings.plain_body)
        return look(samples, settings, **more)

    def by_plain_body(advice: Advice) -> list[LengthTrial]:
        grids = [(trial, trial.grid) for trial in known(tried)(advice)]
        return [
            trial if grid is None else replace(trial, grid=grid.replace(settings=known(grid.settings).replace(plain_body=True)))
            for trial, grid in grids
        ]  # fmt: skip

    monkeypatch.setattr(find, "find_boundary", finds)
    monkeypatch.setattr(Advice, "tried", property(by_plain_body))
    assert main(["info", str(tmp_path / "plate.npy")]) == 0
    assert seen[-1]


def trial_of(length: float, *kinds: str, ridge: float = 0.0, left_out: tuple[LeftOut, ...] = ()) -> LengthTrial:
    """Return a trial that passes with warnings of some kinds and so much ridge."""
    warnings = tuple(Fault(kind, f"is {kind}") for kind in kinds)
    found = Certificate("", 0.5, True, True, 1, 1, 1, 1, 1, 0, warnings=warnings, left_out=left_out)
    line = SimpleNamespace(name="", kind=RIDGE, nodes=np.zeros(0, np.int64), length=lambda _: ridge)
    return LengthTrial(length, cast(Any, SimpleNamespace(certificate=found, line_sets=(line,))))


@pytest.mark.parametrize(("ridge", "taken"), [(8.0, True), (0.0, False)])
def test_a_length_that_loses_ridges_gives_way_to_the_next_above_that_follows_them(
    ridge: float, taken: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The round lip of a bowl is a ridge to long members, and none to members so short that the bowl takes 12,000 of them."""

    def tried(advice: Advice, length: float, most: int = 0) -> LengthTrial:
        share = length / advice._usual
        lost = ("lost",) if 0.9 < share < 1.1 else ()
        return trial_of(length, *lost, ridge=ridge * length if share > 1.1 else 0.0)

    monkeypatch.setattr(Advice, "try_length", tried)
    advice = Advice(cloud_of("limpet"), st.Settings(length=1.0))
    usual = advice._usual
    assert advice.suggest() == (advice.next_above(usual) if taken else advice.next_below(usual))


def test_no_ridge_is_worth_many_thousand_members_where_longer_ones_pass(monkeypatch: pytest.MonkeyPatch) -> None:
    """A vase was suggested 13,000 members for the sharp edge of its foot."""
    tried_at: list[float] = []

    def tried(advice: Advice, length: float, most: int = 0) -> LengthTrial:
        tried_at.append(length)
        return trial_of(length, *(("lost",) if length > 0.9 * advice._usual else ()))

    monkeypatch.setattr(Advice, "try_length", tried)
    advice = Advice(cloud_of("limpet"), st.Settings(length=1.0))
    below = advice.next_below(advice._usual)
    assert advice.suggest() == below
    monkeypatch.setattr(Advice, "members", lambda *_: 12_000)
    tried_at.clear()
    advice = Advice(cloud_of("limpet"), st.Settings(length=1.0))
    assert advice.suggest() == advice._usual and min(tried_at) == advice._usual


def test_a_length_whose_grid_climbs_into_trees_gives_way_to_the_next_above_that_stays_on_the_ground(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It closed openings that were none, between ground and crowns; fewer warnings show the right surface."""
    cut = (LeftOut("limbs", 9, 0.001),)

    def tried(advice: Advice, length: float, most: int = 0) -> LengthTrial:
        hole = LeftOut("hole", 0, 0.0, size=1.5 * length)
        if length < 1.1 * advice._usual:
            return trial_of(length, "closed", "gap", "peak", "lost", left_out=(hole, *cut))
        return trial_of(length, "peak", "offset", left_out=left_out)

    monkeypatch.setattr(Advice, "try_length", tried)
    advice = Advice(cloud_of("limpet"), st.Settings(length=1.0))
    left_out: tuple[LeftOut, ...] = ()
    assert advice.suggest() == advice.next_above(advice._usual)
    left_out = cut  # then it is on limbs too
    assert advice.suggest() == advice._usual


def beside_few_points() -> st.PointCloud:
    """A plate with some outliers beside it, where nothing else is."""
    few = np.random.default_rng(1).uniform([9.0, -6.0, -2.0], [21.0, 6.0, 2.0], (60, 3))
    return st.PointCloud.from_array(np.vstack([sheet(16.0, 12.0, 0.25), few]))


def test_points_that_look_like_sparse_surface_are_judged_once_a_grid_fails_for_them(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Every other front was tried before, which leaves them out all the same."""
    made = counted_runs(monkeypatch, lambda length: True)
    grid = st.grid_from_points(beside_few_points(), st.Settings(length=1.0, effort="quick"))
    assert known(grid.settings).judge_outliers == "always" and len(made) == 2
    assert any(warning.kind == "left out" for warning in known(grid.certificate).warnings)


def test_the_usual_length_is_tried_again_once_a_longer_one_passes_with_the_outliers_judged(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of a face no length passed but one with members of which its nose has two."""
    make_grid, made = pipeline.make_grid, list[tuple[float, str]]()

    def tried(cloud: st.PointCloud, attempt: Attempt, **others: Any) -> st.Grid:
        made.append((attempt.settings.length, attempt.settings.judge_outliers))
        if attempt.settings.length <= advice._usual and attempt.settings.judge_outliers == "auto":
            raise st.FrontError("a member is too short")
        return make_grid(cloud, attempt, **others)

    advice = Advice(beside_few_points(), st.Settings(length=1.0))
    monkeypatch.setattr(pipeline, "make_grid", tried)
    assert advice.suggest() == advice._usual
    assert made.index((advice._usual, "always")) == 6
