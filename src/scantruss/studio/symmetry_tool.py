"""Symmetry: mirror planes or the rotation that the grid keeps exactly, found in the scan, drawn, dragged or typed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from ..scan.symmetry import SYMMETRY_TOLERANCE, nearest_mirror_plane
from ..settings.values import ROTATION_NUMBERS, SYMMETRIES_FOUND
from .dragging import DraggedBalls
from .drawn_lines import ScannedPoints, clicked_point, numbers_of
from .frame import DRAWN_EXTENT, SceneFrame

if TYPE_CHECKING:
    from .state import StudioState
    from .view import StudioView

PLANE_MODE = "mirror plane"
PLANE_COLOR = (90, 120, 200)
PLANE_RADIUS = 0.12  #: of the balls by which a plane is dragged [scene]
MOST_LEANING = 0.1  #: greatest z of the normal of a plane that is dragged
ABOVE_EACH_OTHER = 1e-6  #: share of their distance that two places are apart in plan where they lie above each other
PLANE_REACH = 0.6  #: of a plane that is drawn, from its middle [extent of the scan]
SYMMETRIES = ("none", *SYMMETRIES_FOUND, "typed")


class SymmetryTool:
    """Chooses mirror planes and draws those that the grid keeps."""

    def __init__(self, view: StudioView, gui: Any) -> None:
        self.view = view
        self.way = gui.add_dropdown(
            "planes",
            SYMMETRIES,
            hint="auto finds planes in the scan, else a rotation; rotation finds that only; typed takes what is below",
        )
        self.words = gui.add_text(
            "plane",
            "",
            hint="x, y, z, nx, ny, nz: a point and a normal, in the frame of the scan; or a point, an axis and the parts of a turn",
        )
        draw = gui.add_button(
            "Draw a plane",
            hint="then click two points of the scan: it stands upright through both; drag its balls to turn it",
        )
        self._count = 0
        self._begin: np.ndarray | None = None
        self._ends = np.zeros((0, 3))  # of the plane that can be dragged [scan unit]
        self._balls = DraggedBalls(view, "/mirror ends", self._drop, self._show_moved)
        draw.on_click(view.step(self._start))
        view.modes[PLANE_MODE] = self._click
        self.way.on_update(view.step(self._set))
        view.typed(self.words, lambda: self._set() if self.way.value == SYMMETRIES[-1] else None)

    def _set(self) -> None:
        way, session = self.way.value, self.view.session
        plane: Any = "" if way == SYMMETRIES[0] else way
        if way == SYMMETRIES[-1]:
            if not self.words.value.strip():
                self.view.say("type a plane: x, y, z, nx, ny, nz")
                return
            count = ROTATION_NUMBERS if len(self.words.value.split(",")) == ROTATION_NUMBERS else 6
            plane = (numbers_of(self.words.value, count, "a mirror plane needs a point and a normal, six numbers"),)
        if plane != session.settings.symmetry:
            session.set("symmetry", symmetry=plane)

    def _start(self) -> None:
        self._begin = None
        self.view.click.value = PLANE_MODE

    def _click(self, origin: np.ndarray, ahead: np.ndarray) -> None:
        place = clicked_point(self.view, origin, ahead)
        if self._begin is None:
            self._begin = place
            self._balls.show(self.view.frame.to_scene(self._begin[None]), np.array(PLANE_COLOR, np.uint8), PLANE_RADIUS)
            return
        begin, self._begin = self._begin, None
        self.view.click.value = self.view.clicks[0]
        self._set_drawn(upright_plane(begin, place))

    def _moved(self, number: int, place: np.ndarray) -> tuple[float, ...]:
        """Return the plane with one of its ends at another place."""
        ends = self._ends.copy()
        ends[number] = place
        return upright_plane(*ends)

    def _show_moved(self, number: int, place: np.ndarray) -> None:
        self._draw([self._moved(number, place)], self.view.frame)

    def _drop(self, number: int, place: np.ndarray) -> None:
        self._set_drawn(self._moved(number, place))

    def _set_drawn(self, plane: tuple[float, ...]) -> None:
        """Take the mirror plane of the scan that a drawn one means, or the drawn one where there is none."""
        session = self.view.session
        assert session.cloud is not None
        points = np.asarray(session.cloud.points) + session.cloud.origin
        meant = nearest_mirror_plane(points, plane, SYMMETRY_TOLERANCE * session.settings.length)
        session.set("mirror plane", symmetry=(plane if meant is None else meant.row,))

    def fill(self, before: StudioState | None, state: StudioState) -> None:
        """Show the planes of a state: those that are typed or dragged, or those that the grid has kept."""
        asked = state.settings.symmetry
        same = before is not None and before.settings.symmetry == asked
        if not same:
            self.way.value = asked if asked in SYMMETRIES_FOUND else SYMMETRIES[-1 if asked else 0]
            if asked and not isinstance(asked, str):
                self.view.show_text(self.words, ", ".join(f"{number:.7g}" for number in asked[0]))
        if same and before is not None and before.grid is state.grid and before.cloud is state.cloud:
            return
        made = state.grid.settings.symmetry if state.grid is not None and state.grid.settings is not None else ()
        rows = made if isinstance(asked, str) else asked
        self.view.scene.remove("/mirror ends")
        if state.cloud is None or isinstance(rows, str):  # of a grid that has not looked for them
            rows = ()
        planes = [row for row in rows if len(row) != ROTATION_NUMBERS]
        if state.cloud is not None:
            self._draw(planes, SceneFrame.of(state.cloud))
        if (
            state.cloud is not None
            and len(planes) == 1
            and abs(planes[0][5]) < MOST_LEANING * math.hypot(*planes[0][3:])
        ):
            scanned = ScannedPoints.of(state.cloud, state.settings).places
            ends = ends_on(scanned, np.array(planes[0], float), state.settings.length)
            if ends is not None:
                self._ends = ends
                shown = SceneFrame.of(state.cloud).to_scene(ends)
                self._balls.show(shown, np.array(PLANE_COLOR, np.uint8), PLANE_RADIUS)

    def _draw(self, planes: Sequence[Sequence[float]], frame: SceneFrame) -> None:
        """Draw planes in place of those that are drawn."""
        self.view.scene.remove(*(f"/mirror/{k}" for k in range(len(planes), self._count)))
        self._count = len(planes)
        faces = np.array([[0, 1, 2], [0, 2, 3]], np.uint32)
        for k, plane in enumerate(planes):
            self.view.scene.api.add_mesh_simple(
                f"/mirror/{k}", corners_of_plane(frame, np.array(plane, float)), faces, color=PLANE_COLOR, side="double", opacity=0.25,
                flat_shading=True, cast_shadow=False, receive_shadow=False,
            )  # fmt: skip


def upright_plane(begin: np.ndarray, end: np.ndarray) -> tuple[float, ...]:
    """Return the upright plane through two places (3,): a point and its normal, six numbers.

    Raises
    ------
    InputError
        One lies above the other, so that any upright plane passes through both.
    """
    across = np.array([begin[1] - end[1], end[0] - begin[0], 0.0])
    size = float(np.linalg.norm(across))
    if size < ABOVE_EACH_OTHER * float(np.linalg.norm(end - begin)) or size == 0.0:
        raise InputError("a mirror plane needs two places that do not lie above each other")
    return tuple(float(f"{number:.9g}") for number in (*begin.tolist(), *(across / size).tolist()))


def ends_on(places: np.ndarray, plane: np.ndarray, length: float) -> np.ndarray | None:
    """Return where a plane leaves the scan: the two places (2, 3) within half a member that lie farthest apart along it; None beside it."""
    normal = plane[3:] / np.linalg.norm(plane[3:])
    around = places - plane[:3]
    near = np.flatnonzero(np.abs(around @ normal) <= length / 2)
    along = around[near] @ np.array([-normal[1], normal[0], 0.0])
    if len(near) < 2 or np.ptp(along) < length:
        return None
    ends: np.ndarray = places[near[[along.argmin(), along.argmax()]]].astype(float)
    return ends - ((ends - plane[:3]) @ normal)[:, None] * normal


def corners_of_plane(frame: SceneFrame, plane: np.ndarray) -> np.ndarray:
    """Return the corners (4, 3) of a plane as it is drawn around the middle of the scan, float32."""
    normal = plane[3:] / np.linalg.norm(plane[3:])
    at = frame.to_scene(plane[None, :3])[0].astype(float)
    middle = normal * (normal @ at)
    aside = np.cross(normal, [0.0, 0.0, 1.0] if abs(normal[2]) < 0.9 else [1.0, 0.0, 0.0])
    aside = aside / np.linalg.norm(aside)
    up = np.cross(normal, aside)
    reach = PLANE_REACH * DRAWN_EXTENT
    corners = [middle + reach * (a * aside + 0.5 * b * up) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    return np.array(corners, np.float32)
