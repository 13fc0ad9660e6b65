"""Folds along many lines through the same points: what does not depend on the line is fitted once."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...runtime.jit import kernel
from ..geometry.quadric import REGULARIZATION
from ..geometry.vectors import Vector, dot, vector_of

TERMS_OF_QUADRICS = 6  # terms of a folded surface that do not depend on its line: k0 to k5 of `kernels.surface.ridges`


class QuadricFreePoints(NamedTuple):
    """Points whose heights are freed of a quadric, whichever way the line of a fold runs."""

    basis: np.ndarray  #: (P, TERMS_OF_QUADRICS) orthonormal basis of the quadrics at the points (modified Gram-Schmidt)
    x: np.ndarray  #: (P,) place across [radius]
    y: np.ndarray  #: (P,) place along [radius]
    rest: np.ndarray  #: (P,) height that is left, times the root of the weight [radius]
    root: np.ndarray  #: (P,) root of the weight


@kernel
def _take_out(basis: np.ndarray, count: int, values: np.ndarray) -> float:
    """Free some values (P,) of their shares of the first columns of a basis; returns the sum of their squares."""
    for j in range(count):
        share = 0.0
        for i in range(len(values)):
            share += basis[i, j] * values[i]
        for i in range(len(values)):
            values[i] -= share * basis[i, j]
    squares = 0.0
    for i in range(len(values)):
        squares += values[i] ** 2
    return squares


@kernel
def smooth_part(
    buffer: np.ndarray, taken: int, frame: tuple[Vector, Vector, Vector], radius: float
) -> tuple[QuadricFreePoints, float]:
    """Free the heights of the first points of a buffer of a quadric; returns them with the sum of squares that is left."""
    c, e, n = frame
    points = QuadricFreePoints(
        np.empty((taken, TERMS_OF_QUADRICS)), np.empty(taken), np.empty(taken), np.empty(taken), np.empty(taken)
    )
    whole = 0.0
    for i in range(taken):
        d = vector_of(buffer[i].place)
        x, y, root = dot(d, c) / radius, dot(d, e) / radius, math.sqrt(buffer[i].weight)
        points.basis[i, 0], points.basis[i, 1], points.basis[i, 2] = root, root * x, root * y
        points.basis[i, 3], points.basis[i, 4], points.basis[i, 5] = root * x * x, root * x * y, root * y * y
        points.x[i], points.y[i], points.root[i] = x, y, root
        points.rest[i] = root * dot(d, n) / radius
        whole += buffer[i].weight
    for k in range(TERMS_OF_QUADRICS):
        squares = _take_out(points.basis, k, points.basis[:, k])
        scale = 0.0 if squares <= REGULARIZATION * whole else 1.0 / math.sqrt(squares)
        for i in range(taken):
            points.basis[i, k] *= scale
    return points, _take_out(points.basis, TERMS_OF_QUADRICS, points.rest)


@kernel
def turned_fold_error(points: QuadricFreePoints, squares: float, angle: float, shift: float, rounding: float) -> float:
    """As `fold_error` of a fold whose line is turned by an angle, from what `smooth_part` has left: only k6 and k7 are still fitted."""
    cosine, sine = math.cos(angle), math.sin(angle)
    first, second = np.zeros(TERMS_OF_QUADRICS), np.zeros(TERMS_OF_QUADRICS)
    one = other = both = rise = turn = whole = 0.0
    for i in range(len(points.x)):
        u = cosine * points.x[i] + sine * points.y[i] - shift
        s = points.root[i] * math.sqrt(u * u + rounding * rounding)
        t = u * s
        for k in range(TERMS_OF_QUADRICS):
            first[k] += points.basis[i, k] * s
            second[k] += points.basis[i, k] * t
        one, both, other = one + s * s, both + s * t, other + t * t
        rise, turn = rise + s * points.rest[i], turn + t * points.rest[i]
        whole += points.root[i] ** 2
    for k in range(TERMS_OF_QUADRICS):
        one, both, other = one - first[k] ** 2, both - first[k] * second[k], other - second[k] ** 2
    one, other = one + REGULARIZATION * whole, other + REGULARIZATION * whole
    apart = one * other - both * both
    if apart <= 0.0:
        return np.inf
    return max(squares - (rise * rise * other - 2.0 * rise * turn * both + turn * turn * one) / apart, 0.0)
