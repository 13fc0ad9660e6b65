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
from .ridges import FOLD, LARGEST_GAIN, note_near

SIDES_FROM, SIDES_TO = 0.75, 1.6  # the sides of a wide fold are looked at so far from its line [member lengths]
CREST_WITHIN = 0.6  # its crest is fitted to samples so near to its line [member lengths]
HALF_SLAB = 0.6  # only samples so near along the line count: beyond a corner lies another face [member lengths]
# share of the turn that both sides may bend in half a member each: more is a round body, or a wave
STRAIGHT_SIDES = 0.2
EVEN_SIDES = 0.15  # share of the turn by which the normals of a side may scatter: more are waves
NOISE_OF_NORMALS = 0.1  # they may always scatter by this [radian]
SIDES_CANCEL = 0.7  # length of the mean normal below which the sides turn by more than a right angle
FACES_OUT = 0.5  # least cosine of the angle between the normals of a crest and the direction in which it points
HALF_OF_FOLD = 0.5  # the fold turns from so far on one side to so far on the other [member lengths]
FEWEST_OF_SIDE, FEWEST_OF_CREST = 4, 4  # samples
# turn from which on one sample of the crest is enough: the lip of a thin wall has room for no more
SIDES_TURN_BACK = math.radians(125.0)
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
    """The direction to which normals are as perpendicular as can be, and the direction at right angles to it in which a fold points.

    That is their mean; where they turn so far that both sides nearly cancel, as at a lip, at right angles to the sides. Taken are those
    of the first `count` samples in the queue that lie beside the place, seen in direction `towards`.
    """
    xx = xy = xz = yy = yz = zz = 0.0
    total, n = 0, (0.0, 0.0, 0.0)
    for i in range(count):
        s = surface.queue[i]
        if abs(dot(subtract(row(surface.mean, s), place), towards)) <= HALF_SLAB * surface.length:
            m = row(surface.normals, s)
            n = along(n, 1.0, m)
            xx, xy, xz = xx + m[0] * m[0], xy + m[0] * m[1], xz + m[0] * m[2]
            yy, yz, zz = yy + m[1] * m[1], yz + m[1] * m[2], zz + m[2] * m[2]
            total += 1
    e = smallest_eigenvector(xx, xy, xz, yy, yz, zz)
    if dot(e, towards) < 0.0:
        e = (-e[0], -e[1], -e[2])
    mean = along(n, -dot(n, e), e)
    n = unit(mean)
    if norm(mean) >= SIDES_CANCEL * total:
        return e, n
    c = cross(e, n)
    along_n, both = moment(xx, xy, xz, yy, yz, zz, n, n), moment(xx, xy, xz, yy, yz, zz, n, c)
    turn = 0.5 * math.atan2(2.0 * both, along_n - moment(xx, xy, xz, yy, yz, zz, c, c))  # to where the sides face
    turn += 0.5 * math.pi
    pointing = turned_towards(n, c, turn)
    return e, pointing if dot(pointing, mean) >= 0.0 else (-pointing[0], -pointing[1], -pointing[2])


@kernel
def moment(xx: float, xy: float, xz: float, yy: float, yz: float, zz: float, one: Vector, two: Vector) -> float:
    """Product of a symmetric matrix with two vectors."""
    return (
        one[0] * (xx * two[0] + xy * two[1] + xz * two[2])
        + one[1] * (xy * two[0] + yy * two[1] + yz * two[2])
        + one[2] * (xz * two[0] + yz * two[1] + zz * two[2])
    )


@kernel
def turned_towards(n: Vector, c: Vector, angle: float) -> Vector:
    """The unit vector n, turned towards c by an angle."""
    return along((math.cos(angle) * n[0], math.cos(angle) * n[1], math.cos(angle) * n[2]), math.sin(angle), c)


