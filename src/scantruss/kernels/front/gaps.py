"""Closing the gaps that a front leaves: the best triangles of a polygon by dynamic programming."""

from __future__ import annotations

import numpy as np

from ...runtime.jit import kernel
from ..geometry.triangles import shape_quality
from ..geometry.vectors import cross, dot, norm, row, subtract, unit
from .front import Front, add_triangle, edge_exists, link, remove_segment

MOST_SEGMENTS_OF_GAP = 120  # most segments of a loop that is triangulated; the time grows with their cube
# cosine between a triangle and the surface below which it costs more, and how much more
FACING_OF_GAP, FACING_COST = 0.5, 2.0
LONGEST_SIDE = 1.5  # longest side of a triangle that costs nothing [member lengths]


@kernel
def gap_loop(front: Front, s: int, loop: np.ndarray) -> int:
    """Segments of the shortest closed walk along the front from a segment back to a node it has met; returns their number.

    A loop that meets a node twice is taken apart there, so that the node keeps one fan. Segments form closed loops, so a walk meets
    a node again after no more steps than there are segments; `loop` has room for one more.
    """
    count = 0
    at = s
    while count < len(loop):
        for i in range(count):
            if front.tail[loop[i]] == front.tail[at]:
                for k in range(i, count):
                    loop[k - i] = loop[k]
                return count - i
        loop[count] = at
        count += 1
        at = front.next[at]
    return 0


@kernel
def triangle_cost(front: Front, a: int, b: int, c: int, length: float) -> float:
    """Cost of a triangle: shape, size, and whether it faces the same side as the surface at its nodes."""
    pa, pb, pc = row(front.nodes, a), row(front.nodes, b), row(front.nodes, c)
    face = unit(cross(subtract(pb, pa), subtract(pc, pa)))
    worst = min(dot(face, row(front.normals, a)), dot(face, row(front.normals, b)), dot(face, row(front.normals, c)))
    longest = max(norm(subtract(pb, pa)), norm(subtract(pc, pb)), norm(subtract(pa, pc))) / length
    return (
        (1.0 - shape_quality(pa, pb, pc))
        + max(FACING_OF_GAP - worst, 0.0) * FACING_COST
        + max(longest - LONGEST_SIDE, 0.0)
    )


@kernel
def close_gap(front: Front, loop: np.ndarray, count: int, length: float) -> int:
    """Fill a closed loop of front segments with triangles of least total cost; returns their number, 0 if none fit.

    New edges must not exist yet, so the grid stays manifold.
    """
    node = np.empty(count, np.int64)
    for i in range(count):
        node[i] = front.tail[loop[i]]
    if count < 3 or count > MOST_SEGMENTS_OF_GAP:
        return 0
    cost = np.full((count, count), np.inf)
    split = np.full((count, count), -1, np.int64)
    for i in range(count - 1):
        cost[i, i + 1] = 0.0
    for span in range(2, count):
        for i in range(count - span):
            j = i + span
            if span < count - 1 and edge_exists(front, node[i], node[j]):
                continue
            for k in range(i + 1, j):
                if cost[i, k] < np.inf and cost[k, j] < np.inf:
                    total = cost[i, k] + cost[k, j] + triangle_cost(front, node[i], node[k], node[j], length)
                    if total < cost[i, j]:
                        cost[i, j], split[i, j] = total, k
    if cost[0, count - 1] == np.inf:
        return 0
    stack = np.empty((count, 2), np.int64)
    stack[0, 0], stack[0, 1] = 0, count - 1
    held, made = 1, 0
    while held > 0:  # a piece of a polygon with k sides gives k - 2 triangles, whatever the turns
        held -= 1
        i, j = stack[held, 0], stack[held, 1]
        if j - i < 2:
            continue
        k = split[i, j]
        add_triangle(front, node[i], node[k], node[j])
        made += 1
        stack[held, 0], stack[held, 1] = i, k
        stack[held + 1, 0], stack[held + 1, 1] = k, j
        held += 2
    cut_out(front, loop[:count])
    return made


@kernel
def cut_out(front: Front, loop: np.ndarray) -> None:
    """Take a closed walk of segments (K,) off the front; the segments before and after it follow each other from now on."""
    last = loop[len(loop) - 1]
    before, after = front.previous[loop[0]], front.next[last]
    for i in range(len(loop)):
        remove_segment(front, loop[i])
    if before != last:
        link(front, before, after)
