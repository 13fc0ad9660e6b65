"""Taubin's smoothing and its three stops (Sec. 4.1)."""

from collections.abc import Callable

import naive_grid as naive
import numpy as np
import pytest
from rough import Rough, rough_disc, rough_sphere, same_topology
from typed import known

from scantruss.improve.smoothing import (
    State,
    deviation_allowed,
    lengths_no_longer_even_out,
    moved_too_far,
    shape_no_longer_improves,
    smooth,
)
from scantruss.kernels.mesh import smoothing as kernels
from scantruss.kernels.mesh.grid import AT_REST, ON_CURVE


@pytest.fixture(scope="module")
def disc() -> Rough:
    return rough_disc()


def test_stop_a_the_shape_quality_is_no_longer_improved() -> None:
    before = State(shape=0.95, spread=0.5, moved=0.0)
    assert not shape_no_longer_improves(before, before._replace(shape=0.951))
    assert shape_no_longer_improves(before, before)
    assert shape_no_longer_improves(before, before._replace(shape=0.94))


def test_stop_b_the_standard_deviation_of_lengths_is_no_longer_reduced() -> None:
    before = State(shape=0.95, spread=0.5, moved=0.0)
    assert not lengths_no_longer_even_out(before, before._replace(spread=0.49))
    assert lengths_no_longer_even_out(before, before)
    assert lengths_no_longer_even_out(before, before._replace(spread=0.51))


def test_stop_c_the_average_deviation_is_larger_than_the_criterion() -> None:
    after = State(shape=0.95, spread=0.5, moved=0.2)
    assert moved_too_far(after, 0.19) and not moved_too_far(after, 0.2)


def test_the_criterion_is_the_setting() -> None:
    settings = rough_disc(points=500).settings
    assert deviation_allowed(settings.replace(max_deviation=0.01)) == 0.01
    assert deviation_allowed(settings) > 0


def test_the_state_agrees_with_plain_loops(disc: Rough) -> None:
    mesh = disc.mesh()
    start = mesh.net.nodes + 0.1
    shape, spread, moved = kernels.state_of(mesh.net, start)
    assert shape == pytest.approx(disc.grid.quality.shape_mean)
    assert spread == pytest.approx(disc.grid.quality.length_std)
    assert moved == pytest.approx(0.1 * 3**0.5)


def test_a_step_agrees_with_its_twin(disc: Rough) -> None:
    mesh = disc.mesh()
    net = mesh.net
    before, spare = net.nodes.copy(), np.empty_like(net.nodes)
    kernels.move_to_middle(net, 0.4, spare)
    for v, around in naive.neighbors(disc.grid).items():
        expected = before[v]
        if net.kind[v] < AT_REST:
            there = net.ring[v, [0, net.degree[v] - 1]].tolist() if net.kind[v] == ON_CURVE else sorted(around)
            expected = naive.middle(before, there, v, 0.4)
        assert net.nodes[v] == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("make", [rough_disc, rough_sphere])
def test_smoothing_improves_shape_and_lengths_and_keeps_the_topology(make: Callable[..., Rough]) -> None:
    rough = make()
    mesh = rough.mesh()
    result = smooth(mesh, rough.settings)
    after = mesh.to_grid(rough.grid)
    assert result.passes > 0
    assert same_topology(rough.grid, after)
    assert after.quality.shape_mean > rough.grid.quality.shape_mean
    assert after.quality.length_std < rough.grid.quality.length_std
    assert known(after.quality.node_deviation_mean) < 0.01 * rough.settings.length


def test_a_smaller_criterion_ends_earlier_and_is_kept(disc: Rough) -> None:
    passes = []
    for allowed in (1e-9, 0.01, 0.03, 1.0):
        mesh = disc.mesh()
        start = mesh.net.nodes.copy()
        result = smooth(mesh, disc.settings.replace(max_deviation=allowed * disc.settings.length))
        assert kernels.state_of(mesh.net, start)[2] <= allowed * disc.settings.length
        assert (result.stop == "c") == (allowed < 1)
        passes.append(result.passes)
    assert passes[0] == 0 and passes == sorted(passes)


def test_the_pass_after_which_it_stops_is_undone(disc: Rough) -> None:
    free = disc.settings.replace(max_deviation=100.0)
    mesh = disc.mesh()
    result = smooth(mesh, free)
    assert result.stop in ("a", "b")
    again = disc.mesh()
    limited = smooth(again, free.replace(smooth_passes=result.passes))
    assert limited == (result.passes, "")
    assert np.array_equal(mesh.net.nodes, again.net.nodes)


def test_no_pass_leaves_the_grid_as_it_was(disc: Rough) -> None:
    mesh = disc.mesh()
    before = mesh.net.nodes.copy()
    assert smooth(mesh, disc.settings.replace(smooth_passes=0)) == (0, "")
    assert np.array_equal(mesh.net.nodes, before)


def test_a_plate_stays_a_plate_and_its_corners_stay() -> None:
    plate = rough_disc(bulge=0.0, corners=True)
    mesh = plate.mesh()
    smooth(mesh, plate.settings)
    after = mesh.to_grid(plate.grid)
    assert np.abs(after.nodes[:, 2]).max() < 1e-9
    for corner in plate.corners:
        assert np.abs(after.nodes - corner).max(axis=1).min() == 0.0
    rim = np.concatenate(after.boundary_loops)
    assert np.abs(np.abs(after.nodes[rim] + plate.cloud.origin)[:, :2].max(axis=1) - 1).max() < 1e-9
