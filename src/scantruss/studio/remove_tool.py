"""Remove points by hand: those within rectangles that are dragged are shown in red before they go."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from .clean_tool import GOES_COLOR, GOES_SIZE

if TYPE_CHECKING:
    from .state import StudioState
    from .view import StudioView

REMOVE_WAYS = {
    "Mark": "then hold Shift and drag a rectangle on the drawing, as often as you like",
    "Unmark all": "marks no point any more",
    "Remove": "takes the marked points, drawn in red, away",
}


class RemoveTool:
    """Marks points by rectangles, removes them, and takes them again."""

    def __init__(self, view: StudioView, gui: Any) -> None:
        self.view = view
        ways = view.rows.add("points", REMOVE_WAYS)
        self.about = gui.add_markdown("")
        restore = gui.add_button("Take them again", hint="all points that were removed by hand")
        self._marked: np.ndarray | None = None
        self._listens = False
        steps = dict(zip(REMOVE_WAYS, (self._start, self._unmark, self._remove), strict=True))
        ways.on_click(view.chosen(lambda way: steps[way]()))
        restore.on_click(view.step(view.session.restore_points))

    def _start(self) -> None:
        if self.view.session.cloud is None:
            raise InputError("there is no scan yet; open one")
        self.view.scan.draws.value = True
        self.view.scan.draw()
        if not self._listens:
            self.view.client.scene.on_rect_select(modifier="shift")(self.view.in_order(self._dragged))
            self._listens = True
        self.view.say("hold Shift and drag a rectangle over the points that are to go")

    def _dragged(self, event: Any) -> None:
        self.view.do(lambda: self._mark(np.array([event.screen_min, event.screen_max])))

    def _mark(self, ends: np.ndarray) -> None:
        cloud = self.view.session.cloud
        if cloud is None:
            raise InputError("there is no scan yet; open one")
        places = self.view.frame.to_scene(cloud.points + cloud.origin)
        inside = seen_within(places, self.view.client.camera, np.sort(ends, axis=0))
        self._marked = inside if self._marked is None else self._marked | inside
        self._show()

    def _unmark(self) -> None:
        self._marked = None
        self._show()

    def _remove(self) -> None:
        cloud = self.view.session.cloud
        marked = self._marked if self._marked is not None and cloud is not None else np.zeros(0, np.bool_)
        self.view.session.remove_points(marked)
        self._unmark()
        if self._listens:
            self.view.client.scene.remove_rect_select_callback("all")
            self._listens = False

    def _show(self) -> None:
        state = self.view.session.state
        removed = 0 if state.removed is None else int(state.removed.sum())
        words = [f"{removed:,} points were removed"] if removed else []
        if self._marked is None or state.cloud is None:
            self.view.scene.remove("/marked")
        else:
            places = self.view.frame.to_scene(state.cloud.points[self._marked] + state.cloud.origin)
            self.view.scene.points("/marked", places, GOES_COLOR, GOES_SIZE)
            words.append(f"**{int(self._marked.sum()):,} points are marked**")
        self.about.content = "; ".join(words)

    def fill(self, before: StudioState | None, state: StudioState) -> None:
        """Show what was removed of a state."""
        if before is None or before.cloud is not state.cloud or before.removed is not state.removed:
            self._marked = None
            self._show()


def seen_within(places: np.ndarray, camera: Any, ends: np.ndarray) -> np.ndarray:
    """Return which places (N, 3) of the scene a camera sees within a rectangle (2, 2), x and y from 0 to 1, y downwards."""
    w, x, y, z = np.array(camera.wxyz, float)
    turn = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    right, down, ahead = ((places - np.array(camera.position)) @ turn).T
    with np.errstate(divide="ignore", invalid="ignore"):
        half = np.tan(0.5 * float(camera.fov))
        at = np.stack([right / ahead / (half * float(camera.aspect)), down / ahead / half], axis=1)
        at = 0.5 + 0.5 * at
        inside: np.ndarray = (ahead > 0) & (at >= ends[0]).all(axis=1) & (at <= ends[1]).all(axis=1)
    return inside
