"""Folds: how far a place lies from the planes of the surface around it, which is least on the crest of a fold.

The mean squared distance from the tangent planes of the samples around a node is a quadric (Garland and Heckbert 1997): where the surface
is level or bends gently it says nothing of places on it, across a fold it grows on both sides, and at a corner in all directions. It is
taken only where the normals differ enough, so that smooth surfaces keep their members.
"""

from __future__ import annotations

import numpy as np

from ...runtime.jit import kernel
from ..geometry.vectors import Vector, along, dot, norm, row, subtract
from .local_surface import Surface, flood

# columns 20 to 29 of a patch are the quadric: xx xy xz yy yz zz, its linear part, its constant
FOLD_WEIGHT = 30  # column of the weight: 0 where the surface is smooth, 1 on a sharp fold
DESIRED_LENGTH = 19  # column of the desired member length
PLANES_REACH = 0.75  # samples farther from the node do not count [member lengths]
# 1 - |mean normal|^2 at folds of 23 and 31 degrees; the term begins at one, is whole at the other
SMOOTH, SHARP = 0.04, 0.07
FAR_ENERGY = 0.5  # energy of a place far off the planes
STRENGTH = 15.0  # energy of a place one member length off the planes
CLING = 0.03  # of a node to the rounded surface when it goes to the crest of a fold
CHORD = 12.0  # energy of the middle of a member that lies one length off the surface
SAG = 0.06  # distance of that middle from a surface that bends gently [member lengths]
LONGEST_WAY_TO_CREST = 0.25  # way to a crest, at most [member lengths]
FACING_AWAY = -0.3  # samples that face farther away than this are another side's


@kernel
def add_fold(surface: Surface, patch: np.ndarray, members: float, strength: float) -> None:
    """Fill in the quadric of a patch from the samples within some member lengths of its middle; strength 1 is usual."""
    place = (patch[0], patch[1], patch[2])
    sample = int(patch[15])
    facing = row(surface.normals, sample)
    local = surface.length * surface.field[sample]
    patch[FOLD_WEIGHT], patch[DESIRED_LENGTH] = 0.0, local
    if strength == 0.0:
        return
    reach = members * local
    count = flood(surface, sample, place, reach)
    xx = xy = xz = yy = yz = zz = bx = by = bz = c = total = mx = my = mz = 0.0
    for i in range(count):
        s = surface.queue[i]
        normal = row(surface.normals, s)
        d = subtract(row(surface.mean, s), place)
        w = 1.0 - dot(d, d) / (reach * reach)
        if w <= 0.0 or dot(normal, facing) < FACING_AWAY:
            continue
        nx, ny, nz = normal
        h = w * dot(normal, d)
        xx, xy, xz = xx + w * nx * nx, xy + w * nx * ny, xz + w * nx * nz
        yy, yz, zz = yy + w * ny * ny, yz + w * ny * nz, zz + w * nz * nz
        bx, by, bz = bx + h * nx, by + h * ny, bz + h * nz
        c += h * dot(normal, d)
        mx, my, mz = mx + w * nx, my + w * ny, mz + w * nz
        total += w
    if total <= 0.0:
        return
    spread = 1.0 - (mx * mx + my * my + mz * mz) / (total * total)
    share = (spread - SMOOTH) / (SHARP - SMOOTH)
    if share <= 0.0:
        return
    patch[20], patch[21], patch[22], patch[23], patch[24], patch[25] = (
        xx / total, xy / total, xz / total, yy / total, yz / total, zz / total,
    )  # fmt: skip
    patch[26], patch[27], patch[28], patch[29] = bx / total, by / total, bz / total, c / total
    patch[FOLD_WEIGHT] = strength * min(share, 1.0)


@kernel
def onto_crest(surface: Surface, patch: np.ndarray, place: Vector) -> Vector:
    """Place on the crest of a fold or in its corner near a place on the rounded surface; the same place where there is no fold.

    The least of the quadric with CLING times the squared distance moved; the way is at most LONGEST_WAY_TO_CREST.
    """
    local = surface.length * surface.field[int(patch[15])]
    x, y, z = subtract(place, (patch[0], patch[1], patch[2]))
    share = patch[FOLD_WEIGHT]
    if share <= 0.0:
        return place
    a, b, c, d, e, f = patch[20] + CLING, patch[21], patch[22], patch[23] + CLING, patch[24], patch[25] + CLING
    p = patch[26] - (patch[20] * x + patch[21] * y + patch[22] * z)
    q = patch[27] - (patch[21] * x + patch[23] * y + patch[24] * z)
    r = patch[28] - (patch[22] * x + patch[24] * y + patch[25] * z)
    xx, xy, xz = d * f - e * e, c * e - b * f, b * e - c * d
    det = a * xx + b * xy + c * xz
    step = (
        share * (xx * p + xy * q + xz * r) / det,
        share * (xy * p + (a * f - c * c) * q + (b * c - a * e) * r) / det,
        share * (xz * p + (b * c - a * e) * q + (a * d - b * b) * r) / det,
    )
    size = norm(step)
    if size > LONGEST_WAY_TO_CREST * local:
        return place
    return along(place, 1.0, step)


