"""Parts of a grid that may be alike, joints or panels, as vectors that nodes decide."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ..kernels.mesh.alike import turned_misfits

PAIRS_AT_ONCE = 1_000_000  #: parts that are compared before it is asked whether to go on
UNLIKE_MISFIT = 2.0  #: misfit of parts that cannot be alike


def is_mirrored(shift: np.ndarray, count: np.ndarray) -> np.ndarray:
    """Return whether shifts (N,) of parts of so many vectors (N,) stand for mirror images; see `turned_misfits`."""
    way = shift // np.maximum(count, 1)
    return np.asarray((way == 1) | (way == 3))


def is_reversed(shift: np.ndarray, count: np.ndarray) -> np.ndarray:
    """Return whether with shifts (N,) the vectors (N,) follow each other the other way round; see `turned_misfits`."""
    way = shift // np.maximum(count, 1)
    return np.asarray((way == 1) | (way == 2))


@dataclass(frozen=True, eq=False)
class PartVectors(ABC):
    """Joints or panels of a grid, each as vectors around a point, anticlockwise as seen from outside."""

    called: ClassVar[str]  #: what stands for one in a report
    size_is: ClassVar[str]  #: what its vectors go to
    over: ClassVar[bool]  #: whether one that is turned over is alike, as it has no outside

    nodes_of: np.ndarray  #: (N, M) nodes that the vectors of each part depend on, -1 for none
    count: np.ndarray  #: (N,) int64, vectors of each part
    is_open: np.ndarray  #: (N,) int64, 1 where the first vector is given, 0 where any of them may be the first

    @abstractmethod
    def vectors(self, nodes: np.ndarray) -> np.ndarray:
        """Return the vectors (N, W, 3), without a unit, nil for none, of nodes (V, 3)."""

    @abstractmethod
    def slopes(self, nodes: np.ndarray, ways: np.ndarray) -> np.ndarray:
        """Return how the vectors change (N, W, 3, M, 2) with moves of their nodes along ways (V, 2, 3) [1 / unit of the grid]."""

    def held(self, nodes: np.ndarray, ways: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return what else is to be taken off (N, H) [unit of the grid], and how it changes (N, H, M, 2)."""
        return np.zeros((len(self.count), 0)), np.zeros((len(self.count), 0, self.nodes_of.shape[1], ways.shape[1]))

    def shaped(self, vectors: np.ndarray) -> np.ndarray:
        """Return the means (K, W, 3) of the vectors of each kind as vectors of a part."""
        return vectors

    def normals(self, vectors: np.ndarray) -> np.ndarray:
        """Return (N, 3) unit normals: the mean of the cross products of vectors next to each other."""
        place = np.arange(vectors.shape[1])
        after = np.where(place + 1 < self.count[:, None], place + 1, 0)
        crossed = np.cross(vectors, np.take_along_axis(vectors, after[..., None], axis=1))
        last = place == self.count[:, None] - 1
        crossed[last & (self.is_open == 1)[:, None]] = 0.0
        normal = crossed.sum(axis=1)
        return np.asarray(normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300))

    def own(self, vectors: np.ndarray) -> np.ndarray:
        """Return the vectors (N, W, 3) in frames with z along the normals."""
        normal = self.normals(vectors)
        x = vectors[:, 0] - (vectors[:, 0] * normal).sum(axis=1, keepdims=True) * normal
        x /= np.maximum(np.linalg.norm(x, axis=1, keepdims=True), 1e-300)
        frame = np.stack([x, np.cross(normal, x), normal], axis=1)
        return np.ascontiguousarray(np.einsum("vwc,vkc->vwk", vectors, frame))

    def image_misfits(self, vectors: np.ndarray, parts: np.ndarray) -> np.ndarray:
        """Return misfits (C, C) of the mirror images of some parts to these."""
        count, own = self.count[parts], self.own(vectors)[parts]
        place = np.arange(own.shape[1])
        back = np.where(place < count[:, None], count[:, None] - 1 - place, place)
        images = np.take_along_axis(own, back[..., None], axis=1) * [1.0, -1.0, 1.0]
        both = np.ascontiguousarray(np.concatenate([images, own]))
        square = (both**2).sum(axis=(1, 2))
        shape = len(both), len(parts)
        misfit, shift = np.empty(shape), np.empty(shape, np.int16)
        others = len(parts) + np.arange(len(parts))
        turned_misfits(
            both, square, np.tile(count, 2), np.tile(self.is_open[parts], 2), others, False, self.over, misfit, shift
        )
        return misfit[: len(parts)]

    def misfits(
        self, vectors: np.ndarray, others: np.ndarray, *, mirrored: bool, heard: Callable[[], None] | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return misfits and shifts (N, C) of all parts to some of them; see `turned_misfits`.

        Parameters
        ----------
        heard : callable, optional
            Called before each of some blocks; it may raise to cancel.
        """
        shape = len(self.count), len(others)
        misfit, shift = np.empty(shape), np.empty(shape, np.int16)
        own, square = self.own(vectors), (vectors**2).sum(axis=(1, 2))
        step = max(1, PAIRS_AT_ONCE // max(len(self.count), 1))
        for first in range(0, len(others), step):
            if heard is not None:
                heard()
            some = others[first : first + step]
            block = len(self.count), len(some)
            of_block = np.empty(block), np.empty(block, np.int16)
            turned_misfits(own, square, self.count, self.is_open, some, mirrored, self.over, *of_block)
            misfit[:, first : first + step], shift[:, first : first + step] = of_block
        return misfit, shift
