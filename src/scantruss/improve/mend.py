"""Poor places: triangles and members that the certificate would refuse, which the search leaves where it may not raise the disorder.

At corners of ridges and at necks no valence is ideal, and the moves that the search tries are too few. Here every flip, collapse and split
at a poor triangle is tried, and the one that mends most is kept.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..kernels.mesh.local_search import COLLAPSE, FLIP, SPLIT, is_allowed, make_move
from ..kernels.mesh.poor_places import faults_of_triangles
from ..kernels.mesh.trial import Scratch, gather
from .equalize import energy_of_grid, new_scratch, settle
from .fixed_nodes import RINGS_SETTLED, nodes_around
from .working_mesh import WorkingMesh

if TYPE_CHECKING:
    from ..settings import Settings

POOR_ANGLE_MARGIN = 5.0  # an angle is poor that is not by so much larger than the least allowed [degree]
POOR_FOLD_MARGIN = 5.0  # two triangles are folded whose angle is not by so much larger than the least allowed [degree]
POOR_LENGTH_MARGIN = 0.06  # a member is poor that is not by so much within the lengths allowed [desired length]
MOST_POOR_PLACES = 16  # poor triangles that are mended at most; where there are more, the whole grid is poor
MENDING_ENERGY = 1.5  # most energy that mending a place may cost
SWEEPS_OF_TRIAL = 8  # sweeps in which the nodes around a move settle
LEAST_MENDED = 0.02  # least part of a limit by which a move must mend


class PoorPlaces(NamedTuple):
    """What is poor in a grid."""

    faults: float  #: sum of what is missing to the limits, in parts of them
    worst: np.ndarray  #: (K, 3) int64 the triangles that are poor, the worst first


def mend_poor_places(mesh: WorkingMesh, settings: Settings) -> bool:
    """Mend the triangles and members that the certificate would refuse, where a move and a settling of the nodes around can.

    Returns whether anything has changed.
    """
    poor = poor_places(mesh, settings)
    if not 0 < len(poor.worst) <= MOST_POOR_PLACES:
        return False
    scratch, given_up, mended = new_scratch(mesh), set(), False
    scratch.tried[:] = 1
    for _ in range(2 * MOST_POOR_PLACES):  # each turn mends a place or gives it up
        waiting = [t for t in map(tuple, poor.worst.tolist()) if t not in given_up]
        if not waiting:
            break
        if _mend(mesh, scratch, waiting[0], poor, settings):
            mended = True
        else:
            given_up.add(waiting[0])
        poor = poor_places(mesh, settings)
    return mended


def poor_places(mesh: WorkingMesh, settings: Settings) -> PoorPlaces:
    """Return the triangles with an angle or a member that is not well within the limits of the settings."""
    net = mesh.net
    most = int(net.degree[: net.used].sum())  # three times as many as there are
    triangles, faults = np.empty((most, 3), np.int64), np.empty(most)
    count = faults_of_triangles(
        net,
        mesh.fixed,
        mesh.length,
        settings.min_length + POOR_LENGTH_MARGIN,
        settings.max_length - POOR_LENGTH_MARGIN,
        settings.min_angle + POOR_ANGLE_MARGIN,
        settings.min_fold + POOR_FOLD_MARGIN,
        triangles,
        faults,
    )
    found = faults[:count]
    order = np.argsort(-found, kind="stable")[: int((found > 0.0).sum())]
    return PoorPlaces(float(found.sum()), triangles[order])


def _mend(
    mesh: WorkingMesh, scratch: Scratch, triangle: tuple[int, int, int], poor: PoorPlaces, settings: Settings
) -> bool:
    """Make the move at a triangle that mends most; whether one does, else all is as before."""
    start, best, least, most = (
        mesh.copied(),
        None,
        poor.faults - LEAST_MENDED,
        energy_of_grid(mesh, scratch) + MENDING_ENERGY,
    )
    sides = list(zip(triangle, (*triangle[1:], triangle[0]), strict=True))
    moves = [(move, *side) for move in (FLIP, SPLIT, COLLAPSE) for side in sides]
    moves += [(COLLAPSE, b, a) for a, b in sides]
    for move, a, b in moves:
        if not is_allowed(mesh.net, move, a, b, mesh.length):
            continue
        gather(mesh.net, scratch, a, b)
        added = make_move(mesh.net, mesh.patches, mesh.curves, scratch, move, a, b)
        near = nodes_around(mesh.net, added if added >= 0 else a, RINGS_SETTLED)
        settle(mesh, mesh.length_weight, 1e-4, SWEEPS_OF_TRIAL, independent_sets=[near])
        faults = poor_places(mesh, settings).faults
        if faults < least and energy_of_grid(mesh, scratch) < most:
            best, least = mesh.copied(), faults
        mesh.restore(start)
    if best is not None:
        mesh.restore(best)
    return best is not None
