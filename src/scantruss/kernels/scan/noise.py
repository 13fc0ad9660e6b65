"""Noise removed from a scan: each point moves along the normal to the local surface of the points around it."""

from __future__ import annotations

import numpy as np

from ...runtime.jit import kernel
from ..geometry.kd_tree import STACK_LEVELS, KDTree
from ..geometry.quadric import FIT_POINT
from ..geometry.vectors import along, dot, row, subtract, unit
from ..surface.patches import Patches, fit, foot, gather_around

MOST_AROUND = 600  # most points around a place
RADIUS_RATIO = 1.3  # from one radius to the next narrower one
NOISE_PATCH_FITS = 2  # fits of a patch, the second with less weight for points off the first
LEAST_THICKNESS = 1e-9  # of a patch whose points lie exactly on it [radii]
LEAST_NEARNESS = 1e-3  # weight of a patch at the edge of which a point lies
OFF_PATCH_SQUARE = 9.0  # squared distance from a patch at which it weighs a quarter [thicknesses]


@kernel
def fit_patches(
    tree: KDTree,
    centres: np.ndarray,
    radii: np.ndarray,
    widest: float,
    usual: np.ndarray,
    patches: Patches,
    flatness: np.ndarray,
    begin: int,
    end: int,
) -> None:
    """Fit patches at some points (C,), from `begin` to `end` - 1, with the widest of several radii that fits as well as is usual there.

    Parameters
    ----------
    centres : (C,) int64 places in the tree
    radii : (C,) of the narrowest
    widest : radius of the widest in these
    usual : (C,) rms distance of the points from a patch that fits
    patches : filled
    flatness : (C,), filled with the kurtosis of the distances of the points from each patch, see `_flatness`
    """
    stack, found = np.empty(2 * STACK_LEVELS, np.int64), np.empty(MOST_AROUND, np.int64)
    buffer, matrix = np.zeros(MOST_AROUND, FIT_POINT), np.zeros((6, 7))
    for i in range(begin, end):
        place = row(tree.points, centres[i])
        taken = gather_around(tree, place, widest * radii[i], -1, stack, found, buffer)
        share = widest
        while taken == MOST_AROUND and share > 1.0:  # the share falls to one
            share = max(share / RADIUS_RATIO, 1.0)
            taken = gather_around(tree, place, share * radii[i], -1, stack, found, buffer)
        while True:  # the share falls to one
            fit(buffer, taken, share * radii[i], NOISE_PATCH_FITS, patches, i, matrix)
            if patches.rms[i] <= usual[i] or share <= 1.0:
                break
            share = max(share / RADIUS_RATIO, 1.0)
        flatness[i] = _flatness(buffer, taken, patches.radius[i])


@kernel
def _flatness(buffer: np.ndarray, taken: int, radius: float) -> float:
    """Kurtosis of the distances from a patch, fourth moment over squared variance: 3 for noise, 1 for points at two distances."""
    total = second = fourth = 0.0
    for i in range(taken):
        w = max(1.0 - buffer[i].square / (radius * radius), 0.0)
        square = buffer[i].residual * buffer[i].residual
        total, second, fourth = total + w, second + w * square, fourth + w * square * square
    return fourth * total / (second * second) if second > 0.0 else 3.0


@kernel
def onto_patches(
    tree: KDTree,
    number: np.ndarray,
    patches: Patches,
    neighbors: np.ndarray,
    moved: np.ndarray,
    normals: np.ndarray,
    begin: int,
    end: int,
) -> None:
    """Projection of each point onto the patches around it: a mean weighted towards those that are near, fit well and hold the point.

    number : (N,) int64 patch of each point that is a centre, else -1. moved, normals (N, 3), filled.
    """
    for p in range(begin, end):
        place = row(tree.points, p)
        total, shift, facing = 0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        for k in range(-1, neighbors.shape[1]):
            n = p if k < 0 else neighbors[p, k]
            if n < 0 or number[n] < 0:
                continue
            d = subtract(place, row(tree.points, n))
            at, normal = foot(patches, number[n], d)
            e = subtract(at, d)
            radius = patches.radius[number[n]]
            thick = max(patches.rms[number[n]], LEAST_THICKNESS * radius)
            near = max(1.0 - dot(d, d) / (radius * radius), LEAST_NEARNESS)
            off = 1.0 + dot(e, e) / (OFF_PATCH_SQUARE * thick * thick)
            weight = near * near / (thick * thick * thick * thick * off * off)
            total += weight
            shift = along(shift, weight, e)
            facing = along(facing, weight if dot(normal, facing) >= 0.0 else -weight, normal)
        normal = unit(facing)
        for c in range(3):
            moved[p, c] = place[c] + shift[c] / total if total > 0.0 else place[c]
            normals[p, c] = normal[c]
