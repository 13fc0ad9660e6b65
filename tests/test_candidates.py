"""Multi-start: the flat list of attempts, which of them is kept, and what more effort leaves."""

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise, product
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Never, cast

import naive_grid as naive
import numpy as np
import pytest
from marks import compiled_only
from shapes import Shape, make
from small_clouds import cap, sheet
from steps import lines_of_readme, steps_of
from typed import known

import scantruss as st
from scantruss import candidates, pipeline
from scantruss.attempts.limit import MOST_RUNS, AttemptLimit
from scantruss.attempts.table import FRONT_LENGTHS, SMOOTHING_SCALES, Attempt, attempts
from scantruss.check.certify import Judged, judge
from scantruss.errors import CertificateError, FrontError
from scantruss.improve.optimize import improve_last
from scantruss.runtime import parallel
from scantruss.scan.formats.writing import write_points


@pytest.fixture(scope="module")
def shape() -> Shape:
    return make("scallop", 8_000)


def grid_of(shape: Shape, effort: str, **others: Any) -> st.Grid:
    return st.grid_from_points(shape.points, st.Settings(length=2.0 * shape.length, effort=effort), **others)


Best = tuple[st.Grid, list[tuple[str, float]]]


@pytest.fixture(scope="module")
def best(shape: Shape) -> Best:
    """The grid of effort `best`, made with as many processors as there are, and the progress of its making."""
    seen: list[tuple[str, float]] = []
    return grid_of(shape, "best", progress=lambda stage, share: seen.append((stage, share))), seen


def settings_with_node(shape: Shape, effort: str) -> st.Settings:
    return st.Settings(length=2.0 * shape.length, effort=effort, fixed=(tuple(shape.points[7]),), unit="mm")


@pytest.fixture(scope="module")
def best_with_node(shape: Shape) -> st.Grid:
    """The grid of effort `best` with a fixed node."""
    return st.grid_from_points(shape.points, settings_with_node(shape, "best"))


# ---- attempts


def size_of(settings: st.Settings) -> float | None:
    return settings.box_size and round(settings.box_size, 3)


def listed(points: np.ndarray, **settings: Any) -> list[tuple[float, float | None, str]]:
    """What the attempts at a scan differ in: ridges, samples, method; each kind once."""
    cloud, asked = st.PointCloud.from_array(points), st.Settings(length=1.0, **settings)
    kinds = [(a.settings.ridge_angle, size_of(a.settings), a.settings.method) for a in attempts(cloud, asked)]
    return list(dict.fromkeys(kinds))


def test_what_is_tried_in_which_order() -> None:
    ridge, coarser = st.Settings(length=1.0).ridge_angle, [0.22, 0.24, 0.26]
    rough, smooth = cap(4.0, 1.0, 0.25), sheet(8, 8, 0.04)
    folded = make("gable", 20_000).points / 5.0
    usual = [(ridge, None, "default")]
    assert listed(rough) == usual + [(ridge, size, "default") for size in coarser] + [(ridge, None, "paper")]
    without = [(0.0, size, "default") for size in (None, *coarser)]
    assert listed(folded) == usual + without + [(0.0, None, "paper")]
    others = [(ridge, size, "default") for size in (0.2, *coarser)]
    assert listed(smooth) == usual + others + [(ridge, None, "paper")]
    assert listed(rough, box_size=0.5) == [(ridge, 0.5, "default"), (ridge, 0.5, "paper")]
    assert listed(rough, method="paper") == [(ridge, None, "paper")]


