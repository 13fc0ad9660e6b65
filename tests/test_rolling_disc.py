"""The disc that is rolled along the edge of a scan."""

from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from naive import reachable
from small_clouds import samples_of, sheet

from scantruss.kernels.boundary.loops import DISC_DIRECTIONS, free_directions, has_gap
from scantruss.kernels.geometry.vectors import across
from scantruss.kernels.surface.local_surface import Surface


@pytest.mark.kernels
@given(st.lists(st.tuples(st.floats(-180, 180), st.floats(0.2, 1.0)), max_size=9), st.floats(20, 85))
def test_a_sample_has_a_gap_where_no_neighbour_lies_for_more_than_an_angle(
    others: list[tuple[float, float]], widest: float
) -> None:
    angles = np.radians([angle for angle, _ in others])
    turns = np.sort(angles % (2 * np.pi))
    gaps = np.diff(turns, append=turns[:1] + 2 * np.pi)
    assume(np.abs(gaps - np.radians(widest)).min(initial=1.0) > 1e-6)
    far = np.array([distance for _, distance in others])
    around = np.stack([far * np.cos(angles), far * np.sin(angles), 0.1 * far], axis=1)
    mean = np.concatenate([np.zeros((1, 3)), around])
    links = np.full((len(mean), 9), -1)
    links[0, : len(others)] = np.arange(1, len(mean))
    surface = samples_of(sheet(3, 3, 0.2)).surface._replace(mean=mean, neighbors=links)
    found = has_gap(surface, 0, (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), np.radians(widest), np.empty((9, 3)))
    assert found == bool((gaps > np.radians(widest)).any())


def widest_free(surface: Surface, sample: int, radius: float) -> tuple[Any, float, int]:
    """Middle of the widest run of directions in which a disc that touches a sample holds no other one, 9 where there is none."""
    mean, u = surface.mean, np.array(across(tuple(surface.normals[sample])))
    turns = 2 * np.pi * np.arange(DISC_DIRECTIONS) / DISC_DIRECTIONS
    out = np.cos(turns)[:, None] * u + np.sin(turns)[:, None] * np.cross(surface.normals[sample], u)
    others = sorted(reachable(surface.neighbors, mean, sample, mean[sample], 2 * radius) - {sample})
    away = np.linalg.norm(mean[others] - (mean[sample] + radius * out)[:, None], axis=2)
    assume(np.abs(away - radius).min(initial=radius) > 1e-9)
    free, runs = (away > radius).all(axis=1), []
    for first in range(DISC_DIRECTIONS):
        length = next((i for i in range(DISC_DIRECTIONS) if not free[(first + i) % DISC_DIRECTIONS]), DISC_DIRECTIONS)
        runs.append((length, first))
    length, first = max(runs)
    middle = turns[first] + 0.5 * (length - 1) * 2 * np.pi / DISC_DIRECTIONS
    return (middle, length, sum(longest == length for longest, _ in runs)) if length else (9.0, 0, 1)


@pytest.mark.kernels
@settings(max_examples=15)
@given(st.integers(0, 10**6), st.floats(0.15, 0.4))
def test_a_sample_is_at_the_edge_where_a_disc_that_touches_it_can_be_empty(seed: int, radius: float) -> None:
    """Points at random leave gaps between their neighbours at many samples, into most of which no disc fits."""
    rng = np.random.default_rng(seed)
    surface = samples_of(np.pad(rng.uniform(0, 2, (250, 2)), ((0, 0), (0, 1))), length=0.3).surface
    count, widest = len(surface.mean), np.radians(75.0)
    radii, free = radius * rng.uniform(0.5, 1.2, count), np.empty(count)
    free_directions(surface, radii, widest, free, 0, count)
    ahead, inside = np.empty((surface.neighbors.shape[1], 3)), 0
    for sample in range(count):
        u = across(tuple(surface.normals[sample]))
        v = tuple(np.cross(surface.normals[sample], u))
        if not has_gap(surface, sample, u, v, widest, ahead):
            assert free[sample] == 9.0
            continue
        expected, length, ties = widest_free(surface, sample, radii[sample])
        assert (free[sample] < 9.0) == (length > 0)
        inside += length == 0
        if length and ties == 1:
            assert abs((free[sample] - expected + np.pi) % (2 * np.pi) - np.pi) < 1e-9
    assert inside
