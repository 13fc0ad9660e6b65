"""Patches: the surface at a place of a scan as a quadric fitted to the points around it, robust against points of something else."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...runtime.jit import kernel
from ..geometry.kd_tree import KDTree, within
from ..geometry.quadric import (
    REGULARIZATION,
    TERMS_OF_PLANE,
    TERMS_OF_QUADRIC,
    coefficients_of,
    fit_heights,
    height_at,
    normal_equations,
    project,
    second_moments,
    slopes_at,
    solve_normal_equations,
)
from ..geometry.vectors import Vector, across, along, cross, dot, put_vector, row, smallest_eigenvector, subtract, unit

POINTS_FOR_QUADRIC, POINTS_FOR_PLANE = 10, 5  # fewest points that either is fitted to
LEAST_FREEDOMS = 0.25  # share of the points that the coefficients of a patch leave free at least


class Patches(NamedTuple):
    """Quadrics over planes through the places they were fitted at; v = normal x tangent."""

    normal: np.ndarray  #: (C, 3) unit normal of the plane, of either sign
    tangent: np.ndarray  #: (C, 3) unit vector u in the plane
    heights: np.ndarray  #: (C, 6) height over the plane as coefficients of 1 a b a^2 ab b^2 [scan unit]
    rms: np.ndarray  #: (C,) rms distance of the points from the patch, inf where there are none [scan unit]
    points: np.ndarray  #: (C,) int64 points it was fitted to
    radius: np.ndarray  #: (C,) radius within which they lie [scan unit]


@kernel
def empty_patches(count: int) -> Patches:
    """Room for some patches."""
    return Patches(
        np.zeros((count, 3)), np.zeros((count, 3)), np.zeros((count, 6)), np.zeros(count), np.zeros(count, np.int64),
        np.zeros(count),
    )  # fmt: skip


@kernel
def gather_around(
    tree: KDTree, place: Vector, radius: float, leave: int, stack: np.ndarray, found: np.ndarray, buffer: np.ndarray
) -> int:
    """Put the points within a radius of a place into the buffer of a fit, except the one `leave`; returns how many.

    At most len(found) of them are found.
    """
    count = within(tree, place[0], place[1], place[2], radius, stack, found)
    taken = 0
    for i in range(count):
        if found[i] != leave:
            d = subtract(row(tree.points, found[i]), place)
            put_vector(buffer[taken].place, d)
            buffer[taken].square = dot(d, d)
            taken += 1
    return taken


@kernel
def terms_for(points: int) -> int:
    """How many coefficients so many points determine: those of a quadric, of a plane, or one height."""
    if points >= POINTS_FOR_QUADRIC:
        return TERMS_OF_QUADRIC
    return TERMS_OF_PLANE if points >= POINTS_FOR_PLANE else 1


@kernel
def fit(
    buffer: np.ndarray, taken: int, radius: float, rounds: int, patches: Patches, i: int, matrix: np.ndarray
) -> None:
    """Fit patch i to the points of the buffer that lie within a radius. matrix (6, 7) is scratch.

    A point at distance d weighs (1 - d^2 / R^2)^2 in the first round; in later rounds less, the farther it lies off the last fit.
    """
    inside = 0
    for p in range(taken):
        w = max(1.0 - buffer[p].square / (radius * radius), 0.0)
        buffer[p].weight = w * w
        inside += w > 0.0
    patches.points[i], patches.radius[i] = inside, radius
    size = terms_for(inside)
    for turn in range(rounds):
        if turn < 2:
            _fit_plane(buffer, taken, radius, patches, i)
        size = fit_heights(buffer, taken, radius, size, patches.heights[i], matrix)
        if turn < rounds - 1:
            _weigh_again(buffer, taken, radius)
    patches.rms[i] = _rms(buffer, taken, size)


@kernel
def _weigh_again(buffer: np.ndarray, taken: int, radius: float) -> None:
    """Weigh points less, the more mean residuals they lie off the patch."""
    total = mean = 0.0
    for i in range(taken):
        w = max(1.0 - buffer[i].square / (radius * radius), 0.0)
        total, mean = total + w * w, mean + w * w * abs(buffer[i].residual)
    if mean <= 1e-12 * radius * total:
        return
    for i in range(taken):
        w = max(1.0 - buffer[i].square / (radius * radius), 0.0)
        r = buffer[i].residual * total / (2.0 * mean)
        r = w / (1.0 + r * r)
        buffer[i].weight = r * r


@kernel
def _fit_plane(buffer: np.ndarray, taken: int, radius: float, patches: Patches, i: int) -> None:
    """Fit the plane of patch i by least squares, and project the points onto it."""
    normal = smallest_eigenvector(*second_moments(buffer, taken))
    u = across(normal)
    patches.normal[i, 0], patches.normal[i, 1], patches.normal[i, 2] = normal
    patches.tangent[i, 0], patches.tangent[i, 1], patches.tangent[i, 2] = u
    project(buffer, taken, radius, normal, u)


@kernel
def _rms(buffer: np.ndarray, taken: int, size: int) -> float:
    """Rms distance of the points from a patch, corrected for the `size` coefficients fitted to them; inf without points."""
    total = squares = weights = 0.0
    for i in range(taken):
        w = buffer[i].weight
        total, weights = total + w, weights + w * w
        squares = squares + w * buffer[i].residual * buffer[i].residual
    if total <= 0.0:
        return math.inf
    many = total * total / weights
    return math.sqrt(squares / total * many / max(many - size, LEAST_FREEDOMS * many))


@kernel
def height_variance(buffer: np.ndarray, taken: int, size: int, matrix: np.ndarray) -> float:
    """Variance of the height of the last fit at its place, in variances of a point: large where the points lie to one side."""
    normal_equations(buffer, taken, matrix)
    for r in range(size):
        matrix[r, size] = 1.0 if r == 0 else 0.0
        matrix[r, r] += REGULARIZATION * matrix[0, 0]
    if not solve_normal_equations(matrix, size):
        return math.inf
    variance = 0.0
    for i in range(taken):
        a, b = buffer[i].a, buffer[i].b
        share = matrix[0, size]
        if size >= TERMS_OF_PLANE:
            share += a * matrix[1, size] + b * matrix[2, size]
        if size >= TERMS_OF_QUADRIC:
            share += a * a * matrix[3, size] + a * b * matrix[4, size] + b * b * matrix[5, size]
        variance += (buffer[i].weight * share) ** 2
    return variance


@kernel
def foot(patches: Patches, i: int, place: Vector) -> tuple[Vector, Vector]:
    """Foot of a place on patch i, nearly at right angles to it, and the normal there; both places relative to that of the patch."""
    normal, u, heights = row(patches.normal, i), row(patches.tangent, i), coefficients_of(patches.heights[i])
    v = cross(normal, u)
    a, b, h = dot(place, u), dot(place, v), dot(place, normal)
    slope_a = slope_b = 0.0
    for _ in range(3):
        slope_a, slope_b = slopes_at(heights, a, b)
        t = (h - height_at(heights, a, b)) / (1.0 + slope_a * slope_a + slope_b * slope_b)
        a, b, h = a + t * slope_a, b + t * slope_b, h - t
    at = along(along((normal[0] * h, normal[1] * h, normal[2] * h), a, u), b, v)
    return at, unit(along(along(normal, -slope_a, u), -slope_b, v))
