"""Clouds that nobody means to scan: what they have in common is that some step of the method might never end on them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

POINTS = 4000


def _rng() -> np.random.Generator:
    return np.random.default_rng(7)


def _plate(count: int = POINTS) -> np.ndarray:
    return np.column_stack([_rng().uniform(0, 10, (count, 2)), np.zeros(count)])


def _sphere(count: int = POINTS) -> np.ndarray:
    p = _rng().normal(size=(count, 3))
    return 5 * p / np.linalg.norm(p, axis=1)[:, None]


def _lattice(*counts: int) -> np.ndarray:
    return np.stack(np.meshgrid(*(np.arange(float(n)) for n in counts), indexing="ij"), axis=-1).reshape(
        -1, len(counts)
    )


def _flat_lattice() -> np.ndarray:
    return np.column_stack([_lattice(60, 60), np.zeros(3600)])


def _triangular_lattice() -> np.ndarray:
    i, j = _lattice(60, 60).T
    return np.column_stack([i + j / 2, j * np.sqrt(3) / 2, 0 * i])


def _whole_sphere() -> np.ndarray:
    """Whole coordinates on one sphere: many points in one distance from many places."""
    p = _lattice(101, 101, 101) - 50
    return p[(p**2).sum(axis=1) == 2501]


def _clusters() -> np.ndarray:
    rng = _rng()
    return np.repeat(_plate(100), 40, axis=0) + 1e-6 * rng.normal(size=(POINTS, 3))


def _two_densities() -> np.ndarray:
    plate = _plate(40 * POINTS)
    return plate[(plate[:, 0] > 5) | (_rng().random(len(plate)) < 0.01)]


def _there_and_back() -> np.ndarray:
    """Scan lines there and back: coordinates that rise and fall alike."""
    x = np.concatenate([np.arange(2000.0), np.arange(2000.0)[::-1]])
    return np.column_stack([x / 100, _rng().uniform(0, 20, 4000), 0 * x])


def _crossing_planes() -> np.ndarray:
    plate = _plate() - [5, 5, 0]
    return np.concatenate([np.roll(plate, k, axis=1) for k in range(3)])


def _shells() -> np.ndarray:
    sphere = _sphere()
    return np.concatenate([share * sphere for share in (1.0, 0.95, 0.9, 0.85)])


def _comb() -> np.ndarray:
    plate = _plate(10 * POINTS)
    return plate[(plate[:, 0] % 1 < 0.5) | (plate[:, 1] < 1)]


def _spiral() -> np.ndarray:
    t = np.linspace(0, 60, POINTS)
    return np.column_stack([t * np.cos(t), t * np.sin(t), t])


def _rays() -> np.ndarray:
    rng = _rng()
    turn = np.pi / 12 * rng.integers(0, 24, POINTS)
    return np.column_stack([np.cos(turn), np.sin(turn), 0 * turn]) * rng.uniform(0, 10, (POINTS, 1))


def _far_pair() -> np.ndarray:
    plate = _plate(POINTS // 2)
    return np.concatenate([plate, plate + [1e9, 0, 0]])


def _with(points: np.ndarray, *more: tuple[float, ...]) -> np.ndarray:
    return np.concatenate([points, np.array(more)])


CLOUDS: dict[str, Callable[[], np.ndarray]] = {
    "one place": lambda: np.ones((500, 3)),
    "two places": lambda: np.repeat([[0.0, 0, 0], [1, 1, 1]], 300, axis=0),
    "each point fifty times": lambda: np.repeat(_plate(400), 50, axis=0),
    "a line": lambda: _plate() * [1, 0, 0],
    "two lines": lambda: np.concatenate([_plate() * [1, 0, 0], _plate() * [0, 1, 0] + [5, 0, 0]]),
    "a lattice": _flat_lattice,
    "a triangular lattice": _triangular_lattice,
    "a solid lattice": lambda: _lattice(16, 16, 16),
    "whole coordinates on a sphere": _whole_sphere,
    "few coordinates": lambda: np.round(_plate() / 4) * 4 + [0, 0, 1] * np.round(_rng().uniform(0, 2, (POINTS, 3))),
    "coarse coordinates": lambda: np.round(_sphere(), 0),
    "clusters": _clusters,
    "two densities": _two_densities,
    "there and back": _there_and_back,
    "crossing planes": _crossing_planes,
    "shells in each other": _shells,
    "a comb": _comb,
    "a spiral": _spiral,
    "rays": _rays,
    "a ball": lambda: _rng().uniform(-5, 5, (POINTS, 3)),
    "noise": lambda: _rng().normal(size=(POINTS, 3)) * [5, 5, 1],
    "a walk": lambda: np.cumsum(_rng().normal(size=(POINTS, 3)), axis=0),
    "far apart": _far_pair,
    "one far away": lambda: _with(_plate(), (1e12, 1e12, 1e12)),
    "huge coordinates": lambda: 1e150 * _sphere(),
    "tiny coordinates": lambda: 1e-150 * _sphere(),
    "far from zero": lambda: _plate() + 1e15,
    "a needle": lambda: _plate() * [1, 0.001, 0] + 1e-4 * _rng().normal(size=(POINTS, 3)),
    "a cone of rays": lambda: np.column_stack([_rays()[:, :2], np.linalg.norm(_rays(), axis=1)]),
}
