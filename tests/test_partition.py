"""Two parts of a grid: apart, complete, and the same whoever works on them."""

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
import pytest
from rough import Rough, rough_disc, rough_sphere, same_topology

from scantruss.improve import equalize, perturbation
from scantruss.improve.partition import Partition
from scantruss.improve.working_mesh import LENGTH_WEIGHT
from scantruss.kernels.mesh.grid import Net
from scantruss.kernels.mesh.partition import BETWEEN_PARTS
from scantruss.runtime import parallel

MAKERS: dict[str, Callable[[int], Rough]] = {
    "disc": lambda seed: rough_disc(length=0.14, seed=seed, points=9000),
    "sphere": lambda seed: rough_sphere(count=500, seed=seed, points=6000),
}


@pytest.fixture(params=sorted(MAKERS))
def make(request: pytest.FixtureRequest) -> Callable[..., Rough]:
    return MAKERS[request.param]


def ways(net: Net, start: Iterable[int]) -> dict[int, int]:
    """Members from a set of nodes to each node, by plain rings."""
    away, ring, steps = dict.fromkeys(start, 0), list(start), 0
    while ring:
        steps += 1
        ring = [u for v in ring for u in net.ring[v, : net.degree[v]].tolist() if away.setdefault(u, steps) == steps]
        ring = list(dict.fromkeys(ring))
    return away


@pytest.mark.kernels
@pytest.mark.parametrize("seed", range(2))
def test_two_rings_of_nodes_lie_between_the_parts(make: Callable[..., Rough], seed: int) -> None:
    net = make(seed).mesh().net
    live = net.degree > 0
    partition = Partition(net, live)
    first = np.flatnonzero(live & (partition.label == 0))
    away = ways(net, first.tolist())
    assert min(away[v] for v in np.flatnonzero(live & (partition.label == 1)).tolist()) >= 3
    counts = [int((live & (partition.label == side)).sum()) for side in (0, 1)]
    assert min(counts) > 0.3 * live.sum() and (live & (partition.label == BETWEEN_PARTS)).sum() < 0.3 * live.sum()


@pytest.mark.kernels
def test_each_half_has_free_nodes_of_its_own_and_gives_them_back(make: Callable[..., Rough]) -> None:
    net = make(0).mesh().net
    free, used = net.free[: net.spare[0]].copy(), net.used
    partition = Partition(net, net.degree > 0)
    stacks = [own.free[: own.spare[0]].tolist() for own in partition.nets]
    assert sorted(stacks[0] + stacks[1]) == sorted(free.tolist())
    assert all((partition.label[stack] == side).all() for side, stack in enumerate(stacks))
    partition.run(lambda side: None)
    assert sorted(net.free[: net.spare[0]].tolist()) == sorted(free.tolist()) and net.used == used


@pytest.mark.kernels
def test_a_grid_without_work_has_no_parts(make: Callable[..., Rough]) -> None:
    net = make(0).mesh().net
    partition = Partition(net, np.zeros(len(net.arc), bool))
    assert (partition.label[net.degree > 0] == BETWEEN_PARTS).all()


def in_independent_sets(make: Callable[..., Rough], monkeypatch: pytest.MonkeyPatch, seed: int = 1) -> Rough:
    """A mesh small enough for a test that is settled and searched in parts all the same."""
    monkeypatch.setattr(equalize, "NODES_SETTLED_IN_PARTS", 50)
    monkeypatch.setattr(equalize, "NODES_SEARCHED_IN_PARTS", 10)
    return make(seed)


