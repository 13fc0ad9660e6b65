"""Random surfaces with known topology: smooth heights over smooth outlines with concave boundaries and holes, any pose and unit.

`random_surface(seed)` gives the points and the truth, all in the frame of the points. What it asks for can be had: nothing is
narrower than three members, no hole has a boundary shorter than six, the surface bends at two members or more.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from surfaces import Floats

NECK = 3.0  #: least width of necks and bays, least distance of holes [member]
BEND = 0.5  #: most curvature of the heights, in both directions together [1 / member]
SLOPE = 1.2  #: steepest rise
NOISE = 0.1  #: most noise [member]
Motion = Callable[[Floats], Floats]
ROUND = np.linspace(0, 2 * np.pi, 721)[:-1]


@dataclass(frozen=True, eq=False)
class RandomSurface:
    """A cloud and the truth about it, for `benchmarks.measure` as well as for the tests."""

    name: str
    points: Floats  #: (N, 3)
    length: float  #: member [scan unit]
    noise: float  #: standard deviation of each coordinate [scan unit]
    loops: list[Floats]  #: dense true boundaries, (K, 3) each, the outer one first
    distance: Callable[[Floats], Floats]  #: of positions (K, 3) to the true surface, (K,)
    facts: dict[str, float]  #: what was drawn, in members
    components: int = 1
    known_loops: bool = True
    corners: Floats = field(default_factory=lambda: np.zeros((0, 3)))  #: no boundary has any

    @property
    def euler(self) -> int:
        """V - E + T of the true surface."""
        return 2 - len(self.loops)


class Relief(Protocol):
    """Heights over the plane, in members."""

    def slope(self, xy: Floats) -> Floats:
        """How steep the surface rises at places (K, 2), (K, 2)."""

    def lift(self, xy: Floats) -> Floats:
        """Places on the surface (K, 3)."""


@dataclass(frozen=True, eq=False)
class Heights:
    """A sum of waves over the plane, in members."""

    waves: Floats  #: (M, 2) wave vectors
    phases: Floats  #: (M,)
    rises: Floats  #: (M,)

    def at(self, xy: Floats) -> Floats:
        """Heights over places (K, 2)."""
        return np.asarray(np.sin(xy @ self.waves.T + self.phases) @ self.rises)

    def slope(self, xy: Floats) -> Floats:
        """How steep the surface rises, (K, 2)."""
        return np.asarray((np.cos(xy @ self.waves.T + self.phases) * self.rises) @ self.waves)

    def lift(self, xy: Floats) -> Floats:
        """Places on the surface (K, 3)."""
        return np.column_stack([xy, self.at(xy)])


def random_heights(rng: np.random.Generator) -> Heights:
    """Return waves of 6 to 30 members that keep to BEND and SLOPE, however they add up."""
    count = int(rng.integers(1, 6))
    size = 2 * np.pi / np.exp(rng.uniform(np.log(6), np.log(30), count))
    turn = rng.uniform(0, 2 * np.pi, count)
    rises = rng.uniform(0.2, 1, count) / size**1.5
    scale = rng.uniform(0.05, 1) * min(BEND / (rises * size**2).sum(), SLOPE / (rises * size).sum())
    waves = size[:, None] * np.column_stack([np.cos(turn), np.sin(turn)])
    return Heights(waves, rng.uniform(0, 2 * np.pi, count), scale * rises)


def random_ring(rng: np.random.Generator, radius: float, waves: int, strength: float) -> Callable[[Floats], Floats]:
    """Return the radius of a closed smooth curve around its middle, of any angles."""
    numbers = np.arange(2, 2 + waves)
    sizes = strength * rng.uniform(-1, 1, waves) / numbers
    phases = rng.uniform(0, 2 * np.pi, waves)
    return lambda t: np.asarray(radius * (1 + np.cos(np.multiply.outer(t, numbers) + phases) @ sizes))


def narrowest(curve: Floats) -> float:
    """Least distance of places (K, d) of a closed curve that have more than half as much again of a circle's way between them."""
    steps = np.linalg.norm(np.roll(curve, -1, axis=0) - curve, axis=1)
    along = np.concatenate([[0.0], np.cumsum(steps)[:-1]])
    way = np.abs(along[:, None] - along)
    way = np.minimum(way, steps.sum() - way)
    apart = np.linalg.norm(curve[:, None] - curve, axis=2)
    return float(np.where(way > 1.6 * np.maximum(apart, 0.5), apart, np.inf).min())


def polar(ring: Callable[[Floats], Floats], middle: Floats, t: Floats) -> Floats:
    """Places of a ring (K, 2)."""
    return np.asarray(middle + ring(t)[:, None] * np.column_stack([np.cos(t), np.sin(t)]))


def inside(ring: Callable[[Floats], Floats], middle: Floats, xy: Floats) -> Any:
    """Whether places (K, 2) lie inside a ring."""
    arm = xy - middle
    rim = np.append(ring(ROUND), ring(ROUND[:1]))
    return np.hypot(*arm.T) < np.interp(
        np.arctan2(arm[:, 1], arm[:, 0]) % (2 * np.pi), np.append(ROUND, 2 * np.pi), rim
    )


