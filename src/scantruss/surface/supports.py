"""Supports: columns and legs as thick as a member between a shell and a level floor, recognized by where they stand."""

from __future__ import annotations

import numpy as np

from ..kernels.geometry.components import component_labels
from .linked_samples import Linked

CELL_WIDTH = 0.25  # width of the cells in plan [member lengths]
# height below the highest sample around from which on a sample lies under the shell [member lengths]
LEAST_HEADROOM = 0.6
OFF_FLOOR = 0.3  # height above the floor from which on a sample is none of it [member lengths]
FLOOR_HALF_THICKNESS = 0.1  # half the thickness of a floor [member lengths]
LEAST_FLOOR_SHARE = 0.05  # least share of the samples in a floor
WIDEST_SUPPORT = 1.3  # widest support in plan [member lengths]; the girth of a limb that can carry a grid is three
MOST_UNDER = 0.3  # share of the samples of a shell that lie under others of it, at most: of a closed body half do
LEAST_SLENDER = 1.5  # height of a column, least [widths]
MOST_BELOW_FLOOR = 0.01  # share of the samples that may lie below a floor
MOST_SUPPORTED = 0.2  # share of the samples from which on they are no supports but the shell


def support_samples(found: Linked, length: float) -> np.ndarray:
    """Return which samples (S,) bool belong to supports: narrow in plan, between a level floor and a shell above.

    Parameters
    ----------
    found : the samples, z upwards
    length : desired member length [scan unit]
    """
    mean, none = found.mean, np.zeros(len(found.mean), np.bool_)
    under = _under_shell(mean, length)
    if (floor := _floor_height(mean[under, 2], FLOOR_HALF_THICKNESS * length, LEAST_FLOOR_SHARE * len(mean))) is None:
        return none
    between = under & (mean[:, 2] > floor + OFF_FLOOR * length)
    which = np.flatnonzero(between)
    group = _beside_each_other(mean[which, :2], CELL_WIDTH * length)
    support = none.copy()
    for each in np.unique(group):
        own = which[group == each]
        support[own] = np.ptp(mean[own, :2], axis=0).max() <= WIDEST_SUPPORT * length
    return support if support.mean() <= MOST_SUPPORTED else none


def are_columns(rods: np.ndarray, shell: np.ndarray, length: float) -> bool:
    """Whether most points (N, 3) of rods are of columns, upright and slender, of a shell by its samples (S, 3), of which few lie under it.

    Under a body that is closed half of it lies: its rods are limbs.
    """
    if _under_shell(shell, length).mean() > MOST_UNDER:
        return False
    group, upright = _beside_each_other(rods[:, :2], CELL_WIDTH * length), 0
    for each in np.unique(group):
        own = rods[group == each]
        width, height = np.ptp(own[:, :2], axis=0).max(), np.ptp(own[:, 2])
        upright += len(own) * bool(width <= WIDEST_SUPPORT * length and height >= LEAST_SLENDER * width)
    return 2 * upright > len(rods)


def floor_below(mean: np.ndarray, length: float) -> float | None:
    """Return the height of the level floor under a shell, joined to it or not, below which hardly anything lies; None if there is none.

    Parameters
    ----------
    mean : (S, 3) positions of the samples, z upwards [scan unit]
    length : desired member length [scan unit]
    """
    half, heights = FLOOR_HALF_THICKNESS * length, mean[_under_shell(mean, length), 2]
    if (layer := _floor_height(heights, half, LEAST_FLOOR_SHARE * len(mean))) is None:
        return None
    floor = float(np.median(heights[np.abs(heights - layer) <= half]))
    return floor if (mean[:, 2] < floor - half).mean() < MOST_BELOW_FLOOR else None


def _under_shell(mean: np.ndarray, length: float) -> np.ndarray:
    """Return which samples (S,) bool lie under others (S, 3)."""
    under: np.ndarray = mean[:, 2] < _highest_around(mean, CELL_WIDTH * length) - LEAST_HEADROOM * length
    return under


def _highest_around(mean: np.ndarray, cell: float) -> np.ndarray:
    """Return the height of the highest sample in the cell in plan of each (S,) and in those around it."""
    columns = np.floor((mean[:, :2] - mean[:, :2].min(axis=0)) / cell).astype(np.int64) + 1
    wide = columns.max(axis=0) + 2
    top = np.full(tuple(wide), -np.inf)
    np.maximum.at(top, (columns[:, 0], columns[:, 1]), mean[:, 2])
    around: np.ndarray = np.max(
        [top[columns[:, 0] + i, columns[:, 1] + j] for i in (-1, 0, 1) for j in (-1, 0, 1)], axis=0
    )
    return around


def _beside_each_other(plan: np.ndarray, cell: float) -> np.ndarray:
    """Return a number for each place in plan (K,): the same where their cells touch each other one after the other."""
    cells, number = np.unique(np.floor(plan / cell).astype(np.int64), axis=0, return_inverse=True)
    there = {(i, j): k for k, (i, j) in enumerate(cells.tolist())}
    steps = ((1, -1), (1, 0), (1, 1), (0, 1))
    pairs = [(k, there[i + a, j + b]) for (i, j), k in there.items() for a, b in steps if (i + a, j + b) in there]
    one, other = np.array(pairs, np.int64).reshape(-1, 2).T
    label: np.ndarray = component_labels(len(cells), one, other)[number.ravel()]
    return label


def _floor_height(heights: np.ndarray, half: float, fewest: float) -> float | None:
    """Return the middle of the layer, two halves thick, that holds the most of some heights (K,), and at least the fewest; else None."""
    ordered = np.sort(heights)
    if not len(ordered):
        return None
    count = np.searchsorted(ordered, ordered + 2.0 * half, side="right") - np.arange(len(ordered))
    first = int(count.argmax())
    return float(ordered[first]) + half if count[first] >= fewest else None
