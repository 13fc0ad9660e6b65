"""Sharp ridges of the scan: where its two sides meet, found by fitting a folded surface to the points around a place.

Heights over the plane of the mean normal are a quadric and a fold along a line in that plane. With u across the line and t along it

    h = k0 + k1 t + k2 t^2 + k3 u + k4 u^2 + k5 u t + k6 s + k7 u s,   s = sqrt(u^2 + w^2)

so both sides are quadrics that meet at u = 0. A sharp fold has w = 0 and its slope jumps there by 2 k6; a rounded one turns by that over
a width of some 2 w. A smooth surface has u^3 in place of the last two.
"""

from __future__ import annotations

import math

import numpy as np

from ...runtime.jit import kernel, record_type
from ..geometry.quadric import REGULARIZATION, solve_normal_equations
from ..geometry.vectors import Vector, along, cross, dot, norm, put_vector, row, subtract, unit, vector_of
from .local_surface import Surface, flood, gather_points, walk
from .turned_folds import QuadricFreePoints, smooth_part, turned_fold_error

EITHER_SIDE = -2.0  # no cosine is so low: the points of both sides of a ridge count
TERMS_OF_FOLD = 8  # terms of the folded surface: k0 to k7
SLOPE_OF_SIDE, BEND_OF_SIDE, TERMS_OF_SIDE = 1, 2, 4  # of a side: 1, s, s^2 and t, with s the distance from the crest
FOLD = record_type(
    place=(np.float64, 3),  # on the crest [scan unit]
    ahead=(np.float64, 3),  # unit vector along the crest
    bend=np.float64,  # angle by which the fold turns within a member [radian]
    gain=np.float64,  # over a smooth surface (F statistic)
    off=np.float64,  # rms distance of the points [scan unit]
)
ROUNDINGS_TRIED = (0.0, 0.12, 0.25, 0.4)  # w of the folds that are tried [member lengths]
CLEARLY_BETTER = 0.9  # share of the error of a sharper fold below which one that is more rounded is taken
FIRST_ROUNDING = 0.12  # w while the line is looked for [member lengths]
SHIFTS_TRIED, TURNS_TRIED = 5, 5  # lines tried across and around in each round
# how far the outermost of them lie from the middle one in the first round [radius, radian], and by how much they close up with each
FIRST_SHIFT, FIRST_TURN, NARROWED = 0.4, 0.35, 0.4
# rounds in which the line is looked for with the first rounding; all, then sharp and as it is rounded
ROUNDED_FITS, FOLD_FITS = 2, 5
NEAR_THE_LINE = 0.375  # points nearer to the line than this are left out where its sides are measured: a fold may be rounded [radius]
MIDDLE_OF_SIDES = 0.5 * (1.0 + NEAR_THE_LINE)  # of the points that are taken [radius]
# how far from the line the sides of a rounded fold may meet, at least and at most [radius]
LEAST_MEETING, FARTHEST_MEETING = 0.2, 0.4
SHARP_ENOUGH = 0.7  # angle of a fold from which the place where its sides meet is certain enough [radian]
FEWEST_OF_FLANK = 6  # fewest points of a side
POINTS_OF_FIRST_LOOK = 2  # points of a sample that are looked at first
FEWEST_OF_FIRST_LOOK, FEWEST_OF_FOLD = 20, 30  # fewest points in a first look, in a fit
SHIFT_OF_FIRST_LOOK = 0.25  # lines that are tried in a first look lie so far to both sides of the middle [radius]
STEPS_TO_DIRECTION = 8  # steps of the power method, by far enough for a direction that matters
LARGEST_GAIN = 1e9  # where the points lie exactly on the fold


@kernel
def bends_of_samples(surface: Surface, bends: np.ndarray) -> None:
    """Least cosine between the normal of each sample and those of its neighbours, (S,)."""
    for s in range(len(surface.mean)):
        least = 1.0
        n = row(surface.normals, s)
        for k in range(surface.neighbors.shape[1]):
            m = surface.neighbors[s, k]
            if m < 0:
                break
            least = min(least, dot(n, row(surface.normals, m)))
        bends[s] = least


@kernel
def mean_normal(surface: Surface, sample: int, place: Vector, radius: float) -> tuple[Vector, Vector]:
    """Mean of the normals of the samples around a place, and the direction at right angles to it in which they differ most."""
    count = flood(surface, sample, place, radius)
    n = (0.0, 0.0, 0.0)
    for i in range(count):
        n = along(n, 1.0, row(surface.normals, surface.queue[i]))
    n = unit(n)
    # the direction of the largest spread by some steps of the power method
    c = (0.0, 0.0, 0.0)
    best = 0.0
    for i in range(count):
        m = row(surface.normals, surface.queue[i])
        m = along(m, -dot(m, n), n)
        if norm(m) > best:
            best, c = norm(m), m
    for _ in range(STEPS_TO_DIRECTION):
        total = (0.0, 0.0, 0.0)
        for i in range(count):
            m = row(surface.normals, surface.queue[i])
            m = along(m, -dot(m, n), n)
            total = along(total, dot(m, c), m)
        if norm(total) == 0.0:
            break
        c = unit(total)
    return n, c


