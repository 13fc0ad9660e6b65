"""Normals of single points turned to the side of points that are already oriented."""

from __future__ import annotations

import numpy as np

from ...runtime.jit import kernel
from ..geometry.kd_tree import STACK_LEVELS, KDTree, nearest_in_tree
from ..geometry.vectors import dot, row, subtract

RISE_WEIGHT = 16.0  # of the squared rise over the tangent plane, against the squared distance


@kernel
def turn_like_beside(
    tree: KDTree, settled: np.ndarray, points: np.ndarray, normals: np.ndarray, beside: int, begin: int, end: int
) -> None:
    """Turn the normal of each point to the side of one of its nearest points in the tree: the one most in its tangent plane.

    settled : normals of the points of the tree. normals (N, 3), turned in place. Points above it are on another sheet.
    """
    stack, found, squares = np.empty(2 * STACK_LEVELS, np.int64), np.empty(beside, np.int64), np.empty(beside)
    for p in range(begin, end):
        place, normal = row(points, p), row(normals, p)
        best, side = np.inf, 1.0
        for k in range(nearest_in_tree(tree, place[0], place[1], place[2], beside, stack, found, squares)):
            other = row(settled, found[k])
            rise = dot(subtract(row(tree.points, found[k]), place), normal)
            agree = dot(normal, other)
            cost = (squares[k] + RISE_WEIGHT * rise * rise) * (2.0 - abs(agree))
            if cost < best:
                best, side = cost, agree
        if side < 0.0:
            for c in range(3):
                normals[p, c] = -normals[p, c]
