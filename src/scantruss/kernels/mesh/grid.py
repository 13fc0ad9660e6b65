"""The net: a grid as rings of neighbours, with the three moves that change its topology.

Each node has a ring of neighbours, anticlockwise seen from outside. Triangle i of node v is (v, ring[v, i], ring[v, i + 1]); the ring of
an interior node is closed, that of a boundary node open: its first and last neighbours lie on the boundary too. Members along lines
(fixed lines, ridges) are marked at both ends: they are never flipped, and a line stays a chain of members.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...runtime.jit import kernel

INTERIOR = 0  # kind of a node that slides on the scanned surface
ON_CURVE = 1  # kind of a node that slides on its curve: of the boundary, or of a line if its ring is closed
AT_REST = 2  # kind of a corner or fixed node: never moved or removed
LOCKED = 3  # kind of a node at a defect of the grid (pinch, seam): nothing near it changes


class Net(NamedTuple):
    """A grid while it is improved, with room for C nodes of at most W neighbours."""

    nodes: np.ndarray  #: (C, 3) positions
    ring: np.ndarray  #: (C, W) int64 neighbours, anticlockwise
    degree: np.ndarray  #: (C,) int64 number of neighbours; 0 for a free node
    is_open: np.ndarray  #: (C,) int64, 1 on the boundary, 0 inside
    kind: np.ndarray  #: (C,) int64 INTERIOR, ON_CURVE, AT_REST or LOCKED
    curve: np.ndarray  #: (C,) int64 curve of the boundary or of a line on which the node slides, -1 for none
    ideal: np.ndarray  #: (C,) int64 ideal number of neighbours: 6 inside, on the boundary by its angle
    line: np.ndarray  #: (C,) int64, bit i is set if the member to neighbour i of the ring is part of a line
    arc: np.ndarray  #: (C,) place of a node on its curve, as arc length from the start [scan unit]
    free: np.ndarray  #: (C,) int64 stack of free nodes
    spare: np.ndarray  #: (1,) int64 number of free nodes
    in_use: np.ndarray  #: (1,) int64; no node from this number on has ever been used
    desired: np.ndarray  #: (C,) desired member length at each node [`length`]; all ones where there is one length

    @property
    def used(self) -> int:
        """The nodes from 0 to `used` - 1 have been used."""
        return int(self.in_use[0])


@kernel
def fill_rings(
    corner_node: np.ndarray,
    partner: np.ndarray,
    fan: np.ndarray,
    first: np.ndarray,
    ring: np.ndarray,
    degree: np.ndarray,
    is_open: np.ndarray,
    source: np.ndarray,
    used: int,
) -> int:
    """Write the ring of each node by walking round the fan of each corner.

    Parameters
    ----------
    corner_node : (3 T,) int64 node of the grid at corner 3 t + k
    partner : (3 T,) int64 half-edge opposite to the one that starts at each corner, -1 for none
    fan : (3 T,) int64, -1 at the start, filled with the node of the net at each corner: a node with two fans becomes two nodes
    first : (C,) int64 scratch
    ring, degree, is_open : arrays of the net, degree 0 at the start
    source : (C,) int64, filled with the node of the grid that each node of the net stands for
    used : number of nodes of the grid

    Returns
    -------
    int : number of nodes of the net
    """
    for node in range(used):
        source[node] = node
    for corner in range(len(corner_node)):
        if fan[corner] >= 0:
            continue
        at = corner
        while partner[at] >= 0:  # partners are one to one: the way ends at the boundary or comes back
            back = partner[at]
            back = back - back % 3 + (back % 3 + 1) % 3
            if back == corner:
                break
            at = back
        v = corner_node[corner]
        if degree[v] > 0:
            v = used
            source[v] = corner_node[corner]
            used += 1
        start = at
        first[v] = start
        count = 0
        while at >= 0 and fan[at] < 0:
            fan[at] = v
            count += 1
            at = partner[at - at % 3 + (at % 3 + 2) % 3]
        is_open[v] = 1 if at < 0 else 0
        degree[v] = count + is_open[v]
    for v in range(used):
        at = first[v]
        for i in range(degree[v] - is_open[v]):
            base, k = at - at % 3, at % 3
            ring[v, i] = fan[base + (k + 1) % 3]
            last = base + (k + 2) % 3
            if is_open[v] == 1:
                ring[v, i + 1] = fan[last]
            at = partner[last]
    return used


@kernel
def target_length(net: Net, v: int, u: int, length: float) -> float:
    """Desired length of the member from v to u: the mean of those at its ends, which are in units of `length` [scan unit]."""
    return 0.5 * length * net.desired[v] + 0.5 * length * net.desired[u]


@kernel
def list_triangles(net: Net, triangles: np.ndarray) -> int:
    """List the triangles of the net, each once, its lowest node first; returns how many."""
    count = 0
    for v in range(net.in_use[0]):
        d = net.degree[v]
        for i in range(d - net.is_open[v]):
            u, w = net.ring[v, i], net.ring[v, (i + 1) % d]
            if v < u and v < w:
                triangles[count, 0], triangles[count, 1], triangles[count, 2] = v, u, w
                count += 1
    return count


@kernel
def place_in_ring(net: Net, v: int, u: int) -> int:
    """Position of node u in the ring of node v, -1 if they are not neighbours."""
    for i in range(net.degree[v]):
        if net.ring[v, i] == u:
            return i
    return -1


@kernel
def is_line(net: Net, v: int, u: int) -> bool:
    """Whether the member between two neighbours is part of a line."""
    return net.line[v] != 0 and (net.line[v] >> place_in_ring(net, v, u)) & 1 == 1


@kernel
def mark_line(net: Net, v: int, u: int) -> None:
    """Make the member between two neighbours part of a line, as seen from node v."""
    net.line[v] |= 1 << place_in_ring(net, v, u)


@kernel
def put_in(net: Net, v: int, i: int, u: int) -> None:
    """Insert node u into the ring of node v before position i."""
    line = net.line[v]
    if line != 0:
        below = line & ((1 << i) - 1)
        net.line[v] = below | ((line - below) << 1)
    for j in range(net.degree[v], i, -1):
        net.ring[v, j] = net.ring[v, j - 1]
    net.ring[v, i] = u
    net.degree[v] += 1


@kernel
def take_out(net: Net, v: int, u: int) -> None:
    """Remove node u from the ring of node v."""
    i = place_in_ring(net, v, u)
    line = net.line[v]
    if line != 0:
        net.line[v] = (line & ((1 << i) - 1)) | ((line >> (i + 1)) << i)
    net.degree[v] -= 1
    for j in range(i, net.degree[v]):
        net.ring[v, j] = net.ring[v, j + 1]


@kernel
def wings(net: Net, a: int, b: int) -> tuple[int, int]:
    """Nodes right and left of the edge from a to b, in the triangles (a, right, b) and (a, b, left); -1 if there is no triangle."""
    i, d = place_in_ring(net, a, b), net.degree[a]
    if net.is_open[a] == 1:
        return (net.ring[a, i - 1] if i > 0 else -1), (net.ring[a, i + 1] if i + 1 < d else -1)
    return net.ring[a, (i + d - 1) % d], net.ring[a, (i + 1) % d]


@kernel
def lowest_degree(net: Net, v: int) -> int:
    """Fewest neighbours that a move may leave a node with."""
    return 2 if net.is_open[v] == 1 else 4


@kernel
def may_flip(net: Net, a: int, b: int) -> bool:
    """Whether the edge a-b can be flipped."""
    right, left = wings(net, a, b)
    if right < 0 or left < 0 or right == left or is_line(net, a, b):
        return False
    most = net.ring.shape[1] - 1
    for v in (a, b, right, left):
        if net.kind[v] == LOCKED:
            return False
    return (
        net.degree[a] > lowest_degree(net, a)
        and net.degree[b] > lowest_degree(net, b)
        and net.degree[right] < most
        and net.degree[left] < most
        and place_in_ring(net, right, left) < 0
    )


@kernel
def flip(net: Net, a: int, b: int) -> None:
    """Flip the edge a-b: replace it by the other diagonal of its quadrangle."""
    right, left = wings(net, a, b)
    take_out(net, a, b)
    take_out(net, b, a)
    put_in(net, left, place_in_ring(net, left, a) + 1, right)
    put_in(net, right, place_in_ring(net, right, b) + 1, left)


@kernel
def may_collapse(net: Net, a: int, b: int) -> bool:
    """Whether node b can be collapsed into node a without a change of topology (link condition)."""
    if net.kind[b] >= AT_REST or net.kind[a] == LOCKED or net.kind[b] > net.kind[a]:
        return False
    right, left = wings(net, a, b)
    if net.line[b] != 0 and not (
        is_line(net, a, b) and not (right >= 0 and is_line(net, b, right)) and not (left >= 0 and is_line(net, b, left))
    ):
        return False  # a line stays a chain: its nodes collapse along it only, and not where it turns back at once
    common = 0
    for i in range(net.degree[b]):
        u = net.ring[b, i]
        if net.kind[u] == LOCKED:
            return False
        if place_in_ring(net, a, u) >= 0:
            common += 1
    on_boundary = right < 0 or left < 0
    if common != (1 if on_boundary else 2):
        return False
    if net.is_open[b] == 1 and (not on_boundary or net.degree[b] < 3 or net.curve[a] != net.curve[b]):
        return False
    for v in (right, left):
        if v >= 0 and net.degree[v] <= lowest_degree(net, v):
            return False
    after = net.degree[a] + net.degree[b] - (3 if on_boundary else 4)
    return lowest_degree(net, a) <= after < net.ring.shape[1]


@kernel
def collapse(net: Net, a: int, b: int) -> None:
    """Collapse node b into node a; b becomes free."""
    right, left = wings(net, a, b)
    d = net.degree[b]
    line = net.line[b]
    if net.is_open[b] == 1:  # along the boundary the ring of b, without a, is in order
        begin = 1 if left < 0 else 0
        others = d - 1
    else:
        begin = place_in_ring(net, b, a) + 1
        others = d - 1
    i = place_in_ring(net, a, b)
    take_out(net, a, b)
    for step in range(others):
        u = net.ring[b, (begin + step) % d]
        if u in (right, left):
            take_out(net, u, b)
        else:
            net.ring[u, place_in_ring(net, u, b)] = a
            put_in(net, a, i, u)
            if (line >> ((begin + step) % d)) & 1 == 1:
                net.line[a] |= 1 << i
            i += 1
    net.degree[b] = 0
    net.line[b] = 0
    net.free[net.spare[0]] = b
    net.spare[0] += 1


@kernel
def slides_on_line(net: Net, v: int) -> bool:
    """Whether a node slides on the curve of a line."""
    return net.kind[v] == ON_CURVE and net.is_open[v] == 0


@kernel
def may_split(net: Net, a: int, b: int) -> bool:
    """Whether the edge a-b can be split."""
    right, left = wings(net, a, b)
    most = net.ring.shape[1] - 1
    for v in (a, b, right, left):
        if v >= 0 and net.kind[v] == LOCKED:
            return False
    if (right >= 0 and net.degree[right] >= most) or (left >= 0 and net.degree[left] >= most):
        return False
    if is_line(net, a, b):
        return net.spare[0] > 0 and (slides_on_line(net, a) or slides_on_line(net, b))
    if (right < 0 or left < 0) and (net.curve[a] < 0 or net.curve[a] != net.curve[b]):
        return False
    return net.spare[0] > 0


@kernel
def split(net: Net, a: int, b: int) -> int:
    """Split the edge a-b by a free node and return that; the caller gives it its position."""
    right, left = wings(net, a, b)
    line = is_line(net, a, b)
    net.spare[0] -= 1
    m = net.free[net.spare[0]]
    net.in_use[0] = max(net.in_use[0], m + 1)
    net.ring[a, place_in_ring(net, a, b)] = m
    net.ring[b, place_in_ring(net, b, a)] = m
    net.degree[m] = net.line[m] = 0
    curves = right < 0 or left < 0
    net.is_open[m], net.kind[m] = (1, ON_CURVE) if curves else (0, INTERIOR)
    net.curve[m] = net.curve[a] if curves else -1
    net.desired[m] = 0.5 * (net.desired[a] + net.desired[b])
    if right >= 0:
        put_in(net, right, place_in_ring(net, right, b) + 1, m)
    if left >= 0:
        put_in(net, left, place_in_ring(net, left, a) + 1, m)
    around = (a, right, b, left) if left < 0 or right >= 0 else (b, left, a, -1)
    for u in around:
        if u >= 0:
            put_in(net, m, net.degree[m], u)
    if line:
        net.kind[m] = ON_CURVE
        net.curve[m] = net.curve[a] if slides_on_line(net, a) else net.curve[b]
        mark_line(net, m, a)
        mark_line(net, m, b)
    return m
