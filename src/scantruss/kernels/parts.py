"""Which part of a scan belongs to which node of a grid."""

from __future__ import annotations

import numpy as np

from .boxes import SearchBoxes, search
from .compile import kernel
from .surface import Surface, flood
from .vectors import dot, row, subtract


@kernel
def nearest_nodes(surface: Surface, boxes: SearchBoxes, nodes: np.ndarray, reach: float, nearest: np.ndarray) -> None:
    """The node (V, 3) nearest to each site among those within `reach` on its own sheet, going over the links; -1 where there is none.

    boxes : of the sites. nearest : (S,) int64, filled.
    """
    nearest[:] = -1
    distance = np.empty(len(nearest))
    found = np.empty(512, np.int64)
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
                if nearest[s] < 0 or dd < distance[s]:
                    nearest[s], distance[s] = v, dd
