"""Mirror planes and rotations: found in scans, kept exactly by the grid, refused where there are none."""

from pathlib import Path

import numpy as np
import pytest
from marks import compiled_only
from scipy.spatial import cKDTree

import scantruss as st
from scantruss.cli.main import main
from scantruss.errors import FrontError, InputError
from scantruss.grid.panels import planarity_of
from scantruss.scan.rotation import check_half_turn, check_rotation, find_half_turn, find_rotation, turn_about
from scantruss.scan.symmetry import check_mirror_planes, find_mirror_planes, nearest_mirror_plane
from scantruss.schedules.joints import node_normals

LENGTH = 12.0  # of members of the vault, 100 long
HEXAGON_LENGTH = 7.0  # of members of its hexagons, of as many panels


def vault(turn: float = 0.0, size: tuple[float, float] = (100.0, 70.0), lean: float = 0.0) -> np.ndarray:
    """A shallow vault on a rectangle, its crown leaning to one side, turned about z and away from the origin."""
    x, y = (each.ravel() for each in np.meshgrid(np.linspace(-1, 1, 121), np.linspace(-1, 1, 85)))
    z = 30 * (1 - x**2) * (1 - 0.5 * y**2) + lean * (1 - x**2) * x
    c, s = np.cos(turn), np.sin(turn)
    places = np.stack([size[0] / 2 * x, size[1] / 2 * y, z], axis=1)
    return places @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) + [500.0, -200.0, 10.0]


def reflected(grid: st.Grid, row: tuple[float, ...]) -> np.ndarray:
    """The nodes of a grid on the other side of a plane."""
    normal = np.array(row[3:]) / np.linalg.norm(row[3:])
    places = grid.nodes + (grid.origin - np.array(row[:3]))
    return grid.nodes - 2 * np.outer(places @ normal, normal)


@pytest.mark.parametrize("turn", [0.0, 0.7])
def test_both_planes_of_a_vault_are_found_wherever_it_stands(turn: float) -> None:
    planes = find_mirror_planes(vault(turn), 0.5)
    along = np.array([[np.cos(turn), np.sin(turn), 0], [-np.sin(turn), np.cos(turn), 0]])
    assert len(planes) == 2
    for plane in planes:
        assert np.abs(along @ plane.normal).max() == pytest.approx(1, abs=1e-6) and plane.misfit < 0.1
        assert np.dot(np.subtract([500, -200, 10], plane.point), plane.normal) == pytest.approx(0, abs=0.02)
    assert np.dot(planes[0].normal, planes[1].normal) == pytest.approx(0, abs=1e-12)


def test_a_crown_that_leans_leaves_one_plane_and_a_given_one_is_checked() -> None:
    points = vault(lean=12.0)
    (plane,) = find_mirror_planes(points, 0.5)
    assert abs(plane.normal[1]) == pytest.approx(1, abs=1e-6)
    with pytest.raises(InputError, match="not symmetric in mirror plane 1: 95 % of it lie within"):
        check_mirror_planes(points, [(500, -200, 0, 1, 0, 0)], 0.5)
    with pytest.raises(InputError, match="meet in one line at equal angles"):
        check_mirror_planes(vault(), [(500, -200, 0, 0, 1, 0), (500, -200, 0, 1, 0.3, 0)], 50.0)


@pytest.mark.parametrize(("turn", "aside"), [(8.0, 0.0), (-12.0, 4.0), (0.0, 6.0)])
def test_a_plane_drawn_by_hand_means_the_mirror_plane_near_it(turn: float, aside: float) -> None:
    angle = np.radians(turn)
    meant = nearest_mirror_plane(vault(), (500.0 + aside, -200.0, 10.0, np.cos(angle), np.sin(angle), 0.0), 0.5)
    assert meant is not None and np.abs(np.array(meant.normal) - [1, 0, 0]).max() < 1e-3
    assert np.dot(np.subtract([500, -200, 10], meant.point), meant.normal) == pytest.approx(0, abs=0.02)


def test_a_plane_drawn_where_there_is_no_symmetry_means_none() -> None:
    aside = np.radians(40.0)
    assert nearest_mirror_plane(vault(), (500.0, -200.0, 10.0, np.cos(aside), np.sin(aside), 0.0), 0.5) is None


