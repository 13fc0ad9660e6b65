"""Pictures: what is seen, from where, and the same bytes each time."""

import io
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike
from PIL import Image
from small_grids import cloud_over, dome, fan, icosahedron, make_grid, two_pieces
from typed import known, xyz

import scantruss as st
from scantruss.export.drawing.camera import choose_camera
from scantruss.export.drawing.depth import map_depth
from scantruss.export.drawing.left_out import LEFT_OUT_COLOUR, NO_GRID_COLOUR, OUT_OF_REACH_COLOUR, shown_points
from scantruss.export.drawing.legend import FAULT_COLOUR, places_marked, round_bar, scale_bar
from scantruss.export.drawing.picture import PANELS_SIZE, PICTURE_SIZE, draw_panels, encode_picture
from scantruss.export.drawing.sheet import PICTURE_OF_SHEET, encode_sheet
from scantruss.export.drawing.strokes import FIXED_NODE_COLOUR, PAPER_COLOUR, look
from scantruss.export.drawing.style import PictureStyle
from scantruss.export.solid import build_solid
from scantruss.grid.certificate import Certificate, Fault
from scantruss.grid.upward import facing_of, guessed_up, known_upward, likely_upward, picture_notes
from scantruss.structure.doubts import doubts_of_settings
from scantruss.structure.options import StructureSettings


def pixels(data: bytes) -> np.ndarray:
    """Return a picture as (rows, columns, 3)."""
    return np.asarray(Image.open(io.BytesIO(data)).convert("RGB")).astype(int)


def has_colour(picture: np.ndarray, colour: ArrayLike) -> int:
    """Return how many pixels have a colour."""
    return int((np.abs(picture - np.round(np.array(colour) * 255)).max(axis=2) <= 2).sum())


@pytest.mark.parametrize("make", [fan, icosahedron, two_pieces, dome])
def test_picture_is_full_and_framed(make: Callable[[], st.Grid]) -> None:
    grid = make()
    picture = pixels(encode_picture(grid, cloud_over(grid)))
    assert picture.shape == (PICTURE_SIZE[1], PICTURE_SIZE[0], 3)
    ink = np.abs(picture - np.round(PAPER_COLOUR * 255)).max(axis=2) > 40
    assert ink.mean() > 0.05
    assert not ink[:, :60].any() and not ink[:, -60:].any() and not ink[:50].any()


def test_picture_does_not_depend_on_what_was_drawn_before_or_on_the_users_settings() -> None:
    import matplotlib

    grid = dome()
    first = encode_picture(grid, cloud_over(grid))
    encode_picture(fan())
    with matplotlib.rc_context({"lines.linewidth": 9, "savefig.bbox": "tight", "font.size": 30, "text.color": "red"}):
        assert encode_picture(grid, cloud_over(grid)) == first


def test_picture_says_that_it_is_ours_and_nothing_of_when_it_was_made() -> None:
    said = Image.open(io.BytesIO(encode_picture(fan()))).info
    assert set(said) <= {"dpi", "Software"} and said["Software"] == f"ScanTruss {st.__version__}"


def test_fixed_nodes_are_marked() -> None:
    assert has_colour(pixels(encode_picture(dome())), FIXED_NODE_COLOUR) == 0
    assert has_colour(pixels(encode_picture(dome(fixed=(70,)))), FIXED_NODE_COLOUR) > 50


def test_the_scan_is_seen_where_the_grid_is_not() -> None:
    grid, whole = dome(), cloud_over(dome())
    part = grid.replace(triangles=grid.triangles[:150])
    with_scan, without = (pixels(encode_picture(part, cloud, caption=False)) for cloud in (whole, None))
    assert (np.abs(with_scan - without).max(axis=2) > 20).sum() > 1000


def test_a_far_origin_changes_nothing() -> None:
    grid, far = dome(), np.array([500000.0, 4500000.0, 128.0])
    near = encode_picture(grid, cloud_over(grid))
    assert encode_picture(grid.replace(origin=far), cloud_over(grid.replace(origin=far))) == near


def test_open_shells_are_seen_from_the_side_they_face_and_from_above_if_that_is_down() -> None:
    grid = dome()
    for turn in (np.eye(3), np.diag([1.0, -1.0, -1.0]), np.roll(np.eye(3), 1, axis=0)):
        camera = choose_camera(grid.nodes @ turn.T, grid.triangles)
        facing = np.abs(turn @ [0, 0, 1])
        assert camera.back @ facing > 0.5 and camera.up @ facing > 0.5
        axes = np.stack([camera.right, camera.up, camera.back])
        assert np.allclose(axes @ axes.T, np.eye(3)) and np.linalg.det(axes) == pytest.approx(1)


