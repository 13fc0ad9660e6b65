"""Normals turned to one side: the same over each piece, outwards where it is closed."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...kernels.scan.normals import turn_like_beside
from ...kernels.surface import normals as kernels
from ...runtime.parallel import run_in_parts
from ..normals import HEAD_ON, cut_steep_links, face_one_side, face_outside
from .nearby import REACH_TO, SEARCHES_PER_THREAD, Nearby, build_kd_tree
from .thinning import thin_to

# spacing of the points at which sides are settled, in mean spacings: lines of a scanner are no pieces then
SIDE_SPACING = 2.0
LINKS_OF_A_POINT = 10  # links of each of these points
# thickness, in their spacings, up to which they are smooth enough to reveal a one-sided surface
ONE_SIDED_THICKNESS = 0.15
NEIGHBORS_ASKED = 4  # nearest oriented points of a point; the one most in its tangent plane decides its side


class OrientedNormals(NamedTuple):
    """Normals that face one side of each piece."""

    normals: np.ndarray  #: (N, 3) unit normals, rows of the tree
    pieces: int  #: pieces each of which has a side of its own
    one_sided: int  #: links between opposite normals: dozens on a one-sided surface


def orient_to_one_side(near: Nearby, points: np.ndarray, normals: np.ndarray) -> OrientedNormals:
    """Turn normals (N, 3) of points (N, 3), rows of the tree, to one side of each piece.

    A piece faces away from its centre, so outwards if it is closed; a plate, where that does not decide, faces upwards.
    """
    reach = near.reach[np.isfinite(near.reach)]
    mean_spacing = float(np.median(reach)) * np.sqrt(np.pi / REACH_TO) if len(reach) else 0.0
    extent = float(np.ptp(points, axis=0).max())
    coarse = max(SIDE_SPACING * mean_spacing, 1e-5 * extent, 1e-300)
    stays = thin_to(points, coarse)
    few = Nearby.of(points[stays])
    chosen = np.flatnonzero(stays)[few.tree.ids]
    place, own = few.tree.points, np.ascontiguousarray(normals[chosen])
    neighbors = np.ascontiguousarray(few.neighbors[:, :LINKS_OF_A_POINT])
    cut_steep_links(place, own, neighbors)
    piece = face_one_side(place, own, neighbors)
    face_outside(place, own, piece, neighbors)
    planes, thickness = np.empty_like(own), np.empty(len(place))
    kernels.sample_normals(place, neighbors, planes, thickness, 0, len(place))
    head_on = int(kernels.head_on_links(place, own, neighbors, thickness, ONE_SIDED_THICKNESS * coarse))
    turned = normals.copy()
    tree = build_kd_tree(place)
    settled = np.ascontiguousarray(own[tree.ids])
    run_in_parts(len(points), SEARCHES_PER_THREAD, turn_like_beside, tree, settled, points, turned, NEIGHBORS_ASKED)
    return OrientedNormals(turned, int(piece.max(initial=-1)) + 1, head_on if head_on >= HEAD_ON else 0)
