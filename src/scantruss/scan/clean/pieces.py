"""Loose small pieces: a few points together, away from all large pieces."""

from __future__ import annotations

import numpy as np

from ...kernels.geometry.components import join
from ...kernels.geometry.kd_tree import nearest_of_places
from ...kernels.scan import outliers as kernels
from ...kernels.scan.outliers import THICK_CLOUD
from .nearby import REACH_TO, Nearby, build_kd_tree

LINK_REACH = 3.0  # reaches over which points belong to one piece
BLOB_POINTS = 4.0  # a cloud counts as small up to this many times the points of a small surface
# extent of a cloud, over that of the largest piece, up to which it is small however many points it has
SMALL_EXTENT = 0.3
# reaches over which a small piece belongs to what is beside it: a line of the scanner, a part behind a shadow
PIECE_DISTANCE = 6.0


def find_loose_pieces(near: Nearby, share: float) -> np.ndarray:
    """Return which points belong to loose small pieces, away from all others; rows of the tree.

    A piece is small if it has less than this share of all points, or fewer than `REACH_TO`; a cloud (no surface) also with fewer
    than `BLOB_POINTS` times as many, or if it is narrower than `SMALL_EXTENT` of the largest piece. A small surface near a large one stays,
    and so does what lies near that. With a share of 0 no piece is small.
    """
    count = len(near.squares)
    if count <= REACH_TO or share == 0.0:
        return np.zeros(count, np.bool_)
    piece = _pieces(near)
    sizes = np.bincount(piece, minlength=count)
    thick, aside = np.empty((2, count))
    kernels.measure_planes(near.tree, np.arange(count), near.neighbors, thick, aside, 0, count)
    blob = np.bincount(piece, thick > THICK_CLOUD, minlength=count) > 0.5 * sizes
    least = np.minimum(np.maximum(share * count, REACH_TO) * np.where(blob, BLOB_POINTS, 1.0), float(sizes.max()))
    clouds = np.flatnonzero(blob & (sizes >= least))
    loose = (sizes[piece] < least[piece]) | _small_clouds(near.tree.points, piece, clouds, int(sizes.argmax()))
    typical = float(np.median(near.reach))
    while loose.any():
        kept = np.flatnonzero(~loose)
        away, which = _distances(near.tree.points[loose], near.tree.points[kept])
        beside = away <= PIECE_DISTANCE * np.maximum(typical, near.reach[kept[which]])
        joined = np.unique(piece[loose][beside & ~blob[piece[loose]]])
        if not len(joined):
            break
        loose &= ~np.isin(piece, joined)
    return loose


def _pieces(near: Nearby) -> np.ndarray:
    """Return the piece of each point (N,), numbered by its first point; rows of the tree.

    A point is linked with its neighbours, nearest first, up to the first farther than `LINK_REACH` times the smaller reach of the two.
    """
    reach, piece = near.reach, np.arange(len(near.squares))
    linked = np.ones(len(piece), np.bool_)
    for neighbor, square in zip(near.neighbors.T, near.squares.T, strict=True):
        linked &= (neighbor >= 0) & (square <= (LINK_REACH * np.minimum(reach, reach[neighbor])) ** 2)
        join(piece, np.flatnonzero(linked), neighbor[linked])
    return piece


def _small_clouds(points: np.ndarray, piece: np.ndarray, clouds: np.ndarray, largest: int) -> np.ndarray:
    """Return which points belong to clouds that are small in extent compared with the largest piece (N,) bool."""
    limit = SMALL_EXTENT * float(np.linalg.norm(np.ptp(points[piece == largest], axis=0)))
    small = [cloud for cloud in clouds if np.linalg.norm(np.ptp(points[piece == cloud], axis=0)) < limit]
    return np.isin(piece, small)


def _distances(places: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the distance of places (P, 3) from the nearest of points (N, 3), and the number of that point."""
    squares, which = np.empty(len(places)), np.empty(len(places), np.int64)
    nearest_of_places(build_kd_tree(points), np.ascontiguousarray(places), 1, squares, which)
    return np.sqrt(squares), which
