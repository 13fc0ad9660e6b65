"""Tips: what sticks out of a grid about a member thick, as an ear does, gets a node on its end; what has no tip stays as it is."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from marks import compiled_only
from steps import steps_of
from surfaces import distance_to_triangles
from typed import known

import scantruss as st
from scantruss.errors import CertificateError
from scantruss.front.advance import advance_front
from scantruss.front.orientation_field import orientation_fields
from scantruss.improve import fit, tip_search
from scantruss.improve.candidate import Candidate, grid_of
from scantruss.improve.optimize import improve_first, improve_last
from scantruss.improve.tips import (
    FARTHEST_TIP,
    LEAST_TIP,
    SUSPECT_REACH,
    TIPS_APART,
    find_tips,
    put_on_tips,
    suspects_apart,
)
from scantruss.improve.working_mesh import WorkingMesh
from scantruss.kernels.mesh.grid import AT_REST
from scantruss.surface.samples import SurfaceSamples

BALL = 3.5  # radius [member]
EAR, EAR_AT = (
    np.array([2.2, 0.5, 1.6]),
    np.array([3.3, 0.0, 0.0]),
)  # semi-axes and middle of a flat ear on the ball [member]


def on_ball(count: int, rng: np.random.Generator) -> np.ndarray:
    away = rng.normal(size=(count, 3))
    return np.asarray(away / np.linalg.norm(away, axis=1)[:, None])


def eared_ball(seed: int = 0) -> np.ndarray:
    """Points of a ball with a flat ear, one member thick, that stands out by two."""
    rng = np.random.default_rng(seed)
    ball, ear = BALL * on_ball(9000, rng), EAR_AT + EAR * on_ball(4000, rng)
    outside = (((ball - EAR_AT) / EAR) ** 2).sum(axis=1) > 1.0
    return np.concatenate([ball[outside], ear[np.linalg.norm(ear, axis=1) > BALL]])


def improved(points: np.ndarray) -> tuple[WorkingMesh, st.Grid, SurfaceSamples]:
    """An improved grid, not yet led to its tips, what its front left, and the samples."""
    settings = st.Settings(length=1.0)
    steps = steps_of(st.PointCloud.from_array(points), settings)
    field = orientation_fields(steps.samples, steps.boundary, settings)[0]
    front = advance_front(*steps, settings, field.nodes)
    mesh = improve_first(front, *steps, settings)
    improve_last(mesh, front, steps.samples, steps.constraints, settings)
    return mesh, front, steps.samples


def naive_distances(places: np.ndarray, grid: st.Grid) -> np.ndarray:
    """Distance of each place from the nearest of all triangles."""
    a, b, c = (grid.nodes[grid.triangles[:, k]] for k in range(3))
    return np.array([distance_to_triangles(np.tile(place, (len(a), 1)), a, b, c).min() for place in places])


@compiled_only
def test_tips_are_the_farthest_places() -> None:
    mesh, front, samples = improved(eared_ball())
    tips = np.array(find_tips(mesh, front, samples))
    places = samples.surface.mean[: samples.measured]
    off = naive_distances(places, mesh.close(front)[0])
    assert len(tips) > 0
    of_tips = naive_distances(tips, mesh.close(front)[0])
    assert (np.diff(of_tips) <= 1e-12).all()
    assert of_tips[0] == pytest.approx(off[off <= FARTHEST_TIP].max())
    far = places[(off >= LEAST_TIP) & (off <= FARTHEST_TIP)]
    assert np.linalg.norm(far[:, None] - tips, axis=2).min(axis=1).max() < TIPS_APART
    apart = np.linalg.norm(tips[:, None] - tips, axis=2)[np.triu_indices(len(tips), 1)]
    assert (apart >= TIPS_APART).all()
    assert find_tips(mesh, front, samples, list(tips)) == []  # all given up


@compiled_only
def test_a_node_is_put_on_each_tip_that_is_reached() -> None:
    mesh, front, samples = improved(eared_ball())
    tips, fixed = find_tips(mesh, front, samples), mesh.fixed.copy()
    reached = put_on_tips(mesh, tips)
    nodes = mesh.net.nodes[mesh.net.degree > 0]
    on_tip = [np.linalg.norm(nodes - tip, axis=1).min() < 1e-9 for tip in tips]
    assert sum(on_tip) == reached > 0
    assert (mesh.fixed == fixed).all()  # a tip is no support


def test_tips_near_a_fault_are_told_from_those_that_did_nothing() -> None:
    rng = np.random.default_rng(5)
    for _ in range(50):
        tips = list(rng.uniform(0.0, 12.0, (rng.integers(2, 9), 3)))
        faults = list(rng.uniform(0.0, 12.0, (rng.integers(0, 3), 3)))
        harmless, suspects = suspects_apart(tips, faults, 1.5)
        near = [any(np.linalg.norm(tip - place) < SUSPECT_REACH * 1.5 for place in faults) for tip in tips]
        assert 0 < len(harmless) < len(tips)
        assert {id(tip) for tip in (*harmless, *suspects)} == {id(tip) for tip in tips}
        if 0 < sum(near) < len(tips):
            assert [id(tip) for tip in suspects] == [
                id(tip) for tip, is_near in zip(tips, near, strict=True) if is_near
            ]


@compiled_only
def test_a_tip_that_spoils_the_grid_is_given_up_and_the_others_are_reached(monkeypatch: pytest.MonkeyPatch) -> None:
    points, settings = eared_ball(), st.Settings(length=1.0)
    tips: list[np.ndarray] = []

    def first_tips(*words: Any) -> list[np.ndarray]:
        tips.extend(found := find_tips(*words))
        return found

    spoilt: list[bool] = []

    def spoil(mesh: WorkingMesh, some: list[np.ndarray]) -> int:
        """Put nodes on tips; with the first of all among them, a node lands where it tears the grid."""
        placed = put_on_tips(mesh, some)
        spoilt.append(any((tip == tips[0]).all() for tip in some))
        if spoilt[-1]:
            free = np.flatnonzero((mesh.net.degree > 0) & (mesh.net.is_open == 0))
            mesh.net.nodes[free[0]] += 4.0
            mesh.net.kind[free[0]] = AT_REST
        return placed

    monkeypatch.setattr("scantruss.improve.tip_search.find_tips", first_tips)
    monkeypatch.setattr("scantruss.improve.tip_search.put_on_tips", spoil)
    grid = st.grid_from_points(points, settings)
    assert known(grid.certificate).passed
    assert any(spoilt)
    assert not all(spoilt)
    nodes = grid.nodes
    reached = [np.linalg.norm(nodes - tip, axis=1).min() < 0.5 for tip in tips]
    assert any(reached[1:])


@pytest.mark.parametrize("count", [1, 2])
def test_a_tip_alone_whose_node_stands_off_the_scan_is_given_up_before_anything_is_measured(
    count: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    mesh = SimpleNamespace(copied=lambda: None, restore=lambda _: None, length=1.0)
    search = tip_search.TipSearch(
        cast(Any, SimpleNamespace(mesh=mesh)), *cast(Any, (SimpleNamespace(origin=np.zeros(3)), 0, 0, 0))
    )
    failed = SimpleNamespace(certificate=SimpleNamespace(faults=[]), checked_grid=None)
    asked: list[str] = []

    def noted(name: str, found: Any) -> Any:
        def note(*_: Any) -> Any:
            asked.append(name)
            return found

        return note

    monkeypatch.setattr(tip_search, "put_on_tips", lambda *_: True)
    monkeypatch.setattr(tip_search, "put_down", lambda *_: None)
    monkeypatch.setattr(tip_search, "misses_at_most", lambda *_: False)
    monkeypatch.setattr(tip_search.TipSearch, "of_scan", ())
    monkeypatch.setattr(tip_search.TipSearch, "judged", noted("all", failed))
    monkeypatch.setattr(tip_search.TipSearch, "stands_off", noted("off", True))
    tips = [np.full(3, 9.0 * number) for number in range(count)]
    assert search.reach(tips) is None and len(search.given_up) == count
    assert asked == ["all"] * (count > 1) + ["off"] * count


@compiled_only
@pytest.mark.parametrize("away", [0.5 * SUSPECT_REACH, 1.5 * SUSPECT_REACH])
def test_a_tip_alone_that_fails_far_from_it_is_tried_once_more_with_what_is_far_from_it_at_rest(
    away: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    mesh, front, samples = improved(eared_ball())
    tip = find_tips(mesh, front, samples)[0]
    search = tip_search.TipSearch(cast(Any, SimpleNamespace(mesh=mesh)), samples, *cast(Any, (0, 0, 0)))
    place = tuple(tip + samples.origin + np.array([0.0, away, 0.0]))
    failed, passed = (
        SimpleNamespace(certificate=SimpleNamespace(faults=[SimpleNamespace(where=place)]), checked_grid=None),
        SimpleNamespace(certificate=SimpleNamespace(faults=[]), checked_grid="passes"),
    )
    outcomes, resting = [failed, passed], list[np.ndarray]()
    monkeypatch.setattr(tip_search, "put_down", lambda mesh: resting.append(mesh.net.kind == AT_REST))
    monkeypatch.setattr(tip_search, "misses_at_most", lambda grid, _: grid is not None)
    monkeypatch.setattr(tip_search.TipSearch, "of_scan", ())
    monkeypatch.setattr(tip_search.TipSearch, "judged", lambda *_: outcomes.pop(0))
    monkeypatch.setattr(tip_search.TipSearch, "stands_off", lambda *_: False)
    found = search.reach([tip])
    if away < SUSPECT_REACH:
        assert found is None
        assert len(search.given_up) == len(resting) == 1
        return
    assert cast(Any, found) is passed
    assert not search.given_up
    free = (mesh.net.degree > 0) & ~resting[0]
    far = np.linalg.norm(mesh.net.nodes - tip, axis=1) > tip_search.SETTLES_AROUND_TIP
    assert 0 < (free & ~far).sum() < free.sum()
    np.testing.assert_array_equal(resting[1][free], far[free])
    np.testing.assert_array_equal(mesh.net.kind == AT_REST, resting[0])


@compiled_only
def test_a_grid_reaches_the_end_of_an_ear(monkeypatch: pytest.MonkeyPatch) -> None:
    points, settings = eared_ball(1), st.Settings(length=1.0)
    grid = st.grid_from_points(points, settings)
    monkeypatch.setattr(tip_search, "TURNS_OF_TIPS", 0)
    without = st.grid_from_points(points, settings)
    one, other = known(grid.certificate), known(without.certificate)
    ear = points[points[:, 0] > BALL + 0.5] - grid.origin
    assert naive_distances(ear, grid).max() < 0.5 < naive_distances(ear, without).max()
    assert known(one.scan_distance).p99 < known(other.scan_distance).p99
    assert one.missing <= other.missing
    assert grid.quality.shape_mean > 0.97


@compiled_only
@pytest.mark.parametrize("failing", [1, 99])
def test_of_grids_that_fail_in_the_whole_certificate_alone_that_of_the_last_turn_is_taken_that_passes(
    failing: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    points, settings = eared_ball(1), st.Settings(length=1.0, allow_missing=0.2, ridge_angle=0.0)
    monkeypatch.setattr(fit, "FITTED_FROM", np.inf)  # a fit ends another grid
    with monkeypatch.context() as patch:
        patch.setattr(tip_search, "TURNS_OF_TIPS", 0)
        without = st.grid_from_points(points, settings)
    end, ended = Candidate.end, list[np.ndarray]()

    def fail_with_tips(candidate: Candidate) -> None:
        nodes = grid_of(candidate).nodes
        ended.append(nodes)
        if len(ended) <= failing and not (nodes.shape == without.nodes.shape and (nodes == without.nodes).all()):
            raise CertificateError("the grid has a tunnel", grid_of(candidate))
        end(candidate)

    monkeypatch.setattr(Candidate, "end", fail_with_tips)
    grid = st.grid_from_points(points, settings)
    assert known(grid.certificate).passed
    assert (grid.nodes == ended[-1]).all()
    assert len({nodes.tobytes() for nodes in ended}) == len(ended) > 1
    if failing == 1:
        assert len(ended) == 2
    else:
        assert (grid.nodes == without.nodes).all()
        assert (grid.triangles == without.triangles).all()


@pytest.mark.parametrize("handles", [[], ["a tunnel where the scan is closed"]])
def test_no_tips_are_looked_for_where_a_grid_has_handles_that_its_scan_does_not_have(
    handles: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    done: list[str] = []

    def looked_for(*_: Any) -> list[Any]:
        done.append("tips")
        return []

    monkeypatch.setattr(tip_search, "reach_tips_of", looked_for)
    candidate = SimpleNamespace(
        judged=SimpleNamespace(false_handles=handles),
        mesh=SimpleNamespace(copied=lambda: None),
        end=lambda: done.append("end"),
    )
    tip_search.end_with_tips(*cast(Any, (candidate, 0, 0, 0, 0)))
    assert done == ["tips"] * (not handles) + ["end"]


@compiled_only
def test_a_ball_has_no_tips(monkeypatch: pytest.MonkeyPatch) -> None:
    points, settings = BALL * on_ball(6000, np.random.default_rng(3)), st.Settings(length=1.0)
    grid = st.grid_from_points(points, settings)
    monkeypatch.setattr(tip_search, "TURNS_OF_TIPS", 0)
    without = st.grid_from_points(points, settings)
    assert (grid.nodes == without.nodes).all()
    assert (grid.triangles == without.triangles).all()
