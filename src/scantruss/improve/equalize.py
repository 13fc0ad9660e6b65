"""Equalizing: members of one length and triangles of one shape, by moving nodes and by local search of the topology.

What falls is one energy, in units of which a member at double length costs 1 and a degenerate triangle costs 1:

    E = weight * sum (L / l_e - 1)^2 over members + sum (1 - G) over triangles + folded members + price * V * (mean L / l_e - 1)^2

where l_e is the mean of what is desired at the two nodes of a member.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..grid.grid import Grid
from ..grid.quality import shape_qualities
from ..kernels.mesh.equalize import STRIDE, settle_some
from ..kernels.mesh.grid import Net
from ..kernels.mesh.local_search import search, suit_nodes
from ..kernels.mesh.partition import BETWEEN
from ..kernels.mesh.trial import Scratch, total_energy
from ..runtime.parallel import two_at_once
from .flips import flip_by_angle
from .partition import Halves
from .working_mesh import NEAR, Relief

WEIGHT = 1.0  # of the members beside the triangles
EVEN = {"balance": 3.0, "lengths": 8.0, "shapes": 0.5}  # the same in the last sweeps, when the topology rests
LAST_SWEEPS = (12, 6)  # most of these, each time with new patches,
LAST_STRIDE = 1.75  # and their steps: what is uneven in the large goes slowly (successive over-relaxation)
PRICE = 24.0  # of a mean length that is not the desired one
SHARE = 0.1  # most energy that a node may have anyway
SEARCHES = 6  # rounds over all nodes that ask for a move
MANY = 2500  # nodes from which on halves settle side by side (of fewer, threads would wait for each other as long as they gain),
AT_ONCE = 2  # so many sweeps until those between follow
ASKING = 200  # nodes asking for a move from which on halves of the grid are searched side by side
FAR = 0.5  # how far a node may leave the middle of its patch on the way, in lengths


def new_scratch(relief: Relief) -> Scratch:
    """Return room for the trials of the search, with the numbers of neighbours that suit the nodes."""
    suit_nodes(relief.net)
    return blank_scratch(relief)


def blank_scratch(relief: Relief) -> Scratch:
    """Return room for the trials of the search."""
    capacity, width = relief.net.ring.shape
    return Scratch(
        held=np.zeros(capacity, np.int64),
        tried=np.zeros(capacity, np.int64),
        out=np.zeros(capacity, np.int64),
        around=np.zeros(capacity, np.int64),
        nodes=np.zeros((capacity, 3)),
        arc=np.zeros(capacity),
        ring=np.zeros((capacity, width), np.int64),
        degree=np.zeros(capacity, np.int64),
        line=np.zeros(capacity, np.int64),
        trial=np.zeros(1, np.int64),
        gathered=np.zeros(1, np.int64),
        paid=np.zeros(1, np.int64),
    )


def shares_of(net: Net) -> list[np.ndarray]:
    """Return the nodes of a net to settle: those of both halves, which may move at once, and those between; all of a small one."""
    live = net.degree > 0
    every = np.flatnonzero(live)
    if len(every) < MANY:
        return [every]
    label = Halves(net, live).label[every]
    return [every[label == part] for part in (0, 1, BETWEEN)]


def settle(
    relief: Relief,
    weight: float,
    enough: float,
    sweeps: int,
    stride: float = STRIDE,
    shares: list[np.ndarray] | None = None,
) -> int:
    """Move the nodes downhill until a sweep gains less than `enough` a node; returns the sweeps made.

    Halves of the net, or the `shares` that it has had since its members last changed, move side by side, a few sweeps at once.
    """
    shares = shares_of(relief.net) if shares is None else shares
    awake, count = np.ones(len(relief.net.degree), np.int64), sum(map(len, shares))
    at_once = sweeps if len(shares) == 1 else AT_ONCE

    def move(some: np.ndarray) -> tuple[float, int]:
        of_grid = relief.net, relief.patches, relief.rim, awake, some, relief.length
        return settle_some(*of_grid, weight, enough, at_once, stride)

    for made in range(0, sweeps, at_once):
        gains, done = zip(*two_at_once(move, shares), strict=True)
        if sum(gains) < enough * count:
            return made + max(done)
    return sweeps


def settle_again(relief: Relief) -> None:
    """Settle after a round of moves: the nodes have left the middles of their patches."""
    relief.renew(FAR)
    settle(relief, WEIGHT, 1e-4, 8)


def search_once(relief: Relief, scratch: Scratch) -> int:
    """Try flips, collapses and splits where nodes ask for them; returns how many were kept.

    Where many ask, those of two halves of the grid are tried side by side, then those between.
    """
    net, kept = relief.net, 0
    asking = (net.degree > 0) & (net.degree != net.ideal) & (scratch.tried[:] == 0)
    if asking.sum() >= ASKING:
        kept = _search_halves(relief, Halves(net, asking), scratch)
    terms = terms_of(relief, scratch)
    return kept + _search(relief, net, scratch, terms)


def _search_halves(relief: Relief, halves: Halves, scratch: Scratch) -> int:
    """Search in both halves at once, each with half of the nodes that bring the mean length to the desired one."""
    terms = terms_of(relief, scratch)
    terms = terms._replace(nodes=terms.nodes // 2)
    own = [blank_scratch(relief), blank_scratch(relief)]
    for side in (0, 1):
        own[side].out[:] = halves.label != side
    halves.run(lambda side: _search(relief, halves.nets[side], own[side], terms))
    for side in (0, 1):
        scratch.tried[halves.label == side] = own[side].tried[halves.label == side]
    return sum(int(room.paid[0]) for room in own)


def _search(relief: Relief, net: Net, scratch: Scratch, terms: Terms) -> int:
    of_grid = relief.patches, relief.rim, scratch, relief.length
    return search(net, *of_grid, WEIGHT, terms.strain, PRICE, terms.share, terms.nodes)


class Terms(NamedTuple):
    """What decides over one node more or less, beside the energy around it."""

    strain: float  #: mean length over desired length - 1
    share: float  #: energy that any node has
    nodes: int  #: how many there are


def terms_of(relief: Relief, scratch: Scratch) -> Terms:
    """Return the terms of a whole grid as it is now."""
    energy, mean, count = total_energy(relief.net, scratch, relief.length, WEIGHT)
    return Terms(mean / relief.length - 1.0, min(energy / max(count, 1), SHARE), max(count, 1))


def grid_energy(grid: Grid, length: float) -> float:
    """The energy that falls, of a whole grid; folded members left out."""
    stretch = grid.stretches(length) - 1.0
    shapes = shape_qualities(grid.nodes, grid.triangles)
    price = PRICE * len(grid.nodes) * float(stretch.mean()) ** 2
    return WEIGHT * float((stretch**2).sum()) + float((1.0 - shapes).sum()) + price


def energy_of_node(relief: Relief) -> float:
    """The energy that falls, of an opened grid, for one node: grids of other numbers of nodes can be compared."""
    energy, mean, count = total_energy(relief.net, new_scratch(relief), relief.length, WEIGHT)
    return energy / max(count, 1) + PRICE * (mean / relief.length - 1.0) ** 2


def equalize(relief: Relief, progress: Callable[[float], None] | None = None) -> None:
    """Flip, settle, and search while it pays: the default way to improve a grid."""
    flip_by_angle(relief.net)
    settle(relief, WEIGHT, 1e-3, 60)
    scratch = new_scratch(relief)
    for done in range(SEARCHES):
        if progress:
            progress(0.2 + 0.4 * done / SEARCHES)
        if search_once(relief, scratch) == 0:
            break
        settle_again(relief)


def finish(relief: Relief, prefer: str = "balance") -> None:
    """Settle for good: each node on the surface that is fitted to the scan around it, by what is preferred."""
    shares = shares_of(relief.net)
    for sweeps in LAST_SWEEPS:
        relief.renew(NEAR)
        settle(relief, EVEN[prefer], 1e-5, sweeps, LAST_STRIDE, shares)
    relief.return_to_scan(NEAR)
