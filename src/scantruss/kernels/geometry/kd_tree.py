"""A k-d tree of points: the nearest to a place, and all within a radius.

Search boxes suit points that are spread evenly (samples, nodes). A raw scan is thousands of times denser beside the scanner than far from
it, which does not slow a k-d tree down.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...runtime.jit import kernel

POINTS_OF_LEAF = 10  # most points of a leaf
STACK_LEVELS = 64  # levels that the stack of a search has room for, more than any tree has
QUICK_TURNS = 200  # turns with the median of three, far more than usual, which is about two a level


class KDTree(NamedTuple):
    """Points halved again and again; the children of node n are 2 n + 1 and 2 n + 2."""

    points: np.ndarray  #: (N, 3) in the order of the leaves
    ids: np.ndarray  #: (N,) int64 number of each point before they were sorted
    lower: np.ndarray  #: (nodes, 3) lower corner of the bounds of each node
    upper: np.ndarray  #: (nodes, 3) upper corner
    first: np.ndarray  #: (nodes,) int64 first point of each node
    end: np.ndarray  #: (nodes,) int64 the one after its last point


def empty_kd_tree(points: np.ndarray) -> KDTree:
    """Return a tree of points (N, 3) that is not yet divided; see `divide`."""
    levels = 0
    while len(points) > POINTS_OF_LEAF << levels:  # each turn doubles the number of leaves
        levels += 1
    nodes = (2 << levels) - 1
    first, end = np.zeros((2, nodes), np.int64)
    end[0] = len(points)
    lower, upper = np.zeros((2, nodes, 3))
    return KDTree(np.array(points, np.float64, order="C"), np.arange(len(points)), lower, upper, first, end)


@kernel
def _swap(tree: KDTree, i: int, j: int) -> None:
    """Swap two points."""
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
    """Order the points from begin to end - 1 so that none before `middle` has a larger coordinate than any from it on."""
    low, high, turns = begin, end - 1, 0
    while low < high:  # at least one point is left out of each turn
        turns += 1
        if turns > QUICK_TURNS:  # an order that defeats the median of three: the range of the values is halved
            least, most = _range_of(tree, axis, low, high)
            pivot = min(max(0.5 * least + 0.5 * most, least), most)  # which rounding must not leave
        else:
            a, b, c = tree.points[low, axis], tree.points[(low + high) // 2, axis], tree.points[high, axis]
            pivot = max(min(a, b), min(max(a, b), c))
        i, j = low, high
        while i <= j:  # each turn brings them together by one place or more
            while tree.points[i, axis] < pivot:  # the pivot, or what was swapped, stops it
                i += 1
            while tree.points[j, axis] > pivot:  # the same
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
    """Divide a node across its longest side, and its halves, over some levels; different roots may be divided at once."""
    nodes = len(tree.first)
    first, count = root, 1
    for _ in range(levels):
        for node in range(first, first + count):
            begin, end = tree.first[node], tree.end[node]
            for c in range(3):
                low, high = np.inf, -np.inf
                for p in range(begin, end):
                    low, high = min(low, tree.points[p, c]), max(high, tree.points[p, c])
                tree.lower[node, c], tree.upper[node, c] = low, high
            if 2 * node + 2 >= nodes:
                continue
            axis, longest = 0, -1.0
            for c in range(3):
                if tree.upper[node, c] - tree.lower[node, c] > longest:
                    axis, longest = c, tree.upper[node, c] - tree.lower[node, c]
            middle = (begin + end) // 2
            _select(tree, axis, begin, end, middle)
            tree.first[2 * node + 1], tree.end[2 * node + 1] = begin, middle
            tree.first[2 * node + 2], tree.end[2 * node + 2] = middle, end
        first, count = 2 * first + 1, 2 * count
        if first >= nodes:
            return


@kernel
def _away(tree: KDTree, node: int, x: float, y: float, z: float) -> float:
    """Squared distance of a place from the bounds of a node."""
    dx = max(tree.lower[node, 0] - x, 0.0, x - tree.upper[node, 0])
    dy = max(tree.lower[node, 1] - y, 0.0, y - tree.upper[node, 1])
    dz = max(tree.lower[node, 2] - z, 0.0, z - tree.upper[node, 2])
    return dx * dx + dy * dy + dz * dz


@kernel
def nearest_in_tree(
    tree: KDTree, x: float, y: float, z: float, most: int, stack: np.ndarray, found: np.ndarray, squares: np.ndarray
) -> int:
    """Find the `most` points nearest to a place, nearest first, and their squared distances; returns how many there are.

    stack : (2 `STACK_LEVELS`,) int64 scratch. found, squares : (>= most,) int64 and float64, filled.
    """
    held, top = 0, 1
    stack[0] = 0
    while top > 0:  # each node is taken from the stack once
        top -= 1
        node = stack[top]
        if held == most and _away(tree, node, x, y, z) > squares[held - 1]:
            continue
        if 2 * node + 2 < len(tree.first):
            one, other = 2 * node + 1, 2 * node + 2
            if _away(tree, one, x, y, z) > _away(tree, other, x, y, z):
                one, other = other, one
            stack[top], stack[top + 1] = other, one
            top += 2
            continue
        for p in range(tree.first[node], tree.end[node]):
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
    """Find all points within a radius of a place, in the order of the leaves; returns how many, at most len(found)."""
    count, top = 0, 1
    stack[0] = 0
    limit = radius * radius
    while top > 0:  # each node is taken from the stack once
        top -= 1
        node = stack[top]
        if _away(tree, node, x, y, z) > limit:
            continue
        if 2 * node + 2 < len(tree.first):
            stack[top], stack[top + 1] = 2 * node + 2, 2 * node + 1
            top += 2
            continue
        for p in range(tree.first[node], tree.end[node]):
            dx, dy, dz = tree.points[p, 0] - x, tree.points[p, 1] - y, tree.points[p, 2] - z
            if dx * dx + dy * dy + dz * dz <= limit and count < len(found):
                found[count] = p
                count += 1
    return count


@kernel
def nearest_others(tree: KDTree, neighbors: np.ndarray, squares: np.ndarray, begin: int, end: int) -> None:
    """Find the K nearest other points of each point from `begin` to `end` - 1, nearest first, in the numbering of the tree.

    neighbors, squares : (N, K) int64 and float64, filled with the points and their squared distances, -1 and inf where there are fewer.
    """
    most = neighbors.shape[1]
    stack, found, away = np.empty(2 * STACK_LEVELS, np.int64), np.empty(most + 1, np.int64), np.empty(most + 1)
    for p in range(begin, end):
        count = nearest_in_tree(
            tree, tree.points[p, 0], tree.points[p, 1], tree.points[p, 2], most + 1, stack, found, away
        )
        held = 0
        for k in range(count):
            if found[k] != p and held < most:
                neighbors[p, held], squares[p, held] = found[k], away[k]
                held += 1
        for k in range(held, most):
            neighbors[p, k], squares[p, k] = -1, np.inf


@kernel
def nearest_of_places(tree: KDTree, places: np.ndarray, rank: int, squares: np.ndarray, which: np.ndarray) -> None:
    """Find the nearest point of each place (P, 3) for rank 1, the second nearest for rank 2, and so on.

    squares, which : (P,) float64 and int64, filled with its squared distance and its number; of fewer points, the farthest is taken.
    """
    stack, found, away = np.empty(2 * STACK_LEVELS, np.int64), np.empty(rank, np.int64), np.empty(rank)
    for i in range(len(places)):
        last = nearest_in_tree(tree, places[i, 0], places[i, 1], places[i, 2], rank, stack, found, away) - 1
        squares[i], which[i] = away[last], tree.ids[found[last]]