def test_a_shell_whose_triangles_look_down_is_seen_from_where_others_are() -> None:
    grid, up = dome(), np.array([0.0, 0.0, 1.0])
    usual, turned = (choose_camera(grid.nodes, t, up) for t in (grid.triangles, grid.triangles[:, ::-1]))
    assert turned.back[2] == pytest.approx(usual.back[2]) and turned.back[2] > 0.5 and turned.up[2] > 0.5


def test_what_is_closed_and_long_stands_upright() -> None:
    ball = icosahedron()
    for axis in (1, 2):
        stretch = np.ones(3)
        stretch[axis] = 2.0
        assert choose_camera(ball.nodes * stretch, ball.triangles).up[axis] > 0.9


def test_framed_fills_the_box() -> None:
    grid = dome()
    camera = choose_camera(grid.nodes, grid.triangles).framed(grid.nodes, (10, 20, 110, 220))
    flat, _ = camera.project(grid.nodes)
    low, high = flat.min(axis=0), flat.max(axis=0)
    assert np.all(low >= np.array([10, 20]) - 1e-6) and np.all(high <= np.array([110, 220]) + 1e-6)
    assert np.allclose((low + high) / 2, [60, 120])
    assert np.isclose(high - low, [100, 200]).any()


def test_map_depth_equals_looking_at_each_pixel() -> None:
    rng = np.random.default_rng(3)
    corners, near = rng.uniform(-5, 45, (30, 3, 2)), rng.normal(size=(30, 3))
    nearest, triangle = map_depth(corners, near, (30, 40))
    for row in range(30):
        for column in range(40):
            best, which = -np.inf, -1
            for t in range(30):
                rows = np.vstack([corners[t].T, np.ones(3)])
                share = np.linalg.solve(rows, [column, row, 1])
                if share.min() >= 0 and share @ near[t] > best:
                    best, which = share @ near[t], t
            assert triangle[row, column] == which
            assert nearest[row, column] == pytest.approx(best)


def test_the_inside_of_a_thin_wall_is_painted_behind_its_outside() -> None:
    places = np.array([(x + 0.5 * (y % 2), 0.9 * y, 0.0) for y in range(9) for x in range(9)])
    first = np.array([9 * y + x for y in range(8) for x in range(8)])
    sheet = np.concatenate(
        [np.column_stack([first, first + 1, first + 9]), np.column_stack([first + 1, first + 10, first + 9])]
    )
    nodes = np.concatenate(
        [places, places[:, [1, 0, 2]] + (0.3, 0.2, -0.25)]
    )  # a wall, its other side meshed another way
    triangles = np.concatenate([sheet, sheet + len(places)])
    camera = choose_camera(nodes, triangles, view="40,60").framed(nodes, (10.0, 10.0, 390.0, 390.0))
    view = look(nodes, triangles, camera, (400, 400))
    _, painted = map_depth(view.corners / 2, np.repeat(view.key[:, None], 3, axis=1), view.front.shape)
    seen = view.front >= 0
    assert seen.sum() > 5000 and not view.outside.all()
    assert (view.outside[painted[seen]] == view.outside[view.front[seen]]).all()


def test_panels_show_scan_grid_and_solid(tmp_path: Path) -> None:
    grid = dome()
    solid = build_solid(grid, member_diameter=0.6, node_diameter=1.0, scale=3.0)
    for name in ("a.png", "b.png"):
        draw_panels(cloud_over(grid), grid, solid.vertices, solid.triangles, tmp_path / name)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    picture = pixels((tmp_path / "a.png").read_bytes())
    assert picture.shape == (PANELS_SIZE[1], PANELS_SIZE[0], 3)
    for panel in np.split(picture, 3, axis=1):
        assert (np.abs(panel - np.round(PAPER_COLOUR * 255)).max(axis=2) > 40).mean() > 0.01


def test_flat_and_empty_grids_are_drawn() -> None:
    assert len(encode_picture(make_grid([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)]))) > 1000
    assert len(encode_picture(make_grid([], []))) > 1000


