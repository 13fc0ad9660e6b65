"""Beside the surface of a scan: how far places and points are off it, which length is desired there, and what is said of places."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..errors import InputError, unit_words, words_of_number

if TYPE_CHECKING:
    from ..kernels.surface.local_surface import Surface
    from .samples import SurfaceSamples

#: ratios of units, and theirs of feet and inches: places in one of them are read as in another
OTHER_UNITS = (10.0, 100.0, 1000.0, 0.1, 0.01, 0.001, 0.3048, 1 / 0.3048, 25.4, 1 / 25.4, 12.0, 1 / 12.0)
SAMPLES_OF_NOISE, POINTS_OF_NOISE = 1000, 100  # samples from which the noise is taken, and points of each, at most
FAR_SCAN = 2.0  # distance of a scan from zero at which its box tells units apart [its size]


def local_field(surface: Surface, place: np.ndarray) -> float:
    """Desired length at a place: that of the nearest sample [`length`]."""
    return float(surface.field[((surface.mean - place) ** 2).sum(axis=1).argmin()])


def distance_from_scan(surface: Surface, place: np.ndarray) -> float:
    """Distance of a place from the nearest point of the scan."""
    squares = ((surface.mean - place) ** 2).sum(axis=1)
    reach = np.sqrt(squares.min()) + 2.0 * surface.radius
    best = np.inf
    for sample in np.flatnonzero(squares <= reach * reach):
        points = surface.points[surface.start[sample] : surface.start[sample + 1]]
        best = min(best, float(((points - place) ** 2).sum(axis=1).min()))
    return float(np.sqrt(best))


def noise_of_points(samples: SurfaceSamples) -> float:
    """Return how far points lie off their surface: by the heights of a point and of that beside it [scan unit].

    The samples are means of several points each and lie nearer to it; and points that are nearest to each other lie on one level
    where the surface bends within a sample.
    """
    surface = samples.surface
    several = np.flatnonzero(np.diff(surface.start) > 1)
    squares = []
    for sample in several[:: len(several) // SAMPLES_OF_NOISE + 1].tolist():
        own = surface.points[surface.start[sample] : surface.start[sample + 1]]
        own = own[:: len(own) // POINTS_OF_NOISE + 1]
        heights = own @ surface.normals[sample]
        level = own - heights[:, None] * surface.normals[sample]
        apart = ((level[:, None] - level) ** 2).sum(axis=2)
        np.fill_diagonal(apart, np.inf)
        squares.append(0.5 * np.mean((heights - heights[apart.argmin(axis=1)]) ** 2))
    return float(np.sqrt(np.median(squares))) if squares else 0.0


def check_on_scan(
    name: str, line: Sequence[Sequence[float]], samples: SurfaceSamples, length: float, reach: float = 0.5
) -> None:
    """Refuse a polyline with a point farther than half a member from the scan, or than another reach where more is bridged.

    Parameters
    ----------
    name : what it is in messages, such as "fixed line 2"
    line : (K, 3) in the frame of the scan
    length : desired member length [scan unit]
    reach : [member lengths]

    Raises
    ------
    InputError
        Names the point, the nearest point of the scan, and the unit in which all points would lie at it.
    """
    unit = unit_words(samples.unit)
    places = np.array(line, float)
    for k, place in enumerate(places - samples.origin):
        distance = distance_from_scan(samples.surface, place)
        if distance > reach * length:
            raise InputError(
                f"{name}, point {k + 1} {place_text(places[k])} is {words_of_number(distance, 4)}{unit} away from the scan;"
                f" it must lie within half a member, {0.5 * length:.4g}{unit}; {nearest_words(places, place, samples, length)}"
            )


def nearest_words(places: np.ndarray, place: np.ndarray, samples: SurfaceSamples, length: float) -> str:
    """Return which point of the scan is nearest to a place relative to its origin, and in which unit all places would lie at the scan.

    places : (K, 3) in the frame of the scan, all that were given together
    """
    points = samples.measured_points
    words = f"the nearest point is {place_text(points[((points - place) ** 2).sum(axis=1).argmin()] + samples.origin)}"
    for factor in OTHER_UNITS:
        if _suit(factor * places, samples, length):
            at = f"the unit of the scan, {samples.unit}" if samples.unit else "the unit of the scan"
            return f"{words}; times {factor:.5g} all that are given lie at the scan: give them in {at}"
    return words


def _suit(places: np.ndarray, samples: SurfaceSamples, length: float) -> bool:
    """Whether places (K, 3) in another unit lie at the scan: in its box where it is far from zero, else near its surface.

    What lies near zero in any unit tells nothing.
    """
    low, high = samples.measured_points.min(axis=0), samples.measured_points.max(axis=0)
    relative = places - samples.origin
    if np.linalg.norm(samples.origin + 0.5 * (low + high)) > FAR_SCAN * np.linalg.norm(high - low):
        return bool(((relative >= low - length) & (relative <= high + length)).all())
    if np.linalg.norm(places, axis=1).max() <= length:
        return False
    return all(distance_from_scan(samples.surface, each) <= 0.5 * length for each in relative)


def place_text(place: Sequence[float] | np.ndarray) -> str:
    """Return a place as words: its coordinates in brackets."""
    return "(" + ", ".join(f"{c:.10g}" for c in place) + ")"
