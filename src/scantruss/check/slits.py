"""Narrow gaps of a scan that its grid bridges: a slit, a cut, or two parts that stand close together."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..errors import words_of_number
from ..grid.certificate import Fault, LeftOut, place_of
from ..kernels.mesh.coverage import distances_on_triangles, nearest_distances
from ..runtime.parallel import in_parts, run_in_parts
from ..surface.chosen_samples import KEPT
from .distances import PLACES_MEASURED_PER_THREAD, boxes_of, feet_over, is_over_holes, normals_of, shares_of_corners
from .gaps import POINTS_AROUND_MIDDLE
from .left_out import points_together
from .limits import PLACES_KEPT

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..grid.grid import Grid
    from ..kernels.geometry.boxes import SearchBoxes
    from ..surface.samples import SurfaceSamples
    from .distances import Distances

FINEST_PLACES = 16  # places along a side of a triangle at most
MOST_PLACES_OF_GRID = 2_000_000  # places that are looked at in all
MOST_FAR_PLACES = 10_000  # of those far from all points, how many are looked at closely
# share of the places of a triangle that are nearer to a point than its usual distance, and least half width of a gap in those: at
# random points one place in a million is as far, between lines of a scanner none
SHARE_NEARER, UNUSUAL = 0.5, 3.2
SURELY_SLENDER, SLENDER_GAP = (
    4.5,
    5.0,
)  # ... where no place of a gap is farther than the first of these, it is as many widths long
FEWEST_ON_SIDE = 6  # places along a side of a triangle at least
# half width from which on a gap is a wide one, which is looked for elsewhere [member lengths]
WIDEST_HALF = 0.4
LEAST_STEPS = 0.7  # least half width [steps between places]
WAYS_AROUND = 12  # in which points are looked for around a place, an even number
TO_MIDDLE = 0.35  # step towards the middle of a gap [half widths]
BESIDE_GAP = np.array([1.3, 1.6, 1.9])  # how far away [half widths]
FILLED_WITHIN = 0.3  # distance of most places beside a gap from the nearest point, at most [half widths]
LONG_GAP = 0.5  # length from which on a narrow gap is said [member lengths]
# ... and of its middle, from half a width off its ends: a round one is looked for elsewhere [member lengths]
LONG_MIDDLE = 0.25
IN_A_ROW = 2.0  # gap between places of one narrow gap [steps between places]
FEWEST_IN_GAP = 4  # in one gap
# length up to which a gap is nearly round [widths]: then points must lie around it that make it no accident, as around a round one
NEARLY_ROUND = 1.5


@dataclass(frozen=True, eq=False)
class FeetOnGrid:
    """Points of a scan, each at its foot on the nearest triangle: neither noise nor a bend between nodes keeps them off the grid."""

    points: np.ndarray  #: (N, 3)
    boxes: SearchBoxes
    spacing: float
    on_triangle: np.ndarray  #: (T,) int64, how many there are on each triangle

    def away(self, places: np.ndarray) -> np.ndarray:
        """Return the distance of each place (..., 3) from the nearest foot."""
        flat = np.ascontiguousarray(places.reshape(-1, 3))
        distance = np.empty(len(flat))
        in_parts(
            len(flat),
            PLACES_MEASURED_PER_THREAD,
            lambda _, begin, end: nearest_distances(
                flat[begin:end], self.points, self.boxes, 3.0 * self.spacing, distance[begin:end]
            ),
        )
        return distance.reshape(places.shape[:-1])

    def away_from_triangles(self, corners: np.ndarray, shares: np.ndarray) -> np.ndarray:
        """Return the distance (T, P) of places all over triangles (T, 3, 3), by shares of their corners (P, 3), from the nearest foot."""
        distance = np.empty((len(corners), len(shares)))
        least = PLACES_MEASURED_PER_THREAD // len(shares)
        near = 2.0 * self.spacing
        run_in_parts(
            len(corners), least, distances_on_triangles, corners, shares, self.points, self.boxes, near, distance
        )
        return distance

    def within(self, place: np.ndarray, reach: float) -> int:
        """Return how many points lie within reach of a place (3,)."""
        return int((((self.points - place) ** 2).sum(axis=1) <= reach * reach).sum())


def narrow_gaps(
    grid: Grid,
    samples: SurfaceSamples,
    feet: FeetOnGrid | None,
    found: Distances,
    known: Sequence[LeftOut],
    length: float,
) -> tuple[list[LeftOut], list[Fault], list[LeftOut]]:
    """Return the narrow gaps that a grid bridges, the longest first, a warning of them, and what is known and a part of one.

    Along the middle of such a gap no point is as near as usual, and many lie on either side: at the boundary of a grid, in a part of
    the scan with fewer points, or off a sharp edge they do not.

    Parameters
    ----------
    feet : the points on the grid; None where there are none
    known : holes and gaps that are said already
    length : desired member length [scan unit]
    """
    if feet is None:
        return [], [], []
    members = np.full(len(grid.nodes), length) if grid.desired is None else grid.desired
    members = members[grid.triangles].mean(axis=1)
    near = np.flatnonzero(found.triangles <= WIDEST_HALF * members)  # others lie over closed holes and wide gaps
    if not len(near):
        return [], [], []
    places, owner, half, step, least = _far_places(grid, near, members[near], feet)
    if len(places) and samples.measured < len(samples.surface.mean):
        measured = ~is_over_holes(places, samples)
        places, owner, half, least = places[measured], owner[measured], half[measured], least[measured]
    places, half = _moved_to_middle(grid, feet, places, owner, half)
    inside = _has_points_on_both_sides(grid, feet, places, owner, half)
    places, owner, half, least = places[inside], owner[inside], half[inside], least[inside]
    if not len(places):
        return [], [], []
    group = points_together(places, IN_A_ROW * step[owner])
    gaps: list[tuple[LeftOut, float]] = []
    parts: list[LeftOut] = []
    for number in np.unique(group):
        own = np.flatnonzero(group == number)
        width, middle = 2.0 * float(half[own].max()), places[own[half[own].argmax()]]
        along, member = _extent(places[own]), float(members[owner[own]].mean())
        gap = LeftOut("gap", 0, 0.0, place_of(middle + samples.origin), size := along + width)
        if len(own) < FEWEST_IN_GAP or size < LONG_GAP * member or along < LONG_MIDDLE * member:
            continue
        if along < SLENDER_GAP * width and not (half[own] * UNUSUAL > SURELY_SLENDER * least[own]).any():
            continue
        here = places[own] + samples.origin
        if along < NEARLY_ROUND * width and feet.within(middle, width) < POINTS_AROUND_MIDDLE:
            continue
        if not any(_holds(each, here) for each in known):
            gaps.append((gap, width))
            parts += [each for each in known if each.kind == "gap" and _lies_in(each, here, width)]
    gaps.sort(key=lambda each: -(each[0].size or 0.0))
    warnings = [_warning(gaps, f" {samples.unit}" if samples.unit else "")] if gaps else []
    return [gap for gap, _ in gaps], warnings, parts


def feet_on(grid: Grid, samples: SurfaceSamples, found: Distances, length: float) -> FeetOnGrid | None:
    """Return the points near the grid at their feet; None where there are none."""
    near = np.flatnonzero((samples.judged == KEPT) & (found.scan <= 0.5 * length))
    if not len(near):
        return None
    triangle = found.triangle[near]
    _, points = feet_over(grid, triangle, samples.scan[near])
    boxes = boxes_of(points, max(0.15 * length, 6.0 * samples.spacing))
    return FeetOnGrid(points, boxes, samples.spacing, np.bincount(triangle, minlength=len(grid.triangles)))


def _far_places(
    grid: Grid, near: np.ndarray, members: np.ndarray, feet: FeetOnGrid
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return places on some triangles (K,) that are unusually far from points (P, 3), a triangle and the distance of each (P,).

    Then the distance between places of each of all triangles (T,), and the least unusual distance of each place (P,).

    members : (K,) desired lengths [scan unit]
    """
    along = min(
        FINEST_PLACES, math.ceil(float(members.mean()) / feet.spacing), math.isqrt(2 * MOST_PLACES_OF_GRID // len(near))
    )
    along = max(along, FEWEST_ON_SIDE)
    shares, corners = shares_of_corners(along), grid.nodes[grid.triangles]
    away = feet.away_from_triangles(corners[near], shares)
    usual = np.full(len(grid.triangles), np.inf)
    usual[near] = np.quantile(away, SHARE_NEARER, axis=1)
    least = UNUSUAL * np.sort(usual[_beside(grid)[near]], axis=1)[:, 1]  # of a triangle and those beside it
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    step = edges.mean(axis=1) / along
    at, which = np.nonzero(
        (away > np.maximum(least, LEAST_STEPS * step[near])[:, None]) & (away <= WIDEST_HALF * members[:, None])
    )
    every = len(at) // MOST_FAR_PLACES + 1
    at, which = at[::every], which[::every]
    places = (shares[which, :, None] * corners[near[at]]).sum(axis=1)
    return places, near[at], away[at, which], step * math.sqrt(every), least[at]


def _beside(grid: Grid) -> np.ndarray:
    """Return each triangle and those beside it (T, 4), itself where there are fewer."""
    beside = np.arange(len(grid.triangles))[:, None].repeat(4, axis=1)
    one, other = grid.edge_triangles[(grid.edge_triangles >= 0).all(axis=1)].T
    ends, others = np.concatenate([one, other]), np.concatenate([other, one])
    order = np.argsort(ends, kind="stable")
    ends, others = ends[order], others[order]
    rank = np.arange(len(ends)) - np.searchsorted(ends, ends)
    beside[ends[rank < 3], 1 + rank[rank < 3]] = others[rank < 3]
    return beside


def _ways(grid: Grid, owner: np.ndarray) -> np.ndarray:
    """Return directions all around (P, D, 3) in the plane of each triangle (P,)."""
    a, b, _ = grid.nodes[grid.triangles[owner].T]
    along = (b - a) / np.maximum(np.linalg.norm(b - a, axis=1, keepdims=True), 1e-300)
    across = np.cross(normals_of(grid)[owner], along)
    turn = 2.0 * np.pi * np.arange(WAYS_AROUND) / WAYS_AROUND
    ways: np.ndarray = np.cos(turn)[:, None] * along[:, None] + np.sin(turn)[:, None] * across[:, None]
    return ways


def _moved_to_middle(
    grid: Grid, feet: FeetOnGrid, places: np.ndarray, owner: np.ndarray, half: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return places (P, 3) a step nearer to the middle of their gap, and how far each is from the nearest point (P,)."""
    tried = places[:, None] + (TO_MIDDLE * half)[:, None, None] * _ways(grid, owner)
    away = feet.away(tried)
    best, each = away.argmax(axis=1) if len(places) else owner, np.arange(len(places))
    nearer = away[each, best] > half
    return np.where(nearer[:, None], tried[each, best], places), np.where(nearer, away[each, best], half)


def _has_points_on_both_sides(
    grid: Grid, feet: FeetOnGrid, places: np.ndarray, owner: np.ndarray, half: np.ndarray
) -> np.ndarray:
    """Return which places (P, 3) have points beyond half a width (P,) on opposite sides, as close together as a gap needs (P,) bool."""
    around = places[:, None, None] + (half[:, None] * BESIDE_GAP)[:, None, :, None] * _ways(grid, owner)[:, :, None]
    away = feet.away(around) / half[:, None, None]  # (P, D, R)
    wide = np.concatenate([np.roll(away, 1, axis=1), away, np.roll(away, -1, axis=1)], axis=2)
    filled = np.median(wide, axis=2) <= FILLED_WITHIN
    found: np.ndarray = (filled & np.roll(filled, WAYS_AROUND // 2, axis=1)).any(axis=1)
    return found


def _extent(places: np.ndarray) -> float:
    """Return how long some places (P, 3) are in their longest direction."""
    off = places - places.mean(axis=0)
    direction = np.linalg.svd(off, full_matrices=False)[2][0]
    return float(np.ptp(off @ direction))


def _holds(known: LeftOut, places: np.ndarray) -> bool:
    """Whether most of some places (P, 3), in the scan's own frame, lie within a hole or gap that is said already."""
    if known.where is None or known.size is None:
        return False
    return bool(np.mean(np.linalg.norm(places - known.where, axis=1) <= 0.5 * known.size) > 0.5)


def _lies_in(known: LeftOut, places: np.ndarray, width: float) -> bool:
    """Whether the middle of a gap that is known lies in a longer one, by places (P, 3) along that."""
    return known.where is not None and bool(np.linalg.norm(places - known.where, axis=1).min() <= width)


def _warning(gaps: list[tuple[LeftOut, float]], unit: str) -> Fault:
    """Return the warning of some gaps with their widths, the longest first."""
    longest, width = gaps[0]
    more = f" ({len(gaps)} such places)" if len(gaps) > 1 else ""
    long = words_of_number(longest.size or 0.0, 3)
    words = f"bridges a gap {words_of_number(width, 3)}{unit} wide and {long}{unit} long{more}"
    also = tuple(gap.where for gap, _ in gaps[1:PLACES_KEPT] if gap.where)
    return Fault("gap", words, longest.where, also)
