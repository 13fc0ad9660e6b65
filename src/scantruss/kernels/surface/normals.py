"""Normals of the samples: those of planes through their neighbours, all oriented to one side of the sheet."""

from __future__ import annotations

import math

import numpy as np

from ...runtime.jit import kernel
from ..geometry.boxes import SearchBoxes, search
from ..geometry.vectors import Vector, along, dot, norm, row, smallest_eigenvector, spread_along, subtract, unit

ASIDE_OF_EDGE = 0.25  # least distance of the middle of what is around a sharp edge from it [reach]
NEITHER_SIDE_WITHIN = 0.35  # samples nearer than this show neither side of the edge [reach]
LEAST_OPENING = 0.4  # share of the distance between both sides that must grow with that from the edge, at least
NARROWEST_EDGE, WIDEST_EDGE = 0.1, 1.0  # tangent of half the angle between both sides, at least and at most
# rms distance of the samples from both sides, at most, in their mean distance from the plane between
MOST_SCATTER = 0.5
FEWEST_BEHIND = 6  # fewest samples that show the two sides
MOST_AROUND_EDGE = 1024  # most samples that are looked at around an edge
EACH_SIDE = 0.2  # share of the samples that must lie on each side of an edge
NO_LINK, WORST_LINK = 255, 254.0  # what stands for no link, and for one whose normals disagree most
# cosine of normals that face opposite ways; sine of the way between samples side by side
OPPOSITE_WAYS, SIDE_BY_SIDE = -0.9, 0.3


@kernel
def _plane_at(mean: np.ndarray, neighbors: np.ndarray, s: int) -> tuple[Vector, float]:
    """Unit normal of the least-squares plane of a sample and its neighbours, and their rms distance from it."""
    cx = cy = cz = 0.0
    count = 1
    o = row(mean, s)
    for k in range(neighbors.shape[1]):
        n = neighbors[s, k]
        if n >= 0:
            d = subtract(row(mean, n), o)
            cx, cy, cz = cx + d[0], cy + d[1], cz + d[2]
            count += 1
    cx, cy, cz = cx / count, cy / count, cz / count
    xx, xy, xz, yy, yz, zz = cx * cx, cx * cy, cx * cz, cy * cy, cy * cz, cz * cz
    for k in range(neighbors.shape[1]):
        n = neighbors[s, k]
        if n >= 0:
            d = subtract(row(mean, n), o)
            dx, dy, dz = d[0] - cx, d[1] - cy, d[2] - cz
            xx, xy, xz = xx + dx * dx, xy + dx * dy, xz + dx * dz
            yy, yz, zz = yy + dy * dy, yz + dy * dz, zz + dz * dz
    v = smallest_eigenvector(xx, xy, xz, yy, yz, zz)
    return v, math.sqrt(max(spread_along(v, xx, xy, xz, yy, yz, zz), 0.0) / count)


@kernel
def sample_normals(
    mean: np.ndarray, neighbors: np.ndarray, normals: np.ndarray, thickness: np.ndarray, begin: int, end: int
) -> None:
    """Fit planes to each sample from `begin` to `end` - 1 and its neighbours: normals (S, 3), not yet oriented, and rms distances (S,)."""
    for s in range(begin, end):
        v, thickness[s] = _plane_at(mean, neighbors, s)
        normals[s, 0], normals[s, 1], normals[s, 2] = v


@kernel
def trust_thin_samples(
    mean: np.ndarray, normals: np.ndarray, neighbors: np.ndarray, thickness: np.ndarray, rough: float, steep: float
) -> None:
    """Drop the links from a thick sample to thin ones that it stands above, and fit its normal again.

    At the boundary of a sheet, the nearest samples may lie on the next sheet: they tilt the plane there, but not their own.
    """
    for s in range(len(mean)):
        if thickness[s] <= rough:
            continue
        held, count = 0, 0
        for k in range(neighbors.shape[1]):
            n = neighbors[s, k]
            if n < 0:
                break
            count += 1
            if thickness[n] > rough or abs(dot(unit(subtract(row(mean, n), row(mean, s))), row(normals, n))) <= steep:
                neighbors[s, held] = n
                held += 1
        for k in range(held, count):
            neighbors[s, k] = -1
        if held < count:
            v, thickness[s] = _plane_at(mean, neighbors, s)
            normals[s, 0], normals[s, 1], normals[s, 2] = v