@pytest.mark.parametrize(("noise", "first"), [(0.0, None), (0.07, "rough"), (0.2, "very rough")])
def test_the_mean_surface_is_tried_on_rough_scans_alone_and_on_very_rough_ones_at_once(
    noise: float, first: str | None
) -> None:
    points = sheet(8, 8, 0.1)
    points[:, 2] += np.random.default_rng(0).normal(0.0, noise, len(points))
    cloud = st.PointCloud.from_array(points)
    listed_rows = list(attempts(cloud, st.Settings(length=1.0)))
    smoothed = [k for k, attempt in enumerate(listed_rows) if attempt.settings.smooth_scale == SMOOTHING_SCALES[0]]
    assert [listed_rows[k].row for k in smoothed[:1]] == ([f"mean surface of a {first} scan over 0.5"] if first else [])
    # after the four fronts of the usual look, which has no outliers to leave out
    assert smoothed[:1] == ([4] if first else [])
    scales = [attempt.settings.smooth_scale for attempt in listed_rows]
    assert [scale for scale in scales if scale] == [scale for scale in SMOOTHING_SCALES for _ in range(2) if first]
    for asked in (0.0, 0.7):
        made = attempts(cloud, st.Settings(length=1.0, smooth_scale=asked))
        assert {attempt.settings.smooth_scale for attempt in made} == {asked}


def test_each_kind_begins_with_the_fields_of_the_effort_and_then_does_without() -> None:
    cloud = st.PointCloud.from_array(cap(4.0, 1.0, 0.25))
    by_kind: dict[tuple[object, ...], list[Any]] = {}
    for attempt in attempts(cloud, st.Settings(length=1.0)):
        by_kind.setdefault((attempt.settings.box_size, attempt.settings.method), []).append(attempt.starts)
    for (_, method), starts in by_kind.items():
        lone = starts[1:] if method == "default" else starts
        assert method == "paper" or starts[0] is None
        assert [(way.scale, way.laid) for (way,) in lone] == [(share, False) for share in FRONT_LENGTHS]


def refusing(monkeypatch: pytest.MonkeyPatch, passes: Callable[[Any], bool]) -> list[Any]:
    """Let only some attempts be made; returns those that were begun."""
    begun, make_grid = [], pipeline.make_grid

    def chosen(cloud: st.PointCloud, attempt: Any, **others: Any) -> st.Grid:
        begun.append(attempt)
        if not passes(attempt):
            raise FrontError(f"fault {len(begun)}")
        return make_grid(cloud, attempt, **others)

    monkeypatch.setattr(pipeline, "make_grid", chosen)
    return begun


@pytest.mark.parametrize(("size", "method"), [(0.22, "default"), (0.26, "default"), (None, "paper")])
def test_the_first_that_passes_is_the_grid_and_its_settings_say_so(
    monkeypatch: pytest.MonkeyPatch, size: float | None, method: str
) -> None:
    refusing(monkeypatch, lambda a: (size_of(a.settings), a.settings.method) == (size, method))
    grid = st.grid_from_points(cap(4.0, 1.0, 0.25), st.Settings(length=1.0))
    assert (size_of(known(grid.settings)), known(grid.settings).method) == (size, method)
    assert known(grid.certificate).passed


def test_where_none_passes_the_first_fault_is_the_one_that_is_raised(monkeypatch: pytest.MonkeyPatch) -> None:
    begun = refusing(monkeypatch, lambda _: False)
    with pytest.raises(FrontError, match="fault 1"):
        st.grid_from_points(cap(4.0, 1.0, 0.25), st.Settings(length=1.0))
    assert len(begun) == 2 * (4 * 4 + 3)  # with the effort asked for, then with the least
    assert [attempt.settings.effort for attempt in begun] == ["normal"] * (4 * 4 + 3) + ["quick"] * (4 * 4 + 3)


def test_more_effort_never_gives_less(monkeypatch: pytest.MonkeyPatch) -> None:
    refusing(monkeypatch, lambda attempt: attempt.settings.effort == "quick")
    for effort in ("normal", "best", "quick"):
        grid = st.grid_from_points(cap(4.0, 1.0, 0.25), st.Settings(length=1.0, effort=effort))
        assert known(grid.settings).effort == "quick" and known(grid.certificate).passed


