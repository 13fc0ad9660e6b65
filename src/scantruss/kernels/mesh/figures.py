"""Angles of a grid: of its triangles, and between neighbouring triangles."""

from __future__ import annotations

import math

import numpy as np

from ...runtime.jit import kernel
from ..geometry.vectors import Vector, cross, dot, norm, row, subtract


@kernel
def angle_between(u: Vector, w: Vector) -> float:
    """Angle between two vectors [degree]; 0 if one has no length."""
    return math.degrees(math.atan2(norm(cross(u, w)), dot(u, w) + 0.0))  # atan2(0, -0) would be 180


@kernel
def angles_of_triangles(nodes: np.ndarray, triangles: np.ndarray, angles: np.ndarray) -> None:
    """Fill in the angle of each triangle (T, 3) at each of its nodes (T, 3) [degree]."""
    for t in range(len(triangles)):
        for k in range(3):
            corner = row(nodes, triangles[t, k])
            to = subtract(row(nodes, triangles[t, (k + 1) % 3]), corner)
            angles[t, k] = angle_between(to, subtract(row(nodes, triangles[t, (k + 2) % 3]), corner))


@kernel
def _normal_of(nodes: np.ndarray, triangles: np.ndarray, t: int) -> Vector:
    a = row(nodes, triangles[t, 0])
    return cross(subtract(row(nodes, triangles[t, 1]), a), subtract(row(nodes, triangles[t, 2]), a))


@kernel
def folds_of(nodes: np.ndarray, triangles: np.ndarray, two: np.ndarray, angles: np.ndarray) -> None:
    """Fill in the angle (E,) between the two triangles `two` (E, 2) at each member [degree]: 180 level, 0 folded flat, NaN for one."""
    for e in range(len(two)):
        angles[e] = math.nan
        if two[e, 1] >= 0:
            first = _normal_of(nodes, triangles, two[e, 0])
            angles[e] = 180.0 - angle_between(first, _normal_of(nodes, triangles, two[e, 1]))
