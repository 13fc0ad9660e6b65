"""Choosing the triangle of a segment, and the loop over active segments (Sec. 3.4, 3.5)."""

from __future__ import annotations

import math

import numpy as np

from ...runtime.jit import kernel
from ..geometry.triangles import quality, turned
from ..geometry.vectors import Vector, along, cross, dot, norm, row, subtract, unit
from ..surface.local_surface import (
    SURFACE_PATCH,
    Surface,
    fit_patch,
    flood,
    onto_patch,
    patch_normal,
    walk,
)
from ..surface.size_field import length_at
from .cases import choose_by_case, far_from_front
from .fits import fits, left_angle, near_nodes, right_angle
from .front import (
    ACTIVE,
    DONE,
    FULL,
    MORE,
    MOST_NEAR_NODES,
    WAITING,
    Front,
    Rules,
    add_node,
    attach,
    propose_node,
    rules_at,
)

ALONG_LIMB = 0.3  # cosine between a triangle and the normal at a node below which it may shut off a limb
# distance of the middle of a triangle from the nearest sample at which it has left the sheet [member lengths]
TRIANGLE_OFF_SHEET = 0.36
# how far such a triangle looks for more scan, and what may lie beyond it [member lengths]
SIGHT_BEYOND_TRIANGLE, LARGEST_TIP_BEYOND = 0.9, 0.55
STEPS_AROUND = 4  # in which the surface is followed around a bend
NO_BEND = 0.8  # cosine between the normals before and behind a bend above which it is none
GOOD_ENOUGH = 0.8  # quality with an existing node, as a share of the best possible, above which no new node is tried
SEEN_FROM, SEEN_TO = 0.4, 1.1  # distances from a line between which the surface beside it is looked at [member lengths]
PART_OF_ANGLE = 1.3  # most that one part of an angle of the front may be [radian]
REFLEX_ANGLE = 3.6  # angle above which the front turns back at a node and the first part is 60 degrees [radian]
FARTHEST_SAMPLE = 0.9  # distance from a new node to the nearest sample at which the scan has ended [member lengths]
REGULAR_HEIGHT = 0.87  # height of a regular triangle [sides]
HEIGHT_OF_LENGTH = 0.4  # distance from a segment at which the length of its triangle is looked up [member lengths]
# how a new triangle is looked for: the value at strictness 1, and what strictness 0 adds to it
AROUND_SEGMENT, FARTHER_AROUND_SEGMENT = 2.4, 0.8  # distance up to which nodes are considered [member lengths]
WIDEST_CLOSED, WIDER_CLOSED = 2.2, 0.7  # widest angle that a triangle with a neighbour closes [radian]
AROUND_IDEAL, FARTHER_AROUND_IDEAL = 0.75, 0.9  # distance of a node from the ideal point [member lengths]
# least distance of a new node from the front, as a share of the setting: at strictness 0, what strictness 1 adds, and for both
LOOSE_ROOM, STRICT_ROOM, ROOM_OF_NEW_NODE = 0.4, 0.6, 1.1
ROOM_OF_CANDIDATE = 0.5  # least distance of a candidate node from the front, as a share of the setting
# of the quality with a node of the front that is no neighbour, a candidate
WORTH_OF_FRONT_NODE, WORTH_OF_CANDIDATE = 0.9, 0.95
LEAST_QUALITY = 0.5  # quality at strictness 1 below which a triangle waits for a later round
STEEP_SIDE = 0.6  # cosine of the angle between that side and the plane of its nodes below which the side is followed


