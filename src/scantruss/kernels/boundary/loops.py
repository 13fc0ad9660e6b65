"""Boundary points and ordered boundary loops of a point cloud (Sec. 3.3).

A disc is rolled along the edge of the samples in their tangent planes: it touches boundary samples one after the other, which gives
ordered loops directly. Gaps narrower than the disc do not let it in. Then a disc is slid from outside against the points at each
place of a loop: what it touches are the boundary points.
"""

from __future__ import annotations

import math

import numpy as np

from ...runtime.jit import kernel
from ..geometry.vectors import Vector, across, along, cross, dot, row, subtract, unit
from ..surface.local_surface import Surface, flood, walk

DISC_DIRECTIONS = 64  # directions around a point that points near it cover or leave free
SWEEP_BINS = 240  # directions around a point into which the turn of the rolling disc is divided
SAME_SHEET_COSINE = 0.2  # samples whose normals have a smaller cosine are another sheet, or a plant


@kernel
def _polar(place: Vector, normal: Vector, u: Vector, v: Vector, other: Vector, noise: float) -> tuple[float, float]:
    """Direction of another place in the tangent plane, and its distance as if the surface were unrolled into the plane.

    Heights above the plane below `noise` do not count: a rough scan is taken as a sheet.
    """
    d = subtract(other, place)
    a, b = dot(d, u), dot(d, v)
    h = max(abs(dot(d, normal)) - noise, 0.0)
    return math.atan2(b, a), math.sqrt(a * a + b * b + h * h)


@kernel
def has_gap(surface: Surface, s: int, u: Vector, v: Vector, widest: float, ahead: np.ndarray) -> bool:
    """Whether the directions to the neighbours of a sample leave a gap wider than `widest` [rad]; False if there are none.

    widest : less than a right angle. ahead (K, 3) is scratch: the directions in their order around the sample, each with a number that
    grows as its angle does.
    """
    place, count = row(surface.mean, s), 0
    for k in range(surface.neighbors.shape[1]):
        n = surface.neighbors[s, k]
        if n >= 0:
            d = subtract(row(surface.mean, n), place)
            a, b = dot(d, u), dot(d, v)
            if a == 0.0 and b == 0.0:
                continue
            turn = a / (abs(a) + abs(b))
            turn = 1.0 - turn if b >= 0.0 else 3.0 + turn
            at = count
            while at > 0 and ahead[at - 1, 2] > turn:
                for c in range(3):
                    ahead[at, c] = ahead[at - 1, c]
                at -= 1
            ahead[at, 0], ahead[at, 1], ahead[at, 2] = a, b, turn
            count += 1
    if count == 0 or ahead[count - 1, 2] - ahead[0, 2] < 2.0:  # all on one side
        return count > 0
    limit = math.cos(widest)
    for k in range(count):
        a, b = ahead[k, 0], ahead[k, 1]
        c, d = ahead[(k + 1) % count, 0], ahead[(k + 1) % count, 1]
        along_it = a * c + b * d
        if (
            along_it <= 0.0
            or a * d - b * c < 0.0
            or along_it * along_it < limit * limit * (a * a + b * b) * (c * c + d * d)
        ):
            return True
    return False


@kernel
def _block(
    surface: Surface,
    other: int,
    place: Vector,
    normal: Vector,
    u: Vector,
    v: Vector,
    noise: float,
    reach: float,
    blocked: np.ndarray,
) -> int:
    """Mark the directions in which a disc `reach` wide that touches a place would hold another sample; how many are new."""
    if dot(row(surface.normals, other), normal) < SAME_SHEET_COSINE:
        return 0
    angle, distance = _polar(place, normal, u, v, row(surface.mean, other), noise)
    new = 0
    if 0.0 < distance < reach:
        half = math.acos(distance / reach)
        low = int(math.ceil((angle - half) * DISC_DIRECTIONS / (2.0 * math.pi)))
        high = int(math.floor((angle + half) * DISC_DIRECTIONS / (2.0 * math.pi)))
        for b in range(low, high + 1):
            new += not blocked[b % DISC_DIRECTIONS]
            blocked[b % DISC_DIRECTIONS] = True
    return new


