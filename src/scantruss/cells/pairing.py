"""Pairing: the triangles of a lattice become quads, two and two; what stays single is led to its like through the quads between."""

from __future__ import annotations

import numpy as np
from scipy.optimize import linprog
from scipy.sparse import csr_matrix

from .collapse import LatticeMesh

SINGLE_COST = 6.0  # what a triangle without a partner costs, against a square, which gains 1


def pairs_of(mesh: LatticeMesh) -> tuple[np.ndarray, np.ndarray]:
    """Return the best quads (Q, 4) that pairs of triangles make, and the triangles left (S, 3)."""
    triangles, count = mesh.triangles, len(mesh.nodes)
    starts = triangles[:, [0, 1, 2]].ravel()
    ends = triangles[:, [1, 2, 0]].ravel()
    opposite = triangles[:, [2, 0, 1]].ravel()
    key = np.minimum(starts, ends) * count + np.maximum(starts, ends)
    order = np.argsort(key, kind="stable")
    two = np.flatnonzero(key[order][1:] == key[order][:-1])
    one, other = order[two], order[two + 1]
    low, high = np.sort(mesh.chains, axis=1).T
    free = ~np.isin(key[one], low * count + high)
    one, other = one[free], other[free]
    quads = np.stack([starts[one], opposite[other], ends[one], opposite[one]], axis=1)
    gain = squareness(mesh.nodes, quads)
    a, b = one // 3, other // 3
    edges, each = len(one), len(triangles)
    matrix = csr_matrix(
        (
            np.ones(2 * edges + each),
            (
                np.concatenate([a, b, np.arange(each)]),
                np.concatenate([np.tile(np.arange(edges), 2), edges + np.arange(each)]),
            ),
        ),
        shape=(each, edges + each),
    )
    found = linprog(
        np.concatenate([-gain, np.full(each, SINGLE_COST)]),
        A_eq=matrix,
        b_eq=np.ones(each),
        bounds=(0.0, 1.0),
        method="highs-ds",
    )
    value = found.x[:edges]
    is_free, taken = np.ones(each, np.bool_), np.zeros(edges, np.bool_)
    for e in np.lexsort(
        (-gain, -np.rint(4 * value))
    ).tolist():  # the whole ones first, then of each odd ring all but one
        if is_free[a[e]] and is_free[b[e]] and (value[e] > 0.25 or gain[e] > 0.3):
            is_free[a[e]] = is_free[b[e]] = False
            taken[e] = True
    return quads[taken], triangles[is_free]


def squareness(nodes: np.ndarray, quads: np.ndarray) -> np.ndarray:
    """Return how square quads are (Q,): 1 with right angles only, 0 where one is gone."""
    worst = np.zeros(len(quads))
    for k in range(4):
        v, before, after = (nodes[quads[:, (k + s) % 4]] for s in (0, 3, 1))
        x, y = before - v, after - v
        size = np.linalg.norm(x, axis=1) * np.linalg.norm(y, axis=1)
        angle = np.arccos(np.clip(np.einsum("ij,ij->i", x, y) / np.maximum(size, 1e-300), -1, 1))
        worst = np.maximum(worst, np.abs(angle / (np.pi / 2) - 1.0))
    return np.maximum(1.0 - worst, 0.0)
