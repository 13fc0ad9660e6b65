"""Local search of the topology: an edge is flipped, collapsed or split, the nodes around settle, and a lower energy is kept."""

from __future__ import annotations

import math

import numpy as np

from ...runtime.jit import kernel
from ..boundary.curves import Curves, at_arc
from ..geometry.vectors import cross, dot, norm, row, subtract, vector_of
from .equalize import OVER_RELAXATION, settle_node
from .grid import (
    ON_CURVE,
    Net,
    collapse,
    flip,
    is_line,
    may_collapse,
    may_flip,
    may_split,
    slides_on_line,
    split,
    target_length,
    wings,
)
from .lines import arc_on_line, halfway
from .trial import Scratch, gather, local_energy, may_change, put_back, triangles_across

FLIP, COLLAPSE, SPLIT = 0, 1, 2  # moves
NO_MOVE = -1  # stands for a move that cannot be made or makes no sense
TOLERATED_DISORDER = (2, 0, 2)  # growth of the disorder by a flip, collapse or split up to which it is tried
REPAIRABLE_DISORDER = 6  # growth beyond that up to which flips around are tried first
MOST_REPAIRS = 4  # most of these flips
SETTLING_SWEEPS = 2  # sweeps in which all nodes around a move settle
# growth of the energy by a flip, collapse or split up to which a trial goes on once the quadrangle has settled
EARLY_ALLOWANCE = (0.35, 1.2, 2.0)
# growth of the energy by a flip, collapse or split up to which it goes on once all nodes around have settled
LATE_ALLOWANCE = (0.06, 0.3, 0.5)
# cosine between the normals of two patches below which the surface falls off steeply from a line
STEEP_BESIDE_LINE = 0.5
STRAINED_MEMBER = 0.15  # relative deviation of a member from its desired length above which its nodes ask for moves
SHORTEST_SPLIT = 1.05  # length of the shortest member that is split [desired length]
# length from which on a line between two nodes at rest keeps a node between them [desired length]
LONGEST_LINE_MEMBER = 1.5
LONGEST_COLLAPSED = 1.1  # length of the longest member that is collapsed [desired length]
SHORTEST_TRIAL_STEP = 0.005  # shortest step that is made in a trial [member lengths]
LEAST_PAID = 1e-4  # energy that a move must gain


@kernel
def place_between(net: Net, curves: Curves, v: int, a: int, b: int) -> None:
    """Put node v half-way between a and b, along their curve if it slides on one."""
    if slides_on_line(net, v):
        first = arc_on_line(net, curves, v, a, b)
        middle = halfway(curves, net.curve[v], first, arc_on_line(net, curves, v, b, a))
        net.arc[v], net.nodes[v, 0], net.nodes[v, 1], net.nodes[v, 2] = at_arc(curves, net.curve[v], middle)
    elif net.kind[v] == ON_CURVE:
        total = curves.total[net.curve[v]]
        ahead = (net.arc[b] - net.arc[a]) % total if total > 0.0 else 0.0
        if ahead > 0.5 * total:
            ahead -= total
        net.arc[v], net.nodes[v, 0], net.nodes[v, 1], net.nodes[v, 2] = at_arc(
            curves, net.curve[v], net.arc[a] + 0.5 * ahead
        )
    else:
        for c in range(3):
            net.nodes[v, c] = 0.5 * (net.nodes[a, c] + net.nodes[b, c])


@kernel
def disorder(net: Net, move: int, a: int, b: int) -> int:
    """By how much a move at the edge a-b changes the disorder: the sum of squares of valence less ideal valence."""
    right, left = wings(net, a, b)
    curves = right < 0 or left < 0
    da, db = net.degree[a] - net.ideal[a], net.degree[b] - net.ideal[b]
    change = 0
    if move == FLIP:
        change = 2 - 2 * da - 2 * db
    elif move == COLLAPSE:
        merged = net.degree[a] + net.degree[b] - (3 if curves else 4) - net.ideal[a]
        change = merged * merged - da * da - db * db
    else:
        change = 1 if curves else 4
    for v in (right, left):
        if v >= 0:
            d = net.degree[v] - net.ideal[v]
            change += 1 - 2 * d if move == COLLAPSE else 1 + 2 * d
    return change


@kernel
def tidy(net: Net, scratch: Scratch, seeds: int) -> int:
    """Flip edges at the first `seeds` nodes of the neighbourhood while that lowers the disorder; returns its change."""
    stamp, total = scratch.trial[0], 0
    for _ in range(MOST_REPAIRS):
        best, a, b = 0, scratch.around[0], scratch.around[0]
        for k in range(seeds):
            v = scratch.around[k]
            d = net.degree[v]
            for i in range(d):
                if net.is_open[v] == 1 and (i == 0 or i == d - 1):
                    continue
                u, right, left = net.ring[v, i], net.ring[v, (i + d - 1) % d], net.ring[v, (i + 1) % d]
                if scratch.held[u] == stamp and scratch.held[right] == stamp and scratch.held[left] == stamp:
                    change = 4 - 2 * (d - net.ideal[v] + net.degree[u] - net.ideal[u])
                    change += 2 * (net.degree[right] - net.ideal[right] + net.degree[left] - net.ideal[left])
                    if change < best and may_flip(net, v, u):
                        best, a, b = change, v, u
        if best == 0:
            break
        flip(net, a, b)
        total += best
    return total


