"""Sides of thin walls: each normal turned to the side with which most samples around it agree."""

from __future__ import annotations

import numpy as np

from ...runtime.jit import kernel
from ..geometry.boxes import SearchBoxes, search
from ..geometry.vectors import dot, row, subtract, unit

MOST_VOTERS = 256  # most samples around one that are asked
BEHIND_SINE = 0.75  # sine of the angle above its plane beyond which a sample lies behind another one, not beside it
WEIGHT_BEHIND = 0.2  # of a sample behind another one, which faces the other way; one beside it in its plane counts 1


@kernel
def vote_on_sides(mean: np.ndarray, normals: np.ndarray, boxes: SearchBoxes, reach: float, most: int) -> int:
    """Turn normals (S, 3) over, one after the other, until each agrees with most samples within a reach; returns how many turns it took.

    Those beside a sample in its plane should face as it does, those behind it the other way. Each turn raises the agreement of all
    pairs, so that it ends; `most` times all samples are asked at most.

    boxes : the samples by box
    """
    found, turns = np.empty(MOST_VOTERS, np.int64), 0
    for _ in range(most):
        before = turns
        for s in range(len(mean)):
            x, y, z = row(mean, s)
            own, vote = row(normals, s), 0.0
            for c in range(search(boxes, mean, x, y, z, reach, found)):
                q = found[c]
                if q == s:
                    continue
                way, other = unit(subtract(row(mean, q), row(mean, s))), row(normals, q)
                up, down, agree = abs(dot(way, own)), abs(dot(way, other)), dot(own, other)
                vote += (1.0 - up) ** 2 * (1.0 - down) ** 2 * agree
                if up > BEHIND_SINE and down > BEHIND_SINE:
                    vote -= WEIGHT_BEHIND * agree
            if vote < 0.0:
                turns += 1
                for i in range(3):
                    normals[s, i] = -normals[s, i]
        if turns == before:
            break
    return turns
