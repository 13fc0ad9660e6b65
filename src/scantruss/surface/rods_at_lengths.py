"""Which points of a scan belong to rods, seen at several member lengths."""

from __future__ import annotations

import numpy as np

from ..scan.clean.thinning import number_in_boxes
from .chosen_samples import Asked, radius_of_samples
from .linked_samples import Linked, link_samples
from .rods import MOST_RODS, lengths_of_rods, pieces_of_rods, rod_points
from .supports import free_columns, support_samples


def points_of_rods(points: np.ndarray, spacing: float, asked: Asked) -> np.ndarray:
    """Return which points (N, 3) belong to rods, (N,) bool: seen at shorter lengths too, as long members blur a scaffold with its shell."""
    lengths = lengths_of_rods(asked.length, spacing)
    radii = [radius_of_samples(asked._replace(length=length), spacing) for length in lengths]
    finest = link_samples(points, radii[0], lengths[0], spacing)
    column = (finest.owner >= 0) & (free_columns(finest.mean, radii[0], asked.length)[finest.owner] > 0)
    rods = np.zeros(len(points), np.bool_)
    for length, radius in zip(lengths, radii, strict=True):
        left = np.flatnonzero(~rods)
        first = length == lengths[0]
        found = finest if first else link_samples(np.ascontiguousarray(points[left]), radius, length, spacing)
        known = column[left] & (length == lengths[-1])
        rods[left[_rods_at(length, found, known, asked)]] = True
    if len(lengths) > 1 and rods.any():
        rods |= pieces_of_rods(finest, rods, radii[0], asked.length)
    if rods.any() and _share_of_surface(points, rods, 2.0 * radii[-1]) > MOST_RODS:  # then they are the scan itself
        rods[:] = False
    return rods


def _share_of_surface(points: np.ndarray, rods: np.ndarray, width: float) -> float:
    """Return the share of boxes of a width [scan unit] whose points (N, 3) are mostly of rods (N,): of the area, however dense they are."""
    box = number_in_boxes(points, width)
    return float((2 * np.bincount(box, rods) > np.bincount(box)).mean())


def _rods_at(length: float, found: Linked, column: np.ndarray, asked: Asked) -> np.ndarray:
    """Return which points (N,) bool belong to rods by their samples for a member length, of which some are known for columns (N,) bool."""
    samples = len(found.mean)
    owner = np.where(found.owner >= 0, found.owner, samples)
    support = 2 * np.bincount(owner, column, samples + 1) > np.bincount(owner, minlength=samples + 1)
    known = support[:samples] | support_samples(found, length) if asked.z_is_up else support[:samples]
    return rod_points(found, len(column), length, known)
