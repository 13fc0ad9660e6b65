"""3-vectors as tuples: `np.cross` and `np.linalg.norm` on them compile 7 times longer and run 6 times slower."""

from __future__ import annotations

import math

import numpy as np

from ...runtime.jit import kernel

Vector = tuple[float, float, float]


@kernel
def row(array: np.ndarray, i: int) -> Vector:
    """Row i of an (N, >=3) array."""
    return array[i, 0], array[i, 1], array[i, 2]


@kernel
def vector_of(values: np.ndarray) -> Vector:
    """Three numbers (3,) as a vector."""
    return values[0], values[1], values[2]


@kernel
def put_vector(values: np.ndarray, a: Vector) -> None:
    """Write a vector into three numbers (3,)."""
    values[0], values[1], values[2] = a


@kernel
def fill_row(target: np.ndarray, source: np.ndarray) -> None:
    """Copy a row into another: ``target[:] = source`` takes 40 times longer to compile, for an error that cannot occur."""
    for i in range(len(target)):
        target[i] = source[i]


@kernel
def subtract(a: Vector, b: Vector) -> Vector:
    """Return a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@kernel
def along(a: Vector, t: float, b: Vector) -> Vector:
    """Return a + t b."""
    return a[0] + t * b[0], a[1] + t * b[1], a[2] + t * b[2]


@kernel
def dot(a: Vector, b: Vector) -> float:
    """Return a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@kernel
def cross(a: Vector, b: Vector) -> Vector:
    """Return a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@kernel
def norm(a: Vector) -> float:
    """Return the length of a."""
    return math.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])


@kernel
def unit(a: Vector) -> Vector:
    """Return a / |a|; the zero vector stays zero."""
    length = math.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])
    if length == 0.0:
        return 0.0, 0.0, 0.0
    return a[0] / length, a[1] / length, a[2] / length


@kernel
def across(normal: Vector) -> Vector:
    """Return a unit vector at right angles to a unit normal, always the same for a normal."""
    x, y, z = abs(normal[0]), abs(normal[1]), abs(normal[2])
    if x <= y and x <= z:
        return unit((0.0, -normal[2], normal[1]))
    if y <= z:
        return unit((-normal[2], 0.0, normal[0]))
    return unit((-normal[1], normal[0], 0.0))


@kernel
def spread_along(v: Vector, xx: float, xy: float, xz: float, yy: float, yz: float, zz: float) -> float:
    """Return v' M v of a symmetric 3x3 matrix: for second moments and a unit vector the sum of squares along it."""
    return v[0] * (xx * v[0] + 2.0 * (xy * v[1] + xz * v[2])) + v[1] * (yy * v[1] + 2.0 * yz * v[2]) + v[2] * zz * v[2]


@kernel
def smallest_eigenvector(xx: float, xy: float, xz: float, yy: float, yz: float, zz: float) -> Vector:
    """Unit eigenvector of the smallest eigenvalue of a symmetric 3x3 matrix (closed form); (0, 0, 1) for a zero matrix."""
    largest = max(abs(xx), abs(yy), abs(zz), abs(xy), abs(xz), abs(yz))
    if largest == 0.0:
        return 0.0, 0.0, 1.0
    xx, xy, xz, yy, yz, zz = xx / largest, xy / largest, xz / largest, yy / largest, yz / largest, zz / largest
    mean = (xx + yy + zz) / 3.0
    off = xy * xy + xz * xz + yz * yz
    a, b, c = xx - mean, yy - mean, zz - mean
    p = math.sqrt((a * a + b * b + c * c + 2.0 * off) / 6.0)
    if p == 0.0:
        return 0.0, 0.0, 1.0
    det = (a * (b * c - yz * yz) - xy * (xy * c - yz * xz) + xz * (xy * yz - b * xz)) / (2.0 * p * p * p)
    smallest = mean + 2.0 * p * math.cos(math.acos(min(max(det, -1.0), 1.0)) / 3.0 + 2.0 * math.pi / 3.0)
    first = (xx - smallest, xy, xz)
    second = (xy, yy - smallest, yz)
    third = (xz, yz, zz - smallest)
    best = cross(first, second)
    other = cross(second, third)
    if dot(other, other) > dot(best, best):
        best = other
    other = cross(third, first)
    if dot(other, other) > dot(best, best):
        best = other
    if dot(best, best) > 1e-20 * p * p * p * p:
        return unit(best)
    longest = first  # the points lie on a line: all rows point along it
    if dot(second, second) > dot(longest, longest):
        longest = second
    if dot(third, third) > dot(longest, longest):
        longest = third
    return across(unit(longest))
