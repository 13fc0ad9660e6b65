"""What of a scan its grid does not follow: counted, with places and sizes."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ..grid.certificate import LeftOut, place_of
from ..kernels.geometry.components import component_labels
from ..kernels.scan.nearby import nearest_places
from ..surface.samples import DUPLICATE, KEPT, OUTLIER, ROD, SPARSE_POINT

if TYPE_CHECKING:
    from ..surface.samples import SurfaceSamples
    from .distances import Distances

MOST_PLACES = 5  # places of a kind that are listed one by one; the others are one entry without a place


def parts_left_out(
    samples: SurfaceSamples, found: Distances, members: np.ndarray, reach: np.ndarray
) -> tuple[LeftOut, ...]:
    """Return what a grid leaves out, the most points first; what the settings asked for and holes that are closed come last.

    Parameters
    ----------
    members, reach : (N,) desired member length at each point, and how far it may lie from the grid [scan unit]
    """
    count = len(samples.scan)
    parts = [*_of_kind("outliers", samples.judged == OUTLIER, samples, found)]
    parts += _of_kind("sparse", samples.judged == SPARSE_POINT, samples, found)
    parts += _of_kind("rods", samples.judged == ROD, samples, found)
    parts += _of_kind("duplicates", samples.judged == DUPLICATE, samples, found)
    away = np.flatnonzero((samples.judged == KEPT) & (found.scan > reach))
    owner = _owners(samples, away)
    small = (owner >= 0) & ~samples.kept[owner]
    other = small & np.isin(samples.piece[owner], samples.not_chosen)
    parts += _places("pieces", away[small & ~other], samples.piece[owner[small & ~other]], samples, found)
    far = ~small & (found.scan[away] > members[away])
    parts += _places("far", away[far], _groups(samples, owner[far]), samples, found)
    parts.sort(key=lambda part: -part.points)
    chosen_out = _places("not chosen", away[other], samples.piece[owner[other]], samples, found)
    parts += [replace(part, asked=True) for part in chosen_out]
    total = count + sum(number for _, number in samples.unread)
    parts += [LeftOut(words, number, number / total, asked=True) for words, number in samples.unread]
    return (*parts, *_closed_holes(samples))


def _part(kind: str, which: np.ndarray, samples: SurfaceSamples, found: Distances, placed: bool = True) -> LeftOut:
    """Return some points of the scan (K,), K > 0, as one entry."""
    points = samples.scan[which]
    where = place_of(np.median(points, axis=0) + samples.origin) if placed else None
    size = float(np.ptp(points, axis=0).max()) if placed else None
    return LeftOut(kind, len(which), len(which) / len(samples.scan), where, size, float(found.scan[which].max()))


def _of_kind(kind: str, which: np.ndarray, samples: SurfaceSamples, found: Distances) -> list[LeftOut]:
    """Return the points marked in `which` (N,) bool as one entry; none where none is."""
    return [_part(kind, np.flatnonzero(which), samples, found)] if which.any() else []


def _places(
    kind: str, which: np.ndarray, group: np.ndarray, samples: SurfaceSamples, found: Distances
) -> list[LeftOut]:
    """Return an entry for each of the largest groups of points (K,), and one for the rest."""
    if not len(which):
        return []
    _, number, counts = np.unique(group, return_inverse=True, return_counts=True)
    largest = np.argsort(-counts, kind="stable")
    parts = [_part(kind, which[number == each], samples, found) for each in largest[:MOST_PLACES]]
    rest = np.isin(number, largest[MOST_PLACES:])
    return [*parts, *([_part(kind, which[rest], samples, found, placed=False)] if rest.any() else [])]


def _owners(samples: SurfaceSamples, which: np.ndarray) -> np.ndarray:
    """Return the sample nearest to some points (K,), -1 where none is near."""
    owner = np.empty(len(which), np.int64)
    near = 2.0 * max(samples.surface.radius, samples.spacing)
    nearest_places(samples.scan[which], samples.boxes, samples.surface.mean, near, owner, 0, len(which))
    return owner


def _groups(samples: SurfaceSamples, owner: np.ndarray) -> np.ndarray:
    """Return a number (K,) for each of some points by their samples (K,): the same where these hang together, -1 where there is none."""
    if not len(owner):
        return owner
    chosen = np.unique(owner[owner >= 0])
    position = np.full(len(samples.surface.mean) + 1, -1)
    position[chosen] = np.arange(len(chosen))
    beside = position[samples.surface.neighbors[chosen]]  # a neighbour of -1 is the last position: none
    one, other = np.nonzero(beside >= 0)
    label = component_labels(len(chosen), one, beside[one, other])
    return np.where(owner >= 0, label[position[owner]] if len(chosen) else -1, -1)


def _closed_holes(samples: SurfaceSamples) -> list[LeftOut]:
    """Return the holes that were closed: where samples of made-up points hang together."""
    made_up = np.arange(samples.measured, len(samples.surface.mean))
    group = _groups(samples, made_up)
    holes = []
    for each in np.unique(group):
        mean = samples.surface.mean[made_up[group == each]]
        where = place_of(mean.mean(axis=0) + samples.origin)
        holes.append(LeftOut("hole", 0, 0.0, where, float(np.ptp(mean, axis=0).max()), asked=True))
    return holes
