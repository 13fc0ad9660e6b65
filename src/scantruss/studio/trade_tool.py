"""Few different parts: the trade between their number and what it costs, as a curve on which a number is clicked."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from ..grid.alike import JOINTS, LENGTHS, WHAT_IS_ALIKE

if TYPE_CHECKING:
    from .state import StudioState, Trade
    from .view import StudioView

NUMBER_FIELD = "at most"  #: label of the field that a click on the curve fills
CURVE_WIDTH, CHART_HEIGHT, CHART_GAP, CHART_MARGIN = 400, 76, 30, 50  #: of the charts [pixel]
LEAST_BETWEEN_TICKS = 24  #: numbers of lengths or kinds below the curve [pixel]
CURVE_COLOR, PLAIN_COLOR, PRESENT_COLOR = "#1c7ed6", "#868e96", "#e8590c"


class TradeTool:
    """Finds the trade, draws it, and takes the grid of a number."""

    def __init__(self, view: StudioView, gui: Any) -> None:
        self.view = view
        self.parts = gui.add_dropdown("fewer", WHAT_IS_ALIKE, hint="different lengths of members, joints or panels")
        self.tolerance = gui.add_text(
            "tolerance",
            "1%",
            hint="parts within it of each other are made the same: largest misfit over the mean member; of joints that of unit directions",
        )
        self.mirrored = gui.add_checkbox(
            "mirror images equal", False, visible=False, hint="as flat panels are that may be turned over"
        )
        find = gui.add_button(
            "Find what fewer cost", hint="takes a minute or some, joints and panels longest; Stop ends it"
        )
        self.curve = gui.add_html("")
        self.number = gui.add_text(NUMBER_FIELD, "", visible=False, hint="lengths or kinds; or click on the curve")
        self.about = gui.add_markdown("", visible=False)
        self._drawn: tuple[Any, ...] = ()
        self.parts.on_update(view.step(self._choose))
        view.corrects(self.tolerance)
        find.on_click(view.step(self._find))
        view.typed(self.number, self._take)

    def _choose(self) -> None:
        self.mirrored.visible = self.parts.value != LENGTHS

    def _find(self) -> None:
        text = self.tolerance.value.strip()
        try:
            tolerance = float(text.removesuffix("%")) / (100.0 if text.endswith("%") else 1.0)
        except ValueError:
            raise InputError(f"tolerance needs a share such as 1%, got {text!r}") from None
        parts = self.parts.value
        self.view.session.find_trade(parts, tolerance, mirrored=bool(self.mirrored.value) and parts != LENGTHS)

    def _take(self) -> None:
        text = self.number.value.strip()
        if not text:
            return
        if not text.isdecimal() or int(text) < 1:
            raise InputError(f"{NUMBER_FIELD} needs a number of lengths or kinds, got {text!r}")
        self.view.session.take_traded(int(text))

    def fill(self, _before: StudioState | None, state: StudioState) -> None:
        """Show the trade of the grid of a state."""
        trade = state.trade
        present = None if trade is None else present_number(state)
        self.view.show_text(self.number, "" if present is None else str(present))  # so that another press counts
        if self._drawn == (trade, state.grid):
            return
        if trade is not None and trade not in self._drawn:
            self.parts.value = trade.parts  # as of a project that was opened
            self._choose()
        self._drawn = (trade, state.grid)
        self.curve.content = "" if trade is None else curve_of(trade, present)
        self.number.visible = trade is not None
        self.about.content = "" if trade is None else words_of_present(trade, state)
        self.about.visible = bool(self.about.content)


def present_number(state: StudioState) -> int | None:
    """Return how many lengths or kinds were asked for of the grid of a state; None where it is the one before."""
    return None if state.grid is None or state.grid.alike is None else state.grid.alike.count


def words_of_present(trade: Trade, state: StudioState) -> str:
    """Return what the grid of a state costs, in words."""
    number = present_number(state)
    chosen = next((each for each in trade.traded if each.number == number), None)
    what = "lengths" if trade.parts == LENGTHS else f"kinds of {trade.parts}"
    if chosen is None:
        return f"the grid as it was: {trade.off_scan:.2g} members off the scan; click on the curve to take fewer {what}"
    return (
        f"**{chosen.number} {what}** within {100 * chosen.misfit:.3g} %, as it was within {100 * chosen.plain:.3g} %; nodes moved by"
        f" {chosen.moved:.2g} members at most, {chosen.off_scan or 0.0:.2g} off the scan; lengths std/mean {chosen.cv:.4f}"
    )


def curve_of(trade: Trade, present: int | None) -> str:
    """Return the trade as HTML: misfit, distance from the scan and evenness over the number; a click on a number asks for it."""
    numbers = np.array([each.number for each in trade.traded], float)
    low, high = float(numbers.min()), float(numbers.max())
    inner = CURVE_WIDTH - CHART_MARGIN - 14
    across = CHART_MARGIN + (inner * (numbers - low) / (high - low) if high > low else np.full(len(numbers), inner / 2))
    misfit = "directions" if trade.parts == JOINTS else "member"
    charts = (
        (f"largest misfit [% of the {misfit}], dashed as it was",
         [100 * each.misfit for each in trade.traded], [100 * each.plain for each in trade.traded]),
        ("farthest node off the scan [% of the member]",
         [100 * (each.off_scan or 0.0) for each in trade.traded], [100 * trade.off_scan] * len(numbers)),
        ("std/mean of the lengths", [each.cv for each in trade.traded], [trade.before.quality.length_cv] * len(numbers)),
    )  # fmt: skip
    height = len(charts) * (CHART_HEIGHT + CHART_GAP) + 20
    drawn = [_chart(across, k * (CHART_HEIGHT + CHART_GAP), *chart) for k, chart in enumerate(charts)]
    bottom, shown, order = height - 22, -np.inf, np.argsort(across)
    middles = 0.5 * (across[order][1:] + across[order][:-1])
    strips = zip(order.tolist(), [0.0, *middles.tolist()], [*middles.tolist(), float(CURVE_WIDTH)], strict=True)
    for k, left, right in strips:
        x, number = float(across[k]), trade.traded[k].number
        line = f'<line x1="{x:.1f}" x2="{x:.1f}" y1="14" y2="{bottom}" stroke="{PRESENT_COLOR}" stroke-width="2"/>'
        drawn.append(
            f'<g data-field="{NUMBER_FIELD}" data-low="{number}" data-high="{number}" role="button" tabindex="0"'
            f' aria-label="{number}" style="cursor:pointer"><title>{number}</title>{line if number == present else ""}'
            f'<rect x="{left:.1f}" y="0" width="{right - left:.1f}" height="{height}" fill="transparent"/></g>'
        )
        if x - shown >= LEAST_BETWEEN_TICKS:
            at = f'x="{x:.1f}" y="{height - 8}" text-anchor="middle" pointer-events="none"'
            drawn.append(f"<text {at}>{number}</text>")
            shown = x
    style = "width:100%;padding:0 .6em;font-size:11px"
    return f'<svg viewBox="0 0 {CURVE_WIDTH} {height}" style="{style}" fill="currentColor">{"".join(drawn)}</svg>'


def _chart(across: np.ndarray, top: float, words: str, values: list[float], plain: list[float]) -> str:
    """Return one chart as SVG, from nil on."""
    most = max(*values, *plain, 1e-12)
    base = top + CHART_GAP - 12 + CHART_HEIGHT

    def points(of: list[float]) -> list[tuple[float, float]]:
        return [(x, base - CHART_HEIGHT * value / most) for x, value in zip(across.tolist(), of, strict=True)]

    def line(of: list[float], color: str, more: str) -> str:
        path = " ".join(f"{x:.1f},{y:.1f}" for x, y in points(of))
        return f'<polyline points="{path}" fill="none" stroke="{color}" stroke-width="1.5"{more}/>'

    dots = "".join(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3.5" fill="{CURVE_COLOR}"/>' for x, y in points(values))
    ticks = "".join(
        f'<text x="{CHART_MARGIN - 8}" y="{base - CHART_HEIGHT * share + 4:.1f}" text-anchor="end">{most * share:.3g}</text>'
        for share in (0.0, 1.0)
    )
    axis = f'<line x1="{CHART_MARGIN - 4}" x2="{CURVE_WIDTH - 6}" y1="{base}" y2="{base}" stroke="{PLAIN_COLOR}" stroke-width="1"/>'
    title = f'<text x="{CHART_MARGIN}" y="{top + 11}">{words}</text>'
    return (
        title
        + axis
        + ticks
        + line(plain, PLAIN_COLOR, ' stroke-dasharray="4 3"')
        + line(values, CURVE_COLOR, "")
        + dots
    )
