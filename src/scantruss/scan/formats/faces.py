"""Normals of the points of a mesh, from its faces."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

MOST_TWICE = 0.01  # share of the edges of faces that may run the same way twice: more are not wound alike

LEAST_OF_FACES = 1e-3  # share of the sizes of its faces that must be left of their sum for a point to have a normal


def normals_from_faces(points: np.ndarray, faces: Iterable[np.ndarray]) -> np.ndarray | None:
    """Return the normals at the points of a mesh, the mean of those of their faces by area.

    Parameters
    ----------
    points : (N, 3) array
    faces : iterable of (F, K) int arrays
        Points of each face in turn, faces of as many corners together.

    Returns
    -------
    (N, 3) array or None
        Unit normals, zero where a point has no face, or faces that face each other away, as both sides of one triangle; None where
        there are no faces, they are damaged, or not wound alike: those normals would say nothing of the two sides of a sheet.
    """
    fans = [
        np.stack([face[:, 0], face[:, k], face[:, k + 1]], axis=1)
        for face in faces
        for k in range(1, face.shape[1] - 1)
    ]
    triangles = np.concatenate(fans).astype(np.int64) if fans else np.empty((0, 3), np.int64)
    if not len(triangles) or triangles.min() < 0 or triangles.max() >= len(points):
        return None
    if not _wound_alike(triangles, len(points)):
        return None
    corners = points[triangles]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    sizes = np.linalg.norm(across, axis=1)
    *total, most = (
        np.bincount(triangles.ravel(), np.repeat(each, 3), minlength=len(points)) for each in (*across.T, sizes)
    )
    normals = np.stack(total, axis=1)
    lengths = np.linalg.norm(normals, axis=1)
    known = lengths > LEAST_OF_FACES * most
    normals[known] /= lengths[known, None]
    normals[~known] = 0.0
    return normals


def _wound_alike(triangles: np.ndarray, points: int) -> bool:
    """Whether faces that share an edge run along it in opposite directions, nearly all of them."""
    sides = np.sort((triangles * points + np.roll(triangles, -1, axis=1)).ravel())
    return bool((sides[1:] == sides[:-1]).sum() <= MOST_TWICE * len(sides))
