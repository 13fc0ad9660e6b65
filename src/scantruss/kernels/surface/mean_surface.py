"""The mean surface of a rough scan: moving least squares over balls, in which points far off the fit weigh less (Fleishman et al. 2005)."""

from __future__ import annotations

import math

import numpy as np

from ...runtime.jit import kernel
from ..geometry.boxes import SearchBoxes, search
from ..geometry.quadric import (
    FIT_POINT,
    TERMS_OF_PLANE,
    TERMS_OF_QUADRIC,
    fit_heights,
    project,
    second_moments,
)
from ..geometry.vectors import Vector, across, along, dot, norm, put_vector, row, smallest_eigenvector, subtract

POINTS_OF_FIT = 4096  # more than fill a ball of 8 spacings
FIT_TURNS = 4  # fits, each with the weights that follow from the one before
KNOWN_TURNS = 3  # fits that turn the plane, too
OFF_THE_FIT = 1.5  # distance from the fit, in mean ones, at which a point weighs half
# distance of the centre of the points from the middle of the ball, in radii, from which on a plane is fitted
PLANE_FROM_ASIDE = 0.2
FEWEST_FOR_QUADRIC, FEWEST_FOR_PLANE = 12, 6  # fewest points to which a quadric, or a plane, is fitted


@kernel
def move_to_mean(
    places: np.ndarray,
    points: np.ndarray,
    boxes: SearchBoxes,
    radius: float,
    terms: int,
    begin: int,
    end: int,
) -> None:
    """Move each place from `begin` to `end` - 1 to the surface fitted to the points within a radius of it, along its normal.

    Parameters
    ----------
    places : (Q, 3), moved
    points : (N, 3), by box
    terms : most terms of the surface; at the boundary, where the points lie to one side, it is a plane
    """
    found, buffer, weights = (
        np.empty(POINTS_OF_FIT, np.int64),
        np.empty(POINTS_OF_FIT, FIT_POINT),
        np.empty(POINTS_OF_FIT),
    )
    heights, matrix = np.zeros(TERMS_OF_QUADRIC), np.empty((TERMS_OF_QUADRIC, TERMS_OF_QUADRIC + 1))
    for q in range(begin, end):
        place = row(places, q)
        taken = search(boxes, points, place[0], place[1], place[2], radius, found)
        for i in range(taken):
            d = subtract(row(points, found[i]), place)
            w = 1.0 - dot(d, d) / (radius * radius)
            put_vector(buffer[i].place, d)
            buffer[i].weight = weights[i] = w * w
        normal = (0.0, 0.0, 1.0)
        for turn in range(FIT_TURNS):
            if turn < KNOWN_TURNS:
                normal = smallest_eigenvector(*second_moments(buffer, taken))
            size = min(_terms(buffer, taken, radius, normal), terms)
            project(buffer, taken, radius, normal, across(normal))
            fit_heights(buffer, taken, radius, size, heights, matrix)
            _weigh_again(buffer, taken, weights)
        height = min(max(heights[0], -radius), radius)
        places[q, 0], places[q, 1], places[q, 2] = along(place, height, normal)


@kernel
def _terms(buffer: np.ndarray, taken: int, radius: float, normal: Vector) -> int:
    """How many terms of a quadric the points determine well: those of a plane where they lie to one side of the middle."""
    total = x = y = z = 0.0
    for i in range(taken):
        w = buffer[i].weight
        d = buffer[i].place
        total, x, y, z = total + w, x + w * d[0], y + w * d[1], z + w * d[2]
    total = max(total, 1e-300)
    centre = (x / total, y / total, z / total)
    aside = norm(along(centre, -dot(centre, normal), normal))
    if taken >= FEWEST_FOR_QUADRIC and aside < PLANE_FROM_ASIDE * radius:
        return TERMS_OF_QUADRIC
    return TERMS_OF_PLANE if taken >= FEWEST_FOR_PLANE else 1


@kernel
def _weigh_again(buffer: np.ndarray, taken: int, weights: np.ndarray) -> None:
    """Give points less weight the farther they lie off the fit."""
    off = total = 0.0
    for i in range(taken):
        off, total = off + weights[i] * abs(buffer[i].residual), total + weights[i]
    off = max(OFF_THE_FIT * off / max(total, 1e-300), 1e-300)
    for i in range(taken):
        r = buffer[i].residual / off
        buffer[i].weight = weights[i] / (1.0 + r * r)


@kernel
def mean_offsets(
    nodes: np.ndarray,
    normals: np.ndarray,
    points: np.ndarray,
    boxes: SearchBoxes,
    radius: np.ndarray,
    bias: np.ndarray,
    scatter: np.ndarray,
    begin: int,
    end: int,
) -> None:
    """Fill in how far outside of each node the surface of the points around it lies (V,), and their rms distance from that (V,).

    It is the quadric over the tangent plane of the node fitted to the points within its radius (V,) by least squares: no point
    weighs less for being far off. NaN where they do not determine a plane.
    """
    buffer, found = np.empty(POINTS_OF_FIT, FIT_POINT), np.empty(POINTS_OF_FIT, np.int64)
    heights, matrix = np.zeros(TERMS_OF_QUADRIC), np.empty((TERMS_OF_QUADRIC, TERMS_OF_QUADRIC + 1))
    for v in range(begin, end):
        place, normal = row(nodes, v), row(normals, v)
        taken = search(boxes, points, place[0], place[1], place[2], radius[v], found)
        for i in range(taken):
            d = subtract(row(points, found[i]), place)
            put_vector(buffer[i].place, d)
            w = 1.0 - dot(d, d) / (radius[v] * radius[v])
            buffer[i].weight = w * w
        size = _terms(buffer, taken, radius[v], normal)
        bias[v] = scatter[v] = math.nan
        if size == 1:
            continue
        project(buffer, taken, radius[v], normal, across(normal))
        fit_heights(buffer, taken, radius[v], size, heights, matrix)
        off = total = 0.0
        for i in range(taken):
            off += buffer[i].weight * buffer[i].residual * buffer[i].residual
            total += buffer[i].weight
        bias[v], scatter[v] = heights[0], math.sqrt(off / max(total, 1e-300))
