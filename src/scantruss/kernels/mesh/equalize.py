"""Equalizing: nodes move on the scanned surface downhill on the energy of members and triangles.

The energy is E = weight * sum (L / l_0 - 1)^2 over the members + sum (1 - G) over the triangles. l_0 is the mean of the desired
lengths at the two nodes of a member; G is the shape quality (Eq. 5), negative for a triangle that is turned over. The first part acts
like springs, the second like Laplacian smoothing.
"""

from __future__ import annotations

import math

import numpy as np

from ...runtime.jit import kernel
from ..boundary.curves import Curves, slide
from ..geometry.vectors import dot, subtract, vector_of
from ..surface.folds import chord_energy, chord_slope, fold_energy, fold_slope
from ..surface.local_surface import onto_patch
from .grid import AT_REST, INTERIOR, ON_CURVE, Net

FOUR_ROOT_3 = 4.0 * math.sqrt(3.0)  # makes the shape quality of a regular triangle 1 (Eq. 5)
OVER_RELAXATION = 1.4  # over-relaxation: length of a step in that to the least energy of a node whose neighbours rest
PATCH_REACH = 0.8  # distance from the centre of its patch beyond which a node is not moved [member lengths]
SHORTEST_STEP = 1e-4  # shortest step that is made while nodes settle [member lengths]
TRIANGLE_STIFFNESS = 1.3  # of the triangles at a node, where that of its members is their weight
LONGEST_STEP = 0.3  # longest step of a node [member lengths]
NODE_STEPS, SHORTENED = 2, 0.3  # steps of a node that are tried, each shorter than the one before by this
WAKES_FROM = 0.1  # share of `enough` from which on the gain of a node wakes its neighbours


@kernel
def star_energy(
    net: Net, patches: np.ndarray, v: int, x: float, y: float, z: float, length: float, weight: float, slope: bool
) -> tuple[float, float, float, float]:
    """Energy of the members and triangles at node v if it stood at (x, y, z), and with `slope` its gradient, which takes time.

    A triangle counts as turned over if it faces against most triangles of the node, seen along the normal of its patch.
    """
    nodes = net.nodes
    gx = gy = gz = energy = 0.0  # of the members
    sx = sy = sz = shape = 0.0  # of the triangles
    nx, ny, nz = vector_of(patches[v].normal)
    d, half = net.degree[v], 0.5 * length
    own = half * net.desired[v]
    w = net.ring[v, d - 1]
    cx, cy, cz = nodes[w, 0] - x, nodes[w, 1] - y, nodes[w, 2] - z
    cc = cx * cx + cy * cy + cz * cz
    for i in range(d):
        bx, by, bz, bb = cx, cy, cz, cc  # to the neighbour before
        w = net.ring[v, i]
        cx, cy, cz = nodes[w, 0] - x, nodes[w, 1] - y, nodes[w, 2] - z
        cc = cx * cx + cy * cy + cz * cz
        size = math.sqrt(cc)
        if size > 0.0:
            target = own + half * net.desired[w]
            stretch = size / target - 1.0
            energy += weight * stretch * stretch
            if slope:
                f = 2.0 * weight * stretch / (target * size)
                gx, gy, gz = gx - f * cx, gy - f * cy, gz - f * cz
        if i == 0 and net.is_open[v] == 1:
            continue
        energy += 1.0
        ux, uy, uz = by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx  # twice the area, as a vector
        ex, ey, ez = cx - bx, cy - by, cz - bz
        squares = bb + cc + ex * ex + ey * ey + ez * ez
        doubled = math.sqrt(ux * ux + uy * uy + uz * uz)
        if squares <= 0.0 or doubled <= 1e-12 * squares:
            continue
        f = 0.5 * FOUR_ROOT_3 / (doubled * squares)
        if ux * nx + uy * ny + uz * nz < 0.0:
            f = -f
        g = f * doubled * doubled
        shape += g
        if slope:
            h = 2.0 * g / squares
            # the doubled area falls along e x u / |u|, the squares grow along -2 (b + c)
            sx += h * (bx + cx) - f * (ey * uz - ez * uy)
            sy += h * (by + cy) - f * (ez * ux - ex * uz)
            sz += h * (bz + cz) - f * (ex * uy - ey * ux)
    if patches[v].fold_weight > 0.0:
        energy += fold_energy(patches, v, x, y, z)
        if slope:
            fx, fy, fz = fold_slope(patches, v, x, y, z)
            gx, gy, gz = gx + fx, gy + fy, gz + fz
    for i in range(d):
        w = net.ring[v, i]
        if patches[v].fold_weight > 0.0 or patches[w].fold_weight > 0.0:
            hx, hy, hz = 0.5 * (x + nodes[w, 0]), 0.5 * (y + nodes[w, 1]), 0.5 * (z + nodes[w, 2])
            energy += chord_energy(patches, v, w, hx, hy, hz)
            if slope:
                fx, fy, fz = chord_slope(patches, v, w, hx, hy, hz)
                gx, gy, gz = gx + 0.5 * fx, gy + 0.5 * fy, gz + 0.5 * fz
    side = 1.0 if shape >= 0.0 else -1.0
    return energy - side * shape, gx - side * sx, gy - side * sy, gz - side * sz


