"""Boundary loops of clouds whose boundary is known: number, length, side, corners, nodes (Sec. 3.3)."""

from typing import Any, Never

import numpy as np
import pytest
from edged_surfaces import edged_surface
from numpy.typing import ArrayLike
from shapes import make
from small_clouds import ball, cap, ring, samples_of, sheet, tire, turn_of
from steps import boundary_of

import scantruss as st
from scantruss.boundary.curves import area_within, length_around, resample
from scantruss.boundary.find import POINTS_OF_RANDOM_HOLE, Loop, characteristic_points
from scantruss.boundary.offset import SamplingBias, close_random_bays
from scantruss.boundary.touched_points import _onwards as onwards
from scantruss.boundary.which_holes import is_covered


def found(points: np.ndarray, length: float = 1.0, **settings: Any) -> tuple[st.Boundary, np.ndarray]:
    """Boundary of points, and the origin its places are relative to."""
    cloud = st.PointCloud.from_array(points)
    return boundary_of(cloud, st.Settings(length=length, **settings)), cloud.origin


def in_hole(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return np.hypot(x, y) < 2.0


RECTANGLE = [(-6, -4), (6, -4), (6, 4), (-6, 4)]
ELL = [(-6, -6), (6, -6), (6, 0), (0, 0), (0, 6), (-6, 6)]
RHOMBUS = [(-6, 0), (0, -6 * 3**0.5 / 3), (6, 0), (0, 6 * 3**0.5 / 3)]  # 60 and 120 degrees


def polygon(corners: ArrayLike, spacing: float = 0.12, seed: int = 0) -> np.ndarray:
    """Points of a plate over a polygon, its boundary dense."""
    corners = np.array(corners, float)
    after = np.roll(corners, -1, axis=0)
    body = sheet(14, 14, spacing, seed=seed)[:, :2]
    crossing = np.zeros(len(body), int)
    clear = np.full(len(body), np.inf)
    curves = []
    for a, b in zip(corners, after, strict=True):
        upward = (a[1] <= body[:, 1]) != (b[1] <= body[:, 1])
        with np.errstate(divide="ignore", invalid="ignore"):
            x = a[0] + (body[:, 1] - a[1]) * (b[0] - a[0]) / (b[1] - a[1])
        crossing += upward & (body[:, 0] < x)
        t = np.clip(((body - a) @ (b - a)) / ((b - a) @ (b - a)), 0, 1)
        clear = np.minimum(clear, np.linalg.norm(body - a - t[:, None] * (b - a), axis=1))
        steps = round(np.linalg.norm(b - a) / (0.8 * spacing))
        curves.append(a + np.arange(steps)[:, None] / steps * (b - a))
    flat = np.concatenate([body[(crossing % 2 == 1) & (clear > 0.5 * spacing)], *curves])
    return np.random.default_rng(seed).permutation(np.column_stack([flat, np.zeros(len(flat))]))


def perimeter(corners: np.ndarray) -> float:
    corners = np.array(corners, float)
    return np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1).sum()


def assert_surface_on_the_left(
    boundary: st.Boundary, origin: np.ndarray, points: np.ndarray, length: float = 1.0
) -> None:
    """0.3 members to the left of the loops there are points, to the right there are none; but for places near a corner."""
    cloud = st.PointCloud.from_array(points)
    surface = st.sample_surface(cloud, st.Settings(length=length)).surface
    for loop in boundary.loops:
        ahead = np.roll(loop.points, -2, axis=0) - np.roll(loop.points, 2, axis=0)
        ahead /= np.linalg.norm(ahead, axis=1)[:, None]
        clear = []
        for k in range(0, len(loop.points), 9):
            sample = ((surface.mean - loop.points[k]) ** 2).sum(axis=1).argmin()
            left = 0.3 * length * np.cross(surface.normals[sample], ahead[k])
            inside, outside = (
                np.linalg.norm(points - origin - loop.points[k] - s * left, axis=1).min() for s in (1, -1)
            )
            clear.append(inside < 0.15 * length and outside > 0.2 * length)
        assert np.mean(clear) > 0.8


