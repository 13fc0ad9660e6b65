"""Tips: where the scan sticks out of a grid or sinks into it, a node is put on the farthest place.

Even members and regular triangles draw a grid off ears, toes and beaks that are about a member thick: nothing in its energy knows that the
scan goes on. So the grid is measured against the samples, and each tip gets a node in the way that disturbs the grid least, as a fixed
position does.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..check.distances import distances_to_grid
from ..kernels.boundary.curves import nearest_on_curves
from .equalize import energy_of_grid, new_scratch
from .fixed_nodes import take_place, ways_to_place
from .working_mesh import WorkingMesh, close_net

if TYPE_CHECKING:
    from ..grid.grid import Grid
    from ..surface.samples import SurfaceSamples

LEAST_TIP = 0.32  # distance of a tip from the grid, at least [member lengths]
FARTHEST_TIP = 1.2  # what is farther away is no tip but a part without a grid [member lengths]
TIPS_APART = 1.0  # least distance between two tips [member lengths]
TIP_TO_BOUNDARY = 0.5  # distance from the boundary within which no tip is looked for [member lengths]
SUSPECT_REACH = 2.0  # distance from a fault within which a node on a tip may have caused it [member lengths]
MOST_TIPS = 40  # most tips at a time, the farthest first
ENERGY_OF_TIP = 2.0  # most energy that a node on a tip may cost


def put_on_tips(mesh: WorkingMesh, tips: Sequence[np.ndarray]) -> int:
    """Put nodes on tips (3,) of a scan, where they stay while the grid around settles; returns how many."""
    return sum(_reach(mesh, tip) for tip in tips)


def find_tips(
    mesh: WorkingMesh, front: Grid, samples: SurfaceSamples, given_up: Sequence[np.ndarray] = ()
) -> list[np.ndarray]:
    """Return the samples (3,) that lie farthest from the grid around them, the farthest first.

    Parameters
    ----------
    mesh : WorkingMesh
    front : Grid
        What the mesh was opened from.
    samples : SurfaceSamples
    given_up : arrays (3,), optional
        Tips that no node can be put on, beside which none is looked for.
    """
    measured = samples.kept.copy()
    measured[samples.measured :] = False
    places = samples.surface.mean[measured]
    local = mesh.length * samples.surface.field[measured]
    grid = close_net(mesh.net, mesh.source, front)
    off = distances_to_grid(places, grid, mesh.length)[0] / local
    order = np.argsort(-off, kind="stable")
    order = order[(off[order] >= LEAST_TIP) & (off[order] <= FARTHEST_TIP)]
    tips: list[np.ndarray] = []
    for place, size in zip(places[order], local[order], strict=True):
        if len(tips) == MOST_TIPS:
            break
        near = any(np.linalg.norm(place - tip) < TIPS_APART * size for tip in (*tips, *given_up))
        if not near and not _is_at_boundary(mesh, place, TIP_TO_BOUNDARY * size):
            tips.append(place)
    return tips


def suspects_apart(
    tips: Sequence[np.ndarray], faults: Sequence[np.ndarray], length: float
) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Return the tips that have nothing to do with faults at some places (3,), and the others: fewer in each than there were.

    Where the places do not tell, these are the nearer and the farther half of them.
    """
    suspect = [is_suspect(tip, faults, length) for tip in tips]
    if all(suspect) or not any(suspect):
        suspect = [k >= len(tips) // 2 for k in range(len(tips))]
    return [tip for tip, is_one in zip(tips, suspect, strict=True) if not is_one], [
        tip for tip, is_one in zip(tips, suspect, strict=True) if is_one
    ]


def is_suspect(tip: np.ndarray, faults: Sequence[np.ndarray], length: float) -> bool:
    """Whether a tip (3,) is so near to a fault at one of some places (3,) that a node on it may have caused it."""
    return any(float(np.linalg.norm(tip - place)) < SUSPECT_REACH * length for place in faults)


def _is_at_boundary(mesh: WorkingMesh, place: np.ndarray, reach: float) -> bool:
    """Whether a place lies within some distance of a curve that nodes slide on."""
    curve, _, distance = nearest_on_curves(mesh.curves, *place.tolist())
    return bool(curve >= 0 and distance < reach)


def _reach(mesh: WorkingMesh, place: np.ndarray) -> bool:
    """Put a node on a tip in the way that costs the least energy; whether it costs little enough, else all is as before."""
    scratch = new_scratch(mesh)
    scratch.tried[:] = 1
    start, best, least = mesh.copied(), None, energy_of_grid(mesh, scratch) + ENERGY_OF_TIP
    for way in ways_to_place(mesh, place):
        mesh.restore(start)
        take_place(mesh, scratch, way, place, around=True)
        energy = energy_of_grid(mesh, scratch)
        if energy < least:
            best, least = mesh.copied(), energy
    mesh.restore(start if best is None else best)
    mesh.fixed[:] = start.fixed
    return best is not None