@pytest.mark.kernels
@pytest.mark.parametrize("seed", range(3))
def test_each_node_settles_in_one_share_and_no_member_joins_two_that_settle_at_once(
    make: Callable[..., Rough], seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    net = in_independent_sets(make, monkeypatch, seed).mesh().net
    first, second, between = equalize.independent_sets_of(net)
    assert sorted([*first, *second, *between]) == np.flatnonzero(net.degree > 0).tolist()
    assert min(len(first), len(second)) > 0.3 * (net.degree > 0).sum()
    beside = {u for v in first.tolist() for u in net.ring[v, : net.degree[v]].tolist()}
    assert not beside & set(second.tolist())
    monkeypatch.setattr(equalize, "NODES_SETTLED_IN_PARTS", 10_000)
    assert [some.tolist() for some in equalize.independent_sets_of(net)] == [np.flatnonzero(net.degree > 0).tolist()]


@pytest.mark.parametrize("processors", [1, 4])
def test_equalizing_in_parts_leads_to_the_same_grid_on_any_machine(
    make: Callable[..., Rough], processors: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    nets = []
    for count in (2, processors):
        monkeypatch.setattr(parallel, "processors", lambda count=count: count)
        rough = in_independent_sets(make, monkeypatch)
        mesh = rough.mesh()
        equalize.equalize(mesh)
        equalize.finish(mesh)
        assert same_topology(rough.grid, mesh.to_grid(rough.grid))
        nets.append(mesh.net)
    for one, other in zip(*nets, strict=True):
        assert one.tobytes() == other.tobytes()


@pytest.mark.parametrize("seed", range(3))
def test_parts_settle_as_well_as_the_whole(
    make: Callable[..., Rough], seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    energies, sweeps = [], []
    for many in (50, 10_000):
        mesh = make(seed).mesh()
        monkeypatch.setattr(equalize, "NODES_SETTLED_IN_PARTS", many)
        sweeps.append(equalize.settle(mesh, LENGTH_WEIGHT, 1e-7, 400))
        energies.append(equalize.energy_of_node(mesh))
    assert max(sweeps) < 400
    assert energies[0] == pytest.approx(energies[1], rel=0.01)


def test_what_lies_between_is_searched_after_the_parts(
    make: Callable[..., Rough], monkeypatch: pytest.MonkeyPatch
) -> None:
    mesh = in_independent_sets(make, monkeypatch, 2).mesh()
    equalize.settle(mesh, LENGTH_WEIGHT, 1e-3, 20)
    net, scratch = mesh.net, equalize.new_scratch(mesh)
    seen, run = [], Partition.run

    def of_net() -> tuple[np.ndarray, ...]:
        return net.nodes, net.ring, net.degree, net.kind, net.curve, net.ideal, net.line

    def look(partition: Partition, work: Any) -> None:
        between = (partition.label == BETWEEN_PARTS) & (net.degree > 0)
        old = [array[between].copy() for array in of_net()]
        run(partition, work)
        seen.append([np.array_equal(array[between], was) for array, was in zip(of_net(), old, strict=True)])

    monkeypatch.setattr(Partition, "run", look)
    before = equalize.energy_of_node(mesh)
    kept = equalize.search_once(mesh, scratch)
    assert all(seen[0]) and kept > 0 and equalize.energy_of_node(mesh) < before
    while kept:
        kept = equalize.search_once(mesh, scratch)
    asking = (net.degree > 0) & (net.degree != net.ideal)
    assert asking.any() and (scratch.tried[asking] == 1).all()


@pytest.mark.parametrize("processors", [1, 4])
def test_perturbations_in_parts_lead_to_the_same_grid_on_any_machine(
    make: Callable[..., Rough], processors: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    nets = []
    for count in (2, processors):
        monkeypatch.setattr(parallel, "processors", lambda count=count: count)
        monkeypatch.setattr(perturbation, "NODES_OF_LARGE_GRID", 100)
        rough = make(1)
        mesh = rough.mesh()
        equalize.settle(mesh, LENGTH_WEIGHT, 1e-3, 20)
        before = equalize.energy_of_node(mesh)
        perturbation.search_widely(mesh, "normal")
        assert equalize.energy_of_node(mesh) < before
        assert same_topology(rough.grid, mesh.to_grid(rough.grid))
        nets.append(mesh.net)
    for one, other in zip(*nets, strict=True):
        assert one.tobytes() == other.tobytes()


def test_what_lies_between_stays_while_the_parts_are_perturbed(
    make: Callable[..., Rough], monkeypatch: pytest.MonkeyPatch
) -> None:
    mesh = make(2).mesh()
    equalize.settle(mesh, LENGTH_WEIGHT, 1e-3, 20)
    net = mesh.net
    names, seen, run = ("nodes", "ring", "degree"), [], Partition.run

    def look(partition: Partition, work: Any) -> None:
        parts = [(partition.label == label) & (net.degree > 0) for label in (BETWEEN_PARTS, 0, 1)]
        old = {name: getattr(net, name).copy() for name in names}
        run(partition, work)
        seen.append([any((getattr(net, name)[part] != old[name][part]).any() for name in names) for part in parts])

    monkeypatch.setattr(Partition, "run", look)
    monkeypatch.setattr(perturbation, "NODES_OF_LARGE_GRID", 100)
    perturbation.search_widely(mesh, "normal")
    assert len(seen) >= 2 and seen[0] == [False, True, True]
    assert not any(between for between, *_ in seen)
