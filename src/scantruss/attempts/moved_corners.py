"""Corners in which ridges of a scan meet and that its grid moves, as where another line or corner lies less than a member beside them."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ..check.limits import PLACES_KEPT
from ..constraints.find import wanted_ridges
from ..constraints.ridges import ONE_CORNER
from ..errors import ScanTrussError, words_of_number
from ..grid.certificate import Fault, place_of
from ..surface.samples import sample_surface
from .lost_ridges import places_on_chains

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..constraints.ridge_ends import Ridge
    from ..grid.grid import Grid
    from ..scan.cloud import PointCloud
    from ..settings import Settings

CORNER_MOVED = 0.25  # distance of the nearest node from which on a corner is moved [member lengths]
# how far from its corner a ridge is followed or not, and distance from the grid's ridges within which it is [member lengths]
FOLLOWED_FROM, FOLLOWED_WITHIN = 1.0, 0.3
CLEAR_OF_BOUNDARY = 0.75  # distance of a corner from the boundary, where ridges end at that [member lengths]


def with_moved_corners(grid: Grid, cloud: PointCloud, asked: Settings, wide: tuple[int, ...] = ()) -> Grid:
    """Return a grid with a warning of the corners that it moves; as it is without any.

    Parameters
    ----------
    asked : Settings
        Those that were asked for, where the grid has none.
    wide : numbers of wide folds that are ridges too
    """
    found, made = grid.certificate, grid.settings or asked
    if found is None or not len(grid.lines):
        return grid
    try:
        samples = sample_surface(cloud, made)
        ridges = wanted_ridges(samples, made, wide)
    except ScanTrussError:  # its folds are a tangle
        return grid
    moved = moved_corners(grid, ridges, made.length)
    if not moved:
        return grid
    unit, more = f" {grid.unit}" if grid.unit else "", f" ({len(moved)} such places)" if len(moved) > 1 else ""
    words = (
        f"moves a corner where ridges meet by {words_of_number(moved[0][0], 3)}{unit}{more}; shorter members keep it"
    )
    at, *others = (place_of(place + grid.origin) for _, place in moved[:PLACES_KEPT])
    warnings = (*found.warnings, Fault("ridge", words, at, tuple(others)))
    return grid.replace(certificate=replace(found, warnings=warnings))


def moved_corners(grid: Grid, ridges: Sequence[Ridge], length: float) -> list[tuple[float, np.ndarray]]:
    """Return how far a grid moves the corners of ridges that it follows, the farthest first, and where each (3,) is on the scan.

    Parameters
    ----------
    ridges : those of the scan
    length : desired member length, where the grid has none of its own at each node [scan unit]
    """
    followed = places_on_chains(grid)
    if not len(followed):
        return []
    outer = grid.nodes[grid.edges[grid.edge_uses == 1].ravel()]
    ends = [(ridge, at, ridge.places[at]) for ridge in ridges if not ridge.ring for at in (0, -1)]
    found: list[tuple[float, np.ndarray]] = []
    for ridge, _, place in ends:
        member = length if grid.desired is None else float(grid.desired[_nearest(grid.nodes, place)])
        away = _gap(grid.nodes, place)
        if away <= CORNER_MOVED * member or any(np.linalg.norm(place - other) < member / 2 for _, other in found):
            continue
        here = [each for each in ends if np.linalg.norm(each[2] - place) < ONE_CORNER * member]
        led = [_gap(followed, _inwards(one, at, member)) < FOLLOWED_WITHIN * member for one, at, _ in here]
        on_boundary = len(outer) and _gap(outer, place) < CLEAR_OF_BOUNDARY * member
        if len({id(one) for one, _, _ in here} | {id(ridge)}) > 1 and all(led) and not on_boundary:
            found.append((away, place))
    return sorted(found, key=lambda each: -each[0])


def _nearest(places: np.ndarray, place: np.ndarray) -> int:
    """Return the number of the place (K, 3) that is nearest to one (3,)."""
    return int(np.linalg.norm(places - place, axis=1).argmin())


def _gap(places: np.ndarray, place: np.ndarray) -> float:
    """Return the distance of a place (3,) from the nearest of others (K, 3)."""
    return float(np.linalg.norm(places - place, axis=1).min())


def _inwards(ridge: Ridge, at: int, member: float) -> np.ndarray:
    """Return the place (3,) on a ridge a member from one of its ends, or its middle where it is short."""
    line = ridge.places if at == 0 else ridge.places[::-1]
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    way = min(FOLLOWED_FROM * member, 0.5 * arc[-1])
    return np.array([np.interp(way, arc, line[:, axis]) for axis in range(3)])
