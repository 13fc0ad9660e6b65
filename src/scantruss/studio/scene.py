"""What is drawn: the scan, the members, panels and nodes of a grid, and marks beside them, in the scene of one page."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from ..grid.panels import panel_of_triangles
from .colours import DIMMED_COLOUR, FROM_GRID, PLAIN_COLOUR, colors_of_scan
from .frame import SceneFrame, SectionPlane
from .tone import to_be_seen

if TYPE_CHECKING:
    from ..export.model import Model
    from .legend import ColourLegend
    from .state import StudioState

FRONT_COLOR = np.array((240, 190, 90), np.uint8)
NO_MESH, NO_TRIANGLES = np.zeros((0, 3)), np.zeros((0, 3), np.int64)
GRID_PARTS = (
    "/grid/members", "/grid/members in points", "/grid/tubes", "/grid/nodes", "/grid/balls", "/grid/panels",
    "/grid/panels coloured",
)  # fmt: skip
PANEL_COLOR = (205, 216, 223)
SELECTED_COLOR = (230, 97, 1)
#: of members, of what stands out, of what only shows where it was [pixel]
LINE_WIDTH, WIDE_LINE, FAINT_LINE = 3.0, 7.0, 1.0
TUBE_RADIUS, BALL_RADIUS = 0.05, 0.09  #: of members and nodes drawn as bodies [mean member length]
ROD_RADIUS = 0.03  #: of members of layers, drawn so where they are too many for lines [mean member length]
DRAWN_POINTS, FIRST_POINTS = 100_000, 20_000  #: of the scan; of its first picture
MOST_DRAWN_LINES = 4000  #: members that are drawn as lines
MOST_BEADS = 33_000  #: points by which so many members are drawn
#: points of such a member at least and at most, and how large they are [their distance]
BEADS, BEAD_SIZE = (3, 12), 0.45
MOST_DRAWN_RODS = 20_000  #: members of layers that are drawn as rods; more are points
TUBE_SIDES, ROD_SIDES = 8, 3
BODY_GAMMA, PANEL_GAMMA = 2.2, 1.45  #: exponents of colours, see `lit`
SKY_LIGHT = 0.3  #: share of the light that comes from the sky
PLAIN_LIGHT = 2.0  #: on all sides of bodies, without a sky
SKY_COLORS = {
    False: ((150, 188, 222), (243, 246, 248)),
    True: ((16, 24, 38), (52, 60, 72)),
}  #: of a light and a dark page, up and down
SKY_ROWS = 64  #: of its picture [pixel]
GROUND_SIZE, GROUND_SHADOW = 60.0, 0.25  #: of the ground [scene], and how dark shadows are on it
BARB_LENGTH, BARB_WIDTH = 0.16, 0.05  #: of the head of an arrow that is drawn by lines [scene]
DRAWN_SHARE = 0.93  #: of a panel about its middle, so that it does not cover its members
OCTAHEDRON = np.array([[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], np.float32)
BALL_FACES = np.array(
    [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4], [1, 0, 5], [2, 1, 5], [3, 2, 5], [0, 3, 5]], np.int32
)


class Scene:
    """The scene of one page; each part is drawn again by its name, and removed when it is empty."""

    def __init__(self, scene: Any) -> None:
        self.api = scene
        scene.set_up_direction("+z")
        self.light(False)
        self._scan_key: tuple[Any, ...] = ()
        self._widths: dict[str, float] = {}  # of lines by their names, as on the page [pixel]
        self._front: tuple[np.ndarray, np.ndarray] | None = None
        self._scan_legend: ColourLegend | None = None

    def scan(
        self, state: StudioState, wanted: str, section: SectionPlane | None, most: int = DRAWN_POINTS
    ) -> ColourLegend | None:
        """Draw the scan of a state, thinned, and return the legend of its colours, where there is one.

        Parameters
        ----------
        wanted : str
            Of `colorings_of_scan`.
        most : int
            Points that are drawn.
        """
        assert state.cloud is not None
        key = (state.cloud, wanted, state.grid if wanted == FROM_GRID else None, section, most)
        if key == self._scan_key:
            return self._scan_legend
        taken = np.arange(0, len(state.cloud.points), max(1, -(-len(state.cloud.points) // most)))
        colors, legend = colors_of_scan(state, taken, wanted)
        places = SceneFrame.of(state.cloud).to_scene(state.cloud.points[taken] + state.cloud.origin)
        if section is not None:
            kept = section.keeps(places)
            places, colors = places[kept], colors[kept]
        self.points("/scan", places, np.ascontiguousarray(colors), 0.02)
        self._scan_key, self._scan_legend = key, legend
        return legend

    def remove_scan(self) -> None:
        """Draw no scan."""
        self._scan_key, self._scan_legend = (), None
        self.remove("/scan")

    def remove(self, *names: str) -> None:
        """Remove parts."""
        for name in names:
            self.api.remove_by_name(name)

    def light(self, is_fine: bool, is_dark: bool = False, ground: float = 0.0) -> None:
        """Light bodies by day, under a sky and with shadows on the ground, or plainly, which costs a slow machine least.

        Parameters
        ----------
        ground : float
            Height of the ground [scene].
        """
        self.api.configure_environment_map("park" if is_fine else None, environment_intensity=SKY_LIGHT)
        self.api.configure_default_lights(True, cast_shadow=is_fine)
        self.api.add_light_ambient("/daylight", intensity=0.0 if is_fine else PLAIN_LIGHT)
        self.api.set_background_image(sky(is_dark) if is_fine else None)
        if is_fine:
            self.api.add_grid(
                "/ground", GROUND_SIZE, GROUND_SIZE, cell_thickness=0.0, section_thickness=0.0, fade_strength=0.0,
                shadow_opacity=GROUND_SHADOW, position=(0.0, 0.0, ground),
            )  # fmt: skip
        else:
            self.remove("/ground")

    def members(
        self,
        name: str,
        ends: np.ndarray,
        colors: np.ndarray,
        width: float = LINE_WIDTH,
        most: int | None = MOST_DRAWN_LINES,
    ) -> None:
        """Draw the members (M, 2, 3) of a grid: as lines, or where these are more than `most` as rows of points, which cost less."""
        few, many = (ends, ends[:0]) if most is None or len(ends) <= most else (ends[:0], ends)
        self.lines(name, few, colors[: len(few)], width)
        beads = int(np.clip(MOST_BEADS // max(len(many), 1), *BEADS))
        step = float(np.linalg.norm(many[:, 1] - many[:, 0], axis=1).mean()) / beads if len(many) else 1.0
        share = ((np.arange(beads) + 0.5) / beads)[None, :, None]
        places = (many[:, None, 0] + share * (many[:, None, 1] - many[:, None, 0])).reshape(-1, 3)
        self.points(
            f"{name} in points",
            places.astype(np.float32),
            np.repeat(colors[: len(many)], beads, axis=0),
            BEAD_SIZE * step,
            "square",  # a fifth of the time of a picture less than circles
        )

    def points(
        self,
        name: str,
        places: np.ndarray,
        colors: np.ndarray,
        size: float,
        shape: Literal["circle", "square"] = "circle",
    ) -> None:
        """Draw points (N, 3) in colours (N, 3) or one."""
        if not len(places):
            self.remove(name)
            return
        self.api.add_point_cloud(name, places, colors, point_size=size, point_shape=shape, precision="float32")

    def thinned(self, name: str, places: np.ndarray, color: np.ndarray) -> None:
        """Draw the points of a scan (N, 3), thinned, in one colour."""
        self.points(name, places[:: max(1, -(-len(places) // DRAWN_POINTS))], color, 0.02)

    def lines(self, name: str, ends: np.ndarray, colors: np.ndarray, width: float = LINE_WIDTH) -> None:
        """Draw segments (M, 2, 3) in colours (M, 3) or one."""
        if not len(ends):
            self.remove(name)
            return
        self._widths[name] = width
        each = np.broadcast_to(to_be_seen(colors), (len(ends), 3))
        self.api.add_line_segments(
            name, ends.astype(np.float32), np.repeat(each[:, None], 2, axis=1), thickness=width, thickness_units="screen"
        )  # fmt: skip

    def widen_lines(self, times: float) -> None:
        """Draw all lines so many times as wide as usual, as a picture of more pixels than the page needs."""
        for name, width in self._widths.items():
            if (handle := self.api.get_handle_by_name(name)) is not None:
                handle.thickness = times * width

    def chain(self, name: str, places: np.ndarray, closed: bool, color: tuple[int, int, int], width: float) -> None:
        """Draw a polyline (M, 3)."""
        around = np.concatenate([places, places[:1]]) if closed else places
        self.lines(name, np.stack([around[:-1], around[1:]], axis=1), np.array(color, np.uint8), width)

    def tubes(self, name: str, ends: np.ndarray, colors: np.ndarray, radius: float, sides: int = TUBE_SIDES) -> None:
        """Draw segments (M, 2, 3) as tubes of so many sides."""
        if not len(ends):
            self.remove(name)
            return
        k = np.arange(sides)
        angles = 2 * np.pi * k / sides
        circle = np.stack([np.cos(angles), np.sin(angles), np.zeros(sides)], axis=1)
        after = (k + 1) % sides
        faces = np.concatenate(
            [np.stack([k, after, k + sides], axis=1), np.stack([after, after + sides, k + sides], axis=1)]
        )
        spans = ends[:, 1] - ends[:, 0]
        sizes = np.linalg.norm(spans, axis=1)
        self.api.add_batched_meshes_simple(
            name,
            np.concatenate([circle, circle + [0.0, 0.0, 1.0]]).astype(np.float32),
            faces.astype(np.uint32),
            turns_from_z(spans / np.maximum(sizes, 1e-12)[:, None]),
            ends[:, 0].astype(np.float32),
            batched_scales=np.stack([np.full_like(sizes, radius), np.full_like(sizes, radius), sizes], axis=1),
            batched_colors=lit(np.broadcast_to(colors, (len(ends), 3)), BODY_GAMMA),
            lod="off",
        )

    def balls(self, name: str, places: np.ndarray, colors: np.ndarray, radius: float) -> None:
        """Draw balls at places (N, 3) in colours (N, 3) or one."""
        if not len(places):
            self.remove(name)
            return
        corners, faces = round_ball()
        self.api.add_batched_meshes_simple(
            name, corners, faces, np.tile([1.0, 0.0, 0.0, 0.0], (len(places), 1)), places.astype(np.float32),
            batched_scales=np.full(len(places), radius),
            batched_colors=lit(np.broadcast_to(colors, (len(places), 3)), BODY_GAMMA), lod="off",
        )  # fmt: skip

    def panels(
        self,
        name: str,
        nodes: np.ndarray,
        triangles: np.ndarray,
        colors: np.ndarray | None,
        opacity: float | None,
        panels: np.ndarray | None = None,
    ) -> None:
        """Draw triangles (T, 3) of nodes (V, 3), or the panels (P, K) that they are of, in one colour or each in its own (P, 3)."""
        self.remove(name, f"{name} coloured")
        if not len(triangles):
            return
        table = triangles if panels is None else panels
        owner, there = panel_of_triangles(table), (table >= 0)[:, :, None]
        middles = ((nodes[table] * there).sum(axis=1) / there.sum(axis=1))[owner][:, None]
        corners = (middles + DRAWN_SHARE * (nodes[triangles] - middles)).reshape(-1, 3).astype(np.float32)
        faces = np.arange(len(corners), dtype=np.uint32).reshape(-1, 3)
        if colors is None:
            self.api.add_mesh_simple(
                name, corners, faces, color=PANEL_COLOR, side="double", flat_shading=True, opacity=opacity,
                cast_shadow=False, receive_shadow=False,
            )  # fmt: skip
            return
        import trimesh

        body = trimesh.Trimesh(corners, faces, process=False)
        rgba = np.concatenate(
            [np.repeat(lit(colors, PANEL_GAMMA)[owner], 3, axis=0), np.full((len(corners), 1), 255)], axis=1
        )
        body.visual.vertex_colors = rgba.astype(np.uint8)
        self.api.add_mesh_trimesh(f"{name} coloured", body)

    def front(self, frame: SceneFrame | None, front: tuple[np.ndarray, np.ndarray] | None) -> None:
        """Draw a front that advances, nodes (V, 3) [scan unit] and triangles (T, 3), in place of the grid; None draws the grid again."""
        front = front if frame is not None and front is not None and len(front[1]) else None
        if front is self._front:
            return
        if frame is None or front is None:
            self.panels("/front", NO_MESH, NO_TRIANGLES, None, None)
        else:
            nodes, triangles = front
            self.panels(
                "/front", frame.to_scene(nodes), triangles, np.broadcast_to(FRONT_COLOR, (len(triangles), 3)), None
            )
        before, self._front = self._front, front
        if (shown := front is not None) != (before is not None):
            for name in GRID_PARTS:
                if (handle := self.api.get_handle_by_name(name)) is not None:
                    handle.visible = not shown

    def highlight(self, kind: str, number: int, places: np.ndarray, model: Model) -> None:
        """Draw a node, member or panel so that it stands out."""
        color = np.array(SELECTED_COLOR, np.uint8)
        if kind == "nodes":
            self.points("/selected/node", places[[number]], color, 0.15)
        elif kind == "members":
            self.lines("/selected/member", places[model.members[[number]]], color, WIDE_LINE)
        else:
            self.chain("/selected/panel", places[model.panel_loops[number]], True, SELECTED_COLOR, WIDE_LINE)


def is_layered(model: Model) -> bool:
    """Whether a structure has layers below its panels, which must be seen through them."""
    return model.truss is not None and model.truss.layers is not None


def drawn_as_rods(model: Model, number: int) -> bool:
    """Whether so many members of a model are drawn as rods: of layers, which points do not show, and too many for lines."""
    return is_layered(model) and MOST_DRAWN_LINES < number <= MOST_DRAWN_RODS


def lit(colors: np.ndarray, gamma: float) -> np.ndarray:
    """Return the colours (N, 3) uint8 of bodies that look like some colours (N, 3) by daylight: the page takes theirs as light."""
    return np.rint(255.0 * (np.asarray(colors, float) / 255.0) ** gamma).astype(np.uint8)


def sky(is_dark: bool, rows: int = SKY_ROWS) -> np.ndarray:
    """Return a sky (rows, 1, 3) uint8, paler towards the ground."""
    high, low = np.array(SKY_COLORS[is_dark], float)
    return np.rint(high + np.linspace(0.0, 1.0, rows)[:, None, None] * (low - high)).astype(np.uint8)


def barbed(places: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Return segments (5 N, 2, 3) that draw arrows (N, 3) which end at places (N, 3): a shaft and four barbs each."""
    size = np.linalg.norm(along, axis=1, keepdims=True)
    ahead = along / np.maximum(size, 1e-12)
    steep = np.abs(ahead[:, 2:]) > 0.9
    aside = np.cross(ahead, np.where(steep, [[1.0, 0.0, 0.0]], [[0.0, 0.0, 1.0]]))
    aside /= np.maximum(np.linalg.norm(aside, axis=1, keepdims=True), 1e-12)
    across = np.cross(ahead, aside)
    back = places - np.minimum(BARB_LENGTH, 0.4 * size) * ahead
    ends = [places - along, *(back + BARB_WIDTH * side for side in (aside, -aside, across, -across))]
    return np.stack([np.stack([end, places], axis=1) for end in ends], axis=1).reshape(-1, 2, 3)


