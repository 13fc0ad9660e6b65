"""Quads are made even: their nodes move on the scan, downhill on an energy of lengths and right angles.

The energy is E = lengths * sum (L / l_0 - 1)^2 over the members + angles * sum cos^2 of the corners. A corner that is turned over
costs between 1 and 2. l_0 is the mean of the desired lengths at the two nodes of a member.
"""

from __future__ import annotations

import math

import numpy as np

from ...runtime.jit import kernel
from ..boundary.curves import Curves, slide
from ..geometry.vectors import Vector, cross, dot, row, subtract, vector_in
from ..surface.local_surface import CENTRE, NORMAL, onto_patch

FLAT = 4.0  # what a corner of 180 degrees costs beside the square of its cosine, by the eighth power of that
QUAD_REACH = 0.8  # distance from the centre of its patch beyond which a node is not moved [member lengths]


@kernel
def side_energy(a: Vector, b: Vector, target: float) -> tuple[float, float, float, float]:
    """Square of the stretch of a member, and its gradient where its first node moves."""
    d = subtract(a, b)
    size = math.sqrt(dot(d, d))
    stretch = size / target - 1.0
    f = 2.0 * stretch / (target * max(size, 1e-12 * target))
    return stretch * stretch, f * d[0], f * d[1], f * d[2]


@kernel
def corner_energy(e: Vector, f: Vector, normal: Vector) -> tuple[float, Vector, Vector]:
    """Square of the cosine between two ways from a corner, 2 less that where it is turned over; and its gradients by the ways."""
    ee, ff = dot(e, e), dot(f, f)
    if ee <= 0.0 or ff <= 0.0:
        return 1.0 + FLAT, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    inverse = 1.0 / math.sqrt(ee * ff)
    c = dot(e, f) * inverse
    side = 1.0 if dot(cross(e, f), normal) > 0.0 else -1.0
    c2 = c * c
    c6 = c2 * c2 * c2
    value = c2 + FLAT * c2 * c6
    if side < 0.0:
        value = 2.0 * (1.0 + FLAT) - value
    g, ce, cf = side * c * (2.0 + 8.0 * FLAT * c6), c / ee, c / ff
    by_e = (g * (f[0] * inverse - ce * e[0]), g * (f[1] * inverse - ce * e[1]), g * (f[2] * inverse - ce * e[2]))
    by_f = (g * (e[0] * inverse - cf * f[0]), g * (e[1] * inverse - cf * f[1]), g * (e[2] * inverse - cf * f[2]))
    return value, by_e, by_f


@kernel
def node_energy(
    nodes: np.ndarray,
    quads: np.ndarray,
    share: np.ndarray,
    of: np.ndarray,
    begin: int,
    end: int,
    v: int,
    place: Vector,
    normal: Vector,
    desired: np.ndarray,
    lengths: float,
    angles: float,
) -> tuple[float, float, float, float]:
    """Energy of the members and corners that move with node v if it stood at a place, and its gradient.

    share : (Q, 4) weight of each side of a quad, 1/2 where another quad has it too
    of : quads at the node are of[begin:end]
    """
    energy = gx = gy = gz = 0.0
    for i in range(begin, end):
        q = of[i]
        k = 0
        for corner in range(4):
            if quads[q, corner] == v:
                k = corner
        ia, ic, ib = quads[q, (k + 1) % 4], quads[q, (k + 2) % 4], quads[q, (k + 3) % 4]
        a, b, c = row(nodes, ia), row(nodes, ib), row(nodes, ic)
        s, x, y, z = side_energy(place, a, 0.5 * (desired[v] + desired[ia]))
        w = lengths * share[q, k]
        energy, gx, gy, gz = energy + w * s, gx + w * x, gy + w * y, gz + w * z
        s, x, y, z = side_energy(place, b, 0.5 * (desired[v] + desired[ib]))
        w = lengths * share[q, (k + 3) % 4]
        energy, gx, gy, gz = energy + w * s, gx + w * x, gy + w * y, gz + w * z
        s, by_e, by_f = corner_energy(subtract(a, place), subtract(b, place), normal)
        t, _, at_a = corner_energy(subtract(c, a), subtract(place, a), normal)
        r, at_b, _ = corner_energy(subtract(place, b), subtract(c, b), normal)
        energy += angles * (s + t + r)
        gx += angles * (at_a[0] + at_b[0] - by_e[0] - by_f[0])
        gy += angles * (at_a[1] + at_b[1] - by_e[1] - by_f[1])
        gz += angles * (at_a[2] + at_b[2] - by_e[2] - by_f[2])
    return energy, gx, gy, gz


