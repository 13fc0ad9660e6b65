"""The paper, equation by equation (Ding, Xu and Luo 2017): one test each, with values worked out by hand.

The stops (a), (b), (c) of Sec. 4.1 and the smoothing that obeys them: test_smoothing.
"""

from __future__ import annotations

import math

import naive
import numpy as np
import pytest
from small_clouds import HandFront, cap, ring, sheet
from small_grids import flipped_edges
from steps import boundary_of, front_of, steps_of

import scantruss as st
from scantruss.boundary.find import characteristic_points
from scantruss.front.start import new_front, start_front
from scantruss.kernels.front import cases, fits
from scantruss.kernels.front import front as lists
from scantruss.kernels.front.advance import advance_by_cases
from scantruss.kernels.geometry.boxes import box_index, new_boxes
from scantruss.kernels.geometry.triangles import (
    on_unmeshed_side,
    onto_tangent_plane,
    quality,
    segments_cross,
    shape_quality,
    size_quality,
)
from scantruss.surface.samples import sample_surface

ROOT3 = math.sqrt(3.0)
A, B = (0.0, 0.0), (1.0, 0.0)  # the candidate segment AB; the unmeshed area is above it


def three(x: float, y: float) -> tuple[float, float, float]:
    return float(x), float(y), 0.0


# Sec. 3.2: search boxes


@pytest.mark.kernels
def test_equation_1_a_box_is_larger_than_the_spacing_and_smaller_than_the_smallest_hole() -> None:
    settings = st.Settings(length=1.0)
    cloud = st.PointCloud.from_array(sheet(5, 4, 0.2))
    size = sample_surface(cloud, settings).boxes.size
    assert cloud.spacing < size.max()
    assert size.max() < settings.closed_boundary_length / math.pi  # the diameter of a hole with that boundary


@pytest.mark.kernels
def test_equation_2_number_of_boxes() -> None:
    """Extents of 10, 4 and 0 in boxes of 2 give 6, 3 and 1 of Eq. 2; the next box is there for the upper bound itself."""
    boxes = new_boxes(np.array([-5.0, 1.0, 7.0]), np.array([5.0, 5.0, 7.0]), 2.0, 1, 1)
    assert boxes.counts[:2].tolist() == [6, 3]
    assert box_index(boxes, 0, 5.0) == 5
    assert box_index(boxes, 1, 5.0) == 2


@pytest.mark.kernels
def test_equation_3_size_of_a_box() -> None:
    """10 / (6 - 1) = 2. To the letter 11 / (6 - 1) = 2.2 > d_B = 2; rounding up gives 11 / 6, a plate 2 instead of 0 / 0."""
    boxes = new_boxes(np.zeros(3), np.array([10.0, 11.0, 0.0]), 2.0, 1, 1)
    assert boxes.size == pytest.approx([2.0, 11 / 6, 2.0])
    assert ((boxes.size > 1.0) & (boxes.size <= 2.0)).all()


@pytest.mark.kernels
def test_equation_4_index_of_the_box_of_a_point() -> None:
    """With x_min = -5 and D = 2, x = 0.5 lies in box int(5.5 / 2) + 1 = 3; counted from 0 it is number 2."""
    boxes = new_boxes(np.full(3, -5.0), np.full(3, 5.0), 2.0, 1, 1)
    assert box_index(boxes, 0, 0.5) + 1 == 3
    assert [box_index(boxes, 0, x) + 1 for x in (-5.0, -3.001, -2.999, 4.999)] == [1, 1, 2, 5]


# Sec. 3.4: choosing a new node


