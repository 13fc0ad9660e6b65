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
SLAB_RADII = 3.0  # height and width of the cells in which columns without a floor are looked for, least [sample radii]
# by how much a column's middle moves from slab to slab, and its width over its height, at most [member lengths], [widths]
UPRIGHT_WITHIN, EVEN_WITHIN = 0.2, 0.3
# by how much a part of a foot is wider at its top than at its bottom, at least, where one below is narrower and at its end [its width]
WIDENS, WIDENS_FROM_END = 0.05, 0.15
WIDEST_COLUMN = 1.6  # widest column without a floor in plan [member lengths]; a grid has five members or less around it
MOST_IN_COLUMNS = 0.4  # share of the samples from which on they are no columns but the shell
# least variance in plan across a column, in that along it: a strip of a shell has less, half a tube 0.19
LEAST_ROUND = 0.2
OUTSIDE = 0.75  # distance from the middle of a column from which on a sample is none of it [widths]
SHAFT = (0.05, 0.95)  # part of the points of a column between which its shaft lies, its capital and base aside
FEWEST_OF_SHELL = 6  # fewest samples above a column, near it, that are a shell


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


def free_columns(mean: np.ndarray, radius: float, length: float) -> np.ndarray:
    """Return the number (S,) from 1 of the column of each sample, 0 where it is of none, of a shell that may stand on no floor.

    They are upright, straight, slender tubes under it. Under a body that is closed half of it lies, in whatever direction, its floor
    aside: its legs and handles are none.

    Parameters
    ----------
    mean : (S, 3) positions of the samples, z upwards where they are of a shell on columns [scan unit]
    radius : of the samples [scan unit]
    length : desired member length [scan unit]
    """
    column, under = np.zeros(len(mean), np.int64), _under_shell(mean, length)
    floor = _floor_height(mean[under, 2], FLOOR_HALF_THICKNESS * length, LEAST_FLOOR_SHARE * len(mean))
    off_floor = mean[:, 2] > (-np.inf if floor is None else floor + OFF_FLOOR * length)
    if not under.any() or under[off_floor].mean() > MOST_UNDER + MOST_IN_COLUMNS:
        return column
    cell = max(CELL_WIDTH * length, SLAB_RADII * radius)
    slab = np.floor((mean[:, 2] - mean[:, 2].min()) / cell).astype(np.int64)
    order = np.argsort(slab, kind="stable")
    pieces: list[np.ndarray] = []  # narrow parts of the slabs
    shape: list[tuple[float, ...]] = []  # slab, middle in plan and width of each
    for which in np.split(order, np.flatnonzero(np.diff(slab[order])) + 1):
        if not under[which].any():
            continue
        group = _beside_each_other(mean[which, :2], cell)
        for own in np.split(which[np.argsort(group, kind="stable")], np.flatnonzero(np.diff(np.sort(group))) + 1):
            low, high = mean[own, :2].min(axis=0), mean[own, :2].max(axis=0)
            width = float((high - low).max())
            if 0.0 < width <= WIDEST_COLUMN * length / (1.0 - EVEN_WITHIN):
                pieces.append(own)
                shape.append((slab[own[0]], *(0.5 * (low + high)), width))
    shapes = np.array(shape).reshape(-1, 4)
    for chain in _chains(shapes, length):
        own, widths = np.concatenate([pieces[each] for each in chain]), _without_peaks(shapes[chain, 3])
        if np.median(widths) > WIDEST_COLUMN * length or _is_part_of_foot(chain, shapes, length):
            continue
        if np.ptp(widths) <= EVEN_WITHIN * widths.max() and _is_column(mean, own, float(widths.max()), length):
            column[own] = column.max() + 1
    stands = column[off_floor] > 0
    is_shell = (under[off_floor] & ~stands).mean() <= MOST_UNDER and stands.mean() <= MOST_IN_COLUMNS
    return column if is_shell else np.zeros_like(column)


def _chains(shape: np.ndarray, length: float) -> list[np.ndarray]:
    """Return the parts (K, 4) of slabs that stand on each other, straight and of one width, as lists of their numbers."""
    pairs = []
    for below, (level, x, y, width) in enumerate(shape):
        above = np.flatnonzero(shape[:, 0] == level + 1)
        near = np.hypot(shape[above, 1] - x, shape[above, 2] - y) <= UPRIGHT_WITHIN * length
        even = np.abs(shape[above, 3] - width) <= EVEN_WITHIN * np.maximum(shape[above, 3], width)
        pairs += [(below, on_it) for on_it in above[near & even]]
    one, other = np.array(pairs, np.int64).reshape(-1, 2).T
    label = component_labels(len(shape), one, other) if len(shape) else one
    return [np.flatnonzero(label == each) for each in np.unique(label)]


