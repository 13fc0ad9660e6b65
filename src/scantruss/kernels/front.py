"""The advancing front: its lists, what may be attached to it, and how (Sec. 3.4, 3.5, Eq. 10, Table 1).

A front segment runs from its tail to its head with the unmeshed area on its left. Segments form closed loops (previous, next).
Attaching a triangle keeps the loops closed and every edge at two triangles, so the grid is manifold at every moment.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .boxes import SearchBoxes, put, search
from .compile import kernel
from .surface import Surface, linked
from .triangles import (
    angle_from,
    distance_to_segment,
    inside_triangle,
    lines_cross,
    on_unmeshed_side,
    onto_tangent_plane,
)
from .vectors import Vector, across, along, cross, dot, norm, row, subtract, unit

GONE, ACTIVE, INACTIVE, WAITING = 0, 1, 2, 3  # states of a segment
DONE, MORE, FULL = 0, 1, 2  # what `advance` returns
NODES, SEGMENTS, TRIANGLES, FIRST, LAST = 0, 1, 2, 3, 4  # counters
LENGTH, NEARNESS, W1, MERGE, SHAPE, SIZE, RANGE, STRICT, QUADRANGLE = range(
    9
)  # places in `numbers`; LENGTH is that at the segment in hand
REFERENCE, GRADED = (
    9,
    10,
)  # places of the length that the length field multiplies, and of 1 where there is one that differs
SHEET = 0.45  # what is farther from a triangle than this is another sheet, in lengths
NEAR = 400  # most front nodes looked at in one step


class Front(NamedTuple):
    """Nodes, segments and triangles of an advancing front."""

    nodes: np.ndarray  #: (C, 3)
    normals: np.ndarray  #: (C, 3) outer normals of the surface at the nodes
    site: np.ndarray  #: (C,) site nearest to each node
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
    count: np.ndarray  # type: ignore[assignment]  #: (8,) counters; hides tuple.count
    boxes: SearchBoxes  #: the nodes by box


@kernel
def propose_node(front: Front, place: Vector, normal: Vector, site: int, on_boundary: bool) -> int:
    """Write down the node that may come next, without adding it; returns its number."""
    n = front.count[NODES]
    for c in range(3):
        front.nodes[n, c] = place[c]
        front.normals[n, c] = normal[c]
    front.site[n] = site
    front.on_boundary[n] = on_boundary
    front.out[n] = -1
    front.corner[n] = -1
    return n


@kernel
def add_node(front: Front) -> None:
    """Add the proposed node."""
    n = front.count[NODES]
    front.count[NODES] += 1
    put(front.boxes, n, front.nodes[n, 0], front.nodes[n, 1], front.nodes[n, 2])


@kernel
def add_segment(front: Front, tail: int, head: int, state: int) -> int:
    """Add a front segment, not yet linked to its neighbours; active ones join the queue."""
    s = front.count[SEGMENTS]
    front.count[SEGMENTS] += 1
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
    front.queue[front.count[LAST] % len(front.queue)] = s
    front.count[LAST] += 1


@kernel
def link(front: Front, s: int, following: int) -> None:
    """Make one segment follow another."""
    front.next[s] = following
    front.previous[following] = s


@kernel
def add_chain(front: Front, nodes: np.ndarray, state: int) -> None:
    """Add the segments of a closed chain of nodes (K,), linked."""
    count, first = len(nodes), front.count[SEGMENTS]
    for i in range(count):
        add_segment(front, nodes[i], nodes[(i + 1) % count], state)
    for i in range(count):
        link(front, first + i, first + (i + 1) % count)


@kernel
def remove_segment(front: Front, s: int) -> None:
    """Take a segment out of the front."""
    front.state[s] = GONE
    node = front.tail[s]
    at = front.out[node]
    if at == s:
        front.out[node] = front.out_next[s]
        return
    while front.out_next[at] != s:
        at = front.out_next[at]
    front.out_next[at] = front.out_next[s]


@kernel
def add_triangle(front: Front, a: int, b: int, c: int) -> None:
    """Add a triangle to the grid."""
    t = front.count[TRIANGLES]
    front.count[TRIANGLES] += 1
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
    """Attach the triangle of segment s and node p: the front goes round it from now on.

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


