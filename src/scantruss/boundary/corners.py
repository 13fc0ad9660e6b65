"""Corners of a boundary curve: where they are, found from the curve at both sides (Sec. 3.6)."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ..settings import Settings

CURVE_STEP = 0.05  # distance between the points of a boundary curve [member lengths]
# points nearer to a corner than this are rounded off and do not help to locate it [member lengths]
ROUNDED_OFF = 0.15
CUT_OFF = 0.4  # points nearer to a corner than this do not help where the disc has cut off a sharp re-entrant corner [member lengths]
CORNER_REACH = 2.0  # length of the curve on each side from which the place of a corner is found [member lengths]
SHORTEST_SIDE = 0.6  # shortest length of the curve on each side, where another corner is near [member lengths]
# start and end of the part of the curve on each side that shows where a corner may be [member lengths]
SIGHT_ALONG_CURVE = (0.1, 0.8)
CORNER_SPACING = 0.5  # on each side, where a corner turns most; its place lies no farther off [member lengths]
# of corners closer together the sharpest stays: the member between them would be too short [member lengths]
NEAREST_CORNERS = 0.6
CURVED_FIT_RATIO = 6.0  # a side counts as curved if a quadratic fits it this many times better than a line
MOST_ANGLE_RATIO = 1.3  # largest ratio of the angle of a corner to the angle between quadratics fitted to its sides
MEDIAN_TURN_RATIO = 1.7  # a corner turns at least this many times more than the median of its loop
QUARTILE_TURN_RATIO = 1.8  # a corner turns at least this many times more than the upper quartile of its loop
CERTAIN_TURN = 70.0  # a turn this large is a corner in any case [degree]
# a loop no longer than this turns much everywhere: it has no corner if its points lie off a circle by less than that (rms) [member lengths]
SHORT_LOOP, OFF_CIRCLE = 6.5, 0.045


def find_corners(curve: np.ndarray, settings: Settings, coarser: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Return where a closed curve has corners and their exact places.

    A corner is sought where lines fitted to the curve before and after a point differ most in direction. Quadratics must confirm
    it: they distinguish a corner from a bend, while lines are not misled by a ragged boundary. On a ragged loop, which turns everywhere,
    a corner must turn more than the rest. It lies where its two sides meet.

    Parameters
    ----------
    curve : (M, 3) closed curve of steps `CURVE_STEP * length`
    settings : `corner_angle`, `length`
    coarser : factor on the lengths of curve that are examined; larger where points are sparse

    Returns
    -------
    at : (C,) int64 points of the curve next to the corners
    places : (C, 3) the corners
    """
    step = CURVE_STEP / coarser
    if len(curve) < 2 * round(SIGHT_ALONG_CURVE[1] / step) + 2 or _is_round(curve, settings.length):
        return np.zeros(0, np.int64), np.zeros((0, 3))
    turn = _turns(curve, step)
    usual = max(MEDIAN_TURN_RATIO * float(np.median(turn)), QUARTILE_TURN_RATIO * float(np.quantile(turn, 0.75)))
    enough = max(settings.corner_angle, min(usual, CERTAIN_TURN))
    found: list[tuple[float, int, np.ndarray]] = []
    peaks = _peaks(turn, enough)
    for i, reaches in zip(peaks.tolist(), _reaches(peaks, len(curve), step), strict=True):
        for rounded in (ROUNDED_OFF, CUT_OFF) if turn[i] > CERTAIN_TURN else (ROUNDED_OFF,):
            place, angle = _corner(curve, i, reaches, round(rounded / step))
            if angle > enough and np.linalg.norm(place - curve[i]) < CORNER_SPACING * settings.length:
                found.append((angle, i, place))
                break
    return _apart(found, NEAREST_CORNERS * settings.length)


def _is_round(curve: np.ndarray, length: float) -> bool:
    """Whether a closed curve of equal steps (M, 3) is short and a circle but for little."""
    if len(curve) * CURVE_STEP > SHORT_LOOP:
        return False
    flat = (curve - curve.mean(axis=0)) @ np.linalg.svd(curve - curve.mean(axis=0), full_matrices=False)[2][:2].T
    found = np.linalg.lstsq(np.column_stack([flat, np.ones(len(flat))]), (flat**2).sum(axis=1), rcond=None)[0]
    radii = np.linalg.norm(flat - 0.5 * found[:2], axis=1)
    return bool(radii.std() < OFF_CIRCLE * length)


def _peaks(turn: np.ndarray, enough: float) -> np.ndarray:
    """Points (P,) of a closed curve that turn most within `CORNER_SPACING` to both sides, and by more than `enough`."""
    half = round(CORNER_SPACING / CURVE_STEP)
    around = np.concatenate([turn[-half:], turn, turn[:half]])
    highest = np.lib.stride_tricks.sliding_window_view(around, 2 * half + 1).max(axis=1)
    peaks = np.flatnonzero((turn >= highest) & (turn > enough))
    return peaks[np.diff(peaks, append=peaks[:1] + len(turn)) > half]


def _reaches(peaks: np.ndarray, count: int, step: float) -> list[tuple[int, int]]:
    """Steps of the curve before and after each peak that help to locate the corner: up to the next peak."""
    reaches = []
    for k in range(len(peaks)):
        rooms = (peaks[k] - peaks[k - 1], peaks[(k + 1) % len(peaks)] - peaks[k])
        before, after = (int(room) % count if len(peaks) > 1 else count for room in rooms)
        reaches.append((_reach(before, count, step), _reach(after, count, step)))
    return reaches


def _reach(room: int, count: int, step: float) -> int:
    """Steps to fit on one side, given the room to the next corner and the number of steps of the curve."""
    return min(
        max(room - round(ROUNDED_OFF / step), round(SHORTEST_SIDE / step)), round(CORNER_REACH / step), count // 2
    )


