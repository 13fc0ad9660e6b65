"""Groups of members: by piece and by line or boundary, or by their way to the boundary."""

from __future__ import annotations

import re

import numpy as np

from ..errors import InputError
from ..grid.groups import BOUNDARY, FRAME_MEMBERS, INNER
from ..kernels.geometry.components import component_labels
from .truss import Truss

WAYS_TO_GROUP = ("members", "groups", "rings")  #: what has a section of its own in sizing


def member_groups_of(truss: Truss, by: str = "groups") -> tuple[tuple[str, ...], np.ndarray]:
    """Return the names of groups and the (M,) number of the group of each member.

    Parameters
    ----------
    truss : Truss
        Its triangles give the boundary and what is on no panel, its sets of nodes the lines.
    by : str
        "groups": boundary, the lines of the grid by name, inner, and frame (on no panel), in each piece; top, bottom and web of a
        double layer.
        "rings": "ring 0" touches the boundary, "ring 1" is the next towards the middle, and so on; "no ring" where there is none.

    Raises
    ------
    InputError
        There is no such way to group.
    """
    if by not in WAYS_TO_GROUP[1:]:
        raise InputError(f"members are grouped by {' or '.join(WAYS_TO_GROUP[1:])}, got {by!r}")
    words = _rings(truss) if by == "rings" else _lines(truss)
    piece = component_labels(len(truss.nodes), truss.members[:, 0], truss.members[:, 1])[truss.members[:, 0]]
    _, piece = np.unique(piece, return_inverse=True)
    if piece.max() > 0:
        words = [f"piece {number + 1} {word}" for number, word in zip(piece.ravel().tolist(), words, strict=True)]
    names = sorted(set(words), key=lambda name: re.sub(r"\d+", lambda found: found[0].zfill(9), name))
    number_of = {name: number for number, name in enumerate(names)}
    return tuple(names), np.array([number_of[word] for word in words], np.int64)


def boundary_members(truss: Truss) -> np.ndarray:
    """Return whether each member (M,) is a side of one triangle only."""
    return _triangles_at(truss) == 1


def _triangles_at(truss: Truss) -> np.ndarray:
    """Return the number of triangles at each member (M,)."""
    sides = np.sort(truss.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    keys, ends = (np.sort(each, axis=1) @ [len(truss.nodes), 1] for each in (sides, truss.members))
    keys = np.sort(keys)
    return np.searchsorted(keys, ends, side="right") - np.searchsorted(keys, ends)


def _lines(truss: Truss) -> list[str]:
    """Return for each member the line that it lies on, boundary, inner or frame."""
    words = np.full(len(truss.members), INNER, object)
    for name, nodes in truss.node_sets.items():
        if name.startswith("line:"):
            words[np.isin(truss.members, nodes).all(axis=1)] = name
    words[boundary_members(truss)] = BOUNDARY
    words[_triangles_at(truss) == 0] = FRAME_MEMBERS
    for name, members in truss.member_sets.items():
        words[members] = name
    return words.tolist()


def _rings(truss: Truss) -> list[str]:
    """Return for each member the ring it lies in: how many members its nearer end is from the boundary."""
    ring = np.full(len(truss.nodes), -1, np.int64)
    ring[truss.members[boundary_members(truss)]] = 0
    for step in range(len(truss.nodes)):  # each step reaches a node, or the last
        starts, ends = truss.members.T
        reached = np.concatenate([ends[ring[starts] == step], starts[ring[ends] == step]])
        reached = reached[ring[reached] < 0]
        if len(reached) == 0:
            break
        ring[reached] = step + 1
    return [f"ring {number}" if number >= 0 else "no ring" for number in ring[truss.members].min(axis=1).tolist()]