def test_what_the_grid_leaves_out_is_coloured_and_named_and_outliers_do_not_shrink_the_picture() -> None:
    points, grid = scan_and_grid()
    near = np.concatenate([points, [(0.0, 0.0, 60.0)] * 3 + [(1.0, 0.0, 60.0)] * 3])
    cloud = st.PointCloud.from_array(near)
    shown = shown_points(grid, cloud)
    kinds = {part.words.split(": ")[1] for part in shown.missed}
    assert any(word.startswith(("set aside as outliers", "farther than a member")) for word in kinds)
    total = len(shown.followed) + sum(len(part.points) for part in shown.missed)
    assert total == len(near)
    bare, full = (pixels(encode_picture(grid, c)) for c in (st.PointCloud.from_array(points), cloud))
    for colour in (OUT_OF_REACH_COLOUR, LEFT_OUT_COLOUR):
        assert has_colour(full, colour) >= has_colour(bare, colour)
    assert has_colour(full, OUT_OF_REACH_COLOUR) + has_colour(full, LEFT_OUT_COLOUR) > has_colour(
        bare, OUT_OF_REACH_COLOUR
    ) + has_colour(bare, LEFT_OUT_COLOUR)


def scan_and_grid() -> tuple[np.ndarray, st.Grid]:
    """A flat scan and the grid of its left half, made with settings that say so."""
    rng = np.random.default_rng(0)
    points = np.column_stack([rng.uniform(-10, 10, (4000, 2)), np.zeros(4000)])
    return points, st.grid_from_points(points, st.Settings(length=2.0, effort="quick"))


def test_scan_beyond_the_grid_is_red_and_inside_the_picture() -> None:
    points, grid = scan_and_grid()
    more = np.concatenate([points, points + [0, 25.0, 0]])
    part = grid.replace(origin=grid.origin)
    shown = shown_points(part, st.PointCloud.from_array(more))
    assert sum(len(p.points) for p in shown.missed if p.framed) > 3900
    picture = pixels(encode_picture(part, st.PointCloud.from_array(more)))
    assert has_colour(picture, OUT_OF_REACH_COLOUR) + has_colour(picture, NO_GRID_COLOUR) > 500


@pytest.mark.parametrize(
    ("view", "back", "up"),
    [
        ("top", (0, 0, 1), (0, 1, 0)),
        ("bottom", (0, 0, -1), (0, -1, 0)),
        ("front", (0, -1, 0), (0, 0, 1)),
        ("back", (0, 1, 0), (0, 0, 1)),
        ("left", (-1, 0, 0), (0, 0, 1)),
        ("right", (1, 0, 0), (0, 0, 1)),
        ("90,0", (1, 0, 0), (0, 0, 1)),
        ("0,30", (0, -np.sqrt(0.75), 0.5), (0, 0.5, np.sqrt(0.75))),
    ],
)
def test_views_look_from_where_their_names_say(view: str, back: Any, up: Any) -> None:
    grid = dome()
    camera = choose_camera(grid.nodes, grid.triangles, np.array([0.0, 0.0, 1.0]), view)
    assert np.allclose(camera.back, back, atol=1e-12)
    assert abs(np.linalg.det([camera.right, camera.up, camera.back]) - 1) < 1e-9
    if "bottom" not in view:
        assert np.allclose(camera.up, up, atol=1e-12)


def test_behind_is_the_other_side_of_auto() -> None:
    grid = dome()
    one, other = (choose_camera(grid.nodes, grid.triangles, view=view) for view in ("auto", "behind"))
    level = one.back - (one.back @ one.ground) * one.ground
    assert np.allclose(other.back - (other.back @ one.ground) * one.ground, -level)


def test_a_dome_without_a_unit_stands_on_its_opening_and_a_cup_on_its_foot() -> None:
    turn, high = np.meshgrid(np.linspace(0, 2 * np.pi, 24, endpoint=False), np.linspace(0, 3, 8))
    wide = 1.0 + 0.2 * high
    wall = np.column_stack([(wide * np.cos(turn)).ravel(), (wide * np.sin(turn)).ravel(), high.ravel()])
    foot = np.column_stack([np.cos(turn[0]), np.sin(turn[0]), np.zeros(24)]) * 0.5
    assert np.allclose(likely_upward(np.concatenate([wall, foot]), np.array([0.0, 0.0, -0.1])), [0, 0, 1])
    grid = dome()
    facing = facing_of(grid.nodes, grid.triangles)
    assert np.allclose(likely_upward(grid.nodes, facing), [0, 0, 1])


