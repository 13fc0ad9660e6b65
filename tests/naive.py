"""Slow, obvious twins of the kernels, in plain numpy."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from functools import cache

import numpy as np
from numpy.typing import ArrayLike


def within(positions: ArrayLike, place: ArrayLike, reach: float) -> list[int]:
    """Ids of the positions within `reach` of a place, sorted."""
    return np.flatnonzero(((np.asarray(positions) - place) ** 2).sum(axis=1) <= reach * reach).tolist()


def thin(points: np.ndarray, radius: float) -> list[int]:
    """Points that become samples: each that has no earlier sample nearer than `radius`."""
    chosen: list[int] = []
    for p, place in enumerate(points):
        if not chosen or ((points[chosen] - place) ** 2).sum(axis=1).min() >= radius * radius:
            chosen.append(p)
    return chosen


def nearest(positions: np.ndarray, sample: int, count: int, far: float) -> list[int]:
    """Ids of the `count` positions nearest to one of them within `far`, nearest first, without itself."""
    distance = np.linalg.norm(positions - positions[sample], axis=1)
    order = np.lexsort((np.arange(len(positions)), distance))
    return [int(s) for s in order if s != sample and distance[s] <= far][:count]


def plane_normal(points: np.ndarray) -> np.ndarray:
    """Normal of the least-squares plane, of either sign."""
    return np.linalg.eigh(np.cov(points.T))[1][:, 0]


def reachable(neighbors: np.ndarray, mean: np.ndarray, sample: int, place: np.ndarray, reach: float) -> set[int]:
    """Samples linked to one sample over samples within `reach` of a place; the first one counts wherever it is."""
    inside = np.linalg.norm(mean - place, axis=1) <= reach
    found, waiting = {sample}, [sample]
    while waiting:
        for n in neighbors[waiting.pop()]:
            if n >= 0 and inside[n] and n not in found:
                found.add(int(n))
                waiting.append(int(n))
    return found


def shape_quality(a: ArrayLike, b: ArrayLike, c: ArrayLike) -> float:
    """Eq. 5: 4 sqrt(3) area / (sum of squared sides), the area after Heron."""
    x, y, z = (float(np.linalg.norm(np.subtract(*ends))) for ends in ((b, a), (c, b), (a, c)))
    half = (x + y + z) / 2
    area = max(half * (half - x) * (half - y) * (half - z), 0.0) ** 0.5
    return 4 * 3**0.5 * area / (x * x + y * y + z * z)


def size_quality(length: float, l1: float, l2: float) -> float:
    """Eq. 6."""
    return min(l1 / length, length / l1) * min(l2 / length, length / l2)


def cross_inside(a: ArrayLike, b: ArrayLike, c: ArrayLike, d: ArrayLike) -> bool:
    """Whether two segments in the plane meet at a place inside both: where the lines through them meet."""
    a, b, c, d = (np.asarray(p, float) for p in (a, b, c, d))
    matrix = np.stack([b - a, c - d], axis=1)
    if abs(np.linalg.det(matrix)) < 1e-12:
        return False
    s, t = np.linalg.solve(matrix, c - a)
    return bool(0 < s < 1 and 0 < t < 1)


def distance_to_segment(p: ArrayLike, a: ArrayLike, b: ArrayLike) -> float:
    """Least distance of a place from very many places of a segment."""
    t = np.linspace(0, 1, 20001)[:, None]
    return float(np.linalg.norm(np.asarray(a) + t * np.subtract(b, a) - np.asarray(p), axis=1).min())


def optimal_point(
    points: np.ndarray, a: ArrayLike, b: ArrayLike, normal: ArrayLike, length: float, w1: float, extent: float
) -> int:
    """Sec. 3.4 (1): the point that makes the best triangle on ab among those in the search region; -1: none."""
    a, b, normal = np.asarray(a, float), np.asarray(b, float), np.asarray(normal, float)
    l0 = float(np.linalg.norm(b - a))
    r = np.sqrt(3) / 2 * (w1 * length + (1 - w1) * l0)
    best, chosen = -1.0, -1
    for i, p in enumerate(points):
        share = np.clip(np.dot(p - a, b - a) / l0**2, 0, 1)
        d1 = abs(np.dot(p - (a + b) / 2, (b - a) / l0))
        d2 = np.linalg.norm(p - a - share * (b - a))
        if d1 <= extent and abs(d2 - r) <= extent and np.dot(np.cross(b - a, p - a), normal) > 0:
            delta = shape_quality(a, b, p) + size_quality(
                l0, float(np.linalg.norm(p - a)), float(np.linalg.norm(p - b))
            )
            if delta > best:
                best, chosen = delta, i
    return chosen


def triangulations(count: int) -> tuple[tuple[tuple[int, int, int], ...], ...]:
    """Yield every way of dividing a polygon of `count` corners into triangles, as tuples of corners."""

    @cache
    def between(i: int, j: int) -> tuple[tuple[tuple[int, int, int], ...], ...]:
        if j - i < 2:
            return ((),)
        return tuple(
            (*left, *right, (i, k, j)) for k in range(i + 1, j) for left in between(i, k) for right in between(k, j)
        )

    return between(0, count - 1)


def directed_edges(triangles: ArrayLike) -> Counter[tuple[int, int]]:
    """How often each directed edge occurs."""
    return Counter((int(t[k]), int(t[(k + 1) % 3])) for t in np.asarray(triangles) for k in range(3))


def faults(triangles: ArrayLike) -> list[str]:
    """What is wrong with a net of triangles: an empty list for a manifold one whose triangles face the same way.

    Twice the same directed edge means either three triangles at an edge or two that face opposite sides; a node with
    two separate fans is pinched.
    """
    found = [f"edge {e} is used {n} times in one direction" for e, n in directed_edges(triangles).items() if n > 1]
    opposite: dict[int, list[tuple[int, int]]] = {}
    for t in np.asarray(triangles).tolist():
        if len(set(t)) < 3:
            found.append(f"triangle {t} has a node twice")
        for k in range(3):
            opposite.setdefault(t[k], []).append((t[(k + 1) % 3], t[(k + 2) % 3]))
    for node, sides in opposite.items():
        if len(groups(sides)) > 1:
            found.append(f"node {node} is pinched")
    return found


def groups(pairs: Iterable[tuple[int, int]]) -> list[set[int]]:
    """Sets of what is joined by pairs."""
    sets: list[set[int]] = []
    for pair in pairs:
        joined = set(pair).union(*(s for s in sets if s & set(pair)))
        sets = [s for s in sets if not s & set(pair)] + [joined]
    return sets


def topology(triangles: np.ndarray) -> tuple[int, int, int]:
    """Components, boundary loops and Euler number of a manifold net, counted one by one."""
    edges = directed_edges(triangles)
    open_edges = [e for e in edges if (e[1], e[0]) not in edges]
    whole = {tuple(sorted(e)) for e in edges}
    nodes = {n for e in edges for n in e}
    return len(groups(edges)), len(groups(open_edges)), len(nodes) - len(whole) + len(triangles)


def means_by_box(points: np.ndarray, spacing: float) -> np.ndarray:
    """Mean of the points in each cube of a lattice through zero, in the order of the numbers of the cubes."""
    boxes: dict[tuple[int, ...], list[np.ndarray]] = {}
    for point in points:
        if np.isfinite(point).all():
            boxes.setdefault(tuple(np.floor(point / spacing).astype(int)), []).append(point)
    return np.array([np.mean(np.array(boxes[box]) - boxes[box][0], axis=0) + boxes[box][0] for box in sorted(boxes)])