def _apart(found: list[tuple[float, int, np.ndarray]], distance: float) -> tuple[np.ndarray, np.ndarray]:
    """The sharpest of corners (angle, point of the curve, place) that lie closer together than a distance, in order."""
    kept: list[tuple[int, np.ndarray]] = []
    for _, i, place in sorted(found, key=lambda corner: (-corner[0], corner[1])):
        if all(np.linalg.norm(place - other) > distance for _, other in kept):
            kept.append((i, place))
    kept.sort(key=lambda corner: corner[0])
    at, places = [i for i, _ in kept], [place for _, place in kept]
    return np.array(at, np.int64), np.array(places, float).reshape(-1, 3)


def _turns(curve: np.ndarray, step: float) -> np.ndarray:
    """Angle (M,) between lines fitted to the curve before and after each place [degree]."""
    offsets = np.arange(round(SIGHT_ALONG_CURVE[0] / step), round(SIGHT_ALONG_CURVE[1] / step) + 1)
    slope = (offsets - offsets.mean()) / ((offsets - offsets.mean()) ** 2).sum()
    count, most = len(curve), int(offsets[-1])
    around = np.concatenate([curve[-most:], curve, curve[:most]])
    after = sum(s * around[most + o : most + o + count] for s, o in zip(slope, offsets.tolist(), strict=True))
    before = -sum(s * around[most - o : most - o + count] for s, o in zip(slope, offsets.tolist(), strict=True))
    cosine = (before * after).sum(axis=1)
    cosine /= np.maximum(np.linalg.norm(before, axis=1) * np.linalg.norm(after, axis=1), 1e-300)
    return np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))


def _corner(curve: np.ndarray, at: int, reaches: tuple[int, int], rounded: int) -> tuple[np.ndarray, float]:
    """Place where the two sides meet near a point of the curve, and the angle between them there [degree].

    Straight sides are fitted by lines. The angle is at most `MOST_ANGLE_RATIO` times that between quadratics, so that a bend is no corner.
    """
    half = round(CORNER_SPACING / CURVE_STEP)
    centre = at
    for _ in range(3):
        sides = [
            _side(curve, centre, tuple(range(sign * rounded, sign * (reach + 1), sign)))
            for sign, reach in zip((-1, 1), reaches, strict=True)
        ]
        place = _meeting(sides[0][0], sides[1][0])
        window = np.arange(at - half, at + half + 1) % len(curve)
        away = ((curve[window] - place) ** 2).sum(axis=1)
        nearest = int(window[np.flatnonzero(away <= away.min() * (1 + 1e-6))[0]])  # the first of equals
        if nearest == centre:
            break
        centre = nearest
    cosines = [_cosine(sides[0][k][1], sides[1][k][1]) for k in (0, 1)]
    straight, bent = np.degrees(np.arccos(np.clip(cosines, -1.0, 1.0))).tolist()
    return place, min(straight, MOST_ANGLE_RATIO * bent)


def _cosine(a: np.ndarray, b: np.ndarray) -> float:
    """Cosine of the angle between two vectors."""
    return float(a @ b) / max(float(np.linalg.norm(a) * np.linalg.norm(b)), 1e-300)


def _side(curve: np.ndarray, at: int, offsets: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Fits to the curve at some steps before or after a point: the better of line and quadratic, and the quadratic.

    Returns
    -------
    better, quadratic : (3, 3) coefficients of 1, s, s^2 [steps]
    """
    steps, terms, to_quadratic, to_line = _fits(offsets)
    places = curve[(at + steps) % len(curve)]
    quadratic, line = to_quadratic @ places, to_line @ places
    error, least = (float(((terms @ found - places) ** 2).sum()) for found in (line, quadratic))
    straight = error < CURVED_FIT_RATIO * least + 1e-6 * float(((places[-1] - places[0]) ** 2).sum())
    return line if straight else quadratic, quadratic


@lru_cache(maxsize=256)
def _fits(offsets: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Least-squares fits at some steps (K,): the steps, terms (K, 3), and the matrices from points to coefficients, (3, K) each."""
    steps = np.array(offsets)
    terms = np.vander(steps.astype(float), 3, increasing=True)
    to_line = np.zeros((3, len(steps)))
    to_line[:2] = np.linalg.pinv(terms[:, :2])
    return steps, terms, np.linalg.pinv(terms), to_line


def _meeting(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Place where two quadratic curves come nearest to each other, near their parameter 0 (Gauss-Newton)."""
    s = t = 0.0
    for _ in range(6):
        gap = after[0] + t * after[1] + t * t * after[2] - before[0] - s * before[1] - s * s * before[2]
        a, b = before[1] + 2 * s * before[2], -(after[1] + 2 * t * after[2])
        aa, ab, bb, ag, bg = (float(u @ v) for u, v in ((a, a), (a, b), (b, b), (a, gap), (b, gap)))
        room = aa * bb - ab * ab
        if room > 1e-12 * aa * bb:
            change = (bb * ag - ab * bg) / room, (aa * bg - ab * ag) / room
        else:  # parallel: each goes half the way
            change = 0.5 * ag / max(aa, 1e-300), 0.5 * bg / max(bb, 1e-300)
        s, t = (min(max(p + c, -0.6 / CURVE_STEP), 0.6 / CURVE_STEP) for p, c in zip((s, t), change, strict=True))
        if max(map(abs, change)) < 1e-9:
            break
    middle: np.ndarray = 0.5 * (
        before[0] + s * before[1] + s * s * before[2] + after[0] + t * after[1] + t * t * after[2]
    )
    return middle
