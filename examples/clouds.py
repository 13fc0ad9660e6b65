"""Scans for the examples, generated: shells like those of the paper, given by a polygon in plan and a height above it [mm].

The last two are roofs in metres.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

Array = np.ndarray
NOISE = 0.02  # standard deviation of each coordinate [mm]


@dataclass(frozen=True)
class Shell:
    """A shell: its polygon in plan, its height, and the places that matter."""

    outline: Array  #: (K, 2) corners of its polygon in plan, anticlockwise
    height: Callable[[Array, Array], Array]
    holes: tuple[
        tuple[float, float, float, float, float], ...
    ] = ()  #: ellipses: centre x and y, half axes, turn [radian]
    corners: Array = field(default_factory=lambda: np.zeros((0, 3)))  #: (C, 3) corners of the boundary
    fixed: Array = field(default_factory=lambda: np.zeros((0, 3)))  #: (F, 3) where supports shall stand
    points: Array = field(default_factory=lambda: np.zeros((0, 3)))  #: (N, 3) the scan


def make(name: str, count: int = 120_000, seed: int = 0) -> Shell:
    """Return a shell with its scan: random points with a constant density per area of the surface."""
    shell = SHELLS[name]()
    rng = np.random.default_rng(seed)
    low, high = shell.outline.min(axis=0), shell.outline.max(axis=0)
    found: list[Array] = []
    while sum(map(len, found)) < count:
        x, y = rng.uniform(low, high, (2 * count, 2)).T
        kept = _inside(shell.outline, x, y) & np.all([_outside(hole, x, y) for hole in shell.holes], axis=0)
        x, y = x[kept], y[kept]
        step = 1e-4
        slope_x = (shell.height(x + step, y) - shell.height(x - step, y)) / (2 * step)
        slope_y = (shell.height(x, y + step) - shell.height(x, y - step)) / (2 * step)
        area = np.sqrt(1.0 + slope_x**2 + slope_y**2)  # of the surface over one square millimetre in plan
        chosen = rng.uniform(0.0, min(float(area.max()), 8.0), len(x)) < area
        found.append(np.column_stack([x, y, shell.height(x, y)])[chosen])
    points = np.concatenate(found)[:count]
    return replace(shell, points=points + NOISE * rng.normal(size=points.shape))


def _inside(polygon: Array, x: Array, y: Array) -> Array:
    """Tell which places lie in a polygon (K, 2): a ray to the right crosses its sides an odd number of times."""
    odd = np.zeros(len(x), bool)
    for (ax, ay), (bx, by) in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        beside = np.flatnonzero((ay > y) != (by > y))  # few, so that little is computed for each side
        odd[beside] ^= x[beside] < ax + (y[beside] - ay) * (bx - ax) / (by - ay)
    return odd


def _outside(hole: tuple[float, float, float, float, float], x: Array, y: Array) -> Array:
    """Tell which places lie outside an elliptic hole."""
    centre_x, centre_y, first, second, turn = hole
    along = np.cos(turn) * (x - centre_x) + np.sin(turn) * (y - centre_y)
    across = np.cos(turn) * (y - centre_y) - np.sin(turn) * (x - centre_x)
    return np.asarray((along / first) ** 2 + (across / second) ** 2 > 1.0)


def _lifted(height: Callable[[Array, Array], Array], places: object) -> Array:
    x, y = np.array(places, float).T
    return np.column_stack([x, y, height(x, y)])


def scallop() -> Shell:
    """Return a ribbed valve of about 100 mm with ears at the hinge: four corners, two of them re-entrant."""
    start = np.arctan2(-45 / 51.1, 24 / 50.6) + 1e-9
    turn = np.linspace(start, np.pi - start, 800)
    body = np.column_stack([50.6 * np.cos(turn), 5 + np.where(np.sin(turn) > 0, 43, 51.1) * np.sin(turn)])
    ears = [tuple(body[-1]), (-25.0, -50.5), (23.0, -50.5), tuple(body[0])]

    def height(x: Array, y: Array) -> Array:
        away = np.hypot(x, y + 55)
        rib = 1.6 * np.cos(30 * np.arctan2(x, y + 55)) * np.clip((away - 25) / 50, 0, 1) ** 2
        return np.asarray(3 + 23 * np.exp(-(x**2) / (2 * 37.0**2) - (y + 8) ** 2 / (2 * 33.0**2)) + rib)

    outline = np.concatenate([body, ears[1:3]])
    supports = [(48.3, 14.0), (-12.0, 15.0), (8.0, -20.0)]  # the first about half a member from the boundary
    return Shell(outline, height, corners=_lifted(height, ears), fixed=_lifted(height, supports))


def two_holes() -> Shell:
    """Return the scallop with two holes cut into it."""
    valve = scallop()
    holes = ((-18.0, 9.0, 11.0, 9.0, 0.2), (16.3, -7.0, 6.4, 8.0, -0.15))
    return Shell(valve.outline, valve.height, holes, valve.corners)


def _round(radius: Callable[[Array], Array], profile: Callable[[Array, Array], Array]) -> Shell:
    """Return a shell without corners, by the radius for each angle and the height for each share of it."""
    angle = np.linspace(0, 2 * np.pi, 720, endpoint=False)
    outline = radius(angle)[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])

    def height(x: Array, y: Array) -> Array:
        theta = np.arctan2(y, x)
        return profile(np.hypot(x, y) / radius(theta), theta)

    return Shell(outline, height)


def clam() -> Shell:
    """Return a small deep valve of about 42 mm with a steep margin and growth rings."""

    def radius(t: Array) -> Array:
        return np.asarray(1 / np.hypot(np.cos(t) / 21.5, np.sin(t) / 16.6) * (1 + 0.03 * np.sin(3 * t - 0.4)))

    def profile(s: Array, t: Array) -> Array:
        return np.asarray(15.2 - (8.0 + 1.7 * np.cos(t - 3.6)) * s**2.8 + 0.1 * np.sin(9 * np.pi * s**2) * s**2)

    return _round(radius, profile)


def limpet() -> Shell:
    """Return an oval shell of about 96 x 74 mm with a nearly pointed apex."""

    def radius(t: Array) -> Array:
        return np.asarray(1 / np.hypot(np.cos(t) / 48, np.sin(t) / 37) * (1 + 0.03 * np.cos(t) + 0.02 * np.cos(2 * t)))

    def profile(s: Array, t: Array) -> Array:
        return np.asarray(30.5 - (21.0 + 5.0 * np.cos(t) * s) * (np.sqrt(1.2 * s**2 + 0.04) - 0.2 + 0.15 * s**2))

    return _round(radius, profile)


def stadium() -> Shell:
    """Return the limpet with an elliptic hole."""
    shell = limpet()
    return Shell(shell.outline, shell.height, ((0.5, 0.0, 20.0, 12.3, 0.0),))


def cloth() -> Shell:
    """Return the plaster of a rectangular cloth hung from its four corners; the free edges pull in."""
    share = np.linspace(-1, 1, 160, endpoint=False)
    low = np.column_stack([45 * share, -33 + 4 * (1 - share**2)])
    right = np.column_stack([45 - 4.5 * (1 - share**2), 33 * share])

    def height(x: Array, y: Array) -> Array:
        a, b = (x / 45) ** 2, (y / 33) ** 2
        return np.asarray(24 * (1 - 0.787 * (a + b) + 0.574 * a * b))

    corners = _lifted(height, [(-45.0, -33.0), (45, -33), (45, 33), (-45, 33)])
    return Shell(np.concatenate([low, right, -low, -right]), height, corners=corners)


COURT = (36.625, 46.025, 51.125, 22.245)  # half width, extent along -y and +y, radius of the reading room [m]


def court() -> Shell:
    """Return a court of 73 x 97 m around a round reading room, in metres.

    The rectangle, the circle and the function between them are those of Williams, The analytic and numerical definition of the
    geometry of the British Museum Great Court Roof, 2001, with y the other way; the bulge on it is simpler than his.
    """
    half, south, north, radius = COURT

    def height(x: Array, y: Array) -> Array:
        away = np.maximum(np.hypot(x, y), radius)
        near_x, near_y = radius * x / away, radius * y / away
        edge = (1 - x / half) * (1 + x / half) * (1 - y / north) * (1 + y / south)
        inner = (1 - near_x / half) * (1 + near_x / half) * (1 - near_y / north) * (1 + near_y / south)
        share = edge / inner  # 0 on the rectangle, 1 on the circle
        return np.asarray(1.25 * share + 14.0 * share * (1 - radius / away))

    corners = _lifted(height, [(-half, -south), (half, -south), (half, north), (-half, north)])
    return Shell(corners[:, :2], height, ((0.0, 0.0, radius, radius, 0.0),), corners)


def canopy() -> Shell:
    """Return a canopy of 40 x 28 m that follows the hills below it, with the places of its feet, in metres."""

    def height(x: Array, y: Array) -> Array:
        return np.asarray(4 + 2.2 * np.sin(x / 7.5) * np.cos(y / 8.0) - 0.012 * x**2 - 0.006 * y**2)

    outline = np.array([(-20.0, -14.0), (20, -14), (20, 14), (-20, 14)])
    feet = [
        (-17.0, -11.0),
        (-5.0, -10.0),
        (7.0, -11.0),
        (17.0, -10.0),
        (-17.0, 10.0),
        (-6.0, 11.0),
        (6.0, 10.0),
        (17.0, 11.0),
        (0.0, 0.0),
    ]
    return Shell(outline, height, corners=_lifted(height, outline), fixed=_lifted(height, feet))


SHELLS = {
    "court": court,
    "canopy": canopy,
    "scallop": scallop,
    "clam": clam,
    "limpet": limpet,
    "cloth": cloth,
    "two_holes": two_holes,
    "stadium": stadium,
}
