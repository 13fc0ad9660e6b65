"""The law of the table of attempts, and of what follows from what came of them."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from marks import compiled_only
from shapes import make
from small_clouds import ball, cap, sheet
from typed import known

import scantruss as st
from scantruss.attempts.better import doubts_ridges, is_better_without_ridges
from scantruss.attempts.course import (
    IS_BETTER,
    RIDGES_GIVEN_UP,
    WITH_LEAST_EFFORT,
    WITHOUT_DOUBTFUL_RIDGES,
    WITHOUT_RODS,
    AttemptCourse,
)
from scantruss.attempts.limit import MOST_RUNS
from scantruss.attempts.table import (
    AS_ASKED,
    PLAIN_BODY,
    PLAIN_NEAR_FAULTS,
    ROWS_OF_TRIALS,
    ROWS_TRIED,
    TIMES_OF_PLAINER,
    TURNED_ROWS,
    Attempt,
    AttemptRow,
    attempts,
)
from scantruss.errors import FrontError
from scantruss.grid.certificate import Certificate, Fault, LeftOut
from scantruss.grid.line_sets import RIDGE
from scantruss.surface import samples

NAMES = [row.name for row in ROWS_TRIED]


def rough_sheet() -> np.ndarray:
    points = sheet(8, 8, 0.1)
    points[:, 2] += np.random.default_rng(0).normal(0.0, 0.07, len(points))
    return points


CLOUDS = {
    "cap": (cap(4.0, 1.0, 0.25), {}),
    "smooth": (sheet(8, 8, 0.04), {}),
    "rough": (rough_sheet(), {}),
    "folded": (make("gable", 20_000).points / 5.0, {}),
    "samples set": (cap(4.0, 1.0, 0.25), {"box_size": 0.2}),
    "paper": (cap(4.0, 1.0, 0.25), {"method": "paper"}),
}


def listed(name: str) -> tuple[st.Settings, list[Attempt]]:
    points, own = CLOUDS[name]
    asked = st.Settings(length=1.0, **cast(Any, own))
    return asked, list(attempts(st.PointCloud.from_array(points), asked))


def changed_between(one: st.Settings, other: st.Settings) -> set[str]:
    """Names of the settings that two differ in."""
    before, after = one.to_dict(), other.to_dict()
    return {name for name in before if before[name] != after[name]}


def test_each_row_has_a_name_of_its_own_and_the_first_changes_nothing() -> None:
    assert len(set(NAMES)) == len(NAMES)
    first = ROWS_TRIED[0]
    assert first.name == AS_ASKED and not first.changes and not first.shares


def test_a_trial_of_a_body_comes_to_the_plain_one_before_other_fronts_and_with_the_usual_effort() -> None:
    """Two grids are made of some lengths: of a figure with limbs a second front of all of it would be the other one."""
    names = [row.name for row in ROWS_OF_TRIALS]
    assert sorted(names) == sorted(row.name for row in ROWS_TRIED)
    ahead = [row for row in ROWS_OF_TRIALS[: names.index(PLAIN_BODY)] if row.fronts != slice(0, 1)]
    assert all(row.name.startswith(("hall", "thin walls")) for row in ahead)
    efforts = {row.name: row.changed(st.Settings(length=1.0, effort="quick")).effort for row in ROWS_OF_TRIALS}
    assert efforts.pop(PLAIN_BODY) == "normal" and set(efforts.values()) == {"quick"}


@pytest.mark.parametrize("name", CLOUDS)
def test_attempts_come_in_the_order_of_the_table_each_once(name: str) -> None:
    asked, tried = listed(name)
    places = [NAMES.index(attempt.row) for attempt in tried]
    assert places == sorted(places) and tried[0].settings == asked
    kinds = [(attempt.settings, attempt.starts) for attempt in tried]
    assert all(kinds.index(kind) == number for number, kind in enumerate(kinds))


@pytest.mark.parametrize("name", CLOUDS)
def test_an_attempt_differs_from_what_was_asked_in_what_its_row_says_and_rows_before_it_keep(name: str) -> None:
    asked, tried = listed(name)
    base = asked
    for row in ROWS_TRIED:
        own = [attempt for attempt in tried if attempt.row == row.name]
        for attempt in own:
            assert changed_between(base, attempt.settings) <= row.changes.keys() | row.shares.keys()
            assert all(getattr(attempt.settings, key) == value for key, value in row.changes.items())
            assert attempt.starts in row.layouts(attempt.settings)
            assert attempt.faults == () and not attempt.is_trial
        if own and row.stays:
            base = own[0].settings


def test_a_look_that_fails_ends_no_list() -> None:
    """Where the boundary of a scan cannot be followed, looks at it fail too: samples a little farther apart are tried all the same."""

    def fails(scan: Any, now: Any) -> bool:
        raise FrontError("the boundary cannot be followed")

    rows = [
        AttemptRow("first", slice(1)),
        AttemptRow("looked at", slice(1), fails),
        AttemptRow("last", slice(1), shares={"length": 2.0}),
    ]
    tried = attempts(st.PointCloud.from_array(cap(4.0, 1.0, 0.25)), st.Settings(length=1.0), rows)
    assert [each.row for each in tried] == ["first", "last"]


def test_a_lattice_turned_is_tried_where_all_grids_begin_from_one() -> None:
    points = ball(5.0, 20_000)  # of more than 600 members squared, where effort `normal` lays one lattice
    large, small = (st.Settings(length=length) for length in (0.6, 1.2))
    cloud = st.PointCloud.from_array(points)
    for asked, expected in (
        (large, [*TURNED_ROWS]),
        (large.replace(effort="best"), [*TURNED_ROWS]),
        (small, []),
        (large.replace(effort="quick"), [*TURNED_ROWS]),
    ):
        assert [a.starts[0].turn for a in attempts(cloud, asked) if a.row == "rows turned" and a.starts] == expected
    along = large.replace(rows_along=(0.0, 0.0, 5.0, 1.0, 0.0, 0.0))
    assert {a.row for a in attempts(cloud, along)}.isdisjoint({"rows turned", "the paper's method"})


def driven(course: AttemptCourse, outcomes: dict[str, Any]) -> list[Attempt]:
    """Run a course, each attempt coming to what is said of its row; returns those made."""
    made = []
    for attempt in course:
        made.append(attempt)
        outcome = outcomes.get(attempt.row, FrontError(f"fault {len(made)}"))
        if isinstance(outcome, FrontError):
            course.failed(attempt, outcome)
        else:
            course.passed(attempt, outcome)
        assert len(made) <= 2 * MOST_RUNS
    return made


def test_where_none_passes_the_list_is_made_again_with_the_least_effort_and_ends() -> None:
    points, _ = CLOUDS["cap"]
    cloud, asked = st.PointCloud.from_array(points), st.Settings(length=1.0)
    course = AttemptCourse(cloud, asked)
    made = driven(course, {})
    once = list(attempts(cloud, asked))
    assert made == once + [replace(each, settings=each.settings.replace(effort="quick")) for each in once]
    with pytest.raises(FrontError, match=r"fault 1$"):
        course.outcome()


def test_the_samples_of_all_looks_at_a_scan_of_a_hundred_thousand_points_are_made_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    cloud, asked = st.PointCloud.from_array(CLOUDS["rough"][0]), st.Settings(length=1.0)
    kept = samples.POINTS_OF_KEPT_SAMPLES * len(cloud.points) // 100_000
    made: list[Any] = []
    monkeypatch.setattr(samples, "POINTS_OF_KEPT_SAMPLES", kept)
    made_of = samples._prepare

    def prepare(*given: Any, **more: Any) -> samples.SurfaceSamples:
        made.append(given[3])
        return made_of(*given, **more)

    monkeypatch.setattr(samples, "_prepare", prepare)
    for attempt in (course := AttemptCourse(cloud, asked)):
        samples.sample_surface(cloud, attempt.settings)
        course.failed(attempt, FrontError("fault"))
    assert len(made) == len(set(made)) > 5


def test_a_grid_along_rods_is_followed_by_one_attempt_without_and_the_better_is_taken(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("scantruss.attempts.course.runs_along_rods", lambda *_: True)
    monkeypatch.setattr("scantruss.attempts.course.lost_ridges", lambda *_: [])
    monkeypatch.setattr("scantruss.attempts.course.with_moved_corners", lambda grid, *_: grid)
    cloud, asked = st.PointCloud.from_array(CLOUDS["cap"][0]), st.Settings(length=1.0)
    grids = {
        count: cast(Any, SimpleNamespace(certificate=SimpleNamespace(warnings=(0,) * count, left_out=())))
        for count in (1, 2)
    }
    for first, without in ((1, 2), (2, 1)):
        course = AttemptCourse(cloud, asked)
        made = driven(course, {AS_ASKED: grids[first], WITHOUT_RODS: grids[without]})
        assert [each.row for each in made] == [AS_ASKED, WITHOUT_RODS]
        assert changed_between(asked, made[1].settings) == {"keep_rods"}
        assert course.outcome() is grids[1]
    course = AttemptCourse(cloud, asked)
    assert len(driven(course, {AS_ASKED: grids[2]})) == 2 and course.outcome() is grids[2]
    gap = LeftOut("gap", 0, 0.0, (0.0, 0.0, 0.0), 1.0)
    webbed = cast(Any, SimpleNamespace(certificate=SimpleNamespace(warnings=(0,), left_out=(gap,))))
    course = AttemptCourse(cloud, asked)
    driven(course, {AS_ASKED: webbed, WITHOUT_RODS: grids[2]})
    assert course.outcome() is grids[2]  # more warnings, but no gap spanned


def test_a_grid_that_breaks_a_limb_is_none_that_passes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("scantruss.attempts.course.breaks_limb", lambda *_: (1.0, 2.0, 3.0))
    course = AttemptCourse(st.PointCloud.from_array(CLOUDS["cap"][0]), st.Settings(length=1.0))
    grid = cast(Any, SimpleNamespace(certificate=None, cells="triangle"))
    made = driven(course, {AS_ASKED: grid})
    assert len(made) > 2
    with pytest.raises(st.CertificateError, match="torn at a limb") as refused:
        course.outcome()
    assert refused.value.where == (1.0, 2.0, 3.0)


def refused_for(*faults: tuple[str, str]) -> st.CertificateError:
    """Return the refusal of a grid with faults of some kinds and words."""
    found = Certificate(
        "", 0.5, True, True, 1, 1, 1, 1, 1, 0, faults=tuple(Fault(kind, words, None) for kind, words in faults)
    )
    return st.CertificateError("it fails", cast(Any, SimpleNamespace(certificate=found, cells="triangle")))


def test_a_refusal_says_what_accepts_a_grid_made_otherwise_that_only_leaves_out_sparse_parts() -> None:
    cloud, asked = st.PointCloud.from_array(CLOUDS["cap"][0]), st.Settings(length=1.0, effort="quick")
    angle, sparse = ("angle", "has an angle of 9 degrees"), ("sparse", "leaves out at least 8% of the surface")
    for first, later, is_said in (
        ((angle,), (sparse,), True),
        ((angle,), (angle, sparse), False),
        ((sparse,), (sparse,), False),
    ):
        course = AttemptCourse(cloud, asked)
        for number, attempt in enumerate(course):
            course.failed(attempt, refused_for(*(later if number else first)))
        with pytest.raises(FrontError) as raised:
            course.outcome()
        said = "one made otherwise only leaves out at least 8% of the surface: --allow-missing accepts that"
        assert (said in str(raised.value)) == is_said


def test_ridges_are_given_up_right_after_the_fault_and_the_first_fault_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    def after(self: Attempt, fault: FrontError, cloud: st.PointCloud) -> Attempt | None:
        if self.row not in (AS_ASKED, RIDGES_GIVEN_UP) or len(self.faults) == 2:
            return None
        return replace(self, faults=(*self.faults, (float(len(self.faults)), 0.0, 0.0)))

    monkeypatch.setattr(Attempt, "after", after)
    cloud, asked = st.PointCloud.from_array(CLOUDS["cap"][0]), st.Settings(length=1.0, effort="quick")
    course = AttemptCourse(cloud, asked)
    made = driven(course, {})
    assert [each.row for each in made[:4]] == [AS_ASKED, RIDGES_GIVEN_UP, RIDGES_GIVEN_UP, "front without rows"]
    assert [len(each.faults) for each in made[:4]] == [0, 1, 2, 0] and all(a.settings == asked for a in made[:4])
    assert len(made) == len(list(attempts(cloud, asked))) + 2
    with pytest.raises(FrontError, match=r"fault 1$"):
        course.outcome()


def _any_grid() -> Any:
    return SimpleNamespace(certificate=None, cells="triangle")


@pytest.mark.parametrize("is_better", [False, True])
def test_a_grid_that_gives_up_ridges_is_followed_by_one_without_any_and_the_better_is_taken(
    is_better: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    course_of = "scantruss.attempts.course."
    first, without = _any_grid(), _any_grid()
    monkeypatch.setattr(course_of + "lost_ridges", lambda *_: [])
    for name in ("with_moved_corners", "with_ridges_lost", "with_ridges_given_up"):
        monkeypatch.setattr(course_of + name, lambda grid, *_: grid)
    monkeypatch.setattr(course_of + "doubts_ridges", lambda grid, _: grid is first)
    monkeypatch.setitem(IS_BETTER, WITHOUT_DOUBTFUL_RIDGES, lambda *_: is_better)
    cloud, asked = st.PointCloud.from_array(CLOUDS["cap"][0]), st.Settings(length=1.0)
    course = AttemptCourse(cloud, asked)
    made = driven(course, {AS_ASKED: first, WITHOUT_DOUBTFUL_RIDGES: without})
    assert [each.row for each in made] == [AS_ASKED, WITHOUT_DOUBTFUL_RIDGES]
    assert changed_between(asked, made[1].settings) == {"ridge_angle"}
    assert course.outcome() is (without if is_better else first)
    course = AttemptCourse(cloud, asked)
    driven(course, {AS_ASKED: first})  # without ridges none passes
    assert course.outcome() is first


@pytest.mark.parametrize("is_better", [False, True])
@pytest.mark.parametrize("missing", [0.001, 0.03])
def test_a_plain_body_that_drops_parts_is_followed_by_the_least_effort_and_the_better_is_taken(
    missing: float, is_better: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A token with raised letters: 4.4 % were missing, with the least effort 0.8 %."""

    def after(self: Attempt, fault: FrontError, cloud: st.PointCloud) -> Attempt | None:
        follows = self.row == WITH_LEAST_EFFORT and not self.faults
        return replace(self, faults=((1.0, 0.0, 0.0),)) if follows else None

    course_of, drops = "scantruss.attempts.course.", missing > 0.005
    for name in ("doubts_ridges", "runs_along_rods", "stands_on_columns", "jumps_between_walls"):
        monkeypatch.setattr(course_of + name, lambda *_: False)
    monkeypatch.setattr(course_of + "breaks_limb", lambda *_: None)
    monkeypatch.setattr(course_of + "lost_ridges", lambda *_: [])
    for name in ("with_moved_corners", "with_ridges_lost", "with_ridges_given_up"):
        monkeypatch.setattr(course_of + name, lambda grid, *_: grid)
    monkeypatch.setattr(Attempt, "after", after)
    monkeypatch.setattr(Attempt, "ridges_given_up", lambda *_: [])
    monkeypatch.setitem(IS_BETTER, WITH_LEAST_EFFORT, lambda *_: is_better)
    body, asked = (
        cast(Any, SimpleNamespace(certificate=SimpleNamespace(missing=missing, warnings=(), left_out=())))
        for _ in range(2)
    )
    cloud, settings = st.PointCloud.from_array(CLOUDS["cap"][0]), st.Settings(length=1.0)
    tried = [Attempt(settings), Attempt(settings.replace(plain_body=True), row=PLAIN_BODY)]
    course, made = AttemptCourse(cloud, settings, tried), []
    for attempt in course:
        made.append(attempt)
        if attempt.row == PLAIN_BODY or (attempt.row == WITH_LEAST_EFFORT and attempt.faults):
            course.passed(attempt, body if attempt.row == PLAIN_BODY else asked)
        else:
            course.failed(attempt, FrontError("a fault"))
    assert [each.row for each in made] == [AS_ASKED, PLAIN_BODY, *[WITH_LEAST_EFFORT] * 2 * drops]
    assert all(changed_between(settings, each.settings) == {"effort"} for each in made[2:])
    assert course.outcome() is (asked if is_better and drops else body)