@pytest.mark.kernels
def test_equation_5_quality_of_a_triangle() -> None:
    """The sides 3, 4, 5: phi = 4 sqrt(3) 6 / 50. On the side 3 with l_0 = 3: rho = 3/4 3/5. delta = a_1 phi + a_2 rho."""
    a, b, p = three(0, 0), three(3, 0), three(0, 4)
    phi, rho = 4 * ROOT3 * 6 / 50, 3 / 4 * 3 / 5
    assert shape_quality(a, b, p) == pytest.approx(phi)
    assert quality(a, b, p, 3.0, 1.0, 1.0) == pytest.approx(phi + rho)
    assert quality(a, b, p, 3.0, 2.0, 0.5) == pytest.approx(2 * phi + 0.5 * rho)
    regular = three(1.5, 1.5 * ROOT3)
    assert shape_quality(a, b, regular) == pytest.approx(1)
    assert quality(a, b, regular, 3.0, 1.0, 1.0) == pytest.approx(2)


@pytest.mark.kernels
def test_equation_6_size_quality() -> None:
    """l_0 = 2, l_1 = 1, l_2 = 4: rho_1 = min(1/2, 2), rho_2 = min(2, 1/2), rho = 1/4."""
    assert size_quality(2.0, 1.0, 4.0) == 0.25
    assert size_quality(2.0, 2.0, 2.0) == 1
    assert size_quality(2.0, 2.0, 3.0) == pytest.approx(2 / 3)


@pytest.mark.kernels
def test_equation_7_the_unmeshed_side() -> None:
    """(AP x AB) . n > 0 with the inner normal n, here downwards: P above AB in the plane."""
    a, b = three(*A), three(*B)
    outer, inner = (0.0, 0.0, 1.0), np.array([0.0, 0.0, -1.0])
    for p, above in ((three(0.5, 1), True), (three(0.5, -1), False), (three(3, 0.01), True), (three(0.5, 0), False)):
        assert bool(np.cross(p, b) @ inner > 0) == above  # AP = p, AB = b
        assert on_unmeshed_side(a, b, p, outer) == above


@pytest.mark.kernels
def test_equation_8_lines_that_cross() -> None:
    """(CA x CB) . (DA x DB) < 0: C and D lie on two sides of AB. On one side nothing crosses."""
    assert segments_cross((0.0, 0.0), (4.0, 0.0), (1.0, -1.0), (2.0, 1.0))
    assert not segments_cross((0.0, 0.0), (4.0, 0.0), (1.0, 2.0), (2.0, 1.0))


@pytest.mark.kernels
def test_equation_9_lines_whose_extensions_cross_do_not() -> None:
    """Eq. 8 holds (C and D lie on two sides of the line through AB), but the lines meet at x = 5, beyond B."""
    a, b, c, d = (0.0, 0.0), (4.0, 0.0), (5.0, -1.0), (5.0, 1.0)
    ca, cb, da, db = (np.array([*np.subtract(to, start), 0.0]) for start in (c, d) for to in (a, b))
    eight = np.cross(ca, cb) @ np.cross(da, db)
    assert eight < 0
    assert not segments_cross(a, b, c, d)
    assert segments_cross(a, (6.0, 0.0), c, d)


@pytest.mark.kernels
def test_equations_8_and_9_on_the_tangent_plane() -> None:
    """Two members that pass over each other in space cross once they are projected to the plane."""
    u, v = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
    places = [(0.0, 0.0, 0.3), (2.0, 2.0, 0.1), (0.0, 2.0, -0.2), (2.0, 0.0, 0.0)]
    assert segments_cross(*(onto_tangent_plane(p, (0.0, 0.0, 0.0), u, v) for p in places))


@pytest.mark.kernels
def test_equation_10_distance_of_the_ideal_point() -> None:
    """l_e = 4, l_0 = 2, w_1 = w_2 = 1/2: r = sqrt(3)/2 (2 + 1). Only l_e counts for w_1 = 1, only l_0 for w_1 = 0."""
    assert cases.reach(4.0, 2.0, 0.5) == pytest.approx(ROOT3 / 2 * 3)
    assert cases.reach(4.0, 2.0, 1.0) == pytest.approx(ROOT3 / 2 * 4)
    assert cases.reach(4.0, 2.0, 0.0) == pytest.approx(ROOT3 / 2 * 2)


