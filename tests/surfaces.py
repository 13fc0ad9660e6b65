"""True surfaces as dense triangles: built from sheets or from a field, cut, measured, sampled; distances to them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]
Lift = Callable[[Floats], Floats]


@dataclass(frozen=True, eq=False)
class Surface:
    """A dense, noise-free triangulation of a true surface.

    `lift` maps parameters (K, 2) to positions (K, 3) where the surface was built from parameters; `project` moves
    positions (K, 3) onto a surface that was built from a field.
    """

    nodes: Floats  #: (V, 3)
    triangles: Ints  #: (T, 3)
    parameters: Floats | None = None  #: (T, 3, 2) parameters of the corners of each triangle
    lift: Lift | None = None
    project: Lift | None = None

    @cached_property
    def areas(self) -> Floats:
        """(T,) area of each triangle."""
        a, b, c = (self.nodes[self.triangles[:, k]] for k in range(3))
        return np.asarray(np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2)

    @cached_property
    def edges(self) -> tuple[Ints, Ints]:
        """(E, 2) edges and (E,) the number of triangles at each."""
        ends = np.sort(
            np.concatenate([self.triangles[:, [0, 1]], self.triangles[:, [1, 2]], self.triangles[:, [2, 0]]]), axis=1
        )
        key, count = np.unique(ends[:, 0] * len(self.nodes) + ends[:, 1], return_counts=True)
        return np.stack(np.divmod(key, len(self.nodes)), axis=1), count

    @cached_property
    def loops(self) -> list[Floats]:
        """Closed boundary loops, each (K, 3) without repeating its first position."""
        edges, count = self.edges
        beside: dict[int, list[int]] = {}
        for a, b in edges[count == 1].tolist():
            beside.setdefault(a, []).append(b)
            beside.setdefault(b, []).append(a)
        loops = []
        while beside:
            node = next(iter(beside))
            loop = []
            while node in beside:
                loop.append(node)
                following = beside[node].pop()
                if not beside[node]:
                    del beside[node]
                beside[following].remove(node)
                if not beside[following]:
                    del beside[following]
                node = following
            loops.append(self.nodes[loop])
        return loops

    @cached_property
    def euler(self) -> int:
        """V - E + T, of the nodes that have a triangle."""
        return int(self._is_used.sum()) - len(self.edges[0]) + len(self.triangles)

    @cached_property
    def components(self) -> int:
        """The number of separate pieces."""
        from scipy.sparse import coo_matrix
        from scipy.sparse.csgraph import connected_components

        edges, _ = self.edges
        graph = coo_matrix((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(len(self.nodes),) * 2)
        return len(np.unique(connected_components(graph, directed=False)[1][self._is_used]))

    @cached_property
    def _is_used(self) -> Bools:
        """(V,) whether a node has a triangle."""
        used = np.zeros(len(self.nodes), bool)
        used[self.triangles] = True
        return used

    @cached_property
    def _tree(self) -> Any:
        from scipy.spatial import cKDTree

        return cKDTree(self.nodes[self.triangles].mean(axis=1))

    def distance(self, positions: Floats) -> Floats:
        """Return the distance of positions (K, 3) to the surface, (K,)."""
        _, near = self._tree.query(positions, k=min(12, len(self.triangles)))
        corners = self.nodes[self.triangles[near]]  # (K, 12, 3, 3)
        found = distance_to_triangles(positions[:, None], corners[:, :, 0], corners[:, :, 1], corners[:, :, 2])
        return np.asarray(found.min(axis=1))

    def sample(self, count: int, rng: np.random.Generator, weight: Lift | None = None, even: bool = True) -> Floats:
        """Return `count` positions on the surface, exact and not on the chords, (count, 3).

        `weight` gives the relative density at positions (K, 3); even: somewhat more even than chance.
        """
        chance = self.areas if weight is None else self.areas * weight(self.nodes[self.triangles].mean(axis=1))
        total = np.cumsum(chance)
        place = rng.random(count)
        place = (np.arange(count) + place) / count if even else place
        triangle = np.searchsorted(total[:-1], place * total[-1], side="right")
        first, second = rng.random((2, count))
        over = first + second > 1
        first[over], second[over] = 1 - first[over], 1 - second[over]
        share = np.stack([1 - first - second, first, second], axis=1)
        if self.lift is not None and self.parameters is not None:
            return self.lift(np.einsum("kc,kcd->kd", share, self.parameters[triangle]))
        positions = np.einsum("kc,kcd->kd", share, self.nodes[self.triangles[triangle]])
        return positions if self.project is None else self.project(positions)

    def moved(self, motion: Lift) -> Surface:
        """Return the dense triangulation after a motion of positions (K, 3); it can no longer be sampled exactly."""
        return replace(self, nodes=motion(self.nodes), parameters=None, lift=None, project=None)


def distance_to_triangles(p: Floats, a: Floats, b: Floats, c: Floats) -> Floats:
    """Return the distance of p to the triangles a b c, or segments where b is c, elementwise; all (..., 3)."""

    def to_segment(start: Floats, end: Floats) -> Floats:
        along = end - start
        share = ((p - start) * along).sum(-1) / np.maximum((along * along).sum(-1), 1e-300)
        return np.asarray(np.linalg.norm(p - start - np.clip(share, 0, 1)[..., None] * along, axis=-1))

    normal = np.cross(b - a, c - a)
    size = np.maximum((normal * normal).sum(-1), 1e-300)
    second = (np.cross(p - a, c - a) * normal).sum(-1) / size
    third = (np.cross(b - a, p - a) * normal).sum(-1) / size
    inside = (second >= 0) & (third >= 0) & (second + third <= 1) & (normal != 0).any(-1)
    above = np.abs(((p - a) * normal).sum(-1)) / np.sqrt(size)
    return np.asarray(
        np.where(inside, above, np.minimum(np.minimum(to_segment(a, b), to_segment(b, c)), to_segment(c, a)))
    )


def sheet(
    parameters: Floats, lift: Lift, *, closed: tuple[bool, bool] = (False, False), twisted: bool = False
) -> Surface:
    """Return a surface from a table of parameters (m, n, 2).

    Closed: the last row (column) is the first again; twisted: the last row is the first one reversed. A row whose
    positions are all one (a pole) becomes one node.
    """
    m, n = parameters.shape[:2]
    index = np.arange(m * n).reshape(m, n)
    positions = lift(parameters.reshape(-1, 2)).reshape(m, n, 3)
    size = np.ptp(positions.reshape(-1, 3), axis=0).max()
    for row in (0, -1):
        if np.ptp(positions[row], axis=0).max() < 1e-9 * size:
            index[row] = index[row, 0]
    if closed[0]:
        index[-1] = index[0, ::-1] if twisted else index[0]
    if closed[1]:
        index[:, -1] = index[:, 0]
    places = np.arange(m * n).reshape(m, n)
    a, b, c, d = places[:-1, :-1].ravel(), places[1:, :-1].ravel(), places[1:, 1:].ravel(), places[:-1, 1:].ravel()
    corners = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    triangles = index.ravel()[corners]
    whole = (
        (triangles[:, 0] != triangles[:, 1])
        & (triangles[:, 1] != triangles[:, 2])
        & (triangles[:, 2] != triangles[:, 0])
    )
    return Surface(positions.reshape(-1, 3), triangles[whole], parameters.reshape(-1, 2)[corners[whole]], lift)


def disc(outline: Floats, inner: Floats, rings: int, lift: Lift) -> Surface:
    """Return the surface over the region between a loop (n, 2) or centre (2,) and an outline (n, 2) seen from it."""
    outline = np.concatenate([outline, outline[:1]])
    start = np.broadcast_to(inner, outline.shape) if inner.ndim == 1 else np.concatenate([inner, inner[:1]])
    share = np.linspace(0, 1, rings + 1)[:, None, None]
    return sheet(start + share * (outline - start), lift, closed=(False, True))


def joined(*surfaces: Surface) -> Surface:
    """Return separate surfaces as one; its samples are taken by the caller, piece by piece."""
    start = np.cumsum([0, *(len(s.nodes) for s in surfaces)])
    return Surface(
        np.concatenate([s.nodes for s in surfaces]),
        np.concatenate([s.triangles + k for s, k in zip(surfaces, start, strict=False)]),
    )


def cut(surface: Surface, keep: Callable[[Floats], Floats]) -> Surface:
    """Return the part of a surface where keep(positions) > 0; triangles across are cut along straight lines."""
    value = keep(surface.nodes)
    value = np.where(np.abs(value) < 1e-12, 1e-12, value)
    inside = value[surface.triangles] > 0
    count = inside.sum(axis=1)
    ends = np.sort(
        np.concatenate([surface.triangles[:, [0, 1]], surface.triangles[:, [1, 2]], surface.triangles[:, [2, 0]]]),
        axis=1,
    )
    across = np.unique(ends[(value[ends[:, 0]] > 0) != (value[ends[:, 1]] > 0)], axis=0)
    share = (value[across[:, 0]] / (value[across[:, 0]] - value[across[:, 1]]))[:, None]
    added = surface.nodes[across[:, 0]] * (1 - share) + surface.nodes[across[:, 1]] * share
    keys = across[:, 0] * len(surface.nodes) + across[:, 1]

    def between(a: Ints, b: Ints) -> Ints:
        low, high = np.minimum(a, b), np.maximum(a, b)
        return np.asarray(len(surface.nodes) + np.searchsorted(keys, low * len(surface.nodes) + high))

    def first_alone(state: bool, wanted: int) -> Ints:
        chosen = count == wanted
        place = np.argmax(inside[chosen] == state, axis=1)
        return np.asarray(np.take_along_axis(surface.triangles[chosen], (place[:, None] + np.arange(3)) % 3, axis=1))

    a, b, c = first_alone(True, 1).T
    d, e, f = first_alone(False, 2).T
    parts = [surface.triangles[count == 3], np.stack([a, between(a, b), between(a, c)], axis=1)]
    parts += [np.stack([between(d, e), e, f], axis=1), np.stack([between(d, e), f, between(d, f)], axis=1)]
    used, triangles = np.unique(np.concatenate(parts), return_inverse=True)
    return Surface(np.concatenate([surface.nodes, added])[used], triangles.reshape(-1, 3), project=surface.project)


def from_field(field: Callable[[Floats], Floats], low: Floats, high: Floats, step: float) -> Surface:
    """Return the surface field = 0 (negative inside), marching through tetrahedra of `step`, then Newton steps."""
    counts = np.ceil((np.asarray(high) - low) / step).astype(int) + 1
    lattice = np.stack(np.meshgrid(*(np.arange(k) for k in counts), indexing="ij"), axis=-1).reshape(-1, 3)
    coarse = lattice[(lattice % 4 == 0).all(axis=1)]
    rough = np.zeros(-(-counts // 4))
    rough[tuple(coarse.T // 4)] = field(low + step * (coarse + 1.5))
    value = rough[tuple(lattice.T // 4)]
    near = np.abs(value) < 12 * step  # elsewhere the sign is enough
    value[near] = np.concatenate(
        [field(low + step * part) for part in np.array_split(lattice[near], 1 + near.sum() // 100_000)]
    )
    value = np.where(np.abs(value) < 1e-9 * step, 1e-9 * step, value)
    strides = np.array([counts[1] * counts[2], counts[2], 1])
    cells = lattice[(lattice < counts - 1).all(axis=1)] @ strides
    walks = [(0, strides[i], strides[i] + strides[j], strides.sum()) for i in range(3) for j in range(3) if i != j]
    parts = []
    for walk in walks:
        tetrahedra = cells[:, None] + np.array(walk)
        inside = value[tetrahedra] < 0
        mixed = inside.any(axis=1) & ~inside.all(axis=1)
        parts.append(_cut_tetrahedra(tetrahedra[mixed], inside[mixed]))
    pairs = np.sort(np.concatenate(parts).reshape(-1, 2), axis=1)
    ends, triangles = np.unique(pairs, axis=0, return_inverse=True)
    share = (value[ends[:, 0]] / (value[ends[:, 0]] - value[ends[:, 1]]))[:, None]
    nodes = low + step * (lattice[ends[:, 0]] * (1 - share) + lattice[ends[:, 1]] * share)

    def project(positions: Floats) -> Floats:
        for _ in range(2):
            here = field(positions)
            slope = np.stack([field(positions + 1e-4 * step * unit) - here for unit in np.eye(3)], axis=1) / (
                1e-4 * step
            )
            change = slope * (here / np.maximum((slope * slope).sum(axis=1), 1e-12))[:, None]
            size = np.maximum(np.linalg.norm(change, axis=1) / step, 1)[:, None]
            positions = positions - change / size
        return positions

    return Surface(project(nodes), triangles.reshape(-1, 3), project=project)


def _cut_tetrahedra(tetrahedra: Ints, inside: NDArray[np.bool_]) -> Ints:
    """Return triangles (K, 3, 2), each corner on the edge between two lattice places."""
    found = []
    code = inside @ np.array([1, 2, 4, 8])
    for case in range(1, 15):
        t = tetrahedra[code == case]
        within = [k for k in range(4) if case >> k & 1]
        without = [k for k in range(4) if not case >> k & 1]
        if len(within) in (1, 3):
            alone, others = (within[0], without) if len(within) == 1 else (without[0], within)
            found.append(np.stack([t[:, [alone, k]] for k in others], axis=1))
        else:
            (a, b), (c, d) = within, without
            found.append(np.stack([t[:, [a, c]], t[:, [a, d]], t[:, [b, d]]], axis=1))
            found.append(np.stack([t[:, [a, c]], t[:, [b, d]], t[:, [b, c]]], axis=1))
    return np.concatenate(found)
