"""Legends of what is drawn, in a small window on the drawing."""

from __future__ import annotations

from typing import Any

from .legend import ColourLegend

LEGEND_WIDTH = 260  #: [pixel]
LEGEND_GAP = 12  #: from the lower left corner of the drawing [pixel]


class Legends:
    """One legend for each colouring that is seen."""

    def __init__(self, gui: Any) -> None:
        self._panel = gui.add_panel(visible=False)
        with self._panel.add_tab("Legend"):
            self._html = gui.add_html("")
        self._panel.float(x=LEGEND_GAP, y=-LEGEND_GAP, width=LEGEND_WIDTH)
        self._shown: dict[str, ColourLegend] = {}

    @property
    def shown(self) -> tuple[ColourLegend, ...]:
        """Those that are seen."""
        return tuple(self._shown.values())

    def show(self, name: str, legend: ColourLegend | None) -> None:
        """Show the legend of a part of the drawing; None takes it away."""
        if self._shown.get(name) == legend:
            return
        self._shown.pop(name, None)
        if legend is not None:
            self._shown[name] = legend
        self._html.content = "".join(each.html() for each in self.shown)
        self._panel.visible = bool(self._shown)
