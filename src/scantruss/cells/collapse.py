"""Collapse: the nodes of a fine mesh that belong to one node of the lattice become one, edge by edge, so that the mesh stays manifold."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .fine_mesh import AT_REST_THERE, FREE, FineMesh

SAME_NODE = 0.5  # way in either axis up to which two lattice nodes are one [members]


@dataclass(frozen=True, eq=False)
class LatticeMesh:
    """A triangulation of the nodes of a lattice."""

    nodes: np.ndarray  #: (V, 3) [scan unit]
    triangles: np.ndarray  #: (T, 3) int64
    held: np.ndarray  #: (V,) int64 as in a `FineMesh`
    chains: np.ndarray  #: (C, 2) int64 edges along the boundary and lines
    source: np.ndarray  #: (V,) int64 node of the fine mesh that each was


def collapse(mesh: FineMesh, places: np.ndarray, ways: np.ndarray) -> LatticeMesh:
    """Return the fine mesh with all edges collapsed that join nodes of one lattice node.

    Parameters
    ----------
    mesh : FineMesh
    places : (F, 3) place of the lattice node of each node [scan unit]
    ways : (E, 2) way from lattice node to lattice node along each edge [members]
    """
    work = _Collapsing(mesh)
    size = np.abs(ways).max(axis=1)
    order = np.argsort(size, kind="stable")
    queue = [tuple(mesh.edges[e].tolist()) for e in order[size[order] < SAME_NODE].tolist()]
    while queue:  # ends: each turn collapses an edge, or is the last
        left = [(a, b) for a, b in queue if not work.try_edge(a, b)]
        if len(left) == len(queue):
            break
        queue = left
    return work.result(places)


class _Collapsing:
    """A mesh while its edges are collapsed."""

    def __init__(self, mesh: FineMesh) -> None:
        self.mesh = mesh
        count = len(mesh.nodes)
        self.into = list(range(count))
        self.held = mesh.held.tolist()
        self.triangles: list[list[int] | None] = mesh.triangles.tolist()
        self.of_node: list[set[int]] = [set() for _ in range(count)]
        for t, corners in enumerate(mesh.triangles.tolist()):
            for v in corners:
                self.of_node[v].add(t)
        self.chain: list[set[int]] = [set() for _ in range(count)]
        for a, b in mesh.chains.tolist():
            self.chain[a].add(b)
            self.chain[b].add(a)

    def find(self, v: int) -> int:
        while self.into[v] != v:  # ends: each was collapsed into one that was there later
            self.into[v] = self.into[self.into[v]]
            v = self.into[v]
        return v

    def neighbours(self, v: int) -> set[int]:
        found: set[int] = set()
        for t in self.of_node[v]:
            found.update(self.triangles[t] or ())
        found.discard(v)
        return found

    def try_edge(self, a: int, b: int) -> bool:
        """Collapse the edge between what two nodes have become, where that is allowed; True too where they are one already."""
        a, b = self.find(a), self.find(b)
        if a == b:
            return True
        if self.held[b] > self.held[a] or (self.held[b] == self.held[a] and b < a):
            a, b = b, a  # b goes
        at_edge = self.of_node[a] & self.of_node[b]
        on_chain = b in self.chain[a]
        if self.held[b] == AT_REST_THERE or not at_edge or (self.held[b] != FREE and not on_chain):
            return False
        around_a, around_b = self.neighbours(a), self.neighbours(b)
        if len(around_a & around_b) != len(at_edge) or len(around_a | around_b) < 3 + len(at_edge):
            return False
        if on_chain and len(self.chain[a] & self.chain[b]):
            return False
        gone = {v for t in at_edge for v in self.triangles[t] or ()} - {a, b}
        if any(not self.chain[v] and len(self.of_node[v]) <= 3 for v in gone):  # two triangles would lie on each other
            return False
        if any(len(self.of_node[v]) <= 1 for v in gone):  # a triangle at a corner stays
            return False
        for t in at_edge:
            for v in self.triangles[t] or ():
                self.of_node[v].discard(t)
            self.triangles[t] = None
        for t in self.of_node[b]:
            self.triangles[t] = [a if v == b else v for v in self.triangles[t] or ()]
            self.of_node[a].add(t)
        self.of_node[b] = set()
        for w in self.chain[b]:
            self.chain[w].discard(b)
            if w != a:
                self.chain[w].add(a)
                self.chain[a].add(w)
        self.chain[b] = set()
        self.into[b] = a
        return True

    def result(self, places: np.ndarray) -> LatticeMesh:
        root = np.array([self.find(v) for v in range(len(self.into))])
        kept, inverse = np.unique(root, return_inverse=True)
        held = self.mesh.held[kept]
        counts = (self.mesh.held == held[inverse]).astype(float)  # a node of the boundary stays there
        mean: np.ndarray = np.stack([np.bincount(inverse, counts * places[:, k]) for k in range(3)], axis=1)
        mean = mean / np.bincount(inverse, counts)[:, None]
        nodes = np.where((held == AT_REST_THERE)[:, None], self.mesh.nodes[kept], mean)
        number = np.full(len(self.into), -1)
        number[kept] = np.arange(len(kept))
        triangles = number[np.array([t for t in self.triangles if t is not None])]
        pairs = sorted({(min(v, w), max(v, w)) for v in kept.tolist() for w in self.chain[v]})
        chains = number[np.array(pairs, np.int64).reshape(-1, 2)]
        return LatticeMesh(nodes, triangles, held, chains, kept)