@kernel
def lies_beside(net: Net, patches: np.ndarray, a: int, b: int) -> bool:
    """Whether node a is on a line from which the surface falls off so steeply to node b that its patch says nothing of the way there."""
    steep = dot(vector_of(patches[a].normal), vector_of(patches[b].normal)) < STEEP_BESIDE_LINE
    return steep and net.line[a] != 0 and net.line[b] == 0


@kernel
def make_move(net: Net, patches: np.ndarray, curves: Curves, scratch: Scratch, move: int, a: int, b: int) -> int:
    """Make a move at the edge a-b; returns the node that a split adds, -1 for other moves."""
    if move == FLIP:
        flip(net, a, b)
        return -1
    if move == COLLAPSE:
        if net.kind[a] == net.kind[b]:
            place_between(net, curves, a, a, b)
        collapse(net, a, b)
        return -1
    added = split(net, a, b)
    patches[added] = patches[b if lies_beside(net, patches, a, b) else a]
    place_between(net, curves, added, a, b)
    net.ideal[added] = 4 if net.is_open[added] == 1 else 6
    scratch.held[added] = scratch.trial[0]
    scratch.around[scratch.gathered[0]] = added
    scratch.gathered[0] += 1
    return added


@kernel
def undo_move(net: Net, scratch: Scratch, move: int, added: int) -> None:
    """Undo a move: restore the nodes around it."""
    if added >= 0:
        scratch.held[added] = 0
        scratch.gathered[0] -= 1
        net.degree[added] = 0
        net.spare[0] += 1
    elif move == COLLAPSE:
        net.spare[0] -= 1
    put_back(net, scratch)


@kernel
def try_move(
    net: Net,
    patches: np.ndarray,
    curves: Curves,
    scratch: Scratch,
    move: int,
    a: int,
    b: int,
    length: float,
    weight: float,
    worth: float,
) -> bool:
    """Make a move at the edge a-b, settle the nodes around, and keep it if the energy falls and no collapse shuts off a limb.

    `worth` is the energy that one more node may cost. Moves that raise the disorder hardly ever pay and are not tried, unless flips
    around them can repair it.
    """
    change = disorder(net, move, a, b)
    tidied = move != FLIP and change > 0
    if change > TOLERATED_DISORDER[move] + (REPAIRABLE_DISORDER if tidied else 0):
        return False
    gather(net, scratch, a, b)
    across = triangles_across(net, patches, scratch, length) if move == COLLAPSE else 0
    before = after = 0.0
    rehearse = change > TOLERATED_DISORDER[move]  # flips are tried first, before anything settles
    for turn in range(2):
        if turn == 1 or not rehearse:
            before = local_energy(net, patches, scratch, length, weight)
            before += worth if move == SPLIT else (-worth if move == COLLAPSE else 0.0)
        added = make_move(net, patches, curves, scratch, move, a, b)
        if tidied:
            change += tidy(net, scratch, 4)
        if turn == 0 and rehearse:
            undo_move(net, scratch, move, added)
            if change > TOLERATED_DISORDER[move]:
                return False
            continue
        break
    for turn in range(1 + SETTLING_SWEEPS):
        for i in range(min(4, scratch.gathered[0]) if turn == 0 else scratch.gathered[0]):
            settle_node(
                net, patches, curves, scratch.around[i], length, weight, SHORTEST_TRIAL_STEP * length, OVER_RELAXATION
            )
        if turn == 0 and added >= 0:
            settle_node(net, patches, curves, added, length, weight, SHORTEST_TRIAL_STEP * length, OVER_RELAXATION)
        after = local_energy(net, patches, scratch, length, weight)
        if after > before + (EARLY_ALLOWANCE[move] if turn == 0 else LATE_ALLOWANCE[move]):
            break
    if after < before - LEAST_PAID and (move != COLLAPSE or triangles_across(net, patches, scratch, length) <= across):
        for i in range(scratch.gathered[0]):
            scratch.tried[scratch.around[i]] = 0
        scratch.paid[0] += 1
        return True
    undo_move(net, scratch, move, added)
    return False


