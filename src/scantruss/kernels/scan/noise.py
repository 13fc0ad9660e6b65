"""Noise taken off a scan: each point goes to the local surface of the points around it, along the normal."""

from __future__ import annotations

import numpy as np

from ...runtime.jit import kernel
from ..geometry.kd_tree import STACK_LEVELS, KDTree
from ..geometry.quadric import COLUMNS
from ..geometry.vectors import along, dot, row, subtract, unit
from ..surface.patches import PATCH, fit, foot, gather

ROOM = 600  # most points around a place
RADIUS_RATIO = 1.3  # from one radius to the next narrower one
PATCH_FITS = 2  # fits of a patch, the second with the points that lie off the first weighed down


@kernel
def fit_patches(
    tree: KDTree,
    centres: np.ndarray,
    radii: np.ndarray,
    widest: float,
    usual: np.ndarray,
    patches: np.ndarray,
    begin: int,
    end: int,
) -> None:
    """Fit patches at some points (C,), from `begin` to `end` - 1: of several radii the widest that fits as well as is usual there.

    Parameters
    ----------
    centres : (C,) int64 places in the tree
    radii : (C,) of the narrowest
    widest : radius of the widest in these
    usual : (C,) rms distance of the points from a patch that fits
    patches : (C, PATCH), filled; column 13 with how flat the distances of the points from it are distributed, see `_flatness`
    """
    stack, found = np.empty(2 * STACK_LEVELS, np.int64), np.empty(ROOM, np.int64)
    buffer, matrix, patch = np.zeros((ROOM, COLUMNS)), np.zeros((6, 7)), np.zeros(PATCH)
    for i in range(begin, end):
        place = row(tree.points, centres[i])
        taken = gather(tree, place, widest * radii[i], -1, stack, found, buffer)
        share = widest
        while taken == ROOM and share > 1.0:
            share = max(share / RADIUS_RATIO, 1.0)
            taken = gather(tree, place, share * radii[i], -1, stack, found, buffer)
        while True:  # the share falls to one
            fit(buffer, taken, share * radii[i], PATCH_FITS, patch, matrix)
            if patch[12] <= usual[i] or share <= 1.0:
                break
            share = max(share / RADIUS_RATIO, 1.0)
        patch[13] = _flatness(buffer, taken, patch[15])
        for c in range(PATCH):
            patches[i, c] = patch[c]


@kernel
def _flatness(buffer: np.ndarray, taken: int, radius: float) -> float:
    """Fourth moment of the distances from a patch over the square of the second: 3 for noise, 1 for points at two distances."""
    total = second = fourth = 0.0
    for i in range(taken):
        w = max(1.0 - buffer[i, 3] / (radius * radius), 0.0)
        square = buffer[i, 5] * buffer[i, 5]
        total, second, fourth = total + w, second + w * square, fourth + w * square * square
    return fourth * total / (second * second) if second > 0.0 else 3.0


@kernel
def onto_patches(
    tree: KDTree,
    number: np.ndarray,
    patches: np.ndarray,
    neighbors: np.ndarray,
    moved: np.ndarray,
    normals: np.ndarray,
    begin: int,
    end: int,
) -> None:
    """Foot of each point on the patches around it: their mean, in which those count most that are near, fit well and hold the point.

    number : (N,) int64 patch of each point that is a centre, else -1. moved, normals (N, 3), filled.
    """
    patch = np.empty(PATCH)
    for p in range(begin, end):
        place = row(tree.points, p)
        total, shift, facing = 0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        for k in range(-1, neighbors.shape[1]):
            n = p if k < 0 else neighbors[p, k]
            if n < 0 or number[n] < 0:
                continue
            for c in range(PATCH):
                patch[c] = patches[number[n], c]
            d = subtract(place, row(tree.points, n))
            at, normal = foot(patch, d)
            e = subtract(at, d)
            thick = max(patch[12], 1e-9 * patch[15])
            near = max(1.0 - dot(d, d) / (patch[15] * patch[15]), 1e-3)
            off = 1.0 + dot(e, e) / (9.0 * thick * thick)
            weight = near * near / (thick * thick * thick * thick * off * off)
            total += weight
            shift = along(shift, weight, e)
            facing = along(facing, weight if dot(normal, facing) >= 0.0 else -weight, normal)
        normal = unit(facing)
        for c in range(3):
            moved[p, c] = place[c] + shift[c] / total if total > 0.0 else place[c]
            normals[p, c] = normal[c]
