"""The loops of a factorization by substructures: what `structure.substructures` leaves to no library.

Triangles are kept by columns: row j of an array holds column j of the lower triangle, from the diagonal on.
"""

from __future__ import annotations

import numpy as np

from ...runtime.jit import kernel


@kernel
def add_condensed(
    part: np.ndarray, places: np.ndarray, own: np.ndarray, coupling: np.ndarray, interface: np.ndarray
) -> None:
    """Add the (K, K) stiffness that a substructure has condensed on its interface to the one that eliminates next.

    places : (K,) int64, rising, of the rows of the part among the displacements of the next: its own first, then its interface
    own : (N, N) of its own displacements; coupling : (N, B) with its interface; interface : (B, B) of that
    """
    owned = len(own)
    inner = np.searchsorted(places, owned)
    for j in range(inner):
        column, wide = own[places[j]], coupling[places[j]]
        for i in range(j, inner):
            column[places[i]] += part[j, i]
        for i in range(inner, len(places)):
            wide[places[i] - owned] += part[j, i]
    for j in range(inner, len(places)):
        column = interface[places[j] - owned]
        for i in range(j, len(places)):
            column[places[i] - owned] += part[j, i]


@kernel
def signed_cholesky(matrix: np.ndarray, signs: np.ndarray) -> bool:
    """Replace a symmetric (N, N) matrix by L, and fill the signs (N,) of a diagonal S: it is L S L^T; False where a pivot is nil."""
    count = len(matrix)
    for j in range(count):
        pivot = matrix[j, j]
        if pivot == 0.0 or not np.isfinite(pivot):
            return False
        signs[j] = 1.0 if pivot > 0 else -1.0
        root = np.sqrt(abs(pivot))
        matrix[j, j] = root
        for i in range(j + 1, count):
            matrix[j, i] *= signs[j] / root
        for k in range(j + 1, count):
            factor = signs[j] * matrix[j, k]
            for i in range(k, count):
                matrix[k, i] -= factor * matrix[j, i]
    return True


@kernel
def solve_factored(
    first: np.ndarray,
    begin: np.ndarray,
    values: np.ndarray,
    signs: np.ndarray,
    outer_first: np.ndarray,
    outer: np.ndarray,
    work: np.ndarray,
    loads: np.ndarray,
) -> None:
    """Replace loads (C, F) by the displacements that they make.

    first : (S + 1,) first displacement of each substructure; begin : (S + 1,) of its values
    values : L of its own displacements (N, N), then the coupling with its interface (N, B); signs : (F,)
    outer_first : (S + 1,), outer : the displacements of the interface of each substructure
    work : (F,), of any values
    """
    parts = len(first) - 1
    for turn in range(2 * parts):  # from the first part to the last, and back
        s = turn if turn < parts else 2 * parts - 1 - turn
        count, wide = first[s + 1] - first[s], outer_first[s + 1] - outer_first[s]
        middle = begin[s] + count * count
        own = values[begin[s] : middle].reshape(count, count)
        coupling = values[middle : begin[s + 1]].reshape(count, wide)
        places = outer[outer_first[s] : outer_first[s + 1]]
        for c in range(len(loads)):
            mine = loads[c, first[s] : first[s + 1]]
            if turn < parts:
                _eliminate(own, coupling, mine, work)
                for k in range(wide):
                    loads[c, places[k]] -= work[k]
            else:
                for k in range(wide):
                    work[k] = loads[c, places[k]]
                _substitute_back(own, coupling, signs[first[s] : first[s + 1]], mine, work)


@kernel
def _eliminate(own: np.ndarray, coupling: np.ndarray, mine: np.ndarray, carried: np.ndarray) -> None:
    """Solve for the loads of a substructure (N,), and put what they carry over to its interface into `carried` (B or more,)."""
    count, wide = coupling.shape
    for k in range(wide):
        carried[k] = 0.0
    for j in range(count):
        value = mine[j] / own[j, j]
        mine[j] = value
        for i in range(j + 1, count):
            mine[i] -= own[j, i] * value
        for k in range(wide):
            carried[k] += coupling[j, k] * value


@kernel
def _substitute_back(
    own: np.ndarray, coupling: np.ndarray, signs: np.ndarray, mine: np.ndarray, interface: np.ndarray
) -> None:
    """Replace the loads of a substructure (N,) by its displacements, with those of its interface (B or more,)."""
    count, wide = coupling.shape
    for j in range(count - 1, -1, -1):
        value = signs[j] * mine[j] - _dot(coupling[j], interface, wide)
        mine[j] = (value - _dot(own[j, j + 1 :], mine[j + 1 :], count - j - 1)) / own[j, j]


@kernel
def _dot(one: np.ndarray, other: np.ndarray, count: int) -> float:
    """Return the scalar product of the first values, in four sums that do not wait for each other."""
    a, b, c, d = 0.0, 0.0, 0.0, 0.0
    whole = count - count % 4
    for i in range(0, whole, 4):
        a += one[i] * other[i]
        b += one[i + 1] * other[i + 1]
        c += one[i + 2] * other[i + 2]
        d += one[i + 3] * other[i + 3]
    for i in range(whole, count):
        a += one[i] * other[i]
    return (a + b) + (c + d)
