"""The corners of an opening with four straight sides, such as a window, found from all of its boundary at once.

Where the sides are short, two corners are in sight of one another, the curve turns everywhere, and no place of it stands out as a corner.
"""

from __future__ import annotations

import numpy as np

from ..kernels.surface.local_surface import Surface
from .corners import CURVE_STEP

# loops of these lengths are looked at: on shorter ones too few points tell four sides from a circle [member lengths]
SHORTEST_LOOP, LONGEST_LOOP = 5.0, 24.0
EVERY = 2  # only each second point of the curve is looked at
NEAR_CORNER = 0.2  # points nearer to a corner than this are rounded off [member lengths]
SHORTEST = 0.6  # shortest side [member lengths]
MOST_OFF_SIDES = 0.08  # largest distance of the points from the sides (rms) [member lengths]
# the same as a share of the distance from the best ellipse, which has no corners
MOST_OF_ELLIPSE = 0.8
LEAST_TURN = 40.0  # least angle between two sides [degree]
MOST_CUT_OFF = 0.45  # largest distance of a corner from the curve, which cuts it off [member lengths]
INSIDE = 0.1  # distance from the sides from which a point lies inside the opening [member lengths]
# most points inside, as a share of those that are expected between the curve and the corners if these are rounded; one is an outlier
MOST_INSIDE = 0.3
BESIDE_PLANE = 0.5  # height over the plane of the opening up to which points count [member lengths]


def corners_of_four_sides(curve: np.ndarray, surface: Surface, density: float) -> np.ndarray:
    """Return the corners (4, 3) of a closed curve (M, 3) of equal steps that runs along four straight sides; none (0, 3) if it does not.

    The sides are the four lines that fit it best of all. They must fit it better than an ellipse and meet close to it, and the scan
    must have hardly a point between the curve and the corners: an opening with rounded corners has them.

    density : points per area beside the curve [1 / scan unit^2]
    """
    length = surface.length
    none = np.zeros((0, 3))
    places = curve[::EVERY]
    if not SHORTEST_LOOP <= len(places) * EVERY * CURVE_STEP <= LONGEST_LOOP:
        return none
    middle = places.mean(axis=0)
    axes = np.linalg.svd(places - middle, full_matrices=False)[2]
    flat = (places - middle) @ axes[:2].T / length
    ends, squares = _best_four(_off_lines(flat))
    off, off_ellipse = (squares / len(flat)) ** 0.5, _off_ellipse(flat)
    if off > min(MOST_OFF_SIDES, MOST_OF_ELLIPSE * off_ellipse):
        return none
    found = _meetings(flat, ends)
    away = np.linalg.norm(flat[:, None] - found, axis=2).min(axis=0)
    if len(found) < 4 or away.max() > MOST_CUT_OFF:
        return none
    points = (surface.points - middle) @ axes.T / length
    inside = int((_depth(points[np.abs(points[:, 2]) < BESIDE_PLANE, :2], found) > INSIDE).sum())
    cut_off = np.maximum(away - np.sqrt(2.0) * INSIDE, 0.0)  # the height of a triangle of this area in a right angle
    if inside > max(1.0, MOST_INSIDE * density * length**2 * float((cut_off**2).sum())):
        return none
    heights = np.linalg.lstsq(_paraboloid(flat), (places - middle) @ axes[2], rcond=None)[0]
    corners: np.ndarray = middle + length * found @ axes[:2] + (_paraboloid(found) @ heights)[:, None] * axes[2]
    return corners


def _steps(share: float) -> int:
    """Return a length of the curve [member lengths] in places that are looked at."""
    return round(share / (EVERY * CURVE_STEP))


