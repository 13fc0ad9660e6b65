"""Every figure of the certificate against brute force, on a hundred grids, most of them spoilt on purpose."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import fields
from itertools import combinations

import networkx as nx  # type: ignore[import-untyped]
import numpy as np
import pytest
from scipy.spatial import cKDTree
from steps import Steps, steps_of
from surfaces import distance_to_triangles
from typed import known, xyz

import scantruss as st
from scantruss.check.certify import certify
from scantruss.check.distances import COMPARED_WITH_NODE
from scantruss.grid.certificate import Certificate, Spread
from scantruss.kernels.surface.mean_surface import FEWEST_FOR_PLANE, FEWEST_FOR_QUADRIC, PLANE_FROM_ASIDE
from scantruss.surface.chosen_samples import OUTLIER
from scantruss.surface.samples import SurfaceSamples

LENGTH = 1.0
SPOILT = ("none", "off", "near", "collapsed", "holed", "split", "flap", "crossed", "folded", "mirrored")


def barrel(seed: int, outliers: int = 0) -> np.ndarray:
    """Points of a plate bent to a barrel, with noise, and some outliers above it."""
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
    elif how == "split":
        middle = nodes[triangles].mean(axis=1)[:, 0]
        triangles = triangles[abs(middle - np.median(middle)) > 0.5]
    elif how == "flap":  # a third triangle at a member, or two fans at a node
        a, b, _ = triangles[len(triangles) // 2]
        c, d = np.argsort(((nodes - nodes[a]) ** 2).sum(axis=1))[-2:]
        triangles = np.concatenate([triangles, [[a, b if rng.random() < 0.5 else d, c]]])
    elif how == "crossed":
        inside = np.setdiff1d(triangles, np.concatenate(grid.boundary_loops))
        nodes[rng.choice(inside)] += [1.3, 0.2, 0.05]
    elif how == "folded":
        inside = np.setdiff1d(triangles, np.concatenate(grid.boundary_loops))
        nodes[rng.choice(inside)] += [0.0, 0.0, 2.5]
    elif how == "mirrored":  # one triangle looks the other way
        triangles = triangles.copy()
        triangles[5] = triangles[5][::-1]
    return grid.replace(nodes=nodes, triangles=triangles, deviation=None)


@pytest.mark.parametrize("seed", range(10))
def test_every_figure_is_that_of_brute_force(seed: int) -> None:
    settings = st.Settings(length=LENGTH, min_fold=30.0, max_length=1.9)
    cloud = st.PointCloud.from_array(barrel(seed, outliers=0 if seed % 2 else 30))
    right = st.grid_from_points(cloud.points, settings)
    steps = steps_of(cloud, settings)
    rng = np.random.default_rng(seed)
    for how in SPOILT:
        grid = spoil(right, how, rng)
        place = xyz(right.nodes[right.boundary_loops[0][0]] + right.origin + [0.0, 0.0, 0.01 * seed])
        wanted = settings.replace(fixed=[place] if seed % 3 == 0 else [])
        found = certify(grid, steps.samples, steps.boundary, wanted)
        compare(grid, found, cloud, steps.samples, settings)
        compare_topology(grid, found, steps)
        compare_members(grid, found)
        compare_offsets(grid, found, steps.samples)
        compare_rest(grid, found, wanted)


def test_no_figure_of_the_certificate_is_left_without_a_second_opinion() -> None:
    """A figure that is new must be compared above before it is added here."""
    assert {spec.name for spec in fields(Certificate)} == {
        "unit", "reach", "manifold", "orientable", "pieces", "scan_pieces", "boundary_loops", "scan_loops", "euler", "handles",
        "faults", "warnings", "widened", "points", "left_out", "crossings", "scan_within_reach", "missing", "grid_within_reach",
        "scan_distance", "farthest_kept", "triangle_distance", "node_distance", "noise", "shortest_member", "longest_member",
        "smallest_angle",
        "largest_angle", "sharpest_fold", "fixed_error", "irregular", "irregular_forced", "node_bias", "node_bias_p95",
        "node_scatter",
    }  # fmt: skip


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
    check_spread(known(found.scan_distance), away, cloud.points + cloud.origin)
    farthest = int(away.argmax())
    assert (found.farthest_listed is not None) == bool(samples.judged[farthest] != 0 or away[farthest] > LENGTH)
    assert known(found.farthest_kept).value == pytest.approx(away[samples.judged != OUTLIER].max(), rel=1e-9)
    beyond = (samples.judged == 0) & (away > 0.5 * LENGTH)
    assert found.missing == pytest.approx(beyond.mean(), abs=1e-12)
    assert found.scan_within_reach == (away <= 0.5 * LENGTH).mean()
    measured = cloud.points[samples.judged == 0]
    tree = cKDTree(measured)
    middles = np.maximum(tree.query(corners.mean(axis=1))[0], tree.query(corners)[0].max(axis=1))
    check_spread(known(found.triangle_distance), middles, corners.mean(axis=1) + grid.origin)
    assert found.grid_within_reach == (middles <= 0.5 * LENGTH).mean()
    near, which = tree.query(grid.nodes, k=12)
    around = measured[which]
    _, sizes, axes = np.linalg.svd(around - around.mean(axis=1, keepdims=True))
    off = np.minimum(np.abs(np.einsum("vi,vi->v", grid.nodes - around.mean(axis=1), axes[:, 2])), near[:, 0])
    noise = sizes[:, 2] / np.sqrt(12)
    check_spread(known(found.node_distance), off, grid.nodes + grid.origin)
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


def compare_topology(grid: st.Grid, found: Certificate, steps: Steps) -> None:
    """Compare pieces, loops, Euler number, sides and irregular nodes with what plain graphs of nodes and triangles say."""
    # triangles at each member, with the direction in which they run along it
    at: dict[tuple[int, int], list[tuple[int, bool]]] = defaultdict(list)
    for number, triangle in enumerate(grid.triangles.tolist()):
        for a, b in zip(triangle, triangle[1:] + triangle[:1], strict=True):
            at[min(a, b), max(a, b)].append((number, a < b))
    net, rim, sides = nx.Graph(list(at)), nx.Graph(), nx.Graph()
    beside: dict[int, nx.Graph] = defaultdict(nx.Graph)
    for (a, b), uses in at.items():
        if len(uses) == 1:
            rim.add_edge(a, b)
        for (one, _), (other, _) in combinations(uses, 2):
            beside[a].add_edge(one, other)
            beside[b].add_edge(one, other)
        for (one, along), (other, as_well) in combinations(
            uses, 2
        ):  # each triangle as it stands (0) and turned over (1)
            turn = int(along == as_well)
            sides.add_edge((one, 0), (other, turn))
            sides.add_edge((one, 1), (other, 1 - turn))
    for number, triangle in enumerate(grid.triangles.tolist()):
        for v in triangle:
            beside[v].add_node(number)
        sides.add_nodes_from([(number, 0), (number, 1)])
    fans = [nx.number_connected_components(beside[v]) for v in net]
    manifold = max(map(len, at.values())) <= 2 and max(fans) == 1
    orientable = not any(nx.has_path(sides, (number, 0), (number, 1)) for number in range(len(grid.triangles)))
    pieces = nx.number_connected_components(net)
    loops = nx.number_connected_components(rim) + sum(max(d // 2 - 1, 0) for _, d in rim.degree)
    euler = net.number_of_nodes() - len(at) + len(grid.triangles)
    assert (found.manifold, found.orientable, found.pieces, found.boundary_loops, found.euler) == (
        manifold, orientable, pieces, loops, euler,
    )  # fmt: skip
    assert found.handles == ((2 * pieces - loops - euler) // 2 if manifold and orientable else None)
    assert found.scan_pieces == len(steps.samples.pieces) and found.scan_loops == len(steps.boundary.loops)
    charge = {v: 6 - net.degree[v] for v in net}
    for v in {v for member, uses in at.items() if len(uses) != 2 for v in member}:
        angle = sum(
            grid.angles[number, list(triangle).index(v)]
            for number, triangle in enumerate(grid.triangles.tolist())
            if v in triangle
        )
        charge[v] = max(int(angle / 60.0 + 0.5), 1) + 1 - net.degree[v]
    assert found.irregular == sum(map(abs, charge.values()))
    assert found.irregular_forced == sum(abs(sum(charge[v] for v in piece)) for piece in nx.connected_components(net))


def compare_members(grid: st.Grid, found: Certificate) -> None:
    """Compare the worst members, angles and fold and their places with plain sums over all of them."""
    corners = grid.nodes[grid.triangles]
    members = {(min(pair), max(pair)) for t in grid.triangles.tolist() for pair in combinations(t, 2)}
    lengths = {(a, b): float(np.linalg.norm(grid.nodes[a] - grid.nodes[b])) for a, b in members}
    for worst, (a, b) in (
        (known(found.shortest_member), min(lengths, key=lengths.__getitem__)),
        (known(found.longest_member), max(lengths, key=lengths.__getitem__)),
    ):
        assert worst.value == pytest.approx(lengths[a, b])
        if list(lengths.values()).count(lengths[a, b]) == 1:
            assert worst.where == pytest.approx(0.5 * (grid.nodes[a] + grid.nodes[b]) + grid.origin)
    angles = []
    for triangle in corners:
        for k in range(3):
            u, w = triangle[(k + 1) % 3] - triangle[k], triangle[(k + 2) % 3] - triangle[k]
            angles.append(np.degrees(np.arctan2(np.linalg.norm(np.cross(u, w)), u @ w)))
    assert known(found.smallest_angle).value == pytest.approx(min(angles), abs=1e-5)
    largest = known(found.largest_angle)
    assert largest.value == pytest.approx(max(angles), abs=1e-5)
    assert largest.where == pytest.approx(corners.reshape(-1, 3)[int(np.argmax(angles))] + grid.origin)
    ways = [pair for t in grid.triangles.tolist() for pair in zip(t, t[1:] + t[:1], strict=True)]
    if not found.manifold or len(set(ways)) < len(ways):  # neighbours run the same way: one looks to the other side
        assert not found.passed
        return
    folds = []
    for one, other in combinations(grid.triangles.tolist(), 2):
        shared = [v for v in one if v in other]
        if len(shared) == 2:
            c, d = next(v for v in one if v not in shared), next(v for v in other if v not in shared)
            a, b = (grid.nodes[v] for v in shared)
            along = (b - a) / np.linalg.norm(b - a)
            arms = [grid.nodes[v] - a - ((grid.nodes[v] - a) @ along) * along for v in (c, d)]
            folds.append(np.degrees(np.arctan2(np.linalg.norm(np.cross(*arms)), arms[0] @ arms[1])))
    assert known(found.sharpest_fold).value == pytest.approx(min(folds), abs=1e-4)
    assert ("folded" in {fault.kind for fault in found.faults}) == (min(folds) < 30.0)


def compare_offsets(grid: st.Grid, found: Certificate, samples: SurfaceSamples) -> None:
    """Compare bias and scatter with quadrics fitted by plain weighted least squares to the points within a member of each node."""
    every = len(samples.measured_points) // (COMPARED_WITH_NODE * len(grid.nodes)) + 1
    points, offsets = samples.measured_points[::every], []
    a, b, c = (grid.nodes[grid.triangles[:, k]] for k in range(3))
    for v, node in enumerate(grid.nodes):
        normal = np.cross(b - a, c - a)[(grid.triangles == v).any(axis=1)].sum(axis=0)
        normal = normal / max(np.linalg.norm(normal), 1e-300)
        away = points - node
        away = away[np.linalg.norm(away, axis=1) < LENGTH]
        weight = (1.0 - (away**2).sum(axis=1) / LENGTH**2) ** 2
        if len(away) < FEWEST_FOR_PLANE:
            continue
        centre = weight @ away / weight.sum()
        aside = np.linalg.norm(centre - (centre @ normal) * normal)
        across = np.linalg.svd(normal[None])[2][1:]
        x, y = across @ away.T
        terms = [np.ones(len(x)), x, y]
        if len(away) >= FEWEST_FOR_QUADRIC and aside < PLANE_FROM_ASIDE * LENGTH:
            terms += [x * x, x * y, y * y]
        table, root = np.stack(terms, axis=1), np.sqrt(weight)
        fit = np.linalg.lstsq(table * root[:, None], away @ normal * root, rcond=None)[0]
        off = away @ normal - table @ fit
        offsets.append((fit[0], np.sqrt(weight @ off**2 / weight.sum())))
    bias, scatter = np.array(offsets).T
    assert found.node_bias == pytest.approx(bias.mean(), abs=1e-4)
    assert found.node_bias_p95 == pytest.approx(np.quantile(np.abs(bias), 0.95), abs=1e-4)
    assert found.node_scatter == pytest.approx(np.median(scatter), abs=1e-4)


def compare_rest(grid: st.Grid, found: Certificate, settings: st.Settings) -> None:
    """Compare cuts, fixed positions, and what the settings widened."""
    low, high = (pick(grid.nodes[grid.triangles], axis=1) for pick in (np.min, np.max))
    touch = (low[:, None] <= high).all(axis=2) & (low <= high[:, None]).all(axis=2)  # boxes around two triangles
    near = [(grid.triangles[i].tolist(), grid.triangles[j].tolist()) for i, j in np.argwhere(np.triu(touch, 1))]
    cuts = [pair for pair in near if cut_each_other(grid.nodes, *pair)]
    assert found.crossings == min(len(cuts), 100)
    assert ("crossing" in {fault.kind for fault in found.faults}) == bool(cuts)
    if settings.fixed:
        among = grid.nodes[grid.fixed] if grid.fixed.any() else grid.nodes
        assert known(found.fixed_error).value == pytest.approx(
            min(np.linalg.norm(among + grid.origin - np.array(settings.fixed[0]), axis=1))
        )
    else:
        assert found.fixed_error is None
    assert found.widened == ("max length 1.9 instead of 1.8",)
    assert (found.unit, found.reach) == ("", 0.5 * LENGTH)
    assert found.passed == (not found.faults)
    poor = {
        "angle": 15.0 <= known(found.smallest_angle).value < 25.0,
        "short": 0.5 <= known(found.shortest_member).value < 0.6,
        "long": 1.6 < known(found.longest_member).value <= 1.9,
    }
    kinds = {warning.kind for warning in found.warnings}
    assert {kind for kind in poor if kind in kinds} == {kind for kind, is_so in poor.items() if is_so}


def cut_each_other(nodes: np.ndarray, one: list[int], other: list[int]) -> bool:
    """Whether a side of one triangle goes through another, apart from the nodes that they share; none lie in one plane here."""
    shared = set(one) & set(other)
    if len(shared) > 1:
        return False
    for triangle, against in ((one, other), (other, one)):
        corner = nodes[against]
        normal = np.cross(corner[1] - corner[0], corner[2] - corner[0])
        for a, b in combinations(triangle, 2):
            if shared & {a, b}:
                continue
            above, below = (nodes[a] - corner[0]) @ normal, (nodes[b] - corner[0]) @ normal
            if above * below < 0:
                place = nodes[a] + above / (above - below) * (nodes[b] - nodes[a])
                turns = [np.cross(corner[k] - corner[k - 1], place - corner[k - 1]) @ normal for k in range(3)]
                if min(turns) > 0:
                    return True
    return False


def check_spread(spread: Spread, values: np.ndarray, places: np.ndarray) -> None:
    """Compare a median, two quantiles, and the largest with its place."""
    assert (spread.p50, spread.p95, spread.p99) == pytest.approx(
        tuple(np.quantile(values, [0.5, 0.95, 0.99])), abs=1e-7
    )
    assert spread.largest.value == pytest.approx(values.max(), abs=1e-7)
    if np.sort(values)[-2] < values.max() - 1e-6:
        assert spread.largest.where == pytest.approx(places[values.argmax()])
