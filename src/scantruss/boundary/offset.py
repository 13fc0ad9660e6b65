"""The edge of the surface: a smooth curve with corners, slightly beyond the randomly sampled boundary points (Sec. 3.3)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..kernels.surface.local_surface import Surface
from ..scan.vectors import dots, units
from ..settings import Settings
from .corners import CURVE_STEP, NEAREST_CORNERS, find_corners
from .curves import heights_along, outward, resample, room_across, runs_around, smooth_between
from .density import SlidingDisc, density_along
from .four_sides import corners_of_four_sides

SMOOTHING_WINDOW = 0.5  # half width of the window in which the curve is always smoothed [member lengths]
# half widths of wider windows, used where random sampling explains how far they move the curve [member lengths]
WIDER_WINDOWS = (1.0, 2.0, 3.0)
CURVE_PARTS = 6  # a window is never wider than the curve over this number
WINDOW_SHIFT = 2.0  # a wider window may move the curve inwards by this many times the sampling bias
# a wider window may close a bay in which this many points are expected; with up to 1.5 times as many, half of it
POINTS_OF_CLOSED_BAY = 4.0
ROOM_ACROSS = 0.6  # distance to another part of the curve below which the offset is limited [member lengths]
OFFSET_SHARE = 0.25  # largest offset towards another part of the curve, as a share of the distance to it
POINTS_OF_EMPTY_BAY = 6.0  # a corner in a bay where no more points than this are expected does not count
# a bay beside which the boundary goes straight on is closed if no more points than this are expected in it
POINTS_OF_RANDOM_BAY = 10.0
WIDEST_BAY = 0.8  # widest mouth of such a bay [member lengths]
LEAST_BAY = 0.05  # least area of such a bay [square of the member length]
LONGEST_BAY, LENGTHENED = 2.0, 1.2  # longest way around it [member lengths], and least [its mouth]
# lengths of the curve beside it that are its sides [member lengths], and the least cosine of their angles with the mouth
SIDES_OF_BAY, COSINE_OF_SIDE = (0.2, 0.6), 0.92
BAY_REACH = 1.5  # a bay is measured under a chord that starts and ends this far from its middle [member lengths]
BAY_COSINE = 0.7  # least cosine between the direction into a bay and the surface
# mean distance of the surface edge beyond the outermost random points, in the unit of `sampling_bias_of`
MEAN_BEYOND = 0.44
EXACT_ROUGHNESS = 0.1  # roughness of a boundary below which its points lie exactly on the edge [sampling biases]
RANDOM_POINTS = 0.4  # roughness of a boundary above which its points are random [sampling biases]
# share of the sampling bias by which the curve is moved outwards; more would put nodes off the surface
OFFSET_OF_BIAS = 0.6
# sampling bias up to which corners are found at full resolution; beyond it they are looked for more coarsely [member lengths]
CORNERS_SHOW_TO = 0.07
COARSEST_CORNERS = 2.0  # corners are looked for at most this many times more coarsely


@dataclass(frozen=True)
class SamplingBias:
    """How far random sampling keeps points from the edge of the surface."""

    beyond: float  #: mean distance from the boundary points to the edge of the surface [scan unit]
    density: float  #: points per area [1 / scan unit^2]
    disc: SlidingDisc | None = None  #: that touched the points; None if they are as dense everywhere

    def along(self, surface: Surface, curve: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return `beyond` and `density` at each place of a closed curve of equal steps (M, 3), both (M,)."""
        if self.disc is None:
            return np.full(len(curve), self.beyond), np.full(len(curve), self.density)
        density = density_along(surface, curve, self.disc.reach)
        share = mean_beyond(density, self.disc) / mean_beyond(self.density, self.disc)
        return self.beyond * share, density


NO_TIPS = np.zeros((0, 3))
NO_BIAS = SamplingBias(0.0, np.inf)  # what method "paper" assumes


def mean_beyond(density: np.ndarray | float, disc: SlidingDisc) -> np.ndarray:
    """Return how far the surface extends on average beyond random points that a disc touches, by their density (M,) [scan unit].

    For the density rho and a disc of radius r it is `MEAN_BEYOND` rho^(-2/3) r^(-1/3): the disc enters to the depth h at which the
    segment inside the surface, of area (4/3) (2 r)^(1/2) h^(3/2), holds about one point.
    """
    in_member, radii = np.asarray(density) * disc.length**2, disc.radii(np.asarray(density)) / disc.length
    found: np.ndarray = MEAN_BEYOND * disc.length * in_member ** (-2 / 3) * radii ** (-1 / 3)
    return found