def _without_peaks(width: np.ndarray) -> np.ndarray:
    """Return the widths of parts (K,) that stand on each other without what a point aside adds to one of them."""
    both = np.pad(width, 1, "edge")
    inside: np.ndarray = np.median([both[:-2], width, both[2:]], axis=0)
    return inside


def _is_part_of_foot(chain: np.ndarray, shape: np.ndarray, length: float) -> bool:
    """Whether parts of slabs (K,) on each other are of a foot of the shell: what is above them widens over a stretch as long as theirs.

    Or they widen as what is above them does. What is below is narrower, if anything is.

    shape : (N, 4) slab, middle in plan and width of all parts
    """
    level, width = shape[chain, 0], shape[chain, 3]
    bottom, top = shape[chain[level.argmin()]], shape[chain[level.argmax()]]
    below, above = _beside(shape, bottom, -1.0, length), _beside(shape, top, 1.0, length)
    if not len(above) or (above[:, 3] <= width.max()).any() or (below[:, 3] >= width.min()).any():
        return False
    if top[3] >= (1.0 + (WIDENS if len(below) else WIDENS_FROM_END)) * bottom[3]:
        return True
    slabs, here = 0, top
    for _ in range(int(np.ptp(level)) + 1):
        above = _beside(shape, here, 1.0, length)
        if not len(above) or above[:, 3].min() < (1.0 + WIDENS) * here[3]:
            break
        slabs, here = slabs + 1, above[above[:, 3].argmin()]
    return slabs > np.ptp(level)


def _beside(shape: np.ndarray, part: np.ndarray, step: float, length: float) -> np.ndarray:
    """Return which of the parts (N, 4) of slabs stand on a part (4,) of one, step 1, or under it, -1; rows as `_chains`."""
    away = np.hypot(*(shape[:, 1:3] - part[1:3]).T)
    near = away <= UPRIGHT_WITHIN * length + 0.5 * np.abs(shape[:, 3] - part[3])  # a foot may widen to one side
    return shape[(shape[:, 0] == part[0] + step) & near]


def _is_column(mean: np.ndarray, own: np.ndarray, width: float, length: float) -> bool:
    """Whether some samples (K,) in slabs on each other are slender and round, and samples (S, 3) beside them are above them all."""
    bottom, top = mean[own, 2].min(), mean[own, 2].max()
    if top - bottom < max(LEAST_SLENDER * width, length):
        return False
    variances = np.linalg.eigvalsh(np.cov(mean[own, :2], rowvar=False))
    if variances[0] < LEAST_ROUND * variances[1]:
        return False
    away = np.hypot(*(mean[:, :2] - np.median(mean[own, :2], axis=0)).T)
    beside = (away > OUTSIDE * width) & (away < width + length)
    return int((beside & (mean[:, 2] > top)).sum()) >= FEWEST_OF_SHELL


def are_columns(rods: np.ndarray, shell: np.ndarray, length: float) -> bool:
    """Whether most points (N, 3) of rods are of columns, upright and slender, of a shell by its samples (S, 3), of which few lie under it.

    Under a body that is closed half of it lies: its rods are limbs.
    """
    if _under_shell(shell, length).mean() > MOST_UNDER:
        return False
    return 2 * sum(map(len, _uprights(rods, length))) > len(rods)


def column_stays(rods: np.ndarray, kept: np.ndarray, length: float) -> bool:
    """Whether most points of any upright, slender part of rods (N, 3) are kept, (N,) bool."""
    return any(2 * kept[own].sum() > len(own) for own in _uprights(rods, length))


def _uprights(rods: np.ndarray, length: float) -> list[np.ndarray]:
    """Return the numbers of the points (N, 3) of each upright, slender part of rods; a capital and a base are no wider part of it."""
    group, uprights = _beside_each_other(rods[:, :2], CELL_WIDTH * length), []
    for each in np.unique(group):
        own = np.flatnonzero(group == each)
        width = np.ptp(np.quantile(rods[own, :2], SHAFT, axis=0), axis=0).max()
        if width <= WIDEST_SUPPORT * length and np.ptp(rods[own, 2]) >= max(LEAST_SLENDER * width, length):
            uprights.append(own)
    return uprights


def lies_under_itself(mean: np.ndarray, length: float) -> bool:
    """Whether any of the samples (S, 3) of a scan lies under others, as columns do, or the floor they stand on."""
    return bool(_under_shell(mean, length).any())


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
