"""Folds that turn over nearly a member: where, and by how much, is read from the normals of the samples across them.

The heights of a wide fillet say little about where its middle lies; the normals of both sides tell where these would meet.
"""

from __future__ import annotations

import math

import numpy as np

from ...runtime.jit import kernel, record_type
from ..geometry.quadric import solve_normal_equations
from ..geometry.vectors import (
    Vector,
    along,
    cross,
    dot,
    norm,
    put_vector,
    row,
    smallest_eigenvector,
    subtract,
    unit,
)
from .local_surface import Surface, flood, walk
from .ridges import LARGEST_GAIN

SIDES_FROM, SIDES_TO = 0.75, 1.6  # the sides of a wide fold are looked at so far from its line [member lengths]
CREST_WITHIN = 0.6  # its crest is fitted to samples so near to its line [member lengths]
HALF_SLAB = 0.6  # only samples so near along the line count: beyond a corner lies another face [member lengths]
# share of the turn that both sides may bend in half a member each: more is a round body, or a wave
STRAIGHT_SIDES = 0.2
EVEN_SIDES = 0.15  # share of the turn by which the normals of a side may scatter: more are waves
NOISE_OF_NORMALS = 0.1  # they may always scatter by this [radian]
HALF_OF_FOLD = 0.5  # the fold turns from so far on one side to so far on the other [member lengths]
FEWEST_OF_SIDE, FEWEST_OF_CREST = 4, 4  # samples
SEARCHES_OF_CREST = 4  # how often the line is moved to where both sides meet
FARTHEST_SHIFT = 0.3  # at most so far each time [member lengths]
SHARE_OF_DIAGONAL = 1e-9  # added to the normal equations of the crest, which a straight row of samples leaves open
TERMS_OF_CREST = 4  # of the crest: 1, u, u^2, t
SUMS_OF_SIDE = record_type(  # over the samples of a side
    count=np.float64,
    away=np.float64,  # distance from the line, half a member less [member lengths]
    angle=np.float64,  # of the normal from the mean normal [radian]
    away_square=np.float64,
    away_angle=np.float64,
    angle_square=np.float64,
    across=np.float64,  # place [member lengths]
    height=np.float64,
)
SIDE = record_type(
    angle=np.float64,  # of its normals half a member from the line [radian]
    rate=np.float64,  # how it changes in a member [radian]
    error=np.float64,  # square of the error of the angle
    scatter=np.float64,  # rms distance of the normals from that line [radian]
    across=np.float64,  # its place at the inner end [member lengths]
    height=np.float64,
)


@kernel
def axis_of_normals(surface: Surface, count: int, place: Vector, towards: Vector) -> tuple[Vector, Vector]:
    """The direction to which normals are as perpendicular as can be, and the mean normal at right angles to it.

    Taken are those of the first `count` samples in the queue that lie beside the place, seen in direction `towards`.
    """
    xx = xy = xz = yy = yz = zz = 0.0
    n = (0.0, 0.0, 0.0)
    for i in range(count):
        s = surface.queue[i]
        if abs(dot(subtract(row(surface.mean, s), place), towards)) <= HALF_SLAB * surface.length:
            m = row(surface.normals, s)
            n = along(n, 1.0, m)
            xx, xy, xz = xx + m[0] * m[0], xy + m[0] * m[1], xz + m[0] * m[2]
            yy, yz, zz = yy + m[1] * m[1], yz + m[1] * m[2], zz + m[2] * m[2]
    e = smallest_eigenvector(xx, xy, xz, yy, yz, zz)
    if dot(e, towards) < 0.0:
        e = (-e[0], -e[1], -e[2])
    return e, unit(along(n, -dot(n, e), e))


