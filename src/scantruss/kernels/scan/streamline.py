"""One point of each search box."""

from __future__ import annotations

import numpy as np

from ...runtime.jit import kernel, record_type
from ..geometry.boxes import SearchBoxes, box_index, put_into, slot_of

SIDE_BITS = 3  # bits of a coordinate that number the boxes along the side of a block
BLOCK_SIDE = 1 << SIDE_BITS  # boxes along the side of a block
SIDE_MASK = BLOCK_SIDE - 1  # takes these bits out of a coordinate
BLOCK_BYTES = BLOCK_SIDE * BLOCK_SIDE  # a bit for each box of a block
CHOSEN_COUNTS = record_type(points=np.int64, blocks=np.int64)  # points chosen so far, and blocks in which they lie


@kernel
def choose_first(
    points: np.ndarray,
    boxes: SearchBoxes,
    blocks: SearchBoxes,
    taken: np.ndarray,
    among: np.ndarray,
    chosen: np.ndarray,
    begin: int,
    end: int,
    counts: np.record,
) -> int:
    """Choose the first of the points `among` (M,), of those before `end` where M is 0, in each box that is not taken yet.

    Boxes that are neighbours in space are neighbours in memory, so that a large scan touches few blocks at a time.

    Parameters
    ----------
    points : (N, 3)
    boxes : SearchBoxes, of which only bounds, sizes and counts are used
    blocks : SearchBoxes of the blocks of boxes, each with its row of `taken` as its first item
    taken : (B, BLOCK_BYTES) uint8, zero at the start: a bit for each box of a block
    chosen : (capacity,) int64, filled with the points
    begin, end : where to go on and to stop in `among`
    counts : CHOSEN_COUNTS so far

    Returns
    -------
    int : where to go on; less than `end` where `chosen` or `taken` is full
    """
    for m in range(begin, end):
        p = among[m] if len(among) > 0 else m
        i, j, k = (
            box_index(boxes, 0, points[p, 0]),
            box_index(boxes, 1, points[p, 1]),
            box_index(boxes, 2, points[p, 2]),
        )
        block = blocks.first[slot_of(blocks, i >> SIDE_BITS, j >> SIDE_BITS, k >> SIDE_BITS)]
        if block < 0:
            block = counts.blocks
            if block == len(taken):
                return m
            put_into(blocks, block, i >> SIDE_BITS, j >> SIDE_BITS, k >> SIDE_BITS)
            counts.blocks += 1
        byte, bit = ((i & SIDE_MASK) << SIDE_BITS) + (j & SIDE_MASK), np.uint8(1 << (k & SIDE_MASK))
        if taken[block, byte] & bit == 0:
            if counts.points == len(chosen):
                return m
            taken[block, byte] |= bit
            chosen[counts.points] = p
            counts.points += 1
    return end
