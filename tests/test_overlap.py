"""The kernels of splicing against slow, obvious twins."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some
from range_scans import body, random_pose, scans_of
from scipy.spatial import cKDTree
from typed import xyz

from scantruss.kernels.geometry.boxes import nearest
from scantruss.kernels.scan import blend as blending
from scantruss.kernels.scan import features as feature_kernels
from scantruss.kernels.scan import overlap as kernels
from scantruss.scan.register.features import ANGLE_BINS, features_from_behind, find_features
from scantruss.scan.register.fine import align, judge_pair, solve_step
from scantruss.scan.register.matching import fit_pose
from scantruss.scan.register.poses import invert, move, quaternion_of, small_motion, turn_by
from scantruss.scan.register.views import View, boxes_around, make_view

pytestmark = pytest.mark.kernels
SPACING = 0.12


def angle_between(one: np.ndarray, other: np.ndarray) -> float:
    """Return the angle [degree] of the rotation between two poses."""
    between = one[:3, :3].T @ other[:3, :3]
    sine = np.linalg.norm(between - between.T) / np.sqrt(8.0)
    return float(np.degrees(np.arctan2(sine, 0.5 * (np.trace(between) - 1.0))))


@pytest.fixture(scope="module")
def views() -> tuple[View, View, np.ndarray]:
    """Two overlapping views of a body, and the true pose from the first to the second."""
    rng = np.random.default_rng(4)
    scans, poses = scans_of(body(2), [(1.0, 0.0, 0.0), (0.8, 0.6, 0.1)], rng, count=4000)
    return make_view(scans[0], SPACING), make_view(scans[1], SPACING), invert(poses[1]) @ poses[0]


@given(some.integers(0, 2**32 - 1))
def test_the_nearest_place_is_the_nearest(seed: int) -> None:
    rng = np.random.default_rng(seed)
    places = rng.random((40, 3))
    boxes, reach = boxes_around(places, 0.2), rng.uniform(0.05, 0.5)
    for x in rng.uniform(-0.3, 1.3, (20, 3)):
        away, at = cKDTree(places).query(x)
        assert nearest(boxes, places, *xyz(x), reach) == (at if away <= reach else -1)


def test_the_first_place_within_reach_is_the_first() -> None:
    rng = np.random.default_rng(1)
    points, places = rng.random((200, 3)), rng.random((40, 3))
    owner = np.empty(200, np.int64)
    kernels.first_places(points, boxes_around(places, 0.2), places, 0.25, owner)
    near = np.linalg.norm(points[:, None] - places, axis=2) <= 0.25
    assert np.array_equal(owner, np.where(near.any(axis=1), near.argmax(axis=1), -1))


def test_places_keep_their_spacing_and_normals_face_outside(views: tuple[View, View, np.ndarray]) -> None:
    for view in views[:2]:
        assert len(view.points) > 80 and np.allclose(np.linalg.norm(view.normals, axis=1), 1.0)
        assert view.bulge > 0.5
        middle = view.points.mean(axis=0)
        assert ((view.points - middle) * view.normals).sum(axis=1).mean() > 0.0
        assert 0.05 < view.on_boundary.mean() < 0.6


def slow_values(p: np.ndarray, n: np.ndarray, q: np.ndarray, m: np.ndarray) -> tuple[float, float, float]:
    d = (q - p) / np.linalg.norm(q - p)
    v = np.cross(d, n) / np.linalg.norm(np.cross(d, n))
    return v @ m, n @ d, np.arctan2(np.cross(n, v) @ m, n @ m)


def test_histograms_count_the_angles_of_all_pairs_in_reach(views: tuple[View, View, np.ndarray]) -> None:
    view, reach = views[0], 4 * SPACING
    edges = np.sort(np.random.default_rng(0).uniform(-1, 1, (3, 4)), axis=1)
    found = np.zeros((len(view.points), 2 * 3 * 5))
    feature_kernels.point_histograms(view.points, view.normals, view.boxes, reach, edges, found, 0, 12)
    for p in range(12):
        slow = np.zeros((2, 3, 5))
        for q in range(len(view.points)):
            away = np.linalg.norm(view.points[q] - view.points[p])
            if 0 < away <= reach:
                values = slow_values(view.points[p], view.normals[p], view.points[q], view.normals[q])
                for kind, value in enumerate(values):
                    slow[int(away >= 0.6 * reach), kind, np.searchsorted(edges[kind], value, "right")] += 1
        slow /= np.maximum(slow.sum(axis=2, keepdims=True), 1)
        assert np.allclose(found[p], slow.ravel())


def test_features_do_not_change_when_a_scan_is_moved(views: tuple[View, View, np.ndarray]) -> None:
    view = views[0]
    pose = random_pose(np.random.default_rng(8))
    points, normals = move(pose, view.points), turn_by(pose, view.normals)
    moved = replace(view, points=points, normals=normals, boxes=boxes_around(points, 1.5 * SPACING))
    turned = replace(view, normals=-view.normals)
    plain, other, opposite = find_features([view, moved, turned])
    assert (np.abs(plain - other) > 20).mean() < 0.01  # a value on the edge of a bin may change sides
    assert (np.abs(features_from_behind(plain) - opposite) > 20).mean() < 0.01
    assert plain.shape == (len(view.points), 6 * ANGLE_BINS) and np.array_equal(plain, np.round(plain))


def slow_sums(
    a: View, b: View, pose: np.ndarray, reach: float, soft: float, sharp: float, centre: np.ndarray
) -> tuple[np.ndarray, int]:
    """One way of a plane-to-plane step: the pairs by a tree, the weights by inverting the sum of the covariances."""
    sums = np.zeros((6, 7))
    count = 0
    for p, n in zip(move(pose, a.points), turn_by(pose, a.normals), strict=False):
        away, q = cKDTree(b.points).query(p)
        m = b.normals[q]
        if away > reach or b.on_boundary[q] or n @ m < 0.6:
            continue
        e = 1.0 / sharp
        covariance = 2 * np.eye(3) - (1 - e) * (np.outer(n, n) + np.outer(m, m))
        d = p - b.points[q]
        weight = np.linalg.inv(covariance) / (1 + (d @ m / soft) ** 2)
        arm = p - centre
        jacobian = np.column_stack([-np.cross(np.eye(3), arm).T.T, np.eye(3)])
        jacobian[:, :3] = -np.array([[0, -arm[2], arm[1]], [arm[2], 0, -arm[0]], [-arm[1], arm[0], 0]])
        sums[:, :6] += jacobian.T @ weight @ jacobian
        sums[:, 6] += jacobian.T @ weight @ d
        count += 1
    return sums, count


def test_a_step_sums_what_generalized_icp_says(views: tuple[View, View, np.ndarray]) -> None:
    a, b, pose = views
    pose = (
        small_motion(np.array([0.02, -0.01, 0.03]), np.array([0.01, 0.02, 0.0]), move(pose, a.points).mean(axis=0))
        @ pose
    )
    centre = b.points.mean(axis=0)
    sums = np.zeros((7, 7))
    count = kernels.step_sums(
        a.points, a.normals, b.points, b.normals, b.on_boundary, b.boxes, pose, pose,
        1.0, 1, 0.2, 0.05, 100.0, centre[None], sums,
    )  # fmt: skip
    slow, many = slow_sums(a, b, pose, 0.2, 0.05, 100.0, centre)
    assert count == many > 50
    assert np.allclose(sums[:6], slow, rtol=1e-6, atol=1e-6 * np.abs(slow).max())


def test_judging_counts_what_agrees_and_what_does_not(views: tuple[View, View, np.ndarray]) -> None:
    a, b, pose = views
    near, reach = 0.02, 0.36
    tree = cKDTree(b.points)
    for shift in (0.0, 0.05):
        there = pose.copy()
        there[:3, 3] += shift
        agreeing = against = squares = 0
        for p, n in zip(move(there, a.points), turn_by(there, a.normals), strict=False):
            away, q = tree.query(p)
            off = (p - b.points[q]) @ b.normals[q]
            if away > reach or b.on_boundary[q] or away**2 - off**2 > 2.25 * SPACING**2:
                continue
            if n @ b.normals[q] < -0.2:
                continue
            if abs(off) <= near and n @ b.normals[q] > 0.75:
                agreeing, squares = agreeing + 1, squares + off**2
            else:
                against += 1
        found = kernels.judge_overlap(
            a.points, a.normals, b.points, b.normals, b.on_boundary, b.boxes, there, 1.0, SPACING, near, reach
        )
        assert found == pytest.approx((agreeing, against, squares))
    right, wrong = (judge_pair(a, b, p, 1.0, near, reach) for p in (pose, there))
    assert right.agreement > 0.9 > wrong.agreement and right.score > wrong.score


def test_alignment_finds_back(views: tuple[View, View, np.ndarray]) -> None:
    a, b, pose = views
    centre = move(pose, a.points).mean(axis=0)
    start = small_motion(np.array([0.05, -0.06, 0.04]), np.array([0.04, -0.05, 0.03]), centre) @ pose
    found = align(a, b, start, 1.0, (2 * SPACING, SPACING), 10_000, 30)
    assert angle_between(found, pose) < 1.0 < 4.0 < angle_between(start, pose)
    assert np.linalg.norm(move(found, a.points) - move(pose, a.points), axis=1).mean() < 0.15 * SPACING


@given(some.integers(0, 2**32 - 1))
def test_poses(seed: int) -> None:
    rng = np.random.default_rng(seed)
    pose, other = random_pose(rng), random_pose(rng)
    points = rng.normal(size=(7, 3))
    assert np.allclose(move(invert(pose), move(pose, points)), points)
    q = quaternion_of(pose)
    assert np.isclose(np.linalg.norm(q), 1.0) and q[3] >= 0.0
    half = np.degrees(2 * np.arccos(min(abs(q @ quaternion_of(other)), 1.0)))
    assert angle_between(pose, other) == pytest.approx(half, abs=1e-4)
    axis = rng.normal(size=3)
    motion = small_motion(axis, np.zeros(3), points[0])
    assert np.allclose(move(motion, points[:1]), points[:1])
    assert np.allclose(turn_by(motion, axis[None]), axis)
    normals = points / np.linalg.norm(points, axis=1)[:, None]
    assert np.allclose(fit_pose(points, normals, move(pose, points), turn_by(pose, normals), 1.0), pose)


@given(some.integers(0, 2**32 - 1))
def test_a_step_is_the_solution(seed: int) -> None:
    rng = np.random.default_rng(seed)
    a, load = rng.normal(size=(12, 20)), rng.normal(size=12)
    assert np.allclose(solve_step(a @ a.T, load, 1.0), -np.linalg.solve(a @ a.T, load), atol=1e-2)


def test_depth_is_the_distance_from_the_rim(views: tuple[View, View, np.ndarray]) -> None:
    view = views[0]
    boundary_points = np.ascontiguousarray(view.points[view.on_boundary])
    depth = np.empty(len(view.points))
    blending.depths(view.points, boundary_points, boxes_around(boundary_points, 0.3), 0.5, depth)
    assert np.allclose(depth, np.minimum(cKDTree(boundary_points).query(view.points)[0], 0.5))


def test_a_second_layer_moves_points_to_the_mean_and_takes_what_it_sees_better() -> None:
    """Two level plates 0.1 apart: with equal weights points move half-way; the deeper one keeps its points."""
    x, y = np.meshgrid(np.arange(12.0), np.arange(12.0))
    low = np.column_stack([x.ravel(), y.ravel(), np.zeros(144)])
    high = low + [0.0, 0.0, 0.1]
    up = np.tile([0.0, 0.0, 1.0], (144, 1))
    for deeper in (0, 1):
        own, deep = np.arange(144), np.full(144, 3.0)
        shift, weight, kept = np.zeros((144, 3)), np.full(144, 1.0), np.ones(144, np.int64)
        blending.add_layer(
            low, own, up, deep, high, up, boxes_around(high, 2.0), np.full(144, 2.0 + 2.0 * deeper), np.eye(4), 1.0, 0,
            1.5, 0.5, 1.0, shift, weight, kept,
        )  # fmt: skip
        assert np.allclose(shift / weight[:, None], [0.0, 0.0, 0.05])
        assert (kept == 1 - deeper).all()
