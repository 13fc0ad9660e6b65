"""Which nodes `--supports corners` holds."""

import numpy as np
import pytest
from small_grids import dome, make_grid

from scantruss.structure.supports import node_sets


def outline(*sides: tuple[float, int]) -> np.ndarray:
    """Return the nodes of a closed polyline: turns [degree] and then so many members of 1 m."""
    directions = np.repeat(np.radians(np.cumsum([turn for turn, _ in sides])), [count for _, count in sides])
    steps = np.stack([np.cos(directions), np.sin(directions), 0 * directions], axis=1)
    return np.cumsum(steps, axis=0) - steps


def corners(points: np.ndarray) -> list[int]:
    """Return the corners of a plane grid that a node in the middle joins to a closed polyline."""
    count = len(points)
    grid = make_grid([*points, points.mean(axis=0)], [(k, (k + 1) % count, count) for k in range(count)])
    return node_sets(grid)["corners"].tolist()


@pytest.mark.parametrize("foot", [1, 2, 3, 5])
def test_both_ends_of_a_foot_are_corners_however_narrow_it_is(foot: int) -> None:
    """A hexagon of alternating long and short sides stands on feet of one member and more."""
    assert corners(outline(*[(60, foot), (60, 9)] * 3)) == sorted(
        each for k in range(3) for each in (k * (foot + 9), k * (foot + 9) + foot)
    )


def test_a_corner_that_is_rounded_over_a_member_or_two_is_one() -> None:
    rounded = outline(*[(30, 1), (30, 1), (30, 8)] * 4)
    assert corners(rounded) == [1, 11, 21, 31]


def test_a_round_boundary_has_no_corner_and_a_square_four() -> None:
    assert corners(outline(*[(10, 1)] * 36)) == []
    assert corners(outline(*[(90, 6)] * 4)) == [0, 6, 12, 18]


def test_a_dome_stands_on_its_four_corners() -> None:
    assert node_sets(dome(7))["corners"].tolist() == [0, 6, 42, 48]
