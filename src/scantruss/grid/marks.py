"""Marks of nodes, members and panels: a letter and the number, from 1, in the order of the grid."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .tables import GridTables


def numbered(letters: str, count: int, digits: int) -> list[str]:
    """Return `count` marks with at least so many digits, all of one width, so that they sort as they count."""
    width = max(digits, len(str(count)))
    return [f"{letters}{number:0{width}d}" for number in range(1, count + 1)]


def node_marks(grid: GridTables) -> list[str]:
    """Return the mark of each node: N001, N002, and so on."""
    return numbered("N", len(grid.nodes), 3)


def member_marks(grid: GridTables) -> list[str]:
    """Return the mark of each member: M0001, M0002, and so on."""
    return numbered("M", len(grid.edges), 4)


def panel_marks(grid: GridTables) -> list[str]:
    """Return the mark of each panel: P0001, P0002, and so on."""
    return numbered("P", len(grid.panel_table), 4)