def square(side: int = 3) -> list[tuple[float, float]]:
    """A square of segments of length 1, anticlockwise; AB is number 1 of its lower side."""
    steps = np.arange(side)
    low = -1.0
    lower, right = [(low + k, 0.0) for k in steps], [(low + side, float(k)) for k in steps]
    upper, left = [(low + side - k, float(side)) for k in steps], [(low, float(side - k)) for k in steps]
    return [*lower, *right, *upper, *left]


AB = 1  # segment of `square` from (0, 0) to (1, 0)


@pytest.mark.kernels
@pytest.mark.parametrize("w1", [0.0, 0.5, 1.0])
def test_section_3_4_step_1_the_optimal_point(w1: float) -> None:
    """Of the points with d_1 <= b and r - h <= d_2 <= r + h on the unmeshed side, the one of the best triangle.

    With w_1 = 1 the regular triangle, of height 0.87, lies below the search region, which begins at r - h = 1.56 - 0.38.
    """
    hand = HandFront(square(), length=1.8, length_weight=w1, search_range=3.0)
    assert cases.optimal_point(hand.surface, hand.front, AB, hand.rules, hand.patch)
    found = hand.front.nodes[hand.front.counts.nodes]
    expected = naive.optimal_point(
        hand.surface.points, three(*A), three(*B), (0, 0, 1), 1.8, w1, hand.rules.search_range
    )
    assert found.tolist() == hand.surface.points[expected].tolist()  # to the last bit: a point of the cloud
    r = ROOT3 / 2 * (w1 * 1.8 + (1 - w1) * 1.0)
    assert abs(found[0] - 0.5) <= hand.rules.search_range
    assert abs(found[1] - r) <= hand.rules.search_range


@pytest.mark.kernels
def test_section_3_4_step_1_b_and_h_bound_the_search() -> None:
    """With 3 spacings of 0.1 the region holds no point where none lies within 0.95 of its middle, even if it is doubled."""
    points = sheet(8, 8, 0.1)
    away = np.hypot(points[:, 0] - 0.5, points[:, 1] - ROOT3 / 2)
    for radius, there in ((0.2, True), (0.95, False)):
        hand = HandFront(square(5), points=points[away > radius], length=1.0, search_range=3.0)
        assert cases.optimal_point(hand.surface, hand.front, AB, hand.rules, hand.patch) == there


@pytest.mark.kernels
def test_section_3_4_step_1_points_on_the_meshed_side_do_not_count() -> None:
    """Eq. 7: all points above AB are taken away; those below it are as near."""
    points = sheet(8, 8, 0.125)
    hand = HandFront(square(), points=points[points[:, 1] < 1e-3])
    assert not cases.optimal_point(hand.surface, hand.front, AB, hand.rules, hand.patch)


@pytest.mark.kernels
def test_section_3_4_step_2_a_point_far_from_the_front_becomes_a_node() -> None:
    """The distance to the upper side, 3 - r = 2.1, is more than l_e / 2."""
    hand = HandFront(square())
    near = hand.near(AB)
    assert cases.new_node(hand.surface, hand.front, AB, hand.rules, hand.found, near, hand.patch)
    a, b, p = 1, 2, 12
    assert hand.triangles == [{a, b, p}]
    assert hand.nodes[p, :2] == pytest.approx([0.5, ROOT3 / 2], abs=0.1)
    assert {(a, p), (p, b)} <= hand.alive.keys() and (a, b) not in hand.alive


@pytest.mark.kernels
@pytest.mark.parametrize(("height", "far"), [(0.51, True), (0.49, False)])
def test_section_3_4_step_2_half_a_length_is_the_limit(height: float, far: bool) -> None:
    """A place at this height over the middle of AB's neighbour, and far from all else; AB itself does not count."""
    hand = HandFront(square(5))
    near = hand.near(AB)
    place = three(1.5, height)
    assert cases.far_from_front(hand.front, AB, -1, place, hand.found, near, 0.5 * 1.0, 1.0) == far


