"""Parts alike: how far the vectors of one part of a grid are from those of another, turned about the normals."""

from __future__ import annotations

import numpy as np

from ...runtime.jit import kernel


@kernel
def turned_misfits(
    own: np.ndarray,
    square: np.ndarray,
    count: np.ndarray,
    is_open: np.ndarray,
    others: np.ndarray,
    mirrored: bool,
    over: bool,
    misfit: np.ndarray,
    shift: np.ndarray,
) -> None:
    """Find how far the vectors of each part are from those of others, turned to where they are nearest.

    With the normals on each other, the turn that leaves the least sum of squares between vectors a, b is the argument of
    sum conj(a_xy) b_xy, and the sum is sum |a|^2 + |b|^2 - 2 |sum conj(a_xy) b_xy| - 2 sum a_z b_z. All shifts around a part are tried;
    that of an open one begins with its first vector. Of a mirror image the order is reversed, and a_xy stands for its conjugate; of a part
    that is turned over a_z is negative besides; of the mirror image of that a_z alone.

    Parameters
    ----------
    own : (N, W, 3) vectors of each part, anticlockwise, z along the normal
    square : (N,) sum of the squares of the vectors of each part
    count : (N,) int64, vectors of each part
    is_open : (N,) int64, 1 where the first vector is given
    others : (C,) int64
    mirrored : whether mirror images are alike
    over : whether parts that are turned over are alike
    misfit : (N, C), filled with the root mean square of what is between the vectors; 2 where their numbers or kinds differ
    shift : (N, C) int64, filled: vector j of the other is vector (j + shift) % count of the part; from count on, of its mirror image,
        (shift - j) % count; from 2 count on, of the part turned over, (shift - j) % count; from 3 count on, of the mirror image of
        that, (j + shift) % count
    """
    for v in range(len(count)):
        number = count[v]
        for c in range(len(others)):
            u = others[c]
            misfit[v, c], shift[v, c] = 2.0, 0
            if count[u] != number or is_open[u] != is_open[v] or number == 0:
                continue
            best = -np.inf
            for s in range(1 if is_open[v] == 1 else number):
                real, imaginary, along = 0.0, 0.0, 0.0
                for j in range(number):
                    i = j + s if j + s < number else j + s - number
                    real += own[v, i, 0] * own[u, j, 0] + own[v, i, 1] * own[u, j, 1]
                    imaginary += own[v, i, 0] * own[u, j, 1] - own[v, i, 1] * own[u, j, 0]
                    along += own[v, i, 2] * own[u, j, 2]
                flat = np.sqrt(real * real + imaginary * imaginary)
                if flat + along > best:
                    best = flat + along
                    shift[v, c] = s
                if mirrored and over and flat - along > best:
                    best = flat - along
                    shift[v, c] = s + 3 * number
            if mirrored or over:
                for s in range(number - 1 if is_open[v] == 1 else 0, number):
                    real, imaginary, along = 0.0, 0.0, 0.0
                    for j in range(number):
                        i = s - j if s >= j else s - j + number
                        real += own[v, i, 0] * own[u, j, 0] - own[v, i, 1] * own[u, j, 1]
                        imaginary += own[v, i, 0] * own[u, j, 1] + own[v, i, 1] * own[u, j, 0]
                        along += own[v, i, 2] * own[u, j, 2]
                    flat = np.sqrt(real * real + imaginary * imaginary)
                    if mirrored and flat + along > best:
                        best = flat + along
                        shift[v, c] = s + number
                    if over and flat - along > best:
                        best = flat - along
                        shift[v, c] = s + 2 * number
            misfit[v, c] = np.sqrt(max(square[v] + square[u] - 2.0 * best, 0.0) / number)
