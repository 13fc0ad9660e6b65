"""Trials: the nodes around an edge, saved as they were, and the energy that a trial changes."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...runtime.jit import kernel
from ..geometry.quadric import coefficients_of, height_at
from ..geometry.vectors import Vector, cross, dot, norm, row, subtract, vector_of
from ..surface.folds import chord_energy, fold_energy
from .equalize import FOUR_ROOT_3
from .grid import Net, target_length, wings

OFF_PATCH = 0.33  # distance of the middle of a triangle from the patches of its nodes at which it has left them [desired length]


class Scratch(NamedTuple):
    """The neighbourhood of one trial, as it was before, and what is known of the nodes."""

    held: np.ndarray  #: (C,) int64 number of the last trial with the node in its neighbourhood
    tried: np.ndarray  #: (C,) int64, 1 if nothing near the node has changed since its moves were tried
    out: np.ndarray  #: (C,) int64, 1 for a node that must not change
    around: np.ndarray  #: (C,) int64 nodes of the neighbourhood; the next five are theirs, as before the trial
    nodes: np.ndarray  #: (C, 3) positions
    arc: np.ndarray  #: (C,) arc lengths
    ring: np.ndarray  #: (C, W) int64 rings
    degree: np.ndarray  #: (C,) int64 numbers of neighbours
    line: np.ndarray  #: (C,) int64 members along lines
    trial: np.ndarray  #: (1,) int64 number of the trial
    gathered: np.ndarray  #: (1,) int64 number of nodes of the neighbourhood
    paid: np.ndarray  #: (1,) int64 how many trials were kept


@kernel
def gather(net: Net, scratch: Scratch, a: int, b: int) -> None:
    """Save the neighbourhood of the edge a-b: the nodes of its quadrangle and all their neighbours."""
    scratch.trial[0] += 1
    stamp = scratch.trial[0]
    right, left = wings(net, a, b)
    count = 0
    for v in (a, b, right, left):
        if v >= 0 and scratch.held[v] != stamp:
            scratch.held[v] = stamp
            scratch.around[count] = v
            count += 1
    for i in range(count):
        v = scratch.around[i]
        for j in range(net.degree[v]):
            u = net.ring[v, j]
            if scratch.held[u] != stamp:
                scratch.held[u] = stamp
                scratch.around[count] = u
                count += 1
    for i in range(count):
        v = scratch.around[i]
        scratch.nodes[i, 0], scratch.nodes[i, 1], scratch.nodes[i, 2] = (
            net.nodes[v, 0],
            net.nodes[v, 1],
            net.nodes[v, 2],
        )
        scratch.arc[i] = net.arc[v]
        scratch.degree[i], scratch.line[i] = net.degree[v], net.line[v]
        for j in range(net.degree[v]):
            scratch.ring[i, j] = net.ring[v, j]
    scratch.gathered[0] = count


@kernel
def may_change(net: Net, scratch: Scratch, a: int, b: int) -> bool:
    """Whether all nodes that a trial at the edge a-b may change are within bounds."""
    right, left = wings(net, a, b)
    for v in (a, b, right, left):
        if v >= 0:
            if scratch.out[v] == 1:
                return False
            for i in range(net.degree[v]):
                if scratch.out[net.ring[v, i]] == 1:
                    return False
    return True


@kernel
def put_back(net: Net, scratch: Scratch) -> None:
    """Undo a trial: restore its neighbourhood."""
    for i in range(scratch.gathered[0]):
        v = scratch.around[i]
        for c in range(3):
            net.nodes[v, c] = scratch.nodes[i, c]
        net.arc[v] = scratch.arc[i]
        net.degree[v], net.line[v] = scratch.degree[i], scratch.line[i]
        for j in range(scratch.degree[i]):
            net.ring[v, j] = scratch.ring[i, j]


@kernel
def folds_outwards(net: Net, scratch: Scratch, v: int, a: int, b: int, normal: Vector) -> bool:
    """Whether triangle (v, a, b) with a normal is folded over the member a-b, whose ends are not in the neighbourhood of v."""
    beyond = wings(net, a, b)[0]
    if beyond < 0 or (beyond < v and scratch.held[beyond] == scratch.trial[0]):
        return False  # on the boundary, or counted from the other side
    p = row(net.nodes, a)
    other = cross(subtract(row(net.nodes, beyond), p), subtract(row(net.nodes, b), p))
    return dot(normal, other) < 0.0


@kernel
def local_energy(net: Net, patches: np.ndarray, scratch: Scratch, length: float, weight: float) -> float:
    """Energy of all members and triangles with a node in the neighbourhood, each counted once, and 1 for each folded member.

    A member is folded if its two triangles meet at less than 90 degrees. Members of which only a triangle is in the neighbourhood count
    too, or two trials side by side could lower the energy in turn for ever.
    """
    nodes, held, stamp = net.nodes, scratch.held, scratch.trial[0]
    energy = 0.0
    for k in range(scratch.gathered[0]):
        v = scratch.around[k]
        d = net.degree[v]
        if d == 0:
            continue
        energy += fold_energy(patches, v, nodes[v, 0], nodes[v, 1], nodes[v, 2])
        closed = net.is_open[v] == 0
        w = net.ring[v, d - 2 if closed else d - 1]
        cx, cy, cz = nodes[w, 0] - nodes[v, 0], nodes[w, 1] - nodes[v, 1], nodes[w, 2] - nodes[v, 2]
        cc = cx * cx + cy * cy + cz * cz
        inside = held[w] == stamp
        ux = uy = uz = 0.0
        for at in range(-1 if closed else 0, d):
            bx, by, bz, bb, before, was_inside = cx, cy, cz, cc, w, inside
            tx, ty, tz = ux, uy, uz  # the triangle before
            w = net.ring[v, at if at >= 0 else d - 1]
            inside = held[w] == stamp
            skipped, counted = was_inside and before < v, inside and w < v
            cx, cy, cz = nodes[w, 0] - nodes[v, 0], nodes[w, 1] - nodes[v, 1], nodes[w, 2] - nodes[v, 2]
            cc = cx * cx + cy * cy + cz * cz
            if at >= 0 and not counted:
                stretch = math.sqrt(cc) / target_length(net, v, w, length) - 1.0
                energy += weight * stretch * stretch
                if patches[v].fold_weight > 0.0 or patches[w].fold_weight > 0.0:
                    hx, hy, hz = nodes[v, 0] + 0.5 * cx, nodes[v, 1] + 0.5 * cy, nodes[v, 2] + 0.5 * cz
                    energy += chord_energy(patches, v, w, hx, hy, hz)
            if at == 0 and not closed:
                continue
            ux, uy, uz = by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx
            if not skipped and tx * ux + ty * uy + tz * uz < 0.0:
                energy += 1.0
            if skipped or counted or at < 0:
                continue
            ex, ey, ez = cx - bx, cy - by, cz - bz
            squares = bb + cc + ex * ex + ey * ey + ez * ez
            energy += 1.0
            if squares > 0.0:
                energy -= 0.5 * FOUR_ROOT_3 * math.sqrt(ux * ux + uy * uy + uz * uz) / squares
            if not inside and not was_inside and folds_outwards(net, scratch, v, before, w, (ux, uy, uz)):
                energy += 1.0
    return energy


@kernel
def total_energy(
    net: Net, patches: np.ndarray, scratch: Scratch, length: float, weight: float
) -> tuple[float, float, int]:
    """Energy of the whole grid, mean length of its members (as if `length` were desired everywhere), and its number of nodes."""
    scratch.trial[0] += 1
    count = members = 0
    total = 0.0
    for v in range(net.in_use[0]):
        if net.degree[v] > 0:
            scratch.held[v] = scratch.trial[0]
            scratch.around[count] = v
            count += 1
            for i in range(net.degree[v]):
                u = net.ring[v, i]
                if v < u:
                    members += 1
                    target = 0.5 * (net.desired[v] + net.desired[u])
                    total += norm(subtract(row(net.nodes, u), row(net.nodes, v))) / target
    scratch.gathered[0] = count
    return local_energy(net, patches, scratch, length, weight), total / max(members, 1), count


@kernel
def off_patch(patches: np.ndarray, v: int, place: Vector) -> float:
    """Distance of a place from the patch of a node, along the normal of its plane."""
    patch = patches[v]
    d = subtract(place, vector_of(patch.centre))
    normal, u = vector_of(patch.normal), vector_of(patch.tangent)
    heights = coefficients_of(patch.heights)
    return abs(dot(d, normal) - height_at(heights, dot(d, u), dot(d, cross(normal, u))))


@kernel
def triangles_across(net: Net, patches: np.ndarray, scratch: Scratch, length: float) -> int:
    """Number of triangles at the edge of a trial and its wings that have left the patches of their nodes: those across a limb."""
    found = 0
    for k in range(min(4, scratch.gathered[0])):
        v = scratch.around[k]
        d = net.degree[v]
        for i in range(d - 1 if net.is_open[v] == 1 else d):
            a, b = net.ring[v, i], net.ring[v, (i + 1) % d]
            p, q, r = row(net.nodes, v), row(net.nodes, a), row(net.nodes, b)
            middle = ((p[0] + q[0] + r[0]) / 3.0, (p[1] + q[1] + r[1]) / 3.0, (p[2] + q[2] + r[2]) / 3.0)
            away = min(off_patch(patches, v, middle), off_patch(patches, a, middle), off_patch(patches, b, middle))
            found += away > OFF_PATCH * length * net.desired[v]
    return found
