"""Pictures: what is seen, from where, and the same bytes each time."""

import io

import numpy as np
import pytest
from PIL import Image
from small_grids import cloud_over, dome, fan, icosahedron, make_grid, two_pieces

import scantruss as st
from scantruss.export.drawing.camera import choose_camera, map_depth
from scantruss.export.drawing.picture import PANELS, SIZE, draw_panels, encode_picture
from scantruss.export.drawing.strokes import MARK, PAPER
from scantruss.export.solid import build_solid


def pixels(data):
    """Return a picture as (rows, columns, 3)."""
    return np.asarray(Image.open(io.BytesIO(data)).convert("RGB")).astype(int)


def has_colour(picture, colour):
    """Return how many pixels have a colour."""
    return int((np.abs(picture - np.round(np.array(colour) * 255)).max(axis=2) <= 2).sum())


@pytest.mark.parametrize("make", [fan, icosahedron, two_pieces, dome])
def test_picture_is_full_and_framed(make):
    grid = make()
    picture = pixels(encode_picture(grid, cloud_over(grid)))
    assert picture.shape == (SIZE[1], SIZE[0], 3)
    ink = np.abs(picture - np.round(PAPER * 255)).max(axis=2) > 40
    assert ink.mean() > 0.05
    assert not ink[:, :60].any() and not ink[:, -60:].any() and not ink[:50].any()


def test_picture_does_not_depend_on_what_was_drawn_before_or_on_the_users_settings():
    import matplotlib

    grid = dome()
    first = encode_picture(grid, cloud_over(grid))
    encode_picture(fan())
    with matplotlib.rc_context({"lines.linewidth": 9, "savefig.bbox": "tight", "font.size": 30, "text.color": "red"}):
        assert encode_picture(grid, cloud_over(grid)) == first


def test_picture_says_that_it_is_ours_and_nothing_of_when_it_was_made():
    said = Image.open(io.BytesIO(encode_picture(fan()))).info
    assert set(said) <= {"dpi", "Software"} and said["Software"] == f"ScanTruss {st.__version__}"


def test_fixed_nodes_are_marked():
    assert has_colour(pixels(encode_picture(dome())), MARK) == 0
    assert has_colour(pixels(encode_picture(dome(fixed=(70,)))), MARK) > 50


def test_the_scan_is_seen_where_the_grid_is_not():
    grid, whole = dome(), cloud_over(dome())
    part = grid.replace(triangles=grid.triangles[:150])
    with_scan, without = (pixels(encode_picture(part, cloud, caption=False)) for cloud in (whole, None))
    assert (np.abs(with_scan - without).max(axis=2) > 20).sum() > 1000


def test_a_far_origin_changes_nothing():
    grid, far = dome(), np.array([500000.0, 4500000.0, 128.0])
    near = encode_picture(grid, cloud_over(grid))
    assert encode_picture(grid.replace(origin=far), cloud_over(grid.replace(origin=far))) == near


def test_open_shells_are_seen_from_the_side_they_face():
    grid = dome()
    for turn in (np.eye(3), np.diag([1.0, -1.0, -1.0]), np.roll(np.eye(3), 1, axis=0)):
        camera = choose_camera(grid.nodes @ turn.T, grid.triangles)
        facing = turn @ [0, 0, 1]
        assert camera.back @ facing > 0.5 and camera.up @ facing > 0.5
        axes = np.stack([camera.right, camera.up, camera.back])
        assert np.allclose(axes @ axes.T, np.eye(3)) and np.linalg.det(axes) == pytest.approx(1)


def test_what_is_closed_and_long_stands_upright():
    ball = icosahedron()
    for axis in range(3):
        stretch = np.ones(3)
        stretch[axis] = 2.0
        assert choose_camera(ball.nodes * stretch, ball.triangles).up[axis] > 0.9


def test_framed_fills_the_box():
    grid = dome()
    camera = choose_camera(grid.nodes, grid.triangles).framed(grid.nodes, (10, 20, 110, 220))
    flat, _ = camera.project(grid.nodes)
    low, high = flat.min(axis=0), flat.max(axis=0)
    assert np.all(low >= np.array([10, 20]) - 1e-6) and np.all(high <= np.array([110, 220]) + 1e-6)
    assert np.allclose((low + high) / 2, [60, 120])
    assert np.isclose(high - low, [100, 200]).any()


def test_map_depth_equals_looking_at_each_pixel():
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


def test_panels_show_scan_grid_and_solid(tmp_path):
    grid = dome()
    solid = build_solid(grid, member_diameter=0.6, node_diameter=1.0, scale=3.0)
    for name in ("a.png", "b.png"):
        draw_panels(cloud_over(grid), grid, solid.vertices, solid.triangles, tmp_path / name)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    picture = pixels((tmp_path / "a.png").read_bytes())
    assert picture.shape == (PANELS[1], PANELS[0], 3)
    for panel in np.split(picture, 3, axis=1):
        assert (np.abs(panel - np.round(PAPER * 255)).max(axis=2) > 40).mean() > 0.01


def test_flat_and_empty_grids_are_drawn():
    assert len(encode_picture(make_grid([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)]))) > 1000
    assert len(encode_picture(make_grid([], []))) > 1000