@kernel
def free_directions(surface: Surface, radii: np.ndarray, widest: float, free: np.ndarray, begin: int, end: int) -> None:
    """For each sample from `begin` to `end` - 1, a direction in which a disc that touches it would be empty, or 9 if there is none.

    Samples whose neighbours leave no gap wider than `widest` [rad] are inside and not looked at further. The direction (S,) is
    the middle of the widest free range, counted from `across(normal)`, less than a turn.
    """
    blocked = np.zeros(DISC_DIRECTIONS, np.bool_)
    ahead = np.empty((surface.neighbors.shape[1], 3))
    noise = 0.2 * surface.length
    for s in range(begin, end):
        free[s] = 9.0
        normal, place = row(surface.normals, s), row(surface.mean, s)
        u = across(normal)
        v = cross(normal, u)
        if not has_gap(surface, s, u, v, widest, ahead):
            continue
        blocked[:] = False
        reach, left = 2.0 * radii[s], DISC_DIRECTIONS
        for k in range(surface.neighbors.shape[1]):  # these rule out most samples that are inside
            n = surface.neighbors[s, k]
            if n < 0 or left == 0:
                break
            d = subtract(row(surface.mean, n), place)
            if dot(d, d) <= reach * reach:
                left -= _block(surface, n, place, normal, u, v, noise, reach, blocked)
        if left == 0:
            continue
        for i in range(1, flood(surface, s, place, reach)):
            _block(surface, surface.queue[i], place, normal, u, v, noise, reach, blocked)
        best, run = 0, 0
        for b in range(2 * DISC_DIRECTIONS):
            run = 0 if blocked[b % DISC_DIRECTIONS] else run + 1
            if run > best and run <= DISC_DIRECTIONS:
                best = run
                free[s] = (b - 0.5 * (run - 1)) % DISC_DIRECTIONS * 2.0 * math.pi / DISC_DIRECTIONS


@kernel
def sample_disc(surface: Surface, sample: int, direction: float, radius: float) -> Vector:
    """Centre of the disc that touches a sample from its free direction."""
    normal = row(surface.normals, sample)
    u = across(normal)
    place = along(row(surface.mean, sample), radius * math.cos(direction), u)
    return along(place, radius * math.sin(direction), cross(normal, u))


