"""Kicks of a whole grid: from where a search that only goes down does not get on."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..kernels.mesh.grid import Net
from ..kernels.mesh.perturbation import HOPE, HOPELESS, KEPT, MOST, Area, kick_all
from ..kernels.mesh.trial import Scratch
from .equalize import FAR, PRICE, WEIGHT, Terms, new_scratch, settle_again, terms_of
from .partition import Halves
from .working_mesh import Relief

KICKS = {"quick": (0, 0.0), "normal": (6, 0.0), "best": (40, 0.2)}  # rounds of kicks, and what they may cost at first
MANY = 700  # nodes from which on the rim decides little, and `normal` kicks once, in halves
HALVINGS, FEW = 2, 12  # times that it does so, as long as so many nodes wait
HOT = 0.8  # part of the rounds in which they may cost anything
DARING = 5.0  # of what they may cost, how much more than usual is left to hope while it is hot


def new_area(relief: Relief, number: int = 0) -> Area:
    """Return room for what a kick may change, and a source of chance of its own for each number."""
    capacity, width = relief.net.ring.shape
    return Area(
        **{name: np.zeros(capacity, np.int64) for name in ("mark", "away", "out")},
        **{
            name: np.zeros(MOST, np.int64) for name in ("around", "degree", "is_open", "kind", "curve", "ideal", "line")
        },
        nodes=np.zeros((MOST, 3)),
        arc=np.zeros(MOST),
        desired=np.zeros(MOST),
        ring=np.zeros((MOST, width), np.int64),
        patches=np.zeros((MOST, relief.patches.shape[1])),
        free=np.zeros(KEPT, np.int64),
        **{name: np.zeros(1, np.int64) for name in ("saved", "spare", "number", "gathered", "paid")},
        seed=np.array([7919 * number]),
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
            hope = HOPE + DARING * cooled if heat else HOPELESS
            waiting = np.ones(len(relief.net.arc), np.bool_)
            kick(relief, relief.net, room, waiting, terms_of(relief, room[0]), cooled, hope)
            relief.renew(FAR)
    settle_again(relief)


def kick_in_halves(relief: Relief) -> None:
    """Kick a large grid once at each irregular node, in halves side by side, and give up early what will hardly pay.

    What lies between the halves is kicked in other halves, and what is left then by itself.
    """
    net, waiting = relief.net, np.ones(len(relief.net.arc), np.bool_)
    rooms = [(new_scratch(relief), new_area(relief, number)) for number in range(3)]

    def kick_both(halves: Halves) -> None:
        terms = terms_of(relief, rooms[2][0])
        terms = terms._replace(nodes=terms.nodes // 2)  # each half brings the mean length to the desired one by itself
        for side in (0, 1):
            rooms[side][1].out[:] = halves.label != side
        halves.run(lambda side: kick(relief, halves.nets[side], rooms[side], waiting, terms, 0.0, HOPE))

    for _ in range(HALVINGS):
        irregular = waiting & (net.degree > 0) & (net.degree != net.ideal)
        if irregular.sum() >= FEW:
            kick_both(Halves(net, irregular))
    kick(relief, net, rooms[2], waiting, terms_of(relief, rooms[2][0]), 0.0, HOPE)
    relief.renew(FAR)


def kick(
    relief: Relief,
    net: Net,
    room: tuple[Scratch, Area],
    waiting: np.ndarray,
    terms: Terms,
    heat: float,
    hope: float,
) -> None:
    """Kick a net of the grid once at each irregular node waiting (C,) bool; see `kernels.mesh.perturbation.kick_all`."""
    of_grid = relief.patches, relief.rim, *room, waiting, relief.length
    kick_all(net, *of_grid, WEIGHT, terms.strain, PRICE, terms.share, terms.nodes, heat, hope)
