"""Small grids of quads and hexagons."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

import scantruss as st
from scantruss.grid.panels import table_of, triangles_of

Loops = list[list[int]]


def vault(across: int = 5, along: int = 4) -> tuple[np.ndarray, Loops]:
    """Nodes and quads of a barrel vault, 1.5 by 1.2 m each."""
    x, y = np.meshgrid(np.arange(across + 1), np.arange(along + 1))
    nodes = np.stack([1.5 * x, 1.2 * y, 2.0 * np.sin(math.pi * x / across) + 0.1 * y], axis=-1).reshape(-1, 3)
    first = (np.arange(along)[:, None] * (across + 1) + np.arange(across)).ravel()
    return nodes, np.stack([first, first + 1, first + across + 2, first + across + 1], axis=1).tolist()


def comb(across: int = 4, along: int = 3) -> tuple[np.ndarray, Loops]:
    """Nodes and hexagons of a slightly twisted comb."""
    places: dict[tuple[float, float], int] = {}
    loops: Loops = []
    for row in range(along):
        for column in range(across):
            x, y = (column + 0.5 * (row % 2)) * math.sqrt(3), 1.5 * row
            turns = [math.pi / 6 + k * math.pi / 3 for k in range(6)]
            corners = [(round(x + math.cos(turn), 9), round(y + math.sin(turn), 9)) for turn in turns]
            loops.append([places.setdefault(corner, len(places)) for corner in corners])
    return np.array([(x, y, 0.02 * x * y) for x, y in places]), loops


def grid_of(nodes: np.ndarray, loops: Loops, **others: Any) -> st.Grid:
    """A grid of panels."""
    panels = table_of(loops)
    return st.Grid(
        nodes=nodes,
        triangles=triangles_of(nodes, panels),
        panels=panels,
        fixed=np.zeros(len(nodes), bool),
        **({"origin": np.zeros(3)} | others),
    )
