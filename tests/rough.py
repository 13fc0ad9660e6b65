"""Rough grids as a front leaves them, made without one: jittered nodes over a disc, a plate, a sphere, and the scan below."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial import ConvexHull, Delaunay

from scantruss import Grid, PointCloud, Settings
from scantruss.improve.working_mesh import WorkingMesh
from scantruss.kernels.boundary.curves import Curves
from scantruss.surface.samples import sample_surface


class Rough(NamedTuple):
    """A rough grid, its scan, and the true boundary curve."""

    cloud: PointCloud
    grid: Grid
    curves: Curves
    corners: np.ndarray
    settings: Settings

    def mesh(self) -> WorkingMesh:
        """The grid taken apart."""
        surface = sample_surface(self.cloud, self.settings).surface
        return WorkingMesh.from_grid(self.grid, surface, self.curves, self.corners, self.settings.length)


def no_boundary() -> Curves:
    """The curves of a closed scan: none."""
    return Curves(np.zeros((0, 3)), np.zeros(0), np.zeros(1, np.int64), np.zeros(0))


def curve_of(points: np.ndarray) -> Curves:
    """One closed polyline as the kernels see it."""
    points = np.asarray(points, float)
    steps = np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1)
    arc = np.concatenate([[0.0], np.cumsum(steps)[:-1]])
    return Curves(points, arc, np.array([0, len(points)]), np.array([steps.sum()]))


def lift(xy: np.ndarray, bulge: float) -> np.ndarray:
    """Places over the plane: a paraboloid of that height over a disc of radius 1."""
    return np.column_stack([xy, bulge * (1.0 - (xy**2).sum(axis=1))])


def hexagonal(length: float, size: float) -> np.ndarray:
    """Places of a triangular pattern that covers a square of half width `size`."""
    rows = np.arange(-size, size, length * 3**0.5 / 2)
    return np.concatenate(
        [
            np.column_stack(
                [np.arange(-size, size, length) + (k % 2) * length / 2, 0 * np.arange(-size, size, length) + y]
            )
            for k, y in enumerate(rows)
        ]
    )


def rough_disc(
    length: float = 0.22,
    jitter: float = 0.25,
    bulge: float = 0.4,
    seed: int = 0,
    corners: bool = False,
    points: int = 6000,
) -> Rough:
    """A disc, or with corners a square plate, of half width 1, lifted onto a paraboloid."""
    rng = np.random.default_rng(seed)
    if corners:
        side = np.linspace(-1, 1, 80, endpoint=False)
        outline = np.concatenate(
            [
                np.column_stack(p)
                for p in ((side, 0 * side - 1), (0 * side + 1, side), (-side, 0 * side + 1), (0 * side - 1, -side))
            ]
        )
        count = round(2 / length)
        rim_xy = outline[(np.arange(4 * count) * 80 / count).round().astype(int)]
    else:
        angle = np.linspace(0, 2 * np.pi, 320, endpoint=False)
        outline = np.column_stack([np.cos(angle), np.sin(angle)])
        count = round(2 * np.pi / length)
        rim_xy = outline[(np.arange(count) * 320 / count).round().astype(int)]
    inner = hexagonal(length, 1.0) + jitter * length * rng.uniform(-1, 1, hexagonal(length, 1.0).shape)
    reach = np.abs(inner).max(axis=1) if corners else np.linalg.norm(inner, axis=1)
    nodes = np.concatenate([rim_xy, inner[reach < 1 - 0.5 * length]])
    triangles = Delaunay(nodes).simplices.astype(np.int64)
    a, b, c = (nodes[triangles[:, k]] for k in range(3))
    area = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    triangles[area < 0] = triangles[area < 0][:, ::-1]
    triangles = triangles[np.abs(area) > 1e-4 * length**2]
    scan = rng.uniform(-1, 1, (points, 2))
    scan = scan[(np.abs(scan).max(axis=1) if corners else np.linalg.norm(scan, axis=1)) <= 1]
    cloud = PointCloud.from_array(np.concatenate([lift(scan, bulge), lift(outline, bulge)]))
    grid = Grid(lift(nodes, bulge) - cloud.origin, triangles, np.zeros(len(nodes), bool), cloud.origin)
    curve = curve_of(lift(outline, bulge) - cloud.origin)
    at = curve.points[[0, 80, 160, 240]] if corners else np.zeros((0, 3))
    return Rough(cloud, grid, curve, at, Settings(length=length))


def rough_sphere(count: int = 160, seed: int = 0, points: int = 6000) -> Rough:
    """A sphere of radius 1."""
    rng = np.random.default_rng(seed)

    def spread(number: int, jitter: float) -> np.ndarray:
        k = np.arange(number) + 0.5
        z, angle = 1 - 2 * k / number, np.pi * (1 + 5**0.5) * k
        places = np.column_stack([np.sqrt(1 - z**2) * np.cos(angle), np.sqrt(1 - z**2) * np.sin(angle), z])
        places += jitter * np.sqrt(4 * np.pi / number) * rng.uniform(-1, 1, places.shape)
        return places / np.linalg.norm(places, axis=1)[:, None]

    nodes = spread(count, 0.25)
    triangles = ConvexHull(nodes).simplices.astype(np.int64)
    a, b, c = (nodes[triangles[:, k]] for k in range(3))
    inward = (np.cross(b - a, c - a) * a).sum(axis=1) < 0
    triangles[inward] = triangles[inward][:, ::-1]
    cloud = PointCloud.from_array(spread(points, 0.2))
    grid = Grid(nodes - cloud.origin, triangles, np.zeros(count, bool), cloud.origin)
    return Rough(cloud, grid, no_boundary(), np.zeros((0, 3)), Settings(length=float(grid.lengths.mean())))


def strip_of(count: int, half_turns: int = 0) -> Grid:
    """A closed strip of triangles around an axis; with one half turn a Moebius strip."""
    angle = 2 * np.pi * np.arange(count) / count
    tilt = half_turns * angle / 2
    arm = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    across = np.cos(tilt)[:, None] * [0, 0, 1] + np.sin(tilt)[:, None] * arm
    nodes = np.concatenate([2 * arm - 0.3 * across, 2 * arm + 0.3 * across])
    triangles = []
    for k in range(count):
        a, b, c, d = k, (k + 1) % count, count + (k + 1) % count, count + k
        if k == count - 1 and half_turns % 2:
            b, c = c, b
        triangles += [(a, b, c), (a, c, d)]
    return Grid(nodes, np.array(triangles, np.int64), np.zeros(2 * count, bool), np.zeros(3))


def same_topology(a: Grid, b: Grid) -> bool:
    """Whether two grids have the same topology and all triangles of the second face one way."""
    ends = np.concatenate([b.triangles[:, [0, 1]], b.triangles[:, [1, 2]], b.triangles[:, [2, 0]]])
    return a.topology == b.topology and len(np.unique(ends, axis=0)) == len(ends)