def test_no_more_grids_are_made_than_the_law_says(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        "scantruss.attempts.course.attempts", lambda cloud, settings: (Attempt(settings) for _ in range(1000))
    )
    begun = refusing(monkeypatch, lambda _: False)
    with pytest.raises(FrontError, match="fault 1"):
        st.grid_from_points(cap(4.0, 1.0, 0.25), st.Settings(length=1.0))
    assert len(begun) == 2 * MOST_RUNS  # for each of two efforts


@pytest.mark.parametrize("method", ["default", "paper"])
def test_a_front_of_another_length_is_taken_where_the_first_fails(monkeypatch: pytest.MonkeyPatch, method: str) -> None:
    refusing(monkeypatch, lambda a: a.starts is not None and a.starts[0].scale == FRONT_LENGTHS[2])
    grid = st.grid_from_points(cap(4.0, 1.0, 0.25), st.Settings(length=1.0, method=method))
    assert known(grid.certificate).passed and grid.settings == st.Settings(length=1.0, method=method)


def test_a_grid_that_fails_its_check_comes_with_the_error_or_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    """All grids lose a half: what is raised is the failed certificate of the first."""

    def half(*arguments: Any) -> st.Grid:
        grid = improve_last(*arguments)
        left = grid.nodes[grid.triangles].mean(axis=1)[:, 0] < np.median(grid.nodes[:, 0])
        return grid.replace(triangles=grid.triangles[left])

    monkeypatch.setattr(candidates, "improve_last", half)
    points, asked = cap(4.0, 1.0, 0.25), st.Settings(length=1.0)
    with pytest.raises(CertificateError, match=r"the grid leaves out .* of the scan") as refused:
        st.grid_from_points(points, asked)
    assert refused.value.where == refused.value.grid.certificate.faults[0].where
    assert not refused.value.grid.certificate.passed
    kept = st.grid_from_points(points, asked, keep_failed=True)
    assert not known(kept.certificate).passed and kept.settings == asked


# ---- several fronts


def test_more_effort_leaves_less_energy() -> None:
    """On the mean of some scans of some shapes, for a node, by more than twice what chance makes of such a mean."""
    energies = []
    for effort in ("quick", "normal", "best"):
        shares = []
        for name, seed in product(("l_plate", "scallop"), range(3)):
            shape = make(name, 8_000, seed=seed)
            grid = grid_of(shape, effort)
            shares.append(naive.grid_energy(grid, 2.0 * shape.length) / len(grid.nodes))
        energies.append(np.array(shares))
    for less, more in pairwise(energies):
        gained = less - more
        assert gained.mean() > 2.0 * gained.std(ddof=1) / np.sqrt(len(gained))


def test_lengths_or_shapes_can_be_preferred(shape: Shape) -> None:
    quality = {
        prefer: st.grid_from_points(shape.points, st.Settings(length=2.0 * shape.length, prefer=prefer)).quality
        for prefer in ("lengths", "balance", "shapes")
    }
    assert quality["lengths"].length_cv < quality["balance"].length_cv < quality["shapes"].length_cv
    assert quality["lengths"].shape_mean < quality["balance"].shape_mean < quality["shapes"].shape_mean


def test_the_number_of_processors_makes_no_difference(
    shape: Shape, best: Best, monkeypatch: pytest.MonkeyPatch
) -> None:
    for count in (1, 5):
        monkeypatch.setattr(parallel, "processors", lambda count=count: count)
        grid = grid_of(shape, "best")
        assert grid.nodes.tobytes() == best[0].nodes.tobytes()
        assert grid.triangles.tobytes() == best[0].triangles.tobytes()


def test_the_quality_before_is_that_of_the_front_and_fixed_nodes_stay(shape: Shape, best_with_node: st.Grid) -> None:
    grid, place = best_with_node, shape.points[7]
    assert known(grid.before).length_cv > 1.3 * grid.quality.length_cv
    assert np.linalg.norm(grid.nodes[grid.fixed] + grid.origin - place, axis=1).min() < 1e-9 * shape.length
    assert grid.settings == settings_with_node(shape, "best")


