"""Stars: how far the members at one node are from those at another, turned about the normals."""

from __future__ import annotations

import numpy as np

from ...runtime.jit import kernel


@kernel
def star_misfits(
    own: np.ndarray, valence: np.ndarray, is_open: np.ndarray, others: np.ndarray, misfit: np.ndarray, shift: np.ndarray
) -> None:
    """Find how far the star of each node is from those of others, turned to where it is nearest.

    With the normals on each other, the turn that leaves the least sum of squares of unit vectors a, b is the argument of
    sum conj(a_xy) b_xy, and the sum is 2 k - 2 |sum conj(a_xy) b_xy| - 2 sum a_z b_z. All shifts of a ring around an inner node are
    tried; that of an open node begins at the boundary.

    Parameters
    ----------
    own : (V, W, 3) unit vectors along the members of each node, anticlockwise, z along the normal
    valence : (V,) int64, members of each node
    is_open : (V,) int64, 1 where the node is on the boundary
    others : (C,) int64
    misfit : (V, C), filled with the root mean square of what is between the unit vectors; 2 where valence or kind differ
    shift : (V, C) int64, filled: member j of the other is member (j + shift) % valence of the node
    """
    for v in range(len(valence)):
        count = valence[v]
        for c in range(len(others)):
            u = others[c]
            misfit[v, c], shift[v, c] = 2.0, 0
            if valence[u] != count or is_open[u] != is_open[v] or count == 0:
                continue
            best = -np.inf
            for s in range(1 if is_open[v] == 1 else count):
                real, imaginary, along = 0.0, 0.0, 0.0
                for j in range(count):
                    i = j + s if j + s < count else j + s - count
                    real += own[v, i, 0] * own[u, j, 0] + own[v, i, 1] * own[u, j, 1]
                    imaginary += own[v, i, 0] * own[u, j, 1] - own[v, i, 1] * own[u, j, 0]
                    along += own[v, i, 2] * own[u, j, 2]
                same = np.sqrt(real * real + imaginary * imaginary) + along
                if same > best:
                    best = same
                    shift[v, c] = s
            misfit[v, c] = np.sqrt(max(2.0 - 2.0 * best / count, 0.0))
