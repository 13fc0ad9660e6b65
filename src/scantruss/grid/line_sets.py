"""Named sets of nodes: those on each fixed line and each ridge."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from .grid import Grid

FIXED_LINE, RIDGE = "fixed line", "ridge"


@dataclass(frozen=True, eq=False)
class LineSet:
    """The nodes on a fixed line or a ridge."""

    name: str  #: of a fixed line that of its file or of the settings; ridges are numbered
    kind: str  #: "fixed line" or "ridge"
    nodes: np.ndarray  #: (K,) int64 in their order along the line, each once

    def length(self, grid: Grid) -> float:
        """Return the length of the members along the line [scan unit]."""
        members = grid.lines[np.isin(grid.lines, self.nodes).all(axis=1)]
        return float(np.linalg.norm(grid.nodes[members[:, 0]] - grid.nodes[members[:, 1]], axis=1).sum())


def sets_of(grid: Grid, kind: str) -> list[dict[str, Any]]:
    """Return the sets of one kind as plain values: name, length [scan unit], nodes."""
    return [
        {"name": each.name, "length": each.length(grid), "nodes": each.nodes.tolist()}
        for each in grid.line_sets
        if each.kind == kind
    ]
