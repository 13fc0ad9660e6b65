"""A tree of points that are as close together here and as far apart there as they like: the nearest of a place, all near a place.

Search boxes suit what is spread evenly (samples, nodes). A scan as it comes is thousands of times denser beside the scanner than far
from it; a tree of halves does not mind.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...runtime.jit import kernel

LEAF = 10  # most points of a leaf
QUICK_TURNS = 200  # turns with the median of three; usual are about two a level
STACK_LEVELS = 64  # levels of the stack of a search, more than any tree has


class KDTree(NamedTuple):
    """Points in halves of halves; node n has the halves 2 n + 1 and 2 n + 2."""

    points: np.ndarray  #: (N, 3) in the order of the leaves
    ids: np.ndarray  #: (N,) int64 number that each had
    bounds: np.ndarray  #: (nodes, 6) lower and upper corner
    ranges: np.ndarray  #: (nodes, 2) int64 first point and the one after the last


def empty_kd_tree(points: np.ndarray) -> KDTree:
    """Return a tree of points (N, 3) that is not yet divided; see `divide`."""
    levels = 0
    while len(points) > LEAF << levels:
        levels += 1
    nodes = (2 << levels) - 1
    ranges = np.zeros((nodes, 2), np.int64)
    ranges[0, 1] = len(points)
    return KDTree(np.array(points, np.float64, order="C"), np.arange(len(points)), np.zeros((nodes, 6)), ranges)


@kernel
def _swap(tree: KDTree, i: int, j: int) -> None:
    """Let two points change places."""
    for c in range(3):
        kept = tree.points[i, c]
        tree.points[i, c] = tree.points[j, c]
        tree.points[j, c] = kept
    number = tree.ids[i]
    tree.ids[i] = tree.ids[j]
    tree.ids[j] = number


@kernel
def _range_of(tree: KDTree, axis: int, low: int, high: int) -> tuple[float, float]:
    """Least and largest coordinate of the points from low to high."""
    least, most = np.inf, -np.inf
    for p in range(low, high + 1):
        least, most = min(least, tree.points[p, axis]), max(most, tree.points[p, axis])
    return least, most


@kernel
def _select(tree: KDTree, axis: int, begin: int, end: int, middle: int) -> None:
    """Order the points from begin to end - 1 so that none before `middle` has a larger coordinate than any from there on."""
    low, high, turns = begin, end - 1, 0
    while low < high:  # at least one point is left out of each turn
        turns += 1
        if (
            turns > QUICK_TURNS
        ):  # points in an order that defeats the median of three: the range of the values is halved
            least, most = _range_of(tree, axis, low, high)
            pivot = 0.5 * least + 0.5 * most
        else:
            a, b, c = tree.points[low, axis], tree.points[(low + high) // 2, axis], tree.points[high, axis]
            pivot = max(min(a, b), min(max(a, b), c))
        i, j = low, high
        while i <= j:
            while tree.points[i, axis] < pivot:
                i += 1
            while tree.points[j, axis] > pivot:
                j -= 1
            if i <= j:
                _swap(tree, i, j)
                i += 1
                j -= 1
        if middle <= j:
            high = j
        elif middle >= i:
            low = i
        else:
            return


@kernel
def divide(tree: KDTree, root: int, levels: int) -> None:
    """Divide a node across its longest side, and its halves, so many levels deep; what one root holds no other touches."""
    nodes = len(tree.ranges)
    first, count = root, 1
    for _ in range(levels):
        for node in range(first, first + count):
            begin, end = tree.ranges[node, 0], tree.ranges[node, 1]
            for c in range(3):
                low, high = np.inf, -np.inf
                for p in range(begin, end):
                    low, high = min(low, tree.points[p, c]), max(high, tree.points[p, c])
                tree.bounds[node, c], tree.bounds[node, 3 + c] = low, high
            if 2 * node + 2 >= nodes:
                continue
            axis, longest = 0, -1.0
            for c in range(3):
                if tree.bounds[node, 3 + c] - tree.bounds[node, c] > longest:
                    axis, longest = c, tree.bounds[node, 3 + c] - tree.bounds[node, c]
            middle = (begin + end) // 2
            _select(tree, axis, begin, end, middle)
            tree.ranges[2 * node + 1, 0], tree.ranges[2 * node + 1, 1] = begin, middle
            tree.ranges[2 * node + 2, 0], tree.ranges[2 * node + 2, 1] = middle, end
        first, count = 2 * first + 1, 2 * count
        if first >= nodes:
            return


@kernel
def _away(tree: KDTree, node: int, x: float, y: float, z: float) -> float:
    """Squared distance of a place from the box of a node."""
    dx = max(tree.bounds[node, 0] - x, 0.0, x - tree.bounds[node, 3])
    dy = max(tree.bounds[node, 1] - y, 0.0, y - tree.bounds[node, 4])
    dz = max(tree.bounds[node, 2] - z, 0.0, z - tree.bounds[node, 5])
    return dx * dx + dy * dy + dz * dz


@kernel
def nearest(
    tree: KDTree, x: float, y: float, z: float, most: int, stack: np.ndarray, found: np.ndarray, squares: np.ndarray
) -> int:
    """The `most` points nearest to a place, nearest first, with their squared distances; returns how many there are.

    stack (2 `STACK_LEVELS`,), found (>= most,) int64 and squares (>= most,) are filled.
    """
    held, top = 0, 1
    stack[0] = 0
    while top > 0:
        top -= 1
        node = stack[top]
        if held == most and _away(tree, node, x, y, z) > squares[held - 1]:
            continue
        if 2 * node + 2 < len(tree.ranges):
            one, other = 2 * node + 1, 2 * node + 2
            if _away(tree, one, x, y, z) > _away(tree, other, x, y, z):
                one, other = other, one
            stack[top], stack[top + 1] = other, one
            top += 2
            continue
        for p in range(tree.ranges[node, 0], tree.ranges[node, 1]):
            dx, dy, dz = tree.points[p, 0] - x, tree.points[p, 1] - y, tree.points[p, 2] - z
            square = dx * dx + dy * dy + dz * dz
            if held == most and square >= squares[held - 1]:
                continue
            at = held if held < most else most - 1
            while at > 0 and squares[at - 1] > square:
                squares[at], found[at] = squares[at - 1], found[at - 1]
                at -= 1
            squares[at], found[at] = square, p
            held = min(held + 1, most)
    return held


@kernel
def within(tree: KDTree, x: float, y: float, z: float, radius: float, stack: np.ndarray, found: np.ndarray) -> int:
    """All points within a radius of a place, in the order of the leaves; returns how many, at most len(found)."""
    count, top = 0, 1
    stack[0] = 0
    limit = radius * radius
    while top > 0:
        top -= 1
        node = stack[top]
        if _away(tree, node, x, y, z) > limit:
            continue
        if 2 * node + 2 < len(tree.ranges):
            stack[top], stack[top + 1] = 2 * node + 2, 2 * node + 1
            top += 2
            continue
        for p in range(tree.ranges[node, 0], tree.ranges[node, 1]):
            dx, dy, dz = tree.points[p, 0] - x, tree.points[p, 1] - y, tree.points[p, 2] - z
            if dx * dx + dy * dy + dz * dz <= limit and count < len(found):
                found[count] = p
                count += 1
    return count


@kernel
def nearest_others(tree: KDTree, neighbors: np.ndarray, squares: np.ndarray, begin: int, end: int) -> None:
    """The K nearest other points of those from `begin` to `end` - 1, nearest first, by their places in the tree; -1 where there are fewer.

    neighbors (N, K) int64 and squares (N, K), squared distances, inf where there is none, are filled.
    """
    most = neighbors.shape[1]
    stack, found, away = np.empty(2 * STACK_LEVELS, np.int64), np.empty(most + 1, np.int64), np.empty(most + 1)
    for p in range(begin, end):
        count = nearest(tree, tree.points[p, 0], tree.points[p, 1], tree.points[p, 2], most + 1, stack, found, away)
        held = 0
        for k in range(count):
            if found[k] != p and held < most:
                neighbors[p, held], squares[p, held] = found[k], away[k]
                held += 1
        for k in range(held, most):
            neighbors[p, k], squares[p, k] = -1, np.inf


@kernel
def nearest_of_places(tree: KDTree, places: np.ndarray, rank: int, squares: np.ndarray, which: np.ndarray) -> None:
    """Squared distance of each place (P, 3) from its nearest point for rank 1, from its second nearest for rank 2, and so on.

    squares (P,) and which (P,) int64, the number that this point had, are filled; where there are fewer points the farthest counts.
    """
    stack, found, away = np.empty(2 * STACK_LEVELS, np.int64), np.empty(rank, np.int64), np.empty(rank)
    for i in range(len(places)):
        last = nearest(tree, places[i, 0], places[i, 1], places[i, 2], rank, stack, found, away) - 1
        squares[i], which[i] = away[last], tree.ids[found[last]]
