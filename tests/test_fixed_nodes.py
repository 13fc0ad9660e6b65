"""Fixed nodes: exactly in place, good triangles around them, refused in words where that is impossible."""

from collections.abc import Callable

import numpy as np
import pytest
from marks import compiled_only
from rough import Rough, rough_disc, rough_sphere, same_topology
from small_clouds import sheet
from steps import boundary_of, optimized

from scantruss import Grid, InputError, PointCloud, Settings, grid_from_points
from scantruss.boundary.find import find_boundary
from scantruss.constraints.find import find_constraints
from scantruss.constraints.fixed_nodes import check_fixed_positions
from scantruss.grid.marks import node_marks
from scantruss.surface.samples import sample_surface

MAKERS: dict[str, Callable[[], Rough]] = {
    "disc": rough_disc,
    "sphere": rough_sphere,
    "plate": lambda: rough_disc(corners=True),
}


@pytest.fixture(scope="module", params=sorted(MAKERS))
def scene(request: pytest.FixtureRequest) -> Rough:
    rough = MAKERS[request.param]()
    return rough


def angle_around(grid: Grid) -> float:
    """Smallest angle of the triangles at fixed nodes [degree]."""
    return grid.angles[grid.fixed[grid.triangles].any(axis=1)].min()


def spread_out(points: np.ndarray, count: int, gap: float, seed: int) -> np.ndarray:
    """Points of a cloud that keep a distance from each other."""
    rng = np.random.default_rng(seed)
    chosen: list[np.ndarray] = []
    while len(chosen) < count:
        place = points[rng.integers(len(points))]
        if all(np.linalg.norm(place - other) >= gap for other in chosen):
            chosen.append(place)
    return np.array(chosen)


@compiled_only
@pytest.mark.parametrize("method", ["default", "paper"])
@pytest.mark.parametrize("seed", range(2))
def test_ten_fixed_nodes_anywhere(scene: Rough, method: str, seed: int) -> None:
    rough = scene
    length = rough.settings.length
    places = spread_out(rough.cloud.points, 10, 1.3 * length, seed) + rough.cloud.origin
    grid = optimized(rough.grid, rough.cloud, rough.settings.replace(method=method), places)
    assert same_topology(rough.grid, grid)
    assert grid.fixed.sum() == 10
    found = grid.nodes[grid.fixed] + grid.origin
    for place in places:
        assert np.abs(found - place).max(axis=1).min() <= 1e-12
    assert angle_around(grid) > (25 if method == "default" else 12)
    assert grid.quality.shape_mean > (0.96 if method == "default" else 0.9)


@pytest.mark.parametrize("seed", range(3))
def test_two_fixed_nodes_half_a_member_apart(scene: Rough, seed: int) -> None:
    rough = scene
    points, length = rough.cloud.points, rough.settings.length
    rng = np.random.default_rng(seed)
    first = points[rng.integers(len(points))]
    distance = np.linalg.norm(points - first, axis=1)
    second = points[np.flatnonzero((distance > 0.5 * length) & (distance < 0.58 * length))[0]]
    places = np.stack([first, second]) + rough.cloud.origin
    grid = optimized(rough.grid, rough.cloud, rough.settings, places)
    assert same_topology(rough.grid, grid)
    assert grid.fixed.sum() == 2
    assert angle_around(grid) > 18


def test_positions_are_in_the_frame_of_the_scan() -> None:
    rough = rough_disc()
    far = rough.cloud.points + rough.cloud.origin + [5e5, 4e6, 100.0]
    from scantruss import PointCloud

    cloud = PointCloud.from_array(far)
    grid = rough.grid.replace(
        nodes=rough.grid.nodes + rough.cloud.origin + [5e5, 4e6, 100.0] - cloud.origin, origin=cloud.origin
    )
    place = far[17]
    done = optimized(grid, cloud, rough.settings, [place])
    assert np.abs(done.nodes[done.fixed] + done.origin - place).max() < 1e-8


def test_a_corner_may_be_fixed_and_stays_one_node() -> None:
    rough = rough_disc(corners=True)
    boundary = boundary_of(rough.cloud, rough.settings)
    nodes = rough.grid.nodes.copy()
    for corner in boundary.corners:
        nodes[np.linalg.norm(nodes - corner, axis=1).argmin()] = corner
    grid = rough.grid.replace(nodes=nodes)
    assert len(boundary.corners) == 4
    done = optimized(grid, rough.cloud, rough.settings, boundary.corners[:1] + rough.cloud.origin)
    assert done.fixed.sum() == 1 and same_topology(grid, done)
    assert np.array_equal(done.nodes[done.fixed][0], boundary.corners[0])


def test_settings_hold_the_positions_too() -> None:
    rough = rough_disc()
    place = (rough.cloud.points[5] + rough.cloud.origin).tolist()
    grid = optimized(rough.grid, rough.cloud, rough.settings.replace(fixed=(tuple(place),)))
    assert grid.nodes[grid.fixed] + grid.origin == pytest.approx(np.array([place]), abs=1e-12)


