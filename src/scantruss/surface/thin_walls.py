"""Thin walls, as of a vase: on which of their two sides each point lies, found before samples are chosen for a member length."""

from __future__ import annotations

import numpy as np

from ..kernels.geometry.boxes import new_boxes
from ..kernels.surface.samples import put_all
from ..kernels.surface.sides import vote_on_sides
from ..scan.cloud import bounds_of
from ..scan.normals import mean_normals
from .faced_surface import faced_surface
from .given_normals import GivenNormals
from .linked_samples import link_samples

WALL_SPACING = 1.3  # distance between the samples that tell the sides of a wall apart [point spacings]
WALL_SHARE = 0.07  # least distance between them [member lengths]
WALL_LENGTH = 5.0  # member length that suits them, by which they are linked [their distance]
ROUNDS = 2  # times that they are linked and faced: the second time, no link leads through the wall
VOTING_REACH = 3.0  # distance within which samples agree on their sides [their distance]
MOST_VOTES = 30  # times that all samples are asked at most
PASSES = 3  # times that normals are averaged with those beside them


def normals_of_walls(points: np.ndarray, spacing: float, length: float) -> GivenNormals | None:
    """Return normals of points (N, 3) that face away from the walls between them, for members of a length [scan unit].

    None where they face both ways all over, so that there are no sides to distinguish.
    """
    apart, given = max(WALL_SPACING * spacing, WALL_SHARE * length), None
    for _ in range(ROUNDS):
        found = link_samples(points, apart, WALL_LENGTH * apart, spacing, given)
        surface, _, _ = faced_surface(found, apart, WALL_LENGTH * apart, spacing)
        mean, normals, reach = surface.mean, surface.normals, VOTING_REACH * apart
        boxes = new_boxes(*bounds_of(mean), reach, len(mean), len(mean))
        put_all(boxes, mean, np.arange(len(mean)))
        vote_on_sides(mean, normals, boxes, reach, MOST_VOTES)
        for _ in range(PASSES):
            normals = mean_normals(normals, surface.neighbors, 0.0)
        given = GivenNormals.of(points, normals[found.owner])
        if given is None:
            return None
    return given