def sampling_bias_of(surface: Surface, points: np.ndarray, curve: np.ndarray, disc: SlidingDisc) -> SamplingBias:
    """Return how far the surface extends beyond its boundary points (M, 3), which a disc slid from outside touches.

    Points placed on the edge itself, as in a mesh, hardly rise above the lines through their neighbours: then there is no bias.
    curve : (K, 3) places of equal steps along the points
    """
    density = float(np.median(density_along(surface, curve, disc.reach)))
    of_random_points = float(mean_beyond(density, disc))
    uneven = float(np.median(np.abs(heights_along(surface, points)))) / of_random_points
    random = min(max((uneven - EXACT_ROUGHNESS) / (RANDOM_POINTS - EXACT_ROUGHNESS), 0.0), 1.0)
    return SamplingBias(of_random_points * random, density, disc)


def offset_curve(
    curve: np.ndarray, bias: SamplingBias, settings: Settings, surface: Surface, tips: np.ndarray = NO_TIPS
) -> tuple[np.ndarray, np.ndarray]:
    """Return a closed curve (M, 3) of equal steps through boundary points, the surface to its left, as the surface ends there.

    The curve is moved out by most of the sampling bias, its corners are found, and it is smoothed between them, more strongly
    where random sampling explains what that takes away.

    tips : (P, 3) places of the curve that are pointed corners, whether they are found or not

    Returns
    -------
    smoothed : (K, 3)
    corner_at : (C,) int64, points of it that are corners
    """
    if bias.beyond == 0.0:
        corners = with_tips(*_corners(curve, bias, np.zeros(0), settings, surface), curve, tips, settings.length)
        (narrow,), corner_at = smooth_between(curve, *corners, [round(SMOOTHING_WINDOW / CURVE_STEP)])
        return narrow, corner_at
    step = CURVE_STEP * settings.length
    curve = close_random_bays(curve, bias, settings.length, surface)
    beyond, density = bias.along(surface, curve)
    room = OFFSET_SHARE * room_across(curve, ROOM_ACROSS * settings.length, step)
    curve = curve + np.minimum(OFFSET_OF_BIAS * beyond, room)[:, None] * outward(surface, curve)
    at, places = with_tips(*_corners(curve, bias, density, settings, surface), curve, tips, settings.length)
    halves = [
        round(SMOOTHING_WINDOW / CURVE_STEP),
        *(min(round(wide / CURVE_STEP), len(curve) // CURVE_PARTS) for wide in WIDER_WINDOWS),
    ]
    (narrow, *wider), corner_at = smooth_between(curve, at, places, halves)
    smoothed, out = narrow, outward(surface, wider[-1])
    room = OFFSET_SHARE * room_across(narrow, ROOM_ACROSS * settings.length, step)
    beyond, density = bias.along(surface, narrow)
    for one in wider:
        share = explained(one - narrow, out, room, density * step, WINDOW_SHIFT * beyond)
        smoothed = smoothed + share[:, None] * (one - smoothed)
    return smoothed, corner_at


def with_tips(
    at: np.ndarray, places: np.ndarray, curve: np.ndarray, tips: np.ndarray, length: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return where a curve (M, 3) has corners (C,) and their places (C, 3), with the tips (P, 3) beside which there is none yet."""
    for tip in tips:
        if np.linalg.norm(places - tip, axis=1).min(initial=np.inf) > NEAREST_CORNERS * length:
            nearest = int(np.linalg.norm(curve - tip, axis=1).argmin())
            order = int(np.searchsorted(at, nearest))
            at, places = np.insert(at, order, nearest), np.insert(places, order, curve[nearest], axis=0)
    return at, places


def close_random_bays(curve: np.ndarray, bias: SamplingBias, length: float, surface: Surface) -> np.ndarray:
    """Return a closed curve (M, 3) of equal steps, the surface to its left, without the bays that random sampling makes in straight parts.

    A disc that slides along points drawn at random falls into a gap between them and far into the surface, and the bay looks like a
    corner.
    """
    for _ in range(len(curve)):  # each turn takes away places
        bays = _random_bays(curve, outward(surface, curve), bias.along(surface, curve)[1], length)
        if not bays:
            break
        kept = np.ones(len(curve), np.bool_)
        for begin, places in bays:
            kept[np.arange(begin + 1, begin + places) % len(curve)] = False
        curve = resample(curve[kept], CURVE_STEP * length)
    return curve


def _random_bays(curve: np.ndarray, out: np.ndarray, density: np.ndarray, length: float) -> list[tuple[int, int]]:
    """Return where each bay begins that random sampling explains, and how many steps it takes; of those that overlap the largest."""
    sides = [round(side / CURVE_STEP) for side in SIDES_OF_BAY]
    before = [units(curve - np.roll(curve, side, axis=0)) for side in sides]
    after = [np.roll(ahead, -side, axis=0) for ahead, side in zip(before, sides, strict=True)]
    bays: list[tuple[float, int, int]] = []
    for places in range(4, min(round(LONGEST_BAY / CURVE_STEP), len(curve) // 4) + 1):
        chord = np.roll(curve, -places, axis=0) - curve
        mouth, ahead = np.linalg.norm(chord, axis=1), units(chord)
        beside = [dots(side, ahead) for side in before + [np.roll(side, -places, axis=0) for side in after]]
        goes_on = np.min(beside, axis=0) > COSINE_OF_SIDE
        lengthened = places * CURVE_STEP * length > LENGTHENED * mouth
        at = np.flatnonzero(goes_on & lengthened & (mouth < WIDEST_BAY * length))
        area = _area_to_chord(curve, at, places, out)
        random = (area > LEAST_BAY * length**2) & (area * density[at] <= POINTS_OF_RANDOM_BAY)
        bays += [(-size, begin, places) for size, begin in zip(area[random].tolist(), at[random].tolist(), strict=True)]
    taken, found = np.zeros(len(curve), np.bool_), []
    for _, begin, places in sorted(bays):
        inside = np.arange(begin, begin + places + 1) % len(curve)
        if not taken[inside].any():
            taken[inside] = True
            found.append((begin, places))
    return found


def _area_to_chord(curve: np.ndarray, begin: np.ndarray, places: int, out: np.ndarray) -> np.ndarray:
    """Return the area (C,) between parts of a closed curve (M, 3) and their chords; negative where the curve lies outside its chord."""
    around = (begin[:, None] + np.arange(places + 1)) % len(curve)
    part = curve[around] - curve[around[:, :1]]
    normal = units(np.cross(out[around].mean(axis=1), part[:, -1]))
    area: np.ndarray = -0.5 * dots(np.cross(part[:, :-1], part[:, 1:]).sum(axis=1), normal)
    return area


def length_that_shows_corners(beyond: float, length: float) -> float:
    """Return the least member length with which corners are found at full resolution; both lengths [scan unit].

    `beyond` is the sampling bias at `length`; with the disc it falls as the cube root of the length.
    """
    if beyond <= CORNERS_SHOW_TO * length:
        return length
    return (beyond * length ** (1 / 3) / CORNERS_SHOW_TO) ** 0.75


def _corners(
    curve: np.ndarray, bias: SamplingBias, density: np.ndarray, settings: Settings, surface: Surface
) -> tuple[np.ndarray, np.ndarray]:
    """Return where a curve through boundary points has corners, and their places; not those in bays that random sampling explains."""
    four = corners_of_four_sides(curve, surface, bias.density) if settings.method == "default" else np.zeros((0, 3))
    if len(four):
        at = np.linalg.norm(curve[:, None] - four, axis=2).argmin(axis=0)
        return np.sort(at), four[at.argsort()]
    coarser = min(max(bias.beyond / (CORNERS_SHOW_TO * settings.length), 1.0), COARSEST_CORNERS)
    at, places = find_corners(curve, settings, coarser)
    if len(at) == 0 or bias.beyond == 0.0:
        return at, places
    kept = bays_at(curve, at, outward(surface, curve)) * density[at] > POINTS_OF_EMPTY_BAY
    return at[kept], places[kept]


def bays_at(curve: np.ndarray, at: np.ndarray, out: np.ndarray) -> np.ndarray:
    """Return the areas (C,) of the bays that a closed curve (M, 3) of equal steps makes around some of its places (C,).

    A bay lies between the curve and the chord that reaches `BAY_REACH` to both sides. The area is infinite where there is no bay:
    where the chord lies inside the curve, or above the surface. out : (M, 3) directions outwards.
    """
    half = round(BAY_REACH / CURVE_STEP)
    around = (at[:, None] + np.arange(-half, half + 1)) % len(curve)
    part, outwards = curve[around] - curve[around[:, :1]], out[around].mean(axis=1)
    chord, share = part[:, -1], np.linspace(0.0, 1.0, 2 * half + 1)[:, None]
    across = (chord[:, None] * share - part).sum(axis=1)
    is_bay = dots(across, outwards) > BAY_COSINE * np.linalg.norm(across, axis=1)
    found: np.ndarray = np.where(is_bay, _area_to_chord(curve, around[:, 0], 2 * half, out), np.inf)
    return found


def explained(
    step: np.ndarray, out: np.ndarray, room: np.ndarray, density: np.ndarray, inwards: np.ndarray
) -> np.ndarray:
    """Return the share (M,), 0 to 1, of each step (M, 3) of a closed curve that random sampling explains.

    Steps inwards cut off tongues, which hold points: random ones are no longer than `inwards` (M,). Steps outwards fill bays, which
    hold none: those are random where few points are expected in them.

    Parameters
    ----------
    out : (M, 3) direction outwards
    room : (M,) how far a step may lead outwards
    density : (M,) points to a length of the steps and one place of the curve
    """
    along = dots(step, out)
    outwards = along > 0.0
    run = runs_around(outwards)
    missing = np.bincount(run, np.abs(along) * density)[run]
    roomy = np.divide(room, along, out=np.full(len(along), np.inf), where=outwards)
    bay = np.minimum(2.0 - missing / POINTS_OF_CLOSED_BAY, roomy)
    tongue = 2.0 - np.linalg.norm(step, axis=1) / inwards
    share: np.ndarray = np.clip(np.where(outwards, bay, tongue), 0.0, 1.0)
    return share
