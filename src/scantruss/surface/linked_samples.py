"""Surface samples: chosen among the points, given the points nearest to them, and linked to their neighbours."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..kernels.geometry.boxes import SearchBoxes, new_boxes
from ..kernels.surface import normals as normal_kernels
from ..kernels.surface import samples as kernels
from ..runtime.parallel import run_in_parts
from ..scan.clean.streamline import is_dense, streamlined
from ..scan.cloud import Bounds, bounds_of
from ..scan.normals import NORMALS_PER_THREAD
from .given_normals import NO_NORMALS, GivenNormals

LINKS_OF_A_SAMPLE = 12  # most links of a sample
LINK_BOX = 4.0  # size d_B of the search boxes of the samples (Eq. 1), in which they are linked [sample radii]
CHOOSING_BOX = 2.2  # size of the search boxes while samples are chosen [sample radii]
POINTS_TO_SORT = 250_000  # points from which on they are sorted in space, because they do not fit into the cache
# points from which on they are sorted where most are samples themselves, which takes more memory
SAMPLES_TO_SORT = 40_000
LONE_SPACING = 0.3  # point spacing above which most points are samples themselves [sample radii]
SORTING_RADIUS = 8.0  # radius of the samples by which points are sorted [sample radii]
LINKED_POINTS_PER_THREAD = 20_000  # fewest points worth a thread of their own
PATCH_SPACING = 0.3  # point spacing that is dense enough for fitting patches [sample radii]
ROUGH_SAMPLE = 0.04  # thickness above which a sample is rough and moved to the middle of its sheet [member lengths]
SOME_ROUGH = 0.002  # share of rough samples above which a scan may be a thick layer
MANY_ROUGH = 0.007  # share of rough samples above which they are moved; fewer may lie along ridges
THICKNESS_OF_SHEETS = 0.12  # thickness above which a sample may hold several sheets [member lengths]
# share of the thick samples that finer ones may leave rough where sheets come apart: those along the edges at which they meet
SHARE_ALONG_EDGES = 0.2
# rough samples linked to one along an edge, at least, and the share of them that are: 0.94 and more on walls with a lip, 0.72 and less
# between layers that are nowhere joined
SEVERAL_BESIDE, MOST_BESIDE = 3, 0.9
MOST_REFINEMENTS = 2  # most times that the sample radius is halved to see whether a thick layer is several sheets
FINEST_RADIUS = 1.0  # smallest radius of a sample [point spacings]
SMOOTH_THICKNESS = 0.075  # largest thickness of the samples of a smooth scan [member lengths]
SAMPLES_WITHOUT_ROOM_FOR_RIDGE = 2  # rough samples that a smooth scan may have: too few for a ridge


class Linked(NamedTuple):
    """Samples of one thinning radius, linked; their normals of either sign."""

    owner: np.ndarray  #: (N,) int64 sample of each point
    chosen: np.ndarray  #: (S,) int64 point of each sample
    grouped: np.ndarray  #: (N, 3) the points sorted by sample
    start: np.ndarray  #: (S + 1,) int64 where each sample's points start
    boxes: SearchBoxes
    mean: np.ndarray  #: (S, 3)
    neighbors: np.ndarray  #: (S, LINKS_OF_A_SAMPLE) int64
    normals: np.ndarray  #: (S, 3)
    thickness: np.ndarray  #: (S,)
    facing: np.ndarray = NO_NORMALS  #: (S, 3) normals given with the scan, (0, 3) where none are


def thin_dense(points: np.ndarray, bounds: Bounds, radius: float, spacing: float) -> np.ndarray:
    """Return as many of the points, which lie within these bounds, as the samples need; large numbers of them sorted in space.

    They are sorted by much larger samples, so that points close in space are close in memory. Samples serve better than boxes here:
    turning or moving a scan does not change the order.
    """
    if is_dense(spacing, PATCH_SPACING * radius):
        points = points.take(streamlined(points, bounds, PATCH_SPACING * radius), axis=0)
    if len(points) < (SAMPLES_TO_SORT if spacing > LONE_SPACING * radius else POINTS_TO_SORT):
        return points
    owner, _, places, _, _ = _settled(points, SORTING_RADIUS * radius, 0.0, 0.0, NO_NORMALS)
    return group(points, owner, len(places))[0]


def link_samples(
    points: np.ndarray, radius: float, length: float, spacing: float, given: GivenNormals | None = None
) -> Linked:
    """Return the samples of points for one thinning radius, those that face opposite ways by the given normals apart."""
    facing = given.at(points) if given is not None else NO_NORMALS
    owner, chosen, _, boxes, neighbors = _settled(points, radius, length, spacing, facing)
    grouped, start, mean = group(points, owner, len(chosen))
    own = facing[chosen] if len(facing) else facing
    return Linked(owner, chosen, grouped, start, boxes, mean, neighbors, *_normals(mean, neighbors), own)


def is_smooth(found: Linked, length: float, uneven: float) -> bool:
    """Whether the scan is a smooth surface, flat or evenly bent, so that larger samples describe it as well as smaller ones.

    uneven : largest angle between the normals of neighbours after one is mirrored to the other [degree]
    """
    if (found.thickness > SMOOTH_THICKNESS * length).sum() > SAMPLES_WITHOUT_ROOM_FOR_RIDGE:
        return False
    marks, least = np.empty(len(found.mean), np.bool_), float(np.cos(np.radians(uneven)))
    linked = found.mean, found.normals, found.neighbors
    run_in_parts(len(marks), NORMALS_PER_THREAD, normal_kernels.mark_uneven, *linked, least, marks)
    return bool(marks.sum() <= SAMPLES_WITHOUT_ROOM_FOR_RIDGE)


def link_finer(
    coarse: Linked, points: np.ndarray, radius: float, length: float, spacing: float, given: GivenNormals | None = None
) -> tuple[Linked, float] | None:
    """Return finer samples and their radius if they form smooth sheets, else None.

    Sheets that lie only a few samples apart look like one rough layer; finer samples separate them. Few of these are rough then, side by
    side along the edges where the sheets meet; in noise most stay so.
    """
    thick = float((coarse.thickness > THICKNESS_OF_SHEETS * length).mean())
    for _ in range(MOST_REFINEMENTS):
        radius *= 0.5
        if radius < FINEST_RADIUS * spacing:
            return None
        found = link_samples(points, radius, length, spacing, given)
        rough = found.thickness > ROUGH_SAMPLE * length
        if rough.mean() <= SOME_ROUGH or (
            rough.mean() <= SHARE_ALONG_EDGES * thick and _are_side_by_side(found, rough)
        ):
            return found, radius
    return None


def _are_side_by_side(found: Linked, which: np.ndarray) -> bool:
    """Whether most of some samples (S,) bool are linked to several of them, as along edges, and not scattered as between two layers."""
    beside = ((found.neighbors >= 0) & which[found.neighbors]).sum(axis=1)
    return bool((beside[which] >= SEVERAL_BESIDE).mean() >= MOST_BESIDE)


def refined(
    found: Linked, points: np.ndarray, coarse: np.ndarray, radius: float, length: float, spacing: float
) -> Linked:
    """Return the samples with finer ones, of a smaller radius, in place of some of them, `coarse` (S,) bool."""
    among, kept = np.flatnonzero(coarse[found.owner]), int((~coarse).sum())
    owner, finer, _, _ = samples_of_points(points[among], radius)
    chosen = np.concatenate([found.chosen[~coarse], among[finer]])
    places = np.concatenate([found.mean[~coarse], points[among[finer]]])
    owners = (np.cumsum(~coarse) - 1)[found.owner]
    owners[among] = kept + owner
    boxes = new_boxes(*bounds_of(places), float(found.boxes.size.max()), len(places), len(places))
    kernels.put_all(boxes, places, np.arange(len(places)))
    neighbors = _neighbors(places, boxes, length, radius, spacing, NO_NORMALS)
    settled = points, places, neighbors, owners, NO_NORMALS, chosen
    run_in_parts(len(points), LINKED_POINTS_PER_THREAD, kernels.settle_points, *settled)
    alone = np.flatnonzero(np.bincount(owners, minlength=len(chosen)) == 0)
    owners[chosen[alone]] = alone  # one that lies at no point may lose all of its points to finer ones: its own stays
    grouped, start, mean = group(points, owners, len(chosen))
    mean[:kept] = places[:kept]
    return Linked(owners, chosen, grouped, start, boxes, mean, neighbors, *_normals(mean, neighbors))


def settle_to_sheet(
    found: Linked, points: np.ndarray, radius: float, length: float, spacing: float, still: np.ndarray
) -> Linked:
    """Return the samples of a rough layer moved to its middle, but those that stay where they are, thinned and linked again."""
    moved, thickness = np.empty_like(found.mean), np.where(still, 0.0, found.thickness)
    kernels.settle_samples(found.mean, found.neighbors, thickness, ROUGH_SAMPLE * length, 0.6 * length, moved)
    joined, chosen, mean, boxes, neighbors = _settled(moved, radius, length, spacing, found.facing)
    owner = joined[found.owner]
    grouped, start, _ = group(points, owner, len(chosen))
    facing = found.facing[chosen] if len(found.facing) else found.facing
    chosen = found.chosen[chosen]
    return Linked(owner, chosen, grouped, start, boxes, mean, neighbors, *_normals(mean, neighbors), facing)


def is_rough(found: Linked, rough: float, some: float = SOME_ROUGH) -> bool:
    """Whether the samples form a thick layer and no sheet: a larger share of them than `some` is thicker than `rough`."""
    return bool((found.thickness > rough).mean() > some)


def samples_of_points(
    points: np.ndarray, radius: float, facing: np.ndarray = NO_NORMALS
) -> tuple[np.ndarray, np.ndarray, np.ndarray, SearchBoxes]:
    """Return a sample within the radius of each point, the point of each sample, its position (S, 3), and the samples by box.

    Each point with no earlier sample within the radius becomes a sample.
    """
    owner = np.full(len(points), -1, np.int64)
    lower, upper = bounds_of(points)
    capacity, begin, count = 1 << 14, 0, 0
    chosen, places = np.empty(capacity, np.int64), np.empty((capacity, 3))
    while True:
        boxes = new_boxes(lower, upper, CHOOSING_BOX * radius, capacity, capacity)
        kernels.put_all(boxes, points, chosen[:count])
        begin, count = kernels.choose_samples(points, radius, boxes, owner, chosen, places, begin, count, facing)
        if begin == len(points):
            break
        chosen = np.concatenate([chosen[:count], np.empty(3 * capacity, np.int64)])
        places = np.concatenate([places[:count], np.empty((3 * capacity, 3))])
        capacity = len(chosen)
    places, chosen = places[:count].copy(), chosen[:count].copy()
    boxes = new_boxes(lower, upper, LINK_BOX * radius, count, count)
    kernels.put_all(boxes, places, np.arange(count))
    return owner, chosen, places, boxes


def _settled(
    points: np.ndarray, radius: float, length: float, spacing: float, facing: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, SearchBoxes, np.ndarray]:
    """Return the nearest sample of each point, the point and position of each sample, the samples by box, and their neighbours."""
    owner, chosen, places, boxes = samples_of_points(points, radius, facing)
    neighbors = _neighbors(places, boxes, length, radius, spacing, facing[chosen] if len(facing) else facing)
    settled = points, places, neighbors, owner, facing, chosen
    run_in_parts(len(points), LINKED_POINTS_PER_THREAD, kernels.settle_points, *settled)
    return owner, chosen, places, boxes, neighbors


def _neighbors(
    places: np.ndarray, boxes: SearchBoxes, length: float, radius: float, spacing: float, facing: np.ndarray
) -> np.ndarray:
    """Return the neighbours of each sample (S, 3) among the others."""
    neighbors = np.full((len(places), LINKS_OF_A_SAMPLE), -1, np.int64)
    far = max(0.7 * length, 3.0 * spacing)
    near = max(2.9 * radius, 1.5 * spacing)
    run_in_parts(len(places), NORMALS_PER_THREAD, kernels.nearest_samples, places, boxes, near, far, neighbors, facing)
    if len(facing):
        kernels.cut_across_grooves(places, neighbors, facing)
    kernels.link_back(places, neighbors)
    return neighbors


def _normals(mean: np.ndarray, neighbors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the normal of each sample, not yet oriented, and the thickness there."""
    normals, thickness = np.empty_like(mean), np.empty(len(mean))
    run_in_parts(len(mean), NORMALS_PER_THREAD, normal_kernels.sample_normals, mean, neighbors, normals, thickness)
    return normals, thickness


def group(points: np.ndarray, owner: np.ndarray, samples: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the points sorted by sample, where each sample's points start, and their means."""
    start, mean = np.zeros(samples + 1, np.int64), np.zeros((samples, 3))
    grouped = np.empty_like(points)
    kernels.group_points(points, owner, start, grouped, mean)
    return grouped, start, mean
