"""The order in which displacements are eliminated: nested dissection of the nodes by their places (George 1973)."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix

from .truss import Truss

LEAST_PART = 12  #: nodes that are not divided further


def dissected(truss: Truss) -> np.ndarray:
    """Return the rank (V,) of each node: halves by their longest side first, then the nodes between them, and so on in each half."""
    count = len(truss.nodes)
    ends = np.concatenate([truss.members, truss.members[:, ::-1]])
    near = csr_matrix(coo_matrix((np.ones(len(ends)), tuple(ends.T)), (count, count)))
    here = np.zeros(count)
    rank = np.empty(count, np.int64)
    parts = [(np.arange(count), count)]  # nodes, and the rank after their last
    while parts:  # each turn takes a part away and adds smaller ones
        nodes, end = parts.pop()
        places = truss.nodes[nodes]
        axis = int(np.ptp(places, axis=0).argmax()) if len(nodes) else 0
        order = np.argsort(places[:, axis], kind="stable")
        one, other = nodes[order[: len(nodes) // 2]], nodes[order[len(nodes) // 2 :]]
        here[one] = 1.0
        between = near[other] @ here > 0
        here[one] = 0.0
        if len(nodes) <= LEAST_PART or between.all():
            rank[nodes] = np.arange(end - len(nodes), end)
            continue
        last, rest = other[between], other[~between]
        rank[last] = np.arange(end - len(last), end)
        parts += [(one, end - len(last) - len(rest)), (rest, end - len(last))]
    return rank
