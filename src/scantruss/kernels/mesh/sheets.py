"""Which samples of a scan belong to which node of a grid, and where the grid does not connect what the scan does."""

from __future__ import annotations

import numpy as np

from ...runtime.jit import kernel
from ..geometry.boxes import SearchBoxes, search
from ..geometry.vectors import dot, row, subtract
from ..surface.local_surface import Surface, flood

COST_ACROSS_FOLD = 2.0  # what a distance counts to a node on the other side of a fold of more than 90 degrees
MOST_SAMPLES_NEAR_NODE = 512  # most samples around a node


@kernel
def nearest_nodes(surface: Surface, boxes: SearchBoxes, nodes: np.ndarray, reach: float, nearest: np.ndarray) -> None:
    """Find the nearest node (V, 3) of each sample within `reach` over the links of its own sheet; -1 if there is none.

    A node on the other side of a fold counts as `COST_ACROSS_FOLD` times as far: at the end of a thin wall, or of a narrow gap, one
    on the other side may be nearer than the sample's own.

    boxes : of the samples. nearest : (S,) int64, filled.
    """
    nearest[:] = -1
    distance = np.empty(len(nearest))
    found = np.empty(MOST_SAMPLES_NEAR_NODE, np.int64)
    for v in range(len(nodes)):
        place = row(nodes, v)
        near, least = -1, 1e300
        for i in range(search(boxes, surface.mean, place[0], place[1], place[2], 0.5 * reach, found)):
            d = subtract(row(surface.mean, found[i]), place)
            dd = dot(d, d)
            if dd < least or (dd == least and found[i] < near):
                near, least = found[i], dd
        if near >= 0:
            for i in range(flood(surface, near, place, reach)):
                s = surface.queue[i]
                d = subtract(row(surface.mean, s), place)
                dd = dot(d, d)
                if dot(row(surface.normals, s), row(surface.normals, near)) < 0.0:
                    dd *= COST_ACROSS_FOLD * COST_ACROSS_FOLD
                if nearest[s] < 0 or dd < distance[s]:
                    nearest[s], distance[s] = v, dd


@kernel
def note_disconnected(
    links: np.ndarray,
    normals: np.ndarray,
    nearest: np.ndarray,
    first: np.ndarray,
    ends: np.ndarray,
    most: int,
    torn: np.ndarray,
) -> int:
    """Note the linked samples whose nodes are far from each other in the grid; returns how many there are, at most as there is room for.

    Parameters
    ----------
    links : (S, K) int64, linked samples, -1 for none; those across a fold of more than 90 degrees do not count
    normals : (S, 3) of the samples
    nearest : (S,) int64, node of each sample, -1 for none
    first, ends : (V + 1,) and (2 E,) int64, the nodes at the other ends of the members of each node
    most : members between two nodes up to which they are close
    torn : (T, 2) int64, filled
    """
    stamp, queue = np.full(len(first) - 1, -1, np.int64), np.empty(len(first) - 1, np.int64)
    count_torn, number = 0, 0
    for s in range(len(nearest)):
        a = nearest[s]
        for k in range(links.shape[1] if a >= 0 else 0):
            b = nearest[links[s, k]] if links[s, k] >= 0 else -1
            if b <= a or dot(row(normals, s), row(normals, links[s, k])) < 0.0:
                continue
            number += 1
            queue[0], stamp[a] = a, number
            begin, end, found = 0, 1, False
            for _ in range(most):
                count = end
                for i in range(begin, end):
                    for j in range(first[queue[i]], first[queue[i] + 1]):
                        u = ends[j]
                        found = found or u == b
                        if stamp[u] != number:
                            stamp[u] = number
                            queue[count] = u
                            count += 1
                begin, end = end, count
                if found:
                    break
            if not found:
                torn[count_torn, 0], torn[count_torn, 1] = s, links[s, k]
                count_torn += 1
                if count_torn == len(torn):
                    return count_torn
    return count_torn
