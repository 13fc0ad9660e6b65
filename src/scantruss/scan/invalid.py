"""Values that no scan has: no-data values, and what a wrong byte order makes of coordinates."""

from __future__ import annotations

import numpy as np

from ..errors import InputError
from .extent import bulk_of

POINTS_LOOKED_AT = 2_000  # points that tell where most of them lie
FEWEST_POINTS = 100  # points that tell it
FARTHEST_FROM_MIDDLE = 1e6  # widths of the middle half of a scan from its middle, beyond which a point is none of it
MOST_INVALID_SHARE = 0.01  # share of the points that are left out; more are a fault of the file
EXTENTS = (1e-30, 1e30)  # of a scan in any unit; swapped bytes of a whole number make less than the one, of others more
CAUSE = "the file is damaged, its byte order wrong, or it has no-data values"


def find_invalid(points: np.ndarray, lower: np.ndarray, upper: np.ndarray, said: str) -> np.ndarray | None:
    """Return which points lie so far away that they are none of the scan, (N,) bool; None where none does.

    Parameters
    ----------
    points : (N, 3) float64 array
        Finite.
    lower, upper : their smallest and largest coordinates
    said : str
        What a message starts with.

    Raises
    ------
    InputError
        They are more than a few.
    """
    if len(points) < FEWEST_POINTS:
        return None
    some = points[:: max(len(points) // POINTS_LOOKED_AT, 1)]
    with np.errstate(over="ignore", invalid="ignore"):
        low, middle, high = np.percentile(some, [25.0, 50.0, 75.0], axis=0)
        width = float((high - low).max()) or float(np.ptp(bulk_of(some), axis=0).max())
        if not width > 0 or max(np.max(upper - middle), np.max(middle - lower)) <= FARTHEST_FROM_MIDDLE * width:
            return None
        invalid: np.ndarray = (np.abs(points - middle) > FARTHEST_FROM_MIDDLE * width).any(axis=1)
    if (count := int(invalid.sum())) > MOST_INVALID_SHARE * len(points):
        most = np.abs(points[invalid]).max()
        raise InputError(
            f"{said}{count:,} of {len(points):,} points lie a million times farther away than half of the scan is wide,"
            f" with coordinates up to {most:.3g}; {CAUSE}"
        )
    return invalid


def invalid_values_note(points: np.ndarray) -> str:
    """Return what should be said of points that are left out for this."""
    most = np.abs(points).max()
    return (
        f"{len(points):,} points with coordinates up to {most:.3g}, a million times farther away than the scan is wide,"
        " are left out"
    )


def check_sensible(extent: float, said: str) -> None:
    """Refuse an extent that no scan has."""
    if not EXTENTS[0] <= extent <= EXTENTS[1]:
        raise InputError(f"{said}the points span {extent:.3g}, as no scan does; {CAUSE}")
