"""A sparse part of a sheet that a grid leaves out is said with its share of the surface, however few its points."""

from __future__ import annotations

import numpy as np
import pytest
from typed import known

import scantruss as st
from scantruss.report.figures import first_line


def roof_with_a_sparse_quarter(density: float) -> np.ndarray:
    rng = np.random.default_rng(3)
    x, y = rng.uniform(-12, 12, (2, 40_000))
    kept = (x < 2) | (y < 2) | (rng.random(len(x)) < density)
    x, y = x[kept], y[kept]
    return np.column_stack([x, y, 5 - 0.02 * x * x - 0.015 * y * y]) + rng.normal(0, 0.004, (len(x), 3))


@pytest.mark.parametrize(("density", "allowed"), [(0.02, 0.05), (0.02, 0.2), (1.0, 0.05)])
def test_a_sparse_part_that_is_left_out_fails_or_is_the_first_line_where_it_is_allowed(
    density: float, allowed: float
) -> None:
    """A sixth of a roof left with half a percent of its points, and no line said so."""
    settings = st.Settings(length=0.7, effort="quick", allow_missing=allowed)
    try:
        found = known(st.grid_from_points(roof_with_a_sparse_quarter(density), settings).certificate)
    except st.CertificateError as error:
        assert density < 1.0 and allowed < 0.1
        found = known(error.grid.certificate)
    assert found.passed == (density == 1.0 or allowed > 0.17)
    said = [each for each in (*found.faults, *found.warnings) if each.kind == "sparse"]
    assert len(said) == (density < 1.0)
    if said:
        assert found.judged_out < 0.01
        share = int(said[0].words.split("least ")[1].partition("%")[0])
        assert 8 <= share <= 17
        assert min(known(said[0].where)[:2]) > 1.0
    assert first_line(found) == [f"the grid {each.words}" for each in said if found.passed]
