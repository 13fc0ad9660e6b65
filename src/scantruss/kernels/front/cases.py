"""The six cases of advancing a segment (Table 1) and the optimal point (Sec. 3.4), to the letter of the paper."""

from __future__ import annotations

import math

import numpy as np

from ...runtime.jit import kernel
from ..geometry.boxes import put, take
from ..geometry.triangles import distance_to_segment, on_unmeshed_side, quality, shape_quality, turned
from ..geometry.vectors import Vector, along, cross, dot, norm, row, subtract, unit
from ..surface.local_surface import Surface, fit_patch, flood, onto_patch, patch_normal, walk
from .fits import clear_of_front, faces_away, fits, left_angle, near_nodes, right_angle
from .front import (
    INACTIVE,
    Front,
    Rules,
    add_node,
    add_triangle,
    attach,
    edge_exists,
    enqueue,
    link,
    propose_node,
    remove_segment,
)

# What the paper leaves open: how strictly a triangle is tested.
CASE_STRICTNESS = 0.7  # strictness of the tests for a triangle that a case asks for, from 0 to 1
LEAST_MERGED_SHAPE = 0.4  # shape quality below which the triangle of two merged nodes is too flat
LEAST_FINISHED_SHAPE = 0.35  # shape quality below which merging would leave a finished triangle too flat
# cosine of the angle between a triangle and the surface at its nodes, below which it stands up from it
LEAST_ALIGNMENT = 0.5
FARTHEST_MERGED = 0.9  # free nodes farther apart than this are not merged [lengths]
LEAST_DELTA = 0.3  # quality delta below which no triangle with an existing node is made
SEARCH_REACH = 2.4  # distance from a segment up to which nodes of the front are considered [lengths]
# least distance of a new node from a candidate node that the front has not reached yet [lengths]
CANDIDATE_CLEARANCE = 0.45
# how far from their middle the point is looked for that two nodes become [steps between samples]
STEPS_AROUND_MERGED = 2.0
MARGIN_OF_SEARCH = 1.5  # how much farther than the search range the samples reach whose points are looked at
WIDENED_SEARCH = 2.0  # by which a search range without points grows, once

# numbers of the cases in Table 1: closed triangle, closed quadrangle, both angles small, none, only beta, only alpha
CASE_1, CASE_2, CASE_3, CASE_4, CASE_5, CASE_6 = 1, 2, 3, 4, 5, 6


@kernel
def case_of(front: Front, s: int, alpha: float, beta: float, limit: float) -> int:
    """Which of the six cases of Table 1 a segment is in; alpha, beta and their limit in radians."""
    before, after = front.previous[s], front.next[s]
    at_end = front.tail[before] == front.head[s] or front.head[after] == front.tail[s]  # of a line
    if front.next[after] == before and not at_end:
        return CASE_1
    if front.next[front.next[after]] == before and not at_end:
        return CASE_2
    if alpha < limit and beta < limit:
        return CASE_3
    if alpha < limit:
        return CASE_6
    return CASE_5 if beta < limit else CASE_4


@kernel
def reach(length: float, segment: float, w1: float) -> float:
    """Eq. 10: the distance r of the ideal point from a segment, from the desired length and the segment's own."""
    return 0.5 * math.sqrt(3.0) * (w1 * length + (1.0 - w1) * segment)


@kernel
def try_node(front: Front, s: int, p: int, rules: Rules, found: np.ndarray, near: int) -> bool:
    """Attach node p to a segment if that fits."""
    good, passage = fits(front, s, p, found, near, rules.length, CASE_STRICTNESS)
    if good:
        attach(front, s, p, passage)
    return good


@kernel
def close_triangle(front: Front, s: int, rules: Rules, found: np.ndarray, near: int) -> bool:
    """Table 1, case 1: the neighbours meet."""
    return try_node(front, s, front.tail[front.previous[s]], rules, found, near)


@kernel
def close_left(front: Front, s: int, rules: Rules, found: np.ndarray, near: int) -> bool:
    """Table 1, case 6: a triangle with the previous neighbour."""
    return try_node(front, s, front.tail[front.previous[s]], rules, found, near)


@kernel
def close_right(front: Front, s: int, rules: Rules, found: np.ndarray, near: int) -> bool:
    """Table 1, case 5: a triangle with the next neighbour."""
    return try_node(front, s, front.head[front.next[s]], rules, found, near)


