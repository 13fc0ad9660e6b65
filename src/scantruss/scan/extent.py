"""Whether the files of a scan lie together: scans that were never put into one frame often do not."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

POINTS_LOOKED_AT = 10_000  # points that tell where a file lies
BULK = 100_000  # points that tell where most of them lie
FARTHEST_FROM_BULK = 5.0  # diagonals of the bulk of a scan from its middle, beyond which a point is none of it
BULK_PERCENTILES = (2.0, 98.0)  # percentiles of each coordinate between which they do


def extent_of(points: np.ndarray) -> np.ndarray:
    """Return about the lowest and highest coordinates of points (N, 3), (2, 3); inf and -inf where there are none."""
    some = points[:: max(len(points) // POINTS_LOOKED_AT, 1)]
    some = some[np.isfinite(some).all(axis=1)].astype(np.float64)  # whole numbers have no inf
    return np.stack([some.min(axis=0, initial=np.inf), some.max(axis=0, initial=-np.inf)])


def bulk_of(points: np.ndarray) -> np.ndarray:
    """Return the lowest and highest coordinates of points (N, 3) but for a few outlier ones at each end, (2, 3)."""
    return np.percentile(points[:: max(len(points) // BULK, 1)], BULK_PERCENTILES, axis=0)


def usual_extent(points: np.ndarray) -> np.ndarray:
    """Return about the lowest and highest coordinates of points (N, 3) but for those far from most others, (2, 3).

    As (0, 0, 0) for no echo in a scan with national coordinates. Sparse far ends count.
    """
    some = points[:: max(len(points) // BULK, 1)]
    lower, upper = bulk_of(some)
    away = np.linalg.norm(some - 0.5 * (lower + upper), axis=1)
    near = some[away <= FARTHEST_FROM_BULK * np.linalg.norm(upper - lower)]
    return np.stack([near.min(axis=0), near.max(axis=0)])


def joined(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return the extent of both."""
    return np.stack([np.minimum(one[0], other[0]), np.maximum(one[1], other[1])])


def extent_note(files: Sequence[Path], extents: Sequence[np.ndarray]) -> tuple[str, ...]:
    """Return what should be said of files that lie apart, by the extent (2, 3) of each.

    Two lie together where the gap between them is no longer than the longer of them, or where others lead from one to the other.
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
