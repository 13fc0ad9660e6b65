"""Crop the scan: by a box with two handles, a polygon drawn on the plan, or words typed."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from ..selection import check_crop, parts_of, polygon_text
from .picking import place_on_scan

if TYPE_CHECKING:
    from .state import StudioState
    from .view import StudioView

CROP_COLOR = (200, 90, 0)
OUTSIDE_COLOR = np.array((190, 190, 195), np.uint8)
CROP_MODE = "corner of crop"
BOX_EDGES = np.array([(0, 1), (0, 2), (0, 4), (1, 3), (1, 5), (2, 3), (2, 6), (3, 7), (4, 5), (4, 6), (5, 7), (6, 7)])
CROP_WAYS = {
    "Box": "a box with two handles that are dragged",
    "Polygon": "corners that are clicked on the plan; Undo drops the last",
    "All": "no crop: the whole scan",
}


def crosses_itself(corners: Sequence[Sequence[float]], *, closed: bool) -> bool:
    """Whether two sides of a polygon in plan cross, the one back to its first corner among them if it is closed."""
    begin = np.array(corners, float).reshape(-1, 2)
    begin, end = (begin, np.roll(begin, -1, axis=0)) if closed else (begin[:-1], begin[1:])

    def side(places: np.ndarray) -> np.ndarray:
        """On which side of each line (N,) each place (N,) lies, (N, N)."""
        along, away = end - begin, places[None] - begin[:, None]
        return np.asarray(np.sign(along[:, None, 0] * away[:, :, 1] - along[:, None, 1] * away[:, :, 0]))

    apart = side(begin) * side(end) < 0  # the ends of each side lie on both sides of the line
    return bool((apart & apart.T).any())


def check_rings(part: str) -> None:
    """Refuse a polygon that crosses itself, of which nobody knows what is inside.

    Raises
    ------
    InputError
        One of its rings does.
    """
    for ring in (ring for rings in parts_of(part)[1] for ring in rings):
        if len(ring) % 2 == 0 and crosses_itself(np.reshape(ring, (-1, 2)).tolist(), closed=True):
            raise InputError(
                "the polygon crosses itself, so what is inside is not known; press Undo to drop its last corner, or Polygon to begin again"
            )


class CropTool:
    """Chooses a part of space, draws it, and takes the points in it."""

    def __init__(self, view: StudioView, gui: Any) -> None:
        self.view = view
        ways = view.rows.add("draw crop", CROP_WAYS)
        self.words = gui.add_text(
            "crop", "", hint="box:X0,Y0,Z0,X1,Y1,Z1, sphere:X,Y,Z,RADIUS or polygon:X,Y,X,Y,...; several with blanks"
        )
        take = gui.add_button("Crop", color="blue")
        self._handles: list[Any] = []
        self._corners: list[tuple[float, float]] = []
        ways.on_click(view.chosen(lambda way: {"Box": self._box, "Polygon": self._polygon, "All": self._all}[way]()))
        view.corrects(self.words)
        take.on_click(view.step(self._take))
        view.modes[CROP_MODE] = self._corner

    def _check(self) -> None:
        if self.view.session.cloud is None:
            raise InputError("there is no scan yet; open one")

    def _all(self) -> None:
        self._clear()
        self.words.value = ""
        self.view.session.crop(())

    def _take(self) -> None:
        self._check()
        parts = tuple(self.words.value.split())
        if self._corners and len(self._corners) < 3:
            raise InputError("a polygon needs three corners at least; click more of them")
        for part in check_crop(parts):
            if part.startswith("polygon:"):
                check_rings(part)
        self.view.session.crop(parts)
        self._clear()

    def put_away(self) -> None:
        """Draw no box or polygon that has not been taken; its words stay in the field."""
        if self._handles or self._corners:
            self._clear()

    def _clear(self) -> None:
        """Draw nothing more of what was being chosen."""
        for handle in self._handles:
            handle.remove()
        self._handles, self._corners = [], []
        self.view.scene.remove("/crop", "/crop outside")
        if self.view.click.value == CROP_MODE:
            self.view.click.value = self.view.clicks[0]

    # ---- box

    def _box(self) -> None:
        """Show a box around the points that are taken, or the one that is typed, with a handle at its lowest and highest corner."""
        self._check()
        self._clear()
        frame, cloud = self.view.frame, self.view.session.cloud
        assert cloud is not None
        low, high = frame.to_scene(np.stack(cloud.bounds) + cloud.origin)
        for part in self.words.value.split():
            if part.startswith("box:") and len(numbers := parts_of(part)[1][0][0]) == 6:
                low, high = frame.to_scene(np.array(numbers).reshape(2, 3))
        for name, at in (("low", low), ("high", high)):
            handle = self.view.scene.api.add_transform_controls(
                f"/crop {name}", scale=1.2, disable_rotations=True, depth_test=False, position=tuple(at.tolist())
            )
            handle.on_update(self.view.in_order(self._dragged))
            self._handles.append(handle)
        self.view.see(np.concatenate([self._box_corners(), frame.corners]))
        self._show_box()

    def _dragged(self, event: Any) -> None:
        self.view.do_quietly(partial(self._show_box, event.phase == "end"))

    def _show_box(self, tells: bool = True) -> None:
        corners = self._box_corners()
        self.view.scene.lines("/crop", corners[BOX_EDGES], np.array(CROP_COLOR, np.uint8), 4.0)
        if tells:
            numbers = self.view.frame.from_scene(corners[[0, -1]]).ravel().tolist()
            self.words.value = "box:" + ",".join(f"{number:.10g}" for number in numbers)
            self._show_outside()

    def _box_corners(self) -> np.ndarray:
        """Return the corners (8, 3) of the box between the handles, in the scene, the lowest first and the highest last."""
        ends = np.sort(np.array([handle.position for handle in self._handles]), axis=0)
        return np.array([[ends[k >> axis & 1, axis] for axis in range(3)] for k in range(8)])

    def _show_outside(self) -> None:
        """Draw the points outside the present crop too, so that it can be made larger."""
        state = self.view.session.state
        if state.settings.crop:
            outside = self._whole()[state.cropped_off()]
            self.view.scene.thinned("/crop outside", self.view.frame.to_scene(outside), OUTSIDE_COLOR)

    def _whole(self) -> np.ndarray:
        """Return the points of the scan as it was opened (N, 3), in its own frame [scan unit]."""
        whole = self.view.session.state.whole
        if whole is None:
            raise InputError("there is no scan yet; open one")
        points: np.ndarray = whole.cloud.points + whole.cloud.origin
        return points

    # ---- polygon

    def _polygon(self) -> None:
        """Look at the scan from above and take corners by clicks."""
        self._check()
        self._clear()
        self.words.value = ""
        self._show_outside()
        self.view.plan()
        self.view.click.value = CROP_MODE
        self.view.say("click the corners of a polygon on the plan, then press Crop; Undo drops the last corner")

    def take_back(self) -> bool:
        """Drop the last corner of a polygon that is being drawn; whether there was one."""
        if self.view.click.value != CROP_MODE or not self._corners:
            return False
        self._corners.pop()
        self._show_corners()
        return True

    def _corner(self, origin: np.ndarray, ahead: np.ndarray) -> None:
        """Take the place under a click for a corner: on the scan, or beside it at its middle height."""
        frame = self.view.frame
        at = place_on_scan(frame.to_scene(self._whole()), origin, ahead, self.view.near)
        if at is None:
            if abs(ahead[2]) < 1e-6:
                raise InputError("no corner is there; look at the scan from above: press Polygon")
            at = origin - ahead * (origin[2] / ahead[2])
        x, y, _ = frame.from_scene(at).tolist()
        corners = [*self._corners, (float(f"{x:.10g}"), float(f"{y:.10g}"))]
        if crosses_itself(corners, closed=False):
            raise InputError(
                "to that corner the polygon would cross itself; click elsewhere, or press Undo to drop the last corner"
            )
        self._corners = corners
        self._show_corners()

    def _show_corners(self) -> None:
        frame = self.view.frame
        self.words.value = polygon_text([self._corners]) if len(self._corners) > 2 else ""
        self.view.scene.remove("/crop")
        if not self._corners:
            return
        places = np.array([(*corner, frame.middle[2]) for corner in self._corners])
        height = float(frame.to_scene(self._whole())[:, 2].max())
        drawn = frame.to_scene(places)
        drawn[:, 2] = height
        if len(drawn) > 1:
            self.view.scene.chain("/crop", drawn, len(drawn) > 2, CROP_COLOR, 4.0)
        else:
            self.view.scene.points("/crop", drawn, np.array(CROP_COLOR, np.uint8), 0.12)

    def fill(self, before: StudioState | None, state: StudioState) -> None:
        """Show the crop of a state."""
        if before is None or before.settings.crop != state.settings.crop or before.whole is not state.whole:
            self.words.value = " ".join(state.settings.crop)
            self._clear()
