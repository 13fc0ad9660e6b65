"""The largest eigenvalues of a large operator: block Lanczos with full orthogonalization (Golub and Underwood 1977).

It keeps its whole basis, so that it needs half of the products of ARPACK, which starts again and again. Blocks find both vectors of
a double eigenvalue, as symmetric shells have them. Its sums are not those of BLAS, which wakes threads that wait for each other.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csc_matrix

from .substructures import Factor

BASIS_SIZE = 160  #: of the basis
NIL_NORM = 1e-10  #: of what is left of a vector, over what it was, where it lies within the basis
NIL_VALUE = 1e-10  #: share of the greatest eigenvalue of either sign that is nil


class Basis:
    """Vectors that are orthonormal in the scalar product of a positive matrix."""

    def __init__(self, metric: csc_matrix) -> None:
        self.metric = metric
        self.count = 0
        self._vectors, self._weighted = np.empty((2, BASIS_SIZE, metric.shape[0]))  #: and the matrix times them

    @property
    def vectors(self) -> np.ndarray:
        """(C, F) the vectors."""
        return self._vectors[: self.count]

    def parts(self, vector: np.ndarray) -> np.ndarray:
        """Return the (C,) scalar products of a vector with those of the basis."""
        made: np.ndarray = np.einsum("if,f->i", self._weighted[: self.count], vector)
        return made

    def enter(self, vector: np.ndarray) -> np.ndarray:
        """Put in what of a vector lies without the basis, of size 1; return its parts along the basis (C,), the new one included."""
        before = self._size(vector, self.metric @ vector)
        along = np.zeros(self.count)
        for _ in range(2):  # once leaves rounding errors
            part = self.parts(vector)
            vector = vector - np.einsum("i,if->f", part, self.vectors)
            along += part
        weighted = self.metric @ vector
        left = self._size(vector, weighted)
        if left <= NIL_NORM * before:
            return along
        self._vectors[self.count], self._weighted[self.count] = vector / left, weighted / left
        self.count += 1
        return np.append(along, left)

    def _size(self, vector: np.ndarray, weighted: np.ndarray) -> float:
        return float(np.sqrt(max(np.einsum("f,f->", vector, weighted), 0.0)))


def largest_eigenpairs(
    factor: Factor, matrix: csc_matrix, metric: csc_matrix, count: int, tolerance: float, block: int = 2
) -> tuple[np.ndarray, np.ndarray] | None:
    """Return the `count` largest eigenvalues of L^-1 A (K,), largest first, with their vectors (F, K).

    Parameters
    ----------
    factor : Factor
        Of the (F, F) matrix L.
    matrix : (F, F) sparse matrix
        A.
    metric : (F, F) sparse matrix
        M, positive: M L^-1 A is symmetric.
    count : int
        K; fewer come where the vectors that are reached are fewer.
    tolerance : float
        What becomes of a vector besides its eigenvalue times it, over the largest eigenvalue.
    block : int
        Vectors that go on together: as many equal eigenvalues as are found.

    Returns
    -------
    tuple of arrays, or None
        None where `BASIS_SIZE` do not suffice.
    """
    basis = Basis(metric)
    for vector in np.random.default_rng(1).standard_normal((block, metric.shape[0])):
        basis.enter(vector)
    table = np.zeros((BASIS_SIZE, BASIS_SIZE))  # the operator within the basis; what leads out of it stands below
    first = 0
    while (
        basis.count <= BASIS_SIZE - block
    ):  # ends: each turn adds vectors, `block` at most, or has none to add and returns
        last = basis.count
        for number in range(first, last):
            along = basis.enter(factor.solve(matrix @ basis.vectors[number]))
            table[: len(along), number] = along
        within = (table[:last, :last] + table[:last, :last].T) / 2
        values, shapes = np.linalg.eigh(within)
        nil = NIL_VALUE * float(np.abs(values).max())
        values, shapes = values[::-1][:count], shapes[:, ::-1][:, :count]
        left = np.linalg.norm(table[last : basis.count, :last] @ shapes, axis=0)
        enough = max(tolerance * float(np.abs(values).max()), nil)
        if basis.count == last or (last >= count and (left <= enough).all()):
            return values, np.einsum("mf,mk->fk", basis.vectors[:last], shapes)
        first = last
    return None
