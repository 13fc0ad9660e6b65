"""Polylines that the user gives: checked, brought onto the scan in small steps, their corners found."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..boundary.curves import length_along
from ..boundary.polylines import POINTS_UNDER_LINE, corners_of_polyline, divide_polyline, feet_on_scan, simplify
from ..errors import InputError, unit_words, words_of_number
from ..kernels.surface.local_surface import Surface
from ..surface.near_scan import check_on_scan, place_text
from ..surface.samples import SurfaceSamples, narrow_surface

if TYPE_CHECKING:
    from ..settings import Settings
    from .network import Network

LINE_STEP = 0.05  # distance between the points of a line [member lengths]
STRAIGHTENED_ZIGZAG = 0.005  # zigzags of a polyline below this are straightened first [member lengths]
RETURN_LENGTH = 1.5  # a line that comes back to itself after this length meets itself [member lengths]
SHORTEST_LINE = 0.5  # shortest open line [member lengths]
SHORTEST_RING = 2.0  # shortest closed line [member lengths]


def add_polylines(network: Network, samples: SurfaceSamples, settings: Settings) -> None:
    """Add the user's lines to a network.

    Raises
    ------
    InputError
        A line is too short for the member, or leaves the scan by more than half a member; names the line and the place.
    """
    patches = narrow_surface(samples, POINTS_UNDER_LINE)
    for number, line in enumerate(settings.fixed_lines, 1):
        name = settings.line_names[number - 1] if settings.line_names else f"line {number}"
        given = np.array(line, float) - samples.origin
        check_on_scan(f"fixed line {number}", line, samples, settings.length)
        closed = bool((given[0] == given[-1]).all())
        _check_length(given, closed, number, samples.unit, settings.length)
        points, vertices = divide_polyline(
            simplify(given, STRAIGHTENED_ZIGZAG * settings.length, closed), closed, LINE_STEP * settings.length
        )
        corners = corners_of_polyline(points, vertices, closed, settings)
        points = _onto_scan(points, number, samples, patches, settings.length)
        for part, own, ring in _without_returns(points, corners, closed, settings.length):
            network.add(part, ring, own, name=name)


def _check_length(given: np.ndarray, closed: bool, number: int, unit: str, length: float) -> None:
    """Refuse a line on which no members have room."""
    total = length_along(given)
    least = (SHORTEST_RING if closed else SHORTEST_LINE) * length
    if total < least:
        what = "ring, that is at least two members" if closed else "line, that is at least half a member"
        raise InputError(
            f"fixed line {number} is {words_of_number(total, 4)}{unit_words(unit)} long; a {what}, {least:.4g}{unit_words(unit)}, is needed"
        )


def _onto_scan(points: np.ndarray, number: int, samples: SurfaceSamples, surface: Surface, length: float) -> np.ndarray:
    """Bring the points (M, 3) of a line down onto the scan; refuse a line that leaves it between its own points."""
    feet, gaps = feet_on_scan(points, surface)
    away = np.flatnonzero(gaps > 0.5 * length)
    if len(away):
        unit = unit_words(samples.unit)
        raise InputError(
            f"fixed line {number} leaves the scan by {words_of_number(float(gaps[away[0]]), 4)}{unit} near"
            f" {place_text(points[away[0]] + samples.origin)};"
            f" it must stay within half a member, {0.5 * length:.4g}{unit}: give it more points"
        )
    return feet


def _without_returns(
    points: np.ndarray, corners: list[int], closed: bool, length: float
) -> list[tuple[np.ndarray, list[int], bool]]:
    """Cut a line that crosses or touches itself into parts that do not: (points, corners, closed) each."""
    sparse = np.arange(0, len(points), 3)
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    arc = np.concatenate([[0.0], np.cumsum(steps)])
    total = float(arc[-1] + np.linalg.norm(points[0] - points[-1]))
    places = points[sparse]
    for k, i in enumerate(sparse.tolist()):
        along = arc[sparse[:k]]
        gap = arc[i] - along
        gap = np.minimum(gap, total - gap) if closed else gap
        back = np.flatnonzero(
            (gap > RETURN_LENGTH * length) & (((places[:k] - places[k]) ** 2).sum(axis=1) < (0.3 * length) ** 2)
        )
        if len(back):
            middle = (int(sparse[back[-1]]) + i) // 2
            first, second = points[: middle + 1], points[middle:]
            if closed:
                second = np.concatenate([second, points[:1]])
            return [
                *_without_returns(first, [c for c in corners if c <= middle], False, length),
                *_without_returns(second, [c - middle for c in corners if c > middle], False, length),
            ]
    return [(points, corners, closed)]
