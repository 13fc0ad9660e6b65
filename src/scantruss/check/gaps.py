"""Gaps of a scan that its grid bridges: where a triangle covers a place that has points all around, none of them near."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from ..errors import words_of_number
from ..grid.certificate import Fault, LeftOut, place_of
from ..kernels.geometry.components import component_labels
from ..settings import SMALLEST_HOLE
from ..surface.chosen_samples import LIMB, ROD
from .distances import nearest_point_distances
from .limits import PLACES_KEPT
from .mouths import mouths_closed

if TYPE_CHECKING:
    from ..boundary.find import Boundary
    from ..grid.grid import Grid
    from ..surface.samples import SurfaceSamples

#: places in a triangle that are looked at, by its corners; with its corners and the middles of its members none is farther than a sixth
#: of a member from one of them
PLACES_IN_TRIANGLE = np.array([[2, 2, 2], [4, 1, 1], [1, 4, 1], [1, 1, 4]]) / 6.0
#: places a ninth of a member apart all over a triangle that may cover a gap: one of them is near the middle of that
MORE_PLACES = np.array([[a, b, 9 - a - b] for a in range(10) for b in range(10 - a)]) / 9.0
OFF_BOUNDARY = 1.0 / 6.0  # how far such places are from the boundary of the grid [heights of the triangle]
# distance of one of the first places from the middle of a gap that makes its triangle one that may cover it [member lengths]
NEAR_MIDDLE = 0.1
HALF_WIDTH = 0.2  # least distance from the nearest point at which a place lies in a gap [member lengths]
# ... and in usual distances: at random points none is farther, between lines of a scanner half as far
FAR_OF_USUAL = 4.0
SOME_PLACES = 50  # places from which the usual distance is taken
POINTS_AROUND = 45  # points up to twice that distance from which on an empty place is no accident, as exp(-n/3) tells
# ... where the emptiest of many places is chosen, which is farther from points than one at random
POINTS_AROUND_MIDDLE = 60
# ... where it is the emptiest of a whole scan: that none of n points is within half of their reach has a probability of (3 / 4)^n
POINTS_AROUND_EMPTIEST = 75
# sectors of the ring around an empty place, and least number of points in the two that have fewest: where these tell the density, the place
# is empty at random with a probability of exp(-7)
SECTORS_OF_RING, LEAST_OF_TWO = 6, 7
PLACES_ACROSS_GAP = np.stack(np.meshgrid(*[np.linspace(-0.6, 0.6, 7)] * 2), axis=-1).reshape(
    -1, 2
)  # places around another [its arms]
FACES_AS_AROUND = 0.5  # least cosine between the normals of a gap and of the surface around it
MOST_BRIDGED = 1.2  # width of a gap that is open there from which on a grid that bridges it fails [member lengths]
OPEN_FROM = 0.1  # distance of the boundary from the nearest point from which on a gap there is open [member lengths]
WIDE_OPENING = 0.5  # longest side from which on an opening that is closed is said [member lengths]
# distance from an opening within which what was left out may be why it is closed [member lengths], and that of its middle from the axis
# of what was left out [size of the opening]
BESIDE_HOLE, OFF_AXIS = 0.75, 0.3
GAPS_LOOKED_AT = 500  # places that are looked at closely, those farthest from all points first


def bridged_gaps(
    grid: Grid, samples: SurfaceSamples, boundary: Boundary, length: float
) -> tuple[list[LeftOut], list[Fault]]:
    """Return the gaps that a grid bridges and that are not known as closed holes, the widest first, and a warning.

    The warning is of those that are open at the boundary of the grid: there it joins what is apart, or covers a bay. It is a fault, of
    kind "bridged", where one of them is wider than `MOST_BRIDGED`. Another is of the mouths of slots that it closes.

    length : desired member length [scan unit]
    """
    gaps, said = _gaps_within(grid, samples, boundary, length)
    return gaps, [*said, *mouths_closed(grid, samples, length, said)]


def _gaps_within(
    grid: Grid, samples: SurfaceSamples, boundary: Boundary, length: float
) -> tuple[list[LeftOut], list[Fault]]:
    """Return the gaps of `bridged_gaps` and the warning of those that are open at the boundary of the grid.

    Points at random leave a disc of radius d free with a probability of exp(-pi d^2 density), and the ring from d to twice d, of three
    times its area, tells the density there: n points around an empty disc mean that it would hold n / 3. Discs lie in the planes of
    the triangles, so that a triangle off a bent surface is none over a gap.
    """
    points = samples.points_by_x
    places, owner = _places(grid)
    away = nearest_point_distances(places, samples, length)
    members = np.full(len(grid.nodes), length) if grid.desired is None else grid.desired
    members = members[grid.triangles].mean(axis=1)
    least = HALF_WIDTH * members
    if not (away > (least - NEAR_MIDDLE * members)[owner]).any():
        return [], []
    normals = _normals(grid)
    some = np.arange(0, len(places), len(places) // SOME_PLACES + 1)
    usual = np.median([_level(places[at], normals[owner[at]], away[at], points).min(initial=away[at]) for at in some])
    least = np.maximum(least, FAR_OF_USUAL * usual)
    covering = np.unique(owner[away > (least - NEAR_MIDDLE * members)[owner]])
    extra, theirs = _more_places(grid, covering)
    from_extra = nearest_point_distances(extra, samples, length)
    order = np.lexsort((-from_extra, theirs))
    best = order[np.unique(theirs[order], return_index=True)[1]]
    needed = np.repeat([POINTS_AROUND, POINTS_AROUND_MIDDLE], [len(places), len(best)])
    places, owner = np.concatenate([places, extra[best]]), np.concatenate([owner, theirs[best]])
    away = np.concatenate([away, from_extra[best]])
    least = least[owner]
    far = np.flatnonzero(away > least)
    far = far[np.argsort(-away[far], kind="stable")[:GAPS_LOOKED_AT]]
    half = np.array([empty_disc(places[at], normals[owner[at]], away[at], points, needed[at]) for at in far])
    edge = points_of_loops(boundary)
    half *= [
        not is_sparse_beside(places[at], normals[owner[at]], r, points, edge)
        and _lies_along(places[at], normals[owner[at]], r, samples)
        for at, r in zip(far, half, strict=True)
    ]
    far, half = far[half > least[far]], half[half > least[far]]
    if not len(far):
        return [], []
    triangle = owner[far]
    group = _groups(grid, triangle, places[far], half)[triangle]
    is_open = _open_triangles(grid, samples, length)
    found: list[tuple[float, LeftOut, bool, bool]] = []
    for each in np.unique(group):
        own = np.flatnonzero(group == each)
        widest = own[half[own].argmax()]
        middle, width = places[far[widest]], 2.0 * float(half[widest])
        if not _is_known(middle, samples, boundary):
            size = float(np.ptp(places[far[own]], axis=0).max()) + width
            gap = LeftOut("gap", 0, 0.0, place_of(middle + samples.origin), size)
            too_wide = width > MOST_BRIDGED * float(members[triangle[widest]])
            found.append((width, gap, bool(is_open[triangle[own]].any()), too_wide))
    found.sort(key=lambda each: -each[0])
    unit = f" {samples.unit}" if samples.unit else ""
    wide = [(width, gap.where) for width, gap, reaches_boundary, _ in found if reaches_boundary]
    kind = "bridged" if any(reaches_boundary and too_wide for _, _, reaches_boundary, too_wide in found) else "gap"
    more = f" ({len(wide)} such places)" if len(wide) > 1 else ""
    words = f"bridges a gap {words_of_number(wide[0][0], 3)}{unit} wide{more}" if wide else ""
    warnings = (
        [Fault(kind, words, wide[0][1], tuple(where for _, where in wide[1:PLACES_KEPT] if where))] if wide else []
    )
    return [gap for _, gap, _, _ in found], warnings


def openings_closed(
    holes: list[LeftOut], said: list[Fault], samples: SurfaceSamples, length: float, unit: str
) -> list[Fault]:
    """Return a warning of the openings that a grid closes though nobody asked for it, and that are not small; none of those said."""
    known = {place for fault in said for place in (fault.where, *fault.also)}
    wide = [
        hole
        for hole in holes
        if not hole.asked and hole.where not in known and (hole.size or 0.0) > WIDE_OPENING * length
    ]
    if not wide:
        return []
    wide.sort(key=lambda hole: -(hole.size or 0.0))
    left_out = ((ROD, "a column or the like was left out"), (LIMB, "a limb was cut off"))
    said_here: list[Fault] = []
    for judged, why in left_out:
        points = samples.scan[samples.judged == judged]
        own = [hole for hole in wide if hole.where and _is_in_line(points, hole, samples.origin, length)]
        wide = [hole for hole in wide if hole not in own]
        said_here += _closed(own, "closes a place", f", where {why}", unit)
    small = bool(wide) and (wide[0].size or 0.0) < SMALLEST_HOLE / math.pi * length
    then = f"; shorter members {'leave' if small else 'may leave'} it open"
    return said_here + _closed(wide, "closes an opening", "", unit, then)


def _closed(holes: list[LeftOut], begin: str, why: str, unit: str, then: str = "") -> list[Fault]:
    """Return the warning of the holes that a grid closes, the largest first, by words for one; none of no hole."""
    if not holes:
        return []
    places, count = [hole.where for hole in holes if hole.where], sum(hole.number for hole in holes)
    what = f"{words_of_number(holes[0].size or 0.0, 3)}{unit and ' ' + unit} across"
    words = f"{begin} {what}{why}{f' ({count} such places)' if count > 1 else ''}{then}"
    return [Fault("closed", words, places[0] if places else None, tuple(places[1:PLACES_KEPT]))]


def _is_in_line(points: np.ndarray, hole: LeftOut, origin: np.ndarray, length: float) -> bool:
    """Whether the points (N, 3) from an origin (3,) near a hole, as of a column, are in line with its middle."""
    size, away = hole.size or 0.0, points + origin - np.array(hole.where)
    reach, far = size + BESIDE_HOLE * length, np.linalg.norm(away, axis=1)
    if not (far <= reach).any():
        return False
    near = away[far <= 2.0 * reach]  # so much of a column that it is longer than wide
    middle = near.mean(axis=0)
    axis = np.linalg.svd(near - middle, full_matrices=False)[2][0]
    return bool(np.linalg.norm(middle - (middle @ axis) * axis) <= OFF_AXIS * size)


def is_empty_within(curve: np.ndarray, points: np.ndarray, edge: np.ndarray | None = None) -> bool:
    """Whether a closed curve (M, 3) is around a place that is no accident to be empty.

    points : (N, 3) by ascending x; edge : as of `is_sparse_beside`, which is asked too where it is given.
    """
    middle = curve.mean(axis=0)
    along, across, normal = np.linalg.svd(curve - middle)[2]
    reach = float(np.linalg.norm(curve - middle, axis=1).max())
    # a curve of few samples is not around the middle of its hole; one along an edge is narrow, and beside it is air
    half = np.array([reach, np.abs((curve - middle) @ across).max()])
    place = _emptiest(middle, half[:, None] * np.stack([along, across]), reach, points)
    away = float(np.linalg.norm(points_within(place, reach, points) - place, axis=1).min(initial=reach))
    radius = empty_disc(place, normal, away, points, POINTS_AROUND_EMPTIEST)
    return radius > 0.0 and (edge is None or not is_sparse_beside(place, normal, radius, points, edge))


def points_of_loops(boundary: Boundary) -> np.ndarray:
    """Return the points of all loops of a boundary (B, 3)."""
    return np.concatenate([np.zeros((0, 3)), *(loop.points for loop in boundary.loops)])


def is_sparse_beside(
    place: np.ndarray, normal: np.ndarray, radius: float, points: np.ndarray, edge: np.ndarray
) -> bool:
    """Whether points are so few on one side of an empty disc that it may belong to a sparse part of the scan, and is no opening.

    points : (N, 3) by ascending x; edge : (B, 3) boundary of the scan, near which no side is looked at.
    """
    if radius <= 0.0 or bool((((edge - place) ** 2).sum(axis=1) < (2.0 * radius) ** 2).any()):
        return False
    around = points_within(place, 3.0 * radius, points) - place
    x, y = np.linalg.svd(normal[None])[2][1:]
    u, v, height = around @ x, around @ y, around @ normal
    in_ring = (np.abs(height) <= 2.0 * radius) & (np.hypot(u, v) <= 2.0 * radius)
    sector = ((np.arctan2(v, u) / (2.0 * np.pi) + 0.5) * SECTORS_OF_RING).astype(int) % SECTORS_OF_RING
    count = np.sort(np.bincount(sector[in_ring], minlength=SECTORS_OF_RING))
    return bool(count[:2].sum() < LEAST_OF_TWO)


def _lies_along(place: np.ndarray, normal: np.ndarray, radius: float, samples: SurfaceSamples) -> bool:
    """Whether an empty disc lies along the surface around it: one that cuts off an acute edge or a tip lies across its sides."""
    if radius <= 0.0:
        return False
    surface = samples.surface
    around = ((surface.mean - place) ** 2).sum(axis=1) <= (2.0 * radius) ** 2
    return not around.any() or bool(np.median(np.abs(surface.normals[around] @ normal)) >= FACES_AS_AROUND)


def points_within(place: np.ndarray, reach: float, points: np.ndarray) -> np.ndarray:
    """Return the points (K, 3) of those by ascending x (N, 3) that lie within reach of a place."""
    begin, end = np.searchsorted(points[:, 0], [place[0] - reach, place[0] + reach])
    around = points[begin:end]
    near: np.ndarray = around[((around - place) ** 2).sum(axis=1) <= reach * reach]
    return near


def _emptiest(middle: np.ndarray, arms: np.ndarray, reach: float, points: np.ndarray) -> np.ndarray:
    """Return the place (3,) around another, by arms (2, 3) of a reach at most, that is farthest from all points (N, 3) by ascending x."""
    around = points_within(middle, 2.0 * reach, points)
    places: np.ndarray = middle + PLACES_ACROSS_GAP @ arms
    away = [np.linalg.norm(around - place, axis=1).min(initial=reach) for place in places]
    return places[int(np.argmax(away))]


def empty_disc(
    place: np.ndarray, normal: np.ndarray, away: float, points: np.ndarray, least: int = POINTS_AROUND
) -> float:
    """Return the radius of the disc around a place (3,) that is free of points, 0 where that may be an accident.

    away : distance of the nearest point; points : (N, 3) by ascending x; least : points around it from which on it is no accident.
    """
    level = _level(place, normal, away, points)
    radius = float(level.min(initial=away))
    return radius if (level <= 2.0 * radius).sum() >= least else 0.0


def _level(place: np.ndarray, normal: np.ndarray, away: float, points: np.ndarray) -> np.ndarray:
    """Return the distances in the plane at a place of the points near it (K,); parameters as of `empty_disc`."""
    around = points_within(place, 3.0 * away, points) - place
    height = around @ normal
    level: np.ndarray = np.sqrt(np.maximum((around**2).sum(axis=1) - height**2, 0.0))[np.abs(height) <= 2.0 * away]
    return level


def _normals(grid: Grid) -> np.ndarray:
    """Return the unit normals of the triangles (T, 3), zero where they have none."""
    a, b, c = grid.nodes[grid.triangles.T]
    normal: np.ndarray = np.cross(b - a, c - a)
    return normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)


def _places(grid: Grid) -> tuple[np.ndarray, np.ndarray]:
    """Return places all over the triangles of a grid but not on its boundary (P, 3), and a triangle in which each is (P,)."""
    inner = grid.edge_triangles[:, 1] >= 0
    of_node = np.full(len(grid.nodes), -1)
    of_node[grid.triangles] = np.arange(len(grid.triangles))[:, None]
    of_node[grid.edges[~inner]] = -1
    nodes = np.flatnonzero(of_node >= 0)
    inside = np.einsum("pc,tcx->tpx", PLACES_IN_TRIANGLE, grid.nodes[grid.triangles]).reshape(-1, 3)
    places = np.concatenate([inside, grid.nodes[grid.edges[inner]].mean(axis=1), grid.nodes[nodes]])
    numbers = np.arange(len(grid.triangles)).repeat(len(PLACES_IN_TRIANGLE))
    return places, np.concatenate([numbers, grid.edge_triangles[inner, 0], of_node[nodes]])


def _more_places(grid: Grid, chosen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return places all over some triangles (K,) but not near the boundary of their grid (P, 3), and a triangle of each (P,)."""
    outer = np.flatnonzero(grid.edge_triangles[:, 1] < 0)
    triangles, ends = grid.edge_triangles[outer, 0], grid.edges[outer]
    opposite = np.zeros((len(grid.triangles), 3), np.bool_)  # corners that face a member of the boundary
    member, corner = np.nonzero((grid.triangles[triangles][:, :, None] != ends[:, None, :]).all(axis=2))
    opposite[triangles[member], corner] = True
    at_boundary = np.isin(grid.triangles[chosen], ends)
    near = (opposite[chosen][:, None] & (MORE_PLACES < OFF_BOUNDARY - 1e-9)).any(axis=2)
    near |= (at_boundary[:, None] & (MORE_PLACES > 1.0 - OFF_BOUNDARY + 1e-9)).any(axis=2)
    places = np.einsum("pc,tcx->tpx", MORE_PLACES, grid.nodes[grid.triangles[chosen]])[~near]
    return places, chosen[np.nonzero(~near)[0]]