@pytest.mark.parametrize(
    ("extent", "axis"),
    [
        ((4, 1, 2), 2),
        ((4, 2, 1), 1),
        ((4, 3, 0.5), 2),
        ((1, 4, 1), 1),
        ((2, 2, 0.5), 2),
        ((0.5, 2, 2), 1),
        ((3, 1, 1), 1),
    ],
)
def test_a_body_without_a_flat_face_stands_along_y_or_z_never_along_x(extent: Any, axis: int) -> None:
    """An animal is longest from head to tail; a plate lies, also one that is long in x."""
    grid = icosahedron()
    nodes = grid.nodes * np.array(extent)
    assert int(np.abs(likely_upward(nodes, np.zeros(3))).argmax()) == axis


def turned_profile(radii: Any, heights: Any) -> np.ndarray:
    """Return points of a surface of revolution about z through rings of some radii at some heights, with flat ends between."""
    turn = np.linspace(0, 2 * np.pi, 36, endpoint=False)
    return np.concatenate(
        [
            np.column_stack([r * np.cos(turn), r * np.sin(turn), np.full(36, z)])
            for r, z in zip(radii, heights, strict=True)
        ]
    )


def on_four_legs() -> np.ndarray:
    """Return points of an animal with a long neck, four thin legs and flat flanks."""
    body = np.array([[x, y, z] for x in np.linspace(0, 6, 13) for y in (-1, 1) for z in np.linspace(6, 9, 7)])
    neck = np.array([[6 + z / 3, y, 9 + z] for z in np.linspace(0, 8, 9) for y in (-0.9, 0.9)])
    legs = np.array([[x, y, z] for x in (0.5, 5.5) for y in (-0.8, 0.8) for z in np.linspace(0, 6, 9)])
    return np.concatenate([body, neck, legs])


@pytest.mark.parametrize(
    ("nodes", "openness"),
    [
        (turned_profile(np.linspace(1.5, 1.2, 30), np.linspace(0, 12, 30)), 0.03),  # a column
        (turned_profile(np.sqrt(np.linspace(0, 1, 20)) * 3, np.linspace(0, 2.5, 20)), 0.43),  # a bowl with no foot
        (turned_profile([4, 4, 4.5, 3, 1.2, 1.2], [0, 8, 12, 15, 17, 20]), 0.0),  # a bottle
        (on_four_legs(), 0.0),
    ],
    ids=["column", "bowl", "bottle", "animal"],
)
@pytest.mark.parametrize("axis", [1, 2])
def test_what_has_unlike_ends_stands_on_one_of_them_with_y_or_z_up(nodes: Any, openness: float, axis: int) -> None:
    """Columns and animals lay on their sides, a bowl upside down."""
    facing = np.array([0.0, 0.0, -openness])
    turned, facing = np.roll(nodes, axis - 2, axis=1), np.roll(facing, axis - 2)
    assert np.array_equal(likely_upward(turned, facing), np.eye(3)[axis])


def test_a_flat_foot_counts_before_a_flat_back_and_small_feet_count() -> None:
    """An angel whose robe is open below lay on its face, as its wings are flat behind; an animal on small feet stood on its head."""
    robe = turned_profile([2.0, 1.0, 1.0], [0, 6, 7])
    head = [[0.0, 0.0, 8.0], [0.0, -2.1, 1.0]]
    wings = np.array([[x, 2.2, z] for x in (-5.0, -3.0, 3.0, 5.0) for z in (4.0, 7.0)])
    assert np.array_equal(likely_upward(np.concatenate([robe, head, wings]), np.zeros(3)), [0, 0, 1])
    body = icosahedron().nodes * [0.4, 0.9, 1.0]
    feet = np.array([[x, y, -14.0] for x in (-1.0, 1.0) for y in (-2.0, 3.0)])
    animal = np.concatenate([body, feet])
    animal[:, 2] *= 0.4
    assert np.array_equal(likely_upward(animal, np.zeros(3)), [0, 0, 1])


