"""Fine alignment: generalized ICP of one scan onto another, and how a right pose differs from a wrong one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...kernels.scan import overlap as kernels
from ...kernels.scan.overlap import MOTION_NUMBERS
from .poses import invert, small_motion
from .views import View

PLANE_STIFFNESS = 1000.0  # stiffness across the surface over that along it
MOST_STEPS = 10  # most steps with one reach
LAST_STEP = 5e-3  # a step that moves no place farther than this share of the spacing is the last
DAMPING_SHARE = 1e-6  # share of the stiffness added, so that directions that slide freely stay at rest


@dataclass(frozen=True, eq=False)
class Fit:
    """How two scans agree under a pose."""

    agreeing: int  #: places of both scans that lie on the other's surface
    against: int  #: places over the other's surface, but off it
    share: float  #: overlap: the agreeing share of the places of the scan that has the larger one
    residual: float  #: root of the mean squared distance of agreeing places across the surface [scan unit]
    near: float  #: distance across the surface within which places agree [scan unit]
    over: float  #: share of the places, agreeing or against, of the scan that has the larger one

    @property
    def agreement(self) -> float:
        """Share of the places over the other's surface that lie on it."""
        return self.agreeing / max(self.agreeing + self.against, 1)

    @property
    def score(self) -> float:
        """Score by which poses are compared: agreeing places, reduced where others contradict or agreement is random.

        Surfaces that merely cross lie anywhere within `near`: the mean squared distance is then a third of its square.
        """
        return self.agreeing * self.agreement**2 * max(1.0 - 3.0 * (self.residual / self.near) ** 2, 0.0)


def align(
    first: View,
    second: View,
    pose: np.ndarray,
    turn: float,
    reaches: Sequence[float],
    few: int,
    rounds: int = MOST_STEPS,
) -> np.ndarray:
    """Return the pose (4, 4) that brings the first scan onto the second, from a pose nearby.

    Parameters
    ----------
    pose : (4, 4) from the frame of the first scan to that of the second
    turn : 1, or -1 if the normals of the two views face opposite sides
    reaches : distances within which places are paired, one after the other [scan unit]
    few : places of a scan that suffice
    rounds : most steps with one reach
    """
    every = max(min(len(first.points), len(second.points)) // few, 1)
    centre = second.points.mean(axis=0)[None]
    size = float(np.linalg.norm(np.ptp(second.points, axis=0)))
    for reach in reaches:
        for _ in range(rounds):
            sums = np.zeros((7, 7))
            count = add_pairs(sums, first, second, pose, np.eye(4), turn, reach, centre, every)
            if count < 6:
                return pose
            step = solve_step(sums[:MOTION_NUMBERS, :MOTION_NUMBERS], sums[:MOTION_NUMBERS, MOTION_NUMBERS], 0.5 * size)
            pose = small_motion(step[:3], step[3:], centre[0]) @ pose
            if np.linalg.norm(step[:3]) * size + np.linalg.norm(step[3:]) < LAST_STEP * first.spacing:
                break
    return pose


def add_pairs(
    sums: np.ndarray,
    first: View,
    second: View,
    first_pose: np.ndarray,
    second_pose: np.ndarray,
    turn: float,
    reach: float,
    centre: np.ndarray,
    every: int,
) -> int:
    """Add the pairs of places of two scans, found both ways, to the (7, 7) sums for moving the first; return their number."""
    soft = 0.5 * first.spacing
    count = 0
    for a, b, one, other, sign in (
        (first, second, first_pose, second_pose, 1.0),
        (second, first, second_pose, first_pose, -1.0),
    ):
        part = np.zeros((7, 7))
        count += kernels.step_sums(
            a.points, a.normals, b.points, b.normals, b.on_boundary, b.boxes,
            np.ascontiguousarray(one), np.ascontiguousarray(invert(other) @ one),
            turn, every, reach, soft, PLANE_STIFFNESS, centre, part,
        )  # fmt: skip
        part[MOTION_NUMBERS, :MOTION_NUMBERS] *= sign
        part[:MOTION_NUMBERS, MOTION_NUMBERS] *= sign
        sums += part
    return count


def solve_step(stiffness: np.ndarray, load: np.ndarray, arm: float) -> np.ndarray:
    """Return the step (6 K,) that removes the residual, rotations [radian] before translations; what slides freely stays.

    arm : length that makes rotations comparable to translations [scan unit]
    """
    scale = np.tile([1.0 / arm] * 3 + [1.0] * 3, len(load) // 6)
    matrix = stiffness * scale[:, None] * scale
    matrix[np.diag_indices(len(load))] += DAMPING_SHARE * np.trace(matrix) / len(load) + 1e-300
    rest = -load * scale
    for k in range(len(load)):  # by hand: a library may round differently with other numbers of threads
        factor = matrix[k + 1 :, k] / matrix[k, k]
        matrix[k + 1 :, k:] -= np.multiply.outer(factor, matrix[k, k:])
        rest[k + 1 :] -= factor * rest[k]
    step = np.zeros(len(load))
    for k in range(len(load) - 1, -1, -1):
        step[k] = (rest[k] - (matrix[k, k + 1 :] * step[k + 1 :]).sum()) / matrix[k, k]
    return scale * step


def judge_pair(first: View, second: View, pose: np.ndarray, turn: float, near: float, reach: float) -> Fit:
    """Return how two scans agree under a pose (4, 4) of the first in the frame of the second; near and reach [scan unit]."""
    shares, over = [], []
    all_agreeing, all_against, all_squares = 0, 0, 0.0
    for a, b, back in ((first, second, pose), (second, first, invert(pose))):
        agreeing, against, squares = kernels.judge_overlap(
            a.points, a.normals, b.points, b.normals, b.on_boundary, b.boxes,
            np.ascontiguousarray(back), turn, b.spacing, near, reach,
        )  # fmt: skip
        shares.append(agreeing / max(len(a.points), 1))
        over.append((agreeing + against) / max(len(a.points), 1))
        all_agreeing, all_against, all_squares = all_agreeing + agreeing, all_against + against, all_squares + squares
    residual = float(np.sqrt(all_squares / max(all_agreeing, 1)))
    return Fit(all_agreeing, all_against, float(max(shares)), residual, near, float(max(over)))