@kernel
def settle_quads(
    nodes: np.ndarray,
    quads: np.ndarray,
    share: np.ndarray,
    of: np.ndarray,
    start: np.ndarray,
    some: np.ndarray,
    held: np.ndarray,
    curve: np.ndarray,
    arc: np.ndarray,
    patches: np.ndarray,
    curves: Curves,
    desired: np.ndarray,
    lengths: float,
    angles: float,
    sweeps: int,
    stride: float,
    enough: float,
) -> int:
    """Move some nodes (K,) downhill in sweeps, until one gains less than `enough` a node; returns the sweeps made.

    of, start : quads at the node some[k] are of[start[k]:start[k + 1]]
    """
    for sweep in range(sweeps):
        gain = 0.0
        for k in range(len(some)):
            v = some[k]
            if held[v] == 2:
                continue
            place, normal = row(nodes, v), vector_in(patches, v, NORMAL)
            begin, end = start[k], start[k + 1]
            before, gx, gy, gz = node_energy(
                nodes, quads, share, of, begin, end, v, place, normal, desired, lengths, angles
            )
            if held[v] == 0:
                over = gx * normal[0] + gy * normal[1] + gz * normal[2]
                gx, gy, gz = gx - over * normal[0], gy - over * normal[1], gz - over * normal[2]
            local = desired[v]
            step = stride * local * local / ((end - begin) * (2.0 * lengths * 0.5 + 4.0 * angles))
            size = step * math.sqrt(gx * gx + gy * gy + gz * gz)
            if size < 1e-4 * local:
                continue
            most = 0.3 * local
            if size > most:
                step *= most / size
            for _ in range(3):
                to = (place[0] - step * gx, place[1] - step * gy, place[2] - step * gz)
                new = arc[v]
                if held[v] == 1:
                    new, x, y, z = slide(curves, curve[v], arc[v], most, to[0], to[1], to[2])
                    to = (x, y, z)
                else:
                    to = onto_patch(patches[v], to)
                    d = subtract(to, vector_in(patches, v, CENTRE))
                    if dot(d, d) > QUAD_REACH * QUAD_REACH * local * local:
                        step *= 0.3
                        continue
                after = node_energy(nodes, quads, share, of, begin, end, v, to, normal, desired, lengths, angles)[0]
                if after < before:
                    nodes[v, 0], nodes[v, 1], nodes[v, 2] = to
                    arc[v] = new
                    gain += before - after
                    break
                step *= 0.3
        if gain < enough * len(some):
            return sweep + 1
    return sweeps


@kernel
def energy_of_quads(
    nodes: np.ndarray,
    quads: np.ndarray,
    share: np.ndarray,
    patches: np.ndarray,
    desired: np.ndarray,
    lengths: float,
    angles: float,
    out: np.ndarray,
) -> float:
    """Fill in the energy of each quad (Q,), with its share of its sides; returns their sum."""
    total = 0.0
    for q in range(len(quads)):
        energy = 0.0
        for k in range(4):
            v, a, b = quads[q, k], quads[q, (k + 1) % 4], quads[q, (k + 3) % 4]
            place = row(nodes, v)
            s = side_energy(place, row(nodes, a), 0.5 * (desired[v] + desired[a]))[0]
            energy += lengths * share[q, k] * s
            e, f = subtract(row(nodes, a), place), subtract(row(nodes, b), place)
            energy += angles * corner_energy(e, f, vector_in(patches, v, NORMAL))[0]
        out[q] = energy
        total += energy
    return total


@kernel
def shares_of(quads: np.ndarray, at_boundary: np.ndarray, share: np.ndarray) -> None:
    """Fill in the weight of each side of some quads (Q, 4): 1 on the boundary, 1/2 where another quad has it too or may have."""
    count = 4 * len(quads)
    for i in range(count):
        q, k = i // 4, i % 4
        a, b = quads[q, k], quads[q, (k + 1) % 4]
        share[q, k] = 0.5
        if at_boundary[a] and at_boundary[b]:
            alone = True
            for j in range(count):
                p, m = j // 4, j % 4
                alone = alone and not (quads[p, m] == b and quads[p, (m + 1) % 4] == a)
            if alone:
                share[q, k] = 1.0


@kernel
def try_quads(
    nodes: np.ndarray,
    before: np.ndarray,
    after: np.ndarray,
    degree: np.ndarray,
    at_boundary: np.ndarray,
    held: np.ndarray,
    curve: np.ndarray,
    arc: np.ndarray,
    patches: np.ndarray,
    curves: Curves,
    desired: np.ndarray,
    lengths: float,
    angles: float,
    sweeps: int,
    stride: float,
    enough: float,
    join: int,
    joined: int,
) -> float:
    """Return by how much the energy of some quads grows that are put in the place of others, once their inner nodes have settled.

    Parameters
    ----------
    before, after : (Q, 4) the quads around a move, without it and with it
    degree : (V,) quads at each node after the move; nodes all of whose quads are among them settle
    join, joined : node that another was merged with, which starts between them; -1 for none
    """
    share, out = np.empty((len(before), 4)), np.empty(len(before))
    shares_of(before, at_boundary, share)
    old = energy_of_quads(nodes, before, share, patches, desired, lengths, angles, out)
    if join >= 0 and held[join] == 0:
        for k in range(3):
            nodes[join, k] = 0.5 * (nodes[join, k] + nodes[joined, k])
    count = len(after)
    share, out = np.empty((count, 4)), np.empty(count)
    shares_of(after, at_boundary, share)
    flat = after.copy().reshape(4 * count)
    order = np.argsort(flat, kind="mergesort")
    some, start, of = np.empty(4 * count, np.int64), np.zeros(4 * count + 1, np.int64), np.empty(4 * count, np.int64)
    found, taken, i = 0, 0, 0
    while i < 4 * count:  # each turn goes on to the next node
        v, j = flat[order[i]], i
        while j < 4 * count and flat[order[j]] == v:  # each turn goes on by a corner
            j += 1
        if j - i == degree[v] and held[v] < 2:
            for k in range(i, j):
                of[taken] = order[k] // 4
                taken += 1
            some[found] = v
            found += 1
            start[found] = taken
        i = j
    settle_quads(
        nodes, after, share, of[:taken], start[: found + 1], some[:found], held, curve, arc, patches, curves,
        desired, lengths, angles, sweeps, stride, enough,
    )  # fmt: skip
    return energy_of_quads(nodes, after, share, patches, desired, lengths, angles, out) - old
