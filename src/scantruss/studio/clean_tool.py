"""Clean the scan: the points that would go are shown in red before they go."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from .scan_parts import Cleaning

if TYPE_CHECKING:
    from .state import StudioState
    from .view import StudioView

GOES_COLOR = np.array((214, 20, 20), np.uint8)
GOES_SIZE = 0.06  #: of a point that goes [scene]


class CleanTool:
    """Proposes a cleaning and does it."""

    def __init__(self, view: StudioView, gui: Any) -> None:
        self.view = view
        self.distance = gui.add_text(
            "outliers", "3", hint="points so many times farther from others than usual; 0: none"
        )
        self.pieces = gui.add_text(
            "loose pieces", "0.005", hint="detached pieces below this share of all points; 0: none"
        )
        buttons = view.rows.add(
            "red", {"Show what goes": "in red, duplicates too; nothing goes yet", "Keep all": "nothing is red any more"}
        )
        self.about = gui.add_markdown("")
        view.corrects(self.distance, self.pieces)
        remove = gui.add_button("Remove what is red")
        self._drawn: Cleaning | None = None
        buttons.on_click(view.chosen(lambda way: self._show() if way == "Show what goes" else self._keep()))
        remove.on_click(view.step(view.session.clean))

    def _show(self) -> None:
        numbers = []
        for text in (self.distance, self.pieces):
            try:
                numbers.append(float(text.value))
            except ValueError:
                raise InputError(f"{text.label} needs a number, got {text.value!r}") from None
        self.view.session.propose_cleaning(*numbers)
        self.view.scan.draws.value = True
        self.view.scan.draw()

    def _keep(self) -> None:
        self.view.session.forget_cleaning()

    def fill(self, _before: StudioState | None, state: StudioState) -> None:
        """Show what is proposed."""
        found = self.view.session.proposed()
        if found is self._drawn and found is not None:
            return
        self._drawn = found
        if found is None or state.cloud is None:
            self.view.scene.remove("/goes")
            done = state.cleaning
            self.about.content = "" if done is None else f"removed: {'; '.join(done.words) or 'as before'}"
            return
        places = self.view.frame.to_scene(state.cloud.points[found.removes] + state.cloud.origin)
        self.view.scene.points("/goes", places, GOES_COLOR, GOES_SIZE)
        self.about.content = f"**{int(found.removes.sum()):,} of {len(found.removes):,} points go**: " + (
            "; ".join(found.words) or "nothing to clean"
        )
