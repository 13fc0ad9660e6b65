"""Which loops of a boundary bound holes, and which of them the settings name."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..errors import InputError, words_of_place
from ..surface.near_scan import distance_from_scan
from .curves import area_within
from .polylines import well_within

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..kernels.surface.local_surface import Surface
    from ..surface.samples import SurfaceSamples
    from .find import Loop

# a piece this many times larger than a disc with its boundary length is nearly closed: the loop is a hole
NEARLY_CLOSED = 10.0
# distance from the plane of a hole within which points lie inside it [member lengths], and from what share of those expected on it is none
IN_PLANE_OF_HOLE, COVERED_FROM = 0.12, 0.5
LONGEST_COVERED = 8.0  # longest loop of which points inside it say that it bounds no hole [member lengths]
# farthest that the boundary of a hole passes a place that names it [member lengths]
AT_HOLE = 1.0


def is_hole(loop: Loop, samples: SurfaceSamples) -> bool:
    """Whether a loop bounds a hole: any internal loop, or the external loop of a nearly closed piece."""
    share = float((samples.piece == loop.piece).mean())
    return not loop.external or share * samples.area > NEARLY_CLOSED * loop.length**2 / (4 * np.pi)


def is_covered(loop: Loop, density: float, surface: Surface, piece: np.ndarray) -> bool:
    """Whether points of the piece that a loop bounds lie all over its inside, so that it bounds no hole, as one along a sharp edge.

    density : of the points beside it [1 / scan unit^2]
    piece : (S,) of each sample
    """
    length = surface.length * (1.0 if loop.desired is None else float(loop.desired.min()))
    if loop.length > LONGEST_COVERED * length:  # as all outer boundaries are
        return False
    middle = loop.points.mean(axis=0)
    axes = np.linalg.svd(loop.points - middle, full_matrices=False)[2]
    ring = (loop.points - middle) @ axes.T
    reach = np.linalg.norm(ring, axis=1).max() + surface.step
    near = (piece == loop.piece) & (np.linalg.norm(surface.mean - middle, axis=1) < reach)
    owned = [surface.points[surface.start[k] : surface.start[k + 1]] for k in np.flatnonzero(near).tolist()]
    points = (np.concatenate([loop.points[:0], *owned]) - middle) @ axes.T
    points = points[np.abs(points[:, 2]) < IN_PLANE_OF_HOLE * length]
    inside = well_within(points[:, :2], ring[:, :2], 0.0)
    return float(inside.sum()) >= COVERED_FROM * density * area_within(loop.points)


def named_holes(
    places: Sequence[Sequence[float]], loops: Sequence[Loop], samples: SurfaceSamples, length: float
) -> set[int]:
    """Return which loops are the holes that pass some places [scan unit]; a hole too small to be found is closed anyway.

    Raises
    ------
    InputError
        A place is not at the scan, or at an outer boundary alone.
    """
    found: set[int] = set()
    for place in places:
        here = np.array(place, float) - samples.origin
        away = {k: float(np.linalg.norm(loop.points - here, axis=1).min()) for k, loop in enumerate(loops)}
        near = sorted((gap, k) for k, gap in away.items() if gap <= AT_HOLE * length)
        holes = [k for _, k in near if is_hole(loops[k], samples)]
        if holes:
            found.add(holes[0])
        elif near or distance_from_scan(samples.surface, here) > AT_HOLE * length:
            what = "at the outer boundary, which cannot be closed" if near else "not at the scan"
            raise InputError(
                f"the place {words_of_place(place)} of fill_at is {what}; name one on the boundary of a hole"
            )
    return found
