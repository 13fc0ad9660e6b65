"""What is painted in a picture: shaded triangles, members, points, marks and shadows as a camera sees them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...grid.grid import Grid
from ...scan.cloud import PointCloud
from .camera import Camera
from .depth import hidden_pairs, map_depth, raised_keys

# by how much a triangle of which the inside is seen counts as farther back: behind the outside of a thin wall, never through it [sides]
INSIDE_BEHIND = 0.5
MEMBERS_BEFORE = 1e-9  # by how much members are painted before their triangles [distance of the eye]
MOST_POINTS = {True: 40_000, False: 120_000}  #: of the scan that are drawn, over a grid and alone
PAPER_COLOUR = np.array([0.984, 0.980, 0.969])  # background
GROUND_COLOUR = np.array([0.925, 0.918, 0.898])  # shadow on the ground
INK_COLOUR = np.array([0.098, 0.180, 0.290])  # members
BOUNDARY_COLOR = np.array([0.047, 0.098, 0.176])  # members on a boundary
OUTSIDE_SHADES = (
    np.array([0.345, 0.525, 0.620]),
    np.array([0.835, 0.925, 0.930]),
)  # triangles in the shade, in the light
INSIDE_SHADES = (np.array([0.560, 0.470, 0.390]), np.array([0.930, 0.870, 0.780]))  # seen from their other side
CLAY_COLOURS = (np.array([0.130, 0.165, 0.220]), np.array([0.640, 0.690, 0.720]))  # a scan
PRINT_COLOURS = (np.array([0.520, 0.170, 0.090]), np.array([0.990, 0.640, 0.420]))  # a printed model
FIXED_NODE_COLOUR = np.array([0.851, 0.290, 0.180])  # fixed nodes
COLOUR_BEHIND = 0.25  # how much of its colour is left to what lies behind the grid
COLOUR_BEFORE = 0.2  # the same of what was left out and lies between the eye and the grid, as a floor seen from below
COLOUR_THROUGH = 0.4  # the same of what is shown through the grid
MISSED_DOT = 3.0  # width of the dot of a point that is left out [pixel]
MOST_HIDDEN = 0.05  # share of the grid that they may hide before they are faint
PIXELS_OF_MAP = 4  # of the picture, in a pixel of the map of what is in front
LEAST_SEEN = 0.1  # share of some points below which they are shown through the grid that hides them


@dataclass(frozen=True, eq=False)
class Strokes:
    """Things to paint: filled triangles, lines and dots alike."""

    key: np.ndarray  #: (N,) what is smaller is painted first
    shape: np.ndarray  #: (N, 3, 2) corners [pixel]; a line repeats one, a dot is a very short line
    fill: np.ndarray  #: (N, 4) colour
    line: np.ndarray  #: (N, 4) colour
    width: np.ndarray  #: (N,) of the line [pixel]


@dataclass(frozen=True, eq=False)
class CameraView:
    """A surface as seen by a camera."""

    camera: Camera
    corners: np.ndarray  #: (T, 3, 2) [pixel]
    middle: np.ndarray  #: (T,) nearness of the middle of each triangle [scan unit]
    key: np.ndarray  #: (T,) the same, less where its inside is seen, raised above those of the triangles that it hides
    light: np.ndarray  #: (T,) how much light each gets, 0 to 1
    outside: np.ndarray  #: (T,) bool, whether its outside is seen
    depth: tuple[float, float]  #: nearness of the farthest and the nearest node [scan unit]
    nearest: np.ndarray  #: (rows, columns) nearness of what is in front at each pixel
    front: np.ndarray  #: (rows, columns) the triangle in front, -1 where none is

    def fade(self, near: np.ndarray) -> np.ndarray:
        """Return how far back things are, (N,) 0 in front to 1."""
        low, high = self.depth
        return np.clip((high - near) / max(high - low, 1e-300), 0, 1)


def look(
    nodes: np.ndarray, triangles: np.ndarray, camera: Camera, size: tuple[int, int], *, mapped: bool = True
) -> CameraView:
    """Return how a surface looks from a camera; the map of what is in front only if asked for."""
    flat, near = camera.project(nodes)
    corners, depth = flat[triangles], near[triangles]
    normal = _soft_normals(nodes, triangles)
    a, b, c = nodes[triangles.T]
    eye = camera.middle + camera.distance * camera.back
    outside = ((eye - a) * np.cross(b - a, c - a)).sum(axis=1) > 0
    normal = np.where(outside[:, None], normal, -normal)
    key_light = _unit(-0.55 * camera.right + 0.75 * camera.up + 0.65 * camera.back)
    fill_light = _unit(0.8 * camera.right + 0.1 * camera.up + 0.6 * camera.back)
    light = 0.16 + 0.70 * np.clip(normal @ key_light, 0, 1) + 0.22 * np.clip(normal @ fill_light, 0, 1)
    used = near[np.unique(triangles)]
    rows, columns = (size[1] // 2, size[0] // 2) if mapped else (0, 0)
    scale = camera.scale(depth)  # changes evenly across a triangle in the picture, as nearness does not
    largest, front = map_depth(corners / 2, scale, (rows, columns))
    nearest = np.where(front >= 0, camera.nearness(largest), -np.inf)
    span = (float(used.min()), float(used.max()))
    side = float(np.sqrt(((b - a) ** 2).sum(axis=1).mean()))
    middle = depth.mean(axis=1)
    key = middle - np.where(outside, 0.0, INSIDE_BEHIND * side)
    key = raised_keys(key, hidden_pairs(corners / 2, scale, largest, front), 2.0 * MEMBERS_BEFORE * camera.distance)
    return CameraView(camera, corners, middle, key, np.clip(light, 0, 1), outside, span, nearest, front)


def _unit(vector: np.ndarray) -> np.ndarray:
    """Return the vector with length 1."""
    unit: np.ndarray = vector / np.linalg.norm(vector)
    return unit


def _soft_normals(nodes: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return (T, 3) unit normals, halfway between flat triangles and a smooth surface."""
    a, b, c = nodes[triangles.T]
    normal = np.cross(b - a, c - a)
    at_node = np.zeros_like(nodes)
    for axis in range(3):
        at_node[:, axis] = np.bincount(triangles.ravel(), np.repeat(normal[:, axis], 3), len(nodes))
    smooth = at_node[triangles].sum(axis=1)
    return _rows_to_unit(_rows_to_unit(normal) + _rows_to_unit(smooth))


