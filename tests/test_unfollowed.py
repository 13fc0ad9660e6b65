"""What runs along a grid within a member of it and is not followed is said, with its place and share: a beam, a rib, a second layer."""

from __future__ import annotations

import numpy as np
import pytest
from marks import compiled_only
from typed import known

import scantruss as st
from scantruss.boundary.find import find_boundary
from scantruss.check.certify import certify
from scantruss.check.unfollowed import is_wide
from scantruss.grid.certificate import Fault
from scantruss.pipeline import grid_from_points
from scantruss.surface.samples import sample_surface

SPRINGING = 0.4  # height of the foot of the dome over its centre [radii]


def dome(rng: np.random.Generator, noise: float) -> np.ndarray:
    """A dome of radius 10 down to its springing."""
    height, turn = 10.0 * rng.uniform(SPRINGING, 1.0, 24_000), rng.uniform(0.0, 2.0 * np.pi, 24_000)
    radius = np.sqrt(100.0 - height**2)
    points = np.column_stack([radius * np.cos(turn), radius * np.sin(turn), height])
    return points + rng.normal(0.0, noise, points.shape)


def ring_beam(rng: np.random.Generator, side: float, noise: float) -> np.ndarray:
    """The outer, upper and lower faces of a square beam around the foot of the dome."""
    turn, along, face = rng.uniform(0.0, 2.0 * np.pi, 7_000), rng.uniform(0.0, side, 7_000), rng.integers(0, 3, 7_000)
    foot, radius = 10.0 * SPRINGING, 10.0 * np.sqrt(1.0 - SPRINGING**2)
    outward = np.where(face == 0, side, along)
    down = np.where(face == 0, along, np.where(face == 1, 0.0, side))
    points = np.column_stack([(radius + outward) * np.cos(turn), (radius + outward) * np.sin(turn), foot - down])
    return points + rng.normal(0.0, noise, points.shape)


def warning_of(points: np.ndarray, length: float) -> Fault | None:
    """Return what the certificate of a grid says of parts that it does not follow."""
    grid = grid_from_points(points, st.Settings(length=length, effort="quick"))
    assert known(grid.certificate).passed
    found = [each for each in known(grid.certificate).warnings if each.kind == "unfollowed"]
    assert len(found) <= 1
    return found[0] if found else None


@compiled_only
def test_a_ring_beam_a_third_of_a_member_wide_is_named_with_its_place_and_share() -> None:
    rng = np.random.default_rng(3)
    points = np.concatenate([dome(rng, 0.004), ring_beam(rng, 0.6, 0.004)])
    warning = known(warning_of(points, 2.0))
    assert "does not follow" in warning.words and "such as a beam" in warning.words
    for place in (known(warning.where), *warning.also):
        x, y, z = place
        assert np.hypot(x, y) > 8.5 and z < 10.0 * SPRINGING + 0.6  # on the beam, or where the dome meets it
    share = float(warning.words.partition("(")[2].partition("%")[0]) / 100.0
    assert 0.01 <= share <= 7_000 / 31_000


@compiled_only
@pytest.mark.parametrize("width", [0.18, 0.22, 0.26])
def test_a_ring_beam_a_fifth_of_a_member_wide_is_named_where_the_shell_is_flat_enough_to_tell(width: float) -> None:
    """The triangles fold so little that their sag cannot explain it."""
    rng = np.random.default_rng(3)
    warning = known(warning_of(np.concatenate([dome(rng, 0.004), ring_beam(rng, 2.0 * width, 0.004)]), 2.0))
    assert all(z < 10.0 * SPRINGING + 0.6 for _, _, z in (known(warning.where), *warning.also))


@compiled_only
@pytest.mark.parametrize("noise", [0.004, 0.1])
@pytest.mark.parametrize("length", [1.2, 2.0, 3.0])
def test_a_dome_without_one_has_no_such_warning_noisy_or_not(noise: float, length: float) -> None:
    assert warning_of(dome(np.random.default_rng(3), noise), length) is None


