"""Groups of members: by what they lie on."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from .grid import Grid

BOUNDARY, INNER = "boundary", "inner"  #: groups of members on no line
FRAME_MEMBERS = "frame"  #: group of members that are sides of no panel


def member_groups(grid: Grid) -> list[str]:
    """Return the group of each member: boundary, the name of its fixed line or ridge, inner, or frame."""
    groups = np.full(len(grid.edges), INNER, object)
    on_line = np.flatnonzero(grid.edge_on_line)
    for line in reversed(grid.line_sets):  # the first that holds both nodes stands
        groups[on_line[np.isin(grid.edges[on_line], line.nodes).all(axis=1)]] = line.name
    groups[grid.edge_uses == 1] = BOUNDARY
    groups[grid.edge_uses == 0] = FRAME_MEMBERS
    return [str(group) for group in groups]
