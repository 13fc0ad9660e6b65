"""Clouds with known answers: `make("scallop")` gives points and the truth about the surface they were measured on.

Each shape is described once; every option (number and density of points, noise, outliers, duplicates, pose, scale,
offset) then applies to all of them alike. The same arguments give the same bytes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from scans import SCANS
from surfaces import Floats, Lift, Surface
from truths import OTHERS, PAPER, Truth

SHAPES: dict[str, Callable[[], Truth]] = {shape.__name__: shape for shape in (*PAPER, *OTHERS, *SCANS)}


@dataclass(frozen=True, eq=False)
class Shape:
    """A cloud and the truth about it, all in the frame of the cloud."""

    name: str
    points: Floats  #: (N, 3)
    surface: Surface
    length: float  #: suggested member
    noise: float
    corners: Floats
    fixed: Floats
    orientable: bool
    unit: str
    known_loops: bool  #: False: loops and Euler number are not known

    @property
    def euler(self) -> int:
        """V - E + T of the true surface."""
        return self.surface.euler

    @property
    def components(self) -> int:
        """The number of separate pieces."""
        return self.surface.components

    @property
    def loops(self) -> list[Floats]:
        """Dense true boundaries, (K, 3) each."""
        return self.surface.loops

    @property
    def area(self) -> float:
        """Area of the true surface."""
        return float(self.surface.areas.sum())

    def distance(self, positions: Floats) -> Floats:
        """Return the distance of positions (K, 3) to the true surface, (K,)."""
        return self.surface.distance(np.asarray(positions, np.float64))


@lru_cache(maxsize=8)
def _truth(name: str) -> tuple[Truth, Surface]:
    truth = SHAPES[name]()
    return truth, truth.surface


def _rotation(rng: np.random.Generator) -> Floats:
    """Return a random rotation matrix (3, 3)."""
    turn, upper = np.linalg.qr(rng.normal(size=(3, 3)))
    turn = turn * np.sign(np.diag(upper))
    return np.asarray(turn * [1, 1, np.sign(np.linalg.det(turn))])


def _sample(truth: Truth, count: int, rng: np.random.Generator, weight: Lift | None, even: bool = True) -> Floats:
    """Return `count` exact positions on the kept part of the pieces, each piece by its area."""
    area = np.array([piece.areas.sum() for piece in truth.pieces])
    found = np.zeros((0, 3))
    while len(found) < count:
        wanted = int((count - len(found)) * 1.2) + 20
        new = [
            piece.sample(n, rng, weight, even)
            for piece, n in zip(truth.pieces, rng.multinomial(wanted, area / area.sum()), strict=True)
        ]
        positions = rng.permutation(np.concatenate(new))
        for keep in (truth.keep, truth.seen):
            positions = positions if keep is None else positions[keep(positions) > 0]
        found = np.concatenate([found, positions])
    return found[:count]


def _apart(positions: Floats, radius: Floats) -> Floats:
    """Return those positions (K, 3) that keep `radius` (K,) from each other, earlier ones first, as vertices do."""
    from scipy.spatial import cKDTree

    pairs = cKDTree(positions).query_pairs(radius.max(), output_type="ndarray")
    pairs = np.sort(
        pairs[np.linalg.norm(positions[pairs[:, 0]] - positions[pairs[:, 1]], axis=1) < radius[pairs].mean(axis=1)],
        axis=1,
    )
    waiting, chosen = np.ones(len(positions), bool), np.zeros(len(positions), bool)
    while waiting.any():
        pairs = pairs[waiting[pairs].all(axis=1)]
        new = waiting.copy()
        new[pairs[:, 1]] = False
        chosen |= new
        waiting &= ~new
        waiting[pairs[new[pairs[:, 0]], 1]] = False
    return positions[chosen]


def _vertices(truth: Truth, surface: Surface, count: int, rng: np.random.Generator) -> Floats:
    """Return about `count` positions as the vertices of a mesh lie, unevenly large, with its boundary."""
    assert truth.spread is not None
    candidates = np.concatenate(
        [*(rng.permutation(loop) for loop in surface.loops), _sample(truth, 8 * count, rng, None)]
    )
    waves = rng.normal(size=(3, 3)) * 3 / np.ptp(surface.nodes, axis=0).max()
    low, high = truth.spread
    radius = low + (high - low) * (0.5 + 0.5 * np.sin(2 * candidates @ waves).mean(axis=1))
    return _apart(candidates, radius / radius.mean() * np.sqrt(0.6 * surface.areas.sum() / count))


def _plants(truth: Truth, points: Floats, rng: np.random.Generator) -> Floats:
    if truth.plants is None:
        return points
    share, low, high = truth.plants
    above = rng.random(len(points)) < share
    points[above, 2] += rng.uniform(low, high, above.sum())
    return points


def make(name: str, count: int | None = None, **options: Any) -> Shape:
    """Return a cloud of SHAPES[name] with its truth; options as of `sampled`."""
    return sampled(name, *_truth(name), count, **options)


def sampled(
    name: str,
    truth: Truth,
    surface: Surface,
    count: int | None = None,
    *,
    noise: float | None = None,
    seed: int = 0,
    pose: bool = False,
    scale: float = 1.0,
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0),
    even: bool = True,
    density_ratio: float = 1.0,
    outliers: float = 0.0,
    duplicates: float = 0.0,
    scan_lines: float = 0.0,
) -> Shape:
    """Return a cloud of a shape with its truth.

    Parameters
    ----------
    name : str
        Also a part of the seed.
    truth, surface
        The shape, and its true surface.
    count : int
        Number of points on the surface; none: as many as the twin of the shape has.
    noise : float
        Standard deviation of each coordinate, before `scale` [unit of the shape].
    seed : int
        Of points, noise, outliers and pose.
    pose : bool
        Turn and shift at random.
    scale, offset
        Positions become scale * position + offset, after the pose; the truth goes with them.
    even : bool
        Points lie somewhat more evenly than at random; False: at random.
    density_ratio : float
        Points lie this much denser at one end than at the other.
    outliers, duplicates : float
        Added points far from the surface and repeated points, as a share of `count`.
    scan_lines : float
        Distance of parallel lines along x to which points are pulled, 0 for none [unit of the shape].
    """
    rng = np.random.default_rng([seed, *name.encode()])
    low, size = surface.nodes.min(axis=0), np.ptp(surface.nodes, axis=0)
    weight = truth.weight if density_ratio == 1 else lambda p: density_ratio ** ((p[:, 0] - low[0]) / size[0])
    wanted = int((count or truth.count) * (8 if scan_lines else 1))
    points = _vertices(truth, surface, wanted, rng) if truth.spread else _sample(truth, wanted, rng, weight, even)
    if scan_lines:
        on_line = np.abs((points[:, 1] - low[1]) % scan_lines - scan_lines / 2) < scan_lines / 16
        points = points[on_line]
    noise = truth.noise if noise is None else noise
    points = _plants(truth, points + noise * rng.normal(size=points.shape), rng)
    far = low - 0.3 * size + 1.6 * size * rng.random((round(outliers * len(points)), 3))
    points = rng.permutation(np.concatenate([points, far, points[: round(duplicates * len(points))]]))
    turn, shift = (_rotation(rng), size.max() * rng.normal(size=3)) if pose else (np.eye(3), np.zeros(3))

    def motion(p: Floats) -> Floats:
        return np.asarray((p @ turn.T + shift) * scale + offset)

    return Shape(
        name=name,
        points=np.ascontiguousarray(motion(points)),
        surface=surface.moved(motion) if pose or scale != 1.0 or any(offset) else surface,
        length=truth.length * scale,
        noise=noise * scale,
        corners=motion(truth.corners),
        fixed=motion(truth.fixed),
        orientable=truth.orientable,
        unit=truth.unit,
        known_loops=truth.known_loops,
    )
