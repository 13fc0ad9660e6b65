"""Duplicate points: equal to the last bit, by a hash table of all coordinates, or within a small distance, by small search boxes."""

from __future__ import annotations

import math

import numpy as np

from ...runtime.jit import kernel


@kernel
def _mixed(a: int, b: int, c: int) -> int:
    """Hash of three integers, spread over all bits; nothing overflows."""
    mixed = 0
    for value in (a, b, c):
        low, high = value & 0x7FFFFFFF, (value >> 32) & 0x7FFFFFFF
        mixed = (mixed & 0x7FFFFFFF) * 2654435 + low * 40503 + high * 961748927
        mixed ^= mixed >> 29
    return mixed


@kernel
def _roughly_mixed(a: int, b: int, c: int) -> int:
    """The same in a third of the time, spread over the lowest bits only: for a small table."""
    folded = a ^ (b << 21) ^ (b >> 43) ^ (c << 42) ^ (c >> 22)
    return (((folded ^ (folded >> 32)) & 0x7FFFFFFF) * 2654435) >> 20


@kernel
def _same(points: np.ndarray, p: int, q: int) -> bool:
    """Whether two points have the same coordinates."""
    return points[p, 0] == points[q, 0] and points[p, 1] == points[q, 1] and points[p, 2] == points[q, 2]


@kernel
def mark_repeats(points: np.ndarray, bits: np.ndarray, slots: np.ndarray, repeated: np.ndarray) -> None:
    """Mark the points (N, 3) that are the same as an earlier one.

    bits : the same coordinates as int64. slots : more than N, a power of two of them, all -1.
    """
    mask = len(slots) - 1
    for p in range(len(points)):
        slot = _mixed(bits[p, 0], bits[p, 1], bits[p, 2]) & mask
        while slots[slot] >= 0 and not _same(points, p, slots[slot]):  # there are more slots than points
            slot = (slot + 1) & mask
        if slots[slot] >= 0:
            repeated[p] = True
        else:
            slots[slot] = p


@kernel
def enter_points(points: np.ndarray, bits: np.ndarray, chosen: np.ndarray, slots: np.ndarray) -> int:
    """Enter the chosen points (ascending) into a hash table; returns how many repeat another of them."""
    mask = len(slots) - 1
    count = 0
    for i in range(len(chosen)):
        p = chosen[i]
        slot = _roughly_mixed(bits[p, 0], bits[p, 1], bits[p, 2]) & mask
        while slots[slot] >= 0 and not _same(points, p, slots[slot]):  # there are more slots than points
            slot = (slot + 1) & mask
        if slots[slot] >= 0:
            count += 1
        else:
            slots[slot] = p
    return count


@kernel
def count_repeats(points: np.ndarray, bits: np.ndarray, slots: np.ndarray, begin: int, end: int) -> int:
    """Number of points from `begin` to `end` - 1 that repeat one that is entered in a table."""
    mask = len(slots) - 1
    count = 0
    for p in range(begin, end):
        slot = _roughly_mixed(bits[p, 0], bits[p, 1], bits[p, 2]) & mask
        while slots[slot] >= 0:  # there are more slots than points
            if slots[slot] != p and _same(points, p, slots[slot]):
                count += 1
            slot = (slot + 1) & mask
    return count


@kernel
def mark_near(
    points: np.ndarray,
    lower: np.ndarray,
    radius: float,
    slots: np.ndarray,
    following: np.ndarray,
    left_out: np.ndarray,
) -> None:
    """Mark the points within `radius` of an earlier one that is not marked.

    slots : more than N, a power of two of them, all -1: boxes as wide as the radius. following : (N,), all -1.
    """
    mask = len(slots) - 1
    for p in range(len(points)):
        x, y, z = points[p, 0], points[p, 1], points[p, 2]
        i = math.floor((x - lower[0]) / radius)
        j = math.floor((y - lower[1]) / radius)
        k = math.floor((z - lower[2]) / radius)
        near = False
        for box in range(27):
            a, b, c = i + box // 9 - 1, j + box // 3 % 3 - 1, k + box % 3 - 1
            q = slots[_mixed(a, b, c) & mask]
            while q >= 0 and not near:
                dx, dy, dz = points[q, 0] - x, points[q, 1] - y, points[q, 2] - z
                near = dx * dx + dy * dy + dz * dz <= radius * radius
                q = following[q]
            if near:
                break
        left_out[p] = near
        if not near:
            slot = _mixed(i, j, k) & mask
            following[p] = slots[slot]
            slots[slot] = p
