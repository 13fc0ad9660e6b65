"""Scans with the faults of real ones, at default settings: the right topology, on the true surface."""

from functools import lru_cache

import numpy as np
import pytest
from hard_scans import HARD, hard
from marks import compiled_only
from shapes import Shape

import scantruss as st


@lru_cache(maxsize=1)
def scanned(name: str) -> Shape:
    return hard(name, 0)


@compiled_only
@pytest.mark.parametrize("method", ["default", "paper"])
@pytest.mark.parametrize("name", HARD)
def test_topology_and_distance(name: str, method: str) -> None:
    """Nodes off the boundary lie within half the noise of the true surface on average (.003 members where there is hardly any)."""
    shape = scanned(name)
    settings = st.Settings(length=shape.length, effort="quick", method=method)
    if method == "paper":  # it merges nodes as they come and sets members no limits
        settings = settings.replace(min_length=0.2, max_length=2.5, min_angle=5.0, max_offset=0.5)
    grid = st.grid_from_points(shape.points, settings)
    assert grid.topology.manifold and grid.topology.orientable
    assert (grid.topology.boundary_loops, grid.topology.euler) == (len(shape.loops), shape.euler)
    assert grid.topology.components == shape.components
    inner = np.ones(len(grid.nodes), bool)
    inner[grid.edges[grid.edge_uses == 1].ravel()] = False
    off = shape.distance(grid.nodes[inner] + grid.origin).mean()
    assert off <= max(0.5 * shape.noise, 0.003 * shape.length)
