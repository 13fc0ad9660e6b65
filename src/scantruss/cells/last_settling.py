"""Last settling of quads: lengths may get as even as corners allow that stay near a right angle."""

from __future__ import annotations

import math

import numpy as np

from ..check.limits import WARN_WIDE
from ..grid.panels import corner_angles_of
from .quad_mesh import QUAD_ANGLES, QuadMesh
from .quad_search import Search

LAST_SWEEPS_OF_QUADS = 60  # most sweeps with each weight
LAST_NEAR = 0.2  # distance of a node from the centre of its patch that gets it a new one [members]
# weights of angles in the energy that are tried in turn after the usual one
LOWER_ANGLES = (0.4, 0.36, 0.32, 0.285, 0.255, 0.225, 0.2, 0.18)
ASKEW_CORNER = 20.0  # angle by which a corner that is not near a right angle is off it [degree]
MORE_ASKEW = 1.2  # share of the corners askew before that may be so after where lengths are as even as is aimed at
MOST_ASKEW = 0.049  # largest share of all corners that may be
# of the CV of lengths, the share of corners askew and that of irregular nodes inside
AIMS_OF_QUADS = (0.075, 0.05, 0.08)


def settle_last(mesh: QuadMesh) -> None:
    """Settle all nodes, with a lower and lower weight of angles as long as hardly more corners get askew.

    Where lengths are less even than is aimed at, all corners may be that the aim allows.
    """
    _settle(mesh, QUAD_ANGLES)
    quads = mesh.live()
    most = MOST_ASKEW * quads.size
    few = min(MORE_ASKEW * _askew(mesh, quads), most)
    last = QUAD_ANGLES
    for angles in LOWER_ANGLES:
        uneven = _unevenness(mesh, quads) > AIMS_OF_QUADS[0]
        if not _lowered(mesh, quads, angles, most if uneven else few):
            if uneven:
                _lowered(mesh, quads, math.sqrt(angles * last), most)
            return
        last = angles


def _lowered(mesh: QuadMesh, quads: np.ndarray, angles: float, allowed: float) -> bool:
    """Settle all nodes with a weight of angles, unless more corners get askew than allowed; returns whether that is kept."""
    before = mesh.nodes.copy(), mesh.arc.copy(), mesh.patches.copy()
    _settle(mesh, angles)
    if _askew(mesh, quads) <= allowed:
        return True
    mesh.nodes[:], mesh.arc[:], mesh.patches[:] = before
    return False


def _unevenness(mesh: QuadMesh, quads: np.ndarray) -> float:
    """Return the CV of the lengths of the members, each over its desired length."""
    ends, others = quads.ravel(), np.roll(quads, -1, axis=1).ravel()
    key = np.unique(np.minimum(ends, others) * len(mesh.nodes) + np.maximum(ends, others))
    a, b = np.divmod(key, len(mesh.nodes))
    lengths = np.linalg.norm(mesh.nodes[a] - mesh.nodes[b], axis=1) / (0.5 * (mesh.desired[a] + mesh.desired[b]))
    return float(lengths.std() / lengths.mean())


def shortfall(search: Search) -> float:
    """Return the largest of the CV of lengths, the share of corners askew and that of irregular nodes inside, each over its aim."""
    mesh, moves = search.mesh, search.moves
    quads = mesh.live()
    inside = [v for v, own in enumerate(mesh.at) if own and not moves.at_boundary[v]]
    irregular = sum(moves.charge(v) > 0 for v in inside) / max(len(inside), 1)
    found = _unevenness(mesh, quads), _askew(mesh, quads) / quads.size, irregular
    return max(value / aim for value, aim in zip(found, AIMS_OF_QUADS, strict=True))


def wide_corners(mesh: QuadMesh) -> int:
    """Return how many corners are so wide that their panel is all but a triangle."""
    return int((corner_angles_of(mesh.nodes, mesh.live()) > WARN_WIDE).sum())


def _settle(mesh: QuadMesh, angles: float) -> None:
    """Settle all nodes on patches around them."""
    mesh.renew(LAST_NEAR)
    mesh.settle(LAST_SWEEPS_OF_QUADS, angles=angles)


def _askew(mesh: QuadMesh, quads: np.ndarray) -> int:
    """Return how many corners are not near a right angle."""
    return int((np.abs(corner_angles_of(mesh.nodes, quads) - 90.0) > ASKEW_CORNER).sum())
