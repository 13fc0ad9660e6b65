"""Parts of a scan that lie one over the other, with a gap between them, and that a grid joins: a model on a table, two plates."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..errors import words_of_number
from ..grid.certificate import Fault, place_of
from ..kernels.geometry.components import component_labels
from ..scan.vectors import dots
from ..surface.owners import owners_of
from .left_out import points_together
from .limits import PLACES_KEPT

if TYPE_CHECKING:
    from collections.abc import Sequence

    from scipy.spatial import cKDTree

    from ..grid.grid import Grid
    from ..surface.samples import SurfaceSamples

CLOSEST_POINTS = 0.05  # distance to which the points of denser scans are thinned [member lengths]
# least sine of the angle between a member and the scan, in the mean of its ends: others lie on one surface
LEAST_SLOPE = 0.1
# step from point to point, each nearer to the other end of a member, by which nearly all members of one surface are crossed
STEP_OF_WALK, NEIGHBORS_OF_WALK, STEPS_OF_WALK = 1.5, 16, 60  # [spacings of the points]
MEMBERS_LOOKED_AT = 400  # of those that are not
STEP_BESIDE = 1.2  # step by which points around a member hang together [median distance of their fourth neighbours]
AROUND_MIDDLE = 1.0  # radius around the middle of a member in which its two parts must be apart [member lengths]
# the share of the links of a tree through all points that are usual, and least gap in the longest of these
USUAL_LINK, UNUSUAL_LINK = 0.95, 1.4
NEIGHBORS_LINKED = 8  # of each point
FEWEST_OF_PARTS = 20, 6  # points of the part that goes on all around, and of that over it
# the ring around the middle of a member in which the one part must have points on all sides: at the edge of a thin wall
# both sides end [member lengths]
RING_AROUND, SECTORS_OF_MIDDLE = (0.4, 0.95), 8
OVER_WITHIN = 1.5  # distance within which a point has points under it [spacings]
AREA_OVER = 0.6  # area in which one part lies over the other [squared member lengths]
HEIGHT_OVER = 0.7  # ... and its usual height there [gaps]
JOINTS_TOGETHER = 1.5  # distance within which members that join two parts are one place [member lengths]


def parts_joined(grid: Grid, samples: SurfaceSamples, length: float, said: Sequence[Fault] = ()) -> list[Fault]:
    """Return a warning of the members that lead from a part of the scan to another that lies over it, with no points between.

    Around such a member the scan falls into two parts, the one goes on under the other, and the gap between them is wider than usual
    between points. A steep face without points, as of a bench of a quarry, ends one where the other begins; at the edge of a
    thin wall both end.

    Parameters
    ----------
    length : desired member length [scan unit]
    said : warnings of gaps; what lies within a member of their places is not said again
    """
    ends = np.empty((0, 2), np.int64) if samples.moved else _steep_members(grid, samples)
    if not len(ends):
        return []
    from scipy.spatial import cKDTree  # which grids without steep members do not load

    points = _thinned(samples.measured_points, samples.spacing, CLOSEST_POINTS * length)
    tree = cKDTree(points)
    step = STEP_OF_WALK * max(samples.spacing, CLOSEST_POINTS * length)
    ends = ends[_are_apart(tree, grid.nodes[ends], step)]
    ends = ends[:: len(ends) // MEMBERS_LOOKED_AT + 1]
    reach = AROUND_MIDDLE * length
    widths = np.array([_gap_of(tree, member, reach, step) for member in grid.nodes[ends]])
    middles, widths = grid.nodes[ends].mean(axis=1)[widths > 0.0], widths[widths > 0.0]
    if not len(middles):
        return []
    group = points_together(middles, np.full(len(middles), JOINTS_TOGETHER * length))
    known = [np.array(place) - samples.origin for fault in said for place in (fault.where, *fault.also) if place]
    found: list[tuple[int, float, np.ndarray]] = []
    for each in np.unique(group):
        own = middles[group == each]
        if all(np.linalg.norm(own - place, axis=1).min() > length for place in known):
            found.append((len(own), float(np.median(widths[group == each])), own[len(own) // 2]))
    if not found:
        return []
    found.sort(key=lambda place: -place[0])
    unit, more = f" {grid.unit}" if grid.unit else "", f" ({len(found)} such places)" if len(found) > 1 else ""
    words = f"joins two layers of the scan, one over the other, {words_of_number(found[0][1], 3)}{unit} apart{more}"
    at, *also = (place_of(middle + samples.origin) for _, _, middle in found[:PLACES_KEPT])
    return [Fault("joined", words, at, tuple(also))]


def _steep_members(grid: Grid, samples: SurfaceSamples) -> np.ndarray:
    """Return the members inside a grid (K, 2) that lead off the scan, in the mean of their ends."""
    ends = grid.edges[grid.edge_triangles[:, 1] >= 0]
    owner = owners_of(samples, grid.nodes)
    ahead = grid.nodes[ends[:, 1]] - grid.nodes[ends[:, 0]]
    one, two = (samples.surface.normals[owner[ends[:, k]]] for k in (0, 1))
    alike = np.where(dots(one, two) < 0.0, -1.0, 1.0)[:, None]  # a bend leads off to either side, a step to one
    along = np.abs(dots(ahead, 0.5 * (one + alike * two)))
    return ends[(along > LEAST_SLOPE * np.linalg.norm(ahead, axis=1)) | (owner[ends] < 0).any(axis=1)]


def _thinned(points: np.ndarray, spacing: float, apart: float) -> np.ndarray:
    """Return points (N, 3) of some spacing, one of each cube that wide where they are closer."""
    if spacing >= apart:
        return points
    cube = np.floor((points - points.min(axis=0)) / apart).astype(np.int64)
    across = cube.max(axis=0) + 1
    key = (cube[:, 0] * across[1] + cube[:, 1]) * across[2] + cube[:, 2]
    return points[np.unique(key, return_index=True)[1]]


def _are_apart(tree: cKDTree, ends: np.ndarray, step: float) -> np.ndarray:
    """Return which members, by their ends (K, 2, 3), no walk over the points of the scan crosses (K,) bool."""
    points = np.concatenate([tree.data, np.full((1, 3), np.inf)])
    at, to = tree.query(ends)[1].T
    away = np.linalg.norm(points[at] - points[to], axis=1)
    walking = np.flatnonzero(at != to)
    apart = np.zeros(len(ends), np.bool_)
    for _ in range(STEPS_OF_WALK):
        if not len(walking):
            break
        _, near = tree.query(points[at[walking]], k=NEIGHBORS_OF_WALK, distance_upper_bound=step)
        left = np.linalg.norm(points[near] - points[to[walking], None], axis=2)
        best = left.argmin(axis=1)
        each = np.arange(len(walking))
        nearer = left[each, best] < away[walking]
        apart[walking[~nearer]] = True
        at[walking[nearer]], away[walking[nearer]] = near[each, best][nearer], left[each, best][nearer]
        walking = walking[nearer & (left[each, best] > 0.0)]
    apart[walking] = True
    return apart


def _gap_of(tree: cKDTree, member: np.ndarray, reach: float, step: float) -> float:
    """Return the width of the gap that a member (2, 3) crosses from one part of the scan to another that lies over it; 0 of none."""
    from scipy.spatial import cKDTree as Tree

    middle = member.mean(axis=0)
    around = np.array(tree.query_ball_point(middle, reach))
    if len(around) < sum(FEWEST_OF_PARTS):
        return 0.0
    points = tree.data[around]
    local = Tree(points)
    usual_step = STEP_BESIDE * float(np.median(local.query(points, k=5)[0][:, -1]))
    begin, end = local.query_pairs(max(step, usual_step), output_type="ndarray").T
    label, (one, other) = component_labels(len(points), begin, end), local.query(member)[1].tolist()
    if label[one] == label[other]:
        return 0.0
    part, gap, usual, spacing = _parts(points, one, other)
    if gap < UNUSUAL_LINK * usual:
        return 0.0
    parts = points[part == part[one]], points[part == part[other]]
    is_gap = any(_lies_over(*each, middle, reach, gap, spacing) for each in (parts, parts[::-1]))
    return gap if is_gap else 0.0


def _parts(points: np.ndarray, one: int, other: int) -> tuple[np.ndarray, float, float, float]:
    """Return the parts (N,) into which points (N, 3) fall by links shorter than the longest that leads from one to another.

    With that, the longest usual link, and the median.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import minimum_spanning_tree

    begin, end, long = _links_between(points)
    links = minimum_spanning_tree(coo_array((np.maximum(long, 1e-300), (begin, end)), shape=(len(points),) * 2)).tocoo()
    order = np.argsort(links.data)
    begin, end, long = links.row[order].astype(np.int64), links.col[order].astype(np.int64), links.data[order]
    low, high = 0, len(long)  # the fewest links, the shortest first, by which the two hang together
    for _ in range(len(long).bit_length()):
        count = (low + high) // 2
        label = component_labels(len(points), begin[:count], end[:count])
        low, high = (low, count) if label[one] == label[other] else (count, high)
    label = component_labels(len(points), begin[:low], end[:low])
    return label, float(long[low]), float(np.quantile(long, USUAL_LINK)), float(np.median(long))