@pytest.mark.kernels
def test_section_3_4_step_3_else_the_best_triangle_with_an_end_of_the_near_segments() -> None:
    """A hole with a corner at (0.45, 1.2) comes within l_e / 2 of the optimal point (0.5, 0.87).

    Of the ends of the segments so near, the corner makes the best triangle with AB, phi + rho = 0.948 + 0.591.
    """
    hole = [(0.45, 1.2), (-0.2, 1.9), (0.5, 2.4), (1.2, 1.9)]
    hand = HandFront(square(4), hole)
    near = hand.near(AB)
    place = three(0.5, ROOT3 / 2)
    ends = {}
    for a, b in hand.alive:
        if naive.distance_to_segment(place, hand.nodes[a], hand.nodes[b]) < 0.5 and (a, b) != (1, 2):
            for q in {a, b} - {1, 2}:
                to_a, to_b = (float(np.linalg.norm(hand.nodes[q] - three(*end))) for end in (A, B))
                ends[q] = naive.shape_quality(three(*A), three(*B), hand.nodes[q]) + naive.size_quality(1, to_a, to_b)
    assert max(ends, key=ends.__getitem__) == 16
    assert ends[16] == pytest.approx(0.948 + 0.591, abs=0.002)
    assert cases.new_node(hand.surface, hand.front, AB, hand.rules, hand.found, near, hand.patch)
    assert hand.triangles == [{1, 2, 16}]
    assert len(hand.nodes) == 20  # no new one


# Table 1: the six cases; AB is the candidate, C the free end of the previous segment, D that of the next one


def advance_once(hand: HandFront, s: int = 0) -> int:
    """Advance one segment by Table 1."""
    return cases.choose_by_case(hand.surface, hand.front, s, hand.rules, hand.found, hand.patch)


def case(hand: HandFront, s: int = 0) -> int:
    """Number of the case in which a segment is."""
    angles = fits.left_angle(hand.front, s), fits.right_angle(hand.front, s)
    return cases.case_of(hand.front, s, *angles, hand.rules.merge_angle)


def around(c: tuple[float, float], d: tuple[float, float]) -> list[tuple[float, float]]:
    """AB with C and D, closed far away by a wide loop."""
    return [A, B, d, (3.2, 1.0), (3.2, 2.6), (0.5, 3.2), (-2.2, 2.6), (-2.2, 1.0), c]


C, D = 8, 2  # nodes of `around`


@pytest.mark.kernels
def test_table_1_case_1_a_triangle_is_closed() -> None:
    hand = HandFront([A, B, (0.5, 0.9)], method="paper")
    assert case(hand) == 1
    assert advance_once(hand)
    assert hand.triangles == [{0, 1, 2}]
    assert not hand.alive


@pytest.mark.kernels
def test_table_1_case_2_a_quadrangle_is_divided_by_its_better_diagonal() -> None:
    """A (0, 0), B (1, 0), D (1.4, 0.9), C (0.4, 0.9): BC = 1.08 is shorter than AD = 1.66, and its triangles are better."""
    hand = HandFront([A, B, (1.4, 0.9), (0.4, 0.9)], method="paper")
    assert case(hand) == 2
    assert advance_by_cases(hand.surface, hand.front, hand.rules, 100) == lists.DONE
    assert set(hand.triangles) == {frozenset({0, 1, 3}), frozenset({1, 2, 3})}
    assert not hand.alive
    mirrored = HandFront([A, B, (0.6, 0.9), (-0.4, 0.9)], method="paper")
    advance_by_cases(mirrored.surface, mirrored.front, mirrored.rules, 100)
    assert set(mirrored.triangles) == {frozenset({0, 1, 2}), frozenset({0, 2, 3})}


