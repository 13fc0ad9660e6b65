"""Small grids made by hand, for the tests of files, solids and pictures."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from scantruss import Grid, GridQuality, PointCloud, Settings
from scantruss.improve.flips import flip_edges
from scantruss.improve.working_mesh import close_net, open_net


def make_grid(nodes: ArrayLike, triangles: ArrayLike, fixed: Iterable[int] = (), **others: Any) -> Grid:
    """Return a grid of lists."""
    nodes = np.asarray(nodes, np.float64).reshape(-1, 3)
    marked = np.zeros(len(nodes), bool)
    marked[list(fixed)] = True
    given: dict[str, Any] = {"origin": np.zeros(3), "unit": "mm"} | others
    return Grid(nodes=nodes, triangles=np.asarray(triangles, np.int64).reshape(-1, 3), fixed=marked, **given)


def fan(length: float = 10.0, **others: Any) -> Grid:
    """Six equilateral triangles around node 0: V 7, E 12, T 6, one loop."""
    angle = np.arange(6) * np.pi / 3
    rim = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1) * length
    triangles = [(0, k + 1, (k + 1) % 6 + 1) for k in range(6)]
    return make_grid([(0, 0, 0), *rim], triangles, **others)


def icosahedron(length: float = 10.0, **others: Any) -> Grid:
    """Closed: V 12, E 30, T 20, no loop."""
    g = (1 + 5**0.5) / 2
    nodes: list[tuple[float, float, float]] = [(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g)]
    nodes += [(0, -1, -g), (0, 1, -g), (g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1)]
    triangles = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2)]
    triangles += [(10, 7, 6), (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5)]
    triangles += [(2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1)]
    return make_grid(np.array(nodes) * length / 2, triangles, **others)


def two_pieces(length: float = 10.0, **others: Any) -> Grid:
    """A fan and an icosahedron far from each other, and a node that belongs to neither."""
    a, b = fan(length), icosahedron(length)
    nodes = [*a.nodes, *(b.nodes + np.array([5 * length, 0, 0])), (0, 0, 9 * length)]
    return make_grid(nodes, [*a.triangles, *(b.triangles + len(a.nodes))], **others)


def dome(count: int = 12, length: float = 4.0, **others: Any) -> Grid:
    """A shallow dome with `count` nodes along each side."""
    i, j = np.divmod(np.arange(count * count), count)
    x, y = (i + 0.5 * (j % 2)) * length, j * length * 3**0.5 / 2
    x, y = x - x.mean(), y - y.mean()
    nodes = np.stack([x, y, 0.3 * x.max() - 0.3 * (x**2 + y**2) / x.max()], axis=1)
    triangles = []
    for a in (count * i + j)[(i < count - 1) & (j < count - 1)].tolist():
        b, c, d = a + count, a + count + 1, a + 1
        triangles += [(a, b, d), (b, c, d)] if a % count % 2 == 0 else [(a, b, c), (a, c, d)]
    return make_grid(nodes, triangles, **others)


def uneven(count: int = 8) -> Grid:
    """A dome whose inner nodes are not quite where they should be."""
    grid = dome(count, 4.0, unit="m")
    inner = np.ones(len(grid.nodes), bool)
    inner[np.concatenate(grid.boundary_loops)] = False
    x = grid.nodes + 0.15 * inner[:, None] * np.random.default_rng(5).standard_normal(grid.nodes.shape) * [1, 1, 0]
    x[:, 2] = 0.3 * grid.nodes[:, 0].max() - 0.3 * (x[:, 0] ** 2 + x[:, 1] ** 2) / grid.nodes[:, 0].max()
    return grid.replace(nodes=x)


def rich(**others: Any) -> Grid:
    """A fan with everything a grid can carry."""
    before = GridQuality(0.9, 0.1, 0.5, 9.7, 1 / 3, 0.1, 31.0, 99.0, 0.8, 0.01, 0.02, "mm")
    values: dict[str, Any] = {
        "fixed": (0, 3),
        "origin": np.array([500000.1, 4500000.2, 100.3]),
        "deviation": np.array([0.1, 1 / 3, np.nan, 0.0, 1e-300, 2.0, -0.0]),
        "settings": Settings(length=10.0, unit="mm", fixed=[(0.1, 0.2, 0.3)], max_deviation=0.7),
        "before": before,
    }
    return fan(**(values | others))


def cloud_over(grid: Grid, count: int = 3000) -> PointCloud:
    """Return points on the triangles of a grid, in another local frame."""
    rng = np.random.default_rng(5)
    corners = grid.nodes[grid.triangles[rng.integers(len(grid.triangles), size=count)]]
    points = (corners * rng.dirichlet((1, 1, 1), count)[:, :, None]).sum(axis=1)
    return PointCloud(points=points - 7.0, origin=grid.origin + 7.0, unit=grid.unit)


def flipped_edges(grid: Grid) -> tuple[Grid, int]:
    """Return a grid after all flips that raise the smallest angle (Sec. 4.1), and how many they were."""
    if not len(grid.triangles):
        return grid, 0
    net, source = open_net(grid)
    count = flip_edges(net)
    return close_net(net, source, grid), count
