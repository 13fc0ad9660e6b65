"""The initial front where there are lines: each is a slit, whose members are front segments in both directions.

At every node the segments are linked in the order in which they stand around it. So a line inside is one loop, along it and back;
one from rim to rim divides the loop of the rim; a ring has a loop at each side. The front advances from all of them.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from .errors import FrontError
from .kernels import front as lists
from .kernels.field import lengths_along
from .kernels.surface import Surface
from .kernels.triangles import angle_from
from .kernels.vectors import Vector
from .lines.network import Lines
from .scan.sites import is_graded


def divide_curve(points: np.ndarray, arc: np.ndarray, pieces: int, closed: bool) -> np.ndarray:
    """Return the places (pieces - 1, 3) that divide a curve into pieces of equal arc; (pieces, 3) with its start for a closed one."""
    at = np.arange(0 if closed else 1, pieces) * (arc[-1] / pieces)
    return np.stack([np.interp(at, arc, points[:, c]) for c in range(3)], axis=1)


def chain_places(lines: Lines, surface: Surface, length: float, taken: set[tuple[int, int]]) -> list[np.ndarray]:
    """Return the places of the nodes between the ends of each line: members of about a length, no two between the same nodes.

    With a length field they are equally far apart in desired lengths.

    taken : pairs of stops that are joined by a member already
    """
    found = []
    for curve, (first, last) in zip(lines.curves, lines.ends.tolist(), strict=True):
        closed = first < 0
        points = np.concatenate([curve, curve[:1]]) if closed else curve
        steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
        if is_graded(surface):
            desired = np.empty(len(points))
            lengths_along(surface, np.ascontiguousarray(points), desired)
            steps /= 0.5 * (desired[1:] + desired[:-1])
        arc = np.concatenate([[0.0], np.cumsum(steps)])
        pieces = max(int(round(arc[-1] / length)), 3 if first == last else 1)
        pair = (min(first, last), max(first, last))
        if pieces == 1 and pair in taken:
            pieces = 2
        if pieces == 1:
            taken.add(pair)
        found.append(divide_curve(points, arc, pieces, closed))
    return found


def add_half_edges(front: lists.Front, chain: list[int]) -> None:
    """Add the members of a chain of nodes as active front segments of both directions, not yet linked."""
    for a, b in pairwise(chain):
        lists.add_segment(front, a, b, lists.ACTIVE)
        lists.add_segment(front, b, a, lists.ACTIVE)


def link_around(front: lists.Front, node: int) -> None:
    """Link every segment that comes to a node to the one that leaves it next, the unmeshed area being to the left of both.

    The segments are put in order around the node once, from that of the rim on, and each that comes is followed by another one.
    So each has one segment before it and one after it, also where two lines leave a node in one direction, or one of them
    leaves it across the rim.
    """
    count = int(front.count[lists.SEGMENTS])
    leaving = np.flatnonzero((front.tail[:count] == node) & (front.state[:count] != lists.GONE)).tolist()
    coming = np.flatnonzero((front.head[:count] == node) & (front.state[:count] != lists.GONE)).tolist()
    place, normal = front.nodes[node], tuple(front.normals[node].tolist())

    def arm(t: int) -> Vector:
        x, y, z = (front.nodes[front.head[t]] - place).tolist()
        return x, y, z

    first = leaving[0]  # that of the rim, which was in the lists before the lines
    around = [first, *sorted(leaving[1:], key=lambda t: angle_from(arm(first), arm(t), normal))]
    for before, line in pairwise(around):
        back = next(s for s in coming if front.tail[s] == front.head[line])
        coming.remove(back)
        lists.link(front, back, before)
    lists.link(front, coming[0], around[-1])


def line_members(front: lists.Front) -> np.ndarray:
    """Return the members (K, 2) of the lines of an initial front, smaller node first, sorted: those with segments of both directions."""
    count = int(front.count[lists.SEGMENTS])
    pairs = np.sort(np.stack([front.tail[:count], front.head[:count]], axis=1), axis=1)
    members, times = np.unique(pairs, axis=0, return_counts=True)
    found: np.ndarray = members[times == 2]
    return found


def check_kept(members: np.ndarray, triangles: np.ndarray, nodes: np.ndarray) -> None:
    """Refuse a front that has left out a member (K, 2) of a line.

    Raises
    ------
    FrontError
        Names a place.
    """
    if len(members) == 0:
        return
    count = len(nodes)
    ends = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    made = np.unique(ends.min(axis=1) * count + ends.max(axis=1))
    lost = ~np.isin(members[:, 0] * count + members[:, 1], made)
    if lost.any():
        x, y, z = nodes[members[lost][0]].mean(axis=0).tolist()
        raise FrontError(
            "a line could not be kept as members of the grid; use a smaller length, or give the line more room",
            where=(x, y, z),
        )
