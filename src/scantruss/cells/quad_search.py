"""Local search of the topology of quads: each move is kept where it lowers the energy, or where another after it does."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from .quad_mesh import QuadMesh
from .quad_moves import NO_PAIR, Move, Moves

MOST_COST_OF_FIRST_MOVE = 0.6  # most energy that the first of two moves may cost
LEAST_GAIN = 1e-3  # least energy that a move must gain
MOST_PRICE = 0.25  # largest energy that an average quad is assumed to have
# what the square of the members too many or too few at a node counts beside the energy, and counts once few are left
IRREGULAR_PRICE, LAST_IRREGULAR_PRICE = 0.3, 0.12
LED_IRREGULAR_PRICE = 0.1  # the same where rows follow the curvature, which turns them
# distance of a node from the centre of its patch that gets it a new one after a round [members]
RENEWED_IN_SEARCH = 0.4
SWEEPS_AFTER_ROUND = 30  # most sweeps of all nodes after a round


class Made(NamedTuple):
    """A move that was made, and what was there before."""

    move: Move
    quads: dict[int, list[int]]  #: corners before, of quads that were there
    fresh: list[int]  #: quads that were not
    places: np.ndarray  #: (K,) nodes that may have moved
    was: np.ndarray  #: (K, 4) where they were: place and arc length on their curves
    growth: float  #: of the energy and the price of irregular nodes


class Search:
    """The search over a mesh of quads; what was tried in a round is tried again in the next only where the quads have changed."""

    def __init__(self, mesh: QuadMesh, irregular_price: float = IRREGULAR_PRICE) -> None:
        self.mesh, self.moves = mesh, Moves(mesh)
        self.price = 0.0  # energy of a quad more or less
        self.irregular_price = irregular_price  # of a member too many or too few
        self.twice = False  # whether moves that cost energy are followed by another
        self.clock = 0
        self.stamp = [0] * len(mesh.at)  # when each node was last changed
        self.done: dict[tuple[int | str, ...], int] = {}  # when each move was last tried

    def cost(self) -> float:
        """Return the mean energy of a quad, with its share of the price of irregular nodes."""
        mesh = self.mesh
        charges = sum(self.moves.charge(v) for v, quads in enumerate(mesh.at) if quads)
        return mesh.mean_energy() + self.irregular_price * charges / max(sum(map(bool, mesh.quads)), 1)

    def refine(self) -> None:
        """Try all moves again, and let irregular nodes be where they make lengths and angles even."""
        self.irregular_price = min(self.irregular_price, LAST_IRREGULAR_PRICE)
        self.done.clear()

    def make(self, move: Move, allowed: float) -> Made | None:
        """Make a move and settle around it; None unless energy and price grow by less than allowed."""
        mesh = self.mesh
        kept, other = move.pair
        if move.kind == "split":
            mesh.add_node(kept, other, move.quads)
            self.moves.at_boundary[other], self.moves.ideals[other] = False, 4
        join = move.pair if move.kind == "collapse" else NO_PAIR
        touched = sorted(v for v in move.touched if mesh.at[v])
        price = move.growth * self.price - move.penalty * self.irregular_price
        growth, count = mesh.try_quads(touched, move.quads, self.moves.at_boundary, allowed + price, join)
        if growth - price >= allowed:
            return None
        places, was = mesh.around[0][:count].copy(), mesh.around[1][:count].copy()
        old, fresh = mesh.change(move.quads)
        mesh.tie(move.cut, move.tied)
        if move.kind == "split":
            mesh.free.pop()
        elif move.kind == "collapse":
            mesh.free.append(other)
        return Made(move, old, fresh, places, was, growth - price)

    def take_back(self, made: Made) -> None:
        """Take the last move back."""
        mesh = self.mesh
        mesh.change(made.quads)
        mesh.tie(made.move.tied, made.move.cut)
        del mesh.quads[len(mesh.quads) - len(made.fresh) :]
        if made.move.kind == "split":
            mesh.free.append(made.move.pair[1])
        elif made.move.kind == "collapse":
            mesh.free.pop()
        mesh.nodes[made.places], mesh.arc[made.places] = made.was[:, :3], made.was[:, 3]

    def keep(self, *made: Made) -> None:
        """Note that moves are kept: what was tried around them may be tried again."""
        self.clock += 1
        for each in made:
            for v in (*each.places.tolist(), *each.move.touched):
                self.stamp[v] = self.clock

    def try_move(self, move: Move | None) -> bool:
        """Make a move if the energy falls by it, or by it and another after it."""
        if move is None:
            return False
        first = self.make(move, MOST_COST_OF_FIRST_MOVE if self.twice else -LEAST_GAIN)
        if first is None:
            return False
        if first.growth < -LEAST_GAIN:
            self.keep(first)
            return True
        for name in self.moves.after(move):
            then = self.moves.named(name)
            second = self.make(then, -first.growth - LEAST_GAIN) if then is not None else None
            if second is not None:
                self.keep(first, second)
                return True
        self.take_back(first)
        return False

    def untried(self, key: tuple[int | str, ...], nodes: Iterable[int]) -> bool:
        """Whether a move has not been tried since one of its nodes changed; notes that it is."""
        if self.done.get(key, -1) >= max(self.stamp[v] for v in nodes):
            return False
        self.done[key] = self.clock
        return True

    def run(self) -> None:
        """Try all moves at irregular nodes once."""
        mesh, moves = self.mesh, self.moves
        for v in [v for v in range(len(mesh.at)) if mesh.at[v] and moves.charge(v)]:
            for q in sorted(mesh.at[v]):
                for k in (0, 1):
                    if mesh.quads[q] and self.untried(("collapse", q, k), mesh.quads[q]):
                        self.try_move(moves.collapse(q, k))
            rings = [mesh.quads[q] for q in sorted(mesh.at[v])]
            sides = {(min(a, b), max(a, b)) for ring in rings for a, b in zip(ring, ring[1:] + ring[:1], strict=True)}
            for a, b in sorted(sides):
                for way in (1, 2):
                    if self.untried(("turn", a, b, way), (a, b)):
                        self.try_move(moves.turn(a, b, way))
            for w in (v, *moves.ring_of(v)):
                if mesh.at[w] and self.untried(("split", w), (w,)):
                    any(self.try_move(move) for move in moves.splits(w))


def search_quads_once(search: Search, *, twice: bool) -> float:
    """Try the moves at all irregular nodes once and settle; returns the cost of a quad.

    twice : whether moves that cost energy are followed by another
    """
    mesh = search.mesh
    if twice != search.twice:
        search.done.clear()
    search.twice, search.price = twice, min(mesh.mean_energy(), MOST_PRICE)
    search.run()
    mesh.renew(RENEWED_IN_SEARCH)
    mesh.settle(SWEEPS_AFTER_ROUND)
    return search.cost()
