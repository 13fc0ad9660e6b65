"""Small clouds for the digest, made with numpy alone, so that no change of the tests changes them; a member is 1 long."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np


def sheet(width: float, depth: float, spacing: float, seed: int = 0) -> np.ndarray:
    """Points of a plate around the origin, on a jittered lattice that reaches the rim."""
    rng = np.random.default_rng(seed)
    x, y = (np.linspace(-side / 2, side / 2, round(side / spacing) + 1) for side in (width, depth))
    u, v = (a.ravel() for a in np.meshgrid(x, y))
    inner = (abs(u) < width / 2 - 1e-9) & (abs(v) < depth / 2 - 1e-9)
    jitter = 0.3 * spacing * rng.uniform(-1, 1, (len(u), 2)) * inner[:, None]
    return rng.permutation(np.column_stack([u + jitter[:, 0], v + jitter[:, 1], 0 * u]))


def bumps(width: float = 9.0, depth: float = 7.0, spacing: float = 0.15) -> np.ndarray:
    """Points of a curved roof over a rectangle."""
    p = sheet(width, depth, spacing)
    p[:, 2] = 1.2 * np.cos(0.5 * p[:, 0]) * np.cos(0.4 * p[:, 1]) + 0.2 * np.sin(p[:, 0])
    return p


def ring(inner: float, outer: float, spacing: float = 0.2, seed: int = 0) -> np.ndarray:
    """Points between two circles, both rims dense; `inner` 0 gives a disc."""
    p = sheet(2 * outer, 2 * outer, spacing, seed)
    away = np.hypot(p[:, 0], p[:, 1])
    parts = [p[(away < outer - 0.5 * spacing) & (away > inner + (0.5 * spacing if inner else -1))]]
    for radius in (inner, outer):
        if radius:
            turn = np.linspace(0, 2 * np.pi, round(2 * np.pi * radius / (0.7 * spacing)), endpoint=False)
            parts.append(radius * np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1))
    return np.random.default_rng(seed).permutation(np.concatenate(parts))


def ball(radius: float, count: int, noise: float = 0.0) -> np.ndarray:
    """Points of a sphere, evenly on a spiral."""
    rng = np.random.default_rng(1)
    z = 1 - (2 * np.arange(count) + 1) / count
    turn, flat = np.pi * (3 - 5**0.5) * np.arange(count), np.sqrt(1 - z * z)
    p = radius * np.stack([flat * np.cos(turn), flat * np.sin(turn), z], axis=1)
    return rng.permutation(p + noise * rng.normal(size=p.shape))


def torus(radius: float, tube: float, spacing: float = 0.2) -> np.ndarray:
    """Points of a torus around z."""
    rng = np.random.default_rng(2)
    m, n = round(2 * np.pi * (radius + tube) / spacing), round(2 * np.pi * tube / spacing)
    a, b = (c.ravel() for c in np.meshgrid(np.arange(m) * 2 * np.pi / m, np.arange(n) * 2 * np.pi / n))
    a, b = a + rng.uniform(-1, 1, len(a)) / m, b + rng.uniform(-1, 1, len(b)) / n
    away = radius + tube * np.cos(b)
    return rng.permutation(np.stack([away * np.cos(a), away * np.sin(a), tube * np.sin(b)], axis=1))


def dome() -> np.ndarray:
    """Points of a spherical cap, its rim dense."""
    flat = ring(0.0, 5.5)
    away = np.maximum(np.hypot(flat[:, 0], flat[:, 1]), 1e-12)
    side = 5.0 * np.sin(away / 5.0) / away
    return np.stack([side * flat[:, 0], side * flat[:, 1], 5.0 * np.cos(away / 5.0)], axis=1)


def roof(noise: float = 0.0) -> np.ndarray:
    """Points of a gable roof."""
    p = sheet(8.0, 7.0, 0.15)
    p[:, 2] = -0.8 * abs(p[:, 1])
    return p + noise * np.random.default_rng(3).normal(size=p.shape)


def holes() -> np.ndarray:
    """Points of a curved plate with a large, a middle and a small hole."""
    p = bumps(12.0, 9.0)
    kept = np.ones(len(p), bool)
    for x, y, radius in ((-3.0, 0.5, 1.9), (2.0, 1.5, 1.1), (3.0, -2.5, 0.45)):
        kept &= np.hypot(p[:, 0] - x, p[:, 1] - y) > radius
    return p[kept]


def box() -> np.ndarray:
    """Points of a closed box of 5 x 4 x 3 members."""
    parts = []
    for axis, (w, d, h) in enumerate(((5.0, 4.0, 3.0), (4.0, 3.0, 5.0), (3.0, 5.0, 4.0))):
        for side in (-0.5, 0.5):
            p = sheet(w, d, 0.15, 7 + axis)
            p[:, 2] = side * h
            parts.append(np.roll(p, axis, axis=1))
    return np.concatenate(parts)


def cone() -> np.ndarray:
    """Points of an open cone with its apex."""
    p = ring(0.0, 4.5, 0.17)
    p[:, 2] = 4.0 - 0.8 * np.hypot(p[:, 0], p[:, 1])
    return p


def rolled() -> np.ndarray:
    """Points of a sheet rolled up, its turns 1.2 members apart."""
    p = sheet(16.0, 4.0, 0.15)
    turn = np.sqrt(4.0 + (p[:, 0] + 8.0) / (0.5 * 1.2 / (2 * np.pi) * (2 * np.pi)))
    radius = 0.6 * turn
    return np.column_stack([radius * np.cos(turn), p[:, 1], radius * np.sin(turn)])


def strays() -> np.ndarray:
    """Points of a curved roof among strays, three hundredths of them."""
    rng, p = np.random.default_rng(5), bumps()
    return rng.permutation(np.concatenate([p, rng.uniform([-6, -5, -4], [6, 5, 5], (len(p) // 33, 3))]))


def uneven() -> np.ndarray:
    """Points of a curved roof, at one end ten times denser."""
    p = bumps(9.0, 7.0, 0.07)
    return p[np.random.default_rng(6).random(len(p)) < 10 ** -((p[:, 0] + 4.5) / 9.0)]


def moved(p: np.ndarray, by: float, seed: int = 9) -> np.ndarray:
    """Return points moved at random."""
    return p + by * np.random.default_rng(seed).normal(size=p.shape)


CLOUDS: dict[str, Callable[[], np.ndarray]] = {
    "plate": lambda: sheet(9.0, 7.0, 0.2),
    "bumps": bumps,
    "dome": dome,
    "ring": lambda: ring(2.0, 6.0),
    "ball": lambda: ball(3.5, 5000, 0.01),
    "torus": lambda: torus(4.0, 1.6),
    "pieces": lambda: np.concatenate(
        [sheet(6, 5, 0.2), ring(1.5, 4.0) + [9.0, 0, 2.0], ball(2.0, 2500) + [-8.0, 0, 0]]
    ),
    "strip": lambda: sheet(14.0, 1.6, 0.12),
    "roof": roof,
    "noisy": lambda: moved(bumps(), 0.07),
    "rough": lambda: moved(bumps(9.0, 7.0, 0.12), 0.2),
    "twice": lambda: np.repeat(bumps(), 3, axis=0),
    "strays": strays,
    "far": lambda: bumps() + [3_500_000.0, 5_400_000.0, 412.0],
    "small unit": lambda: bumps() * 1.0000001 + [0.0, 0.0, 1e4],
    "sparse": lambda: bumps(12.0, 10.0, 0.33),
    "uneven": uneven,
    "holes": holes,
    "rolled": rolled,
    "few": lambda: sheet(2.0, 2.0, 0.5),
    "line": lambda: np.column_stack([np.linspace(0, 9, 400), np.zeros(400), np.zeros(400)]),
    "lattice": lambda: np.stack(
        [a.ravel() for a in np.meshgrid(np.arange(60) * 0.15, np.arange(50) * 0.15, [0.0])], axis=1
    ),
    "box": box,
    "cone": cone,
    "dense": lambda: bumps(9.0, 7.0, 0.04),
}