@kernel
def settle_node(
    net: Net, patches: np.ndarray, curves: Curves, v: int, length: float, weight: float, still: float, stride: float
) -> float:
    """Move node v one step downhill, on the surface or along its curve; returns by how much its energy fell.

    still : shortest step that is made where `length` is desired [scan unit]. stride : over-relaxation
    """
    kind = net.kind[v]
    if kind >= AT_REST or net.degree[v] == 0:
        return 0.0
    x, y, z = net.nodes[v, 0], net.nodes[v, 1], net.nodes[v, 2]
    before, gx, gy, gz = star_energy(net, patches, v, x, y, z, length, weight, True)
    if kind == INTERIOR:
        nx, ny, nz = vector_of(patches[v].normal)
        across = gx * nx + gy * ny + gz * nz
        gx, gy, gz = gx - across * nx, gy - across * ny, gz - across * nz
    local = length * net.desired[v]
    step = stride * local * local / (net.degree[v] * (weight + TRIANGLE_STIFFNESS))
    most = LONGEST_STEP * local
    size = step * math.sqrt(gx * gx + gy * gy + gz * gz)
    if size < still * net.desired[v]:
        return 0.0
    if size > most:
        step *= most / size
    arc = net.arc[v]
    for _ in range(NODE_STEPS):
        place = (x - step * gx, y - step * gy, z - step * gz)
        if kind == ON_CURVE:
            arc, px, py, pz = slide(curves, net.curve[v], net.arc[v], most, place[0], place[1], place[2])
        else:
            px, py, pz = onto_patch(patches[v], place)
            d = subtract((px, py, pz), vector_of(patches[v].centre))
            if dot(d, d) > PATCH_REACH * PATCH_REACH * local * local:
                step *= SHORTENED
                continue
        after = star_energy(net, patches, v, px, py, pz, length, weight, False)[0]
        if after < before:
            net.nodes[v, 0], net.nodes[v, 1], net.nodes[v, 2] = px, py, pz
            net.arc[v] = arc
            return before - after
        step *= SHORTENED
    return 0.0


@kernel
def settle_some(
    net: Net,
    patches: np.ndarray,
    curves: Curves,
    awake: np.ndarray,
    some: np.ndarray,
    length: float,
    weight: float,
    enough: float,
    sweeps: int,
    stride: float,
) -> tuple[float, int]:
    """Settle some nodes (K,) in sweeps until one gains less than `enough` a node; returns the last gain and the sweeps made.

    awake : (C,) int64, 1 at the start; 1 for nodes that have moved, or a neighbour has, since they were last settled
    """
    gain = 0.0
    for sweep in range(sweeps):
        gain = 0.0
        for k in range(len(some)):
            v = some[k]
            if awake[v] == 1:
                awake[v] = 0
                gained = settle_node(net, patches, curves, v, length, weight, SHORTEST_STEP * length, stride)
                gain += gained
                if gained > WAKES_FROM * enough:
                    awake[v] = 1
                    for i in range(net.degree[v]):
                        awake[net.ring[v, i]] = 1
        if gain < enough * len(some):
            return gain, sweep + 1
    return gain, sweeps
