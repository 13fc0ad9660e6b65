"""Legends of what is drawn, in a small window on the drawing."""

from __future__ import annotations

from typing import Any

LEGEND_WIDTH = 260  #: [pixel]
LEGEND_GAP = 12  #: from the lower left corner of the drawing [pixel]


class Legends:
    """One legend for each colouring that is seen."""

    def __init__(self, gui: Any) -> None:
        self._panel = gui.add_panel(visible=False)
        with self._panel.add_tab("Legend"):
            self._html = gui.add_html("")
        self._panel.float(x=LEGEND_GAP, y=-LEGEND_GAP, width=LEGEND_WIDTH)
        self._shown: dict[str, str] = {}

    def show(self, name: str, html: str) -> None:
        """Show the legend of a part of the drawing; "" takes it away."""
        if self._shown.get(name, "") == html:
            return
        self._shown[name] = html
        self._html.content = "".join(self._shown.values())
        self._panel.visible = bool(self._html.content)
