"""Factors of matrices that are positive definite."""

from __future__ import annotations

from scipy.sparse import csc_matrix
from scipy.sparse.linalg import SuperLU, splu


def factored(matrix: csc_matrix) -> SuperLU:
    """Return the factors of a matrix that is symmetric and positive definite, and so needs no pivots."""
    return splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
