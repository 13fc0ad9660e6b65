"""Sites chosen among the points, each point given to its site, and sites linked to those beside them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..kernels.geometry.boxes import SearchBoxes, new_boxes
from ..kernels.surface import normals as normal_kernels
from ..kernels.surface import samples as kernels
from ..runtime.parallel import in_parts
from ..scan.cloud import Bounds, bounds_of
from ..scan.normals import SAMPLES_PER_THREAD
from .streamline import is_dense, streamlined

NEIGHBORS = 12  # links of a site
CLOSE = 2.2  # size of the search boxes while sites are chosen, in their radii
POINTS_TO_SORT = 250_000  # points from which on they no longer fit into the cache, and are sorted
MANY_SAMPLES = 40_000  # the same where most points are sites of their own, which takes more room:
LONE = 0.3  # so far apart, in radii of a site
LARGE = 8.0  # size of the sites that they are sorted by, in radii of a site
POINTS_PER_THREAD = 20_000  # fewest points for a thread of their own
PATCH_SPACING = 0.3  # distance of points, in radii of a site, that serves the patches as well as any smaller one
ROUGH = 0.04  # sites thicker than this many member lengths are settled to a sheet first
SOME_ROUGH = 0.002  # share of rough sites from which on a scan may be a thick layer,
MANY_ROUGH = 0.007  # and from which on they are settled: fewer may lie along its ridges
SHEETS = 0.12  # sites thicker than this may be several sheets
FINER = 2  # times that sites are made twice as fine, to see whether a thick layer is several sheets
FINEST = 1.0  # spacings between the finest sites
BENT = 0.075  # sites of a smooth scan are no thicker than this, in member lengths
SAMPLES_WITHOUT_ROOM_FOR_RIDGE = 2  # sites at which a smooth scan is not: there is no room for a ridge


class Linked(NamedTuple):
    """Sites of one thinning radius, linked; their normals of either sign."""

    owner: np.ndarray  #: (N,) int64 site of each point
    chosen: np.ndarray  #: (S,) int64 point of each site
    grouped: np.ndarray  #: (N, 3) the points sorted by site
    start: np.ndarray  #: (S + 1,) int64 where each site's points start
    boxes: SearchBoxes
    mean: np.ndarray  #: (S, 3)
    neighbors: np.ndarray  #: (S, NEIGHBORS) int64
    normals: np.ndarray  #: (S, 3)
    thickness: np.ndarray  #: (S,)


def thin_dense(points: np.ndarray, bounds: Bounds, radius: float, spacing: float) -> np.ndarray:
    """Return those of very dense points, within these bounds, that serve as well as all of them, sorted where they are many.

    Sorted by much larger sites, what lies together in space does so in memory, in all that follows. By sites, not by boxes: a scan
    that is turned or moved stays sorted as it was.
    """
    if is_dense(spacing, PATCH_SPACING * radius):
        points = points.take(streamlined(points, bounds, PATCH_SPACING * radius), axis=0)
    if len(points) < (MANY_SAMPLES if spacing > LONE * radius else POINTS_TO_SORT):
        return points
    owner, _, places, _, _ = _settled(points, LARGE * radius, 0.0, 0.0)
    return group(points, owner, len(places))[0]


def link_samples(points: np.ndarray, radius: float, length: float, spacing: float) -> Linked:
    """Return the sites of points for one thinning radius."""
    owner, chosen, _, boxes, neighbors = _settled(points, radius, length, spacing)
    grouped, start, mean = group(points, owner, len(chosen))
    return Linked(owner, chosen, grouped, start, boxes, mean, neighbors, *_normals(mean, neighbors))


def is_smooth(found: Linked, length: float, uneven: float) -> bool:
    """Whether the scan is a smooth surface at the sites, flat or evenly bent: larger sites tell as much of it as smaller ones.

    uneven : angle by which the normals of neighbours, one mirrored to the other, differ at most [degree]
    """
    if (found.thickness > BENT * length).sum() > SAMPLES_WITHOUT_ROOM_FOR_RIDGE:
        return False
    marks, least = np.empty(len(found.mean), np.bool_), float(np.cos(np.radians(uneven)))
    linked = found.mean, found.normals, found.neighbors
    in_parts(
        len(marks),
        SAMPLES_PER_THREAD,
        lambda _, begin, end: normal_kernels.mark_uneven(*linked, least, marks, begin, end),
    )
    return bool(marks.sum() <= SAMPLES_WITHOUT_ROOM_FOR_RIDGE)


def link_finer(points: np.ndarray, radius: float, length: float, spacing: float) -> tuple[Linked, float] | None:
    """Return finer sites, and their radius, where these form smooth sheets; None where they do not.

    Sheets that lie side by side, a few sites apart, look like one rough layer. They come apart as soon as the sites are finer.
    """
    for _ in range(FINER):
        radius *= 0.5
        if radius < FINEST * spacing:
            return None
        found = link_samples(points, radius, length, spacing)
        if not is_rough(found, ROUGH * length):
            return found, radius
    return None


def settle_to_sheet(found: Linked, points: np.ndarray, radius: float, length: float, spacing: float) -> Linked:
    """Return the sites of a rough layer moved to its middle, thinned and linked anew."""
    moved = np.empty_like(found.mean)
    kernels.settle_samples(found.mean, found.neighbors, found.thickness, ROUGH * length, 0.6 * length, moved)
    joined, chosen, mean, boxes, neighbors = _settled(moved, radius, length, spacing)
    owner = joined[found.owner]
    grouped, start, _ = group(points, owner, len(chosen))
    return Linked(owner, found.chosen[chosen], grouped, start, boxes, mean, neighbors, *_normals(mean, neighbors))


def is_rough(found: Linked, rough: float, some: float = SOME_ROUGH) -> bool:
    """Whether the sites form a thick layer, no sheet: more than some of them, as a share, are thicker than `rough`."""
    return bool((found.thickness > rough).mean() > some)


def samples_of_points(points: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, SearchBoxes]:
    """Return a site within the radius of each point, the point of each site and where it is (S, 3), and the sites by box.

    Sites are points that keep the radius: each that has no earlier site nearer.
    """
    owner = np.full(len(points), -1, np.int64)
    lower, upper = bounds_of(points)
    capacity, begin, count = 1 << 14, 0, 0
    chosen, places = np.empty(capacity, np.int64), np.empty((capacity, 3))
    while True:
        boxes = new_boxes(lower, upper, CLOSE * radius, capacity, capacity)
        kernels.put_all(boxes, points, chosen[:count])
        begin, count = kernels.choose_samples(points, radius, boxes, owner, chosen, places, begin, count)
        if begin == len(points):
            break
        chosen = np.concatenate([chosen[:count], np.empty(3 * capacity, np.int64)])
        places = np.concatenate([places[:count], np.empty((3 * capacity, 3))])
        capacity = len(chosen)
    places, chosen = places[:count].copy(), chosen[:count].copy()
    boxes = new_boxes(lower, upper, 4.0 * radius, count, count)
    kernels.put_all(boxes, places, np.arange(count))
    return owner, chosen, places, boxes


def _settled(
    points: np.ndarray, radius: float, length: float, spacing: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, SearchBoxes, np.ndarray]:
    """Return the nearest site of each point, the point of each site and where it is, the sites by box and their neighbours."""
    owner, chosen, places, boxes = samples_of_points(points, radius)
    neighbors = _neighbors(places, boxes, length, radius, spacing)
    in_parts(
        len(points),
        POINTS_PER_THREAD,
        lambda _, begin, end: kernels.settle_points(points, places, neighbors, owner, begin, end),
    )
    return owner, chosen, places, boxes, neighbors


def _neighbors(places: np.ndarray, boxes: SearchBoxes, length: float, radius: float, spacing: float) -> np.ndarray:
    """Return the neighbours of each site (S, 3) among the others."""
    neighbors = np.full((len(places), NEIGHBORS), -1, np.int64)
    far = max(0.7 * length, 3.0 * spacing)
    near = max(2.9 * radius, 1.5 * spacing)
    in_parts(
        len(places),
        SAMPLES_PER_THREAD,
        lambda _, begin, end: kernels.nearest_samples(places, boxes, near, far, neighbors, begin, end),
    )
    kernels.link_back(places, neighbors)
    return neighbors


def _normals(mean: np.ndarray, neighbors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the normal of each site (either sign) and the thickness of the points there."""
    normals, thickness = np.empty_like(mean), np.empty(len(mean))
    in_parts(
        len(mean),
        SAMPLES_PER_THREAD,
        lambda _, begin, end: normal_kernels.sample_normals(mean, neighbors, normals, thickness, begin, end),
    )
    return normals, thickness


def group(points: np.ndarray, owner: np.ndarray, samples: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the points sorted by site, where each site's points start, and their means."""
    start, mean = np.zeros(samples + 1, np.int64), np.zeros((samples, 3))
    grouped = np.empty_like(points)
    kernels.group_points(points, owner, start, grouped, mean)
    return grouped, start, mean
