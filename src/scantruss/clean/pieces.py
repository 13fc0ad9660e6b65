"""Loose small pieces: a few points together, away from all that is large."""

from __future__ import annotations

import numpy as np

from ..kernels import strays as kernels
from ..kernels import tree as trees
from .nearby import AROUND, Nearby, grow_tree
from .strays import THICK

LINK = 3.0  # reaches over which points belong to one piece
BLOB = 4.0  # a cloud of points may have so many times more of them than a small surface
APART = (
    6.0  # reaches over which a small piece belongs to what is beside it: a line of the scanner, a part behind a shadow
)


def find_loose_pieces(near: Nearby, share: float) -> np.ndarray:
    """Return which points belong to pieces with fewer than this share of all points, away from all others; rows of the tree.

    Of pieces that are no surface but a cloud the share may be larger, `BLOB` times. A small surface
    that lies near a large one stays, and so does what lies near that.
    """
    count = len(near.squares)
    if count <= AROUND:
        return np.zeros(count, np.bool_)
    piece = np.empty(count, np.int64)
    kernels.join_near(near.neighbors, near.squares, near.reach, LINK, piece)
    sizes = np.bincount(piece, minlength=count)
    thick, aside = np.empty((2, count))
    kernels.measure_planes(near.tree, np.arange(count), near.neighbors, thick, aside, 0, count)
    blob = np.bincount(piece, thick > THICK, minlength=count) > 0.5 * sizes
    least = np.minimum(np.maximum(share * count, AROUND) * np.where(blob, BLOB, 1.0), float(sizes.max()))
    loose = sizes[piece] < least[piece]
    typical = float(np.median(near.reach))
    while loose.any():
        kept = np.flatnonzero(~loose)
        tree = grow_tree(near.tree.points[kept])
        away, which = _distances(tree, near.tree.points[loose])
        beside = away <= APART * np.maximum(typical, near.reach[kept[which]])
        joined = np.unique(piece[loose][beside & ~blob[piece[loose]]])
        if not len(joined):
            break
        loose &= ~np.isin(piece, joined)
    return loose


def _distances(tree: trees.Tree, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the distance of places (P, 3) from the nearest point of a tree, and the number of that point."""
    away, which = np.empty(len(places)), np.empty(len(places), np.int64)
    kernels.nearest_of_places(tree, np.ascontiguousarray(places), away, which)
    return away, which
