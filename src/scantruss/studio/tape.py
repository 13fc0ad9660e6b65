"""A measuring tape between two clicks on the scan or the grid."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from .frame import SceneFrame
from .picking import nearest_point, place_on_scan

if TYPE_CHECKING:
    from .state import StudioState
    from .view import StudioView

TAPE_MODE = "measure"
TAPE_COLOR = (120, 20, 140)


class Tape:
    """Measures from the first of two clicks to the second."""

    def __init__(self, view: StudioView, gui: Any) -> None:
        self.view = view
        measure = gui.add_button("Measure", hint="then click two points of the scan, or nodes of the grid")
        self.said = gui.add_markdown("", visible=False)
        self._begin: np.ndarray | None = None
        measure.on_click(view.step(self._start))
        view.modes[TAPE_MODE] = self._clicked

    def _start(self) -> None:
        self._begin = None
        self.view.scene.remove("/tape end")
        self.view.click.value = TAPE_MODE
        self.view.session.measure(())
        self._say("click two points")

    def _say(self, words: str) -> None:
        self.said.visible, self.said.content = bool(words), words

    def _clicked(self, origin: np.ndarray, ahead: np.ndarray) -> None:
        """Take the node or the point of the scan under a click."""
        at = self._place(origin, ahead)
        if at is None:
            raise InputError("nothing to measure is there; click on a point of the scan or a node of the grid")
        if self._begin is None:
            self._begin = at
            self.view.scene.points("/tape end", at[None].astype(np.float32), np.array(TAPE_COLOR, np.uint8), 0.12)
            return
        ends, self._begin = self.view.frame.from_scene(np.stack([self._begin, at])), None
        self.view.session.measure(tuple(tuple(float(f"{c:.9g}") for c in end) for end in ends.tolist()))

    def _place(self, origin: np.ndarray, ahead: np.ndarray) -> np.ndarray | None:
        """Return the place in the scene: of a node, rather than of a point of the scan."""
        shown = self.view.shown_model()
        if shown is not None:
            places = self.view.places(shown[0])
            if (node := nearest_point(places, origin, ahead)) is not None:
                return np.asarray(places[node], float)
        cloud = self.view.session.cloud
        assert cloud is not None
        return place_on_scan(self.view.frame.to_scene(cloud.points + cloud.origin), origin, ahead)

    def fill(self, before: StudioState | None, state: StudioState) -> None:
        """Show the tape of a state."""
        if before is not None and before.tape == state.tape and before.cloud is state.cloud:
            return
        self._begin = None
        scene = self.view.scene
        scene.remove("/tape", "/tape end", "/tape length")
        if state.cloud is None or not state.tape:
            self._say("")
            return
        ends = np.array(state.tape, float)
        places, way = SceneFrame.of(state.cloud).to_scene(ends), ends[1] - ends[0]
        unit = f" {state.cloud.unit}" if state.cloud.unit else ""
        length = f"{np.linalg.norm(way):.4g}{unit}"
        scene.lines("/tape", places[None], np.array(TAPE_COLOR, np.uint8), 5.0)
        scene.api.add_label(
            "/tape length", length, position=tuple(places.mean(axis=0).tolist()), anchor="bottom-center"
        )
        across = ", ".join(f"{name} {part:.4g}" for name, part in zip("xyz", way.tolist(), strict=True))
        self._say(f"**{length}** ({across}; in plan {np.linalg.norm(way[:2]):.4g})")