@pytest.mark.kernels
def test_table_1_case_3_two_free_ends_merge_into_the_point_closest_to_them() -> None:
    """C (0.2, 0.95) and D (0.8, 0.95), alpha = beta = 78 degrees: one triangle with the point nearest to (0.5, 0.95)."""
    hand = HandFront(around((0.2, 0.95), (0.8, 0.95)), inner=(C, D), method="paper")
    assert case(hand) == 3
    assert advance_once(hand)
    (triangle,) = hand.triangles
    (merged,) = triangle - {0, 1}
    assert merged in (C, D)
    points = hand.surface.points
    closest = points[np.linalg.norm(points - three(0.5, 0.95), axis=1).argmin()]
    assert hand.nodes[merged].tolist() == closest.tolist()
    gone = ({C, D} - {merged}).pop()
    ends = {n for segment in hand.alive for n in segment}
    assert merged in ends and not {gone, 0, 1} & ends
    assert len(hand.alive) == 9 - 3
    assert (7, merged) in hand.alive and (merged, 3) in hand.alive


@pytest.mark.kernels
def test_table_1_case_3_triangles_that_are_finished_follow_the_merged_node() -> None:
    """A triangle on the far side of C keeps its other nodes; its corner at C moves along."""
    hand = HandFront(around((0.2, 0.95), (0.8, 0.95)), inner=(C, D), method="paper")
    outside = hand.add_node(-0.75, 0.5)
    lists.add_triangle(hand.front, C, outside, 0)
    assert advance_once(hand)
    merged = next(iter(hand.triangles[1] - {0, 1}))
    assert hand.triangles[0] == {merged, outside, 0}
    assert naive.faults(hand.front.triangles[:2]) == []


@pytest.mark.kernels
def test_table_1_case_3_a_boundary_node_does_not_move() -> None:
    """D lies on the boundary: C comes to it."""
    hand = HandFront(around((0.2, 0.95), (0.8, 0.95)), inner=(C,), method="paper")
    assert advance_once(hand)
    assert hand.triangles == [{0, 1, D}]
    assert hand.nodes[D].tolist() == [0.8, 0.95, 0.0]


@pytest.mark.kernels
def test_table_1_case_3_after_foucault_a_quadrangle_is_divided() -> None:
    """C and D are joined, and the quadrangle is divided by a diagonal: two triangles, no node moves."""
    places = around((0.2, 0.95), (0.8, 0.95))
    hand = HandFront(places, inner=(C, D), method="paper", case3="quadrangle")
    assert case(hand) == 3
    assert advance_once(hand)
    assert set(hand.triangles) in ({frozenset({0, 1, C}), frozenset({1, C, D})}, {frozenset({0, 1, D}), frozenset({0, C, D})})  # fmt: skip
    assert (C, D) in hand.alive
    assert hand.nodes[:, :2] == pytest.approx(np.array(places))


@pytest.mark.kernels
def test_table_1_case_4_a_new_node() -> None:
    """Alpha = beta = 180 degrees: the three steps of Sec. 3.4."""
    hand = HandFront(square(), method="paper")
    assert case(hand, AB) == 4
    assert advance_once(hand, AB)
    assert hand.triangles == [{1, 2, 12}]
    assert hand.nodes[12].tolist() in hand.surface.points.tolist()
    assert {(1, 12), (12, 2)} <= hand.alive.keys()


@pytest.mark.kernels
def test_table_1_case_5_a_triangle_with_the_next_segment() -> None:
    """Alpha = 135 degrees, beta = 72 degrees: the triangle ABD."""
    hand = HandFront(around((-0.7, 0.7), (0.7, 0.9)), method="paper")
    assert case(hand) == 5
    assert advance_once(hand)
    assert hand.triangles == [{0, 1, D}]
    assert (0, D) in hand.alive and (1, D) not in hand.alive
    assert (C, 0) in hand.alive


@pytest.mark.kernels
def test_table_1_case_6_a_triangle_with_the_previous_segment() -> None:
    """The mirror image of case 5: the triangle ABC."""
    hand = HandFront(around((0.3, 0.9), (1.7, 0.7)), method="paper")
    assert case(hand) == 6
    assert advance_once(hand)
    assert hand.triangles == [{0, 1, C}]
    assert (C, 1) in hand.alive and (C, 0) not in hand.alive
    assert (1, D) in hand.alive


