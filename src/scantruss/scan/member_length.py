"""Which member lengths a scan can carry, and which one suits it."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np

from ..errors import InputError
from ..settings import Settings, shortest_and_longest
from .cloud import PointCloud

SPACINGS = 3.0  #: a member needs this many point spacings: fewer points than that do not tell a boundary from a gap
GAPS = 2.2  #: ... and where points lie at random, this many distances to the sixth neighbour
USUAL_GAPS = 3.5  #: what suits evenly meshed scans, where nobody said a length
USUAL = 25.0  #: members along the longest side of a scan, where nobody said a length
LARGEST_PER_EXTENT = 6.0  #: above a sixth of the scan's extent a grid says little of its shape


def check_length(cloud: PointCloud, settings: Settings) -> None:
    """Refuse a member length that this scan cannot carry.

    Raises
    ------
    InputError
        The length is larger than the scan, or smaller than about three point spacings.
    """
    extent = cloud.extent
    spacing = cloud.spacing
    unit = f" {cloud.unit}" if cloud.unit else ""
    if settings.length_field:
        _check_field(settings, extent, spacing)
    if settings.length > extent:
        raise InputError(
            f"length {settings.length:g}{unit} is larger than the scan, whose longest side is {extent:.4g}{unit};"
            f" use at most {length_range(cloud)[1]:g}"
        )
    if settings.length < SPACINGS * spacing * (1 - 1e-9):
        raise InputError(
            f"length {settings.length:g}{unit} is too small for points that are {spacing:.3g}{unit} apart;"
            f" use at least {length_range(cloud)[0]:g}"
        )


def _check_field(settings: Settings, extent: float, spacing: float) -> None:
    """Refuse a length field of which a part cannot be carried."""
    shortest, longest = shortest_and_longest(settings.length_field)
    scale = settings.length / shortest
    unit = f" {settings.unit}" if settings.unit else ""
    if scale * longest > extent:
        raise InputError(
            f"the longest length of the length field, {scale * longest:g}{unit}, is larger than the scan,"
            f" whose longest side is {extent:.4g}{unit}; use shorter ones"
        )
    if settings.length < SPACINGS * spacing * (1 - 1e-9):
        raise InputError(
            f"the shortest length of the length field, {settings.length:g}{unit}, is too small for points that are"
            f" {spacing:.3g}{unit} apart; use at least {round_length(SPACINGS * spacing, 'up'):g}"
        )


def length_range(cloud: PointCloud) -> tuple[float, float]:
    """Return the smallest and the largest sensible member length, rounded to two digits [scan unit]."""
    low = max(SPACINGS * cloud.spacing, GAPS * cloud.gap)
    return round_length(low, "up"), round_length(_usual_extent(cloud) / LARGEST_PER_EXTENT, "down")


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