@kernel
def ideal_point(front: Front, s: int, alpha: float, beta: float, side: float) -> Vector:
    """The ideal point of a segment: it divides the angles at both ends into equal parts near 60 degrees."""
    a, b = front.tail[s], front.head[s]
    pa, pb = row(front.nodes, a), row(front.nodes, b)
    ab = subtract(pb, pa)
    at_a = min(alpha / max(1.0, math.floor(alpha * 3.0 / math.pi + 0.5)), PART_OF_ANGLE)
    at_b = min(beta / max(1.0, math.floor(beta * 3.0 / math.pi + 0.5)), PART_OF_ANGLE)
    if alpha > REFLEX_ANGLE:
        at_a = math.pi / 3.0
    if beta > REFLEX_ANGLE:
        at_b = math.pi / 3.0
    from_a = along(pa, side, turned(ab, row(front.normals, a), at_a))
    from_b = along(pb, side, turned((-ab[0], -ab[1], -ab[2]), row(front.normals, b), -at_b))
    return 0.5 * (from_a[0] + from_b[0]), 0.5 * (from_a[1] + from_b[1]), 0.5 * (from_a[2] + from_b[2])


@kernel
def beside_line(surface: Surface, front: Front, s: int, place: Vector, length: float) -> Vector:
    """An ideal point beside a segment of a line, turned onto the side of the surface to its left where that falls off steeply.

    At a sharp edge of a body, the nodes face as both sides together do, and neither side lies in their plane.
    """
    pa, pb = row(front.nodes, front.tail[s]), row(front.nodes, front.head[s])
    middle = along(pa, 0.5, subtract(pb, pa))
    way = unit(subtract(pb, pa))
    arm = subtract(place, middle)
    ahead = dot(arm, way)
    left = along(arm, -ahead, way)
    height = norm(left)
    left = unit(left)
    side = (0.0, 0.0, 0.0)
    count = flood(surface, walk(surface, front.sample[front.tail[s]], middle), middle, SEEN_TO * length)
    for i in range(count):
        d = subtract(row(surface.mean, surface.queue[i]), middle)
        d = along(d, -dot(d, way), way)
        far = norm(d)
        if far > SEEN_FROM * length and dot(d, left) > 0.0:
            side = along(side, 1.0 / far, d)
    side = unit(side)
    if norm(side) == 0.0 or dot(side, left) > STEEP_SIDE:
        return place
    return along(along(middle, ahead, way), height, side)


@kernel
def propose_on_surface(surface: Surface, front: Front, s: int, place: Vector, patch: np.record) -> bool:
    """Propose a node at the projection of a place onto the surface; False if the scan has no points there."""
    sample = front.sample[front.tail[s]]
    if fit_patch(surface, patch, sample, place) < 3:
        return False
    foot = onto_patch(patch, place)
    near = walk(surface, patch.sample, foot)
    gap = norm(subtract(row(surface.mean, near), foot))
    normal = patch_normal(patch, foot)
    propose_node(front, foot, normal, near, False)
    return gap < FARTHEST_SAMPLE * surface.length * surface.field[near]


@kernel
def goes_on(surface: Surface, sample: int, middle: Vector, ahead: Vector, length: float) -> bool:
    """Whether the sheet of a sample goes on beyond a place in a direction, as a limb does beyond a triangle across it."""
    far = along(middle, SIGHT_BEYOND_TRIANGLE * length, ahead)
    sample = walk(surface, sample, far)
    return dot(subtract(row(surface.mean, sample), middle), ahead) > LARGEST_TIP_BEYOND * length


@kernel
def off_sheet(surface: Surface, sample: int, middle: Vector, length: float) -> bool:
    """Whether a place has left the sheet of a sample near it."""
    return norm(subtract(row(surface.mean, walk(surface, sample, middle)), middle)) > TRIANGLE_OFF_SHEET * length


@kernel
def shuts_off(surface: Surface, front: Front, s: int, p: int, length: float, strict: float) -> bool:
    """Whether the triangle of segment s and node p lies across a limb, or leaves the sheet there, and not along it."""
    a, b = front.tail[s], front.head[s]
    pa, pb, pp = row(front.nodes, a), row(front.nodes, b), row(front.nodes, p)
    middle = (pa[0] + pb[0] + pp[0]) / 3.0, (pa[1] + pb[1] + pp[1]) / 3.0, (pa[2] + pb[2] + pp[2]) / 3.0
    off = off_sheet(surface, front.sample[a], middle, length)
    if off and strict > 0.0:
        return True
    face = unit(cross(subtract(pb, pa), subtract(pp, pa)))
    across_limb = 0
    for q in (a, b, p):
        across_limb += dot(face, row(front.normals, q)) < ALONG_LIMB
    return (off or across_limb >= 2) and goes_on(surface, front.sample[a], middle, face, length)


