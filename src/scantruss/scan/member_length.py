"""Which member lengths a scan can carry, and which one suits it."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np

from ..errors import InputError, LengthError
from ..settings import Settings, shortest_and_longest
from .cloud import PointCloud

SPACINGS = 3.0  #: a member needs this many point spacings: fewer points than that do not tell a boundary from a gap
GAPS = 1.75  #: ... and where points lie at random, this many distances to the sixth neighbour
USUAL_GAPS = 3.5  #: what suits evenly meshed scans, where nobody said a length
USUAL = 25.0  #: members along the longest side of a scan, where nobody said a length
LARGEST_PER_EXTENT = 3.5  #: above this share of the scan's extent a grid says nothing of its shape


def check_length(cloud: PointCloud, settings: Settings) -> None:
    """Refuse a member length outside of the range that this scan can carry; see `length_range`.

    Raises
    ------
    LengthError
        The length is too small for the distance between the points, or too large for the extent of the scan.
    """
    low, high = exact_range(cloud)
    shortest, longest, what = settings.length, settings.length, "length"
    if settings.length_field:
        field = shortest_and_longest(settings.length_field)
        longest, what = settings.length * field[1] / field[0], "the {} length of the length field,"
    unit = f" {cloud.unit}" if cloud.unit else ""
    extent = f"a scan whose longest side is {_usual_extent(cloud):.4g}{unit}"
    apart = f"points that are {cloud.spacing:.3g}{unit} apart"
    if low > high:
        raise InputError(
            f"this scan carries no grid: members must be at least {round_length(low, 'up'):g}{unit} long for {apart}, and at most"
            f" {round_length(high, 'down'):g} for {extent}; scan it more densely"
        )
    if longest > high * (1 + 1e-9):
        raise LengthError(
            f"{what.format('longest')} {longest:g}{unit} is too large for {extent};"
            f" use at most {round_length(high, 'down'):g}"
        )
    if shortest < low * (1 - 1e-9):
        raise LengthError(
            f"{what.format('shortest')} {shortest:g}{unit} is too small for {apart}; use at least {round_length(low, 'up'):g}"
        )


def exact_range(cloud: PointCloud) -> tuple[float, float]:
    """Return the smallest and the largest member length that a scan carries [scan unit]."""
    return max(SPACINGS * cloud.spacing, GAPS * cloud.gap), _usual_extent(cloud) / LARGEST_PER_EXTENT


def length_range(cloud: PointCloud) -> tuple[float, float]:
    """Return the smallest and the largest member length that a scan carries, rounded to two digits [scan unit]."""
    low, high = exact_range(cloud)
    return round_length(low, "up"), round_length(high, "down")


def _usual_extent(cloud: PointCloud) -> float:
    """Return the longest side of a scan; of its bulk where a few points lie so far away that they are none of it [scan unit]."""
    from .checks import usual_extent

    usual = float(np.ptp(usual_extent(cloud.points), axis=0).max())
    return usual if 0.0 < usual < 0.5 * cloud.extent else cloud.extent


def suggest_length(cloud: PointCloud) -> float:
    """Return a member length that suits the scan, rounded to two digits [scan unit]."""
    low, high = length_range(cloud)
    wished = max(_usual_extent(cloud) / USUAL, USUAL_GAPS * cloud.gap)
    return max(round_length(min(wished, high), "nearest"), low)


def round_length(value: float, way: Literal["up", "down", "nearest"]) -> float:
    """Round to two significant digits."""
    if not value > 0:
        return 0.0
    digits = 1 - math.floor(math.log10(value))
    steps = value * 10.0**digits
    whole = {"up": math.ceil(steps - 1e-9), "down": math.floor(steps + 1e-9), "nearest": round(steps)}[way]
    return float(f"{whole}e{-digits}")
