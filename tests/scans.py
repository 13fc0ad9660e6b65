"""Shapes of clouds that look like real scans: bodies, busts, shells as mesh vertices, hillsides, single views.

Sizes are those of common scans; seeds inside the generators are part of the shape.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from surfaces import Floats, Surface, from_field
from truths import Truth, dome, height, plate, scallop

Field = Callable[[Floats], Floats]


def _ball(centre: Sequence[float], radii: Sequence[float], turn: float = 0.0) -> Field:
    """Return roughly the signed distance to an ellipsoid, turned about y [degree]."""
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    frame = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])

    def distance(p: Floats) -> Floats:
        q = (p - np.array(centre)) @ frame
        inner, outer = np.linalg.norm(q / radii, axis=1), np.linalg.norm(q / np.square(radii), axis=1)
        return np.where(inner > 1e-6, inner * (inner - 1) / np.maximum(outer, 1e-12), -min(radii))

    return distance


def _limb(*path: Sequence[float], radius: float) -> Field:
    """Return the signed distance to a tube of one radius along a path of positions."""
    places = np.array(path, np.float64)

    def distance(p: Floats) -> Floats:
        nearest = np.full(len(p), np.inf)
        for a, b in pairwise(places):
            share = np.clip((p - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
            nearest = np.minimum(nearest, np.linalg.norm(p - a - share[:, None] * (b - a), axis=1))
        return np.asarray(nearest - radius)

    return distance


def _union(*fields: Field, soft: float) -> Field:
    """Return the union of bodies with seams rounded over about `soft`."""

    def distance(p: Floats) -> Floats:
        result = fields[0](p)
        for other in fields[1:]:
            value = other(p)
            share = np.clip(0.5 + 0.5 * (value - result) / soft, 0, 1)
            result = value * (1 - share) + result * share - soft * share * (1 - share)
        return np.asarray(result)

    return distance


def _rough(field: Field, size: float, rise: float, seed: int, waves: int = 12) -> Field:
    """Return a body with bumps of about `size` and `rise` all over."""
    rng = np.random.default_rng(seed)
    direction = rng.normal(size=(waves, 3))
    direction *= (2 * np.pi / (size * rng.uniform(0.7, 1.6, waves)) / np.linalg.norm(direction, axis=1))[:, None]
    phase = rng.uniform(0, 2 * np.pi, waves)
    return lambda p: np.asarray(field(p) + rise * np.sqrt(2 / waves) * np.sin(p @ direction.T + phase).sum(axis=1))


def _wavy(seed: int, octaves: Sequence[tuple[float, float]]) -> Callable[[Floats, Floats], Floats]:
    """Return heights over a plane, a sum of waves (length, height)."""
    rng = np.random.default_rng(seed)
    parts = []
    for length, rise in octaves:
        for _ in range(6):
            angle, phase = rng.uniform(0, 2 * np.pi, 2)
            parts.append(
                (
                    2 * np.pi / (length * rng.uniform(0.8, 1.3)) * np.array([np.cos(angle), np.sin(angle)]),
                    phase,
                    rise / 1.8,
                )
            )
    return lambda x, y: np.asarray(sum(h * np.sin(k[0] * x + k[1] * y + phase) for k, phase, h in parts))


STATUE = _union(
    _ball((0, 0, 0), (26, 22, 34)),
    _ball((4, 0, 46), (17, 15, 17)),
    _limb((6, 20, 14), (24, 24, -4), (30, 8, -16), radius=6),
    _limb((6, -20, 14), (26, -22, 2), (32, -12, 16), radius=6),
    _ball((20, 0, 45), (5, 4, 4)),
    _ball((0, 0, -36), (28, 26, 8)),
    soft=8.0,
)


def statuette() -> Truth:
    """Return a closed small figure with a head, two arms that touch the body, folds; Euler number 2."""
    body = _rough(STATUE, 14, 0.8, 3)
    return Truth(
        (from_field(body, np.array([-36.0, -36, -52]), np.array([46.0, 36, 72]), 1.0),), 5.0, count=60_000, noise=0.03
    )


def cat() -> Truth:
    """Return a closed small cat: a tail makes a handle (Euler number 0), ears are about one member thick."""
    body = _union(
        _ball((0, 0, 0), (0.22, 0.18, 0.3)),
        _ball((0.06, 0, 0.38), (0.16, 0.15, 0.14)),
        _ball((0.05, 0.11, 0.53), (0.035, 0.06, 0.1)),
        _ball((0.05, -0.11, 0.53), (0.035, 0.06, 0.1)),
        _ball((0.16, 0.08, -0.25), (0.12, 0.06, 0.06)),
        _ball((0.16, -0.08, -0.25), (0.12, 0.06, 0.06)),
        _limb((-0.15, 0, -0.2), (-0.33, 0, -0.18), (-0.38, 0, 0.0), (-0.32, 0, 0.14), (-0.14, 0, 0.17), radius=0.055),
        soft=0.05,
    )
    surface = from_field(_rough(body, 0.15, 0.006, 5), np.array([-0.5, -0.3, -0.4]), np.array([0.4, 0.3, 0.75]), 0.0125)
    return Truth((surface,), 0.07, count=5_200, noise=0.0, unit="", spread=(0.45, 0.9))


def bust() -> Truth:
    """Return a bust as the vertices of a coarse uneven mesh, open at the base with a ragged cut: one loop."""
    head = _union(
        _ball((0, 0, 0.75), (0.5, 0.42, 0.62)),
        _ball((0.42, 0, 0.7), (0.16, 0.09, 0.2)),
        _limb((0, 0, 0.3), (-0.05, 0, -0.6), radius=0.27),
        _ball((-0.1, 0, -0.85), (0.45, 0.85, 0.4)),
        _limb((0.3, 0.2, 0.25), (0.4, 0, 0.12), (0.3, -0.2, 0.25), radius=0.1),
        soft=0.15,
    )
    surface = from_field(_rough(head, 0.22, 0.014, 8), np.array([-0.8, -1.1, -1.45]), np.array([0.8, 1.1, 1.5]), 0.03)
    base = _wavy(4, ((0.6, 0.03), (0.17, 0.02)))
    return Truth(
        (surface,),
        0.15,
        count=8_400,
        noise=0.001,
        unit="",
        keep=lambda p: p[:, 2] + 1.05 - base(p[:, 0], p[:, 1]),
        spread=(0.7, 1.2),
    )


def rabbit() -> Truth:
    """Return a body with thin ears, three large openings in its base and small drop-outs that a grid closes."""
    length = 0.006
    body = _union(
        _ball((0, 0, 0), (0.06, 0.048, 0.05)),
        _ball((-0.045, 0, 0.045), (0.032, 0.026, 0.028)),
        _ball((-0.03, 0.014, 0.085), (0.0055, 0.011, 0.03), 15),
        _ball((-0.03, -0.014, 0.085), (0.0055, 0.011, 0.03), 15),
        _ball((0.06, 0, -0.015), (0.014, 0.014, 0.014)),
        _ball((0, 0, -0.04), (0.062, 0.05, 0.018)),
        soft=0.012,
    )
    surface = from_field(
        _rough(body, 0.012, 0.0005, 2), np.array([-0.1, -0.07, -0.075]), np.array([0.09, 0.07, 0.13]), 0.0015
    )
    openings = [((-0.03, 0.0, -0.058), 0.015), ((0.03, 0.012, -0.058), 0.017), ((0.005, -0.027, -0.058), 0.009)]

    def keep(p: Floats) -> Floats:
        return np.asarray(np.min([np.linalg.norm(p - np.array(c), axis=1) - r for c, r in openings], axis=0))

    rng = np.random.default_rng(6)
    spots = surface.nodes[rng.choice(len(surface.nodes), 14)]

    def seen(p: Floats) -> Floats:
        near = np.min([np.linalg.norm(p - spot, axis=1) for spot in spots], axis=0)
        return np.asarray(near - 0.25 * length)

    return Truth((surface,), length, count=34_000, noise=0.0001, unit="m", keep=keep, seen=seen)


def valve_vertices() -> Truth:
    """Return a small scallop valve as mesh vertices, about five to a member."""
    small = scallop()
    return replace(small, count=7_600, noise=0.02, spread=(0.85, 1.1), fixed=np.zeros((0, 3)))


def mask() -> Truth:
    """Return a face-like mask as mesh vertices with a steep margin and a ragged boundary."""
    ragged = _wavy(11, ((0.9, 0.02), (0.25, 0.015)))

    def radius(t: Floats) -> Floats:
        return np.asarray(1 / np.hypot(np.cos(t) / 68, np.sin(t) / 88) * (1 + ragged(np.cos(t), np.sin(t))))

    def profile(s: Floats, t: Floats) -> Floats:
        x, y = 68 * s * np.cos(t), 88 * s * np.sin(t)
        nose = 22 * np.exp(-((x / 11) ** 2) - ((y + 6) / 20) ** 2) - 7 * np.exp(
            -(((np.abs(x) - 28) / 13) ** 2) - ((y - 18) / 10) ** 2
        )
        return np.asarray(80 - 70 * np.abs(s) ** 3.2 + nose + 2.5 * np.exp(-((x / 24) ** 2) - ((y + 42) / 5) ** 2))

    return dome(radius, profile, 7.0, 88.0, count=10_400, noise=0.05, spread=(0.75, 1.2))


def hillside() -> Truth:
    """Return lidar ground: rough, an irregular ragged boundary with bays, two strips of uneven density."""
    ragged = _wavy(21, ((2.0, 0.16), (0.5, 0.04), (0.12, 0.012)))
    mesh = _wavy(22, ((260, 16), (90, 5), (30, 1.0), (13, 0.35)))

    def radius(t: Floats) -> Floats:
        return np.asarray(
            1
            / (np.abs(np.cos(t) / 146) ** 4 + np.abs(np.sin(t) / 100) ** 4) ** 0.25
            * (1 + ragged(np.cos(t), np.sin(t)))
        )

    def profile(s: Floats, t: Floats) -> Floats:
        x, y = s * radius(t) * np.cos(t), s * radius(t) * np.sin(t)
        return mesh(x, y) + 0.35 * x

    return dome(
        radius,
        profile,
        8.0,
        150.0,
        count=38_000,
        noise=0.08,
        unit="m",
        weight=lambda p: 1 + 2.0 * (np.abs(p[:, 1] - 0.3 * p[:, 0]) < 40),
    )


def wooded_hillside() -> Truth:
    """Return the hillside with plants: 8 % of the points stand 0.5 to 12 m above the ground."""
    return replace(hillside(), plants=(0.08, 0.5, 12.0))


def quarry() -> Truth:
    """Return ground with a steep wall, a bay in the boundary and two inner gaps without points."""
    mesh = _wavy(31, ((200, 10), (60, 3)))

    def z(x: Floats, y: Floats) -> Floats:
        return np.asarray(mesh(x, y) + 30 * np.tanh((x + 30 * np.sin(y / 60)) / 18))

    def keep(p: Floats) -> Floats:
        x, y = p[:, 0], p[:, 1]
        bay = np.hypot((x - 210) / 90, (y - 20) / 35) - 1
        pond, barn = np.hypot((x + 90) / 34, (y + 80) / 45) - 1, np.hypot((x + 60) / 40, (y - 110) / 28) - 1
        return np.asarray(np.minimum(np.minimum(bay, pond), barn))

    corners = [(-210.0, -230.0), (210, -230), (210, 230), (-210, 230)]
    return replace(
        plate(corners, height(z), 12.0, centre=(0.0, 0.0), count=33_000, noise=0.1, unit="m"),
        keep=keep,
        corners=np.zeros((0, 3)),
    )


def view() -> Truth:
    """Return what a scanner sees of the figure from one side: ragged boundary, shadow gaps, no known number of loops."""
    figure = statuette()
    body: Surface = figure.pieces[0]
    assert body.project is not None
    direction = np.array([0.85, 0.3, 0.4]) / np.linalg.norm([0.85, 0.3, 0.4])

    bumpy, low, high = _rough(STATUE, 14, 0.8, 3), body.nodes.min(axis=0) - 1.0, body.nodes.max(axis=0) + 1.0

    def facing(p: Floats) -> Floats:
        """Positive where no ray towards the scanner enters the figure by a fifth of a unit."""
        seen = np.ones(len(p))
        for step in np.linspace(2.0, 80, 27):
            on_ray = p + step * direction
            left = np.flatnonzero((seen > 0.0) & ((on_ray > low) & (on_ray < high)).all(axis=1))
            seen[left] = bumpy(on_ray[left]) + 0.2
        return seen

    return replace(figure, count=40_000, seen=facing, known_loops=False)


SCANS = (statuette, cat, bust, rabbit, valve_vertices, mask, hillside, wooded_hillside, quarry, view)
