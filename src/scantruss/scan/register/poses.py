"""Poses: rigid motions as (4, 4) matrices."""

from __future__ import annotations

import numpy as np


def make_pose(rotation: np.ndarray, translation: np.ndarray) -> np.ndarray:
    """Return the (4, 4) pose of a rotation (3, 3) and a translation (3,)."""
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation, translation
    return pose


def invert(pose: np.ndarray) -> np.ndarray:
    """Return the inverse of a pose (4, 4)."""
    return make_pose(pose[:3, :3].T, -pose[:3, :3].T @ pose[:3, 3])


def turn_by(pose: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Return directions (N, 3) rotated by a pose (4, 4); summed by hand, as a matrix product may round differently with other threads."""
    x, y, z = directions[:, 0, None], directions[:, 1, None], directions[:, 2, None]
    turned: np.ndarray = x * pose[:3, 0] + y * pose[:3, 1] + z * pose[:3, 2]
    return turned


def move(pose: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return points (N, 3) moved by a pose (4, 4)."""
    return turn_by(pose, points) + pose[:3, 3]


def small_motion(turning: np.ndarray, moving: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """Return the pose (4, 4) that turns by the vector `turning` (3,) [radian] around `centre` and then moves by `moving`."""
    angle = float(np.linalg.norm(turning))
    x, y, z = turning
    skew = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    if angle < 1e-12:
        a, b = 1.0, 0.5
    else:
        a, b = np.sin(angle) / angle, (1.0 - np.cos(angle)) / (angle * angle)
    rotation = np.eye(3) + a * skew + b * skew @ skew
    return make_pose(rotation, centre + moving - rotation @ centre)


def quaternion_of(pose: np.ndarray) -> np.ndarray:
    """Return the unit quaternion (x, y, z, w), w not negative, of the rotation of a pose."""
    r = pose[:3, :3]
    largest = int(np.argmax([r[0, 0], r[1, 1], r[2, 2], np.trace(r)]))
    if largest == 3:
        q = np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], 1.0 + np.trace(r)])
    else:
        i, j, k = largest, (largest + 1) % 3, (largest + 2) % 3
        q = np.zeros(4)
        q[i], q[j], q[k] = 1.0 + 2.0 * r[i, i] - np.trace(r), r[j, i] + r[i, j], r[k, i] + r[i, k]
        q[3] = r[k, j] - r[j, k]
    q = q / np.linalg.norm(q)
    return -q if q[3] < 0.0 else q
