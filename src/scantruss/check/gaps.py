"""Gaps of a scan that its grid bridges: where a triangle covers a place that has points all around, none of them near."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..grid.certificate import Fault, LeftOut, place_of
from ..kernels.geometry.boxes import SearchBoxes
from ..kernels.geometry.components import component_labels
from ..kernels.mesh.coverage import nearest_distances
from .distances import POINT_BOX, boxes_of

if TYPE_CHECKING:
    from ..boundary.find import Boundary
    from ..grid.grid import Grid
    from ..surface.samples import SurfaceSamples

#: places in a triangle that are looked at, by its corners; with its corners and the middles of its members none is farther than a sixth
#: of a member from one of them
PLACES = np.array([[2, 2, 2], [4, 1, 1], [1, 4, 1], [1, 1, 4]]) / 6.0
HALF_WIDTH = 0.2  # least distance from the nearest point at which a place lies in a gap [member lengths]
UNEVEN = 4.0  # ... and in median distances: at random points none is farther, between lines of a scanner half as far
POINTS_AROUND = 45  # points up to twice that distance from which on an empty place is no accident, as exp(-n/3) tells
ACROSS = np.stack(np.meshgrid(*[np.linspace(-0.6, 0.6, 7)] * 2), axis=-1).reshape(-1, 2)  # places in a loop [radius]
OPEN = 0.1  # distance of the boundary from the nearest point from which on a gap there is open [member lengths]
MOST_PLACES = 30  # places of a warning that are kept
MOST_LOOKED_AT = 1000  # places that are looked at closely, those farthest from all points first


def bridged_gaps(
    grid: Grid, samples: SurfaceSamples, boundary: Boundary, length: float
) -> tuple[list[LeftOut], list[Fault]]:
    """Return the gaps that a grid bridges and that are not known as closed holes, the widest first, and a warning.

    The warning is of those that are open at the boundary of the grid: there it joins what is apart, or covers a bay.

    Points at random leave a disc of radius d free with a probability of exp(-pi d^2 density), and the ring from d to twice d, of three
    times its area, tells the density there: n points around an empty disc mean that it would hold n / 3. Discs lie in the planes of
    the triangles, so that a triangle off a bent surface is none over a gap.

    Parameters
    ----------
    length : desired member length [scan unit]
    """
    points = samples.measured_points
    boxes = boxes_of(points, max(POINT_BOX * length, 2.0 * samples.spacing))
    places, owner = _places(grid)
    away = np.empty(len(places))
    nearest_distances(places, points, boxes, 0.25 * length, away)
    members = np.full(len(grid.nodes), length) if grid.desired is None else grid.desired
    least = np.maximum(HALF_WIDTH * members[grid.triangles].mean(axis=1)[owner], UNEVEN * np.median(away))
    far = np.flatnonzero(away > least)
    far = far[np.argsort(-away[far], kind="stable")[:MOST_LOOKED_AT]]
    if not len(far):
        return [], []
    points = by_x(points)
    triangle = owner[far]
    a, b, c = grid.nodes[grid.triangles[triangle].T]
    normal = np.cross(b - a, c - a)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    half = np.array([empty_disc(*each, points) for each in zip(places[far], normal, away[far], strict=True)])
    empty = half > least[far]
    far, triangle, half = far[empty], triangle[empty], half[empty]
    group = _groups(grid, triangle)[triangle]
    is_open = _open_triangles(grid, samples.measured_points, boxes, length)
    found: list[tuple[float, LeftOut, bool]] = []
    for each in np.unique(group):
        own = np.flatnonzero(group == each)
        widest = own[half[own].argmax()]
        middle, width = places[far[widest]], 2.0 * float(half[widest])
        if not _is_known(middle, samples, boundary):
            size = float(np.ptp(places[far[own]], axis=0).max()) + width
            gap = LeftOut("gap", 0, 0.0, place_of(middle + samples.origin), size)
            found.append((width, gap, bool(is_open[triangle[own]].any())))
    found.sort(key=lambda each: -each[0])
    unit = f" {samples.unit}" if samples.unit else ""
    wide = [(width, gap.where) for width, gap, reaches_boundary in found if reaches_boundary]
    more = f" ({len(wide)} such places)" if len(wide) > 1 else ""
    words = f"bridges a gap {wide[0][0]:.3g}{unit} wide{more}" if wide else ""
    warnings = (
        [Fault("gap", words, wide[0][1], tuple(where for _, where in wide[1:MOST_PLACES] if where))] if wide else []
    )
    return [gap for _, gap, _ in found], warnings


def by_x(points: np.ndarray) -> np.ndarray:
    """Return points (N, 3) by ascending x."""
    ordered: np.ndarray = points[np.argsort(points[:, 0], kind="stable")]
    return ordered


def is_empty_within(curve: np.ndarray, points: np.ndarray) -> bool:
    """Whether a closed curve (M, 3) is around a place that is no accident to be empty; points : (N, 3) by ascending x."""
    middle = curve.mean(axis=0)
    axes = np.linalg.svd(curve - middle)[2]
    reach = float(np.linalg.norm(curve - middle, axis=1).max())
    begin, end = np.searchsorted(points[:, 0], [middle[0] - 2.0 * reach, middle[0] + 2.0 * reach])
    around = points[begin:end][((points[begin:end] - middle) ** 2).sum(axis=1) <= 4.0 * reach * reach]
    places = middle + reach * ACROSS @ axes[:2]  # a curve of few samples is not around the middle of its hole
    away = np.array([np.linalg.norm(around - place, axis=1).min(initial=reach) for place in places])
    best = int(away.argmax())
    return empty_disc(places[best], axes[2], float(away[best]), points) > 0.0


def empty_disc(place: np.ndarray, normal: np.ndarray, away: float, points: np.ndarray) -> float:
    """Return the radius of the disc around a place (3,) that is free of points, 0 where that may be an accident.

    away : distance of the nearest point; points : (N, 3) by ascending x.
    """
    begin, end = np.searchsorted(points[:, 0], [place[0] - 3.0 * away, place[0] + 3.0 * away])
    around = points[begin:end] - place
    around = around[(around**2).sum(axis=1) <= 9.0 * away * away]
    height = around @ normal
    level = np.sqrt(np.maximum((around**2).sum(axis=1) - height**2, 0.0))[np.abs(height) <= 2.0 * away]
    radius = float(level.min(initial=away))
    return radius if (level <= 2.0 * radius).sum() >= POINTS_AROUND else 0.0


def _places(grid: Grid) -> tuple[np.ndarray, np.ndarray]:
    """Return places all over the triangles of a grid but not on its boundary (P, 3), and a triangle in which each is (P,)."""
    inner = grid.edge_triangles[:, 1] >= 0
    of_node = np.full(len(grid.nodes), -1)
    of_node[grid.triangles] = np.arange(len(grid.triangles))[:, None]
    of_node[grid.edges[~inner]] = -1
    nodes = np.flatnonzero(of_node >= 0)
    inside = np.einsum("pc,tcx->tpx", PLACES, grid.nodes[grid.triangles]).reshape(-1, 3)
    places = np.concatenate([inside, grid.nodes[grid.edges[inner]].mean(axis=1), grid.nodes[nodes]])
    numbers = np.arange(len(grid.triangles)).repeat(len(PLACES))
    return places, np.concatenate([numbers, grid.edge_triangles[inner, 0], of_node[nodes]])


def _open_triangles(grid: Grid, points: np.ndarray, boxes: SearchBoxes, length: float) -> np.ndarray:
    """Return which triangles (T,) bool have a node where the boundary of the grid leaves the scan."""
    members = grid.edges[grid.edge_triangles[:, 1] < 0]
    places = np.concatenate([grid.nodes[members].mean(axis=1), grid.nodes[members[:, 0]]])
    away = np.empty(len(places))
    nearest_distances(places, points, boxes, 0.25 * length, away)
    ends = np.concatenate([members, members[:, :1].repeat(2, axis=1)])
    found: np.ndarray = np.isin(grid.triangles, ends[away > OPEN * length]).any(axis=1)
    return found


def _groups(grid: Grid, chosen: np.ndarray) -> np.ndarray:
    """Return a number (T,) for each triangle: the same for those of some (K,) that have a node in common."""
    a, b, c = grid.triangles[np.unique(chosen)].T
    label = component_labels(len(grid.nodes), np.concatenate([a, b]), np.concatenate([b, c]))
    return label[grid.triangles[:, 0]]


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
