"""The direction of the rows: an arrow on the scan, drawn by two clicks, whose ends are dragged."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .dragging import DraggedBalls
from .drawn_lines import ScannedPoints, clicked_point, numbers_of
from .frame import SceneFrame
from .scene import barbed

if TYPE_CHECKING:
    from .state import StudioState
    from .view import StudioView

ROWS_MODE = "arrow of rows"
ROWS_COLOR = (0, 110, 120)
ROWS_WIDTH = 5.0  #: of the arrow [pixel]
ROWS_RADIUS = 0.12  #: of the balls at the ends of the arrow [scene]


class RowsTool:
    """Draws the arrow along which the rows of members run."""

    def __init__(self, view: StudioView, gui: Any) -> None:
        self.view = view
        draw = gui.add_button(
            "Draw an arrow", hint="then click two points of the scan; drag the balls at its ends to turn it"
        )
        self.words = gui.add_text(
            "arrow", "", hint="x, y, z, dx, dy, dz: a place on the scan and a direction; empty: none"
        )
        none = gui.add_button("No arrow")
        self._begin: np.ndarray | None = None
        self._balls = DraggedBalls(view, "/rows ends", self._drop, self._show)
        draw.on_click(view.step(self._start))
        none.on_click(view.step(lambda: view.session.set("no arrow", rows_along=())))
        view.typed(self.words, self._typed)
        view.modes[ROWS_MODE] = self._click

    def _start(self) -> None:
        self._begin = None
        self.view.click.value = ROWS_MODE
        self.view.say("click where the arrow begins, then where it ends")

    def _click(self, origin: np.ndarray, ahead: np.ndarray) -> None:
        place = clicked_point(self.view, origin, ahead)
        if self._begin is None:
            self._begin = place
            at = self.view.frame.to_scene(place[None])
            self.view.scene.points("/rows", at, np.array(ROWS_COLOR, np.uint8), 0.12)
            self.view.say("now click where the arrow ends")
            return
        begin, self._begin = self._begin, None
        self.view.click.value = self.view.clicks[0]
        self._set(begin, place)

    def _set(self, begin: np.ndarray, end: np.ndarray) -> None:
        arrow = tuple(float(f"{number:.9g}") for number in (*begin.tolist(), *(end - begin).tolist()))
        self.view.session.set("arrow of rows", rows_along=arrow)

    def _typed(self) -> None:
        text = self.words.value.strip()
        arrow = numbers_of(text, 6, "an arrow needs six numbers x, y, z, dx, dy, dz") if text else ()
        self.view.session.set("arrow of rows", rows_along=arrow)

    def _with(self, number: int, place: np.ndarray) -> np.ndarray:
        """Return both ends of the arrow (2, 3) with one of them at another place [scan unit]."""
        arrow = np.array(self.view.session.settings.rows_along, float)
        ends = np.stack([arrow[:3], arrow[:3] + arrow[3:]])
        ends[number] = place
        return ends

    def _show(self, number: int, place: np.ndarray) -> None:
        ends = self.view.frame.to_scene(self._with(number, place))
        self.view.scene.chain("/rows arrow", ends, False, ROWS_COLOR, ROWS_WIDTH)

    def _drop(self, number: int, place: np.ndarray) -> None:
        begin, end = self._with(number, place)
        self._set(begin, end)

    def fill(self, before: StudioState | None, state: StudioState) -> None:
        """Show the arrow of a state."""
        arrow = tuple(state.settings.rows_along)
        if before is not None and tuple(before.settings.rows_along) == arrow and before.cloud is state.cloud:
            return
        self.view.show_text(self.words, ", ".join(f"{number:.7g}" for number in arrow))
        self.view.scene.remove("/rows", "/rows arrow", "/rows ends")
        if not arrow or state.cloud is None:
            return
        ends = SceneFrame.of(state.cloud).to_scene(np.array([arrow[:3], np.add(arrow[:3], arrow[3:])]))
        over = ScannedPoints.of(state.cloud, state.settings).along(
            np.array([arrow[:3], np.add(arrow[:3], arrow[3:])]), state.settings.length
        )
        line = SceneFrame.of(state.cloud).to_scene(over)
        head = barbed(line[-1:], line[-1:] - line[-2:-1])
        segments = np.concatenate([np.stack([line[:-1], line[1:]], axis=1), head])
        self.view.scene.lines("/rows arrow", segments, np.array(ROWS_COLOR, np.uint8), ROWS_WIDTH)
        self._balls.show(ends, np.array(ROWS_COLOR, np.uint8), ROWS_RADIUS)