def test_progress_grows_to_the_end(best: Best) -> None:
    shares = [share for stage, share in best[1] if stage == "optimize"]
    assert shares == sorted(shares) and shares[-1] == 1.0


@pytest.mark.parametrize("effort", ["quick", "normal", "best"])
def test_the_steps_that_the_readme_shows_give_the_grid_of_the_one_call(
    shape: Shape, effort: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest
) -> None:
    """The same bytes, the certificate included."""
    monkeypatch.chdir(tmp_path)
    write_points("shell.ply", shape.points, unit="mm")
    asked = settings_with_node(shape, effort)
    own = {"length": asked.length, "effort": effort, "fixed": list(asked.fixed), "unit": "mm"}
    names: dict[str, Any] = {"own": own}
    exec(lines_of_readme().replace("length=1.0, fixed=[(-14.40, -10.36, 0.01)]", "**own"), names)
    is_best = effort == "best"
    whole = request.getfixturevalue("best_with_node") if is_best else st.grid_from_points(shape.points, asked)
    grid = names["grid"]
    assert names["settings"] == asked
    assert len(names["constraints"].positions) == 1 and len(Path("grid.obj").read_bytes()) > 10_000
    assert grid.nodes.tobytes() == whole.nodes.tobytes() and grid.triangles.tobytes() == whole.triangles.tobytes()
    assert grid.certificate == whole.certificate and known(grid.certificate).passed


def test_fronts_that_fail_their_check_are_left_out_and_the_fault_of_the_best_is_raised(
    shape: Shape, monkeypatch: pytest.MonkeyPatch
) -> None:
    cloud, settings = st.PointCloud.from_array(shape.points), st.Settings(length=2.0 * shape.length, effort="best")
    steps = steps_of(cloud, settings)
    fronts = st.advance_fronts(*steps, st.orientation_fields(steps.samples, steps.boundary, settings), settings)
    refused: list[st.Grid] = []

    def check(grid: st.Grid, *others: Any) -> Judged:
        if others[-1].effort == "best" and len(refused) < 3:
            refused.append(grid)
            raise FrontError(f"fault {len(refused)}")
        return judge(grid, *others)

    monkeypatch.setattr(parallel, "processors", lambda: 1)
    monkeypatch.setattr("scantruss.improve.candidate.judge", check)
    grid = st.optimize_fronts(fronts, *steps, settings)
    assert len(refused) == 3 and grid.topology.manifold

    def never(grid: st.Grid, *_: Any) -> Never:
        refused.append(grid)
        raise FrontError(f"fault {len(refused)}")

    refused.clear()
    monkeypatch.setattr("scantruss.improve.candidate.judge", never)
    with pytest.raises(FrontError, match="fault 1"):
        st.optimize_fronts(fronts, *steps, settings)


@pytest.mark.parametrize("fails", ["best", "normal"])
def test_best_is_no_worse_than_normal_and_takes_part_only_where_that_passes(
    shape: Shape, monkeypatch: pytest.MonkeyPatch, fails: str
) -> None:
    cloud, settings = st.PointCloud.from_array(shape.points), st.Settings(length=2.0 * shape.length, effort="best")
    steps = steps_of(cloud, settings)
    usual = st.grid_from_points(shape.points, settings.replace(effort="normal"))
    fronts = st.advance_fronts(*steps, st.orientation_fields(steps.samples, steps.boundary, settings), settings)

    def check(grid: st.Grid, *others: Any) -> Judged:
        if others[-1].effort == fails:
            raise FrontError(f"fault of {fails}")
        return judge(grid, *others)

    monkeypatch.setattr("scantruss.improve.candidate.judge", check)
    if fails == "normal":
        with pytest.raises(FrontError, match="fault of normal"):
            st.optimize_fronts(fronts, *steps, settings)
        return
    grid = st.optimize_fronts(fronts, *steps, settings)
    found, theirs = known(known(grid.certificate).scan_distance), known(known(usual.certificate).scan_distance)
    assert grid.settings == settings and known(grid.certificate).passed
    assert grid.quality.length_cv <= usual.quality.length_cv and grid.quality.shape_mean >= usual.quality.shape_mean
    assert found.p95 <= theirs.p95 and found.p99 <= theirs.p99


