"""CSV: the members in the named file, the nodes in a second one beside it.

`grid.csv` holds one line per member, `grid_nodes.csv` one line per node. Coordinates are in the scan's own frame; the
header names the unit of every column that has one.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from ..grid.grid import Grid
from .model import Model, members_of
from .style import FileStyle

Table = tuple[Iterable[str], Iterable[Iterable[Any]]]  # header and rows


def nodes_path(path: Path) -> Path:
    """Return the path of the nodes that belong to a file of members: `grid.csv` -> `grid_nodes.csv`."""
    return path.with_name(f"{path.stem}_nodes{path.suffix}")


def encode_csv(model: Model, path: Path, style: FileStyle) -> dict[Path, bytes]:
    """Return the two files: members at `path`, nodes beside it; with a decimal comma and semicolons if asked for."""
    grid = members_of(model)
    tables = {path: _members(grid, model), nodes_path(path): _nodes(grid, model)}
    return {place: encode_table(*table, decimal_comma=style.decimal_comma) for place, table in tables.items()}


def encode_table(header: Iterable[str], rows: Iterable[Iterable[Any]], *, decimal_comma: bool = False) -> bytes:
    """Return the text of a table; numbers with every digit of a float64, nothing for None."""
    between = ";" if decimal_comma else ","
    words = ([_cell(value, between, "," if decimal_comma else ".") for value in row] for row in rows)
    lines = [between.join(header), *(between.join(row) for row in words)]
    return ("\n".join(lines) + "\n").encode("utf-8")


def _cell(value: Any, between: str, point: str) -> str:
    """Return a value as a table holds it; words in quotes where they need them."""
    if isinstance(value, str):
        return '"' + value.replace('"', '""') + '"' if {between, '"', "\n"} & set(value) else value
    return "" if value is None else repr(value).replace(".", point)


def _with_unit(names: str, unit: str) -> list[str]:
    """Return column names, each followed by the unit where it is known."""
    return [f"{name} [{unit}]" if unit else name for name in names.split()]


def _members(grid: Grid, model: Model) -> Table:
    """Return the table of members: both nodes, their places, the length, whether on a boundary, mark and group."""
    nodes = grid.scan_nodes
    start, end = grid.edges[:, 0], grid.edges[:, 1]
    columns = _with_unit("start_x start_y start_z end_x end_y end_z length", grid.unit)
    places = np.concatenate([nodes[start], nodes[end], grid.lengths[:, None]], axis=1)
    boundary = (grid.edge_uses == 1).astype(int)
    number = {pair: k for k, pair in enumerate(map(tuple, np.sort(model.members, axis=1).tolist()))}
    own = [
        number[pair] for pair in map(tuple, np.sort(grid.edges, axis=1).tolist())
    ]  # members of layers are in another order there
    marks, groups = model.member_marks, [model.groups[k] for k in model.group_of.tolist()]
    rows = zip(
        range(len(start)), start.tolist(), end.tolist(), *places.T.tolist(), boundary.tolist(), [marks[k] for k in own],
        [groups[k] for k in own], strict=True,
    )  # fmt: skip
    return (["id", "start", "end", *columns, "boundary", "mark", "group"], rows)


def _nodes(grid: Grid, model: Model) -> Table:
    """Return the table of nodes: place, members there, whether on a boundary, fixed, mark, distance from the scan, lines and ridges."""
    valence = np.bincount(grid.edges.ravel(), minlength=len(grid.nodes))
    boundary = np.zeros(len(grid.nodes), int)
    boundary[grid.edges[grid.edge_uses == 1].ravel()] = 1
    header = ["id", *_with_unit("x y z", grid.unit), "valence", "boundary", "fixed", "mark"]
    fixed = np.asarray(grid.fixed, int).tolist()
    columns = [*grid.scan_nodes.T.tolist(), valence.tolist(), boundary.tolist(), fixed, list(model.node_marks)]
    if grid.deviation is not None:
        header += _with_unit("deviation", grid.unit)
        columns.append([None if value != value else value for value in np.asarray(grid.deviation, float).tolist()])
    if grid.desired is not None:
        header += _with_unit("desired_length", grid.unit)
        columns.append(np.asarray(grid.desired, float).tolist())
    if grid.line_sets:
        header.append("lines")
        columns.append(_names_of_lines(grid))
    return (header, zip(range(len(grid.nodes)), *columns, strict=True))


def _names_of_lines(grid: Grid) -> list[str]:
    """Return for each node the names of the fixed lines and ridges on which it lies, with bars between them."""
    names: list[list[str]] = [[] for _ in grid.nodes]
    for line in grid.line_sets:
        for node in line.nodes.tolist():
            names[node].append(line.name)
    return ["|".join(each) for each in names]