@pytest.mark.parametrize("turns", [1, 3, TIMES_OF_PLAINER + 2])
def test_before_the_plain_body_limbs_and_slits_near_faults_are_left_aside(
    turns: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[str] = []

    def plainer(self: Attempt, fault: FrontError, cloud: st.PointCloud) -> Attempt | None:
        seen.append(str(fault))
        places = (*self.settings.plain_at, (float(len(seen)), 0.0, 0.0))
        if len(places) > turns:
            return None
        return replace(self, settings=self.settings.replace(plain_at=places), row=PLAIN_NEAR_FAULTS)

    monkeypatch.setattr(Attempt, "plainer", plainer)
    monkeypatch.setattr(Attempt, "after", lambda *_: None)
    cloud, asked = st.PointCloud.from_array(CLOUDS["cap"][0]), st.Settings(length=1.0, effort="quick")
    rows: list[tuple[str, dict[str, Any]]] = [
        (AS_ASKED, {}),
        ("sharp edges", {"sharp_edges": True}),
        (PLAIN_BODY, {"plain_body": True, "effort": "normal"}),
    ]
    tried = [Attempt(asked.replace(**changes), is_trial=True, row=row) for row, changes in rows]
    course = AttemptCourse(cloud, asked, tried)
    made = driven(course, {})
    near = made[2:-1]
    assert [each.row for each in made] == [AS_ASKED, "sharp edges", *[PLAIN_NEAR_FAULTS] * len(near), PLAIN_BODY]
    assert len(near) == min(turns, TIMES_OF_PLAINER)
    assert all(each.is_trial and changed_between(asked, each.settings) == {"plain_at"} for each in near)
    assert [len(each.settings.plain_at) for each in near] == list(range(1, len(near) + 1))
    assert seen[0] == "fault 1" and seen[1:3] == ["fault 3", "fault 4"][: len(seen) - 1]  # of the first, then its own


def test_what_is_near_a_fault_is_left_aside_once_and_then_the_front_is_laid_out_otherwise() -> None:
    turn = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    along = np.linspace(4.0, 7.0, 40)
    tube = np.stack([np.repeat(along, 24), 0.25 * np.tile(np.cos(turn), 40), 0.25 * np.tile(np.sin(turn), 40)], axis=1)
    directions = np.random.default_rng(0).normal(size=(20_000, 3))
    body = 4.0 * directions / np.linalg.norm(directions, axis=1)[:, None]
    cloud = st.PointCloud.from_array(np.concatenate([body, tube]))
    first = Attempt(st.Settings(length=1.0, limb_girth=0.0))
    near, far = FrontError("a fault", where=(6.5, 0.0, 0.0)), FrontError("another", where=(-4.0, 0.0, 0.0))
    assert first.plainer(far, cloud) is None and first.plainer(FrontError("nowhere"), cloud) is None
    plain = first.plainer(near, cloud)
    assert plain is not None and plain.settings.plain_at == ((6.5, 0.0, 0.0),) and plain.starts is None
    other = plain.plainer(far, cloud)
    assert other is not None and other.settings == plain.settings and other.starts is not None
    assert other.plainer(near, cloud) is None


def knotted_tube(sides: int = 12, count: int = 30_000) -> np.ndarray:
    """Points (N, 3) of a tube of so many sides along a trefoil knot, 7.3 members round for members of length 1."""
    rng = np.random.default_rng(7)
    along, around = rng.uniform(0.0, 2.0 * np.pi, (2, count))

    def middle(t: np.ndarray) -> np.ndarray:
        places = np.column_stack(
            [np.sin(t) + 2.0 * np.sin(2.0 * t), np.cos(t) - 2.0 * np.cos(2.0 * t), -np.sin(3.0 * t)]
        )
        return np.asarray(2.4 * places)

    ahead = middle(along + 1e-4) - middle(along - 1e-4)
    ahead /= np.linalg.norm(ahead, axis=1)[:, None]
    side = np.cross(ahead, [0.0, 0.0, 1.0])
    side /= np.linalg.norm(side, axis=1)[:, None]
    out = np.cos(around)[:, None] * side + np.sin(around)[:, None] * np.cross(ahead, side)
    half = np.pi / sides
    radius = 7.3 / (2.0 * np.pi) * np.cos(half) / np.cos(around % (2.0 * half) - half)
    return middle(along) + radius[:, None] * out + rng.normal(0.0, 0.02, (count, 3))


@compiled_only
def test_a_round_tube_is_as_even_as_without_ridges() -> None:
    """Members ran along folds of 30 degrees that noise makes sharper here and there: their lengths varied by .12 in place of .06."""
    grid = st.grid_from_points(knotted_tube(), st.Settings(length=1.0))
    assert grid.quality.length_cv < 0.07 and not known(grid.certificate).warnings


def bone(sides: int = 8, count: int = 30_000) -> np.ndarray:
    """Points (N, 3) of a bent bar of so many sides, 4.5 to 7.5 members round for members of length 1: each side is narrower than these."""
    rng = np.random.default_rng(3)
    around, along = rng.uniform(0.0, 2.0 * np.pi, count), rng.uniform(0.0, 16.0, count)
    half = np.pi / sides
    radius = (
        3.0 / np.pi * (1.0 + 0.25 * np.cos(np.pi * along / 8.0)) * np.cos(half) / np.cos(around % (2.0 * half) - half)
    )
    places = [radius * np.cos(around) + 0.016 * (along - 8.0) ** 2, radius * np.sin(around), along]
    return np.column_stack(places) + rng.normal(0.0, 0.01, (count, 3))


@compiled_only
def test_a_bone_is_as_even_as_without_ridges_unless_a_ridge_angle_is_chosen() -> None:
    """Chains along folds that are closer than a member is long: lengths varied by .16, and the grid was farther off."""
    plain, chosen = (st.grid_from_points(bone(), st.Settings(length=1.0, ridge_angle=angle)) for angle in (40.0, 39.0))
    assert plain.quality.length_cv < 0.08 and not plain.line_sets
    assert chosen.line_sets and chosen.quality.length_cv > plain.quality.length_cv


@pytest.mark.parametrize(("angle", "cv", "doubts"), [(150.0, 0.1, True), (150.0, 0.07, False), (90.0, 0.1, False)])
def test_uneven_members_raise_doubts_along_blunt_folds_alone(
    angle: float, cv: float, doubts: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A further grid cost machine parts a third of their time for nothing. An edge of the boundary has no angle."""
    grid: Any = SimpleNamespace(
        certificate=None,
        quality=SimpleNamespace(length_cv=cv, stretch_cv=None),
        line_sets=[SimpleNamespace(kind=RIDGE, name="ridge 1", nodes=np.arange(3), length=lambda _: 2.0)],
        edge_on_line=np.array([True, True, True, False]),
        edge_uses=np.array([2, 2, 1, 2]),
    )
    monkeypatch.setattr("scantruss.attempts.better.fold_angles", lambda _: np.array([angle, angle, np.nan, 180.0]))
    assert doubts_ridges(grid, st.Settings(length=1.0)) == doubts
    assert not doubts_ridges(grid, st.Settings(length=1.0, ridge_angle=30.0))


@pytest.mark.parametrize(
    ("cv", "p99", "triangle_p99", "kinds", "is_better"),
    [
        (0.06, 0.21, 0.20, (), True),
        (0.09, 0.20, 0.20, (), False),  # hardly evener
        (0.06, 0.23, 0.20, (), False),
        (0.06, 0.20, 0.23, (), False),  # the points are of columns
        (0.06, 0.20, 0.20, ("lost",), False),
        (0.06, 0.20, 0.20, ("short",), False),
    ],
)
def test_a_grid_without_ridges_is_taken_where_it_is_far_evener_and_hardly_farther_off(
    cv: float, p99: float, triangle_p99: float, kinds: tuple[str, ...], is_better: bool
) -> None:
    def judged(cv: float, p99: float, triangle_p99: float, kinds: tuple[str, ...]) -> Any:
        certificate = SimpleNamespace(
            warnings=[SimpleNamespace(kind=kind) for kind in kinds],
            scan_distance=SimpleNamespace(p95=0.1, p99=p99),
            triangle_distance=SimpleNamespace(p95=0.1, p99=triangle_p99),
            missing=0.0,
        )
        return SimpleNamespace(
            certificate=certificate, quality=SimpleNamespace(length_cv=cv, stretch_cv=None, shape_mean=0.98)
        )

    without, other = judged(cv, p99, triangle_p99, kinds), judged(0.1, 0.2, 0.2, ("angle",))
    assert is_better_without_ridges(without, other) == is_better


def refused(kind: str) -> st.CertificateError:
    """Return why a grid is refused whose fault is of a kind."""
    found = SimpleNamespace(
        faults=[SimpleNamespace(kind=kind)], missing=0.0, left_out=(), crossings=0, boundary_loops=0, scan_loops=0
    )
    return st.CertificateError(f"fault {kind}", cast(Any, SimpleNamespace(certificate=found, cells="triangle")))


def test_what_fails_by_its_one_front_is_not_made_again_with_less_effort(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Attempt, "after", lambda *_: None)
    cloud, asked = st.PointCloud.from_array(CLOUDS["cap"][0]), st.Settings(length=1.0)
    for kind, again in (("torn", True), ("manifold", False), ("short", True)):
        course = AttemptCourse(cloud, asked)
        made = driven(course, dict.fromkeys(NAMES, refused(kind)))
        once = [each for each in made if each.settings.effort == "normal"]
        less = {(each.row, each.starts) for each in made[len(once) :]}
        assert all(((each.row, each.starts) in less) == again for each in once if each.has_one_front(cloud))
        assert all((each.row, each.starts) in less for each in once if not each.has_one_front(cloud))
        assert any(each.has_one_front(cloud) for each in once)
        with pytest.raises(st.CertificateError, match=f"fault {kind}"):
            course.outcome()


def test_the_first_attempt_is_made_with_each_effort_though_it_fails_by_its_front(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The body is made plain near the faults of the first: with those of more effort a dragon failed that passes with less."""
    monkeypatch.setattr(Attempt, "after", lambda *_: None)
    monkeypatch.setattr(Attempt, "has_one_front", lambda *_: True)
    course = AttemptCourse(st.PointCloud.from_array(CLOUDS["cap"][0]), st.Settings(length=1.0))
    made = driven(course, dict.fromkeys(NAMES, refused("manifold")))
    assert [each.row for each in made if each.settings.effort == "quick"] == [AS_ASKED]
    assert len(made) > 2


def test_a_refusal_has_the_whole_certificate_and_others_are_not_made() -> None:
    made: list[str] = []

    def whole(name: str) -> st.CertificateError:
        made.append(name)
        return st.CertificateError(f"whole {name}", light.grid)

    light = refused("short")
    faults = [st.CertificateError(name, light.grid, None, lambda name=name: whole(name)) for name in ("one", "two")]  # type: ignore[misc]
    course = AttemptCourse(st.PointCloud.from_array(sheet(8, 8, 0.25)), st.Settings(length=1.0, effort="quick"))
    for number, attempt in enumerate(course):
        course.failed(attempt, faults[min(number, 1)])
    with pytest.raises(st.CertificateError, match="whole one") as raised:
        course.outcome()
    assert made == ["one"] and raised.value.whole is raised.value
