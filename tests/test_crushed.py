"""A grid with a spike where its scan has none fails, as up a chimney; where it crushes a foot or a knob that is said."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from small_clouds import sheet
from test_places_to_look_at import NOTHING, lattice, scanned
from typed import known

import scantruss as st
from scantruss.check.certify import certified, certify
from scantruss.check.crushed import frayed
from scantruss.check.limits import PLACES_KEPT
from scantruss.errors import CertificateError
from scantruss.grid.certificate import Fault

SETTINGS = st.Settings(length=1.0, ridge_angle=0.0)
GABLE = 0.55  # rise of a roof for each unit across
WIDE, HIGH = 0.4, 0.9  # of a chimney


def gable(places: np.ndarray) -> np.ndarray:
    """Places (K, 3) of a level sheet lifted to a roof with its ridge along x."""
    return places - GABLE * np.abs(places[:, 1:2]) * [0.0, 0.0, 1.0]


def chimney(seed: int = 2) -> np.ndarray:
    """Points of the walls and the top of a chimney that stands on the ridge."""
    random = np.random.default_rng(seed)
    at, across, z = random.uniform([[0.0], [-0.5], [-0.2]], [[4.0], [0.5], [1.0]], (3, 1600))
    side = at.astype(int)
    walls = np.where(
        side[:, None] < 2,
        np.column_stack([WIDE * across, np.where(side == 0, -0.5, 0.5) * WIDE, HIGH * z]),
        np.column_stack([np.where(side == 2, -0.5, 0.5) * WIDE, WIDE * across, HIGH * z]),
    )
    top = np.column_stack([WIDE * random.uniform(-0.5, 0.5, (400, 2)), np.full(400, HIGH)])
    return np.concatenate([walls, top])


def raised(height: float) -> tuple[st.Grid, st.Grid]:
    """A grid over a gable, and the same with the node in its middle lifted."""
    grid = lattice()
    nodes = gable(grid.nodes + grid.origin) - grid.origin
    flat = grid.replace(nodes=nodes)
    up = nodes.copy()
    up[int(np.linalg.norm(grid.nodes + grid.origin, axis=1).argmin()), 2] += height
    return flat, grid.replace(nodes=up)


def test_a_node_up_a_chimney_on_the_ridge_of_a_roof_is_a_fault_with_its_place() -> None:
    points = gable(sheet(13, 8, 0.06))
    points = np.concatenate([points[np.abs(points[:, :2]).max(axis=1) > 0.5 * WIDE], chimney()])
    flat, spiked = raised(HIGH)
    samples, grid = scanned(points, spiked)
    (fault,) = (fault for fault in certify(grid, samples, NOTHING, SETTINGS).faults if fault.kind == "spike")
    assert known(fault.where) == pytest.approx((0.0, 0.0, HIGH), abs=1e-9)
    with pytest.raises(CertificateError, match="has a spike where its scan has none"):
        certified(grid, samples, NOTHING, SETTINGS)
    samples, grid = scanned(points, flat)
    assert not any(fault.kind in ("spike", "crushed") for fault in certify(grid, samples, NOTHING, SETTINGS).faults)


def test_a_node_at_the_tip_of_a_cone_of_the_scan_is_neither_spike_nor_crushed() -> None:
    points = sheet(13, 8, 0.04)
    cone = np.maximum(1.0 - np.linalg.norm(points[:, :2], axis=1), 0.0)
    points[:, 2] += HIGH * cone
    grid = lattice()
    nodes = grid.nodes.copy()
    nodes[int(np.linalg.norm(grid.nodes + grid.origin, axis=1).argmin()), 2] += HIGH
    samples, grid = scanned(points, grid.replace(nodes=nodes))
    found = certify(grid, samples, NOTHING, SETTINGS)
    assert not any(fault.kind in ("spike", "crushed") for fault in (*found.faults, *found.warnings))


@pytest.mark.parametrize(
    ("places", "far", "fails"), [(6, 0.003, True), (5, 0.003, False), (6, 0.001, False), (30, 0.2, True)]
)
def test_a_grid_crushed_at_many_places_that_misses_the_scan_is_frayed(places: int, far: float, fails: bool) -> None:
    where = [(float(k), 0.0, 0.0) for k in range(places)]
    crushed = [Fault("crushed", "crushes a part", where[0], tuple(where[1:]))]
    away = np.where(np.arange(1000) < 1000 * far, 2.0, 0.1)
    found: Any = SimpleNamespace(scan=away)
    members, every = np.ones(1000), np.ones(1000, bool)
    assert bool(frayed(crushed, found, every, members)) == fails
    if fails:
        (fault,) = frayed(crushed, found, every, members)
        more = " or more" if places == PLACES_KEPT else ""
        assert fault.words.startswith(f"is frayed at {places} places{more}, where") and (
            fault.where,
            *fault.also,
        ) == tuple(where)
    assert not frayed(crushed, found, away < 1.0, members)  # what is missed is none that is to be followed
    assert not frayed([], found, every, members)
