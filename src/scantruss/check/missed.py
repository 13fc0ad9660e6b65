"""Which points of its scan a grid misses or rounds off, and where most of them are."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..grid.certificate import place_of
from ..surface.chosen_samples import KEPT, LIMB, SLIT
from .left_out import LIMBS_APART, points_together
from .limits import COVER_REACH, NOISES_OFF, ROUNDED_BY
from .unfollowed import mean_heights

if TYPE_CHECKING:
    from ..grid.grid import Grid
    from ..surface.samples import SurfaceSamples
    from .distances import Distances


def points_wanted(samples: SurfaceSamples) -> np.ndarray:
    """Return which points (N,) bool count as missing where a grid is far from them: those it is to follow, and limbs and slits cut off."""
    wanted: np.ndarray = np.isin(samples.judged, (KEPT, LIMB, SLIT)) & ~samples.elsewhere
    return wanted


def points_missed(samples: SurfaceSamples, distance: np.ndarray, reach: np.ndarray) -> np.ndarray:
    """Return which points (N,) bool a grid is to follow and misses; parameters as of `points_left_out`."""
    missed: np.ndarray = points_wanted(samples) & (distance > reach)
    return missed


def largest_patch_missed(
    samples: SurfaceSamples, distance: np.ndarray, members: np.ndarray, reach: np.ndarray
) -> tuple[float, float, float] | None:
    """Return the point in the middle of the most points beside each other that a grid misses; None if it misses none.

    Parameters as of `points_left_out`.
    """
    which = np.flatnonzero(points_missed(samples, distance, reach))
    if not len(which):
        return None
    group = points_together(samples.scan[which], LIMBS_APART * members[which])
    patch = samples.scan[which[group == np.bincount(group).argmax()]]
    middle = patch[((patch - patch.mean(axis=0)) ** 2).sum(axis=1).argmin()]
    return place_of(middle + samples.origin)


def farthest_followed(distance: np.ndarray, followed: np.ndarray, members: np.ndarray) -> int:
    """Return which point is the farthest from the grid of those that it follows (N,) bool, and that lie within a member (N,) of it."""
    return int(np.where(followed & (distance <= members), distance / members, -1.0).argmax())


def shares_rounded(
    grid: Grid,
    samples: SurfaceSamples,
    found: Distances,
    followed: np.ndarray,
    members: np.ndarray,
    scatter: float,
) -> tuple[float, float]:
    """Return the share of the points that a grid rounds off, and of those that it rounds off by more than their scatter.

    Of a mean surface only that is rounded off which does not lie on both sides of it.

    followed : (N,) bool, points of the scan that count: what the grid is to follow, and limbs that were cut off
    members : (N,) desired member length at each point [scan unit]
    scatter : usual distance of the points from the mean surface [scan unit]
    """
    off = mean_heights(grid, samples, found, members) if samples.moved else found.scan
    return (
        _share_between(off, followed, members, 0.0),
        _share_between(found.scan, followed, members, NOISES_OFF * scatter),
    )


def _share_between(distance: np.ndarray, followed: np.ndarray, members: np.ndarray, roughness: float) -> float:
    """Return the share of the points that are followed and too far off to be on the grid, but not so far that they are missed."""
    off = (distance > ROUNDED_BY * members + roughness) & (distance <= COVER_REACH * members)
    return float((followed & off).mean())
