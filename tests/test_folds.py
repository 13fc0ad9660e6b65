"""The energy of places off a fold: its gradient, its least on the crest, none where the surface is smooth."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from marks import compiled_only

import scantruss as st
from scantruss.kernels.surface import folds
from scantruss.kernels.surface.local_surface import SURFACE_PATCH, Surface, fit_patch

pytestmark = pytest.mark.kernels


def surface_of(points: np.ndarray) -> Surface:
    """Return the surface of points for members of length 1."""
    return st.sample_surface(st.PointCloud(points, np.zeros(3)), st.Settings(length=1.0)).surface


def patch_at(surface: Surface, place: np.ndarray, strength: float = 1.0) -> tuple[np.ndarray, Surface]:
    """Return a patch fitted at a place, in two rows, and the surface."""
    patches = np.zeros(2, SURFACE_PATCH)
    sample = int(np.argmin(np.linalg.norm(surface.mean - place, axis=1)))
    fit_patch(surface, patches[0], sample, tuple(place))
    folds.add_fold(surface, patches[0], folds.PLANES_REACH, strength)
    patches[1] = patches[0]
    return patches, surface


@cache
def roof(rise: float, points: int = 4_000) -> Surface:
    """Return the surface of a gable of length 6 along y whose flanks rise by `rise` per unit."""
    rng = np.random.default_rng(2)
    x, y = rng.uniform(-3, 3, points), rng.uniform(-3, 3, points)
    return surface_of(np.column_stack([x, y, -rise * np.abs(x)]))


def test_the_slope_is_that_of_the_energy_of_a_place() -> None:
    patches, _ = patch_at(roof(1.0), np.array([0.2, 0.1, -0.2]))
    for place in np.random.default_rng(1).uniform(-0.3, 0.3, (20, 3)):
        change = [
            (folds.fold_energy(patches, 0, *(place + step)) - folds.fold_energy(patches, 0, *(place - step))) / 2e-6
            for step in 1e-6 * np.eye(3)
        ]
        np.testing.assert_allclose(folds.fold_slope(patches, 0, *place), change, atol=1e-5)


def test_the_middle_of_a_member_off_the_surface_falls_down_its_slope() -> None:
    patches, _ = patch_at(roof(1.0), np.array([0.2, 0.1, -0.2]))
    for place in np.random.default_rng(1).uniform(-0.3, 0.3, (20, 3)) - [0.0, 0.0, 0.5]:
        slope = np.array(folds.chord_slope(patches, 0, 1, *place))
        before = folds.chord_energy(patches, 0, 1, *place)
        assert before > 0.0 and folds.chord_energy(patches, 0, 1, *(place - 1e-3 * slope)) < before


@compiled_only
@pytest.mark.parametrize("rise", [1.0, 1.5])
def test_a_node_beside_a_fold_is_drawn_to_its_crest(rise: float) -> None:
    patches, surface = patch_at(roof(rise, 20_000), np.array([0.2, 0.0, -0.2 * rise]))
    energies = [folds.fold_energy(patches, 0, x, 0.0, -rise * abs(x)) for x in np.linspace(-0.4, 0.4, 81)]
    assert abs(np.linspace(-0.4, 0.4, 81)[np.argmin(energies)]) < 0.15  # from 0.2
    beside = (0.1, 0.0, -0.1 * rise)
    fit_patch(surface, patches[0], patches[0].sample, beside)
    folds.add_fold(surface, patches[0], 0.4, 1.0)
    crest = folds.onto_crest(surface, patches[0], beside)
    assert np.hypot(crest[0], crest[2]) < np.hypot(beside[0], beside[2])


def test_a_gentle_bend_is_no_fold() -> None:
    rng = np.random.default_rng(2)
    x, y = rng.uniform(-3, 3, 4_000), rng.uniform(-3, 3, 4_000)
    patches, surface = patch_at(surface_of(np.column_stack([x, y, -0.1 * (x * x + y * y)])), np.zeros(3))
    assert patches[0].fold_weight == 0.0 and folds.fold_energy(patches, 0, 0.3, 0.0, 0.4) == 0.0
    assert folds.onto_crest(surface, patches[0], (0.3, 0.0, 0.1)) == (0.3, 0.0, 0.1)