@compiled_only
def test_a_rib_across_a_roof_is_named_and_a_bump_as_high_is_not() -> None:
    rng = np.random.default_rng(4)
    x, y = rng.uniform(-10.0, 10.0, 40_000), rng.uniform(-6.0, 6.0, 40_000)

    def roof(raised: np.ndarray) -> np.ndarray:
        return np.column_stack([x, y, 2.0 * np.cos(x / 12.0) + 0.4 * raised + rng.normal(0.0, 0.004, len(x))])

    warning = known(warning_of(roof((np.abs(x - 1.0) < 0.2).astype(float)), 1.5))
    assert abs(known(warning.where)[0] - 1.0) < 0.6
    assert warning_of(roof((np.hypot(x - 1.0, y) < 1.0).astype(float)), 1.5) is None


def strip(rise: float) -> np.ndarray:
    """A canopy of 20 x 3, bent across by a rise."""
    rng = np.random.default_rng(1)
    x, y = rng.uniform(-1.5, 1.5, 20_000), rng.uniform(0.0, 20.0, 20_000)
    return np.column_stack([x, y, rise * (1.0 - (x / 1.5) ** 2)]) + rng.normal(0.0, 0.004, (20_000, 3))


@compiled_only
@pytest.mark.parametrize("length", [3.0, 3.6])
def test_a_row_of_triangles_under_a_bent_canopy_fails_and_names_its_share(length: float) -> None:
    """Its folds do not tell how the scan is bent across it."""
    with pytest.raises(
        st.CertificateError, match=r"follows less than half of the scan: .*shorter members follow it"
    ) as caught:
        grid_from_points(strip(0.6), st.Settings(length=length, effort="quick"))
    assert {fault.kind for fault in known(known(caught.value.grid).certificate).faults} == {"unfollowed"}


@compiled_only
@pytest.mark.parametrize(("rise", "length"), [(0.6, 1.5), (0.05, 3.0)])
def test_a_canopy_of_shorter_members_passes_and_so_does_one_that_is_nearly_flat(rise: float, length: float) -> None:
    grid = grid_from_points(strip(rise), st.Settings(length=length, effort="quick"))
    assert known(grid.certificate).passed


