"""The local surface at a single place of a scan: a quadric through the points around it, fitted in the presence of some that are not of it.

A patch is a row of numbers, relative to the place it was fitted at:

    0:3 unit normal   3:6 tangent u (v = normal x u)   6:12 height as coefficients of 1 a b aa ab bb   12 rms distance of the points
    13 variance of the height at the place itself, in units of that of a point   14 points   15 radius

The points of a fit are rows of a buffer:

    0:3 position   3 squared distance   4 weight   5 height over the patch   6 a   7 b   8 height over the plane; a, b in radii
"""

from __future__ import annotations

import math

import numpy as np

from .compile import kernel
from .surface import solve
from .tree import Tree, within
from .vectors import Vector, across, along, cross, dot, row, smallest_eigenvector, subtract, unit

PATCH = 16  # columns of a patch
COLUMNS = 9  # columns of a buffer
FULL, FLAT = 10, 5  # points that a quadric needs, and a plane


@kernel
def gather(
    tree: Tree, place: Vector, radius: float, leave: int, stack: np.ndarray, found: np.ndarray, buffer: np.ndarray
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
        size = _heights(buffer, taken, radius, size, patch, matrix)
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
    total = cx = cy = cz = 0.0
    xx = xy = xz = yy = yz = zz = 0.0
    for i in range(taken):
        w = buffer[i, 4]
        x, y, z = buffer[i, 0], buffer[i, 1], buffer[i, 2]
        total, cx, cy, cz = total + w, cx + w * x, cy + w * y, cz + w * z
        xx, xy, xz = xx + w * x * x, xy + w * x * y, xz + w * x * z
        yy, yz, zz = yy + w * y * y, yz + w * y * z, zz + w * z * z
    if total > 0.0:
        cx, cy, cz = cx / total, cy / total, cz / total
        xx, xy, xz = xx - total * cx * cx, xy - total * cx * cy, xz - total * cx * cz
        yy, yz, zz = yy - total * cy * cy, yz - total * cy * cz, zz - total * cz * cz
    normal = smallest_eigenvector(xx, xy, xz, yy, yz, zz)
    u = across(normal)
    v = cross(normal, u)
    patch[0], patch[1], patch[2] = normal
    patch[3], patch[4], patch[5] = u
    for i in range(taken):
        d = (buffer[i, 0], buffer[i, 1], buffer[i, 2])
        buffer[i, 6], buffer[i, 7], buffer[i, 8] = dot(d, u) / radius, dot(d, v) / radius, dot(d, normal)


@kernel
def _system(buffer: np.ndarray, taken: int, matrix: np.ndarray) -> None:
    """Normal equations of a quadric, matrix (6, 7), from the moments of the points."""
    m00 = m10 = m01 = m20 = m11 = m02 = m30 = m21 = m12 = m03 = m40 = m31 = m22 = m13 = m04 = 0.0
    z00 = z10 = z01 = z20 = z11 = z02 = 0.0
    for i in range(taken):
        w, a, b, z = buffer[i, 4], buffer[i, 6], buffer[i, 7], buffer[i, 8]
        wa, wb = w * a, w * b
        waa, wab, wbb = wa * a, wa * b, wb * b
        m00, m10, m01, m20, m11, m02 = m00 + w, m10 + wa, m01 + wb, m20 + waa, m11 + wab, m02 + wbb
        m30, m21, m12, m03 = m30 + waa * a, m21 + waa * b, m12 + wbb * a, m03 + wbb * b
        m40, m31, m22 = m40 + waa * a * a, m31 + waa * a * b, m22 + waa * b * b
        m13, m04 = m13 + wbb * a * b, m04 + wbb * b * b
        z00, z10, z01 = z00 + w * z, z10 + wa * z, z01 + wb * z
        z20, z11, z02 = z20 + waa * z, z11 + wab * z, z02 + wbb * z
    rows = (
        (m00, m10, m01, m20, m11, m02, z00),
        (m10, m20, m11, m30, m21, m12, z10),
        (m01, m11, m02, m21, m12, m03, z01),
        (m20, m30, m21, m40, m31, m22, z20),
        (m11, m21, m12, m31, m22, m13, z11),
        (m02, m12, m03, m22, m13, m04, z02),
    )
    for r in range(6):
        for c in range(7):
            matrix[r, c] = rows[r][c]


@kernel
def _heights(buffer: np.ndarray, taken: int, radius: float, size: int, patch: np.ndarray, matrix: np.ndarray) -> int:
    """Coefficients of the heights by least squares, of a plane where a quadric is not told; returns how many."""
    while True:
        _system(buffer, taken, matrix)
        for r in range(size):
            matrix[r, size] = matrix[r, 6]
            matrix[r, r] += 1e-9 * matrix[0, 0]
        if solve(matrix, size) or size == 1:
            break
        size = 3 if size == 6 else 1
    for c in range(6):
        power = 1.0 if c == 0 else (radius if c < 3 else radius * radius)
        patch[6 + c] = matrix[c, size] / power if c < size else 0.0
    for i in range(taken):
        buffer[i, 5] = buffer[i, 8] - height(patch, radius * buffer[i, 6], radius * buffer[i, 7])
    return size


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
    _system(buffer, taken, matrix)
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
