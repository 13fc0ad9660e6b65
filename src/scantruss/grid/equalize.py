"""Equalizing: members of one length and triangles of one shape, by moving nodes and by local search of the topology.

What falls is one energy, in units of which a member at double length costs 1 and a degenerate triangle costs 1:

    E = weight * sum (L / l_e - 1)^2 over members + sum (1 - G) over triangles + folded members + price * V * (mean L / l_e - 1)^2

where l_e is the mean of what is desired at the two nodes of a member.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..kernels.equalize import STRIDE, settle_all
from ..kernels.flips import flip_by_angle
from ..kernels.search import search, suit_nodes
from ..kernels.trial import Scratch, total_energy
from .flips import FOLD, ROUNDS
from .grid import Grid
from .quality import shape_qualities
from .relief import NEAR, Relief

WEIGHT = 1.0  # of the members beside the triangles
EVEN = {"balance": 3.0, "lengths": 8.0, "shapes": 0.5}  # the same in the last sweeps, when the topology rests
LAST_SWEEPS = (12, 6)  # most of these, each time with new patches,
LAST_STRIDE = 1.75  # and their steps: what is uneven in the large goes slowly (successive over-relaxation)
PRICE = 24.0  # of a mean length that is not the desired one
SHARE = 0.1  # most energy that a node may have anyway
SEARCHES = 6  # rounds over all nodes that ask for a move
FAR = 0.5  # how far a node may leave the middle of its patch on the way, in lengths


def new_scratch(relief: Relief) -> Scratch:
    """Return room for the trials of the search, with the numbers of neighbours that suit the nodes."""
    capacity, width = relief.net.ring.shape
    suit_nodes(relief.net)
    return Scratch(
        note=np.zeros((capacity, 2), np.int64),
        around=np.zeros(capacity, np.int64),
        nodes=np.zeros((capacity, 4)),
        ring=np.zeros((capacity, width + 2), np.int64),
        counter=np.zeros(3, np.int64),
    )


def settle(relief: Relief, weight: float, enough: float, sweeps: int, stride: float = STRIDE) -> int:
    """Move the nodes downhill until a sweep gains less than `enough` a node; returns the sweeps made."""
    awake = np.ones(len(relief.net.degree), np.int64)
    return settle_all(relief.net, relief.patches, relief.rim, awake, relief.length, weight, enough, sweeps, stride)


def settle_again(relief: Relief) -> None:
    """Settle after a round of moves: the nodes have left the middles of their patches."""
    relief.renew(FAR)
    settle(relief, WEIGHT, 1e-4, 8)


def search_once(relief: Relief, scratch: Scratch) -> int:
    """Try flips, collapses and splits where nodes ask for them; returns how many were kept."""
    terms = terms_of(relief, scratch)
    return search(
        relief.net, relief.patches, relief.rim, scratch, relief.length, WEIGHT, terms.strain, PRICE, terms.share
    )


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
    flip_by_angle(relief.net, FOLD, ROUNDS)
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
    for sweeps in LAST_SWEEPS:
        relief.renew(NEAR)
        settle(relief, EVEN[prefer], 1e-5, sweeps, LAST_STRIDE)
    relief.return_to_scan(NEAR)
