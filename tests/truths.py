"""Shapes described once, as a true surface and what a right grid of it must be: of the paper and of geometry."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from surfaces import Floats, Lift, Surface, cut, disc, joined, sheet

STEP = 1 / 12  # edge of the dense true triangles, in members


@dataclass(frozen=True, eq=False)
class Truth:
    """What is known of a shape: the surface, and what a right grid of it must be."""

    pieces: tuple[Surface, ...]  #: surfaces that points are taken from, before any cut
    length: float  #: member that suits the shape [scan unit]
    noise: float = 0.02  #: standard deviation of each coordinate [scan unit]
    count: int = 100_000  #: number of points
    keep: Callable[[Floats], Floats] | None = None  #: points and surface are kept where this is positive
    corners: Floats = field(default_factory=lambda: np.zeros((0, 3)))  #: (C, 3) true corners of the boundary
    fixed: Floats = field(default_factory=lambda: np.zeros((0, 3)))  #: (F, 3) positions that must become nodes
    orientable: bool = True
    unit: str = "mm"
    weight: Lift | None = None  #: relative density of the points at positions (K, 3)
    spread: tuple[float, float] | None = (
        None  #: points keep apart as the vertices of a mesh do, within these bounds of unevenness
    )
    seen: Callable[[Floats], Floats] | None = None  #: points, not the surface, are kept where this is positive
    plants: tuple[float, float, float] | None = (
        None  #: share of the points that stand above the ground, and from and to which height
    )
    known_loops: bool = True  #: False: the boundary follows from what the scanner saw

    @property
    def surface(self) -> Surface:
        """The true surface, cut."""
        whole = self.pieces[0] if len(self.pieces) == 1 else joined(*self.pieces)
        return whole if self.keep is None else cut(whole, self.keep)


def dense(corners: list[tuple[float, float]] | Floats, step: float) -> Floats:
    """Return a closed polygon (n, 2) divided into steps; its corners stay."""
    around = np.asarray(corners, np.float64)
    parts = []
    for a, b in zip(around, np.roll(around, -1, axis=0), strict=True):
        parts.append(
            a + np.linspace(0, 1, max(1, round(np.linalg.norm(b - a) / step)), endpoint=False)[:, None] * (b - a)
        )
    return np.concatenate(parts)


def height(z: Callable[[Floats, Floats], Floats]) -> Lift:
    return lambda xy: np.stack([xy[:, 0], xy[:, 1], z(xy[:, 0], xy[:, 1])], axis=1)


def outside_ellipse(
    centre: tuple[float, float], radii: tuple[float, float], turn: float = 0.0
) -> Callable[[Floats], Floats]:
    """Return a function of positions, positive outside an elliptic hole seen from above."""
    c, s = np.cos(turn), np.sin(turn)

    def outside(p: Floats) -> Floats:
        x, y = p[:, 0] - centre[0], p[:, 1] - centre[1]
        return np.asarray(((c * x + s * y) / radii[0]) ** 2 + ((c * y - s * x) / radii[1]) ** 2 - 1)

    return outside


def plate(
    corners: list[tuple[float, float]],
    lift: Lift,
    length: float,
    centre: tuple[float, float] = (0.0, 0.0),
    **more: Any,
) -> Truth:
    """Return a shape over a polygon that `centre` sees whole; every vertex of the polygon is a corner."""
    outline = dense(corners, length * STEP)
    rings = int(np.ceil(np.linalg.norm(outline - centre, axis=1).max() / (length * STEP)))
    return Truth(
        (disc(outline, np.array(centre), rings, lift),), length, corners=lift(np.array(corners, np.float64)), **more
    )


def scallop() -> Truth:
    """Return example 1: a ribbed valve of about 100 mm with ears at the hinge: four corners, two of them re-entrant."""
    length = 4.7
    turn = np.linspace(np.arctan2(-45 / 51.1, 24 / 50.6) + 1e-9, np.pi - np.arctan2(-45 / 51.1, 24 / 50.6), 1600)
    body = np.stack([50.6 * np.cos(turn), 5 + np.where(turn % (2 * np.pi) < np.pi, 43, 51.1) * np.sin(turn)], axis=1)
    ears = np.array([body[-1], (-25.0, -50.5), (23.0, -50.5), body[0]])
    outline = np.concatenate(
        [
            body[:-1],
            *(
                dense(ears[k : k + 2], length * STEP)[
                    : int(np.ceil(np.hypot(*(ears[k + 1] - ears[k])) / length / STEP))
                ]
                for k in range(3)
            ),
        ]
    )

    def z(x: Floats, y: Floats) -> Floats:
        away = np.hypot(x, y + 55)
        rib = 1.6 * np.cos(30 * np.arctan2(x, y + 55)) * np.clip((away - 25) / 50, 0, 1) ** 2
        return np.asarray(3 + 23 * np.exp(-(x**2) / (2 * 37.0**2) - (y + 8) ** 2 / (2 * 33.0**2)) + rib)

    lift = height(z)
    surface = disc(outline, np.array([0.0, 0.0]), int(55 / (length * STEP)), lift)
    near_boundary = np.array([48.3, 14.0])  # about half a member from the boundary: the paper's node a
    fixed = lift(np.array([near_boundary, (-12.0, 15.0), (8.0, -20.0)]))
    return Truth((surface,), length, count=120_000, corners=lift(ears), fixed=fixed)


def two_holes() -> Truth:
    """Return example 5: the scallop with two holes cut into it."""
    first, second = outside_ellipse((-18.0, 9.0), (11.0, 9.0), 0.2), outside_ellipse((16.3, -7.0), (6.4, 8.0), -0.15)
    return replace(scallop(), count=110_000, keep=lambda p: np.minimum(first(p), second(p)), fixed=np.zeros((0, 3)))


def dome(
    radius: Callable[[Floats], Floats],
    profile: Callable[[Floats, Floats], Floats],
    length: float,
    size: float,
    **more: Any,
) -> Truth:
    """Return a shell over a star-shaped outline radius(angle); height profile(share of the radius, angle)."""
    angle = np.linspace(0, 2 * np.pi, int(2 * np.pi * size / (length * STEP)), endpoint=False)
    outline = np.stack([np.cos(angle), np.sin(angle)], axis=1) * radius(angle)[:, None]

    def z(x: Floats, y: Floats) -> Floats:
        theta = np.arctan2(y, x)
        return profile(np.hypot(x, y) / radius(theta), theta)

    return Truth((disc(outline, np.zeros(2), int(size / (length * STEP)), height(z)),), length, **more)


def clam() -> Truth:
    """Return example 2: a small deep valve of about 42 mm with a steep margin and growth rings."""

    def radius(t: Floats) -> Floats:
        return np.asarray(1 / np.hypot(np.cos(t) / 21.5, np.sin(t) / 16.6) * (1 + 0.03 * np.sin(3 * t - 0.4)))

    def profile(s: Floats, t: Floats) -> Floats:
        return np.asarray(15.2 - (8.0 + 1.7 * np.cos(t - 3.6)) * s**2.8 + 0.1 * np.sin(9 * np.pi * s**2) * s**2)

    return dome(radius, profile, 1.9, 21.5, noise=0.01, count=120_000)


def limpet() -> Truth:
    """Return example 3: an oval shell of about 96 x 74 mm with a nearly pointed apex."""

    def radius(t: Floats) -> Floats:
        return np.asarray(1 / np.hypot(np.cos(t) / 48, np.sin(t) / 37) * (1 + 0.03 * np.cos(t) + 0.02 * np.cos(2 * t)))

    def profile(s: Floats, t: Floats) -> Floats:
        return np.asarray(30.5 - (21.0 + 5.0 * np.cos(t) * s) * (np.sqrt(1.2 * s**2 + 0.04) - 0.2 + 0.15 * s**2))

    return dome(radius, profile, 3.9, 48.0, count=120_000)


def stadium() -> Truth:
    """Return example 6: the limpet with an elliptic hole."""
    return replace(limpet(), count=100_000, keep=outside_ellipse((0.5, 0.0), (20.0, 12.3)))


def cloth() -> Truth:
    """Return example 4: the plaster of a rectangular cloth hung from its four corners; the free edges pull in."""
    length, share = 2.75, np.linspace(-1, 1, 320, endpoint=False)
    low, right = (
        np.stack([45 * share, -33 + 4 * (1 - share**2)], axis=1),
        np.stack([45 - 4.5 * (1 - share**2), 33 * share], axis=1),
    )
    outline = np.concatenate([low, right, -low, -right])

    def z(x: Floats, y: Floats) -> Floats:
        a, b = (x / 45) ** 2, (y / 33) ** 2
        return np.asarray(24 * (1 - 0.787 * (a + b) + 0.574 * a * b))

    lift = height(z)
    surface = disc(outline, np.zeros(2), int(56 / (length * STEP)), lift)
    return Truth(
        (surface,), length, count=120_000, corners=lift(np.array([(-45.0, -33.0), (45, -33), (45, 33), (-45, 33)]))
    )


def great_court() -> Truth:
    """Return the roof of the Great Court after Williams, heights roughly: a rectangle outside, a circle inside."""
    a, b, c, d, length = 22.245, 36.625, 46.025, 51.125, 2.0
    corners = np.array([(-b, -d), (b, -d), (b, c), (-b, c)])
    outline = dense(corners, length * STEP)
    inner = a * outline / np.linalg.norm(outline, axis=1)[:, None]

    def z(x: Floats, y: Floats) -> Floats:
        r = np.maximum(np.hypot(x, y), a)
        level = (1 - x / b) * (1 + x / b) * (1 - y / c) * (1 + y / d)
        level = level / np.maximum(
            (1 - a * x / (r * b)) * (1 + a * x / (r * b)) * (1 - a * y / (r * c)) * (1 + a * y / (r * d)), 1e-12
        )
        east, west, north, south = (np.maximum(v, 1e-9) for v in (b - x, b + x, c - y, d + y))
        inverse = sum(np.hypot(u, v) / (u * v) for u in (east, west) for v in (north, south))
        return np.asarray(19.71 + 1.245 * level + (r / a - 1) / inverse * 2.1 * (1 + 0.25 * np.sin(np.arctan2(y, x))))

    lift = height(z)
    surface = disc(outline, inner, int(44 / (length * STEP)), lift)
    return Truth((surface,), length, noise=0.004, count=150_000, corners=lift(corners), unit="m")


def _angles(m: int, n: int, low: float = 0.0, high: float = 2 * np.pi) -> Floats:
    return np.stack(np.meshgrid(np.linspace(low, high, m), np.linspace(0, 2 * np.pi, n), indexing="ij"), axis=-1)


def sphere() -> Truth:
    """Return a closed sphere of radius 50."""

    def lift(q: Floats) -> Floats:
        return 50 * np.stack(
            [np.sin(q[:, 0]) * np.cos(q[:, 1]), np.sin(q[:, 0]) * np.sin(q[:, 1]), np.cos(q[:, 0])], axis=1
        )

    return Truth((sheet(_angles(300, 600, 0, np.pi), lift, closed=(False, True)),), 6.0)


def torus() -> Truth:
    """Return a closed torus, radii 40 and 15."""

    def lift(q: Floats) -> Floats:
        ring = 40 + 15 * np.cos(q[:, 0])
        return np.stack([ring * np.cos(q[:, 1]), ring * np.sin(q[:, 1]), 15 * np.sin(q[:, 0])], axis=1)

    return Truth((sheet(_angles(240, 800), lift, closed=(True, True)),), 5.0, count=120_000)


def moebius() -> Truth:
    """Return a strip that turns by 180 degrees: one side, one boundary, Euler number 0."""

    def lift(q: Floats) -> Floats:
        ring = 40 + q[:, 1] * np.cos(q[:, 0] / 2)
        return np.stack([ring * np.cos(q[:, 0]), ring * np.sin(q[:, 0]), q[:, 1] * np.sin(q[:, 0] / 2)], axis=1)

    table = np.stack(np.meshgrid(np.linspace(0, 2 * np.pi, 1300), np.linspace(-13, 13, 131), indexing="ij"), axis=-1)
    return Truth((sheet(table, lift, closed=(True, False), twisted=True),), 4.0, count=80_000, orientable=False)


def saddle() -> Truth:
    """Return a saddle with a sharp bump and a pit whose radius is about one member."""

    def z(x: Floats, y: Floats) -> Floats:
        bump = 7 * np.exp(-((x - 14) ** 2 + (y + 10) ** 2) / 18) - 6 * np.exp(-((x + 16) ** 2 + (y - 17.5) ** 2) / 18)
        return np.asarray(0.0112 * (x**2 - y**2) + bump)

    return plate([(-50.0, -50.0), (50, -50), (50, 50), (-50, 50)], height(z), 4.0, count=120_000)


def two_patches() -> Truth:
    """Return two separate curved patches, 5.7 mm apart."""

    def first(t: Floats) -> Floats:
        return 26 + 3 * np.cos(3 * t)

    def second(t: Floats) -> Floats:
        return 17 + 0 * t

    one = dome(first, lambda s, t: 8 - (4.5 + 1.5 * np.cos(t)) * s**2, 3.0, 28.0).pieces[0]
    lift = height(lambda x, y: 5 + 6.4 * np.sin((x * np.cos(0.3) + y * np.sin(0.3)) / 12.5))
    other = dome(second, lambda s, t: 0 * s, 3.0, 17.0).pieces[0]
    assert other.parameters is not None and other.lift is not None
    flat = other.nodes

    def shifted(q: Floats) -> Floats:
        return np.asarray(lift(q) + np.array([51.7, 6, 0]))

    return Truth((one, replace(other, nodes=shifted(flat[:, :2]), lift=shifted)), 3.0, count=80_000)


def thin_strip() -> Truth:
    """Return a helical strip 6 mm wide, narrower than two members: four corners."""
    turns, radius, rise = 1.57, 34.5, 60.0
    run = np.hypot(2 * np.pi * turns * radius, rise)
    slope = np.array([2 * np.pi * turns * radius, rise]) / run

    def lift(q: Floats) -> Floats:
        around, up = q[:, 0] * slope[0] - q[:, 1] * slope[1], q[:, 0] * slope[1] + q[:, 1] * slope[0]
        return np.stack([radius * np.cos(around / radius), radius * np.sin(around / radius), up], axis=1)

    table = np.stack(np.meshgrid(np.linspace(0, run, 1750), np.linspace(-3, 3, 31), indexing="ij"), axis=-1)
    return Truth((sheet(table, lift),), 4.0, count=60_000, corners=lift(table[[0, 0, -1, -1], [0, -1, 0, -1]]))


def fold_over() -> Truth:
    """Return a U of two sheets 2.5 mm apart, nearer than a member."""

    def lift(q: Floats) -> Floats:
        s, bend = q[:, 0], 1.25 * np.pi
        turn = np.clip(s / 1.25, -np.pi / 2, np.pi / 2)
        past = np.maximum(np.abs(s) - bend / 2, 0)
        return np.stack([past - 1.25 * np.cos(turn), q[:, 1], 1.25 + 1.25 * np.sin(turn)], axis=1)

    reach = 40 + 1.25 * np.pi / 2
    corners = [(-reach, -25.0), (reach, -25.0), (reach, 25.0), (-reach, 25.0)]
    return plate(corners, lift, 4.0, count=140_000)


def gable() -> Truth:
    """Return a gable roof: two planes, a sharp ridge that ends in two corners."""
    corners = [(-40.0, -30.0), (0, -30), (40, -30), (40, 30), (0, 30), (-40, 30)]
    return plate(corners, height(lambda x, y: 30 - 0.9 * np.abs(x)), 5.0, count=80_000)


def pantheon() -> Truth:
    """Return a hemispherical dome with an oculus, upright at the springing."""

    def lift(q: Floats) -> Floats:
        return 50 * np.stack(
            [np.sin(q[:, 0]) * np.cos(q[:, 1]), np.sin(q[:, 0]) * np.sin(q[:, 1]), np.cos(q[:, 0])], axis=1
        )

    return Truth((sheet(_angles(300, 1200, np.arcsin(9 / 50), np.pi / 2), lift, closed=(False, True)),), 5.0)


def l_plate() -> Truth:
    """Return a hypar over an L: five corners and a re-entrant one."""
    corners = [(-40.0, -40.0), (40, -40), (40, 0), (0, 0), (0, 40), (-40, 40)]
    return plate(corners, height(lambda x, y: 5.33 + 0.00889 * x * y), 5.0, centre=(-20.0, -20.0), count=80_000)


def flat_plate() -> Truth:
    """Return a plate without noise, all points exactly in a plane."""
    return plate(
        [(-30.0, -20.0), (30, -20), (30, 20), (-30, 20)], height(lambda x, y: 0 * x), 4.0, count=60_000, noise=0.0
    )


def terrain() -> Truth:
    """Return rolling terrain of 300 x 200 m."""

    def z(x: Floats, y: Floats) -> Floats:
        return np.asarray(
            2.6 * np.sin(x / 23 + 0.4) * np.cos(y / 31)
            + 1.7 * np.sin((x + 2 * y) / 37)
            + 1.2 * np.sin((2 * x - y) / 29 + 1)
        )

    corners = [(-150.0, -100.0), (150, -100), (150, 100), (-150, 100)]
    return plate(corners, height(z), 8.0, count=200_000, noise=0.05, unit="m")


PAPER = (scallop, clam, limpet, cloth, two_holes, stadium)
OTHERS = (
    great_court,
    sphere,
    torus,
    saddle,
    two_patches,
    thin_strip,
    gable,
    pantheon,
    l_plate,
    flat_plate,
    terrain,
    moebius,
    fold_over,
)
