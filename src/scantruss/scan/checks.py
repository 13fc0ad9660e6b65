"""Checks of what a scan holds: where its points lie, invalid values, files that lie apart, degrees."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..errors import InputError

if TYPE_CHECKING:
    from .cloud import PointCloud

POINTS_OF_EXTENT = 10_000  # points from which the extent of a file is measured
POINTS_OF_BULK = 100_000  # points from which the bulk of a scan is measured
FARTHEST_FROM_BULK = 5.0  # diagonals of the bulk of a scan from its middle, beyond which a point is an outlier
BULK_PERCENTILES = (2.0, 98.0)  # percentiles of each coordinate between which the bulk lies
POINTS_OF_MIDDLE = 2_000  # points from which the middle half of a scan is measured
FAR_ON_MAP = 100.0  # extents of a scan from zero from which on it lies on a map
FEWEST_POINTS = 100  # points below which no value is called invalid
FARTHEST_FROM_MIDDLE = 1e6  # widths of the middle half of a scan from its middle, beyond which a value is invalid
RASTER_COLUMNS = 4.0  # most different x of a raster, in square roots of its number of points
NO_DATA_SHARES, FEWEST_NO_DATA = (0.002, 0.5), 20  # share and number of points that may have a value for no data
USUAL_NO_DATA = (
    0.0,
    -99.0,
    -999.0,
    -9999.0,
    -99999.0,
    -32767.0,
    -32768.0,
    9999.0,
    99999.0,
)  # heights that often stand for no data
CLIFF_GAP = 0.1  # gap to the other heights, as a share of their range, that no terrain has
STEEP_CLIFF = 10.0  # slope to the nearest others, in multiples of the usual one, that no shore has
SOME_OF_RASTER = 20_000  # points of the rest that are looked at
# widths of the middle half of a scan from its middle, beyond which a place that many points share has no data
FAR_FROM_MIDDLE = 10.0
SINGLE_STEP = 0.25  # step of coordinates in single precision from which a note says it [mean distances between points]
MOST_INVALID_SHARE = 0.01  # share of the points that may be invalid; more are a fault of the file
EXTENTS_READ = (1e-30, 1e30)  # of a scan in any unit; numbers with swapped bytes lie outside
LIKELY_CAUSE = "the file is damaged, its byte order wrong, or it has no-data values"
MOST_DEGREES = 1.0  # degrees that a scan spans at most
# heights to the longer side in plan: a degree is 111 km, so metres of height are many times the degrees
STEEPEST_DEGREES = 50.0


def extent_of(points: np.ndarray) -> np.ndarray:
    """Return about the lowest and highest coordinates of points (N, 3), (2, 3); inf and -inf if there are none."""
    some = points[:: max(len(points) // POINTS_OF_EXTENT, 1)]
    some = some[np.isfinite(some).all(axis=1)].astype(np.float64)  # integers have no inf
    return np.stack([some.min(axis=0, initial=np.inf), some.max(axis=0, initial=-np.inf)])


def lies_on_map(origin: np.ndarray, extent: float) -> bool:
    """Whether a scan so large lies so far from zero (3,) as on a map, in x and in y, and less far in z."""
    return bool(np.abs(origin[:2]).min() > max(FAR_ON_MAP * extent, abs(origin[2])))


def bulk_of(points: np.ndarray) -> np.ndarray:
    """Return the lowest and highest coordinates of points (N, 3) but for a few outliers at each end, (2, 3)."""
    return np.percentile(points[:: max(len(points) // POINTS_OF_BULK, 1)], BULK_PERCENTILES, axis=0)


def usual_extent(points: np.ndarray) -> np.ndarray:
    """Return about the lowest and highest coordinates of points (N, 3) but for those far from most others, (2, 3).

    As (0, 0, 0) for no echo in a scan with national coordinates. Sparse far ends count.
    """
    some = points[:: max(len(points) // POINTS_OF_BULK, 1)]
    lower, upper = bulk_of(some[:: max(len(some) // POINTS_OF_EXTENT, 1)])
    middle, reach = 0.5 * (lower + upper), FARTHEST_FROM_BULK * np.linalg.norm(upper - lower)
    lowest, highest = (np.array([measure(axis) for axis in some.T]) for measure in (np.min, np.max))
    if np.linalg.norm(np.maximum(highest - middle, middle - lowest)) > reach:
        near = some[np.linalg.norm(some - middle, axis=1) <= reach]
        lowest, highest = near.min(axis=0), near.max(axis=0)
    return np.stack([lowest, highest])


def joint_extent(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return the extent of both."""
    return np.stack([np.minimum(one[0], other[0]), np.maximum(one[1], other[1])])


