"""The local surface of the scan: feet on planes, quadrics and balls, on one sheet only, outliers ignored."""

from collections.abc import Iterable
from functools import cache

import naive
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from small_clouds import ball, samples_of, sheet, turn_of
from typed import xyz

from scantruss.kernels.surface.local_surface import (
    SURFACE_PATCH,
    Surface,
    fit_patch,
    flood,
    linked,
    onto_patch,
    patch_normal,
    walk,
)
from scantruss.runtime.jit import new_record


@cache
def small_ball() -> Surface:
    """Sites of a ball, prepared once."""
    return samples_of(ball(2.0, 400)).surface


def nearest_sample(surface: Surface, place: Iterable[float]) -> int:
    return int(((surface.mean - xyz(place)) ** 2).sum(axis=1).argmin())


def foot_of(surface: Surface, place: Iterable[float], sample: int | None = None) -> np.ndarray:
    """Foot of a place by a fresh patch, on the sheet of a sample or of the nearest one."""
    patch, at = new_record(SURFACE_PATCH), xyz(place)
    fit_patch(surface, patch, nearest_sample(surface, at) if sample is None else sample, at)
    return np.array(onto_patch(patch, at))


def inner_places(rng: np.random.Generator, width: float, count: int) -> np.ndarray:
    """Places a little over or under the plane, away from the boundary of a plate."""
    return rng.uniform(-1, 1, (count, 3)) * [0.5 * width - 1.0, 0.5 * width - 1.0, 0.2]


@pytest.mark.kernels
@given(st.integers(0, 1000))
@settings(max_examples=5)
def test_planes_are_reproduced_exactly(seed: int) -> None:
    """Tilted or not: the foot is the foot on the plane, the normal that of the plane."""
    turn = turn_of(seed)
    surface = samples_of(sheet(5, 5, 0.25, seed=seed) @ turn.T).surface
    for place in inner_places(np.random.default_rng(seed), 5.0, 3):
        patch = new_record(SURFACE_PATCH)
        at = tuple(turn @ place)
        fit_patch(surface, patch, nearest_sample(surface, at), at)
        foot = np.array(onto_patch(patch, at))
        assert foot == pytest.approx(turn @ (place * [1, 1, 0]), abs=1e-8)
        assert abs(np.array(patch_normal(patch, at)) @ turn[:, 2]) == pytest.approx(1, abs=1e-12)


@pytest.mark.kernels
def test_planes_are_reproduced_exactly_at_their_rim_too() -> None:
    surface = samples_of(sheet(5, 5, 0.25)).surface
    for place in ([2.5, 0.3, 0.1], [2.5, 2.5, 0.1], [-2.4, 2.5, -0.1]):
        assert foot_of(surface, place) == pytest.approx([*place[:2], 0], abs=1e-8)


@pytest.mark.kernels
@pytest.mark.parametrize("place", [(0.5, 0.2, 0.6), (-0.6, 0.4, -0.3), (0.3, -0.7, 0.5)])
def test_the_foot_is_the_nearest_place_of_the_patch(place: tuple[float, float, float]) -> None:
    """Aside of the middle, where the patch is steep: the nearest of a fine raster of its places."""
    patch = new_record(SURFACE_PATCH)
    c = (0.05, 0.1, -0.2, 0.3, 0.1, -0.25)
    patch.normal, patch.tangent, patch.heights = (0, 0, 1), (1, 0, 0), c
    x, y = np.meshgrid(np.linspace(-1.5, 1.5, 1501), np.linspace(-1.5, 1.5, 1501))
    z = c[0] + c[1] * x + c[2] * y + c[3] * x * x + c[4] * x * y + c[5] * y * y
    away = np.sqrt((x - place[0]) ** 2 + (y - place[1]) ** 2 + (z - place[2]) ** 2)
    foot = np.array(onto_patch(patch, place))
    assert np.linalg.norm(foot - place) == pytest.approx(away.min(), rel=0.01)


