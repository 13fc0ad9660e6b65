"""The local surface of the scan: moving least squares on the points of one sheet.

Nodes are kept on it while they move. Each node caches one quadric patch, a row of `patches`:

    0:3 centre   3:6 unit normal (oriented)   6:9 tangent u (v = normal x u)   9:15 coefficients of 1 u v uu uv vv
    15 sample nearest to the centre   16 fitted (1) or not (0)   17 mean distance of the points from the patch
    18 spread of the points, 1 in a disc, 0 on a line   19:31 the fold, see `folds`
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...runtime.jit import kernel
from ..geometry.quadric import AWAY, COLUMNS, WEIGHT, fit_heights, project, second_moments
from ..geometry.vectors import Vector, across, along, cross, dot, norm, row, smallest_eigenvector, subtract

PATCH = 31  # columns of a patch row
HEIGHTS = 9  # first of its coefficients


class Surface(NamedTuple):
    """The scan at the scale of a member: samples, their links and points."""

    points: np.ndarray  #: (N, 3) the points, grouped by sample
    start: np.ndarray  #: (S + 1,) points of sample s are start[s]:start[s + 1]
    mean: np.ndarray  #: (S, 3) mean of the points of each sample
    normals: np.ndarray  #: (S, 3) oriented unit normals
    neighbors: np.ndarray  #: (S, K) nearest samples on the same sheet, -1 at the end
    length: float  #: desired member length [scan unit]
    radius: float  #: thinning radius: no two samples are nearer [scan unit]
    patch_radius: float  #: [scan unit]
    patch_points: float  #: most points of a sample that a patch is fitted to
    step: float  #: from sample to sample [scan unit]
    stamp: np.ndarray  #: (S,) int64 scratch of `flood`
    queue: np.ndarray  #: (S,) int64 scratch of `flood`
    counter: np.ndarray  #: (1,) int64 number of the last flood
    field: (
        np.ndarray
    )  #: (S,) desired member length at each sample, in units of `length`: ones where there is one length


@kernel
def walk(surface: Surface, sample: int, place: Vector) -> int:
    """Sample nearest to a place, reached by going downhill over the links: never leaves the sheet."""
    return descend(surface, sample, place, place, math.inf)


@kernel
def descend(surface: Surface, sample: int, target: Vector, place: Vector, reach: float) -> int:
    """Sample reached over links by steps that each come nearer to a target, to samples within `reach` of a place only."""
    best = _square(row(surface.mean, sample), target)
    while True:  # each step leads to a nearer sample, so to none twice
        to = -1
        for k in range(surface.neighbors.shape[1]):
            n = surface.neighbors[sample, k]
            if n < 0:
                break
            at = row(surface.mean, n)
            square = _square(at, target)
            if square < best and _square(at, place) <= reach * reach:
                best, to = square, n
        if to < 0:
            return sample
        sample = to


@kernel
def _square(a: Vector, b: Vector) -> float:
    """Squared distance of two places."""
    d = subtract(a, b)
    return dot(d, d)


@kernel
def flood(surface: Surface, sample: int, place: Vector, reach: float) -> int:
    """Samples within `reach` of a place that are linked to `sample` within that reach, into surface.queue; returns their number."""
    surface.counter[0] += 1
    mark = surface.counter[0]
    surface.queue[0] = sample
    surface.stamp[sample] = mark
    count, at = 1, 0
    while at < count:
        s = surface.queue[at]
        at += 1
        for k in range(surface.neighbors.shape[1]):
            n = surface.neighbors[s, k]
            if n < 0:
                break
            if surface.stamp[n] != mark:
                surface.stamp[n] = mark
                d = subtract(row(surface.mean, n), place)
                if dot(d, d) <= reach * reach:
                    surface.queue[count] = n
                    count += 1
    return count


@kernel
def linked(surface: Surface, a: int, b: int, place: Vector, reach: float) -> bool:
    """Whether sample b can be reached from sample a over links within `reach` of a place."""
    target = row(surface.mean, b)
    if a == b:
        return True
    if _square(target, place) > reach * reach:
        return False
    if descend(surface, a, target, place, reach) == b:  # most that are linked are so
        return True
    count = flood(surface, a, place, reach)
    return surface.stamp[b] == surface.counter[0] and _queued(surface, b, count)


@kernel
def _queued(surface: Surface, sample: int, count: int) -> bool:
    """Whether a sample is among those the last flood found (it stamps the samples just outside too)."""
    found = False
    for i in range(count):
        found = found or surface.queue[i] == sample
    return found


@kernel
def gather_points(
    surface: Surface,
    count: int,
    place: Vector,
    radius: float,
    most: int,
    facing: Vector,
    least: float,
    buffer: np.ndarray,
) -> int:
    """Points around a place, relative to it, with their weights, into the buffer of a fit; returns their number.

    Taken are the points of the first `count` samples in surface.queue whose normal has a cosine over `least` to `facing`, of each at most
    about `most`. They weigh (1 - d^2 / R^2)^2.
    """
    taken = 0
    for i in range(count):
        s = surface.queue[i]
        if dot(row(surface.normals, s), facing) > least:
            first, last = surface.start[s], surface.start[s + 1]
            step = 1 + (last - first - 1) // most
            for p in range(first, last, step):
                d = subtract(row(surface.points, p), place)
                w = 1.0 - dot(d, d) / (radius * radius)
                if w > 0.0 and taken < len(buffer):
                    buffer[taken, 0], buffer[taken, 1], buffer[taken, 2] = d
                    buffer[taken, WEIGHT] = w * w
                    taken += 1
    return taken


@kernel
def fit_patch(surface: Surface, patch: np.ndarray, sample: int, place: Vector) -> int:
    """Fit the quadric of a patch (one row) to the points around a place, on the sheet of `sample`; returns the points used.

    Points weigh (1 - d^2 / R^2)^2; where some lie far off the first fit (plants, noise) they are weighed down and it is fitted again.
    """
    sample = walk(surface, sample, place)
    facing = row(surface.normals, sample)
    local = surface.field[
        sample
    ]  # a patch is as wide as the members there; the wider, the fewer points of a sample suffice
    radius, most = surface.patch_radius * local, max(int(surface.patch_points / (local * local)), 1)
    patch[15] = sample
    taken, widest = 0, max(1.6 * surface.patch_radius, surface.length) * local
    while True:  # the radius grows by a quarter until it is the widest
        count = flood(surface, sample, place, radius + 0.5 * surface.step)
        if count < 1:
            count = 1
        buffer = np.empty((_points_at_most(surface, count, most), COLUMNS))
        taken = gather_points(surface, count, place, radius, most, facing, 0.0, buffer)
        if taken >= 12 or not 0.0 < radius < widest:
            break
        radius *= 1.26
    _plane_of(buffer, taken, facing, patch)
    project(buffer, taken, radius, (patch[3], patch[4], patch[5]), (patch[6], patch[7], patch[8]))
    matrix = np.empty((6, 7))
    size = fit_heights(buffer, taken, radius, 6 if taken >= 10 else (3 if taken >= 4 else 1), patch, HEIGHTS, matrix)
    mean = 0.0
    for i in range(taken):
        mean += abs(buffer[i, AWAY])
    mean = mean / max(taken, 1)
    if mean > 0.002 * surface.length * local and taken > 12:
        for i in range(taken):
            r = buffer[i, AWAY] / (2.0 * mean)
            buffer[i, WEIGHT] /= (1.0 + r * r) * (1.0 + r * r)
        fit_heights(buffer, taken, radius, size, patch, HEIGHTS, matrix)
    patch[0], patch[1], patch[2] = place
    patch[16], patch[17] = 1.0, mean
    return taken


@kernel
def _points_at_most(surface: Surface, count: int, most: int) -> int:
    """Points of the first `count` samples in surface.queue, of each about `most` at most."""
    points = 0
    for i in range(count):
        s = surface.queue[i]
        points += min(surface.start[s + 1] - surface.start[s], most)
    return points


@kernel
def _plane_of(buffer: np.ndarray, taken: int, facing: Vector, patch: np.ndarray) -> None:
    """Normal and tangent of the weighted least-squares plane, turned to face as the sample does."""
    normal = facing
    patch[18] = 0.0
    if taken >= 4:
        xx, xy, xz, yy, yz, zz = second_moments(buffer, taken)
        normal = smallest_eigenvector(xx, xy, xz, yy, yz, zz)
        trace = xx + yy + zz
        if trace > 0.0:
            minors = xx * yy + xx * zz + yy * zz - xy * xy - xz * xz - yz * yz
            patch[18] = 4.0 * minors / (trace * trace)
        side = dot(normal, facing)
        if side < 0.0:
            normal = (-normal[0], -normal[1], -normal[2])
        if abs(side) < 0.5:
            normal = facing
    patch[3], patch[4], patch[5] = normal
    patch[6], patch[7], patch[8] = across(normal)


@kernel
def height(patch: np.ndarray, a: float, b: float) -> float:
    """Height of a patch over its plane at (a, b) [scan unit]."""
    return patch[9] + a * (patch[10] + a * patch[12] + b * patch[13]) + b * (patch[11] + b * patch[14])


@kernel
def onto_patch(patch: np.ndarray, place: Vector) -> Vector:
    """Foot of a place on a patch, nearly at right angles to it."""
    centre = (patch[0], patch[1], patch[2])
    normal = (patch[3], patch[4], patch[5])
    u = (patch[6], patch[7], patch[8])
    v = cross(normal, u)
    d = subtract(place, centre)
    x, y, h = dot(d, u), dot(d, v), dot(d, normal)
    a, b = x, y
    for _ in range(2):  # of the foot on the tangent plane
        slope_a = patch[10] + 2.0 * a * patch[12] + b * patch[13]
        slope_b = patch[11] + 2.0 * b * patch[14] + a * patch[13]
        over = h - height(patch, a, b) - slope_a * (x - a) - slope_b * (y - b)
        t = over / (1.0 + slope_a * slope_a + slope_b * slope_b)
        a, b = x + t * slope_a, y + t * slope_b
    return along(along(along(centre, a, u), b, v), height(patch, a, b), normal)


@kernel
def patch_normal(patch: np.ndarray, place: Vector) -> Vector:
    """Unit normal of a patch over a place."""
    normal = (patch[3], patch[4], patch[5])
    u = (patch[6], patch[7], patch[8])
    v = cross(normal, u)
    d = subtract(place, (patch[0], patch[1], patch[2]))
    a, b = dot(d, u), dot(d, v)
    slope_a = patch[10] + 2.0 * a * patch[12] + b * patch[13]
    slope_b = patch[11] + 2.0 * b * patch[14] + a * patch[13]
    n = along(along(normal, -slope_a, u), -slope_b, v)
    length = norm(n)
    return n[0] / length, n[1] / length, n[2] / length


@kernel
def onto_surface(surface: Surface, patches: np.ndarray, node: int, x: float, y: float, z: float) -> Vector:
    """Foot of a place on the scanned surface by the patch of a node; fitted anew when the place has left the middle of it."""
    patch = patches[node]
    place = (x, y, z)
    d = subtract(place, (patch[0], patch[1], patch[2]))
    reach = 0.25 * surface.length
    if patch[16] == 0.0 or dot(d, d) > reach * reach:
        fit_patch(surface, patch, int(patch[15]), place)
    return onto_patch(patch, place)
