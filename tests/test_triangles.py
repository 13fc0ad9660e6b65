"""Quality, sides, angles, crossings: laws, and agreement with slow twins (textbook values are in test_paper)."""

import math

import naive
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from typed import xyz

from scantruss.kernels.geometry import triangles as t

pytestmark = pytest.mark.kernels

number = st.floats(-10, 10, allow_subnormal=False)
place = st.tuples(number, number, number)
flat = st.tuples(number, number)
whole = st.tuples(st.integers(-6, 6).map(float), st.integers(-6, 6).map(float))
UP = (0.0, 0.0, 1.0)


def far_apart(*places: tuple[float, ...], least: float = 1e-3) -> bool:
    p = np.array(places)
    return all(np.linalg.norm(p[i] - p[j]) > least for i in range(len(p)) for j in range(i))


@given(place, place, place)
def test_shape_quality_agrees_with_heron_and_lies_between_0_and_1(
    a: tuple[float, float, float], b: tuple[float, float, float], c: tuple[float, float, float]
) -> None:
    assume(far_apart(a, b, c))
    found = t.shape_quality(a, b, c)
    assert found == pytest.approx(naive.shape_quality(a, b, c), abs=1e-5)
    assert 0 <= found <= 1 + 1e-12
    assert found == pytest.approx(t.shape_quality(c, a, b), abs=1e-12)
    assert found == pytest.approx(t.shape_quality(b, a, c), abs=1e-12)


@given(place, place, place, st.floats(1e-3, 1e3))
def test_shape_quality_does_not_depend_on_size(
    a: tuple[float, float, float], b: tuple[float, float, float], c: tuple[float, float, float], scale: float
) -> None:
    assume(far_apart(a, b, c))
    larger = [xyz(scale * x for x in p) for p in (a, b, c)]
    assert t.shape_quality(*larger) == pytest.approx(t.shape_quality(a, b, c), abs=1e-9)


def test_triangles_without_area_have_no_quality() -> None:
    a, b = (0.0, 0.0, 0.0), (1.0, 0.0, 0.0)
    assert t.shape_quality(a, a, a) == 0
    assert t.shape_quality(a, b, (2.0, 0.0, 0.0)) == 0
    assert t.size_quality(1.0, 0.0, 1.0) == t.size_quality(1.0, 1.0, 0.0) == t.size_quality(0.0, 1.0, 1.0) == 0
    assert t.quality(a, a, a, 1.0, 1.0, 1.0) == 0


positive = st.floats(1e-3, 1e3)


@given(positive, positive, positive)
def test_size_quality_is_symmetric_and_at_most_1(length: float, l1: float, l2: float) -> None:
    found = t.size_quality(length, l1, l2)
    assert found == pytest.approx(naive.size_quality(length, l1, l2))
    assert found == t.size_quality(length, l2, l1)
    assert 0 < found <= 1
    assert t.size_quality(length, length, length) == 1
    assert t.size_quality(length, 2 * length, length) == pytest.approx(t.size_quality(length, length / 2, length))


@given(place, place, place, place)
def test_only_one_side_is_unmeshed(
    a: tuple[float, float, float],
    b: tuple[float, float, float],
    p: tuple[float, float, float],
    n: tuple[float, float, float],
) -> None:
    volume = float(np.dot(np.cross(np.subtract(b, a), np.subtract(p, a)), n))
    assume(abs(volume) > 1e-6)
    assert t.on_unmeshed_side(a, b, p, n) == (volume > 0)
    assert t.on_unmeshed_side(a, b, p, n) != t.on_unmeshed_side(b, a, p, n)


@given(st.floats(0.01, 2 * math.pi - 0.01), st.floats(0, 6.28), st.floats(0.1, 5), st.floats(0.1, 5), st.integers(0, 9))
def test_angles_are_counted_anticlockwise_seen_from_the_tip_of_the_normal(
    angle: float, start: float, r1: float, r2: float, seed: int
) -> None:
    turn = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    base, arm = (
        tuple(turn @ [r * math.cos(phi), r * math.sin(phi), 0.0]) for r, phi in ((r1, start), (r2, start + angle))
    )
    found = t.angle_from(base, arm, tuple(turn @ UP))
    assert found == pytest.approx(angle, abs=1e-9)
    lifted = tuple(np.array(arm) + 3.0 * turn[:, 2])  # heights over the plane do not count
    assert t.angle_from(base, lifted, tuple(turn @ UP)) == pytest.approx(angle, abs=1e-9)


