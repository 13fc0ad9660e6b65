"""Fixed lines: drawn on the scan by clicks or typed; each becomes a chain of members."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from .drawn_lines import clicked_point, points_of, scanned_points
from .fixed_list import NONE_CHOSEN
from .frame import SceneFrame

if TYPE_CHECKING:
    from .state import StudioState
    from .view import StudioView

DRAW_MODE = "draw line"
LINE_COLOR, CHOSEN_LINE_COLOR = (178, 24, 120), (230, 97, 1)
DRAWN_LINE_WIDTH = 6.0  #: of a fixed line [pixel]
SIGNIFICANT_OF_LINE = 9  #: digits of a coordinate of a line
TYPED_WAYS = {"Add": "the points above, as another line", "Delete": "the line that is chosen above"}
LINE_WAYS = {
    "Finish": "the line ends at its last point",
    "Close": "back to its first point",
    "Drop point": "the last one goes",
}


class LineList:
    """The fixed lines, and the one that is being drawn."""

    def __init__(self, view: StudioView, gui: Any) -> None:
        self.view = view
        draw = gui.add_button(
            "Draw by clicks", hint="then click points on the scan; the line follows the scan between them"
        )
        ways = view.rows.add("line", LINE_WAYS)
        self.words = gui.add_text("points", "", hint="x, y, z; x, y, z; ... in the frame of the scan, in its unit")
        self.chosen = gui.add_dropdown("lines", (NONE_CHOSEN,))
        typed = view.rows.add("typed line", TYPED_WAYS)
        self._points: list[np.ndarray] = []
        self._count = 0
        view.corrects(self.words)
        draw.on_click(view.step(self._begin))
        ways.on_click(view.chosen(self._go_on))
        typed.on_click(view.chosen(self._typed))
        self.chosen.on_update(view.step(lambda: self._draw(view.session.state)))
        view.modes[DRAW_MODE] = self._click

    def _typed(self, way: str) -> None:
        if way == "Add":
            self._add(np.array(points_of(self.words.value)))
        else:
            self._delete()

    def _begin(self) -> None:
        scanned_points(self.view.session)
        self._points = []
        self.view.click.value = DRAW_MODE
        self._show_points()

    def _click(self, origin: np.ndarray, ahead: np.ndarray) -> None:
        self._points.append(clicked_point(self.view, origin, ahead))
        self._show_points()

    def _go_on(self, way: str) -> None:
        if way == "Drop point":
            self._points = self._points[:-1]
            self._show_points()
            return
        if len(self._points) < 2 + (way == "Close"):
            raise InputError("a line needs two points, a closed one three; click on the scan")
        self._add(np.array([*self._points, *self._points[: way == "Close"]]))

    def _show_points(self) -> None:
        """Draw the line that is being drawn."""
        scene = self.view.scene
        scene.remove("/drawn", "/drawn points")
        if self._points:
            places = np.array(self._points)
            scene.points("/drawn points", self.view.frame.to_scene(places), np.array(CHOSEN_LINE_COLOR, np.uint8), 0.12)
            if len(places) > 1:
                over = scanned_points(self.view.session).along(places, self.view.session.settings.length)
                scene.chain("/drawn", self.view.frame.to_scene(over), False, CHOSEN_LINE_COLOR, DRAWN_LINE_WIDTH)

    def _add(self, points: np.ndarray) -> None:
        """Add a line through points (K, 3) over the scan."""
        if len(points) < 2:
            raise InputError("a line needs two points at least")
        session = self.view.session
        over = scanned_points(self.view.session).along(points, session.settings.length)
        line = tuple(tuple(float(f"{c:.{SIGNIFICANT_OF_LINE}g}") for c in place) for place in over.tolist())
        names = session.settings.line_names
        if names:
            names = (*names, f"line {len(names) + 1}")
        session.set("fixed line", fixed_lines=(*session.settings.fixed_lines, line), line_names=names)
        self._points = []
        self._show_points()

    def _number(self) -> int:
        if self.chosen.value == NONE_CHOSEN:
            raise InputError("there is no line yet; draw one")
        return int(self.chosen.value.partition(":")[0]) - 1

    def _delete(self) -> None:
        number, settings = self._number(), self.view.session.settings
        lines, names = (
            tuple(each for k, each in enumerate(own) if k != number)
            for own in (settings.fixed_lines, settings.line_names)
        )
        self.view.session.set("delete fixed line", fixed_lines=lines, line_names=names)

    def fill(self, before: StudioState | None, state: StudioState) -> None:
        """Show the fixed lines of a state."""
        lines = state.settings.fixed_lines
        if before is not None and before.settings.fixed_lines == lines and before.cloud is state.cloud:
            return
        if before is not None and before.cloud is not state.cloud:
            self._points = []
        unit = f" {state.cloud.unit}" if state.cloud is not None and state.cloud.unit else ""
        sizes = [np.linalg.norm(np.diff(np.array(line), axis=0), axis=1).sum() for line in lines]
        self.chosen.options = tuple(f"{k}: {size:.4g}{unit} long" for k, size in enumerate(sizes, 1)) or (NONE_CHOSEN,)
        self._draw(state)

    def _draw(self, state: StudioState) -> None:
        lines, scene = state.settings.fixed_lines if state.cloud is not None else (), self.view.scene
        scene.remove(*(f"/lines/{k}" for k in range(len(lines), self._count)))
        self._count = len(lines)
        chosen = self.chosen.value.partition(":")[0]
        for k, line in enumerate(lines):
            assert state.cloud is not None
            places = SceneFrame.of(state.cloud).to_scene(np.array(line))
            color = CHOSEN_LINE_COLOR if chosen == str(k + 1) and len(lines) > 1 else LINE_COLOR
            scene.chain(f"/lines/{k}", places, False, color, DRAWN_LINE_WIDTH)
