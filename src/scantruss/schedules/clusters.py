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


def sorted_by_count(of: np.ndarray, representative: np.ndarray, misfit: np.ndarray) -> Clusters:
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
    return sorted_by_count(of, found, np.abs(lengths - lengths[found[of]]))


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
    return sorted_by_count(of, np.array(representative, np.int64), misfit)


@dataclass(frozen=True, eq=False)
class PanelSizes:
    """What panels are compared by, node after node anticlockwise; NaN where a panel has no such node."""

    sides: np.ndarray  #: (P, K) from node k to the next [mm]
    across: np.ndarray | None = None  #: (P, K) from node k to node k + 2, of panels of more than three nodes [mm]
    height: np.ndarray | None = None  #: (P, K) of node k over the mean plane, outwards, of the same [mm]

    @property
    def count(self) -> np.ndarray:
        """(P,) nodes of each panel."""
        return np.isfinite(self.sides).sum(axis=1)

    @property
    def all(self) -> list[np.ndarray]:
        """What there is."""
        return [each for each in (self.sides, self.across, self.height) if each is not None]

    def mirrored(self, panels: np.ndarray) -> PanelSizes:
        """Return the sizes of the mirror images of some panels, their nodes in the opposite order."""
        count, place = self.count[panels][:, None], np.arange(self.sides.shape[1])

        def back(values: np.ndarray | None, nodes: int) -> np.ndarray | None:
            """Return what goes over so many nodes, from the other end."""
            if values is None:
                return None
            taken = np.where(place < count, (-place - nodes) % count, place)
            return np.take_along_axis(values[panels], taken, axis=1)

        sides = back(self.sides, 1)
        assert sides is not None
        return PanelSizes(sides, back(self.across, 2), back(self.height, 0))


def misfits_of_panels(mine: PanelSizes, item: int, theirs: PanelSizes, others: np.ndarray) -> np.ndarray:
    """Return the largest difference (C,) of a panel to others of as many nodes, wherever the first begins [mm]."""
    count = int(mine.count[item])
    far = np.zeros((len(others), count))
    for own, values in zip(mine.all, theirs.all, strict=True):
        turned = np.stack([np.roll(own[item, :count], -k) for k in range(count)])
        far = np.maximum(far, np.abs(values[others, None, :count] - turned).max(axis=2))
    return np.asarray(far.min(axis=1))


def cluster_panels(sizes: PanelSizes, tolerance: float) -> Clusters:
    """Return the types of panels by their sizes, wherever one begins; the misfit is that of the worst.

    Parameters
    ----------
    tolerance : largest misfit of one type [mm]
    """
    number = len(sizes.sides)
    keys = np.column_stack([sizes.count, *(np.nan_to_num(np.sort(values, axis=1)) for values in sizes.all)])
    return _cluster(
        keys, tolerance, lambda item, others: misfits_of_panels(sizes, item, sizes, others), number, np.arange(number)
    )


