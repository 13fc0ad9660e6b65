"""A measuring tape between two clicks on the scan or the grid."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
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
        self.view.scene.remove("/tape", "/tape end", "/tape length")
        self.view.click.value, self.said.visible = TAPE_MODE, True
        self.said.content = "click two points"

    def _clicked(self, origin: np.ndarray, ahead: np.ndarray) -> None:
        """Take the node or the point of the scan under a click."""
        at = self._place(origin, ahead)
        if at is None:
            raise InputError("nothing to measure is there; click on a point of the scan or a node of the grid")
        scene = self.view.scene
        if self._begin is None:
            self._begin = at
            scene.remove("/tape", "/tape length")
            scene.points("/tape end", at[None].astype(np.float32), np.array(TAPE_COLOR, np.uint8), 0.12)
            return
        ends, self._begin = np.stack([self._begin, at]), None
        way = np.diff(self.view.frame.from_scene(ends), axis=0)[0]
        cloud = self.view.session.cloud
        unit = f" {cloud.unit}" if cloud is not None and cloud.unit else ""
        length = f"{np.linalg.norm(way):.4g}{unit}"
        scene.lines("/tape", ends[None], np.array(TAPE_COLOR, np.uint8), 5.0)
        scene.api.add_label("/tape length", length, position=tuple(ends.mean(axis=0).tolist()))
        across = ", ".join(f"{name} {part:.4g}" for name, part in zip("xyz", way.tolist(), strict=True))
        self.said.visible, self.said.content = True, f"**{length}** ({across}; in plan {np.linalg.norm(way[:2]):.4g})"

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
        """Put the tape away where the scan is another one."""
        if before is not None and before.cloud is not state.cloud:
            self._begin, self.said.content = None, ""
            self.view.scene.remove("/tape", "/tape end", "/tape length")