def _links_between(points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the ends (K,) of links of points (N, 3) to those beside them and between parts that are left, and how long they are."""
    from scipy.spatial import cKDTree as Tree

    away, near = Tree(points).query(points, k=NEIGHBORS_LINKED + 1)
    begins, ends, lengths = (
        [np.arange(len(points)).repeat(NEIGHBORS_LINKED)],
        [near[:, 1:].ravel()],
        [away[:, 1:].ravel()],
    )
    label = component_labels(len(points), begins[0], ends[0])
    parts = [np.flatnonzero(label == each) for each in np.unique(label)]
    for number, part in enumerate(parts):
        tree = Tree(points[part])
        for other in parts[number + 1 :]:
            apart, nearest = tree.query(points[other])
            at = int(apart.argmin())
            begins.append(part[nearest[at : at + 1]])
            ends.append(other[at : at + 1])
            lengths.append(apart[at : at + 1])
    return np.concatenate(begins), np.concatenate(ends), np.concatenate(lengths)


def _lies_over(
    under: np.ndarray, over: np.ndarray, middle: np.ndarray, reach: float, gap: float, spacing: float
) -> bool:
    """Whether a part (N, 3) goes on all around the middle of a member, and another (M, 3) lies over it."""
    from scipy.spatial import cKDTree as Tree

    if len(under) < FEWEST_OF_PARTS[0] or len(over) < FEWEST_OF_PARTS[1]:
        return False
    axes = np.linalg.svd(under - under.mean(axis=0), full_matrices=False)[2]
    below, above = (under - middle) @ axes.T, (over - middle) @ axes.T
    away = np.hypot(below[:, 0], below[:, 1])
    ring = (away > RING_AROUND[0] * reach) & (away < RING_AROUND[1] * reach)
    sector = np.floor((np.arctan2(below[ring, 1], below[ring, 0]) / (2.0 * np.pi) + 0.5) * SECTORS_OF_MIDDLE)
    if len(np.unique(sector.astype(int) % SECTORS_OF_MIDDLE)) < SECTORS_OF_MIDDLE:
        return False
    apart, nearest = Tree(below[:, :2]).query(above[:, :2], k=3)
    is_over = apart.mean(axis=1) < OVER_WITHIN * spacing
    height = np.abs(above[:, 2] - below[nearest, 2].mean(axis=1))[is_over]
    wide = len(height) * spacing**2 >= AREA_OVER * reach**2
    return bool(wide and np.median(height) >= HEIGHT_OVER * gap)
