"""The local surface of the scan: moving least squares on the points of one sheet.

Nodes are kept on it while they move. Each node keeps the patch that was fitted last, a record of `patches`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...runtime.jit import kernel, record_type
from ..geometry.quadric import (
    FIT_POINT,
    TERMS_OF_PLANE,
    TERMS_OF_QUADRIC,
    coefficients_of,
    fit_heights,
    height_at,
    project,
    second_moments,
    slopes_at,
)
from ..geometry.vectors import (
    Vector,
    across,
    along,
    cross,
    dot,
    norm,
    put_vector,
    row,
    smallest_eigenvector,
    subtract,
    vector_of,
)

SURFACE_PATCH = record_type(  # a quadric over a plane, and what `kernels.surface.folds` knows of a fold there
    centre=(np.float64, 3),  # where it was fitted [scan unit]
    normal=(np.float64, 3),  # oriented unit normal of its plane
    tangent=(np.float64, 3),  # unit vector u in the plane; v = normal x u
    heights=(np.float64, 6),  # over the plane as coefficients of 1 u v u^2 uv v^2
    sample=np.int64,  # nearest to the centre
    is_fitted=np.bool_,
    mean_distance=np.float64,  # of the points from the patch [scan unit]
    roundness=np.float64,  # how the points spread in the plane: 1 in a disc, 0 on a line
    desired=np.float64,  # member length [scan unit]
    fold_squares=(np.float64, 6),  # quadric of the squared distance from the planes around: xx xy xz yy yz zz,
    fold_linear=(np.float64, 3),  # its linear part
    fold_constant=np.float64,  # and its constant
    fold_weight=np.float64,  # 0 where the surface is smooth, 1 on a sharp fold
)
# how a patch is fitted: it widens until so many points are within it, or it is so wide
ENOUGH_POINTS = 12
PATCH_WIDENS = 1.26  # from one radius to the next
WIDEST_LOCAL_PATCH = 1.6  # in usual patches; at least a member
FEWEST_IN_QUADRIC_PATCH, FEWEST_IN_PLANE_PATCH = 10, 4
OFF_FIT = 0.002  # mean distance of more points than enough from a patch above which it is fitted again [member lengths]


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
    field: np.ndarray  #: (S,) desired member length at each sample [`length`]; all ones where there is one length


@kernel
def walk(surface: Surface, sample: int, place: Vector) -> int:
    """Sample nearest to a place, reached from another over links that each come nearer: it never leaves the sheet."""
    return descend(surface, sample, place, place, math.inf)


@kernel
def descend(surface: Surface, sample: int, target: Vector, place: Vector, reach: float) -> int:
    """Sample nearest to a target, reached over links that each come nearer to it, through samples within `reach` of a place only."""
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
    """List in surface.queue the samples within `reach` of a place that links within that reach join to `sample`; returns how many."""
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
    if descend(surface, a, target, place, reach) == b:  # finds most pairs, faster than a flood
        return True
    count = flood(surface, a, place, reach)
    return surface.stamp[b] == surface.counter[0] and _queued(surface, b, count)


@kernel
def _queued(surface: Surface, sample: int, count: int) -> bool:
    """Whether a sample is among those the last flood listed; it also stamps the samples just outside."""
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
    """Put the points around a place, relative to it, into the buffer of a fit with weights (1 - d^2 / R^2)^2; returns how many.

    They are points of the first `count` samples in surface.queue, about `most` of each, where the cosine between the normal of the
    sample and `facing` exceeds `least`.
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
                    put_vector(buffer[taken].place, d)
                    buffer[taken].weight = w * w
                    taken += 1
    return taken


