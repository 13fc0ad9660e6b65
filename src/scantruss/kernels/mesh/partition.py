"""Two parts of a grid on which two threads work at once, and the nodes between them, which do not change meanwhile.

A move depends on nodes at most two members away. Two rings of nodes between the parts do not change, so that neither part depends on
the other and the result does not depend on the timing of the threads.
"""

from __future__ import annotations

import numpy as np

from ...runtime.jit import kernel
from .grid import Net

BETWEEN_PARTS = -1  # label of the nodes between the parts


@kernel
def farthest(net: Net, start: int, among: np.ndarray, away: np.ndarray, queue: np.ndarray) -> int:
    """Fill in how many members away from `start` each node is, -1 if not connected; returns the last one reached of those `among`."""
    away[:] = -1
    queue[0], away[start] = start, 0
    count, at, last = 1, 0, start
    while at < count:
        v = queue[at]
        at += 1
        if among[v]:
            last = v
        for i in range(net.degree[v]):
            u = net.ring[v, i]
            if away[u] < 0:
                away[u] = away[v] + 1
                queue[count] = u
                count += 1
    return last


@kernel
def paths_from_ends(net: Net, among: np.ndarray, away: np.ndarray, queue: np.ndarray) -> bool:
    """Fill away (2, C) with how many members each node is from two far ends of the nodes `among` (C,) bool; False if there are none.

    The ends depend on the topology alone, not on the position of the grid.
    """
    for v in range(net.in_use[0]):
        if among[v]:
            end = farthest(net, farthest(net, v, among, away[0], queue), among, away[0], queue)
            farthest(net, farthest(net, end, among, away[0], queue), among, away[1], queue)
            return True
    return False


@kernel
def part(net: Net, nearer: np.ndarray, label: np.ndarray) -> None:
    """Label the nodes 0 or 1 by the end they are nearer to (C,) int64, or BETWEEN_PARTS if a neighbour is nearer to the other."""
    for v in range(net.in_use[0]):
        label[v] = nearer[v]
        for i in range(net.degree[v]):
            if nearer[net.ring[v, i]] != nearer[v]:
                label[v] = BETWEEN_PARTS