def ribbed(width: float, depth: float, bend: float = 14.0) -> np.ndarray:
    """A shallow roof, 24 by 16, with three beams under it."""
    rng = np.random.default_rng(11)

    def roof(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return np.asarray(3.0 * np.cos(x / bend) * np.cos(y / 12.0))

    x, y = rng.uniform([-12.0, -8.0], [12.0, 8.0], (50_000, 2)).T
    under = (abs(x[:, None] - [-6.0, 0.0, 6.0]) < width / 2.0).any(axis=1)
    parts = [np.column_stack([x, y, roof(x, y) - depth * under])]
    for side in (-width / 2.0, width / 2.0):
        for middle in (-6.0, 0.0, 6.0) if width else ():
            at, along = np.full(1500, middle + side), rng.uniform(-8.0, 8.0, 1500)
            parts.append(np.column_stack([at, along, roof(at, along) - rng.uniform(0.0, depth, 1500)]))
    points = np.concatenate(parts)
    return points + rng.normal(0.0, 0.005, points.shape)


@compiled_only
@pytest.mark.parametrize("length", [2.7, 3.0, 3.3])
def test_beams_a_fifth_of_a_member_wide_are_named(length: float) -> None:
    words = known(warning_of(ribbed(0.6, 0.5), length)).words
    assert "such as a beam" in words


@compiled_only
@pytest.mark.parametrize("length", [1.6, 3.0])
def test_a_roof_that_bends_and_has_no_beams_has_no_such_warning(length: float) -> None:
    for bend in (14.0, 4.0):
        assert warning_of(ribbed(0.0, 0.0, bend), length) is None, bend


@compiled_only
@pytest.mark.parametrize("length", [2.9, 4.2])
def test_waves_that_members_are_too_long_for_are_named_with_their_share(length: float) -> None:
    rng = np.random.default_rng(11)
    x, y = rng.uniform([0.0, 0.0], [20.0, 14.0], (60_000, 2)).T
    points = np.column_stack([x, y, 0.5 * np.sin(2.0 * np.pi * x / 2.5) + 0.006 * y**2])
    warning = known(warning_of(points + rng.normal(0.0, 0.005, points.shape), length))
    share = float(warning.words.partition("scan: ")[2].partition("%")[0]) / 100.0
    assert warning.words.startswith("smooths out waves") and 0.3 <= share <= 0.55


@compiled_only
def test_where_panels_were_made_planar_that_is_the_first_reason() -> None:
    """The nodes of planar quads leave a cambered leaf by a tenth of a member."""
    rng = np.random.default_rng(5)
    x, y = rng.uniform([-14.0, -7.0], [14.0, 7.0], (60_000, 2)).T
    inside = abs(y) < 6.5 * np.cos(np.pi * x / 28.0) ** 0.8
    x, y = x[inside], y[inside]
    points = np.column_stack([x, y, 4.0 - 0.012 * x**2 - 0.05 * y**2 + 0.4 * np.sin(x / 4.0)])
    settings = st.Settings(length=1.0, effort="quick", cells="quad", planar=True)
    grid = grid_from_points(points + rng.normal(0.0, 0.004, points.shape), settings)
    (warning,) = (each for each in known(grid.certificate).warnings if each.kind == "unfollowed")
    assert "as panels were made planar" in warning.words


@compiled_only
def test_a_body_whose_lobes_are_narrower_than_the_members_is_refused_and_with_shorter_ones_it_passes() -> None:
    points = lobed(np.random.default_rng(5), lobes=5, depth=0.35)
    with pytest.raises(st.CertificateError, match=r"too coarse for the shape of the scan: 5\d\.\d% of its points"):
        grid_from_points(points, st.Settings(length=0.7, effort="quick"))
    assert known(grid_from_points(points, st.Settings(length=0.3, effort="quick")).certificate).passed


@compiled_only
def test_a_mean_surface_far_inside_its_scan_is_a_fault() -> None:
    ball = lobed(np.random.default_rng(6), lobes=5, depth=0.0)
    grid = grid_from_points(ball, st.Settings(length=0.5, effort="quick"))
    settings = st.Settings(length=0.5, smooth_scale=0.5, ridge_angle=0.0)
    samples, boundary = find_boundary(sample_surface(st.PointCloud.from_array(ball), settings), settings)
    kinds = [
        {fault.kind for fault in certify(grid.replace(nodes=size * grid.nodes), samples, boundary, settings).faults}
        for size in (1.0, 0.75)
    ]
    assert "unfollowed" not in kinds[0] and "unfollowed" in kinds[1]


def lobed(rng: np.random.Generator, lobes: int, depth: float) -> np.ndarray:
    """A ball of radius 1 with lobes around it."""
    way = rng.normal(size=(8_000, 3))
    way /= np.linalg.norm(way, axis=1)[:, None]
    turn, level = np.arctan2(way[:, 1], way[:, 0]), np.hypot(way[:, 0], way[:, 1])
    return np.asarray(way * (1.0 + depth * np.cos(lobes * turn) * level**2)[:, None])


@compiled_only
@pytest.mark.parametrize(("length", "fails"), [(0.28, True), (0.8, False)])
def test_a_grid_whose_nodes_jump_between_two_layers_is_refused(length: float, fails: bool) -> None:
    rng = np.random.default_rng(7)
    x, y = rng.uniform([-3.0, -2.5], [3.0, 2.5], (6_500, 2)).T
    layer = 0.11 * rng.integers(0, 2, len(x))
    points = np.column_stack([x, y, 3.0 - 0.01 * x**2 - 0.01 * y**2 + layer + rng.normal(0.0, 0.004, len(x))])
    if fails:
        with pytest.raises(st.CertificateError, match=r"rounds off [23]\d% of the points"):
            grid_from_points(points, st.Settings(length=length, effort="quick"))
    else:
        assert known(grid_from_points(points, st.Settings(length=length, effort="quick")).certificate).passed


def test_a_strip_of_a_surface_and_a_line_of_points_are_parted_however_few_points_are_farthest_off() -> None:
    """The edge of a niche that is cut off, and a cable beside the grid."""
    along = np.linspace(0.0, 1.0, 30)
    strip = np.column_stack([along, np.zeros(30), np.full(30, 0.33)])
    beside = [strip + (0.0, 0.1 * side, -0.08) for side in (-1, 1)]
    assert is_wide(strip, np.concatenate([strip, *beside]), 1.0, 0.03)
    assert not is_wide(strip, np.concatenate([strip, beside[0][:9]]), 1.0, 0.03)