@pytest.mark.kernels
@pytest.mark.parametrize("coefficients", [(0.1, 0.05, -0.08), (0.12, 0.0, 0.12), (0.0, 0.2, 0.0)])
def test_quadrics_are_reproduced_nearly_exactly(coefficients: tuple[float, float, float]) -> None:
    """Z = a x^2 + b x y + c y^2: a graph over its own tangent plane at the middle, nearly one elsewhere."""
    a, b, c = coefficients

    def height(p: np.ndarray) -> np.ndarray:
        return a * p[..., 0] ** 2 + b * p[..., 0] * p[..., 1] + c * p[..., 1] ** 2

    points = sheet(5, 5, 0.2)
    points[:, 2] = height(points)
    surface = samples_of(points).surface
    for place in np.array([(0, 0, 0.1), (0.8, -0.5, 0.1), (-1.0, 1.2, -0.1), (1.5, 0.2, 0.0)]):
        foot = foot_of(surface, place)
        assert foot[2] == pytest.approx(height(foot), abs=2e-3)
        slope = np.array([2 * a * foot[0] + b * foot[1], 2 * c * foot[1] + b * foot[0], -1])
        away = place - foot
        if np.linalg.norm(away) > 0.02:  # it stands upright on the surface
            assert abs(away @ slope) > 0.999 * np.linalg.norm(away) * np.linalg.norm(slope)


def test_the_foot_lies_on_a_noisy_ball_within_half_the_noise() -> None:
    noise = 0.02
    surface = samples_of(ball(5.0, 40_000, noise=noise)).surface
    rng = np.random.default_rng(2)
    places = rng.normal(size=(150, 3))
    places *= (5.0 + rng.uniform(-0.2, 0.2, 150) / 1)[:, None] / np.linalg.norm(places, axis=1)[:, None]
    feet = np.array([foot_of(surface, p) for p in places])
    radius = np.linalg.norm(feet, axis=1)
    assert abs(radius - 5.0).mean() < 0.5 * noise
    beside = np.linalg.norm(feet / radius[:, None] - places / np.linalg.norm(places, axis=1)[:, None], axis=1)
    assert 5.0 * beside.max() < 0.05  # the foot is below the place, not beside it


@pytest.mark.kernels
def test_the_normal_of_a_patch_is_that_of_the_ball() -> None:
    surface = samples_of(ball(3.0, 1500)).surface
    for place in np.random.default_rng(5).normal(size=(5, 3)):
        place = 3.0 * place / np.linalg.norm(place)
        patch = new_record(SURFACE_PATCH)
        fit_patch(surface, patch, nearest_sample(surface, place), tuple(place))
        beside = place + 0.2 * np.cross(place / 3.0, [0.6, 0.0, 0.8])
        for p in (place, beside):
            expected = p / np.linalg.norm(p)
            assert np.array(patch_normal(patch, tuple(p))) @ expected > np.cos(np.radians(2))


@pytest.mark.kernels
def test_a_patch_is_fitted_where_the_place_is_not_where_its_sample_is() -> None:
    """The foot depends on the place alone: the sample from which it is looked for only tells the sheet."""
    surface = samples_of(ball(3.0, 1500)).surface
    start = nearest_sample(surface, (0.0, 0.0, 3.1))
    for angle in np.linspace(0, 2.5, 26):
        place = 3.1 * np.array([np.sin(angle), 0, np.cos(angle)])
        foot = foot_of(surface, place, start)
        assert np.linalg.norm(foot) == pytest.approx(3.0, abs=0.01)
        assert foot == pytest.approx(place * 3.0 / 3.1, abs=0.03)


