"""Taubin's smoothing, and the figures by which it stops (Sec. 4.1)."""

from __future__ import annotations

import math

import numpy as np

from ...runtime.jit import kernel
from ..geometry.vectors import cross, dot, norm, row, subtract
from .equalize import FOUR_ROOT_3
from .grid import INTERIOR, ON_CURVE, Net, slides_on_line


@kernel
def move_to_middle(net: Net, factor: float, before: np.ndarray) -> None:
    """Move each free node by `factor` of the way to the mean of its neighbours; on the boundary or a line, of its two neighbours there.

    A neighbour weighs as much as the length of its member over the desired one, so that long members become shorter: with equal weights
    a grid keeps the uneven density that the front has left. All nodes move at once, from the positions kept in `before` (C, 3).
    """
    used = net.in_use[0]
    for v in range(used):
        before[v, 0], before[v, 1], before[v, 2] = net.nodes[v, 0], net.nodes[v, 1], net.nodes[v, 2]
    for v in range(used):
        d = net.degree[v]
        if d == 0 or net.kind[v] > ON_CURVE:
            continue
        along_line = slides_on_line(net, v)
        step = 1 if net.kind[v] == INTERIOR or along_line else d - 1
        x = y = z = total = 0.0
        for i in range(0, d, step):
            if along_line and (net.line[v] >> i) & 1 == 0:
                continue
            arm = subtract(row(before, net.ring[v, i]), row(before, v))
            weight = norm(arm) / (net.desired[v] + net.desired[net.ring[v, i]])
            total += weight
            x, y, z = x + weight * arm[0], y + weight * arm[1], z + weight * arm[2]
        if total > 0.0:
            net.nodes[v, 0] += factor * x / total
            net.nodes[v, 1] += factor * y / total
            net.nodes[v, 2] += factor * z / total


@kernel
def state_of(net: Net, start: np.ndarray) -> tuple[float, float, float]:
    """Mean shape quality of the triangles, standard deviation of the member lengths, mean distance of the nodes from `start` (C, 3).

    Lengths count in the desired length at the member.
    """
    shape = total = squares = moved = 0.0
    triangles = members = count = 0
    for v in range(net.in_use[0]):
        d = net.degree[v]
        if d == 0:
            continue
        count += 1
        here = row(net.nodes, v)
        moved += norm(subtract(here, row(start, v)))
        for i in range(d):
            u, w = net.ring[v, i], net.ring[v, (i + 1) % d]
            a, b = subtract(row(net.nodes, u), here), subtract(row(net.nodes, w), here)
            if v < u:
                members += 1
                shorter = 2.0 / (net.desired[v] + net.desired[u])
                total += shorter * norm(a)
                squares += shorter * shorter * dot(a, a)
            if v < u and v < w and i < d - net.is_open[v]:
                triangles += 1
                c = subtract(b, a)
                edges = dot(a, a) + dot(b, b) + dot(c, c)
                if edges > 0.0:
                    shape += 0.5 * FOUR_ROOT_3 * norm(cross(a, b)) / edges
    mean = total / max(members, 1)
    return (
        shape / max(triangles, 1),
        math.sqrt(max(squares / max(members, 1) - mean * mean, 0.0)),
        moved / max(count, 1),
    )