@pytest.mark.kernels
def test_table_1_90_degrees_are_the_limit_and_80_may_be_set() -> None:
    """Alpha >= 90 is not < 90; at 85 degrees the paper is in case 3, Foucault with his 80 in case 4."""
    assert st.Settings(length=1.0).merge_angle == 90.0
    hand = HandFront(around((0.2, 0.95), (0.8, 0.95)))
    right = math.pi / 2
    cases_at = {
        (alpha, beta): cases.case_of(hand.front, 0, alpha, beta, right)
        for alpha in (right, right - 1e-9)
        for beta in (right, right - 1e-9)
    }
    assert cases_at == {(right, right): 4, (right, right - 1e-9): 5, (right - 1e-9, right): 6, (right - 1e-9, right - 1e-9): 3}  # fmt: skip
    wide = math.radians(85)
    assert cases.case_of(hand.front, 0, wide, wide, math.radians(90)) == 3
    assert cases.case_of(hand.front, 0, wide, wide, math.radians(80)) == 4


@pytest.mark.kernels
def test_table_1_angles_are_those_of_the_unmeshed_area() -> None:
    """At a re-entrant corner the angle is 270 degrees, not 90."""
    hand = HandFront(around((0.0, -1.0), (1.0, 1.0)))
    assert fits.left_angle(hand.front, 0) == pytest.approx(1.5 * math.pi)
    assert fits.right_angle(hand.front, 0) == pytest.approx(0.5 * math.pi)


# Sec. 3.3 and 3.6: boundaries; Fig. 4: the whole


def plate_with_hole() -> tuple[st.PointCloud, dict[str, st.Settings]]:
    cloud = st.PointCloud.from_array(ring(2.0, 6.0, 0.2))
    return cloud, {way: st.Settings(length=1.0, advance_from=way, method="paper") for way in ("external", "all")}


def test_section_3_3_characteristic_points_at_the_desired_length() -> None:
    cloud, ways = plate_with_hole()
    for loop in boundary_of(cloud, ways["external"]).loops:
        nodes, _ = characteristic_points(loop, 1.0)
        steps = np.linalg.norm(np.roll(nodes, -1, axis=0) - nodes, axis=1)
        assert steps == pytest.approx(1.0, abs=0.08)


@pytest.mark.parametrize("way", ["external", "all"])
def test_section_3_6_internal_boundaries_are_active_or_inactive(way: str) -> None:
    cloud, ways = plate_with_hole()
    samples, boundary, constraints = steps_of(cloud, ways[way])
    assert (len(boundary.external), len(boundary.internal)) == (1, 1)
    front = start_front(new_front(samples, ways[way]), samples, boundary, constraints, ways[way])
    count = front.counts.segments
    away = np.linalg.norm(front.nodes[front.tail[:count], :2], axis=1)
    assert (front.state[:count][away > 4] == lists.ACTIVE).all()
    assert (front.state[:count][away < 4] == (lists.ACTIVE if way == "all" else lists.INACTIVE)).all()
    assert ((away < 4).sum(), (away > 4).sum()) == (13, 38)  # 2 pi 2 and 2 pi 6 members


@pytest.mark.parametrize("way", ["external", "all"])
def test_section_3_6_where_the_front_starts(way: str) -> None:
    """The first triangles lie at the external boundary, or at both; in the end both boundaries are those of the grid."""
    cloud, ways = plate_with_hole()
    grid = front_of(cloud, ways[way])
    away = np.linalg.norm(grid.nodes + grid.origin, axis=1)
    first = away[grid.triangles[:50]].min(axis=1)
    assert (first < 2.1).any() == (way == "all")
    assert naive.faults(grid.triangles) == []
    assert naive.topology(grid.triangles) == (1, 2, 0)
    assert (abs(away - 2.0) < 0.05).sum() == 13
    assert (abs(away - 6.0) < 0.05).sum() == 38


