"""The clouds with known answers: their truth is measured on the true surface, and the options do what they say."""

from __future__ import annotations

import numpy as np
import pytest
import scans
from shapes import SHAPES, make
from surfaces import cut, distance_to_triangles, from_field

KNOWN = {  # loops, Euler number, components, corners
    "scallop": (1, 1, 1, 4),
    "clam": (1, 1, 1, 0),
    "limpet": (1, 1, 1, 0),
    "cloth": (1, 1, 1, 4),
    "two_holes": (3, -1, 1, 4),
    "stadium": (2, 0, 1, 0),
    "great_court": (2, 0, 1, 4),
    "sphere": (0, 2, 1, 0),
    "torus": (0, 0, 1, 0),
    "saddle": (1, 1, 1, 4),
    "two_patches": (2, 2, 2, 0),
    "thin_strip": (1, 1, 1, 4),
    "gable": (1, 1, 1, 6),
    "pantheon": (2, 0, 1, 0),
    "l_plate": (1, 1, 1, 6),
    "flat_plate": (1, 1, 1, 4),
    "terrain": (1, 1, 1, 4),
    "moebius": (1, 0, 1, 0),
    "fold_over": (1, 1, 1, 4),
    "cat": (0, 0, 1, 0),
    "mask": (1, 1, 1, 0),
    "hillside": (1, 1, 1, 0),
    "quarry": (3, -1, 1, 0),
}


@pytest.mark.parametrize("name", KNOWN)
def test_truth_is_what_the_surface_has(name: str) -> None:
    """Loops, Euler number, components and corners; points lie on the surface but for the noise."""
    shape = make(name, 3000, seed=1)
    assert (len(shape.loops), shape.euler, shape.components, len(shape.corners)) == KNOWN[name]
    deviation = shape.distance(shape.points)
    assert deviation.mean() < 1.3 * shape.noise + shape.length / 500
    if len(shape.corners):
        rim = np.concatenate(shape.loops)
        assert max(np.linalg.norm(rim - corner, axis=1).min() for corner in shape.corners) < 1e-9 * np.ptp(rim)


def test_areas_and_rims_of_simple_shapes_are_those_of_geometry() -> None:
    """Sphere, torus, gable and flat plate against formulas."""
    assert make("sphere", 10).area == pytest.approx(4 * np.pi * 50**2, rel=1e-3)
    assert make("torus", 10).area == pytest.approx(4 * np.pi**2 * 40 * 15, rel=1e-3)
    assert make("gable", 10).area == pytest.approx(2 * 60 * np.hypot(40, 36))
    plate = make("flat_plate", 10)
    assert np.linalg.norm(np.roll(plate.loops[0], -1, axis=0) - plate.loops[0], axis=1).sum() == pytest.approx(200)


def test_same_arguments_same_bytes() -> None:
    """A seed fixes every option; another seed changes the points."""
    one = make("cloth", 500, seed=3, pose=True, outliers=0.1, density_ratio=5)
    assert one.points.tobytes() == make("cloth", 500, seed=3, pose=True, outliers=0.1, density_ratio=5).points.tobytes()
    assert not np.array_equal(one.points, make("cloth", 500, seed=4, pose=True, outliers=0.1, density_ratio=5).points)


def test_truth_moves_with_the_cloud() -> None:
    """Pose, scale and offset keep distances to the surface, up to the scale."""
    still, moved = (
        make("gable", 500, seed=2),
        make("gable", 500, seed=2, pose=True, scale=0.01, offset=(5e5, 4.5e6, 100.0)),
    )
    assert moved.length == pytest.approx(0.01 * still.length)
    assert moved.area == pytest.approx(1e-4 * still.area, rel=1e-6)
    assert moved.distance(moved.points).mean() == pytest.approx(0.01 * still.distance(still.points).mean(), rel=0.05)


def test_options_change_what_they_say() -> None:
    """Counts of outliers and duplicates, denser end, points on lines."""
    assert len(make("flat_plate", 1000, outliers=0.1, duplicates=0.5).points) == 1600
    assert len(np.unique(make("flat_plate", 1000, duplicates=0.5).points, axis=0)) == 1000
    dense = make("flat_plate", 4000, density_ratio=25).points
    assert (dense[:, 0] > 0).sum() > 3 * (dense[:, 0] < 0).sum()
    lines = make("flat_plate", 1000, scan_lines=2.0).points
    assert np.ptp((lines[:, 1] + 20) % 2.0) < 0.3


def test_vertices_keep_apart() -> None:
    """Mesh-like clouds have no two points much nearer than the others."""
    from scipy.spatial import cKDTree

    for name in ("valve_vertices", "mask"):
        near = cKDTree(points := make(name, 2000, noise=0).points).query(points, 2)[0][:, 1]
        assert near.min() > 0.5 * np.median(near)


def test_plants_stand_above_the_ground() -> None:
    """Eight in a hundred points."""
    shape = make("wooded_hillside", 5000)
    share = (shape.distance(shape.points) > 5 * shape.noise).mean()
    assert 0.05 < share < 0.09


def test_field_of_a_ball_gives_its_area_and_euler_number() -> None:
    """Marching through tetrahedra and cutting, against formulas."""
    ball = from_field(lambda p: np.linalg.norm(p, axis=1) - 1, np.full(3, -1.3), np.full(3, 1.3), 0.05)
    assert ball.euler == 2 and not ball.loops
    assert ball.areas.sum() == pytest.approx(4 * np.pi, rel=3e-3)
    half = cut(ball, lambda p: p[:, 2] - 0.013)
    assert half.euler == 1 and len(half.loops) == 1
    assert half.areas.sum() == pytest.approx(2 * np.pi * (1 - 0.013), rel=3e-3)


def test_distance_to_triangles_is_that_to_many_points_in_them() -> None:
    """Against the nearest of many points of the triangle."""
    rng = np.random.default_rng(0)
    p, a, b, c = rng.normal(size=(4, 40, 3))
    share = rng.dirichlet([0.4] * 3, size=20_000)
    c[30:] = b[30:]  # segments
    found = distance_to_triangles(p, a, b, c)
    for k in range(40):
        slow = np.linalg.norm(p[k] - share @ np.stack([a[k], b[k], c[k]]), axis=1).min()
        assert found[k] <= slow + 1e-12 < found[k] + 0.06


def test_every_scan_is_listed() -> None:
    """The clouds that look like scans can be made by name."""
    assert all(scan.__name__ in SHAPES for scan in scans.SCANS)
