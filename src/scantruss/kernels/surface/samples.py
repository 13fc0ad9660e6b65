"""Surface samples (surfels): the scan at the scale of a member.

A sample stands for the points around it. Samples are chosen by greedy disc thinning in the order of the points, so that the result does
not depend on the search boxes; then each point goes to its nearest sample. Samples are linked to their neighbours on the same sheet, so
that no later search strays to another sheet close by.
"""

from __future__ import annotations

import numpy as np

from ...runtime.jit import kernel
from ..geometry.boxes import SearchBoxes, box_index, put, search, slot_of
from ..geometry.vectors import Vector, dot, norm, row, smallest_eigenvector, subtract, unit

TIE_TOLERANCE = 1e-6  # relative difference below which two squared distances count as equal
SIDE_OF_GROOVE = 0.3  # cosine of the normals of two samples below which they may be the sides of a groove
LOOKS_ACROSS = 0.2  # cosine between a normal and the way to the other side above which a sample looks at it; share of it that is deeper
ONE_SIDE = 0.3  # cosine of the normals of two samples on one side of a groove
# cosine of the normals given with two points below which they lie on opposite sides of something thin
OPPOSITE_COSINE = -0.7
MOST_SAMPLES_AROUND = 4096  # most samples around a sample
SAMPLE_REACH_GROWS = 1.5  # by which the search for neighbours widens
ENOUGH_NEIGHBORS = 6  # neighbours with which a part of the scan is not sparse
MUCH_FARTHER = 2.25  # ratio of squared distances from which on one sample is much farther than another
OFF_SETTLED = 1.5  # distance from the plane of the samples around, in mean ones, at which one weighs half


@kernel
def may_share_sheet(facing: np.ndarray, p: int, q: int) -> bool:
    """Whether two points do not face opposite ways; facing (N, 3) normals given with the points, (0, 3) where none are."""
    return len(facing) == 0 or dot(row(facing, p), row(facing, q)) > OPPOSITE_COSINE


@kernel
def _sample_within(
    boxes: SearchBoxes,
    places: np.ndarray,
    i: int,
    j: int,
    k: int,
    place: Vector,
    square: float,
    facing: np.ndarray,
    chosen: np.ndarray,
    p: int,
) -> int:
    """A sample of a search box that point p may belong to, its squared distance from the place below `square`; -1 if there is none."""
    item = boxes.first[slot_of(boxes, i, j, k)]
    while item >= 0:
        d = subtract(row(places, item), place)
        if dot(d, d) < square and may_share_sheet(facing, p, chosen[item]):
            return item
        item = boxes.next[item]
    return -1


@kernel
def choose_samples(
    points: np.ndarray,
    radius: float,
    boxes: SearchBoxes,
    owner: np.ndarray,
    chosen: np.ndarray,
    places: np.ndarray,
    begin: int,
    count: int,
    facing: np.ndarray,
) -> tuple[int, int]:
    """Choose samples from points[begin:] so that every point has one within `radius` and no two are nearer to each other.

    Points that face opposite ways have no sample in common.

    Parameters
    ----------
    points : (N, 3) array
    boxes : SearchBoxes of the samples, about as large as `radius`
    owner : (N,) int64, filled with a sample within the radius of each point
    chosen, places : (capacity,) int64 and (capacity, 3), filled with the point of each sample and its position
    begin, count : the point to go on from, and the number of samples so far
    facing : (N, 3) normals given with the points, (0, 3) where none are

    Returns
    -------
    begin, count : begin < N if the table of boxes is half full or `chosen` is full
    """
    square = radius * radius
    for p in range(begin, len(points)):
        x, y, z = points[p, 0], points[p, 1], points[p, 2]
        a, b, c = box_index(boxes, 0, x), box_index(boxes, 1, y), box_index(boxes, 2, z)
        place = (x, y, z)
        home = _sample_within(
            boxes, places, a, b, c, place, square, facing, chosen, p
        )  # most find one in their own box
        if home < 0:
            i0, i1 = box_index(boxes, 0, x - radius), box_index(boxes, 0, x + radius)
            j0, j1 = box_index(boxes, 1, y - radius), box_index(boxes, 1, y + radius)
            k0, k1 = box_index(boxes, 2, z - radius), box_index(boxes, 2, z + radius)
            for i in range(i0, i1 + 1):
                for j in range(j0, j1 + 1):
                    for k in range(k0, k1 + 1):
                        if home < 0 and (i != a or j != b or k != c):
                            home = _sample_within(boxes, places, i, j, k, place, square, facing, chosen, p)
        if home < 0:
            if count == len(chosen) or 2 * (count + 1) > len(boxes.keys):
                return p, count
            home = count
            chosen[count] = p
            places[count, 0], places[count, 1], places[count, 2] = x, y, z
            put(boxes, count, x, y, z)
            count += 1
        owner[p] = home
    return len(points), count


