"""Rods: columns, poles, scaffold and cables, too thin for a grid, that join a shell with its floor."""

from __future__ import annotations

import numpy as np

from ..kernels.geometry.components import component_labels
from ..kernels.surface.rods import spreads_around
from .linked_samples import Linked

COARSE, FINE = 1.0, 0.6  # distances within which the samples around one tell whether it is a rod [member lengths]
ENOUGH = 24  # samples around a usual one that tell a rod from a sheet
FEWEST = 6  # fewest samples around one, rods aside, that make a sheet
THIN = 0.15  # spread across a rod over that along it, of squares; half a disc, as at a boundary, has 0.28
STUB = 1.3  # distance from a rod at which samples may be its ends [member lengths]
OFF_SHEET = 0.1  # distance from the sheet around at which a sample near a rod is an end of it [member lengths]
APART = 0.8  # distance from all sheets to which a rod stands off, at one place at least [member lengths]
MOST = 0.4  # share of the samples from which on they are no rods but the scan
ROUNDS = 3  # times that ends of rods are looked for


def rod_points(found: Linked, points: int, length: float, supports: np.ndarray | None = None) -> np.ndarray:
    """Return which points (N,) bool belong to rods: to samples along a line, and to the ends of these where they meet a sheet.

    Parameters
    ----------
    found : Linked
        The samples of the points.
    points : int
        How many points there are.
    length : float
        Desired member length [scan unit].
    supports : (S,) bool, optional
        Samples that are known for supports, though they are no thinner than a member.
    """
    known = np.zeros(len(found.mean), np.bool_) if supports is None else supports
    spreads, _, count = _spreads(found, np.ones(len(found.mean), np.bool_), COARSE * length)
    tells = np.median(count) >= ENOUGH  # of fewer samples around each a sheet may look thin too
    rod = known | (_thin(spreads) & tells)
    if rod.any():  # then joints of a scaffold too, which are rods to all sides
        rod |= _thin(_spreads(found, ~rod, FINE * length)[0])
    for _ in range(ROUNDS if rod.any() else 0):
        near = ~rod & (_moments(found, rod, STUB * length)[2] > 0)
        spreads, off, count = _spreads(found, ~rod, COARSE * length)
        alone = (count < FEWEST) | _thin(spreads)
        ends = near & (alone | (off > np.maximum(OFF_SHEET * length, 2.0 * np.sqrt(spreads[:, 0]))))
        if not ends.any():
            break
        rod |= ends
    rod &= _long_groups(found, rod, known, length)
    if rod.mean() > MOST:
        rod[:] = False
    marked: np.ndarray = np.where(found.owner >= 0, rod[found.owner], False)
    return marked if len(marked) == points else np.zeros(points, np.bool_)


def _long_groups(found: Linked, rod: np.ndarray, known: np.ndarray, length: float) -> np.ndarray:
    """Return which samples belong to a group of rods, (S,) bool: known, or a member long and standing off all sheets.

    Others are corners of a sheet, or where it has few points.
    """
    beside = found.neighbors
    one, other = np.nonzero((beside >= 0) & rod[:, None] & rod[beside])
    label = component_labels(len(rod), one, beside[one, other])
    order = np.argsort(label, kind="stable")
    first = np.flatnonzero(np.diff(label[order], prepend=-1))
    sizes = np.maximum.reduceat(found.mean[order], first) - np.minimum.reduceat(found.mean[order], first)
    long = np.zeros(len(rod), np.bool_)
    long[label[order[first]]] = sizes.max(axis=1) >= length
    off = np.zeros(len(rod), np.bool_)
    off[label[rod & (_moments(found, ~rod, APART * length)[2] == 0)]] = True
    long &= off
    long[label[known]] = True
    marked: np.ndarray = long[label]
    return marked


def _thin(spreads: np.ndarray) -> np.ndarray:
    """Return where samples lie along a line, (S,) bool."""
    thin: np.ndarray = spreads[:, 1] < THIN * spreads[:, 2]
    return thin


def _spreads(found: Linked, alive: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the spread of the living samples around each along their axes, least first, its distance from their plane, their number."""
    moments, middle, count = _moments(found, alive, reach)
    spreads, axes = np.linalg.eigh(moments)
    return np.maximum(spreads, 0.0), np.abs(np.einsum("si,si->s", found.mean - middle, axes[:, :, 0])), count


def _moments(found: Linked, alive: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return mean products (S, 3, 3), mean (S, 3) and number (S,) of the living samples within reach of each."""
    moments, middle = np.empty((len(found.mean), 3, 3)), np.empty((len(found.mean), 3))
    count = np.empty(len(found.mean), np.int64)
    spreads_around(found.mean, found.boxes, alive, reach, moments, middle, count)
    return moments, middle, count
