"""Types: equal nodes, equal panels and equal lengths, within a tolerance.

Every item differs from the representative of its type by at most the tolerance; whatever is compared does not change when the grid is
turned or moved. Mirror images are different types.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import numpy as np

from .joints import Joints


@dataclass(frozen=True, eq=False)
class Clusters:
    """Items by type, the most frequent type first."""

    of: np.ndarray  #: (N,) type of each item, -1 for what has none
    representative: np.ndarray  #: (K,) item that stands for each type
    misfit: np.ndarray  #: (N,) of each item to its representative; NaN for what has none

    @property
    def counts(self) -> np.ndarray:
        """(K,) items of each type."""
        return np.bincount(self.of[self.of >= 0], minlength=len(self.representative))

    @property
    def worst(self) -> np.ndarray:
        """(K,) item with the largest misfit of each type."""
        order = np.lexsort((-np.arange(len(self.of)), self.misfit, self.of))
        order = order[self.of[order] >= 0]
        return order[np.cumsum(self.counts) - 1]


def _sorted_by_count(of: np.ndarray, representative: np.ndarray, misfit: np.ndarray) -> Clusters:
    """Number the types by how many items they have; equal ones as they were found."""
    counts = np.bincount(of[of >= 0], minlength=len(representative))
    order = np.argsort(-counts, kind="stable")
    number = np.empty(len(order) + 1, np.int64)
    number[order] = np.arange(len(order))
    number[-1] = -1
    return Clusters(number[of], representative[order], misfit)


def cluster_lengths(lengths: np.ndarray, tolerance: float, kind: np.ndarray | None = None) -> Clusters:
    """Return the fewest types of which every length (N,) is within the tolerance of one of its own; different kinds (N,) share none."""
    kind = np.zeros(len(lengths), np.int64) if kind is None else kind
    order = np.lexsort((lengths, kind))
    of = np.empty(len(lengths), np.int64)
    representative: list[int] = []
    for each in np.unique(kind):
        mine = order[kind[order] == each]
        ordered = lengths[mine]
        begin = 0
        while begin < len(ordered):  # each type takes one length at least
            middle = int(np.searchsorted(ordered, ordered[begin] + tolerance, "right")) - 1
            while ordered[middle] - ordered[begin] > tolerance:  # a sum that was rounded up; ends at `begin`
                middle -= 1
            end = int(np.searchsorted(ordered, ordered[middle] + tolerance, "right"))
            while ordered[end - 1] - ordered[middle] > tolerance:  # ends at `middle`
                end -= 1
            of[mine[begin:end]] = len(representative)
            representative.append(int(mine[middle]))
            begin = end
    found = np.array(representative, np.int64)
    return _sorted_by_count(of, found, np.abs(lengths - lengths[found[of]]))


def _cluster(
    keys: np.ndarray, tolerance: float, misfits: Callable[[int, np.ndarray], np.ndarray], count: int, items: np.ndarray
) -> Clusters:
    """Give each item to the nearest representative within the tolerance, or make it one, in their order.

    Parameters
    ----------
    keys : (I, 1 + M), a column that must be equal, and three or more that differ by at most the misfit of two items
    tolerance : largest misfit
    misfits : of an item to several representatives
    count : length of the arrays returned
    items : (I,) the items, rising
    """
    reach = tolerance * 1.001  # a little more, for rounding
    cells = np.floor(keys[:, 1:4] / reach).astype(np.int64)
    key_of = dict(zip(items.tolist(), keys, strict=True))
    around = list(product((-1, 0, 1), repeat=cells.shape[1]))
    found: dict[tuple[int, ...], list[int]] = {}  # representatives by cell
    of, misfit = np.full(count, -1, np.int64), np.full(count, np.nan)
    representative: list[int] = []
    for item, same, cell in zip(items.tolist(), keys[:, 0].astype(np.int64).tolist(), cells.tolist(), strict=True):
        near = sorted(
            number
            for step in around
            for number in found.get((same, *(c + s for c, s in zip(cell, step, strict=True))), ())
        )
        if near:
            apart = np.abs([key_of[representative[number]] for number in near] - key_of[item]).max(axis=1)
            near = [number for number, far in zip(near, (apart > reach).tolist(), strict=True) if not far]
        if near:
            each = misfits(item, np.array([representative[number] for number in near]))
            best = int(np.argmin(each))
            if each[best] <= tolerance:
                of[item], misfit[item] = near[best], each[best]
                continue
        found.setdefault((same, *cell), []).append(len(representative))
        of[item], misfit[item] = len(representative), 0.0
        representative.append(item)
    return _sorted_by_count(of, np.array(representative, np.int64), misfit)


def cluster_panels(sides: np.ndarray, tolerance: float, across: np.ndarray | None = None) -> Clusters:
    """Return the types of panels by their sides, anticlockwise, wherever one begins; the misfit is that of the worst side.

    Parameters
    ----------
    sides : (P, K) lengths, NaN where a panel has no such side [mm]
    tolerance : largest misfit of one type [mm]
    across : (P, K) distances from node k to node k + 2 of panels of more than three nodes, which have to agree too
    """
    size = np.isfinite(sides).sum(axis=1)
    sizes = [sides] if across is None else [sides, across]

    def misfits(item: int, others: np.ndarray) -> np.ndarray:
        count = int(size[item])
        far = np.zeros((len(others), count))
        for values in sizes:
            turned = np.stack([np.roll(values[item, :count], -k) for k in range(count)])
            far = np.maximum(far, np.abs(values[others, None, :count] - turned).max(axis=2))
        return far.min(axis=1)

    keys = np.column_stack([size, *(np.nan_to_num(np.sort(values, axis=1)) for values in sizes)])
    return _cluster(keys, tolerance, misfits, len(sides), np.arange(len(sides)))


def cluster_nodes(joints: Joints, tolerance: float) -> Clusters:
    """Return the types of nodes by the directions of their members in the frame of the ball, turned about the normal [degree], and bolts.

    The misfit is the largest angle between a hole and that of the representative, once the ball is turned to where the sum of squares
    across the normal is least.
    """

    def misfits(item: int, others: np.ndarray) -> np.ndarray:
        return _misfits(joints, item, others).min(axis=1)

    used = np.flatnonzero(joints.valence)
    valence = joints.valence[used]
    place = np.arange(len(joints.node)) - joints.start[joints.node]
    ranked = np.zeros((2, len(joints.valence), int(valence.max())))
    for table, values in zip(
        ranked, (joints.tilt, joints.to_next / 2.0), strict=True
    ):  # half an angle: two holes may be off
        table[joints.node, place] = values[np.lexsort((values, joints.node))]
    tilts, angles = ranked[:, used]
    keys = np.column_stack([valence, tilts.sum(axis=1) / valence, angles[:, 0], angles.max(axis=1), angles, tilts])
    return _cluster(keys, tolerance, misfits, len(joints.valence), used)


def _misfits(joints: Joints, item: int, others: np.ndarray) -> np.ndarray:
    """Return the misfit (C, v) of a node to C others of v members, for each of its members put into their first hole [degree]."""
    mine = joints.own[joints.start[item] : joints.start[item + 1]]
    count = len(mine)
    turned = mine[(np.arange(count)[:, None] + np.arange(count)) % count]  # (v, v, 3)
    theirs = joints.own[joints.start[others][:, None] + np.arange(count)][:, None]  # (C, 1, v, 3)
    flat, their_flat = turned[..., 0] + 1j * turned[..., 1], theirs[..., 0] + 1j * theirs[..., 1]
    turn = np.angle((np.conj(flat) * their_flat).sum(axis=-1))  # (C, v)
    across = np.abs(flat * np.exp(1j * turn)[..., None] - their_flat)
    chord = np.hypot(across, turned[..., 2] - theirs[..., 2])
    bolts, place = joints.bolt[joints.start[item] + np.arange(count)], np.arange(count)
    their_bolts = joints.bolt[joints.start[others][:, None] + place][:, None]  # (C, 1, v)
    chord[bolts[(place[:, None] + place) % count] != their_bolts] = 2.0  # another thread is another ball
    return 2.0 * np.degrees(np.arcsin(np.minimum(chord / 2.0, 1.0))).max(axis=-1)


def holes_of_types(joints: Joints, types: Clusters) -> np.ndarray:
    """Return for each member end (2 E,) the hole of the representative that it goes into, from 0."""
    holes = np.empty(len(joints.node), np.int64)
    for item in np.flatnonzero(types.of >= 0).tolist():
        begin, end = joints.start[item], joints.start[item + 1]
        misfit = _misfits(joints, item, types.representative[types.of[item]][None])
        holes[begin:end] = (np.arange(end - begin) - int(np.argmin(misfit[0]))) % (end - begin)
    return holes
