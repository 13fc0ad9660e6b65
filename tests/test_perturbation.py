"""Kicks: they lower the energy or leave no trace, and never touch the topology."""

from typing import Any

import naive_grid
import numpy as np
import pytest
from rough import Rough, rough_disc, rough_sphere, same_topology

from scantruss.improve.equalize import MEAN_LENGTH_WEIGHT, energy_of_node, new_scratch, settle
from scantruss.improve.perturbation import LONGER, Spared, new_area, search_widely
from scantruss.improve.working_mesh import LENGTH_WEIGHT, WorkingMesh
from scantruss.kernels.mesh import perturbation as kernels
from scantruss.kernels.mesh.grid import LOCKED, Net
from scantruss.kernels.mesh.perturbation import Area
from scantruss.kernels.mesh.trial import Scratch, total_energy

MAKERS = {
    "disc": lambda seed=0: rough_disc(length=0.4, seed=seed, points=1500),
    "sphere": lambda seed=0: rough_sphere(count=60, seed=seed, points=1500),
}


@pytest.fixture(params=sorted(MAKERS))
def settled(request: pytest.FixtureRequest) -> tuple[Rough, WorkingMesh, Scratch, Area]:
    """A rough grid, settled, with room for perturbations."""
    rough = MAKERS[request.param]()
    mesh = rough.mesh()
    settle(mesh, LENGTH_WEIGHT, 1e-4, 30)
    return rough, mesh, new_scratch(mesh), new_area(mesh)


def trace(net: Net) -> Any:
    """All that a net says of the nodes in use."""
    used = np.flatnonzero(net.degree > 0)
    rings = np.where(np.arange(net.ring.shape[1]) < net.degree[used, None], net.ring[used], -1)
    return used.tolist(), rings.tolist(), net.nodes[used].tobytes(), net.arc[used].tobytes(), net.degree[used].tobytes()


def energy_of(mesh: WorkingMesh, scratch: Scratch) -> float:
    return total_energy(mesh.net, mesh.patches, scratch, mesh.length, LENGTH_WEIGHT)[0]


def perturb(mesh: WorkingMesh, scratch: Scratch, area: Area, v: int, worth: float, temperature: float = 0.0) -> bool:
    listed = kernels.list_area(mesh.net, mesh.patches, area, v) == kernels.AREA_LISTED
    return listed and kernels.perturb(
        mesh.net,
        mesh.patches,
        mesh.curves,
        scratch,
        area,
        mesh.length,
        LENGTH_WEIGHT,
        worth,
        0.0,
        temperature,
        kernels.ALLOWANCE_SEARCHED,
    )


@pytest.mark.kernels
def test_a_perturbation_that_does_not_pay_leaves_no_trace(settled: tuple[Rough, WorkingMesh, Scratch, Area]) -> None:
    """If a node more or less may cost nothing, at most what moves no node pays."""
    _, mesh, scratch, area = settled
    net = mesh.net
    before, free, patches = trace(net), int(net.spare[0]), mesh.patches[net.degree > 0].tobytes()
    perturbed = 0
    for v in np.flatnonzero(net.degree > 0)[::2].tolist():
        assert kernels.list_area(net, mesh.patches, area, v) == kernels.AREA_LISTED
        perturbed += kernels.move_at_random(net, mesh.patches, mesh.curves, scratch, area, mesh.length)
        kernels.settle_area(net, mesh.patches, mesh.curves, area, mesh.length, LENGTH_WEIGHT)
        kernels.search_area(net, mesh.patches, mesh.curves, scratch, area, mesh.length, LENGTH_WEIGHT, 0.05)
        kernels.put_area_back(net, mesh.patches, area)
        assert int(net.spare[0]) == free and trace(net) == before
        assert mesh.patches[net.degree > 0].tobytes() == patches
    assert perturbed > 20


@pytest.mark.kernels
def test_the_energy_of_the_area_changes_by_as_much_as_that_of_the_grid(
    settled: tuple[Rough, WorkingMesh, Scratch, Area],
) -> None:
    _, mesh, scratch, area = settled
    net = mesh.net
    for v in np.flatnonzero(net.degree > 0)[::8].tolist():
        assert kernels.list_area(net, mesh.patches, area, v) == kernels.AREA_LISTED
        before = (
            kernels.area_energy(net, mesh.patches, scratch, area, mesh.length, LENGTH_WEIGHT),
            energy_of(mesh, scratch),
        )
        kernels.move_at_random(net, mesh.patches, mesh.curves, scratch, area, mesh.length)
        kernels.settle_area(net, mesh.patches, mesh.curves, area, mesh.length, LENGTH_WEIGHT)
        kernels.search_area(net, mesh.patches, mesh.curves, scratch, area, mesh.length, LENGTH_WEIGHT, 0.0)
        after = (
            kernels.area_energy(net, mesh.patches, scratch, area, mesh.length, LENGTH_WEIGHT),
            energy_of(mesh, scratch),
        )
        assert after[0] - before[0] == pytest.approx(after[1] - before[1], abs=1e-9)


def test_a_perturbation_that_pays_lowers_the_energy_by_more_than_its_nodes_are_worth(
    settled: tuple[Rough, WorkingMesh, Scratch, Area],
) -> None:
    rough, mesh, scratch, area = settled
    net, paid = mesh.net, 0
    for v in np.flatnonzero(net.degree > 0).tolist() * 2:
        if net.degree[v] == 0:
            continue
        before, free = energy_of(mesh, scratch), int(net.spare[0])
        if perturb(mesh, scratch, area, v, 0.03):
            paid += 1
            assert energy_of(mesh, scratch) < before + 0.03 * (free - int(net.spare[0])) - 9e-5
    assert paid > 3
    assert same_topology(rough.grid, mesh.to_grid(rough.grid))