@kernel
def fit_patch(surface: Surface, patch: np.record, sample: int, place: Vector) -> int:
    """Fit a patch to the points around a place, on the sheet of `sample`; returns how many points it was fitted to.

    Points weigh (1 - d^2 / R^2)^2. Where they lie off the fit (plants, noise), it is fitted again with those far off weighing less.
    """
    sample = walk(surface, sample, place)
    facing = row(surface.normals, sample)
    local = surface.field[
        sample
    ]  # a patch grows with the members: the wider it is, the fewer points of a sample are enough
    radius, most = surface.patch_radius * local, max(int(surface.patch_points / (local * local)), 1)
    patch.sample = sample
    taken, widest = 0, max(WIDEST_LOCAL_PATCH * surface.patch_radius, surface.length) * local
    while True:  # the radius grows by a quarter until it is the widest
        count = flood(surface, sample, place, radius + 0.5 * surface.step)
        if count < 1:
            count = 1
        buffer = np.empty(_points_at_most(surface, count, most), FIT_POINT)
        taken = gather_points(surface, count, place, radius, most, facing, 0.0, buffer)
        if taken >= ENOUGH_POINTS or not 0.0 < radius < widest:
            break
        radius *= PATCH_WIDENS
    _plane_of(buffer, taken, facing, patch)
    project(buffer, taken, radius, vector_of(patch.normal), vector_of(patch.tangent))
    matrix = np.empty((TERMS_OF_QUADRIC, TERMS_OF_QUADRIC + 1))
    size = 1
    if taken >= FEWEST_IN_PLANE_PATCH:
        size = TERMS_OF_QUADRIC if taken >= FEWEST_IN_QUADRIC_PATCH else TERMS_OF_PLANE
    size = fit_heights(buffer, taken, radius, size, patch.heights, matrix)
    mean = 0.0
    for i in range(taken):
        mean += abs(buffer[i].residual)
    mean = mean / max(taken, 1)
    if mean > OFF_FIT * surface.length * local and taken > ENOUGH_POINTS:
        for i in range(taken):
            r = buffer[i].residual / (2.0 * mean)
            buffer[i].weight /= (1.0 + r * r) * (1.0 + r * r)
        fit_heights(buffer, taken, radius, size, patch.heights, matrix)
    put_vector(patch.centre, place)
    patch.is_fitted, patch.mean_distance = True, mean
    return taken


@kernel
def _points_at_most(surface: Surface, count: int, most: int) -> int:
    """Room for the points of the first `count` samples in surface.queue, at most `most` of each."""
    points = 0
    for i in range(count):
        s = surface.queue[i]
        points += min(surface.start[s + 1] - surface.start[s], most)
    return points


@kernel
def _plane_of(buffer: np.ndarray, taken: int, facing: Vector, patch: np.record) -> None:
    """Fit the plane of a patch by weighted least squares, its normal on the side of `facing`; `facing` itself where points are few."""
    normal = facing
    patch.roundness = 0.0
    if taken >= FEWEST_IN_PLANE_PATCH:
        xx, xy, xz, yy, yz, zz = second_moments(buffer, taken)
        normal = smallest_eigenvector(xx, xy, xz, yy, yz, zz)
        trace = xx + yy + zz
        if trace > 0.0:
            minors = xx * yy + xx * zz + yy * zz - xy * xy - xz * xz - yz * yz
            patch.roundness = 4.0 * minors / (trace * trace)
        side = dot(normal, facing)
        if side < 0.0:
            normal = (-normal[0], -normal[1], -normal[2])
        if abs(side) < 0.5:
            normal = facing
    put_vector(patch.normal, normal)
    put_vector(patch.tangent, across(normal))


@kernel
def onto_patch(patch: np.record, place: Vector) -> Vector:
    """Foot of a place on a patch, nearly at right angles to it."""
    centre, normal, u = vector_of(patch.centre), vector_of(patch.normal), vector_of(patch.tangent)
    heights, v = coefficients_of(patch.heights), cross(normal, u)
    d = subtract(place, centre)
    x, y, h = dot(d, u), dot(d, v), dot(d, normal)
    a, b = x, y
    for _ in range(2):  # each time to the foot on the tangent plane at (a, b)
        slope_a, slope_b = slopes_at(heights, a, b)
        over = h - height_at(heights, a, b) - slope_a * (x - a) - slope_b * (y - b)
        t = over / (1.0 + slope_a * slope_a + slope_b * slope_b)
        a, b = x + t * slope_a, y + t * slope_b
    return along(along(along(centre, a, u), b, v), height_at(heights, a, b), normal)


@kernel
def feet_on_patches(patches: np.ndarray, places: np.ndarray, feet: np.ndarray) -> None:
    """Fill the feet (N, 3) of places (N, 3), each on its own patch (N,)."""
    for k in range(len(places)):
        feet[k, 0], feet[k, 1], feet[k, 2] = onto_patch(patches[k], row(places, k))


@kernel
def patch_normal(patch: np.record, place: Vector) -> Vector:
    """Unit normal of a patch over a place."""
    normal, u = vector_of(patch.normal), vector_of(patch.tangent)
    v = cross(normal, u)
    d = subtract(place, vector_of(patch.centre))
    slope_a, slope_b = slopes_at(coefficients_of(patch.heights), dot(d, u), dot(d, v))
    n = along(along(normal, -slope_a, u), -slope_b, v)
    length = norm(n)
    return n[0] / length, n[1] / length, n[2] / length
