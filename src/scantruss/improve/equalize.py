"""Equalizing: members of one length and triangles of one shape, by moving nodes and by local search of the topology.

Both lower one energy, in which a member of twice its desired length costs 1 and a degenerate triangle costs 1:

    E = weight * sum (L / l_e - 1)^2 over members + sum (1 - G) over triangles + folded members + price * V * (mean L / l_e - 1)^2

where l_e is the mean of the lengths desired at the two nodes of a member. On a folded surface, the distances of nodes and of the middles
of members from it are added (`kernels.surface.folds`): nodes move to the crest, and members run along it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..kernels.mesh.equalize import OVER_RELAXATION, settle_some
from ..kernels.mesh.grid import Net
from ..kernels.mesh.local_search import search_moves, suit_nodes
from ..kernels.mesh.partition import BETWEEN_PARTS
from ..kernels.mesh.trial import Scratch, total_energy
from ..runtime.parallel import two_at_once
from .flips import flip_edges
from .partition import Partition
from .working_mesh import NEAR_IN_THE_END, WorkingMesh

# weight of the lengths of members against the shapes of triangles in the last sweeps, for each value of `prefer`
LAST_LENGTH_WEIGHT = {"balance": 3.0, "lengths": 8.0, "shapes": 0.5}
LAST_SWEEPS = (12, 6)  # most sweeps in each of the last rounds; patches are fitted again before each round
LAST_RELAXATION = 1.75  # over-relaxation of the last sweeps, which evens out long waves (successive over-relaxation)
MEAN_LENGTH_WEIGHT = 24.0  # energy per node of a mean length off the desired one, per square of its relative error
LARGEST_SHARE = 0.1  # largest energy that an average node is assumed to have
LOCAL_SEARCH_ROUNDS = 6  # most rounds of the local search
NODES_SETTLED_IN_PARTS = 2500  # nodes from which on two parts settle at once; with fewer, waiting costs more
SWEEPS_IN_PARTS = 2  # sweeps of the parts between two sweeps of the nodes between them
NODES_SEARCHED_IN_PARTS = 200  # irregular nodes from which on two parts are searched at once
FARTHEST_ON_THE_WAY = 0.5  # distance of a node from the centre of its patch that gets it a new one [member lengths]


def new_scratch(mesh: WorkingMesh) -> Scratch:
    """Return scratch arrays for the trials of the search, and fill in the ideal valence of each node."""
    suit_nodes(mesh.net)
    return blank_scratch(mesh)


def blank_scratch(mesh: WorkingMesh) -> Scratch:
    """Return scratch arrays for the trials of the search."""
    capacity, width = mesh.net.ring.shape
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


def independent_sets_of(net: Net) -> list[np.ndarray]:
    """Return the nodes to settle: those of two parts, which may move at once, and those between; all in one for a small net."""
    live = net.degree > 0
    every = np.flatnonzero(live)
    if len(every) < NODES_SETTLED_IN_PARTS:
        return [every]
    label = Partition(net, live).label[every]
    return [every[label == part] for part in (0, 1, BETWEEN_PARTS)]


def settle(
    mesh: WorkingMesh,
    weight: float,
    enough: float,
    sweeps: int,
    stride: float = OVER_RELAXATION,
    independent_sets: list[np.ndarray] | None = None,
) -> int:
    """Move the nodes downhill until a sweep gains less than `enough` per node; returns the sweeps made.

    independent_sets : nodes as from `independent_sets_of`, if the topology has not changed since
    """
    independent_sets = independent_sets_of(mesh.net) if independent_sets is None else independent_sets
    awake, count = np.ones(len(mesh.net.degree), np.int64), sum(map(len, independent_sets))
    at_once = sweeps if len(independent_sets) == 1 else SWEEPS_IN_PARTS

    def move(some: np.ndarray) -> tuple[float, int]:
        of_grid = mesh.net, mesh.patches, mesh.curves, awake, some, mesh.length
        return settle_some(*of_grid, weight, enough, at_once, stride)

    for made in range(0, sweeps, at_once):
        gains, done = zip(*two_at_once(move, independent_sets), strict=True)
        if sum(gains) < enough * count:
            return made + max(done)
    return sweeps


def settle_again(mesh: WorkingMesh) -> None:
    """Settle after a round of moves, in which nodes have left the centres of their patches."""
    mesh.renew(FARTHEST_ON_THE_WAY)
    settle(mesh, mesh.length_weight, 1e-4, 8)


def search_once(mesh: WorkingMesh, scratch: Scratch) -> int:
    """Try flips, collapses and splits at the nodes that ask for them; returns how many were kept.

    If many ask, two parts of the grid are searched at once, then what lies between them.
    """
    net, kept = mesh.net, 0
    asking = (net.degree > 0) & (net.degree != net.ideal) & (scratch.tried[:] == 0)
    if asking.sum() >= NODES_SEARCHED_IN_PARTS:
        kept = _search_partition(mesh, Partition(net, asking), scratch)
    terms = terms_of(mesh, scratch)
    return kept + _search(mesh, net, scratch, terms)


def _search_partition(mesh: WorkingMesh, partition: Partition, scratch: Scratch) -> int:
    """Search both parts at once; each may add half of the nodes that bring the mean length to the desired one."""
    terms = terms_of(mesh, scratch)
    terms = terms._replace(nodes=terms.nodes // 2)
    own = [blank_scratch(mesh), blank_scratch(mesh)]
    for side in (0, 1):
        own[side].out[:] = partition.label != side
    partition.run(lambda side: _search(mesh, partition.nets[side], own[side], terms))
    for side in (0, 1):
        scratch.tried[partition.label == side] = own[side].tried[partition.label == side]
    return sum(int(room.paid[0]) for room in own)


def _search(mesh: WorkingMesh, net: Net, scratch: Scratch, terms: Terms) -> int:
    of_grid = mesh.patches, mesh.curves, scratch, mesh.length
    return search_moves(net, *of_grid, mesh.length_weight, terms.strain, MEAN_LENGTH_WEIGHT, terms.share, terms.nodes)


class Terms(NamedTuple):
    """What one node more or less costs, besides the energy around it."""

    strain: float  #: mean length over desired length - 1
    share: float  #: energy of an average node
    nodes: int  #: number of nodes


def terms_of(mesh: WorkingMesh, scratch: Scratch) -> Terms:
    """Return the terms for a whole grid as it is now."""
    energy, mean, count = total_energy(mesh.net, mesh.patches, scratch, mesh.length, mesh.length_weight)
    return Terms(mean / mesh.length - 1.0, min(energy / max(count, 1), LARGEST_SHARE), max(count, 1))


def energy_of_grid(mesh: WorkingMesh, scratch: Scratch) -> float:
    """Return the energy of an opened grid with the usual weight of the lengths."""
    return float(total_energy(mesh.net, mesh.patches, scratch, mesh.length, mesh.length_weight)[0])


def energy_of_node(mesh: WorkingMesh) -> float:
    """Return the energy of an opened grid per node, which compares grids with different numbers of nodes."""
    energy, mean, count = total_energy(mesh.net, mesh.patches, new_scratch(mesh), mesh.length, mesh.length_weight)
    return energy / max(count, 1) + MEAN_LENGTH_WEIGHT * (mean / mesh.length - 1.0) ** 2


def equalize(mesh: WorkingMesh, progress: Callable[[float], None] | None = None) -> None:
    """Flip, settle and search until no move is kept: the default way to improve a grid."""
    flip_edges(mesh.net)
    settle(mesh, mesh.length_weight, 1e-3, 60)
    scratch = new_scratch(mesh)
    for done in range(LOCAL_SEARCH_ROUNDS):
        if progress:
            progress(0.2 + 0.4 * done / LOCAL_SEARCH_ROUNDS)
        if search_once(mesh, scratch) == 0:
            break
        settle_again(mesh)


def finish(mesh: WorkingMesh, prefer: str = "balance") -> None:
    """Settle for the last time, with weights by what is preferred, and return the nodes to the scan."""
    independent_sets = independent_sets_of(mesh.net)
    for sweeps in LAST_SWEEPS:
        mesh.renew(NEAR_IN_THE_END)
        settle(mesh, LAST_LENGTH_WEIGHT[prefer], 1e-5, sweeps, LAST_RELAXATION, independent_sets)
    mesh.return_to_scan(NEAR_IN_THE_END)
