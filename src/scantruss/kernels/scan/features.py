"""Features: how the surface bends around a place, in numbers that do not change when the scan is rotated or moved."""

from __future__ import annotations

import math

import numpy as np

from ...runtime.jit import kernel
from ..geometry.boxes import SearchBoxes, search
from ..geometry.vectors import cross, dot, row, subtract

MOST_AROUND_POINT = 4096  # most points around a point
EVERY_PAIR = 7  # of the pairs around a point, every so many is a sample
INNER_REACH = 0.6  # share of the reach within which the first half of a histogram counts
OWN_WEIGHT = 0.1  # added to a distance in reaches, so that the histogram of a point itself weighs ten
NO_ANGLE = 1e-9  # sine of the angle between the normal and the line of a pair below which it has no angles


@kernel
def _values(points: np.ndarray, normals: np.ndarray, p: int, q: int) -> tuple[float, float, float, float]:
    """Distance of two points, and the three angles between their normals and the line (Rusu, Blodow and Beetz 2009)."""
    d = subtract(row(points, q), row(points, p))
    length = math.sqrt(dot(d, d))
    if length == 0.0:
        return 0.0, 0.0, 0.0, 0.0
    d = (d[0] / length, d[1] / length, d[2] / length)
    u, m = row(normals, p), row(normals, q)
    v = cross(d, u)
    size = math.sqrt(dot(v, v))
    if size < NO_ANGLE:
        return 0.0, 0.0, 0.0, 0.0
    v = (v[0] / size, v[1] / size, v[2] / size)
    w = cross(u, v)
    return length, dot(v, m), dot(u, d), math.atan2(dot(w, m), dot(u, m))


@kernel
def sample_values(
    points: np.ndarray, normals: np.ndarray, boxes: SearchBoxes, reach: float, every: int, values: np.ndarray
) -> int:
    """Fill values (M, 3) with the angles of pairs around every `every`-th point; returns how many rows."""
    found = np.empty(MOST_AROUND_POINT, np.int64)
    count = 0
    for p in range(0, len(points), every):
        many = search(boxes, points, points[p, 0], points[p, 1], points[p, 2], reach, found)
        for i in range(0, many, EVERY_PAIR):
            length, a, b, c = _values(points, normals, p, found[i])
            if length > 0.0 and count < len(values):
                values[count, 0], values[count, 1], values[count, 2] = a, b, c
                count += 1
    return count


@kernel
def _bin(edges: np.ndarray, kind: int, value: float) -> int:
    """Bin of a value among the edges (3, B - 1)."""
    low, high = 0, edges.shape[1]
    while low < high:  # each turn halves what is left
        middle = (low + high) // 2
        if value < edges[kind, middle]:
            high = middle
        else:
            low = middle + 1
    return low


@kernel
def point_histograms(
    points: np.ndarray,
    normals: np.ndarray,
    boxes: SearchBoxes,
    reach: float,
    edges: np.ndarray,
    histograms: np.ndarray,
    begin: int,
    end: int,
) -> None:
    """Shares of the angles around each point from `begin` to `end` - 1, (N, 2 * 3 * B): in the inner half of the reach, and beyond."""
    found = np.empty(MOST_AROUND_POINT, np.int64)
    bins = edges.shape[1] + 1
    for p in range(begin, end):
        many = search(boxes, points, points[p, 0], points[p, 1], points[p, 2], reach, found)
        inner = outer = 0
        for i in range(many):
            length, a, b, c = _values(points, normals, p, found[i])
            if length == 0.0:
                continue
            at = 0 if length < INNER_REACH * reach else 3 * bins
            inner += 1 if at == 0 else 0
            outer += 1 if at > 0 else 0
            histograms[p, at + _bin(edges, 0, a)] += 1.0
            histograms[p, at + bins + _bin(edges, 1, b)] += 1.0
            histograms[p, at + 2 * bins + _bin(edges, 2, c)] += 1.0
        for i in range(3 * bins):
            histograms[p, i] /= max(inner, 1)
            histograms[p, 3 * bins + i] /= max(outer, 1)


@kernel
def mix_histograms(
    points: np.ndarray,
    boxes: SearchBoxes,
    reach: float,
    histograms: np.ndarray,
    mixed: np.ndarray,
    begin: int,
    end: int,
) -> None:
    """Mean of the histograms around each point from `begin` to `end` - 1, weighted towards the nearer ones, its own most."""
    found = np.empty(MOST_AROUND_POINT, np.int64)
    for p in range(begin, end):
        many = search(boxes, points, points[p, 0], points[p, 1], points[p, 2], reach, found)
        total = 0.0
        for i in range(many):
            q = found[i]
            d = subtract(row(points, q), row(points, p))
            weight = 1.0 / (OWN_WEIGHT + math.sqrt(dot(d, d)) / reach)
            total += weight
            for j in range(histograms.shape[1]):
                mixed[p, j] += weight * histograms[q, j]
        for j in range(histograms.shape[1]):
            mixed[p, j] /= max(total, 1e-300)
