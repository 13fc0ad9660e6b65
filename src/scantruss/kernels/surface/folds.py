"""Folds: how far a place lies from the planes of the surface around it, which is least on the crest of a fold.

The mean squared distance from the tangent planes of the samples around a node is a quadric (Garland and Heckbert 1997): where the surface
is level or bends gently it says nothing of places on it, across a fold it grows on both sides, and at a corner in all directions. It is
taken only where the normals differ enough, so that smooth surfaces keep their members.
"""

from __future__ import annotations

import numpy as np

from ...runtime.jit import kernel
from ..geometry.quadric import coefficients_of, height_at, slopes_at
from ..geometry.vectors import Vector, along, cross, dot, norm, put_vector, row, subtract, vector_of
from .local_surface import Surface, flood

PLANES_REACH = 0.75  # samples farther from the node do not count [member lengths]
# 1 - |mean normal|^2 at folds of 23 and 31 degrees; the term begins at one, is whole at the other
SMOOTH_SPREAD, SHARP_SPREAD = 0.04, 0.07
FAR_ENERGY = 0.5  # energy of a place far off the planes
PLANES_WEIGHT = 15.0  # energy of a place one member length off the planes
CLING_WEIGHT = 0.03  # of a node to the rounded surface when it goes to the crest of a fold
CHORD_WEIGHT = 12.0  # energy of the middle of a member that lies one length off the surface
GENTLE_SAG = 0.06  # distance of that middle from a surface that bends gently [member lengths]
LONGEST_WAY_TO_CREST = 0.25  # way to a crest, at most [member lengths]
FACING_AWAY = -0.3  # samples that face farther away than this are another side's


@kernel
def add_fold(surface: Surface, patch: np.record, members: float, strength: float) -> None:
    """Fill in the quadric of a patch from the samples within some member lengths of its middle; strength 1 is usual."""
    place = vector_of(patch.centre)
    sample = patch.sample
    facing = row(surface.normals, sample)
    local = surface.length * surface.field[sample]
    patch.fold_weight, patch.desired = 0.0, local
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
    share = (spread - SMOOTH_SPREAD) / (SHARP_SPREAD - SMOOTH_SPREAD)
    if share <= 0.0:
        return
    put_vector(patch.fold_squares[:3], (xx / total, xy / total, xz / total))
    put_vector(patch.fold_squares[3:], (yy / total, yz / total, zz / total))
    put_vector(patch.fold_linear, (bx / total, by / total, bz / total))
    patch.fold_constant = c / total
    patch.fold_weight = strength * min(share, 1.0)


@kernel
def onto_crest(surface: Surface, patch: np.record, place: Vector) -> Vector:
    """Place on the crest of a fold or in its corner near a place on the rounded surface; the same place where there is no fold.

    The least of the quadric with CLING_WEIGHT times the squared distance moved; the way is at most LONGEST_WAY_TO_CREST.
    """
    local = surface.length * surface.field[patch.sample]
    x, y, z = subtract(place, vector_of(patch.centre))
    share = patch.fold_weight
    if share <= 0.0:
        return place
    xx, xy, xz, yy, yz, zz = coefficients_of(patch.fold_squares)
    bx, by, bz = vector_of(patch.fold_linear)
    p, q, r = bx - (xx * x + xy * y + xz * z), by - (xy * x + yy * y + yz * z), bz - (xz * x + yz * y + zz * z)
    a, b, c, d, e, f = xx + CLING_WEIGHT, xy, xz, yy + CLING_WEIGHT, yz, zz + CLING_WEIGHT
    first, second, third = d * f - e * e, c * e - b * f, b * e - c * d  # row of the adjugate
    det = a * first + b * second + c * third
    step = (
        share * (first * p + second * q + third * r) / det,
        share * (second * p + (a * f - c * c) * q + (b * c - a * e) * r) / det,
        share * (third * p + (b * c - a * e) * q + (a * d - b * b) * r) / det,
    )
    size = norm(step)
    if size > LONGEST_WAY_TO_CREST * local:
        return place
    return along(place, 1.0, step)


