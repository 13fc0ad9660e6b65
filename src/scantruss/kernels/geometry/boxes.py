"""Search boxes (Sec. 3.2, Eqs. 2-4).

Only occupied boxes are stored, in a hash table from the number of a box to its first item; the items of a box form a chain.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...runtime.jit import kernel

NEARLY_IN_BOX = 1e-6  # by which a place may be in the box beside its own [boxes]


class SearchBoxes(NamedTuple):
    """Items (points, samples or nodes) by box."""

    lower: np.ndarray  #: (3,) float64 lower bounds
    size: np.ndarray  #: (3,) float64, D of Eq. 3
    inverse: np.ndarray  #: (3,) float64, 1 / D: multiplying is much faster than dividing
    counts: np.ndarray  #: (3,) int64, N of Eq. 2
    keys: np.ndarray  #: (H,) int64 number of the box in each slot, -1 for a free slot; H is a power of two
    first: np.ndarray  #: (H,) int64 first item of the box in each slot
    next: np.ndarray  #: (capacity,) int64 next item of the same box, -1 after the last


def new_boxes(lower: np.ndarray, upper: np.ndarray, box: float, capacity: int, slots: int) -> SearchBoxes:
    """Return empty search boxes (Eqs. 2, 3) no larger than `box` [scan unit], unless that makes more than 100,000 along an axis.

    Eq. 3 divides by N - 1, zero for a scan thinner than one box, and lets D grow to nearly 2 d_B; here N - 1 is rounded up, so
    that d_B / 2 < D <= d_B, and a thin direction has one box.
    """
    extent = np.asarray(upper, float) - lower
    parts = np.minimum(np.maximum(np.ceil(extent / box), 1), 100_000).astype(np.int64)
    size = np.where(extent > 0.5 * box, extent / parts, box)
    table = 1 << max(int(2 * slots - 1).bit_length(), 4)
    return SearchBoxes(
        np.array(lower, float),
        size,
        1.0 / size,
        parts + 1,
        np.full(table, -1, np.int64),
        np.full(table, -1, np.int64),
        np.full(capacity, -1, np.int64),
    )


@kernel
def box_index(boxes: SearchBoxes, axis: int, x: float) -> int:
    """Index of the box of a coordinate along an axis (Eq. 4), from 0; places outside the bounds belong to the outermost box."""
    i = int((x - boxes.lower[axis]) * boxes.inverse[axis])
    return min(max(i, 0), boxes.counts[axis] - 1)


@kernel
def slot_of(boxes: SearchBoxes, i: int, j: int, k: int) -> int:
    """Slot of a box in the table; if the box is not there, the free slot where it would go."""
    key = (i * boxes.counts[1] + j) * boxes.counts[2] + k
    mask = len(boxes.keys) - 1
    mixed = key * 613  # at most 1e15 boxes: no overflow
    slot = (mixed ^ (mixed >> 17)) & mask
    while boxes.keys[slot] != key and boxes.keys[slot] != -1:  # at least half of the slots are free
        slot = (slot + 1) & mask
    return slot


@kernel
def put_into(boxes: SearchBoxes, item: int, i: int, j: int, k: int) -> int:
    """Put an item into a box; returns 1 if the box is new, else 0."""
    slot = slot_of(boxes, i, j, k)
    new = 0
    if boxes.keys[slot] == -1:
        boxes.keys[slot] = (i * boxes.counts[1] + j) * boxes.counts[2] + k
        new = 1
    boxes.next[item] = boxes.first[slot]
    boxes.first[slot] = item
    return new


@kernel
def put(boxes: SearchBoxes, item: int, x: float, y: float, z: float) -> int:
    """Put an item into the box of a place; returns 1 if the box is new, else 0."""
    return put_into(boxes, item, box_index(boxes, 0, x), box_index(boxes, 1, y), box_index(boxes, 2, z))


@kernel
def take(boxes: SearchBoxes, item: int, x: float, y: float, z: float) -> None:
    """Take an item out of its box; x, y, z is the place at which it was put in."""
    slot = slot_of(boxes, box_index(boxes, 0, x), box_index(boxes, 1, y), box_index(boxes, 2, z))
    at = boxes.first[slot]
    if at == item:
        boxes.first[slot] = boxes.next[item]
        return
    while at >= 0:
        if boxes.next[at] == item:
            boxes.next[at] = boxes.next[item]
            return
        at = boxes.next[at]


@kernel
def is_wide(boxes: SearchBoxes, x: float, y: float, z: float, reach: float) -> bool:
    """Whether more boxes than the table has slots may hold what is within `reach` of a place: then all that are occupied are looked at."""
    total = 1
    for axis in range(3):
        at = x if axis == 0 else (y if axis == 1 else z)
        if math.isnan(at):
            return True  # it is in no box
        total *= box_index(boxes, axis, at + reach) - box_index(boxes, axis, at - reach) + 1
    return total > len(boxes.keys)


@kernel
def _search_box(
    boxes: SearchBoxes,
    slot: int,
    positions: np.ndarray,
    x: float,
    y: float,
    z: float,
    reach: float,
    found: np.ndarray,
    count: int,
) -> int:
    """Add the items of a box within `reach` of a place to the `count` found so far; returns how many there are."""
    item = boxes.first[slot]
    while item >= 0:
        dx, dy, dz = positions[item, 0] - x, positions[item, 1] - y, positions[item, 2] - z
        if dx * dx + dy * dy + dz * dz <= reach * reach and count < len(found):
            found[count] = item
            count += 1
        item = boxes.next[item]
    return count


@kernel
def search(
    boxes: SearchBoxes, positions: np.ndarray, x: float, y: float, z: float, reach: float, found: np.ndarray
) -> int:
    """Find the items within `reach` of a place; returns how many, at most len(found)."""
    count = 0
    if is_wide(boxes, x, y, z, reach):
        for slot in range(len(boxes.first)):
            count = _search_box(boxes, slot, positions, x, y, z, reach, found, count)
        return count
    square = reach * reach
    for i in range(box_index(boxes, 0, x - reach), box_index(boxes, 0, x + reach) + 1):
        to_i = _squared_gap(boxes, 0, i, x)
        for j in range(box_index(boxes, 1, y - reach), box_index(boxes, 1, y + reach) + 1):
            to_j = to_i + _squared_gap(boxes, 1, j, y)
            if to_j > square:
                continue
            half = math.sqrt(square - to_j) + NEARLY_IN_BOX * boxes.size[2]
            for k in range(box_index(boxes, 2, z - half), box_index(boxes, 2, z + half) + 1):
                count = _search_box(boxes, slot_of(boxes, i, j, k), positions, x, y, z, reach, found, count)
    return count


@kernel
def _nearest_in_box(
    boxes: SearchBoxes, slot: int, positions: np.ndarray, x: float, y: float, z: float, best: int, least: float
) -> tuple[int, float]:
    """The nearest of the items of a box and the best so far, and its squared distance."""
    item = boxes.first[slot]
    while item >= 0:
        dx, dy, dz = positions[item, 0] - x, positions[item, 1] - y, positions[item, 2] - z
        dd = dx * dx + dy * dy + dz * dz
        if dd < least or (dd == least and item < best):
            best, least = item, dd
        item = boxes.next[item]
    return best, least


@kernel
def nearest(boxes: SearchBoxes, positions: np.ndarray, x: float, y: float, z: float, reach: float) -> int:
    """The item nearest to x, y, z within `reach`, of equals the first; -1 if there is none."""
    best, least = -1, reach * reach
    if is_wide(boxes, x, y, z, reach):
        for slot in range(len(boxes.first)):
            best, least = _nearest_in_box(boxes, slot, positions, x, y, z, best, least)
        return best
    own = box_index(boxes, 0, x), box_index(boxes, 1, y), box_index(boxes, 2, z)
    best, least = _nearest_in_box(boxes, slot_of(boxes, *own), positions, x, y, z, best, least)
    reach = min(reach, math.sqrt(least) + NEARLY_IN_BOX * max(boxes.size[0], boxes.size[1], boxes.size[2]))
    for i in range(box_index(boxes, 0, x - reach), box_index(boxes, 0, x + reach) + 1):
        to_i = _squared_gap(boxes, 0, i, x)
        if to_i > least:
            continue
        for j in range(box_index(boxes, 1, y - reach), box_index(boxes, 1, y + reach) + 1):
            to_j = to_i + _squared_gap(boxes, 1, j, y)
            if to_j > least:
                continue
            for k in range(box_index(boxes, 2, z - reach), box_index(boxes, 2, z + reach) + 1):
                if to_j + _squared_gap(boxes, 2, k, z) <= least and (i, j, k) != own:
                    best, least = _nearest_in_box(boxes, slot_of(boxes, i, j, k), positions, x, y, z, best, least)
    return best


@kernel
def _squared_gap(boxes: SearchBoxes, axis: int, index: int, x: float) -> float:
    """Return the square of how far a coordinate is from a box along an axis, rounding aside; the outermost boxes have no end."""
    low = (x - boxes.lower[axis]) * boxes.inverse[axis] - index
    gap = 0.0
    if low < 0.0 and index > 0:
        gap = -low
    elif low > 1.0 and index < boxes.counts[axis] - 1:
        gap = low - 1.0
    gap = max(gap - NEARLY_IN_BOX, 0.0) * boxes.size[axis]
    return gap * gap
