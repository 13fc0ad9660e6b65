"""Equalizing: members of one length and triangles of one shape, by moving nodes and by local search of the topology.

What falls is one energy, in units of which a member at double length costs 1 and a degenerate triangle costs 1:

    E = weight * sum (L / l_e - 1)^2 over members + sum (1 - G) over triangles + folded members + price * V * (mean L / l_e - 1)^2

where l_e is the mean of what is desired at the two nodes of a member. Where the surface is folded, what nodes and the middles of members
are off it is added (`kernels.surface.folds`): nodes come to the crest, and members run along it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..grid.grid import Grid
from ..grid.quality import shape_qualities
from ..kernels.mesh.equalize import RELAXATION, settle_some
from ..kernels.mesh.grid import Net
from ..kernels.mesh.local_search import search, suit_nodes
from ..kernels.mesh.partition import BETWEEN
from ..kernels.mesh.trial import Scratch, total_energy
from ..runtime.parallel import two_at_once
from .flips import flip_by_angle
from .partition import Partition
from .working_mesh import NEAR_IN_THE_END, WorkingMesh

WEIGHT = 1.0  # weight of the member lengths against the shapes of the triangles
# that weight in the last sweeps, when the topology is final, for each `prefer`
EVEN = {"balance": 3.0, "lengths": 8.0, "shapes": 0.5}
LAST_SWEEPS = (12, 6)  # most sweeps of each of the last rounds; patches are fitted anew before each round
LAST_RELAXATION = 1.75  # over-relaxation of the last sweeps, which evens out long waves (successive over-relaxation)
PRICE = 24.0  # energy per node of a mean length that is off the desired one, for the square of the relative error
USUAL_ENERGY = 0.1  # largest energy per node that any node is assumed to have
SEARCHES = 6  # most rounds of the local search
MANY_NODES = 2500  # nodes above which two partitions settle at once; for fewer, waiting costs more than it gains
AT_ONCE = 2  # sweeps of the partitions between two sweeps of the nodes between them
ASKING = 200  # nodes to be searched above which two partitions are searched at once
# how far a node may leave the middle of its patch before that is fitted anew [member lengths]
FARTHEST_ON_THE_WAY = 0.5


def new_scratch(mesh: WorkingMesh) -> Scratch:
    """Return room for the trials of the search, with the numbers of neighbours that suit the nodes."""
    suit_nodes(mesh.net)
    return blank_scratch(mesh)


def blank_scratch(mesh: WorkingMesh) -> Scratch:
    """Return room for the trials of the search."""
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
    """Return the nodes of a net to settle: those of both halves, which may move at once, and those between; all of a small one."""
    live = net.degree > 0
    every = np.flatnonzero(live)
    if len(every) < MANY_NODES:
        return [every]
    label = Partition(net, live).label[every]
    return [every[label == part] for part in (0, 1, BETWEEN)]


def settle(
    mesh: WorkingMesh,
    weight: float,
    enough: float,
    sweeps: int,
    stride: float = RELAXATION,
    independent_sets: list[np.ndarray] | None = None,
) -> int:
    """Move the nodes downhill until a sweep gains less than `enough` a node; returns the sweeps made.

    Halves of the net, or the `independent_sets` that it has had since its members last changed, move side by side, a few sweeps at once.
    """
    independent_sets = independent_sets_of(mesh.net) if independent_sets is None else independent_sets
    awake, count = np.ones(len(mesh.net.degree), np.int64), sum(map(len, independent_sets))
    at_once = sweeps if len(independent_sets) == 1 else AT_ONCE

    def move(some: np.ndarray) -> tuple[float, int]:
        of_grid = mesh.net, mesh.patches, mesh.curves, awake, some, mesh.length
        return settle_some(*of_grid, weight, enough, at_once, stride)

    for made in range(0, sweeps, at_once):
        gains, done = zip(*two_at_once(move, independent_sets), strict=True)
        if sum(gains) < enough * count:
            return made + max(done)
    return sweeps


def settle_again(mesh: WorkingMesh) -> None:
    """Settle after a round of moves: the nodes have left the middles of their patches."""
    mesh.renew(FARTHEST_ON_THE_WAY)
    settle(mesh, WEIGHT, 1e-4, 8)


def search_once(mesh: WorkingMesh, scratch: Scratch) -> int:
    """Try flips, collapses and splits where nodes ask for them; returns how many were kept.

    Where many ask, those of two halves of the grid are tried side by side, then those between.
    """
    net, kept = mesh.net, 0
    asking = (net.degree > 0) & (net.degree != net.ideal) & (scratch.tried[:] == 0)
    if asking.sum() >= ASKING:
        kept = _search_partition(mesh, Partition(net, asking), scratch)
    terms = terms_of(mesh, scratch)
    return kept + _search(mesh, net, scratch, terms)


def _search_partition(mesh: WorkingMesh, partition: Partition, scratch: Scratch) -> int:
    """Search in both halves at once, each with half of the nodes that bring the mean length to the desired one."""
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
    return search(net, *of_grid, WEIGHT, terms.strain, PRICE, terms.share, terms.nodes)


class Terms(NamedTuple):
    """What decides over one node more or less, beside the energy around it."""

    strain: float  #: mean length over desired length - 1
    share: float  #: energy that any node has
    nodes: int  #: how many there are


def terms_of(mesh: WorkingMesh, scratch: Scratch) -> Terms:
    """Return the terms of a whole grid as it is now."""
    energy, mean, count = total_energy(mesh.net, mesh.patches, scratch, mesh.length, WEIGHT)
    return Terms(mean / mesh.length - 1.0, min(energy / max(count, 1), USUAL_ENERGY), max(count, 1))


def grid_energy(grid: Grid, length: float) -> float:
    """The energy that falls, of a whole grid; folded members left out."""
    stretch = grid.stretches(length) - 1.0
    shapes = shape_qualities(grid.nodes, grid.triangles)
    price = PRICE * len(grid.nodes) * float(stretch.mean()) ** 2
    return WEIGHT * float((stretch**2).sum()) + float((1.0 - shapes).sum()) + price


def energy_of_node(mesh: WorkingMesh) -> float:
    """The energy that falls, of an opened grid, for one node: grids of other numbers of nodes can be compared."""
    energy, mean, count = total_energy(mesh.net, mesh.patches, new_scratch(mesh), mesh.length, WEIGHT)
    return energy / max(count, 1) + PRICE * (mean / mesh.length - 1.0) ** 2


def equalize(mesh: WorkingMesh, progress: Callable[[float], None] | None = None) -> None:
    """Flip, settle, and search while it pays: the default way to improve a grid."""
    flip_by_angle(mesh.net)
    settle(mesh, WEIGHT, 1e-3, 60)
    scratch = new_scratch(mesh)
    for done in range(SEARCHES):
        if progress:
            progress(0.2 + 0.4 * done / SEARCHES)
        if search_once(mesh, scratch) == 0:
            break
        settle_again(mesh)


def finish(mesh: WorkingMesh, prefer: str = "balance") -> None:
    """Settle for good: each node on the surface that is fitted to the scan around it, by what is preferred."""
    independent_sets = independent_sets_of(mesh.net)
    for sweeps in LAST_SWEEPS:
        mesh.renew(NEAR_IN_THE_END)
        settle(mesh, EVEN[prefer], 1e-5, sweeps, LAST_RELAXATION, independent_sets)
    mesh.return_to_scan(NEAR_IN_THE_END)
