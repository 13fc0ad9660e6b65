"""Moves of quads: collapse of a panel, turn of a member, split of a node; each as the changes that it makes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..grid.panels import corner_angles_of
from ..kernels.cells.quads import FREE_NODE, RESTING_NODE, SLIDING_NODE
from .quad_mesh import QuadMesh

WORST_PENALTY = 2  # growth of the sum of squared irregularities up to which a move is tried
MOST_QUADS = 7  # most quads at a node after a collapse
FEWEST_QUADS = 3  # fewest quads at a node inside
# distance of two nodes of the boundary over the way along it, below which the bend between them stays
LEAST_STRAIGHT = 0.95
NO_PAIR = (-1, -1)  # of a move that neither merges nor splits nodes


class Move(NamedTuple):
    """What a move changes."""

    kind: str  #: collapse, turn or split
    touched: frozenset[int]  #: nodes whose quads change
    quads: dict[int, list[int]]  #: new corners of quads, none of one that goes; -1 is a new quad
    growth: int  #: quads more
    penalty: int  #: growth of the sum of squared irregularities
    pair: tuple[int, int] = NO_PAIR  #: the node that stays and the one that goes or comes
    cut: frozenset[tuple[int, int]] = frozenset()  #: members of chains that go, the smaller node first
    tied: frozenset[tuple[int, int]] = frozenset()  #: those that come


class Moves:
    """The moves of a mesh of quads, and how irregular its nodes are."""

    def __init__(self, mesh: QuadMesh) -> None:
        self.mesh = mesh
        self.at_boundary = self._at_boundary()
        self.ideals = self._ideals()

    def _at_boundary(self) -> np.ndarray:
        """Return which nodes lie on the boundary (C,)."""
        mesh, on = self.mesh, np.zeros(len(self.mesh.at), np.bool_)
        for a, b in mesh.chains:
            if len(mesh.at[a] & mesh.at[b]) == 1:
                on[a] = on[b] = True
        return on

    def _ideals(self) -> list[int]:
        """Return how many quads each node should have: four inside, two on the boundary, at a corner of it as its angle says."""
        mesh, quads = self.mesh, self.mesh.live()
        total = np.bincount(quads.ravel(), corner_angles_of(mesh.nodes, quads).ravel(), len(mesh.at))
        at_corner = np.maximum(np.rint(total / 90.0), 1.0).astype(np.int64)
        ideal_at_boundary = np.where(mesh.held == RESTING_NODE, at_corner, 2)
        ideals: list[int] = np.where(self.at_boundary, ideal_at_boundary, 4).tolist()
        return ideals

    def charge(self, v: int, change: int = 0) -> int:
        """Square of the quads too many or too few at a node, with some more."""
        return (len(self.mesh.at[v]) + change - self.ideals[v]) ** 2

    def grows(self, v: int, change: int) -> int:
        """By how much the charge of a node grows with some quads more."""
        return self.charge(v, change) - self.charge(v)

    def is_chain(self, a: int, b: int) -> bool:
        """Whether a member lies on the boundary or a line."""
        return (min(a, b), max(a, b)) in self.mesh.chains

    def ring_of(self, v: int) -> list[int]:
        """Neighbours of a node inside, anticlockwise; none where they are no ring."""
        mesh, after = self.mesh, {}
        for q in mesh.at[v]:
            corners = mesh.quads[q]
            k = corners.index(v)
            after[corners[(k + 1) % 4]] = corners[k - 1]
        if not after or self.at_boundary[v]:
            return []
        start = next(iter(after))
        ring, at = [start], after[start]
        while at != start:  # ends: a ring has no more nodes than there are
            if at not in after or len(ring) > len(after):
                return []
            ring.append(at)
            at = after[at]
        return ring

    def collapse(self, q: int, k: int) -> Move | None:
        """Merge corner k of a quad with the opposite one; None where that cannot be or is hopeless."""
        mesh, corners = self.mesh, self.mesh.quads[q]
        a, b, c, d = corners[k:] + corners[:k]
        if mesh.held[c] > mesh.held[a] or (self.at_boundary[c] and not self.at_boundary[a]):
            a, b, c, d = c, d, a, b
        if mesh.held[c] != FREE_NODE:
            return self._merge_along(q, [a, b, c, d])
        if any(len(mesh.at[v]) <= (1 if self.at_boundary[v] else FEWEST_QUADS) for v in (b, d)):
            return None
        quads = len(mesh.at[a]) + len(mesh.at[c]) - 2
        penalty = (
            (quads - self.ideals[a]) ** 2 - self.charge(a) - self.charge(c) + self.grows(b, -1) + self.grows(d, -1)
        )
        if quads > MOST_QUADS or penalty > WORST_PENALTY:
            return None
        around = [{v for p in mesh.at[end] - {q} for v in mesh.quads[p]} for end in (a, c)]
        if around[0] & around[1] - {b, d}:
            return None
        changes = {p: [a if v == c else v for v in mesh.quads[p]] for p in sorted(mesh.at[c]) if p != q}
        return Move("collapse", frozenset((a, b, c, d)), {**changes, q: []}, -1, penalty, (a, c))

    def _merge_along(self, q: int, corners: list[int]) -> Move | None:
        """Merge two nodes of the boundary, of which the second slides, that have a node of one quad between them, which goes."""
        mesh = self.mesh
        a, b, c, d = corners
        if self.at_boundary[b] and len(mesh.at[b]) == 1:
            b, d = d, b
        between, across = d, b
        if not (
            self.at_boundary[between]
            and len(mesh.at[between]) == 1
            and mesh.held[between] == mesh.held[c] == SLIDING_NODE
        ):
            return None
        if not self.is_chain(a, between) or not self.is_chain(c, between):
            return None
        before, after = mesh.nodes[between] - mesh.nodes[a], mesh.nodes[c] - mesh.nodes[between]
        if np.linalg.norm(before + after) < LEAST_STRAIGHT * (np.linalg.norm(before) + np.linalg.norm(after)):
            return None
        if len(mesh.at[across]) <= (1 if self.at_boundary[across] else FEWEST_QUADS):
            return None
        quads = len(mesh.at[a]) + len(mesh.at[c]) - 2
        penalty = (quads - self.ideals[a]) ** 2 + self.grows(across, -1)
        penalty -= self.charge(a) + self.charge(c) + self.charge(between)
        around = [{v for p in mesh.at[end] - {q} for v in mesh.quads[p]} for end in (a, c)]
        if not 0 < quads <= MOST_QUADS or penalty > WORST_PENALTY or around[0] & around[1] - {across}:
            return None
        changes = {p: [a if v == c else v for v in mesh.quads[p]] for p in sorted(mesh.at[c]) if p != q}
        cut = frozenset(pair for pair in mesh.chains if c in pair or between in pair)
        ends = [v for pair in cut if c in pair for v in pair if v not in (c, between)]
        tied = frozenset((min(a, v), max(a, v)) for v in ends)
        return Move("collapse", frozenset(corners), {**changes, q: []}, -1, penalty, (a, c), cut, tied)

    def turn(self, a: int, b: int, way: int) -> Move | None:
        """Turn the member between two nodes in the six corners around it, one way (1) or the other (2)."""
        mesh = self.mesh
        both = sorted(mesh.at[a] & mesh.at[b])
        if len(both) != 2 or self.is_chain(a, b):
            return None
        if any(len(mesh.at[v]) <= (1 if self.at_boundary[v] else FEWEST_QUADS) for v in (a, b)):
            return None
        one, two = both
        i = mesh.quads[one].index(a)
        if mesh.quads[one][(i + 1) % 4] != b:
            one, two = two, one
        x, y = mesh.quads[one], mesh.quads[two]
        i, j = x.index(a), y.index(b)
        x, y = x[i:] + x[:i], y[j:] + y[:j]
        ring = [a, y[2], y[3], b, x[2], x[3]]
        if len(set(ring)) != 6:
            return None
        ring = ring[way:] + ring[:way]
        ends = ring[0], ring[3]
        if mesh.at[ends[0]] & mesh.at[ends[1]]:
            return None
        penalty = self.grows(a, -1) + self.grows(b, -1) + self.grows(ends[0], 1) + self.grows(ends[1], 1)
        if penalty > WORST_PENALTY:
            return None
        return Move("turn", frozenset(ring), {one: ring[:4], two: [ring[3], ring[4], ring[5], ring[0]]}, 0, penalty)

    def splits(self, v: int) -> list[Move]:
        """Split a node inside in two, in each way that is not hopeless: a new node takes the quads between two neighbours."""
        mesh, ring = self.mesh, self.ring_of(v)
        if mesh.held[v] != FREE_NODE or not mesh.free or any(self.is_chain(v, w) for w in ring):
            return []
        count, fresh, found = len(ring), mesh.free[-1], []
        for i in range(count):
            for span in range(1, count // 2 + 1):
                mine, other = count - span + 1, span + 1
                a, b = ring[i], ring[(i + span) % count]
                penalty = (mine - 4) ** 2 + (other - 4) ** 2 - self.charge(v) + self.grows(a, 1) + self.grows(b, 1)
                twice = 2 * span == count and i >= span
                if twice or min(mine, other) < FEWEST_QUADS or penalty > WORST_PENALTY:
                    continue
                taken = {ring[(i + k) % count] for k in range(span)}
                changes = {}
                for q in sorted(mesh.at[v]):
                    corners = mesh.quads[q]
                    if corners[(corners.index(v) + 1) % 4] in taken:
                        changes[q] = [fresh if w == v else w for w in corners]
                changes[-1] = [v, a, fresh, b]
                found.append(Move("split", frozenset((v, a, b, fresh)), changes, 1, penalty, (v, fresh)))
        return found

    def after(self, move: Move) -> list[tuple[int, ...]]:
        """Return the turns (a, b, way) and collapses (quad, corner) at the nodes that a move has left irregular."""
        mesh = self.mesh
        found: dict[tuple[int, ...], None] = {}
        for v in sorted(move.touched):
            if mesh.at[v] and self.charge(v):
                for q in sorted(mesh.at[v]):
                    corners = mesh.quads[q]
                    k = corners.index(v)
                    for w in (corners[k - 1], corners[(k + 1) % 4]):
                        found.update(dict.fromkeys([(min(v, w), max(v, w), 1), (min(v, w), max(v, w), 2)]))
                    found.update(dict.fromkeys([(q, 0), (q, 1)]))
        return list(found)

    def named(self, name: tuple[int, ...]) -> Move | None:
        """Return a turn (a, b, way) or a collapse (quad, corner)."""
        if len(name) == 3:
            return self.turn(*name)
        return self.collapse(*name) if self.mesh.quads[name[0]] else None