def test_a_scan_without_a_mirror_plane_is_refused() -> None:
    x, y = np.random.default_rng(2).random((2, 4000))
    points = np.stack([100 * x, 60 * y, 20 * x * y + 15 * np.sin(5 * x + 3 * y)], axis=1)
    with pytest.raises(InputError, match=r"no mirror plane within 0.5, a tenth of a member: the best leaves 95 %"):
        find_mirror_planes(points, 0.5)


@compiled_only
def test_a_hole_beside_the_plane_is_refused_and_not_mirrored() -> None:
    """So few points have no counterpart that the planes are found all the same."""
    points = vault()
    away = np.hypot(points[:, 0] - 505.0, points[:, 1] + 200.0)
    settings = st.Settings(
        length=LENGTH, symmetry=((500.0, -200.0, 0.0, 1.0, 0.0, 0.0),), effort="quick", fill_holes=0.0
    )
    with pytest.raises(FrontError, match="the boundary of the scan has no counterpart near") as refused:
        st.grid_from_points(points[away > 16.0], settings)
    assert refused.value.where is not None
    assert np.hypot(refused.value.where[0] - 505.0, refused.value.where[1] + 200.0) == pytest.approx(16.0, abs=3.0)
    closed = settings.replace(fill_at=((521.0, -200.0, 36.0),))
    assert st.grid_from_points(points[away > 16.0], closed).topology.boundary_loops == 1


@compiled_only
@pytest.mark.parametrize("lean", [0.0, 13.0])
@pytest.mark.parametrize("cells", ["triangle", "quad", "hexagon"])
def test_the_grid_is_its_own_image_to_rounding(lean: float, cells: str) -> None:
    length = LENGTH if cells != "hexagon" else HEXAGON_LENGTH
    settings = st.Settings(length=length, symmetry="auto", effort="quick", cells=cells)
    grid = st.grid_from_points(vault(0.3, lean=lean), settings)
    assert grid.certificate is not None and grid.certificate.passed and grid.settings is not None
    rows = grid.settings.symmetry
    assert len(rows) == (2 if lean == 0 else 1)
    members = {frozenset(pair) for pair in grid.edges.tolist()}
    exact = 1e-12 * 700
    for row in rows:
        assert not isinstance(row, str)
        apart, image = cKDTree(grid.nodes).query(reflected(grid, tuple(row)))
        assert apart.max() < exact and np.array_equal(image[image], np.arange(len(image)))
        assert {frozenset(image[list(pair)].tolist()) for pair in members} == members
        panels = {frozenset(panel) for panel in grid.panel_loops}
        assert {frozenset(image[list(panel)].tolist()) for panel in panels} == panels
        on = np.flatnonzero(image == np.arange(len(image)))
        if cells != "hexagon":
            assert sum(pair <= set(on.tolist()) for pair in members) >= len(on) - 1 >= 4  # rows of members on the plane
    distinct = len(np.unique(np.round(grid.lengths, 9)))
    assert distinct < (0.4 if lean == 0 else 0.65) * len(grid.lengths)
    made = st.schedule(grid.replace(unit="m"), st.ScheduleSettings(tube=100.0))
    assert None not in made.node_types["mirror image"]
    truss = st.Truss.from_grid(grid.replace(unit="m"), supports="boundary")
    for row in rows:
        assert not isinstance(row, str)
        image = cKDTree(grid.nodes).query(reflected(grid, tuple(row)))[1]
        across = np.array(row[3:]) / np.linalg.norm(row[3:])
        for found in (node_normals(grid), truss.node_normals):
            assert np.abs(found - 2 * np.outer(found @ across, across) - found[image]).max() < 1e-9
    assert cells != "triangle" or None not in made.panel_types["mirror image"]
    again = st.grid_from_points(vault(0.3, lean=lean), grid.settings)
    assert np.array_equal(again.nodes, grid.nodes) and np.array_equal(again.triangles, grid.triangles)


