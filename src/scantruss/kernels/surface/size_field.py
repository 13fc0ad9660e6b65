"""The length field: the desired member length at each sample of the scan, and between the samples."""

from __future__ import annotations

import math

import numpy as np

from ...runtime.jit import kernel
from ..geometry.boxes import SearchBoxes, put, search
from ..geometry.quadric import coefficients_of
from ..geometry.vectors import Vector, dot, norm, row, subtract
from .local_surface import SURFACE_PATCH, Surface, fit_patch, flood, walk

BLEND_REACH = 2.2  # distance up to which the lengths of samples count at a place [steps between samples]
CURVATURE_DEVIATION = 14.4  # standard deviation of a curvature inside the scan [that of a point / R^2 sqrt(points)]
DEVIATION_ASIDE = 14.0  # its relative growth with the squared distance of the mean of the points [patch radii]
RMS_OVER_MEAN = 1.25  # standard deviation of a normal distribution in its mean absolute deviation
BLENDED_LENGTHS = 12  # given lengths that count at a place; the next nearest shows how far away a length counts
SEARCH_GROWTHS = 90  # times that a search radius grows by half at most: from any box to all of them
REACH_SHRINKS, BLEND_REACH_GROWS = 0.7, 1.5  # a search begins with this share of the last reach, and grows by this
FEWEST_FOR_CURVATURE = 10  # fewest points of a patch whose curvature counts


@kernel
def length_at(surface: Surface, sample: int, place: Vector) -> float:
    """Desired length at a place near a sample [`length`]: a mean over the nearest sample and its neighbours, weighted by nearness."""
    sample = walk(surface, sample, place)
    reach = BLEND_REACH * surface.step
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
    """Fill in the desired lengths (P,) at places (P, 3), each near the one before it; the first may lie anywhere."""
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
    """Shorten lengths (S,) until they differ by at most `slope` times the distance over the links; returns the sweeps made.

    The result is the largest such field that nowhere exceeds the given one, whatever the order of the sweeps. Each sweep settles
    at least one more sample along each path, so there are no more sweeps than samples (Bellman and Ford).
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
    """Blend values given at some places (K, 3) into one for each sample (S,), weighted by the inverse square of the distance (Shepard).

    Only the nearest `BLENDED_LENGTHS` count, each weighing less as its distance approaches that of the next one, so that the blend
    has no steps (Franke and Little). boxes : empty, with room for K; reach : radius of the first search.
    """
    for n in range(len(given)):
        put(boxes, n, given[n, 0], given[n, 1], given[n, 2])
    found = np.empty(len(given), np.int64)
    near = np.empty(BLENDED_LENGTHS + 1)
    which = np.empty(BLENDED_LENGTHS + 1, np.int64)
    wanted = min(BLENDED_LENGTHS + 1, len(given))
    for s in range(len(places)):
        place = row(places, s)
        reach *= REACH_SHRINKS
        count = search(boxes, given, place[0], place[1], place[2], reach, found)
        for _ in range(SEARCH_GROWTHS):
            if count >= wanted:
                break
            reach *= BLEND_REACH_GROWS
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
        limit = near[BLENDED_LENGTHS] if kept > BLENDED_LENGTHS else np.inf
        total = mean = 0.0
        for i in range(min(kept, BLENDED_LENGTHS)):
            away = max(near[i], 1e-9 * reach)
            weight = (1.0 / away - 1.0 / limit) ** 2 if limit > away else 0.0
            total += weight
            mean += weight * values[which[i]]
        lengths[s] = mean / total if total > 0.0 else values[which[0]]


@kernel
def _largest_curvature(patch: np.record) -> float:
    """Absolute value of the larger principal curvature of a patch at its centre [1 / scan unit]."""
    _, p, q, uu, uv, vv = coefficients_of(patch.heights)
    grown = 1.0 + p * p + q * q
    root = math.sqrt(grown)
    e, f, g = 1.0 + p * p, p * q, 1.0 + q * q
    a, b, c = 2.0 * uu / root, uv / root, 2.0 * vv / root
    mean = 0.5 * (e * c - 2.0 * f * b + g * a) / grown
    gauss = (a * c - b * b) / grown
    return abs(mean) + math.sqrt(max(mean * mean - gauss, 0.0))


@kernel
def choose_apart(neighbors: np.ndarray, chosen: np.ndarray) -> int:
    """Mark a maximal set of samples, chosen (S,) bool, no two of which are linked; returns how many."""
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
def measure_curvatures(
    surface: Surface, samples: np.ndarray, curvatures: np.ndarray, deviations: np.ndarray, begin: int, end: int
) -> None:
    """Measure the larger principal curvature of the scan at some samples (P,), from `begin` to `end` - 1.

    curvatures, deviations : (P,), filled with its absolute value and with the standard deviation that noise gives it: that of the least
    squares fit, which grows where the scan lies to one side only [1 / scan unit]
    """
    patch = np.zeros(1, SURFACE_PATCH)
    for i in range(begin, end):
        place = row(surface.mean, samples[i])
        taken = fit_patch(surface, patch[0], samples[i], place)
        count = flood(surface, samples[i], place, surface.patch_radius)
        x = y = z = 0.0
        for k in range(count):
            d = subtract(row(surface.mean, surface.queue[k]), place)
            x, y, z = x + d[0], y + d[1], z + d[2]
        aside = norm((x, y, z)) / (max(count, 1) * surface.patch_radius)
        curvatures[i] = _largest_curvature(patch[0])
        spread = CURVATURE_DEVIATION * (1.0 + DEVIATION_ASIDE * aside * aside) * RMS_OVER_MEAN * patch[0].mean_distance
        deviations[i] = spread / (surface.patch_radius * surface.patch_radius * math.sqrt(max(taken, 1)))
        if taken < FEWEST_FOR_CURVATURE:
            deviations[i] = np.inf