@kernel
def same_sheet(surface: Surface, front: Front, a: int, q: int, length: float) -> bool:
    """Whether two nodes lie on the same sheet of the surface: plainly side by side, or linked over the sites between them."""
    d = subtract(row(front.nodes, q), row(front.nodes, a))
    far = norm(d)
    na, nq = row(front.normals, a), row(front.normals, q)
    if far < 1e-9 * length:
        return True
    flat = max(abs(dot(d, na)), abs(dot(d, nq))) / far
    facing = dot(na, nq)
    if facing > 0.8 and flat < 0.3:
        return True
    if facing < -0.5 and flat > 0.7:
        return False
    place = along(row(front.nodes, a), 0.5, d)
    return linked(surface, front.site[a], front.site[q], place, 0.6 * far + 1.5 * surface.scale[4])


@kernel
def near_nodes(surface: Surface, front: Front, s: int, reach: float, length: float, found: np.ndarray) -> int:
    """Nodes within reach of the middle of a segment, on its sheet; returns their number.

    Finished nodes are among them: a front that has gone astray must not run over them.
    """
    a, b = front.tail[s], front.head[s]
    pa, pb = row(front.nodes, a), row(front.nodes, b)
    count = search(
        front.boxes, front.nodes, 0.5 * (pa[0] + pb[0]), 0.5 * (pa[1] + pb[1]), 0.5 * (pa[2] + pb[2]), reach, found
    )
    kept = 0
    for i in range(count):
        q = found[i]
        if q != a and q != b and (same_sheet(surface, front, a, q, length) or same_sheet(surface, front, b, q, length)):
            found[kept] = q
            kept += 1
    return kept


@kernel
def left_angle(front: Front, s: int) -> float:
    """Angle alpha of Table 1: at the tail, from the segment to its previous neighbour across the unmeshed area."""
    a = row(front.nodes, front.tail[s])
    c = row(front.nodes, front.tail[front.previous[s]])
    if front.tail[front.previous[s]] == front.head[s]:
        return 2.0 * math.pi  # the end of a line
    return angle_from(subtract(row(front.nodes, front.head[s]), a), subtract(c, a), row(front.normals, front.tail[s]))


@kernel
def right_angle(front: Front, s: int) -> float:
    """Angle beta of Table 1: at the head, between the segment and its next neighbour across the unmeshed area."""
    b = row(front.nodes, front.head[s])
    d = row(front.nodes, front.head[front.next[s]])
    if front.head[front.next[s]] == front.tail[s]:
        return 2.0 * math.pi
    return angle_from(subtract(d, b), subtract(row(front.nodes, front.tail[s]), b), row(front.normals, front.head[s]))


@kernel
def _sector(front: Front, leaving: int, q: int) -> float:
    """Angle at the tail of a segment, from it to node q; 9 where q is outside the unmeshed area there, less than `margin` is 0."""
    p = front.tail[leaving]
    place, normal = row(front.nodes, p), row(front.normals, p)
    base = subtract(row(front.nodes, front.head[leaving]), place)
    whole = angle_from(base, subtract(row(front.nodes, front.tail[front.previous[leaving]]), place), normal)
    if front.tail[front.previous[leaving]] == front.head[leaving] or whole < 1e-9:
        whole = 2.0 * math.pi
    angle = angle_from(base, subtract(row(front.nodes, q), place), normal)
    return angle if angle < whole else 9.0


@kernel
def passage_of(front: Front, s: int, p: int) -> int:
    """Segment that leaves node p where the triangle of s and p meets the front there; -1: it meets it nowhere rightly."""
    a, b = front.tail[s], front.head[s]
    at = front.out[p]
    while at >= 0:
        to_a, to_b = _sector(front, at, a), _sector(front, at, b)
        if 0.0 < to_a < to_b < 9.0 and at != s and front.previous[at] != s:
            return at
        at = front.out_next[at]
    return -1


