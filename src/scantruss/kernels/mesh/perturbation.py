"""Perturbations: random moves, after which the grid around settles and is searched; kept if the energy falls."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...runtime.jit import kernel
from ..boundary.curves import Curves
from ..geometry.vectors import fill_row
from .equalize import OVER_RELAXATION, settle_node
from .grid import LOCKED, Net, place_in_ring, wings
from .local_search import (
    COLLAPSE,
    FLIP,
    NO_MOVE,
    SHORTEST_TRIAL_STEP,
    SPLIT,
    is_allowed,
    is_regular,
    make_move,
    move_at,
    try_move,
)
from .trial import Scratch, gather, local_energy

AREA_RINGS = 5  # rings of nodes around the perturbed node that may change
SEARCHED_RINGS = 2  # rings whose nodes are searched
PERTURBED_RINGS = 1  # rings in which random moves are made
MOST_NODES = 400  # most nodes of an area
SAVED_FREE_NODES = 32  # free nodes from the top of the stack that are saved with an area
MOST_RANDOM_MOVES = 3  # most random moves of a perturbation
SEARCH_ROUNDS = 2  # most rounds of settling and searching
AREA_SWEEPS = 2  # sweeps in which the area settles in a round
ALLOWANCE_SETTLED = 2.2  # energy that random moves may cost once the area has settled; what costs more never pays
ALLOWANCE_SEARCHED = 0.2  # energy that they may cost once the area has been searched; what costs more hardly ever pays
AREA_LISTED, AREA_UNFIT, AREA_OUT_OF_BOUNDS = 0, 1, 2  # what became of listing an area
# moves that one is drawn of, and how many of these are flips; then a collapse and a split
MOVES_DRAWN, FLIPS_DRAWN = 5, 3
MOST_KEPT_AT_NODE = 20  # most moves that are kept at one node before the next one is searched
SMALLEST_FALL = 1e-4  # fall of the energy that counts
RANDOM_NUMBERS = 100_000  # numbers that chance is drawn of


class Area(NamedTuple):
    """The nodes that a perturbation may change, saved as they were before it."""

    mark: np.ndarray  #: (C,) int64 number of the last perturbation with the node in its area
    away: np.ndarray  #: (C,) int64 rings between the node and the perturbed node
    out: np.ndarray  #: (C,) int64, 1 for a node out of bounds
    around: np.ndarray  #: (A,) int64 the nodes
    nodes: np.ndarray  #: (A, 3) their places
    arc: np.ndarray  #: (A,) their arcs
    desired: np.ndarray  #: (A,) their desired lengths
    ring: np.ndarray  #: (A, W) int64 their rings
    degree: np.ndarray  #: (A,) int64; this and the next five as in `Net`
    is_open: np.ndarray  #: (A,) int64
    kind: np.ndarray  #: (A,) int64
    curve: np.ndarray  #: (A,) int64
    ideal: np.ndarray  #: (A,) int64
    line: np.ndarray  #: (A,) int64
    patches: np.ndarray  #: (A,) SURFACE_PATCH, their local surfaces: a node that is freed may come back elsewhere
    free: np.ndarray  #: (SAVED_FREE_NODES,) int64 the top of the stack of free nodes
    saved: np.ndarray  #: (1,) int64 how many of these are saved
    spare: np.ndarray  #: (1,) int64 how many nodes were free
    number: np.ndarray  #: (1,) int64 number of the perturbation
    gathered: np.ndarray  #: (1,) int64 number of nodes of the area
    seed: np.ndarray  #: (1,) int64 state of the random numbers
    paid: np.ndarray  #: (1,) int64 how many perturbations were kept


@kernel
def random_choice(area: Area, choices: int) -> int:
    """A pseudo-random number from 0 to choices - 1, the same in every run."""
    area.seed[0] = (area.seed[0] * 1103515245 + 12345) & 0x7FFFFFFF
    return (area.seed[0] >> 8) % choices


@kernel
def list_area(net: Net, patches: np.ndarray, area: Area, v: int) -> int:
    """Save the nodes around a node; AREA_UNFIT if there are too many or a defect is among them, AREA_OUT_OF_BOUNDS if one is."""
    area.number[0] += 1
    stamp = area.number[0]
    area.around[0] = v
    area.mark[v], area.away[v] = stamp, 0
    count, at = 1, 0
    while at < count:
        u = area.around[at]
        at += 1
        if area.out[u] == 1:
            return AREA_OUT_OF_BOUNDS
        if net.kind[u] == LOCKED:
            return AREA_UNFIT
        if area.away[u] == AREA_RINGS:
            continue
        for i in range(net.degree[u]):
            w = net.ring[u, i]
            if area.mark[w] != stamp:
                if count == len(area.around):
                    return AREA_UNFIT
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
        area.patches[k] = patches[u]
    free = net.spare[0]
    area.spare[0], area.saved[0] = free, min(free, SAVED_FREE_NODES)
    for k in range(area.saved[0]):
        area.free[k] = net.free[free - 1 - k]
    return AREA_LISTED


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
        patches[u] = area.patches[k]


@kernel
def added_node(net: Net, area: Area, k: int) -> int:
    """Free node k of the saved ones if it is in use by now, else -1; it joins the area beside the perturbed node."""
    v = area.free[k]
    if net.degree[v] == 0:
        return -1
    if area.mark[v] != area.number[0]:
        area.mark[v], area.away[v] = area.number[0], PERTURBED_RINGS
    return v


@kernel
def area_energy(net: Net, patches: np.ndarray, scratch: Scratch, area: Area, length: float, weight: float) -> float:
    """Energy of all members and triangles with a node in the area."""
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
def move_at_random(net: Net, patches: np.ndarray, curves: Curves, scratch: Scratch, area: Area, length: float) -> int:
    """Make some random moves at and around the perturbed node; returns how many."""
    made = 0
    for _ in range(1 + random_choice(area, MOST_RANDOM_MOVES)):
        near = 1
        while near < area.gathered[0] and area.away[area.around[near]] <= PERTURBED_RINGS:
            near += 1
        a = area.around[random_choice(area, near)]
        if net.degree[a] == 0:
            continue
        b = net.ring[a, random_choice(area, net.degree[a])]
        kind = random_choice(area, MOVES_DRAWN)
        move = FLIP if kind < FLIPS_DRAWN else (COLLAPSE if kind == FLIPS_DRAWN else SPLIT)
        if is_allowed(net, move, a, b, length) and is_within(net, area, a, b):
            gather(net, scratch, a, b)
            added = make_move(net, patches, curves, scratch, move, a, b)
            if added >= 0:
                area.mark[added], area.away[added] = area.number[0], PERTURBED_RINGS
            made += 1
    return made


@kernel
def settle_area(net: Net, patches: np.ndarray, curves: Curves, area: Area, length: float, weight: float) -> None:
    """Settle the nodes of the area, except those at its edge."""
    for _ in range(AREA_SWEEPS):
        for k in range(area.gathered[0] + area.saved[0]):
            listed = k < area.gathered[0]
            v = area.around[k] if listed else added_node(net, area, k - area.gathered[0])
            if v >= 0 and net.degree[v] > 0 and area.away[v] < AREA_RINGS:
                settle_node(net, patches, curves, v, length, weight, SHORTEST_TRIAL_STEP * length, OVER_RELAXATION)


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
    """Try moves at the irregular nodes in the middle of the area that are not yet marked as tried; returns how many were kept."""
    kept = 0
    for k in range(area.gathered[0] + area.saved[0]):
        listed = k < area.gathered[0]
        v = area.around[k] if listed else added_node(net, area, k - area.gathered[0])
        if v < 0 or net.degree[v] == 0 or area.away[v] > SEARCHED_RINGS:
            continue
        if scratch.tried[v] == 1 or is_regular(net, v, length):
            continue
        i = 0
        while i < 4 * net.degree[v] and kept < MOST_KEPT_AT_NODE:  # between two moves that are kept, i rises
            u, way = net.ring[v, i // 4], i % 4
            if way == 0 and scratch.tried[u] == 1:
                i += 4  # this edge was tried from its other end
                continue
            scratch.tried[v] = 1
            i += 1
            move, a, b = move_at(net, v, u, way, length)
            if move == NO_MOVE or not is_within(net, area, a, b):
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
            if place_in_ring(net, v, area.ring[k, i]) < 0:
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
    """Perturb the grid in the area that is listed; True if the result is kept, else all is as before.

    worth, bend : n more nodes may cost worth n - bend n^2
    allowance : energy that a perturbation may still cost once it is searched; if it is below ALLOWANCE_SETTLED, one that the search has
        undone is given up too
    """
    before = area_energy(net, patches, scratch, area, length, weight)
    if move_at_random(net, patches, curves, scratch, area, length) == 0:
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
    luck = -SMALLEST_FALL
    if temperature > 0.0:
        luck = -temperature * math.log((random_choice(area, RANDOM_NUMBERS) + 1.0) / (RANDOM_NUMBERS + 1.0))
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
    """Perturb the grid once at each waiting node whose valence is not ideal; returns how many perturbations were kept.

    Parameters
    ----------
    waiting : (C,) bool; on return, True only for nodes whose area is partly out of bounds
    strain, price, share, count : as in `search`
    temperature, allowance : as in `perturb`
    """
    paid, free = area.paid[0], net.spare[0]
    for v in range(net.in_use[0]):
        if not waiting[v] or area.out[v] == 1:
            continue
        listed = AREA_UNFIT
        if net.degree[v] > 0 and net.degree[v] != net.ideal[v]:
            listed = list_area(net, patches, area, v)
        waiting[v] = listed == AREA_OUT_OF_BOUNDS
        if listed == AREA_LISTED:
            worth = share + price * (strain - 0.5 * (free - net.spare[0]) / count)
            perturb(
                net, patches, curves, scratch, area, length, weight, worth, 0.25 * price / count, temperature, allowance
            )
    return area.paid[0] - paid
