"""The girth of a limb at each sample: how far it is round a section across its axis."""

from __future__ import annotations

import math

import numpy as np

from ...runtime.jit import kernel
from ..geometry.boxes import SearchBoxes, box_index, slot_of
from ..geometry.vectors import across, cross, dot, norm, row, smallest_eigenvector, subtract
from .local_surface import Surface, flood

# in which the width of a section is measured: the girth of its convex hull is pi mean widths (Cauchy)
DIRECTIONS_OF_WIDTH = 12
FACING_OPPOSITE = -0.3  # cosine between the normals of two samples below which they lie on opposite sides of a limb
MOST_MEAN_NORMAL = 0.6  # largest mean normal of a section that is closed; half a pipe has 0.64, a strip 1
# mean cosine between normals and arms from the middle of a section below which it is a hole, no limb
INWARD_COSINE = -0.3
SAME_LIMB = 0.6  # least cosine between the axes of sections of a limb beside each other
TURNS_OF_AXIS = 3  # times that the axis of a limb is turned until it stands across the section


@kernel
def measure_girths(
    surface: Surface,
    which: np.ndarray,
    most: float,
    half: float,
    girth: np.ndarray,
    axis: np.ndarray,
    begin: int,
    end: int,
) -> None:
    """Fill in the girth (S,) and axis (S, 3) of the limb at each sample of `which` (K,) from `begin` to `end` - 1.

    Infinity where there is none, and less than 0 where it faces inwards, as a hole does.

    A section holds the samples within `half` of the plane through a sample across the axis, to which normals are as perpendicular as
    they can be. It counts if it is closed, and its links reach no farther than half the largest girth.

    Parameters
    ----------
    most, half : float
        Largest girth that matters, and half the thickness of a section [desired lengths there]
    """
    section = np.empty(len(surface.mean), np.int64)
    for i in range(begin, end):
        s = which[i]
        girth[s] = math.inf
        length = surface.length * surface.field[s]
        place, normal = row(surface.mean, s), row(surface.normals, s)
        count = flood(surface, s, place, most / 3.0 * length)
        opposite = False
        xx = xy = xz = yy = yz = zz = 0.0
        for k in range(count):
            n = row(surface.normals, surface.queue[k])
            opposite = opposite or dot(n, normal) < FACING_OPPOSITE
            xx, xy, xz = xx + n[0] * n[0], xy + n[0] * n[1], xz + n[0] * n[2]
            yy, yz, zz = yy + n[1] * n[1], yz + n[1] * n[2], zz + n[2] * n[2]
        if not opposite:
            continue
        a = smallest_eigenvector(xx, xy, xz, yy, yz, zz)
        axis[s, 0], axis[s, 1], axis[s, 2] = a
        count = _flood_section(surface, s, a, half * length, 0.5 * most * length, section)
        if count > 0:
            girth[s] = _girth_of(surface, section, count, a)


@kernel
def follow_girths(
    surface: Surface, which: np.ndarray, most: np.ndarray, half: float, girth: np.ndarray, axis: np.ndarray
) -> None:
    """Fill in the girth (S,) at each sample of `which` (K,) whose axis (S, 3) is about that of the limb beside it, and turn the axis.

    Infinity where its section is open, faces inwards or is larger than `most` (K,) [desired lengths there].
    """
    section = np.empty(len(surface.mean), np.int64)
    for i in range(len(which)):
        s = which[i]
        girth[s] = math.inf
        length = surface.length * surface.field[s]
        a = before = row(axis, s)
        count = _flood_section(surface, s, a, half * length, 0.5 * most[i] * length, section)
        for _ in range(TURNS_OF_AXIS):
            xx = xy = xz = yy = yz = zz = 0.0
            for k in range(count):
                n = row(surface.normals, section[k])
                xx, xy, xz = xx + n[0] * n[0], xy + n[0] * n[1], xz + n[0] * n[2]
                yy, yz, zz = yy + n[1] * n[1], yz + n[1] * n[2], zz + n[2] * n[2]
            if count > 0:
                a = smallest_eigenvector(xx, xy, xz, yy, yz, zz)
                count = _flood_section(surface, s, a, half * length, 0.5 * most[i] * length, section)
        if count == 0 or abs(dot(a, before)) < SAME_LIMB:
            continue
        found = _girth_of(surface, section, count, a)
        if 0.0 < found <= most[i] * length:
            girth[s] = found
            axis[s, 0], axis[s, 1], axis[s, 2] = a


