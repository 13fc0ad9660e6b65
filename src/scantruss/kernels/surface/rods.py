"""How the samples around each sample spread."""

from __future__ import annotations

import numpy as np

from ...runtime.jit import kernel
from ..geometry.boxes import SearchBoxes, box_index, slot_of
from ..geometry.vectors import dot, row, subtract


@kernel
def spreads_around(
    mean: np.ndarray,
    boxes: SearchBoxes,
    alive: np.ndarray,
    reach: float,
    which: np.ndarray,
    moments: np.ndarray,
    middle: np.ndarray,
    counts: np.ndarray,
    begin: int,
    end: int,
) -> None:
    """Fill in the covariance, moments (K, 3, 3), of the samples marked `alive` within reach of each of `which` (K,), `begin` to `end` - 1.

    middle, counts : (K, 3) and (K,), filled with their mean and their number. A sample counts itself if it is alive.
    """
    for at in range(begin, end):
        s = which[at]
        x, y, z = row(mean, s)
        count = 0
        tx = ty = tz = xx = xy = xz = yy = yz = zz = 0.0
        for i in range(box_index(boxes, 0, x - reach), box_index(boxes, 0, x + reach) + 1):
            for j in range(box_index(boxes, 1, y - reach), box_index(boxes, 1, y + reach) + 1):
                for k in range(box_index(boxes, 2, z - reach), box_index(boxes, 2, z + reach) + 1):
                    t = boxes.first[slot_of(boxes, i, j, k)]
                    while t >= 0:
                        d = subtract(row(mean, t), (x, y, z))
                        if alive[t] and dot(d, d) <= reach * reach:
                            count += 1
                            tx, ty, tz = tx + d[0], ty + d[1], tz + d[2]
                            xx, xy, xz = xx + d[0] * d[0], xy + d[0] * d[1], xz + d[0] * d[2]
                            yy, yz, zz = yy + d[1] * d[1], yz + d[1] * d[2], zz + d[2] * d[2]
                        t = boxes.next[t]
        counts[at], many = count, max(count, 1)
        total, squares = (tx / many, ty / many, tz / many), ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))
        for a in range(3):
            middle[at, a] = mean[s, a] + total[a]
            for b in range(3):
                moments[at, a, b] = squares[a][b] / many - total[a] * total[b]