def _open_triangles(grid: Grid, samples: SurfaceSamples, length: float) -> np.ndarray:
    """Return which triangles (T,) bool have a node where the boundary of the grid leaves the scan."""
    members = grid.edges[grid.edge_triangles[:, 1] < 0]
    places = np.concatenate([grid.nodes[members].mean(axis=1), grid.nodes[members[:, 0]]])
    away = nearest_point_distances(places, samples, length)
    ends = np.concatenate([members, members[:, :1].repeat(2, axis=1)])
    return np.asarray(np.isin(grid.triangles, ends[away > OPEN_FROM * length]).any(axis=1))


def _groups(grid: Grid, chosen: np.ndarray, middles: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """Return a number (T,) for each triangle: the same for those of some (K,) that have a member in common or whose discs overlap."""
    one, other = grid.edge_triangles[np.isin(grid.edge_triangles, chosen).all(axis=1)].T
    apart = np.linalg.norm(middles[:, None] - middles, axis=2)
    these, those = np.nonzero(apart < radii[:, None] + radii)
    label: np.ndarray = component_labels(
        len(grid.triangles), np.concatenate([one, chosen[these]]), np.concatenate([other, chosen[those]])
    )
    return label


def _is_known(place: np.ndarray, samples: SurfaceSamples, boundary: Boundary) -> bool:
    """Whether a place (3,) lies over a hole that was filled, or in the curve around one that is bridged."""
    mean = samples.surface.mean
    away = ((mean - place) ** 2).sum(axis=1)
    if away.argmin() >= samples.measured:
        return True
    around = ((curve, curve.mean(axis=0)) for curve in boundary.bridged)
    return any(
        np.linalg.norm(place - middle) <= np.linalg.norm(curve - middle, axis=1).max() for curve, middle in around
    )