def extent_note(files: Sequence[Path], extents: Sequence[np.ndarray]) -> tuple[str, ...]:
    """Return a note on files that lie apart, by the extent (2, 3) of each.

    Two files lie together if the gap between them is no longer than the longer of them, or if others bridge it.
    """
    held = [number for number, extent in enumerate(extents) if np.isfinite(extent).all()]
    if len(held) < 2:
        return ()
    low, high = (np.array([extents[number][side] for number in held]) for side in (0, 1))
    long = np.linalg.norm(high - low, axis=1)
    least = np.full(len(held), np.inf)  # gap to those that lie together with the first
    together, coming = {0}, [0]
    while coming:
        one = coming.pop()
        gap = np.linalg.norm(np.maximum(np.maximum(low - high[one], low[one] - high), 0.0), axis=1)
        least = np.minimum(least, gap)
        new = set(np.flatnonzero(gap <= np.maximum(long, long[one])).tolist()) - together
        together |= new
        coming += new
    aside = sorted(set(range(len(held))) - together)
    if not aside:
        return ()
    name = files[held[aside[0]]].name
    more = f" and {len(aside) - 1:,} more files lie" if len(aside) > 1 else " lies"
    return (
        f"{name}{more} about {least[aside].min():.2g} or more from the others, farther than they are long;"
        " scantruss splice puts scans into one frame",
    )


