"""Local search of the topology: flip, collapse, split, settle the nodes around, keep what lowers the energy."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .compile import kernel
from .equalize import ROOT, settle_node
from .grid import RIM, Net, collapse, flip, may_collapse, may_flip, may_split, split, wings
from .rim import Rim, at_arc
from .vectors import cross, dot, norm, row, subtract

FLIP, COLLAPSE, SPLIT = 0, 1, 2
TOLERATED = (2, 0, 2)  # growth of the disorder by a flip, collapse, split
SWEEPS = 2
HOPE = 0.06  # energy above the old one after one sweep that the next may still make good
STILL = 0.005  # shorter steps are not made in trials, in lengths
TIDIED = 6  # growth beyond that which flips around may take back
FLIPS = 4  # most of these flips


class Scratch(NamedTuple):
    """Room for one trial: what is around, and how it was before."""

    mark: np.ndarray  #: (C,) int64 number of the trial that holds the node
    ideal: np.ndarray  #: (C,) int64 neighbours that suit the node: 6 inside, by its angle on the boundary
    tried: np.ndarray  #: (C,) int64, 1 where nothing has changed around the node since it was tried
    around: np.ndarray  #: (C,) int64 nodes that may move
    nodes: np.ndarray  #: (C, 4) their places and arcs before
    ring: np.ndarray  #: (C, W) their rings before
    degree: np.ndarray  #: (C,) int64
    counter: np.ndarray  #: (3,) int64 trials made; nodes around; trials that paid


@kernel
def gather(net: Net, scratch: Scratch, a: int, b: int) -> None:
    """List the nodes around the edge a-b: its quadrangle and all their neighbours, as they are now."""
    scratch.counter[0] += 1
    stamp = scratch.counter[0]
    right, left = wings(net, a, b)
    count = 0
    for v in (a, b, right, left):
        if v >= 0 and scratch.mark[v] != stamp:
            scratch.mark[v] = stamp
            scratch.around[count] = v
            count += 1
    for i in range(count):
        v = scratch.around[i]
        for j in range(net.degree[v]):
            u = net.ring[v, j]
            if scratch.mark[u] != stamp:
                scratch.mark[u] = stamp
                scratch.around[count] = u
                count += 1
    for i in range(count):
        v = scratch.around[i]
        scratch.nodes[i, 0], scratch.nodes[i, 1], scratch.nodes[i, 2] = (
            net.nodes[v, 0],
            net.nodes[v, 1],
            net.nodes[v, 2],
        )
        scratch.nodes[i, 3] = net.arc[v]
        scratch.degree[i] = net.degree[v]
        for j in range(net.degree[v]):
            scratch.ring[i, j] = net.ring[v, j]
    scratch.counter[1] = count


@kernel
def put_back(net: Net, scratch: Scratch) -> None:
    """Undo a trial: all around as it was."""
    for i in range(scratch.counter[1]):
        v = scratch.around[i]
        net.nodes[v, 0], net.nodes[v, 1], net.nodes[v, 2] = (
            scratch.nodes[i, 0],
            scratch.nodes[i, 1],
            scratch.nodes[i, 2],
        )
        net.arc[v] = scratch.nodes[i, 3]
        net.degree[v] = scratch.degree[i]
        for j in range(scratch.degree[i]):
            net.ring[v, j] = scratch.ring[i, j]


@kernel
def local_energy(net: Net, scratch: Scratch, length: float, weight: float) -> float:
    """Energy of all members and triangles that have a node in the neighbourhood, each counted once; 1 for a folded member.

    A member is folded where its two triangles meet at less than 90 degrees.
    """
    nodes, mark, stamp = net.nodes, scratch.mark, scratch.counter[0]
    energy = 0.0
    for k in range(scratch.counter[1]):
        v = scratch.around[k]
        d = net.degree[v]
        if d == 0:
            continue
        inside = net.is_open[v] == 0
        i = d - 2 if inside else d - 1
        w = net.ring[v, i]
        cx, cy, cz = nodes[w, 0] - nodes[v, 0], nodes[w, 1] - nodes[v, 1], nodes[w, 2] - nodes[v, 2]
        cc = cx * cx + cy * cy + cz * cz
        counted = mark[w] == stamp and w < v
        ux = uy = uz = 0.0
        for at in range(-1 if inside else 0, d):
            bx, by, bz, bb, skipped = cx, cy, cz, cc, counted
            tx, ty, tz = ux, uy, uz  # the triangle before
            w = net.ring[v, at if at >= 0 else d - 1]
            counted = mark[w] == stamp and w < v
            cx, cy, cz = nodes[w, 0] - nodes[v, 0], nodes[w, 1] - nodes[v, 1], nodes[w, 2] - nodes[v, 2]
            cc = cx * cx + cy * cy + cz * cz
            if at >= 0 and not counted:
                stretch = math.sqrt(cc) / length - 1.0
                energy += weight * stretch * stretch
            if at == 0 and not inside:
                continue
            ux, uy, uz = by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx
            if not skipped and tx * ux + ty * uy + tz * uz < 0.0:
                energy += 1.0
            if skipped or counted or at < 0:
                continue
            ex, ey, ez = cx - bx, cy - by, cz - bz
            squares = bb + cc + ex * ex + ey * ey + ez * ez
            energy += 1.0
            if squares > 0.0:
                energy -= 0.5 * ROOT * math.sqrt(ux * ux + uy * uy + uz * uz) / squares
    return energy


@kernel
def place_between(net: Net, rim: Rim, v: int, a: int, b: int) -> None:
    """Put node v halfway between a and b: along their curve if it is on the rim."""
    if net.kind[v] == RIM:
        total = rim.total[net.curve[v]]
        ahead = (net.arc[b] - net.arc[a]) % total if total > 0.0 else 0.0
        if ahead > 0.5 * total:
            ahead -= total
        net.arc[v], net.nodes[v, 0], net.nodes[v, 1], net.nodes[v, 2] = at_arc(
            rim, net.curve[v], net.arc[a] + 0.5 * ahead
        )
    else:
        for c in range(3):
            net.nodes[v, c] = 0.5 * (net.nodes[a, c] + net.nodes[b, c])


@kernel
def disorder(net: Net, ideal: np.ndarray, move: int, a: int, b: int) -> int:
    """By how much a move at the edge a-b changes the sum of squared differences between neighbours and ideal."""
    right, left = wings(net, a, b)
    rim = right < 0 or left < 0
    da, db = net.degree[a] - ideal[a], net.degree[b] - ideal[b]
    change = 0
    if move == FLIP:
        change = 2 - 2 * da - 2 * db
    elif move == COLLAPSE:
        merged = net.degree[a] + net.degree[b] - (3 if rim else 4) - ideal[a]
        change = merged * merged - da * da - db * db
    else:
        change = 1 if rim else 4
    for v in (right, left):
        if v >= 0:
            d = net.degree[v] - ideal[v]
            change += 1 - 2 * d if move == COLLAPSE else 1 + 2 * d
    return change


@kernel
def tidy(net: Net, scratch: Scratch, seeds: int) -> int:
    """Flip edges at the first `seeds` nodes of the neighbourhood while that lessens the disorder; returns the change of it."""
    stamp, total, ideal = scratch.counter[0], 0, scratch.ideal
    for _ in range(FLIPS):
        best, a, b = 0, scratch.around[0], scratch.around[0]
        for k in range(seeds):
            v = scratch.around[k]
            d = net.degree[v]
            for i in range(d):
                if net.is_open[v] == 1 and (i == 0 or i == d - 1):
                    continue
                u, right, left = net.ring[v, i], net.ring[v, (i + d - 1) % d], net.ring[v, (i + 1) % d]
                if scratch.mark[u] == stamp and scratch.mark[right] == stamp and scratch.mark[left] == stamp:
                    change = 4 - 2 * (d - ideal[v] + net.degree[u] - ideal[u])
                    change += 2 * (net.degree[right] - ideal[right] + net.degree[left] - ideal[left])
                    if change < best and may_flip(net, v, u):
                        best, a, b = change, v, u
        if best == 0:
            break
        flip(net, a, b)
        total += best
    return total


@kernel
def make_move(net: Net, patches: np.ndarray, rim: Rim, scratch: Scratch, move: int, a: int, b: int) -> int:
    """Make a move at the edge a-b; returns the node that a split adds, else -1."""
    if move == FLIP:
        flip(net, a, b)
        return -1
    if move == COLLAPSE:
        if net.kind[a] == net.kind[b]:
            place_between(net, rim, a, a, b)
        collapse(net, a, b)
        return -1
    added = split(net, a, b)
    for c in range(patches.shape[1]):
        patches[added, c] = patches[a, c]
    place_between(net, rim, added, a, b)
    scratch.ideal[added] = 4 if net.is_open[added] == 1 else 6
    scratch.mark[added] = scratch.counter[0]
    scratch.around[scratch.counter[1]] = added
    scratch.counter[1] += 1
    return added


@kernel
def undo_move(net: Net, scratch: Scratch, move: int, added: int) -> None:
    """Put all around back as it was before a move."""
    if added >= 0:
        scratch.mark[added] = 0
        scratch.counter[1] -= 1
        net.degree[added] = 0
        net.count[0] += 1
    elif move == COLLAPSE:
        net.count[0] -= 1
    put_back(net, scratch)


@kernel
def try_move(
    net: Net,
    patches: np.ndarray,
    rim: Rim,
    scratch: Scratch,
    move: int,
    a: int,
    b: int,
    length: float,
    weight: float,
    worth: float,
) -> bool:
    """Make a move at the edge a-b, settle the nodes around, and keep it if the energy has fallen.

    `worth` is what one more node may cost. Moves that leave the numbers of neighbours farther from the ideal hardly ever pay and
    are not made; those that flips around can make good are.
    """
    change = disorder(net, scratch.ideal, move, a, b)
    tidied = move != FLIP and change > 0
    if change > TOLERATED[move] + (TIDIED if tidied else 0):
        return False
    gather(net, scratch, a, b)
    if change > TOLERATED[move]:
        added = make_move(net, patches, rim, scratch, move, a, b)
        change += tidy(net, scratch, 4)
        undo_move(net, scratch, move, added)
        if change > TOLERATED[move]:
            return False
    before = local_energy(net, scratch, length, weight)
    before += worth if move == SPLIT else (-worth if move == COLLAPSE else 0.0)
    added = make_move(net, patches, rim, scratch, move, a, b)
    if tidied:
        tidy(net, scratch, 4)
    after = before
    for _ in range(SWEEPS):
        for i in range(scratch.counter[1]):
            settle_node(net, patches, rim, scratch.around[i], length, weight, STILL * length)
        after = local_energy(net, scratch, length, weight)
        if after > before + HOPE:
            break
    if after < before - 1e-4:
        for i in range(scratch.counter[1]):
            scratch.tried[scratch.around[i]] = 0
        scratch.counter[2] += 1
        return True
    undo_move(net, scratch, move, added)
    return False


@kernel
def is_regular(net: Net, ideal: np.ndarray, v: int, length: float) -> bool:
    """Whether nothing about node v asks for a move: neighbours as ideal, members near their length."""
    if net.degree[v] != ideal[v]:
        return False
    for i in range(net.degree[v]):
        w = net.ring[v, i]
        if abs(norm(subtract(row(net.nodes, w), row(net.nodes, v))) / length - 1.0) > 0.15:
            return False
    return True


@kernel
def search(
    net: Net,
    patches: np.ndarray,
    rim: Rim,
    scratch: Scratch,
    length: float,
    weight: float,
    strain: float,
    price: float,
    share: float,
) -> int:
    """One round over all nodes that ask for a move; returns how many moves were kept.

    Beside members, triangles and folds, `price * V * strain^2` shall fall, so that the mean length comes to the desired one: `strain`
    is mean / desired length - 1 at the start, and falls by 1 / (2 V) with each node added. The `share` of energy that any node has
    does not count, or nodes would be taken away for being nodes.
    """
    kept, free = scratch.counter[2], net.count[0]
    count = max(len(net.degree) - free, 1)
    for v in range(net.count[1]):
        if net.degree[v] == 0 or scratch.tried[v] == 1 or is_regular(net, scratch.ideal, v, length):
            continue
        scratch.tried[v] = 1
        i = 0
        while i < 4 * net.degree[v]:
            u = net.ring[v, i // 4]
            choice = i % 4
            i += 1
            move, a, b = min(choice, COLLAPSE), v, u
            if choice == 2:
                a, b = u, v
            elif choice == 3:
                move = SPLIT
            if choice == 0 and scratch.tried[u] == 1 and not is_regular(net, scratch.ideal, u, length):
                i += 3  # this edge was tried from its other end
                continue
            if move == FLIP:
                allowed = may_flip(net, a, b)
            elif move == COLLAPSE:
                allowed = (choice == 1 or net.kind[a] != net.kind[b]) and may_collapse(net, a, b)
            else:
                allowed = may_split(net, a, b)
            half = 0.5 if move == SPLIT else -0.5
            worth = share + price * (strain - 0.5 * (free - net.count[0] + half) / count)
            if allowed and try_move(net, patches, rim, scratch, move, a, b, length, weight, worth):
                i = 0
                if net.degree[v] == 0 or is_regular(net, scratch.ideal, v, length):
                    break
    return scratch.counter[2] - kept


@kernel
def suit_nodes(net: Net, ideal: np.ndarray) -> None:
    """Fill in how many neighbours suit each node: 6 inside, on the boundary as many as its angle has room for."""
    for v in range(len(ideal)):
        ideal[v] = 6
        if net.degree[v] > 0 and net.is_open[v] == 1:
            angle = 0.0
            for i in range(net.degree[v] - 1):
                p = subtract(row(net.nodes, net.ring[v, i]), row(net.nodes, v))
                q = subtract(row(net.nodes, net.ring[v, i + 1]), row(net.nodes, v))
                n, d = norm(cross(p, q)), dot(p, q)
                if n > 0.0 or d != 0.0:
                    angle += math.atan2(n, d)
            ideal[v] = max(2, int(math.floor(3.0 * angle / math.pi + 0.5)) + 1)


@kernel
def total_energy(net: Net, scratch: Scratch, length: float, weight: float) -> tuple[float, float, int]:
    """Energy of the whole grid, mean length of its members, and its nodes."""
    scratch.counter[0] += 1
    count = members = 0
    total = 0.0
    for v in range(net.count[1]):
        if net.degree[v] > 0:
            scratch.mark[v] = scratch.counter[0]
            scratch.around[count] = v
            count += 1
            for i in range(net.degree[v]):
                u = net.ring[v, i]
                if v < u:
                    members += 1
                    total += norm(subtract(row(net.nodes, u), row(net.nodes, v)))
    scratch.counter[1] = count
    return local_energy(net, scratch, length, weight), total / max(members, 1), count