@kernel
def fold_error(
    buffer: np.ndarray,
    taken: int,
    frame: tuple[Vector, Vector, Vector],
    shift: float,
    radius: float,
    folded: bool,
    rounding: float,
    matrix: np.ndarray,
) -> float:
    """Weighted sum of squared distances of the points from the best folded (or smooth) surface; its terms into the last column.

    frame : across, along, normal; shift : place of the line across [radius]; rounding : w [radius]. Lengths count in radii. Infinite
    where none fits.
    """
    c, e, n = frame
    term = np.empty(TERMS_OF_FOLD + 1)
    matrix[:, :] = 0.0
    squares = 0.0
    for i in range(taken):
        d = vector_of(buffer[i].place)
        u, t, h = dot(d, c) / radius - shift, dot(d, e) / radius, dot(d, n) / radius
        size = math.sqrt(u * u + rounding * rounding)
        term[0], term[1], term[2], term[3], term[4], term[5] = 1.0, t, t * t, u, u * u, u * t
        term[6], term[7] = (size, u * size) if folded else (u * u * u, 0.0)
        term[TERMS_OF_FOLD] = h
        w = buffer[i].weight
        squares += w * h * h
        for r in range(TERMS_OF_FOLD):
            wr = w * term[r]
            for k in range(r, TERMS_OF_FOLD + 1):
                matrix[r, k] += wr * term[k]
    right = np.empty(TERMS_OF_FOLD)
    for r in range(TERMS_OF_FOLD):
        for k in range(r):
            matrix[r, k] = matrix[k, r]
        matrix[r, r] += REGULARIZATION * matrix[0, 0]
        right[r] = matrix[r, TERMS_OF_FOLD]
    if not solve_normal_equations(matrix, TERMS_OF_FOLD):
        return np.inf
    for r in range(TERMS_OF_FOLD):
        squares -= right[r] * matrix[r, TERMS_OF_FOLD]
    return max(squares, 0.0)


@kernel
def jump_of(matrix: np.ndarray, rounding: float, reach: float) -> float:
    """Angle by which a fold turns from `reach` before its line to as far behind it, the bend of the sides aside [radian]."""
    slope, jump = (
        matrix[3, TERMS_OF_FOLD],
        matrix[6, TERMS_OF_FOLD] * reach / math.sqrt(reach * reach + rounding * rounding),
    )
    return abs(math.atan(slope + jump) - math.atan(slope - jump))


@kernel
def flank(
    buffer: np.ndarray,
    taken: int,
    frame: tuple[Vector, Vector, Vector],
    crest: tuple[float, float],
    radius: float,
    side: float,
) -> tuple[float, float, float, float, bool]:
    """One side (1 or -1) of a fold in the plane across it; whether it could be fitted is returned last.

    Its direction and how much it bends [radian]; how far across and how high its middle is [radius].

    crest : place of the line across and its height [radius]. Taken are the points between NEAR_THE_LINE and 1 radius from it.
    """
    c, e, n = frame
    term = np.empty(TERMS_OF_SIDE)
    across, up = np.zeros((TERMS_OF_SIDE, TERMS_OF_SIDE + 1)), np.zeros((TERMS_OF_SIDE, TERMS_OF_SIDE + 1))
    points = 0
    for i in range(taken):
        d = vector_of(buffer[i].place)
        u, h = side * (dot(d, c) / radius - crest[0]), dot(d, n) / radius - crest[1]
        s = math.sqrt(u * u + h * h)
        if u > 0.0 and NEAR_THE_LINE < s < 1.0:
            points += 1
            s -= MIDDLE_OF_SIDES
            term[0], term[1], term[2], term[3] = 1.0, s, s * s, dot(d, e) / radius
            for r in range(TERMS_OF_SIDE):
                for k in range(TERMS_OF_SIDE):
                    across[r, k] += buffer[i].weight * term[r] * term[k]
                across[r, TERMS_OF_SIDE] += buffer[i].weight * term[r] * u
                up[r, TERMS_OF_SIDE] += buffer[i].weight * term[r] * h
    for r in range(TERMS_OF_SIDE):
        across[r, r] += REGULARIZATION * across[0, 0]
        for k in range(TERMS_OF_SIDE):
            up[r, k] = across[r, k]
    if (
        points < FEWEST_OF_FLANK
        or not solve_normal_equations(across, TERMS_OF_SIDE)
        or not solve_normal_equations(up, TERMS_OF_SIDE)
    ):
        return 0.0, 0.0, 0.0, 0.0, False
    half = 1.0 - MIDDLE_OF_SIDES
    slope_across, bend_across = across[SLOPE_OF_SIDE, TERMS_OF_SIDE], across[BEND_OF_SIDE, TERMS_OF_SIDE]
    slope_up, bend_up = up[SLOPE_OF_SIDE, TERMS_OF_SIDE], up[BEND_OF_SIDE, TERMS_OF_SIDE]
    outer = math.atan2(slope_up + 2.0 * half * bend_up, slope_across + 2.0 * half * bend_across)
    inner = math.atan2(slope_up - 2.0 * half * bend_up, slope_across - 2.0 * half * bend_across)
    return math.atan2(slope_up, slope_across), outer - inner, across[0, TERMS_OF_SIDE], up[0, TERMS_OF_SIDE], True


