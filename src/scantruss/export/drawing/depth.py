"""What lies in front of what in a picture, pixel by pixel, and in which order triangles are painted so that it is seen."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

PIXELS_AT_ONCE = 50_000  # of the windows of triangles
MOST_RAISES = 100  # of keys, one after the other; triangles that hide each other in a ring have no right order
LEAST_BEHIND = 1e-6  # between what hides and what is hidden: neighbours meet along their side [span of nearness]


def map_depth(corners: np.ndarray, near: np.ndarray, shape: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Return what is in front at each pixel.

    Parameters
    ----------
    corners : np.ndarray
        (T, 3, 2) corners of triangles [pixel].
    near : np.ndarray
        (T, 3) how near the corners are, in any measure that changes evenly across a triangle in the picture.
    shape : tuple of int
        Rows and columns of the map.

    Returns
    -------
    nearest : np.ndarray
        (rows, columns) how near what is in front is, -inf if nothing is.
    triangle : np.ndarray
        (rows, columns) int64 triangle in front, -1 where none is.
    """
    nearest, triangle = np.full(shape, -np.inf), np.full(shape, -1, np.int64)
    for t, pixel, depth in _covered(corners, near, shape):
        nearer = depth > nearest.flat[pixel]
        np.maximum.at(nearest.reshape(-1), pixel, depth)
        front = np.flatnonzero(nearer & (depth == nearest.flat[pixel]))[::-1]  # the first of those alike
        triangle.flat[pixel[front]] = t[front]
    return nearest, triangle


def hidden_pairs(corners: np.ndarray, near: np.ndarray, nearest: np.ndarray, triangle: np.ndarray) -> np.ndarray:
    """Return (P, 2) each triangle and one that is seen before it at a pixel of a map of `map_depth`; not both before each other."""
    least = LEAST_BEHIND * float(np.ptp(near)) if len(near) else 0.0
    found = [np.empty(0, np.int64)]  # both triangles as one number
    for t, pixel, depth in _covered(corners, near, nearest.shape):
        hidden = depth < nearest.flat[pixel] - least
        found.append(np.unique(t[hidden] * len(near) + triangle.flat[pixel[hidden]]))
    pairs = np.stack(np.divmod(np.unique(np.concatenate(found)), max(len(near), 1)), axis=1)
    both = np.isin(pairs @ [len(near), 1], pairs @ [1, len(near)])
    kept: np.ndarray = pairs[~both]
    return kept


def raised_keys(key: np.ndarray, pairs: np.ndarray, step: float) -> np.ndarray:
    """Return keys (T,) of painting, raised where needed to a step above that of what is hidden, for (P, 2) hidden and seen."""
    hidden, seen = pairs.T
    for _ in range(MOST_RAISES):
        raised = key.copy()
        np.maximum.at(raised, seen, key[hidden] + step)
        if np.array_equal(raised, key):
            break
        key = raised
    return key


def _covered(
    corners: np.ndarray, near: np.ndarray, shape: tuple[int, ...]
) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Yield, some triangles at a time, each pixel that one covers: the triangle, the pixel, row by row, and how near it is there."""
    low = np.clip(np.floor(corners.min(axis=1)).astype(int), 0, (shape[1], shape[0]))
    high = np.clip(np.ceil(corners.max(axis=1)).astype(int) + 1, 0, (shape[1], shape[0]))
    (wide, tall), side, other = (high - low).T, corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    double_area = side[:, 0] * other[:, 1] - side[:, 1] * other[:, 0]
    used = np.flatnonzero(np.abs(double_area) > 1e-9)
    parts = np.cumsum((wide * tall)[used]) // PIXELS_AT_ONCE
    for some in np.split(used, np.flatnonzero(np.diff(parts)) + 1):
        count = (wide * tall)[some]
        t = np.repeat(some, count)
        place = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)  # in the window of its triangle
        row, column = low[t, 1] + place // wide[t], low[t, 0] + place % wide[t]
        x, y = column - corners[t, 0, 0], row - corners[t, 0, 1]
        u = (x * other[t, 1] - y * other[t, 0]) / double_area[t]
        v = (side[t, 0] * y - side[t, 1] * x) / double_area[t]
        depth = near[t, 0] + u * (near[t, 1] - near[t, 0]) + v * (near[t, 2] - near[t, 0])
        inside = (u >= 0) & (v >= 0) & (u + v <= 1)
        yield t[inside], (row * shape[1] + column)[inside], depth[inside]