def spread(places: np.ndarray, most: int) -> np.ndarray:
    """Return about `most` of some places (N, 3) at most, far from one another: their numbers (K,)."""
    if len(places) <= most:
        return np.arange(len(places))
    taken = [0]
    away = np.full(len(places), np.inf)
    for _ in range(most - 1):
        away = np.minimum(away, ((places - places[taken[-1]]) ** 2).sum(axis=1))
        taken.append(int(away.argmax()))
    return np.array(taken)


def round_ball() -> tuple[np.ndarray, np.ndarray]:
    """Return the corners (18, 3) and triangles (32, 3) of an octahedron whose sides are divided once, on a ball of radius 1."""
    corners, faces = OCTAHEDRON.tolist(), []
    known: dict[tuple[int, int], int] = {}

    def middle(a: int, b: int) -> int:
        key = (min(a, b), max(a, b))
        if key not in known:
            place = np.array(corners[a]) + corners[b]
            known[key] = len(corners)
            corners.append((place / np.linalg.norm(place)).tolist())
        return known[key]

    for a, b, c in BALL_FACES.tolist():
        ab, bc, ca = middle(a, b), middle(b, c), middle(c, a)
        faces += [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
    return np.array(corners, np.float32), np.array(faces, np.uint32)


def turns_from_z(directions: np.ndarray) -> np.ndarray:
    """Return the (M, 4) quaternions w, x, y, z that turn the z axis into unit vectors (M, 3)."""
    x, y, z = directions.T
    turns = np.stack([1 + z, -y, x, np.zeros_like(x)], axis=1)
    turns[z < -1 + 1e-9] = [0.0, 1.0, 0.0, 0.0]
    return turns / np.linalg.norm(turns, axis=1)[:, None]


def drawn_colors(colors: np.ndarray, selected: np.ndarray | None) -> np.ndarray:
    """Return colours (N, 3) with those dimmed that are not selected (N,)."""
    return colors if selected is None else np.where(selected[:, None], colors, DIMMED_COLOUR)


def plain_colors(count: int) -> np.ndarray:
    """Return the colour of what has no value (count, 3)."""
    return np.broadcast_to(PLAIN_COLOUR, (count, 3))


def cut(section: SectionPlane | None, ends: np.ndarray, colors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return segments and their colours on the drawn side of a section."""
    if section is None:
        return ends, colors
    clipped, kept = section.clipped(ends)
    return clipped, colors[kept]