def _rows_to_unit(rows: np.ndarray) -> np.ndarray:
    """Return each row with length 1; zero rows stay zero."""
    length = np.linalg.norm(rows, axis=1, keepdims=True)
    unit: np.ndarray = np.divide(rows, length, out=np.zeros_like(rows), where=length > 0)
    return unit


def _mix(colours: tuple[np.ndarray, np.ndarray], share: np.ndarray, alpha: float = 1.0) -> np.ndarray:
    """Return (N, 4) colours between the first (share 0) and the second (share 1)."""
    share = share[:, None]
    return np.concatenate([(1 - share) * colours[0] + share * colours[1], np.full_like(share, alpha)], axis=1)


def _hazy(colour: np.ndarray, fade: np.ndarray, most: float) -> np.ndarray:
    """Return (N, 4) colours that go towards the paper by up to `most` far back."""
    colour = np.broadcast_to(np.concatenate([colour, [1.0]]) if colour.ndim == 1 else colour, (len(fade), 4)).copy()
    share = (most * fade)[:, None]
    colour[:, :3] = (1 - share) * colour[:, :3] + share * PAPER_COLOUR
    return colour


def _surface_strokes(
    view: CameraView, outside: tuple[np.ndarray, np.ndarray], inside: tuple[np.ndarray, np.ndarray]
) -> Strokes:
    """Return the shaded triangles of a view."""
    colour = np.where(view.outside[:, None], _mix(outside, view.light), _mix(inside, view.light))
    colour = _hazy(colour, view.fade(view.middle), 0.30)
    return Strokes(view.key, view.corners, colour, colour, np.full(len(colour), 0.6))


