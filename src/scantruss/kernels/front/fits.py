"""What may be attached to a front: nodes nearby, the angles of a segment, whether a triangle or node fits (Sec. 3.4, Table 1).

A triangle is valid if it leaves the grid manifold and crosses nothing on its own sheet (Eqs. 7-9 and more).
"""

from __future__ import annotations

import math

import numpy as np

from ...runtime.jit import kernel
from ..geometry.boxes import search
from ..geometry.triangles import (
    angle_from,
    distance_to_segment,
    inside_triangle,
    lines_cross,
    on_unmeshed_side,
    onto_tangent_plane,
)
from ..geometry.vectors import Vector, across, along, cross, dot, norm, row, subtract, unit
from ..surface.local_surface import Surface, linked
from .front import Front, edge_exists

# how far from a triangle a line of the front that faces as it does may be and still be crossed [member lengths]
FOLD_DISTANCE = 0.85
FACING_COSINE = 0.5  # least cosine of the angle between such a line and the triangle
SHEET_DISTANCE = 0.45  # distance from a triangle from which on another sheet begins [member lengths]
FACES_AWAY = -0.5  # cosine between normals below which places near each other lie on two sides of a sharp edge
# two nodes lie plainly on one sheet, or on two, by the cosine between their normals and the sine of the line between them
ONE_SHEET_FACING, ONE_SHEET_SLOPE = 0.8, 0.3
TWO_SHEETS_FACING, TWO_SHEETS_SLOPE = -0.5, 0.7
# how far from their middle samples may link two nodes: a share of their distance, and steps between samples
LINKED_WITHIN, LINKED_STEPS = 0.6, 1.5
LOOSE_ALIGNMENT, STRICT_ALIGNMENT = -0.2, 0.5  # least cosine between a triangle and the surface; what strictness 1 adds
LONGEST_EDGE, SHORTER_EDGE = 3.0, 1.2  # longest edge of a triangle; what strictness 1 takes off [member lengths]
ROOM_BESIDE_EDGE = 0.25  # distance of a node of the front from a new edge at strictness 1 [member lengths]
NO_SECTOR = 9.0  # stands for the angle of a node outside the unmeshed area; larger than a full turn [radian]
NO_DIFFERENCE = 1e-9  # distance, and angle, below which two are the same [member lengths, radian]


@kernel
def same_sheet(surface: Surface, front: Front, a: int, q: int, length: float) -> bool:
    """Whether two nodes lie on the same sheet of the surface: plainly side by side, or linked over the samples between them."""
    d = subtract(row(front.nodes, q), row(front.nodes, a))
    far = norm(d)
    na, nq = row(front.normals, a), row(front.normals, q)
    if far < NO_DIFFERENCE * length:
        return True
    flat = max(abs(dot(d, na)), abs(dot(d, nq))) / far
    facing = dot(na, nq)
    if facing > ONE_SHEET_FACING and flat < ONE_SHEET_SLOPE:
        return True
    if facing < TWO_SHEETS_FACING and flat > TWO_SHEETS_SLOPE:
        return False
    place = along(row(front.nodes, a), 0.5, d)
    return linked(surface, front.sample[a], front.sample[q], place, LINKED_WITHIN * far + LINKED_STEPS * surface.step)


@kernel
def faces_away(front: Front, normal: Vector, q: int) -> bool:
    """Whether a node lies on the other side of a sharp edge of a body, seen from a place of that normal."""
    return front.sharp_edges and dot(normal, row(front.normals, q)) < FACES_AWAY


