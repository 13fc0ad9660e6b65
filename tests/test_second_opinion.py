"""Every figure of the certificate against brute force, on a hundred grids, most of them spoilt on purpose."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree
from steps import steps_of
from surfaces import distance_to_triangles
from typed import known

import scantruss as st
from scantruss.check.certify import certify
from scantruss.grid.certificate import Certificate, Spread
from scantruss.surface.samples import SurfaceSamples

LENGTH = 1.0


def barrel(seed: int, outliers: int = 0) -> np.ndarray:
    """Points of a plate bent to a barrel, with noise, and some strays above it."""
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(0.0, 7.0, 1200), rng.uniform(0.0, 5.0, 1200)
    points = np.column_stack([8 * np.sin(x / 8), y, 8 * np.cos(x / 8) + rng.normal(0.0, 0.01, 1200)])
    strays = rng.uniform([0.0, 0.0, 9.5], [7.0, 5.0, 12.0], (outliers, 3))
    return np.concatenate([points, strays])


def spoil(grid: st.Grid, how: str, rng: np.random.Generator) -> st.Grid:
    """Return the grid with some of its nodes moved or triangles taken away."""
    nodes, triangles = grid.nodes.copy(), grid.triangles
    some = rng.integers(len(nodes), size=3)
    if how == "off":
        nodes[some] += rng.normal(0.0, 0.4, (3, 3))
    elif how == "near":
        nodes[some] += rng.normal(0.0, 0.05, (3, 3))
    elif how == "collapsed":
        a, b = grid.edges[rng.integers(len(grid.edges))]
        nodes[a] += 0.97 * (nodes[b] - nodes[a])
    elif how == "holed":
        triangles = np.delete(triangles, rng.integers(len(triangles), size=8), axis=0)
    elif how == "lifted":
        nodes += [0.0, 0.0, rng.uniform(0.0, 1.5)]
    return grid.replace(nodes=nodes, triangles=triangles, deviation=None)


@pytest.mark.parametrize("seed", range(20))
def test_every_figure_is_that_of_brute_force(seed: int) -> None:
    settings = st.Settings(length=LENGTH)
    cloud = st.PointCloud.from_array(barrel(seed, outliers=0 if seed % 2 else 30))
    right = st.grid_from_points(cloud.points, settings)
    steps = steps_of(cloud, settings)
    rng = np.random.default_rng(seed)
    for how in ("none", "off", "near", "collapsed", "holed"):
        grid = spoil(right, how, rng)
        compare(grid, certify(grid, steps.samples, steps.boundary, settings), cloud, steps.samples, settings)


def compare(
    grid: st.Grid, found: Certificate, cloud: st.PointCloud, samples: SurfaceSamples, settings: st.Settings
) -> None:
    """Compare a certificate with plain sums over all points, nodes and triangles."""
    corners = grid.nodes[grid.triangles]
    away = np.concatenate(
        [
            distance_to_triangles(part[:, None], *(corners[None, :, k] for k in range(3))).min(axis=1)
            for part in np.array_split(cloud.points, 10)
        ]
    )
    assert found.points == len(cloud.points)
    check_spread(known(found.scan_distance), away)
    assert found.scan_within_reach == (away <= 0.5 * LENGTH).mean()
    measured = cloud.points[samples.judged == 0]
    tree = cKDTree(measured)
    middles = np.maximum(tree.query(corners.mean(axis=1))[0], tree.query(corners)[0].max(axis=1))
    check_spread(known(found.triangle_distance), middles)
    assert found.grid_within_reach == (middles <= 0.5 * LENGTH).mean()
    near, which = tree.query(grid.nodes, k=12)
    around = measured[which]
    _, sizes, axes = np.linalg.svd(around - around.mean(axis=1, keepdims=True))
    off = np.minimum(np.abs(np.einsum("vi,vi->v", grid.nodes - around.mean(axis=1), axes[:, 2])), near[:, 0])
    noise = sizes[:, 2] / np.sqrt(12)
    check_spread(known(found.node_distance), off)
    assert found.noise == pytest.approx(np.median(noise), abs=1e-7)
    lengths = np.linalg.norm(grid.nodes[grid.edges[:, 0]] - grid.nodes[grid.edges[:, 1]], axis=1)
    assert (known(found.shortest_member).value, known(found.longest_member).value) == pytest.approx(
        (lengths.min(), lengths.max())
    )
    sides = corners - np.roll(corners, 1, axis=1)
    cosine = -(sides * np.roll(sides, -1, axis=1)).sum(axis=2)
    norms = np.linalg.norm(sides, axis=2)
    angles = np.degrees(np.arccos(np.clip(cosine / (norms * np.roll(norms, -1, axis=1)), -1.0, 1.0)))
    assert known(found.smallest_angle).value == pytest.approx(angles.min(), abs=1e-5)
    expected = {
        "angle": angles.min() < settings.min_angle,
        "short": lengths.min() < settings.min_length * LENGTH,
        "long": lengths.max() > settings.max_length * LENGTH,
        "offset": (off - 3.0 * noise).max() > settings.max_offset * LENGTH,
        "cover": (away <= 0.5 * LENGTH).mean() < 0.8,
        "astray": middles.max() > LENGTH * (0.5 + 4.0 / (2 * np.pi)),
    }
    kinds = {fault.kind for fault in found.faults}
    assert {kind for kind in expected if kind in kinds} == {kind for kind, is_so in expected.items() if is_so}
    left_out = {kind: sum(part.points for part in found.left_out if part.kind == kind) for kind in ("outliers", "far")}
    assert left_out["outliers"] == (samples.judged == 2).sum()
    assert left_out["far"] == ((samples.judged == 0) & (away > LENGTH)).sum()


def check_spread(spread: Spread, values: np.ndarray) -> None:
    """Compare a median, two quantiles and the largest."""
    assert (spread.p50, spread.p95, spread.p99) == pytest.approx(
        tuple(np.quantile(values, [0.5, 0.95, 0.99])), abs=1e-7
    )
    assert spread.largest.value == pytest.approx(values.max(), abs=1e-7)
