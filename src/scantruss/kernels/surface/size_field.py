"""The length field: the member length that is desired at each sample of the scan, and between the samples."""

from __future__ import annotations

import math

import numpy as np

from ...runtime.jit import kernel
from ..geometry.boxes import SearchBoxes, put, search
from ..geometry.vectors import Vector, dot, norm, row, subtract
from .local_surface import PATCH, Surface, fit_patch, flood, walk

BLEND_STEPS = 2.2  # samples farther than so many steps do not count at a place
SPREAD, ASIDE = (
    14.4,
    14.0,
)  # of a curvature: by noise in the middle of a patch, and how it grows towards the boundary of the scan
GROWTHS = 90  # times that a reach grows by half at most: from any box to all of them
NEAREST = 12  # given lengths that count at a place; the next one says how far away a length counts


@kernel
def length_at(surface: Surface, sample: int, place: Vector) -> float:
    """Desired length at a place near a sample: the mean of the sample and its neighbours, the nearer the weightier."""
    sample = walk(surface, sample, place)
    reach = BLEND_STEPS * surface.step
    total = mean = 0.0
    for k in range(-1, surface.neighbors.shape[1]):
        s = sample if k < 0 else surface.neighbors[sample, k]
        if s < 0:
            break
        d = subtract(row(surface.mean, s), place)
        weight = 1.0 - dot(d, d) / (reach * reach)
        if weight > 0.0:
            total += weight * weight
            mean += weight * weight * surface.field[s]
    return mean / total if total > 0.0 else surface.field[sample]


@kernel
def lengths_along(surface: Surface, places: np.ndarray, lengths: np.ndarray) -> None:
    """Desired length (P,) at places (P, 3) each of which lies near the one before; the sample of the first is looked for in all."""
    sample, least = 0, np.inf
    for s in range(len(surface.mean)):
        d = subtract(row(surface.mean, s), row(places, 0))
        if dot(d, d) < least:
            sample, least = s, dot(d, d)
    for p in range(len(places)):
        place = row(places, p)
        sample = walk(surface, sample, place)
        lengths[p] = length_at(surface, sample, place)


@kernel
def grade(mean: np.ndarray, neighbors: np.ndarray, lengths: np.ndarray, slope: float) -> int:
    """Shorten lengths (S,) that grow by more than `slope` per way over the links of the samples; returns the sweeps made.

    What is left is the largest field below the given one of which no place is longer than another by more than the slope times
    the way between them: the least of all lengths each grown by its way, whatever the order of the sweeps. A sweep settles at least
    one more sample of each way, so that there are no more than samples (Bellman and Ford).
    """
    sweeps = 0
    for _ in range(len(mean) + 1):
        changed = False
        sweeps += 1
        for i in range(len(mean)):
            s = i if sweeps % 2 == 1 else len(mean) - 1 - i
            for k in range(neighbors.shape[1]):
                n = neighbors[s, k]
                if n < 0:
                    break
                way = slope * norm(subtract(row(mean, n), row(mean, s)))
                if lengths[s] > lengths[n] + way:
                    lengths[s] = lengths[n] + way
                    changed = True
                elif lengths[n] > lengths[s] + way:
                    lengths[n] = lengths[s] + way
                    changed = True
        if not changed:
            break
    return sweeps


@kernel
def blend_lengths(
    places: np.ndarray, given: np.ndarray, values: np.ndarray, boxes: SearchBoxes, reach: float, lengths: np.ndarray
) -> None:
    """Blend lengths given at some places (K, 3) into one at each sample (S,), by the inverse square of the distance (Shepard).

    Of more than `NEAREST` the nearest count, each less the nearer its distance comes to that of the next one, so that the blend
    has no steps (Franke and Little). `boxes` is empty, with room for K; `reach` the radius with which the first look-up begins.
    """
    for n in range(len(given)):
        put(boxes, n, given[n, 0], given[n, 1], given[n, 2])
    found = np.empty(len(given), np.int64)
    near = np.empty(NEAREST + 1)
    which = np.empty(NEAREST + 1, np.int64)
    wanted = min(NEAREST + 1, len(given))
    for s in range(len(places)):
        place = row(places, s)
        reach *= 0.7
        count = search(boxes, given, place[0], place[1], place[2], reach, found)
        for _ in range(GROWTHS):
            if count >= wanted:
                break
            reach *= 1.5
            count = search(boxes, given, place[0], place[1], place[2], reach, found)
        kept = 0
        for i in range(count):
            away = norm(subtract(row(given, found[i]), place))
            at = kept if kept < len(near) else len(near) - 1
            if kept == len(near) and away >= near[at]:
                continue
            while at > 0 and near[at - 1] > away:
                near[at], which[at] = near[at - 1], which[at - 1]
                at -= 1
            near[at], which[at] = away, found[i]
            kept = min(kept + 1, len(near))
        limit = near[NEAREST] if kept > NEAREST else np.inf
        total = mean = 0.0
        for i in range(min(kept, NEAREST)):
            away = max(near[i], 1e-9 * reach)
            weight = (1.0 / away - 1.0 / limit) ** 2 if limit > away else 0.0
            total += weight
            mean += weight * values[which[i]]
        lengths[s] = mean / total if total > 0.0 else values[which[0]]


@kernel
def _bend(patch: np.ndarray) -> float:
    """Largest curvature of a patch at its middle, without sign."""
    p, q = patch[10], patch[11]
    grown = 1.0 + p * p + q * q
    root = math.sqrt(grown)
    e, f, g = 1.0 + p * p, p * q, 1.0 + q * q
    a, b, c = 2.0 * patch[12] / root, patch[13] / root, 2.0 * patch[14] / root
    mean = 0.5 * (e * c - 2.0 * f * b + g * a) / grown
    gauss = (a * c - b * b) / grown
    return abs(mean) + math.sqrt(max(mean * mean - gauss, 0.0))


@kernel
def choose_apart(neighbors: np.ndarray, chosen: np.ndarray) -> int:
    """Choose samples (S,) bool no two of which are linked, so that every other one is linked to one of them; returns their number."""
    count = 0
    for s in range(len(neighbors)):
        free = True
        for k in range(neighbors.shape[1]):
            n = neighbors[s, k]
            if n < 0:
                break
            free = free and not chosen[n]
        chosen[s] = free
        count += free
    return count


@kernel
def measure_bends(surface: Surface, samples: np.ndarray, found: np.ndarray, begin: int, end: int) -> None:
    """Measure how much the scan bends at some samples (P,), from `begin` to `end` - 1.

    found : (P, 2), filled: largest curvature without sign, and its standard deviation by the noise: that of least squares with the
    weights of a patch, which grows where the scan lies to one side only
    """
    patch = np.zeros(PATCH)
    for i in range(begin, end):
        place = row(surface.mean, samples[i])
        taken = fit_patch(surface, patch, samples[i], place)
        count = flood(surface, samples[i], place, surface.patch_radius)
        x = y = z = 0.0
        for k in range(count):
            d = subtract(row(surface.mean, surface.queue[k]), place)
            x, y, z = x + d[0], y + d[1], z + d[2]
        aside = norm((x, y, z)) / (max(count, 1) * surface.patch_radius)
        found[i, 0] = _bend(patch)
        spread = SPREAD * (1.0 + ASIDE * aside * aside) * 1.25 * patch[17]
        found[i, 1] = spread / (surface.patch_radius * surface.patch_radius * math.sqrt(max(taken, 1)))
        if taken < 10:
            found[i, 1] = np.inf
