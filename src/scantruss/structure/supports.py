"""Supports: which nodes are supported, and how."""

from __future__ import annotations

import math
import re
from contextlib import suppress
from difflib import get_close_matches
from typing import TYPE_CHECKING

import numpy as np

from ..errors import InputError, did_you_mean
from ..kernels.geometry.components import component_labels
from .quantities import FORCE_PER_LENGTH, LENGTH, quantity

if TYPE_CHECKING:
    from ..grid.grid import Grid
    from .truss import Truss

SUPPORT_TURN = 45.0  #: least turn of the boundary, seen over two members to either side, at a corner [degree]
#: least turn at one node, seen over one member and over two, that makes it a corner beside others [degree]
SHARP_TURN = 40.0
SUPPORT_WAYS = "corners, boundary, lowest:H, fixed, ends, line:NAME, loop:N"
OTHER_WAYS = f"name others with --supports: {SUPPORT_WAYS}, a node such as N001 or a file of positions"
SUPPORT_WORDS = ("corners", "boundary", "fixed", "ends")  #: of these, those without a value
HELD_BY_TYPE = {
    "pinned": (math.inf,) * 3 + (0.0,) * 3,
    "fixed": (math.inf,) * 6,
    "roller": (0.0, 0.0, math.inf, 0.0, 0.0, 0.0),
}


def node_sets(grid: Grid) -> dict[str, np.ndarray]:
    """Return what the grid names.

    "fixed", "boundary" (the longest loop of each piece), "loop:1", ..., "corners", "line:NAME", and "ends": the nodes of one member,
    such as the feet of columns.
    """
    sets = {"fixed": np.flatnonzero(grid.fixed)}
    ends = np.flatnonzero(np.bincount(grid.edges.ravel(), minlength=len(grid.nodes)) == 1)
    if len(ends):
        sets["ends"] = ends
    loops = sorted(grid.boundary_loops, key=lambda loop: -_length(grid.nodes[loop]))
    piece = component_labels(len(grid.nodes), grid.edges[:, 0], grid.edges[:, 1])
    longest = {int(piece[loop[0]]): loop for loop in reversed(loops)}
    if loops:
        sets["boundary"] = np.unique(np.concatenate(list(longest.values())))
        corners = [_corners(grid.nodes, loop) for loop in longest.values()]
        sets["corners"] = np.unique(np.concatenate(corners))
    sets |= {f"loop:{number}": loop for number, loop in enumerate(loops, 1)}
    sets |= {f"line:{line.name}": line.nodes for line in grid.line_sets}
    return {name: np.asarray(nodes, np.int64) for name, nodes in sets.items()}


def support_nodes(truss: Truss, where: str | np.ndarray) -> np.ndarray:
    """Return the ids of the nodes that are named: ways joined by "+", marks such as N001, or ids.

    Raises
    ------
    InputError
        A name is not known, or no node is found.
    """
    if not isinstance(where, str):
        ids = np.asarray(where, np.int64).ravel()
        if len(ids) == 0 or ids.min() < 0 or ids.max() >= len(truss.nodes):
            raise InputError(f"supports must be ids of nodes, 0 to {len(truss.nodes) - 1}, and at least one")
        return np.unique(ids)
    if not where.strip():
        raise InputError(
            f"no supports; name some with --supports: {SUPPORT_WAYS}, a node such as N001 or a file of positions"
        )
    found = [_nodes_of(truss, word.strip()) for word in where.split("+")]
    return np.unique(np.concatenate(found))


def support_stiffness(count: int, nodes: np.ndarray, kind: str) -> np.ndarray:
    """Return the (V, 6) stiffness of supports of one type: pinned, fixed, roller or springs:K."""
    name, _, value = kind.partition(":")
    if name == "springs":
        if not value:
            raise InputError("support type springs needs a stiffness, such as springs:5MN/m")
        stiffness: tuple[float, ...] = (quantity(value, FORCE_PER_LENGTH, "stiffness of a spring"),) * 3 + (0.0,) * 3
        if stiffness[0] <= 0:
            raise InputError(f"the stiffness of a spring must be positive, got {value}")
    elif kind in HELD_BY_TYPE:
        stiffness = HELD_BY_TYPE[kind]
    else:
        raise InputError(f"support type must be pinned, fixed, roller or springs:K, got {kind!r}")
    supports = np.zeros((count, 6))
    supports[nodes] = stiffness
    return supports