def test_figure_4_the_front_advances_until_nothing_is_left_to_advance() -> None:
    cloud = st.PointCloud.from_array(cap(5.0, 1.2, 0.2))
    settings = st.Settings(length=1.0, method="paper")
    grid = front_of(cloud, settings)
    assert naive.faults(grid.triangles) == []
    assert naive.topology(grid.triangles) == (1, 1, 1)
    a, b, c = (grid.nodes[grid.triangles[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
    assert area == pytest.approx(2 * math.pi * 25 * (1 - math.cos(1.2)), rel=0.02)


def test_section_3_5_nodes_are_points_of_the_cloud() -> None:
    """In the paper's own method every node that is not of the boundary is a measured point."""
    cloud = st.PointCloud.from_array(ring(0.0, 6.0, 0.2))
    settings = st.Settings(length=1.0, method="paper")
    grid = front_of(cloud, settings)
    inner = np.setdiff1d(np.arange(len(grid.nodes)), np.concatenate(grid.boundary_loops))
    measured = {tuple(p) for p in cloud.points.tolist()}
    share = np.mean([tuple(p) in measured for p in grid.nodes[inner].tolist()])
    assert share > 0.9  # the rest closes gaps


# Sec. 4: optimization


def scan_of_a_dome() -> np.ndarray:
    return cap(5.0, 1.2, 0.2)


def test_section_4_1_flips_make_the_smallest_angle_as_large_as_they_can() -> None:
    """A rhombus of diagonals 4 and 2: the long one leaves 27 degrees, the short one 53; the short one is taken and stays."""
    nodes = np.array([(0.0, 0.0, 0.0), (2.0, -1.0, 0.0), (4.0, 0.0, 0.0), (2.0, 1.0, 0.0)])
    wide = st.Grid(nodes, np.array([(0, 1, 2), (0, 2, 3)]), np.zeros(4, bool), np.zeros(3))
    flipped, count = flipped_edges(wide)
    assert count == 1
    assert {frozenset(t) for t in flipped.triangles.tolist()} == {frozenset({0, 1, 3}), frozenset({1, 2, 3})}
    assert naive.directed_edges(flipped.triangles).keys() >= {(0, 1), (1, 2), (2, 3), (3, 0)}
    again, count = flipped_edges(flipped)
    assert count == 0 and again.triangles.tolist() == flipped.triangles.tolist()


@pytest.mark.parametrize("method", ["paper", "default"])
def test_section_4_2_fixed_nodes_are_exactly_in_place(method: str) -> None:
    points = scan_of_a_dome()
    rng = np.random.default_rng(1)
    inner = points[points[:, 2] > 3.5]
    fixed = inner[[0, np.linalg.norm(inner - inner[0], axis=1).argmax()]] + 0.01 * rng.normal(size=(2, 3))
    settings = st.Settings(length=1.0, method=method, fixed=[tuple(p) for p in fixed.tolist()])
    grid = st.grid_from_points(points, settings)
    assert grid.fixed.sum() == 2
    for place in fixed:
        distance = np.linalg.norm(grid.nodes + grid.origin - place, axis=1)
        assert distance.min() < 1e-12
        assert grid.fixed[distance.argmin()]
    assert naive.faults(grid.triangles) == []
    assert grid.quality.shape_min > 0.4


def test_section_4_2_the_front_does_not_know_of_fixed_nodes() -> None:
    """They are not taken into account in the process of grid generating."""
    cloud = st.PointCloud.from_array(scan_of_a_dome())
    plain = st.Settings(length=1.0, method="paper")
    fixing = plain.replace(fixed=[tuple(cloud.points[5] + cloud.origin)])
    a, b = (front_of(cloud, s) for s in (plain, fixing))
    assert a.nodes.tobytes() == b.nodes.tobytes() and a.triangles.tobytes() == b.triangles.tobytes()


@pytest.mark.parametrize(
    ("places", "said"),
    [([(0.0, 0.0, 9.0)], "away from the scan"), ([(0.0, 0.0, 5.0), (0.3, 0.0, 5.0)], "apart")],
)
def test_section_4_2_positions_that_cannot_be_nodes_are_refused(
    places: list[tuple[float, float, float]], said: str
) -> None:
    with pytest.raises(st.InputError, match=said):
        st.grid_from_points(scan_of_a_dome(), st.Settings(length=1.0, method="paper", fixed=places))