@pytest.mark.parametrize("corners", [RECTANGLE, ELL, RHOMBUS], ids=["rectangle", "ell", "rhombus"])
@pytest.mark.parametrize("seed", [0, 1])
def test_corners_of_a_plate_are_found_within_a_tenth_of_a_member(corners: np.ndarray, seed: int) -> None:
    points = polygon(corners, seed=seed)
    boundary, origin = found(points)
    (loop,) = boundary.loops
    assert loop.external and boundary.internal == ()
    assert loop.length == pytest.approx(perimeter(corners), rel=0.01)
    places = loop.corners + origin
    assert len(places) == len(corners) == len(boundary.corners)
    for corner in corners:
        assert np.linalg.norm(places - [*corner, 0], axis=1).min() < 0.1
    assert_surface_on_the_left(boundary, origin, points)


@pytest.mark.parametrize("corners", [RECTANGLE, ELL, RHOMBUS], ids=["rectangle", "ell", "rhombus"])
def test_nodes_divide_every_side_equally_and_corners_are_nodes(corners: np.ndarray) -> None:
    boundary, _ = found(polygon(corners))
    nodes, is_corner = characteristic_points(boundary.loops[0], 1.0)
    assert is_corner.sum() == len(corners)
    assert is_corner[0]
    steps = np.linalg.norm(np.roll(nodes, -1, axis=0) - nodes, axis=1)
    ends = [*np.flatnonzero(is_corner), len(nodes)]
    for begin, end in zip(ends[:-1], ends[1:], strict=True):
        side = steps[begin:end]
        assert np.ptp(side) < 0.02
        assert side.mean() == pytest.approx(1.0, abs=0.5 / len(side) + 0.03)
    assert sorted(np.diff(ends).tolist()) == sorted(
        round(float(np.linalg.norm(np.subtract(b, a)))) for a, b in zip(corners, corners[1:] + corners[:1], strict=True)
    )


@pytest.mark.parametrize("length", [0.8, 1.0, 1.7])
def test_a_disc_has_one_loop_without_corners(length: float) -> None:
    points = ring(0.0, 6.0, 0.12)
    boundary, origin = found(points, length)
    (loop,) = boundary.loops
    assert loop.external and len(loop.corners) == 0
    assert loop.length == pytest.approx(12 * np.pi, rel=0.01)
    assert np.linalg.norm(loop.points + origin, axis=1) == pytest.approx(6.0, abs=0.05)
    nodes, is_corner = characteristic_points(loop, length)
    assert len(nodes) == round(loop.length / length) and not is_corner.any()
    steps = np.linalg.norm(np.roll(nodes, -1, axis=0) - nodes, axis=1)
    assert np.ptp(steps) < 0.02 * length
    assert_surface_on_the_left(boundary, origin, points, length)


def test_an_annulus_has_an_external_and_an_internal_boundary() -> None:
    points = ring(2.0, 6.0, 0.12)
    boundary, origin = found(points)
    (outer,), (inner,) = boundary.external, boundary.internal
    assert boundary.loops == (outer, inner)
    assert outer.length == pytest.approx(12 * np.pi, rel=0.01)
    assert inner.length == pytest.approx(4 * np.pi, rel=0.02)
    assert np.linalg.norm(inner.points + origin, axis=1) == pytest.approx(2.0, abs=0.05)
    assert outer.piece == inner.piece
    assert_surface_on_the_left(boundary, origin, points)


def area_enclosed(loop: Loop) -> float:
    """Signed area of a loop seen from above."""
    x, y = loop.points[:, 0], loop.points[:, 1]
    return 0.5 * (x * np.roll(y, -1) - y * np.roll(x, -1)).sum()


def test_external_boundaries_run_anticlockwise_internal_ones_clockwise() -> None:
    """Seen from above, where the normals of a plate point."""
    boundary, _ = found(ring(2.0, 6.0, 0.12))
    assert area_enclosed(boundary.external[0]) == pytest.approx(36 * np.pi, rel=0.02)
    assert area_enclosed(boundary.internal[0]) == pytest.approx(-4 * np.pi, rel=0.04)


@pytest.mark.parametrize("radius", [1.0, 1.5])
def test_holes_shorter_than_the_smallest_are_closed_over(radius: float) -> None:
    """A boundary of 2 pi r counts from `fill_holes` on."""
    around = 2 * np.pi * radius
    points = ring(radius, 6.0, 0.12)
    assert len(found(points, fill_holes=0.85 * around)[0].internal) == 1
    assert len(found(points, fill_holes=1.15 * around)[0].internal) == 0
    assert len(found(points, fill_holes=1.15 * around)[0].external) == 1