def fallen_shadow(nodes: np.ndarray, triangles: np.ndarray, camera: Camera) -> np.ndarray:
    """Return (V, 3) where the shadow of each node falls on the ground, just below the lowest node."""
    height = nodes @ camera.ground
    used = height[np.unique(triangles)]
    floor = float(used.min()) - 0.02 * float(np.ptp(used))
    across = float(np.ptp(nodes @ camera.right))
    slope = min(1.0, 0.6 * across / max(float(np.ptp(used)), 1e-300))  # tall objects cast shadows as short as flat ones
    sun = _unit(camera.ground + slope * (-0.30 * camera.right + 0.12 * np.cross(camera.ground, camera.right)))
    fallen: np.ndarray = nodes - ((height - floor) / (sun @ camera.ground))[:, None] * sun
    return fallen


def shadow_strokes(nodes: np.ndarray, triangles: np.ndarray, camera: Camera) -> Strokes:
    """Return the shadow that a surface casts on the ground below it."""
    shape = camera.project(fallen_shadow(nodes, triangles, camera))[0][triangles]
    colour = np.broadcast_to(np.concatenate([GROUND_COLOUR, [1.0]]), (len(shape), 4))
    return Strokes(np.full(len(shape), -np.inf), shape, colour, colour, np.full(len(shape), 0.8))


def framed(
    nodes: np.ndarray,
    triangles: np.ndarray,
    camera: Camera,
    box: tuple[float, float, float, float],
    more: np.ndarray | None = None,
) -> Camera:
    """Return the camera with a surface, its shadow and further points (N, 3) filling a box (left, bottom, right, top) [pixel]."""
    used = np.unique(triangles)
    shown = [nodes[used], fallen_shadow(nodes, triangles, camera)[used], *([] if more is None else [more])]
    everything = np.concatenate(shown)
    if more is not None and len(more):
        camera = camera.around(np.concatenate([nodes[used], more]))
    return camera.framed(everything, box)


def grid_strokes(grid: Grid, scan: np.ndarray | None, view: CameraView) -> list[Strokes]:
    """Return shadow, triangles, members, fixed nodes and, if given, the points of the scan (N, 3)."""
    strokes = [
        shadow_strokes(grid.nodes, grid.triangles, view.camera),
        _surface_strokes(view, OUTSIDE_SHADES, INSIDE_SHADES),
        _member_strokes(grid, view),
    ]
    if scan is not None:
        strokes.append(dot_strokes(scan, float(np.mean(grid.lengths)), view, over=True))
    if grid.fixed.any():
        strokes += _mark_strokes(grid, view)
    return strokes


def _member_strokes(grid: Grid, view: CameraView) -> Strokes:
    """Return the members as lines just in front of their triangles, those on a boundary or line bolder."""
    flat, near = view.camera.project(grid.nodes)
    ends = grid.edges
    pair = grid.edge_triangles
    boundary = pair[:, 1] < 0
    key = np.maximum(view.key[pair[:, 0]], view.key[np.where(boundary, pair[:, 0], pair[:, 1])])
    length = np.linalg.norm(flat[ends[:, 0]] - flat[ends[:, 1]], axis=1)
    width = float(np.clip(0.055 * np.quantile(length, 0.75), 0.4, 2.4))
    fade = view.fade(near[ends].mean(axis=1))
    bold = boundary | grid.edge_on_line
    colour = np.where(bold[:, None], _hazy(BOUNDARY_COLOR, fade, 0.45), _hazy(INK_COLOUR, fade, 0.60))
    widths = np.where(bold, 1.9 * width, width)
    return Strokes(
        key + MEMBERS_BEFORE * view.camera.distance, flat[ends[:, [0, 1, 1]]], np.zeros_like(colour), colour, widths
    )


