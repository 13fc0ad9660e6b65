"""Sites: the scan at the scale of a member.

A site stands for the points around it (greedy disc thinning in the order of the points, so that the result does not depend on
how the boxes lie). Sites know their neighbours on the same sheet of the surface, which makes every later look-up safe against
a second sheet nearby.
"""

from __future__ import annotations

import math

import numpy as np

from .boxes import SearchBoxes, box_index, put, search, slot_of
from .compile import kernel
from .vectors import Vector, dot, row, smallest_eigenvector, subtract, unit


@kernel
def thin_points(
    points: np.ndarray, radius: float, boxes: SearchBoxes, owner: np.ndarray, chosen: np.ndarray, begin: int, count: int
) -> tuple[int, int]:
    """Choose sites from points[begin:] so that every point has one within `radius`; sites keep that distance.

    Parameters
    ----------
    points : (N, 3) array
    boxes : SearchBoxes of the sites, boxes not smaller than `radius`
    owner : (N,) int64, filled with the site of each point
    chosen : (capacity,) int64, filled with the point of each site
    begin, count : where to go on, and the sites so far

    Returns
    -------
    begin, count : begin < N where the table of boxes is half full or `chosen` is full
    """
    used = 0
    for p in range(begin, len(points)):
        x, y, z = points[p, 0], points[p, 1], points[p, 2]
        home = -1  # of several sites within reach the earliest, however the boxes lie
        for i in range(box_index(boxes, 0, x - radius), box_index(boxes, 0, x + radius) + 1):
            for j in range(box_index(boxes, 1, y - radius), box_index(boxes, 1, y + radius) + 1):
                for k in range(box_index(boxes, 2, z - radius), box_index(boxes, 2, z + radius) + 1):
                    item = boxes.first[slot_of(boxes, i, j, k)]
                    while item >= 0:
                        if home < 0 or item < home:
                            q = chosen[item]
                            dx, dy, dz = points[q, 0] - x, points[q, 1] - y, points[q, 2] - z
                            if dx * dx + dy * dy + dz * dz < radius * radius:
                                home = item
                        item = boxes.next[item]
        if home < 0:
            if count == len(chosen) or 2 * (count + 1) > len(boxes.keys):
                return p, count
            home = count
            chosen[count] = p
            used += put(boxes, count, x, y, z)
            count += 1
        owner[p] = home
    return len(points), count


@kernel
def group_points(
    points: np.ndarray, owner: np.ndarray, start: np.ndarray, grouped: np.ndarray, index: np.ndarray, mean: np.ndarray
) -> None:
    """Sort the points by site (counting sort); start (S + 1,) must be zero, mean (S, 3) gets the mean of each site's points."""
    sites = len(start) - 1
    for p in range(len(points)):
        start[owner[p] + 1] += 1
    for s in range(sites):
        start[s + 1] += start[s]
    at = start.copy()
    for p in range(len(points)):
        s = owner[p]
        to = at[s]
        at[s] += 1
        index[to] = p
        for c in range(3):
            grouped[to, c] = points[p, c]
            mean[s, c] += points[p, c] - points[index[start[s]], c]
    for s in range(sites):
        n = start[s + 1] - start[s]
        for c in range(3):
            mean[s, c] = grouped[start[s], c] + mean[s, c] / max(n, 1)


