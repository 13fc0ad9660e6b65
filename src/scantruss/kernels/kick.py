"""Kicks: moves at random, after which the grid around settles and is searched; what has lowered the energy is kept."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .compile import kernel
from .equalize import STRIDE, settle_node
from .grid import DEGREE, IDEAL, KIND, LOCKED, Net, place_of, target_length, wings
from .rim import Rim
from .search import COLLAPSE, FLIP, LONG, SHORT, SPLIT, STILL, is_allowed, is_regular, make_move, try_move
from .trial import MARK, TRIED, Scratch, gather, local_energy
from .vectors import fill_row, norm, row, subtract

WIDE, SEARCHED, KICKED = 5, 2, 1  # rings around the kicked node that may change, are searched, get the random moves
MOST = 400  # nodes of an area
KEPT = 32  # free nodes at the top of the stack that are written down
MOVES = 3  # most random moves of a kick
ROUNDS = 2  # of settling and searching
CALM = 2  # sweeps of settling in a round
STAMP, COUNT, CHANCE, PAID = 0, 1, 2, 3  # places in `Area.counter`
HOPELESS = 2.2  # energy that moves at random may cost once settled: what costs more never pays in the end
HOPE = 0.2  # the same once searched: what costs more hardly ever does
OUT = 2  # column of `Area.mark`
LISTED, UNFIT, BEYOND = 0, 1, 2  # areas


class Area(NamedTuple):
    """The nodes that a kick may change, as they were before it."""

    mark: np.ndarray  #: (C, 3) int64 number of the kick that has the node in its area; rings away from the kicked node; 1 out of bounds
    around: np.ndarray  #: (A,) int64 the nodes
    nodes: np.ndarray  #: (A, 5) their places, arcs and desired lengths
    ring: np.ndarray  #: (A, W) int64 their rings
    patches: np.ndarray  #: (A, PATCH) their local surfaces: a node that is freed may come back elsewhere
    state: np.ndarray  #: (A, 6) int64 their states
    free: np.ndarray  #: (KEPT + 2,) int64 the top of the stack of free nodes; their number, and how many are here
    counter: np.ndarray  #: (4,) int64 kicks; nodes of the area; chance; kicks that paid


@kernel
def chance(area: Area, choices: int) -> int:
    """A number from 0 to choices - 1, the same in every run."""
    area.counter[CHANCE] = (area.counter[CHANCE] * 1103515245 + 12345) & 0x7FFFFFFF
    return (area.counter[CHANCE] >> 8) % choices


@kernel
def list_area(net: Net, patches: np.ndarray, area: Area, v: int) -> int:
    """List the nodes around a node as they are now: LISTED, or UNFIT where there are too many or a defect is among them.

    BEYOND where one is out of bounds.
    """
    area.counter[STAMP] += 1
    stamp = area.counter[STAMP]
    area.around[0] = v
    area.mark[v, 0], area.mark[v, 1] = stamp, 0
    count, at = 1, 0
    while at < count:
        u = area.around[at]
        at += 1
        if area.mark[u, OUT] == 1:
            return BEYOND
        if net.state[u, KIND] == LOCKED:
            return UNFIT
        if area.mark[u, 1] == WIDE:
            continue
        for i in range(net.state[u, DEGREE]):
            w = net.ring[u, i]
            if area.mark[w, 0] != stamp:
                if count == len(area.around):
                    return UNFIT
                area.mark[w, 0], area.mark[w, 1] = stamp, area.mark[u, 1] + 1
                area.around[count] = w
                count += 1
    area.counter[COUNT] = count
    for k in range(count):
        u = area.around[k]
        for c in range(3):
            area.nodes[k, c] = net.nodes[u, c]
        area.nodes[k, 3], area.nodes[k, 4] = net.arc[u], net.desired[u]
        fill_row(area.ring[k], net.ring[u])
        fill_row(area.state[k], net.state[u])
        fill_row(area.patches[k], patches[u])
    free = net.free[-2]
    area.free[-2], area.free[-1] = free, min(free, KEPT)
    for k in range(area.free[-1]):
        area.free[k] = net.free[free - 1 - k]
    return LISTED


@kernel
def put_area_back(net: Net, patches: np.ndarray, area: Area) -> None:
    """Undo a kick."""
    free = area.free[-2]
    net.free[-2] = free
    for k in range(area.free[-1]):
        net.free[free - 1 - k] = area.free[k]
        net.state[area.free[k], DEGREE] = 0
    for k in range(area.counter[COUNT]):
        u = area.around[k]
        for c in range(3):
            net.nodes[u, c] = area.nodes[k, c]
        net.arc[u], net.desired[u] = area.nodes[k, 3], area.nodes[k, 4]
        fill_row(net.ring[u], area.ring[k])
        fill_row(net.state[u], area.state[k])
        fill_row(patches[u], area.patches[k])


@kernel
def added_node(net: Net, area: Area, k: int) -> int:
    """Free node k of those written down if it is in use now and not in the area, else -1; it joins the area at its middle."""
    v = area.free[k]
    if net.state[v, DEGREE] == 0:
        return -1
    if area.mark[v, 0] != area.counter[STAMP]:
        area.mark[v, 0], area.mark[v, 1] = area.counter[STAMP], KICKED
    return v


@kernel
def area_energy(net: Net, scratch: Scratch, area: Area, length: float, weight: float) -> float:
    """Energy of all members and triangles that have a node in the area."""
    scratch.counter[0] += 1
    count = 0
    for k in range(area.counter[COUNT] + area.free[-1]):
        listed = k < area.counter[COUNT]
        v = area.around[k] if listed else added_node(net, area, k - area.counter[COUNT])
        if v >= 0 and net.state[v, DEGREE] > 0 and scratch.note[v, MARK] != scratch.counter[0]:
            scratch.note[v, MARK] = scratch.counter[0]
            scratch.around[count] = v
            count += 1
    scratch.counter[1] = count
    return local_energy(net, scratch, length, weight)


@kernel
def is_within(net: Net, area: Area, a: int, b: int) -> bool:
    """Whether all that a move at the edge a-b may change lies in the area."""
    stamp = area.counter[STAMP]
    right, left = wings(net, a, b)
    for v in (a, b, right, left):
        if v >= 0:
            if area.mark[v, 0] != stamp:
                return False
            for i in range(net.state[v, DEGREE]):
                if area.mark[net.ring[v, i], 0] != stamp:
                    return False
    return True


@kernel
def move_at_random(net: Net, patches: np.ndarray, rim: Rim, scratch: Scratch, area: Area) -> int:
    """Make some random moves near the kicked node; returns how many."""
    made = 0
    for _ in range(1 + chance(area, MOVES)):
        near = 1
        while near < area.counter[COUNT] and area.mark[area.around[near], 1] <= KICKED:
            near += 1
        a = area.around[chance(area, near)]
        if net.state[a, DEGREE] == 0:
            continue
        b = net.ring[a, chance(area, net.state[a, DEGREE])]
        kind = chance(area, 5)
        move = FLIP if kind < 3 else (COLLAPSE if kind == 3 else SPLIT)
        if is_allowed(net, move, a, b) and is_within(net, area, a, b):
            gather(net, scratch, a, b)
            added = make_move(net, patches, rim, scratch, move, a, b)
            if added >= 0:
                area.mark[added, 0], area.mark[added, 1] = area.counter[STAMP], KICKED
            made += 1
    return made


@kernel
def settle_area(net: Net, patches: np.ndarray, rim: Rim, area: Area, length: float, weight: float) -> None:
    """Settle the nodes of the area but those at its edge."""
    for _ in range(CALM):
        for k in range(area.counter[COUNT] + area.free[-1]):
            listed = k < area.counter[COUNT]
            v = area.around[k] if listed else added_node(net, area, k - area.counter[COUNT])
            if v >= 0 and net.state[v, DEGREE] > 0 and area.mark[v, 1] < WIDE:
                settle_node(net, patches, rim, v, length, weight, STILL * length, STRIDE)


@kernel
def search_area(
    net: Net, patches: np.ndarray, rim: Rim, scratch: Scratch, area: Area, length: float, weight: float, worth: float
) -> int:
    """Try moves at the irregular nodes in the middle of the area that are not marked as tried; returns how many were kept."""
    kept = 0
    for k in range(area.counter[COUNT] + area.free[-1]):
        listed = k < area.counter[COUNT]
        v = area.around[k] if listed else added_node(net, area, k - area.counter[COUNT])
        if v < 0 or net.state[v, DEGREE] == 0 or area.mark[v, 1] > SEARCHED:
            continue
        if scratch.note[v, TRIED] == 1 or is_regular(net, v, length):
            continue
        i = 0
        while i < 4 * net.state[v, DEGREE] and kept < 20:
            u, way = net.ring[v, i // 4], i % 4
            if way == 0 and scratch.note[u, TRIED] == 1:
                i += 4  # this edge was tried from its other end
                continue
            scratch.note[v, TRIED] = 1
            i += 1
            move, a, b = (way + 1) // 2, v, u
            if way == 2:
                if net.state[u, KIND] == net.state[v, KIND]:
                    continue
                a, b = u, v
            if not (is_allowed(net, move, a, b) and is_within(net, area, a, b)):
                continue
            size = norm(subtract(row(net.nodes, b), row(net.nodes, a))) / target_length(net, a, b, length)
            if (move == SPLIT and size < SHORT) or (move == COLLAPSE and size > LONG):
                continue
            if try_move(net, patches, rim, scratch, move, a, b, length, weight, worth):
                kept += 1
                i = 0
    return kept


@kernel
def forget_trials(scratch: Scratch, area: Area) -> None:
    """Mark all nodes of the area as not tried."""
    for k in range(area.counter[COUNT] + area.free[-1]):
        scratch.note[area.around[k] if k < area.counter[COUNT] else area.free[k - area.counter[COUNT]], TRIED] = 0


@kernel
def is_as_before(net: Net, area: Area) -> bool:
    """Whether each node of the area has the neighbours that it had before the kick."""
    if net.free[-2] != area.free[-2]:
        return False
    for k in range(area.counter[COUNT]):
        v = area.around[k]
        if net.state[v, DEGREE] != area.state[k, DEGREE]:
            return False
        for i in range(net.state[v, DEGREE]):
            if place_of(net, v, area.ring[k, i]) < 0:
                return False
    return True


@kernel
def kick(
    net: Net,
    patches: np.ndarray,
    rim: Rim,
    scratch: Scratch,
    area: Area,
    length: float,
    weight: float,
    worth: float,
    bend: float,
    heat: float,
    hope: float,
) -> bool:
    """Kick the grid in the area that is listed; True if that has paid, else all is as before.

    worth, bend : n more nodes may cost worth n - bend n^2
    hope : what still costs more once it is searched is given up; below HOPELESS, so is what the search has undone
    """
    before = area_energy(net, scratch, area, length, weight)
    if move_at_random(net, patches, rim, scratch, area) == 0:
        return False
    for turn in range(ROUNDS):
        forget_trials(scratch, area)
        settle_area(net, patches, rim, area, length, weight)
        if area_energy(net, scratch, area, length, weight) - before > (HOPELESS if turn == 0 else hope):
            put_area_back(net, patches, area)
            return False
        if search_area(net, patches, rim, scratch, area, length, weight, worth) == 0:
            break
        if turn == 0 and hope < HOPELESS and is_as_before(net, area):
            put_area_back(net, patches, area)
            return False
    settle_area(net, patches, rim, area, length, weight)
    after = area_energy(net, scratch, area, length, weight)
    more = area.free[-2] - net.free[-2]
    luck = -heat * math.log((chance(area, 100000) + 1.0) / 100001.0) if heat > 0.0 else -1e-4
    if after - before < worth * more - bend * more * more + luck:
        area.counter[PAID] += 1
        return True
    put_area_back(net, patches, area)
    return False


@kernel
def kick_all(
    net: Net,
    patches: np.ndarray,
    rim: Rim,
    scratch: Scratch,
    area: Area,
    waiting: np.ndarray,
    length: float,
    weight: float,
    strain: float,
    price: float,
    share: float,
    count: int,
    heat: float,
    hope: float,
) -> int:
    """Kick the grid once at every node waiting that has more or fewer neighbours than suit it; returns how often that paid.

    Parameters
    ----------
    waiting : (C,) bool; on return only of nodes with one out of bounds around them
    strain, price, share : as in `search`
    count : V, as in `search`; those within bounds
    heat, hope : as in `kick`
    """
    paid, free = area.counter[PAID], net.free[-2]
    for v in range(net.free[-1]):
        if not waiting[v] or area.mark[v, OUT] == 1:
            continue
        listed = UNFIT
        if net.state[v, DEGREE] > 0 and net.state[v, DEGREE] != net.state[v, IDEAL]:
            listed = list_area(net, patches, area, v)
        waiting[v] = listed == BEYOND
        if listed == LISTED:
            worth = share + price * (strain - 0.5 * (free - net.free[-2]) / count)
            kick(net, patches, rim, scratch, area, length, weight, worth, 0.25 * price / count, heat, hope)
    return area.counter[PAID] - paid