def placed(cloud: PointCloud, grid: Grid) -> np.ndarray:
    """Return the points of a scan in the frame of its grid (N, 3)."""
    points: np.ndarray = cloud.points + (np.asarray(cloud.origin, float) - grid.origin)
    return points


def some_of(points: np.ndarray, most: int) -> np.ndarray:
    """Return at most so many of some points (N, 3); always the same ones."""
    if len(points) <= most:
        return points
    chosen: np.ndarray = points[np.sort(np.random.default_rng(0).permutation(len(points))[:most])]
    return chosen


def dot_strokes(points: np.ndarray, member: float, view: CameraView, *, over: bool) -> Strokes:
    """Return the points of the scan (N, 3) that are seen, as dots: over the triangles, or alone and shaded."""
    flat, near = view.camera.project(some_of(points, MOST_POINTS[over]))
    inside, triangle, nearest = _in_front(flat, view)
    flat, near, triangle, nearest = flat[inside], near[inside], triangle[inside], nearest[inside]
    slack = 0.5 * member
    seen = (triangle < 0) | (near > nearest - slack)
    flat, near, triangle, nearest = flat[seen], near[seen], triangle[seen], nearest[seen]
    on = (triangle >= 0) & (near < nearest + slack)
    key = np.where(on, np.maximum(view.key[triangle], near), near) + slack
    light = np.where(triangle >= 0, view.light[triangle], 0.5)
    colour = _hazy(
        _mix((INK_COLOUR, OUTSIDE_SHADES[0]), light, 0.55) if over else _mix(CLAY_COLOURS, light), view.fade(near), 0.30
    )
    return Strokes(key, _dots(flat), np.zeros_like(colour), colour, np.full(len(key), 1.5 if over else 2.4))


def missed_strokes(
    points: np.ndarray, colour: np.ndarray, view: CameraView, box: tuple[float, float, float, float]
) -> Strokes:
    """Return points that the grid leaves out (N, 3) in a colour (3,), as far as they lie in a box.

    They are faint where they lie before the grid and hide much of it, and shown through the grid where it hides nearly all of them.
    """
    flat, near = view.camera.project(some_of(points, MOST_POINTS[True]))
    shown = ((flat >= box[:2]) & (flat <= box[2:])).all(axis=1)
    flat, near = flat[shown], near[shown]
    inside, triangle, nearest = _in_front(flat, view)
    covers = inside & (triangle >= 0)
    behind, before = covers & (near < nearest), covers & (near > nearest)
    through = bool(len(flat)) and 1.0 - float(behind.mean()) < LEAST_SEEN
    hides = len(_cells_of(flat[before])) * MISSED_DOT**2 > MOST_HIDDEN * PIXELS_OF_MAP * (view.front >= 0).sum()
    shown = np.broadcast_to(np.concatenate([colour, [1.0]]), (len(flat), 4)).copy()
    shown[behind, 3] = _faint(flat[behind], COLOUR_THROUGH)
    shown[before, 3] = _faint(flat[before], COLOUR_BEFORE) if hides else 1.0
    key = near + 1e-6 * view.camera.distance
    if through:
        key[behind] = np.inf
    return Strokes(key, _dots(flat), np.zeros_like(shown), shown, np.full(len(flat), MISSED_DOT))


def _faint(flat: np.ndarray, colour: float) -> float:
    """Return how much of its colour each of some dots (N, 2) [pixel] has such that about so much is left where they lie on each other."""
    on_each_other = len(flat) / max(len(_cells_of(flat)), 1)
    return float(1.0 - (1.0 - colour) ** (1.0 / max(on_each_other, 1.0)))