def test_missing_points_here_and_there_make_no_hole() -> None:
    points = sheet(12, 8, 0.12)
    keep = np.random.default_rng(0).random(len(points)) < 0.6
    for centre in ((2.0, 1.0), (-3.0, -1.0)):
        keep &= np.hypot(points[:, 0] - centre[0], points[:, 1] - centre[1]) > 0.3
    assert len(found(points[keep])[0].loops) == 1


@pytest.mark.parametrize("points", [ball(4.0, 12_000, noise=0.01), tire(5.0, 2.0, 0.15)], ids=["ball", "torus"])
def test_closed_clouds_have_no_boundary(points: np.ndarray) -> None:
    boundary, _ = found(points)
    assert boundary.loops == () and boundary.corners.shape == (0, 3)
    assert boundary.curves.start.tolist() == [0] and boundary.curves.points.shape == (0, 3)


def test_every_piece_has_an_external_boundary() -> None:
    a, b = ring(2.0, 5.0, 0.15), ring(0.0, 3.0, 0.15) + np.array([12.0, 0, 0])
    boundary, _ = found(np.concatenate([a, b]))
    assert len(boundary.external) == 2 and len(boundary.internal) == 1
    assert {loop.piece for loop in boundary.external} == {0, 1}
    assert boundary.internal[0].piece == 0
    assert [round(loop.length) for loop in boundary.loops] == [31, 19, 13]  # external ones first, then by length


def test_debris_beside_the_scan_has_no_boundary() -> None:
    points = np.concatenate([sheet(12, 8, 0.15), sheet(0.8, 0.8, 0.15) + np.array([9.0, 0, 0])])
    assert len(found(points)[0].loops) == 1


def test_pieces_that_are_all_smaller_than_a_member_are_refused() -> None:
    dome = cap(8.0, 1.0, 0.5)
    with pytest.raises(st.InputError, match="each piece of the scan is smaller than length 4000; use a shorter one"):
        found(np.concatenate([dome, dome + np.array([1e5, 0.0, 0.0])]), 4000.0)


@pytest.mark.parametrize("noise", [0.0, 0.03])
def test_the_rim_of_a_dome_is_a_circle(noise: float) -> None:
    points = cap(8.0, 1.0, 0.15)
    points += noise * np.random.default_rng(0).normal(size=points.shape)
    boundary, origin = found(points)
    (loop,) = boundary.loops
    assert loop.length == pytest.approx(2 * np.pi * 8.0 * np.sin(1.0), rel=0.01)
    assert len(loop.corners) == 0
    assert (loop.points + origin)[:, 2] == pytest.approx(8.0 * np.cos(1.0), abs=0.08 + 2 * noise)
    assert_surface_on_the_left(boundary, origin, points)


@pytest.mark.parametrize("name", ["scallop", "cloth", "gable", "flat_plate", "two_holes", "great_court", "pantheon"])
def test_rims_of_known_shapes(name: str) -> None:
    shape = make(name, seed=1)
    boundary, _ = found(shape.points, shape.length)
    assert len(boundary.loops) == len(shape.loops)
    lengths = sorted(np.linalg.norm(np.roll(curves, -1, axis=0) - curves, axis=1).sum() for curves in shape.loops)
    assert sorted(loop.length for loop in boundary.loops) == pytest.approx(lengths, rel=0.02)


@pytest.mark.parametrize(
    "name", ["scallop", "cloth", "gable", "flat_plate", "l_plate", "two_holes", "great_court", "saddle"]
)
def test_corners_of_known_shapes(name: str) -> None:
    """Every corner is found within a tenth of a member of its true place, also re-entrant ones, and none besides."""
    for seed in range(3):
        shape = make(name, seed=seed)
        boundary, origin = found(shape.points, shape.length)
        for corner in shape.corners:
            assert np.linalg.norm(boundary.corners + origin - corner, axis=1).min() < 0.1 * shape.length
        assert len(boundary.external[0].corners) == len(shape.corners)


