"""What lies along a grid and is not followed: parts such as a ring beam, a rib or a second layer, or most of the scan."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

import numpy as np

from ..errors import words_of_number
from ..grid.certificate import Fault, place_of
from ..grid.line_sets import RIDGE, sets_of
from .distances import distances_to_grid, feet_over
from .folds import fold_angles
from .left_out import points_together
from .limits import NOISES_OFF, PLACES_KEPT

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..grid.grid import Grid
    from ..surface.samples import SurfaceSamples
    from .distances import Distances

# distance from the grid, beyond the noise, from which on points are not followed: at most, as members that span a surface with a radius
# of one member lie that far off it, and at least [member lengths]; in between by the folds between a triangle and its neighbours
NOT_FOLLOWED, LEVEL_NOT_FOLLOWED = 0.125, 0.02
SAG_OF_FOLD = 0.43  # ... of a bent surface, with half as much again to be sure [member lengths, at a radian]
WIDEST_CUBE, NARROWEST_CUBE = (
    0.25,
    0.1,
)  # widest and narrowest cubes in which most points must lie that far off [member lengths]
SPACINGS_OF_CUBE = 4.0  # width of the cubes between these: some points lie in each [spacings of the points]
LENGTH_OF_LONG_PART = 6.0  # longest side of the box around such a part from which on it is no bump that members round off [member lengths]
WARN_SHARE = 0.01  # share of the points in such a part from which on it is said
# share of the points that a grid is to follow above which it does not follow the scan, and how far off those are at least, beyond
# the noise [member lengths]: as where one row of triangles runs along a bent strip; of two layers, followed by turns, it is half at most
MOST_UNFOLLOWED, LEAST_OFF = 0.55, 0.05
WARN_UNFOLLOWED = 0.3  # ... above which that is said: 0.30 to 0.48 on corrugated roofs, at most 0.26 on 200 grids that keep to their scans
# share above which it is a fault where a twentieth of the points lie farther off than this: blocks, where a figure has a waist and a
# neck; the waves of a roof that are smoothed out are lower [member lengths]
SHARE_OF_COARSE, FAR_OFF_COARSE, TWENTIETH = 0.25, 0.24, 0.95
# share of the points on triangles that stand off the middle of their points by more than the second, above which a grid does not follow
# the mean surface of its scan: a body smoothed away is smaller than the scan, folds that are lie on both sides [member lengths]
MOST_OFF_MEAN, OFF_MEAN = 0.15, 0.2
# distance from the grid, beyond the noise, from which on points are of a peak that it cuts off [member lengths], and how many these
# are at least, in all and times as many as points of a line as long
HEIGHT_OF_PEAK, FEWEST_OF_PEAK, WIDTH_OF_PEAK = 0.3, 12, 3.0
# the same distance of points around a peak, and how far from it and how many times as many these are: of the edges of a niche a strip no
# wider than the spacing lies farthest off, and a surface beside it less far [member lengths]
BASE_OF_PEAK, AROUND_PEAK, TIMES_AS_MANY = 0.15, 0.3, 2.0
# distance of a crest from a grid from which on it is cut off, and share of its places that may be nearer [member lengths]
CREST_OFF, SHARE_OF_CREST = 0.1, 0.6
# longest way from the end of a ridge to a corner for which it makes [member lengths], least cosine of the angle between that way and its
# last members, and how many these are
BREAKS_WITHIN, AIMS_AT, LAST_MEMBERS = 3.0, 0.9, 3
CRESTS_MEET_WITHIN = 1.5  # distance of the ends of two crests within which they meet in a corner [member lengths]


def unfollowed_parts(
    grid: Grid, samples: SurfaceSamples, found: Distances, chosen: np.ndarray, members: np.ndarray
) -> list[Fault]:
    """Return a warning of the parts of a scan that a grid does not follow, though they lie within a member of it.

    Such a part hangs together, is long, and most of the points in each place of it lie off the grid: noise is none.

    Parameters
    ----------
    chosen : (N,) bool, points of the scan that the grid is to follow
    members : (N,) desired member length at each point [scan unit]
    """
    side = _cube(samples, members)
    which = _off(samples, found, chosen, members, _followed_to(grid), WARN_SHARE * len(samples.scan))
    if not len(which):
        return []
    part = points_together(samples.scan[which], np.full(len(which), side))
    points = np.bincount(part)
    large = np.flatnonzero(points >= WARN_SHARE * len(samples.scan))
    parts = [which[part == number] for number in large[np.argsort(-points[large], kind="stable")].tolist()]
    long = [own for own in parts if _size(own, samples) >= LENGTH_OF_LONG_PART * members[own].mean()]
    if not long and len(which) > WARN_UNFOLLOWED * chosen.sum():
        what, share = "smooths out waves or folds of the scan", f"{len(which) / chosen.sum():.0%}"
        return [_points_off(samples, found, which, f"{what}: {share}", "; shorter members follow them")]
    return [_warning(grid, samples, found, long)] if long else []


def mostly_unfollowed(
    grid: Grid, samples: SurfaceSamples, found: Distances, chosen: np.ndarray, members: np.ndarray
) -> list[Fault]:
    """Return a fault where a grid follows less than half of the points that it is to follow, or too few and the others lie far off.

    Parameters as of `unfollowed_parts`.
    """
    followed_to, count = _followed_to(grid), int(chosen.sum())
    which = _off(samples, found, chosen, members, followed_to, SHARE_OF_COARSE * count)
    if len(which) <= SHARE_OF_COARSE * count:
        return []
    far = _off(samples, found, chosen, members, np.maximum(followed_to, LEAST_OFF), MOST_UNFOLLOWED * count)
    if len(far) > MOST_UNFOLLOWED * count:
        return [_points_off(samples, found, far, f"follows less than half of the scan: {len(far) / count:.1%}")]
    noise = float(np.median(found.noise)) / float(members.max())
    twentieth = float(np.quantile(found.scan[chosen] / members[chosen], TWENTIETH))
    if twentieth <= FAR_OFF_COARSE + noise:
        return []
    what, share = "is too coarse for the shape of the scan", f"{len(which) / count:.1%}"
    return [
        _points_off(samples, found, which, f"{what}: {share}", f", one in twenty by {twentieth:.2f} members or more")
    ]


def _points_off(samples: SurfaceSamples, found: Distances, which: np.ndarray, what: str, more: str = "") -> Fault:
    """Return the fault or warning of points (K,) that are not followed, with words before and after how far off they are."""
    unit, worst = f" {samples.unit}" if samples.unit else "", int(which[found.scan[which].argmax()])
    words = f"{what} of its points lie up to {words_of_number(found.scan[worst], 3)}{unit} off{more}"
    return Fault("unfollowed", words, place_of(samples.scan[worst] + samples.origin))


def off_mean_surface(
    grid: Grid, samples: SurfaceSamples, found: Distances, chosen: np.ndarray, members: np.ndarray
) -> list[Fault]:
    """Return a fault where the mean surface of a rough scan is not followed either; parameters as of `unfollowed_parts`."""
    triangle, member = found.triangle[chosen], members[chosen]
    height = feet_over(grid, triangle, samples.scan[chosen])[0] / member
    count = np.maximum(np.bincount(triangle, minlength=len(grid.triangles)), 1)
    middle = np.abs(np.bincount(triangle, height, minlength=len(grid.triangles)) / count)[triangle]
    share = float(np.mean(middle > OFF_MEAN)) if len(middle) else 0.0
    if share <= MOST_OFF_MEAN:
        return []
    worst = int(np.flatnonzero(chosen)[(middle * member).argmax()])
    words = f"is too coarse for the shape of the scan: {share:.1%} of its points lie where that is {OFF_MEAN:g} members off or more"
    return [Fault("unfollowed", words, place_of(samples.scan[worst] + samples.origin))]


def rounded_peaks(
    grid: Grid, samples: SurfaceSamples, found: Distances, chosen: np.ndarray, members: np.ndarray
) -> list[Fault]:
    """Return a warning of peaks, tips and dips that a grid cuts off, however few of the points lie there.

    Points far off that hang together are a surface, points that stand alone are none. Parameters as of `unfollowed_parts`.
    """
    noise = float(np.median(found.noise))
    off = np.flatnonzero(
        chosen & (found.scan > HEIGHT_OF_PEAK * members + NOISES_OFF * noise) & (found.scan <= members)
    )
    if len(off) < FEWEST_OF_PEAK:
        return []
    part = points_together(samples.scan[off], np.full(len(off), SPACINGS_OF_CUBE * samples.spacing))
    peaks = [off[part == number] for number in np.flatnonzero(np.bincount(part) >= FEWEST_OF_PEAK)]
    base = samples.scan[chosen & (found.scan > BASE_OF_PEAK * members + NOISES_OFF * noise) & (found.scan <= members)]
    peaks = [own for own in peaks if is_wide(samples.scan[own], base, float(members[own].mean()), samples.spacing)]
    if not peaks:
        return []
    peaks.sort(key=lambda own: -float(found.scan[own].max()))
    worst = [int(own[found.scan[own].argmax()]) for own in peaks[:PLACES_KEPT]]
    unit, more = f" {grid.unit}" if grid.unit else "", f" ({len(peaks)} such places)" if len(peaks) > 1 else ""
    words = f"cuts off a peak, a tip or a dip by {words_of_number(found.scan[worst[0]], 3)}{unit}{more}; shorter members follow it"
    at, *others = (place_of(place) for place in samples.scan[worst] + samples.origin)
    return [Fault("peak", words, at, tuple(others))]


def is_wide(peak: np.ndarray, base: np.ndarray, member: float, spacing: float) -> bool:
    """Return whether the points (K, 3) of a peak, or those around it that lie off as well (M, 3), are a surface and no line of points."""
    if len(peak) * spacing >= WIDTH_OF_PEAK * np.ptp(peak, axis=0).max():
        return True
    from scipy.spatial import cKDTree  # which most grids do not load

    around = cKDTree(peak).query(base, distance_upper_bound=AROUND_PEAK * member)[0]
    return bool(np.isfinite(around).sum() >= TIMES_AS_MANY * len(peak))


def _off(
    samples: SurfaceSamples,
    found: Distances,
    chosen: np.ndarray,
    members: np.ndarray,
    followed_to: np.ndarray,
    least: float,
) -> np.ndarray:
    """Return the numbers of the chosen points (N,) bool that lie off the triangles, where most do; none where these are too few.

    followed_to : (T,) up to which distance from each triangle points are followed, noise aside [member lengths]
    least : fewest points that are looked at closely
    """
    noise = float(np.median(found.noise))
    near = np.flatnonzero(chosen & (found.scan <= members))
    off = found.scan[near] > followed_to[found.triangle[near]] * members[near] + noise
    if off.sum() < max(least, 1):
        return near[:0]
    which: np.ndarray = near[off & _mostly(off, samples.scan[near], _cube(samples, members))]
    return which


def _cube(samples: SurfaceSamples, members: np.ndarray) -> float:
    """Return the width of the cubes in which most points must lie off [scan unit]."""
    longest = float(members.max())
    return min(max(SPACINGS_OF_CUBE * samples.spacing, NARROWEST_CUBE * longest), WIDEST_CUBE * longest)


def _followed_to(grid: Grid) -> np.ndarray:
    """Return up to which distance from each triangle (T,) points are followed, noise aside: as a surface so bent [member lengths]."""
    folds, bend = np.radians(180.0 - fold_angles(grid)), np.zeros(len(grid.triangles))
    for triangles in grid.edge_triangles.T:
        known = (triangles >= 0) & np.isfinite(folds)
        np.maximum.at(bend, triangles[known], folds[known])
    followed: np.ndarray = np.minimum(SAG_OF_FOLD * bend + LEVEL_NOT_FOLLOWED, NOT_FOLLOWED)
    return followed


def mean_heights(grid: Grid, samples: SurfaceSamples, found: Distances, members: np.ndarray) -> np.ndarray:
    """Return how far each place of the scan lies off a grid (N,): the mean of the heights of its points, in which roughness is lost.

    members : (N,) desired member length at each point [scan unit]
    """
    height, feet = feet_over(grid, found.triangle, samples.scan)
    number = _cubes(feet, _cube(samples, members))
    mean: np.ndarray = np.abs(np.bincount(number, height) / np.bincount(number))[number]
    return mean


def _mostly(off: np.ndarray, points: np.ndarray, side: float) -> np.ndarray:
    """Return which points (K, 3) lie in a cube of which most points are off (K,) bool."""
    number = _cubes(points, side)
    mostly: np.ndarray = (2 * np.bincount(number, off) > np.bincount(number))[number]
    return mostly


def _cubes(points: np.ndarray, side: float) -> np.ndarray:
    """Return the number of the cube of a width [scan unit] in which each point lies (K,)."""
    cube = np.floor(points / side).astype(np.int64)
    cube -= cube.min(axis=0)
    across = cube.max(axis=0) + 1
    number: np.ndarray = np.unique((cube[:, 0] * across[1] + cube[:, 1]) * across[2] + cube[:, 2], return_inverse=True)[
        1
    ]
    return number


def _size(which: np.ndarray, samples: SurfaceSamples) -> float:
    """Return the longest side of the box around some points of the scan (K,)."""
    return float(np.ptp(samples.scan[which], axis=0).max())


def _warning(grid: Grid, samples: SurfaceSamples, found: Distances, parts: list[np.ndarray]) -> Fault:
    """Return the warning of some parts, each the numbers of its points, with the place of each that is farthest from the grid."""
    unit, points = f" {grid.unit}" if grid.unit else "", sum(map(len, parts))
    worst = [int(own[found.scan[own].argmax()]) for own in parts]
    several = f"{len(parts)} parts of the scan, the largest" if len(parts) > 1 else "a part of the scan"
    is_planar = grid.settings is not None and grid.settings.planar
    why = (
        "as panels were made planar, or for a beam or a rib"
        if is_planar
        else "such as a beam, a rib, a lip or a second layer"
    )
    words = (
        f"does not follow {several} {words_of_number(_size(parts[0], samples), 3)}{unit} long, {why}:"
        f" {points:,} points ({points / len(samples.scan):.1%}) lie up to {words_of_number(found.scan[worst].max(), 3)}{unit} off"
    )
    at, *others = (place_of(place) for place in samples.scan[worst] + samples.origin)
    return Fault("unfollowed", words, at, tuple(others))


def crests_cut_off(grid: Grid, crests: Sequence[np.ndarray], length: float) -> tuple[int, ...]:
    """Return the numbers of the crests, each places (K, 3), that a grid cuts off, and of those that meet them: a box has all or none.

    length : desired member length [scan unit]
    """
    off = [np.quantile(distances_to_grid(places, grid, length)[0], SHARE_OF_CREST) for places in crests]
    chosen = [number for number in range(len(crests)) if off[number] > CREST_OFF * length]
    for number in chosen:  # each is added once
        ends = crests[number][[0, -1]]
        for other, places in enumerate(crests):
            gaps = np.linalg.norm(ends[:, None] - places[[0, -1]], axis=2)
            if other not in chosen and gaps.min() < CRESTS_MEET_WITHIN * length:
                chosen.append(other)
    return tuple(sorted(chosen))


def broken_ridges(grid: Grid, members: np.ndarray) -> list[Fault]:
    """Return a warning of the ridges that end before a corner for which they make.

    A corner is a node in which two other ridges end. An end at the boundary of the grid or on another ridge is none.

    members : (N,) desired member length at each point [scan unit]
    """
    lines = set(map(frozenset, grid.lines.tolist()))
    every = [np.array(each["nodes"]) for each in sets_of(grid, RIDGE) if len(each["nodes"]) > 1]
    rings = [len(chain) > 2 and frozenset(chain[[0, -1]].tolist()) in lines for chain in every]
    chains = [chain for chain, is_ring in zip(every, rings, strict=True) if not is_ring]
    ends = Counter(int(chain[at]) for chain in chains for at in (0, -1))
    corners = np.array([node for node, count in ends.items() if count > 1], np.int64)
    outer = {int(node) for chain in grid.boundary_loops for node in chain}
    found: list[tuple[float, np.ndarray]] = []
    for chain in chains:
        others = {int(node) for other in every if other is not chain for node in other}
        aims = corners[~np.isin(corners, chain)]
        for inwards in (chain, chain[::-1]):
            end = int(inwards[0])
            if end in outer or end in others or not len(aims):
                continue
            ahead = grid.nodes[end] - grid.nodes[inwards[min(LAST_MEMBERS, len(inwards) - 1)]]
            ways = grid.nodes[aims] - grid.nodes[end]
            away = np.linalg.norm(ways, axis=1)
            nearest = int(away.argmin())
            straight = ways[nearest] @ ahead >= AIMS_AT * away[nearest] * np.linalg.norm(ahead)
            if straight and away[nearest] <= BREAKS_WITHIN * members.mean():
                found.append((float(away[nearest]), grid.nodes[end] + 0.5 * ways[nearest] + grid.origin))
    if not found:
        return []
    found.sort(key=lambda each: -each[0])
    unit, more = f" {grid.unit}" if grid.unit else "", f" ({len(found)} such places)" if len(found) > 1 else ""
    words = f"breaks off a ridge {words_of_number(found[0][0], 3)}{unit} before the corner where others meet{more}"
    at, *also = (place_of(place) for _, place in found[:PLACES_KEPT])
    return [Fault("ridge", words, at, tuple(also))]
