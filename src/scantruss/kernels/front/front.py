"""The advancing front: its lists, and how a triangle is attached to it (Sec. 3.5).

A front segment runs from its tail to its head with the unmeshed area on its left. Segments form closed loops (previous, next).
Attaching a triangle keeps the loops closed and every edge at two triangles, so the grid is manifold at every moment.

Two rules hold for all segments that are not GONE, from the initial front on; every change of the lists keeps them:

- `next` is one to one among them, `previous` is its inverse, and each begins where the one before it ends;
- the list of a node (`out`, `out_next`) holds each of them that starts there once, and nothing else; so does that of its corners.

Therefore every walk ends: along `next` it comes back to where it began, and down the list of a node to its end.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...runtime.jit import kernel, record_type
from ..geometry.boxes import SearchBoxes, put
from ..geometry.vectors import Vector

GONE, ACTIVE, INACTIVE, WAITING = 0, 1, 2, 3  # states of a segment
DONE, MORE, FULL = 0, 1, 2  # what `advance` returns
MOST_NEAR_NODES = 400  # most front nodes looked at in one step
# how many nodes, segments and triangles there are; the queue holds the segments from number `first` to `last` - 1, its end comes
# before its beginning
FRONT_COUNTS = record_type(nodes=np.int64, segments=np.int64, triangles=np.int64, first=np.int64, last=np.int64)


class Rules(NamedTuple):
    """The parameters of a front."""

    length: float  #: desired at the segment in hand [scan unit]
    desired: float  #: desired member length, which the length field multiplies [scan unit]
    graded: bool  #: whether the length field differs from place to place
    length_weight: float  #: w_1 of Eq. 10
    shape_weight: float  #: alpha_1 of Eq. 5
    size_weight: float  #: alpha_2 of Eq. 5
    search_range: float  #: b and h of Sec. 3.4, step 1 [scan unit]
    nearness: float  #: least distance of a new node from the front, in lengths (Sec. 3.4, step 2)
    merge_angle: float  #: limit of alpha and beta in Table 1 [radian]
    quadrangle: bool  #: case 3 makes Foucault's quadrangle
    strict: float  #: how good a triangle must be, from 1 in the first round to 0 in the last


@kernel
def rules_at(rules: Rules, length: float) -> Rules:
    """The same rules where another length is desired."""
    return Rules(
        length,
        rules.desired,
        rules.graded,
        rules.length_weight,
        rules.shape_weight,
        rules.size_weight,
        rules.search_range,
        rules.nearness,
        rules.merge_angle,
        rules.quadrangle,
        rules.strict,
    )


class Front(NamedTuple):
    """Nodes, segments and triangles of an advancing front."""

    nodes: np.ndarray  #: (C, 3)
    normals: np.ndarray  #: (C, 3) outer normals of the surface at the nodes
    sample: np.ndarray  #: (C,) sample nearest to each node
    on_boundary: np.ndarray  #: (C,) bool
    out: np.ndarray  #: (C,) a front segment that starts at the node, -1: none
    tail: np.ndarray  #: (F,)
    head: np.ndarray  #: (F,)
    previous: np.ndarray  #: (F,)
    next: np.ndarray  #: (F,)
    state: np.ndarray  #: (F,)
    out_next: np.ndarray  #: (F,) another segment with the same tail, -1: none
    triangles: np.ndarray  #: (T, 3)
    corner: np.ndarray  #: (C,) last corner (3 t + k) at the node, -1: none
    corner_next: np.ndarray  #: (3 T,) another corner at the same node, -1: none
    queue: np.ndarray  #: (Q,) segments to be advanced
    counts: np.record  #: FRONT_COUNTS
    sharp_edges: bool  #: whether the sharp edges of bodies are looked at
    boxes: SearchBoxes  #: the nodes by box


@kernel
def propose_node(front: Front, place: Vector, normal: Vector, sample: int, on_boundary: bool) -> int:
    """Store a proposed node without adding it; returns its number."""
    n = front.counts.nodes
    for c in range(3):
        front.nodes[n, c] = place[c]
        front.normals[n, c] = normal[c]
    front.sample[n] = sample
    front.on_boundary[n] = on_boundary
    front.out[n] = -1
    front.corner[n] = -1
    return n


@kernel
def add_node(front: Front) -> None:
    """Add the proposed node."""
    n = front.counts.nodes
    front.counts.nodes += 1
    put(front.boxes, n, front.nodes[n, 0], front.nodes[n, 1], front.nodes[n, 2])


@kernel
def add_segment(front: Front, tail: int, head: int, state: int) -> int:
    """Add a front segment, not yet linked to its neighbours; active ones join the queue."""
    s = front.counts.segments
    front.counts.segments += 1
    front.tail[s], front.head[s], front.state[s] = tail, head, state
    front.out_next[s] = front.out[tail]
    front.out[tail] = s
    if state == ACTIVE:
        enqueue(front, s)
    return s


@kernel
def enqueue(front: Front, s: int) -> None:
    """Put a segment at the end of the queue."""
    front.state[s] = ACTIVE
    front.queue[front.counts.last % len(front.queue)] = s
    front.counts.last += 1


@kernel
def link(front: Front, s: int, following: int) -> None:
    """Make one segment follow another."""
    front.next[s] = following
    front.previous[following] = s


@kernel
def add_chain(front: Front, nodes: np.ndarray, state: int) -> None:
    """Add the segments of a closed chain of nodes (K,), linked."""
    count, first = len(nodes), front.counts.segments
    for i in range(count):
        add_segment(front, nodes[i], nodes[(i + 1) % count], state)
    for i in range(count):
        link(front, first + i, first + (i + 1) % count)


@kernel
def remove_segment(front: Front, s: int) -> None:
    """Take a segment that is not GONE out of the front; its neighbours are still to be linked."""
    front.state[s] = GONE
    node = front.tail[s]
    at = front.out[node]
    if at == s:
        front.out[node] = front.out_next[s]
        return
    while front.out_next[at] != s:  # each turn goes on in the list of the node, which holds s
        at = front.out_next[at]
    front.out_next[at] = front.out_next[s]


@kernel
def add_triangle(front: Front, a: int, b: int, c: int) -> None:
    """Add a triangle to the grid."""
    t = front.counts.triangles
    front.counts.triangles += 1
    for k in range(3):
        node = a if k == 0 else (b if k == 1 else c)
        front.triangles[t, k] = node
        front.corner_next[3 * t + k] = front.corner[node]
        front.corner[node] = 3 * t + k


@kernel
def edge_exists(front: Front, a: int, b: int) -> bool:
    """Whether an edge of the grid or of the front joins two nodes."""
    at = front.corner[a]
    while at >= 0:
        t = at // 3
        if front.triangles[t, 0] == b or front.triangles[t, 1] == b or front.triangles[t, 2] == b:
            return True
        at = front.corner_next[at]
    s = front.out[a]
    while s >= 0:
        if front.head[s] == b:
            return True
        s = front.out_next[s]
    s = front.out[b]
    while s >= 0:
        if front.head[s] == a:
            return True
        s = front.out_next[s]
    return False


@kernel
def attach(front: Front, s: int, p: int, passage: int) -> None:
    """Attach the triangle of segment s and node p: from now on the front runs around it.

    passage : segment that leaves p at the place where the triangle meets the front; -1 for a node that is new, or is the far end
    of a neighbouring segment
    """
    a, b = front.tail[s], front.head[s]
    before, after = front.previous[s], front.next[s]
    c, d = front.tail[before], front.head[after]
    add_triangle(front, a, b, p)
    if p == c and p == d and front.next[after] == before:
        remove_segment(front, s)
        remove_segment(front, before)
        remove_segment(front, after)
    elif p == c and passage < 0:
        x = front.previous[before]
        remove_segment(front, s)
        remove_segment(front, before)
        new = add_segment(front, c, b, ACTIVE)
        link(front, x, new)
        link(front, new, after)
    elif p == d and passage < 0:
        y = front.next[after]
        remove_segment(front, s)
        remove_segment(front, after)
        new = add_segment(front, a, d, ACTIVE)
        link(front, before, new)
        link(front, new, y)
    else:
        remove_segment(front, s)
        first = add_segment(front, a, p, ACTIVE)
        second = add_segment(front, p, b, ACTIVE)
        link(front, before, first)
        if passage < 0:
            link(front, first, second)
        else:
            w = front.previous[passage]
            link(front, first, passage)
            link(front, w, second)
        link(front, second, after)