@kernel
def fit_wide_fold(surface: Surface, sample: int, place: Vector, towards: Vector, fold: np.record) -> bool:
    """Fit a fold to the normals of the samples around a place; False where there are too few, or its sides bend as much as it does.

    towards : direction of the ridge near by, (0, 0, 0) where it is not known
    fold : `ridges.FOLD`, filled; its gain is the square of the turn over that of its error
    """
    size = surface.length
    sample = walk(surface, sample, place)
    count = flood(surface, sample, place, (SIDES_TO + FARTHEST_SHIFT) * size)
    e, n = axis_of_normals(surface, count, place, towards)
    if norm(towards) == 0.0:
        e, n = axis_of_normals(surface, count, place, e)
    c = cross(e, n)
    line = height = 0.0
    sums, crest, term = np.empty(2, SUMS_OF_SIDE), np.empty((TERMS_OF_CREST, TERMS_OF_CREST + 1)), np.empty(4)
    side = np.empty(2, SIDE)
    for _ in range(SEARCHES_OF_CREST):
        clear_sums(sums)
        crest[:, :] = 0.0
        for i in range(count):
            s = surface.queue[i]
            d, m = subtract(row(surface.mean, s), place), row(surface.normals, s)
            t, u, h = dot(d, e) / size, dot(d, c) / size - line, dot(d, n) / size - height
            w = math.sqrt(u * u + h * h)
            if abs(t) > HALF_SLAB:
                continue
            if w < CREST_WITHIN:
                term[0], term[1], term[2], term[3] = 1.0, u, u * u, t
                for r in range(TERMS_OF_CREST):
                    for k in range(TERMS_OF_CREST):
                        crest[r, k] += term[r] * term[k]
                    crest[r, TERMS_OF_CREST] += term[r] * h
            elif SIDES_FROM < w < SIDES_TO:
                add_sample(sums[0 if u < 0.0 else 1], w - HALF_OF_FOLD, math.atan2(dot(m, c), dot(m, n)), u, h)
        if min(sums[0].count, sums[1].count) < FEWEST_OF_SIDE or crest[0, 0] < FEWEST_OF_CREST:
            return False
        fit_side(sums[0], -1.0, side[0])
        fit_side(sums[1], 1.0, side[1])
        for r in range(TERMS_OF_CREST):
            crest[r, r] += SHARE_OF_DIAGONAL * crest[0, 0]
        apart = math.tan(side[1].angle) - math.tan(side[0].angle)
        if apart == 0.0 or not solve_normal_equations(crest, TERMS_OF_CREST):
            return False
        # a normal at angle a from n towards c is that of the line h = h0 - (u - u0) tan a
        meet = side[1].height + side[1].across * math.tan(side[1].angle)
        meet -= side[0].height + side[0].across * math.tan(side[0].angle)
        step = max(min(meet / apart, FARTHEST_SHIFT), -FARTHEST_SHIFT)
        height += crest[0, TERMS_OF_CREST] + step * (crest[1, TERMS_OF_CREST] + step * crest[2, TERMS_OF_CREST])
        line += step
    turn, own = abs(side[1].angle - side[0].angle), abs(side[1].rate) + abs(side[0].rate)
    uneven = max(side[0].scatter, side[1].scatter)
    if HALF_OF_FOLD * own > STRAIGHT_SIDES * turn or uneven > max(EVEN_SIDES * turn, NOISE_OF_NORMALS):
        return False
    put_vector(fold.place, along(along(place, line * size, c), height * size, n))
    put_vector(fold.ahead, e)
    error = side[0].error + side[1].error
    bend = max(turn - HALF_OF_FOLD * own, 0.0)
    fold.bend, fold.gain = bend, min(bend * bend / max(error, 1.0 / LARGEST_GAIN), LARGEST_GAIN)
    fold.off = surface.step * math.sqrt(error)
    return True


@kernel
def clear_sums(sums: np.ndarray) -> None:
    """Set the sums of both sides (2,) SUMS_OF_SIDE to zero."""
    for one in sums:
        one.count = one.away = one.angle = one.across = one.height = 0.0
        one.away_square = one.away_angle = one.angle_square = 0.0


@kernel
def add_sample(sums: np.record, away: float, angle: float, across: float, height: float) -> None:
    """Add a sample to the sums of its side, SUMS_OF_SIDE."""
    sums.count += 1.0
    sums.away += away
    sums.angle += angle
    sums.away_square += away * away
    sums.away_angle += away * angle
    sums.angle_square += angle * angle
    sums.across += across
    sums.height += height


@kernel
def fit_side(sums: np.record, sign: float, side: np.record) -> None:
    """Fit a SIDE to its sums; sign : -1 or 1, on which side of the line it lies."""
    count, w, a = sums.count, sums.away, sums.angle
    spread = sums.away_square - w * w / count
    rate = (sums.away_angle - w * a / count) / spread if spread > 0.0 else 0.0
    rest = max(sums.angle_square - a * a / count - rate * rate * spread, 0.0) / max(count - 2.0, 1.0)
    mean = w / count
    side.angle, side.rate = a / count - rate * mean, rate
    side.error = rest * (1.0 / count + mean * mean / max(spread, 1.0 / LARGEST_GAIN))
    side.scatter = math.sqrt(rest)
    # the normal midway between the middle of the side and its inner end
    towards = side.angle + 0.5 * rate * mean
    side.across = sums.across / count - sign * mean * math.cos(towards)
    side.height = sums.height / count + sign * mean * math.sin(towards)
