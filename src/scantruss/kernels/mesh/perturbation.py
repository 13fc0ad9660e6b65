"""Perturbations: moves at random, after which the grid around settles and is searched; what has lowered the energy is kept."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...runtime.jit import kernel
from ..boundary.curves import Curves
from ..geometry.vectors import fill_row, norm, row, subtract
from .equalize import STRIDE, settle_node
from .grid import LOCKED, Net, place_of, target_length, wings
from .local_search import COLLAPSE, FLIP, LONG, SHORT, SPLIT, STILL, is_allowed, is_regular, make_move, try_move
from .trial import Scratch, gather, local_energy

WIDE, SEARCHED, PERTURBED = (
    5,
    2,
    1,
)  # rings around the perturbed node that may change, are searched, get the random moves
MOST_NODES = 400  # nodes of an area
KEPT = 32  # free nodes at the top of the stack that are written down
MOVES = 3  # most random moves of a perturbation
SEARCH_ROUNDS = 2  # of settling and searching
CALM = 2  # sweeps of settling in a round
ALLOWANCE_SETTLED = 2.2  # energy that moves at random may cost once settled: what costs more never pays in the end
ALLOWANCE_SEARCHED = 0.2  # the same once searched: what costs more hardly ever does
LISTED, UNFIT, BEYOND = 0, 1, 2  # areas


class Area(NamedTuple):
    """The nodes that a perturbation may change, as they were before it."""

    mark: np.ndarray  #: (C,) int64 number of the perturbation that has the node in its area
    away: np.ndarray  #: (C,) int64 rings away from the perturbed node
    out: np.ndarray  #: (C,) int64, 1 where the node is out of bounds
    around: np.ndarray  #: (A,) int64 the nodes
    nodes: np.ndarray  #: (A, 3) their places
    arc: np.ndarray  #: (A,) their arcs
    desired: np.ndarray  #: (A,) their desired lengths
    ring: np.ndarray  #: (A, W) int64 their rings
    degree: np.ndarray  #: (A,) int64 and all else of a `Net` that they have
    is_open: np.ndarray  #: (A,) int64
    kind: np.ndarray  #: (A,) int64
    curve: np.ndarray  #: (A,) int64
    ideal: np.ndarray  #: (A,) int64
    line: np.ndarray  #: (A,) int64
    patches: np.ndarray  #: (A, PATCH) their local surfaces: a node that is freed may come back elsewhere
    free: np.ndarray  #: (KEPT,) int64 the top of the stack of free nodes
    saved: np.ndarray  #: (1,) int64 how many of these there are
    spare: np.ndarray  #: (1,) int64 how many nodes were free
    number: np.ndarray  #: (1,) int64 number of the perturbation
    gathered: np.ndarray  #: (1,) int64 nodes of the area
    seed: np.ndarray  #: (1,) int64 state of the random numbers
    paid: np.ndarray  #: (1,) int64 perturbations that paid


@kernel
def random_choice(area: Area, choices: int) -> int:
    """A number from 0 to choices - 1, the same in every run."""
    area.seed[0] = (area.seed[0] * 1103515245 + 12345) & 0x7FFFFFFF
    return (area.seed[0] >> 8) % choices


@kernel
def list_area(net: Net, patches: np.ndarray, area: Area, v: int) -> int:
    """List the nodes around a node as they are now: LISTED, or UNFIT where there are too many or a defect is among them.

    BEYOND where one is out of bounds.
    """
    area.number[0] += 1
    stamp = area.number[0]
    area.around[0] = v
    area.mark[v], area.away[v] = stamp, 0
    count, at = 1, 0
    while at < count:
        u = area.around[at]
        at += 1
        if area.out[u] == 1:
            return BEYOND
        if net.kind[u] == LOCKED:
            return UNFIT
        if area.away[u] == WIDE:
            continue
        for i in range(net.degree[u]):
            w = net.ring[u, i]
            if area.mark[w] != stamp:
                if count == len(area.around):
                    return UNFIT
                area.mark[w], area.away[w] = stamp, area.away[u] + 1
                area.around[count] = w
                count += 1
    area.gathered[0] = count
    for k in range(count):
        u = area.around[k]
        for c in range(3):
            area.nodes[k, c] = net.nodes[u, c]
        area.arc[k], area.desired[k] = net.arc[u], net.desired[u]
        fill_row(area.ring[k], net.ring[u])
        area.degree[k], area.is_open[k], area.kind[k] = net.degree[u], net.is_open[u], net.kind[u]
        area.curve[k], area.ideal[k], area.line[k] = net.curve[u], net.ideal[u], net.line[u]
        fill_row(area.patches[k], patches[u])
    free = net.spare[0]
    area.spare[0], area.saved[0] = free, min(free, KEPT)
    for k in range(area.saved[0]):
        area.free[k] = net.free[free - 1 - k]
    return LISTED


@kernel
def put_area_back(net: Net, patches: np.ndarray, area: Area) -> None:
    """Undo a perturbation."""
    free = area.spare[0]
    net.spare[0] = free
    for k in range(area.saved[0]):
        net.free[free - 1 - k] = area.free[k]
        net.degree[area.free[k]] = 0
    for k in range(area.gathered[0]):
        u = area.around[k]
        for c in range(3):
            net.nodes[u, c] = area.nodes[k, c]
        net.arc[u], net.desired[u] = area.arc[k], area.desired[k]
        fill_row(net.ring[u], area.ring[k])
        net.degree[u], net.is_open[u], net.kind[u] = area.degree[k], area.is_open[k], area.kind[k]
        net.curve[u], net.ideal[u], net.line[u] = area.curve[k], area.ideal[k], area.line[k]
        fill_row(patches[u], area.patches[k])


@kernel
def added_node(net: Net, area: Area, k: int) -> int:
    """Free node k of those written down if it is in use now and not in the area, else -1; it joins the area at its middle."""
    v = area.free[k]
    if net.degree[v] == 0:
        return -1
    if area.mark[v] != area.number[0]:
        area.mark[v], area.away[v] = area.number[0], PERTURBED
    return v


@kernel
def area_energy(net: Net, patches: np.ndarray, scratch: Scratch, area: Area, length: float, weight: float) -> float:
    """Energy of all members and triangles that have a node in the area."""
    scratch.trial[0] += 1
    count = 0
    for k in range(area.gathered[0] + area.saved[0]):
        listed = k < area.gathered[0]
        v = area.around[k] if listed else added_node(net, area, k - area.gathered[0])
        if v >= 0 and net.degree[v] > 0 and scratch.held[v] != scratch.trial[0]:
            scratch.held[v] = scratch.trial[0]
            scratch.around[count] = v
            count += 1
    scratch.gathered[0] = count
    return local_energy(net, patches, scratch, length, weight)


@kernel
def is_within(net: Net, area: Area, a: int, b: int) -> bool:
    """Whether all that a move at the edge a-b may change lies in the area."""
    stamp = area.number[0]
    right, left = wings(net, a, b)
    for v in (a, b, right, left):
        if v >= 0:
            if area.mark[v] != stamp:
                return False
            for i in range(net.degree[v]):
                if area.mark[net.ring[v, i]] != stamp:
                    return False
    return True


@kernel
def move_at_random(net: Net, patches: np.ndarray, curves: Curves, scratch: Scratch, area: Area) -> int:
    """Make some random moves near the perturbed node; returns how many."""
    made = 0
    for _ in range(1 + random_choice(area, MOVES)):
        near = 1
        while near < area.gathered[0] and area.away[area.around[near]] <= PERTURBED:
            near += 1
        a = area.around[random_choice(area, near)]
        if net.degree[a] == 0:
            continue
        b = net.ring[a, random_choice(area, net.degree[a])]
        kind = random_choice(area, 5)
        move = FLIP if kind < 3 else (COLLAPSE if kind == 3 else SPLIT)
        if is_allowed(net, move, a, b) and is_within(net, area, a, b):
            gather(net, scratch, a, b)
            added = make_move(net, patches, curves, scratch, move, a, b)
            if added >= 0:
                area.mark[added], area.away[added] = area.number[0], PERTURBED
            made += 1
    return made


@kernel
def settle_area(net: Net, patches: np.ndarray, curves: Curves, area: Area, length: float, weight: float) -> None:
    """Settle the nodes of the area but those at its edge."""
    for _ in range(CALM):
        for k in range(area.gathered[0] + area.saved[0]):
            listed = k < area.gathered[0]
            v = area.around[k] if listed else added_node(net, area, k - area.gathered[0])
            if v >= 0 and net.degree[v] > 0 and area.away[v] < WIDE:
                settle_node(net, patches, curves, v, length, weight, STILL * length, STRIDE)


@kernel
def search_area(
    net: Net,
    patches: np.ndarray,
    curves: Curves,
    scratch: Scratch,
    area: Area,
    length: float,
    weight: float,
    worth: float,
) -> int:
    """Try moves at the irregular nodes in the middle of the area that are not marked as tried; returns how many were kept."""
    kept = 0
    for k in range(area.gathered[0] + area.saved[0]):
        listed = k < area.gathered[0]
        v = area.around[k] if listed else added_node(net, area, k - area.gathered[0])
        if v < 0 or net.degree[v] == 0 or area.away[v] > SEARCHED:
            continue
        if scratch.tried[v] == 1 or is_regular(net, v, length):
            continue
        i = 0
        while i < 4 * net.degree[v] and kept < 20:
            u, way = net.ring[v, i // 4], i % 4
            if way == 0 and scratch.tried[u] == 1:
                i += 4  # this edge was tried from its other end
                continue
            scratch.tried[v] = 1
            i += 1
            move, a, b = (way + 1) // 2, v, u
            if way == 2:
                if net.kind[u] == net.kind[v]:
                    continue
                a, b = u, v
            if not (is_allowed(net, move, a, b) and is_within(net, area, a, b)):
                continue
            size = norm(subtract(row(net.nodes, b), row(net.nodes, a))) / target_length(net, a, b, length)
            if (move == SPLIT and size < SHORT) or (move == COLLAPSE and size > LONG):
                continue
            if try_move(net, patches, curves, scratch, move, a, b, length, weight, worth):
                kept += 1
                i = 0
    return kept


@kernel
def forget_trials(scratch: Scratch, area: Area) -> None:
    """Mark all nodes of the area as not tried."""
    for k in range(area.gathered[0] + area.saved[0]):
        scratch.tried[area.around[k] if k < area.gathered[0] else area.free[k - area.gathered[0]]] = 0


@kernel
def is_as_before(net: Net, area: Area) -> bool:
    """Whether each node of the area has the neighbours that it had before the perturbation."""
    if net.spare[0] != area.spare[0]:
        return False
    for k in range(area.gathered[0]):
        v = area.around[k]
        if net.degree[v] != area.degree[k]:
            return False
        for i in range(net.degree[v]):
            if place_of(net, v, area.ring[k, i]) < 0:
                return False
    return True


@kernel
def perturb(
    net: Net,
    patches: np.ndarray,
    curves: Curves,
    scratch: Scratch,
    area: Area,
    length: float,
    weight: float,
    worth: float,
    bend: float,
    temperature: float,
    allowance: float,
) -> bool:
    """Perturb the grid in the area that is listed; True if that has paid, else all is as before.

    worth, bend : n more nodes may cost worth n - bend n^2
    allowance : what still costs more once it is searched is given up; below ALLOWANCE_SETTLED, so is what the search has undone
    """
    before = area_energy(net, patches, scratch, area, length, weight)
    if move_at_random(net, patches, curves, scratch, area) == 0:
        return False
    for turn in range(SEARCH_ROUNDS):
        forget_trials(scratch, area)
        settle_area(net, patches, curves, area, length, weight)
        if area_energy(net, patches, scratch, area, length, weight) - before > (
            ALLOWANCE_SETTLED if turn == 0 else allowance
        ):
            put_area_back(net, patches, area)
            return False
        if search_area(net, patches, curves, scratch, area, length, weight, worth) == 0:
            break
        if turn == 0 and allowance < ALLOWANCE_SETTLED and is_as_before(net, area):
            put_area_back(net, patches, area)
            return False
    settle_area(net, patches, curves, area, length, weight)
    after = area_energy(net, patches, scratch, area, length, weight)
    more = area.spare[0] - net.spare[0]
    luck = -temperature * math.log((random_choice(area, 100000) + 1.0) / 100001.0) if temperature > 0.0 else -1e-4
    if after - before < worth * more - bend * more * more + luck:
        area.paid[0] += 1
        return True
    put_area_back(net, patches, area)
    return False


@kernel
def perturb_all(
    net: Net,
    patches: np.ndarray,
    curves: Curves,
    scratch: Scratch,
    area: Area,
    waiting: np.ndarray,
    length: float,
    weight: float,
    strain: float,
    price: float,
    share: float,
    count: int,
    temperature: float,
    allowance: float,
) -> int:
    """Perturb the grid once at every node waiting that has more or fewer neighbours than suit it; returns how often that paid.

    Parameters
    ----------
    waiting : (C,) bool; on return only of nodes with one out of bounds around them
    strain, price, share : as in `search`
    count : V, as in `search`; those within bounds
    temperature, allowance : as in `perturb`
    """
    paid, free = area.paid[0], net.spare[0]
    for v in range(net.in_use[0]):
        if not waiting[v] or area.out[v] == 1:
            continue
        listed = UNFIT
        if net.degree[v] > 0 and net.degree[v] != net.ideal[v]:
            listed = list_area(net, patches, area, v)
        waiting[v] = listed == BEYOND
        if listed == LISTED:
            worth = share + price * (strain - 0.5 * (free - net.spare[0]) / count)
            perturb(
                net, patches, curves, scratch, area, length, weight, worth, 0.25 * price / count, temperature, allowance
            )
    return area.paid[0] - paid