def _cells_of(flat: np.ndarray) -> np.ndarray:
    """Return the cells (K, 2) as wide as a dot in which some dots (N, 2) [pixel] lie."""
    cells: np.ndarray = np.unique(np.floor(flat / MISSED_DOT), axis=0)
    return cells


def _in_front(flat: np.ndarray, view: CameraView) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return which places of a picture (N, 2) lie in it, and the triangle in front there and its nearness."""
    rows, columns = view.front.shape
    pixel = np.rint(flat / 2).astype(int)
    inside = (pixel >= 0).all(axis=1) & (pixel[:, 0] < columns) & (pixel[:, 1] < rows)
    column, row = np.clip(pixel, 0, (columns - 1, rows - 1)).T
    return inside, view.front[row, column], view.nearest[row, column]


def oblique_view(cloud: PointCloud, size: tuple[int, int]) -> Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]:
    """Return what takes places (N, 3) to a picture of a scan from obliquely above: where they are [pixel], and how far behind."""

    def project(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        turn, tilt = np.radians(-35.0), np.radians(35.0)
        across = np.cos(turn) * points[:, 0] - np.sin(turn) * points[:, 1]
        depth = np.sin(turn) * points[:, 0] + np.cos(turn) * points[:, 1]
        return np.column_stack([across, np.sin(tilt) * depth + np.cos(tilt) * points[:, 2]]), depth

    flat, _ = project(some_of(cloud.points, MOST_POINTS[False]))
    low, high = flat.min(axis=0), flat.max(axis=0)
    scale = 0.9 * float((np.array(size) / np.maximum(high - low, 1e-300)).min())

    def view(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        flat, depth = project(points)
        return (flat - 0.5 * (low + high)) * scale + 0.5 * np.array(size), depth

    return view


def cloud_strokes(cloud: PointCloud, size: tuple[int, int]) -> Strokes:
    """Return the points of a scan as dots seen from obliquely above, the higher the lighter, in a picture of a size [pixel]."""
    points = some_of(cloud.points, MOST_POINTS[False])
    flat, depth = oblique_view(cloud, size)(points)
    height = points[:, 2] - points[:, 2].min()
    colour = _mix(CLAY_COLOURS, height / max(float(height.max()), 1e-300), 0.8)
    return Strokes(-depth, _dots(flat), np.zeros_like(colour), colour, np.full(len(flat), 2.0))


def _dots(flat: np.ndarray) -> np.ndarray:
    """Return (N, 3, 2) lines so short that their round ends make a dot; a line of no length is not painted."""
    shape: np.ndarray = flat[:, None] + np.array([[-0.05, 0.0], [0.05, 0.0], [0.05, 0.0]])
    return shape


def _mark_strokes(grid: Grid, view: CameraView) -> list[Strokes]:
    """Return the marks of the fixed nodes: full where they are seen, faint behind the grid."""
    flat, near = view.camera.project(grid.nodes[grid.fixed])
    _, _, nearest = _in_front(flat, view)
    seen = near > nearest - 0.5 * float(np.mean(grid.lengths))
    shape = _dots(flat)
    strokes = []
    for colour, width in ((PAPER_COLOUR, 15.0), (FIXED_NODE_COLOUR, 11.0)):
        shown = np.broadcast_to(np.concatenate([colour, [1.0]]), (len(flat), 4)).copy()
        shown[:, 3] = np.where(seen, 1.0, COLOUR_BEHIND)
        front = np.full(len(flat), np.inf)
        strokes.append(Strokes(front, shape, np.zeros_like(shown), shown, np.full(len(flat), width)))
    return strokes


def solid_strokes(view: CameraView) -> Strokes:
    """Return the outside of a solid, shaded."""
    surface = _surface_strokes(view, PRINT_COLOURS, PRINT_COLOURS)
    keep = view.outside
    return Strokes(surface.key[keep], surface.shape[keep], surface.fill[keep], surface.line[keep], surface.width[keep])
