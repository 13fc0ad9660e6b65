"""Sparse parts of a sheet that a grid leaves out: few of the points, but much of the surface."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..grid.certificate import Fault, place_of
from ..surface.chosen_samples import KEPT, SPARSE_POINT
from .limits import WARN_LEFT_OUT

if TYPE_CHECKING:
    from ..surface.samples import SurfaceSamples
    from .distances import Distances

# widths of the cells in which surface is counted: the first at which those that are left out hold enough points [member lengths]
CELLS_OF_SPARSE, ENOUGH_IN_CELL = (2.0, 3.0, 4.0, 6.0), 3.0
FEWEST_IN_CELL = 2  # points in a cell that show surface: a single one may be anything


def sparse_parts(
    samples: SurfaceSamples, found: Distances, members: np.ndarray, allowed: float
) -> tuple[list[Fault], list[Fault]]:
    """Return a fault where points too far apart for the members lie on more of the surface than may be missing; a warning of less.

    Surface is counted in cells: those with points in reach of the grid, and those where only points are that it leaves out.

    Parameters
    ----------
    members : (N,) desired member length at each point [scan unit]
    allowed : share of the scan that may be missing
    """
    sparse = samples.judged == SPARSE_POINT
    if not sparse.any():
        return [], []
    covered = found.scan <= members
    gone = ~covered & (sparse | ((samples.judged == KEPT) & ~samples.elsewhere))
    which = np.flatnonzero(covered | gone)
    for width in CELLS_OF_SPARSE:
        number = _cells(samples.scan[which], width * float(np.median(members)))
        followed, held = np.bincount(number, covered[which]) > 0, np.bincount(number, gone[which])
        left = ~followed & (held >= FEWEST_IN_CELL) & (np.bincount(number, sparse[which]) > 0)
        if followed.all() or held[~followed].mean() >= ENOUGH_IN_CELL:
            break
    share = left.sum() / (followed.sum() + left.sum())
    if share <= WARN_LEFT_OUT:
        return [], []
    points = samples.scan[which[left[number]]]
    middle = points[((points - np.median(points, axis=0)) ** 2).sum(axis=1).argmin()]
    words = f"leaves out at least {share:.0%} of the surface, where points are too far apart for members so short"
    said = [Fault("sparse", words, place_of(middle + samples.origin))]
    return (said, []) if share > allowed else ([], said)


def _cells(points: np.ndarray, width: float) -> np.ndarray:
    """Return the number of the cell, of those with points, in which each point (N, 3) lies."""
    cell = np.floor(points / width).astype(np.int64)
    cell -= cell.min(axis=0)
    across = cell.max(axis=0) + 1
    number: np.ndarray = np.unique((cell[:, 0] * across[1] + cell[:, 1]) * across[2] + cell[:, 2], return_inverse=True)[
        1
    ]
    return number.ravel()
