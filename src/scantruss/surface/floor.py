"""The floor under a scanned shell: a level, flat piece below all others."""

from __future__ import annotations

import numpy as np

LEVEL_COSINE = 0.996  # least cosine between the normal of a floor and the vertical: 5 degrees
FLOOR_RMS = 0.004  # largest rms distance of a floor from its plane [its longest side]
LEAST_HEIGHT = 0.5  # least height of the others over a floor, of which some stand higher than one [cells]
SHARE_OVER_FLOOR = 0.7  # least share of the other pieces that lies over the floor in plan
SHARE_OF_FLOOR = 0.25  # least share of the floor that lies under the other pieces in plan


def find_floor(mean: np.ndarray, piece: np.ndarray, pieces: tuple[int, ...], cell: float) -> int | None:
    """Return which of some pieces is the floor under the others, None if none is.

    Parameters
    ----------
    mean : (S, 3) positions of the samples, z upwards [scan unit]
    piece : (S,) piece of each sample
    pieces : numbers of the pieces
    cell : width of the cells by which plans are compared, wider than the spacing of the samples [scan unit]
    """
    if len(pieces) < 2:
        return None
    lowest = min(pieces, key=lambda number: float(np.median(mean[piece == number, 2])))
    floor, others = mean[piece == lowest], mean[np.isin(piece, [p for p in pieces if p != lowest])]
    middle = floor.mean(axis=0)
    _, spread, axes = np.linalg.svd(floor - middle, full_matrices=False)
    flat = spread[2] / np.sqrt(len(floor)) <= FLOOR_RMS * float(np.ptp(floor, axis=0).max())
    height = (others - middle) @ (axes[2] * np.sign(axes[2, 2]))
    is_over = float(height.min()) > LEAST_HEIGHT * cell and float(height.max()) > cell
    if not flat or abs(axes[2, 2]) < LEVEL_COSINE or not is_over:
        return None
    below, above = _cells(floor, cell), _cells(others, cell)
    both = len(below & above)
    return lowest if both >= SHARE_OVER_FLOOR * len(above) and both >= SHARE_OF_FLOOR * len(below) else None


def _cells(points: np.ndarray, cell: float) -> set[tuple[int, int]]:
    """Return the cells in plan that points (N, 3) lie in."""
    return set(map(tuple, np.unique(np.floor(points[:, :2] / cell).astype(np.int64), axis=0).tolist()))
