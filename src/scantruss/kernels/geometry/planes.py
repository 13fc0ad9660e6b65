"""Planes through points by least squares."""

from __future__ import annotations

import numpy as np

from ...runtime.jit import kernel
from .vectors import Vector, smallest_eigenvector, spread_along


@kernel
def plane_of(offsets: np.ndarray, count: int) -> tuple[Vector, Vector, float, float]:
    """Mean and unit normal of the plane through offsets (>= count, 3), sum of squares off the plane, and about the mean in all."""
    cx = cy = cz = xx = xy = xz = yy = yz = zz = 0.0
    for k in range(count):
        x, y, z = offsets[k, 0], offsets[k, 1], offsets[k, 2]
        cx, cy, cz = cx + x, cy + y, cz + z
        xx, xy, xz = xx + x * x, xy + x * y, xz + x * z
        yy, yz, zz = yy + y * y, yz + y * z, zz + z * z
    cx, cy, cz = cx / count, cy / count, cz / count
    xx, xy, xz = xx - count * cx * cx, xy - count * cx * cy, xz - count * cx * cz
    yy, yz, zz = yy - count * cy * cy, yz - count * cy * cz, zz - count * cz * cz
    v = smallest_eigenvector(xx, xy, xz, yy, yz, zz)
    return (cx, cy, cz), v, max(spread_along(v, xx, xy, xz, yy, yz, zz), 0.0), xx + yy + zz
