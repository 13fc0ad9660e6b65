"""Longer searches of grids that pass: what they leave, what they spare, and which grids effort `normal` searches on."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np
import pytest
from marks import compiled_only
from shapes import make
from small_clouds import cap
from steps import Steps, steps_of
from typed import known

import scantruss as st
from scantruss import candidates
from scantruss.candidates import TURNS_OF_BEST, fitted_and_evened
from scantruss.check.certify import judge
from scantruss.errors import CertificateError
from scantruss.front.orientation_field import orientation_fields
from scantruss.grid.certificate import Fault
from scantruss.improve.candidate import Candidate, grid_of
from scantruss.improve.longer_search import SPARED_AT_FAULT, Turns, is_as_near, search_on
from scantruss.improve.optimize import searched_again
from scantruss.improve.working_mesh import WorkingMesh
from scantruss.kernels.mesh.grid import AT_REST

TURNS = Turns(free=4, sparing=6)
Usual = tuple[Candidate, Steps, st.Settings]


def usual_of(points: np.ndarray, length: float) -> Usual:
    """The candidate of effort `normal` on points, before it is fitted and searched on, and the steps before."""
    cloud, settings = st.PointCloud.from_array(points), st.Settings(length=length)
    steps = steps_of(cloud, settings)
    fields = orientation_fields(steps.samples, steps.boundary, settings)
    improved = candidates.improve_fronts(candidates.advance_fronts(*steps, fields, settings), *steps, settings)
    return candidates.chosen(candidates.those_that_pass(improved, *steps, settings)), steps, settings


def usual_of_gable() -> Usual:
    gable = make("gable", 20_000)
    return usual_of(gable.points, 1.5 * gable.length)


@compiled_only
def test_a_grid_with_ridges_is_searched_on_and_is_in_no_figure_worse() -> None:
    best, steps, settings = usual_of_gable()
    usual = grid_of(best)
    search_on(best, *steps, settings, known(best.judged), TURNS_OF_BEST)
    even = grid_of(best)
    theirs, found = (known(known(grid.certificate).scan_distance) for grid in (usual, even))
    assert len(even.lines) > 0 and known(even.certificate).passed
    assert even.quality.length_cv < usual.quality.length_cv and even.quality.shape_mean >= usual.quality.shape_mean
    assert found.p95 <= theirs.p95 and found.p99 <= theirs.p99


@compiled_only
@pytest.mark.parametrize(("most", "searches"), [(3000, 4), (10, 1)])
def test_longer_searches_have_meshes_and_chances_of_their_own(
    monkeypatch: pytest.MonkeyPatch, most: int, searches: int
) -> None:
    usual, steps, settings = usual_of(cap(4.0, 1.0, 0.25), 1.0)
    nodes, begun = usual.mesh.net.nodes.copy(), list[tuple[int, Candidate]]()

    def search(candidate: Candidate, *others: Any) -> None:
        begun.append((others[-1], candidate))
        assert np.array_equal(candidate.mesh.net.nodes, nodes)

    monkeypatch.setattr(candidates, "search_on", search)
    monkeypatch.setattr(candidates, "NODES_OF_SEVERAL_SEARCHES", most)
    assert candidates.searched_on(usual, usual, [], *steps, settings) in [each for _, each in begun]
    assert sorted(number for number, _ in begun) == list(range(searches))
    meshes = [each.mesh for _, each in begun]
    for one, two in combinations(meshes, 2):
        pairs = zip((*one.net, one.patches), (*two.net, two.patches), strict=True)
        assert not any(np.shares_memory(*pair) for pair in pairs)


@compiled_only
def test_a_longer_search_spares_the_places_of_its_faults_and_begins_again_from_its_last_good_grid(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The second half of the turns all fail at one place, and each of them begins from the same grid.

    Those after the first spare the place, and those after the second leave its nodes where they are.
    """
    best, steps, settings = usual_of(cap(4.0, 1.0, 0.25), 1.0)
    begun: list[tuple[bytes, list[int]]] = []
    held, moved = list[int](), list[float]()
    fault = Fault("torn", "is torn", (0.5, 0.25, 4.0))

    def searched(mesh: WorkingMesh, *others: Any) -> st.Grid:
        begun.append((mesh.net.nodes.tobytes(), [len(each.places) for each in others[-2]]))
        place = np.array(fault.where) - steps.samples.origin
        near = np.linalg.norm(mesh.net.nodes - place, axis=1) < SPARED_AT_FAULT * mesh.length
        at_rest = near & (mesh.net.degree > 0) & (mesh.net.kind == AT_REST)
        held.append(int(at_rest.sum()))
        before = mesh.net.nodes[at_rest]
        grid = searched_again(mesh, *others)
        moved.append(float(np.linalg.norm(mesh.net.nodes[at_rest] - before, axis=1).max(initial=0.0)))
        return grid

    def check(grid: st.Grid, *others: Any) -> Any:
        now = judge(grid, *others)
        fails = len(begun) > TURNS.free
        return replace(now, certificate=replace(now.certificate, faults=(fault,))) if fails else now

    monkeypatch.setattr("scantruss.improve.longer_search.searched_again", searched)
    monkeypatch.setattr("scantruss.improve.longer_search.judged", check)
    search_on(best, *steps, settings, known(best.judged), TURNS)
    sparing = begun[TURNS.free :]
    assert len({nodes for nodes, _ in sparing}) == 1
    assert [spared for _, spared in sparing] == [[k, 0] for k in range(TURNS.sparing)]
    assert max(moved) < 1e-6
    assert min(held[TURNS.free + 2 :]) > max(held[: TURNS.free + 2])
    assert known(grid_of(best).certificate).passed


