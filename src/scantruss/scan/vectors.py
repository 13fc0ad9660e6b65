"""Many vectors at once, outside of the kernels."""

from __future__ import annotations

import numpy as np


def dots(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the scalar product of each vector of a (N, 3) with that of b, (N,): by columns, as sums along rows of three are slow."""
    return a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1] + a[:, 2] * b[:, 2]


def units(vectors: np.ndarray) -> np.ndarray:
    """Return vectors (N, 3) with length 1; those without length stay as they are."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0)


def pairs_within(places: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the pairs of places (K, 3) no farther apart than `reach`, the lower first, sorted, (P,) each; for a few thousand of them."""
    order = np.argsort(places[:, 0], kind="stable")
    along = places[order, 0]
    others = np.searchsorted(along, along + reach, side="right") - np.arange(1, len(along) + 1)
    first = np.repeat(np.arange(len(along)), others)
    after = np.arange(len(first)) - np.repeat(np.cumsum(others) - others, others)
    pairs = np.sort(order[np.stack([first, first + 1 + after])], axis=0)
    pairs = pairs[:, ((places[pairs[1]] - places[pairs[0]]) ** 2).sum(axis=1) <= reach**2]
    one, two = pairs[:, np.lexsort(pairs[::-1])]
    return one, two