def _off_lines(flat: np.ndarray) -> np.ndarray:
    """Return the squared distances (N, N), summed, of a closed curve (N, 2) from place to place from the line that fits it there."""
    count, cut = len(flat), _steps(NEAR_CORNER)
    twice = np.concatenate([flat, flat])
    x, y = twice.T
    sums = np.cumsum(np.column_stack([x, y, x * x, y * y, x * y]), axis=0)
    sums = np.concatenate([np.zeros((1, 5)), sums])
    begin, sides = np.arange(count)[:, None], np.arange(_steps(SHORTEST), count - 2)
    taken = sides - 2 * cut + 1
    sx, sy, sxx, syy, sxy = np.moveaxis(sums[begin + sides - cut + 1] - sums[begin + cut], 2, 0)
    xx, yy, xy = sxx - sx * sx / taken, syy - sy * sy / taken, sxy - sx * sy / taken
    least = 0.5 * (xx + yy) - np.sqrt(0.25 * (xx - yy) ** 2 + xy**2)
    squares = np.full((count, count), np.inf)
    squares[begin, (begin + sides) % count] = np.maximum(least, 0.0) * sides / taken
    return squares


def _best_four(squares: np.ndarray) -> tuple[list[int], float]:
    """Return the four places, in order, between which the sides have the least sum of squares, and that sum."""
    count = len(squares)
    two, between = np.full((count, count), np.inf), np.zeros((count, count), np.int64)
    for i in range(count):
        by = squares[:, i : i + 1] + squares[i]
        better = by < two
        two[better], between[better] = by[better], i
    first, third = np.unravel_index(int((two + two.T).argmin()), two.shape)
    ends = sorted([int(first), int(between[first, third]), int(third), int(between[third, first])])
    return ends, float(two[first, third] + two[third, first])


def _meetings(flat: np.ndarray, ends: list[int]) -> np.ndarray:
    """Return where the lines along a closed curve (N, 2) from end to end meet (4, 2); fewer if two of them hardly turn."""
    count, cut, sides = len(flat), _steps(NEAR_CORNER), []
    for begin, end in zip(ends, [*ends[1:], ends[0] + count], strict=True):
        part = flat[np.arange(begin + cut, end - cut + 1) % count]
        along = np.linalg.svd(part - part.mean(axis=0), full_matrices=False)[2][0]
        sides.append((part.mean(axis=0), along * np.sign(along @ (part[-1] - part[0]))))
    found = []
    for (before, came), (after, goes) in zip([sides[-1], *sides[:-1]], sides, strict=True):
        if abs(float(came @ goes)) < np.cos(np.radians(LEAST_TURN)):
            found.append(before + came * np.linalg.solve(np.column_stack([came, -goes]), after - before)[0])
    return np.array(found).reshape(-1, 2)


def _paraboloid(flat: np.ndarray) -> np.ndarray:
    """Return the terms (N, 6) of a paraboloid at some places (N, 2)."""
    x, y = flat.T
    return np.column_stack([np.ones(len(flat)), x, y, x * x, x * y, y * y])


def _off_ellipse(flat: np.ndarray) -> float:
    """Return the distance (rms) of places (N, 2) from the ellipse that fits them, about."""
    size = float(np.abs(flat).max())
    x, y = flat.T / size
    terms = np.column_stack([x * x, x * y, y * y, x, y])
    xx, xy, yy, x1, y1 = found = np.linalg.lstsq(terms, np.ones(len(x)), rcond=None)[0]
    value = terms @ found - 1.0
    slope = np.hypot(2 * xx * x + xy * y + x1, xy * x + 2 * yy * y + y1)
    return float(np.sqrt(np.mean((size * value / np.maximum(slope, 1e-9)) ** 2)))


def _depth(places: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Return how far inside of the nearest side of a convex polygon (K, 2) some places (N, 2) lie; negative outside."""
    ahead = np.roll(corners, -1, axis=0) - corners
    normals = np.column_stack([-ahead[:, 1], ahead[:, 0]]) / np.linalg.norm(ahead, axis=1)[:, None]
    towards = np.sign(normals[0] @ (corners.mean(axis=0) - corners[0]))
    depth: np.ndarray = (towards * (places @ normals.T - (normals * corners).sum(axis=1))).min(axis=1)
    return depth
