"""Views: a scan at one spacing, with normals that face one side; every step of splicing works on them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...kernels.geometry.boxes import SearchBoxes, new_boxes
from ...kernels.scan import overlap as kernels_of_overlap
from ...kernels.surface import normals as normal_kernels
from ...kernels.surface import samples as kernels
from ...runtime.parallel import run_in_parts
from ...surface.given_normals import NO_NORMALS
from ...surface.linked_samples import samples_of_points
from ..normals import face_one_side, mean_normals

NEIGHBORS_FOR_NORMAL = 14  # neighbours of a place, for its normal
FEWEST_NEIGHBORS = 5  # neighbours below which a place is left out, as it lies on no surface
BOUNDARY_OFFSET = 0.32  # offset of the mean of its neighbours from a place at the boundary, as a share of their reach
LEAST_PIECE_SHARE = 0.02  # least share of the places of a piece whose normals count for the side that it faces


@dataclass(frozen=True, eq=False)
class View:
    """A scan thinned to one spacing; places are means of the points around them."""

    points: np.ndarray  #: (S, 3) places [scan unit], in the frame of the scan
    normals: np.ndarray  #: (S, 3) unit normals, all to one side
    on_boundary: np.ndarray  #: (S,) bool, places at the boundary of what the scan sees
    boxes: SearchBoxes  #: of the places
    spacing: float  #: distance the places keep [scan unit]
    noise: float  #: typical distance of a place from the plane of its neighbours [scan unit]
    bulge: float  #: certainty that the normals face the outside of a bulge, 0 to 1
    strict: float = 1.0  #: factor on the distance within which other scans agree with this one


def make_view(points: np.ndarray, spacing: float, coarse: View | None = None) -> View:
    """Return the view of a scan at a spacing.

    Parameters
    ----------
    points : (N, 3) array [scan unit]
    spacing : distance between places [scan unit]
    coarse : another view of the scan whose normals give the side to face; else the outside of a bulge

    Returns
    -------
    View
        Without the places that have too few neighbours to lie on a surface.
    """
    places = thin_to_places(points, spacing)
    neighbors = link_places(places, spacing)
    sound = neighbors[:, FEWEST_NEIGHBORS - 1] >= 0
    if not sound.all():
        places = np.ascontiguousarray(places[sound])
        neighbors = link_places(places, spacing)
    normals, thickness = np.zeros_like(places), np.zeros(len(places))
    normal_kernels.sample_normals(places, neighbors, normals, thickness, 0, len(places))
    if coarse is None:
        _face_as_seen(places, normals, neighbors)
    else:
        kernels_of_overlap.face_like(places, normals, coarse.points, coarse.normals, coarse.boxes, 2.0 * coarse.spacing)
    normals_around = mean_normals(normals, neighbors, 0.7)
    aside = np.zeros(len(places))
    kernels_of_overlap.mark_boundary(places, normals, neighbors, aside)
    noise = float(np.median(thickness)) if len(places) else 0.0
    return View(
        places,
        normals_around,
        aside > BOUNDARY_OFFSET,
        boxes_around(places, 1.5 * spacing),
        spacing,
        noise,
        abs(_bulge(places, normals_around)),
    )


def thin_to_places(points: np.ndarray, spacing: float) -> np.ndarray:
    """Return places (S, 3) about one spacing apart: means of the points around the first of each neighbourhood."""
    owner, chosen, samples, boxes = samples_of_points(points, spacing)
    kernels_of_overlap.first_places(points, boxes, samples, spacing, owner)
    count = len(chosen)
    mean = np.zeros((count, 3))
    start = np.zeros(count + 1, np.int64)
    kernels.group_points(points, owner, start, np.empty_like(points), mean)
    return mean


def boxes_around(points: np.ndarray, size: float) -> SearchBoxes:
    """Return search boxes that hold all points (N, 3)."""
    count = len(points)
    lower, upper = (points.min(axis=0), points.max(axis=0)) if count else (np.zeros(3), np.ones(3))
    boxes = new_boxes(lower, upper, size, count, count)
    kernels.put_all(boxes, points, np.arange(count))
    return boxes


def link_places(points: np.ndarray, spacing: float) -> np.ndarray:
    """Return the nearest neighbours (N, NEIGHBORS_FOR_NORMAL) of each point within a few spacings, -1 where there are fewer."""
    neighbors = np.full((len(points), NEIGHBORS_FOR_NORMAL), -1, np.int64)
    boxes = boxes_around(points, 2.2 * spacing)
    near, far = 2.2 * spacing, 3.3 * spacing
    run_in_parts(len(points), 3000, kernels.nearest_samples, points, boxes, near, far, neighbors, NO_NORMALS)
    off = (
        np.linalg.norm(points[neighbors] - points[:, None], axis=2) > far
    )  # where there are few, it searches farther: outliers here
    neighbors[off] = -1
    return neighbors


def _face_as_seen(places: np.ndarray, normals: np.ndarray, neighbors: np.ndarray) -> None:
    """Turn all normals to one side: along the links of each piece, pieces as seen from one sensor, the whole outwards."""
    piece = face_one_side(places, normals, neighbors)
    counts = np.bincount(piece)
    sums = np.stack([np.bincount(piece, normals[:, c]) for c in range(3)], axis=1)
    sign = np.ones(len(counts))
    votes = np.flatnonzero(counts >= LEAST_PIECE_SHARE * len(places))
    view = sums[np.argmax(counts)] if len(counts) else np.zeros(3)
    for _ in range(5):
        sign = np.where(sums @ view < 0.0, -1.0, 1.0)
        view = (sign[votes, None] * sums[votes]).sum(axis=0) if len(votes) else view
    normals *= sign[piece][:, None]
    if len(places) and _bulge(places, normals) < 0.0:
        normals *= -1.0


def _bulge(places: np.ndarray, normals: np.ndarray) -> float:
    """Return how much more the normals point away from the centre of the places than towards it, -1 to 1."""
    rise = (normals * (places - places.mean(axis=0))).sum(axis=1) if len(places) else np.zeros(1)
    return float(rise.sum() / max(np.abs(rise).sum(), 1e-300))