@kernel
def settle_points(
    points: np.ndarray,
    places: np.ndarray,
    neighbors: np.ndarray,
    owner: np.ndarray,
    facing: np.ndarray,
    chosen: np.ndarray,
    begin: int,
    end: int,
) -> None:
    """Give each point from `begin` to `end` - 1 to its nearest sample, by going from its owner (N,) over the links to nearer ones.

    Of samples equally near but for rounding, of which regular points have many, the first is taken: the result depends neither on the
    owner at the start nor on the position of the scan.
    """
    for p in range(begin, end):
        place, sample = row(points, p), owner[p]
        d = subtract(row(places, sample), place)
        least = dot(d, d)
        while True:  # each turn leads to a nearer sample, so to none twice
            to, first, nearly = sample, sample, least * (1.0 + TIE_TOLERANCE)
            for k in range(neighbors.shape[1]):
                n = neighbors[sample, k]
                if n < 0:
                    break
                d = subtract(row(places, n), place)
                dd = dot(d, d)
                if dd <= nearly and not may_share_sheet(facing, p, chosen[n]):
                    continue
                if dd <= nearly:
                    first = min(first, n)
                if dd < least:
                    least, to = dd, n
            if to == sample:
                owner[p] = first
                break
            sample = to


@kernel
def group_points(
    points: np.ndarray, owner: np.ndarray, start: np.ndarray, grouped: np.ndarray, mean: np.ndarray
) -> None:
    """Sort the points by sample (counting sort), and fill mean (S, 3) with the mean of each sample's points; start (S + 1,) is zero."""
    samples = len(start) - 1
    for p in range(len(points)):
        start[owner[p] + 1] += 1
    for s in range(samples):
        start[s + 1] += start[s]
    at = start.copy()
    for p in range(len(points)):
        to = at[owner[p]]
        at[owner[p]] += 1
        grouped[to, 0], grouped[to, 1], grouped[to, 2] = row(points, p)
    for s in range(samples):
        first = row(grouped, start[s])
        x = y = z = 0.0
        for i in range(start[s] + 1, start[s + 1]):
            d = subtract(row(grouped, i), first)
            x, y, z = x + d[0], y + d[1], z + d[2]
        n = max(start[s + 1] - start[s], 1)
        mean[s, 0], mean[s, 1], mean[s, 2] = first[0] + x / n, first[1] + y / n, first[2] + z / n


@kernel
def _alike(count: int, found: np.ndarray, facing: np.ndarray, s: int) -> int:
    """Keep those of the first `count` samples found that do not face away from sample s; returns how many."""
    if len(facing) == 0:
        return count
    held = 0
    for c in range(count):
        if may_share_sheet(facing, s, found[c]):
            found[held] = found[c]
            held += 1
    return held


