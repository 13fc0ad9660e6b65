"""Poor triangles: by how much the angles, members and folds of each are beyond some limits."""

from __future__ import annotations

import numpy as np

from ...runtime.jit import kernel
from ..geometry.vectors import Vector, cross, norm, row, subtract
from .figures import angle_between
from .grid import Net, list_triangles, target_length, wings


@kernel
def normal_beyond(net: Net, a: int, b: int) -> tuple[bool, Vector]:
    """Whether there is a triangle right of the member from a to b, and its normal."""
    right = wings(net, a, b)[0]
    if right < 0:
        return False, (0.0, 0.0, 0.0)
    start = row(net.nodes, a)
    return True, cross(subtract(row(net.nodes, right), start), subtract(row(net.nodes, b), start))


@kernel
def faults_of_triangles(
    net: Net,
    fixed: np.ndarray,
    length: float,
    shortest: float,
    longest: float,
    narrowest: float,
    flattest: float,
    triangles: np.ndarray,
    faults: np.ndarray,
) -> int:
    """List the triangles of the net (T, 3), each once, and how far each is beyond some limits (T,), in parts of them; returns how many.

    fixed : (C,) bool nodes that stay; members between two of them, and angles between three, are not asked for
    shortest, longest : lengths of members [desired length]
    narrowest, flattest : angle of a triangle, and between two triangles [degree]
    """
    nodes, count = net.nodes, list_triangles(net, triangles)
    for t in range(count):
        v, u, w = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        held = fixed[v] and fixed[u] and fixed[w]
        normal = cross(subtract(row(nodes, u), row(nodes, v)), subtract(row(nodes, w), row(nodes, v)))
        found = 0.0
        for a, b, c in ((v, u, w), (u, w, v), (w, v, u)):
            start = row(nodes, a)
            if not (fixed[a] and fixed[b]):
                size = norm(subtract(row(nodes, b), start)) / target_length(net, a, b, length)
                found += max(1.0 - size / shortest, size / longest - 1.0, 0.0)
            if not held:
                angle = angle_between(subtract(row(nodes, b), start), subtract(row(nodes, c), start))
                found += max(1.0 - angle / narrowest, 0.0)
            two, other = normal_beyond(net, a, b)
            if two:
                found += max(1.0 - (180.0 - angle_between(normal, other)) / flattest, 0.0)
        faults[t] = found
    return count
