"""Moving pairs of irregular nodes: chains of flips that pay only together."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .compile import kernel
from .equalize import settle_node
from .grid import DEGREE, IDEAL, OPEN, Net, flip, may_flip, wings
from .rim import Rim
from .search import EARLY, FLIP, STILL, SWEEPS, disorder
from .trial import TRIED, Scratch, gather, local_energy, put_back, restore

NO_WORSE = 2  # growth of the disorder by a flip of a chain
CHOICES = 32  # most flips looked at for the next link of a chain


class Journal(NamedTuple):
    """The nodes that a chain has touched, as they were before it."""

    mark: np.ndarray  #: (C,) int64 number of the chain that has written the node down
    around: np.ndarray  #: (C,) int64 the nodes
    nodes: np.ndarray  #: (C, 4) their places and arcs
    ring: np.ndarray  #: (C, W + 1) int64 their rings; last the number of neighbours
    counter: np.ndarray  #: (3,) int64 chains begun; nodes written down; chains that paid


@kernel
def note_down(journal: Journal, scratch: Scratch) -> None:
    """Write down the nodes of a trial that the chain has not touched before."""
    for i in range(scratch.counter[1]):
        v = scratch.around[i]
        if journal.mark[v] != journal.counter[0]:
            journal.mark[v] = journal.counter[0]
            at = journal.counter[1]
            journal.around[at] = v
            for c in range(4):
                journal.nodes[at, c] = scratch.nodes[i, c]
            for c in range(journal.ring.shape[1]):
                journal.ring[at, c] = scratch.ring[i, c]
            journal.counter[1] += 1


@kernel
def flip_and_settle(
    net: Net,
    patches: np.ndarray,
    rim: Rim,
    scratch: Scratch,
    a: int,
    b: int,
    length: float,
    weight: float,
    most: float,
) -> float:
    """Flip the edge a-b, settle the nodes around; returns by how much the energy has grown, if that may come below `most`."""
    gather(net, scratch, a, b)
    before = local_energy(net, scratch, length, weight)
    flip(net, a, b)
    change = 0.0
    for turn in range(1 + SWEEPS):
        for i in range(min(4, scratch.counter[1]) if turn == 0 else scratch.counter[1]):
            settle_node(net, patches, rim, scratch.around[i], length, weight, STILL * length)
        if turn != 1:
            change = local_energy(net, scratch, length, weight) - before
        if turn == 0 and change > most + EARLY[FLIP]:
            break
    return change


@kernel
def list_flips(net: Net, corners: np.ndarray, flips: np.ndarray) -> int:
    """List the edges at the corners (4,) of a flipped quadrangle that a chain may flip next; returns their number.

    flips : (CHOICES, 2), filled; not the diagonal that has just been made, which would undo the flip
    """
    count = 0
    for k in range(len(corners)):
        v = corners[k]
        if v < 0:
            continue
        for i in range(net.state[v, DEGREE]):
            u = net.ring[v, i]
            again = (v == corners[0] and u == corners[1]) or (v == corners[1] and u == corners[0])
            twice = False
            for j in range(k):
                twice = twice or u == corners[j]
            if again or twice or count == len(flips) or not may_flip(net, v, u):
                continue
            if disorder(net, FLIP, v, u) <= NO_WORSE:
                flips[count, 0], flips[count, 1] = v, u
                count += 1
    return count


@kernel
def try_chain(
    net: Net,
    patches: np.ndarray,
    rim: Rim,
    scratch: Scratch,
    journal: Journal,
    a: int,
    b: int,
    length: float,
    weight: float,
    links: int,
    hope: float,
) -> bool:
    """Flip a-b, then again and again the edge beside that costs least; keep the chain as soon as it has paid.

    A chain is given up after so many `links`, or when it has raised the energy by more than `hope`.
    """
    journal.counter[0] += 1
    journal.counter[1] = 0
    flips = np.empty((CHOICES, 2), np.int64)
    corners = np.empty(4, np.int64)
    total = 0.0
    for link in range(links):
        count, best, least = 1, 0, 0.0
        if link == 0:
            flips[0, 0], flips[0, 1] = a, b
        else:
            count = list_flips(net, corners, flips)
            least = 1e300
            for k in range(count):
                change = flip_and_settle(
                    net, patches, rim, scratch, flips[k, 0], flips[k, 1], length, weight, min(least, hope - total)
                )
                put_back(net, scratch)
                if change < least:
                    best, least = k, change
        if count == 0 or total + least > hope:
            break
        p, q = flips[best, 0], flips[best, 1]
        corners[0], corners[1] = wings(net, p, q)
        corners[2], corners[3] = p, q
        total += flip_and_settle(net, patches, rim, scratch, p, q, length, weight, hope - total)
        note_down(journal, scratch)
        if total > hope:
            break
        if total < -1e-4:
            for i in range(journal.counter[1]):
                scratch.note[journal.around[i], TRIED] = 0
            journal.counter[2] += 1
            return True
    restore(net, journal.around, journal.nodes, journal.ring, journal.counter[1])
    return False


@kernel
def glide(
    net: Net,
    patches: np.ndarray,
    rim: Rim,
    scratch: Scratch,
    journal: Journal,
    length: float,
    weight: float,
    links: int,
    hope: float,
) -> int:
    """One round of chains over all nodes with more or fewer neighbours than suit them; returns how many were kept."""
    kept = journal.counter[2]
    for v in range(net.free[-1]):
        i = 0
        tries = 0
        while i < net.state[v, DEGREE] and net.state[v, DEGREE] != net.state[v, IDEAL] and tries < 100:
            d = net.state[v, DEGREE]
            u, w = net.ring[v, i], net.ring[v, (i + 1) % d]
            paid = False
            tries += 1
            if may_flip(net, v, u) and disorder(net, FLIP, v, u) <= NO_WORSE:
                paid = try_chain(net, patches, rim, scratch, journal, v, u, length, weight, links, hope)
            if not paid and (i < d - 1 or net.state[v, OPEN] == 0):
                if may_flip(net, u, w) and disorder(net, FLIP, u, w) <= NO_WORSE:
                    paid = try_chain(net, patches, rim, scratch, journal, u, w, length, weight, links, hope)
            i = 0 if paid else i + 1
    return journal.counter[2] - kept