@kernel
def _flood_section(
    surface: Surface, sample: int, a: tuple[float, float, float], half: float, reach: float, section: np.ndarray
) -> int:
    """List the samples that links join to a sample near the plane through it across `a`; 0 if they reach farther than `reach`."""
    surface.counter[0] += 1
    mark = surface.counter[0]
    place = row(surface.mean, sample)
    section[0], surface.stamp[sample] = sample, mark
    count, at = 1, 0
    while at < count:  # each sample is listed once
        s = section[at]
        at += 1
        for k in range(surface.neighbors.shape[1]):
            n = surface.neighbors[s, k]
            if n < 0:
                break
            if surface.stamp[n] != mark:
                surface.stamp[n] = mark
                d = subtract(row(surface.mean, n), place)
                if abs(dot(d, a)) <= half:
                    if dot(d, d) > reach * reach:
                        return 0
                    section[count] = n
                    count += 1
    return count


@kernel
def _girth_of(surface: Surface, section: np.ndarray, count: int, a: tuple[float, float, float]) -> float:
    """Girth of the convex hull of a section; infinity where it is open, less than 0 where it faces inwards, as a hole."""
    u = across(a)
    v = cross(a, u)
    x = y = nx = ny = 0.0
    for i in range(count):
        p, n = row(surface.mean, section[i]), row(surface.normals, section[i])
        x, y = x + dot(p, u) / count, y + dot(p, v) / count
        nx, ny = nx + dot(n, u) / count, ny + dot(n, v) / count
    outward = 0.0
    for i in range(count):
        p, n = row(surface.mean, section[i]), row(surface.normals, section[i])
        arm, face = (dot(p, u) - x, dot(p, v) - y, 0.0), (dot(n, u), dot(n, v), 0.0)
        outward += dot(arm, face) / max(norm(arm) * norm(face), 1e-300) / count
    if nx * nx + ny * ny > MOST_MEAN_NORMAL * MOST_MEAN_NORMAL:
        return math.inf
    total = 0.0
    for k in range(DIRECTIONS_OF_WIDTH):
        turn = math.pi * k / DIRECTIONS_OF_WIDTH
        c, d = math.cos(turn), math.sin(turn)
        low, high = math.inf, -math.inf
        for i in range(count):
            p = row(surface.mean, section[i])
            t = c * dot(p, u) + d * dot(p, v)
            low, high = min(low, t), max(high, t)
        total += high - low
    return math.copysign(math.pi * total / DIRECTIONS_OF_WIDTH, outward - INWARD_COSINE)


@kernel
def mark_opposite(surface: Surface, boxes: SearchBoxes, reach: float, marks: np.ndarray, begin: int, end: int) -> None:
    """Mark (S,) the samples from `begin` to `end` - 1 with another within reach [desired lengths] that faces the opposite way."""
    for s in range(begin, end):
        marks[s] = _faces_another(surface, boxes, s, reach * surface.length * surface.field[s])


@kernel
def _faces_another(surface: Surface, boxes: SearchBoxes, s: int, far: float) -> bool:
    """Whether another sample within a distance [scan unit] of one faces the opposite way."""
    place, normal = row(surface.mean, s), row(surface.normals, s)
    for i in range(box_index(boxes, 0, place[0] - far), box_index(boxes, 0, place[0] + far) + 1):
        for j in range(box_index(boxes, 1, place[1] - far), box_index(boxes, 1, place[1] + far) + 1):
            for k in range(box_index(boxes, 2, place[2] - far), box_index(boxes, 2, place[2] + far) + 1):
                t = boxes.first[slot_of(boxes, i, j, k)]
                while t >= 0:
                    d = subtract(row(surface.mean, t), place)
                    if dot(row(surface.normals, t), normal) < FACING_OPPOSITE and dot(d, d) <= far * far:
                        return True
                    t = boxes.next[t]
    return False
