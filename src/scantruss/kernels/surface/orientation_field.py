"""Orientation field and position field: smooth directions with 6-fold symmetry, and a triangular lattice along them.

Both are stored at samples and smoothed from coarse levels to fine ones: each sample turns its direction to the mean of its
neighbours' (up to sixths of a turn), then moves its lattice to the mean of theirs (up to steps of the lattice). After Jakob, Tarini,
Panozzo, Sorkine-Hornung: Instant Field-Aligned Meshes (2015), 6-fold, extrinsic.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...runtime.jit import kernel
from ..geometry.vectors import Vector, across, along, cross, dot, norm, row, subtract, unit

SINE_OF_60 = 0.5 * math.sqrt(3.0)  # sine of 60 degrees, the height of a regular triangle [sides]
# added to the squared sine between two planes, so that the point between parallel ones is half way
PARALLEL_PLANES = 1e-4
SEEN_AROUND = 1.2  # way over the links within which nodes are compared, beyond their least distance [member lengths]


class Level(NamedTuple):
    """The samples of one level of the hierarchy, and the direction and lattice at each."""

    mean: np.ndarray  #: (P, 3)
    normals: np.ndarray  #: (P, 3)
    neighbors: np.ndarray  #: (P, K) int64 linked samples, -1 at the end
    direction: np.ndarray  #: (P, 3) unit vector along one of the six directions of the lattice
    node: np.ndarray  #: (P, 3) the lattice node nearest to the sample
    mark: np.ndarray  #: (P,) int64 scratch


@kernel
def choose_level(mean: np.ndarray, neighbors: np.ndarray, radius: float, owner: np.ndarray, chosen: np.ndarray) -> int:
    """Choose the samples of a coarser level so that each finer one has one of them within `radius` over the links; returns how many.

    owner : (S,) int64, -1 at the start, filled with the coarser sample of each finer one
    chosen : (S,) int64, filled with the finer sample at which each coarser one lies
    """
    queue, seen_from = np.empty(len(mean), np.int64), np.full(len(mean), -1, np.int64)
    count = 0
    for s in range(len(mean)):
        if owner[s] >= 0:
            continue
        chosen[count] = s
        owner[s] = count
        queue[0] = s
        seen_from[s] = s
        last, at = 1, 0
        while at < last:
            here = queue[at]
            at += 1
            for k in range(neighbors.shape[1]):
                n = neighbors[here, k]
                if n < 0:
                    break
                if seen_from[n] != s:
                    seen_from[n] = s
                    d = subtract(row(mean, n), row(mean, s))
                    if dot(d, d) < radius * radius:
                        queue[last] = n
                        last += 1
                        if owner[n] < 0:
                            owner[n] = count
        count += 1
    return count


@kernel
def link_level(mean: np.ndarray, normals: np.ndarray, neighbors: np.ndarray, owner: np.ndarray, level: Level) -> None:
    """Fill in the means, normals and links of a level, all empty at the start: samples are linked if any of their finer ones are."""
    for s in range(len(mean)):
        p = owner[s]
        level.mark[p] += 1
        for c in range(3):
            level.mean[p, c] += mean[s, c]
            level.normals[p, c] += normals[s, c]
        for k in range(neighbors.shape[1]):
            n = neighbors[s, k]
            if n < 0:
                break
            q = owner[n]
            if q == p:
                continue
            i = 0
            while i < level.neighbors.shape[1] and level.neighbors[p, i] >= 0 and level.neighbors[p, i] != q:
                i += 1
            if i < level.neighbors.shape[1]:
                level.neighbors[p, i] = q
    for p in range(len(level.mean)):
        normal = unit(row(level.normals, p))
        for c in range(3):
            level.mean[p, c] /= max(level.mark[p], 1)
            level.normals[p, c] = normal[c]


@kernel
def links_away(neighbors: np.ndarray, start: int, away: np.ndarray, queue: np.ndarray) -> int:
    """Fill in how many links away from `start` each sample is (P,), -1 where none lead there; returns the last one reached.

    queue : (P,) int64 scratch
    """
    away[:] = -1
    queue[0], away[start] = start, 0
    last, at = 1, 0
    while at < last:
        here = queue[at]
        at += 1
        for k in range(neighbors.shape[1]):
            n = neighbors[here, k]
            if n < 0:
                break
            if away[n] < 0:
                away[n] = away[here] + 1
                queue[last] = n
                last += 1
    return queue[last - 1]


@kernel
def sixth(direction: Vector, normal: Vector) -> Vector:
    """A direction turned by 60 degrees about a normal."""
    a = cross(normal, direction)
    return (
        0.5 * direction[0] + SINE_OF_60 * a[0],
        0.5 * direction[1] + SINE_OF_60 * a[1],
        0.5 * direction[2] + SINE_OF_60 * a[2],
    )


@kernel
def flat(direction: Vector, normal: Vector) -> Vector:
    """A direction projected onto the plane at right angles to a normal, as a unit vector."""
    d = along(direction, -dot(direction, normal), normal)
    size = norm(d)
    if size < 1e-9:
        return across(normal)
    return d[0] / size, d[1] / size, d[2] / size


@kernel
def nearest_turn(direction: Vector, other: Vector, normal: Vector) -> Vector:
    """The one of the six directions of a sample that is nearest to another direction."""
    turned = sixth(direction, normal)
    third = subtract(turned, direction)
    best = direction
    most = dot(direction, other)
    size = abs(most)
    if abs(dot(turned, other)) > size:
        best, most = turned, dot(turned, other)
        size = abs(most)
    if abs(dot(third, other)) > size:
        best, most = third, dot(third, other)
    if most < 0.0:
        return -best[0], -best[1], -best[2]
    return best


@kernel
def smooth_directions(level: Level, some: np.ndarray) -> None:
    """Turn the directions of some samples (K,) to the mean of those of their neighbours."""
    for i in range(len(some)):
        p = some[i]
        normal = row(level.normals, p)
        total = row(level.direction, p)
        weight = 0.0
        for k in range(level.neighbors.shape[1]):
            q = level.neighbors[p, k]
            if q < 0:
                break
            other = row(level.normals, q)
            # the two turns, one of each sample, that agree best
            b = row(level.direction, q)
            a = nearest_turn(total, b, normal)
            most, left, right = dot(a, b), a, b
            for _turn in range(2):
                b = sixth(b, other)
                a = nearest_turn(total, b, normal)
                if dot(a, b) > most:
                    most, left, right = dot(a, b), a, b
            total = flat(
                (weight * left[0] + right[0], weight * left[1] + right[1], weight * left[2] + right[2]), normal
            )
            weight += 1.0
        for c in range(3):
            level.direction[p, c] = total[c]


@kernel
def lower_corner(node: Vector, u: Vector, v: Vector, place: Vector, length: float) -> Vector:
    """The lower corner of the cell in which a place lies, of the lattice through a node with steps along u and v."""
    d = subtract(place, node)
    du, dv = dot(d, u), dot(d, v)
    i = math.floor((4.0 * du - 2.0 * dv) / (3.0 * length))
    j = math.floor((4.0 * dv - 2.0 * du) / (3.0 * length))
    return along(along(node, i * length, u), j * length, v)


@kernel
def nearest_node(node: Vector, direction: Vector, normal: Vector, place: Vector, length: float) -> Vector:
    """The node nearest to a place, of the lattice through a node with a direction."""
    u = direction
    v = sixth(u, normal)
    low = lower_corner(node, u, v, place, length)
    best, least = low, 1e300
    for i in range(4):
        at = along(along(low, length * (i & 1), u), length * (i >> 1), v)
        d = subtract(at, place)
        if dot(d, d) < least:
            best, least = at, dot(d, d)
    return best


@kernel
def between(p: Vector, n: Vector, q: Vector, m: Vector) -> Vector:
    """A point between two samples, on the line where their planes meet (half way where they are parallel)."""
    np_, nq, mp, mq, nm = dot(n, p), dot(n, q), dot(m, p), dot(m, q), dot(n, m)
    share = 1.0 / (1.0 - nm * nm + PARALLEL_PLANES)
    s = 2.0 * (nq - np_ - nm * (mp - mq)) * share
    t = 2.0 * (mp - mq - nm * (nq - np_)) * share
    return (
        0.5 * (p[0] + q[0]) - 0.25 * (n[0] * s + m[0] * t),
        0.5 * (p[1] + q[1]) - 0.25 * (n[1] * s + m[1] * t),
        0.5 * (p[2] + q[2]) - 0.25 * (n[2] * s + m[2] * t),
    )


@kernel
def agree(level: Level, p: int, q: int, node: Vector, length: float) -> tuple[Vector, Vector]:
    """Between two samples, the two nodes of their lattices that lie nearest to each other; `node` is one of the lattice of p."""
    n, m = row(level.normals, p), row(level.normals, q)
    middle = between(row(level.mean, p), n, row(level.mean, q), m)
    u, x = row(level.direction, p), row(level.direction, q)
    v, y = sixth(u, n), sixth(x, m)
    here = lower_corner(node, u, v, middle, length)
    there = lower_corner(row(level.node, q), x, y, middle, length)
    left, right, least = here, there, 1e300
    for i in range(4):
        a = along(along(here, length * (i & 1), u), length * (i >> 1), v)
        for j in range(4):
            b = along(along(there, length * (j & 1), x), length * (j >> 1), y)
            d = subtract(a, b)
            if dot(d, d) < least:
                left, right, least = a, b, dot(d, d)
    return left, right


@kernel
def smooth_lattice(level: Level, length: float, some: np.ndarray) -> None:
    """Move the lattices of some samples (K,) to the mean of those of their neighbours."""
    for i in range(len(some)):
        p = some[i]
        mean, normal = row(level.mean, p), row(level.normals, p)
        total = row(level.node, p)
        weight = 0.0
        for k in range(level.neighbors.shape[1]):
            q = level.neighbors[p, k]
            if q < 0:
                break
            a, b = agree(level, p, q, total, length)
            share = 1.0 / (weight + 1.0)
            total = (
                (weight * a[0] + b[0]) * share,
                (weight * a[1] + b[1]) * share,
                (weight * a[2] + b[2]) * share,
            )
            total = along(total, -dot(subtract(total, mean), normal), normal)
            weight += 1.0
        total = nearest_node(total, row(level.direction, p), normal, mean, length)
        for c in range(3):
            level.node[p, c] = total[c]


@kernel
def lay_first(level: Level, first: int, direction: Vector, node: Vector, length: float, queue: np.ndarray) -> None:
    """Set the direction and the lattice of one sample and carry them from sample to sample over the links.

    queue : (P,) int64 scratch
    """
    for p in range(len(level.mean)):
        level.mark[p] = 0
    begin, unmarked = first, 0
    for _ in range(len(level.mean)):
        way = flat(direction, row(level.normals, begin))
        put_lattice(level, begin, way, node, length)
        level.mark[begin] = 1
        queue[0] = begin
        last, at = 1, 0
        while at < last:
            p = queue[at]
            at += 1
            for k in range(level.neighbors.shape[1]):
                q = level.neighbors[p, k]
                if q < 0:
                    break
                if level.mark[q] == 0:
                    level.mark[q] = 1
                    put_lattice(level, q, row(level.direction, p), row(level.node, p), length)
                    queue[last] = q
                    last += 1
        begin = -1
        for p in range(unmarked, len(level.mean)):  # those before are marked, and stay so
            if level.mark[p] == 0:
                begin = unmarked = p
                break
        if begin < 0:
            return
        other = level.neighbors[begin, 0]
        node = row(level.mean, begin)
        direction = subtract(row(level.mean, max(other, 0)), node)


@kernel
def put_lattice(level: Level, p: int, direction: Vector, node: Vector, length: float) -> None:
    """Give a sample a direction and a lattice with a node at a place, or straight above it."""
    mean, normal = row(level.mean, p), row(level.normals, p)
    direction = flat(direction, normal)
    node = along(node, -dot(subtract(node, mean), normal), normal)
    node = nearest_node(node, direction, normal, mean, length)
    for c in range(3):
        level.direction[p, c] = direction[c]
        level.node[p, c] = node[c]


@kernel
def hand_down(coarse: Level, owner: np.ndarray, fine: Level, length: float) -> None:
    """Give the samples of a finer level the directions and lattices of their coarser ones."""
    for p in range(len(fine.mean)):
        q = owner[p]
        put_lattice(fine, p, row(coarse.direction, q), row(coarse.node, q), length)


@kernel
def list_nodes(level: Level, order: np.ndarray, length: float, apart: float, chosen: np.ndarray) -> int:
    """Choose samples whose nodes become candidate nodes, none nearer than `apart` to another on the sheet; returns how many.

    order : (K,) int64 the samples in the order in which they are considered
    chosen : (P,) int64, filled
    """
    is_chosen, seen_from = np.zeros(len(chosen), np.bool_), np.full(len(chosen), -1, np.int64)
    queue = np.empty(len(chosen), np.int64)
    count = 0
    reach = SEEN_AROUND * length + apart
    for o in range(len(order)):
        p = order[o]
        place = row(level.node, p)
        queue[0] = p
        seen_from[p] = p
        last, at = 1, 0
        free = True
        while at < last and free:
            here = queue[at]
            at += 1
            if is_chosen[here]:
                d = subtract(row(level.node, here), place)
                free = dot(d, d) >= apart * apart
            for k in range(level.neighbors.shape[1]):
                q = level.neighbors[here, k]
                if q < 0:
                    break
                if seen_from[q] != p:
                    seen_from[q] = p
                    d = subtract(row(level.mean, q), place)
                    if dot(d, d) < reach * reach:
                        queue[last] = q
                        last += 1
        if free:
            is_chosen[p] = True
            chosen[count] = p
            count += 1
    return count