def random_outline(rng: np.random.Generator, radius: float, heights: Heights) -> Callable[[Floats], Floats]:
    """Return an outer boundary no part of which is narrower than NECK, ever rounder until that holds."""
    strength = rng.uniform(0.1, 1.1)
    while True:
        ring = random_ring(rng, radius, 5, strength)
        if ring(ROUND).min() > 0.3 * radius and narrowest(heights.lift(polar(ring, np.zeros(2), ROUND[::2]))) >= NECK:
            return ring
        strength *= 0.95


def random_holes(
    rng: np.random.Generator, outline: Floats, room: Callable[[Floats], Any], wanted: int
) -> list[tuple[Callable[[Floats], Floats], Floats]]:
    """Return at most `wanted` holes that keep NECK from the outline (K, 2) and each other, as far as they have room."""
    found: list[tuple[Callable[[Floats], Floats], Floats]] = []
    rims = [outline]
    for _ in range(200 * wanted):
        if len(found) == wanted:
            break
        middle, radius = rng.uniform(outline.min(axis=0), outline.max(axis=0)), rng.uniform(1.2, 3)
        ring = random_ring(rng, radius, 2, 0.3)
        if min(np.hypot(*(r - middle).T).min() for r in rims) < NECK + 0.7 * radius:
            continue
        rim = polar(ring, middle, ROUND[::6])
        if room(rim).all() and min(np.linalg.norm(rim[:, None] - r, axis=2).min() for r in rims) >= NECK:
            found.append((ring, middle))
            rims.append(rim)
    return found


def sample(
    rng: np.random.Generator,
    heights: Relief,
    kept: Callable[[Floats], Any],
    half: float,
    density: float,
    facts: dict[str, float],
    steepest: float = np.hypot(1, SLOPE),
) -> Floats:
    """Return places on the kept part of the surface (N, 3), at least `density` of them a member squared.

    `steepest`: the most area over an area of the plan.
    """
    ratio, even = facts["density ratio"], facts["even"] > 0
    most = density * ratio * steepest
    if even:
        side = np.arange(-half, half, 1 / np.sqrt(most))
        xy = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
        xy = xy + rng.uniform(-0.5, 0.5, xy.shape) / np.sqrt(most)
    else:
        xy = rng.uniform(-half, half, (int(most * (2 * half) ** 2), 2))
    thin = ratio ** ((xy[:, 0] - half) / (2 * half))
    xy = xy[rng.random(len(xy)) < thin]
    xy = xy[kept(xy)]
    steep = np.hypot(1, np.linalg.norm(heights.slope(xy), axis=1)) / steepest
    return rng.permutation(heights.lift(xy[rng.random(len(xy)) < steep]))


def random_motion(rng: np.random.Generator) -> tuple[Motion, Motion, float]:
    """Return a motion from members into the frame of a scan, the way back, and the member length there."""
    turn, upper = np.linalg.qr(rng.normal(size=(3, 3)))
    turn *= np.sign(np.diag(upper))
    turn[:, 0] *= np.linalg.det(turn)
    length = float(10 ** rng.uniform(-2, 3))
    shift = length * rng.normal(size=3) * float(rng.choice([0, 30, 1e6]))
    return (
        lambda p: np.asarray(length * (p @ turn.T) + shift),
        lambda p: np.asarray((p - shift) @ turn / length),
        length,
    )


def random_surface(seed: int) -> RandomSurface:
    """Return the surface of a seed; the same seed gives the same bytes."""
    rng = np.random.default_rng([seed, 5818627])
    heights = random_heights(rng)
    radius = rng.uniform(6, 14)
    facts = {
        "radius": radius,
        "noise": float(rng.choice([0.0, rng.uniform(0, NOISE)], p=[0.2, 0.8])),
        "density": float(np.exp(rng.uniform(np.log(20), np.log(120)))),
        "density ratio": float(np.exp(rng.uniform(0, np.log(4)))),
        "even": float(rng.random() < 0.5),
    }
    outer = random_outline(rng, radius, heights)
    rim = polar(outer, np.zeros(2), ROUND)
    holes = random_holes(rng, rim[::3], lambda xy: inside(outer, np.zeros(2), xy), int(rng.integers(0, 5)))

    def kept(xy: Floats) -> Any:
        there = inside(outer, np.zeros(2), xy)
        for ring, middle in holes:
            there &= ~inside(ring, middle, xy)
        return there

    points = sample(rng, heights, kept, float(np.abs(rim).max()), facts["density"], facts)
    points += facts["noise"] * rng.normal(size=points.shape)
    motion, back, length = random_motion(rng)

    def distance(p: Floats) -> Floats:
        own = back(p)
        return np.asarray(
            length
            * np.abs(own[:, 2] - heights.at(own[:, :2]))
            / np.hypot(1, np.linalg.norm(heights.slope(own[:, :2]), axis=1))
        )

    rims = [rim, *(polar(ring, middle, ROUND) for ring, middle in holes)]
    return RandomSurface(
        name=f"seed {seed}",
        points=np.ascontiguousarray(motion(points)),
        length=length,
        noise=length * facts["noise"],
        loops=[motion(heights.lift(r)) for r in rims],
        distance=distance,
        facts={**facts, "holes": float(len(holes)), "neck": narrowest(heights.lift(rim[::2]))},
    )