@compiled_only
def test_symmetric_hexagons_keep_corners_fixed_nodes_and_their_images_and_are_made_planar() -> None:
    points = vault(lean=12.0)
    corners = np.array([[x, y] for x in (450.0, 550.0) for y in (-235.0, -165.0)])
    place = points[np.hypot(points[:, 0] - 515.0, points[:, 1] + 185.0).argmin()]
    settings = st.Settings(length=HEXAGON_LENGTH, symmetry="auto", effort="quick", cells="hexagon")
    bent = st.grid_from_points(points, settings)
    flat = st.grid_from_points(points, settings.replace(planar=True, fixed=[tuple(place.tolist())]))
    for grid in (bent, flat):
        away = np.linalg.norm(grid.scan_nodes[:, None, :2] - corners, axis=2).min(axis=0)
        assert away.max() < 0.06 * HEXAGON_LENGTH
        assert grid.settings is not None and grid.settings.cells == "hexagon"
        assert not isinstance(grid.settings.symmetry, str)
        (row,) = grid.settings.symmetry
        apart, _ = cKDTree(grid.nodes).query(reflected(grid, tuple(row)))
        assert apart.max() < 1e-12 * 700
        assert not grid.line_sets  # the planes are no lines
    off = [planarity_of(grid.nodes, grid.panel_table).mean() for grid in (bent, flat)]
    assert off[1] < 0.8 * off[0]
    away = np.linalg.norm(flat.scan_nodes - place, axis=1)
    assert away.min() < 0.02 * HEXAGON_LENGTH and flat.fixed.sum() == 2


def test_a_fixed_line_without_its_image_is_refused() -> None:
    line = [(512.0, -215.0, 33.0), (532.0, -185.0, 22.0)]  # aslant over the middle
    points = vault()
    line = [tuple(points[np.linalg.norm(points[:, :2] - place[:2], axis=1).argmin()]) for place in line]
    with pytest.raises(FrontError, match="is not symmetric in the mirror planes, near"):
        st.grid_from_points(points, st.Settings(length=LENGTH, symmetry="auto", fixed_lines=[line], effort="quick"))


def test_the_command_takes_planes_of_a_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    np.savetxt("shell.xyz", vault())
    Path("planes.txt").write_text("# the long way\n500, -200, 0, 0, 1, 0\n")
    words = f"grid shell.xyz shell.json --length {LENGTH} --effort quick --symmetry"
    assert main([*words.split(), "planes.txt"]) == 0
    said = capsys.readouterr()
    assert "symmetric in 1 mirror plane, as point and normal: 500, -200, 0, 0, 1, 0" in said.out + said.err
    assert '"symmetry": [[500.0, -200.0, 0.0, 0.0, 1.0, 0.0]]' in " ".join(
        Path("shell.settings.json").read_text().split()
    ).replace("[ ", "[").replace(" ]", "]")
    for text, reason in (
        (
            "500,-200,0,0,0,1,2\n0,0,0,0,0,1,2",
            "the axis of the half turn must meet that of the rotation squarely",
        ),
        ("500,-200,0,0,0,1,2\n500,-200,0,1,0,0,3", "a rotation stands alone or before a half turn"),
        ("500,-200,0,0,0,1,2\n500,-200,40,1,0,0,2", "or the axis is no line of the surface"),
        ("500,-200,0,0,0,1,1", "a rotation needs a point, an axis and the parts of a turn, 2 to 12"),
        ("500,-200,0,0,0,1,3", "the scan is not the same when it is turned by 360/3 degrees about the axis"),
        ("500,-200,0", "line 1: a mirror plane needs six numbers"),
        ("0,0,0,0,0,0", "a mirror plane needs a point and a normal"),
        ("", "holds no mirror plane"),
        ("500,-200,0,1,1,0", "the scan is not symmetric in mirror plane 1"),
    ):
        Path("bad.txt").write_text(text)
        assert main([*words.replace("shell.json", "bad.json").split(), "bad.txt"]) == 2
        error = capsys.readouterr().err
        assert reason in error and error.count("\n") == 1 and not Path("bad.json").exists(), error


def test_a_surface_of_revolution_has_three_planes_at_60_degrees() -> None:
    radius, turn = (each.ravel() for each in np.meshgrid(np.sqrt(np.linspace(0.0, 1.0, 60)), np.linspace(0, 6.28, 160)))
    points = np.stack([10 * radius * np.cos(turn), 10 * radius * np.sin(turn), 3 * (1 - radius**2)], axis=1)
    planes = find_mirror_planes(points, 0.1)
    cosines = np.abs(np.array([plane.normal for plane in planes]) @ np.transpose([plane.normal for plane in planes]))
    assert len(planes) == 3 and cosines[np.triu_indices(3, 1)] == pytest.approx(0.5, abs=1e-12)


