"""Tab: what the grid must keep: fixed nodes, fixed lines, mirror planes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .fixed_list import FixedNodes
from .line_list import LineList
from .symmetry_tool import SymmetryTool

if TYPE_CHECKING:
    from .state import StudioState
    from .view import StudioView


class ConstraintsTab:
    """Fixed nodes, lines and planes."""

    def __init__(self, view: StudioView, gui: Any) -> None:
        with gui.add_folder("Fixed nodes"):
            self.fixed = FixedNodes(view, gui)
        with gui.add_folder("Fixed lines"):
            self.lines = LineList(view, gui)
        with gui.add_folder("Symmetry", expand_by_default=False):
            self.symmetry = SymmetryTool(view, gui)

    def fill(self, before: StudioState | None, state: StudioState) -> None:
        """Show the constraints of a state."""
        for part in (self.fixed, self.lines, self.symmetry):
            part.fill(before, state)
