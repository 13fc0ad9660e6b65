"""What is hidden in a picture: what lies behind is not seen, however near its middle is."""

import numpy as np
import pytest
from small_grids import make_grid
from test_picture import pixels

from scantruss.export.drawing.camera import choose_camera
from scantruss.export.drawing.depth import PIXELS_AT_ONCE, hidden_pairs, map_depth, raised_keys
from scantruss.export.drawing.picture import encode_picture
from scantruss.export.drawing.strokes import look
from scantruss.export.drawing.style import PictureStyle

WALL = [(0.0, 0.0, 0.0), (10.0, 0.0, 0.0), (10.0, 9.0, 8.0), (0.0, 9.0, 8.0)]  # it leans back


def light_outside(shown: np.ndarray) -> int:
    """Return how many pixels have the light blue of an outside."""
    return int(((shown[..., 2] > shown[..., 0] + 8) & (shown.sum(axis=2) > 330)).sum())


def test_what_lies_behind_a_wall_is_not_seen_though_its_middle_is_nearer() -> None:
    """Behind a wall, of which the inside was seen, the triangles of a tunnel were painted over it like teeth."""
    behind = [(2.0, 0.5, 0.3), (5.0, 0.5, 0.3), (3.5, 2.2, 1.8)]  # just behind its foot
    wall_only = make_grid(WALL, [(0, 2, 1), (0, 3, 2)]).replace(unit="m")
    both = make_grid([*WALL, *behind], [(0, 2, 1), (0, 3, 2), (4, 5, 6)]).replace(unit="m")
    style = PictureStyle(views=("front",))
    bare, full = (pixels(encode_picture(grid, caption=False, style=style)) for grid in (wall_only, both))
    before = make_grid([*WALL, *(np.array(behind) - [0, 1, 0])], [(0, 2, 1), (0, 3, 2), (4, 5, 6)]).replace(unit="m")
    assert light_outside(pixels(encode_picture(before, caption=False, style=style))) > 3000
    assert light_outside(full) <= light_outside(bare) + 20


def layers(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Return nodes and triangles of slanted sheets, one above the other, each with triangles of its own size."""
    rng = np.random.default_rng(seed)
    nodes: list[np.ndarray] = []
    triangles: list[np.ndarray] = []
    for level in range(4):
        count = int(rng.integers(1, 6))
        x, y = (axis.ravel() for axis in np.meshgrid(np.linspace(0, 10, count + 1), np.linspace(0, 10, count + 1)))
        first = np.array([(count + 1) * j + i for j in range(count) for i in range(count)]) + sum(map(len, nodes))
        quads = np.column_stack([first, first + 1, first + count + 2, first + count + 1])
        nodes.append(np.column_stack([x, y, 2.5 * x - 1.5 * y - 0.4 * level]) + [*rng.uniform(-2, 2, 2), 0.0])
        sheet = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
        triangles.append(sheet[:, ::-1] if rng.random() < 0.5 else sheet)
    return np.concatenate(nodes), np.concatenate(triangles)


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("name", ["auto", "behind", "top", "left"])
def test_each_pixel_shows_what_is_in_front(seed: int, name: str) -> None:
    nodes, triangles = layers(seed)
    camera = choose_camera(nodes, triangles, view=name).framed(nodes, (10.0, 10.0, 390.0, 290.0))
    view = look(nodes, triangles, camera, (400, 300))
    rank = np.argsort(np.argsort(view.key, kind="stable")).astype(float)
    _, painted = map_depth(view.corners / 2, np.repeat(rank[:, None], 3, axis=1), view.front.shape)
    near = camera.project(nodes)[1][triangles]
    wrong = painted != view.front
    for triangle, hidden in zip(painted[wrong].tolist(), view.nearest[wrong].tolist(), strict=True):
        assert hidden <= near[triangle].max() + 1e-9  # they meet along a side
    assert wrong.mean() < 0.01


def test_triangles_that_hide_each_other_in_a_ring_are_painted_all_the_same() -> None:
    ring = np.array([(0, 1), (1, 2), (2, 0)])
    raised = raised_keys(np.array([0.0, 1.0, 2.0, 9.0]), ring, 1e-9)
    assert raised == pytest.approx([2.0, 2.0, 2.0, 9.0], abs=1e-6)


def test_triangles_that_pass_through_each_other_hide_neither() -> None:
    corners = np.array([[(0, 0), (40, 0), (0, 40)]] * 2, float)
    near = np.array([(0.0, 1.0, 0.0), (0.5, 0.5, 0.5)])
    assert not len(hidden_pairs(corners, near, *map_depth(corners, near, (50, 50))))


def test_a_map_in_parts_is_that_of_the_whole() -> None:
    """Large triangles, of which one fills a part, and none."""
    side = int(2 * PIXELS_AT_ONCE**0.5)
    corners = np.array([[(0, 0), (side, 0), (0, side)]] * 3, float)
    near = np.array([(1.0, 1.0, 1.0), (3.0, 3.0, 3.0), (2.0, 2.0, 2.0)])
    nearest, triangle = map_depth(corners, near, (side, side))
    assert set(np.unique(triangle).tolist()) == {-1, 1} and nearest[0, 0] == 3.0
    assert hidden_pairs(corners, near, nearest, triangle).tolist() == [[0, 1], [2, 1]]
    nothing = map_depth(corners[:0], near[:0], (4, 4))
    assert not len(hidden_pairs(corners[:0], near[:0], *nothing))
