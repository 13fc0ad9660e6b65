"""The member lengths that are possible on a scan, and the one that suits it."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np

from ..errors import InputError, LengthError, words_of_number
from ..settings import Settings, shortest_and_longest
from .cloud import PointCloud, share_with_six_near

LEAST_SPACINGS = 3.0  #: a member needs this many point spacings, or a boundary cannot be distinguished from a gap
# a member needs this many distances to the sixth neighbour, which for random points is more than the spacings
RANDOM_GAPS = 1.75
USUAL_GAPS = 3.5  # distances to the sixth neighbour in a suggested length, which suits evenly meshed scans
USUAL_MEMBERS = 25.0  #: members along the longest side of a scan, for a suggested length
LARGEST_PER_EXTENT = 3.5  #: above this share of the scan's extent a grid says nothing of its shape
MESH_FILES = (
    ".obj",
    ".stl",
    ".off",
    ".3mf",
    ".gltf",
    ".glb",
    ".vtp",
    ".vtu",
)  #: files of meshes, of which the vertices are read
SOME_POINTS = 8_000  #: points of a first look at how far apart they lie
SURELY_FEWER = 4  #: times as many in a scan: then they lie closer than in that look
SURE_SHARE = 0.75  #: share of the places at which they must lie near enough in that look; half of them would do


def check_length(cloud: PointCloud, settings: Settings) -> None:
    """Refuse a member length outside the range of this scan; see `length_range`.

    Raises
    ------
    LengthError
        The length is too small for the distance between the points, or too large for the extent of the scan.
    """
    shortest, longest, what = settings.length, settings.length, "length"
    if settings.length_field:
        field = shortest_and_longest(settings.length_field)
        longest, what = settings.length * field[1] / field[0], "the {} length of the length field,"
    if _surely_carries(cloud, shortest, longest):
        return
    low, high = exact_range(cloud)
    unit = f" {cloud.unit}" if cloud.unit else ""
    extent = f"a scan whose longest side is {words_of_number(cloud.usual_extent, 4)}{unit}"
    apart = f"points that are {words_of_number(cloud.spacing, 3)}{unit} apart"
    if low > high:
        raise InputError(
            f"this scan carries no grid: members must be at least {round_length(low, 'up'):g}{unit} long for {apart}, and at most"
            f" {round_length(high, 'down'):g} for {extent}; {denser_words(cloud)}"
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


def denser_words(cloud: PointCloud) -> str:
    """Say what helps where a scan has too few points for any length."""
    if cloud.name.lower().endswith(MESH_FILES):
        return "of a mesh the vertices alone are read, so divide its triangles first, or sample points on them"
    return "scan it more densely"


def exact_range(cloud: PointCloud) -> tuple[float, float]:
    """Return the smallest and the largest possible member length of a scan [scan unit]."""
    return max(LEAST_SPACINGS * cloud.spacing, RANDOM_GAPS * cloud.gap), cloud.usual_extent / LARGEST_PER_EXTENT


def length_range(cloud: PointCloud) -> tuple[float, float]:
    """Return the smallest and the largest possible member length of a scan, rounded to two digits [scan unit]."""
    low, high = exact_range(cloud)
    return round_length(low, "up"), round_length(high, "down")


def _surely_carries(cloud: PointCloud, shortest: float, longest: float) -> bool:
    """Whether members of such lengths are possible by a quick look: if some of the points lie near enough for them, all do."""
    if longest * LARGEST_PER_EXTENT > cloud.usual_extent or shortest < LEAST_SPACINGS * cloud.spacing:
        return False
    every = len(cloud.points) // SOME_POINTS
    return any(
        share_with_six_near(np.asfortranarray(cloud.points[::step]), shortest / RANDOM_GAPS) >= SURE_SHARE
        for step in ((every, 1) if every >= SURELY_FEWER else (1,))
    )


def suggest_length(cloud: PointCloud) -> float:
    """Return a member length that suits the scan, rounded to two digits [scan unit]."""
    low, high = length_range(cloud)
    wished = max(cloud.usual_extent / USUAL_MEMBERS, USUAL_GAPS * cloud.gap)
    return max(round_length(min(wished, high), "nearest"), low)


def round_length(value: float, way: Literal["up", "down", "nearest"]) -> float:
    """Round to two significant digits."""
    if not value > 0:
        return 0.0
    digits = 1 - math.floor(math.log10(value))
    steps = value * 10.0**digits
    whole = {"up": math.ceil(steps - 1e-9), "down": math.floor(steps + 1e-9), "nearest": round(steps)}[way]
    return float(f"{whole}e{-digits}")