@kernel
def fit_wide_fold(surface: Surface, sample: int, place: Vector, towards: Vector, fold: np.record) -> bool:
    """Fit a fold to the normals of the samples around a place; False where there are too few, or its sides bend as much as it does.

    The crest lies where the surface crosses the plane midway between both sides, which a lip has too, whose sides never meet.

    towards : direction of the ridge near by, (0, 0, 0) where it is not known
    fold : `ridges.FOLD`, filled; its gain is the square of the turn over that of its error
    """
    size = surface.length
    sample = walk(surface, sample, place)
    count = flood(surface, sample, place, (SIDES_TO + FARTHEST_SHIFT) * size)
    e, n = axis_of_normals(surface, count, place, towards)
    if norm(towards) == 0.0:
        e, n = axis_of_normals(surface, count, place, e)
    at = place
    sums, crest, term = np.empty(2, SUMS_OF_SIDE), np.empty((TERMS_OF_CREST, TERMS_OF_CREST + 1)), np.empty(4)
    side = np.empty(2, SIDE)
    for _ in range(SEARCHES_OF_CREST):
        c = cross(e, n)
        clear_sums(sums)
        crest[:, :] = 0.0
        outwards = 0.0  # more than 0 where the normals of both sides point away from each other
        for i in range(count):
            s = surface.queue[i]
            outwards += dot(subtract(row(surface.mean, s), at), c) * dot(row(surface.normals, s), c)
        for i in range(count):
            s = surface.queue[i]
            d, m = subtract(row(surface.mean, s), at), row(surface.normals, s)
            t, u, h = dot(d, e) / size, dot(d, c) / size, dot(d, n) / size
            w = math.sqrt(u * u + h * h)
            if abs(t) > HALF_SLAB:
                continue
            if w < CREST_WITHIN and dot(m, n) > FACES_OUT:
                term[0], term[1], term[2], term[3] = 1.0, u, u * u, t
                for r in range(TERMS_OF_CREST):
                    for k in range(TERMS_OF_CREST):
                        crest[r, k] += term[r] * term[k]
                    crest[r, TERMS_OF_CREST] += term[r] * h
            elif SIDES_FROM < w < SIDES_TO:
                beside = u if dot(m, n) > FACES_OUT else dot(m, c) * outwards
                add_sample(sums[0 if beside < 0.0 else 1], w - HALF_OF_FOLD, math.atan2(dot(m, c), dot(m, n)), u, h)
        if min(sums[0].count, sums[1].count) < FEWEST_OF_SIDE or crest[0, 0] < 1.0:
            return False
        fit_side(sums[0], -1.0, side[0])
        fit_side(sums[1], 1.0, side[1])
        for r in range(TERMS_OF_CREST):
            crest[r, r] += SHARE_OF_DIAGONAL * crest[0, 0]
        # a normal at angle a from n towards c is that of the line (u - u0) sin a + (h - h0) cos a = 0
        left, right = side[0].angle, side[1].angle
        if crest[0, 0] < FEWEST_OF_CREST and abs(right - left) < SIDES_TURN_BACK:
            return False
        apart = math.sin(right) - math.sin(left)
        if apart == 0.0 or not solve_normal_equations(crest, TERMS_OF_CREST):
            return False
        up = crest[0, TERMS_OF_CREST]
        middle = (side[1].across * math.sin(right) + (side[1].height - up) * math.cos(right)) / apart
        middle -= (side[0].across * math.sin(left) + (side[0].height - up) * math.cos(left)) / apart
        step = max(min(middle, FARTHEST_SHIFT), -FARTHEST_SHIFT)
        up += step * (crest[1, TERMS_OF_CREST] + step * crest[2, TERMS_OF_CREST])
        at = along(along(at, step * size, c), up * size, n)
        n = turned_towards(n, c, 0.5 * (left + right))
    turn, own = abs(side[1].angle - side[0].angle), abs(side[1].rate) + abs(side[0].rate)
    uneven = max(side[0].scatter, side[1].scatter)
    if HALF_OF_FOLD * own > STRAIGHT_SIDES * turn or uneven > max(EVEN_SIDES * turn, NOISE_OF_NORMALS):
        return False
    put_vector(fold.place, at)
    put_vector(fold.ahead, e)
    error = side[0].error + side[1].error
    bend = max(turn - HALF_OF_FOLD * own, 0.0)
    fold.bend, fold.gain = bend, min(bend * bend / max(error, 1.0 / LARGEST_GAIN), LARGEST_GAIN)
    fold.off = surface.step * math.sqrt(error)
    return True


@kernel
def keep_wide_folds(
    surface: Surface, seeds: np.ndarray, apart: float, least: float, sure: float, note: np.ndarray
) -> int:
    """Keep, in front, the seeds (samples) at which a wide fold is fitted, of those nearer than `apart` to each other the first.

    Returns their number.

    least, sure : angle [radian] and gain of the fold, at least
    note : (K,) int64 scratch, zero at the start
    """
    fold = np.empty(1, FOLD)
    kept = 0
    for i in range(len(seeds)):
        if note[i] != 0:
            continue
        note_near(surface, seeds, i, apart, note)
        place = row(surface.mean, seeds[i])
        fits = fit_wide_fold(surface, seeds[i], place, (0.0, 0.0, 0.0), fold[0])
        if fits and fold[0].bend >= least and fold[0].gain >= sure:
            seeds[kept] = seeds[i]
            kept += 1
    return kept


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