@kernel
def nearest_samples(
    positions: np.ndarray,
    boxes: SearchBoxes,
    near: float,
    far: float,
    neighbors: np.ndarray,
    facing: np.ndarray,
    begin: int,
    end: int,
) -> None:
    """Find the K nearest samples of each sample from `begin` to `end` - 1, nearest first, -1 where there are fewer within `far`.

    The search starts with radius `near`. Where it finds fewer than six the scan is sparse, and it goes on to twice `far`. Samples that
    face opposite ways are no neighbours; facing (S, 3) normals given with the scan, (0, 3) where none are.
    """
    k = neighbors.shape[1]
    found = np.empty(MOST_SAMPLES_AROUND, np.int64)
    distance = np.empty(k)
    for s in range(begin, end):
        x, y, z = row(positions, s)
        reach = near
        count = _alike(search(boxes, positions, x, y, z, reach, found), found, facing, s)
        most = max(k, ENOUGH_NEIGHBORS)
        while count <= most and reach < (far if count > ENOUGH_NEIGHBORS else 2.0 * far):  # the reach, never 0, grows
            reach = min(SAMPLE_REACH_GROWS * reach, far if reach < far else 2.0 * far)
            count = _alike(search(boxes, positions, x, y, z, reach, found), found, facing, s)
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
def cut_across_grooves(positions: np.ndarray, neighbors: np.ndarray, facing: np.ndarray) -> None:
    """Cut the links across a groove, or a gap between two walls, above its bottom; facing (S, 3) normals given with the scan.

    Two samples look at each other across it, and one of them is linked to a third that lies deeper and looks across it too. At the
    bottom of a valley there is none.
    """
    k_most = neighbors.shape[1]
    cut = np.zeros(neighbors.shape, np.bool_)
    for s in range(len(positions)):
        for k in range(k_most):
            t = neighbors[s, k]
            if t < 0:
                break
            a, b, d = row(facing, s), row(facing, t), subtract(row(positions, t), row(positions, s))
            far = norm(d)
            if dot(a, b) < SIDE_OF_GROOVE and dot(d, a) > LOOKS_ACROSS * far and dot(d, b) < -LOOKS_ACROSS * far:
                up = unit((a[0] + b[0], a[1] + b[1], a[2] + b[2]))
                cut[s, k] = _goes_deeper(positions, neighbors, facing, s, t, up, far) or _goes_deeper(
                    positions, neighbors, facing, t, s, up, far
                )
    for s in range(len(positions)):
        held = 0
        for k in range(k_most):
            if neighbors[s, k] >= 0 and not cut[s, k]:
                neighbors[s, held] = neighbors[s, k]
                held += 1
        neighbors[s, held:] = -1


@kernel
def _goes_deeper(
    positions: np.ndarray, neighbors: np.ndarray, facing: np.ndarray, s: int, t: int, up: Vector, far: float
) -> bool:
    """Whether the side of a groove at sample s, which looks at t, goes on deeper."""
    for k in range(neighbors.shape[1]):
        n = neighbors[s, k]
        if n < 0:
            break
        down = -dot(subtract(row(positions, n), row(positions, s)), up)
        if (
            down > LOOKS_ACROSS * far
            and dot(row(facing, n), row(facing, s)) > ONE_SIDE
            and dot(row(facing, n), row(facing, t)) < 0.0
        ):
            return True
    return False


@kernel
def link_back(positions: np.ndarray, neighbors: np.ndarray) -> None:
    """Link samples back to much farther ones that have them among their six nearest, in place of their farthest neighbours.

    Otherwise a sparse part of the scan, linked one way only, would look like a gap from the dense part beside it.
    """
    k_most = neighbors.shape[1]
    taken = np.zeros(len(positions), np.int64)
    for t in range(len(positions)):
        for k in range(ENOUGH_NEIGHBORS):
            s = neighbors[t, k]
            if s < 0 or neighbors[s, k_most - 1] < 0 or taken[s] >= 3:
                continue
            d = subtract(row(positions, t), row(positions, s))
            e = subtract(row(positions, neighbors[s, ENOUGH_NEIGHBORS - 1]), row(positions, s))
            if dot(d, d) < MUCH_FARTHER * dot(e, e):
                continue
            known = False
            for i in range(k_most):
                known = known or neighbors[s, i] == t
            if not known:
                neighbors[s, k_most - 1 - taken[s]] = t
                taken[s] += 1


@kernel
def settle_samples(
    mean: np.ndarray, neighbors: np.ndarray, thickness: np.ndarray, rough: float, radius: float, settled: np.ndarray
) -> None:
    """Move each rough sample (thickness above `rough`) onto the plane of the samples linked to it within a radius.

    Noise, plants and doubled layers thicker than a sample leave a cloud of samples; this turns it back into a sheet. Samples far off
    the plane weigh less.
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
                    r = (dot(d, v) - off) / (OFF_SETTLED * spread)
                    weight[i] = w * w / (1.0 + r * r)
        for c in range(3):
            settled[s, c] = place[c] + off * v[c]


@kernel
def put_all(boxes: SearchBoxes, points: np.ndarray, chosen: np.ndarray) -> None:
    """Put the chosen points into boxes, in their order."""
    for s in range(len(chosen)):
        put(boxes, s, points[chosen[s], 0], points[chosen[s], 1], points[chosen[s], 2])