def pinwheel(blades: int = 3, turn: float = 0.0) -> np.ndarray:
    """A shell with as many waves as blades, each leaning the same way round, that has no mirror plane; away from the origin."""
    radius, angle = (
        each.ravel()
        for each in np.meshgrid(np.sqrt(np.linspace(0.0, 1.0, 110)), np.linspace(0, 2 * np.pi, 330, endpoint=False))
    )
    x = 50 * radius * np.cos(angle + turn)
    y = 50 * radius * np.sin(angle + turn)
    z = 14 * (1 - radius**2) + 5 * radius**2 * np.sin(blades * angle + 2.0 * radius)
    return np.stack([x, y, z], axis=1) + [300.0, 20.0, -5.0]


@pytest.mark.parametrize("blades", [2, 3, 5])
def test_the_rotation_of_a_pinwheel_is_found_wherever_it_stands(blades: int) -> None:
    tilt = turn_about(np.array([1.0, 0.0, 0.0]), 0.4)
    found = find_rotation(pinwheel(blades, 0.3) @ tilt.T, 0.5)
    assert found.order == blades and found.misfit < 0.1
    assert np.abs(tilt[:, 2] @ found.axis) == pytest.approx(1, abs=1e-5)
    off = np.cross(np.subtract(tilt @ [300.0, 20.0, -5.0], found.point), found.axis)
    assert np.linalg.norm(off) < 0.02
    again = check_rotation(pinwheel(blades, 0.3) @ tilt.T, found.row, 0.5)
    assert again.misfit == pytest.approx(found.misfit) and again.order == blades


def test_a_scan_without_a_rotation_is_refused() -> None:
    with pytest.raises(InputError, match=r"no rotation within 0.5, a tenth of a member.*; leave --symmetry out"):
        find_rotation(vault(lean=12.0), 0.5)


def test_turning_about_an_axis_keeps_it_and_adds_up() -> None:
    axis = np.array([2.0, -1.0, 2.0]) / 3.0
    part = turn_about(axis, 2 * np.pi / 7)
    assert part @ axis == pytest.approx(axis) and np.linalg.det(part) == pytest.approx(1)
    assert np.linalg.matrix_power(part, 7) == pytest.approx(np.eye(3))


@compiled_only
@pytest.mark.parametrize("cells", ["triangle", "quad", "hexagon"])
def test_the_grid_of_a_pinwheel_is_itself_when_turned(cells: str) -> None:
    length = LENGTH if cells != "hexagon" else HEXAGON_LENGTH
    grid = st.grid_from_points(pinwheel(), st.Settings(length=length, symmetry="auto", effort="quick", cells=cells))
    assert grid.cells == cells and grid.topology.manifold and grid.topology.orientable
    assert grid.certificate is not None and grid.certificate.passed and grid.settings is not None
    assert not isinstance(grid.settings.symmetry, str)
    (row,) = grid.settings.symmetry
    assert row[6] == 3
    turn = turn_about(np.array(row[3:6]), 2 * np.pi / 3)
    centre = np.array(row[:3]) - grid.origin
    apart, image = cKDTree(grid.nodes).query((grid.nodes - centre) @ turn.T + centre)
    assert apart.max() < 1e-12 * 400 and len(np.unique(image)) == len(image)
    members = {frozenset(pair) for pair in grid.edges.tolist()}
    assert {frozenset(image[list(pair)].tolist()) for pair in members} == members
    assert len(np.unique(np.round(grid.lengths, 9))) <= len(grid.lengths) / 3 + 1
    assert len(grid.lines) == 0 and not grid.line_sets  # the seams are no lines
    again = st.grid_from_points(pinwheel(), grid.settings)
    assert np.array_equal(again.nodes, grid.nodes) and np.array_equal(again.triangles, grid.triangles)


TILT = turn_about(np.array([0.6, 0.8, 0.0]), 0.3)
CENTRE = np.array([40.0, -7.0, 3.0])


def hypar(twist: float = 0.0) -> np.ndarray:
    """A saddle over a square of 20 whose edges and middle lines are straight, tilted; twisted it keeps the rotation alone."""
    u, v = (each.ravel() for each in np.meshgrid(np.linspace(-10, 10, 90), np.linspace(-10, 10, 90)))
    z = 0.03 * u * v + twist * (u**2 + v**2)
    return np.stack([u, v, z], axis=1) @ TILT.T + CENTRE


