"""The fit of a grid to its scan: more even, nearer, and on whatever is sharp or fixed."""

from __future__ import annotations

import naive
import numpy as np
import pytest
from marks import compiled_only
from rough import Rough, rough_disc, rough_sphere
from test_wide_ridges import HALF, rounded_box

import scantruss as st
from scantruss.check.distances import boxes_of
from scantruss.check.limits import NOISES_OFF, WARN_OFFSET
from scantruss.constraints.find import Constraints
from scantruss.grid.line_sets import RIDGE
from scantruss.improve import fit
from scantruss.improve.equalize import finish, new_scratch
from scantruss.improve.optimize import project_onto_scan
from scantruss.improve.working_mesh import WorkingMesh
from scantruss.kernels.mesh import fit as kernels
from scantruss.kernels.mesh.grid import INTERIOR, ON_CURVE, list_triangles
from scantruss.kernels.mesh.trial import total_energy
from scantruss.surface.samples import SurfaceSamples, sample_surface

WEIGHT = 3.0  # of lengths against shapes
CORNERS = (-1.0, 1.0)


def box(fillet: float, count: int = 25_000, noise: float = 0.02) -> st.PointCloud:
    """A cube of half width 20 with edges rounded by a radius, sharp for almost none."""
    return st.PointCloud.from_array(rounded_box(fillet, count, noise))


def unfitted(cloud: st.PointCloud, settings: st.Settings, monkeypatch: pytest.MonkeyPatch) -> st.Grid:
    with monkeypatch.context() as patch:
        patch.setattr(fit, "FITTED_FROM", np.inf)
        return st.grid_from_points(cloud, settings)


