"""Two halves of a grid: apart, complete, and the same whoever works on them."""

import numpy as np
import pytest
from rough import rough_disc, rough_sphere, same_topology

from scantruss import machine
from scantruss.grid import equalize, kicks
from scantruss.grid.halves import Halves
from scantruss.kernels.halves import BETWEEN

MAKERS = {
    "disc": lambda seed: rough_disc(length=0.14, seed=seed, points=9000),
    "sphere": lambda seed: rough_sphere(count=500, seed=seed, points=6000),
}


@pytest.fixture(params=sorted(MAKERS))
def make(request):
    return MAKERS[request.param]


def ways(net, start):
    """Members from a set of nodes to each node, by plain rings."""
    away, ring, steps = dict.fromkeys(start, 0), list(start), 0
    while ring:
        steps += 1
        ring = [u for v in ring for u in net.ring[v, : net.degree[v]].tolist() if away.setdefault(u, steps) == steps]
        ring = list(dict.fromkeys(ring))
    return away


@pytest.mark.kernels
@pytest.mark.parametrize("seed", range(3))
def test_two_rings_of_nodes_lie_between_the_halves(make, seed):
    net = make(seed).relief().net
    live = net.degree > 0
    halves = Halves(net, live)
    first = np.flatnonzero(live & (halves.label == 0))
    away = ways(net, first.tolist())
    assert min(away[v] for v in np.flatnonzero(live & (halves.label == 1)).tolist()) >= 3
    counts = [int((live & (halves.label == side)).sum()) for side in (0, 1)]
    assert min(counts) > 0.3 * live.sum() and (live & (halves.label == BETWEEN)).sum() < 0.3 * live.sum()


@pytest.mark.kernels
def test_each_half_has_free_nodes_of_its_own_and_gives_them_back(make):
    net = make(0).relief().net
    free, used = net.free[: net.free[-2]].copy(), net.used
    halves = Halves(net, net.degree > 0)
    stacks = [own.free[: own.free[-2]].tolist() for own in halves.nets]
    assert sorted(stacks[0] + stacks[1]) == sorted(free.tolist())
    assert all((halves.label[stack] == side).all() for side, stack in enumerate(stacks))
    halves.run(lambda side: None)
    assert sorted(net.free[: net.free[-2]].tolist()) == sorted(free.tolist()) and net.used == used


@pytest.mark.kernels
def test_a_grid_without_work_has_no_halves(make):
    net = make(0).relief().net
    halves = Halves(net, np.zeros(len(net.arc), bool))
    assert (halves.label[net.degree > 0] == BETWEEN).all()


@pytest.mark.parametrize("processors", [1, 4])
def test_kicks_in_halves_lead_to_the_same_grid_on_any_machine(make, processors, monkeypatch):
    nets = []
    for count in (2, processors):
        monkeypatch.setattr(machine, "processors", lambda count=count: count)
        monkeypatch.setattr(kicks, "MANY", 100)
        rough = make(1)
        relief = rough.relief()
        equalize.settle(relief, equalize.WEIGHT, 1e-3, 20)
        before = equalize.energy_of_node(relief)
        kicks.search_widely(relief, "normal")
        assert equalize.energy_of_node(relief) < before
        assert same_topology(rough.grid, relief.to_grid(rough.grid))
        nets.append(relief.net)
    for one, other in zip(*nets, strict=True):
        assert one.tobytes() == other.tobytes()


def test_what_lies_between_stays_while_the_halves_are_kicked(make, monkeypatch):
    relief = make(2).relief()
    equalize.settle(relief, equalize.WEIGHT, 1e-3, 20)
    net = relief.net
    names, seen, run = ("nodes", "ring", "state"), [], Halves.run

    def look(halves, work):
        parts = [(halves.label == label) & (net.degree > 0) for label in (BETWEEN, 0, 1)]
        old = {name: getattr(net, name).copy() for name in names}
        run(halves, work)
        seen.append([any((getattr(net, name)[part] != old[name][part]).any() for name in names) for part in parts])

    monkeypatch.setattr(Halves, "run", look)
    monkeypatch.setattr(kicks, "MANY", 100)
    kicks.search_widely(relief, "normal")
    assert len(seen) >= 2 and seen[0] == [False, True, True]
    assert not any(between for between, *_ in seen)