@kernel
def propose_around_bend(surface: Surface, front: Front, s: int, side: float, patch: np.record) -> bool:
    """Propose a node at the height of a regular triangle over a segment, measured along the surface, where that bends sharply.

    In the plane of the segment the same way leads across a limb to its other side. False where the surface hardly bends.
    """
    a, b = front.tail[s], front.head[s]
    pa, pb, na, nb = row(front.nodes, a), row(front.nodes, b), row(front.normals, a), row(front.normals, b)
    ab = subtract(pb, pa)
    place, first = along(pa, 0.5, ab), unit((na[0] + nb[0], na[1] + nb[1], na[2] + nb[2]))
    normal, sample = first, front.sample[a]
    ahead = unit(cross(first, ab))
    for _ in range(STEPS_AROUND):
        place = along(place, REGULAR_HEIGHT * side / STEPS_AROUND, ahead)
        if fit_patch(surface, patch, sample, place) < 3:
            return False
        place = onto_patch(patch, place)
        normal, sample = patch_normal(patch, place), walk(surface, patch.sample, place)
        ahead = unit(along(ahead, -dot(ahead, normal), normal))
    if dot(normal, first) > NO_BEND:
        return False
    propose_node(front, place, normal, sample, False)
    return (
        norm(subtract(row(surface.mean, sample), place)) < TRIANGLE_OFF_SHEET * surface.length * surface.field[sample]
    )


@kernel
def choose_by_quality(
    surface: Surface, front: Front, s: int, rules: Rules, found: np.ndarray, patch: np.record
) -> bool:
    """Attach the best triangle that fits: with a neighbour's end, a node of the front nearby or a new node; False if none fits."""
    length, strict = rules.length, rules.strict
    a, b = front.tail[s], front.head[s]
    pa, pb = row(front.nodes, a), row(front.nodes, b)
    before, after = front.previous[s], front.next[s]
    c, d = front.tail[before], front.head[after]
    around_segment = (AROUND_SEGMENT + FARTHER_AROUND_SEGMENT * (1.0 - strict)) * length
    near = near_nodes(surface, front, s, around_segment, length, found)
    alpha, beta = left_angle(front, s), right_angle(front, s)
    segment = norm(subtract(pb, pa))
    side = rules.length_weight * length + (1.0 - rules.length_weight) * segment  # mixed as in Eq. 10
    place = ideal_point(front, s, alpha, beta, side)
    if front.sharp_edges and front.on_boundary[a] and front.on_boundary[b]:
        place = beside_line(surface, front, s, place, length)
    widest = WIDEST_CLOSED + WIDER_CLOSED * (1.0 - strict)
    around = (AROUND_IDEAL + FARTHER_AROUND_IDEAL * (1.0 - strict)) * length
    room = (LOOSE_ROOM + STRICT_ROOM * strict) * rules.nearness * length * ROOM_OF_NEW_NODE
    score = np.full(near + 1, -1.0)
    for i in range(near):
        q = found[i]
        if front.out[q] < 0 and front.corner[q] >= 0:
            continue
        pq = row(front.nodes, q)
        value = quality(pa, pb, pq, side, rules.shape_weight, rules.size_weight)
        if q in (c, d):
            if (q == c and alpha < widest) or (q == d and beta < widest):
                score[i] = value
        elif norm(subtract(pq, place)) < around:
            if front.out[q] >= 0:
                score[i] = WORTH_OF_FRONT_NODE * value
            elif far_from_front(front, s, q, pq, found, near, ROOM_OF_CANDIDATE * rules.nearness * length, length):
                score[i] = WORTH_OF_CANDIDATE * value  # a candidate node that the front has not reached yet
    enough = GOOD_ENOUGH * (rules.shape_weight + rules.size_weight)
    proposed = around_bend = False
    while True:  # each turn proposes one of two new nodes or takes a candidate out
        best = -1
        for i in range(near + 1):
            if score[i] > 0.0 and (best < 0 or score[i] > score[best]):
                best = i
        if not proposed and (best < 0 or score[best] < enough):
            proposed = True
            if propose_on_surface(surface, front, s, place, patch):
                pp = row(front.nodes, front.counts.nodes)
                if far_from_front(front, s, front.counts.nodes, pp, found, near, room, length):
                    score[near] = quality(pa, pb, pp, side, rules.shape_weight, rules.size_weight)
            continue
        if best < 0 or score[best] < LEAST_QUALITY * strict:
            if around_bend or not propose_around_bend(surface, front, s, side, patch):
                return False
            around_bend = True
            pp = row(front.nodes, front.counts.nodes)
            if far_from_front(front, s, front.counts.nodes, pp, found, near, room, length):
                score[near] = quality(pa, pb, pp, side, rules.shape_weight, rules.size_weight)
            continue
        p = found[best] if best < near else front.counts.nodes
        good, passage = fits(front, s, p, found, near, length, strict)
        if good and not shuts_off(surface, front, s, p, length, strict):
            if best == near:
                add_node(front)
            attach(front, s, p, passage)
            return True
        score[best] = -1.0


