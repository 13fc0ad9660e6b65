"""Equalizing: one energy that falls, members of one length, a topology that stays; curves on which the boundary slides."""

from collections.abc import Callable

import naive_grid as naive
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some
from marks import compiled_only
from rough import Rough, curve_of, rough_disc, rough_sphere, same_topology
from typed import known, xyz

from scantruss.improve.equalize import (
    LAST_RELAXATION,
    MEAN_LENGTH_WEIGHT,
    equalize,
    finish,
    new_scratch,
    search_once,
    settle,
)
from scantruss.improve.working_mesh import LENGTH_WEIGHT, WorkingMesh
from scantruss.kernels.boundary import curves
from scantruss.kernels.mesh import equalize as kernels
from scantruss.kernels.mesh import local_search
from scantruss.kernels.mesh.grid import AT_REST, INTERIOR, may_collapse, may_flip, may_split
from scantruss.kernels.mesh.trial import Scratch, total_energy

MAKERS: dict[str, Callable[..., Rough]] = {
    "disc": rough_disc,
    "sphere": rough_sphere,
    "plate": lambda **other: rough_disc(corners=True, **other),
}


@pytest.fixture(params=sorted(MAKERS))
def rough(request: pytest.FixtureRequest) -> Rough:
    return MAKERS[request.param]()


def test_the_slope_of_the_energy_agrees_with_differences() -> None:
    rough = rough_disc()
    mesh = rough.mesh()
    net, length = mesh.net, rough.settings.length
    for v in range(0, len(rough.grid.nodes), 5):
        place = net.nodes[v].copy()
        slope = np.array(kernels.star_energy(net, mesh.patches, v, *xyz(place), length, 1.7, True)[1:])
        for c in range(3):
            step = np.eye(3)[c] * 1e-6
            up = kernels.star_energy(net, mesh.patches, v, *xyz(place + step), length, 1.7, False)[0]
            down = kernels.star_energy(net, mesh.patches, v, *xyz(place - step), length, 1.7, False)[0]
            assert slope[c] == pytest.approx((up - down) / 2e-6, abs=1e-4 / length)


def test_the_energy_agrees_with_plain_loops(rough: Rough) -> None:
    mesh = rough.mesh()
    scratch = new_scratch(mesh)
    energy, mean, count = total_energy(mesh.net, mesh.patches, scratch, rough.settings.length, 1.7)
    assert energy == pytest.approx(naive.energy(rough.grid, rough.settings.length, 1.7))
    assert mean == pytest.approx(rough.grid.lengths.mean()) and count == len(rough.grid.nodes)


def test_a_fold_counts(rough: Rough) -> None:
    mesh = rough.mesh()
    net, length = mesh.net, rough.settings.length
    v = int(np.flatnonzero((net.degree > 0) & (net.kind == INTERIOR))[0])
    net.nodes[v] += 3.0 * (net.nodes[net.ring[v, 0]] - net.nodes[v])
    grid = rough.grid.replace(nodes=net.nodes[: len(rough.grid.nodes)].copy())
    energy = total_energy(net, mesh.patches, new_scratch(mesh), length, LENGTH_WEIGHT)[0]
    assert energy == pytest.approx(naive.energy(grid, length, LENGTH_WEIGHT))
    settle(mesh, LENGTH_WEIGHT, 1e-6, 60)
    healed = mesh.to_grid(rough.grid)
    assert naive.energy(healed, length, 0.0) < 0.2 * len(healed.triangles)


def test_settling_never_raises_the_energy(rough: Rough) -> None:
    mesh = rough.mesh()
    scratch, length = new_scratch(mesh), rough.settings.length
    at_rest = mesh.net.nodes[mesh.net.kind >= AT_REST].copy()
    before = total_energy(mesh.net, mesh.patches, scratch, length, LENGTH_WEIGHT)[0]
    for _ in range(4):
        settle(mesh, LENGTH_WEIGHT, 0.0, 3)
        after = total_energy(mesh.net, mesh.patches, scratch, length, LENGTH_WEIGHT)[0]
        assert after <= before + 1e-9
        before = after
    assert np.array_equal(at_rest, mesh.net.nodes[mesh.net.kind >= AT_REST])


