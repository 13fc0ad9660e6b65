"""Distances between voxels, as far as a reach: two passes over neighbouring rows, exact (Saito and Toriwaki 1994)."""

from __future__ import annotations

import numpy as np

from ...runtime.jit import kernel


@kernel
def squares_in_rows(marked: np.ndarray, reach: int, squares: np.ndarray, begin: int, end: int) -> None:
    """Fill in the squares of the distances of voxels, squares (X, Y, Z) int16, from the nearest marked one of their row, on the last axis.

    marked : (X, Y, Z) bool
    reach : farther ones, and rows without any, are reach + 1 away [voxels]
    begin, end : which voxels along the first axis
    """
    for x in range(begin, end):
        for y in range(marked.shape[1]):
            away = reach + 1
            for z in range(marked.shape[2]):
                away = 0 if marked[x, y, z] else min(away + 1, reach + 1)
                squares[x, y, z] = away * away
            for back in range(marked.shape[2]):
                z = marked.shape[2] - 1 - back
                away = 0 if marked[x, y, z] else min(away + 1, reach + 1)
                squares[x, y, z] = min(squares[x, y, z], away * away)


@kernel
def squares_across_rows(
    given: np.ndarray, first_axis: bool, reach: int, squares: np.ndarray, begin: int, end: int
) -> None:
    """Fill in the squares of the distances, squares (X, Y, Z) int16, from those within rows or planes, given (X, Y, Z).

    first_axis : whether the neighbours are those along the first axis; else along the second
    """
    for x in range(begin, end):
        for y in range(given.shape[1]):
            for z in range(given.shape[2]):
                squares[x, y, z] = given[x, y, z]
            for step in range(-reach, reach + 1):
                i, j = (x + step, y) if first_axis else (x, y + step)
                if step != 0 and 0 <= i < given.shape[0] and 0 <= j < given.shape[1]:
                    for z in range(given.shape[2]):
                        squares[x, y, z] = min(squares[x, y, z], given[i, j, z] + step * step)