@compiled_only
def test_an_improved_grid_keeps_its_fixed_nodes_when_it_is_improved_again() -> None:
    rough = rough_disc()
    place = rough.cloud.points[5] + rough.cloud.origin
    once = optimized(rough.grid, rough.cloud, rough.settings, [place])
    again = optimized(once, rough.cloud, rough.settings, [place])
    assert again.fixed.sum() == 1
    assert np.array_equal(once.nodes[once.fixed], again.nodes[again.fixed])
    third = optimized(once, rough.cloud, rough.settings)
    assert np.array_equal(once.nodes[once.fixed], third.nodes[third.fixed])


@pytest.mark.parametrize(
    ("places", "words"),
    [
        ([(0, 0, 3.0)], r"\(0, 0, 3\) is 2\.6.* away from the scan; it must lie within half a member, 0\.11"),
        (
            [(0, 0, 0.4), (0.05, 0, 0.4)],
            r"\(0, 0, 0\.4\) and \(0\.05, 0, 0\.4\) are 0\.05 apart; they need half a member",
        ),
        ([(0, 0, 0.4), (0, 0, 0.4)], "are 0 apart"),
        ([(0, 0, np.nan)], "finite"),
        ([(0, 0)], "three finite coordinates"),
        ([("a", 0, 0)], "positions of three numbers"),
        ([(1.3, 0, 0)], "away from the scan"),
    ],
)
def test_positions_that_cannot_be_are_refused(places: list[tuple[float, float, float]], words: str) -> None:
    rough = rough_disc()
    with pytest.raises(InputError, match=words):
        optimized(rough.grid, rough.cloud, rough.settings, places)


def test_a_refusal_names_the_unit() -> None:
    rough = rough_disc()
    from dataclasses import replace

    with pytest.raises(InputError, match="mm away from the scan"):
        optimized(rough.grid, replace(rough.cloud, unit="mm"), Settings(length=0.22), [(9, 9, 9)])


def test_a_position_off_the_scan_comes_with_the_nearest_point() -> None:
    points = rough_disc(points=2000).cloud.points + [100.0, 200.0, 300.0]
    far = np.array([100.2, 200.1, 305.0])
    cloud, settings = PointCloud.from_array(points), Settings(length=0.3)
    with pytest.raises(InputError, match=r"; the nearest point is \(") as refused:
        check_fixed_positions([far.tolist()], sample_surface(cloud, settings), settings.length)
    named = np.array([float(word) for word in str(refused.value).rsplit("(", 1)[1].rstrip(")").split(",")])
    assert np.allclose(named, points[np.linalg.norm(points - far, axis=1).argmin()], atol=1e-6)


@compiled_only
@pytest.mark.parametrize(
    ("height", "words"), [(0.0, None), (0.2, "0.20 members, 0.2 m, off the scan, as its position is fixed")]
)
def test_a_fixed_node_off_the_scan_is_a_warning_with_its_mark(height: float, words: str | None) -> None:
    settings = Settings(length=1.0, unit="m", effort="quick", fixed=[(0.3, 0.2, height)])
    grid = grid_from_points(sheet(8.0, 6.0, 0.1), settings)
    assert grid.certificate is not None
    found = [warning for warning in grid.certificate.warnings if warning.kind == "fixed"]
    assert len(found) == (words is not None)
    if words is not None:
        (node,) = np.flatnonzero(grid.fixed)
        assert found[0].words == f"has its node {node_marks(grid)[node]} {words}"
        assert found[0].where == pytest.approx((0.3, 0.2, height))


@pytest.mark.parametrize("far", [0.0, 2683400.0])
@pytest.mark.parametrize("factor", [1000.0, 0.3048, 1 / 0.3048, 10.0])
def test_places_in_another_unit_are_told_of_with_the_nearest_point(factor: float, far: float) -> None:
    side = np.linspace(0.0, 24.0, 80)
    x, y = (each.ravel() for each in np.meshgrid(side, side))
    scan = np.column_stack([x + far, y + far, 6.0 + 0.02 * x * y])
    samples = sample_surface(PointCloud.from_array(scan, unit="m"), Settings(length=2.0, unit="m"))
    places = scan[[700, 3000, 6000]]
    with pytest.raises(InputError) as raised:
        check_fixed_positions(places * factor, samples, 2.0)
    said = str(raised.value)
    assert "the nearest point is (" in said
    assert f"times {1 / factor:.5g} all that are given lie at the scan: give them in the unit of the scan, m" in said
    settings = Settings(length=2.0, unit="m", fixed_lines=[(places * factor).tolist()])
    with pytest.raises(InputError, match=r"fixed line 1.*nearest point is .*times .* lie at the scan"):
        find_constraints(*find_boundary(samples, settings), settings)


def test_a_place_that_no_unit_brings_to_the_scan_is_not_suspected_of_one() -> None:
    side = np.linspace(-12.0, 12.0, 80)
    x, y = (each.ravel() for each in np.meshgrid(side, side))
    cloud = PointCloud.from_array(np.column_stack([x, y, 0.0 * x]))
    samples = sample_surface(cloud, Settings(length=2.0))
    with pytest.raises(InputError) as raised:
        check_fixed_positions([(0.0, 0.0, 9.0)], samples, 2.0)
    assert "times" not in str(raised.value)