def test_a_move_that_does_not_pay_leaves_no_trace(rough: Rough) -> None:
    mesh = rough.mesh()
    net, scratch, length = mesh.net, new_scratch(mesh), rough.settings.length
    settle(mesh, LENGTH_WEIGHT, 1e-4, 20)
    live = net.degree > 0
    kept = [array[live].copy() for array in (net.nodes, net.degree, net.arc, net.kind)]
    rings = [net.ring[v, : net.degree[v]].tolist() for v in np.flatnonzero(live)]
    free = net.spare[0]
    for v in range(0, len(rough.grid.nodes), 5):
        for u in net.ring[v, : net.degree[v]].tolist():
            for move, allowed in enumerate((may_flip, may_collapse, may_split)):
                if allowed(net, v, u):
                    worth = 0.0 if move == 0 else (99.0 if move == 1 else -99.0)
                    if local_search.disorder(net, move, v, u) > 0 or move > 0:
                        assert (
                            not local_search.try_move(
                                net, mesh.patches, mesh.curves, scratch, move, v, u, length, LENGTH_WEIGHT, worth
                            )
                            or move == 0
                        )
                        if scratch.paid[0]:
                            return  # a flip that paid: from here on the net is another
    assert net.spare[0] == free
    for array, values in zip((net.nodes, net.degree, net.arc, net.kind), kept, strict=True):
        assert np.array_equal(array[live], values)
    assert rings == [net.ring[v, : net.degree[v]].tolist() for v in np.flatnonzero(live)]


def stated_energy(mesh: WorkingMesh, scratch: Scratch) -> float:
    """The energy that the search lowers, but for the share of each node."""
    energy, mean, count = total_energy(mesh.net, mesh.patches, scratch, mesh.length, LENGTH_WEIGHT)
    return energy + MEAN_LENGTH_WEIGHT * count * (mean / mesh.length - 1) ** 2 - 0.1 * count


def test_the_search_lowers_the_energy_and_keeps_the_topology(rough: Rough) -> None:
    mesh = rough.mesh()
    settle(mesh, LENGTH_WEIGHT, 1e-4, 30)
    scratch = new_scratch(mesh)
    before, kept = stated_energy(mesh, scratch), search_once(mesh, scratch)
    assert kept > 0
    assert stated_energy(mesh, scratch) < before
    assert same_topology(rough.grid, mesh.to_grid(rough.grid))


@compiled_only
@pytest.mark.parametrize("seed", range(4))
def test_each_kept_move_lowers_the_energy_of_the_whole_grid(seed: int) -> None:
    """Also where much is folded: else neighbours could lower their own energies in turn for ever."""
    mesh = rough_sphere(count=160, seed=seed).mesh()
    net, rng = mesh.net, np.random.default_rng(seed)
    net.nodes[: net.used] += 0.6 * mesh.length * rng.uniform(-1, 1, (net.used, 3))
    scratch = new_scratch(mesh)
    before = total_energy(net, mesh.patches, scratch, mesh.length, LENGTH_WEIGHT)[0]
    for v in range(net.used):
        for u in net.ring[v, : net.degree[v]].tolist():
            if net.degree[v] and may_flip(net, v, u):
                local_search.try_move(
                    net, mesh.patches, mesh.curves, scratch, local_search.FLIP, v, u, mesh.length, LENGTH_WEIGHT, 0.0
                )
                after = total_energy(net, mesh.patches, scratch, mesh.length, LENGTH_WEIGHT)[0]
                assert after == before or after < before - 9e-5
                before = after
    assert scratch.paid[0] > 10


@compiled_only
def test_members_become_equal_and_triangles_regular(rough: Rough) -> None:
    mesh = rough.mesh()
    equalize(mesh)
    finish(mesh)
    after = mesh.to_grid(rough.grid)
    quality, length = after.quality, rough.settings.length
    assert same_topology(rough.grid, after)
    assert quality.shape_mean > max(0.97, rough.grid.quality.shape_mean)
    assert quality.shape_std < rough.grid.quality.shape_std
    assert quality.length_cv < min(0.12, rough.grid.quality.length_cv)
    assert abs(quality.length_mean / length - 1) < 0.04
    assert quality.angle_min > 30
    assert known(quality.node_deviation_mean) < 0.01 * length
    for corner in rough.corners:
        assert np.abs(after.nodes - corner).max(axis=1).min() == 0.0
    if len(rough.curves.total):
        rim = np.concatenate(after.boundary_loops)
        far = [naive.nearest_on_polyline(rough.curves.points, place, 50) for place in after.nodes[rim]]
        assert max(far) < 0.01 * length