def _nodes_of(truss: Truss, word: str) -> np.ndarray:
    """Return the nodes that one word names."""
    if word.startswith("lowest:"):
        height = quantity(word.removeprefix("lowest:"), LENGTH, "height above the lowest node", plain=True)
        if height < 0:
            raise InputError(f"no supports: no node lies below the lowest, got {word}")
        z = truss.nodes[:, 2]
        used = np.zeros(len(z), bool)
        used[truss.members] = True
        return np.flatnonzero(used & (z <= z[used].min() + height))
    if word in truss.node_marks:
        return np.array([truss.node_marks.index(word)])
    with suppress(KeyError):
        if len(nodes := truss.node_sets[word]):
            return nodes
        if word == "fixed":
            raise InputError(
                f"no supports: the grid has no fixed nodes; give scantruss grid --fixed X,Y,Z, or {OTHER_WAYS}"
            )
        raise InputError(f"no supports: the grid has no {word}; {OTHER_WAYS}")
    names = [name for name in truss.node_sets if name.startswith(("line:", "loop:"))]
    if word in ("corners", "boundary"):
        why = "is closed" if len(truss.triangles) else "is without panels"
        raise InputError(f"no supports: the grid {why} and has no {word}; use lowest:H or fixed nodes")
    if word.startswith(("line:", "loop:")) and names:
        near = get_close_matches(word, names, 3, 0.0)
        raise InputError(f"no supports: the grid has no {word}; nearest are {' '.join(near)}")
    if word.startswith("line:"):
        raise InputError(f"no supports: the grid has no lines, so no {word}; {OTHER_WAYS}")
    if word == "lowest":
        raise InputError(
            "no supports: lowest needs a height above the lowest node, in metres or with a unit; write it as lowest:0.5"
        )
    if re.fullmatch(r"[Nn]?\d+", word):
        marks = truss.node_marks
        raise InputError(f"no supports {word!r}: the nodes are marked {marks[0]} to {marks[-1]}")
    if re.search(r"[/\\]|\.[A-Za-z]{1,5}$", word):
        raise InputError(f"no supports: there is no file {word}; it needs positions X,Y,Z, one per line")
    raise InputError(
        f"no supports {word!r}{did_you_mean(word, (*SUPPORT_WORDS, *truss.node_sets))}; name some with --supports:"
        f" {SUPPORT_WAYS}, a node such as N001 or a file of positions"
    )


def _length(points: np.ndarray) -> float:
    """Return the length of a closed polyline."""
    return float(np.linalg.norm(points - np.roll(points, 1, axis=0), axis=1).sum())


def _corners(nodes: np.ndarray, loop: np.ndarray) -> np.ndarray:
    """Return where a loop turns sharply, so both ends of a narrow foot, and else the greatest turn within two members."""
    (near, axis), (far, _) = (_turns(nodes[loop], members) for members in (1, 2))
    sharp = np.minimum(near, far) > SHARP_TURN
    for step in (-1, 1):  # turning back at once is a zigzag
        sharp &= ~((np.roll(near, step) > SHARP_TURN) & ((axis * np.roll(axis, step, axis=0)).sum(axis=1) < 0))
    around, sharp_around = (np.max([np.roll(each, step) for step in (-2, -1, 1, 2)], axis=0) for each in (far, sharp))
    return loop[sharp | ((far > SUPPORT_TURN) & (far >= around - 1e-6) & ~sharp_around)]


def _turns(points: np.ndarray, members: int) -> tuple[np.ndarray, np.ndarray]:
    """Return by how much a closed polyline turns at each point, over so many members to either side [degree], and about which axes."""
    before, after = points - np.roll(points, members, axis=0), np.roll(points, -members, axis=0) - points
    axis = np.cross(before, after)
    return np.degrees(np.arctan2(np.linalg.norm(axis, axis=1), (before * after).sum(axis=1))), axis