@kernel
def face_off_edges_of(
    mean: np.ndarray, normals: np.ndarray, boxes: SearchBoxes, thick: np.ndarray, reach: float, begin: int, end: int
) -> None:
    """Let samples on a sharp edge of a body face away from it: some of `thick` (P,), from `begin` to `end` - 1.

    Where two sides meet at less than a right angle, a plane through the samples around lies between both and faces neither. There
    the samples lie to one side of the edge, near two planes that part from it: away from a plane through the edge, with t the distance
    from it, by |h| = a + b t.

    reach : distance within which samples are looked at
    """
    found = np.empty(MOST_AROUND_EDGE, np.int64)
    for i in range(begin, end):
        place = row(mean, thick[i])
        count = search(boxes, mean, place[0], place[1], place[2], reach, found)
        inwards = (0.0, 0.0, 0.0)
        for k in range(count):
            inwards = along(inwards, 1.0 / count, subtract(row(mean, found[k]), place))
        if norm(inwards) < ASIDE_OF_EDGE * reach:
            continue
        inwards = unit(inwards)
        xx = xy = xz = yy = yz = zz = 0.0
        for k in range(count):
            x, y, z = across_to(subtract(row(mean, found[k]), place), inwards)
            xx, xy, xz, yy, yz, zz = xx + x * x, xy + x * y, xz + x * z, yy + y * y, yz + y * z, zz + z * z
        # the edge runs along the widest spread across `inwards`; the smallest but the one along `inwards` is the way between both sides
        large = xx + yy + zz
        a, b, c = inwards
        between = smallest_eigenvector(
            xx + large * a * a,
            xy + large * a * b,
            xz + large * a * c,
            yy + large * b * b,
            yz + large * b * c,
            zz + large * c * c,
        )
        n = above = 0
        st = sh = stt = sth = shh = 0.0
        for k in range(count):
            d = subtract(row(mean, found[k]), place)
            t, h = dot(d, inwards), dot(d, between)
            if t > NEITHER_SIDE_WITHIN * reach:
                n, above = n + 1, above + (h > 0.0)
                h = abs(h)
                st, sh, stt, sth, shh = st + t, sh + h, stt + t * t, sth + t * h, shh + h * h
        if n < FEWEST_BEHIND or not EACH_SIDE * n < above < (1.0 - EACH_SIDE) * n:
            continue
        spread = stt - st * st / n
        slope = (sth - st * sh / n) / spread if spread > 0.0 else 0.0
        off = math.sqrt(max(shh - sh * sh / n - slope * slope * spread, 0.0) / n)
        if NARROWEST_EDGE < slope < WIDEST_EDGE and slope * st > LEAST_OPENING * sh and off * n < MOST_SCATTER * sh:
            normals[thick[i], 0], normals[thick[i], 1], normals[thick[i], 2] = -a, -b, -c


@kernel
def across_to(d: Vector, way: Vector) -> Vector:
    """The part of a vector at right angles to a unit vector."""
    return along(d, -dot(d, way), way)


@kernel
def cut_steep_links_of(
    mean: np.ndarray, normals: np.ndarray, neighbors: np.ndarray, steep: float, begin: int, end: int
) -> None:
    """Drop neighbours that lie above or below a sample from `begin` to `end` - 1, not beside it: they are on another sheet."""
    for s in range(begin, end):
        held = 0
        for k in range(neighbors.shape[1]):
            n = neighbors[s, k]
            if n < 0:
                break
            e = unit(subtract(row(mean, n), row(mean, s)))
            if abs(dot(e, row(normals, s))) <= steep or abs(dot(e, row(normals, n))) <= steep:
                neighbors[s, held] = n
                held += 1
        for k in range(held, neighbors.shape[1]):
            neighbors[s, k] = -1


@kernel
def _mirrored(mean: np.ndarray, normals: np.ndarray, s: int, n: int) -> float:
    """Absolute cosine between the normal of sample n and that of sample s mirrored in the plane half-way between them.

    It follows a sharply bent surface where a plain comparison fails (Koenig and Gumhold 2009).
    """
    e = unit(subtract(row(mean, n), row(mean, s)))
    a, b = row(normals, s), row(normals, n)
    return abs(dot(a, b) - 2.0 * dot(e, a) * dot(e, b))


@kernel
def mark_uneven(
    mean: np.ndarray, normals: np.ndarray, neighbors: np.ndarray, least: float, uneven: np.ndarray, begin: int, end: int
) -> None:
    """Mark the samples from `begin` to `end` - 1, uneven (S,) bool, with a link along which the scan is not an arc.

    Along it the normals, one mirrored to the other, have a cosine below `least`.
    """
    for s in range(begin, end):
        uneven[s] = False
        for k in range(neighbors.shape[1]):
            n = neighbors[s, k]
            if n < 0:
                break
            if _mirrored(mean, normals, s, n) < least:
                uneven[s] = True
                break


