"""Effort: more time leaves less energy; the grid does not depend on the number of processors."""

from itertools import product

import numpy as np
import pytest
from shapes import make

import scantruss as st
from scantruss import several
from scantruss.errors import FrontError
from scantruss.grid.equalize import grid_energy


@pytest.fixture(scope="module")
def shape():
    return make("scallop", 20_000)


def grid_of(shape, effort, **others):
    return st.grid_from_points(shape.points, st.Settings(length=1.4 * shape.length, effort=effort), **others)


def test_more_effort_leaves_less_energy():
    """On the mean of some scans of some shapes, for a node; a single grid may be lucky."""
    energies = []
    for effort in ("quick", "normal", "best"):
        shares = []
        for name, seed in product(("scallop", "l_plate", "two_holes"), range(4)):
            shape = make(name, 20_000, seed=seed)
            grid = grid_of(shape, effort)
            shares.append(grid_energy(grid, 1.4 * shape.length) / len(grid.nodes))
        energies.append(np.mean(shares))
    assert 0.95 * energies[0] > energies[1] > 1.03 * energies[2]


def test_lengths_or_shapes_can_be_preferred(shape):
    quality = {
        prefer: st.grid_from_points(shape.points, st.Settings(length=1.4 * shape.length, prefer=prefer)).quality
        for prefer in ("lengths", "balance", "shapes")
    }
    assert quality["lengths"].length_cv < quality["balance"].length_cv < quality["shapes"].length_cv
    assert quality["lengths"].shape_mean < quality["balance"].shape_mean < quality["shapes"].shape_mean


def test_the_number_of_processors_makes_no_difference(shape, monkeypatch):
    grids = []
    for count in (1, 2, 5):
        monkeypatch.setattr(several, "processors", lambda count=count: count)
        grids.append(grid_of(shape, "best"))
    for grid in grids[1:]:
        assert grid.nodes.tobytes() == grids[0].nodes.tobytes()
        assert grid.triangles.tobytes() == grids[0].triangles.tobytes()


def test_the_quality_before_is_that_of_the_front_and_fixed_nodes_stay(shape):
    place = tuple(shape.points[7])
    settings = st.Settings(length=1.4 * shape.length, effort="best", fixed=(place,))
    grid = st.grid_from_points(shape.points, settings)
    assert grid.before.length_cv > 1.3 * grid.quality.length_cv
    assert np.linalg.norm(grid.nodes[grid.fixed] + grid.origin - place, axis=1).min() < 1e-9 * shape.length
    assert grid.settings == settings


def test_progress_grows_to_the_end(shape):
    seen = []
    grid_of(shape, "best", progress=lambda stage, share: seen.append((stage, share)))
    shares = [share for stage, share in seen if stage == "optimize"]
    assert shares == sorted(shares) and shares[-1] == 1.0


def test_fronts_that_fail_are_left_out_and_the_fault_of_the_best_is_told(shape, monkeypatch):
    cloud, settings = st.PointCloud.from_array(shape.points), st.Settings(length=1.4 * shape.length, effort="best")
    boundary = st.find_boundary(cloud, settings)
    refused = []

    def check(grid):
        if len(refused) < 3:
            refused.append(grid)
            raise FrontError(f"fault {len(refused)}")
        return grid

    monkeypatch.setattr(several, "processors", lambda: 1)
    _, grid, _ = several.several_grids(cloud, boundary, settings, check)
    assert len(refused) == 3 and grid.topology.manifold

    def never(grid):
        refused.append(grid)
        raise FrontError(f"fault {len(refused)}")

    refused.clear()
    with pytest.raises(FrontError, match="fault 1"):
        several.several_grids(cloud, boundary, settings, never)