@kernel
def bend_of(
    buffer: np.ndarray, taken: int, frame: tuple[Vector, Vector, Vector], crest: tuple[float, float], radius: float
) -> tuple[float, float]:
    """Angle between both sides of a fold [radian], and how far across its line both sides would meet [radius].

    The angle is less what the sides would turn if they bent on between them as they do themselves.
    """
    left, left_bend, left_at, left_up, fits_left = flank(buffer, taken, frame, crest, radius, -1.0)
    right, right_bend, right_at, right_up, fits_right = flank(buffer, taken, frame, crest, radius, 1.0)
    if not (fits_left and fits_right):
        return 0.0, 0.0
    turn, own = left + right, 0.5 * (left_bend + right_bend)
    if turn < 0.0:
        turn, own = -turn, -own
    # right: up = right_up + (u - right_at) tan(right); left: up = left_up - (u + left_at) tan(left)
    apart = math.tan(right) + math.tan(left)
    meet = (left_up - left_at * math.tan(left) - right_up + right_at * math.tan(right)) / apart if apart != 0.0 else 0.0
    return max(turn - max(own, 0.0) * MIDDLE_OF_SIDES / (1.0 - MIDDLE_OF_SIDES), 0.0), meet


@kernel
def is_folded(surface: Surface, sample: int, radius: float, least: float, buffer: np.ndarray) -> bool:
    """Whether a few points around a sample look as if they were folded by an angle of at least `least` [radian]."""
    place = row(surface.mean, sample)
    n, c = mean_normal(surface, sample, place, radius)
    count = flood(surface, sample, place, radius + 0.5 * surface.step)
    taken = gather_points(surface, count, place, radius, POINTS_OF_FIRST_LOOK, n, EITHER_SIDE, buffer)
    if taken < FEWEST_OF_FIRST_LOOK or norm(c) < 0.5:
        return False
    matrix = np.empty((TERMS_OF_FOLD, TERMS_OF_FOLD + 1))
    frame = turned_frame(c, n, 0.0)
    error, bend = np.inf, 0.0
    rounding, reach = FIRST_ROUNDING * surface.length / radius, 0.5 * surface.length / radius
    for j in range(3):
        found = fold_error(buffer, taken, frame, SHIFT_OF_FIRST_LOOK * (j - 1), radius, True, rounding, matrix)
        if found < error:
            error, bend = found, jump_of(matrix, rounding, reach)
    return bend >= least


@kernel
def note_near(surface: Surface, seeds: np.ndarray, i: int, apart: float, note: np.ndarray) -> None:
    """Note the seeds (samples) after seed i that are nearer to it than `apart`; note : (K,) int64, 1 for these."""
    place = row(surface.mean, seeds[i])
    for j in range(i + 1, len(seeds)):
        d = subtract(row(surface.mean, seeds[j]), place)
        if dot(d, d) < apart * apart:
            note[j] = 1


@kernel
def keep_folded(
    surface: Surface, seeds: np.ndarray, radius: float, least: float, apart: float, buffer: np.ndarray, note: np.ndarray
) -> int:
    """Keep, in front, the seeds (samples) that look folded, of those nearer than `apart` to each other the first; returns their number.

    note : (K,) int64 scratch, zero at the start
    """
    kept = 0
    for i in range(len(seeds)):
        if note[i] != 0:
            continue
        note_near(surface, seeds, i, apart, note)
        if is_folded(surface, seeds[i], radius, least, buffer):
            seeds[kept] = seeds[i]
            kept += 1
    return kept


@kernel
def best_rounding(
    points: QuadricFreePoints, squares: float, angle: float, shift: float, member: float
) -> tuple[float, float]:
    """Error of the folds along a line of the sharpest rounding that fits, and that rounding [radius]; member : its length [radius]."""
    least, best = np.inf, 0.0
    for w in ROUNDINGS_TRIED:
        error = turned_fold_error(points, squares, angle, shift, w * member)
        if error < CLEARLY_BETTER * least:
            least, best = error, w * member
    return least, best


