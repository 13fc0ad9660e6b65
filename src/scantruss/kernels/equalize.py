"""Equalizing: nodes move on the scanned surface until the energy of members and triangles is least.

The energy is E = weight * sum (L / l_0 - 1)^2 over the members + sum (1 - G) over the triangles, G negative where a triangle is
turned over. Its first part is springs, its second is Laplace: for a fixed opposite side, G grows towards the middle.
"""

from __future__ import annotations

import math

import numpy as np

from .compile import kernel
from .grid import INTERIOR, REST, RIM, Net
from .rim import Rim, slide
from .surface import Surface, fit_patch, onto_patch, walk
from .vectors import norm, row, subtract

ROOT = 4.0 * math.sqrt(3.0)
STRIDE = 1.4  # steps longer than to the least energy of a node alone: nodes move together


@kernel
def star_energy(net: Net, patches: np.ndarray, v: int, x: float, y: float, z: float, length: float, weight: float, slope: np.ndarray) -> float:
    """Energy of the members and triangles at node v if it stood at (x, y, z); `slope` (3,) gets its gradient.

    A triangle counts as turned over where it faces against the others of the node, as seen along the normal of its patch.
    """
    nodes = net.nodes
    gx = gy = gz = energy = 0.0  # of the members
    sx = sy = sz = shape = 0.0  # of the triangles
    nx, ny, nz = patches[v, 3], patches[v, 4], patches[v, 5]
    d = net.degree[v]
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
            stretch = size / length - 1.0
            energy += weight * stretch * stretch
            f = 2.0 * weight * stretch / (length * size)
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
        f = 0.5 * ROOT / (doubled * squares)
        if ux * nx + uy * ny + uz * nz < 0.0:
            f = -f
        g = f * doubled * doubled
        shape += g
        h = 2.0 * g / squares
        # the doubled area falls along e x u / |u|, the squares grow along -2 (b + c)
        sx += h * (bx + cx) - f * (ey * uz - ez * uy)
        sy += h * (by + cy) - f * (ez * ux - ex * uz)
        sz += h * (bz + cz) - f * (ex * uy - ey * ux)
    side = 1.0 if shape >= 0.0 else -1.0
    slope[0], slope[1], slope[2] = gx - side * sx, gy - side * sy, gz - side * sz
    return energy - side * shape


@kernel
def settle_node(net: Net, surface: Surface, patches: np.ndarray, rim: Rim, v: int, length: float, weight: float, reach: float, still: float, slope: np.ndarray) -> float:
    """Move node v downhill by one step on the surface or along its curve; returns by how much its energy fell.

    Steps shorter than `still` are not made.
    The local surface is fitted anew where the node has left the middle of its patch by more than `reach` [scan unit].
    """
    kind = net.kind[v]
    if kind >= REST or net.degree[v] == 0:
        return 0.0
    x, y, z = net.nodes[v, 0], net.nodes[v, 1], net.nodes[v, 2]
    before = star_energy(net, patches, v, x, y, z, length, weight, slope)
    gx, gy, gz = slope[0], slope[1], slope[2]
    if kind == INTERIOR:
        nx, ny, nz = patches[v, 3], patches[v, 4], patches[v, 5]
        across = gx * nx + gy * ny + gz * nz
        gx, gy, gz = gx - across * nx, gy - across * ny, gz - across * nz
    step = STRIDE * length * length / (net.degree[v] * (weight + 1.3))
    most = 0.3 * length
    size = step * math.sqrt(gx * gx + gy * gy + gz * gz)
    if size < still:
        return 0.0
    if size > most:
        step *= most / size
    arc = net.arc[v]
    for _ in range(2):
        place = (x - step * gx, y - step * gy, z - step * gz)
        if kind == RIM:
            arc, px, py, pz = slide(rim, net.curve[v], net.arc[v], most, place[0], place[1], place[2])
        else:
            if norm(subtract(place, row(patches, v))) > reach:
                fit_patch(surface, patches[v], int(patches[v, 15]), place)
            px, py, pz = onto_patch(patches[v], place)
        after = star_energy(net, patches, v, px, py, pz, length, weight, slope)
        if after < before:
            net.nodes[v, 0], net.nodes[v, 1], net.nodes[v, 2] = px, py, pz
            net.arc[v] = arc
            return before - after
        step *= 0.3
    return 0.0


@kernel
def settle_all(net: Net, surface: Surface, patches: np.ndarray, rim: Rim, length: float, weight: float, reach: float, enough: float, sweeps: int) -> int:
    """Settle all nodes again and again until a sweep gains less than `enough` a node; returns the sweeps made."""
    used = net.count[1]
    slope = np.empty(3)
    awake = np.ones(used, np.int64)  # nodes that have moved, or whose neighbours have, since they were last looked at
    for sweep in range(sweeps):
        gain = 0.0
        for v in range(used):
            if awake[v] == 1:
                awake[v] = 0
                gained = settle_node(net, surface, patches, rim, v, length, weight, reach, 1e-4 * length, slope)
                gain += gained
                if gained > 0.1 * enough:
                    awake[v] = 1
                    for i in range(net.degree[v]):
                        awake[net.ring[v, i]] = 1
        if gain < enough * used:
            return sweep + 1
    return sweeps


@kernel
def nearest_site(surface: Surface, x: float, y: float, z: float) -> int:
    """Site of the scan nearest to a place, by trying all."""
    best, site = np.inf, 0
    for s in range(len(surface.mean)):
        dx, dy, dz = surface.mean[s, 0] - x, surface.mean[s, 1] - y, surface.mean[s, 2] - z
        square = dx * dx + dy * dy + dz * dz
        if square < best:
            best, site = square, s
    return site


@kernel
def seat_nodes(net: Net, surface: Surface, patches: np.ndarray, length: float) -> None:
    """Fit the local surface of every node; from node to node over the members, so that each stays on its sheet of the scan."""
    used = net.count[1]
    queue = np.empty(used, np.int64)
    seated = np.zeros(used, np.int64)
    for seed in range(used):
        if seated[seed] == 1 or net.degree[seed] == 0:
            continue
        queue[0], count, at = seed, 1, 0
        seated[seed] = 1
        patches[seed, 15] = nearest_site(surface, net.nodes[seed, 0], net.nodes[seed, 1], net.nodes[seed, 2])
        while at < count:
            v = queue[at]
            at += 1
            place = row(net.nodes, v)
            site = walk(surface, int(patches[v, 15]), place)
            if norm(subtract(row(surface.mean, site), place)) > 0.5 * length:
                site = nearest_site(surface, place[0], place[1], place[2])
            patches[v, 15] = site
            fit_patch(surface, patches[v], site, place)
            for i in range(net.degree[v]):
                u = net.ring[v, i]
                if seated[u] == 0:
                    seated[u] = 1
                    patches[u, 15] = site
                    queue[count] = u
                    count += 1


@kernel
def measure_deviation(net: Net, surface: Surface, patches: np.ndarray, near: float, deviation: np.ndarray) -> None:
    """Distance of each node from the scanned surface, fitted around it anew unless its patch is centred within `near`."""
    for v in range(net.count[1]):
        if net.degree[v] > 0:
            place = row(net.nodes, v)
            if norm(subtract(place, row(patches, v))) > near:
                fit_patch(surface, patches[v], int(patches[v, 15]), place)
            deviation[v] = norm(subtract(place, onto_patch(patches[v], place)))
