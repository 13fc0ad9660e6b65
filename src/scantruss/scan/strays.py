"""Stray points: measured points that belong to no surface, left out before all else (Sec. 2 leaves that to the scanner)."""

from __future__ import annotations

import numpy as np

from ..kernels import normals as facing
from ..kernels import sites as kernels
from ..kernels.boxes import new_boxes
from ..machine import in_parts
from .cloud import measure_gap

AROUND = 8  # a point's reach is the distance to this neighbour
FAR = 6.0  # reach, in typical reaches, at which a point is a stray whatever is near it
TOO_FAR = 1.1  # the same in member lengths
ROUNDS = 3  # strays near each other hide each other: after a round some more stand out
PLANE = 16  # neighbours whose plane tells whether a point stands off the surface
OFF = 5.0  # distance from that plane, in thicknesses of what lies there, from which on a point is a stray
LONE = 3e-4  # share of sites without neighbours from which on strays are looked for


def has_strays(neighbors: np.ndarray) -> bool:
    """Whether so many sites stand alone that it is worth looking for strays; neighbors (S, K) as `kernels.nearest_sites`."""
    return bool((neighbors[:, 5] < 0).mean() > LONE)


def find_strays(points: np.ndarray, distance: float, length: float = np.inf) -> np.ndarray:
    """Return which points are strays (N,) bool.

    First those whose reach is more than `distance` times that of their neighbours; then those that stand off the surface by more
    than a gap and `OFF` times the thickness of the points there.

    Parameters
    ----------
    points : (N, 3) [scan unit]
    distance : as `Settings.stray_distance`
    length : desired member length [scan unit]; where points are farther apart no grid can be made of them
    """
    stray = np.zeros(len(points), np.bool_)
    for _ in range(ROUNDS):
        kept = np.flatnonzero(~stray)
        if len(kept) <= AROUND:
            return stray
        found = _look(np.ascontiguousarray(points[kept]), distance, length)
        stray[kept[found]] = True
        if not found.any():
            break
    for _ in range(ROUNDS if stray.any() else 0):
        kept = np.flatnonzero(~stray)
        if len(kept) <= PLANE:
            break
        found = _off_surface(np.ascontiguousarray(points[kept]))
        stray[kept[found]] = True
        if not found.any():
            break
    return stray


def _look(points: np.ndarray, distance: float, length: float = np.inf) -> np.ndarray:
    """One round of `find_strays`, by reach."""
    neighbors, gap = _nearest(points, AROUND, FAR)
    last = neighbors[:, -1]
    reach = np.where(last >= 0, np.linalg.norm(points[last] - points, axis=1), np.inf)
    usual = np.median(np.where(neighbors >= 0, reach[neighbors], np.inf), axis=1)
    return (reach > distance * usual) | (reach > min(FAR * gap, max(TOO_FAR * length, distance * gap)))


def _off_surface(points: np.ndarray) -> np.ndarray:
    """One round of `find_strays`, by the plane of the nearest points."""
    neighbors, gap = _nearest(points, PLANE, FAR)
    off, thickness = np.zeros(len(points)), np.zeros(len(points))
    facing.distances_from_planes(points, neighbors, off, thickness)
    return (off > gap) & (off > OFF * thickness)


def _nearest(points: np.ndarray, count: int, far: float) -> tuple[np.ndarray, float]:
    """Return the nearest other points of each point (N, count) within `far` gaps, -1 where there are fewer, and the gap."""
    gap = max(measure_gap(points), 1e-12 * float(np.ptp(points, axis=0).max()))
    boxes = new_boxes(points.min(axis=0), points.max(axis=0), 2.0 * gap, len(points), len(points))
    kernels.put_all(boxes, points, np.arange(len(points)))
    neighbors = np.full((len(points), count), -1, np.int64)
    near, most = 1.5 * gap, far * gap
    in_parts(
        len(points), 3000, lambda _, begin, end: kernels.nearest_sites(points, boxes, near, most, neighbors, begin, end)
    )
    return neighbors, gap
