"""A move of quads is tried: the quads around it are changed, their nodes settle, and all is as before unless the energy falls enough."""

from __future__ import annotations

import numpy as np

from ...runtime.jit import kernel
from .quads import FREE_NODE, QuadNet, energy_of_quads, settle_quads

TRIAL_SWEEPS = 8  # most sweeps of a trial
# sweeps, and the energy over what is allowed that more of them never gained
HOPELESS_AFTER = ((1, 1.6), (2, 0.6), (4, 0.15))


@kernel
def shares_of(quads: np.ndarray, at_boundary: np.ndarray, share: np.ndarray) -> None:
    """Fill in the weight of each side of some quads (Q, 4): 1 on the boundary, 1/2 where another quad has it too or may have."""
    count = 4 * len(quads)
    for i in range(count):
        q, k = i // 4, i % 4
        a, b = quads[q, k], quads[q, (k + 1) % 4]
        share[q, k] = 0.5
        if at_boundary[a] and at_boundary[b]:
            alone = True
            for j in range(count):
                p, m = j // 4, j % 4
                alone = alone and not (quads[p, m] == b and quads[p, (m + 1) % 4] == a)
            if alone:
                share[q, k] = 1.0


@kernel
def put_in_order(values: np.ndarray) -> None:
    """Sort a few whole numbers in place."""
    for i in range(1, len(values)):
        value, j = values[i], i
        while j > 0 and values[j - 1] > value:  # ends: each turn goes back by one
            values[j] = values[j - 1]
            j -= 1
        values[j] = value


