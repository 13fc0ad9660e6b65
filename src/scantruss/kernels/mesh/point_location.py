"""Point location: the sample, the patch and the place on a curve of each node of a net."""

from __future__ import annotations

import numpy as np

from ...runtime.jit import kernel
from ..boundary.curves import Curves, nearest_on_curves, slide
from ..geometry.vectors import Vector, along, cross, dot, norm, row, subtract, unit, vector_of
from ..surface.folds import PLANES_REACH, add_fold
from ..surface.local_surface import SURFACE_PATCH, Surface, fit_patch, onto_patch, walk
from ..surface.size_field import length_at
from .grid import AT_REST, INTERIOR, ON_CURVE, Net

FARTHEST_PATCH = 0.5  # distance of a new patch from its node above which it is of another sheet [member lengths]
FACES_BACK = -0.3  # cosine between the normals of a node and a sample below which that is of another sheet
SAME_CORNER = 1e-6  # distance from a corner within which a node stands on it [member lengths]


@kernel
def nearest_sample(surface: Surface, x: float, y: float, z: float) -> int:
    """Sample of the scan nearest to a place, by exhaustive search."""
    best, sample = np.inf, 0
    for s in range(len(surface.mean)):
        dx, dy, dz = surface.mean[s, 0] - x, surface.mean[s, 1] - y, surface.mean[s, 2] - z
        square = dx * dx + dy * dy + dz * dz
        if square < best:
            best, sample = square, s
    return sample


@kernel
def facing_sample(surface: Surface, place: Vector, facing: Vector, sample: int) -> int:
    """The given sample if it faces about the same side, else the nearest that does, as on the near side of a thin wall."""
    if dot(row(surface.normals, sample), facing) >= FACES_BACK:
        return sample
    best, found = np.inf, sample
    for s in range(len(surface.mean)):
        d = subtract(row(surface.mean, s), place)
        square = dot(d, d)
        if square < best and dot(row(surface.normals, s), facing) > 0.0:
            best, found = square, s
    return found if best < (FARTHEST_PATCH * surface.length) ** 2 else sample


@kernel
def facing_of_node(net: Net, v: int) -> Vector:
    """The direction (unit vector) in which the triangles of a node face, in the mean by their areas."""
    place, total, d = row(net.nodes, v), (0.0, 0.0, 0.0), net.degree[v]
    for i in range(d - net.is_open[v]):
        one, other = row(net.nodes, net.ring[v, i]), row(net.nodes, net.ring[v, (i + 1) % d])
        total = along(total, 1.0, cross(subtract(one, place), subtract(other, place)))
    return unit(total)


@kernel
def locate_nodes(
    net: Net, surface: Surface, patches: np.ndarray, length: float, queue: np.ndarray, located: np.ndarray
) -> None:
    """Find the sample nearest to each node, from node to node over the members, so that each stays on its sheet of the scan.

    `queue` and `located` (C,) int64 are scratch, zero at the start.
    """
    used = net.in_use[0]
    for seed in range(used):
        if located[seed] == 1 or net.degree[seed] == 0:
            continue
        queue[0], count, at = seed, 1, 0
        located[seed] = 1
        patches[seed].sample = nearest_sample(surface, net.nodes[seed, 0], net.nodes[seed, 1], net.nodes[seed, 2])
        while at < count:
            v = queue[at]
            at += 1
            place = row(net.nodes, v)
            sample = walk(surface, patches[v].sample, place)
            if norm(subtract(row(surface.mean, sample), place)) > 0.5 * length:
                sample = nearest_sample(surface, place[0], place[1], place[2])
            if net.line[v] == 0:
                sample = facing_sample(surface, place, facing_of_node(net, v), sample)
            patches[v].sample = sample
            for i in range(net.degree[v]):
                u = net.ring[v, i]
                if located[u] == 0:
                    located[u] = 1
                    patches[u].sample = sample
                    queue[count] = u
                    count += 1


@kernel
def locate_on_boundary(net: Net, curves: Curves, corners: np.ndarray, fixed: np.ndarray, length: float) -> None:
    """Find the place of each boundary node on the curves, along which all may slide except corners (K, 3) and fixed nodes."""
    for v in range(net.in_use[0]):
        if net.is_open[v] == 0 or net.kind[v] != AT_REST:
            continue
        place = row(net.nodes, v)
        curve, arc, distance = nearest_on_curves(curves, place[0], place[1], place[2])
        if curve < 0 or distance > 0.5 * length:
            continue
        net.curve[v], net.arc[v] = curve, arc
        free = not fixed[v] and net.line[v] == 0
        for k in range(len(corners)):
            free = free and norm(subtract(row(corners, k), place)) > SAME_CORNER * length
        if free:
            net.kind[v] = ON_CURVE


@kernel
def renew_patches(
    net: Net, surface: Surface, patches: np.ndarray, near: float, strength: float, begin: int, end: int
) -> int:
    """Fit new patches to the nodes from `begin` to `end` - 1 that are farther than `near` from the centres of theirs; returns how many.

    A new patch far from its node is of another sheet or follows too few points: the old one is kept.
    """
    count = 0
    before = np.empty(1, SURFACE_PATCH)
    for v in range(begin, end):
        if net.degree[v] > 0:
            place = row(net.nodes, v)
            if not patches[v].is_fitted or norm(subtract(place, vector_of(patches[v].centre))) > near * net.desired[v]:
                before[0] = patches[v]
                fit_patch(surface, patches[v], patches[v].sample, place)
                add_fold(surface, patches[v], PLANES_REACH, strength)
                local = surface.length * net.desired[v]
                if (
                    before[0].is_fitted
                    and norm(subtract(place, onto_patch(patches[v], place))) > FARTHEST_PATCH * local
                ):
                    patches[v] = before[0]
                count += 1
    return count


@kernel
def renew_lengths(net: Net, surface: Surface, patches: np.ndarray, begin: int, end: int) -> None:
    """Look up the desired member length at each node from `begin` to `end` - 1."""
    for v in range(begin, end):
        if net.degree[v] > 0:
            net.desired[v] = length_at(surface, patches[v].sample, row(net.nodes, v))


@kernel
def return_to_scan(net: Net, patches: np.ndarray, curves: Curves, reach: float) -> None:
    """Return each free node to its patch of the scanned surface, or to its curve within `reach` along it."""
    for v in range(net.in_use[0]):
        x, y, z = row(net.nodes, v)
        if net.degree[v] > 0 and net.kind[v] == INTERIOR:
            x, y, z = onto_patch(patches[v], (x, y, z))
        elif net.degree[v] > 0 and net.kind[v] == ON_CURVE:
            net.arc[v], x, y, z = slide(curves, net.curve[v], net.arc[v], reach * net.desired[v], x, y, z)
        net.nodes[v, 0], net.nodes[v, 1], net.nodes[v, 2] = x, y, z


@kernel
def distances_from_scan(net: Net, patches: np.ndarray, distance: np.ndarray) -> None:
    """Fill in the distance of each node from its patch of the scanned surface (C,)."""
    for v in range(net.in_use[0]):
        if net.degree[v] > 0:
            place = row(net.nodes, v)
            distance[v] = norm(subtract(place, onto_patch(patches[v], place)))
