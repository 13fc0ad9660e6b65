"""Pairs of triangles that may intersect: those close together, except those proved to be apart in floating point.

A proof is a plane between the two, with both certainly on its sides whatever rounding did; the caller decides the few pairs left in
exact numbers. Differences of nearby nodes are rounded once, so the error of a sum of products of such differences is at most
ERROR_OF_PRODUCT times the sum of the absolute products.
"""

from __future__ import annotations

import numpy as np

from ...runtime.jit import kernel
from ..geometry.boxes import SearchBoxes, box_index, put, slot_of
from ..geometry.triangles import across_edge
from ..geometry.vectors import Vector, cross, dot, row, subtract, unit

ERROR_OF_PRODUCT = 1e-14  # relative error of a product of three differences, with a margin: forty times the last bit
BALL_MARGIN = 1.000001  # by which balls around triangles are larger, whatever rounding did
FOLDED_BACK = 1e-6  # cosine times the largest squared side by which two wings point apart


@kernel
def _certain_side(axis: Vector, arm: Vector) -> int:
    """Sign of axis . arm: 1 or -1 if rounding cannot change it, else 0."""
    value = dot(axis, arm)
    size = abs(axis[0] * arm[0]) + abs(axis[1] * arm[1]) + abs(axis[2] * arm[2])
    if abs(value) <= ERROR_OF_PRODUCT * size:
        return 0
    return 1 if value > 0.0 else -1


@kernel
def _certain_turn(a: Vector, b: Vector, c: Vector) -> int:
    """Sign of a . (b x c): 1 or -1 if rounding cannot change it, else 0."""
    value = dot(a, cross(b, c))
    size = abs(a[0]) * (abs(b[1] * c[2]) + abs(b[2] * c[1]))
    size += abs(a[1]) * (abs(b[2] * c[0]) + abs(b[0] * c[2]))
    size += abs(a[2]) * (abs(b[0] * c[1]) + abs(b[1] * c[0]))
    if abs(value) <= ERROR_OF_PRODUCT * size:
        return 0
    return 1 if value > 0.0 else -1


@kernel
def _parts(axis: Vector, a: Vector, b: Vector, c: Vector, d: Vector) -> bool:
    """Whether the arms a, b certainly point to one side of the plane at right angles to an axis, and c, d to the other."""
    side = _certain_side(axis, a)
    return (
        side != 0
        and _certain_side(axis, b) == side
        and _certain_side(axis, c) == -side
        and _certain_side(axis, d) == -side
    )


@kernel
def fans_apart(a: Vector, b: Vector, c: Vector, d: Vector) -> bool:
    """Whether two triangles at one node, given by arms a, b and c, d from it, certainly meet there only."""
    ua, ub, uc, ud = unit(a), unit(b), unit(c), unit(d)
    axis = (
        ua[0] + ub[0] - uc[0] - ud[0],
        ua[1] + ub[1] - uc[1] - ud[1],
        ua[2] + ub[2] - uc[2] - ud[2],
    )
    if _parts(axis, a, b, c, d):
        return True
    near, far, best = ua, uc, dot(ua, uc)  # the two arms with the gap between them
    for p, q in ((ua, ud), (ub, uc), (ub, ud)):
        if dot(p, q) > best:
            near, far, best = p, q, dot(p, q)
    if _parts(subtract(near, far), a, b, c, d):
        return True
    abc, abd, cda, cdb = _certain_turn(a, b, c), _certain_turn(a, b, d), _certain_turn(c, d, a), _certain_turn(c, d, b)
    if abc * abd > 0 or cda * cdb > 0:  # one triangle lies on one side of the plane of the other
        return True
    return abc * cda > 0 or abd * cda < 0 or abc * cdb < 0 or abd * cdb > 0  # planes through an arm of each


@kernel
def wings_apart(edge: Vector, c: Vector, d: Vector) -> bool:
    """Whether two triangles at one edge, with third nodes at arms c and d from its start, certainly meet there only."""
    if _certain_turn(edge, c, d) != 0:
        return True
    p, q = across_edge(edge, c), across_edge(edge, d)
    return dot(p, q) < -FOLDED_BACK * max(dot(edge, edge), dot(c, c), dot(d, d))


@kernel
def _gap(axis: Vector, a: Vector, b: Vector, c: Vector, d: Vector, e: Vector) -> bool:
    """Whether there is certainly a gap along an axis between the triangle of the arms 0, a, b and that of c, d, e."""
    pa, pb, pc, pd, pe = dot(axis, a), dot(axis, b), dot(axis, c), dot(axis, d), dot(axis, e)
    most = 0.0
    for arm in (a, b, c, d, e):
        most = max(most, abs(axis[0] * arm[0]) + abs(axis[1] * arm[1]) + abs(axis[2] * arm[2]))
    margin = 2.0 * ERROR_OF_PRODUCT * most
    low, high = min(0.0, pa, pb), max(0.0, pa, pb)
    return min(pc, pd, pe) > high + margin or max(pc, pd, pe) < low - margin


