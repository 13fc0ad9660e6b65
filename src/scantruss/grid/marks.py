"""Marks of nodes and members: the names that drawings, schedules and structures share."""

from __future__ import annotations

from .grid import Grid


def node_marks(grid: Grid) -> list[str]:
    """Return N001, N002, ... for the nodes in their order, with as many digits as the last needs and at least 3."""
    return _marks("N", len(grid.nodes), 3)


def member_marks(grid: Grid) -> list[str]:
    """Return M0001, M0002, ... for the members in their order, with as many digits as the last needs and at least 4."""
    return _marks("M", len(grid.edges), 4)


def _marks(letter: str, count: int, digits: int) -> list[str]:
    width = max(digits, len(str(count)))
    return [f"{letter}{number:0{width}d}" for number in range(1, count + 1)]
