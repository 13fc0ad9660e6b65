"""Quadrics fitted to heights over a plane by weighted least squares; where the points do not determine one, a plane.

The height over the point (a, b) of the plane is c0 + c1 a + c2 b + c3 a^2 + c4 a b + c5 b^2. The points of a fit are
FIT_POINT records of a buffer.
"""

from __future__ import annotations

import numpy as np

from ...runtime.jit import kernel, record_type
from .vectors import Vector, cross, dot, vector_of

FIT_POINT = record_type(
    place=(np.float64, 3),  # from the middle of the fit [scan unit]
    square=np.float64,  # squared distance from there
    weight=np.float64,
    residual=np.float64,  # height over the fitted surface [scan unit]
    a=np.float64,  # place in the plane [radii of the fit]
    b=np.float64,
    height=np.float64,  # over the plane [scan unit]
)
TERMS_OF_QUADRIC, TERMS_OF_PLANE = 6, 3  # coefficients of either surface
# added to each diagonal element of normal equations, in the first one: it decides only what the points leave open
REGULARIZATION = 1e-9
LEAST_PIVOT = 1e-10  # pivot at or below which a system has no solution

Coefficients = tuple[float, float, float, float, float, float]


@kernel
def second_moments(buffer: np.ndarray, taken: int) -> tuple[float, float, float, float, float, float]:
    """Weighted second moments xx, xy, xz, yy, yz, zz of the points about their centre."""
    total = cx = cy = cz = 0.0
    xx = xy = xz = yy = yz = zz = 0.0
    for i in range(taken):
        w = buffer[i].weight
        x, y, z = vector_of(buffer[i].place)
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
    """Fill in the places of the points in the plane through the origin with a normal and a tangent u, and their heights over it."""
    v = cross(normal, u)
    for i in range(taken):
        d = vector_of(buffer[i].place)
        buffer[i].a, buffer[i].b = dot(d, u) / radius, dot(d, v) / radius
        buffer[i].height = dot(d, normal)


@kernel
def normal_equations(buffer: np.ndarray, taken: int, matrix: np.ndarray) -> None:
    """Normal equations of a quadric, matrix (6, 7), from the moments of the points."""
    m00 = m10 = m01 = m20 = m11 = m02 = m30 = m21 = m12 = m03 = m40 = m31 = m22 = m13 = m04 = 0.0
    z00 = z10 = z01 = z20 = z11 = z02 = 0.0
    for i in range(taken):
        w, a, b, z = buffer[i].weight, buffer[i].a, buffer[i].b, buffer[i].height
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
def solve_normal_equations(matrix: np.ndarray, size: int) -> bool:
    """Solve the symmetric system in matrix[:size, :size + 1] in place; the solution is left in its last column."""
    for i in range(size):
        pivot = matrix[i, i]
        if pivot <= LEAST_PIVOT:
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
    buffer: np.ndarray, taken: int, radius: float, size: int, heights: np.ndarray, matrix: np.ndarray
) -> int:
    """Fit heights (6,), the coefficients of 1 a b a^2 ab b^2 [scan unit], to the points; returns how many are not zero.

    Where the points do not determine `size` coefficients, a plane is fitted, or their mean height. The residuals go into the buffer.
    matrix : (6, 7) scratch
    """
    while True:  # the size falls from 6 to 3 to 1
        normal_equations(buffer, taken, matrix)
        for r in range(size):
            matrix[r, size] = matrix[r, TERMS_OF_QUADRIC]
            matrix[r, r] += REGULARIZATION * matrix[0, 0]
        if solve_normal_equations(matrix, size) or size == 1:
            break
        size = TERMS_OF_PLANE if size == TERMS_OF_QUADRIC else 1
    for c in range(TERMS_OF_QUADRIC):
        heights[c] = matrix[c, size] if c < size else 0.0
    fitted = coefficients_of(heights)
    for i in range(taken):
        buffer[i].residual = buffer[i].height - height_at(fitted, buffer[i].a, buffer[i].b)
    for c in range(1, TERMS_OF_QUADRIC):
        heights[c] /= radius if c < TERMS_OF_PLANE else radius * radius
    return size


@kernel
def coefficients_of(values: np.ndarray) -> Coefficients:
    """Six numbers (6,) as the coefficients of a quadric."""
    return values[0], values[1], values[2], values[3], values[4], values[5]


@kernel
def height_at(c: Coefficients, a: float, b: float) -> float:
    """Height of a quadric over its plane at (a, b)."""
    return c[0] + a * (c[1] + a * c[3] + b * c[4]) + b * (c[2] + b * c[5])


@kernel
def slopes_at(c: Coefficients, a: float, b: float) -> tuple[float, float]:
    """Slopes of a quadric along a and b at (a, b)."""
    return c[1] + 2.0 * a * c[3] + b * c[4], c[2] + 2.0 * b * c[5] + a * c[4]
