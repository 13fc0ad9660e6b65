"""Fixed nodes: the positions that the user appoints (Sec. 4.2), checked."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..errors import InputError, words_of_number
from ..surface.samples import SurfaceSamples, distance_from_scan, local_field

#: ratios of units, and theirs of feet and inches: places in one of them are read as in another
OTHER_UNITS = (10.0, 100.0, 1000.0, 0.1, 0.01, 0.001, 0.3048, 1 / 0.3048, 25.4, 1 / 25.4, 12.0, 1 / 12.0)
FAR_SCAN = 2.0  # distance of a scan from zero at which its box tells units apart [its size]


def check_fixed_positions(
    fixed: Sequence[Sequence[float]] | np.ndarray, samples: SurfaceSamples, length: float
) -> np.ndarray:
    """Return fixed positions relative to the cloud's origin, (K, 3) [scan unit].

    Raises
    ------
    InputError
        A position is farther than length / 2 from the scan, or closer than that to another.
    """
    places = np.array(fixed, float).reshape(-1, 3)
    unit = f" {samples.unit}" if samples.unit else ""
    relative = places - samples.origin
    for k, place in enumerate(relative):
        distance = distance_from_scan(samples.surface, place)
        local = length * local_field(samples.surface, place)
        if distance > 0.5 * local:
            raise InputError(
                f"fixed position {place_text(places[k])} is {words_of_number(distance, 4)}{unit} away from the scan;"
                f" it must lie within half a member, {0.5 * local:.4g}{unit}; {nearest_words(places, place, samples, length)}"
            )
        gaps = np.linalg.norm(relative[:k] - place, axis=1)
        if k and gaps.min() < 0.5 * local * (1 - 1e-9):
            other = places[int(gaps.argmin())]
            raise InputError(
                f"fixed positions {place_text(other)} and {place_text(places[k])} are {gaps.min():.4g}{unit} apart;"
                f" they need half a member, {0.5 * local:.4g}{unit}"
            )
    return relative


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
