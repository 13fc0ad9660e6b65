"""Tab: open a scan, choose what is taken of it, clean it, measure it."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from ..grid.upward import guessed_up
from ..settings import UNITS
from .clean_tool import CleanTool
from .colours import CLASS_NAMES, MOST_CLASSES, OWN_COLORS, SCAN_COLOURINGS, colorings_of_scan
from .crop_tool import CropTool
from .left_out import words_left_out, words_on_page
from .opening import EXAMPLES
from .remove_tool import RemoveTool
from .scan_parts import UP_AXES
from .tape import Tape

if TYPE_CHECKING:
    from .state import StudioState
    from .view import StudioView

UNKNOWN_UNIT = "not known"


class ScanTab:
    """The scan: where it comes from, how it is drawn, and what is taken of it."""

    def __init__(self, view: StudioView, gui: Any) -> None:
        self.view, session, step = view, view.session, view.step
        upload = gui.add_upload_button(
            "Open a scan or project",
            hint="or drop a file on the page, also a grid saved as .json over its scan; at most 500 MB, a larger one by its path",
        )
        with gui.add_folder("Open a path or an example", expand_by_default=session.cloud is None):
            self.path = gui.add_text("path", "", hint="of a file in the folder of the project")
            by_path = gui.add_button("Open the path")
            self.example = gui.add_dropdown("example", tuple(EXAMPLES))
            opened = gui.add_button("Open the example")
        self.about, self.left_out = gui.add_markdown(""), gui.add_markdown("", visible=False)
        self.unit = gui.add_dropdown("unit", tuple(name or UNKNOWN_UNIT for name in UNITS), initial_value=UNKNOWN_UNIT)
        self.up = gui.add_dropdown(
            "up",
            tuple(UP_AXES),
            hint="axis of the file that points up: of a scan that lies on its side, y or x; what was placed goes",
        )
        self.seems = gui.add_markdown("", visible=False)
        self.draws = gui.add_checkbox("draw scan", True)
        self.coloring = gui.add_dropdown("colour", SCAN_COLOURINGS)
        with gui.add_folder("Crop", expand_by_default=False):
            self.crop = CropTool(view, gui)
        self._classes = gui.add_folder("Classes", expand_by_default=False, visible=False)
        with gui.add_folder("Clean", expand_by_default=False):
            self.clean = CleanTool(view, gui)
        with gui.add_folder("Remove by hand", expand_by_default=False):
            self.remove = RemoveTool(view, gui)
        with gui.add_folder("Tape", expand_by_default=False):
            self.tape = Tape(view, gui)
        self._gui, self._boxes = gui, dict[int, Any]()
        upload.on_upload(view.chosen(lambda file: session.open_upload(file.name, file.content)))
        view.corrects(self.path)
        by_path.on_click(step(lambda: session.open_path(self.path.value)))
        opened.on_click(step(lambda: session.open_example(self.example.value)))
        self.unit.on_update(step(lambda: session.set_unit("" if self.unit.value == UNKNOWN_UNIT else self.unit.value)))
        self.up.on_update(step(lambda: session.turn(self.up.value)))
        self._is_set = False  # whether a person has said if the scan is drawn
        self.draws.on_update(step(self._set_drawn))
        self.coloring.on_update(step(self.draw))

    def fill(self, before: StudioState | None, state: StudioState) -> None:
        """Show a state."""
        cloud = state.cloud
        unit = f" {cloud.unit}" if cloud is not None and cloud.unit else ""
        if cloud is None:
            self.about.content = "Open a scan: any format that `scantruss info` reads."
        elif before is None or before.cloud is not cloud:
            place = self.view.session.place
            saved = f"; saved as {place.name} after each step" if place is not None else "; not saved"
            whole = len(cloud.points) if state.whole is None else len(state.whole.cloud.points)
            of_all = f" of {whole:,}" if whole != len(cloud.points) else ""
            self.about.content = f"**{cloud.name or 'scan'}**: {len(cloud.points):,}{of_all} points, {cloud.extent:.4g}{unit} long{saved}"
            self.unit.value = cloud.unit or UNKNOWN_UNIT
        if before is None or before.cloud is not cloud or before.grid is not state.grid:
            lines = words_left_out(state)
            self.left_out.content, self.left_out.visible = words_on_page(lines), bool(lines)
            seems = axis_that_seems_up(state)
            self.seems.content, self.seems.visible = (
                f"its shape tells that **{seems}** is up; choose that here",
                bool(seems),
            )
        self.up.value = "z" if state.whole is None else state.whole.up
        if before is None or before.whole is not state.whole or before.settings.classes != state.settings.classes:
            self._fill_classes(state)
        if before is None or before.whole is not state.whole:
            known = colorings_of_scan(state)
            kept = self.coloring.value
            self.coloring.options = known
            is_new = before is None or before.whole is None or before.whole.colors is None
            self.coloring.value = known[0] if (is_new and known[0] == OWN_COLORS) or kept not in known else kept
        for tool in (self.crop, self.clean, self.remove, self.tape):
            tool.fill(before, state)
        if before is None or before.cloud is not cloud or before.grid is not state.grid:
            if not self._is_set:
                self.draws.value = state.grid is None  # it hides the grid
            self.draw()

    def _set_drawn(self) -> None:
        self._is_set = True
        self.draw()

    def _fill_classes(self, state: StudioState) -> None:
        held = () if state.whole is None else state.whole.held_classes
        if tuple(self._boxes) != held:
            for box in self._boxes.values():
                box.remove()
            self._classes.visible = len(held) > 1
            with self._classes:
                self._boxes = {number: self._box(number) for number in held[:MOST_CLASSES]}
        for number, box in self._boxes.items():
            box.value = not state.settings.classes or number in state.settings.classes

    def _box(self, number: int) -> Any:
        box = self._gui.add_checkbox(f"{number} {CLASS_NAMES.get(number, '')}".strip(), True)
        box.on_update(self.view.step(partial(self._choose_classes)))
        return box

    def _choose_classes(self) -> None:
        self.view.session.choose_classes(tuple(number for number, box in self._boxes.items() if box.value))

    def draw(self) -> None:
        """Draw the scan."""
        state = self.view.session.state
        if state.cloud is None or not self.draws.value:
            self.view.scene.remove_scan()
            self.view.legends.show("scan", None)
            return
        self.view.legends.show("scan", self.view.scene.scan(state, self.coloring.value, self.view.look.section))


def axis_that_seems_up(state: StudioState) -> str:
    """Return the axis of the file that the shape of the grid tells is up, where it is not the one that was chosen; else ""."""
    if state.grid is None or not (guess := guessed_up(state.grid, state.cloud)):
        return ""
    axis = (-1 if guess.startswith("-") else 1) * np.eye(3)["xyz".index(guess[-1])]
    in_file = axis @ np.array(UP_AXES["z" if state.whole is None else state.whole.up], float)
    return next(name for name, rows in UP_AXES.items() if np.allclose(rows[2], in_file))
