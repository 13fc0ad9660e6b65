"""Slow, obvious twins of the kernels that improve a grid."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import combinations

import numpy as np

from scantruss import Grid
from scantruss.grid.quality import shape_qualities
from scantruss.improve.equalize import MEAN_LENGTH_WEIGHT
from scantruss.improve.working_mesh import LENGTH_WEIGHT


def shape(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> float:
    """G of one triangle."""
    squares = ((b - a) ** 2).sum() + ((c - b) ** 2).sum() + ((a - c) ** 2).sum()
    return 2 * 3**0.5 * np.linalg.norm(np.cross(b - a, c - a)) / squares


def angles(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> tuple[float, float, float]:
    """Three angles of one triangle [degree]."""

    def at(p: np.ndarray, q: np.ndarray, r: np.ndarray) -> float:
        u, w = q - p, r - p
        return np.degrees(np.arccos(np.clip(u @ w / np.linalg.norm(u) / np.linalg.norm(w), -1, 1)))

    return at(a, b, c), at(b, c, a), at(c, a, b)


def neighbors(grid: Grid) -> dict[int, set[int]]:
    """Node to its neighbours."""
    found: dict[int, set[int]] = {v: set() for v in range(len(grid.nodes))}
    for triangle in grid.triangles.tolist():
        for a, b in combinations(triangle, 2):
            found[a].add(b)
            found[b].add(a)
    return found


def wings(grid: Grid) -> dict[tuple[int, int], list[int]]:
    """Edge (a, b), a < b, to the third nodes of its triangles."""
    found: dict[tuple[int, int], list[int]] = {}
    for a, b, c in grid.triangles.tolist():
        for p, q, r in ((a, b, c), (b, c, a), (c, a, b)):
            found.setdefault((min(p, q), max(p, q)), []).append(r)
    return found


def flips_that_pay(grid: Grid) -> dict[tuple[int, int], float]:
    """Edges whose flip would make the smallest angle of their two triangles larger, by how many degrees."""
    found = {}
    around = neighbors(grid)
    for (a, b), third in wings(grid).items():
        if len(third) == 2 and third[1] not in around[third[0]]:
            p, q, r, s = (grid.nodes[v] for v in (a, b, *third))
            now = min(*angles(p, q, r), *angles(p, q, s))
            then = min(*angles(r, s, p), *angles(r, s, q))
            if then > now + 1e-6:
                found[a, b] = then - now
    return found


def energy(grid: Grid, length: float, weight: float) -> float:
    """Members, triangles and folds."""
    total = 0.0
    for (a, b), third in wings(grid).items():
        p, q = grid.nodes[a], grid.nodes[b]
        total += weight * (float(np.linalg.norm(q - p)) / length - 1) ** 2
        if len(third) == 2:
            r, s = grid.nodes[third[0]], grid.nodes[third[1]]
            total += float(np.cross(q - p, r - p) @ np.cross(s - p, q - p) < 0)
    return total + sum(1 - shape(*grid.nodes[t]) for t in grid.triangles)


def middle(nodes: np.ndarray, around: Iterable[int], v: int, factor: float) -> np.ndarray:
    """Node v moved towards the middle of its neighbours, each with the weight of its distance."""
    arms = np.array([nodes[u] - nodes[v] for u in around])
    weights = np.linalg.norm(arms, axis=1)
    return nodes[v] + factor * (weights[:, None] * arms).sum(axis=0) / weights.sum()


def nearest_on_polyline(points: np.ndarray, place: np.ndarray, samples: int = 2000) -> float:
    """Distance of a place from a closed polyline, by sampling its segments."""
    t = np.linspace(0, 1, samples)[:, None]
    nxt = np.roll(points, -1, axis=0)
    return min(np.linalg.norm(a + t * (b - a) - place, axis=1).min() for a, b in zip(points, nxt, strict=True))


def grid_energy(grid: Grid, length: float) -> float:
    """Return the energy of a whole grid, without folded members."""
    stretch = grid.stretches(length) - 1.0
    shapes = shape_qualities(grid.nodes, grid.triangles)
    price = MEAN_LENGTH_WEIGHT * len(grid.nodes) * float(stretch.mean()) ** 2
    return LENGTH_WEIGHT * float((stretch**2).sum()) + float((1.0 - shapes).sum()) + price