@kernel
def fit_fold(
    surface: Surface, sample: int, place: Vector, towards: Vector, radius: float, buffer: np.ndarray, fold: np.record
) -> bool:
    """Fit a folded surface around a place; False where there are too few points.

    towards : direction of the ridge near by, (0, 0, 0) where it is not known
    fold : FOLD, filled
    """
    sample = walk(surface, sample, place)
    n, c = mean_normal(surface, sample, place, radius)
    if norm(towards) > 0.0:
        c = unit(cross(towards, n))
    count = flood(surface, sample, place, radius + 0.5 * surface.step)
    taken = gather_points(surface, count, place, radius, int(surface.patch_points), n, EITHER_SIDE, buffer)
    if taken < FEWEST_OF_FOLD or norm(c) < 0.5:
        return False
    matrix = np.empty((TERMS_OF_FOLD, TERMS_OF_FOLD + 1))
    points, squares = smooth_part(buffer, taken, turned_frame(c, n, 0.0), radius)
    angle = shift = 0.0
    reach, swing = FIRST_SHIFT, FIRST_TURN
    least = np.inf
    rounding = FIRST_ROUNDING * surface.length / radius
    for turn in range(FOLD_FITS):
        if turn == ROUNDED_FITS and least < np.inf:
            rounding = 0.0
            least = turned_fold_error(points, squares, angle, shift, rounding)
        if turn == FOLD_FITS - 1 and least < np.inf:
            least, rounding = best_rounding(points, squares, angle, shift, surface.length / radius)
        at_angle, at_shift = angle, shift
        for i in range(TURNS_TRIED):
            for j in range(SHIFTS_TRIED):
                a = at_angle + swing * (2.0 * i / (TURNS_TRIED - 1) - 1.0)
                b = at_shift + reach * (2.0 * j / (SHIFTS_TRIED - 1) - 1.0)
                error = turned_fold_error(points, squares, a, b, rounding)
                if error < least:
                    least, angle, shift = error, a, b
        if turn != ROUNDED_FITS:  # a sharp fold may lie a little beside
            reach, swing = NARROWED * reach, NARROWED * swing
    if least == np.inf:
        return False
    frame = turned_frame(c, n, angle)
    smooth = fold_error(buffer, taken, frame, shift, radius, False, 0.0, matrix)
    least = fold_error(buffer, taken, frame, shift, radius, True, rounding, matrix)
    total = 0.0
    for i in range(taken):
        total += buffer[i].weight
    across, ahead, _ = frame
    crest = matrix[0, TERMS_OF_FOLD] + matrix[6, TERMS_OF_FOLD] * rounding
    fold.bend, meet = bend_of(buffer, taken, frame, (shift, crest), radius)
    aside = rounding > 0.0 or abs(meet) > LEAST_MEETING  # then the line is not yet the crest
    if aside and abs(meet) < FARTHEST_MEETING and fold.bend > SHARP_ENOUGH:
        size = math.sqrt(meet * meet + rounding * rounding)
        crest = matrix[0, TERMS_OF_FOLD] + meet * (matrix[3, TERMS_OF_FOLD] + meet * matrix[4, TERMS_OF_FOLD])
        crest += size * (matrix[6, TERMS_OF_FOLD] + meet * matrix[7, TERMS_OF_FOLD])
        shift += meet
    put_vector(fold.place, along(along(place, shift * radius, across), crest * radius, n))
    put_vector(fold.ahead, unit(along(ahead, matrix[1, TERMS_OF_FOLD], n)))
    fold.gain = min((smooth - least) * taken / max(least, 1e-12), LARGEST_GAIN)
    fold.off = radius * math.sqrt(least / max(total, 1e-300))
    return True


@kernel
def points_around(
    surface: Surface, sample: int, place: Vector, radius: float, buffer: np.ndarray
) -> tuple[float, float, float, int]:
    """Mean normal around a place; the points of both sides, relative to it, into the buffer, and their number."""
    n, _ = mean_normal(surface, sample, place, radius)
    count = flood(surface, sample, place, radius + surface.step)
    taken = gather_points(surface, count, place, radius, int(surface.patch_points), n, EITHER_SIDE, buffer)
    return n[0], n[1], n[2], taken


@kernel
def turned_frame(c: Vector, n: Vector, angle: float) -> tuple[Vector, Vector, Vector]:
    """The directions across, along and normal to a line whose across has been turned by an angle about the normal."""
    side = cross(n, c)
    across = along((math.cos(angle) * c[0], math.cos(angle) * c[1], math.cos(angle) * c[2]), math.sin(angle), side)
    return across, cross(n, across), n