@kernel
def has_room(front: Front) -> bool:
    """Whether the arrays hold what advancing one segment may add."""
    return (
        front.counts.nodes + 2 <= len(front.nodes)
        and front.counts.segments + 4 <= len(front.tail)
        and front.counts.triangles + 3 <= len(front.triangles)
        and front.counts.last - front.counts.first + 4 <= len(front.queue)
    )


@kernel
def take_segment(front: Front) -> int:
    """Next active segment of the queue, -1 if it is empty."""
    while front.counts.first < front.counts.last:  # each turn takes one out
        s = front.queue[front.counts.first % len(front.queue)]
        front.counts.first += 1
        if front.state[s] == ACTIVE:
            return s
    return -1


@kernel
def rules_of_segment(surface: Surface, front: Front, s: int, rules: Rules) -> Rules:
    """The rules with the length that is desired where the triangle of a segment will lie."""
    if not rules.graded:
        return rules
    a, b = front.tail[s], front.head[s]
    pa, pb = row(front.nodes, a), row(front.nodes, b)
    ab = subtract(pb, pa)
    height = HEIGHT_OF_LENGTH * rules.desired * surface.field[front.sample[a]]
    place = along(along(pa, 0.5, ab), height, turned(ab, row(front.normals, a), 0.5 * math.pi))
    return rules_at(rules, rules.desired * length_at(surface, front.sample[a], place))


@kernel
def advance(surface: Surface, front: Front, rules: Rules, budget: int) -> int:
    """Advance segments by quality until none is left (DONE), the budget is spent (MORE) or an array is full (FULL)."""
    found = np.empty(MOST_NEAR_NODES, np.int64)
    patch = np.zeros(1, SURFACE_PATCH)
    for _ in range(budget):
        if not has_room(front):
            return FULL
        s = take_segment(front)
        if s < 0:
            return DONE
        own = rules_of_segment(surface, front, s, rules)
        if not choose_by_quality(surface, front, s, own, found, patch[0]):
            front.state[s] = WAITING
    return MORE


@kernel
def advance_by_cases(surface: Surface, front: Front, rules: Rules, budget: int) -> int:
    """Advance segments by the six cases of Table 1, as `advance` does by quality; apart, so that it is compiled for method paper only."""
    found = np.empty(MOST_NEAR_NODES, np.int64)
    patch = np.zeros(1, SURFACE_PATCH)
    for _ in range(budget):
        if not has_room(front):
            return FULL
        s = take_segment(front)
        if s < 0:
            return DONE
        own = rules_of_segment(surface, front, s, rules)
        if not choose_by_case(surface, front, s, own, found, patch[0]):
            front.state[s] = WAITING
    return MORE