def test_heat_lets_a_perturbation_cost_something(settled: tuple[Rough, WorkingMesh, Scratch, Area]) -> None:
    _, mesh, scratch, area = settled
    rises = 0
    for v in np.flatnonzero(mesh.net.degree > 0).tolist():
        before = energy_of(mesh, scratch)
        if mesh.net.degree[v] > 0 and perturb(mesh, scratch, area, v, 0.0, temperature=0.5):
            rises += energy_of(mesh, scratch) > before
    assert rises > 0


@pytest.mark.parametrize("effort", ["normal", "best"])
def test_the_wide_search_lowers_the_energy_the_same_way_every_time(
    settled: tuple[Rough, WorkingMesh, Scratch, Area], effort: str
) -> None:
    rough, mesh, _, _ = settled
    before = energy_of_node(mesh)
    search_widely(mesh, effort)
    other = MAKERS["disc" if (mesh.net.is_open == 1).any() else "sphere"]().mesh()
    settle(other, LENGTH_WEIGHT, 1e-4, 30)
    search_widely(other, effort)
    assert energy_of_node(mesh) < before
    assert trace(mesh.net) == trace(other.net)
    assert same_topology(rough.grid, mesh.to_grid(rough.grid))


def test_the_energy_of_a_node_is_that_of_the_slow_twin(settled: tuple[Rough, WorkingMesh, Scratch, Area]) -> None:
    rough, mesh, _, _ = settled
    grid = mesh.to_grid(rough.grid)
    mean = np.linalg.norm(np.diff(grid.nodes[grid.edges], axis=1), axis=2).mean()
    slow = (
        naive_grid.energy(grid, mesh.length, LENGTH_WEIGHT) / len(grid.nodes)
        + MEAN_LENGTH_WEIGHT * (mean / mesh.length - 1.0) ** 2
    )
    assert energy_of_node(mesh) == pytest.approx(slow, rel=1e-9)


@pytest.mark.kernels
def test_a_defect_is_left_alone(settled: tuple[Rough, WorkingMesh, Scratch, Area]) -> None:
    _, mesh, _, area = settled
    mesh.net.kind[:] = LOCKED
    first = int(np.flatnonzero(mesh.net.degree > 0)[0])
    assert kernels.list_area(mesh.net, mesh.patches, area, first) == kernels.AREA_UNFIT


@pytest.mark.kernels
def test_an_area_that_reaches_out_of_bounds_is_told(settled: tuple[Rough, WorkingMesh, Scratch, Area]) -> None:
    _, mesh, _, area = settled
    net = mesh.net
    first = int(np.flatnonzero(net.degree > 0)[0])
    assert kernels.list_area(net, mesh.patches, area, first) == kernels.AREA_LISTED
    around = area.around[: area.gathered[0]].copy()
    for out in around[:: max(len(around) // 5, 1)].tolist():
        area.out[out] = 1
        assert kernels.list_area(net, mesh.patches, area, first) == kernels.AREA_OUT_OF_BOUNDS
        area.out[out] = 0
    assert kernels.list_area(net, mesh.patches, area, first) == kernels.AREA_LISTED


@pytest.mark.kernels
def test_a_net_is_as_before_until_a_member_of_the_area_changes(
    settled: tuple[Rough, WorkingMesh, Scratch, Area],
) -> None:
    _, mesh, scratch, area = settled
    net, changed = mesh.net, 0
    for v in np.flatnonzero(net.degree > 0)[::4].tolist():
        before = trace(net)[:2]
        assert kernels.list_area(net, mesh.patches, area, v) == kernels.AREA_LISTED
        assert kernels.is_as_before(net, area)
        made = kernels.move_at_random(net, mesh.patches, mesh.curves, scratch, area, mesh.length)
        used, rings = trace(net)[:2]
        same = used == before[0] and all(set(a) == set(b) for a, b in zip(rings, before[1], strict=True))
        assert kernels.is_as_before(net, area) == same
        changed += made > 0 and not same
        kernels.put_area_back(net, mesh.patches, area)
    assert changed > 3


def test_no_perturbation_begins_near_places_that_are_spared(settled: tuple[Rough, WorkingMesh, Scratch, Area]) -> None:
    """Where they are all of the grid it keeps its members; where they are a node, those that are far from it change."""
    _, mesh, _, _ = settled
    net, place = mesh.net, mesh.net.nodes[np.flatnonzero(mesh.net.degree > 0)[:1]]
    assert Spared(place, 0.5).away(place + [[0.0, 0.0, 0.4]]).tolist() == [False]
    assert Spared(place, 0.5).away(place + [[0.0, 0.0, 0.6]]).tolist() == [True]
    assert Spared(np.empty((0, 3)), 0.5).away(place).tolist() == [True]
    before = net.ring.copy(), net.degree.copy()
    search_widely(mesh, LONGER, spared=[Spared(place, 100.0)])
    assert (net.ring == before[0]).all() and (net.degree == before[1]).all()
    search_widely(mesh, LONGER, spared=[Spared(place, 0.1 * mesh.length)])
    assert (net.degree != before[1]).any()