def cluster_polygons(polygons: list[np.ndarray], tolerance: float) -> Clusters:
    """Return the types of polygons (K, 3) by the distances of all their corners, anticlockwise, wherever one begins."""
    apart = [np.linalg.norm(each[:, None] - each, axis=2) for each in polygons]

    def misfits(item: int, others: np.ndarray) -> np.ndarray:
        count = len(apart[item])
        turned = np.stack([np.roll(apart[item], (-k, -k), axis=(0, 1)) for k in range(count)])
        return np.array([np.abs(turned - apart[other]).max(axis=(1, 2)).min() for other in others.tolist()])

    most = max((len(each) for each in polygons), default=3)
    ranked = np.zeros((len(polygons), most * (most - 1) // 2))
    for row, each in zip(ranked, apart, strict=True):
        values = np.sort(each[np.triu_indices(len(each), 1)])
        row[: len(values)] = values
    counts = np.array([len(each) for each in polygons])
    keys = np.column_stack([counts, ranked[:, 0], ranked.max(axis=1, initial=0.0), ranked[:, 1:]])
    return _cluster(keys, tolerance, misfits, len(polygons), np.arange(len(polygons)))


def cluster_nodes(joints: Joints, tolerance: float) -> Clusters:
    """Return the types of nodes by the directions of their members in the frame of the ball, turned about the normal [degree], and bolts.

    The misfit is the largest angle between a hole and that of the representative, once the ball is turned to where the sum of squares
    across the normal is least.
    """

    def misfits(item: int, others: np.ndarray) -> np.ndarray:
        return misfits_of_node(joints, item, others).min(axis=1)

    used = np.flatnonzero(joints.valence)
    valence = joints.valence[used]
    place = np.arange(len(joints.node)) - joints.start[joints.node]
    ranked = np.zeros((2, len(joints.valence), int(valence.max())))
    for table, values in zip(
        ranked, (joints.tilt, joints.to_next / 2.0), strict=True
    ):  # half an angle: two holes may be off
        table[joints.node, place] = values[np.lexsort((values, joints.node))]
    tilts, angles = ranked[:, used]
    if not joints.one_layer:
        angles = _pair_angles(joints)[used]
    keys = np.column_stack([valence, tilts.sum(axis=1) / valence, angles[:, 0], angles.max(axis=1), angles, tilts])
    return _cluster(keys, tolerance, misfits, len(joints.valence), used)


def _pair_angles(joints: Joints) -> np.ndarray:
    """Return half the angles between any two members of each node (V, K), rising, filled up with nil."""
    node = joints.node[joints.pairs[:, 0]]
    order = np.lexsort((joints.angle, node))
    counts = np.bincount(node, minlength=len(joints.valence))
    table = np.zeros((len(counts), int(counts.max())))
    table[node[order], np.arange(len(node)) - np.repeat(np.cumsum(counts) - counts, counts)] = joints.angle[order] / 2.0
    return table


def misfits_of_node(joints: Joints, item: int, others: np.ndarray) -> np.ndarray:
    """Return the misfit (C, v) of a node to C others of v members, for v ways to put its members into their holes [degree]."""
    return _around(joints, item, others) if joints.one_layer else _nearest(joints, item, others)[0]


def _nearest(joints: Joints, item: int, others: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the misfit (C, v) of a node to C others [degree], and the hole (C, v, v) that each of its members is put into.

    Its member most across the normal is turned to each of theirs, every member takes the nearest hole, and the ball is turned to where
    the sum of squares across the normal is least. Where two members take one hole the misfit is 180.
    """
    count = int(joints.valence[item])
    mine = joints.own[joints.start[item] : joints.start[item + 1]]
    holes = joints.start[others][:, None] + np.arange(count)
    theirs = joints.own[holes]  # (C, v, 3)
    flat, their_flat = mine[:, 0] + 1j * mine[:, 1], theirs[..., 0] + 1j * theirs[..., 1]
    first = np.conj(flat[np.abs(flat).argmax()])
    turned = flat * np.exp(1j * np.angle(first * their_flat))[..., None]  # (C, v, v)
    across = np.abs(turned[..., None] - their_flat[:, None, None, :])
    hole = np.hypot(across, mine[:, 2, None] - theirs[:, None, None, :, 2]).argmin(axis=-1)  # (C, v, v)
    taken = np.take_along_axis(their_flat[:, None, :], hole, axis=2)
    turn = np.angle((np.conj(flat) * taken).sum(axis=-1))
    height = np.take_along_axis(theirs[:, None, :, 2], hole, axis=2)
    chord = np.hypot(np.abs(flat * np.exp(1j * turn)[..., None] - taken), mine[:, 2] - height)
    bolts = joints.bolt[joints.start[item] + np.arange(count)]
    chord[np.take_along_axis(joints.bolt[holes][:, None, :], hole, axis=2) != bolts] = (
        2.0  # another thread is another ball
    )
    chord[(np.sort(hole, axis=-1) != np.arange(count)).any(axis=-1)] = 2.0
    return 2.0 * np.degrees(np.arcsin(np.minimum(chord / 2.0, 1.0))).max(axis=-1), hole


def _around(joints: Joints, item: int, others: np.ndarray, *, over: bool = False) -> np.ndarray:
    """Return the misfit (C, v) of a node to C others, for each of its members put into their first hole, the others following [degree].

    over : whether it is turned over first, its members in the opposite order
    """
    mine = joints.own[joints.start[item] : joints.start[item + 1]]
    count = len(mine)
    mine = mine[::-1] * [1.0, -1.0, -1.0] if over else mine
    turned = mine[(np.arange(count)[:, None] + np.arange(count)) % count]  # (v, v, 3)
    theirs = joints.own[joints.start[others][:, None] + np.arange(count)][:, None]  # (C, 1, v, 3)
    flat, their_flat = turned[..., 0] + 1j * turned[..., 1], theirs[..., 0] + 1j * theirs[..., 1]
    turn = np.angle((np.conj(flat) * their_flat).sum(axis=-1))  # (C, v)
    across = np.abs(flat * np.exp(1j * turn)[..., None] - their_flat)
    chord = np.hypot(across, turned[..., 2] - theirs[..., 2])
    bolts, place = joints.bolt[joints.start[item] : joints.start[item + 1]], np.arange(count)
    bolts = bolts[::-1] if over else bolts
    their_bolts = joints.bolt[joints.start[others][:, None] + place][:, None]  # (C, 1, v)
    chord[bolts[(place[:, None] + place) % count] != their_bolts] = 2.0  # another thread is another ball
    return 2.0 * np.degrees(np.arcsin(np.minimum(chord / 2.0, 1.0))).max(axis=-1)


def holes_of_types(joints: Joints, types: Clusters, *, over: bool = False) -> np.ndarray:
    """Return for each member end (2 E,) the hole of the representative that it goes into, from 0; over: some balls may be turned over."""
    holes = np.empty(len(joints.node), np.int64)
    for item in np.flatnonzero(types.of >= 0).tolist():
        begin, end = joints.start[item], joints.start[item + 1]
        one, place = types.representative[types.of[item]][None], np.arange(end - begin)
        if not joints.one_layer:
            misfit, hole = _nearest(joints, item, one)
            holes[begin:end] = hole[0, int(np.argmin(misfit[0]))]
            continue
        misfit = _around(joints, item, one)
        if over and (turned := _around(joints, item, one, over=True)).min() < misfit.min():
            misfit, place = turned, place[::-1]
        holes[begin:end] = (place - int(np.argmin(misfit[0]))) % (end - begin)
    return holes