def fit_always(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fit every grid that may be, whether it is worth it or not."""
    monkeypatch.setattr(fit, "FITTED_FROM", -np.inf)
    monkeypatch.setattr(fit, "is_better", lambda *_: True)


def opened(rough: Rough) -> tuple[WorkingMesh, SurfaceSamples]:
    """A rough grid at rest on its scan, and the samples of that."""
    samples, mesh = sample_surface(rough.cloud, rough.settings), rough.mesh()
    finish(mesh)
    project_onto_scan(mesh, samples, boundary=True)
    return mesh, samples


def pulled(
    mesh: WorkingMesh, samples: SurfaceSamples, seed: int = 0
) -> tuple[np.ndarray, kernels.Pull, kernels.Planes]:
    """The triangles of a mesh, some places that draw its nodes, and planes beside these."""
    net, rng = mesh.net, np.random.default_rng(seed)
    room = np.empty((int(net.degree.sum()) + 1, 3), np.int64)
    triangles = room[: list_triangles(net, room)]
    nearest = rng.integers(0, len(triangles), 400)
    places = net.nodes[triangles[nearest]].mean(axis=1) + 0.1 * mesh.length * rng.normal(size=(400, 3))
    shares, off, direction = np.zeros((400, 3)), np.zeros(400), np.zeros((400, 3))
    kernels.put_feet_of_samples(places, net.nodes, triangles, nearest, shares, off, direction)
    node, entry = triangles[nearest].ravel(), np.flatnonzero(shares.ravel() > 0.0)
    entry = entry[np.argsort(node[entry], kind="stable")]
    start = np.searchsorted(node[entry], np.arange(len(net.degree) + 1))
    weight = rng.uniform(0.1, 2.0, 400) / mesh.length**2
    planes = kernels.Planes(np.zeros_like(net.nodes), np.zeros_like(net.nodes), np.zeros_like(net.arc))
    points = samples.surface.points
    which = np.flatnonzero(net.degree > 0)
    kernels.put_planes(which, net.nodes, points, boxes_of(points, 0.2 * mesh.length), 12, samples.spacing, planes)
    return triangles, kernels.Pull(start, entry // 3, shares.ravel()[entry], off, direction, weight), planes


def energy(mesh: WorkingMesh, pull: kernels.Pull, planes: kernels.Planes, feet: np.ndarray, weight: float) -> float:
    """The energy of a mesh, its samples and its planes, summed up slowly; feet : (E, 3) where the nodes of the samples were."""
    net, scratch = mesh.net, new_scratch(mesh)
    total = float(total_energy(net, mesh.patches, scratch, mesh.length, WEIGHT)[0])
    off = pull.off.copy()
    for v in np.flatnonzero(net.degree > 0).tolist():
        for entry in range(pull.start[v], pull.start[v + 1]):
            s = pull.sample[entry]
            off[s] += pull.share[entry] * (net.nodes[v] - feet[v]) @ pull.direction[s]
        height = (net.nodes[v] - planes.middle[v]) @ planes.normal[v]
        if net.kind[v] in (INTERIOR, ON_CURVE):
            total += weight * (height / mesh.length) ** 2
    return total + float((pull.weight * off**2).sum())


@pytest.mark.kernels
def test_planes_are_those_of_the_nearest_points() -> None:
    mesh, samples = opened(rough_sphere(count=40, points=800))
    _, _, planes = pulled(mesh, samples)
    points = samples.surface.points
    for v in np.flatnonzero(mesh.net.degree > 0).tolist():
        near = points[np.argsort(((points - mesh.net.nodes[v]) ** 2).sum(axis=1), kind="stable")[:12]]
        middle, normal = near.mean(axis=0), naive.plane_normal(near)
        assert planes.middle[v] == pytest.approx(middle, abs=1e-9)
        assert abs(planes.normal[v] @ normal) == pytest.approx(1.0, abs=1e-9)
        assert planes.noise[v] == pytest.approx(np.sqrt((((near - middle) @ normal) ** 2).mean()), abs=1e-9)


@pytest.mark.kernels
def test_samples_know_their_feet() -> None:
    """Shares are none or more and add up to one; the foot is as far away as it is said, along the direction."""
    rng = np.random.default_rng(4)
    nodes, triangles = rng.normal(size=(30, 3)), rng.permutation(30).reshape(10, 3)
    places, nearest = rng.normal(size=(200, 3)), rng.integers(-1, 10, 200)
    places[:5] = nodes[triangles[nearest[:5]]].mean(axis=1)
    shares, off, direction = np.ones((200, 3)), np.ones(200), np.zeros((200, 3))
    kernels.put_feet_of_samples(places, nodes, triangles, nearest, shares, off, direction)
    assert not shares[nearest < 0].any()
    for s in np.flatnonzero(nearest >= 0).tolist():
        foot = shares[s] @ nodes[triangles[nearest[s]]]
        assert shares[s].min() >= 0.0
        assert shares[s].sum() == pytest.approx(1.0)
        assert np.linalg.norm(direction[s]) == pytest.approx(1.0)
        assert places[s] + off[s] * direction[s] == pytest.approx(foot, abs=1e-8)


@pytest.mark.kernels
@pytest.mark.parametrize("maker", [rough_disc, rough_sphere])
def test_each_sweep_lowers_the_energy_by_as_much_as_it_says(maker: object) -> None:
    """Of the members and triangles, of the samples off their triangles and of the nodes off their planes; summed up slowly."""
    rough = rough_disc(length=0.5, points=800) if maker is rough_disc else rough_sphere(count=40, points=800)
    mesh, samples = opened(rough)
    _, pull, planes = pulled(mesh, samples)
    net, weight = mesh.net, 5.0
    which = np.flatnonzero((net.degree > 0) & np.isin(net.kind, (INTERIOR, ON_CURVE)))
    is_free = (net.kind == INTERIOR).astype(np.int64)
    arguments = net, mesh.patches, mesh.curves, which, is_free, pull, planes, mesh.length, WEIGHT, weight
    last, start = np.inf, net.nodes.copy()
    for _ in range(3):
        feet, before = net.nodes.copy(), energy(mesh, pull, planes, net.nodes, weight)
        kept = pull._replace(off=pull.off.copy())
        gain = kernels.settle_to_fit(*arguments, 1.0, 1)
        assert before - gain == pytest.approx(energy(mesh, kept, planes, feet, weight), abs=1e-9 * before)
        assert 0.0 < gain < last
        last = gain
    curve = mesh.curves.points
    for v in which[(net.kind[which] == ON_CURVE) & (net.nodes[which] != start[which]).any(axis=1)].tolist():
        ends = np.roll(curve, -1, axis=0)
        assert min(map(naive.distance_to_segment, [net.nodes[v]] * len(ends), curve, ends)) < 1e-5 * mesh.length


@pytest.mark.kernels
def test_no_node_goes_farther_from_its_plane_than_it_may() -> None:
    mesh, samples = opened(rough_sphere(count=40, points=800))
    _, pull, planes = pulled(mesh, samples)
    net, most = mesh.net, 0.02
    which = np.flatnonzero(net.degree > 0)

    def heights() -> np.ndarray:
        return np.abs(((net.nodes - planes.middle) * planes.normal).sum(axis=1))

    before, free = heights(), np.ones(len(net.degree), np.int64)
    kernels.settle_to_fit(net, mesh.patches, mesh.curves, which, free, pull, planes, mesh.length, WEIGHT, 0.0, most, 5)
    limit = np.maximum(most * mesh.length + NOISES_OFF * planes.noise, before)
    assert (heights()[which] <= limit[which] + 1e-12).all()
    assert (heights() > before).any()


@compiled_only
def test_a_grid_on_rounded_folds_is_more_even_and_nearer(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its triangles are the same, and no node is poor for it. A grid that is near as it is stays."""
    cloud, settings = box(2.9), st.Settings(length=5.3)
    plain = st.grid_from_points(cloud, settings)
    assert (plain.nodes == unfitted(cloud, settings, monkeypatch).nodes).all()
    monkeypatch.setattr(fit, "FITTED_FROM", 0.05)
    grid = st.grid_from_points(cloud, settings)
    assert (grid.triangles == plain.triangles).all()
    assert grid.quality.length_cv < plain.quality.length_cv
    assert grid.quality.shape_mean > plain.quality.shape_mean
    found, known = (each.certificate for each in (grid, plain))
    assert found is not None
    assert found.scan_distance is not None
    assert known is not None
    assert known.scan_distance is not None
    assert found.passed
    assert found.scan_distance.p99 < known.scan_distance.p99
    assert len(found.warnings) <= len(known.warnings)
    assert "offset" not in {each.kind for each in found.warnings}
    assert settings.max_offset > WARN_OFFSET


@compiled_only
@pytest.mark.parametrize("settings", [{"effort": "quick"}, {"method": "paper"}])
def test_no_grid_is_fitted_with_the_least_effort_or_by_the_paper(
    settings: dict[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = st.Settings(length=5.3, **settings)  # type: ignore[arg-type]
    plain = unfitted(box(2.4), asked, monkeypatch)
    fit_always(monkeypatch)
    grid = st.grid_from_points(box(2.4), asked)
    assert (grid.nodes == plain.nodes).all()


@compiled_only
def test_a_sharp_edge_keeps_its_nodes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Even where all else is more even for it: nodes of the edges of a cube slide on them."""
    rng = np.random.default_rng(2)
    places = rng.uniform(-HALF, HALF, (30_000, 3))
    places[np.arange(30_000), rng.integers(0, 3, 30_000)] = HALF * rng.choice(CORNERS, 30_000)
    cloud, settings = st.PointCloud.from_array(places), st.Settings(length=7.3)
    plain = unfitted(cloud, settings, monkeypatch)
    fit_always(monkeypatch)
    grid = st.grid_from_points(cloud, settings)
    assert not np.array_equal(grid.nodes, plain.nodes)

    def off_edges(of: st.Grid) -> float:
        """How far nodes of edges are from these: two coordinates are half the side there."""
        on_edges = np.sort(np.abs(of.nodes[np.unique(of.lines)] + of.origin), axis=1)
        return float(np.abs(on_edges[:, 1:] - HALF).max())

    def length_of_edges(of: st.Grid) -> float:
        return sum(each.length(of) for each in of.line_sets if each.kind == RIDGE)

    assert length_of_edges(grid) == pytest.approx(length_of_edges(plain), rel=0.005)
    assert length_of_edges(grid) == pytest.approx(12 * 2 * HALF, rel=0.03)
    assert off_edges(grid) < off_edges(plain) + 0.01 * settings.length


@compiled_only
def test_fixed_nodes_and_lines_stay(monkeypatch: pytest.MonkeyPatch) -> None:
    """A line fixed across a rounded edge, and a node beside it."""
    line = ((0.0, -12.0, HALF), (0.0, 12.0, HALF))
    fixed = ((HALF, 3.0, 3.0),)
    settings = st.Settings(length=5.3, fixed_lines=(line,), fixed=fixed)
    plain = st.grid_from_points(box(2.4), settings)
    fit_always(monkeypatch)
    grid = st.grid_from_points(box(2.4), settings)
    assert not np.array_equal(grid.nodes, plain.nodes)
    assert np.linalg.norm(grid.nodes[grid.fixed] + grid.origin - np.array(fixed[0]), axis=1).min() < 1e-6
    (own,) = (each for each in grid.line_sets if each.kind != RIDGE)
    on_line = grid.nodes[own.nodes] + grid.origin
    assert np.abs(on_line[:, 0]).max() < 1e-5
    assert np.ptp(on_line[:, 1]) == pytest.approx(24.0, abs=1e-4)


@compiled_only
def test_the_mesh_stays_as_it_is() -> None:
    rough = rough_sphere(count=120, points=3000)
    mesh, samples = opened(rough)
    before, constraints = mesh.copied(), Constraints(np.zeros((0, 3)))
    grid, farther = fit.fitted(
        mesh, rough.grid, samples, constraints, rough.settings, fit.ScanFit(fit.WEIGHTS_TRIED[0])
    )
    assert not farther
    assert not np.array_equal(grid.nodes, mesh.net.nodes[: len(grid.nodes)])
    assert (mesh.net.nodes == before.net.nodes).all()
    held = fit.ScanFit(fit.WEIGHTS_TRIED[0], held=grid.nodes[:1])
    again, _ = fit.fitted(mesh, rough.grid, samples, constraints, rough.settings, held)
    away = np.linalg.norm(mesh.net.nodes[: len(grid.nodes)] - grid.nodes[0], axis=1)
    stayed = (again.nodes == mesh.net.nodes[: len(grid.nodes)]).all(axis=1)
    assert (stayed == (away <= fit.HELD_AT_FAULT * mesh.length)).all()


@compiled_only
def test_what_is_preferred_counts_in_a_fit() -> None:
    rough = rough_sphere(count=120, points=3000)
    mesh, samples = opened(rough)
    qualities = [
        fit.fitted(
            mesh,
            rough.grid,
            samples,
            Constraints(np.zeros((0, 3))),
            rough.settings.replace(prefer=prefer),
            fit.ScanFit(fit.WEIGHTS_TRIED[0]),
        )[0].quality
        for prefer in ("lengths", "balance", "shapes")
    ]
    assert sorted(each.length_cv for each in qualities) == [each.length_cv for each in qualities]
    assert sorted(each.shape_mean for each in qualities) == [each.shape_mean for each in qualities]
    assert qualities[0].length_cv < qualities[2].length_cv - 0.01


def test_far_samples_draw_more_than_near_ones() -> None:
    """As their weight says where they are a tenth of a member off, so that it is that of usual ones; at most four times that."""
    times = fit.drawing(np.linspace(0.0, 0.6, 61))
    assert (np.diff(times) >= 0.0).all()
    assert times[10] == pytest.approx(1.0, abs=0.01)
    assert 0.2 < times[0] < 0.4
    assert times[-1] == times.max() == 4.0
