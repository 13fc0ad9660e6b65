"""Single triangles among quads are led to each other, or to the boundary, so that all panels become quads."""

from __future__ import annotations

import heapq

import numpy as np

from ..kernels.cells.quads import FREE_NODE, SLIDING_NODE
from .collapse import LatticeMesh
from .pairing import squareness

THROUGH_LINE = 6.0  # what a line in the way costs, which gets a node more, against a quad
AT_BOUNDARY = 8.0  # what the end at the boundary costs, which gets a node more


class Panels:
    """Polygons of three and four nodes, and which lies to the left of each of their edges."""

    def __init__(self, mesh: LatticeMesh, quads: np.ndarray, singles: np.ndarray) -> None:
        self.nodes = mesh.nodes.tolist()
        self.held = mesh.held.tolist()
        self.chains = {tuple(sorted(pair)) for pair in mesh.chains.tolist()}
        self.corners: list[list[int]] = quads.tolist() + singles.tolist()
        self.left: dict[tuple[int, int], int] = {}
        for p, corners in enumerate(self.corners):
            self._enter(p, corners)

    def _enter(self, p: int, corners: list[int]) -> None:
        self.corners[p] = corners
        for a, b in zip(corners, corners[1:] + corners[:1], strict=True):
            self.left[a, b] = p

    def _leave(self, p: int) -> None:
        corners = self.corners[p]
        for a, b in zip(corners, corners[1:] + corners[:1], strict=True):
            del self.left[a, b]

    def _split(self, a: int, b: int) -> int:
        """Put a node on an edge; returns it. The panels beside it must be entered again."""
        middle = len(self.nodes)
        self.nodes.append([(x + y) / 2 for x, y in zip(self.nodes[a], self.nodes[b], strict=True)])
        key = (min(a, b), max(a, b))
        on_chain = key in self.chains
        self.held.append(SLIDING_NODE if on_chain else FREE_NODE)
        if on_chain:
            self.chains.remove(key)
            self.chains |= {(min(a, middle), max(a, middle)), (min(b, middle), max(b, middle))}
        return middle

    def lead_all(self) -> None:
        """Lead every single triangle to another or to the boundary."""
        for p in range(len(self.corners)):
            if len(self.corners[p]) == 3:
                self._lead(p)

    def _way(self, start: int) -> list[tuple[int, int]]:
        """Return the edges, as seen from the panel before each, over which the cheapest way leads."""
        before: dict[int, tuple[int, int]] = {}
        cost, queue = {start: 0.0}, [(0.0, start, -1, -1)]
        while queue:  # ends: each panel is settled once
            spent, p, a, b = heapq.heappop(queue)
            if (a, b) != (-1, -1) and ((b, a) not in self.left or (p != start and len(self.corners[p]) == 3)):
                way = [(a, b)]
                while self.left[way[0]] != start:  # ends: each turn goes back to a panel that was settled before
                    way.insert(0, before[self.left[way[0]]])
                return way
            if spent > cost[p]:
                continue
            corners = self.corners[p]
            for x, y in zip(corners, corners[1:] + corners[:1], strict=True):
                to = self.left.get((y, x), -1)
                if to < 0:
                    heapq.heappush(queue, (spent + AT_BOUNDARY, p, x, y))
                    continue
                further = spent + 1.0 + (THROUGH_LINE if (min(x, y), max(x, y)) in self.chains else 0.0)
                if further < cost.get(to, np.inf):
                    cost[to], before[to] = further, (x, y)
                    heapq.heappush(queue, (further, to, x, y))
        raise AssertionError("a triangle without a way to another or to the boundary")

    def _lead(self, start: int) -> None:
        p, way = start, self._way(start)
        for number, (a, b) in enumerate(way):
            to = self.left.get((b, a), -1)
            own = self.corners[p]
            k = own.index(a)
            own = own[k:] + own[:k]  # a, b, tip
            tip = own[2]
            between = self._between(p, to) if to >= 0 else -1
            if between >= 0 and self.held[between] == FREE_NODE:
                self._drop(between, p, to)
                self._lead(to)  # ends: panels are one fewer
                return
            barrier = between >= 0 or (min(a, b), max(a, b)) in self.chains
            if to < 0:
                self._leave(p)
                self._enter(p, [a, self._split(a, b), b, tip])
                return
            other = self.corners[to]
            k = other.index(b)
            other = other[k:] + other[:k]  # b, a, and the rest
            self._leave(p)
            self._leave(to)
            if barrier:
                middle = self._split(a, b)
                self._enter(p, [a, middle, b, tip])
                ring = [b, middle, *other[1:]]
                if len(other) == 3:
                    self._enter(to, ring)
                    return
                p, kept = to, None
            elif len(other) == 3:
                self._enter(p, [b, tip, a, other[2]])
                self.corners[to] = []
                return
            else:
                ring, kept = [b, tip, *other[1:]], p
            after = way[number + 1]
            triangle, quad = self._cut(ring, after)
            if kept is None:  # the quad is new
                self.corners.append([])
                kept = len(self.corners) - 1
            self._enter(kept, quad)
            self._enter(to, triangle)
            p = to

    def _between(self, p: int, to: int) -> int:
        """Return the node that a triangle and a quad have to themselves because they share two sides; -1 for none."""
        other = self.corners[to]
        away = [v for v in other if v not in self.corners[p]]
        return other[other.index(away[0]) - 2] if len(other) == 4 and len(away) == 1 else -1

    def _drop(self, between: int, p: int, to: int) -> None:
        """Make one triangle of a triangle and a quad without the node between them."""
        self._leave(p)
        self._leave(to)
        self.corners[p] = []
        self._enter(to, [v for v in self.corners[to] if v != between])

    def _cut(self, ring: list[int], after: tuple[int, int]) -> tuple[list[int], list[int]]:
        """Cut five corners into a triangle that has an edge and the rest, as square as may be."""
        k = ring.index(after[0])
        ring = ring[k:] + ring[:k]  # after[0], after[1], c, d, e
        a, b, c, d, e = ring
        choices = [([a, b, c], [c, d, e, a]), ([e, a, b], [b, c, d, e])]
        nodes = np.array(self.nodes)
        worth = squareness(nodes, np.array([quad for _, quad in choices]))
        for k, (x, y) in enumerate(((c, a), (e, b))):
            if (x, y) in self.left or (y, x) in self.left:  # a member that is there cannot be made again
                worth[k] -= 2.0
        return choices[int(worth.argmax())]

    def result(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return nodes, quads, what holds each node, and the chains."""
        quads = np.array([corners for corners in self.corners if corners], np.int64)
        chains = np.array(sorted(self.chains), np.int64).reshape(-1, 2)
        return np.array(self.nodes), quads, np.array(self.held), chains