@kernel
def fold_energy(patches: np.ndarray, v: int, x: float, y: float, z: float) -> float:
    """Energy of a place off the planes around node v, at most FAR_ENERGY; nothing where the surface is smooth."""
    if patches[v, FOLD_WEIGHT] == 0.0:
        return 0.0
    k = STRENGTH * patches[v, FOLD_WEIGHT] / patches[v, DESIRED_LENGTH] ** 2
    x, y, z = x - patches[v, 0], y - patches[v, 1], z - patches[v, 2]
    gx = patches[v, 20] * x + patches[v, 21] * y + patches[v, 22] * z - 2.0 * patches[v, 26]
    gy = patches[v, 21] * x + patches[v, 23] * y + patches[v, 24] * z - 2.0 * patches[v, 27]
    gz = patches[v, 22] * x + patches[v, 24] * y + patches[v, 25] * z - 2.0 * patches[v, 28]
    q = k * (gx * x + gy * y + gz * z + patches[v, 29])
    return q * FAR_ENERGY / (q + FAR_ENERGY) if q > 0.0 else 0.0


@kernel
def fold_slope(patches: np.ndarray, v: int, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Gradient of `fold_energy`."""
    if patches[v, FOLD_WEIGHT] == 0.0:
        return 0.0, 0.0, 0.0
    k = 2.0 * STRENGTH * patches[v, FOLD_WEIGHT] / patches[v, DESIRED_LENGTH] ** 2
    f = 1.0 - fold_energy(patches, v, x, y, z) / FAR_ENERGY
    k *= f * f
    x, y, z = x - patches[v, 0], y - patches[v, 1], z - patches[v, 2]
    return (
        k * (patches[v, 20] * x + patches[v, 21] * y + patches[v, 22] * z - patches[v, 26]),
        k * (patches[v, 21] * x + patches[v, 23] * y + patches[v, 24] * z - patches[v, 27]),
        k * (patches[v, 22] * x + patches[v, 24] * y + patches[v, 25] * z - patches[v, 28]),
    )


@kernel
def chord_energy(patches: np.ndarray, v: int, w: int, x: float, y: float, z: float) -> float:
    """Energy of the middle of a member between nodes v and w: what it is off the surface beyond the sag of a gentle bend."""
    if patches[v, FOLD_WEIGHT] == 0.0 and patches[w, FOLD_WEIGHT] == 0.0:
        return 0.0
    first, second = _height(patches, v, x, y, z)[0], _height(patches, w, x, y, z)[0]
    q = (
        CHORD
        * max(patches[v, FOLD_WEIGHT], patches[w, FOLD_WEIGHT])
        * (
            0.5 * (first * first + second * second) / max(patches[v, DESIRED_LENGTH], patches[w, DESIRED_LENGTH]) ** 2
            - SAG * SAG
        )
    )
    return q * FAR_ENERGY / (q + FAR_ENERGY) if q > 0.0 else 0.0


@kernel
def chord_slope(patches: np.ndarray, v: int, w: int, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Gradient of `chord_energy`."""
    q = chord_energy(patches, v, w, x, y, z)
    if q == 0.0:
        return 0.0, 0.0, 0.0
    f = 1.0 - q / FAR_ENERGY
    k = (
        f
        * f
        * CHORD
        * max(patches[v, FOLD_WEIGHT], patches[w, FOLD_WEIGHT])
        / max(patches[v, DESIRED_LENGTH], patches[w, DESIRED_LENGTH]) ** 2
    )
    h, px, py, pz = _height(patches, v, x, y, z)
    g, qx, qy, qz = _height(patches, w, x, y, z)
    return k * (h * px + g * qx), k * (h * py + g * qy), k * (h * pz + g * qz)


@kernel
def _height(patches: np.ndarray, v: int, x: float, y: float, z: float) -> tuple[float, float, float, float]:
    """Height of a place over the patch of node v, and its gradient."""
    p = patches[v]
    x, y, z = x - p[0], y - p[1], z - p[2]
    nx, ny, nz, ux, uy, uz = p[3], p[4], p[5], p[6], p[7], p[8]
    vx, vy, vz = ny * uz - nz * uy, nz * ux - nx * uz, nx * uy - ny * ux
    a, b = x * ux + y * uy + z * uz, x * vx + y * vy + z * vz
    h = x * nx + y * ny + z * nz
    h -= p[9] + a * (p[10] + a * p[12] + b * p[13]) + b * (p[11] + b * p[14])
    s, t = p[10] + 2.0 * a * p[12] + b * p[13], p[11] + 2.0 * b * p[14] + a * p[13]
    f = 1.0 / (1.0 + s * s + t * t)  # near to the distance where the patch is steep
    return f**0.5 * h, f**0.5 * (nx - s * ux - t * vx), f**0.5 * (ny - s * uy - t * vy), f**0.5 * (nz - s * uz - t * vz)
