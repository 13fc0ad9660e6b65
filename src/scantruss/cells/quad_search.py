"""Local search of the topology of quads: collapses, turns of members and splits, each kept where it lowers the energy."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Any

import numpy as np

from .fine_mesh import ALONG, AT_REST_THERE, FREE
from .quad_mesh import QuadMesh

SETTLED_RINGS = 2  # rings of quads around a move whose nodes settle in a trial
TRIAL_SWEEPS = 8  # sweeps of a trial
BARRIER = 0.6  # most energy that the first of two moves may cost
LEAST_GAIN = 1e-3  # least energy that a move must gain
ROUNDS = {"quick": 2, "normal": 6, "best": 12}  # most rounds of the search
WORST_PENALTY = 2  # growth of the sum of squared irregularities up to which a move is tried
MOST_MEMBERS = 6  # most members at a node inside


#: kind, nodes touched, new corners of quads (-1: a new quad), quads more, the nodes merged or split
Move = tuple[str, set[int], dict[int, list[int]], int, Any]


class Search:
    """A search over a mesh of quads."""

    def __init__(self, mesh: QuadMesh, price: float, far: bool = False) -> None:
        self.far = far  # whether moves that cost energy are followed by another
        self.mesh = mesh
        self.price = price  # energy of a quad more or less
        self.kept = self.trials = 0
        self.stamp = [0] * len(mesh.at)
        self.clock = 0
        self.done: dict[tuple, int] = {}

    # topology ---------------------------------------------------------------------------------------------------------

    def members_at(self, v: int) -> int:
        """Number of members at a node."""
        mesh = self.mesh
        around = set()
        for q in mesh.at[v]:
            corners = mesh.quads[q]
            k = corners.index(v)
            around.add(corners[k - 1])
            around.add(corners[(k + 1) % 4])
        return len(around)

    def ideal(self, v: int) -> int:
        """Members that a node should have."""
        return self.ideals[v]

    def charge(self, v: int, change: int = 0) -> int:
        """Square of the members too many or too few at a node."""
        return (len(self.mesh.at[v]) + change - self.ideal(v)) ** 2

    def find_ideals(self) -> None:
        """Find how many quads each node should have: four inside; at the boundary by the angle."""
        mesh = self.mesh
        quads = mesh.live()
        total = np.zeros(len(mesh.at))
        for k in range(4):
            v, a, b = (mesh.nodes[quads[:, (k + s) % 4]] for s in (0, 1, 3))
            e, f = a - v, b - v
            c = np.einsum("ij,ij->i", e, f) / np.maximum(np.linalg.norm(e, axis=1) * np.linalg.norm(f, axis=1), 1e-300)
            np.add.at(total, quads[:, k], np.arccos(np.clip(c, -1, 1)))
        ideal = np.full(len(mesh.at), 4)
        on = self.rim = self.rim_nodes()
        turned = np.maximum(np.rint(total / (np.pi / 2)), 1).astype(int)
        corner = mesh.held == AT_REST_THERE
        for v in np.flatnonzero(on).tolist():
            ideal[v] = turned[v] if corner[v] else 2
        self.ideals = ideal.tolist()

    def rim_nodes(self) -> np.ndarray:
        mesh, on = self.mesh, np.zeros(len(self.mesh.at), bool)
        for a, b in mesh.chains:
            if len(mesh.at[a] & mesh.at[b]) == 1:
                on[a] = on[b] = True
        return on

    def around(self, nodes: set[int], rings: int) -> list[int]:
        """Return the quads within some rings of nodes."""
        mesh, inner = self.mesh, set(nodes)
        for _ in range(rings - 1):
            inner |= {v for u in inner for q in mesh.at[u] for v in mesh.quads[q]}
        return sorted({q for v in inner for q in mesh.at[v]})

    def is_chain(self, a: int, b: int) -> bool:
        return (min(a, b), max(a, b)) in self.mesh.chains

    # moves ------------------------------------------------------------------------------------------------------------

    def collapse(self, q: int, k: int) -> tuple | None:
        """Changes that merge corner k of a quad with the opposite one."""
        mesh, corners = self.mesh, self.mesh.quads[q]
        a, b, c, d = corners[k:] + corners[:k]
        if mesh.held[c] > mesh.held[a] or (self.rim[c] and not self.rim[a]):
            a, c, b, d = c, a, d, b
        if mesh.held[c] != FREE or (mesh.held[a] != FREE and False):
            return None
        if self.rim[b] and len(mesh.at[b]) <= 1 or self.rim[d] and len(mesh.at[d]) <= 1:
            return None
        others = len(mesh.at[a]) + len(mesh.at[c]) - 2
        small = [v for v in (b, d) if not self.rim[v] and len(mesh.at[v]) <= 3]
        if others > MOST_MEMBERS + 1 or small:
            return None
        penalty = (
            (others - self.ideal(a)) ** 2 - self.charge(a) - self.charge(c)
            + sum(self.charge(v, -1) - self.charge(v) for v in (b, d))
        )
        if penalty > WORST_PENALTY:
            return None
        fan = {v for p in mesh.at[c] - {q} for v in mesh.quads[p]} & {v for p in mesh.at[a] - {q} for v in mesh.quads[p]}
        if fan - {b, d}:
            return None
        new = {p: [a if v == c else v for v in mesh.quads[p]] for p in mesh.at[c] if p != q}
        new[q] = []
        return ("collapse", {a, b, d}, new, -1, (a, c))

    def turn(self, a: int, b: int, way: int) -> tuple | None:
        """Changes that turn the member between two nodes in the six corners around it."""
        mesh = self.mesh
        both = sorted(mesh.at[a] & mesh.at[b])
        if len(both) != 2 or self.is_chain(a, b):
            return None
        for v in (a, b):
            if len(mesh.at[v]) <= (1 if self.rim[v] else 3):
                return None
        one, two = both
        x = mesh.quads[one]
        i = x.index(a)
        if x[(i + 1) % 4] != b:
            one, two = two, one
            x = mesh.quads[one]
            i = x.index(a)
        x = x[i:] + x[:i]  # a b c d
        y = mesh.quads[two]
        i = y.index(b)
        y = y[i:] + y[:i]  # b a e f
        ring = [a, y[2], y[3], b, x[2], x[3]]
        if len(set(ring)) != 6:
            return None
        if way == 1:
            ends = (ring[1], ring[4])
            first, second = [ring[1], ring[2], ring[3], ring[4]], [ring[4], ring[5], ring[0], ring[1]]
        else:
            ends = (ring[2], ring[5])
            first, second = [ring[2], ring[3], ring[4], ring[5]], [ring[5], ring[0], ring[1], ring[2]]
        if mesh.at[ends[0]] & mesh.at[ends[1]]:
            return None
        penalty = sum(self.charge(v, -1) - self.charge(v) for v in (a, b))
        penalty += sum(self.charge(v, 1) - self.charge(v) for v in ends)
        if penalty > WORST_PENALTY:
            return None
        return ("turn", set(ring), {one: first, two: second}, 0, None)

    def splits(self, v: int) -> list[tuple]:
        """Changes that split a node inside in two, with a quad between them."""
        mesh = self.mesh
        if self.rim[v] or mesh.held[v] != FREE or not mesh.free or not mesh.at[v] or any(self.is_chain(v, w) for w in self.ring_of(v) or []):
            return []
        ring = self.ring_of(v)
        if ring is None:
            return []
        count, found = len(ring), []
        for i in range(count):
            for span in range(1, count // 2 + 1):
                if 2 * span == count and i >= span:
                    continue
                a, b = ring[i], ring[(i + span) % count]
                mine, other = count - span + 1, span + 1
                if min(mine, other) < 3:
                    continue
                penalty = (mine - 4) ** 2 + (other - 4) ** 2 - self.charge(v)
                penalty += sum(self.charge(w, 1) - self.charge(w) for w in (a, b))
                if penalty > WORST_PENALTY:
                    continue
                found.append((v, a, b, i, span))
        return found

    def ring_of(self, v: int) -> list[int] | None:
        """Neighbours of a node inside, in their order."""
        mesh = self.mesh
        after = {}
        for q in mesh.at[v]:
            corners = mesh.quads[q]
            k = corners.index(v)
            after[corners[(k + 1) % 4]] = corners[k - 1]
        start = next(iter(after))
        ring, at = [start], after[start]
        while at != start:
            if at not in after or len(ring) > len(after):
                return None
            ring.append(at)
            at = after[at]
        return ring

    def split(self, v: int, i: int, span: int) -> tuple | None:
        """Changes of a split: a new node takes the quads between two neighbours."""
        mesh, ring = self.mesh, self.ring_of(v)
        if ring is None or not mesh.free:
            return None
        count = len(ring)
        a, b = ring[i % count], ring[(i + span) % count]
        fresh = mesh.free[-1]
        new: dict[int, list[int]] = {}
        for k in range(span):
            one = ring[(i + k) % count]
            q = next(p for p in mesh.at[v] if one in mesh.quads[p] and self._next(p, v) == one)
            new[q] = [fresh if w == v else w for w in mesh.quads[q]]
        new[-1] = [v, a, fresh, b]
        return ("split", {v, a, b, fresh}, new, 1, (v, fresh))

    def _next(self, q: int, v: int) -> int:
        corners = self.mesh.quads[q]
        return corners[(corners.index(v) + 1) % 4]

    # trials -----------------------------------------------------------------------------------------------------------

    def try_move(self, move: Move | None, allowed: float = -LEAST_GAIN) -> float | None:
        """Make a move and settle around it; take it back unless the energy grows by less than `allowed`; return by how much if it stays."""
        if move is None:
            return None
        kind, touched, new, grown, pair = move
        mesh = self.mesh
        self.trials += 1
        old_nodes = {v for v in touched if mesh.at[v]} | ({pair[1]} if kind == "collapse" else set())
        ids = self.around(old_nodes, SETTLED_RINGS)
        before = [mesh.quads[q] for q in ids]
        places = np.array(sorted({v for corners in before for v in corners}), np.int64)
        kept = places, mesh.nodes[places], mesh.arc[places]
        undo = self._apply(new)
        if kind == "split":
            mesh.free.pop()
            self._new_node(*pair)
        after = [mesh.quads[q] for q in [*ids, *undo[1]] if mesh.quads[q]]
        joins = pair if kind == "collapse" else (-1, -1)
        growth = mesh.try_quads(before, after, self.rim, TRIAL_SWEEPS, *joins) - grown * self.price
        self.last = kind, pair, undo, kept, [*places.tolist(), *touched]
        if growth >= allowed:
            self.take_back(self.last)
            return None
        if kind == "collapse":
            mesh.free.append(pair[1])
        elif kind == "split":
            self.ideals[pair[1]] = 4
        return growth

    def take_back(self, made: tuple[Any, ...]) -> None:
        """Take the last move back."""
        kind, pair, undo, (places, nodes, arc), _ = made
        mesh = self.mesh
        self._undo(undo)
        if kind == "split":
            mesh.free.append(pair[1])
        elif kind == "collapse" and mesh.free and mesh.free[-1] == pair[1]:
            mesh.free.pop()
        mesh.nodes[places], mesh.arc[places] = nodes, arc

    def note(self, touched: Iterable[int]) -> None:
        """Note that a move is kept: what was tried around it may be tried again."""
        self.kept += 1
        self.clock += 1
        for v in touched:
            self.stamp[v] = self.clock

    def try_for_good(self, move: Move | None) -> bool:
        """Make a move if the energy falls."""
        growth = self.try_move(move, BARRIER if self.far else -LEAST_GAIN)
        if growth is None:
            return False
        first = self.last
        if growth < -LEAST_GAIN:
            self.note(first[4])
            return True
        for then in self.moves_after(move):
            if self.try_move(then, -growth - LEAST_GAIN) is not None:
                self.note([*first[4], *self.last[4]])
                return True
        self.take_back(first)
        return False

    def moves_after(self, move: Move) -> Iterator[Move]:
        """Yield the moves that may follow one: turns and collapses at the nodes that it has made irregular."""
        mesh = self.mesh
        odd = [v for v in sorted(move[1]) if mesh.at[v] and self.charge(v)]
        seen = set()
        for v in odd:
            for q in sorted(mesh.at[v]):
                corners = mesh.quads[q]
                for a, b in zip(corners, corners[1:] + corners[:1], strict=True):
                    for way in (1, 2):
                        if (key := (min(a, b), max(a, b), way)) not in seen and v in (a, b):
                            seen.add(key)
                            if (found := self.turn(*key)) is not None:
                                yield found
                for k in (0, 1):
                    if (q, k) not in seen:
                        seen.add((q, k))
                        if mesh.quads[q] and (found := self.collapse(q, k)) is not None:
                            yield found

    def _new_node(self, v: int, fresh: int) -> None:
        mesh = self.mesh
        mesh.patches[fresh], mesh.desired[fresh] = mesh.patches[v], mesh.desired[v]
        mesh.held[fresh], mesh.fixed[fresh] = FREE, False
        others = [w for q in mesh.at[fresh] for w in mesh.quads[q] if w not in (fresh, v)]
        mesh.nodes[fresh] = 0.6 * mesh.nodes[v] + 0.4 * mesh.nodes[others].mean(axis=0)
        self.rim[fresh] = False

    def _apply(self, new: dict[int, list[int]]) -> tuple[dict[int, list[int]], list[int]]:
        mesh, old, fresh = self.mesh, {}, []
        for q, corners in new.items():
            if q < 0:
                q = len(mesh.quads)
                mesh.quads.append([])
                fresh.append(q)
            old[q] = mesh.quads[q]
            for v in mesh.quads[q]:
                mesh.at[v].discard(q)
                mesh.degree[v] -= 1
        for q, corners in zip(old, new.values(), strict=True):
            mesh.quads[q] = corners
            for v in corners:
                mesh.at[v].add(q)
                mesh.degree[v] += 1
        return old, fresh

    def _undo(self, undo: tuple[dict[int, list[int]], list[int]]) -> None:
        mesh, (old, fresh) = self.mesh, undo
        for q in old:
            for v in mesh.quads[q]:
                mesh.at[v].discard(q)
                mesh.degree[v] -= 1
        for q, corners in old.items():
            mesh.quads[q] = corners
            for v in corners:
                mesh.at[v].add(q)
                mesh.degree[v] += 1
        for _ in fresh:
            mesh.quads.pop()

    # rounds -----------------------------------------------------------------------------------------------------------

    def untried(self, key: tuple, nodes: list[int]) -> bool:
        """Whether a move has not been tried since one of its nodes changed; notes that it is."""
        newest = max(self.stamp[v] for v in nodes)
        if self.done.get(key, -1) >= newest:
            return False
        self.done[key] = self.clock
        return True

    def round(self) -> int:
        """Try all moves at irregular nodes once; returns how many were kept."""
        mesh, kept = self.mesh, self.kept
        self.find_ideals()
        odd = [v for v in range(len(mesh.at)) if mesh.at[v] and self.charge(v)]
        for v in odd:
            for q in sorted(mesh.at[v]):
                for k in (0, 1):
                    corners = mesh.quads[q]
                    if corners and self.untried(("c", q, k), corners):
                        self.try_for_good(self.collapse(q, k))
            sides = {
                (min(a, b), max(a, b))
                for q in mesh.at[v]
                for a, b in zip(mesh.quads[q], mesh.quads[q][1:] + mesh.quads[q][:1], strict=True)
            }
            for a, b in sorted(sides):
                for way in (1, 2):
                    if self.untried(("t", a, b, way), [a, b]):
                        self.try_for_good(self.turn(a, b, way))
            if mesh.at[v]:
                for w in [v, *(self.ring_of(v) or [])] if not self.rim[v] else [v]:
                    if self.untried(("s", w), [w]):
                        for _, _, _, i, span in self.splits(w):
                            if self.try_for_good(self.split(w, i, span)):
                                break
        return self.kept - kept


def search_quads(mesh: QuadMesh, effort: str, report: Callable[[float], None]) -> None:
    """Search until no move is kept, in rounds, and settle after each."""
    for number in range(ROUNDS[effort]):
        report(number / ROUNDS[effort])
        quads = mesh.live()
        price = float(min(mesh.energies(quads).mean(), 0.25))
        search = Search(mesh, price, far=number > 0 and effort != 'quick')
        kept = search.round()
        mesh.renew(0.4)
        mesh.settle(30)
        if kept == 0:
            break


__all__ = ["ALONG", "search_quads"]