@kernel
def fits(front: Front, s: int, p: int, found: np.ndarray, near: int, length: float, strict: float) -> tuple[bool, int]:
    """Whether the triangle of segment s and node p may be attached; and where it meets the front at p (see `attach`).

    It must lie on the unmeshed side (Eq. 7), face as the surface does, stay within the sectors of the front at its three nodes,
    repeat no edge, cross no segment of the front (Eqs. 8, 9) and hold no node of it. `strict` 1 asks for room, 0 only for rightness.
    """
    a, b = front.tail[s], front.head[s]
    before, after = front.previous[s], front.next[s]
    c, d = front.tail[before], front.head[after]
    pa, pb, pp = row(front.nodes, a), row(front.nodes, b), row(front.nodes, p)
    na, nb, np_ = row(front.normals, a), row(front.normals, b), row(front.normals, p)
    face = unit(cross(subtract(pb, pa), subtract(pp, pa)))
    least = 0.5 * strict - 0.2
    if dot(face, na) <= least or dot(face, nb) <= least or dot(face, np_) <= least:
        return False, -1
    if not on_unmeshed_side(pa, pb, pp, unit((na[0] + nb[0], na[1] + nb[1], na[2] + nb[2]))):
        return False, -1
    longest = (3.0 - 1.2 * strict) * length
    if norm(subtract(pp, pa)) > longest or norm(subtract(pp, pb)) > longest:
        return False, -1
    closes_left, closes_right = p == c, p == d
    passage = -1
    if closes_left and closes_right:
        if front.next[after] != before:
            return False, -1
        return True, -1
    # the edges that are new must not exist and must lie inside the sectors
    if not closes_left:
        if edge_exists(front, a, p) or _sector(front, s, p) >= 9.0:
            return False, -1
    if not closes_right:
        if edge_exists(front, b, p) or _sector(front, after, p) >= 9.0:
            return False, -1
    if closes_left:
        if _sector(front, before, b) >= 9.0:
            return False, -1
    elif closes_right:
        if _sector(front, front.next[after], a) >= 9.0:
            return False, -1
    else:
        if p < front.count[NODES] and front.out[p] >= 0:
            passage = passage_of(front, s, p)
            if passage < 0:
                return False, -1
    if not clear_of_front(front, s, p, pp, found, near, 0.25 * strict * length, length):
        return False, -1
    return True, passage


@kernel
def clear_of_front(
    front: Front, s: int, p: int, pp: Vector, found: np.ndarray, near: int, room: float, length: float
) -> bool:
    """Whether the triangle of segment s and place pp (node p, or -1) crosses no front segment, holds no front node, and keeps room."""
    a, b = front.tail[s], front.head[s]
    pa, pb = row(front.nodes, a), row(front.nodes, b)
    normal = unit(cross(subtract(pb, pa), subtract(pp, pa)))
    u = across(normal)
    v = cross(normal, u)
    a2, b2, p2 = onto_tangent_plane(pa, pa, u, v), onto_tangent_plane(pb, pa, u, v), onto_tangent_plane(pp, pa, u, v)
    for i in range(near + 2):
        q = found[i] if i < near else (a if i == near else b)
        pq = row(front.nodes, q)
        if i < near and q != p and q != a and q != b:
            if abs(dot(subtract(pq, pa), normal)) < SHEET * length and inside_triangle(
                onto_tangent_plane(pq, pa, u, v), a2, b2, p2
            ):
                return False
            if (
                room > 0.0
                and front.out[q] >= 0
                and q != front.tail[front.previous[s]]
                and q != front.head[front.next[s]]
            ):
                if distance_to_segment(pq, pa, pp) < room or distance_to_segment(pq, pb, pp) < room:
                    return False
        t = front.out[q]
        while t >= 0:
            e = front.head[t]
            if t != s:
                pe = row(front.nodes, e)
                if q != a and e != a and q != p and e != p and lines_cross(pa, pp, pq, pe, SHEET * length):
                    return False
                if q != b and e != b and q != p and e != p and lines_cross(pb, pp, pq, pe, SHEET * length):
                    return False
            t = front.out_next[t]
    return True


@kernel
def far_from_front(
    front: Front, s: int, p: int, pp: Vector, found: np.ndarray, near: int, least: float, length: float
) -> bool:
    """Step 2 of Sec. 3.4: whether a new node keeps at least `least` to all surrounding front segments."""
    for i in range(near + 2):
        q = found[i] if i < near else (front.tail[s] if i == near else front.head[s])
        t = front.out[q]
        while t >= 0:
            if t != s and distance_to_segment(pp, row(front.nodes, q), row(front.nodes, front.head[t])) < least:
                return False
            t = front.out_next[t]
        if (
            i < near
            and q != p
            and norm(subtract(pp, row(front.nodes, q))) < (least if front.out[q] >= 0 else max(least, 0.45 * length))
        ):
            return False
    return True
