"""Fixed nodes: the positions that the user appoints (Sec. 4.2), checked."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..errors import InputError, words_of_number
from ..surface.near_scan import distance_from_scan, local_field, nearest_words, place_text
from ..surface.samples import SurfaceSamples


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