def test_fronts_that_would_all_miss_the_same_limbs_are_not_tried() -> None:
    attempt = next(attempts(st.PointCloud.from_array(sheet(8.0, 8.0, 0.25)), st.Settings(length=1.0)))

    def fault(kind: str) -> st.CertificateError:
        part: Any = SimpleNamespace(kind=kind, share=0.06)
        wrong: Any = SimpleNamespace(kind="cover")
        found = SimpleNamespace(
            missing=0.06, faults=(wrong,), left_out=(part,), crossings=0, boundary_loops=1, scan_loops=1
        )
        return st.CertificateError("the grid leaves out 6 %", cast(Any, SimpleNamespace(certificate=found)))

    for kind, tried in (("limbs", False), ("far", True)):
        limit = AttemptLimit()
        for _ in range(2):
            limit.note(attempt, fault(kind))
        assert limit.allows(attempt) == tried
        limit = AttemptLimit()
        limit.note(attempt, fault(kind))
        for change, alike in (
            ({"sharp_edges": True}, False),
            ({"box_size": 0.25}, True),
            ({"method": "paper"}, True),
            ({"limb_girth": 2.4}, False),
        ):
            other = replace(attempt, settings=attempt.settings.replace(**cast(Any, change)))
            assert limit.allows(other) == (tried or not alike)


def test_looks_at_thin_walls_by_two_distances_of_the_samples_are_given_up_as_one() -> None:
    attempt = next(attempts(st.PointCloud.from_array(sheet(8.0, 8.0, 0.25)), st.Settings(length=1.0)))
    found = SimpleNamespace(
        missing=0.5, faults=(), left_out=(), crossings=0, boundary_loops=1, scan_loops=1, pieces=1, scan_pieces=1
    )
    far = st.CertificateError("the grid leaves out 50 %", cast(Any, SimpleNamespace(certificate=found)))
    for changes, hopeful in (
        ([{}, {"thin_walls": True}, {"thin_walls": True, "box_size": 0.35}], True),
        ([{}, {"thin_walls": True}, {"sharp_edges": True}], False),
        ([{}, {"box_size": 0.35}, {"box_size": 0.4}], False),
    ):
        limit = AttemptLimit()
        for change in changes:
            other = replace(attempt, settings=attempt.settings.replace(**cast(Any, change)))
            for _ in range(2):
                limit.note(other, far)
        assert limit.any_left() == hopeful


@compiled_only
@pytest.mark.parametrize("apart", [0.36, 0.4])
def test_two_layers_too_near_for_the_members_are_refused_after_two_grids(
    apart: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The grid joins them and cuts itself everywhere: no other look at the scan, and no less effort, would part them."""
    rng = np.random.default_rng(0)
    x, y = rng.uniform(-9.0, 9.0, 40_000), rng.uniform(-6.0, 6.0, 40_000)
    z = apart * 1.6 * (np.arange(len(x)) % 2) + rng.normal(0.0, 0.004, len(x))
    made: list[Attempt] = []

    def counted(cloud: st.PointCloud, attempt: Attempt, **others: Any) -> st.Grid:
        made.append(attempt)
        return make_grid(cloud, attempt, **others)

    make_grid = pipeline.make_grid
    monkeypatch.setattr(pipeline, "make_grid", counted)
    with pytest.raises(CertificateError, match="is in 1 piece where the scan has 2"):
        st.grid_from_points(np.column_stack([x, y, z]), st.Settings(length=1.6))
    assert len(made) == 2
