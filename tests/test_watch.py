"""A watch on a stage: what takes more than a multiple of its expected steps is refused, with the place."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from shapes import make

import scantruss as st
from scantruss.boundary import rolling_disc
from scantruss.check import crossings
from scantruss.constraints import fold_tracing
from scantruss.front import advance
from scantruss.runtime import watch
from scantruss.runtime.watch import SPARE_STEPS, Watch


def test_a_stage_may_take_a_multiple_of_its_expected_steps() -> None:
    some = Watch("too many steps", 100.0, 3.0)
    for _ in range(3):
        some.note(100, (1.0, 2.0, 3.0))
    some.note(SPARE_STEPS, (1.0, 2.0, 3.0))
    with pytest.raises(st.FrontError, match="too many steps") as refusal:
        some.note(1, np.array([4.0, 5.0, 6.0]))
    assert refusal.value.where == (4.0, 5.0, 6.0)


@pytest.mark.parametrize(
    ("module", "multiple", "words"),
    [
        (rolling_disc, "MOST_TOUCHES", "the boundary cannot be followed"),
        (fold_tracing, "MOST_TRACED", "the ridges of the scan cannot be followed"),
        (advance, "MOST_TRIANGLES_MADE", "the front runs over itself"),
    ],
)
def test_each_stage_is_watched(monkeypatch: pytest.MonkeyPatch, module: object, multiple: str, words: str) -> None:
    """With a multiple that no stage can keep to, each one refuses, at a place on the scan."""
    monkeypatch.setattr(watch, "SPARE_STEPS", 0)
    monkeypatch.setattr(module, multiple, 1e-3)
    shape = make("gable", 10_000)
    with pytest.raises(st.FrontError, match=words) as refusal:
        st.grid_from_points(shape.points, st.Settings(length=shape.length, effort="quick"))
    where = refusal.value.where
    assert where is not None and np.linalg.norm(shape.points - where, axis=1).min() < shape.length


def small_scan() -> tuple[st.PointCloud, st.Settings]:
    return st.PointCloud.from_array(make("gable", 10_000).points), st.Settings(length=make("gable", 10_000).length)


def test_triangles_that_cannot_be_told_apart_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """A search that meets nothing but triangles near each other ends, whatever is among those that it has not seen."""
    monkeypatch.setattr(crossings, "NEAR_A_TRIANGLE", 0)
    monkeypatch.setattr(crossings, "ROOM_FOR_PAIRS", 1)
    monkeypatch.setattr(crossings, "triangles_meet", lambda *_: False)
    nodes = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0.2, 0.2, -1), (0.2, 0.2, 1), (2, 2, 0)], float)
    with pytest.raises(st.FrontError, match="can be told apart"):
        crossings.find_crossings(nodes, np.array([(0, 1, 2), (3, 4, 5)]))


def test_one_disc_that_is_caught_may_be_tried_again_as_often_as_is_allowed() -> None:
    """Of a small scan each try may touch thousands of samples: a lion at twice its length was refused at the first."""
    rolling = rolling_disc._RollingDisc(st.sample_surface(*small_scan()).surface, np.ones(1), 10, np.zeros(3))
    for _ in range(2 * rolling_disc.MOST_TRIES):
        rolling.watch.note(len(rolling.path), np.zeros(3))


def test_the_loops_of_samples_are_rolled_once_and_so_is_what_cannot_be_followed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    cloud, settings = small_scan()
    samples, radii, roll = st.sample_surface(cloud, settings), list[float](), rolling_disc.boundary_loops

    def noted(*given: Any) -> Any:
        radii.append(given[3])
        return roll(*given)

    monkeypatch.setattr(rolling_disc, "boundary_loops", noted)
    monkeypatch.setattr(rolling_disc, "MOST_TOUCHES", 0.0)
    monkeypatch.setattr(watch, "SPARE_STEPS", 0)
    told = set()
    for effort in ("quick", "normal"):
        with pytest.raises(st.FrontError, match="the boundary cannot be followed") as refusal:
            st.find_boundary(samples, settings.replace(effort=effort))
        told.add((str(refusal.value), refusal.value.where))
    assert len(radii) == len(told) == 1
    monkeypatch.undo()
    wider = settings.replace(boundary_radius=0.6)
    (loop,), (first,) = (st.find_boundary(samples, each)[1].loops for each in (wider, wider.replace(corner_angle=60.0)))
    (again,) = st.find_boundary(
        st.sample_surface(st.PointCloud.from_array(make("gable", 10_000).points), wider), wider
    )[1].loops
    assert np.array_equal(loop.points, again.points) and np.allclose(first.length, loop.length, rtol=0.05)