@kernel
def near_nodes(surface: Surface, front: Front, s: int, reach: float, length: float, found: np.ndarray) -> int:
    """Nodes within reach of the middle of a segment, on its sheet; returns their number.

    Finished nodes are included: a front that has lost its way must not run over them.
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
    """Angle at the tail of a segment, from it to node q; NO_SECTOR if q is outside the unmeshed area there."""
    p = front.tail[leaving]
    place, normal = row(front.nodes, p), row(front.normals, p)
    base = subtract(row(front.nodes, front.head[leaving]), place)
    whole = angle_from(base, subtract(row(front.nodes, front.tail[front.previous[leaving]]), place), normal)
    if front.tail[front.previous[leaving]] == front.head[leaving] or whole < NO_DIFFERENCE:
        whole = 2.0 * math.pi
    angle = angle_from(base, subtract(row(front.nodes, q), place), normal)
    return angle if angle < whole else NO_SECTOR


@kernel
def passage_of(front: Front, s: int, p: int) -> int:
    """Segment that leaves node p where the triangle of s and p meets the front there; -1 if they do not meet properly."""
    a, b = front.tail[s], front.head[s]
    at = front.out[p]
    while at >= 0:
        to_a, to_b = _sector(front, at, a), _sector(front, at, b)
        if 0.0 < to_a < to_b < NO_SECTOR and at != s and front.previous[at] != s:
            return at
        at = front.out_next[at]
    return -1


@kernel
def fits(front: Front, s: int, p: int, found: np.ndarray, near: int, length: float, strict: float) -> tuple[bool, int]:
    """Whether the triangle of segment s and node p may be attached; and where it meets the front at p (see `attach`).

    It must lie on the unmeshed side (Eq. 7), face the same side as the surface, stay within the sectors of the front at its three nodes,
    repeat no edge, cross no segment of the front (Eqs. 8, 9) and hold no node of it. With `strict` 1 it must also keep clear of
    the front, with 0 it only has to be valid.
    """
    a, b = front.tail[s], front.head[s]
    before, after = front.previous[s], front.next[s]
    c, d = front.tail[before], front.head[after]
    pa, pb, pp = row(front.nodes, a), row(front.nodes, b), row(front.nodes, p)
    na, nb, np_ = row(front.normals, a), row(front.normals, b), row(front.normals, p)
    face = unit(cross(subtract(pb, pa), subtract(pp, pa)))
    least = LOOSE_ALIGNMENT + STRICT_ALIGNMENT * strict
    if dot(face, na) <= least or dot(face, nb) <= least or dot(face, np_) <= least:
        return False, -1
    if not on_unmeshed_side(pa, pb, pp, unit((na[0] + nb[0], na[1] + nb[1], na[2] + nb[2]))):
        return False, -1
    longest = (LONGEST_EDGE - SHORTER_EDGE * strict) * length
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
        if edge_exists(front, a, p) or _sector(front, s, p) >= NO_SECTOR:
            return False, -1
    if not closes_right:
        if edge_exists(front, b, p) or _sector(front, after, p) >= NO_SECTOR:
            return False, -1
    if closes_left:
        if _sector(front, before, b) >= NO_SECTOR:
            return False, -1
    elif closes_right:
        if _sector(front, front.next[after], a) >= NO_SECTOR:
            return False, -1
    else:
        if p < front.counts.nodes and front.out[p] >= 0:
            passage = passage_of(front, s, p)
            if passage < 0:
                return False, -1
    if not clear_of_front(front, s, p, pp, found, near, ROOM_BESIDE_EDGE * strict * length, length):
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
        if faces_away(front, normal, q):
            continue
        if i < near and q != p and q != a and q != b:
            if abs(dot(subtract(pq, pa), normal)) < SHEET_DISTANCE * length and inside_triangle(
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
            if t != s and q != p and e != p and not faces_away(front, normal, e):
                pe = row(front.nodes, e)
                # a line in a fold lies deep below a triangle that bridges it, and faces as that does
                faces = min(dot(normal, row(front.normals, q)), dot(normal, row(front.normals, e)))
                bridged = front.on_boundary[q] and front.on_boundary[e] and faces > FACING_COSINE
                apart = (FOLD_DISTANCE if bridged else SHEET_DISTANCE) * length
                if q != a and e != a and lines_cross(pa, pp, pq, pe, apart):
                    return False
                if q != b and e != b and lines_cross(pb, pp, pq, pe, apart):
                    return False
            t = front.out_next[t]
    return True