@kernel
def fold_energy(patches: np.ndarray, v: int, x: float, y: float, z: float) -> float:
    """Energy of a place off the planes around node v, at most FAR_ENERGY; nothing where the surface is smooth."""
    if patches[v].fold_weight == 0.0:
        return 0.0
    k = PLANES_WEIGHT * patches[v].fold_weight / patches[v].desired ** 2
    x, y, z = subtract((x, y, z), vector_of(patches[v].centre))
    xx, xy, xz, yy, yz, zz = coefficients_of(patches[v].fold_squares)
    bx, by, bz = vector_of(patches[v].fold_linear)
    gx, gy, gz = (
        xx * x + xy * y + xz * z - 2.0 * bx,
        xy * x + yy * y + yz * z - 2.0 * by,
        xz * x + yz * y + zz * z - 2.0 * bz,
    )
    q = k * (gx * x + gy * y + gz * z + patches[v].fold_constant)
    return q * FAR_ENERGY / (q + FAR_ENERGY) if q > 0.0 else 0.0


@kernel
def fold_slope(patches: np.ndarray, v: int, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Gradient of `fold_energy`."""
    if patches[v].fold_weight == 0.0:
        return 0.0, 0.0, 0.0
    k = 2.0 * PLANES_WEIGHT * patches[v].fold_weight / patches[v].desired ** 2
    f = 1.0 - fold_energy(patches, v, x, y, z) / FAR_ENERGY
    k *= f * f
    x, y, z = subtract((x, y, z), vector_of(patches[v].centre))
    xx, xy, xz, yy, yz, zz = coefficients_of(patches[v].fold_squares)
    bx, by, bz = vector_of(patches[v].fold_linear)
    return (
        k * (xx * x + xy * y + xz * z - bx),
        k * (xy * x + yy * y + yz * z - by),
        k * (xz * x + yz * y + zz * z - bz),
    )


@kernel
def chord_energy(patches: np.ndarray, v: int, w: int, x: float, y: float, z: float) -> float:
    """Energy of the middle of a member between nodes v and w: what it is off the surface beyond the sag of a gentle bend."""
    if patches[v].fold_weight == 0.0 and patches[w].fold_weight == 0.0:
        return 0.0
    first, second = _height(patches, v, x, y, z)[0], _height(patches, w, x, y, z)[0]
    q = (
        CHORD_WEIGHT
        * max(patches[v].fold_weight, patches[w].fold_weight)
        * (
            0.5 * (first * first + second * second) / max(patches[v].desired, patches[w].desired) ** 2
            - GENTLE_SAG * GENTLE_SAG
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
        * CHORD_WEIGHT
        * max(patches[v].fold_weight, patches[w].fold_weight)
        / max(patches[v].desired, patches[w].desired) ** 2
    )
    h, px, py, pz = _height(patches, v, x, y, z)
    g, qx, qy, qz = _height(patches, w, x, y, z)
    return k * (h * px + g * qx), k * (h * py + g * qy), k * (h * pz + g * qz)


@kernel
def _height(patches: np.ndarray, v: int, x: float, y: float, z: float) -> tuple[float, float, float, float]:
    """Height of a place over the patch of node v, and its gradient."""
    d = subtract((x, y, z), vector_of(patches[v].centre))
    normal, along_u = vector_of(patches[v].normal), vector_of(patches[v].tangent)
    along_v, heights = cross(normal, along_u), coefficients_of(patches[v].heights)
    a, b = dot(d, along_u), dot(d, along_v)
    h = dot(d, normal) - height_at(heights, a, b)
    s, t = slopes_at(heights, a, b)
    f = (1.0 / (1.0 + s * s + t * t)) ** 0.5  # near to the distance where the patch is steep
    (nx, ny, nz), (ux, uy, uz), (vx, vy, vz) = normal, along_u, along_v
    return f * h, f * (nx - s * ux - t * vx), f * (ny - s * uy - t * vy), f * (nz - s * uz - t * vz)