def find_invalid(points: np.ndarray, lower: np.ndarray, upper: np.ndarray, prefix: str) -> np.ndarray | None:
    """Return which points lie too far away to belong to the scan, (N,) bool; None if all belong to it.

    Parameters
    ----------
    points : (N, 3) float64 array
        Finite.
    lower, upper : their smallest and largest coordinates
    prefix : start of the message

    Raises
    ------
    InputError
        They are more than a few.
    """
    if len(points) < FEWEST_POINTS:
        return None
    some = points[:: max(len(points) // POINTS_OF_MIDDLE, 1)]
    with np.errstate(over="ignore", invalid="ignore"):
        low, middle, high = np.percentile(some, [25.0, 50.0, 75.0], axis=0)
        width = float((high - low).max()) or float(np.ptp(bulk_of(some), axis=0).max())
        if not width > 0 or max(np.max(upper - middle), np.max(middle - lower)) <= FARTHEST_FROM_MIDDLE * width:
            return None
        invalid: np.ndarray = (np.abs(points - middle) > FARTHEST_FROM_MIDDLE * width).any(axis=1)
    count = int(invalid.sum())
    most_no_data = NO_DATA_SHARES[1] * len(points) if have_one_height(points[invalid]) else 0.0
    if count > max(MOST_INVALID_SHARE * len(points), most_no_data):
        most = np.abs(points[invalid]).max()
        raise InputError(
            f"{prefix}{count:,} of {len(points):,} points lie a million times farther away than half of the scan is wide,"
            f" with coordinates up to {most:.3g}; {LIKELY_CAUSE}"
        )
    return invalid


def find_no_data_place(points: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> np.ndarray | None:
    """Return which points share one place far from the scan, (N,) bool, such as 0, 0, 0 where the scanner got no echo; None if none do.

    Parameters
    ----------
    points : (N, 3) float64 array [scan unit]
        Finite.
    lower, upper : their smallest and largest coordinates [scan unit]
    """
    if len(points) < FEWEST_POINTS:
        return None
    some = np.unique(points[:: max(len(points) // POINTS_OF_MIDDLE, 1)], axis=0)
    with np.errstate(over="ignore", invalid="ignore"):
        low, middle, high = np.percentile(some, [25.0, 50.0, 75.0], axis=0)
        width, away = float((high - low).max()), np.maximum(upper - middle, middle - lower)
        axis = int(away.argmax())
        if not 0.0 < FAR_FROM_MIDDLE * width < away[axis]:
            return None
    farthest = upper[axis] if upper[axis] - middle[axis] > middle[axis] - lower[axis] else lower[axis]
    at: np.ndarray = points[:, axis] == farthest
    count = int(at.sum())
    one_place = count >= FEWEST_NO_DATA and bool((points[at] == points[at][0]).all())
    return at if one_place and count <= NO_DATA_SHARES[1] * len(points) else None


def no_data_place_note(count: int, place: np.ndarray) -> str:
    """Return a note on points that are left out for this."""
    prefix = ", ".join(f"{coordinate + 0.0:.10g}" for coordinate in place)
    return f"{count:,} points stand at ({prefix}), far from the others, as where there is no data, and are left out"


def have_one_height(points: np.ndarray) -> bool:
    """Whether invalid points (K, 3) are some that have the same height, as where a raster has no data."""
    return len(points) >= FEWEST_NO_DATA and bool(points[:, 2].min() == points[:, 2].max())


def invalid_values_note(points: np.ndarray) -> str:
    """Return a note on points that are left out for this."""
    if have_one_height(points):
        return no_data_note(len(points), float(points[0, 2]))
    most = np.abs(points).max()
    return (
        f"{len(points):,} points with coordinates up to {most:.3g}, a million times farther away than the scan is wide,"
        " are left out"
    )


def find_no_data(points: np.ndarray) -> tuple[np.ndarray, float] | None:
    """Return which points have a value for no data as their height, (N,) bool, and that value; None if none has.

    Then many points share exactly the least or the greatest height. In a raster a cliff divides them from their neighbours; a lake has a
    shore. In other scans it is a usual value for no data, farther below or above the rest than that is wide.
    """
    x, z = points[:, 0], points[:, 2]
    if len(points) < FEWEST_POINTS:
        return None
    most = RASTER_COLUMNS * math.sqrt(len(points))
    some = x[:: int(len(x) / (2.0 * most + 1.0)) + 1]  # of these as many are different at most
    is_raster = len(np.unique(some)) <= most and len(np.unique(x)) <= most
    for value in (z.min(), z.max()):
        at: np.ndarray = z == value
        count, rest = int(at.sum()), z[~at]
        if (
            not NO_DATA_SHARES[0] * len(z) <= count <= NO_DATA_SHARES[1] * len(z)
            or count < FEWEST_NO_DATA
            or not np.ptp(rest) > 0
        ):
            continue
        gap = float(np.abs(rest - value).min())
        if is_raster:
            found = gap > CLIFF_GAP * np.ptp(rest) or _has_cliff(points[at], points[~at])
        else:
            found = float(value) in USUAL_NO_DATA and gap > np.ptp(points[~at], axis=0).max()
        if found:
            return at, float(value)
    return None


def _has_cliff(level: np.ndarray, rest: np.ndarray) -> bool:
    """Whether the slope from level points (K, 3) to the nearest of the rest (M, 3) is far steeper than slopes within the rest.

    These are taken to be no less than one step of the heights: those of whole metres are mostly level.
    """
    step = float(np.diff(np.unique(rest[:, 2])).min())
    rest = rest[:: len(rest) // SOME_OF_RASTER + 1]

    def steepness(some: np.ndarray, itself: bool) -> tuple[float, float]:
        some = some[:: len(some) // 200 + 1]
        away = np.hypot(*(some[:, None, axis] - rest[:, axis] for axis in (0, 1)))
        if itself:
            away[away == 0.0] = np.inf
        nearest = away.argmin(axis=1)
        near = away[np.arange(len(some)), nearest]
        shore = (near > 0.0) & (near <= 3.0 * np.median(near))
        if not shore.any():
            return 0.0, math.inf
        return float(np.median(np.abs(some[:, 2] - rest[nearest, 2])[shore] / near[shore])), float(
            np.median(near[shore])
        )

    slope, apart = steepness(rest, itself=True)
    return steepness(level, itself=False)[0] > STEEP_CLIFF * max(slope, step / apart)


def no_data_note(count: int, value: float) -> str:
    """Return a note on points that are left out for this."""
    return f"{count:,} points have exactly z = {value:.10g}, a value for no data, and are left out"


def check_sensible(extent: float, prefix: str) -> None:
    """Refuse an extent that no scan has."""
    if not EXTENTS_READ[0] <= extent <= EXTENTS_READ[1]:
        raise InputError(f"{prefix}the points span {extent:.3g}, as no scan does; {LIKELY_CAUSE}")


def single_precision_note(cloud: PointCloud) -> tuple[str, ...]:
    """Return a note on a cloud whose coordinates were rounded to single precision so far from zero that steps show; else none."""
    some = cloud.points[:: max(len(cloud.points) // POINTS_OF_EXTENT, 1)] + cloud.origin
    with np.errstate(over="ignore"):
        rounded = some.astype(np.float32)
    single = (rounded == some).all(axis=0)
    if not single.any():
        return ()
    step = np.spacing(np.median(np.abs(rounded), axis=0)).astype(np.float64)
    sides = np.sort(np.ptp(usual_extent(cloud.points), axis=0))
    apart = math.sqrt(float(sides[1] * sides[2]) / len(cloud.points))
    coarse = np.flatnonzero(single & (step > SINGLE_STEP * apart))
    if not len(coarse):
        return ()
    names, unit = " and ".join("xyz"[axis] for axis in coarse), f" {cloud.unit}" if cloud.unit else ""
    return (
        f"{names} {'are' if len(coarse) > 1 else 'is'} in steps of up to {step[coarse].max():.2g}{unit}, rounded to single precision"
        " (float32) far from zero: export the scan again in double precision, or moved near zero",
    )


def degrees_note(cloud: PointCloud) -> tuple[str, ...]:
    """Return a note on a cloud whose x and y look like longitude and latitude; none where its unit is known."""
    if cloud.unit:
        return ()
    some = cloud.points[:: max(len(cloud.points) // POINTS_OF_EXTENT, 1)]
    lower, upper = bulk_of(some) + cloud.origin
    x, y, z = upper - lower
    on_earth = max(-lower[0], upper[0]) <= 180.0 and max(-lower[1], upper[1]) <= 90.0
    if not (on_earth and min(x, y) > 0.0 and max(x, y) < MOST_DEGREES and z >= STEEPEST_DEGREES * max(x, y)):
        return ()
    return (
        f"x and y look like longitude and latitude in degrees, {x:.2g} by {y:.2g} beside heights of {z:.2g}: a grid needs lengths,"
        " so project such a scan to a plane system first (QGIS, PDAL filters.reprojection); where they are lengths, --unit says the unit",
    )
