"""The clouds of the comparison: twins with known truth, by number of points, number of nodes and noise."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import product

import numpy as np
from shapes import Shape, make

SHAPES = ("scallop", "clam", "limpet", "cloth", "two_holes", "stadium", "great_court", "sphere")
NOISES = (0.0, 0.3)
POINTS = (100_000, 1_000_000)
NODES = (1_000, 10_000)


@dataclass(frozen=True)
class Cloud:
    """One cloud and the member length wanted on it."""

    shape: str
    points: int
    nodes: int  #: about as many as the length gives
    noise: float  #: standard deviation of each coordinate, in spacings of the points

    @property
    def title(self) -> str:
        return f"{self.shape}, {self.points:,} points, noise {self.noise:g} x spacing, about {self.nodes:,} nodes"

    def harder_than(self, other: Cloud) -> bool:
        """Whether it is the same surface and noise with as many points and nodes or more."""
        same = (self.shape, self.noise) == (other.shape, other.noise)
        return same and self.points >= other.points and self.nodes >= other.nodes


def clouds(
    shapes: Iterable[str] = SHAPES,
    points: Iterable[int] = POINTS,
    nodes: Iterable[int] = NODES,
    noises: Iterable[float] = NOISES,
) -> Iterator[Cloud]:
    """Yield all combinations, small ones first, those with the same points one after the other."""
    for count, shape, noise, wanted in product(sorted(points), shapes, sorted(noises), sorted(nodes)):
        yield Cloud(shape, count, wanted, noise)


@lru_cache(maxsize=1)
def _sampled(shape: str, points: int, noise: float) -> Shape:
    clean = make(shape, points, noise=0.0)
    if not noise:
        return clean
    return make(shape, points, noise=noise * spacing(clean.points))


def spacing(points: np.ndarray) -> float:
    """Return the median distance of the points (N, 3) to their nearest neighbours."""
    from scipy.spatial import cKDTree

    return float(np.median(cKDTree(points).query(points, k=2, workers=2)[0][:, 1]))


def shape_of(cloud: Cloud) -> Shape:
    """Return the points with their truth; `length` is the one that gives about as many nodes as wanted."""
    shape = _sampled(cloud.shape, cloud.points, cloud.noise)
    triangle = shape.area / (2 * cloud.nodes)  # a node has two triangles
    return replace(shape, length=float(np.sqrt(4 / np.sqrt(3) * triangle)))


@lru_cache(maxsize=1)
def _spacing(shape: str, points: int, noise: float) -> float:
    return spacing(_sampled(shape, points, noise).points)


def spacing_of(cloud: Cloud) -> float:
    """Return the spacing of the points as they are, with their noise."""
    return _spacing(cloud.shape, cloud.points, cloud.noise)
