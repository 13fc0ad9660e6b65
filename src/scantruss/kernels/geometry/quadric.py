"""Heights over a plane by least squares: a quadric, a plane where a quadric is not told.

The points of a fit are rows of a buffer:

    0:3 position   3 squared distance   4 weight   5 height over the fit   6 a   7 b   8 height over the plane; a, b in radii
"""

from __future__ import annotations

import numpy as np

from ...runtime.jit import kernel
from .vectors import Vector, cross, dot

WEIGHT, AWAY, HEIGHT = 4, 5, 8  # columns of a buffer
COLUMNS = 9


@kernel
def second_moments(buffer: np.ndarray, taken: int) -> tuple[float, float, float, float, float, float]:
    """Weighted second moments xx, xy, xz, yy, yz, zz of the points about their centre."""
    total = cx = cy = cz = 0.0
    xx = xy = xz = yy = yz = zz = 0.0
    for i in range(taken):
        w = buffer[i, 4]
        x, y, z = buffer[i, 0], buffer[i, 1], buffer[i, 2]
        wx, wy, wz = w * x, w * y, w * z
        total, cx, cy, cz = total + w, cx + wx, cy + wy, cz + wz
        xx, xy, xz = xx + wx * x, xy + wx * y, xz + wx * z
        yy, yz, zz = yy + wy * y, yz + wy * z, zz + wz * z
    if total > 0.0:
        cx, cy, cz = cx / total, cy / total, cz / total
        xx, xy, xz = xx - total * cx * cx, xy - total * cx * cy, xz - total * cx * cz
        yy, yz, zz = yy - total * cy * cy, yz - total * cy * cz, zz - total * cz * cz
    return xx, xy, xz, yy, yz, zz


@kernel
def project(buffer: np.ndarray, taken: int, radius: float, normal: Vector, u: Vector) -> None:
    """Where the points lie in the plane of a normal and a tangent through the origin, and how far over it."""
    v = cross(normal, u)
    for i in range(taken):
        d = (buffer[i, 0], buffer[i, 1], buffer[i, 2])
        buffer[i, 6], buffer[i, 7], buffer[i, 8] = dot(d, u) / radius, dot(d, v) / radius, dot(d, normal)


@kernel
def normal_equations(buffer: np.ndarray, taken: int, matrix: np.ndarray) -> None:
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
def solve(matrix: np.ndarray, size: int) -> bool:
    """Solve the symmetric system in matrix[:size, :size + 1] in place; the last column gets the solution."""
    for i in range(size):
        pivot = matrix[i, i]
        if pivot <= 1e-10:
            return False
        for r in range(i + 1, size):
            factor = matrix[r, i] / pivot
            for c in range(i, size + 1):
                matrix[r, c] -= factor * matrix[i, c]
    for i in range(size - 1, -1, -1):
        value = matrix[i, size]
        for c in range(i + 1, size):
            value -= matrix[i, c] * matrix[c, size]
        matrix[i, size] = value / matrix[i, i]
    return True


@kernel
def fit_heights(
    buffer: np.ndarray, taken: int, radius: float, size: int, patch: np.ndarray, first: int, matrix: np.ndarray
) -> int:
    """Coefficients of 1 a b aa ab bb into patch[first:]; of a plane where a quadric is not told. Returns how many.

    buffer[:, AWAY] gets the heights over the fit. matrix (6, 7) is scratch.
    """
    while True:  # the size falls from 6 to 3 to 1
        normal_equations(buffer, taken, matrix)
        for r in range(size):
            matrix[r, size] = matrix[r, 6]
            matrix[r, r] += 1e-9 * matrix[0, 0]
        if solve(matrix, size) or size == 1:
            break
        size = 3 if size == 6 else 1
    for c in range(6):
        patch[first + c] = matrix[c, size] if c < size else 0.0
    c0, c1, c2, c3, c4, c5 = (
        patch[first], patch[first + 1], patch[first + 2], patch[first + 3], patch[first + 4], patch[first + 5]
    )  # fmt: skip
    for i in range(taken):
        a, b = buffer[i, 6], buffer[i, 7]
        buffer[i, AWAY] = buffer[i, HEIGHT] - (c0 + a * (c1 + a * c3 + b * c4) + b * (c2 + b * c5))
    for c in range(1, 6):
        patch[first + c] /= radius if c < 3 else radius * radius
    return size
