"""Random surfaces with edges and known topology: roofs, folds, vaults, bodies, sharp or filleted, open and closed.

`edged_surface(seed)` gives the points and the truth, all in the frame of the points. No face is narrower than `FACE` members where
folds do not meet in one place, and every fold turns by 30 degrees or more.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from random_surfaces import RandomSurface, random_motion, sample
from scipy.spatial import ConvexHull, HalfspaceIntersection
from surfaces import Floats, sheet

FACE = 4.0  #: least width of a face, but where folds meet in one place [member]
NODES = 300, 3000  #: of the grid, about
PER_NODE = np.sqrt(3) / 2  #: area for a node [member squared]
SPACING_NOISE, MEMBER_NOISE = 0.15, 0.06  #: most noise [spacing], [member]
LOWER = 3.0  #: how far an open body goes on below its boundary before it is cut [member]


@dataclass(frozen=True, eq=False)
class Form:
    """A surface in members."""

    area: float
    face: float  #: width of its narrowest face
    loops: list[Floats]  #: dense boundaries, (K, 3) each
    distance: Callable[[Floats], Floats]
    sample: Callable[[np.random.Generator, float], Floats]  #: points of a density [1 / member squared]


# ---- surfaces over a plan ------------------------------------------------------------------------------------------


def lower(a: Floats, b: Floats, bend: Floats | float) -> Floats:
    """The lower of two heights (K,), rounded where they differ by less than `bend`."""
    bend = np.maximum(bend, 1e-12)
    return np.asarray(np.minimum(a, b) - np.maximum(bend - np.abs(a - b), 0) ** 2 / (4 * bend))


def upper(a: Floats, b: Floats, bend: Floats | float) -> Floats:
    """The upper of two heights (K,), rounded alike."""
    return -lower(-a, -b, bend)


def creased(x: Floats, knots: Floats, values: Floats, fillet: float) -> Floats:
    """A polyline (K,) over x whose corners are rounded with a radius."""
    slopes = np.diff(values) / np.diff(knots)
    heights = values[0] + slopes[0] * (x - knots[0])
    for knot, turn in zip(knots[1:-1], np.diff(slopes), strict=True):
        bend = max(fillet * turn**2 / 2, 1e-12)
        heights = heights + turn * np.maximum(x - knot, 0)
        heights = heights + np.sign(turn) * np.maximum(bend - np.abs(turn * (x - knot)), 0) ** 2 / (4 * bend)
    return np.asarray(heights)


@dataclass(frozen=True, eq=False)
class Relief:
    """Heights over a plan, made for a size of one and used at another."""

    outline: Floats  #: (K, 2) corners of the plan
    height: Callable[[Floats, Floats, float], Floats]  #: of x, y and a fillet
    face: float
    size: float = 1.0
    fillet: float = 0.0
    hole: float = 0.0  #: radius of an opening in the middle

    def at(self, xy: Floats) -> Floats:
        """Heights over places (K, 2)."""
        x, y = (xy / self.size).T
        return self.size * self.height(x, y, self.fillet / self.size)

    def slope(self, xy: Floats) -> Floats:
        """How steep the surface rises, (K, 2)."""
        step = 1e-5 * self.size
        return np.stack([(self.at(xy + step * e) - self.at(xy - step * e)) / (2 * step) for e in np.eye(2)], axis=1)

    def lift(self, xy: Floats) -> Floats:
        """Places on the surface (K, 3)."""
        return np.column_stack([xy, self.at(xy)])

    def kept(self, xy: Floats) -> Floats:
        """Whether places (K, 2) lie in the plan."""
        there = np.hypot(*xy.T) > self.hole * self.size
        crossings = np.zeros(len(xy), int)
        for a, b in zip(self.outline * self.size, np.roll(self.outline, -1, axis=0) * self.size, strict=True):
            if a[1] != b[1]:
                share = (xy[:, 1] - a[1]) / (b[1] - a[1])
                crossings += ((a[1] > xy[:, 1]) != (b[1] > xy[:, 1])) & (xy[:, 0] < a[0] + share * (b[0] - a[0]))
        return np.asarray(there & (crossings % 2 == 1))

    def rims(self) -> list[Floats]:
        """The boundaries in the plan, dense, (K, 2) each."""
        share = np.linspace(0, 1, 100, endpoint=False)[:, None]
        pairs = zip(self.outline, np.roll(self.outline, -1, axis=0), strict=True)
        found = [self.size * np.concatenate([a + share * (b - a) for a, b in pairs])]
        if self.hole:
            found.append(self.size * self.hole * regular(200))
        return found

    def form(self, size: float, fillet: float) -> Form:
        """The surface at a size."""
        made = Relief(self.outline, self.height, self.face, size, fillet, self.hole)
        half = float(np.abs(made.outline).max()) * size
        side = (np.arange(300) + 0.5) / 150 * half - half
        xy = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
        steep = np.hypot(1, np.linalg.norm(made.slope(xy), axis=1))
        there = made.kept(xy)

        def points(rng: np.random.Generator, density: float) -> Floats:
            facts = {"density ratio": float(np.exp(rng.uniform(0, np.log(2)))), "even": float(rng.random() < 0.5)}
            return sample(rng, made, made.kept, half, density, facts, float(steep[there].max()))

        def distance(p: Floats) -> Floats:
            rise = np.hypot(1, np.linalg.norm(made.slope(p[:, :2]), axis=1))
            return np.asarray(np.abs(p[:, 2] - made.at(p[:, :2])) / rise)

        area = float(steep[there].sum()) * (half / 150) ** 2
        return Form(area, self.face * size, [made.lift(rim) for rim in made.rims()], distance, points)


def rectangle(x: float, y: float) -> Floats:
    """Corners of a plan (4, 2) of half sides x and y."""
    return np.array([(-x, -y), (x, -y), (x, y), (-x, y)])


def regular(count: int, radius: float = 1.0) -> Floats:
    """Corners of a regular polygon (count, 2)."""
    turn = 2 * np.pi * np.arange(count) / count
    return radius * np.column_stack([np.cos(turn), np.sin(turn)])


def gable(rng: np.random.Generator) -> Relief:
    """Two flanks and a ridge."""
    rise, half = rng.uniform(0.35, 1.1), rng.uniform(0.8, 2.5)
    return Relief(rectangle(half, 1), lambda x, y, r: creased(y, np.array([-1, 0, 1]), np.array([0, rise, 0]), r), 1.0)


def hip(rng: np.random.Generator) -> Relief:
    """A ridge and four hips that meet at its ends."""
    rise, half = rng.uniform(0.45, 1.1), rng.uniform(1.4, 2.5)

    def height(x: Floats, y: Floats, r: float) -> Floats:
        flanks = creased(y, np.array([-1, 0, 1]), np.array([0, rise, 0]), r)
        return lower(flanks, creased(x, np.array([-half, 0, half]), np.array([0, half * rise, 0]), r), r * rise**2)

    return Relief(rectangle(half, 1), height, 0.8)


def l_roof(rng: np.random.Generator) -> Relief:
    """Two wings at a right angle: ridges, a hip outside, a valley inside."""
    rise, end = rng.uniform(0.45, 1.1), rng.uniform(2, 3.5)

    def height(x: Floats, y: Floats, r: float) -> Floats:
        bend = r * rise**2
        inner = upper(rise * (1 - x), rise * (1 - y), bend)
        return lower(lower(rise * (1 + x), rise * (1 + y), bend), inner, 2 * bend)

    outline = np.array([(-1, -1), (end, -1), (end, 1), (1, 1), (1, end), (-1, end)], float)
    return Relief(outline, height, 1.0)


def dormers(rng: np.random.Generator) -> Relief:
    """A gable with one or two dormers, whose fronts are steep."""
    rise, count = rng.uniform(0.6, 1.0), int(rng.integers(1, 3))
    half = 1.1 * count + rng.uniform(0.2, 0.6)
    middles = np.linspace(-half, half, 2 * count + 1)[1::2] + rng.uniform(-0.1, 0.1)

    def height(x: Floats, y: Floats, r: float) -> Floats:
        found = creased(y, np.array([-1, 0, 1]), np.array([0, rise, 0]), r)
        for middle in middles:
            top = creased(x, middle + np.array([-1, 0, 1]), rise * np.array([-0.2, 0.8, -0.2]), r)
            front = 2.5 * (y + 0.85) + 0.15 * rise
            found = upper(found, lower(top, front, r * 3), r * rise**2)
        return found

    return Relief(rectangle(half, 1), height, 0.5)


def folded_plate(rng: np.random.Generator) -> Relief:
    """Parallel folds up and down."""
    count = int(rng.integers(2, 7))
    rise, long = rng.uniform(0.35, 1.0), rng.uniform(1, 2) * max(1.0, count / 3)
    knots, values = np.arange(count + 1.0) - count / 2, rise * (np.arange(count + 1.0) % 2)
    return Relief(rectangle(count / 2, long), lambda x, y, r: creased(x, knots, values, r), 1.0)


def sawtooth(rng: np.random.Generator) -> Relief:
    """Long slopes up and steep ones down."""
    count, rise, share = int(rng.integers(2, 5)), rng.uniform(0.5, 0.8), rng.uniform(0.25, 0.35)
    knots = np.concatenate([[k, k + 1 - share] for k in range(count)] + [[count]]) - count / 2
    values = rise * (np.arange(2 * count + 1.0) % 2)
    long = rng.uniform(1, 1.5) * count / 2
    return Relief(rectangle(count / 2, long), lambda x, y, r: creased(x, knots, values, r), np.hypot(share, rise))


def star(rng: np.random.Generator) -> Relief:
    """Folds from the middle outwards, up and down in turn; half of them with an opening in the middle."""
    count = int(rng.integers(3, 6))
    step, steep, hole = np.pi / count, rng.uniform(0.35, 0.8), 0.4 if rng.random() < 0.5 else 0.0

    def height(x: Floats, y: Floats, r: float) -> Floats:
        away, turn = np.hypot(x, y), np.arctan2(y, x) / step
        near = np.round(turn)
        off, along = away * np.abs(np.sin((turn - near) * step)), away * np.cos((turn - near) * step)
        bend = np.maximum(np.minimum(2 * r * steep**2, 2 * steep * away * np.sin(step / 2)), 1e-12)
        rounded = np.maximum(bend - 2 * steep * off, 0) ** 2 / (4 * bend)
        return np.asarray((1 - 2 * (near % 2)) * (steep * (np.tan(step / 2) * along - off) - rounded))

    return Relief(regular(2 * count), height, 2 * np.sin(step / 2) * (hole or 1.0), hole=hole)


def arch(x: Floats, half: float, rise: float) -> tuple[Floats, Floats]:
    """Heights (K,) of a circular arch and how steep they are."""
    radius = (half**2 + rise**2) / (2 * rise)
    level = np.sqrt(np.maximum(radius**2 - x**2, 0.01 * radius**2))
    return level - radius + rise, x / level


def vault(rng: np.random.Generator, kind: str) -> Relief:
    """Two barrels that cross over a square or a rectangle; stilted: the narrower one stands higher."""
    wide = 1.0 if kind == "square" else rng.uniform(1.15, 1.6)
    rise = rng.uniform(0.35, 0.5)
    stilt = rng.uniform(0.1, 0.25) if kind == "stilted" else 0.0

    def height(x: Floats, y: Floats, r: float) -> Floats:
        (one, steep), (two, other) = arch(x, wide, rise + stilt), arch(y, 1.0, rise)
        return upper(one, two + stilt, r * (steep**2 + other**2) / 2)

    return Relief(rectangle(wide, 1), height, 1.0)


# ---- surfaces of revolution ----------------------------------------------------------------------------------------


def filleted(corners: Floats, fillet: float) -> Floats:
    """A polyline (P, 2) through corners that are rounded with a radius, or with what has room."""
    parts = [corners[:1]]
    for a, b, c in zip(corners, corners[1:], corners[2:], strict=False):
        back, on = (a - b) / np.linalg.norm(a - b), (c - b) / np.linalg.norm(c - b)
        half = np.arccos(np.clip(back @ on, -1, 1)) / 2
        radius = min(fillet, 0.45 * np.tan(half) * min(np.linalg.norm(a - b), np.linalg.norm(c - b)))
        middle = b + radius / np.sin(half) * (back + on) / np.linalg.norm(back + on)
        share = np.linspace(0, 1, 20)[:, None]
        chord = b + radius / np.tan(half) * (back + share * (on - back)) - middle
        parts.append(middle + radius * chord / np.linalg.norm(chord, axis=1)[:, None])
    return np.concatenate([*parts, corners[-1:]])


@dataclass(frozen=True, eq=False)
class Turned:
    """A profile that turns about an axis, its first place on it; closed where its last is on it too."""

    profile: Floats  #: (P, 2) radius and height
    face: float

    def form(self, size: float, fillet: float) -> Form:
        """The surface at a size."""
        line = filleted(size * self.profile, max(fillet, 1e-6))
        arc = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])

        def lift(parameters: Floats) -> Floats:
            radius, height = (np.interp(parameters[:, 0], arc, line[:, k]) for k in (0, 1))
            turn = parameters[:, 1]
            return np.column_stack([radius * np.cos(turn), radius * np.sin(turn), height])

        steps = np.unique(np.concatenate([arc, np.arange(0, arc[-1], 0.4)]))
        table = np.stack(np.meshgrid(steps, np.linspace(0, 2 * np.pi, 181), indexing="ij"), axis=-1)
        surface = sheet(table, lift, closed=(False, True))
        area = float(surface.areas.sum())

        def points(rng: np.random.Generator, density: float) -> Floats:
            return surface.sample(int(density * area), rng, even=bool(rng.random() < 0.5))

        return Form(area, self.face * size, surface.loops, surface.distance, points)


def drum(rng: np.random.Generator) -> Turned:
    """A cylinder with a lid, and a floor if closed."""
    high = rng.uniform(0.7, 2.0)
    corners = [(0, high), (1, high), (1, 0), (0, 0)]
    return Turned(np.array(corners[: 4 - int(rng.random() < 0.5)], float), min(high, 1.0))


def stepped_disc(rng: np.random.Generator) -> Turned:
    """Two or three discs on each other."""
    count, step, corners = int(rng.integers(2, 4)), rng.uniform(0.45, 0.8), []
    for k in range(count):
        corners += [(k + 0.0 if k else 0.0, (count - k) * step), (k + 1.0, (count - k) * step)]
    corners += [(float(count), 0.0), (0.0, 0.0)]
    return Turned(np.array(corners[: len(corners) - int(rng.random() < 0.5)]), step)


def cone(rng: np.random.Generator) -> Turned:
    """A cone, with a floor if closed."""
    corners = [(0, rng.uniform(0.5, 1.6)), (1, 0), (0, 0)]
    return Turned(np.array(corners[: 3 - int(rng.random() < 0.5)], float), 1.0)


# ---- convex bodies -------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Body:
    """A convex body; open: without what lies below the height 0, so that its walls end in a boundary there."""

    corners: Floats  #: (K, 3)
    face: float
    is_open: bool = False

    def form(self, size: float, fillet: float) -> Form:
        """The surface at a size."""
        corners = size * self.corners
        if self.is_open:
            corners = self._lowered(corners)
        hull = ConvexHull(corners)
        fillet = min(fillet, 0.6 * float(-(hull.equations @ [*corners.mean(axis=0), 1.0]).max()))
        core = Core.within(corners, fillet)
        faces = corners[hull.simplices]
        areas = np.linalg.norm(np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0]), axis=1) / 2

        def points(rng: np.random.Generator, density: float) -> Floats:
            chosen = rng.choice(len(faces), int(density * areas.sum()), p=areas / areas.sum())
            share = rng.dirichlet(np.ones(3), len(chosen))
            found = core.onto(np.einsum("kc,kcd->kd", share, faces[chosen]), fillet)
            return found[found[:, 2] > 0] if self.is_open else found

        rims = [core.rim(corners, fillet)] if self.is_open else []
        inside = np.random.default_rng(0).dirichlet(np.ones(3), (len(faces), 400))
        above = (np.einsum("fsc,fcd->fsd", inside, faces)[..., 2] > 0).mean(axis=1) if self.is_open else 1.0
        return Form(float((areas * above).sum()), self.face * size, rims, partial(core.distance, fillet=fillet), points)

    def _lowered(self, corners: Floats) -> Floats:
        """The corners, those at the height 0 moved down along the walls."""
        base, top = corners[corners[:, 2] == 0], corners[corners[:, 2] > 0]
        high = top[:, 2].max()
        spread = np.linalg.norm(top[0, :2]) / np.linalg.norm(base[0, :2])  # of the top, as a share of the base
        grown = base[:, :2] * (1 + (1 - spread) * LOWER / high)
        return np.concatenate([top, np.column_stack([grown, np.full(len(base), -LOWER)])])


@dataclass(frozen=True, eq=False)
class Core:
    """A convex body around which a ball rolls: where it touches, a filleted one ends."""

    planes: Floats  #: (F, 4) outward normals and offsets
    edges: Floats  #: (E, 2, 3)

    @classmethod
    def within(cls, corners: Floats, fillet: float) -> Core:
        """The part of a body (corners (K, 3)) that is deeper inside than the fillet."""
        planes = np.unique(np.round(ConvexHull(corners).equations, 9), axis=0)
        if fillet:
            shrunk = planes + fillet * np.array([0, 0, 0, 1.0])
            corners = HalfspaceIntersection(shrunk, corners.mean(axis=0)).intersections
        hull = ConvexHull(np.unique(np.round(corners, 9), axis=0))
        ends = np.sort(hull.simplices[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        return cls(np.unique(np.round(hull.equations, 9), axis=0), hull.points[np.unique(ends, axis=0)])

    @cached_property
    def _along(self) -> Floats:
        return self.edges[:, 1] - self.edges[:, 0]

    def nearest(self, p: Floats) -> Floats:
        """The nearest places (K, 3) of the body to places outside of it."""
        best, far = np.zeros_like(p), np.full(len(p), np.inf)
        for normal, offset in zip(self.planes[:, :3], self.planes[:, 3], strict=True):
            off = p @ normal + offset
            foot = p - off[:, None] * normal
            within = (foot @ self.planes[:, :3].T + self.planes[:, 3] < 1e-7).all(axis=1) & (off >= 0) & (off < far)
            best[within], far[within] = foot[within], off[within]
        for (start, _), along in zip(self.edges, self._along, strict=True):
            share = np.clip((p - start) @ along / (along @ along), 0, 1)
            foot = start + share[:, None] * along
            off = np.linalg.norm(p - foot, axis=1)
            nearer = off < far - 1e-9
            best[nearer], far[nearer] = foot[nearer], off[nearer]
        return best

    def onto(self, p: Floats, fillet: float) -> Floats:
        """Move places on the sharp body onto the filleted one."""
        if not fillet:
            return p
        foot = self.nearest(p)
        arm = p - foot
        return np.asarray(foot + fillet * arm / np.linalg.norm(arm, axis=1)[:, None])

    def distance(self, p: Floats, fillet: float) -> Floats:
        """Distance of places (K, 3) from the filleted surface."""
        deep = (p @ self.planes[:, :3].T + self.planes[:, 3]).max(axis=1)
        return np.asarray(
            np.where(deep > 0, np.abs(np.linalg.norm(p - self.nearest(p), axis=1) - fillet), fillet - deep)
        )

    def rim(self, corners: Floats, fillet: float) -> Floats:
        """The section of the filleted body at the height 0."""
        reach = 2 * np.abs(corners).max()
        places = np.column_stack([regular(720, reach), np.zeros(720)])
        low, high = np.zeros(720), np.ones(720)
        for _ in range(40):
            middle = (low + high) / 2
            p = middle[:, None] * places
            out = np.linalg.norm(p - self.nearest(p), axis=1) > fillet
            out &= (p @ self.planes[:, :3].T + self.planes[:, 3]).max(axis=1) > 0
            low, high = np.where(out, low, middle), np.where(out, middle, high)
        return np.asarray(low[:, None] * places)


def frustum(rng: np.random.Generator, sides: int, top: float, base: Floats | None = None) -> Body:
    """A body on a regular polygon (or one of its own) whose top is a share of its base; half of them open."""
    base = regular(sides) if base is None else base
    high = rng.uniform(0.7, 1.6)
    upper_end = np.column_stack([top * base, np.full(len(base), high)]) if top else np.array([[0, 0, high]])
    side = float(np.linalg.norm(base[1] - base[0])) * (top or 1.0)
    corners = np.concatenate([upper_end, np.column_stack([base, np.zeros(len(base))])])
    return Body(corners, min(side, high), bool(rng.random() < 0.5))


def box(rng: np.random.Generator) -> Body:
    """A box of any three sides."""
    return frustum(rng, 4, 1.0, rectangle(rng.uniform(0.6, 1.6), 0.7))


def pyramid(rng: np.random.Generator) -> Body:
    """A pyramid on three to six sides."""
    return frustum(rng, int(rng.integers(3, 7)), 0.0)


def polyhedron(rng: np.random.Generator) -> Body:
    """One of the regular bodies, or a frustum."""
    golden, kind = (1 + 5**0.5) / 2, int(rng.integers(0, 5))
    if kind == 4:
        return frustum(rng, int(rng.integers(3, 7)), rng.uniform(0.4, 0.8))
    cyclic = [np.roll(np.eye(3), k, axis=1) for k in range(3)]
    signs = np.array([(a, b, c) for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)], float)
    solids = [
        signs[[0, 3, 5, 6]],
        np.concatenate([np.eye(3), -np.eye(3)]),
        np.unique(np.concatenate([signs * (0, 1, golden) @ turn for turn in cyclic]), axis=0),
        np.unique(np.concatenate([signs, *(signs * (0, 1 / golden, golden) @ turn for turn in cyclic)]), axis=0),
    ]
    corners = solids[kind] / np.linalg.norm(solids[kind], axis=1).max()
    apart = np.linalg.norm(corners[:, None] - corners, axis=2)
    return Body(corners, float(apart[apart > 1e-9].min()))


# ---- one of them, anywhere -----------------------------------------------------------------------------------------

FAMILIES: dict[str, Callable[[np.random.Generator], Relief | Turned | Body]] = {
    "gable": gable,
    "hip": hip,
    "L roof": l_roof,
    "dormers": dormers,
    "folded plate": folded_plate,
    "sawtooth": sawtooth,
    "star": star,
    "groin vault": partial(vault, kind="square"),
    "cross vault": partial(vault, kind="rectangular"),
    "stilted vault": partial(vault, kind="stilted"),
    "box": box,
    "drum": drum,
    "stepped disc": stepped_disc,
    "cone": cone,
    "pyramid": pyramid,
    "polyhedron": polyhedron,
}


def family_of(seed: int) -> str:
    """Return the family to which a seed belongs."""
    return list(FAMILIES)[seed % len(FAMILIES)]


def edged_surface(seed: int, nodes: tuple[int, int] = NODES) -> RandomSurface:
    """Return the surface of a seed for a grid of about so many nodes; the same seed gives the same bytes."""
    rng = np.random.default_rng([seed, 20260])
    maker = FAMILIES[family_of(seed)](rng)
    wanted = float(np.exp(rng.uniform(*np.log(nodes))))
    unit = maker.form(1.0, 0.0)
    size = max(np.sqrt(wanted * PER_NODE / unit.area), FACE / unit.face)
    fillet = float(rng.choice([0.0, rng.uniform(0, 1)]))
    form = maker.form(float(size), fillet)
    density = float(np.exp(rng.uniform(np.log(20), np.log(120))))
    noise = rng.uniform(0, 1) * float(rng.choice([SPACING_NOISE / np.sqrt(density), MEMBER_NOISE]))
    points = form.sample(rng, density)
    points = points + noise * rng.normal(size=points.shape)
    motion, back, length = random_motion(rng)
    return RandomSurface(
        name=f"{family_of(seed)} {seed}",
        points=np.ascontiguousarray(motion(rng.permutation(points))),
        length=length,
        noise=length * noise,
        loops=[motion(rim) for rim in form.loops],
        distance=lambda p: length * form.distance(back(p)),
        facts={"nodes": form.area / PER_NODE, "density": density, "noise": noise, "fillet": fillet, "face": form.face},
    )
