"""Landing: nodes come down on the scanned surface and not on its noise, however the points lie."""

from __future__ import annotations

import pytest
from shapes import make

import scantruss as st


@pytest.mark.parametrize("lines", [0.0, 1.1])
def test_nodes_lie_nearer_to_the_true_surface_than_half_the_noise(lines: float) -> None:
    """Also between scan lines: points along one line tell nothing of the surface beside it."""
    shape = make("scallop", 40_000, scan_lines=lines)
    grid = st.grid_from_points(shape.points, st.Settings(length=shape.length, effort="quick"))
    assert shape.distance(grid.nodes + grid.origin).mean() <= 0.5 * shape.noise
