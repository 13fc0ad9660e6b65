"""Chains of flips: they lower the energy or leave no trace, and never touch the topology."""

import numpy as np
import pytest
from rough import rough_disc, rough_sphere, same_topology

from scantruss.grid.equalize import WEIGHT, new_journal, new_scratch, settle
from scantruss.kernels import glide as kernels
from scantruss.kernels.grid import may_flip, wings
from scantruss.kernels.search import FLIP, disorder
from scantruss.kernels.trial import total_energy

pytestmark = pytest.mark.kernels

MAKERS = {
    "disc": lambda seed=0: rough_disc(length=0.4, seed=seed, points=1500),
    "sphere": lambda seed=0: rough_sphere(count=60, seed=seed, points=1500),
}


@pytest.fixture(params=sorted(MAKERS))
def settled(request):
    """A rough grid, settled, with room for chains."""
    rough = MAKERS[request.param]()
    relief = rough.relief()
    settle(relief, WEIGHT, 1e-4, 30)
    return rough, relief, new_scratch(relief), new_journal(relief)


def energy_of(relief, scratch):
    return total_energy(relief.net, scratch, relief.length, WEIGHT)[0]


def rings(net):
    return [net.ring[v, : net.degree[v]].tolist() for v in range(net.used)]


def test_a_chain_that_does_not_pay_leaves_no_trace(settled):
    _, relief, scratch, journal = settled
    net = relief.net
    kept = net.nodes.copy(), net.arc.copy(), net.state.copy(), rings(net)
    tried = 0
    for v in range(0, net.used, 3):
        for u in net.ring[v, : net.degree[v]].tolist():
            if may_flip(net, v, u):
                hopeless = -1e9  # gives up at once, whatever it finds
                paid = kernels.try_chain(
                    net, relief.patches, relief.rim, scratch, journal, v, u, relief.length, WEIGHT, 1, hopeless
                )
                assert not paid
                before = energy_of(relief, scratch)
                paid = kernels.try_chain(
                    net, relief.patches, relief.rim, scratch, journal, v, u, relief.length, WEIGHT, 3, 1e9
                )
                if paid:
                    assert energy_of(relief, scratch) < before - 9e-5
                    kept = net.nodes.copy(), net.arc.copy(), net.state.copy(), rings(net)
                tried += 1
                for now, then in zip((net.nodes, net.arc, net.state), kept[:3], strict=True):
                    assert np.array_equal(now, then)
                assert rings(net) == kept[3]
    assert tried > 20


def test_every_round_lowers_the_energy_and_keeps_the_topology(settled):
    rough, relief, scratch, journal = settled
    before = energy_of(relief, scratch)
    total = 0
    for _ in range(3):
        kept = kernels.glide(relief.net, relief.patches, relief.rim, scratch, journal, relief.length, WEIGHT, 4, 0.3)
        after = energy_of(relief, scratch)
        assert after <= before - 9e-5 * kept
        before, total = after, total + kept
    assert total > 0
    assert same_topology(rough.grid, relief.to_grid(rough.grid))


def test_the_next_flips_are_beside_the_last_allowed_and_do_not_undo_it(settled):
    net = settled[1].net
    corners, flips = np.empty(4, np.int64), np.empty((kernels.CHOICES, 2), np.int64)
    seen = 0
    for v in range(net.used):
        for u in net.ring[v, : net.degree[v]].tolist():
            if v < u and may_flip(net, v, u):
                corners[:2], corners[2:] = wings(net, v, u), (v, u)
                kernels.flip(net, v, u)
                count = kernels.list_flips(net, corners, flips)
                found = [tuple(sorted(edge)) for edge in flips[:count].tolist()]
                expected = {
                    tuple(sorted((a, b)))
                    for a in corners.tolist()
                    for b in net.ring[a, : net.degree[a]].tolist()
                    if may_flip(net, a, b) and disorder(net, FLIP, a, b) <= kernels.NO_WORSE
                } - {tuple(sorted(corners[:2].tolist()))}
                assert len(set(found)) == len(found) and set(found) == expected
                kernels.flip(net, int(corners[0]), int(corners[1]))
                seen += count
    assert seen > 50
