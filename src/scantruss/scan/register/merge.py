"""From scans in one frame to one cloud: one layer where they overlap, as dense as one scan.

Where several scans see a spot, its points move across the surface to the mean of the layers, with less weight towards the
boundary of a scan, so that there is no step where one ends. Only the points of the scan that sees the spot farthest from its
boundary are kept.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...kernels.scan import blend as kernels
from .graph import Group
from .poses import invert, move
from .scans import Scan
from .views import View, boxes_around

DEEPEST_INSIDE = 20.0  # depth inside a scan beyond which it makes no difference, in spacings
FULL_DEPTH = 6.0  # depth beyond which a layer has its full weight
SEEN_REACH = 2.2  # reach in which a scan sees a point, in spacings
SAME_LAYER = 2.0  # distance across the surface up to which two layers are the same, in spacings


def merge_scans(
    scans: list[Scan], group: Group, progress: Callable[[str, float], None]
) -> tuple[np.ndarray, list[int]]:
    """Return the points (N, 3) of all scans of a group in its frame, and how many of each member were kept."""
    depth = {i: _depth(scans[i].fine) for i in group.members}
    ranked = sorted(group.members, key=lambda i: (scans[i].cloud.spacing, i))
    parts = []
    for place, i in enumerate(group.members):
        progress("merge", place / len(group.members))
        parts.append(_points_of(scans, group, i, depth, ranked))
    return np.concatenate(parts), [len(part) for part in parts]


def _depth(view: View) -> np.ndarray:
    """Return how far inside the scan each place lies (S,) [scan unit]."""
    most = DEEPEST_INSIDE * view.spacing
    boundary_points = np.ascontiguousarray(view.points[view.on_boundary])
    depth = np.full(len(view.points), most)
    if len(boundary_points):
        kernels.depths(view.points, boundary_points, boxes_around(boundary_points, 0.5 * most), most, depth)
    return depth


def _points_of(scans: list[Scan], group: Group, i: int, depth: dict[int, np.ndarray], ranked: list[int]) -> np.ndarray:
    """Return the points that scan i contributes, moved to the mean layer, in the frame of the group."""
    points, view = scans[i].cloud.points, scans[i].fine
    own, deep = np.empty(len(points), np.int64), np.empty(len(points))
    beside, full = SEEN_REACH * view.spacing, FULL_DEPTH * view.spacing
    kernels.own_places(points, view.points, view.boxes, depth[i], beside, own, deep)
    shift, weight = np.zeros_like(points), np.minimum(deep / full, 1.0)
    kept = np.ones(len(points), np.int64)
    for j in group.members:
        if j != i:
            other = scans[j].fine
            kernels.add_layer(
                points, own, view.normals, deep, other.points, other.normals, other.boxes, depth[j],
                np.ascontiguousarray(invert(group.poses[j]) @ group.poses[i]), group.turns[i] * group.turns[j],
                int(ranked.index(j) < ranked.index(i)), beside, SAME_LAYER * view.spacing, full, shift, weight, kept,
            )  # fmt: skip
    moved = points + shift / np.maximum(weight, 1e-12)[:, None]
    return move(group.poses[i], moved[kept == 1])