def test_boundary_points_do_not_go_back_and_forth() -> None:
    a, b, c, d = np.eye(4)[:, :3]
    assert onwards(np.array([a, b, c, d])) == [0, 1, 2, 3]
    assert onwards(np.array([a, b, a, c, d, c])) == [0, 3]
    assert onwards(np.array([a, b, a, b, d])) == [0, 3, 4]
    assert onwards(np.array([a, a, a, b])) == [0, 3]
    many = np.random.default_rng(0).normal(size=(300, 3))
    order = np.array([k + step for k in range(299) for step in (0, 1, 0)])
    kept = order[onwards(many[order])]
    assert (np.diff(kept) > 0).all()


@pytest.mark.parametrize("seed", [1, 4, 8, 10])
def test_the_rim_of_a_sparse_scan_does_not_run_back_on_itself(seed: int) -> None:
    """With ten points for a node the disc touches some in another order than they have along the boundary."""
    shape = make("great_court", 20_000, seed=seed)
    length = float(np.sqrt(4 / np.sqrt(3) * shape.area / 2 / 2_000))
    for loop in found(shape.points, length)[0].loops:
        arc = np.cumsum(np.linalg.norm(np.diff(loop.points, axis=0, prepend=loop.points[-1:]), axis=1))
        for steps in range(9, 30):
            between = arc[steps:] - arc[:-steps]
            straight = np.linalg.norm(loop.points[steps:] - loop.points[:-steps], axis=1)
            assert ((between < 0.45 * length) | (between < 3.0 * straight)).all()


def test_the_rim_for_the_kernels_is_made_of_the_loops() -> None:
    boundary, _ = found(ring(2.0, 6.0, 0.15))
    curves = boundary.curves
    assert curves.start.tolist() == [0, *np.cumsum([len(loop.points) for loop in boundary.loops])]
    for c, loop in enumerate(boundary.loops):
        points, arc = (
            curves.points[curves.start[c] : curves.start[c + 1]],
            curves.arc[curves.start[c] : curves.start[c + 1]],
        )
        steps = np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1)
        assert curves.total[c] == pytest.approx(loop.length) == pytest.approx(steps.sum())
        assert arc[0] == 0 and np.diff(arc) == pytest.approx(steps[:-1])


def test_corners_follow_the_angle_that_is_asked() -> None:
    """The boundary of a rhombus turns by 120 degrees at two corners and by 60 at the others."""
    points = polygon(RHOMBUS)
    assert [len(found(points, corner_angle=angle)[0].corners) for angle in (40.0, 90.0, 150.0)] == [4, 2, 0]


@pytest.mark.parametrize("seed", range(3))
def test_a_turned_and_shifted_cloud_has_the_same_boundary(seed: int) -> None:
    """Up to rounding: places to a millionth of a member."""
    points = polygon(ELL)
    points[:, 2] = 0.01 * (points[:, 0] ** 2 + points[:, 1] ** 2)
    turn, shift = turn_of(seed), np.array([300.0, -7.0, 20.0])
    (a, origin_a), (b, origin_b) = found(points), found(points @ turn.T + shift)
    for p, q in zip(a.loops, b.loops, strict=True):
        assert (q.points + origin_b - shift) @ turn == pytest.approx(p.points + origin_a, abs=1e-6)
        assert p.corner_at.tolist() == q.corner_at.tolist()


@pytest.mark.kernels
def test_a_larger_cloud_has_the_same_boundary_larger() -> None:
    """Twice as large is the same to the last bit: powers of two do not round."""
    points = polygon([(-3, -2), (3, -2), (3, 2), (-3, 2)], 0.25)
    (a, _), (b, _) = found(points), found(4.0 * points, 4.0)
    for p, q in zip(a.loops, b.loops, strict=True):
        assert (4.0 * p.points).tobytes() == q.points.tobytes()
        assert p.corner_at.tolist() == q.corner_at.tolist()


@pytest.mark.kernels
def test_small_plates_without_and_with_a_hole() -> None:
    rectangle, _ = found(polygon([(-3, -2), (3, -2), (3, 2), (-3, 2)], 0.25))
    assert [len(loop.corners) for loop in rectangle.loops] == [4]
    assert rectangle.loops[0].length == pytest.approx(20, rel=0.02)
    holed, _ = found(ring(1.2, 3.2, 0.25))
    assert [loop.external for loop in holed.loops] == [True, False]


@pytest.mark.kernels
def test_a_small_closed_cloud_has_no_boundary() -> None:
    assert found(ball(2.0, 500))[0].loops == ()