@kernel
def close_quadrangle(front: Front, s: int, rules: Rules, found: np.ndarray, near: int) -> bool:
    """Table 1, case 2: the better diagonal of a quadrangle; its other triangle is then case 1."""
    a, b = row(front.nodes, front.tail[s]), row(front.nodes, front.head[s])
    c = row(front.nodes, front.tail[front.previous[s]])
    d = row(front.nodes, front.head[front.next[s]])
    left = min(shape_quality(a, b, c), shape_quality(b, d, c))
    right = min(shape_quality(a, b, d), shape_quality(a, d, c))
    if left >= right:
        return close_left(front, s, rules, found, near) or close_right(front, s, rules, found, near)
    return close_right(front, s, rules, found, near) or close_left(front, s, rules, found, near)


@kernel
def _fan_holds(front: Front, node: int, place: Vector) -> bool:
    """Whether the finished triangles at a node stay sound when it moves."""
    at = front.corner[node]
    while at >= 0:
        t, k = at // 3, at % 3
        q, r = front.triangles[t, (k + 1) % 3], front.triangles[t, (k + 2) % 3]
        pq, pr = row(front.nodes, q), row(front.nodes, r)
        face = unit(cross(subtract(pq, place), subtract(pr, place)))
        if dot(face, row(front.normals, q)) < LEAST_ALIGNMENT or shape_quality(place, pq, pr) < LEAST_FINISHED_SHAPE:
            return False
        at = front.corner_next[at]
    return True


@kernel
def _share_neighbor(front: Front, c: int, d: int, a: int, b: int) -> bool:
    """Whether two nodes have a common neighbour besides a and b: merging them would pinch the grid."""
    at = front.corner[c]
    while at >= 0:
        t = at // 3
        for k in range(3):
            q = front.triangles[t, k]
            if q != c and q != a and q != b and (q == d or edge_exists(front, q, d)):
                return True
        at = front.corner_next[at]
    s = front.out[c]
    while s >= 0:
        q, w = front.head[s], front.tail[front.previous[s]]
        if (q != a and q != b and edge_exists(front, q, d)) or (w != a and w != b and edge_exists(front, w, d)):
            return True
        s = front.out_next[s]
    return False


@kernel
def merge_neighbors(surface: Surface, front: Front, s: int, rules: Rules, found: np.ndarray, near: int) -> bool:
    """Table 1, case 3: the free ends of both neighbours merge into the point of the cloud closest to them.

    Nodes of a boundary stay: the other end comes to them. Where finished triangles would turn over, nothing is merged.
    """
    a, b = front.tail[s], front.head[s]
    before, after = front.previous[s], front.next[s]
    c, d = front.tail[before], front.head[after]
    if front.on_boundary[c] and front.on_boundary[d]:
        return False
    if c == d or edge_exists(front, c, d) or _share_neighbor(front, c, d, a, b):
        return False
    pc, pd = row(front.nodes, c), row(front.nodes, d)
    if norm(subtract(pd, pc)) > FARTHEST_MERGED * rules.length:
        return False
    middle = along(pc, 0.5, subtract(pd, pc))
    keep, lose = (d, c) if front.on_boundary[d] else (c, d)
    place = middle
    if front.on_boundary[keep]:
        place = row(front.nodes, keep)
    else:
        sample = walk(surface, front.sample[c], middle)
        count = flood(surface, sample, middle, STEPS_AROUND_MERGED * surface.step)
        least = 1e300
        for i in range(count):
            t = surface.queue[i]
            for p in range(surface.start[t], surface.start[t + 1]):
                away = subtract(row(surface.points, p), middle)
                if dot(away, away) < least:
                    least, place = dot(away, away), row(surface.points, p)
    pa, pb = row(front.nodes, a), row(front.nodes, b)
    face = unit(cross(subtract(pb, pa), subtract(place, pa)))
    if dot(face, row(front.normals, a)) < LEAST_ALIGNMENT or shape_quality(pa, pb, place) < LEAST_MERGED_SHAPE:
        return False
    if not (_fan_holds(front, c, place) and _fan_holds(front, d, place)):
        return False
    for i in range(near):
        if found[i] == lose:
            found[i] = keep
    if not clear_of_front(front, s, keep, place, found, near, 0.0, rules.length):
        return False
    _merge(front, keep, lose, place)
    x, y = front.previous[before], front.next[after]
    remove_segment(front, before)
    remove_segment(front, s)
    remove_segment(front, after)
    add_triangle(front, a, b, keep)
    link(front, x, y)
    if front.state[x] != INACTIVE:
        enqueue(front, x)
    if front.state[y] != INACTIVE:
        enqueue(front, y)
    return True


