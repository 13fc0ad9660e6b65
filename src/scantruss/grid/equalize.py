"""Equalizing: members of one length and triangles of one shape, by moving nodes and by local search of the topology.

What falls is one energy, in units of which a member at double length costs 1 and a degenerate triangle costs 1:

    E = weight * sum (L / l_e - 1)^2 over members + sum (1 - G) over triangles + folded members + price * V * (mean L / l_e - 1)^2

where l_e is the mean of what is desired at the two nodes of a member.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..kernels.equalize import settle_all
from ..kernels.flips import flip_by_angle
from ..kernels.grid import Net
from ..kernels.kick import HOPE, HOPELESS, KEPT, MOST, OUT, Area, kick_all
from ..kernels.search import search, suit_nodes
from ..kernels.trial import Scratch, total_energy
from .flips import FOLD, ROUNDS
from .grid import Grid
from .halves import Halves
from .quality import shape_qualities
from .relief import NEAR, Relief

WEIGHT = 1.0  # of the members beside the triangles
EVEN = {"balance": 3.0, "lengths": 8.0, "shapes": 0.5}  # the same in the last sweeps, when the topology rests
PRICE = 24.0  # of a mean length that is not the desired one
SHARE = 0.1  # most energy that a node may have anyway
SEARCHES = 6  # rounds over all nodes that ask for a move
KICKS = {"quick": (0, 0.0), "normal": (6, 0.0), "best": (40, 0.2)}  # rounds of kicks, and what they may cost at first
MANY = 700  # nodes from which on the rim decides little, and `normal` kicks once, in halves
HALVINGS, FEW = 2, 12  # times that it does so, as long as so many nodes wait
HOT = 0.8  # part of the rounds in which they may cost anything
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


def settle(relief: Relief, weight: float, enough: float, sweeps: int) -> int:
    """Move the nodes downhill until a sweep gains less than `enough` a node; returns the sweeps made."""
    awake = np.ones(len(relief.net.degree), np.int64)
    return settle_all(relief.net, relief.patches, relief.rim, awake, relief.length, weight, enough, sweeps)


def settle_again(relief: Relief) -> None:
    """Settle after a round of moves: the nodes have left the middles of their patches."""
    relief.renew(FAR)
    settle(relief, WEIGHT, 1e-4, 8)


def search_once(relief: Relief, scratch: Scratch) -> int:
    """Try flips, collapses and splits where nodes ask for them; returns how many were kept."""
    strain, share, _ = _wanted(relief, scratch)
    return search(relief.net, relief.patches, relief.rim, scratch, relief.length, WEIGHT, strain, PRICE, share)


def _wanted(relief: Relief, scratch: Scratch) -> tuple[float, float, int]:
    """Mean length over desired length - 1, the energy that any node has, and the number of nodes."""
    energy, mean, count = total_energy(relief.net, scratch, relief.length, WEIGHT)
    return mean / relief.length - 1.0, min(energy / max(count, 1), SHARE), max(count, 1)


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


def new_area(relief: Relief, number: int = 0) -> Area:
    """Return room for what a kick may change, and a source of chance of its own for each number."""
    capacity, width = relief.net.ring.shape
    return Area(
        mark=np.zeros((capacity, 3), np.int64),
        around=np.zeros(MOST, np.int64),
        nodes=np.zeros((MOST, 5)),
        ring=np.zeros((MOST, width), np.int64),
        patches=np.zeros((MOST, relief.patches.shape[1])),
        state=np.zeros((MOST, relief.net.state.shape[1]), np.int64),
        free=np.zeros(KEPT + 2, np.int64),
        counter=np.array([0, 0, 7919 * number, 0]),
    )


def search_widely(relief: Relief, effort: str, progress: Callable[[float], None] | None = None) -> None:
    """Kick the grid at its irregular nodes: what a search from there finds is kept if it has paid.

    For `best` it may cost a little at first and less and less later on (simulated annealing).
    """
    rounds, heat = KICKS[effort]
    if not rounds:
        return
    if effort == "normal" and relief.net.used > MANY:
        kick_in_halves(relief)
    else:
        room = new_scratch(relief), new_area(relief)
        for done in range(rounds):
            if progress:
                progress(0.6 + 0.2 * done / rounds)
            cooled = heat * max(0.0, 1.0 - done / (HOT * rounds))
            waiting = np.ones(len(relief.net.arc), np.bool_)
            kick(relief, relief.net, room, waiting, _wanted(relief, room[0]), cooled, HOPELESS)
            relief.renew(FAR)
    settle_again(relief)


def kick_in_halves(relief: Relief) -> None:
    """Kick a large grid once at each irregular node, in halves side by side, and give up early what will hardly pay.

    What lies between the halves is kicked in other halves, and what is left then by itself.
    """
    net, waiting = relief.net, np.ones(len(relief.net.arc), np.bool_)
    rooms = [(new_scratch(relief), new_area(relief, number)) for number in range(3)]

    def kick_both(halves: Halves) -> None:
        strain, share, count = _wanted(relief, rooms[2][0])
        for side in (0, 1):
            rooms[side][1].mark[:, OUT] = halves.label != side
        halves.run(
            lambda side: kick(relief, halves.nets[side], rooms[side], waiting, (strain, share, count // 2), 0.0, HOPE)
        )

    for _ in range(HALVINGS):
        irregular = waiting & (net.degree > 0) & (net.degree != net.ideal)
        if irregular.sum() >= FEW:
            kick_both(Halves(net, irregular))
    kick(relief, net, rooms[2], waiting, _wanted(relief, rooms[2][0]), 0.0, HOPE)
    relief.renew(FAR)


def kick(
    relief: Relief,
    net: Net,
    room: tuple[Scratch, Area],
    waiting: np.ndarray,
    wanted: tuple[float, float, int],
    heat: float,
    hope: float,
) -> None:
    """Kick a net of the grid once at each irregular node waiting (C,) bool; see `kernels.kick.kick_all`."""
    strain, share, count = wanted
    scratch, area = room
    of_grid = relief.patches, relief.rim, scratch, area, waiting, relief.length
    kick_all(net, *of_grid, WEIGHT, strain, PRICE, share, count, heat, hope)


def finish(relief: Relief, prefer: str = "balance") -> None:
    """Settle for good: each node on the surface that is fitted to the scan around it, by what is preferred."""
    for _ in range(2):
        relief.renew(NEAR)
        settle(relief, EVEN[prefer], 1e-5, 20)
    relief.return_to_scan(NEAR)
