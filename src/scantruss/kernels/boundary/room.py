"""Room beside and across closed curves: spikes, and whether there is nothing outside of a loop."""

from __future__ import annotations

import numpy as np

from ...runtime.jit import kernel
from ..geometry.boxes import SearchBoxes, search
from ..geometry.vectors import Vector, along, cross, dot, norm, row, subtract, unit
from ..surface.local_surface import Surface, flood, walk

SHEET_SINE = 0.4  # sine of the angle above the mean plane of two places, beyond which they lie on two sheets
BESIDE_CURVE = 1e-6  # distance from a curve up to which a point lies on it, whatever the rounding [reaches]
ONE_SHEET_COSINE = -0.5  # cosine between the normals of two places, above which they may lie on one sheet


@kernel
def normals_along(surface: Surface, curve: np.ndarray, sample: int, normals: np.ndarray) -> None:
    """Normal of the scan at each place of a curve, from sample to sample on its sheet; `sample` is near the first place."""
    for m in range(len(curve)):
        sample = walk(surface, sample, row(curve, m))
        normals[m, 0], normals[m, 1], normals[m, 2] = row(surface.normals, sample)


@kernel
def _beside(d: Vector, a: Vector, b: Vector) -> bool:
    """Whether two places at a distance d with normals a and b may lie side by side on one sheet, not one over the other.

    On a bend the chord dips below the plane at one end and rises through that at the other: only the mean plane decides.
    """
    rise = dot(d, a) + dot(d, b)
    facing = dot(a, b)
    return facing > ONE_SHEET_COSINE and rise * rise <= SHEET_SINE * SHEET_SINE * dot(d, d) * 2.0 * (1.0 + facing)


@kernel
def _longest_step(curve: np.ndarray) -> float:
    """Longest distance from a place of a closed curve (M, 3) to the next."""
    longest = 0.0
    for i in range(len(curve)):
        longest = max(longest, norm(subtract(row(curve, (i + 1) % len(curve)), row(curve, i))))
    return longest


@kernel
def widest_spike(curve: np.ndarray, normals: np.ndarray, width: float, low: int, high: int) -> tuple[int, int]:
    """Two places of a closed curve nearer than `width` with the most steps between them, more than `low`, at most `high`.

    Places one over the other, by the normals (M, 3) of the scan there, are on different sheets and do not count.

    Returns
    -------
    at, gap : the first place and the steps to the second; gap 0 if there are none
    """
    count, longest = len(curve), _longest_step(curve)
    at, gap = 0, 0
    for i in range(count):
        k = high
        while k > max(low, gap):  # each turn takes away a step or more
            j = (i + k) % count
            d = subtract(row(curve, j), row(curve, i))
            away = norm(d)
            if away < width:
                if _beside(d, row(normals, i), row(normals, j)):
                    at, gap = i, k
                    break
                k -= 1
            else:  # within so many steps it may be near enough
                k -= max(1, int((away - width) / longest))
    return at, gap


@kernel
def room_across(curve: np.ndarray, low: int, room: np.ndarray) -> None:
    """Lower the values (M,) to the distance of each place of a closed curve (M, 3) to any more than `low` steps away along it."""
    count, longest = len(curve), _longest_step(curve)
    for i in range(count):
        k = low + 1
        while k < count - low:  # each turn goes on by a step or more
            away = norm(subtract(row(curve, (i + k) % count), row(curve, i)))
            if away < room[i]:
                room[i] = away
            k += max(1, int((away - room[i]) / longest))  # the next place that may be nearer


@kernel
def open_share(surface: Surface, boxes: SearchBoxes, places: np.ndarray, sample: int, radius: float) -> float:
    """Share of the places of a loop that have room for most of a disc outside, on any sheet: about 1 for a true boundary.

    places : (M, 3) boundary points in order, the surface to their left. sample : one near the first place.
    """
    found = np.empty(8, np.int64)
    free, count = 0, len(places)
    for m in range(count):
        place = row(places, m)
        sample = walk(surface, sample, place)
        ahead = subtract(row(places, (m + 3) % count), row(places, (m - 3) % count))
        out = unit(cross(ahead, row(surface.normals, sample)))
        centre = along(place, radius, out)
        if search(boxes, surface.mean, centre[0], centre[1], centre[2], 0.6 * radius, found) == 0:
            free += 1
    return free / max(count, 1)


@kernel
def points_beside(
    surface: Surface, curve: np.ndarray, out: np.ndarray, sample: int, reach: float, counts: np.ndarray
) -> None:
    """Number of points within `reach` of each place of a curve (M, 3) on its inner side, on one sheet; `sample` is near the first place.

    Those on the curve, which runs through points, do not count. out : (M, 3) directions outwards. counts : (M,) to fill
    """
    for m in range(len(curve)):
        place, outwards = row(curve, m), row(out, m)
        sample = walk(surface, sample, place)
        inside = 0
        for i in range(flood(surface, sample, row(surface.mean, sample), reach + 2.0 * surface.radius)):
            s = surface.queue[i]
            for p in range(surface.start[s], surface.start[s + 1]):
                d = subtract(row(surface.points, p), place)
                inside += dot(d, d) <= reach * reach and dot(d, outwards) < -BESIDE_CURVE * reach
        counts[m] = inside
