"""Bounds of points; points moved to a local origin and their second moments, in one pass."""

from __future__ import annotations

import math

import numpy as np

from ...runtime.jit import kernel

POINTS_PER_BLOCK = 1 << 14  # points whose moments are summed into one row


@kernel
def widen_bounds(points: np.ndarray, bounds: np.ndarray, begin: int, end: int) -> None:
    """Widen bounds (2, 3), lower and upper corner, to hold points[begin:end]; NaN along an axis with a coordinate that is not finite."""
    x0, x1, y0, y1, z0, z1 = bounds[0, 0], bounds[1, 0], bounds[0, 1], bounds[1, 1], bounds[0, 2], bounds[1, 2]
    odd_x = odd_y = odd_z = 0.0
    for p in range(begin, end):
        x, y, z = points[p, 0], points[p, 1], points[p, 2]
        x0, y0, z0 = x if x < x0 else x0, y if y < y0 else y0, z if z < z0 else z0
        x1, y1, z1 = x if x > x1 else x1, y if y > y1 else y1, z if z > z1 else z1
        odd_x = odd_x if abs(x) < math.inf else math.nan
        odd_y = odd_y if abs(y) < math.inf else math.nan
        odd_z = odd_z if abs(z) < math.inf else math.nan
    bounds[0, 0], bounds[0, 1], bounds[0, 2] = x0 + odd_x, y0 + odd_y, z0 + odd_z
    bounds[1, 0], bounds[1, 1], bounds[1, 2] = x1 + odd_x, y1 + odd_y, z1 + odd_z


@kernel
def move_points(
    points: np.ndarray, origin: np.ndarray, moved: np.ndarray, sums: np.ndarray, begin: int, end: int
) -> None:
    """Fill moved (N, 3) with points less origin, and sums (blocks, 9) with sums of their x, y, z, xx, xy, xz, yy, yz, zz.

    Each block from `begin` to `end` - 1 is `POINTS_PER_BLOCK` points, so that the sums do not depend on the number of threads.
    """
    for block in range(begin, end):
        sx = sy = sz = xx = xy = xz = yy = yz = zz = 0.0
        for p in range(block * POINTS_PER_BLOCK, min((block + 1) * POINTS_PER_BLOCK, len(points))):
            x, y, z = points[p, 0] - origin[0], points[p, 1] - origin[1], points[p, 2] - origin[2]
            moved[p, 0], moved[p, 1], moved[p, 2] = x, y, z
            sx, sy, sz = sx + x, sy + y, sz + z
            xx, xy, xz, yy, yz, zz = xx + x * x, xy + x * y, xz + x * z, yy + y * y, yz + y * z, zz + z * z
        row = (sx, sy, sz, xx, xy, xz, yy, yz, zz)
        for c in range(9):
            sums[block, c] = row[c]
