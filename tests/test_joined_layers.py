"""Members that lead from a layer of a scan to another that lies over it are said; a steep face without points is no gap."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from marks import compiled_only
from small_clouds import sheet
from test_places_to_look_at import lattice, scanned
from typed import known

import scantruss as st
from scantruss.check.gaps import is_empty_within
from scantruss.check.joined import parts_joined
from scantruss.grid.certificate import Fault
from scantruss.grid.grid import Grid
from scantruss.pipeline import grid_from_points


def plate(height: float, begin: float = -6.5, end: float = 6.5) -> np.ndarray:
    """Return a plate at a height over x from begin to end."""
    return sheet(13, 8, 0.09, keep=lambda x, y: (x >= begin) & (x <= end)) + np.array([0.0, 0.0, height])


def joint(scan: np.ndarray, height: float, spacing: float = 0.09) -> Fault | None:
    """Return the warning of a lattice that climbs by a height at x = 0.5, on a scan; it follows that on either side."""
    samples, grid = scanned(scan, lattice())
    nodes = grid.nodes + np.where(grid.nodes[:, :1] > 0.5, [[0.0, 0.0, height]], 0.0)
    found = parts_joined(grid.replace(nodes=nodes), replace(samples, spacing=spacing), 1.0)
    assert len(found) <= 1
    return found[0] if found else None


@pytest.mark.parametrize("height", [0.2, 0.3, 0.45, 0.6])
@pytest.mark.parametrize("begin", [0.4, -6.5])
def test_a_plate_over_another_that_a_grid_climbs_is_said(height: float, begin: float) -> None:
    found = known(joint(np.concatenate([plate(0.0), plate(height, begin)]), height))
    assert found.kind == "joined" and found.words.startswith("joins two layers of the scan, one over the other, ")
    assert float(found.words.split("over the other, ")[1].split()[0]) == pytest.approx(height, abs=0.12)
    assert abs(known(found.where)[0] - 0.5) < 0.6


@pytest.mark.parametrize("height", [0.2, 0.45, 0.8])
@pytest.mark.parametrize("seen", [False, True])
def test_a_step_whose_face_the_scanner_saw_or_not_joins_nothing(height: float, seen: bool) -> None:
    up = np.arange(0.0, height, 0.09)
    face = np.stack(np.meshgrid([0.55], np.arange(-4.0, 4.0, 0.09), up), axis=-1).reshape(-1, 3)
    parts = [plate(0.0, end=0.55), plate(height, 0.55), *([face] if seen else [])]
    assert joint(np.concatenate(parts), height) is None


def test_an_overhang_of_a_fifth_of_a_member_and_points_at_random_join_nothing() -> None:
    assert joint(np.concatenate([plate(0.0, end=0.7), plate(0.45, 0.5)]), 0.45) is None
    rng = np.random.default_rng(0)
    flat = rng.uniform([-6.5, -4.0], [6.5, 4.0], (9000, 2))
    step = np.where(flat[:, 0] > 0.55, 0.3, 0.0)
    assert joint(np.column_stack([flat, step + 0.02 * rng.normal(size=9000)]), 0.3, 0.1) is None


def test_what_is_said_of_a_gap_is_not_said_again() -> None:
    samples, grid = scanned(np.concatenate([plate(0.0), plate(0.3, 0.4)]), lattice())
    grid = grid.replace(nodes=grid.nodes + np.where(grid.nodes[:, :1] > 0.5, [[0.0, 0.0, 0.3]], 0.0))
    samples = replace(samples, spacing=0.09)
    (found,) = parts_joined(grid, samples, 1.0)
    assert parts_joined(grid, samples, 1.0, [found]) == []


@compiled_only
def test_the_joint_of_two_plates_close_to_each_other_is_said() -> None:
    """A plate 0.27 members over half of another became one sheet with it, with no word of the joint."""
    scan = np.concatenate([plate(0.0), plate(0.27, -1.0, 9.0)])
    grid: Grid = grid_from_points(scan, st.Settings(length=1.0), keep_failed=True)
    said = [fault for fault in known(grid.certificate).warnings if fault.kind == "joined"]
    assert grid.topology.components == len(said) == 1


def test_the_air_beside_an_edge_is_no_opening() -> None:
    """A narrow curve along the lip of a thin bowl, of which a disc beside it is free of points: an opening was said to be closed there."""
    turn, up = np.meshgrid(np.linspace(-1.5, 1.5, 60), np.linspace(0.0, 3.0, 60))
    wall = np.column_stack([turn.ravel(), np.zeros(turn.size), -up.ravel()])
    points = np.concatenate([wall, wall + [0.0, 0.4, 0.0]])
    around = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    curve = np.column_stack([0.6 * np.cos(around), 0.2 + 0.2 * np.sin(around), -0.05 + 0.0 * around])
    assert not is_empty_within(curve, points[np.argsort(points[:, 0])], np.zeros((0, 3)))