def test_an_apse_stands_on_its_foot_and_what_faces_no_axis_has_z_up() -> None:
    """Half a drum under a quarter of a sphere, open in front, lay on its back; a cave and a seat were drawn askew."""
    turn, high = (axis.ravel() for axis in np.meshgrid(np.linspace(0, np.pi, 19), np.linspace(-1.0, np.pi / 2, 19)))
    wide = np.where(high > 0, np.cos(high), 1.0)
    rise = np.where(high > 0, np.sin(high), high)
    apse = np.column_stack([wide * np.cos(turn), wide * np.sin(turn), rise])
    assert np.array_equal(likely_upward(apse, np.array([0.0, 0.71, 0.15])), [0, 0, 1])
    assert np.array_equal(likely_upward(dome().nodes, np.array([0.0, 0.5, -0.5])), [0, 0, 1])


def test_a_long_tube_lies_and_a_vase_with_ends_alike_stands() -> None:
    tube = turned_profile(np.ones(100), np.linspace(0, 60, 100))[:, [0, 2, 1]]
    assert np.array_equal(likely_upward(tube, np.zeros(3)), [0, 0, 1])
    vase = turned_profile(4 + np.sin(np.linspace(0, np.pi, 40)), np.linspace(0, 14, 40))[:, [0, 2, 1]]
    assert np.array_equal(likely_upward(vase, np.zeros(3)), [0, 1, 0])


def test_gravity_is_z_where_the_unit_or_the_file_tells() -> None:
    grid = dome()
    assert known_upward(grid, None) is None and known_upward(grid, cloud_over(grid)) is None
    assert np.array_equal(known(known_upward(grid.replace(unit="m"), None)), [0, 0, 1])
    tile = st.PointCloud.from_array(grid.nodes, name="tile.laz")
    assert np.array_equal(known(known_upward(grid, tile)), [0, 0, 1])


@pytest.mark.parametrize(("unit", "long", "up"), [("", 2, ""), ("", 1, "y"), ("mm", 0, "y"), ("m", 1, "")])
def test_pictures_of_a_grid_and_doubts_of_its_structure_agree_on_what_is_up(unit: str, long: int, up: str) -> None:
    """A body that stands along an axis of its file: where that is not z, its picture stands, its structure lies, and both say so."""
    body = icosahedron(unit=unit)
    body = body.replace(nodes=body.nodes * np.where(np.arange(3) == long, 2.0, 1.0))
    assert guessed_up(body) == up
    words = picture_notes(body) + doubts_of_settings(StructureSettings(), body)
    assert len(words) == 2 * bool(up) and all(f"{up} up" in each for each in words)
    assert doubts_of_settings(StructureSettings(), dome(unit="")) == []


@pytest.mark.parametrize("longest", [0.034, 0.99, 1.0, 3.7, 5.0, 780.0])
def test_a_scale_bar_is_round_and_as_long_as_it_says(longest: float) -> None:
    bar = round_bar(longest)
    assert bar <= longest < 2.5 * bar
    assert float(f"{bar:.0e}".split("e")[0]) in (1, 2, 5)
    grid = dome()
    camera = choose_camera(grid.nodes, grid.triangles).framed(grid.nodes, (0, 0, 800, 600))
    line, words = scale_bar(camera, 700, 30, 800, "m", 15)
    length = float(words.words.removesuffix(" m"))
    ends = np.stack([camera.middle, camera.middle + length * camera.right])
    assert np.ptp(line[:, 0]) == pytest.approx(np.ptp(camera.project(ends)[0][:, 0]), rel=1e-6)


def test_size_and_number_of_views_are_as_asked() -> None:
    grid = dome()
    assert pixels(encode_picture(grid, style=PictureStyle(size=(500, 300)))).shape == (300, 500, 3)
    both = pixels(encode_picture(grid, style=PictureStyle(views=("top", "front"))))
    assert both.shape == (PANELS_SIZE[1], PANELS_SIZE[0], 3)
    for half in np.split(both, 2, axis=1):
        assert (np.abs(half - np.round(PAPER_COLOUR * 255)).max(axis=2) > 40).mean() > 0.03
    for bad in ({"views": ("sideways",)}, {"views": ("10,95",)}, {"views": ()}, {"size": (10, 5000)}):
        with pytest.raises(st.InputError):
            PictureStyle(**bad)


