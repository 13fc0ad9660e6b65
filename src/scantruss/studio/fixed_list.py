"""Fixed nodes: placed by a click, typed, dragged, deleted."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError, words_of_number, words_of_place
from .dragging import DraggedBalls
from .drawn_lines import clicked_point, numbers_of
from .frame import SceneFrame
from .picking import nearest_point

if TYPE_CHECKING:
    from .state import StudioState
    from .view import StudioView

FIXED_COLOR = np.array((230, 97, 1), np.uint8)
FIXED_RADIUS = 0.1  #: of a fixed node that is drawn [scene]
NONE_CHOSEN = "-"
FIX_MODE = "place fixed node"
FIX_WAYS = {
    "Add": "a fixed node at x, y, z",
    "Move": "the chosen node to x, y, z",
    "Delete": "the chosen node",
}


class FixedNodes:
    """The list of fixed nodes, and the balls by which they are dragged."""

    def __init__(self, view: StudioView, gui: Any) -> None:
        self.view = view
        by_click = gui.add_button(
            "Place by clicks",
            hint="then click on the scan, near a corner of its boundary for the corner; drag a ball to move it",
        )
        self.chosen = gui.add_dropdown("node", (NONE_CHOSEN,))
        self.words = gui.add_text("x, y, z", "", hint="in the frame of the scan, in its unit")
        ways = view.rows.add("typed node", FIX_WAYS)
        self._balls = DraggedBalls(view, "/fixed", lambda number, place: self._set(tuple(place.tolist()), number))
        view.corrects(self.words)
        by_click.on_click(view.step(lambda: setattr(view.click, "value", FIX_MODE)))
        view.modes[FIX_MODE] = self.place
        self.chosen.on_update(view.step(self._choose))
        ways.on_click(view.chosen(self._do))

    def _do(self, way: str) -> None:
        if way == "Delete":
            self._delete()
        else:
            self._set(self._typed(), len(self._fixed) if way == "Add" else self._number())

    @property
    def _fixed(self) -> tuple[tuple[float, ...], ...]:
        return tuple(tuple(place) for place in self.view.session.settings.fixed)

    def _number(self) -> int:
        if self.chosen.value == NONE_CHOSEN:
            raise InputError("choose a fixed node first")
        return int(self.chosen.value.partition(":")[0]) - 1

    def _typed(self) -> tuple[float, ...]:
        x, y, z = numbers_of(self.words.value, 3, "a fixed node needs three numbers x, y, z")
        return x, y, z

    def _set(self, place: tuple[float, ...], number: int) -> None:
        fixed = list(self._fixed)
        fixed[number : number + 1] = [place]
        self.view.session.fix(tuple(fixed))
        self._show(number)

    def _delete(self) -> None:
        number = self._number()
        self.view.session.fix(tuple(each for k, each in enumerate(self._fixed) if k != number), "delete fixed node")

    def place(self, origin: np.ndarray, ahead: np.ndarray) -> None:
        """Place a fixed node on the scan under a ray of the scene, or choose the one that is there."""
        frame = self.view.frame
        places = frame.to_scene(np.array(self._fixed).reshape(-1, 3)) if self._fixed else np.zeros((0, 3), np.float32)
        if len(places) and (there := nearest_point(places, origin, ahead)) is not None:
            self._show(there)
            return
        place = clicked_point(self.view, origin, ahead)
        corner = self.view.session.corner_near(place)
        if corner is not None:
            if (known := next((k for k, one in enumerate(self._fixed) if np.allclose(one, corner)), None)) is not None:
                self._show(known)
                return
            cloud = self.view.session.cloud
            unit = f" {cloud.unit}" if cloud is not None and cloud.unit else ""
            away = words_of_number(float(np.linalg.norm(corner - place)), 2) + unit
            self.view.say(
                f"placed on the corner of the boundary, {away} off the click; drag the ball, or type, to have it elsewhere"
            )
            place = corner
        self._set(tuple(float(f"{c:.12g}") for c in place.tolist()), len(self._fixed))

    def _choose(self) -> None:
        self._show(self._number() if self.chosen.value != NONE_CHOSEN else -1)

    def _show(self, number: int) -> None:
        """Choose a fixed node."""
        options = self.chosen.options
        self.chosen.value = options[number] if 0 <= number < len(options) and options[0] != NONE_CHOSEN else options[0]
        if 0 <= number < len(self._fixed):
            self.words.value = ", ".join(f"{c:.10g}" for c in self._fixed[number])

    def fill(self, before: StudioState | None, state: StudioState) -> None:
        """Show the fixed nodes of a state."""
        if before is not None and before.settings.fixed == state.settings.fixed and before.cloud is state.cloud:
            return
        fixed = state.settings.fixed
        kept = self.chosen.value.partition(":")[0]
        words = tuple(f"{k}: {words_of_place(place)}" for k, place in enumerate(fixed, 1))
        self.chosen.options = words or (NONE_CHOSEN,)
        if state.cloud is not None:
            places = np.array(fixed, float).reshape(-1, 3)
            self._balls.show(SceneFrame.of(state.cloud).to_scene(places), FIXED_COLOR, FIXED_RADIUS)
        self._show(int(kept) - 1 if kept.isdecimal() else -1)
