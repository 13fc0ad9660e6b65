"""Search boxes find exactly what looking at every point finds (Sec. 3.2)."""

from collections.abc import Iterable

import naive
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from typed import xyz

from scantruss.kernels.geometry.boxes import SearchBoxes, box_index, nearest, new_boxes, put, search, take

pytestmark = pytest.mark.kernels


def filled(points: np.ndarray, box: float) -> SearchBoxes:
    """Boxes that hold all points."""
    boxes = new_boxes(points.min(axis=0), points.max(axis=0), box, len(points), len(points))
    for i, p in enumerate(points):
        put(boxes, i, *p)
    return boxes


def found_in(boxes: SearchBoxes, points: np.ndarray, place: Iterable[float], reach: float) -> list[int]:
    room = np.empty(len(points) + 1, np.int64)
    return sorted(room[: search(boxes, points, *xyz(place), reach, room)].tolist())


@st.composite
def clouds(draw: st.DrawFn) -> np.ndarray:
    """Points in a box of any place and proportion, thin and flat ones too; some points twice."""
    rng = np.random.default_rng(draw(st.integers(0, 10_000)))
    count = draw(st.integers(1, 60))
    extent = np.array([draw(st.sampled_from([0.0, 1e-9, 0.3, 1.0, 20.0])) for _ in range(3)])
    centre = np.array([draw(st.sampled_from([-1e4, -3.0, 0.0, 7.5])) for _ in range(3)])
    points = centre + extent * rng.random((count, 3))
    return np.concatenate([points, points[: count // 3]])


@given(clouds(), st.floats(0.05, 3.0), st.floats(0.0, 4.0), st.integers(0, 1000))
def test_boxes_find_exactly_what_brute_force_finds(points: np.ndarray, box: float, reach: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    boxes = filled(points, box)
    places = [points[0], points.mean(axis=0), points.min(axis=0) - 3.0, points.max(axis=0) + 0.5 * reach]
    places += list(points[rng.integers(len(points), size=3)] + rng.normal(size=(3, 3)))
    for place in places:
        assert found_in(boxes, points, place, reach) == naive.within(points, place, reach)


@given(clouds(), st.floats(0.05, 3.0), st.floats(0.0, 4.0), st.integers(0, 1000))
def test_the_nearest_is_the_first_of_those_that_no_other_is_nearer_than(
    points: np.ndarray, box: float, reach: float, seed: int
) -> None:
    """Of points that lie outside of the bounds of the boxes too, as those that were put in later."""
    rng = np.random.default_rng(seed)
    within = points[: max(len(points) // 2, 1)]
    boxes = new_boxes(within.min(axis=0), within.max(axis=0), box, len(points), len(points))
    for i, point in enumerate(points):
        put(boxes, i, *point)
    for place in [
        points[0],
        points.min(axis=0) - 0.7,
        *(points[rng.integers(len(points), size=4)] + rng.normal(size=(4, 3))),
    ]:
        squares = ((points - place) ** 2).sum(axis=1)
        first = int(squares.argmin())
        assert nearest(boxes, points, *xyz(place), reach) == (first if squares[first] < reach * reach else -1)


@given(clouds(), st.floats(0.05, 3.0), st.integers(0, 1000))
def test_what_was_taken_out_is_no_longer_found_and_can_come_back(points: np.ndarray, box: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    boxes = filled(points, box)
    gone = rng.permutation(len(points))[: len(points) // 2]
    for i in gone:
        take(boxes, i, *points[i])
    left = sorted(set(range(len(points))) - set(gone.tolist()))
    centre = points.mean(axis=0)
    assert found_in(boxes, points, centre, 1e3) == left
    for i in gone:
        put(boxes, i, *points[i])
    assert found_in(boxes, points, centre, 1e3) == list(range(len(points)))


def test_taking_out_what_is_not_there_changes_nothing() -> None:
    points = np.array([[0.0, 0, 0], [0.1, 0, 0], [5, 5, 5]])
    boxes = filled(points, 1.0)
    take(boxes, 2, 0.0, 0.0, 0.0)  # it is in another box
    assert found_in(boxes, points, (0.0, 0.0, 0.0), 10.0) == [0, 1, 2]


def test_put_says_whether_the_box_was_new() -> None:
    boxes = new_boxes(np.zeros(3), np.full(3, 4.0), 1.0, 4, 4)
    assert [put(boxes, i, *p) for i, p in enumerate([(0.1, 0, 0), (0.2, 0, 0), (3.5, 0, 0)])] == [1, 0, 1]


def test_no_more_is_returned_than_there_is_room_for() -> None:
    points = np.random.default_rng(0).random((50, 3))
    room = np.empty(7, np.int64)
    assert search(filled(points, 0.3), points, 0.5, 0.5, 0.5, 9.0, room) == 7
    assert len(set(room.tolist())) == 7


@given(st.floats(1e-3, 1e3), st.floats(1e-3, 1e3))
def test_the_size_of_a_box_lies_between_half_of_what_was_asked_and_that(extent: float, box: float) -> None:
    boxes = new_boxes(np.full(3, -1.0), np.array([-1.0 + extent, -1.0, -1.0]), box, 1, 1)
    assume(extent < 1e5 * box)  # beyond that boxes grow, so that their number stays a number
    assert (boxes.size <= box * (1 + 1e-12)).all()
    if box <= extent:
        assert boxes.size[0] > box / 2
    assert boxes.size[1] == box  # no thickness: one box of the size that was asked


@given(clouds(), st.floats(0.05, 3.0))
def test_every_point_lies_in_the_box_of_its_index(points: np.ndarray, box: float) -> None:
    boxes = filled(points, box)
    for p in points:
        for axis in range(3):
            i = box_index(boxes, axis, p[axis])
            low = boxes.lower[axis] + i * boxes.size[axis]
            slack = 1e-9 * max(abs(p[axis]), 1.0)
            assert low - slack <= p[axis] <= low + boxes.size[axis] + slack
            assert 0 <= i < boxes.counts[axis]


def test_places_outside_the_bounds_belong_to_the_outermost_box() -> None:
    boxes = new_boxes(np.zeros(3), np.full(3, 4.0), 1.0, 1, 1)
    assert box_index(boxes, 0, -1e6) == 0
    assert box_index(boxes, 0, -1e-12) == 0
    assert box_index(boxes, 0, 1e6) == boxes.counts[0] - 1


@pytest.mark.parametrize("thickness", [1e-12, 1e-20, 1e-200])
def test_a_hair_of_thickness_hides_no_point(thickness: float) -> None:
    points = np.array([[0.0, 0, 0], [1, 0, thickness], [2, 1, 0], [2, 2, thickness]])
    assert found_in(filled(points, 1.0), points, (1.0, 0.0, 0.0), 5.0) == [0, 1, 2, 3]


def test_very_many_boxes_cost_no_memory() -> None:
    """Two clusters very far apart: only occupied boxes are kept."""
    points = np.array([[0.0, 0, 0], [1e6, 1e6, 1e6], [1e6 + 0.5, 1e6, 1e6]])
    boxes = filled(points, 1.0)
    assert len(boxes.keys) < 100
    assert found_in(boxes, points, points[1], 0.6) == [1, 2]
