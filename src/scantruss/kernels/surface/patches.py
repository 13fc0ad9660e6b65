"""The local surface at a single place of a scan: a quadric through the points around it, fitted in the presence of some that are not of it.

A patch is a row of numbers, relative to the place it was fitted at:

    0:3 unit normal   3:6 tangent u (v = normal x u)   6:12 height as coefficients of 1 a b aa ab bb   12 rms distance of the points
    13 variance of the height at the place itself, in units of that of a point   14 points   15 radius
"""

from __future__ import annotations

import math

import numpy as np

from ...runtime.jit import kernel
from ..geometry.kd_tree import KDTree, within
from ..geometry.quadric import fit_heights, normal_equations, project, second_moments, solve
from ..geometry.vectors import Vector, across, along, cross, dot, row, smallest_eigenvector, subtract, unit

PATCH = 16  # columns of a patch
HEIGHTS = 6  # first of its coefficients
FULL, FLAT = 10, 5  # points that a quadric needs, and a plane


@kernel
def gather(
    tree: KDTree, place: Vector, radius: float, leave: int, stack: np.ndarray, found: np.ndarray, buffer: np.ndarray
) -> int:
    """Points within a radius of a place but one, `leave`, into the buffer; returns their number, at most len(found)."""
    count = within(tree, place[0], place[1], place[2], radius, stack, found)
    taken = 0
    for i in range(count):
        if found[i] != leave:
            d = subtract(row(tree.points, found[i]), place)
            buffer[taken, 0], buffer[taken, 1], buffer[taken, 2] = d
            buffer[taken, 3] = dot(d, d)
            taken += 1
    return taken


@kernel
def fit(buffer: np.ndarray, taken: int, radius: float, rounds: int, patch: np.ndarray, matrix: np.ndarray) -> None:
    """Fit a patch to the points in the buffer that lie within a radius; patch[13] stays as it is. matrix (7, 8) is scratch.

    Points weigh (1 - d^2 / R^2)^2, and after the first of the rounds less the farther they lie off the one before.
    """
    inside = 0
    for i in range(taken):
        w = max(1.0 - buffer[i, 3] / (radius * radius), 0.0)
        buffer[i, 4] = w * w
        inside += w > 0.0
    patch[14], patch[15] = inside, radius
    size = 6 if inside >= FULL else (3 if inside >= FLAT else 1)
    for turn in range(rounds):
        if turn < 2:
            _plane(buffer, taken, radius, patch)
        size = fit_heights(buffer, taken, radius, size, patch, HEIGHTS, matrix)
        if turn < rounds - 1:
            _weigh_again(buffer, taken, radius)
    _spread(buffer, taken, size, patch)


@kernel
def _weigh_again(buffer: np.ndarray, taken: int, radius: float) -> None:
    """Weigh down what lies off the patch, in mean distances of all points from it."""
    total = mean = 0.0
    for i in range(taken):
        w = max(1.0 - buffer[i, 3] / (radius * radius), 0.0)
        total, mean = total + w * w, mean + w * w * abs(buffer[i, 5])
    if mean <= 1e-12 * radius * total:
        return
    for i in range(taken):
        w = max(1.0 - buffer[i, 3] / (radius * radius), 0.0)
        r = buffer[i, 5] * total / (2.0 * mean)
        r = w / (1.0 + r * r)
        buffer[i, 4] = r * r


@kernel
def _plane(buffer: np.ndarray, taken: int, radius: float, patch: np.ndarray) -> None:
    """Normal and tangent of the plane of least squares, and where the points lie over it."""
    normal = smallest_eigenvector(*second_moments(buffer, taken))
    u = across(normal)
    patch[0], patch[1], patch[2] = normal
    patch[3], patch[4], patch[5] = u
    project(buffer, taken, radius, normal, u)


@kernel
def _spread(buffer: np.ndarray, taken: int, size: int, patch: np.ndarray) -> None:
    """Rms distance of the points from the patch, for as many as there are over what the patch has used up."""
    total = squares = weights = 0.0
    for i in range(taken):
        w = buffer[i, 4]
        total, weights, squares = total + w, weights + w * w, squares + w * buffer[i, 5] * buffer[i, 5]
    patch[12] = np.inf
    if total > 0.0:
        many = total * total / weights
        patch[12] = math.sqrt(squares / total * many / max(many - size, 0.25 * many))


@kernel
def doubt(buffer: np.ndarray, taken: int, size: int, patch: np.ndarray, matrix: np.ndarray) -> None:
    """Measure how well the points of the last fit tell the height at the place: patch[13], large where they lie to one side."""
    patch[13] = np.inf
    normal_equations(buffer, taken, matrix)
    for r in range(size):
        matrix[r, size] = 1.0 if r == 0 else 0.0
        matrix[r, r] += 1e-9 * matrix[0, 0]
    if not solve(matrix, size):
        return
    variance = 0.0
    for i in range(taken):
        a, b = buffer[i, 6], buffer[i, 7]
        share = matrix[0, size]
        if size > 1:
            share += a * matrix[1, size] + b * matrix[2, size]
        if size > 3:
            share += a * a * matrix[3, size] + a * b * matrix[4, size] + b * b * matrix[5, size]
        variance += (buffer[i, 4] * share) ** 2
    patch[13] = variance


@kernel
def height(patch: np.ndarray, a: float, b: float) -> float:
    """Height of a patch over its plane at (a, b) [scan unit]."""
    return patch[6] + a * (patch[7] + a * patch[9] + b * patch[10]) + b * (patch[8] + b * patch[11])


@kernel
def foot(patch: np.ndarray, place: Vector) -> tuple[Vector, Vector]:
    """Foot of a place on a patch, nearly at right angles to it, and the normal there; both places relative to that of the patch."""
    normal, u = (patch[0], patch[1], patch[2]), (patch[3], patch[4], patch[5])
    v = cross(normal, u)
    a, b, h = dot(place, u), dot(place, v), dot(place, normal)
    slope_a = slope_b = 0.0
    for _ in range(3):
        slope_a = patch[7] + 2.0 * a * patch[9] + b * patch[10]
        slope_b = patch[8] + 2.0 * b * patch[11] + a * patch[10]
        t = (h - height(patch, a, b)) / (1.0 + slope_a * slope_a + slope_b * slope_b)
        a, b, h = a + t * slope_a, b + t * slope_b, h - t
    at = along(along((normal[0] * h, normal[1] * h, normal[2] * h), a, u), b, v)
    return at, unit(along(along(normal, -slope_a, u), -slope_b, v))
