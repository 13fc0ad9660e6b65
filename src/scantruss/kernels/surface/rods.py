"""How the samples around each sample spread."""

from __future__ import annotations

import numpy as np

from ...runtime.jit import kernel
from ..geometry.boxes import SearchBoxes, box_index, slot_of


@kernel
def spreads_around(
    mean: np.ndarray,
    boxes: SearchBoxes,
    alive: np.ndarray,
    reach: float,
    moments: np.ndarray,
    middle: np.ndarray,
    counts: np.ndarray,
) -> None:
    """Fill in the covariance, moments (S, 3, 3), of the samples marked `alive` within reach of each sample.

    middle, counts : (S, 3) and (S,), filled with their mean and their number. A sample counts itself if it is alive.
    """
    for s in range(len(mean)):
        x, y, z = mean[s, 0], mean[s, 1], mean[s, 2]
        counts[s] = 0
        total = np.zeros(3)
        square = np.zeros((3, 3))
        for i in range(box_index(boxes, 0, x - reach), box_index(boxes, 0, x + reach) + 1):
            for j in range(box_index(boxes, 1, y - reach), box_index(boxes, 1, y + reach) + 1):
                for k in range(box_index(boxes, 2, z - reach), box_index(boxes, 2, z + reach) + 1):
                    t = boxes.first[slot_of(boxes, i, j, k)]
                    while t >= 0:
                        d = (mean[t, 0] - x, mean[t, 1] - y, mean[t, 2] - z)
                        if alive[t] and d[0] * d[0] + d[1] * d[1] + d[2] * d[2] <= reach * reach:
                            counts[s] += 1
                            for a in range(3):
                                total[a] += d[a]
                                for b in range(3):
                                    square[a, b] += d[a] * d[b]
                        t = boxes.next[t]
        many = max(counts[s], 1)
        for a in range(3):
            middle[s, a] = mean[s, a] + total[a] / many
            for b in range(3):
                moments[s, a, b] = square[a, b] / many - total[a] / many * total[b] / many