@pytest.mark.kernels
def test_same_cloud_same_bytes() -> None:
    points = ring(1.2, 3.2, 0.25)
    a, b = found(points)[0], found(points.copy())[0]
    for p, q in zip(a.loops, b.loops, strict=True):
        assert p.points.tobytes() == q.points.tobytes() and p.corner_at.tolist() == q.corner_at.tolist()


class Cancelled(Exception):
    pass


def test_progress_is_reported_and_may_stop_the_search() -> None:
    said = []
    cloud, settings = st.PointCloud.from_array(sheet(6, 4, 0.2)), st.Settings(length=1.0)
    samples = st.sample_surface(cloud, settings)
    st.find_boundary(samples, settings, progress=lambda stage, share: said.append((stage, share)))
    assert {stage for stage, _ in said} == {"boundary"}
    assert [share for _, share in said] == sorted(share for _, share in said) and said[-1][1] == 1.0

    def stop(stage: str, share: float) -> Never:
        raise Cancelled

    with pytest.raises(Cancelled):
        st.find_boundary(samples, settings, progress=stop)


@pytest.mark.parametrize("seed", range(4))
def test_a_disc_that_is_caught_on_its_way_rolls_the_other_way_round(seed: int) -> None:
    """The boundary of what is seen from one side is over a hundred members long; rolled one way only, the disc never comes round.

    There is one hole, and a bay whose mouth is about as wide as the disc: with seed 2 it is closed, a second hole.
    """
    shape = make("view", seed=seed)
    boundary, _ = found(shape.points, shape.length)
    assert len(boundary.loops) in ((3,) if seed == 2 else (2, 3)) and boundary.loops[0].external
    assert boundary.loops[0].length > 100 * shape.length


@pytest.mark.parametrize(
    ("name", "density", "closes"),
    [
        ("bay", 80.0, True),
        ("bay", 160.0, False),
        ("tongue", 80.0, False),
        ("corner", 80.0, False),
        ("wide", 20.0, False),
    ],
)
def test_a_bay_is_closed_where_few_points_are_expected_in_it(name: str, density: float, closes: bool) -> None:
    """A bay of 0.1 members squared in a straight side; no tongue, no re-entrant corner, and none as wide as a member."""
    dents = {"bay": [[0.25, -3], [0, -2.6], [-0.25, -3]], "tongue": [[0.25, -3], [0, -3.4], [-0.25, -3]]}
    dents |= {"corner": [[3, 0], [0, 0], [0, -3]], "wide": [[0.6, -3], [0, -2.6], [-0.6, -3]]}
    last = [[3, -3]] if name != "corner" else []
    corners = np.array([*last, [3, 3], [-3, 3], [-3, -3], *dents[name][::-1]], float)
    curve = resample(np.column_stack([corners, np.zeros(len(corners))]), 0.05)
    surface = samples_of(sheet(8, 8, 0.1)).surface
    found = close_random_bays(curve, SamplingBias(0.1, density), 1.0, surface)
    assert (len(found) < len(curve)) == closes
    if closes:
        assert found[np.abs(found[:, 0]) < 1.0, 1].min() < -2.9 and (np.abs(found[:, 1]) > 2.95).sum() > 200


def test_a_gap_between_random_points_is_no_corner_of_the_boundary() -> None:
    """The boundary ran 0.44 members into a sheet, to a corner, where a disc fell through its edge between two points."""
    random = np.random.default_rng(1)
    points = np.column_stack([random.uniform(-6, 6, (14_000, 2)), np.zeros(14_000)])
    gap = points[:, 1] < -5.5 - 1.8 * np.abs(points[:, 0])
    (loop,) = found(points[~gap])[0].loops
    assert gap.sum() > 4 and np.abs(np.abs(loop.points[:, :2]).max(axis=1) - 6.0).max() < 0.1 and len(loop.corners) == 4


def scalloped(seed: int, count: int = 24_000) -> np.ndarray:
    """A flat roof of 16 x 14, cut in at both ends by four arches that meet in cusps; its outer corners have 39 degrees."""
    random = np.random.default_rng(seed)
    x, y = random.uniform(0.0, 16.0, count), random.uniform(0.0, 14.0, count)
    cut = 1.6 * np.sin(np.pi * (x / 4.0 % 1.0))
    kept = (y > cut) & (y < 14.0 - cut)
    flat = np.column_stack([x, y])[kept]
    flat = flat[np.unique(np.floor(flat / 0.06), axis=0, return_index=True)[1]]
    return np.column_stack([flat, random.normal(0.0, 0.004, len(flat))])