@kernel
def nearest_sites(
    positions: np.ndarray, boxes: SearchBoxes, near: float, far: float, neighbors: np.ndarray, begin: int, end: int
) -> None:
    """The K nearest sites of each site from `begin` to `end` - 1, nearest first, -1 where there are fewer within `far`.

    The search starts with `near`. Where there are not even six, the scan is sparse: the search goes on to twice as far.
    """
    k = neighbors.shape[1]
    found = np.empty(4096, np.int64)
    distance = np.empty(k)
    for s in range(begin, end):
        x, y, z = row(positions, s)
        reach = near
        count = search(boxes, positions, x, y, z, reach, found)
        while (count < k + 1 and reach < far) or (count < 7 and reach < 2.0 * far):
            reach = min(1.5 * reach, far if reach < far else 2.0 * far)
            count = search(boxes, positions, x, y, z, reach, found)
        held = 0
        for c in range(count):
            other = found[c]
            if other == s:
                continue
            d = subtract(row(positions, other), (x, y, z))
            dd = dot(d, d)
            if held == k and (dd > distance[k - 1] or (dd == distance[k - 1] and other > neighbors[s, k - 1])):
                continue
            at = held if held < k else k - 1
            while at > 0 and (distance[at - 1] > dd or (distance[at - 1] == dd and neighbors[s, at - 1] > other)):
                distance[at] = distance[at - 1]
                neighbors[s, at] = neighbors[s, at - 1]
                at -= 1
            distance[at] = dd
            neighbors[s, at] = other
            held = min(held + 1, k)


@kernel
def link_back(positions: np.ndarray, neighbors: np.ndarray) -> None:
    """Let dense sites see the sparse ones that have them among their six nearest: the farthest neighbours make room.

    Otherwise a sparse part of the scan, linked one way only, would look like a gap from the dense part beside it.
    """
    k_most = neighbors.shape[1]
    taken = np.zeros(len(positions), np.int64)
    for t in range(len(positions)):
        for k in range(6):
            s = neighbors[t, k]
            if s < 0 or neighbors[s, k_most - 1] < 0 or taken[s] >= 3:
                continue
            d = subtract(row(positions, t), row(positions, s))
            e = subtract(row(positions, neighbors[s, 5]), row(positions, s))
            if dot(d, d) < 2.25 * dot(e, e):
                continue
            known = False
            for i in range(k_most):
                known = known or neighbors[s, i] == t
            if not known:
                neighbors[s, k_most - 1 - taken[s]] = t
                taken[s] += 1


@kernel
def _plane_at(mean: np.ndarray, neighbors: np.ndarray, s: int) -> tuple[Vector, float]:
    """Unit normal of the least-squares plane of a site and its neighbours, and their rms distance from it."""
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
    square = (
        v[0] * (xx * v[0] + 2.0 * (xy * v[1] + xz * v[2])) + v[1] * (yy * v[1] + 2.0 * yz * v[2]) + v[2] * zz * v[2]
    )
    return v, math.sqrt(max(square, 0.0) / count)


@kernel
def site_normals(mean: np.ndarray, neighbors: np.ndarray, normals: np.ndarray, thickness: np.ndarray) -> None:
    """Normal of the least-squares plane of each site and its neighbours, and their rms distance from it; sign not settled yet."""
    for s in range(len(mean)):
        v, thickness[s] = _plane_at(mean, neighbors, s)
        normals[s, 0], normals[s, 1], normals[s, 2] = v


@kernel
def distances_from_planes(points: np.ndarray, neighbors: np.ndarray, off: np.ndarray, thickness: np.ndarray) -> None:
    """Distance (N,) of each point from the plane of its neighbours, and theirs (rms), a quarter of them, the farthest off, left out.

    Both stay as they are where not all neighbours are there.
    """
    count = neighbors.shape[1]
    keep = count - count // 4
    aside = np.empty(count)
    for p in range(len(points)):
        if neighbors[p, count - 1] < 0:
            continue
        limit, cx, cy, cz, v, square = 1e300, 0.0, 0.0, 0.0, (0.0, 0.0, 1.0), 0.0
        for turn in range(2):
            taken, sx, sy, sz = 0, 0.0, 0.0, 0.0
            xx = xy = xz = yy = yz = zz = 0.0
            for k in range(count):
                if turn == 0 or aside[k] <= limit:
                    x, y, z = subtract(row(points, neighbors[p, k]), row(points, p))
                    taken, sx, sy, sz = taken + 1, sx + x, sy + y, sz + z
                    xx, xy, xz = xx + x * x, xy + x * y, xz + x * z
                    yy, yz, zz = yy + y * y, yz + y * z, zz + z * z
            cx, cy, cz = sx / taken, sy / taken, sz / taken
            xx, xy, xz = xx - taken * cx * cx, xy - taken * cx * cy, xz - taken * cx * cz
            yy, yz, zz = yy - taken * cy * cy, yz - taken * cy * cz, zz - taken * cz * cz
            v = smallest_eigenvector(xx, xy, xz, yy, yz, zz)
            square = 0.0
            for k in range(count):
                d = subtract(row(points, neighbors[p, k]), row(points, p))
                rise = abs(dot(subtract(d, (cx, cy, cz)), v))
                square += rise * rise if turn == 0 or aside[k] <= limit else 0.0
                if turn == 0:
                    aside[k] = rise
            if turn == 0:
                limit = np.sort(aside)[keep - 1]
            else:
                thickness[p] = math.sqrt(square / taken)
        off[p] = abs(dot((cx, cy, cz), v))