def test_places_of_faults_and_warnings_are_marked_with_their_words() -> None:
    grid = dome()
    fault, warning = (
        Fault("angle", "has an angle of 3.0 degrees", (0.0, 0.0, 0.0)),
        Fault("far", "misses it", (1.0, 1.0, 0.0)),
    )
    nothing: dict[str, Any] = dict.fromkeys(
        ("reach", "pieces", "scan_pieces", "boundary_loops", "scan_loops", "euler", "handles"), 1
    )
    found = Certificate(unit="", manifold=True, orientable=True, **nothing, faults=(fault,), warnings=(warning,))
    assert [mark.words for mark in places_marked(grid.replace(certificate=found))] == [fault.words, warning.words]
    plain, marked = (pixels(encode_picture(g)) for g in (grid, grid.replace(certificate=found)))
    assert has_colour(marked, FAULT_COLOUR) > 20 + has_colour(plain, FAULT_COLOUR)


@pytest.mark.parametrize("make", [icosahedron, dome])
@pytest.mark.parametrize(
    "views, size", [(("auto",), PICTURE_SIZE), (("top", "front"), PANELS_SIZE), (("auto",), (600, 900))]
)
def test_the_legend_lies_beside_or_above_what_is_shown(
    make: Callable[[], st.Grid], views: tuple[str, ...], size: tuple[int, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """However many lines it has, no triangle, member or point lies where they are written."""
    grid = make()
    places = [xyz(node) for node in grid.nodes[:5]]
    faults = tuple(
        Fault("angle", f"has an angle of {k} degrees and more words", place) for k, place in enumerate(places)
    )
    found = replace(Certificate("", 1.0, True, True, 1, 1, 1, 1, 1, 0), faults=faults, warnings=faults)
    painted: list[tuple[Any, ...]] = []

    def paint(*given: Any) -> bytes:
        painted.append(given)
        return b""

    monkeypatch.setattr("scantruss.export.drawing.picture.paint", paint)
    encode_picture(grid.replace(certificate=found), cloud_over(grid), style=PictureStyle(views=views, size=size))
    (_, strokes, texts, _, _), *_ = painted
    lines = [text for text in texts if text.align == "left"]
    said = " ".join(text.words for text in lines)
    assert all(f"of {k} degrees" in said for k in range(5)) and ("up, guessed" in said) == bool(guessed_up(grid))
    assert len(lines) >= 21 + bool(guessed_up(grid))
    right = max(text.x + 0.62 * text.size * len(text.words) for text in lines)
    low, high = min(text.y for text in lines) - lines[0].size, max(text.y for text in lines) + lines[0].size
    for each in strokes[1:]:  # the first is the shadow
        x, y = each.shape.reshape(-1, 2).T
        assert not ((x < right) & (y > low) & (y < high)).any()


def test_a_grid_plots_itself_as_an_image() -> None:
    image = dome().plot(view=("top", "front"), size=(600, 400))
    assert image.size == (600, 400) and hasattr(image, "_repr_png_")


def test_more_places_of_a_fault_are_small_rings_of_its_colour() -> None:
    grid, cloud = dome(), cloud_over(dome())
    places = [xyz(grid.nodes[n] + grid.origin) for n in (3, 30, 60)]
    none = Certificate("", 1.0, True, True, 1, 1, 1, 1, 1, 0)
    counts = []
    for also in ((), tuple(places[1:])):
        fault = Fault("short", "has a member of 0.30 desired lengths", places[0], also)
        marked = grid.replace(certificate=replace(none, faults=(fault,)))
        counts.append(has_colour(pixels(encode_picture(marked, cloud)), FAULT_COLOUR))
    assert counts[1] > counts[0] + 30
    again = Certificate.from_dict(json.loads(json.dumps(known(marked.certificate).to_dict())))
    assert again.faults == known(marked.certificate).faults


def test_a_sheet_shows_all_of_each_picture() -> None:
    """Its title lies above it, its scale and caption are not cut off."""
    image, stream = np.full((1200, 1600, 3), 255, np.uint8), io.BytesIO()
    image[:20] = image[-20:] = image[:, :20] = image[:, -20:] = (255, 0, 0)
    Image.fromarray(image).save(stream, "PNG")
    sheet = np.asarray(Image.open(io.BytesIO(encode_sheet([("one", stream.getvalue())] * 3))).convert("RGB"), int)
    red = (np.abs(sheet - [255, 0, 0]) < 60).all(axis=2)
    wide, high = PICTURE_OF_SHEET
    for left in range(0, 3 * wide, wide):
        framed = red[-high:, left : left + wide]
        assert framed[[3, -4]].all() and framed[:, [3, -4]].all()
