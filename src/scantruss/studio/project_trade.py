"""The trade of few different parts in a project file: the grid that it is of, and the places of the nodes of each one in it."""

from __future__ import annotations

import io
import json
from collections.abc import Callable

import numpy as np

from ..grid.alike import Alike
from ..grid.grid import Grid
from ..layouts.moved import moved_grid
from ..layouts.trade import Traded
from .state import Trade

TRADE_HEAD, TRADE_NODES, TRADE_BEFORE = "trade.json", "trade.npz", "trade-grid.json"  #: parts of a project file


def head_of_trade(trade: Trade, grid: Grid | None) -> bytes:
    """Return all of a trade but places of nodes, and whether it is of the grid of the project."""
    rows = []
    for each in trade.traded:
        assert each.grid.alike is not None
        figures = {name: value for name, value in each._asdict().items() if name != "grid"}
        rows.append(figures | {"alike": each.grid.alike.to_dict()})
    head = {"parts": trade.parts, "off_scan": trade.off_scan, "of_grid": trade.before is grid, "traded": rows}
    return (json.dumps(head, indent=1) + "\n").encode()


def nodes_of_trade(trade: Trade) -> dict[str, np.ndarray]:
    """Return the nodes (V, 3) of each grid of a trade, by their names."""
    return {f"nodes_{k}": each.grid.nodes for k, each in enumerate(trade.traded)}


def trade_of_parts(parts: dict[str, bytes], grid: Grid | None, read: Callable[[bytes], Grid]) -> Trade | None:
    """Return the trade that the parts of a project file hold; None where they hold none.

    Parameters
    ----------
    grid : Grid, optional
        That of the project.
    read : callable
        Reads a grid.

    Raises
    ------
    KeyError, TypeError, ValueError
        A part is missing or damaged.
    """
    if TRADE_HEAD not in parts:
        return None
    head = json.loads(parts[TRADE_HEAD])
    before = grid if head["of_grid"] else read(parts[TRADE_BEFORE])
    if before is None:
        raise ValueError("a trade of no grid")
    traded = []
    with np.load(io.BytesIO(parts[TRADE_NODES]), allow_pickle=False) as arrays:
        for k, row in enumerate(head["traded"]):
            nodes = np.ascontiguousarray(arrays[f"nodes_{k}"], np.float64).reshape(before.nodes.shape)
            figures = {name: value for name, value in row.items() if name != "alike"}
            traded.append(Traded(**figures, grid=moved_grid(before, nodes, Alike(**row["alike"]))))
    return Trade(before, str(head["parts"]), tuple(traded), float(head["off_scan"]))