@compiled_only
@pytest.mark.parametrize("stretch", [0.8, 1.25])
def test_the_mean_length_comes_to_the_desired_one(stretch: float) -> None:
    rough = rough_disc(length=0.16)
    rough = rough._replace(settings=rough.settings.replace(length=0.16 * stretch))
    mesh = rough.mesh()
    equalize(mesh)
    finish(mesh)
    after = mesh.to_grid(rough.grid)
    assert same_topology(rough.grid, after)
    assert abs(after.lengths.mean() / (0.16 * stretch) - 1) < 0.06


@compiled_only
def test_the_same_grid_comes_out_twice(rough: Rough) -> None:
    found = []
    for _ in range(2):
        mesh = rough.mesh()
        equalize(mesh)
        finish(mesh)
        found.append(mesh.to_grid(rough.grid))
    assert found[0].nodes.tobytes() == found[1].nodes.tobytes()
    assert found[0].triangles.tobytes() == found[1].triangles.tobytes()


def test_a_grid_closed_while_it_settles_is_the_one_closed_when_it_has(rough: Rough) -> None:
    mesh = rough.mesh()
    equalize(mesh)
    closed = mesh.close(rough.grid)
    finish(mesh)
    early, late = mesh.to_grid(rough.grid, closed), mesh.to_grid(rough.grid)
    assert "topology" in vars(early) and early.topology == late.topology
    for name in ("nodes", "triangles", "fixed", "deviation"):
        assert getattr(early, name).tobytes() == getattr(late, name).tobytes()


def test_a_grid_in_disorder_is_mended() -> None:
    rough = rough_disc(jitter=0.1)
    rng = np.random.default_rng(0)
    nodes = rough.grid.nodes.copy()
    inside = np.setdiff1d(np.arange(len(nodes)), np.concatenate(rough.grid.boundary_loops))
    nodes[inside, :2] += rough.settings.length * rng.uniform(-0.7, 0.7, (len(inside), 2))
    rough = rough._replace(grid=rough.grid.replace(nodes=nodes))
    assert rough.grid.quality.angle_min < 10
    mesh = rough.mesh()
    equalize(mesh)
    finish(mesh)
    after = mesh.to_grid(rough.grid)
    assert same_topology(rough.grid, after)
    assert after.quality.angle_min > 25 and after.quality.shape_mean > 0.96


LOOP = np.array([(0, 0, 0), (1, 0, 0.2), (1.5, 1, 0), (0.5, 1.7, -0.3), (-0.4, 0.9, 0)])


@given(some.floats(-7, 13), some.tuples(some.floats(-1, 2), some.floats(-1, 2), some.floats(-1, 1)))
def test_places_on_a_curve_agree_with_sampling(arc: float, place: tuple[float, float, float]) -> None:
    rim = curve_of(LOOP)
    curve, at, distance = curves.nearest_on_curves(rim, *place)
    assert curve == 0 and distance == pytest.approx(naive.nearest_on_polyline(LOOP, np.array(place)), abs=2e-3)
    there = curves.at_arc(rim, 0, at)
    assert np.linalg.norm(np.array(there[1:]) - place) == pytest.approx(distance, abs=1e-9)
    found = curves.slide(rim, 0, arc % rim.total[0], 100.0, *place)
    assert np.linalg.norm(np.array(found[1:]) - place) == pytest.approx(distance, abs=1e-9)


@given(some.integers(0, 10_000), some.tuples(some.floats(-3, 3), some.floats(-3, 3), some.floats(-1, 1)))
def test_no_place_on_a_long_curve_is_nearer_than_the_one_found(seed: int, place: tuple[float, float, float]) -> None:
    rng = np.random.default_rng(seed)
    angle = np.sort(rng.uniform(0, 2 * np.pi, 300))
    wide = 1.0 + 0.6 * np.cos(rng.integers(2, 9) * angle) + rng.normal(0, 0.03, 300)
    rim = curve_of(np.stack([wide * np.cos(angle), wide * np.sin(angle), 0.2 * np.sin(5 * angle)], axis=1))
    squares = [curves.foot_on_segment(rim, 0, i, 0.0, np.inf, *place)[0] for i in range(300)]
    assert curves.nearest_on_curves(rim, *place)[2] == pytest.approx(np.sqrt(min(squares)), rel=1e-12)


