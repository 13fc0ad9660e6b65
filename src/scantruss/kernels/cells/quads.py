"""Quads are made even: their nodes move on the scan, downhill on an energy of lengths and right angles.

The energy is E = lengths * sum (L / l_0 - 1)^2 over the members + angles * sum cos^2 of the corners. A corner that is turned over
costs between 1 and 2. l_0 is the mean of the desired lengths at the two nodes of a member. Members on curves cost more where the
curve leaves them: `SAG_WEIGHT` times the square of its largest distance over l_0, beyond `SAG_FREE`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...runtime.jit import kernel
from ..boundary.curves import Curves, at_arc, is_open, slide
from ..geometry.vectors import Vector, cross, dot, row, subtract, vector_of
from ..surface.local_surface import onto_patch

STRAIGHT_COST = 4.0  # what a corner of 180 degrees costs beside the square of its cosine, by the eighth power of that
SAG_WEIGHT = 700.0  # of the square of what a curve is farther from its member than is free
SAG_FREE = 0.04  # distance of a curve from its member that costs nothing [members]
SAG_REACH = 2.5  # way along the curve within which its members end [members]
SAG_SAMPLES = 7  # places on the curve at which it is measured
SAG_STEP = 0.02  # way along the curve over which its change is found [members]
QUAD_REACH = 0.8  # distance from the centre of its patch beyond which a node is not moved [member lengths]
FREE_NODE, SLIDING_NODE, RESTING_NODE = 0, 1, 2  # a node moves on the scan, slides along a curve, or stays
OFF_CURVE = 0.1  # distance of a corner from a curve within which it is an end of it [members]
LONGEST_MOVE, SHORTEST_MOVE = 0.3, 1e-4  # of a node at once [members]
SHORTENED_STEP, STEPS_TRIED = 0.3, 3  # a step that does not gain is made shorter by this, and how often


class QuadNet(NamedTuple):
    """Quads, the quads at each node, and what their nodes move on."""

    nodes: np.ndarray  #: (V, 3) [scan unit]
    quads: np.ndarray  #: (Q, 4) int64, -1 where one is gone
    at: np.ndarray  #: (V, D) int64 quads at each node
    degree: np.ndarray  #: (V,) int64 how many they are
    held: np.ndarray  #: (V,) int64 FREE_NODE, SLIDING_NODE or RESTING_NODE
    curve: np.ndarray  #: (V,) int64
    arc: np.ndarray  #: (V,) [scan unit]
    patches: np.ndarray  #: (V,) SURFACE_PATCH
    curves: Curves
    desired: np.ndarray  #: (V,) member lengths [scan unit]
    stamp: np.ndarray  #: (V + Q,) int64 scratch
    clock: np.ndarray  #: (1,) int64


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
        return 1.0 + STRAIGHT_COST, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    inverse = 1.0 / math.sqrt(ee * ff)
    c = dot(e, f) * inverse
    side = 1.0 if dot(cross(e, f), normal) > 0.0 else -1.0
    c2 = c * c
    c6 = c2 * c2 * c2
    value = c2 + STRAIGHT_COST * c2 * c6
    if side < 0.0:
        value = 2.0 * (1.0 + STRAIGHT_COST) - value
    g, ce, cf = side * c * (2.0 + 8.0 * STRAIGHT_COST * c6), c / ee, c / ff
    by_e = (g * (f[0] * inverse - ce * e[0]), g * (f[1] * inverse - ce * e[1]), g * (f[2] * inverse - ce * e[2]))
    by_f = (g * (e[0] * inverse - cf * f[0]), g * (e[1] * inverse - cf * f[1]), g * (e[2] * inverse - cf * f[2]))
    return value, by_e, by_f


@kernel
def node_energy(
    net: QuadNet,
    quads: np.ndarray,
    share: np.ndarray,
    of: np.ndarray,
    v: int,
    place: Vector,
    lengths: float,
    angles: float,
) -> tuple[float, float, float, float]:
    """Energy of the members and corners that move with node v if it stood at a place, and its gradient.

    share : (Q, 4) weight of each side of a quad, 1/2 where another quad has it too
    of : quads at the node
    """
    nodes, desired, normal = net.nodes, net.desired, vector_of(net.patches[v].normal)
    energy = gx = gy = gz = 0.0
    for q in of:
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
def way_on_curve(net: QuadNet, on: int, from_arc: float, u: int, target: float) -> float:
    """Way along a curve from an arc length to another node; 0 where that is not near it on the same curve."""
    there, total, reach = net.arc[u], net.curves.total[on], SAG_REACH * target
    if net.held[u] == SLIDING_NODE and net.curve[u] != on:
        return 0.0
    if net.held[u] != SLIDING_NODE:  # a corner or an end, which is on several curves
        there, x, y, z = slide(net.curves, on, from_arc, reach, net.nodes[u, 0], net.nodes[u, 1], net.nodes[u, 2])
        off = subtract((x, y, z), row(net.nodes, u))
        if dot(off, off) > OFF_CURVE * OFF_CURVE * target * target:
            return 0.0
    way = there - from_arc
    if not is_open(net.curves, on):
        way -= total * math.floor(way / total + 0.5)
    return way if abs(way) < reach else 0.0


@kernel
def sag_of(curves: Curves, curve: int, arc: float, way: float, place: Vector, other: Vector, target: float) -> float:
    """How far a curve leaves a member between two places, at `arc` of the curve and at some way along it [members]."""
    side = subtract(other, place)
    square, farthest = max(dot(side, side), 1e-12 * target * target), 0.0
    for k in range(1, SAG_SAMPLES + 1):
        _, x, y, z = at_arc(curves, curve, arc + way * k / (SAG_SAMPLES + 1.0))
        d = subtract((x, y, z), place)
        t = min(max(dot(d, side) / square, 0.0), 1.0)
        d = (d[0] - t * side[0], d[1] - t * side[1], d[2] - t * side[2])
        farthest = max(farthest, dot(d, d))
    return math.sqrt(farthest) / target


@kernel
def sag_energy(sag: float) -> float:
    """What a member costs because its curve leaves it so far."""
    excess = max(sag - SAG_FREE, 0.0)
    return SAG_WEIGHT * excess * excess


@kernel
def sag_around(
    net: QuadNet, quads: np.ndarray, share: np.ndarray, of: np.ndarray, v: int, place: Vector, here: float
) -> tuple[float, float]:
    """What the members at a node cost because its curve leaves them, if it stood at a place, `here` on its curve.

    Also how far the node may slide before one costs more, as the curve cannot leave it by more than that [members]. Other
    parameters as in `node_energy`.
    """
    energy, most = 0.0, 0.0
    for q in of:
        k = 0
        for corner in range(4):
            if quads[q, corner] == v:
                k = corner
        for way in (1, 3):
            u = quads[q, (k + way) % 4]
            if net.held[u] != FREE_NODE:
                weight = share[q, k] if way == 1 else share[q, (k + 3) % 4]
                target = 0.5 * (net.desired[v] + net.desired[u])
                along_it = way_on_curve(net, net.curve[v], here, u, target)
                if along_it != 0.0:
                    sag = sag_of(net.curves, net.curve[v], here, along_it, place, row(net.nodes, u), target)
                    energy, most = energy + weight * sag_energy(sag), max(most, sag)
    return energy, SAG_FREE - most


@kernel
def sag_slope(net: QuadNet, quads: np.ndarray, share: np.ndarray, of: np.ndarray, v: int) -> Vector:
    """Gradient of `sag_around` where a node slides along its curve."""
    by = SAG_STEP * net.desired[v]
    back, x, y, z = at_arc(net.curves, net.curve[v], net.arc[v] - by)
    there, u, w, t = at_arc(net.curves, net.curve[v], net.arc[v] + by)
    slope = (
        sag_around(net, quads, share, of, v, (u, w, t), there)[0]
        - sag_around(net, quads, share, of, v, (x, y, z), back)[0]
    )
    run = subtract((u, w, t), (x, y, z))
    slope /= max(dot(run, run), by * by)
    return slope * run[0], slope * run[1], slope * run[2]


@kernel
def settle_quad_node(
    net: QuadNet,
    quads: np.ndarray,
    share: np.ndarray,
    of: np.ndarray,
    v: int,
    lengths: float,
    angles: float,
    stride: float,
) -> float:
    """Move a node downhill, on the scan or along its curve; returns by how much its energy fell."""
    place = row(net.nodes, v)
    before, gx, gy, gz = node_energy(net, quads, share, of, v, place, lengths, angles)
    spare, slides = 0.0, net.held[v] == SLIDING_NODE
    if slides:
        sagging, spare = sag_around(net, quads, share, of, v, place, net.arc[v])
        before += sagging
        if spare < SAG_STEP:
            x, y, z = sag_slope(net, quads, share, of, v)
            gx, gy, gz = gx + x, gy + y, gz + z
    else:
        normal = vector_of(net.patches[v].normal)
        over = gx * normal[0] + gy * normal[1] + gz * normal[2]
        gx, gy, gz = gx - over * normal[0], gy - over * normal[1], gz - over * normal[2]
    local = net.desired[v]
    step = stride * local * local / (len(of) * (2.0 * lengths * 0.5 + 4.0 * angles))
    size = step * math.sqrt(gx * gx + gy * gy + gz * gz)
    if size < SHORTEST_MOVE * local:
        return 0.0
    most = LONGEST_MOVE * local
    if size > most:
        step *= most / size
    for _ in range(STEPS_TRIED):
        to = (place[0] - step * gx, place[1] - step * gy, place[2] - step * gz)
        new = net.arc[v]
        if slides:
            new, x, y, z = slide(net.curves, net.curve[v], net.arc[v], most, to[0], to[1], to[2])
            to = (x, y, z)
        else:
            to = onto_patch(net.patches[v], to)
            d = subtract(to, vector_of(net.patches[v].centre))
            if dot(d, d) > QUAD_REACH * QUAD_REACH * local * local:
                step *= SHORTENED_STEP
                continue
        after = node_energy(net, quads, share, of, v, to, lengths, angles)[0]
        if slides and size > spare * local:
            after += sag_around(net, quads, share, of, v, to, new)[0]
        if after < before:
            net.nodes[v, 0], net.nodes[v, 1], net.nodes[v, 2] = to
            net.arc[v] = new
            return before - after
        step *= SHORTENED_STEP
    return 0.0


@kernel
def settle_quads(
    net: QuadNet,
    quads: np.ndarray,
    share: np.ndarray,
    of: np.ndarray,
    start: np.ndarray,
    some: np.ndarray,
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
            if net.held[some[k]] != RESTING_NODE:
                own = of[start[k] : start[k + 1]]
                gain += settle_quad_node(net, quads, share, own, some[k], lengths, angles, stride)
        if gain < enough * len(some):
            return sweep + 1
    return sweeps


@kernel
def energy_of_quads(
    net: QuadNet, quads: np.ndarray, share: np.ndarray, lengths: float, angles: float, out: np.ndarray
) -> float:
    """Fill in the energy of each quad (Q,), with its share of its sides; returns their sum."""
    nodes, held, total = net.nodes, net.held, 0.0
    for q in range(len(quads)):
        energy = 0.0
        for k in range(4):
            v, a, b = quads[q, k], quads[q, (k + 1) % 4], quads[q, (k + 3) % 4]
            place, target = row(nodes, v), 0.5 * (net.desired[v] + net.desired[a])
            s = side_energy(place, row(nodes, a), target)[0]
            energy += lengths * share[q, k] * s
            if held[v] != FREE_NODE and held[a] != FREE_NODE and (held[v] == SLIDING_NODE or held[a] == SLIDING_NODE):
                on, other = (v, a) if held[v] == SLIDING_NODE else (a, v)
                way = way_on_curve(net, net.curve[on], net.arc[on], other, target)
                if way != 0.0:
                    sag = sag_of(net.curves, net.curve[on], net.arc[on], way, row(nodes, on), row(nodes, other), target)
                    energy += share[q, k] * sag_energy(sag)
            e, f = subtract(row(nodes, a), place), subtract(row(nodes, b), place)
            energy += angles * corner_energy(e, f, vector_of(net.patches[v].normal))[0]
        out[q] = energy
        total += energy
    return total
