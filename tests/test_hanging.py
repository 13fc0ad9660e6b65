"""A grid whose nodes hang on points off the surface fails; cliffs, horns and closed holes are none of that."""

from __future__ import annotations

import numpy as np
import pytest
from small_clouds import sheet
from test_places_to_look_at import NOTHING, lattice, scanned
from typed import known

import scantruss as st
from scantruss.check.certify import certified, certify
from scantruss.check.hanging import any_stands_off, nodes_off_sheets
from scantruss.errors import CertificateError

SETTINGS = st.Settings(length=1.0, ridge_angle=0.0)
ROOF = sheet(13, 8, 0.03)


def blob(x: float, y: float, z: float) -> np.ndarray:
    """A few points close together, as of a pole under the roof."""
    return np.array([x, y, z]) + 0.03 * np.random.default_rng(1).normal(size=(20, 3))


def test_a_node_on_a_pole_under_the_roof_is_a_fault_with_its_place() -> None:
    samples, grid = scanned(np.concatenate([ROOF, blob(0, 0, -0.8)]), lattice())
    down = int(np.linalg.norm(grid.nodes + grid.origin, axis=1).argmin())
    nodes = grid.nodes.copy()
    nodes[down, 2] -= 0.8
    whole = certify(grid, samples, NOTHING, SETTINGS)
    assert not any(fault.kind == "hanging" for fault in whole.faults)
    hanging = grid.replace(nodes=nodes)
    (fault,) = (fault for fault in certify(hanging, samples, NOTHING, SETTINGS).faults if fault.kind == "hanging")
    assert known(fault.where) == pytest.approx((0.0, 0.0, -0.8), abs=1e-9)
    with pytest.raises(CertificateError, match=r"hangs on points off the surface.*--crop or --piece"):
        certified(hanging, samples, NOTHING, SETTINGS)


def test_a_node_at_the_foot_of_a_column_is_a_fault_though_points_are_near_its_members() -> None:
    turn, height = np.random.default_rng(3).uniform([[0.0], [-1.0]], [[2.0 * np.pi], [0.0]], (2, 300))
    column = np.column_stack([0.1 * np.cos(turn), 0.1 * np.sin(turn), height])
    samples, grid = scanned(np.concatenate([sheet(13, 8, 0.06), column]), lattice())
    down = int(np.linalg.norm(grid.nodes + grid.origin, axis=1).argmin())
    nodes = grid.nodes.copy()
    nodes[down, 2] -= 0.8
    faults = certify(grid.replace(nodes=nodes), samples, NOTHING, SETTINGS).faults
    (fault,) = (fault for fault in faults if fault.kind == "hanging")
    assert known(fault.where) == pytest.approx((0.0, 0.0, -0.8), abs=1e-9)
    assert not any(fault.kind == "hanging" for fault in certify(grid, samples, NOTHING, SETTINGS).faults)
    assert any_stands_off(grid.replace(nodes=nodes), samples, 1.0) and not any_stands_off(grid, samples, 1.0)


def test_a_node_some_way_down_a_column_is_a_fault_too_but_none_on_a_bent_sheet() -> None:
    turn, height = np.random.default_rng(3).uniform([[0.0], [-1.0]], [[2.0 * np.pi], [0.0]], (2, 300))
    column = np.column_stack([0.1 * np.cos(turn), 0.1 * np.sin(turn), height])
    samples, grid = scanned(np.concatenate([ROOF, column]), lattice())
    down = int(np.linalg.norm(grid.nodes + grid.origin, axis=1).argmin())
    nodes = grid.nodes.copy()
    nodes[down, 2] -= 0.4
    found = certify(grid.replace(nodes=nodes), samples, NOTHING, SETTINGS)
    assert not any(fault.kind == "hanging" for fault in found.faults)
    (fault,) = (fault for fault in found.faults if fault.kind == "off sheet")
    assert known(fault.where) == pytest.approx((0.0, 0.0, -0.4), abs=1e-9)
    assert not nodes_off_sheets(grid, samples, 1.0)
    for radius in (0.7, 1.0, 1.5, 2.5):  # spheres bent ever less, and the tip of each
        at, points = lattice().nodes, ROOF.copy()
        for places in (at, points):
            places[:, 2] = np.sqrt(np.maximum(radius**2 - (places[:, :2] ** 2).sum(axis=1), 0.0))
        ball, bent = scanned(points, lattice().replace(nodes=at))
        assert not nodes_off_sheets(bent, ball, 1.0)


