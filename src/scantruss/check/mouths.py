"""Mouths of slots and bays that a grid closes: it makes an opening of them, cut off from the edge by a strip without points."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..errors import words_of_number
from ..grid.certificate import Fault, place_of
from .distances import nearest_point_distances
from .limits import PLACES_KEPT

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..grid.grid import Grid
    from ..surface.samples import SurfaceSamples

ALONG_MEMBER = np.linspace(0.1, 0.9, 9)  # places along a member of the boundary that are looked at
ACROSS_STRIP = np.linspace(0.0, 1.0, 7)  # ... and from one boundary loop to another
WIDEST_STRIP = 1.2  # distance of two loops up to which what lies between them may be such a strip [member lengths]
HALF_MOUTH = 0.2  # least distance of all places across the strip from the nearest point [member lengths]
EMPTIER = 3.2  # ... and in those usual on the triangles around, as for narrow gaps
AROUND_MOUTH = 2.0  # distance within which these lie [member lengths]


def mouths_closed(grid: Grid, samples: SurfaceSamples, length: float, said: Sequence[Fault] = ()) -> list[Fault]:
    """Return a warning of the strips between two boundary loops of a grid along which no point is as near as usual.

    Parameters
    ----------
    length : desired member length [scan unit]
    said : warnings; what lies within a member of their places is not said again
    """
    chains = grid.boundary_loops
    if len(chains) < 2:
        return []
    ends = [np.stack([grid.nodes[chain], grid.nodes[np.roll(chain, -1)]], axis=1) for chain in chains]
    members = np.concatenate(ends)
    places = members[:, :1] + ALONG_MEMBER[:, None] * (members[:, 1:] - members[:, :1])
    loop = np.arange(len(chains)).repeat([len(chain) * len(ALONG_MEMBER) for chain in chains])
    places = places.reshape(-1, 3)
    is_open = nearest_point_distances(places, samples, length) > HALF_MOUTH * length
    places, loop = places[is_open], loop[is_open]
    pairs = [
        (number, other)
        for number in range(len(places))
        for other in np.flatnonzero(
            (loop > loop[number]) & (np.linalg.norm(places - places[number], axis=1) < WIDEST_STRIP * length)
        ).tolist()
    ]
    if not pairs:
        return []
    one, other = places[np.array(pairs).T]
    across = one[:, None] + ACROSS_STRIP[:, None] * (other - one)[:, None]
    half = nearest_point_distances(across, samples, length).min(axis=1)
    middles = 0.5 * (one + other)
    centres = grid.nodes[grid.triangles].mean(axis=1)
    of_centres = nearest_point_distances(centres, samples, length)
    chosen = np.flatnonzero(half > HALF_MOUTH * length)
    around = [np.linalg.norm(centres - middles[at], axis=1) < AROUND_MOUTH * length for at in chosen.tolist()]
    usual = np.array([np.median(of_centres[near]) for near in around])
    chosen = chosen[half[chosen] > EMPTIER * usual]
    known = [np.array(place) - samples.origin for fault in said for place in (fault.where, *fault.also) if place]
    widest: list[int] = []
    for at in chosen[np.argsort(-half[chosen], kind="stable")].tolist():
        if all(np.linalg.norm(middles[at] - place) > length for place in (*known, *middles[widest])):
            widest.append(at)
    if not widest:
        return []
    unit, more = f" {grid.unit}" if grid.unit else "", f" ({len(widest)} such places)" if len(widest) > 1 else ""
    words = f"closes the mouth, {words_of_number(2.0 * half[widest[0]], 3)}{unit} wide, of a slot or bay{more}"
    at, *others = (place_of(middles[each] + samples.origin) for each in widest[:PLACES_KEPT])
    return [Fault("gap", f"{words}; shorter members leave it open", at, tuple(others))]