@kernel
def is_regular(net: Net, v: int, length: float) -> bool:
    """Whether nothing at node v asks for a move: its valence is ideal and its members are near their lengths."""
    if net.degree[v] != net.ideal[v]:
        return False
    for i in range(net.degree[v]):
        w = net.ring[v, i]
        size = norm(subtract(row(net.nodes, w), row(net.nodes, v)))
        if abs(size / target_length(net, v, w, length) - 1.0) > STRAINED_MEMBER:
            return False
    return True


@kernel
def is_last_of_line(net: Net, a: int, b: int, length: float) -> bool:
    """Whether b is the only node of a line between a and another node at rest, too far from each other for one member."""
    if not slides_on_line(net, b) or slides_on_line(net, a):
        return False
    for i in range(net.degree[b]):
        c = net.ring[b, i]
        if c != a and is_line(net, b, c):
            size = norm(subtract(row(net.nodes, c), row(net.nodes, a))) / target_length(net, a, c, length)
            return not slides_on_line(net, c) and size > LONGEST_LINE_MEMBER
    return False


@kernel
def is_allowed(net: Net, move: int, a: int, b: int, length: float) -> bool:
    """Whether a move at the edge a-b keeps the topology, and leaves no long member in a line, which could not be split."""
    if move == FLIP:
        return may_flip(net, a, b)
    if move == COLLAPSE:
        return may_collapse(net, a, b) and not is_last_of_line(net, a, b, length)
    return may_split(net, a, b)


@kernel
def move_at(net: Net, v: int, u: int, way: int, length: float) -> tuple[int, int, int]:
    """One of four moves at the edge v-u and its nodes a, b: flip, collapse u into v, collapse v into u, split; or NO_MOVE.

    There is none where the topology would change, or the member is too short to be split or too long to be collapsed.
    """
    move, a, b = (way + 1) // 2, v, u
    if way == 2:
        if net.kind[u] == net.kind[v]:
            return NO_MOVE, v, u  # the same as the other collapse: both nodes would come to the middle
        a, b = u, v
    if not is_allowed(net, move, a, b, length):
        return NO_MOVE, a, b
    size = norm(subtract(row(net.nodes, b), row(net.nodes, a))) / target_length(net, a, b, length)
    if (move == SPLIT and size < SHORTEST_SPLIT) or (move == COLLAPSE and size > LONGEST_COLLAPSED):
        return NO_MOVE, a, b
    return move, a, b


@kernel
def search_moves(
    net: Net,
    patches: np.ndarray,
    curves: Curves,
    scratch: Scratch,
    length: float,
    weight: float,
    strain: float,
    price: float,
    share: float,
    count: int,
) -> int:
    """Try moves at all nodes that ask for them, once; returns how many were kept.

    The energy includes `price * V * strain^2`, which draws the mean length to the desired one: `strain` is mean / desired length - 1
    at the start and falls by 1 / (2 V) with each node added; V is `count`, the nodes within bounds. `share`, the energy of an average
    node, is not counted, or nodes would be removed just to save it.
    """
    kept, free = scratch.paid[0], net.spare[0]
    for v in range(net.in_use[0]):
        i, left = 0, scratch.out[v] == 1
        if left:
            continue
        while i < 4 * net.degree[v] and scratch.paid[0] - kept < count:  # between two moves that are kept, i rises
            u, way = net.ring[v, i // 4], i % 4
            if i == 0 and scratch.tried[v] == 1:
                break
            if way == 0:
                asked = v if i == 0 else u
                regular = is_regular(net, asked, length)
                if i == 0 and regular:
                    break
                if asked == u and scratch.tried[u] == 1 and not regular:
                    i += 4  # this edge was tried from its other end
                    continue
            scratch.tried[v] = 1
            i += 1
            move, a, b = move_at(net, v, u, way, length)
            if move == NO_MOVE:
                continue
            if not may_change(net, scratch, a, b):
                left = True  # for a search that may
                continue
            half = 0.5 if move == SPLIT else -0.5
            worth = share + price * (strain - 0.5 * (free - net.spare[0] + half) / count)
            if try_move(net, patches, curves, scratch, move, a, b, length, weight, worth):
                i = 0
        if left:
            scratch.tried[v] = 0
    return scratch.paid[0] - kept


@kernel
def suit_nodes(net: Net) -> None:
    """Fill in the ideal valence of each node: 6 inside, on the boundary what its angle has room for."""
    for v in range(len(net.arc)):
        net.ideal[v] = 6
        if net.degree[v] > 0 and net.is_open[v] == 1:
            angle = 0.0
            for i in range(net.degree[v] - 1):
                p = subtract(row(net.nodes, net.ring[v, i]), row(net.nodes, v))
                q = subtract(row(net.nodes, net.ring[v, i + 1]), row(net.nodes, v))
                n, d = norm(cross(p, q)), dot(p, q)
                if n > 0.0 or d != 0.0:
                    angle += math.atan2(n, d)
            net.ideal[v] = max(2, int(math.floor(3.0 * angle / math.pi + 0.5)) + 1)
