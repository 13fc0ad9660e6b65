"""The initial front where there are lines: each is a slit, whose members are front segments in both directions.

At every node the segments are linked in the order in which they stand around it. So a line inside is one loop, along it and back;
one from boundary to boundary divides the loop of the boundary; a ring has a loop at each side. The front advances from all of them.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from ..errors import FrontError
from ..kernels.front import front as lists
from ..kernels.geometry.triangles import angle_from
from ..kernels.surface.local_surface import Surface
from ..kernels.surface.size_field import lengths_along
from ..surface.samples import is_graded
from .network import Lines


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
    """Link every segment that comes to a node to one that leaves it, each to another: the next clockwise around the node.

    The segments stand around the node in the order of their angles. At the boundary the one that comes along it stands last,
    whatever its angle: lines lie between both, also where the surface is folded so that its normal does not show it.
    """
    count = int(front.counts.segments)
    live = front.state[:count] != lists.GONE
    leaving = {int(front.head[t]): t for t in np.flatnonzero((front.tail[:count] == node) & live).tolist()}
    coming = {int(front.tail[s]): s for s in np.flatnonzero((front.head[:count] == node) & live).tolist()}
    place, normal = front.nodes[node], tuple(front.normals[node].tolist())
    only_coming = sorted(set(coming) - set(leaving))
    first = min(set(leaving) - set(coming), default=min(leaving))

    def turn_of(other: int) -> float:
        base, arm = ((front.nodes[end] - place).tolist() for end in (first, other))
        return 0.0 if other == first else angle_from(tuple(base), tuple(arm), normal)

    around = sorted(leaving, key=lambda other: (turn_of(other), other)) + only_coming
    waiting: list[int] = []  # segments that have come
    unmet: list[int] = []  # segments that leave before any has come
    for other in reversed(around):
        if other in leaving:
            if waiting:
                lists.link(front, waiting.pop(), leaving[other])
            else:
                unmet.append(leaving[other])
        if other in coming:
            waiting.append(coming[other])
    for s, t in zip(waiting, unmet, strict=True):
        lists.link(front, s, t)


def check_links(front: lists.Front, origin: np.ndarray) -> None:
    """Refuse an initial front whose segments are not closed loops, each followed by one of its own: lines have met where they cannot.

    All that takes segments off the front leaves closed loops closed, so every loop over them ends.

    Parameters
    ----------
    front : Front
    origin : (3,) of the cloud [scan unit]

    Raises
    ------
    FrontError
        Names a place.
    """
    count = int(front.counts.segments)
    live = np.flatnonzero(front.state[:count] != lists.GONE)
    following = front.next[live]
    broken = (following < 0) | (front.previous[following] != live) | (front.tail[following] != front.head[live])
    if broken.any():
        x, y, z = (front.nodes[front.head[live[broken][0]]] + origin).tolist()
        raise FrontError(
            "two lines meet where no member has room between them; use a smaller length, or --ridge-angle 0",
            where=(x, y, z),
        )


def line_members(front: lists.Front) -> np.ndarray:
    """Return the members (K, 2) of the lines of an initial front, smaller node first, sorted: those with segments of both directions."""
    count = int(front.counts.segments)
    pairs = np.sort(np.stack([front.tail[:count], front.head[:count]], axis=1), axis=1)
    members, times = np.unique(pairs, axis=0, return_counts=True)
    found: np.ndarray = members[times == 2]
    return found


def check_kept(members: np.ndarray, triangles: np.ndarray, nodes: np.ndarray) -> None:
    """Refuse a front that has left out a member (K, 2) of a line; nodes (N, 3) in the scan's own frame.

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
            "a line could not be kept as members of the grid; use a smaller length, give it more room, or, for a ridge, --ridge-angle 0",
            where=(x, y, z),
        )
