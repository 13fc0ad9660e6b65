"""A symmetric sparse matrix factored by substructures: the multifrontal method (Duff and Reid 1983; Liu 1992).

A substructure eliminates its own displacements by dense matrices and condenses its stiffness on its interface, the later displacements
that they are joined to (static condensation). It is added there to the substructure that the first of these belongs to, and so on.
Where a block is not positive, pivots keep their signs: L S L^T in place of L L^T. As many are negative as there are negative
eigenvalues (Sylvester's law of inertia).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg.blas import dsyrk, dtrsm
from scipy.linalg.lapack import dpotrf
from scipy.sparse import csc_matrix

from ..kernels.structure.substructures import add_condensed, signed_cholesky, solve_factored
from ..runtime.blas import one_blas_thread

SMALL_BLOCK = 48  #: rows of a block that is factored with signs at once; a larger one is halved


class SingularError(ArithmeticError):
    """A pivot is nil."""


@dataclass(frozen=True, eq=False)
class Substructures:
    """In which parts the displacements of a matrix are eliminated, and what each part is joined to."""

    first: np.ndarray  #: (S + 1,) first displacement of each part, which are numbered as they are eliminated
    interfaces: list[np.ndarray]  #: of each part (B,) the later displacements that it is joined to, rising
    parts: list[list[int]]  #: of each part those that are condensed on it
    places: list[
        np.ndarray
    ]  #: (B,) of each interface among the displacements of the part it is condensed on, then its interface
    begin: np.ndarray  #: (S + 1,) first value of the factor of each part
    pattern: tuple[np.ndarray, np.ndarray]  #: row numbers and column starts of the matrix
    source: np.ndarray  #: which values of the matrix are read: its lower triangle
    target: np.ndarray  #: where they go in the factor

    @classmethod
    def of(cls, matrix: csc_matrix, first: np.ndarray) -> Substructures:
        """Return the parts of a matrix; any rising `first` from 0 to the number of displacements will do, a nested dissection is fast."""
        count, parts = matrix.shape[0], len(first) - 1
        owner = np.repeat(np.arange(parts), np.diff(first))
        columns = np.repeat(np.arange(count), np.diff(matrix.indptr))
        source = np.flatnonzero(matrix.indices >= columns)
        rows, columns = matrix.indices[source].astype(np.int64), columns[source]
        ranges = np.searchsorted(columns, first)
        target = np.empty(len(source), np.int64)
        begin = np.zeros(parts + 1, np.int64)
        local = np.empty(count, np.int64)
        interfaces: list[np.ndarray] = []
        children: list[list[int]] = [[] for _ in range(parts)]
        places = [np.zeros(0, np.int64)] * parts
        for part in range(parts):
            start, end = first[part], first[part + 1]
            mine = slice(ranges[part], ranges[part + 1])
            reached = np.concatenate([rows[mine], *(interfaces[child] for child in children[part])])
            interface = np.unique(reached[reached >= end])
            own, wide = end - start, len(interface)
            local[start:end], local[interface] = np.arange(own), np.arange(own, own + wide)
            place, column = local[rows[mine]], columns[mine] - start
            target[mine] = begin[part] + np.where(
                place < own, column * own + place, own * own + column * wide + place - own
            )
            begin[part + 1] = begin[part] + own * (own + wide)
            for child in children[part]:
                places[child] = local[interfaces[child]]
            if wide:
                children[owner[interface[0]]].append(part)
            interfaces.append(interface)
        return cls(first, interfaces, children, places, begin, (matrix.indices, matrix.indptr), source, target)

    @cached_property
    def outer(self) -> tuple[np.ndarray, np.ndarray]:
        """(S + 1,) first of each interface, and all of them one after the other."""
        return np.cumsum([0, *map(len, self.interfaces)]), np.concatenate(self.interfaces)

    def factor(self, matrix: csc_matrix) -> Factor:
        """Return the factor of a symmetric matrix with the entries of that from which the parts were made.

        Raises
        ------
        SingularError
            A pivot is nil.
        ValueError
            The matrix has entries elsewhere.
        """
        if not all(map(np.array_equal, self.pattern, (matrix.indices, matrix.indptr))):
            raise ValueError("the matrix is not of the pattern from which its parts were made")
        values, signs = np.zeros(self.begin[-1]), np.ones(self.first[-1])
        values[self.target] = matrix.data[self.source]
        waiting: dict[int, np.ndarray] = {}
        with one_blas_thread():
            for part, interface in enumerate(self.interfaces):
                start, end = self.first[part], self.first[part + 1]
                own, wide, middle = end - start, len(interface), self.begin[part] + (end - start) ** 2
                block = values[self.begin[part] : middle].reshape(own, own)
                coupling = values[middle : self.begin[part + 1]].reshape(own, wide)
                condensed = np.zeros((wide, wide))
                for child in self.parts[part]:
                    add_condensed(waiting.pop(child), self.places[child], block, coupling, condensed)
                _factor_block(block, signs[start:end])
                if wide:
                    waiting[part] = _condense(block, signs[start:end], coupling, condensed)
        return Factor(self, values, signs)


def factor_by_parts(matrix: csc_matrix, first: np.ndarray) -> Factor:
    """Return the factor of a symmetric matrix of which the parts begin at `first`; see `Substructures`."""
    return Substructures.of(matrix, first).factor(matrix)


@dataclass(frozen=True, eq=False)
class Factor:
    """A factored symmetric matrix."""

    parts: Substructures
    values: (
        np.ndarray
    )  #: of each part L of its own displacements (N, N), then the coupling with its interface (N, B), both by columns
    signs: np.ndarray  #: (F,) of the pivots

    @property
    def negative(self) -> int:
        """How many eigenvalues of the matrix are negative."""
        return int((self.signs < 0).sum())

    @property
    def pivots(self) -> np.ndarray:
        """(F,) what is left of the diagonal, once all before are condensed on it."""
        own = np.diff(self.parts.first)
        number = np.arange(len(self.signs)) - np.repeat(self.parts.first[:-1], own)
        diagonal = self.values[np.repeat(self.parts.begin[:-1], own) + number * (np.repeat(own, own) + 1)]
        return self.signs * diagonal**2

    def solve(self, loads: np.ndarray) -> np.ndarray:
        """Return the (F,) or (F, C) solutions of right-hand sides."""
        found = np.array(np.atleast_2d(loads.T), np.float64, order="C")
        solve_factored(
            self.parts.first,
            self.parts.begin,
            self.values,
            self.signs,
            *self.parts.outer,
            np.empty(found.shape[1]),
            found,
        )
        return found[0] if loads.ndim == 1 else found.T


def _factor_block(block: np.ndarray, signs: np.ndarray) -> None:
    """Replace a dense block by its factor: by LAPACK, or what is left of halving it until that can, where it is not positive."""
    lower, failed = dpotrf(block.T, lower=1, clean=0)
    if not failed:
        block[...] = lower.T
        return
    if len(block) <= SMALL_BLOCK:
        if not signed_cholesky(block, signs):
            raise SingularError("a pivot is nil")
        return
    half = len(block) // 2
    own, coupling = block[:half, :half].copy(), block[:half, half:].copy()
    _factor_block(own, signs[:half])
    rest = _condense(own, signs[:half], coupling, block[half:, half:].copy())
    _factor_block(rest, signs[half:])
    block[:half, :half], block[:half, half:], block[half:, half:] = own, coupling, rest


def _condense(own: np.ndarray, signs: np.ndarray, coupling: np.ndarray, rest: np.ndarray) -> np.ndarray:
    """Solve for the coupling (N, B) with a factored block, and take it off what it is coupled to (B, B); returns that."""
    dtrsm(1.0, own.T, coupling.T, side=1, lower=1, trans_a=1, overwrite_b=1)
    dsyrk(-1.0, coupling.T, beta=1.0, c=rest.T, lower=1, overwrite_c=1)
    if (negative := signs < 0).any():
        coupling[negative] *= -1.0
        dsyrk(2.0, coupling[negative].T, beta=1.0, c=rest.T, lower=1, overwrite_c=1)
    return rest
