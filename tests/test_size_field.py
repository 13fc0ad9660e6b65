"""Length fields: graded, blended, by curvature; a constant one is one length, and members follow a varying one."""

import heapq
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as limits
from hypothesis import strategies as some
from marks import compiled_only
from rough import rough_disc
from small_clouds import ball, cap, ring, samples_of, sheet
from steps import boundary_of
from typed import known, xyz

import scantruss as st
from scantruss.boundary.find import characteristic_points
from scantruss.improve.equalize import new_scratch
from scantruss.kernels.geometry.boxes import new_boxes
from scantruss.kernels.mesh.equalize import star_energy
from scantruss.kernels.mesh.trial import total_energy
from scantruss.kernels.surface import size_field as kernels
from scantruss.kernels.surface.local_surface import Surface
from scantruss.settings import Settings
from scantruss.surface.size_field import LARGEST_RATIO, measured_bends


def tube(radius: float, height: float, spacing: float) -> np.ndarray:
    """Points of a cylinder around z, open at both ends."""
    flat = sheet(2 * np.pi * radius, height, spacing)
    turn = flat[:, 0] / radius
    return np.stack([radius * np.cos(turn), radius * np.sin(turn), flat[:, 1]], axis=1)


def rows_of(
    points: np.ndarray, length: Callable[[np.ndarray], float], count: int = 50
) -> tuple[tuple[float, float, float, float], ...]:
    """Lengths given at some of the points, by a function of places."""
    chosen = points[:: max(len(points) // count, 1)]
    return tuple((*place, float(length(place))) for place in chosen.tolist())


def across(points: np.ndarray, low: float, high: float) -> Callable[[np.ndarray], float]:
    """A length that grows along x from low to high over the points."""
    left, size = points[:, 0].min(), np.ptp(points[:, 0])
    return lambda place: low + (high - low) * (place[0] - left) / size


def field_of(points: np.ndarray, **settings: Any) -> tuple[np.ndarray, Surface]:
    """The desired lengths at the samples of a cloud [scan unit], and the surface."""
    samples = samples_of(points, settings.pop("length", 0.0), **settings)
    return samples.surface.length * samples.surface.field, samples.surface


def targets(grid: st.Grid) -> np.ndarray:
    """Desired length of each member."""
    return known(grid.desired)[grid.edges].mean(axis=1)


def steepest(grid: st.Grid) -> float:
    """Largest ratio of the lengths desired for two members that meet."""
    low, high = np.full(len(grid.nodes), np.inf), np.zeros(len(grid.nodes))
    for end in grid.edges.T:
        np.minimum.at(low, end, targets(grid))
        np.maximum.at(high, end, targets(grid))
    return (high / low).max()


# ---- grading -------------------------------------------------------------------------------------------------------


def graded_slowly(mean: np.ndarray, neighbors: np.ndarray, lengths: np.ndarray, slope: float) -> np.ndarray:
    """The least of all lengths, each grown by its way over the links, by Dijkstra's search."""
    links: list[dict[int, float]] = [{} for _ in mean]
    for s, n in ((s, int(n)) for s, row in enumerate(neighbors) for n in row if n >= 0):
        links[s][n] = links[n][s] = slope * float(np.linalg.norm(mean[n] - mean[s]))
    found, heap = np.array(lengths), [(length, s) for s, length in enumerate(lengths)]
    heapq.heapify(heap)
    while heap:
        length, s = heapq.heappop(heap)
        if length <= found[s]:
            for n, way in links[s].items():
                if length + way < found[n]:
                    found[n] = length + way
                    heapq.heappush(heap, (found[n], n))
    return found


@pytest.mark.kernels
@limits(max_examples=20)
@given(some.integers(0, 1000), some.floats(0.01, 1.0))
def test_grading_is_the_least_of_all_lengths_grown_by_their_way(seed: int, slope: float) -> None:
    rng = np.random.default_rng(seed)
    mean = rng.normal(size=(40, 3))
    neighbors = rng.integers(-1, 40, (40, 4))
    neighbors.sort(axis=1)
    neighbors = np.ascontiguousarray(neighbors[:, ::-1])
    given_lengths = rng.uniform(0.5, 3.0, 40)
    lengths = given_lengths.copy()
    kernels.grade(mean, neighbors, lengths, slope)
    assert np.allclose(lengths, graded_slowly(mean, neighbors, given_lengths, slope), rtol=1e-12)
    again = lengths.copy()
    assert kernels.grade(mean, neighbors, again, slope) == 1 and np.array_equal(again, lengths)


def test_a_step_is_graded_to_both_sides_by_the_ratio() -> None:
    points = sheet(20.0, 4.0, 0.25)
    rows = rows_of(points, lambda place: 1.0 if place[0] < 0 else 3.0, 400)
    lengths, surface = field_of(points, length_field=rows)
    x = surface.mean[:, 0]
    assert lengths[x < -1.0].max() == 1.0 and lengths.max() > 2.0
    order = np.argsort(x)
    for place in np.arange(0.0, 8.0, 0.5):  # a member further on the length may have grown by the ratio
        here = np.interp(place, x[order], lengths[order])
        assert np.interp(place + here, x[order], lengths[order]) < LARGEST_RATIO * here


# ---- lengths given at places ---------------------------------------------------------------------------------------


@pytest.mark.kernels
@limits(max_examples=30)
@given(some.integers(0, 1000), some.sampled_from([1, 2, 5, 12, 13, 60]))
def test_a_blend_agrees_with_weights_written_down(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    given_places, values = rng.normal(size=(count, 3)), rng.uniform(1.0, 3.0, count)
    places = np.concatenate([rng.normal(size=(20, 3)), 30.0 + rng.normal(size=(2, 3))])
    boxes = new_boxes(given_places.min(axis=0) - 1.0, given_places.max(axis=0) + 1.0, 0.7, count, count)
    lengths = np.empty(len(places))
    kernels.blend_lengths(places, given_places, values, boxes, 0.3, lengths)
    for place, length in zip(places, lengths, strict=True):
        away = np.linalg.norm(given_places - place, axis=1)
        limit = np.sort(away)[kernels.BLENDED_LENGTHS] if count > kernels.BLENDED_LENGTHS else np.inf
        weight = np.where(away < limit, (1.0 / away - 1.0 / limit) ** 2, 0.0)
        assert length == pytest.approx((weight * values).sum() / weight.sum(), rel=1e-9)


def test_a_blend_keeps_given_lengths_and_has_no_steps() -> None:
    rng = np.random.default_rng(1)
    given_places, values = rng.uniform(-1.0, 1.0, (200, 3)), rng.uniform(1.0, 3.0, 200)
    way = np.linspace(0.0, 1.0, 4001)[:, None] * [1.9, 1.1, 1.3] - [0.95, 0.5, 0.6]
    for places, check in (
        (given_places, lambda f: np.allclose(f, values)),
        (way, lambda f: abs(np.diff(f)).max() < 0.02),
    ):
        boxes = new_boxes(np.full(3, -1.0), np.full(3, 1.0), 0.3, 200, 200)
        lengths = np.empty(len(places))
        kernels.blend_lengths(np.ascontiguousarray(places), given_places, values, boxes, 0.1, lengths)
        assert check(lengths)


def test_between_samples_a_length_is_that_of_the_samples_around() -> None:
    lengths, surface = field_of(
        points := sheet(12.0, 6.0, 0.25), length_field=rows_of(points, across(points, 1.0, 2.0), 300)
    )
    rng = np.random.default_rng(0)
    for x, y in rng.uniform([-5.0, -2.5], [5.0, 2.5], (50, 2)).tolist():
        found = kernels.length_at(surface, 0, (x, y, 0.0))
        assert found == pytest.approx(across(points, 1.0, 2.0)(np.array([x, y])), rel=0.02)
    ones = surface._replace(field=np.full_like(lengths, 1.0))
    assert kernels.length_at(ones, 0, (0.3, 0.2, 0.0)) == 1.0


# ---- lengths by curvature ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("points", "curvature"), [(ball(5.0, 8000), 1 / 5), (tube(4.0, 12.0, 0.2), 1 / 4)])
def test_the_curvature_of_a_ball_and_a_tube_is_one_over_the_radius(points: np.ndarray, curvature: float) -> None:
    bends = measured_bends(samples_of(points, 1.0).surface)
    assert np.abs(bends / curvature - 1.0).max() < 0.1 and np.median(bends) == pytest.approx(curvature, rel=0.02)


@pytest.mark.parametrize("noise", [0.0, 0.002, 0.005, 0.01])
def test_noise_makes_a_surface_neither_flatter_nor_rounder(noise: float) -> None:
    """A saddle z = xy / 36 with the curvature 1 / 36 nearly everywhere; noise of 10 mm makes sagittas of 36 m in narrow patches."""
    rng = np.random.default_rng(4)
    x, y = rng.uniform([-12.0, -9.0], [12.0, 9.0], (60_000, 2)).T
    bends = measured_bends(
        samples_of(np.stack([x, y, x * y / 36.0 + rng.normal(0.0, noise, len(x))], axis=1), 1.0).surface
    )
    assert np.median(bends) == pytest.approx(1.0 / 37.5, rel=0.1) and np.quantile(bends, 0.95) < 1.15 / 36.0


@pytest.mark.parametrize("points", [ball(5.0, 8000, noise=0.01), tube(4.0, 12.0, 0.2)])
def test_what_bends_alike_gets_one_length(points: np.ndarray) -> None:
    lengths, _ = field_of(points, length_field="curvature:1:3")
    assert lengths.max() < 1.12 and np.median(lengths) < 1.03


@pytest.mark.parametrize("noise", [0.0, 0.01, 0.03])
def test_a_plate_gets_the_longest_length_whatever_its_noise(noise: float) -> None:
    lengths, _ = field_of(sheet(12.0, 10.0, 0.2, noise=noise, seed=3), length_field="curvature:1:2")
    assert lengths.min() > 1.9 and np.median(lengths) == pytest.approx(2.0)


def test_members_over_a_bowl_bulge_alike_where_they_are_not_cut_off() -> None:
    """Curvature of z = r^2 / 2a along a meridian: 1 / (a (1 + r^2 / a^2)^1.5), the larger one near the middle."""
    flat = ring(0.0, 8.0, 0.2)
    r2 = (flat[:, :2] ** 2).sum(axis=1)
    points = flat + np.stack([0 * r2, 0 * r2, r2 / 8.0], axis=1)
    lengths, surface = field_of(points, length_field="curvature:0.8:4")
    r = np.hypot(*surface.mean[:, :2].T)
    parallel = 1.0 / (4.0 * np.sqrt(1.0 + r**2 / 16.0))  # the larger of both principal curvatures
    inside = (r < 6.5) & (lengths > 0.85)
    bulge = lengths[inside] ** 2 * parallel[inside] / 8.0
    assert inside.sum() > 500 and bulge.std() / bulge.mean() < 0.06


# ---- the energy ----------------------------------------------------------------------------------------------------


def test_the_energy_goes_by_the_lengths_desired_at_both_ends() -> None:
    rough = rough_disc()
    mesh = rough.mesh()
    net, length = mesh.net, rough.settings.length
    net.desired[:] = np.random.default_rng(0).uniform(0.7, 1.5, len(net.desired))
    grid = rough.grid.replace(desired=length * net.desired[: len(rough.grid.nodes)])
    stretch = grid.stretches(length)
    plain = total_energy(net, mesh.patches, new_scratch(mesh), length, 0.0)[0]
    energy, mean, _ = total_energy(net, mesh.patches, new_scratch(mesh), length, 1.7)
    assert energy - plain == pytest.approx(1.7 * ((stretch - 1.0) ** 2).sum())
    assert mean == pytest.approx(length * stretch.mean())
    for v in range(0, len(grid.nodes), 7):
        place = net.nodes[v].copy()
        slope = np.array(star_energy(net, mesh.patches, v, *xyz(place), length, 1.7, True)[1:])
        for c in range(3):
            step = np.eye(3)[c] * 1e-6
            up = star_energy(net, mesh.patches, v, *xyz(place + step), length, 1.7, False)[0]
            down = star_energy(net, mesh.patches, v, *xyz(place - step), length, 1.7, False)[0]
            assert slope[c] == pytest.approx((up - down) / 2e-6, abs=1e-4 / length)


# ---- the boundary --------------------------------------------------------------------------------------------------


def test_boundary_nodes_are_equally_far_apart_in_desired_lengths() -> None:
    points = sheet(12.0, 6.0, 0.2)
    settings = Settings(length_field=rows_of(points, across(points, 0.8, 2.0), 300))
    (loop,) = boundary_of(st.PointCloud.from_array(points), settings).loops
    nodes, is_corner = characteristic_points(loop, settings.length)
    assert is_corner.sum() == 4
    sides = np.split(np.arange(len(nodes) + 1), np.flatnonzero(is_corner)[1:])
    for i, side in enumerate(sides):
        ids = np.append(side[side < len(nodes)], sides[i + 1][0] if i + 1 < len(sides) else 0)
        steps = []
        for a, b in zip(nodes[ids[:-1]], nodes[ids[1:]], strict=True):
            places = a + (b - a) * np.linspace(0.0, 1.0, 50)[:, None]
            desired = [across(points, 0.8, 2.0)(place) for place in places]
            steps.append(np.linalg.norm(b - a) * np.mean(1.0 / np.array(desired)))
        assert np.std(steps) / np.mean(steps) < 0.03 and abs(np.mean(steps) - 1.0) < 0.55 / len(steps)


def test_a_hole_is_judged_by_the_members_around_it() -> None:
    points = sheet(16.0, 8.0, 0.15, keep=lambda x, y: np.minimum(np.hypot(x + 5, y), np.hypot(x - 5, y)) > 0.75)
    settings = Settings(length_field=((-5, 0, 0, 0.9), (-2, 0, 0, 0.9), (3, 0, 0, 2.4), (5, 1, 0, 2.4), (7, 0, 0, 2.4)))
    grid = st.grid_from_points(points, settings)
    assert grid.topology.boundary_loops == 2  # the boundary, and the hole where members are short
    small = min(grid.boundary_loops, key=len)
    assert abs((grid.nodes[small] + grid.origin)[:, 0].mean() + 5.0) < 0.3


# ---- whole grids ---------------------------------------------------------------------------------------------------


@compiled_only
@pytest.mark.parametrize("method", ["default", "paper"])
def test_a_constant_field_is_one_length_to_the_byte(method: str) -> None:
    points = cap(6.0, 1.0, 0.25)
    plain = st.grid_from_points(points, Settings(length=1.2, method=method))
    for field in (rows_of(points, lambda _: 1.2), "curvature:1.2:1.2"):
        grid = st.grid_from_points(points, Settings(length_field=field, method=method))
        assert grid.nodes.tobytes() == plain.nodes.tobytes()
        assert grid.triangles.tobytes() == plain.triangles.tobytes()
        assert grid.desired is None and grid.quality == plain.quality


@compiled_only
@pytest.mark.parametrize("method", ["default", "paper"])
@pytest.mark.parametrize("shape", ["dome", "ball"])
def test_members_have_the_lengths_that_are_desired_there(method: str, shape: str) -> None:
    points = cap(9.0, 1.0, 0.2) if shape == "dome" else ball(6.0, 12000, noise=0.01)
    settings = Settings(length_field=rows_of(points, across(points, 0.8, 2.0)), method=method)
    grid = st.grid_from_points(points, settings)
    stretch, topology = grid.stretches(1.0), grid.topology
    assert topology.manifold and topology.orientable
    assert (topology.boundary_loops, topology.euler) == ((1, 1) if shape == "dome" else (0, 2))
    assert stretch.std() / stretch.mean() < (0.08 if method == "default" else 0.13)
    assert abs(stretch.mean() - 1.0) < (0.015 if method == "default" else 0.08)
    assert grid.quality.shape_mean > (0.98 if method == "default" else 0.97)
    assert grid.quality.stretch_cv == pytest.approx(stretch.std() / stretch.mean())
    assert steepest(grid) < LARGEST_RATIO
    wished = across(points, 0.8, 2.0)
    far_in = np.abs(grid.nodes[:, 0]) < 4.0  # a blend flattens towards the ends
    given_there = np.array([wished(place) for place in grid.nodes + grid.origin])
    assert np.abs(grid.desired / given_there - 1.0)[far_in].max() < 0.15


@compiled_only
def test_there_are_as_many_triangles_as_the_lengths_ask_for() -> None:
    points = sheet(24.0, 12.0, 0.25)
    grid = st.grid_from_points(points, Settings(length_field=rows_of(points, across(points, 0.9, 2.2), 200)))
    middles = grid.nodes[grid.triangles].mean(axis=1) + grid.origin
    for low, high in ((-12, -6), (-6, 0), (0, 6), (6, 12)):
        x = np.linspace(low, high, 200)
        asked = 12.0 * np.mean([1 / across(points, 0.9, 2.2)(np.array([p])) ** 2 for p in x]) * (high - low) / 0.433
        assert ((middles[:, 0] > low) & (middles[:, 0] <= high)).sum() == pytest.approx(asked, rel=0.12)


@compiled_only
def test_a_field_scales_with_the_scan_or_by_its_shortest_length() -> None:
    points = cap(6.0, 1.0, 0.25)
    rows = rows_of(points, across(points, 0.9, 1.8))
    grid = st.grid_from_points(points, Settings(length_field=rows))
    twice = st.grid_from_points(2.0 * points, Settings(length_field=(2.0 * np.array(rows)).tolist()))
    assert np.array_equal(twice.nodes + twice.origin, 2.0 * (grid.nodes + grid.origin))
    assert np.array_equal(twice.triangles, grid.triangles) and np.array_equal(
        known(twice.desired), 2.0 * known(grid.desired)
    )
    shortest = min(row[3] for row in rows)
    longer = st.grid_from_points(points, Settings(length=1.25 * shortest, length_field=rows))
    scaled = st.grid_from_points(points, Settings(length_field=[(*r[:3], 1.25 * r[3]) for r in rows]))
    assert known(longer.desired).mean() == pytest.approx(known(scaled.desired).mean(), rel=1e-3)
    assert len(longer.nodes) == pytest.approx(len(grid.nodes) / 1.25**2, rel=0.1)


@compiled_only
def test_fixed_nodes_are_in_place_and_best_takes_a_field() -> None:
    points = cap(9.0, 1.0, 0.25)
    places = ((4.0, 1.0, float(np.sqrt(81 - 17))), (-4.0, -2.0, float(np.sqrt(81 - 20))))
    field = rows_of(points, across(points, 0.9, 1.8))
    several: list[dict[str, Any]] = [{"effort": "best"}, {"method": "paper"}]
    for own in several:
        grid = st.grid_from_points(points, Settings(length_field=field, fixed=places, **own))
        found = (grid.nodes + grid.origin)[grid.fixed]
        assert len(found) == 2 and all(np.linalg.norm(found - p, axis=1).min() < 1e-12 for p in np.array(places))
        assert known(grid.quality.stretch_cv) < 0.14
