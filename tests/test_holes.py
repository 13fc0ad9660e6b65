"""Holes that are closed: the surface goes on smoothly where it is known what it was, and what is made up is told apart."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from marks import compiled_only
from small_clouds import ball, sheet, tire
from steps import boundary_of, steps_of
from threadpoolctl import threadpool_limits
from typed import known

import scantruss as st
from scantruss.boundary.holes import _lattice as lattice
from scantruss.boundary.holes import _thin_plate as thin_plate
from scantruss.boundary.holes import fill_holes
from scantruss.grid.certificate import LeftOut
from scantruss.report.figures import first_line, left_out_lines

RADIUS = 15 / (2 * np.pi)  # of a hole with a boundary of 15 members of length 1


def field(z: Callable[[np.ndarray, np.ndarray], np.ndarray], spacing: float = 0.16, noise: float = 0.002) -> np.ndarray:
    """Points of a surface z(x, y) over a square of 16 members."""
    points = sheet(16, 16, spacing)
    points[:, 2] = z(points[:, 0], points[:, 1])
    return points + noise * np.random.default_rng(1).normal(size=points.shape)


def wave(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return 3 * np.cos(x / 5) * np.cos(y / 6)


Opened = tuple[np.ndarray, tuple[float, float, float], Callable[[np.ndarray], np.ndarray], float]
SURFACES: dict[str, Opened] = {  # points, middle of the hole, distance from the true surface, largest in widths of the hole
    "sphere": (ball(6.0, 16_000, noise=0.002), (0, 0, 6), lambda p: np.linalg.norm(p, axis=1) - 6, 0.02),
    "dome": (field(wave), (1, 1, 3), lambda p: p[:, 2] - wave(p[:, 0], p[:, 1]), 0.02),
    "torus": (tire(8.0, 3.5, 0.18), (0, 8, 3.5), lambda p: np.hypot(np.hypot(p[:, 0], p[:, 1]) - 8, p[:, 2]) - 3.5, 0.04),
    "saddle": (field(lambda x, y: (x * x - y * y) / 14), (-1, 2, 0), lambda p: p[:, 2] - (p[:, 0] ** 2 - p[:, 1] ** 2) / 14, 0.03),
    "ridge": (field(lambda x, y: -0.5 * np.abs(x)), (0, 0, 0), lambda p: p[:, 2] + 0.5 * np.abs(p[:, 0]), 0.12),
}  # fmt: skip


def opened(name: str) -> tuple[np.ndarray, np.ndarray]:
    """Points of a surface with a hole, and its middle."""
    points, middle, _, _ = SURFACES[name]
    return points[np.linalg.norm(points - middle, axis=1) > RADIUS], np.array(middle, float)


@pytest.mark.parametrize("name", SURFACES)
def test_the_surface_goes_on_over_a_hole_of_fifteen_members(name: str) -> None:
    """Every made-up point lies near the true surface, there are points all over the hole, and none besides."""
    points, middle = opened(name)
    cloud, settings = st.PointCloud.from_array(points), st.Settings(length=1.0)
    holes = [
        p.points for p in boundary_of(cloud, settings).loops if np.linalg.norm(p.points[0] + cloud.origin - middle) < 4
    ]
    made_up = fill_holes(steps_of(cloud, settings).samples, holes) + cloud.origin
    _, _, distance, most = SURFACES[name]
    assert np.abs(distance(made_up)).max() < most * 2 * RADIUS
    assert np.linalg.norm(made_up - middle, axis=1).max() < 1.4 * RADIUS
    whole = SURFACES[name][0]
    lost = whole[np.linalg.norm(whole - middle, axis=1) < RADIUS]
    apart = np.linalg.norm(lost[:, None] - made_up, axis=2).min(axis=1)
    assert apart.max() < 0.3 + most * 2 * RADIUS


@compiled_only
@pytest.mark.parametrize(("name", "method"), [("sphere", "default"), ("torus", "paper"), ("saddle", "default")])
def test_a_closed_hole_is_covered_and_its_nodes_have_no_deviation(name: str, method: str) -> None:
    """The loop is gone; exactly the nodes over the hole are told apart, and they lie near the true surface."""
    points, middle = opened(name)
    _, _, distance, most = SURFACES[name]
    before = st.grid_from_points(points, st.Settings(length=1.0, method=method, effort="quick"))
    grid = st.grid_from_points(points, st.Settings(length=1.0, method=method, effort="quick", fill_holes=20.0))
    assert grid.topology.boundary_loops == before.topology.boundary_loops - 1
    assert grid.topology.euler == before.topology.euler + 1
    nodes = grid.nodes + grid.origin
    away, told = np.linalg.norm(nodes - middle, axis=1), np.isnan(known(grid.deviation))
    assert told[away < 0.8 * RADIUS].all() and not told[away > 1.3 * RADIUS].any()
    assert told.sum() > 12
    assert np.abs(distance(nodes[told])).max() < most * 2 * RADIUS
    assert grid.quality.node_deviation_max == np.nanmax(known(grid.deviation))


def test_a_hole_longer_than_asked_keeps_its_loop_and_what_is_around_stays() -> None:
    points, _ = opened("dome")
    cloud = st.PointCloud.from_array(points)
    kept, same = (steps_of(cloud, st.Settings(length=1.0, fill_holes=rim)) for rim in (14.0, None))
    closed = steps_of(cloud, st.Settings(length=1.0, fill_holes=17.0))
    assert len(kept.boundary.loops) == 2 and len(closed.boundary.loops) == 1
    for one, other in zip(kept.boundary.loops, same.boundary.loops, strict=True):
        assert np.array_equal(one.points, other.points)
    assert closed.samples.measured < len(closed.samples.surface.mean)
    assert kept.samples.measured == len(kept.samples.surface.mean)


def test_the_outer_rim_of_a_small_piece_is_no_hole() -> None:
    """A patch whose boundary is shorter than the holes that are closed stays what it is; a nearly closed ball closes."""
    patch = st.PointCloud.from_array(sheet(5, 5, 0.12))
    assert len(boundary_of(patch, st.Settings(length=1.0, fill_holes=30.0)).loops) == 1
    points, _ = opened("sphere")
    assert len(boundary_of(st.PointCloud.from_array(points), st.Settings(length=1.0, fill_holes=30.0)).loops) == 0


@pytest.mark.parametrize("reach", [40, 100])
def test_a_hole_around_a_bend_is_filled(reach: int) -> None:
    """On a tube: as the boundary leaves its plane the hole is drawn as a circle."""
    rng = np.random.default_rng(0)
    turn, z = rng.uniform(-np.pi, np.pi, 30_000), rng.uniform(-10, 10, 30_000)
    points = np.column_stack([3 * np.cos(turn), 3 * np.sin(turn), z])
    points = points[(turn / np.radians(reach)) ** 2 + (z / 3) ** 2 > 1]
    cloud = st.PointCloud.from_array(points)
    samples, boundary, _ = steps_of(cloud, st.Settings(length=1.0))
    hole = [loop.points for loop in boundary.loops if np.abs(loop.points[:, 2] + cloud.origin[2]).max() < 4]
    made_up = fill_holes(samples, hole) + cloud.origin
    off = np.abs(np.hypot(made_up[:, 0], made_up[:, 1]) - 3)
    assert len(hole) == 1
    assert off.max() < (0.03 if reach == 40 else 0.2) * 6
    assert np.abs(np.arctan2(made_up[:, 1], made_up[:, 0])).max() < np.radians(reach + 12)


def test_a_thin_plate_passes_through_its_places_and_keeps_what_is_straight() -> None:
    rng = np.random.default_rng(2)
    flat, values = rng.uniform(-3, 3, (30, 2)), rng.normal(size=(30, 3))
    assert thin_plate(flat, values, flat, 0.0) == pytest.approx(values, abs=1e-8)
    straight = np.array([[1.0, 2, 3], [0.5, 0, 1], [0, 2, -1]])
    wanted = rng.uniform(-2, 2, (50, 2))
    assert thin_plate(flat, np.column_stack([np.ones(30), flat]) @ straight, wanted, 0.1) == pytest.approx(
        np.column_stack([np.ones(50), wanted]) @ straight
    )


def test_a_filled_hole_is_the_same_to_the_byte_with_any_number_of_threads() -> None:
    rng = np.random.default_rng(8)
    flat, values, wanted = rng.uniform(-1, 1, (700, 2)), rng.normal(size=(700, 3)), rng.uniform(-1, 1, (900, 2))
    found = []
    for threads in (1, 2):
        with threadpool_limits(threads, user_api="blas"):
            found.append(thin_plate(flat, values, wanted, 1e-3).tobytes())
    assert found[0] == found[1]


def test_a_lattice_fills_a_polygon_and_keeps_off_its_rim() -> None:
    """Against the area of an L."""
    corners = np.array([(0, 0), (4, 0), (4, 2), (2, 2), (2, 4), (0, 4)], float)
    after = np.roll(corners, -1, axis=0)
    rim = (corners[:, None] + np.linspace(0, 1, 40, endpoint=False)[:, None] * (after - corners)[:, None]).reshape(
        -1, 2
    )
    places = lattice(rim, 0.1)
    assert len(places) * 0.1**2 * 0.75**0.5 == pytest.approx(12 - 16 * 0.05, rel=0.03)
    assert not ((places > 2).all(axis=1)).any() and places.min() > 0 and places.max() < 4
    assert np.linalg.norm(places[:, None] - rim, axis=2).min() >= 0.05


def test_lengths_of_holes_that_are_none_are_refused() -> None:
    several: list[Any] = [-1.0, float("nan"), "wide"]
    for wrong in several:
        with pytest.raises(st.InputError, match="fill_holes"):
            st.Settings(length=1.0, fill_holes=wrong)


def holed(rng: np.random.Generator, holes: list[tuple[float, float, float]]) -> np.ndarray:
    """A plate of 24 x 18 with round holes of x, y, radius."""
    points = np.column_stack([rng.uniform(0, 24, 40_000), rng.uniform(0, 18, 40_000), np.zeros(40_000)])
    points[:, 2] = 0.01 * points[:, 0] ** 2
    away = [np.hypot(points[:, 0] - x, points[:, 1] - y) > radius for x, y, radius in holes]
    return points[np.logical_and.reduce(away)]


@pytest.mark.parametrize("method", ["default", "paper"])
def test_small_holes_that_are_bridged_are_listed_with_place_and_size(method: str) -> None:
    holes = [(6.0, 5.0, 0.52), (17.0, 12.0, 0.53)]
    settings = st.Settings(length=1.0, method=method, effort="quick")
    grid = st.grid_from_points(holed(np.random.default_rng(2), holes), settings)
    assert grid.topology.boundary_loops == 1
    closed = [part for part in known(grid.certificate).left_out if part.kind == "hole"]
    assert len(closed) == len(holes) and [part.number for part in closed] == [1, 1]
    for (x, y, radius), part in zip(sorted(holes), sorted(closed, key=lambda part: known(part.where)), strict=True):
        middle = known(part.where)
        assert np.hypot(middle[0] - x, middle[1] - y) < 0.2
        assert part.size == pytest.approx(2 * radius, abs=0.35)
    kept = st.grid_from_points(holed(np.random.default_rng(2), holes), settings.replace(length=0.7))
    assert kept.topology.boundary_loops == 3 and not known(kept.certificate).left_out


def test_of_many_small_holes_the_largest_are_listed_and_the_others_counted() -> None:
    holes = [(x, y, 0.54) for x in (3.0, 9.0, 15.0, 21.0) for y in (4.0, 9.0, 14.0)]
    grid = st.grid_from_points(holed(np.random.default_rng(3), holes), st.Settings(length=1.0, effort="quick"))
    certificate = known(grid.certificate)
    closed = [part for part in certificate.left_out if part.kind == "hole"]
    assert sum(part.number for part in closed) + grid.topology.boundary_loops - 1 == len(holes)
    assert len(closed) == 6 and (more := closed[-1].number) > 1
    said = [line for line in left_out_lines(certificate) if "hole" in line]
    assert said[0].startswith("hole closed, near (") and said[-1].startswith(f"{more} more holes closed, up to ")
    stray = replace(certificate, left_out=(LeftOut("outliers", 500, 0.02), *closed), points=25_000)
    (line,) = first_line(stray)  # a hole has no points that could be missing
    assert (
        line.startswith("2.0% of the scan, 500 of 25,000 points, is not in the grid: set aside as outliers")
        and "hole" not in line
    )


@compiled_only
def test_a_hole_that_was_asked_to_be_closed_is_not_warned_of_but_another_is() -> None:
    rng = np.random.default_rng(5)
    plate = np.column_stack([rng.uniform(-8, 8, (16_000, 2)), np.zeros(16_000)])
    for middle in ((-3.0, 0.0), (3.0, 1.0)):
        plate = plate[np.linalg.norm(plate[:, :2] - middle, axis=1) > 0.42]
    settings = st.Settings(length=1.0, effort="quick")

    def closed(settings: st.Settings) -> set[tuple[float, ...]]:
        found = known(st.grid_from_points(plate, settings).certificate)
        said = [warning for warning in found.warnings if warning.kind == "closed"]
        return {tuple(np.round(place[:2])) for fault in said for place in (fault.where, *fault.also) if place}

    assert closed(settings) == {(-3.0, 0.0), (3.0, 1.0)}
    assert closed(settings.replace(fill_at=[(3.42, 1.0, 0.0)])) == {(-3.0, 0.0)}
    assert closed(settings.replace(fill_at=[(3.42, 1.0, 0.0), (-3.0, 0.42, 0.0)])) == set()
