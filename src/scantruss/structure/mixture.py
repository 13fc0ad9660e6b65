"""Mixed iterations: what the last ones did to the error makes the next one better (Anderson 1965; Walker and Ni 2011)."""

from __future__ import annotations

import numpy as np

MIXED_ITERATIONS = 6  #: iterations that are looked back on
NIL_SINGULAR_VALUE = 1e-10  #: share of the largest singular value below which changes are ignored


class Mixture:
    """The last iterations of a step: corrections as the tangent gave them, and as they were taken."""

    def __init__(self, weights: np.ndarray) -> None:
        self.weights = weights  # (F,) which make lengths of turns
        self.given: list[np.ndarray] = []
        self.taken: list[np.ndarray] = []

    def improved(self, step: np.ndarray, more: float) -> tuple[np.ndarray, float]:
        """Return a correction of displacements (F,) and load factor, mixed with those before.

        Of all sums of the changes that the last corrections made, the one is taken off that makes this correction smallest.
        """
        given = np.append(step, more)
        best = given
        if self.given:
            changes = np.diff(np.stack([*self.given, given]), axis=0)
            weighted = changes[:, :-1] * self.weights
            table = np.einsum("if,jf->ij", weighted, weighted)  # no BLAS: see `mechanism.product`
            parts = np.linalg.lstsq(
                table, np.einsum("if,f->i", weighted, step * self.weights), rcond=NIL_SINGULAR_VALUE
            )[0]
            best = given - np.einsum("i,if->f", parts, np.stack(self.taken) + changes)
        self.given, self.taken = [*self.given, given][-MIXED_ITERATIONS:], [*self.taken, best][-MIXED_ITERATIONS:]
        return best[:-1], float(best[-1])
