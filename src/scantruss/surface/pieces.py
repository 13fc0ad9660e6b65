"""The connected pieces of a scan: numbered by size, those large enough for a grid, and those that the settings choose."""

from __future__ import annotations

import numpy as np

from ..errors import InputError
from ..kernels.surface.local_surface import Surface
from ..scan.vectors import dots

LEAST_TRIANGLES = 20.0  # fewest triangles of a piece that gets a grid
TRIANGLE_AREA = 0.433  # area of a regular triangle [square of its side]
LEAST_SHARE = 0.01  # least area of such a piece [area of the largest piece]
LEAST_SAMPLES = 12  # fewest samples of such a piece


def number_pieces(piece: np.ndarray) -> np.ndarray:
    """Return the number of the piece of each sample (S,) when pieces are numbered by size, largest first."""
    counts = np.bincount(piece)
    rank = np.empty(len(counts), np.int64)
    rank[np.argsort(-counts, kind="stable")] = np.arange(len(counts))
    return rank[piece]


def sample_areas(surface: Surface) -> np.ndarray:
    """Return the rough area around each sample (S,): a disc through its farthest neighbour, shared by all of them [scan unit^2]."""
    linked = surface.neighbors >= 0
    count = linked.sum(axis=1)
    last = surface.neighbors[np.arange(len(count)), np.maximum(count - 1, 0)]
    arm = surface.mean[last] - surface.mean
    reach = dots(arm, arm)
    return np.where(count > 0, np.pi * reach / (count + 1), 0.0)


def chosen_pieces(large: tuple[int, ...], wanted: str, floor: int | None) -> tuple[int, ...]:
    """Return the large pieces that the settings choose: all but the floor, all, the largest, or some by their numbers from 1.

    Raises
    ------
    InputError
        There is no piece of that number.
    """
    if wanted in ("auto", "all"):
        return tuple(number for number in large if number != floor)
    numbers = [1] if wanted == "largest" else [int(word) for word in wanted.split(",")]
    if max(numbers) > len(large):
        choice = "1" if len(large) == 1 else f"a number up to {len(large)}"
        raise InputError(
            f"piece {max(numbers)} is asked for, but the scan has {len(large)} that can carry a grid;"
            f" choose {choice}, largest or all, or --no-keep-rods to part pieces that poles or cables join"
        )
    return tuple(large[number - 1] for number in sorted(set(numbers)))


def large_pieces(piece: np.ndarray, area: np.ndarray, graded: np.ndarray, length: float) -> tuple[int, ...]:
    """Return the pieces that are not debris: large enough for some twenty triangles, and a hundredth of the largest."""
    count = np.bincount(piece)
    total = np.bincount(piece, area)
    room = LEAST_TRIANGLES * TRIANGLE_AREA * length**2
    large = (np.bincount(piece, graded) >= room) & (total >= LEAST_SHARE * total.max()) & (count >= LEAST_SAMPLES)
    large[0] = True
    return tuple(int(i) for i in np.flatnonzero(large))