@pytest.mark.parametrize("share", [0.02, 0.06])
def test_outliers_are_ignored(share: float) -> None:
    """Points over the sheet (plants, noise) hardly move it: what the least squares alone would be moved by is share * height."""
    rng = np.random.default_rng(1)
    points = sheet(10, 10, 0.08)
    lifted = rng.random(len(points)) < share
    points[lifted, 2] += rng.uniform(0.3, 0.6, lifted.sum())
    surface = samples_of(points).surface
    heights = np.array([foot_of(surface, p)[2] for p in inner_places(rng, 10.0, 60) * [1, 1, 0]])
    assert abs(heights).mean() < 0.3 * share * 0.45


@pytest.mark.kernels
def test_walking_and_feet_stay_on_their_sheet() -> None:
    """Of two plates 0.7 members apart, each keeps its own, wherever between them the place is."""
    lower = sheet(4, 4, 0.125)
    surface = samples_of(np.concatenate([lower, lower[:, [1, 0, 2]] + [0, 0, 0.7]])).surface
    middle = surface.mean[:, 2].mean()
    for start in np.flatnonzero(surface.mean[:, 2] < middle)[::17]:
        end = walk(surface, int(start), (0.5, -0.5, 0.6))
        assert surface.mean[end, 2] < middle
        assert foot_of(surface, (0.5, -0.5, 0.5), int(start)) == pytest.approx([0.5, -0.5, 0.0], abs=1e-8)


@pytest.mark.kernels
@given(st.integers(0, 1000))
@settings(max_examples=8)
def test_walking_ends_where_no_neighbour_is_nearer(seed: int) -> None:
    surface = small_ball()
    rng = np.random.default_rng(seed)
    place = rng.normal(size=3)
    place *= 2.0 / np.linalg.norm(place)
    end = walk(surface, int(rng.integers(len(surface.mean))), tuple(place))
    assert end == nearest_sample(surface, place)  # a ball has no dead ends


@pytest.mark.kernels
@given(st.integers(0, 1000), st.floats(0.1, 3.0))
@settings(max_examples=8)
def test_a_flood_reaches_what_is_linked_within_reach(seed: int, reach: float) -> None:
    surface = small_ball()
    rng = np.random.default_rng(seed)
    sample = int(rng.integers(len(surface.mean)))
    place = surface.mean[sample] + 0.1 * rng.normal(size=3)
    count = flood(surface, sample, tuple(place), reach)
    found = surface.queue[:count].tolist()
    expected = naive.reachable(surface.neighbors, surface.mean, sample, place, reach)
    assert found[0] == sample and len(set(found)) == count
    assert set(found) == expected
    for other in rng.integers(len(surface.mean), size=5).tolist():
        assert linked(surface, sample, other, tuple(place), reach) == (other in expected)


@cache
def slit_sheet() -> Surface:
    """Sites of a sheet with a slit from its middle to one side: around its end there are links, across it none."""
    points = sheet(8.0, 8.0, 0.12)
    slit = (np.abs(points[:, 0]) < 0.9) & (points[:, 1] < 0.0)
    return samples_of(points[~slit]).surface


@pytest.mark.kernels
@pytest.mark.parametrize("reach", [1.2, 1.6, 2.5, 4.0])
def test_samples_on_both_sides_of_a_slit_are_linked_if_the_way_around_its_end_is_within_reach(reach: float) -> None:
    surface = slit_sheet()
    rng = np.random.default_rng(int(10 * reach))
    x, y = surface.mean[:, 0], surface.mean[:, 1]
    left, right = (np.flatnonzero((s * x > 0.9) & (s * x < 1.5) & (y < 0.0) & (y > -2.5)) for s in (-1.0, 1.0))
    found = []
    for a, b in zip(rng.choice(left, 40), rng.choice(right, 40), strict=True):
        place = 0.5 * (surface.mean[a] + surface.mean[b])
        expected = int(b) in naive.reachable(surface.neighbors, surface.mean, int(a), place, reach)
        assert linked(surface, int(a), int(b), tuple(place), reach) == expected
        found.append(expected)
    assert any(found) or reach < 2.0
    assert not all(found) or reach > 3.0