@kernel
def link_weights(
    mean: np.ndarray, normals: np.ndarray, neighbors: np.ndarray, weights: np.ndarray, begin: int, end: int
) -> None:
    """Fill in how much the normals of neighbours disagree after mirroring: 254 sqrt(1 - |cosine|), (S, K) uint8; 255 for no link.

    In steps of a third of a degree: equally certain links are then taken in their order, so that memory is read in order too.
    """
    for s in range(begin, end):
        for k in range(neighbors.shape[1]):
            n = neighbors[s, k]
            weights[s, k] = NO_LINK
            if n >= 0:
                weights[s, k] = int(WORST_LINK * math.sqrt(max(1.0 - _mirrored(mean, normals, s, n), 0.0)))


@kernel
def _root(piece: np.ndarray, sign: np.ndarray, s: int) -> tuple[int, int]:
    """Root of a sample in the union-find tree, and its sign relative to that root; shortens the path."""
    total = 1
    while piece[s] != s:  # numbers fall along the way
        parent = piece[s]
        if piece[parent] != parent:
            sign[s] *= sign[parent]
            piece[s] = piece[parent]
        total *= sign[s]
        s = piece[s]
    return s, total


@kernel
def orient_normals(
    mean: np.ndarray, normals: np.ndarray, neighbors: np.ndarray, order: np.ndarray, piece: np.ndarray
) -> None:
    """Orient the normals of each connected piece to one side, along the spanning tree of the most certain links.

    order : links as s * K + k, most certain first. piece : (S,) int64, filled with the lowest sample of each connected piece.
    """
    k_most = neighbors.shape[1]
    sign, joined = np.ones(len(mean), np.int64), 1
    for s in range(len(mean)):
        piece[s] = s
    for i in range(len(order)):
        if joined == len(mean):
            break
        s = order[i] // k_most
        n = neighbors[s, order[i] - s * k_most]
        root_s, sign_s = _root(piece, sign, s)
        root_n, sign_n = _root(piece, sign, n)
        if root_s == root_n:
            continue
        joined += 1
        e = unit(subtract(row(mean, n), row(mean, s)))
        a, b = row(normals, s), row(normals, n)
        agree = 1 if dot(a, b) - 2.0 * dot(e, a) * dot(e, b) >= 0.0 else -1
        if root_n < root_s:
            piece[root_s] = root_n
            sign[root_s] = sign_s * sign_n * agree
        else:
            piece[root_n] = root_s
            sign[root_n] = sign_s * sign_n * agree
    for s in range(len(mean)):  # parents have lower numbers, so they are done first
        if piece[s] != s:
            sign[s] *= sign[piece[s]]
            piece[s] = piece[piece[s]]
        for c in range(3):
            normals[s, c] *= sign[s]


@kernel
def smooth_normals(
    normals: np.ndarray, neighbors: np.ndarray, facing: float, smoothed: np.ndarray, begin: int, end: int
) -> None:
    """Average the normal of each sample from `begin` to `end` - 1 with those of neighbours whose cosine to it exceeds `facing`."""
    for s in range(begin, end):
        a = row(normals, s)
        x, y, z = 2.0 * a[0], 2.0 * a[1], 2.0 * a[2]
        for k in range(neighbors.shape[1]):
            n = neighbors[s, k]
            if n >= 0:
                b = row(normals, n)
                if dot(a, b) > facing:
                    x, y, z = x + b[0], y + b[1], z + b[2]
        smoothed[s, 0], smoothed[s, 1], smoothed[s, 2] = unit((x, y, z))


@kernel
def head_on_links(
    mean: np.ndarray, normals: np.ndarray, neighbors: np.ndarray, thickness: np.ndarray, smooth: float
) -> int:
    """Count the links between samples thinner than `smooth` that lie side by side but face opposite ways."""
    count = 0
    for s in range(len(mean)):
        for k in range(neighbors.shape[1]):
            n = neighbors[s, k]
            if (
                n < 0
                or dot(row(normals, s), row(normals, n)) >= OPPOSITE_WAYS
                or max(thickness[s], thickness[n]) >= smooth
            ):
                continue
            d = subtract(row(mean, n), row(mean, s))
            rise = max(abs(dot(d, row(normals, s))), abs(dot(d, row(normals, n))))
            if rise < SIDE_BY_SIDE * math.sqrt(max(dot(d, d), 1e-300)):
                count += 1
    return count
