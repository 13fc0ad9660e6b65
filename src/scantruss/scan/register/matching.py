"""Coarse alignment of two scans: poses that bring many similar places together.

Pairs of places with similar features are mostly wrong. Right pairs preserve what a rigid motion preserves: the distance of any
two places, and the angles of their normals with the line between them and with each other. Groups of pairs that agree in this
give the candidates
(second order: two pairs count by how many others agree with both; Chen, Sun, Yang and Tao 2022). No random numbers are used.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .features import features_from_behind
from .poses import make_pose, move, turn_by
from .views import View

ALIKE_PLACES = 3  # most similar places of the other scan for each place
MOST_PAIRS = 800  # most pairs of similar places
DISTANCE_TOLERANCE = 1.2  # largest difference of distances of two agreeing pairs, in spacings
COSINE_TOLERANCE = 0.30  # largest difference of the cosines between normals of two agreeing pairs
PAIR_DISTANCE = 3.0  # least distance between the places of two agreeing pairs, in spacings
GROUPS_KEPT = 60  # groups that become candidates
PAIRS_IN_GROUP = 24  # pairs in a group
FEWEST_PAIRS = 5  # fewest pairs of a group that count


@dataclass(frozen=True, eq=False)
class LikelyPose:
    """A pose that may bring a scan onto another."""

    pose: np.ndarray  #: (4, 4) from the frame of the first scan to that of the second
    turn: float  #: 1, or -1 if the normals of the two views face opposite sides
    support: int  #: pairs of similar places that agree with it


def find_candidates(
    first: View, second: View, first_features: np.ndarray, second_features: np.ndarray, turn: float, most: int
) -> list[LikelyPose]:
    """Return up to `most` different candidates, those with most support first.

    Parameters
    ----------
    turn : 1, or -1 if the normals of the two views are taken to face opposite sides
    """
    features = first_features if turn > 0 else features_from_behind(first_features)
    pairs = _alike(features, second_features)
    if len(pairs) < FEWEST_PAIRS:
        return []
    found = _from_pairs(first, second, pairs, turn)
    found.sort(key=lambda candidate: -candidate.support)
    return _different(found, first, most)


def _alike(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return pairs of places (M, 2) with similar features, from either side, the most similar first.

    Features are whole numbers, so that sums are exact in any order.
    """
    apart = (first * first).sum(axis=1)[:, None] + (second * second).sum(axis=1) - 2.0 * (first @ second.T)
    count = min(ALIKE_PLACES, len(first), len(second))
    if count == 0:
        return np.zeros((0, 2), np.int64)
    there = np.argpartition(apart, count - 1, axis=1)[:, :count]  # the least similar of them last
    back = np.argpartition(apart, count - 1, axis=0)[:count].T
    one = np.stack([np.repeat(np.arange(len(first)), count), there.ravel()], axis=1)
    two = np.stack([back.ravel(), np.repeat(np.arange(len(second)), count)], axis=1)
    code, times = np.unique(np.concatenate([one, two]) @ np.array([len(second), 1]), return_counts=True)
    pairs = np.stack([code // len(second), code % len(second)], axis=1)
    # similarity counts relative to that of other places: places on plain parts are similar to all
    usual, other = apart[np.arange(len(first)), there[:, -1]], apart[back[:, -1], np.arange(len(second))]
    i, j = pairs.T
    rank = apart[i, j] / np.sqrt(np.maximum(usual[i] * other[j], 1e-12))
    order = np.lexsort((code, rank, -times))
    kept: np.ndarray = pairs[order[:MOST_PAIRS]]
    return kept


def _from_pairs(first: View, second: View, pairs: np.ndarray, turn: float) -> list[LikelyPose]:
    """Return the candidates that groups of agreeing pairs give."""
    p, n = first.points[pairs[:, 0]], turn * first.normals[pairs[:, 0]]
    q, m = second.points[pairs[:, 1]], second.normals[pairs[:, 1]]
    agree = _agree(p, n, q, m, first.spacing)
    shared = agree * (agree @ agree)
    weight = shared.sum(axis=1)
    found: list[LikelyPose] = []
    free = np.ones(len(pairs), bool)
    for seed in np.argsort(-weight, kind="stable"):
        if len(found) >= GROUPS_KEPT or weight[seed] <= 0.0:
            break
        if not free[seed]:
            continue
        group = np.argsort(-shared[seed], kind="stable")[:PAIRS_IN_GROUP]
        group = np.append(group[shared[seed, group] > 0.0], seed)
        if len(group) < FEWEST_PAIRS:
            continue
        pose = np.eye(4)
        for _ in range(3):
            pose = fit_pose(p[group], n[group], q[group], m[group], first.spacing)
            off = np.linalg.norm(move(pose, p) - q, axis=1)
            facing = (turn_by(pose, n) * m).sum(axis=1)
            inside = (off < 1.5 * first.spacing) & (facing > 0.7)
            if inside.sum() < FEWEST_PAIRS:
                break
            group = np.flatnonzero(inside)
        if inside.sum() >= FEWEST_PAIRS:
            found.append(LikelyPose(pose, turn, int(inside.sum())))
            free[inside] = False
        free[seed] = False
    return found


def _agree(p: np.ndarray, n: np.ndarray, q: np.ndarray, m: np.ndarray, spacing: float) -> np.ndarray:
    """Return which pairs agree (M, M) float32: their distances and angles fit one rigid motion."""
    one, two = _between(p, n), _between(q, m)
    length = one[0]
    agree = (np.abs(length - two[0]) < DISTANCE_TOLERANCE * spacing) & (length > PAIR_DISTANCE * spacing)
    for a, b in zip(one[1:], two[1:], strict=True):
        agree &= np.abs(a - b) < COSINE_TOLERANCE
    agree &= agree.T
    return agree.astype(np.float32)


def _between(p: np.ndarray, n: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return for all two points their distance, the cosine of their normals, and that of the first normal with the line."""
    p, n = (p - p.mean(axis=0)).astype(np.float32), n.astype(np.float32)
    square, rise, cosine = (np.zeros((len(p), len(p)), np.float32) for _ in range(3))
    for axis in range(3):  # sums of three by hand: a matrix product may round differently with other numbers of threads
        d = p[:, axis] - p[:, axis, None]
        square += d * d
        rise += n[:, axis, None] * d
        cosine += n[:, axis, None] * n[:, axis]
    length = np.sqrt(square)
    return length, cosine, rise / np.maximum(length, np.float32(1e-6) * length.max() + np.float32(1e-30))


def fit_pose(p: np.ndarray, n: np.ndarray, q: np.ndarray, m: np.ndarray, spacing: float) -> np.ndarray:
    """Return the pose that best brings points p with normals n to q with normals m, all (M, 3) (Kabsch)."""
    a, b = p.mean(axis=0), q.mean(axis=0)
    arm = spacing * spacing
    u, _, v = np.linalg.svd(_products(p - a, q - b) + arm * _products(n, m))
    turn = np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ v))])
    rotation = (u @ turn @ v).T
    return make_pose(rotation, b - rotation @ a)


def _products(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return a' b (3, 3) of two (M, 3) arrays."""
    return (a[:, :, None] * b[:, None, :]).sum(axis=0)


def _different(found: list[LikelyPose], view: View, most: int) -> list[LikelyPose]:
    """Return the first `most` candidates with different poses."""
    corners = _corners(view.points)
    kept: list[LikelyPose] = []
    places: list[np.ndarray] = []
    for candidate in found:
        place = move(candidate.pose, corners)
        if all(np.linalg.norm(place - other, axis=1).max() > 3.0 * view.spacing for other in places):
            kept.append(candidate)
            places.append(place)
        if len(kept) == most:
            break
    return kept


def _corners(points: np.ndarray) -> np.ndarray:
    """Return the corners (8, 3) of the box around the points."""
    lower, upper = points.min(axis=0), points.max(axis=0)
    return np.array([[(lower, upper)[i >> axis & 1][axis] for axis in range(3)] for i in range(8)])
