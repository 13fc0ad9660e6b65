"""Ridges that no grid passes with are given up near the faults: which part, how long and where is said."""

from itertools import pairwise

import numpy as np
import pytest
from small_grids import dome
from typed import known

from scantruss.boundary.curves import length_along
from scantruss.check.limits import with_ridges_given_up
from scantruss.check.unfollowed import broken_ridges
from scantruss.constraints.ridge_ends import Ridge
from scantruss.constraints.ridges import FAULT_REACH, cut_around, given_up
from scantruss.grid.certificate import Certificate
from scantruss.grid.line_sets import RIDGE, LineSet

STRIDE = 0.25


def straight(*spans: tuple[float, float]) -> Ridge:
    """A ridge along x over some spans, with nothing between these."""
    x = np.concatenate([np.arange(begin, end + 1e-9, STRIDE) for begin, end in spans])
    return Ridge(np.column_stack([x, np.zeros((len(x), 2))]), True)


@pytest.mark.parametrize(
    ("at", "part"), [(10.0, (8.25, 11.75)), (1.0, (0.0, 3.0)), (19.5, (17.5, 20.0)), (2.5, (0.0, 4.5))]
)
def test_the_part_that_is_given_up_is_what_the_others_do_not_hold(at: float, part: tuple[float, float]) -> None:
    ridge, fault = straight((0.0, 20.0)), np.array([[at, 0.0, 0.0]])
    (gone,) = given_up([ridge], fault, 1.0)
    assert np.abs(gone[[0, -1], 0] - part).max() <= STRIDE
    left = sum(length_along(each.places) for each in cut_around([ridge], fault, 1.0))
    assert left + length_along(gone) == pytest.approx(20.0)
    assert given_up([ridge], fault + [0.0, 2.0 * FAULT_REACH, 0.0], 1.0) == given_up([ridge], fault[:0], 1.0) == []


def test_an_opening_that_a_ridge_goes_on_behind_is_no_part_of_it() -> None:
    parts = given_up([straight((0.0, 8.0), (11.0, 20.0))], np.array([[9.5, 0.0, 0.0]]), 1.0)
    assert [length_along(part) for part in parts] == pytest.approx([0.5, 0.5])
    assert all(part[:, 0].max() <= 8.0 or part[:, 0].min() >= 11.0 for part in parts)


@pytest.mark.parametrize("turn", [0, 7, 20])
def test_a_ring_loses_one_part_wherever_it_begins(turn: int) -> None:
    angle = np.linspace(0, 2 * np.pi, 80, endpoint=False)
    ring = 5.0 * np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle])
    (gone,) = given_up([Ridge(np.roll(ring, turn, axis=0), True, ring=True)], ring[:1], 1.0)
    assert length_along(gone) == pytest.approx(2.0 * FAULT_REACH, abs=3.0 * STRIDE)
    assert np.linalg.norm(gone[len(gone) // 2] - ring[0]) <= STRIDE


@pytest.mark.parametrize(("last", "breaks"), [(6, 0.0), (7, 1.0), (8, 2.0), (10, 0.0)])
def test_a_ridge_that_ends_before_the_corner_for_which_it_makes_is_said(last: int, breaks: float) -> None:
    """Two ridges meet in the node 6, 6 of a dome; a third comes from its edge as far as the node `last`, 6."""
    count, size = 12, 4.0
    others = [[count * i + 6 for i in range(7)], [count * 6 + j for j in range(6, 12)]]
    chains = [*others, [count * i + 6 for i in range(11, last - 1, -1)]]
    sets = tuple(LineSet(f"ridge {number}", RIDGE, np.array(chain)) for number, chain in enumerate(chains, 1))
    lines = np.array([pair for chain in chains for pair in pairwise(chain)])
    grid = dome(count, size, unit="m", lines=lines, line_sets=sets)
    found = broken_ridges(grid, np.full(9, size))
    assert len(found) == (breaks > 0.0)
    if found:
        away = float(np.linalg.norm(grid.nodes[count * last + 6] - grid.nodes[count * 6 + 6]))
        assert away == pytest.approx(breaks * size, rel=0.1)
        assert f"breaks off a ridge {away:.3g} m before the corner" in found[0].words
        middle = 0.5 * (grid.nodes[count * last + 6] + grid.nodes[count * 6 + 6]) + grid.origin
        assert np.allclose(known(found[0].where), middle)


def test_the_warning_names_length_ends_and_middle_of_each_part() -> None:
    grid = dome(5, unit="m", certificate=Certificate("m", 0.5, True, True, 1, 1, 1, 1, 1, 0))
    long, short = straight((1.0, 9.0)).places, straight((20.0, 21.0)).places
    found = with_ridges_given_up(grid, [long, short]).certificate
    assert found is not None
    (warning,) = found.warnings
    assert (
        warning.kind == "ridge"
        and "gives up ridges where no grid passes with them: 9 m" in warning.words
        and "2 parts, the longest 8 m," in warning.words
    )
    assert warning.words.endswith("from (1, 0, 0) to (9, 0, 0)")
    assert warning.where == (5.0, 0.0, 0.0) and warning.also == ((20.5, 0.0, 0.0),)
    assert with_ridges_given_up(grid, []) is grid
    ring = np.concatenate([long, long[:1]])
    (warning,) = known(with_ridges_given_up(grid, [ring]).certificate).warnings
    assert warning.words.endswith(": 16 m in a ring through (1, 0, 0)")
