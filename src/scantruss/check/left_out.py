"""What of a scan its grid does not follow: counted, with places and sizes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ..grid.certificate import LeftOut, place_of
from ..kernels.geometry.components import component_labels
from ..kernels.mesh.coverage import nearest_distances
from ..surface.chosen_samples import DUPLICATE, KEPT, LIMB, OUTLIER, ROD, SLIT, SPARSE_POINT
from ..surface.owners import owners_of
from .distances import boxes_of
from .gaps import is_empty_within, points_of_loops

if TYPE_CHECKING:
    from ..boundary.find import Boundary
    from ..surface.samples import SurfaceSamples
    from .distances import Distances

LIMBS_APART = 0.5  # gap between points of two limbs [member lengths]
SCATTERED_APART = 8.0  # gap between scattered points up to which they are beside each other [spacings of the points]
MOST_STEPS_APART = 1e5  # cells along an axis by which these are found, at most
AROUND_HOLE = 0.25  # distance from a hole at which a place names it [member lengths]
CAP_REACH = 1.2  # distance from the middle of a ring within which a place lies on its cap [largest radii of the ring]
PLACES_LISTED = 5  # places of a kind that are listed one by one; the others are one entry without a place


def parts_left_out(
    samples: SurfaceSamples, found: Distances, members: np.ndarray, reach: np.ndarray
) -> tuple[LeftOut, ...]:
    """Return what a grid leaves out, the most points first, what the settings asked for last.

    Parameters
    ----------
    members, reach : (N,) desired member length at each point, and how far it may lie from the grid [scan unit]
    """
    total = len(samples.scan) + sum(number for _, number in samples.unread)
    return (
        *(part for part, _ in points_left_out(samples, found.scan, members, reach)),
        *(_unread(words, number, number / total, samples) for words, number in samples.unread),
    )


def _unread(words: str, number: int, share: float, samples: SurfaceSamples) -> LeftOut:
    """Return points that were not read, with the middle and the size of the box around them where a crop left them out."""
    box = next((box for crop, box in samples.cropped if crop == words), None)
    if box is None:
        return LeftOut(words, number, share, asked=True)
    return LeftOut(words, number, share, place_of(box.mean(axis=0)), float(np.ptp(box, axis=0).max()), asked=True)


def points_left_out(
    samples: SurfaceSamples, distance: np.ndarray, members: np.ndarray, reach: np.ndarray
) -> list[tuple[LeftOut, np.ndarray]]:
    """Return what a grid leaves out of the points that were read, each with the numbers (K,) of its points.

    Parameters
    ----------
    distance : (N,) of each point from the grid [scan unit]
    members, reach : as in `parts_left_out`
    """
    parts = []
    for kind, judged in (("outliers", OUTLIER), ("sparse", SPARSE_POINT), ("rods", ROD), ("duplicates", DUPLICATE)):
        if len(which := np.flatnonzero(samples.judged == judged)):
            scattered = judged in (OUTLIER, SPARSE_POINT)
            parts.append((_scattered if scattered else _part)(kind, which, samples, distance))
    away = np.flatnonzero((samples.judged == KEPT) & ((distance > reach) | samples.elsewhere))
    owner = owners_of(samples, samples.scan[away])
    small = (owner >= 0) & ~samples.kept[owner]
    other = samples.elsewhere[away]
    floor = other & (samples.piece[owner] == (-1 if samples.floor is None else samples.floor))
    beyond_cut = _beyond_cut(samples, away, np.where(small & ~other, samples.piece[owner], -1), members)
    for kind, judged, more in (("limbs", LIMB, away[beyond_cut]), ("slits", SLIT, away[:0])):
        if len(which := np.union1d(np.flatnonzero((samples.judged == judged) & (distance > reach)), more)):
            group = points_together(samples.scan[which], LIMBS_APART * members[which])
            parts += _places(kind, which, group, samples, distance)
    if floor.any():
        parts.append(_part("floor", away[floor], samples, distance))
        other &= ~floor
    too_small = small & ~other & ~floor & ~beyond_cut
    parts += _places("pieces", away[too_small], samples.piece[owner[too_small]], samples, distance)
    far = ~small & (distance[away] > members[away])
    parts += _places("far", away[far], _groups(samples, owner[far]), samples, distance)
    parts.sort(key=lambda part: -part[0].points)
    chosen_out = _places("not chosen", away[other], samples.piece[owner[other]], samples, distance)
    return [*parts, *((replace(part, asked=True), which) for part, which in chosen_out)]


def _beyond_cut(samples: SurfaceSamples, which: np.ndarray, piece: np.ndarray, members: np.ndarray) -> np.ndarray:
    """Return which points (K,) belong to small pieces (K,), else -1, that hung on a limb before it was cut off, as a hoof does."""
    cut = np.isin(samples.judged, (LIMB, SLIT))
    beyond = np.zeros(len(which), np.bool_)
    if cut.any() and (piece >= 0).any():
        limbs, small = np.ascontiguousarray(samples.scan[cut]), np.flatnonzero(piece >= 0)
        places, length = np.ascontiguousarray(samples.scan[which[small]]), float(members.max())
        away = np.empty(len(small))
        nearest_distances(places, limbs, boxes_of(limbs, length), length, away)
        hung = piece[small[away < LIMBS_APART * members[which[small]]]]
        beyond[small] = np.isin(piece[small], hung)
    return beyond


def _part(
    kind: str, which: np.ndarray, samples: SurfaceSamples, distance: np.ndarray, placed: bool = True
) -> tuple[LeftOut, np.ndarray]:
    """Return some points of the scan (K,), K > 0, as one entry."""
    points = samples.scan[which]
    where = place_of(np.median(points, axis=0) + samples.origin) if placed else None
    size = float(np.ptp(points, axis=0).max()) if placed else None
    share, farthest = len(which) / len(samples.scan), float(distance[which].max())
    return LeftOut(kind, len(which), share, where, size, farthest), which


def _scattered(
    kind: str, which: np.ndarray, samples: SurfaceSamples, distance: np.ndarray
) -> tuple[LeftOut, np.ndarray]:
    """Return points that may be all over the scan (K,), K > 0, as one entry, with the place and the size of the most beside each other."""
    points = samples.scan[which]
    apart = max(SCATTERED_APART * samples.spacing, float(np.ptp(points, axis=0).max()) / MOST_STEPS_APART)
    group = points_together(points, np.full(len(which), apart)) if apart > 0.0 else np.zeros(len(which), np.int64)
    own = group == np.bincount(group).argmax()
    largest, _ = _part(kind, which[own], samples, distance)
    whole, _ = _part(kind, which, samples, distance)
    return replace(whole, where=largest.where, size=largest.size, together=int(own.sum())), which


def _places(
    kind: str, which: np.ndarray, group: np.ndarray, samples: SurfaceSamples, distance: np.ndarray
) -> list[tuple[LeftOut, np.ndarray]]:
    """Return an entry for each of the largest groups of points (K,), and one for the rest."""
    if not len(which):
        return []
    _, number, counts = np.unique(group, return_inverse=True, return_counts=True)
    largest = np.argsort(-counts, kind="stable")
    parts = [_part(kind, which[number == each], samples, distance) for each in largest[:PLACES_LISTED]]
    rest = np.isin(number, largest[PLACES_LISTED:])
    return [*parts, *([_part(kind, which[rest], samples, distance, placed=False)] if rest.any() else [])]


def points_together(points: np.ndarray, apart: np.ndarray) -> np.ndarray:
    """Return a number for each of some points (K, 3): the same where gaps between them are small (K,)."""
    cell = float(apart.max())
    places = np.floor(points / cell).astype(np.int64)
    places -= places.min(axis=0) - 1
    across = places.max(axis=0) + 2  # a layer of empty cells around
    cells, number = np.unique((places[:, 0] * across[1] + places[:, 1]) * across[2] + places[:, 2], return_inverse=True)
    steps = [(i, j, k) for i in (-1, 0, 1) for j in (-1, 0, 1) for k in (-1, 0, 1) if (i, j, k) > (0, 0, 0)]
    pairs = []
    for i, j, k in steps:
        beside = cells + (i * across[1] + j) * across[2] + k
        at = np.searchsorted(cells, beside).clip(max=len(cells) - 1)
        there = np.flatnonzero(cells[at] == beside)
        pairs.append(np.stack([there, at[there]]))
    one, other = np.concatenate(pairs, axis=1)
    label: np.ndarray = component_labels(len(cells), one, other)[number.ravel()]
    return label


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


def closed_holes(samples: SurfaceSamples, boundary: Boundary) -> list[LeftOut]:
    """Return the holes that were closed, the largest first and further ones as one.

    They were filled with made-up points, or were so small that the front ran over them. Of the latter, places between sparse points
    are left out that are empty by accident, and those in sparse parts.
    """
    made_up = np.arange(samples.measured, len(samples.surface.mean))
    group = _groups(samples, made_up)
    filled = [samples.surface.mean[made_up[group == each]] for each in np.unique(group)]
    filled = [places for places in filled if not _closes_body(places, samples)]
    holes = [_hole(places, samples, asked=True) for places in filled]
    edge = points_of_loops(boundary)
    open_ones = (curve for curve in boundary.bridged if is_empty_within(curve, samples.points_by_x, edge))
    holes += [_hole(curve, samples, asked=False) for curve in open_ones]
    holes = without_caps(holes, samples)
    return first_and_more(sorted(holes, key=lambda hole: -(hole.size or 0.0)))


def asked_for(holes: list[LeftOut], places: Sequence[Sequence[float]], length: float) -> list[LeftOut]:
    """Return holes and gaps, those at one of some places as asked for: `fill_at` names them, by a point within or around one."""
    return [
        replace(hole, asked=True) if hole.where and any(_is_at(place, hole, length) for place in places) else hole
        for hole in holes
    ]


def _is_at(place: Sequence[float], hole: LeftOut, length: float) -> bool:
    """Whether a place lies in a hole or within a quarter of a member around it."""
    away = float(np.linalg.norm(np.array(place, float) - np.array(hole.where)))
    return away <= 0.5 * (hole.size or 0.0) + AROUND_HOLE * length


def _closes_body(places: np.ndarray, samples: SurfaceSamples) -> bool:
    """Whether made-up places (K, 3) close a body where a limb was taken off, or a slit filled."""
    gone = samples.scan[np.isin(samples.judged, (LIMB, SLIT))]
    middle = places[((places - places.mean(axis=0)) ** 2).sum(axis=1).argmin()]
    near = np.linalg.norm(gone - middle, axis=1) < samples.surface.length
    return bool(near.any())


def without_caps(holes: list[LeftOut], samples: SurfaceSamples) -> list[LeftOut]:
    """Return holes and gaps but for the caps of limbs that were cut off at a ring, which are listed as such."""
    caps = [
        (middle := ring.points.mean(axis=0), np.linalg.norm(ring.points - middle, axis=1).max())
        for ring in samples.rings
    ]
    return [
        hole
        for hole in holes
        if hole.where is None
        or not any(np.linalg.norm(hole.where - samples.origin - middle) <= CAP_REACH * reach for middle, reach in caps)
    ]


def first_and_more(parts: list[LeftOut]) -> list[LeftOut]:
    """Return the first of some entries of one kind, and one for the others."""
    if len(more := parts[PLACES_LISTED:]) < 2:
        return parts
    size = max(part.size or 0.0 for part in more)
    asked = all(part.asked for part in more)
    return [*parts[:PLACES_LISTED], replace(more[0], where=None, size=size, number=len(more), asked=asked)]


def _hole(places: np.ndarray, samples: SurfaceSamples, *, asked: bool) -> LeftOut:
    """Return a hole as an entry, by places (K, 3): samples that fill it (asked), or the curve around it."""
    where, size = place_of(places.mean(axis=0) + samples.origin), float(np.ptp(places, axis=0).max())
    size += 2.0 * samples.surface.radius if asked else 0.0  # samples end before the points around
    return LeftOut("hole", 0, 0.0, where, size, asked=asked)