@kernel
def _merge(front: Front, keep: int, lose: int, place: Vector) -> None:
    """Give one node the triangles and segments of another, and move it; its normal becomes the mean of both."""
    take(front.boxes, keep, front.nodes[keep, 0], front.nodes[keep, 1], front.nodes[keep, 2])
    take(front.boxes, lose, front.nodes[lose, 0], front.nodes[lose, 1], front.nodes[lose, 2])
    front.nodes[keep, 0], front.nodes[keep, 1], front.nodes[keep, 2] = place
    n, m = row(front.normals, keep), row(front.normals, lose)
    front.normals[keep, 0], front.normals[keep, 1], front.normals[keep, 2] = unit(
        (n[0] + m[0], n[1] + m[1], n[2] + m[2])
    )
    put(front.boxes, keep, place[0], place[1], place[2])
    at = front.corner[lose]
    while at >= 0:
        following = front.corner_next[at]
        front.triangles[at // 3, at % 3] = keep
        front.corner_next[at] = front.corner[keep]
        front.corner[keep] = at
        at = following
    front.corner[lose] = front.sample[lose] = -1
    s = front.out[lose]
    while s >= 0:
        following = front.out_next[s]
        front.head[front.previous[s]] = keep
        front.tail[s] = keep
        front.out_next[s] = front.out[keep]
        front.out[keep] = s
        s = following
    front.out[lose] = -1


@kernel
def divide_quadrangle(front: Front, s: int, rules: Rules, found: np.ndarray, near: int) -> bool:
    """Case 3 after Foucault et al. [30]: the free ends are joined, and the quadrangle is divided by a diagonal."""
    c, d = front.tail[front.previous[s]], front.head[front.next[s]]
    if edge_exists(front, c, d):
        return False
    before = front.previous[s]
    a, b = row(front.nodes, front.tail[s]), row(front.nodes, front.head[s])
    pc, pd = row(front.nodes, c), row(front.nodes, d)
    left = min(shape_quality(a, b, pc), shape_quality(b, pd, pc))
    right = min(shape_quality(a, b, pd), shape_quality(a, pd, pc))
    if left >= right:
        after = front.next[s]
        if not close_left(front, s, rules, found, near):
            return False
        close_right(front, front.previous[after], rules, found, near)
        return True
    if not close_right(front, s, rules, found, near):
        return False
    close_left(front, front.next[before], rules, found, near)
    return True


@kernel
def optimal_point(surface: Surface, front: Front, s: int, rules: Rules, patch: np.record) -> bool:
    """Step 1 of Sec. 3.4: propose the point of the cloud that makes the best triangle with a segment; False if there is none.

    The search covers the points no farther than b from the plane that halves the segment, at r - h to r + h from the segment, on its
    unmeshed side (Eq. 7). A region without points is doubled once; then the segment waits for a later round.
    """
    a, b = front.tail[s], front.head[s]
    pa, pb = row(front.nodes, a), row(front.nodes, b)
    na, nb = row(front.normals, a), row(front.normals, b)
    normal = unit((na[0] + nb[0], na[1] + nb[1], na[2] + nb[2]))
    ab = subtract(pb, pa)
    segment = norm(ab)
    e = unit(ab)
    middle = along(pa, 0.5, ab)
    r = reach(rules.length, segment, rules.length_weight)
    ideal = along(middle, r, turned(ab, normal, 0.5 * math.pi))
    sample = walk(surface, front.sample[a], ideal)
    extent = rules.search_range
    best, chosen, of = -1.0, -1, sample
    for _ in range(2):
        count = flood(surface, sample, ideal, MARGIN_OF_SEARCH * extent + surface.step)
        for i in range(count):
            t = surface.queue[i]
            if dot(row(surface.normals, t), normal) < 0.0:
                continue
            for p in range(surface.start[t], surface.start[t + 1]):
                place = row(surface.points, p)
                if (
                    abs(dot(subtract(place, middle), e)) > extent
                    or abs(distance_to_segment(place, pa, pb) - r) > extent
                ):
                    continue
                if not on_unmeshed_side(pa, pb, place, normal):
                    continue
                value = quality(pa, pb, place, segment, rules.shape_weight, rules.size_weight)
                if value > best:
                    best, chosen, of = value, p, t
        if chosen >= 0:
            break
        extent *= WIDENED_SEARCH
    if chosen < 0:
        return False
    place = row(surface.points, chosen)
    if fit_patch(surface, patch, of, place) < 3:
        return False
    propose_node(front, place, patch_normal(patch, onto_patch(patch, place)), of, False)
    return True


@kernel
def far_from_front(
    front: Front, s: int, p: int, pp: Vector, found: np.ndarray, near: int, least: float, length: float
) -> bool:
    """Step 2 of Sec. 3.4: whether a new node is at least `least` away from all surrounding front segments."""
    normal = row(front.normals, p)
    for i in range(near + 2):
        q = found[i] if i < near else (front.tail[s] if i == near else front.head[s])
        if faces_away(front, normal, q):
            continue
        t = front.out[q]
        while t >= 0:
            e = front.head[t]
            near_it = distance_to_segment(pp, row(front.nodes, q), row(front.nodes, e)) < least
            if t != s and near_it and not faces_away(front, normal, e):
                return False
            t = front.out_next[t]
        if (
            i < near
            and q != p
            and norm(subtract(pp, row(front.nodes, q)))
            < (least if front.out[q] >= 0 else max(least, CANDIDATE_CLEARANCE * length))
        ):
            return False
    return True


@kernel
def best_existing_node(front: Front, s: int, rules: Rules, found: np.ndarray, near: int, pp: Vector) -> bool:
    """Step 3 of Sec. 3.4: the best triangle with an end of the segments that are too near to the optimal point."""
    pa, pb = row(front.nodes, front.tail[s]), row(front.nodes, front.head[s])
    segment = norm(subtract(pb, pa))
    score = np.full(near, -1.0)
    for i in range(near):
        q = found[i]
        t = front.out[q]
        while t >= 0:
            pq = row(front.nodes, q)
            pe = row(front.nodes, front.head[t])
            w = front.tail[front.previous[t]]
            least = min(distance_to_segment(pp, pq, pe), distance_to_segment(pp, row(front.nodes, w), pq))
            if least < rules.nearness * rules.length:
                score[i] = quality(pa, pb, pq, segment, rules.shape_weight, rules.size_weight)
            t = front.out_next[t]
    for _ in range(near):
        i = int(np.argmax(score))
        if score[i] <= LEAST_DELTA:
            return False
        if try_node(front, s, found[i], rules, found, near):
            return True
        score[i] = -1.0
    return False


@kernel
def new_node(
    surface: Surface, front: Front, s: int, rules: Rules, found: np.ndarray, near: int, patch: np.record
) -> bool:
    """Table 1, case 4: the three steps of Sec. 3.4."""
    if not optimal_point(surface, front, s, rules, patch):
        return False
    p = front.counts.nodes
    pp = row(front.nodes, p)
    if far_from_front(front, s, p, pp, found, near, rules.nearness * rules.length, rules.length):
        good, passage = fits(front, s, p, found, near, rules.length, CASE_STRICTNESS)
        if good:
            add_node(front)
            attach(front, s, p, passage)
            return True
    if near == 0:
        return False
    return best_existing_node(front, s, rules, found, near, pp)


@kernel
def choose_by_case(surface: Surface, front: Front, s: int, rules: Rules, found: np.ndarray, patch: np.record) -> bool:
    """Advance a segment by the six cases of Table 1; False if the case's triangle does not fit."""
    near = near_nodes(surface, front, s, SEARCH_REACH * rules.length, rules.length, found)
    case = case_of(front, s, left_angle(front, s), right_angle(front, s), rules.merge_angle)
    if case == CASE_1:
        return close_triangle(front, s, rules, found, near)
    if case == CASE_2:
        return close_quadrangle(front, s, rules, found, near)
    if case == CASE_3:
        if rules.quadrangle:
            return divide_quadrangle(front, s, rules, found, near)
        if merge_neighbors(surface, front, s, rules, found, near):
            return True
        return close_quadrangle(front, s, rules, found, near)
    if case == CASE_5:
        return close_right(front, s, rules, found, near)
    if case == CASE_6:
        return close_left(front, s, rules, found, near)
    return new_node(surface, front, s, rules, found, near, patch)
