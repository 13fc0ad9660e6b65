"""Small clouds made by hand, the scan prepared of them, and fronts laid on them segment by segment."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from scantruss import PointCloud, Settings
from scantruss.front.start import new_front
from scantruss.kernels.front import front as lists
from scantruss.kernels.front.fits import near_nodes
from scantruss.kernels.surface.local_surface import SURFACE_PATCH
from scantruss.runtime.jit import new_record
from scantruss.surface.samples import SurfaceSamples, sample_surface


def sheet(
    width: float,
    depth: float,
    spacing: float,
    *,
    keep: Callable[[np.ndarray, np.ndarray], np.ndarray] | None = None,
    noise: float = 0.0,
    seed: int = 0,
) -> np.ndarray:
    """Points of a plate [-width/2, width/2] x [-depth/2, depth/2], on a jittered lattice that reaches the boundary."""
    rng = np.random.default_rng(seed)
    x, y = (np.linspace(-e / 2, e / 2, round(e / spacing) + 1) for e in (width, depth))
    u, v = (a.ravel() for a in np.meshgrid(x, y))
    inner = (abs(u) < width / 2 - 1e-9) & (abs(v) < depth / 2 - 1e-9)
    jitter = 0.3 * spacing * rng.uniform(-1, 1, (len(u), 2)) * inner[:, None]
    points = np.stack([u + jitter[:, 0], v + jitter[:, 1], noise * rng.normal(size=len(u))], axis=1)
    if keep is not None:
        points = points[keep(points[:, 0], points[:, 1])]
    return rng.permutation(points)


def ring(inner: float, outer: float, spacing: float, *, seed: int = 0) -> np.ndarray:
    """Points between two circles, both boundaries dense; `inner` 0 gives a disc."""
    body = sheet(2 * outer, 2 * outer, spacing, seed=seed)
    away = np.hypot(body[:, 0], body[:, 1])
    parts = [body[(away < outer - 0.5 * spacing) & (away > inner + (0.5 * spacing if inner else -1))]]
    for radius in (inner, outer):
        if radius:
            turn = np.linspace(0, 2 * np.pi, round(2 * np.pi * radius / (0.7 * spacing)), endpoint=False)
            parts.append(radius * np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1))
    return np.random.default_rng(seed).permutation(np.concatenate(parts))


def ball(radius: float, count: int, *, noise: float = 0.0, seed: int = 0) -> np.ndarray:
    """Points of a sphere, evenly on a spiral."""
    rng = np.random.default_rng(seed)
    z = 1 - (2 * np.arange(count) + 1) / count
    turn = np.pi * (3 - 5**0.5) * np.arange(count)
    flat = np.sqrt(1 - z * z)
    points = radius * np.stack([flat * np.cos(turn), flat * np.sin(turn), z], axis=1)
    return rng.permutation(points + noise * rng.normal(size=points.shape))


def tire(radius: float, tube: float, spacing: float, *, seed: int = 0) -> np.ndarray:
    """Points of a torus around z."""
    rng = np.random.default_rng(seed)
    m, n = round(2 * np.pi * (radius + tube) / spacing), round(2 * np.pi * tube / spacing)
    a, b = (c.ravel() for c in np.meshgrid(np.arange(m) * 2 * np.pi / m, np.arange(n) * 2 * np.pi / n))
    a, b = a + rng.uniform(-1, 1, len(a)) / m, b + rng.uniform(-1, 1, len(b)) / n
    away = radius + tube * np.cos(b)
    return rng.permutation(np.stack([away * np.cos(a), away * np.sin(a), tube * np.sin(b)], axis=1))


def cap(radius: float, opening: float, spacing: float, *, seed: int = 0) -> np.ndarray:
    """Points of a dome around z, down to `opening` [radian] from its top, its boundary dense."""
    flat = ring(0.0, radius * opening, spacing, seed=seed)
    away = np.maximum(np.hypot(flat[:, 0], flat[:, 1]), 1e-12)
    side = radius * np.sin(away / radius) / away
    return np.stack([side * flat[:, 0], side * flat[:, 1], radius * np.cos(away / radius)], axis=1)


def turn_of(seed: int) -> np.ndarray:
    """A random rotation matrix."""
    turn, upper = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    turn = turn * np.sign(np.diag(upper))
    return turn * [1, 1, np.sign(np.linalg.det(turn))]


def samples_of(points: np.ndarray, length: float = 1.0, **settings: Any) -> SurfaceSamples:
    """The scan prepared for a member length."""
    return sample_surface(PointCloud.from_array(points), Settings(length=length, **settings))


class HandFront:
    """A front on the plane z = 0, laid segment by segment; the unmeshed area is on the left."""

    def __init__(
        self,
        *loops: Iterable[Sequence[float]],
        points: np.ndarray | None = None,
        inner: Sequence[int] = (),
        state: Sequence[int] = (),
        length: float = 1.0,
        **settings: Any,
    ) -> None:
        """loops: places (H, 2) of closed loops. inner: numbers of the nodes that are not of a boundary."""
        points = sheet(8.0, 8.0, 0.125) if points is None else points
        self.settings = Settings(length=length, **settings)
        self.samples = samples_of(points, length)
        self.surface = self.samples.surface
        self.front = new_front(self.samples, self.settings)
        self.rules = rules_of(self.settings, self.samples.spacing)
        self.found, self.patch = np.empty(lists.MOST_NEAR_NODES, np.int64), new_record(SURFACE_PATCH)
        self.segments = []
        for i, loop in enumerate(loops):
            ids = [self.add_node(*place, boundary=True) for place in loop]
            on = state[i] if state else lists.ACTIVE
            own = [lists.add_segment(self.front, a, b, on) for a, b in zip(ids, ids[1:] + ids[:1], strict=True)]
            for s, after in zip(own, own[1:] + own[:1], strict=True):
                lists.link(self.front, s, after)
            self.segments.append(own)
        self.front.on_boundary[list(inner)] = False

    def add_node(self, x: float, y: float, z: float = 0.0, *, boundary: bool = False) -> int:
        place = (float(x), float(y), float(z))
        sample = int(((self.surface.mean - place) ** 2).sum(axis=1).argmin())
        up = (0.0, 0.0, 1.0) if self.surface.normals[sample, 2] > 0 else (0.0, 0.0, -1.0)
        assert up[2] > 0, "the normals of a plate point upwards"
        n = lists.propose_node(self.front, place, up, sample, boundary)
        lists.add_node(self.front)
        return n

    def near(self, s: int, reach: float = 2.4) -> int:
        """Number of nodes near a segment, in `found`."""
        return near_nodes(self.surface, self.front, s, reach, self.settings.length, self.found)

    @property
    def triangles(self) -> list[frozenset[int]]:
        """Sets of the nodes of the triangles so far, in order."""
        return [frozenset(t) for t in self.front.triangles[: self.front.counts.triangles].tolist()]

    @property
    def alive(self) -> dict[tuple[int, int], int]:
        """(tail, head) of the segments of the front that are left, with their states."""
        count = self.front.counts.segments
        rows = zip(self.front.tail[:count], self.front.head[:count], self.front.state[:count], strict=True)
        return {(int(t), int(h)): int(state) for t, h, state in rows if state != lists.GONE}

    @property
    def nodes(self) -> np.ndarray:
        return self.front.nodes[: self.front.counts.nodes]


def rules_of(settings: Settings, spacing: float, strict: float = 1.0) -> lists.Rules:
    """What a front goes by, for the kernels."""
    return lists.Rules(
        length=settings.length,
        desired=settings.length,
        graded=False,
        length_weight=settings.length_weight,
        shape_weight=settings.shape_weight,
        size_weight=settings.size_weight,
        search_range=settings.search_range * spacing,
        nearness=settings.nearness,
        merge_angle=float(np.radians(settings.merge_angle)),
        quadrangle=settings.case3 == "quadrangle",
        strict=strict,
    )
