"""Triangles of a grid that cut each other: no right grid has any.

Two triangles may have in common the nodes that they share and the members between those; anything more counts, a touch
between others and a triangle folded onto its neighbour included. Search boxes give the pairs that lie near each other, floats
prove most of them apart (`kernels.mesh.crossings`), and the few that are left are decided here in exact fractions.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from ..errors import FrontError
from ..grid.certificate import place_of
from ..kernels.geometry.boxes import new_boxes
from ..kernels.mesh.crossings import doubtful_pairs

MOST_CROSSINGS = 100  # number of intersecting pairs after which the search stops
NEAR_A_TRIANGLE = 50  # pairs a triangle that are looked at: a right grid has hardly any
ROOM_FOR_PAIRS = 1024  # further pairs

Exact = tuple[Fraction, Fraction, Fraction]


def find_crossings(nodes: np.ndarray, triangles: np.ndarray, origin: np.ndarray | float = 0.0) -> np.ndarray:
    """Return pairs of triangles that have more in common than their shared nodes and members, (P, 2), at most `MOST_CROSSINGS`.

    Parameters
    ----------
    nodes : (V, 3) float64 [scan unit]
    triangles : (T, 3) int64
        Those that have a node twice have no inside, and do not count.
    origin : (3,) of the cloud, for messages [scan unit]

    Raises
    ------
    FrontError
        So many lie near each other that it cannot be told.
    """
    a, b, c = triangles.T
    whole = np.flatnonzero((a != b) & (b != c) & (c != a))
    found: list[tuple[int, int]] = []
    most = NEAR_A_TRIANGLE * len(whole) + ROOM_FOR_PAIRS
    pairs = whole[_doubtful(nodes, np.ascontiguousarray(triangles[whole]), most)]
    for t, u in pairs.tolist():
        if triangles_meet(nodes, triangles[t], triangles[u]):
            found.append((t, u))
            if len(found) == MOST_CROSSINGS:
                break
    if not found and len(pairs) == most:
        raise FrontError(
            "more triangles lie near each other than can be told apart; use a longer length",
            where=place_of(nodes[a[pairs[-1, 0]]] + origin),
        )
    return np.array(found, np.int64).reshape(-1, 2)


def _doubtful(nodes: np.ndarray, triangles: np.ndarray, most: int = ROOM_FOR_PAIRS) -> np.ndarray:
    """Return the pairs (P, 2) that are not proved to be apart, no more than `most` of them."""
    if len(triangles) == 0:
        return np.zeros((0, 2), np.int64)
    corners = nodes[triangles]
    lower, upper = corners.min(axis=1), corners.max(axis=1)
    middles = 0.5 * (lower + upper)
    radii = np.sqrt(((corners - middles[:, None]) ** 2).sum(axis=2).max(axis=1))
    widest = float(radii.max())
    box = 2.0 * widest if widest > 0.0 else 1.0
    boxes = new_boxes(lower.min(axis=0), upper.max(axis=0), box, len(triangles), len(triangles))
    pairs = np.empty((most, 2), np.int64)
    return pairs[: doubtful_pairs(nodes, triangles, middles, radii, widest, boxes, pairs)]


def triangles_meet(nodes: np.ndarray, first: Sequence[int], second: Sequence[int]) -> bool:
    """Whether two triangles have more in common than the nodes and the member that they share; exact for any floats.

    Parameters
    ----------
    nodes : (V, 3) float64
    first, second : three node ids each
    """
    one, other = [int(v) for v in first], [int(v) for v in second]
    places = {v: _exact(nodes[v]) for v in {*one, *other}}
    shared = [v for v in one if v in other]
    if len(shared) == 3:
        return True
    if len(shared) == 2:
        c, d = next(v for v in one if v not in shared), next(v for v in other if v not in shared)
        return _folded_flat(*(places[v] for v in (*shared, c, d)))
    triangle, opposite = [places[v] for v in one], [places[v] for v in other]
    if shared:  # whatever they have in common reaches from the shared node to a side that faces it
        side = [places[v] for v in one if v != shared[0]]
        facing = [places[v] for v in other if v != shared[0]]
        return _segment_meets(side, opposite) or _segment_meets(facing, triangle)
    sides = [(_sides(triangle), opposite), (_sides(opposite), triangle)]
    return any(_segment_meets(side, against) for some, against in sides for side in some)


def _exact(place: np.ndarray) -> Exact:
    x, y, z = (Fraction(float(c)) for c in place)
    return x, y, z


def _sides(triangle: list[Exact]) -> list[list[Exact]]:
    return [[triangle[k], triangle[(k + 1) % 3]] for k in range(3)]


def _from(start: Exact, end: Exact) -> Exact:
    return end[0] - start[0], end[1] - start[1], end[2] - start[2]


def _dot(a: Exact, b: Exact) -> Fraction:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: Exact, b: Exact) -> Exact:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _folded_flat(a: Exact, b: Exact, c: Exact, d: Exact) -> bool:
    """Whether the triangles abc and abd lie in one plane on the same side of ab; also where one of them is flat."""
    edge = _from(a, b)
    n, m = _cross(edge, _from(a, c)), _cross(edge, _from(a, d))
    return not any(_cross(n, m)) and _dot(n, m) >= 0


def _segment_meets(segment: Sequence[Exact], triangle: Sequence[Exact]) -> bool:
    """Whether a segment and a triangle with an inside have a place in common, ends and sides included."""
    p, q = segment
    a, b, c = triangle
    normal = _cross(_from(a, b), _from(a, c))
    above, below = _dot(normal, _from(a, p)), _dot(normal, _from(a, q))
    if not any(normal) or above * below > 0:
        return False
    if above == below:  # both zero: all in one plane
        return _inside(p, triangle, normal) or any(
            _segments_meet(p, q, start, end, normal) for start, end in ((a, b), (b, c), (c, a))
        )
    share, step = above / (above - below), _from(p, q)
    return _inside((p[0] + share * step[0], p[1] + share * step[1], p[2] + share * step[2]), triangle, normal)


def _turn(a: Exact, b: Exact, c: Exact, normal: Exact) -> Fraction:
    """Positive where abc turns left, seen from where the normal points to."""
    return _dot(normal, _cross(_from(a, b), _from(a, c)))


def _inside(p: Exact, triangle: Sequence[Exact], normal: Exact) -> bool:
    """Whether a place in the plane of a triangle lies in it, its sides included."""
    a, b, c = triangle
    return _turn(a, b, p, normal) >= 0 and _turn(b, c, p, normal) >= 0 and _turn(c, a, p, normal) >= 0


def _segments_meet(p: Exact, q: Exact, a: Exact, b: Exact, normal: Exact) -> bool:
    """Whether two segments in one plane have a place in common, ends included."""
    pa, pb, qa, qb = _turn(a, b, p, normal), _turn(a, b, q, normal), _turn(p, q, a, normal), _turn(p, q, b, normal)
    if pa == pb == qa == qb == 0:  # on one line
        step = _from(a, b) if a != b else _from(p, q)
        low, high = sorted((_dot(step, a), _dot(step, b)))
        first, last = sorted((_dot(step, p), _dot(step, q)))
        return first <= high and low <= last
    return pa * pb <= 0 and qa * qb <= 0
