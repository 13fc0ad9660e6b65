"""The order in which displacements are eliminated: nested dissection of the nodes by their places (George 1973)."""

from __future__ import annotations

import numpy as np

from .truss import Truss

LEAST_PART = 16  #: nodes that are not divided further: dense matrices of theirs are fast


def dissected(truss: Truss) -> tuple[np.ndarray, np.ndarray]:
    """Return the rank (V,) of each node: two parts along the longest side first, then the nodes between them, and so on in each part.

    All parts of one depth are divided at once. Second come the first rank of each part that is not divided and of the nodes between
    each two, rising, and last the number of nodes.
    """
    count = len(truss.nodes)
    rank = np.empty(count, np.int64)
    part = np.zeros(count, np.int64)  # of each node that has no rank yet
    end = np.array([count])  # the rank after the last one of each part
    left = np.arange(count)  # nodes without a rank
    firsts = [end]
    members = truss.members
    while len(left):  # ends: a part of few nodes gives them ranks, any other is divided into smaller ones
        order, first, size = _along_longest_sides(truss.nodes[left], part[left], len(end))
        left = left[order]
        mine = part[left]
        late = np.zeros(count, bool)
        late[left] = np.arange(len(left)) - first[mine] >= size[mine] // 2
        members = members[part[members[:, 0]] == part[members[:, 1]]]
        crossing = members[late[members[:, 0]] != late[members[:, 1]]]
        between = np.zeros(count, bool)
        between[crossing] = True
        between &= late
        last = np.bincount(mine, between[left], len(end)).astype(np.int64)
        whole = (size <= LEAST_PART) | (last == size - size // 2)
        done = whole[mine] | between[left]
        sizes = np.where(whole, size, last)
        firsts.append((end - sizes)[sizes > 0])
        rank[left[done]] = (end - sizes)[mine[done]] + _numbers_within(mine[done])
        inside = np.zeros(count, bool)
        inside[left[~done]] = True
        members = members[inside[members].all(axis=1)]
        left, mine = left[~done], mine[~done]
        fresh = 2 * mine + ~late[left]  # the later half is eliminated first, so that its ranks stand before
        ends = np.stack([end - last - (size // 2), end - last], axis=1).ravel()
        kept, part[left] = np.unique(fresh, return_inverse=True)
        end = ends[kept]
    return rank, np.unique(np.concatenate(firsts))


def _along_longest_sides(places: np.ndarray, part: np.ndarray, parts: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return an order of the nodes (N,) by their parts, within each along its longest side, and the first and the number of each part."""
    size = np.bincount(part, minlength=parts)
    first = np.cumsum(size) - size
    by_part = np.argsort(part, kind="stable")
    sides = np.maximum.reduceat(places[by_part], first) - np.minimum.reduceat(places[by_part], first)
    along = places[np.arange(len(part)), sides.argmax(axis=1)[part]]
    return np.lexsort((along, part)), first, size


def _numbers_within(part: np.ndarray) -> np.ndarray:
    """Return the number of each node within its part; parts stand together."""
    starts = np.flatnonzero(np.r_[True, part[1:] != part[:-1]]) if len(part) else np.zeros(0, np.int64)
    return np.arange(len(part)) - np.repeat(starts, np.diff(np.r_[starts, len(part)]))