@kernel
def quads_around(net: QuadNet, touched: np.ndarray, found: np.ndarray) -> int:
    """Fill in the quads at some nodes and at their neighbours, in their order; returns how many, -1 where there is no room."""
    net.clock[0] += 1
    clock, count, nodes = net.clock[0], 0, len(net.nodes)
    for turn in range(2):
        seen = count
        for i in range(len(touched) if turn == 0 else 4 * seen):
            v = touched[i] if turn == 0 else net.quads[found[i // 4], i % 4]
            if turn == 1 and net.stamp[v] == clock:
                continue
            if turn == 1:
                net.stamp[v] = clock
            for j in range(net.degree[v]):
                q = net.at[v, j]
                if net.stamp[nodes + q] != clock:
                    if count == len(found):
                        return -1
                    net.stamp[nodes + q] = clock
                    found[count] = q
                    count += 1
    put_in_order(found[:count])
    return count


@kernel
def energy_of(net: QuadNet, quads: np.ndarray, share: np.ndarray, lengths: float, angles: float) -> float:
    """Energy of some quads of a net."""
    return energy_of_quads(net, quads, share, lengths, angles, np.empty(len(quads)))


@kernel
def _quads_after(net: QuadNet, ids: np.ndarray, changed: np.ndarray, corners: np.ndarray, after: np.ndarray) -> int:
    """Put the quads into `after` that stand for some (N,) where others replace a part of them; return how many. See `try_quads`."""
    row = 0
    for i in range(len(ids)):
        other = -1
        for k in range(len(changed)):
            if changed[k] == ids[i]:
                other = k
        if other < 0 or corners[other, 0] >= 0:
            for k in range(4):
                after[row, k] = net.quads[ids[i], k] if other < 0 else corners[other, k]
            row += 1
    for i in range(len(changed)):
        if net.quads[changed[i], 0] < 0 and corners[i, 0] >= 0:
            for k in range(4):
                after[row, k] = corners[i, k]
            row += 1
    return row


@kernel
def _keep_nodes(net: QuadNet, quads: np.ndarray, places: np.ndarray, old: np.ndarray) -> int:
    """Keep which nodes some quads (N, 4) have, and where they are; return how many. Parameters as of `try_quads`."""
    net.clock[0] += 1
    around = 0
    for i in range(4 * len(quads)):
        v = quads[i // 4, i % 4]
        if net.stamp[v] != net.clock[0]:
            net.stamp[v] = net.clock[0]
            places[around] = v
            around += 1
    put_in_order(places[:around])
    for i in range(around):
        v = places[i]
        old[i, 0], old[i, 1], old[i, 2], old[i, 3] = net.nodes[v, 0], net.nodes[v, 1], net.nodes[v, 2], net.arc[v]
    return around


@kernel
def try_quads(
    net: QuadNet,
    touched: np.ndarray,
    changed: np.ndarray,
    corners: np.ndarray,
    at_boundary: np.ndarray,
    lengths: float,
    angles: float,
    stride: float,
    enough: float,
    join: int,
    joined: int,
    allowed: float,
    places: np.ndarray,
    old: np.ndarray,
) -> tuple[float, int]:
    """Return by how much the energy grows where some quads replace others, once the nodes around have settled.

    The quads of the net stay; its nodes have moved if the energy grows by less than `allowed`.

    Parameters
    ----------
    touched : (T,) nodes whose quads change
    changed, corners : (K,), (K, 4) quads and their new corners, of the first -1 for one that goes; one may be new
    join, joined : node that another is merged with, which starts between them; -1 for none
    places, old : (P,), (P, 4) become the nodes around and where they were: place and arc length

    Returns
    -------
    float, int
        Growth, inf where it cannot be; nodes around.
    """
    ids = np.empty(len(places) // 4, np.int64)
    count = quads_around(net, touched, ids)
    if count < 0:
        return np.inf, 0
    before = net.quads[ids[:count]]
    after = np.empty((count + len(changed), 4), np.int64)
    row = _quads_after(net, ids[:count], changed, corners, after)
    after = after[:row]
    around = _keep_nodes(net, before, places, old)
    share = np.empty((count, 4))
    shares_of(before, at_boundary, share)
    energy = energy_of(net, before, share, lengths, angles)
    if join >= 0 and net.held[join] == FREE_NODE:
        for k in range(3):
            net.nodes[join, k] = 0.5 * (net.nodes[join, k] + net.nodes[joined, k])
    share = np.empty((row, 4))
    shares_of(after, at_boundary, share)
    some, start, of = np.empty(4 * row, np.int64), np.zeros(4 * row + 1, np.int64), np.empty(4 * row, np.int64)
    number = inner_nodes(net, before, after, some, start, of)
    growth, made = np.inf, 0
    for sweeps, too_much in HOPELESS_AFTER:
        settle_quads(
            net, after, share, of, start[: number + 1], some[:number], lengths, angles, sweeps - made, stride, enough
        )
        made = sweeps
        growth = energy_of(net, after, share, lengths, angles) - energy
        if growth > allowed + too_much:
            break
    if growth <= allowed + HOPELESS_AFTER[-1][1]:
        settle_quads(
            net,
            after,
            share,
            of,
            start[: number + 1],
            some[:number],
            lengths,
            angles,
            TRIAL_SWEEPS - made,
            stride,
            enough,
        )
        growth = energy_of(net, after, share, lengths, angles) - energy
    if growth >= allowed:
        for i in range(around):
            v = places[i]
            net.nodes[v, 0], net.nodes[v, 1], net.nodes[v, 2], net.arc[v] = old[i, 0], old[i, 1], old[i, 2], old[i, 3]
    return growth, around


@kernel
def inner_nodes(
    net: QuadNet, before: np.ndarray, after: np.ndarray, some: np.ndarray, start: np.ndarray, of: np.ndarray
) -> int:
    """Fill in the nodes that may move, all of whose quads are among those after a move, and the quads at them; returns how many."""
    flat, own = after.copy().reshape(after.size), before.copy().reshape(before.size)
    put_in_order(own)
    order = np.argsort(flat, kind="mergesort")
    number, taken, i = 0, 0, 0
    while i < len(flat):  # each turn goes on to the next node
        v, j = flat[order[i]], i
        while j < len(flat) and flat[order[j]] == v:  # each turn goes on by a corner
            j += 1
        here = np.searchsorted(own, v + 1) - np.searchsorted(own, v)  # of its quads before
        if here == net.degree[v] and net.held[v] < 2:
            for k in range(i, j):
                of[taken] = order[k] // 4
                taken += 1
            some[number] = v
            number += 1
            start[number] = taken
        i = j
    return number