def test_half_turns_about_the_straight_lines_of_a_saddle_are_found() -> None:
    rotation = find_rotation(hypar(), 0.1)
    found = find_half_turn(hypar(), rotation, 0.1)
    assert rotation.order == 2 and found is not None and found.order == 2 and found.misfit < 0.02
    u, v = np.abs(TILT.T @ found.axis)[:2]
    assert max(u, v) == pytest.approx(1, abs=1e-5) and abs(float(np.dot(found.axis, rotation.axis))) < 1e-12
    assert found.point == pytest.approx(CENTRE, abs=0.03)
    again = check_half_turn(hypar(), rotation, found.row, 0.1)
    assert again.axis == pytest.approx(found.axis, abs=1e-12)


def test_surfaces_without_straight_lines_have_no_half_turns() -> None:
    twisted = hypar(0.01)
    rotation = find_rotation(twisted, 0.1)
    assert find_half_turn(twisted, rotation, 0.1) is None
    with pytest.raises(InputError, match="when it is turned over about the axis of the half turn"):
        check_half_turn(twisted, rotation, (*rotation.point, *(TILT @ [1.0, 0.0, 0.0]), 2.0), 0.1)
    with pytest.raises(InputError, match="must meet that of the rotation squarely"):
        check_half_turn(hypar(), find_rotation(hypar(), 0.1), (*CENTRE, *(TILT @ [1.0, 0.0, 0.4]), 2.0), 0.1)
    ball = np.random.default_rng(4).normal(size=(40_000, 3)) * [1.0, 1.0, 1.2]
    ball /= np.linalg.norm(ball / [1.0, 1.0, 1.2], axis=1, keepdims=True)
    about = find_rotation(ball, 0.01)  # half a turn about an axis that pierces it leaves it as it is too
    assert find_half_turn(ball, about, 0.01) is None


@compiled_only
@pytest.mark.parametrize("cells", ["triangle", "quad", "hexagon"])
def test_a_saddle_is_of_four_parts_to_rounding(cells: str) -> None:
    length = {"triangle": 2.0, "quad": 2.0, "hexagon": 1.155}[cells]
    settings = st.Settings(length=length, symmetry="rotation", effort="quick", cells=cells)
    grid = st.grid_from_points(hypar(), settings)
    assert grid.certificate is not None and grid.certificate.passed and grid.settings is not None
    assert grid.topology.manifold and grid.topology.orientable and grid.cells == cells
    rows = grid.settings.symmetry
    assert not isinstance(rows, str) and [row[6] for row in rows] == [2.0, 2.0]
    members = {frozenset(pair) for pair in grid.edges.tolist()}
    panels = {frozenset(panel) for panel in grid.panel_loops}
    for row in rows:
        centre, turn = np.array(row[:3]) - grid.origin, turn_about(np.array(row[3:6]), np.pi)
        apart, image = cKDTree(grid.nodes).query((grid.nodes - centre) @ turn.T + centre)
        assert apart.max() < 1e-9 and len(np.unique(image)) == len(image)
        assert {frozenset(image[list(pair)].tolist()) for pair in members} == members
        assert {frozenset(image[list(panel)].tolist()) for panel in panels} == panels
    assert len(np.unique(np.round(grid.lengths, 7))) < 0.35 * len(grid.lengths)
    assert len(grid.lines) == 0 and not grid.line_sets
    again = st.grid_from_points(hypar(), grid.settings)
    assert np.array_equal(again.nodes, grid.nodes) and np.array_equal(again.triangles, grid.triangles)


def test_a_rotation_stands_alone_or_before_a_half_turn() -> None:
    rotation, half, plane = (0, 0, 0, 0, 0, 1, 3), (0, 0, 0, 1, 0, 0, 2), (0, 0, 0, 1, 0, 0)
    assert len(st.Settings(length=1.0, symmetry=[rotation, half]).symmetry) == 2
    for rows in ([half, rotation], [rotation, plane], [rotation, half, half]):
        with pytest.raises(InputError, match="a rotation stands alone or before a half turn"):
            st.Settings(length=1.0, symmetry=rows)
