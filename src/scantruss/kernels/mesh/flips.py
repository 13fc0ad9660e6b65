"""Flips that raise the smallest angle (Sec. 4.1)."""

from __future__ import annotations

import math

import numpy as np

from ...runtime.jit import kernel
from ..geometry.vectors import Vector, cross, dot, norm, row, subtract
from .grid import Net, flip, may_flip, wings

LEAST_ANGLE_GAIN = 1e-9  # by how much a flip must raise the smallest angle [radian]


@kernel
def smallest_angle(a: Vector, b: Vector, c: Vector) -> float:
    """Smallest angle of a triangle [radian]; 0 if two corners coincide."""
    u, v, w = subtract(b, a), subtract(c, b), subtract(a, c)
    uu, vv, ww = dot(u, u), dot(v, v), dot(w, w)
    if uu <= vv and uu <= ww:  # opposite to the shortest side
        u, w = v, w
    elif ww <= vv:
        u, w = u, v
    n, d = norm(cross(u, w)), -dot(u, w)
    return math.atan2(n, d) if n > 0.0 or d != 0.0 else 0.0


@kernel
def gain_of_flip(net: Net, a: int, b: int, fold: float) -> float:
    """By how much the smallest angle of the two triangles at the edge a-b grows if it is flipped [radian].

    Negative if the flip would fold the grid: the cosine between the normals after it must be at least `fold`, or that before it.
    """
    right, left = wings(net, a, b)
    pa, pb, pr, pl = row(net.nodes, a), row(net.nodes, b), row(net.nodes, right), row(net.nodes, left)
    n1, n2 = cross(subtract(pr, pa), subtract(pb, pa)), cross(subtract(pb, pa), subtract(pl, pa))
    m1, m2 = cross(subtract(pr, pa), subtract(pl, pa)), cross(subtract(pl, pb), subtract(pr, pb))
    before, after = norm(n1) * norm(n2), norm(m1) * norm(m2)
    flat_before = dot(n1, n2) / before if before > 0.0 else -1.0
    flat_after = dot(m1, m2) / after if after > 0.0 else -1.0
    if flat_after < min(fold, flat_before):
        return -1.0
    now = min(smallest_angle(pa, pr, pb), smallest_angle(pa, pb, pl))
    return min(smallest_angle(pa, pr, pl), smallest_angle(pb, pl, pr)) - now


@kernel
def flip_by_angle(net: Net, fold: float, rounds: int, changed: np.ndarray) -> int:
    """Flip each edge where that raises the smallest angle of its two triangles, until no flip does; returns the number of flips.

    changed : (C,) int64, -1 at the start, the last round in which the ring of a node or of a neighbour changed: after the first
        round, only edges between such nodes are tried again
    """
    count = 0
    for turn in range(rounds):
        before = count
        for v in range(net.in_use[0]):
            i = 0
            while i < net.degree[v]:
                u = net.ring[v, i]
                i += 1
                if v < u and changed[v] >= turn - 1 and changed[u] >= turn - 1:
                    if may_flip(net, v, u) and gain_of_flip(net, v, u, fold) > LEAST_ANGLE_GAIN:
                        right, left = wings(net, v, u)
                        flip(net, v, u)
                        count += 1
                        for w in (v, u, right, left):
                            changed[w] = turn
                            for k in range(net.degree[w]):
                                changed[net.ring[w, k]] = turn
        if count == before:
            break
    return count
