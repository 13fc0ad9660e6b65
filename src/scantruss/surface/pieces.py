"""The connected pieces of a scan: numbered by size, those large enough for a grid, and those that the settings choose."""

from __future__ import annotations

import numpy as np

from ..errors import InputError
from ..kernels.surface.local_surface import Surface
from ..scan.vectors import dots

LEAST_TRIANGLES = 20.0  # fewest triangles of a piece that gets a grid
TRIANGLE_AREA = 0.433  # area of a regular triangle [square of its side]
LEAST_SHARE = 0.01  # least area of such a piece [area of the largest piece]
# width of the cells by which pieces are ordered, so that no member length changes that [point spacings]
SPACINGS_OF_CELL = 4.0
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


def chosen_pieces(named: dict[int, int], wanted: str) -> tuple[int, ...]:
    """Return the large pieces that the settings choose by the numbers that users give them, or the first of these as the largest.

    named : large pieces by these numbers, see `SurfaceSamples.named_pieces`

    Raises
    ------
    InputError
        There is no piece of that number, or it cannot carry a grid.
    """
    numbers = [min(named)] if wanted == "largest" else [int(word) for word in wanted.split(",")]
    if unknown := set(numbers) - set(named):
        last = max(named)
        up_to = "1" if last == 1 else f"a number up to {last}"
        choice = up_to if len(named) == last else f"one of {', '.join(map(str, named))}"
        raise InputError(
            f"piece {max(unknown)} is asked for, but the scan has {len(named)} that can carry a grid;"
            f" choose {choice}, largest or all, or --no-keep-rods to part pieces that poles or cables join"
        )
    return tuple(sorted({named[number] for number in numbers}))


def places_to_count(points: np.ndarray, spacing: float) -> np.ndarray:
    """Return one of the points (N, 3) in each cell of a few spacings, (M, 3): as many as the area that they cover."""
    cells = np.floor(points / (SPACINGS_OF_CELL * spacing)).astype(np.int64)
    cells -= cells.min(axis=0)
    across = cells.max(axis=0) + 1
    first = np.unique((cells[:, 0] * across[1] + cells[:, 1]) * across[2] + cells[:, 2], return_index=True)[1]
    return points[first]


def by_size(owner: np.ndarray, places: np.ndarray, piece: np.ndarray) -> list[int]:
    """Return the pieces, that of the largest area first, of as large ones that which lies lowest in x, y, z.

    owner : (M,) sample of each of `places_to_count`, -1 where none is near; places, piece : (S, 3), (S,) of the samples
    """
    low = np.full((int(piece.max()) + 1, 3), np.inf)
    np.minimum.at(low, piece, places)
    cells = np.bincount(piece[owner[owner >= 0]], minlength=len(low))
    order: list[int] = np.lexsort((*low.T[::-1], -cells)).tolist()
    return order


def large_pieces(piece: np.ndarray, area: np.ndarray, graded: np.ndarray, length: float) -> tuple[int, ...]:
    """Return the pieces that are not debris: large enough for some twenty triangles, and a hundredth of the largest."""
    count = np.bincount(piece)
    total = np.bincount(piece, area)
    room = LEAST_TRIANGLES * TRIANGLE_AREA * length**2
    large = (np.bincount(piece, graded) >= room) & (total >= LEAST_SHARE * total.max()) & (count >= LEAST_SAMPLES)
    large[0] = True
    return tuple(int(i) for i in np.flatnonzero(large))
