"""Local search of the topology: flip, collapse, split, settle the nodes around, keep what lowers the energy."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .compile import kernel
from .equalize import ROOT, settle_node
from .grid import INTERIOR, REST, RIM, Net, collapse, flip, may_collapse, may_flip, may_split, split, wings
from .rim import Rim, at_arc
from .surface import Surface

FLIP, COLLAPSE, SPLIT = 0, 1, 2
MOST = 120  # nodes in one neighbourhood


class Scratch(NamedTuple):
    """Room for one trial: what is around, and how it was before."""

    mark: np.ndarray  #: (C,) int64 number of the trial that holds the node
    tried: np.ndarray  #: (C,) int64, 1 where nothing has changed around the node since it was tried
    around: np.ndarray  #: (MOST,) int64 nodes that may move
    nodes: np.ndarray  #: (MOST, 4) their places and arcs before
    ring: np.ndarray  #: (MOST, W) their rings before
    degree: np.ndarray  #: (MOST,) int64
    counter: np.ndarray  #: (3,) int64 trials made; nodes around; trials that paid
    slope: np.ndarray  #: (3,) scratch of `settle_node`


@kernel
def gather(net: Net, scratch: Scratch, a: int, b: int) -> bool:
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
                if count >= MOST - 1:
                    return False
                scratch.mark[u] = stamp
                scratch.around[count] = u
                count += 1
    for i in range(count):
        v = scratch.around[i]
        scratch.nodes[i, 0], scratch.nodes[i, 1], scratch.nodes[i, 2] = net.nodes[v, 0], net.nodes[v, 1], net.nodes[v, 2]
        scratch.nodes[i, 3] = net.arc[v]
        scratch.degree[i] = net.degree[v]
        for j in range(net.degree[v]):
            scratch.ring[i, j] = net.ring[v, j]
    scratch.counter[1] = count
    return True


@kernel
def put_back(net: Net, scratch: Scratch) -> None:
    """Undo a trial: all around as it was."""
    for i in range(scratch.counter[1]):
        v = scratch.around[i]
        net.nodes[v, 0], net.nodes[v, 1], net.nodes[v, 2] = scratch.nodes[i, 0], scratch.nodes[i, 1], scratch.nodes[i, 2]
        net.arc[v] = scratch.nodes[i, 3]
        net.degree[v] = scratch.degree[i]
        for j in range(scratch.degree[i]):
            net.ring[v, j] = scratch.ring[i, j]


@kernel
def local_energy(net: Net, patches: np.ndarray, scratch: Scratch, length: float, weight: float) -> float:
    """Energy of all members and triangles that have a node in the neighbourhood, each counted once."""
    nodes, mark, stamp = net.nodes, scratch.mark, scratch.counter[0]
    energy = 0.0
    for k in range(scratch.counter[1]):
        v = scratch.around[k]
        d = net.degree[v]
        if d == 0:
            continue
        w = net.ring[v, d - 1]
        cx, cy, cz = nodes[w, 0] - nodes[v, 0], nodes[w, 1] - nodes[v, 1], nodes[w, 2] - nodes[v, 2]
        cc = cx * cx + cy * cy + cz * cz
        counted = mark[w] == stamp and w < v
        for i in range(d):
            bx, by, bz, bb, skipped = cx, cy, cz, cc, counted
            w = net.ring[v, i]
            counted = mark[w] == stamp and w < v
            cx, cy, cz = nodes[w, 0] - nodes[v, 0], nodes[w, 1] - nodes[v, 1], nodes[w, 2] - nodes[v, 2]
            cc = cx * cx + cy * cy + cz * cz
            if not counted:
                stretch = math.sqrt(cc) / length - 1.0
                energy += weight * stretch * stretch
            if skipped or counted or (i == 0 and net.is_open[v] == 1):
                continue
            ux, uy, uz = by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx
            ex, ey, ez = cx - bx, cy - by, cz - bz
            squares = bb + cc + ex * ex + ey * ey + ez * ez
            g = 0.0
            if squares > 0.0:
                g = 0.5 * ROOT * math.sqrt(ux * ux + uy * uy + uz * uz) / squares
            if ux * patches[v, 3] + uy * patches[v, 4] + uz * patches[v, 5] < 0.0:
                g = -g
            energy += 1.0 - g
    return energy


@kernel
def place_between(net: Net, patches: np.ndarray, rim: Rim, v: int, a: int, b: int) -> None:
    """Put node v halfway between a and b: along their curve if it is on the rim."""
    if net.kind[v] == RIM:
        total = rim.total[net.curve[v]]
        ahead = (net.arc[b] - net.arc[a]) % total if total > 0.0 else 0.0
        if ahead > 0.5 * total:
            ahead -= total
        net.arc[v], net.nodes[v, 0], net.nodes[v, 1], net.nodes[v, 2] = at_arc(rim, net.curve[v], net.arc[a] + 0.5 * ahead)
    else:
        for c in range(3):
            net.nodes[v, c] = 0.5 * (net.nodes[a, c] + net.nodes[b, c])


@kernel
def try_move(net: Net, surface: Surface, patches: np.ndarray, rim: Rim, scratch: Scratch, move: int, a: int, b: int, length: float, weight: float, sweeps: int) -> bool:
    """Make a move at the edge a-b, settle the nodes around, and keep it if the energy has fallen."""
    if not gather(net, scratch, a, b):
        return False
    before = local_energy(net, patches, scratch, length, weight)
    added = -1
    if move == FLIP:
        flip(net, a, b)
    elif move == COLLAPSE:
        if net.kind[a] == net.kind[b]:
            place_between(net, patches, rim, a, a, b)
        collapse(net, a, b)
    else:
        added = split(net, a, b)
        patches[added] = patches[a]
        place_between(net, patches, rim, added, a, b)
        scratch.mark[added] = scratch.counter[0]
        scratch.around[scratch.counter[1]] = added
        scratch.counter[1] += 1
    for sweep in range(sweeps):
        for i in range(scratch.counter[1]):
            settle_node(net, surface, patches, rim, scratch.around[i], length, weight, False, scratch.slope)
        if sweep == 0 and local_energy(net, patches, scratch, length, weight) > before + 0.3:
            break
    after = local_energy(net, patches, scratch, length, weight)
    if after < before - 1e-4:
        for i in range(scratch.counter[1]):
            scratch.tried[scratch.around[i]] = 0
        scratch.counter[2] += 1
        return True
    if added >= 0:
        scratch.counter[1] -= 1
        net.degree[added] = 0
        net.count[0] += 1
    elif move == COLLAPSE:
        net.count[0] -= 1
    put_back(net, scratch)
    return False


@kernel
def is_regular(net: Net, v: int, length: float) -> bool:
    """Whether nothing about node v asks for a move: as many neighbours as its angle wants, members near their length."""
    d = net.degree[v]
    if net.is_open[v] == 0 and d != 6:
        return False
    angle = 0.0
    for i in range(d):
        w, u = net.ring[v, i], net.ring[v, (i + 1) % d]
        ax, ay, az = net.nodes[w, 0] - net.nodes[v, 0], net.nodes[w, 1] - net.nodes[v, 1], net.nodes[w, 2] - net.nodes[v, 2]
        size = math.sqrt(ax * ax + ay * ay + az * az)
        if abs(size / length - 1.0) > 0.15:
            return False
        if net.is_open[v] == 1 and i + 1 < d:
            bx, by, bz = net.nodes[u, 0] - net.nodes[v, 0], net.nodes[u, 1] - net.nodes[v, 1], net.nodes[u, 2] - net.nodes[v, 2]
            other = math.sqrt(bx * bx + by * by + bz * bz)
            if size * other > 0.0:
                angle += math.acos(min(max((ax * bx + ay * by + az * bz) / (size * other), -1.0), 1.0))
    return net.is_open[v] == 0 or abs(angle - (d - 1) * math.pi / 3.0) < 0.55


@kernel
def search(net: Net, surface: Surface, patches: np.ndarray, rim: Rim, scratch: Scratch, length: float, weight: float, sweeps: int) -> int:
    """One round over all nodes that ask for a move; returns how many moves were kept."""
    kept = scratch.counter[2]
    for v in range(net.count[1]):
        if net.degree[v] == 0 or scratch.tried[v] == 1 or is_regular(net, v, length):
            continue
        scratch.tried[v] = 1
        i = 0
        while i < net.degree[v]:
            u = net.ring[v, i]
            i += 1
            done = False
            if may_flip(net, v, u):
                done = try_move(net, surface, patches, rim, scratch, FLIP, v, u, length, weight, sweeps)
            if not done and may_collapse(net, v, u):
                done = try_move(net, surface, patches, rim, scratch, COLLAPSE, v, u, length, weight, sweeps)
            if not done and may_collapse(net, u, v):
                if net.kind[u] != net.kind[v]:
                    done = try_move(net, surface, patches, rim, scratch, COLLAPSE, u, v, length, weight, sweeps)
            if not done and may_split(net, v, u):
                done = try_move(net, surface, patches, rim, scratch, SPLIT, v, u, length, weight, sweeps)
            if done:
                i = 0
                if net.degree[v] == 0 or is_regular(net, v, length):
                    break
    return scratch.counter[2] - kept
