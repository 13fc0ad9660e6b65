"""Scans with the faults that real ones have, each with its truth: `hard("shadows", seed=1)`.

Most are a shape of `shapes` whose points are spoilt; the others are shapes of their own. The same arguments give the same bytes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from shapes import Shape, make, sampled
from surfaces import Floats, Surface, cut, disc, from_field, sheet
from truths import STEP, Truth, height, plate

SMOOTH = ("scallop", "limpet", "cloth", "stadium", "saddle", "pantheon", "torus", "l_plate", "terrain")


def _smooth(seed: int, count: int, **more: float) -> Shape:
    """One of the smooth shapes, another for each seed, in any pose."""
    name = SMOOTH[seed % len(SMOOTH)]
    return make(name, count, seed=seed, pose=name not in ("terrain",), **more)


def _made(truth: Truth, seed: int, pose: bool = True) -> Shape:
    """A shape of this module."""
    return sampled("hard", truth, truth.surface, seed=seed, pose=pose)


def noisy(seed: int) -> Shape:
    """Noise of a tenth of a member."""
    name = SMOOTH[seed % len(SMOOTH)]
    length = make(name, 10).length
    return make(name, 40_000, noise=0.1 * length, seed=seed, pose=True)


def strays(seed: int) -> Shape:
    """A tenth of outliers in the box around the shape."""
    return _smooth(seed, 40_000, outliers=0.1)


def flat_strays(seed: int) -> Shape:
    """Flat ground with a tenth of outliers in its flat box."""
    return make(("terrain", "flat_plate", "cloth")[seed % 3], 30_000, outliers=0.1, seed=seed)


def uneven_density(seed: int) -> Shape:
    """One end 25 times denser than the other, as dense as the sparse end needs."""
    return _smooth(seed, 40_000, density_ratio=25.0)


def dropouts(seed: int) -> Shape:
    """Round places without points, at most .9 members wide."""
    shape = _smooth(seed, 40_000)
    rng = np.random.default_rng(seed)
    spots: list[Floats] = []
    for spot in shape.surface.nodes[rng.choice(len(shape.surface.nodes), 60)]:
        if all(np.linalg.norm(spot - other) > 1.6 * shape.length for other in spots):
            spots.append(spot)
    radius = shape.length * rng.uniform(0.15, 0.45, len(spots))
    near = np.zeros(len(shape.points), bool)
    for spot, r in zip(spots, radius, strict=True):
        near |= np.linalg.norm(shape.points - spot, axis=1) < r
    return replace(shape, points=np.ascontiguousarray(shape.points[~near]))


def doubled(seed: int) -> Shape:
    """Two scans that miss each other by a twentieth of a member."""
    shape = _smooth(seed, 40_000)
    rng = np.random.default_rng(seed)
    way = rng.normal(size=3)
    side = 0.025 * shape.length * (1 - 2 * (np.arange(len(shape.points)) % 2))
    points = shape.points + side[:, None] * way / np.linalg.norm(way)
    return replace(shape, points=points, noise=float(np.hypot(shape.noise, 0.025 * shape.length)))


def sparse(seed: int) -> Shape:
    """Points a third of a member apart, as the vertices of a mesh lie."""
    name = SMOOTH[seed % len(SMOOTH)]
    shape = make(name, 40_000, noise=0.0, seed=seed, pose=True)
    step = shape.length / 3
    from scipy.spatial import cKDTree

    rng = np.random.default_rng(seed)
    rims = [loop[:: max(1, int(step / np.linalg.norm(loop[1] - loop[0])))] for loop in shape.loops]
    points = np.concatenate([*rims, shape.points])
    tree, free, chosen = cKDTree(points), np.ones(len(points), bool), []
    for p in range(len(points)):
        if free[p]:
            chosen.append(p)
            free[tree.query_ball_point(points[p], 0.9 * step)] = False
    return replace(shape, points=rng.permutation(points[chosen]))


def _rolled(gap: float, turns: float) -> Truth:
    """A sheet rolled up, its turns `gap` apart, member 4."""
    start = 14.0

    def lift(q: Floats) -> Floats:
        angle = (np.sqrt(start**2 + gap / np.pi * q[:, 0]) - start) * 2 * np.pi / gap
        away = start + gap * angle / (2 * np.pi)
        return np.stack([away * np.cos(angle), away * np.sin(angle), q[:, 1]], axis=1)

    end = 2 * np.pi * turns
    run = ((start + gap * end / (2 * np.pi)) ** 2 - start**2) * np.pi / gap
    corners = [(0.0, -20.0), (run, -20.0), (run, 20.0), (0.0, 20.0)]
    length = 4.0
    table = np.stack(
        np.meshgrid(np.linspace(0, run, int(run / length / STEP)), np.linspace(-20, 20, 120), indexing="ij"), axis=-1
    )
    return Truth((sheet(table, lift),), length, noise=0.02, count=90_000, corners=lift(np.array(corners)))


def rolled(seed: int) -> Shape:
    """A sheet rolled up, its turns .5 to .9 members apart."""
    return _made(_rolled(4.0 * (0.5, 0.6, 0.7, 0.9)[seed % 4], 1.6), seed, pose=True)


def _round(radius: float, centre: tuple[float, float], lift: Callable[[Floats], Floats], length: float) -> Surface:
    """A disc in the plane, lifted."""
    turn = np.linspace(0, 2 * np.pi, int(2 * np.pi * radius / (length * STEP)), endpoint=False)
    outline = np.array(centre) + radius * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    return disc(outline, np.array(centre), max(4, int(radius / (length * STEP))), lift)


def island(seed: int) -> Shape:
    """A hole with a loose island in it."""
    lift = height(lambda x, y: 8 * np.cos(x / 25) * np.cos(y / 30))
    hole, inner = ((15.0, 10.0), (14.0, 9.5), (20.0, 12.0))[seed % 3]
    flat = _round(40.0, (0.0, 0.0), height(lambda x, y: 0 * x), 3.0)
    ring = replace(flat, nodes=lift(flat.nodes[:, :2]), lift=lift)
    loose = _round(inner, (0.0, 0.0), lift, 3.0)
    opened = cut(ring, lambda p: np.hypot(p[:, 0], p[:, 1]) - hole)
    shape = _made(Truth((opened, loose), 3.0, noise=0.02, count=40_000), seed, pose=True)
    return shape


def neck(seed: int) -> Shape:
    """Two fields joined by a neck of three members, or less."""
    half = 4.0 * (1.5, 1.3, 1.0)[seed % 3]
    corners = [(-40, -20), (-10, -20), (-10, -half), (10, -half), (10, -20), (40, -20)]
    around = [*corners, *[(x, -y) for x, y in reversed(corners)]]
    lift = height(lambda x, y: 5 * np.cos(x / 20) + y * y / 60)
    box = plate([(-40.0, -20.0), (40, -20), (40, 20), (-40, 20)], lift, 4.0)
    whole = cut(
        box.pieces[0],
        lambda p: np.maximum(np.abs(p[:, 0]) - 10, half - np.abs(p[:, 1])) + 1e-7,
    )
    truth = Truth((whole,), 4.0, noise=0.02, count=40_000, corners=lift(np.array(around, float)))
    return _made(truth, seed, pose=True)


def rough_ground(seed: int) -> Shape:
    """Natural ground: rough at all sizes down to less than a member."""
    rng = np.random.default_rng(seed)
    waves = []
    size = 200.0
    while size > 3.0:
        for _ in range(4):
            angle, phase = rng.uniform(0, 2 * np.pi, 2)
            waves.append((2 * np.pi / size * np.cos(angle), 2 * np.pi / size * np.sin(angle), phase, 0.025 * size))
        size /= 1.9
    lift = height(lambda x, y: sum(h * np.sin(a * x + b * y + p) for a, b, p, h in waves))
    truth = plate([(-80.0, -60.0), (80, -60), (80, 60), (-80, 60)], lift, 8.0, noise=0.05, count=40_000)
    return _made(replace(truth, corners=np.zeros((0, 3))), seed)


def zigzag(seed: int) -> Shape:
    """A boundary with thousands of zigzags finer than a member."""
    depth, wide = ((0.3, 0.08), (0.5, 0.15), (0.8, 0.3))[seed % 3]
    length, radius = 3.0, 45.0
    count = 4 * int(2 * np.pi * radius / (wide * length) / 2)
    turn = np.arange(count) * 2 * np.pi / count
    away = radius - depth * length * np.abs((np.arange(count) % 4) - 2) / 2
    outline = away[:, None] * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    lift = height(lambda x, y: 12 * np.exp(-(x * x + y * y) / 900))
    surface = disc(outline, np.zeros(2), 100, lift)
    return _made(Truth((surface,), length, noise=0.01, count=80_000), seed, pose=True)


def shadows(seed: int) -> Shape:
    """Ground with wedges without points behind posts, as one scanner sees it: each a hole, wider than two members."""
    rng = np.random.default_rng(seed)
    turns = np.arange(4) * np.pi / 2 + rng.uniform(0, 0.6, 4)
    near = rng.uniform(16, 22, 4)

    def keep(p: Floats) -> Floats:
        away, angle = np.hypot(p[:, 0], p[:, 1]), np.arctan2(p[:, 1], p[:, 0])
        open_ = np.full(len(p), np.inf)
        for turn, r in zip(turns, near, strict=True):
            off = np.abs((angle - turn + np.pi) % (2 * np.pi) - np.pi) * away
            open_ = np.minimum(open_, np.max([off - 0.13 * away, r - away, away - r - 16], axis=0))
        return open_

    lift = height(lambda x, y: 4 * np.sin(x / 14) * np.cos(y / 17))
    base = plate([(-50.0, -50.0), (50, -50), (50, 50), (-50, 50)], lift, 3.0)
    return _made(replace(base, keep=keep, count=50_000), seed, pose=True)


def tiny(seed: int) -> Shape:
    """A scan whose unit is a millionth."""
    return _smooth(seed, 40_000, scale=1e-6)


def huge(seed: int) -> Shape:
    """A scan whose unit is a million times smaller than its own."""
    return _smooth(seed, 40_000, scale=1e6)


def thin_wall(seed: int) -> Shape:
    """A closed flat body .8 members thick."""

    def field(p: Floats) -> Floats:
        q = np.abs(p) - np.array([30.0, 22.0, 0.2 if seed % 2 else 0.0])
        return np.linalg.norm(np.maximum(q, 0), axis=1) + np.minimum(q.max(axis=1), 0) - 1.6

    surface = from_field(field, np.array([-35.0, -27, -4]), np.array([35.0, 27, 4]), 0.5)
    return _made(Truth((surface,), 4.0, noise=0.02, count=60_000), seed, pose=True)


HARD: dict[str, Callable[[int], Shape]] = {
    made.__name__: made
    for made in (
        noisy, strays, flat_strays, uneven_density, dropouts, doubled, sparse, rolled, island, neck, rough_ground, zigzag,
        shadows, tiny, huge, thin_wall,
    )
}  # fmt: skip


def hard(name: str, seed: int = 0) -> Shape:
    """One of these scans."""
    return HARD[name](seed)
