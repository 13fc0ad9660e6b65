"""Table 2 of the paper: what its examples 1-4 reach after optimization, by both methods, on clouds made alike."""

from __future__ import annotations

import pytest
from shapes import Shape, make

import scantruss as st

TABLE_2 = {  # mean G, std G, std L / mean L after optimization
    "scallop": (0.962, 0.041, 0.120),
    "clam": (0.970, 0.035, 0.109),
    "limpet": (0.981, 0.028, 0.095),
    "cloth": (0.974, 0.038, 0.119),
}


@pytest.fixture(scope="module", params=TABLE_2)
def shape(request: pytest.FixtureRequest) -> tuple[str, Shape]:
    return request.param, make(request.param, seed=1)


def test_the_paper_to_the_letter_reaches_what_the_paper_reports(shape: tuple[str, Shape]) -> None:
    name, cloud = shape
    grid = st.grid_from_points(cloud.points, st.Settings(length=cloud.length, method="paper"))
    mean, spread, variation = TABLE_2[name]
    assert grid.quality.shape_mean >= mean
    assert grid.quality.shape_std <= spread
    assert grid.quality.length_cv <= variation
    assert grid.before is not None and grid.before.shape_mean < grid.quality.shape_mean


def test_the_default_is_better(shape: tuple[str, Shape]) -> None:
    _, cloud = shape
    grid = st.grid_from_points(cloud.points, st.Settings(length=cloud.length))
    assert grid.quality.shape_mean >= 0.985
    assert grid.quality.shape_std <= 0.020
    assert grid.quality.length_cv <= 0.08
    assert grid.quality.length_mean == pytest.approx(cloud.length, rel=0.03)
