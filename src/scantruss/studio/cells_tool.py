"""The kind of cells: triangles, quads or hexagons, what rows of quads follow, and whether panels are made planar."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ..errors import InputError, ScanTrussError
from ..grid.grid import Grid
from ..settings import Settings
from ..settings.records import CELLS, ROW_GUIDES

if TYPE_CHECKING:
    from .state import StudioState
    from .view import StudioView


def changes_for_cells(settings: Settings, cells: str) -> dict[str, Any]:
    """Return the changes of settings that other cells need: what only the cells before could have goes with them.

    Raises
    ------
    InputError
        The arrow of the rows is of triangles only.
    """
    if cells != "triangle" and settings.rows_along:
        raise InputError("the arrow that gives rows their direction is for triangles; press No arrow first")
    return {
        "cells": cells,
        "rows": settings.rows if cells == "quad" else ROW_GUIDES[0],
        "planar": settings.planar and cells != "triangle",
    }


def words_of_panels(grid: Grid) -> str:
    """Return how many quads or hexagons a grid has; "" of triangles."""
    return "" if grid.panels is None else f", {len(grid.panels):,} {grid.panels_are}"


def words_of_planes(grid: Grid) -> str:
    """Return how far a panel is off its plane at most, over its mean diagonal; "" of triangles."""
    off = grid.quality.planarity_max
    return "" if off is None else f", off plane {off:.2%}"


class CellsTool:
    """Chooses the cells of the next grid."""

    def __init__(self, view: StudioView, gui: Any) -> None:
        self.view = view
        self.cells = gui.add_dropdown("cells", CELLS, hint="what the panels are")
        self.rows = gui.add_dropdown(
            "rows follow", ROW_GUIDES, visible=False, hint="inside: the boundary, or least and greatest curvature"
        )
        self.planar = gui.add_checkbox(
            "planar panels", False, visible=False, hint="by Generate, as far as nodes stay near the scan"
        )
        self.cells.on_update(view.chosen(self._choose))
        self.rows.on_update(view.chosen(lambda value: view.session.set(f"rows follow {value}", rows=value)))
        self.planar.on_update(view.chosen(self._make_planar))

    def _choose(self, cells: str) -> None:
        session = self.view.session
        try:
            session.set(f"cells {cells}", **changes_for_cells(session.settings, cells))
        except ScanTrussError:
            self._show(session.settings)
            raise

    def _make_planar(self, planar: bool) -> None:
        self.view.session.set_quietly("planar panels" if planar else "panels as they are", planar=planar)

    def fill(self, before: StudioState | None, state: StudioState) -> None:
        """Show the cells of a state."""
        if before is None or before.settings is not state.settings:
            self._show(state.settings)

    def _show(self, settings: Settings) -> None:
        self.cells.value, self.rows.value, self.planar.value = settings.cells, settings.rows, settings.planar
        self.rows.visible, self.planar.visible = settings.cells == "quad", settings.cells != "triangle"