@kernel
def trust_thin_sites(
    mean: np.ndarray, normals: np.ndarray, neighbors: np.ndarray, thickness: np.ndarray, rough: float, steep: float
) -> None:
    """Drop the links of a thick site to thin ones over whose plane it stands, and fit its normal anew.

    At the rim of a sheet the nearest sites may be those of the next sheet; they tilt the plane of the one, not of the other.
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
def settle_sites(
    mean: np.ndarray, neighbors: np.ndarray, thickness: np.ndarray, rough: float, radius: float, settled: np.ndarray
) -> None:
    """Move each rough site (thickness over `rough`) to the plane of the sites linked to it within a wider radius.

    Noise, plants and doubled layers thicker than a site leave a cloud of sites instead of a sheet; this gives the sheet back.
    Sites far off the plane weigh less.
    """
    count = len(mean)
    stamp = np.full(count, -1, np.int64)
    queue = np.empty(count, np.int64)
    weight = np.empty(count)
    for s in range(count):
        place = row(mean, s)
        settled[s, 0], settled[s, 1], settled[s, 2] = place
        if thickness[s] <= rough:
            continue
        queue[0] = s
        stamp[s] = s
        found, at = 1, 0
        while at < found:
            q = queue[at]
            at += 1
            for k in range(neighbors.shape[1]):
                n = neighbors[q, k]
                if n >= 0 and stamp[n] != s:
                    stamp[n] = s
                    d = subtract(row(mean, n), place)
                    if dot(d, d) < radius * radius:
                        queue[found] = n
                        found += 1
        for i in range(found):
            d = subtract(row(mean, queue[i]), place)
            w = 1.0 - dot(d, d) / (radius * radius)
            weight[i] = w * w
        for turn in range(3):
            total = cx = cy = cz = 0.0
            for i in range(found):
                d = subtract(row(mean, queue[i]), place)
                w = weight[i]
                total, cx, cy, cz = total + w, cx + w * d[0], cy + w * d[1], cz + w * d[2]
            cx, cy, cz = cx / total, cy / total, cz / total
            xx = xy = xz = yy = yz = zz = 0.0
            for i in range(found):
                d = subtract(row(mean, queue[i]), place)
                w = weight[i]
                x, y, z = d[0] - cx, d[1] - cy, d[2] - cz
                xx, xy, xz = xx + w * x * x, xy + w * x * y, xz + w * x * z
                yy, yz, zz = yy + w * y * y, yz + w * y * z, zz + w * z * z
            v = smallest_eigenvector(xx, xy, xz, yy, yz, zz)
            off = cx * v[0] + cy * v[1] + cz * v[2]
            if turn < 2:
                spread = 0.0
                for i in range(found):
                    spread += weight[i] * abs(dot(subtract(row(mean, queue[i]), place), v) - off)
                spread = max(spread / total, 1e-300)
                for i in range(found):
                    d = subtract(row(mean, queue[i]), place)
                    w = 1.0 - dot(d, d) / (radius * radius)
                    r = (dot(d, v) - off) / (1.5 * spread)
                    weight[i] = w * w / (1.0 + r * r)
        for c in range(3):
            settled[s, c] = place[c] + off * v[c]


@kernel
def cut_steep_links(mean: np.ndarray, normals: np.ndarray, neighbors: np.ndarray, steep: float) -> None:
    """Drop neighbours that stand over a site rather than beside it: they lie on another sheet."""
    for s in range(len(mean)):
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
def link_weights(mean: np.ndarray, normals: np.ndarray, neighbors: np.ndarray, weights: np.ndarray) -> None:
    """How much the normals of neighbours disagree when one is mirrored to the other, 0 (agree) to 1; (S, K), 2 = no link.

    Mirroring at the plane half-way follows a sharply bent surface where plain comparison fails (Koenig and Gumhold 2009).
    """
    for s in range(len(mean)):
        for k in range(neighbors.shape[1]):
            n = neighbors[s, k]
            weights[s, k] = 2.0
            if n >= 0:
                e = unit(subtract(row(mean, n), row(mean, s)))
                a, b = row(normals, s), row(normals, n)
                weights[s, k] = 1.0 - abs(dot(a, b) - 2.0 * dot(e, a) * dot(e, b))


@kernel
def _root(piece: np.ndarray, sign: np.ndarray, s: int) -> tuple[int, int]:
    """Root of a site in the union, and its sign against that root; shortens the path."""
    total = 1
    while piece[s] != s:
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
    """Turn all normals of a connected piece to the same side, along the spanning tree of the most certain links.

    order : links as s * K + k, most certain first. piece : (S,) filled with the smallest site of each connected piece.
    """
    k_most = neighbors.shape[1]
    sign = np.ones(len(mean), np.int64)
    for s in range(len(mean)):
        piece[s] = s
    for i in range(len(order)):
        s, n = order[i] // k_most, neighbors[order[i] // k_most, order[i] % k_most]
        root_s, sign_s = _root(piece, sign, s)
        root_n, sign_n = _root(piece, sign, n)
        if root_s == root_n:
            continue
        e = unit(subtract(row(mean, n), row(mean, s)))
        a, b = row(normals, s), row(normals, n)
        agree = 1 if dot(a, b) - 2.0 * dot(e, a) * dot(e, b) >= 0.0 else -1
        if root_n < root_s:
            piece[root_s] = root_n
            sign[root_s] = sign_s * sign_n * agree
        else:
            piece[root_n] = root_s
            sign[root_n] = sign_s * sign_n * agree
    for s in range(len(mean)):  # parents have smaller numbers, so they are settled first
        if piece[s] != s:
            sign[s] *= sign[piece[s]]
            piece[s] = piece[piece[s]]
        for c in range(3):
            normals[s, c] *= sign[s]


@kernel
def smooth_normals(normals: np.ndarray, neighbors: np.ndarray, facing: float, smoothed: np.ndarray) -> None:
    """Mean normal of each site and of those neighbours whose normals have a cosine over `facing` with its own."""
    for s in range(len(normals)):
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
def put_all(boxes: SearchBoxes, points: np.ndarray, chosen: np.ndarray) -> None:
    """Put the chosen points into boxes, in their order."""
    for s in range(len(chosen)):
        put(boxes, s, points[chosen[s], 0], points[chosen[s], 1], points[chosen[s], 2])


@kernel
def head_on_links(
    mean: np.ndarray, normals: np.ndarray, neighbors: np.ndarray, thickness: np.ndarray, smooth: float
) -> int:
    """Number of links between sites thinner than `smooth` that lie side by side and yet face opposite sides."""
    count = 0
    for s in range(len(mean)):
        for k in range(neighbors.shape[1]):
            n = neighbors[s, k]
            if n < 0 or dot(row(normals, s), row(normals, n)) >= -0.9 or max(thickness[s], thickness[n]) >= smooth:
                continue
            d = subtract(row(mean, n), row(mean, s))
            rise = max(abs(dot(d, row(normals, s))), abs(dot(d, row(normals, n))))
            if rise < 0.3 * math.sqrt(max(dot(d, d), 1e-300)):
                count += 1
    return count
