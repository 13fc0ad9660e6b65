"""Members that come too close: pairs without a common node by their distance, pairs with one by their angle."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix
from scipy.spatial import cKDTree

DISTANCES_AT_ONCE = 1_000_000  #: pairs of which the distances are computed at once


def close_pairs(nodes: np.ndarray, members: np.ndarray, apart: float | np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return pairs of members without a common node whose axes come closer than they may, and how close.

    Parameters
    ----------
    nodes : (V, 3) float64 [m]
    members : (M, 2) int64
    apart : float or (M,) array
        Least distance of two axes, or what each member adds to it, such as its radius [m].

    Returns
    -------
    (P, 2) int64, sorted, and (P,) float64 distances [m]
    """
    ends = nodes[members]
    own = np.broadcast_to(np.asarray(apart, float) / (1.0 if np.ndim(apart) else 2.0), len(members))
    half = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) / 2
    if len(members) < 2:
        return np.zeros((0, 2), np.int64), np.zeros(0)
    reach = 2 * float(half.max() + own.max())
    pairs = cKDTree(ends.mean(axis=1)).query_pairs(reach, output_type="ndarray").astype(np.int64)
    found, distances = [np.zeros((0, 2), np.int64)], [np.zeros(0)]
    for begin in range(0, len(pairs), DISTANCES_AT_ONCE):
        some = pairs[begin : begin + DISTANCES_AT_ONCE]
        one, two = members[some[:, 0]], members[some[:, 1]]
        some = some[~(one[:, :, None] == two[:, None, :]).any(axis=(1, 2))]
        distance = _distances(ends[some[:, 0]], ends[some[:, 1]])
        close = distance < own[some].sum(axis=1)
        found.append(some[close])
        distances.append(distance[close])
    kept, how = np.concatenate(found), np.concatenate(distances)
    order = np.lexsort(kept.T[::-1])
    return kept[order], how[order]


def angles_at_nodes(nodes: np.ndarray, members: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return pairs of members (P, 2) with a common node, sorted, and the angles (P,) between them [degree]."""
    count = len(members)
    uses = coo_matrix((np.ones(2 * count), (np.tile(np.arange(count), 2), members.T.ravel())), (count, len(nodes)))
    table = csr_matrix(uses)
    one, two = (table @ table.T).nonzero()
    pairs = np.stack([one, two], axis=1)[one < two].astype(np.int64)
    pairs = pairs[np.lexsort(pairs.T[::-1])]
    (a, b), (c, d) = members[pairs[:, 0]].T, members[pairs[:, 1]].T
    x, y = nodes[b] - nodes[a], nodes[d] - nodes[c]
    same = np.where((a == c) | (b == d), 1.0, -1.0)
    cosine = same * (x * y).sum(axis=1) / np.maximum(np.linalg.norm(x, axis=1) * np.linalg.norm(y, axis=1), 1e-300)
    return pairs, np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))


def _distances(one: np.ndarray, two: np.ndarray) -> np.ndarray:
    """Return the (P,) distances of segments (P, 2, 3): the least of the inner one and those of ends (Ericson 2005, 5.1.9)."""
    d1, d2, r = one[:, 1] - one[:, 0], two[:, 1] - two[:, 0], one[:, 0] - two[:, 0]
    a, e, b = (d1 * d1).sum(axis=1), (d2 * d2).sum(axis=1), (d1 * d2).sum(axis=1)
    c, f = (d1 * r).sum(axis=1), (d2 * r).sum(axis=1)
    bent = a * e - b * b
    s = np.clip(np.divide(b * f - c * e, bent, out=np.zeros_like(a), where=bent > 1e-12 * a * e), 0.0, 1.0)
    t = (b * s + f) / e
    s = np.where(t < 0, np.clip(-c / a, 0.0, 1.0), np.where(t > 1, np.clip((b - c) / a, 0.0, 1.0), s))
    t = np.clip(t, 0.0, 1.0)
    gap = r + s[:, None] * d1 - t[:, None] * d2
    return np.asarray(np.linalg.norm(gap, axis=1))