@compiled_only
def test_a_grid_with_ridges_that_is_uneven_is_searched_on_by_normal_and_is_in_no_figure_worse(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(candidates, "SEARCHED_ON_FROM", 0.0)
    usual, steps, settings = usual_of_gable()
    before = grid_of(usual)
    even = grid_of(fitted_and_evened(usual, *steps, settings))
    theirs, found = (known(grid.certificate) for grid in (before, even))
    assert found.passed and len(found.warnings) <= len(theirs.warnings)
    assert even.quality.length_cv < before.quality.length_cv - 0.001
    assert even.quality.shape_mean >= before.quality.shape_mean
    assert known(found.scan_distance).p95 <= known(theirs.scan_distance).p95
    assert known(found.scan_distance).p99 <= known(theirs.scan_distance).p99


@pytest.mark.parametrize("which", ["p95", "p99"])
def test_a_grid_is_as_near_as_another_up_to_what_it_may_be_farther(which: str) -> None:
    """At 95 and at 99 %; nearer at one does not make up for farther at the other."""
    grid = st.grid_from_points(cap(4.0, 1.0, 0.25), st.Settings(length=1.0))
    found = known(grid.certificate)
    off = known(found.scan_distance)
    other = "p99" if which == "p95" else "p95"
    farther = replace(off, **{which: getattr(off, which) + 0.004, other: 0.5 * getattr(off, other)})
    moved = grid.replace(certificate=replace(found, scan_distance=farther))
    assert is_as_near(grid, grid)
    assert not is_as_near(moved, grid)
    assert not is_as_near(moved, grid, 0.003)
    assert is_as_near(moved, grid, 0.005)
    missing = grid.replace(certificate=replace(found, missing=found.missing + 0.01))
    assert not is_as_near(missing, grid, 0.005)


@compiled_only
@pytest.mark.parametrize(
    ("limits", "searches"), [({}, 2), ({"SEARCHED_ON_FROM": 1.0}, 0), ({"NODES_OF_SEVERAL_SEARCHES": 10}, 0), (None, 0)]
)
def test_normal_searches_on_where_a_grid_is_folded_uneven_and_not_large(
    limits: dict[str, float] | None, searches: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without limits: a cap, which has no folds."""
    usual, steps, settings = usual_of(cap(4.0, 1.0, 0.25), 1.0) if limits is None else usual_of_gable()
    begun: list[int] = []
    monkeypatch.setattr(candidates, "search_on", lambda *others: begun.append(others[-1]))
    for name, limit in {"SEARCHED_ON_FROM": 0.0, **(limits or {})}.items():
        monkeypatch.setattr(candidates, name, limit)
    fitted_and_evened(usual, *steps, settings)
    assert sorted(begun) == list(range(searches))


@compiled_only
def test_the_mesh_in_the_end_is_that_of_the_grid_taken() -> None:
    best, steps, settings = usual_of_gable()
    before = best.judged
    search_on(best, *steps, settings, known(best.judged), TURNS)
    assert best.judged is not before
    closed = best.mesh.to_grid(best.front)
    assert (np.sort(closed.triangles) == np.sort(grid_of(best).triangles)).all()
    assert (closed.nodes == grid_of(best).nodes).all()


@compiled_only
def test_what_only_the_whole_certificate_tells_leaves_the_grid_as_it_was(monkeypatch: pytest.MonkeyPatch) -> None:
    best, steps, settings = usual_of_gable()
    before, ends, nodes = grid_of(best), list[st.Grid](), best.mesh.net.nodes.copy()

    def end(candidate: Candidate) -> None:
        ends.append(grid_of(candidate))
        raise CertificateError("has a tunnel", grid_of(candidate))

    monkeypatch.setattr(Candidate, "end", end)
    search_on(best, *steps, settings, known(best.judged), TURNS)
    assert ends and ends[0].quality.length_cv < before.quality.length_cv
    assert grid_of(best) is before
    assert (best.mesh.net.nodes == nodes).all()
