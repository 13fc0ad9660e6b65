"""Tab: choose the length of the members and what else steers the grid."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ..errors import InputError, decimal_comma_words
from ..settings.records import EFFORTS, PREFER
from .cells_tool import CellsTool, words_of_panels, words_of_planes
from .feature_list import FeatureList
from .length_brush import LengthBrush
from .rows_tool import RowsTool
from .scale import set_scale
from .trade_tool import TradeTool

if TYPE_CHECKING:
    from .state import StudioState
    from .view import StudioView

SLIDER_STEPS = 100
PREFERENCES = dict(zip(("both", "equal lengths", "regular panels"), PREFER, strict=True))  #: setting by its words
NO_WORDS = "&nbsp;"  #: of a paragraph


class DesignTab:
    """Length, figures of the grid, effort, holes and ridges."""

    def __init__(self, view: StudioView, gui: Any) -> None:
        self.view, session, step = view, view.session, view.step
        self.slider = gui.add_slider("length", 0.5, 2.0, 0.01, 1.0, hint="a quick grid is made while it moves")
        self.length = gui.add_text("exactly", "1", hint="any length, in the unit of the scan")
        tries = gui.add_button(
            "Try lengths", hint="makes quick grids until one passes, as scantruss info does, and takes its length"
        )
        self.figures = gui.add_markdown("")
        self.cells = CellsTool(view, gui)
        self.effort = gui.add_dropdown("effort", EFFORTS, hint="of Generate")
        self.prefer = gui.add_dropdown("prefer", tuple(PREFERENCES), hint="what matters more")
        with gui.add_folder("Holes and ridges", expand_by_default=False):
            self.features = FeatureList(view, gui)
        with gui.add_folder("Direction of rows", expand_by_default=False):
            self.rows = RowsTool(view, gui)
        with gui.add_folder("Length brush", expand_by_default=False):
            self.brush = LengthBrush(view, gui)
        with gui.add_folder("Few different parts", expand_by_default=False):
            self.trade = TradeTool(view, gui)
        self.slider.on_update(view.slid(self._slide))
        view.typed(self.length, self._typed)
        tries.on_click(step(session.try_lengths))
        self.effort.on_update(step(lambda: session.set_quietly("effort", effort=self.effort.value)))
        self.prefer.on_update(step(lambda: session.set("prefer", prefer=PREFERENCES[self.prefer.value])))

    def _slide(self) -> None:
        length = float(f"{self.slider.value:.4g}")
        self.view.show_text(self.length, f"{length:g}")
        self.view.session.live(length)

    def _typed(self) -> None:
        try:
            length = float(self.length.value)
        except ValueError:
            text = self.length.value
            raise InputError(f"length needs a number, got {text!r}{decimal_comma_words(text)}") from None
        self.view.session.set_length(length)

    def fill(self, before: StudioState | None, state: StudioState) -> None:
        """Show a state."""
        session, cloud, settings = self.view.session, state.cloud, state.settings
        if cloud is not None and (before is None or before.cloud is not cloud):
            low, high = (float(f"{bound:.3g}") for bound in session.length_bounds())
            step = float(f"{(high - low) / SLIDER_STEPS or 1.0:.1g}")
            set_scale(self.slider, low, max(high, low + step), step)
        if before is None or before.settings is not settings or before.cloud is not cloud:
            length = float(f"{state.main_length:.9g}")
            if abs(self.slider.value - length) > 1e-9 * length:
                self.slider.value = min(max(length, self.slider.min), self.slider.max)
            self.effort.value = settings.effort
            self.prefer.value = next(words for words, name in PREFERENCES.items() if name == settings.prefer)
        if not session.message:  # else what was refused stands there
            self.view.show_text(self.length, f"{float(f'{state.main_length:.9g}'):g}")
        self._fill_grid(state)
        for part in (self.cells, self.features, self.rows, self.brush, self.trade):
            part.fill(before, state)

    def _fill_grid(self, state: StudioState) -> None:
        grid, unit = state.grid, f" {state.grid.unit}" if state.grid is not None and state.grid.unit else ""
        if grid is None:
            self.figures.content = "\n\n".join(
                ["no grid yet", *[NO_WORDS] * 2]
            )  # nothing below it moves when there is one
            return
        quality, certificate = grid.quality, grid.certificate
        quick = " (quick preview)" if state.is_live else ""
        if state.is_stale and self.view.session.message:  # which stands where this is said else
            quick = " (before the last change)"
        self.figures.content = (
            f"{len(grid.nodes):,} nodes, {len(grid.edges):,} members{words_of_panels(grid)}{quick}\n\n"
            f"length {quality.length_mean:.4g}{unit}, std/mean {quality.length_cv:.4f}; shape {quality.shape_mean:.4f}, 1 is regular"
            f"{words_of_planes(grid)}"
        )
        if certificate is None:
            self.figures.content += f"\n\n{NO_WORDS}"
        else:
            count = len(certificate.warnings)
            warned = f" with {count} warning{'s' * (count > 1)}: Grid, Certificate" if count else ""
            self.figures.content += (
                f"\n\ncertificate: passed{warned}" if certificate.passed else "\n\ncertificate: **failed**"
            )
