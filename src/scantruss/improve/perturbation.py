"""Perturbations of a whole grid: the way out of the local minima of the search."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from ..kernels.mesh.grid import Net
from ..kernels.mesh.perturbation import (
    ALLOWANCE_SEARCHED,
    ALLOWANCE_SETTLED,
    MOST_NODES,
    SAVED_FREE_NODES,
    Area,
    perturb_all,
)
from ..kernels.mesh.trial import Scratch
from .equalize import FARTHEST_ON_THE_WAY, MEAN_LENGTH_WEIGHT, Terms, new_scratch, settle_again, terms_of
from .partition import Partition
from .working_mesh import WorkingMesh

LONGER = "longer"  # the way to search a grid on that passes


class Annealing(NamedTuple):
    """How a grid is perturbed."""

    rounds: int
    temperature: float  #: energy that a perturbation may cost in the first round, on average


class Spared(NamedTuple):
    """Places at which no perturbation begins."""

    places: np.ndarray  #: (K, 3)
    reach: float  #: distance from one of them within which none does [scan unit]

    def away(self, nodes: np.ndarray) -> np.ndarray:
        """Whether each of some nodes (C, 3) lies farther than that from all of them."""
        from scipy.spatial import cKDTree  # which grids of less effort do not load

        return cKDTree(self.places).query(nodes, distance_upper_bound=self.reach)[0] > self.reach


PERTURBATIONS = {  # for each effort, and for the search after it
    "quick": Annealing(0, 0.0),
    "normal": Annealing(6, 0.0),
    "best": Annealing(40, 0.2),
    LONGER: Annealing(8, 0.4),
}
NODES_OF_LARGE_GRID = 700  # nodes above which `normal` perturbs once, in parts: there the boundary matters little
MOST_PARTITIONS = 2  # most times that a large grid is perturbed in parts
IRREGULAR_NODES_FOR_PARTS = 12  # fewest irregular nodes for that
HOT_ROUNDS = 0.8  # share of the rounds in which a perturbation may raise the energy
ALLOWANCE_PER_TEMPERATURE = 5.0  # further energy that a perturbation may cost once searched [temperature of the round]


def new_area(mesh: WorkingMesh, number: int = 0) -> Area:
    """Return scratch arrays for a perturbation, with a random sequence of its own for each number."""
    capacity, width = mesh.net.ring.shape
    return Area(
        **{name: np.zeros(capacity, np.int64) for name in ("mark", "away", "out")},
        **{
            name: np.zeros(MOST_NODES, np.int64)
            for name in ("around", "degree", "is_open", "kind", "curve", "ideal", "line")
        },
        nodes=np.zeros((MOST_NODES, 3)),
        arc=np.zeros(MOST_NODES),
        desired=np.zeros(MOST_NODES),
        ring=np.zeros((MOST_NODES, width), np.int64),
        patches=np.zeros(MOST_NODES, mesh.patches.dtype),
        free=np.zeros(SAVED_FREE_NODES, np.int64),
        **{name: np.zeros(1, np.int64) for name in ("saved", "spare", "number", "gathered", "paid")},
        seed=np.array([7919 * number]),
    )


def search_widely(
    mesh: WorkingMesh,
    way: str,
    progress: Callable[[float], None] | None = None,
    *,
    spared: Sequence[Spared] = (),
    turn: int = 0,
) -> None:
    """Perturb the grid at its irregular nodes, search from there, and keep what lowers the energy.

    way : of `PERTURBATIONS`; with `best` and the longer search the energy may rise a little at first, and less and less later on
        (simulated annealing)
    spared : where the grid is left alone
    turn : number of this search, each of which makes other random moves
    """
    rounds, temperature = PERTURBATIONS[way]
    if not rounds:
        return
    if way == "normal" and mesh.net.used > NODES_OF_LARGE_GRID:
        perturb_in_parts(mesh)
    else:
        room = new_scratch(mesh), new_area(mesh, turn)
        for done in range(rounds):
            if progress:
                progress(0.6 + 0.2 * done / rounds)
            cooled = temperature * max(0.0, 1.0 - done / (HOT_ROUNDS * rounds))
            allowance = ALLOWANCE_SEARCHED + ALLOWANCE_PER_TEMPERATURE * cooled if temperature else ALLOWANCE_SETTLED
            waiting = np.ones(len(mesh.net.arc), np.bool_)
            for each in spared:
                waiting &= each.away(mesh.net.nodes)
            perturb_mesh(mesh, mesh.net, room, waiting, terms_of(mesh, room[0]), cooled, allowance)
            mesh.renew(FARTHEST_ON_THE_WAY)
    settle_again(mesh)


def perturb_in_parts(mesh: WorkingMesh) -> None:
    """Perturb a large grid once at each irregular node, two parts at a time, and give up early on what will hardly pay.

    What lies between the parts is perturbed in other parts, and the rest in the end.
    """
    net, waiting = mesh.net, np.ones(len(mesh.net.arc), np.bool_)
    rooms = [(new_scratch(mesh), new_area(mesh, number)) for number in range(3)]

    def perturb_both(partition: Partition) -> None:
        terms = terms_of(mesh, rooms[2][0])
        terms = terms._replace(nodes=terms.nodes // 2)  # each part adjusts the mean length by itself
        for side in (0, 1):
            rooms[side][1].out[:] = partition.label != side
        partition.run(
            lambda side: perturb_mesh(mesh, partition.nets[side], rooms[side], waiting, terms, 0.0, ALLOWANCE_SEARCHED)
        )

    for _ in range(MOST_PARTITIONS):
        irregular = waiting & (net.degree > 0) & (net.degree != net.ideal)
        if irregular.sum() >= IRREGULAR_NODES_FOR_PARTS:
            perturb_both(Partition(net, irregular))
    perturb_mesh(mesh, net, rooms[2], waiting, terms_of(mesh, rooms[2][0]), 0.0, ALLOWANCE_SEARCHED)
    mesh.renew(FARTHEST_ON_THE_WAY)


def perturb_mesh(
    mesh: WorkingMesh,
    net: Net,
    room: tuple[Scratch, Area],
    waiting: np.ndarray,
    terms: Terms,
    temperature: float,
    allowance: float,
) -> None:
    """Perturb a net of the grid once at each waiting irregular node (C,) bool; see `kernels.mesh.perturbation.perturb_all`."""
    of_grid = mesh.patches, mesh.curves, *room, waiting, mesh.length
    perturb_all(
        net,
        *of_grid,
        mesh.length_weight,
        terms.strain,
        MEAN_LENGTH_WEIGHT,
        terms.share,
        terms.nodes,
        temperature,
        allowance,
    )