@kernel
def _nearest_clear(cover: np.ndarray) -> int:
    """Direction nearest to 0 that nothing covers, at most 75 degrees off; SWEEP_BINS if there is none.

    cover : (SWEEP_BINS + 1,) changes of the number of arcs at each direction; becomes their number.
    """
    for b in range(1, SWEEP_BINS):
        cover[b] += cover[b - 1]
    for b in range(SWEEP_BINS * 5 // 24):
        if cover[b] == 0:
            return b
        if cover[SWEEP_BINS - 1 - b] == 0:
            return -1 - b
    return SWEEP_BINS


@kernel
def roll_disc(
    surface: Surface,
    sample: int,
    centre: Vector,
    radii: np.ndarray,
    path: np.ndarray,
    seen: np.ndarray,
    visit: np.ndarray,
    banned: np.ndarray,
) -> tuple[int, int, int]:
    """Roll an empty disc along the boundary from a sample that it touches, the surface to its left.

    Parameters
    ----------
    radii : (S,) radius of the disc at each sample
    path : (M,) int64, filled with the touched samples
    seen : (S,) int64, for each sample the sample that followed it on an earlier loop, -1: none
    visit : (S,) int64 scratch, index in `path` of the last visit
    banned : (S,) bool, samples that the disc does not feel

    Returns
    -------
    first, last : path[first:last] is the loop; first = last where the disc fell off, came to an earlier loop or path is too short
    steps : how many samples the disc has touched
    """
    path[0] = sample
    count, came_from = 1, -1
    noise = 0.2 * surface.length
    step = 2.0 * math.pi / SWEEP_BINS
    cover, touches = np.empty(SWEEP_BINS + 1, np.int64), np.empty(len(surface.queue))
    while count < len(path):
        normal, place, radius = row(surface.normals, sample), row(surface.mean, sample), radii[sample]
        u = across(normal)
        v = cross(normal, u)
        d = subtract(centre, place)
        phi = math.atan2(dot(d, v), dot(d, u))
        cover[:] = 0
        near = 0  # samples that a disc which touches this one may touch too
        for i in range(1, flood(surface, sample, place, 2.0 * radius)):
            s = surface.queue[i]
            if dot(row(surface.normals, s), normal) < SAME_SHEET_COSINE or banned[s]:
                continue
            angle, distance = _polar(place, normal, u, v, row(surface.mean, s), noise)
            if distance < 2.0 * radius:
                half = math.acos(distance / (2.0 * radius))
                begin = min(int((angle - half - phi) % (2.0 * math.pi) / step), SWEEP_BINS - 1)  # -1e-17 % 2 pi is 2 pi
                end = min(int((angle + half - phi) % (2.0 * math.pi) / step), SWEEP_BINS - 1) + 1
                cover[begin] += 1
                cover[end] -= 1
                if end <= begin:
                    cover[0] += 1
                surface.queue[near], touches[near] = s, angle - half
                near += 1
        clear = _nearest_clear(cover)
        phi += (clear + 0.5) * step if clear < SWEEP_BINS else 0.0
        slack = 0.0 if clear < SWEEP_BINS else 0.35
        least, to, to_angle = 1e300, -1, 0.0
        for i in range(near):
            turn = (touches[i] - phi) % (2.0 * math.pi)
            if turn > 2.0 * math.pi - slack and surface.queue[i] != came_from:
                turn -= 2.0 * math.pi
            if turn < least:
                least, to, to_angle = turn, surface.queue[i], touches[i]
        if to < 0:
            return 0, 0, count
        centre = along(along(place, radius * math.cos(to_angle), u), radius * math.sin(to_angle), v)
        if seen[sample] == to:
            return 0, 0, count
        i = visit[sample]
        if 0 <= i < count - 1 and path[i] == sample and path[i + 1] == to:
            return i, count - 1, count
        visit[sample] = count - 1
        came_from = sample
        sample = to
        path[count] = sample
        count += 1
    return 0, 0, count


@kernel
def come_nearer(surface: Surface, places: np.ndarray, samples: np.ndarray) -> None:
    """Replace the sample near each place (M,) by the nearest one."""
    for m in range(len(places)):
        samples[m] = walk(surface, samples[m], row(places, m))


@kernel
def touch_points(
    surface: Surface,
    places: np.ndarray,
    ahead: np.ndarray,
    samples: np.ndarray,
    radii: np.ndarray,
    touched: np.ndarray,
    begin: int,
    end: int,
) -> None:
    """Slide a disc from outside against the points at each place of a loop from `begin` to `end` - 1.

    Parameters
    ----------
    places, ahead : (M, 3) places along the loop and the direction of the loop there, the surface to its left
    samples : (M,) sample near each place
    radii : (M,) of the disc at each place
    touched : (M, 3) filled with the point that the disc touches first
    """
    noise = 0.35 * surface.length
    for m in range(begin, end):
        sample, place, radius = samples[m], row(places, m), radii[m]
        normal = row(surface.normals, sample)
        out = unit(cross(row(ahead, m), normal))
        side = cross(normal, out)
        touched[m, 0], touched[m, 1], touched[m, 2] = place
        best = -1e300
        count = flood(surface, sample, row(surface.mean, sample), radius + 2.0 * surface.radius)
        for i in range(count):
            s = surface.queue[i]
            if dot(row(surface.normals, s), normal) < SAME_SHEET_COSINE:
                continue
            for p in range(surface.start[s], surface.start[s + 1]):
                d = subtract(row(surface.points, p), place)
                y, h = dot(d, side), dot(d, normal)
                if abs(y) < radius and abs(h) < noise:
                    x = dot(d, out)
                    t = x + math.sqrt(radius * radius - y * y)
                    if t > best + 1e-9 * radius:  # the first of equals, whatever the rounding
                        best = t
                        touched[m, 0], touched[m, 1], touched[m, 2] = row(surface.points, p)