@given(some.floats(0, 5), some.floats(0.01, 1), some.tuples(some.floats(-1, 2), some.floats(-1, 2), some.floats(-1, 1)))
def test_sliding_stays_within_reach_and_never_leads_away(
    arc: float, reach: float, place: tuple[float, float, float]
) -> None:
    rim = curve_of(LOOP)
    total = rim.total[0]
    arc, *start = curves.at_arc(rim, 0, arc)
    found, *there = curves.slide(rim, 0, arc, reach, *place)
    gone = abs((found - arc + total / 2) % total - total / 2)
    assert gone <= reach + 1e-9
    assert np.linalg.norm(np.subtract(there, place)) <= np.linalg.norm(np.subtract(start, place)) + 1e-9


def test_no_curve_is_nearest_where_there_is_none() -> None:
    from rough import no_boundary

    assert curves.nearest_on_curves(no_boundary(), 0.0, 0.0, 0.0)[0] == -1


def test_the_energy_of_a_grid_is_that_of_plain_loops_and_the_price_of_its_mean_length(rough: Rough) -> None:
    for share in (0.8, 1.0, 1.3):
        length = share * rough.settings.length
        stretch = np.mean(
            [np.linalg.norm(np.subtract(*rough.grid.nodes[list(edge)])) for edge in naive.wings(rough.grid)]
        )
        price = MEAN_LENGTH_WEIGHT * len(rough.grid.nodes) * (stretch / length - 1) ** 2
        unfolded = naive.energy(rough.grid, length, LENGTH_WEIGHT) - naive.energy(rough.grid, length, 0.0)
        shapes = sum(1 - naive.shape(*rough.grid.nodes[t]) for t in rough.grid.triangles)
        assert naive.grid_energy(rough.grid, length) == pytest.approx(unfolded + shapes + price)


@pytest.mark.parametrize(("away", "moves"), [(0.0, True), (kernels.PATCH_REACH - 0.01, False)])
def test_a_node_does_not_leave_the_part_of_the_scan_that_its_patch_knows(away: float, moves: bool) -> None:
    rough = rough_disc()
    mesh, length = rough.mesh(), rough.settings.length
    net = mesh.net
    v = int(np.flatnonzero((net.degree > 0) & (net.kind == INTERIOR))[7])
    settle(mesh, LENGTH_WEIGHT, 1e-5, 60)
    rest = net.nodes[v].copy()
    normal = mesh.patches[v].normal.copy()
    along = mesh.patches[v].tangent.copy()
    net.nodes[v] = rest + 0.6 * length * along  # it wants to go back, against `along`
    mesh.patches[v].centre = net.nodes[v] + away * length * along
    mesh.patches[v].heights = 0.0
    place = net.nodes[v].copy()
    gained = kernels.settle_node(
        net, mesh.patches, mesh.curves, v, length, LENGTH_WEIGHT, 1e-6, kernels.OVER_RELAXATION
    )
    assert (gained > 0) == moves == bool(np.linalg.norm(net.nodes[v] - place) > 0)
    assert np.linalg.norm(net.nodes[v] - mesh.patches[v].centre) <= kernels.PATCH_REACH * length
    assert abs((net.nodes[v] - place) @ normal) < 1e-9


def test_long_strides_even_out_a_whole_grid_in_half_the_sweeps(rough: Rough) -> None:
    """Successive over-relaxation: what is uneven in the large goes slowly, node by node."""

    def energy_after(sweeps: int, stride: float) -> float:
        mesh = rough.mesh()
        settle(mesh, LENGTH_WEIGHT, 0.0, sweeps, stride)
        return total_energy(mesh.net, mesh.patches, new_scratch(mesh), mesh.length, LENGTH_WEIGHT)[0]

    plain, long = energy_after(36, kernels.OVER_RELAXATION), energy_after(18, LAST_RELAXATION)
    assert long < plain * 1.001
    assert long < energy_after(18, 1.0)
