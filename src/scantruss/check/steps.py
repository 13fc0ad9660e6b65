"""Lines along which a scan leaves its grid abruptly, as at the sides of beams and fins far narrower than a member."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..errors import words_of_number
from ..grid.certificate import Fault, place_of
from .distances import feet_over
from .left_out import points_together
from .limits import NOISES_OFF, PLACES_KEPT

if TYPE_CHECKING:
    from ..grid.grid import Grid
    from ..surface.samples import SurfaceSamples
    from .distances import Distances

# width of the columns in which heights over the grid are compared, at least [spacings of the points, member lengths]
SIZE_OF_COLUMN = (2.5, 0.05)
# least height of a step beyond the noise [columns, member lengths]: a slope of 45 degrees is none
HEIGHT_OF_STEP = (1.6, 0.08)
FEWEST_IN_COLUMN, SPARED_FROM = 4, 6  # points in a column, and from how many on its highest and its lowest do not count
GAP_IN_LINE = 1.5  # gap within a line of steps [columns]
# length from which on a line is said [member lengths]: along beams 4 to 14, on the shells, twins and real scans without any 1.7 at most
LONG_STEP = 3.0


def unfollowed_steps(
    grid: Grid, samples: SurfaceSamples, found: Distances, chosen: np.ndarray, members: np.ndarray
) -> list[Fault]:
    """Return a warning of the lines along which points at one place of the grid lie at different heights over it.

    Parameters
    ----------
    chosen : (N,) bool, points of the scan that the grid is to follow
    members : (N,) desired member length at each point [scan unit]
    """
    near = np.flatnonzero(chosen & (found.scan <= 0.5 * members))
    if not len(near):
        return []
    points, member = samples.scan[near], float(members[near].mean())
    height, feet = feet_over(grid, found.triangle[near], points)
    column = max(SIZE_OF_COLUMN[0] * samples.spacing, SIZE_OF_COLUMN[1] * member)
    least = max(HEIGHT_OF_STEP[0] * column, HEIGHT_OF_STEP[1] * member) + NOISES_OFF * float(np.median(found.noise))
    high = np.abs(height) > 0.5 * least  # one of the points of a step is
    if not high.any():
        return []
    number = _columns(feet, column)
    near_high = np.isin(number, number[high])
    points, height, number = points[near_high], height[near_high], number[near_high]
    order = np.lexsort((height, number))
    begin = np.flatnonzero(np.diff(number[order], prepend=-1))
    end = np.append(begin[1:], len(order))
    spared = (end - begin >= SPARED_FROM).astype(np.int64)
    step = height[order[end - 1 - spared]] - height[order[begin + spared]]
    high = np.flatnonzero((step > least) & (end - begin >= FEWEST_IN_COLUMN))
    if not len(high):
        return []
    places, step = points[order[begin[high]]], step[high]
    line = points_together(places, np.full(len(places), GAP_IN_LINE * column))
    lines = [
        np.flatnonzero(line == number) for number in np.flatnonzero(np.bincount(line) * column >= LONG_STEP * member)
    ]
    sizes = {own[0]: float(np.ptp(places[own], axis=0).max()) for own in lines}
    lines = sorted((own for own in lines if sizes[own[0]] >= LONG_STEP * member), key=lambda own: -sizes[own[0]])
    if not lines:
        return []
    unit = f" {grid.unit}" if grid.unit else ""
    worst = [int(own[step[own].argmax()]) for own in lines[:PLACES_KEPT]]
    several = f"{len(lines)} narrow parts of the scan, the largest" if len(lines) > 1 else "a narrow part of the scan"
    long = words_of_number(sizes[lines[0][0]], 3)
    words = (
        f"does not follow {several} {long}{unit} long, such as a beam, a rib or a fin: the points there lie"
        f" up to {words_of_number(step[worst].max(), 3)}{unit} apart across the grid"
    )
    at, *others = (place_of(place) for place in places[worst] + samples.origin)
    return [Fault("unfollowed", words, at, tuple(others))]


def _columns(feet: np.ndarray, width: float) -> np.ndarray:
    """Return the number of the column of each point (N,), by its foot on the grid (N, 3); width : of a column [scan unit]."""
    cell = np.floor(feet / width).astype(np.int64)
    cell -= cell.min(axis=0)
    across = cell.max(axis=0) + 1
    number: np.ndarray = (cell[:, 0] * across[1] + cell[:, 1]) * across[2] + cell[:, 2]
    return number
