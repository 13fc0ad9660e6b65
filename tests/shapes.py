"""Clouds with known answers: `make("scallop")` gives points and the truth about the surface they were measured on.

Each generator describes the true surface once; every option (number and density of points, noise, outliers, duplicates, pose,
scale, offset) then applies to all shapes alike. The same arguments give the same bytes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import lru_cache

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
    corners: Floats = field(default_factory=lambda: np.zeros((0, 3)))  #: (C, 3) true corners of the rim
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
    euler: int
    components: int
    loops: tuple[Floats, ...]  #: dense true rims, (K, 3) each
    known_loops: bool  #: False: loops and Euler number are not known

    @property
    def area(self) -> float:
        """Area of the true surface."""
        return float(self.surface.areas.sum())

    def distance(self, positions: Floats) -> Floats:
        """Return the distance of positions (K, 3) to the true surface, (K,)."""
        return self.surface.distance(np.asarray(positions, np.float64))


def _dense(corners: list[tuple[float, float]] | Floats, step: float) -> Floats:
    """Return a closed polygon (n, 2) divided into steps; its corners stay."""
    around = np.asarray(corners, np.float64)
    parts = []
    for a, b in zip(around, np.roll(around, -1, axis=0), strict=True):
        parts.append(
            a + np.linspace(0, 1, max(1, round(np.linalg.norm(b - a) / step)), endpoint=False)[:, None] * (b - a)
        )
    return np.concatenate(parts)


def _height(z: Callable[[Floats, Floats], Floats]) -> Lift:
    return lambda xy: np.stack([xy[:, 0], xy[:, 1], z(xy[:, 0], xy[:, 1])], axis=1)


def _ellipse(centre: tuple[float, float], radii: tuple[float, float], turn: float = 0.0) -> Callable[[Floats], Floats]:
    """Return a function of positions, positive outside an elliptic hole seen from above."""
    c, s = np.cos(turn), np.sin(turn)

    def outside(p: Floats) -> Floats:
        x, y = p[:, 0] - centre[0], p[:, 1] - centre[1]
        return np.asarray(((c * x + s * y) / radii[0]) ** 2 + ((c * y - s * x) / radii[1]) ** 2 - 1)

    return outside


def _plate(
    corners: list[tuple[float, float]],
    lift: Lift,
    length: float,
    centre: tuple[float, float] = (0.0, 0.0),
    **more: object,
) -> Truth:
    """Return a shape over a polygon that `centre` sees whole; every vertex of the polygon is a corner."""
    outline = _dense(corners, length * STEP)
    rings = int(np.ceil(np.linalg.norm(outline - centre, axis=1).max() / (length * STEP)))
    return Truth(
        (disc(outline, np.array(centre), rings, lift),), length, corners=lift(np.array(corners, np.float64)), **more
    )  # type: ignore[arg-type]


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
                _dense(ears[k : k + 2], length * STEP)[
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

    lift = _height(z)
    surface = disc(outline, np.array([0.0, 0.0]), int(55 / (length * STEP)), lift)
    near_rim = np.array([48.3, 14.0])  # about half a member from the rim: the paper's node a
    fixed = lift(np.array([near_rim, (-12.0, 15.0), (8.0, -20.0)]))
    return Truth((surface,), length, count=120_000, corners=lift(ears), fixed=fixed)


def two_holes() -> Truth:
    """Return example 5: the scallop with two holes cut into it."""
    first, second = _ellipse((-18.0, 9.0), (11.0, 9.0), 0.2), _ellipse((16.3, -7.0), (6.4, 8.0), -0.15)
    return replace(scallop(), count=110_000, keep=lambda p: np.minimum(first(p), second(p)), fixed=np.zeros((0, 3)))


def _round(
    radius: Callable[[Floats], Floats],
    profile: Callable[[Floats, Floats], Floats],
    length: float,
    size: float,
    **more: object,
) -> Truth:
    """Return a shell over a star-shaped outline radius(angle); height profile(share of the radius, angle)."""
    angle = np.linspace(0, 2 * np.pi, int(2 * np.pi * size / (length * STEP)), endpoint=False)
    outline = np.stack([np.cos(angle), np.sin(angle)], axis=1) * radius(angle)[:, None]

    def z(x: Floats, y: Floats) -> Floats:
        theta = np.arctan2(y, x)
        return profile(np.hypot(x, y) / radius(theta), theta)

    return Truth((disc(outline, np.zeros(2), int(size / (length * STEP)), _height(z)),), length, **more)  # type: ignore[arg-type]


def clam() -> Truth:
    """Return example 2: a small deep valve of about 42 mm with a steep margin and growth rings."""

    def radius(t: Floats) -> Floats:
        return np.asarray(1 / np.hypot(np.cos(t) / 21.5, np.sin(t) / 16.6) * (1 + 0.03 * np.sin(3 * t - 0.4)))

    def profile(s: Floats, t: Floats) -> Floats:
        return np.asarray(15.2 - (8.0 + 1.7 * np.cos(t - 3.6)) * s**2.8 + 0.1 * np.sin(9 * np.pi * s**2) * s**2)

    return _round(radius, profile, 1.9, 21.5, noise=0.01, count=120_000)


def limpet() -> Truth:
    """Return example 3: an oval shell of about 96 x 74 mm with a nearly pointed apex."""

    def radius(t: Floats) -> Floats:
        return np.asarray(1 / np.hypot(np.cos(t) / 48, np.sin(t) / 37) * (1 + 0.03 * np.cos(t) + 0.02 * np.cos(2 * t)))

    def profile(s: Floats, t: Floats) -> Floats:
        return np.asarray(30.5 - (21.0 + 5.0 * np.cos(t) * s) * (np.sqrt(1.2 * s**2 + 0.04) - 0.2 + 0.15 * s**2))

    return _round(radius, profile, 3.9, 48.0, count=120_000)


def stadium() -> Truth:
    """Return example 6: the limpet with an elliptic hole."""
    return replace(limpet(), count=100_000, keep=_ellipse((0.5, 0.0), (20.0, 12.3)))


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

    lift = _height(z)
    surface = disc(outline, np.zeros(2), int(56 / (length * STEP)), lift)
    return Truth(
        (surface,), length, count=120_000, corners=lift(np.array([(-45.0, -33.0), (45, -33), (45, 33), (-45, 33)]))
    )


def great_court() -> Truth:
    """Return the roof of the Great Court after Williams: a rectangle outside, a circle inside, heights near the true ones."""
    a, b, c, d, length = 22.245, 36.625, 46.025, 51.125, 2.0
    corners = np.array([(-b, -d), (b, -d), (b, c), (-b, c)])
    outline = _dense(corners, length * STEP)
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

    lift = _height(z)
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

    return _plate([(-50.0, -50.0), (50, -50), (50, 50), (-50, 50)], _height(z), 4.0, count=120_000)


def two_patches() -> Truth:
    """Return two separate curved patches, 5.7 mm apart."""

    def first(t: Floats) -> Floats:
        return 26 + 3 * np.cos(3 * t)

    def second(t: Floats) -> Floats:
        return 17 + 0 * t

    one = _round(first, lambda s, t: 8 - (4.5 + 1.5 * np.cos(t)) * s**2, 3.0, 28.0).pieces[0]
    lift = _height(lambda x, y: 5 + 6.4 * np.sin((x * np.cos(0.3) + y * np.sin(0.3)) / 12.5))
    other = _round(second, lambda s, t: 0 * s, 3.0, 17.0).pieces[0]
    assert other.parameters is not None and other.lift is not None
    flat = other.nodes

    def shifted(q: Floats) -> Floats:
        return np.asarray(lift(q) + [51.7, 6, 0])

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
    return _plate(corners, lift, 4.0, count=140_000)


def gable() -> Truth:
    """Return a gable roof: two planes, a sharp ridge that ends in two corners."""
    corners = [(-40.0, -30.0), (0, -30), (40, -30), (40, 30), (0, 30), (-40, 30)]
    return _plate(corners, _height(lambda x, y: 30 - 0.9 * np.abs(x)), 5.0, count=80_000)


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
    return _plate(corners, _height(lambda x, y: 5.33 + 0.00889 * x * y), 5.0, centre=(-20.0, -20.0), count=80_000)


def flat_plate() -> Truth:
    """Return a plate without noise, all points exactly in a plane."""
    return _plate(
        [(-30.0, -20.0), (30, -20), (30, 20), (-30, 20)], _height(lambda x, y: 0 * x), 4.0, count=60_000, noise=0.0
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
    return _plate(corners, _height(z), 8.0, count=200_000, noise=0.05, unit="m")


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
SHAPES: dict[str, Callable[[], Truth]] = {shape.__name__: shape for shape in (*PAPER, *OTHERS)}


@lru_cache(maxsize=8)
def _truth(name: str) -> tuple[Truth, Surface, tuple[Floats, ...]]:
    if name not in SHAPES:
        import scans  # adds the clouds that look like scans

        assert name in SHAPES, f"no shape {name!r} in shapes or {scans.__name__}"
    truth = SHAPES[name]()
    surface = truth.surface
    return truth, surface, tuple(surface.loops)


def _rotation(rng: np.random.Generator) -> Floats:
    """Return a random rotation matrix (3, 3)."""
    turn, upper = np.linalg.qr(rng.normal(size=(3, 3)))
    turn = turn * np.sign(np.diag(upper))
    return np.asarray(turn * [1, 1, np.sign(np.linalg.det(turn))])


def _sample(truth: Truth, count: int, rng: np.random.Generator, weight: Lift | None) -> Floats:
    """Return `count` exact positions on the kept part of the pieces, each piece by its area."""
    area = np.array([piece.areas.sum() for piece in truth.pieces])
    found = np.zeros((0, 3))
    while len(found) < count:
        wanted = int((count - len(found)) * 1.2) + 20
        new = [
            piece.sample(n, rng, weight)
            for piece, n in zip(truth.pieces, rng.multinomial(wanted, area / area.sum()), strict=True)
        ]
        positions = rng.permutation(np.concatenate(new))
        for keep in (truth.keep, truth.seen):
            positions = positions if keep is None else positions[keep(positions) > 0]
        found = np.concatenate([found, positions])
    return found[:count]


def _apart(positions: Floats, radius: Floats) -> Floats:
    """Return those positions (K, 3) that keep `radius` (K,) from each other, earlier ones first: vertices of an even mesh."""
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
    """Return about `count` positions as the vertices of a mesh lie, unevenly large, with its rim."""
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


def make(
    name: str,
    count: int | None = None,
    *,
    noise: float | None = None,
    seed: int = 0,
    pose: bool = False,
    scale: float = 1.0,
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0),
    density_ratio: float = 1.0,
    outliers: float = 0.0,
    duplicates: float = 0.0,
    scan_lines: float = 0.0,
) -> Shape:
    """Return a cloud with its truth.

    Parameters
    ----------
    name : str
        A key of SHAPES.
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
    density_ratio : float
        Points lie this much denser at one end than at the other.
    outliers, duplicates : float
        Added points far from the surface and repeated points, as a share of `count`.
    scan_lines : float
        Distance of parallel lines along x to which points are pulled, 0 for none [unit of the shape].
    """
    truth, surface, loops = _truth(name)
    rng = np.random.default_rng([seed, *name.encode()])
    low, size = surface.nodes.min(axis=0), np.ptp(surface.nodes, axis=0)
    weight = truth.weight if density_ratio == 1 else lambda p: density_ratio ** ((p[:, 0] - low[0]) / size[0])
    wanted = int((count or truth.count) * (8 if scan_lines else 1))
    points = _vertices(truth, surface, wanted, rng) if truth.spread else _sample(truth, wanted, rng, weight)
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
        name=name, points=np.ascontiguousarray(motion(points)), surface=surface.moved(motion), length=truth.length * scale, noise=noise * scale,
        corners=motion(truth.corners), fixed=motion(truth.fixed), orientable=truth.orientable, unit=truth.unit,
        euler=surface.euler, components=surface.components, loops=tuple(map(motion, loops)),
        known_loops=truth.known_loops,
    )  # fmt: skip
