"""Folds along many lines through the same points: what does not depend on the line is fitted once."""

from __future__ import annotations

import math

import numpy as np

from ...runtime.jit import kernel
from ..geometry.quadric import WEIGHT
from ..geometry.vectors import Vector, dot

QUADRICS = 6  # terms of a folded surface that do not depend on its line: k0 to k5 of `kernels.surface.ridges`
PLACE_X, PLACE_Y, REST, ROOT_OF_WEIGHT, TABLE_COLUMNS = 6, 7, 8, 9, 10  # columns of `smooth_part` behind these


@kernel
def smooth_part(buffer: np.ndarray, frame: tuple[Vector, Vector, Vector], radius: float, table: np.ndarray) -> float:
    """Return what is left, as a sum of squares, of the heights of the first P points once they are freed of a quadric.

    table : (P, TABLE_COLUMNS), filled. Its columns are an orthonormal basis of the quadrics, k0 to k5 whichever way the line runs
        (modified Gram-Schmidt), the place (x, y) of each point across and along [radius], its height that is left, and the root of its
        weight.
    """
    c, e, n = frame
    taken = len(table)
    whole = squares = 0.0
    for i in range(taken):
        d = (buffer[i, 0], buffer[i, 1], buffer[i, 2])
        x, y, root = dot(d, c) / radius, dot(d, e) / radius, math.sqrt(buffer[i, WEIGHT])
        table[i, 0], table[i, 1], table[i, 2] = root, root * x, root * y
        table[i, 3], table[i, 4], table[i, 5] = root * x * x, root * x * y, root * y * y
        table[i, PLACE_X], table[i, PLACE_Y], table[i, ROOT_OF_WEIGHT] = x, y, root
        table[i, REST] = root * dot(d, n) / radius
        whole += buffer[i, WEIGHT]
    for k in range(QUADRICS + 1):
        column = k if k < QUADRICS else REST
        for j in range(k):
            share = 0.0
            for i in range(taken):
                share += table[i, j] * table[i, column]
            for i in range(taken):
                table[i, column] -= share * table[i, j]
        squares = 0.0
        for i in range(taken):
            squares += table[i, column] ** 2
        scale = 0.0 if squares <= 1e-9 * whole else 1.0 / math.sqrt(squares)
        for i in range(taken if k < QUADRICS else 0):
            table[i, column] *= scale
    return squares


@kernel
def turned_fold_error(table: np.ndarray, squares: float, angle: float, shift: float, rounding: float) -> float:
    """As `fold_error` of a fold whose line is turned by an angle, from what `smooth_part` has left: only k6 and k7 are still fitted."""
    cosine, sine = math.cos(angle), math.sin(angle)
    first, second = np.zeros(QUADRICS), np.zeros(QUADRICS)
    one = other = both = rise = turn = whole = 0.0
    for i in range(len(table)):
        u = cosine * table[i, PLACE_X] + sine * table[i, PLACE_Y] - shift
        s = table[i, ROOT_OF_WEIGHT] * math.sqrt(u * u + rounding * rounding)
        t = u * s
        for k in range(QUADRICS):
            first[k] += table[i, k] * s
            second[k] += table[i, k] * t
        one, both, other = one + s * s, both + s * t, other + t * t
        rise, turn = rise + s * table[i, REST], turn + t * table[i, REST]
        whole += table[i, ROOT_OF_WEIGHT] ** 2
    for k in range(QUADRICS):
        one, both, other = one - first[k] ** 2, both - first[k] * second[k], other - second[k] ** 2
    one, other = one + 1e-9 * whole, other + 1e-9 * whole
    apart = one * other - both * both
    if apart <= 0.0:
        return np.inf
    return max(squares - (rise * rise * other - 2.0 * rise * turn * both + turn * turn * one) / apart, 0.0)