@given(flat, flat, flat, flat)
def test_crossing_agrees_with_where_the_lines_meet(
    a: tuple[float, float], b: tuple[float, float], c: tuple[float, float], d: tuple[float, float]
) -> None:
    sides = [np.cross([*np.subtract(q, p), 0], [*np.subtract(r, p), 0])[2] for p, q, r in
             ((a, b, c), (a, b, d), (c, d, a), (c, d, b))]  # fmt: skip
    assume(min(abs(s) for s in sides) > 1e-6)  # a side settled by rounding says nothing
    assert t.segments_cross(a, b, c, d) == naive.cross_inside(a, b, c, d)


@given(whole, whole, whole, whole)
def test_touching_is_no_crossing_and_the_order_does_not_matter(
    a: tuple[float, float], b: tuple[float, float], c: tuple[float, float], d: tuple[float, float]
) -> None:
    found = t.segments_cross(a, b, c, d)
    assert found == t.segments_cross(b, a, c, d) == t.segments_cross(c, d, a, b) == t.segments_cross(c, d, b, a)
    if {a, b} & {c, d}:
        assert not found
    middle = (0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1]))
    assert not t.segments_cross(a, b, middle, d)


@given(flat, flat, flat, flat, st.floats(-2, 2), st.integers(0, 50))
def test_crossing_in_space_is_that_in_the_plane_between_the_lines_where_they_pass_near(
    a: tuple[float, float],
    b: tuple[float, float],
    c: tuple[float, float],
    d: tuple[float, float],
    gap: float,
    seed: int,
) -> None:
    sides = [np.cross([*np.subtract(q, p), 0], [*np.subtract(r, p), 0])[2] for p, q, r in
             ((a, b, c), (a, b, d), (c, d, a), (c, d, b))]  # fmt: skip
    assume(min(abs(s) for s in sides) > 1e-3 and abs(abs(gap) - 1.0) > 1e-6)
    turn = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    p, q, r, s = (xyz(turn @ [*place, height]) for place, height in ((a, 0.0), (b, 0.0), (c, gap), (d, gap)))
    assume(np.linalg.norm(np.cross(np.subtract(p, q), np.subtract(r, s))) > 1e-3)
    assert t.lines_cross(p, q, r, s, 1.0) == (naive.cross_inside(a, b, c, d) and abs(gap) < 1.0)


@given(whole, whole, whole, whole)
def test_inside_a_triangle_counts_its_sides(
    p: tuple[float, float], a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]
) -> None:
    area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    assume(area > 0)
    share = np.linalg.solve(np.vstack([np.transpose([a, b, c]), np.ones(3)]), np.array([*p, 1.0]))
    assert t.inside_triangle(p, a, b, c) == bool((share > -1e-9).all())
    assert t.inside_triangle(a, a, b, c)
    assert t.inside_triangle((0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])), a, b, c)


@given(place, place, place)
def test_distance_to_a_segment(
    p: tuple[float, float, float], a: tuple[float, float, float], b: tuple[float, float, float]
) -> None:
    assert t.distance_to_segment(p, a, b) == pytest.approx(naive.distance_to_segment(p, a, b), abs=2e-3)
    assert t.distance_to_segment(p, a, a) == pytest.approx(math.dist(p, a))


def test_distance_to_a_segment_beside_and_beyond_it() -> None:
    a, b = (0.0, 0.0, 0.0), (4.0, 0.0, 0.0)
    assert t.distance_to_segment((1.0, 3.0, 0.0), a, b) == 3
    assert t.distance_to_segment((7.0, 4.0, 0.0), a, b) == 5
    assert t.distance_to_segment((-3.0, 0.0, 4.0), a, b) == 5


@given(place, st.floats(-6, 6), st.integers(0, 20))
def test_turned_goes_round_by_the_angle_in_the_tangent_plane(
    direction: tuple[float, float, float], angle: float, seed: int
) -> None:
    normal = np.random.default_rng(seed).normal(size=3)
    normal /= np.linalg.norm(normal)
    flattened = np.array(direction) - normal * np.dot(normal, direction)
    assume(np.linalg.norm(flattened) > 1e-3)
    found = np.array(t.turned(direction, tuple(normal), angle))
    base = flattened / np.linalg.norm(flattened)
    assert np.linalg.norm(found) == pytest.approx(1)
    assert np.allclose(found, math.cos(angle) * base + math.sin(angle) * np.cross(normal, base), atol=1e-9)


def test_turned_of_a_direction_along_the_normal_still_lies_in_the_plane() -> None:
    found = t.turned((0.0, 0.0, 2.0), UP, 1.0)
    assert np.linalg.norm(found) == pytest.approx(1) and found[2] == 0


@given(place, place)
def test_onto_tangent_plane_drops_the_height(p: tuple[float, float, float], origin: tuple[float, float, float]) -> None:
    u, v = t.onto_tangent_plane(p, origin, (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    assert (u, v) == pytest.approx((p[0] - origin[0], p[1] - origin[1]))
