"""Tab: what the grid must keep: fixed nodes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .fixed_list import FixedNodes

if TYPE_CHECKING:
    from .state import StudioState
    from .view import StudioView


class ConstraintsTab:
    """Fixed nodes."""

    def __init__(self, view: StudioView, gui: Any) -> None:
        with gui.add_folder("Fixed nodes"):
            self.fixed = FixedNodes(view, gui)

    def fill(self, before: StudioState | None, state: StudioState) -> None:
        """Show the constraints of a state."""
        self.fixed.fill(before, state)
