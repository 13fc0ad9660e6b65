"""Two halves of a grid that two threads work on at once, and the nodes between them, which stay as they are meanwhile.

Whatever changes a node looks two members farther at most. Between the halves two rings of nodes rest, so that neither half sees
what happens in the other, and the result is the same however fast either is.
"""

from __future__ import annotations

import numpy as np

from ...runtime.jit import kernel
from .grid import Net

BETWEEN = -1  # label of the nodes that rest


@kernel
def farthest(net: Net, start: int, among: np.ndarray, away: np.ndarray, queue: np.ndarray) -> int:
    """Fill in how many members each node is away from a node, -1 where none lead there; returns the last reached of those `among`."""
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
    """Fill away (2, C) with the members from two far ends of the nodes `among` (C,) bool to each node; False where none is among.

    The ends depend on the net alone, not on where it lies.
    """
    for v in range(net.in_use[0]):
        if among[v]:
            end = farthest(net, farthest(net, v, among, away[0], queue), among, away[0], queue)
            farthest(net, farthest(net, end, among, away[0], queue), among, away[1], queue)
            return True
    return False


@kernel
def part(net: Net, nearer: np.ndarray, label: np.ndarray) -> None:
    """Label the nodes 0 or 1 by the end that they are nearer to (C,) int64, or BETWEEN beside the other half."""
    for v in range(net.in_use[0]):
        label[v] = nearer[v]
        for i in range(net.degree[v]):
            if nearer[net.ring[v, i]] != nearer[v]:
                label[v] = BETWEEN