def test_a_pyramid_that_was_measured_is_none() -> None:
    """Its members are as steep, but points lie along them."""
    grid = lattice()
    down = int(np.linalg.norm(grid.nodes, axis=1).argmin())
    nodes = grid.nodes.copy()
    nodes[down, 2] -= 0.8
    grid = grid.replace(nodes=nodes)
    weights = np.random.default_rng(2).dirichlet(np.ones(3), (len(grid.triangles), 250))
    points = np.einsum("tpc,tcx->tpx", weights, nodes[grid.triangles]).reshape(-1, 3)
    samples, grid = scanned(points, grid)
    assert not any(fault.kind == "hanging" for fault in certify(grid, samples, NOTHING, SETTINGS).faults)


def test_a_cliff_that_the_scanner_did_not_see_is_none() -> None:
    """From its edge two members of six go down through empty space."""
    points = ROOF.copy()
    points[points[:, 0] > 0.2, 2] -= 0.7
    grid = lattice()
    nodes = grid.nodes.copy()
    nodes[nodes[:, 0] > 0.2, 2] -= 0.7
    samples, grid = scanned(points, grid.replace(nodes=nodes))
    assert not any(fault.kind == "hanging" for fault in certify(grid, samples, NOTHING, SETTINGS).faults)


def peak(places: np.ndarray) -> np.ndarray:
    """Heights (N,) of a membrane that rises to a high point at the origin."""
    heights: np.ndarray = 2.4 * np.exp(-np.linalg.norm(places[:, :2], axis=1) / 1.6)
    return heights


def mast(radius: float, low: float, high: float, count: int = 500) -> np.ndarray:
    """Points on an upright tube at the origin."""
    turn, height = np.random.default_rng(3).uniform([[0.0], [low]], [[2.0 * np.pi], [high]], (2, count))
    return np.column_stack([radius * np.cos(turn), radius * np.sin(turn), height])


@pytest.mark.parametrize(
    ("tip", "hole", "fails"), [(2.75, 0.57, True), (1.1, 0.57, True), (1.75, 0.57, False), (2.4, 0.0, False)]
)
def test_a_node_up_or_down_the_mast_of_a_peak_is_a_fault_and_one_on_the_peak_is_none(
    tip: float, hole: float, fails: bool
) -> None:
    """The sheet rises to the mast, so that no normal around it tells; where it ends beside the mast, it is 1.68 high."""
    points = ROOF[np.hypot(ROOF[:, 0], ROOF[:, 1]) >= hole]
    points[:, 2] = peak(points)
    grid = lattice()
    nodes = grid.nodes.copy()
    nodes[:, 2] = peak(nodes)
    nodes[np.linalg.norm(grid.nodes, axis=1).argmin(), 2] = tip
    samples, grid = scanned(np.concatenate([points, mast(0.09, -1.0, 2.9 if hole else 2.4)]), grid.replace(nodes=nodes))
    found = nodes_off_sheets(grid, samples, 1.0)
    assert bool(found) == fails == any_stands_off(grid, samples, 1.0)
    if fails:
        assert known(found[0].where) == pytest.approx((0.0, 0.0, tip), abs=1e-9)


def test_the_mast_of_a_canopy_is_left_out_and_its_peak_is_followed() -> None:
    rng = np.random.default_rng(8)
    way, turn = 4.0 * np.sqrt(rng.uniform(0.02, 1.0, 9000)), rng.uniform(0.0, 2.0 * np.pi, 9000)
    membrane = np.column_stack([way * np.cos(turn), way * np.sin(turn), 0.0 * way])
    membrane[:, 2] = peak(membrane)
    grid = st.grid_from_points(
        np.concatenate([membrane, mast(0.09, -1.0, 2.9)]), st.Settings(length=1.0, effort="quick")
    )
    nodes = grid.scan_nodes
    assert abs(nodes[:, 2] - peak(nodes)).max() < 0.1
    assert nodes[:, 2].max() > 1.5