@pytest.mark.parametrize("length", [0.68, 0.96, 1.34])
def test_the_cusps_and_pointed_corners_of_a_scalloped_edge_are_corners(length: float) -> None:
    """The outer ones were cut off by up to a member, as no member fits across them."""
    boundary, _ = found(scalloped(3), length)
    tips = np.array([(x, y, 0.0) for y in (0.0, 14.0) for x in range(0, 17, 4)], float)
    off = np.linalg.norm(tips[:, None] - boundary.corners, axis=2).min(axis=1)
    assert len(boundary.corners) == len(tips) and off.max() < 0.26 * length and off.mean() < 0.16 * length


def test_a_spike_on_a_straight_side_is_no_corner() -> None:
    """As pointed as those of a scalloped edge, but the boundary turns off to it."""
    random = np.random.default_rng(4)
    x, y = random.uniform(0.0, 10.0, 24_000), random.uniform(-1.0, 8.0, 24_000)
    kept = (y > 0.0) | (np.abs(x - 5.0) < 0.3 * (1.0 + y / 0.9))
    boundary, _ = found(np.column_stack([x, y, np.zeros(len(x))])[kept], 1.0)
    assert len(boundary.corners) == 4
    assert np.linalg.norm(boundary.loops[0].points - [5.0, -0.9, 0.0], axis=1).min() > 0.5


def test_a_hole_that_random_sampling_explains_is_none() -> None:
    """Where points lie at random they leave a place free here and there, by chance one with a boundary of more than four members."""
    surface = edged_surface(10_298)  # a box, sparse and closed
    boundary = boundary_of(st.PointCloud.from_array(surface.points), st.Settings(length=surface.length))
    assert boundary.loops == ()


@pytest.mark.parametrize("density", [30.0, 200.0])
def test_a_hole_in_which_more_points_are_expected_is_one(density: float) -> None:
    rng = np.random.default_rng(5)
    points = rng.uniform(-6, 6, (int(density * 144), 3)) * (1, 1, 0)
    in_slot = (np.abs(points[:, 0]) < 0.75) & (np.abs(points[:, 1]) < 0.45)
    boundary, _ = found(points[~in_slot])
    outer, hole = sorted(boundary.loops, key=lambda loop: -loop.length)
    assert outer.length == pytest.approx(48.0, rel=0.01)
    assert 4.0 < hole.length < 5.0
    assert area_within(hole.points) * density > POINTS_OF_RANDOM_HOLE


def test_the_area_within_a_curve_is_that_of_its_polygon() -> None:
    turn = turn_of(3)
    ell = np.column_stack([np.array(ELL, float), np.zeros(len(ELL))])
    assert area_within(ell @ turn.T + (5.0, -2.0, 1.0)) == pytest.approx(108.0)


def test_a_loop_with_points_all_over_its_inside_bounds_no_hole() -> None:
    """Those of another sheet behind a hole do not count, nor those of another piece, as of a floor below a column, nor a few strays."""
    angle = np.linspace(0, 2 * np.pi, 90, endpoint=False)
    curve = np.column_stack([np.cos(angle), 0.6 * np.sin(angle), 0 * angle])
    whole = sheet(8, 8, 0.1)
    inside = np.hypot(whole[:, 0], whole[:, 1] / 0.6) < 1.0
    behind = np.concatenate([whole[~inside], whole + (0, 0, 0.4)])
    strays = np.concatenate([whole[~inside], whole[inside][::4]])
    for points, covered in ((whole, True), (whole[~inside], False), (behind, False), (strays, False)):
        samples = samples_of(points, outlier_distance=0.0)
        here = curve - samples.origin
        own = int(samples.piece[np.linalg.norm(samples.surface.mean - here[0], axis=1).argmin()])
        for piece, size in ((own, 1.0), (own + 1, 1.0), (own, 2.0)):
            loop = Loop(size * here, np.zeros(0, np.int64), False, size * length_around(here), piece)
            counts = covered and (piece, size) == (own, 1.0)
            assert is_covered(loop, 100.0, samples.surface, samples.piece) == counts