@kernel
def triangles_apart(a: Vector, b: Vector, c: Vector, d: Vector, e: Vector) -> bool:
    """Whether the triangle 0, a, b and the triangle c, d, e (arms from the first node of the first) are certainly apart.

    A gap is looked for along the line between their centres, both normals, and at right angles to each side in its plane. Gaps between
    two skew sides are rare among regular triangles, and left to the exact test.
    """
    middle = (
        c[0] + d[0] + e[0] - a[0] - b[0],
        c[1] + d[1] + e[1] - a[1] - b[1],
        c[2] + d[2] + e[2] - a[2] - b[2],
    )
    if _gap(middle, a, b, c, d, e):
        return True
    normal, other = cross(a, b), cross(subtract(d, c), subtract(e, c))
    if _gap(normal, a, b, c, d, e) or _gap(other, a, b, c, d, e):
        return True
    apart = False
    for side in (a, subtract(b, a), b):
        apart = apart or _gap(cross(normal, side), a, b, c, d, e)
    for side in (subtract(d, c), subtract(e, d), subtract(e, c)):
        apart = apart or _gap(cross(other, side), a, b, c, d, e)
    return apart


@kernel
def proved_apart(nodes: np.ndarray, triangles: np.ndarray, t: int, u: int) -> bool:
    """Whether two triangles certainly have nothing in common but the nodes and the edge that they share."""
    shared, i, j = 0, 0, 0  # i, j: positions in t and u of the last shared node
    alone_t, alone_u = 3, 3  # sums of the positions that are not shared
    for k in range(3):
        for m in range(3):
            if triangles[t, k] == triangles[u, m]:
                shared += 1
                i, j = k, m
                alone_t -= k
                alone_u -= m
    if shared == 0:
        start = row(nodes, triangles[t, 0])
        a, b = subtract(row(nodes, triangles[t, 1]), start), subtract(row(nodes, triangles[t, 2]), start)
        c = subtract(row(nodes, triangles[u, 0]), start)
        d, e = subtract(row(nodes, triangles[u, 1]), start), subtract(row(nodes, triangles[u, 2]), start)
        return triangles_apart(a, b, c, d, e)
    start = row(nodes, triangles[t, i])
    if shared == 1:
        a, b = row(nodes, triangles[t, (i + 1) % 3]), row(nodes, triangles[t, (i + 2) % 3])
        c, d = row(nodes, triangles[u, (j + 1) % 3]), row(nodes, triangles[u, (j + 2) % 3])
        return fans_apart(subtract(a, start), subtract(b, start), subtract(c, start), subtract(d, start))
    if shared == 2:
        end = row(nodes, triangles[t, 3 - i - alone_t])
        c, d = row(nodes, triangles[t, alone_t]), row(nodes, triangles[u, alone_u])
        return wings_apart(subtract(end, start), subtract(c, start), subtract(d, start))
    return False


@kernel
def doubtful_pairs(
    nodes: np.ndarray,
    triangles: np.ndarray,
    middles: np.ndarray,
    radii: np.ndarray,
    widest: float,
    boxes: SearchBoxes,
    pairs: np.ndarray,
) -> int:
    """Fill pairs (P, 2) with triangles that are not proved to be apart; returns how many there are, P where there may be more.

    Parameters
    ----------
    nodes, triangles : (V, 3), (T, 3)
    middles, radii : (T, 3), (T,) bounding balls of the triangles; widest : the largest radius
    boxes : empty, with room for T items
    """
    count = 0
    for t in range(len(triangles)):
        x, y, z = row(middles, t)
        reach = BALL_MARGIN * (radii[t] + widest)
        for i in range(box_index(boxes, 0, x - reach), box_index(boxes, 0, x + reach) + 1):
            for j in range(box_index(boxes, 1, y - reach), box_index(boxes, 1, y + reach) + 1):
                for k in range(box_index(boxes, 2, z - reach), box_index(boxes, 2, z + reach) + 1):
                    u = boxes.first[slot_of(boxes, i, j, k)]
                    while u >= 0:
                        d = subtract(row(middles, u), (x, y, z))
                        touch = BALL_MARGIN * (radii[t] + radii[u])
                        if dot(d, d) <= touch * touch and not proved_apart(nodes, triangles, u, t):
                            if count == len(pairs):
                                return count
                            pairs[count, 0], pairs[count, 1] = u, t
                            count += 1
                        u = boxes.next[u]
        put(boxes, t, x, y, z)
    return count
