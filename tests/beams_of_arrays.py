"""Beams as `structure.corotational` has them, all at once by arrays: the slow twin of their kernels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scantruss.structure.corotational import FARTHEST_TURN, SERIES_TERMS, Members, Response
from scantruss.structure.frame import BEND_Y1, BEND_Z1, LENGTHEN, TWIST

_SERIES = np.cumprod([1.0, *(n / (2 * n + 1) for n in range(1, SERIES_TERMS))])  # of powers of 1 - cosine
_ENDS = np.array([0, 1, 2, 3, 4, 5, 0, 1, 2, 6, 7, 8])  # of chord and turns, in the order of displacements
_SIGNS = np.repeat([-1.0, 1.0, 1.0, 1.0], 3)


def respond(
    members: Members,
    moves: np.ndarray,
    turns: np.ndarray,
    strain: np.ndarray,
    factor: float,
    *,
    foreseen: np.ndarray | None = None,
    tangents: bool = False,
) -> Response:
    """Return forces and tangents of members that bend."""
    start, end = members.ends.T
    moved = moves[end] - moves[start]
    chord = members.chords + moved
    length = np.linalg.norm(chord, axis=1)
    along = chord / length[:, None]
    # (l - L) from l^2 - L^2, which keeps the digits of small strains
    longer = (moved * (2 * members.chords + moved)).sum(axis=1) / (length + members.lengths)
    plane = (np.eye(3) - along[:, :, None] * along[:, None, :]) / length[:, None, None]
    first, second = (members.axes @ turns[each].transpose(0, 2, 1) for each in (start, end))
    ends = _End.of(first, along, length), _End.of(second, along, length)
    twist = (np.cross(first[:, 2], second[:, 1]) - np.cross(first[:, 1], second[:, 2])) / 2

    natural = np.zeros((len(length), 6))  # deformations, and their gradients by chord and turns
    natural[:, LENGTHEN] = longer
    natural[:, TWIST] = (_dot(first[:, 2], second[:, 1]) - _dot(first[:, 1], second[:, 2])) / 2
    slope = np.zeros((len(length), 6, 9))
    slope[:, LENGTHEN, :3] = along
    slope[:, TWIST, 3:6], slope[:, TWIST, 6:] = twist, -twist
    for number, each in enumerate(ends):
        for axis, row in enumerate((BEND_Y1 + number, BEND_Z1 + number)):
            natural[:, row] = each.angles[:, axis]
            slope[:, row, :3] = each.by_chord[:, axis]
            slope[:, row, 3 + 3 * number : 6 + 3 * number] = each.by_turn[:, axis]

    bow = _times(members.bow, natural)
    force = members.axial * (longer / members.lengths + _dot(bow, natural) / 2 - factor * strain)
    share = bow.copy()  # of each deformation in the strain
    share[:, LENGTHEN] = 1 / members.lengths
    stiff = (members.axial * members.lengths)[:, None]
    answers = _times(members.bending, natural) + (force * members.lengths)[:, None] * share
    known = answers if foreseen is None else foreseen
    within = members.bending + (known[:, LENGTHEN] * members.lengths)[:, None, None] * members.bow
    within += stiff[:, :, None] * share[:, :, None] * share[:, None, :]
    hessian = None
    if tangents:
        hessian = slope.transpose(0, 2, 1) @ within @ slope
        hessian[:, :3, :3] += known[:, LENGTHEN, None, None] * plane
        _add_twist(hessian, known[:, TWIST], first, second)
        for number, each in enumerate(ends):
            each.add_bending(hessian, number, known[:, [BEND_Y1 + number, BEND_Z1 + number]], plane, along, length)
        hessian = hessian.take(_ENDS, axis=1).take(_ENDS, axis=2)
        hessian *= _SIGNS[:, None] * _SIGNS
    back = slope.transpose(0, 2, 1)
    return Response(
        forces=_times(back, answers)[:, _ENDS] * _SIGNS,
        tangents=hessian,
        natural=answers,
        strained=_times(back, -(stiff[:, 0] * strain)[:, None] * share)[:, _ENDS] * _SIGNS,
        stiffness=within,
        slope=slope,
        too_far=bool(min(each.cosine.min() for each in ends) < FARTHEST_TURN),
    )


@dataclass(frozen=True, eq=False)
class _End:
    """The turn of an end against the chord: the rotation vector that takes the chord there has no twist."""

    axes: np.ndarray  # (M, 3, 3) of the end, as rows
    cosine: np.ndarray  # (M,) of the turn
    ratio: tuple[np.ndarray, np.ndarray, np.ndarray]  # angle over its sine, and derivatives by the cosine
    angles: np.ndarray  # (M, 2) about y and z
    by_chord: np.ndarray  # (M, 2, 3) derivatives of the angles
    by_turn: np.ndarray  # (M, 2, 3)

    @classmethod
    def of(cls, axes: np.ndarray, along: np.ndarray, length: np.ndarray) -> _End:
        cosine = _dot(axes[:, 0], along)
        ratio = _angle_over_sine(cosine)
        across = np.stack([axes[:, 2], -axes[:, 1]], axis=1)
        sines = (across @ along[:, :, None])[:, :, 0]
        factor, more = ratio[0][:, None, None], ratio[1][:, None, None] * sines[:, :, None]
        by_chord, by_turn = _by_chord(across, along, length), np.cross(across, along[:, None, :])
        by_chord = factor * by_chord + more * _by_chord(axes[:, :1], along, length)
        by_turn = factor * by_turn + more * np.cross(axes[:, :1], along[:, None, :])
        return cls(axes, cosine, ratio, ratio[0][:, None] * sines, by_chord, by_turn)

    def add_bending(
        self,
        hessian: np.ndarray,
        number: int,
        moments: np.ndarray,
        plane: np.ndarray,
        along: np.ndarray,
        length: np.ndarray,
    ) -> None:
        """Add the second derivatives of the angles, times the moments, by chord and turn of this end."""
        ratio, more, most = self.ratio
        axis = self.axes[:, 0]
        across = moments[:, :1] * self.axes[:, 2] - moments[:, 1:] * self.axes[:, 1]
        sine = _dot(across, along)
        slope = [  # of cosine and sine
            np.concatenate([_by_chord(v[:, None], along, length)[:, 0], np.cross(v, along)], axis=1)
            for v in (axis, across)
        ]
        mixed = more[:, None, None] * slope[0][:, :, None] * slope[1][:, None, :]
        block = mixed + mixed.transpose(0, 2, 1)
        block += (most * sine)[:, None, None] * slope[0][:, :, None] * slope[0][:, None, :]
        vector = (more * sine)[:, None] * axis + ratio[
            :, None
        ] * across  # its product with the chord has these second derivatives
        product = _dot(vector, along)
        flat = vector - product[:, None] * along
        outer = flat[:, :, None] * along[:, None, :]
        block[:, :3, :3] -= (outer + outer.transpose(0, 2, 1)) / (length**2)[:, None, None]
        block[:, :3, :3] -= (product / length)[:, None, None] * plane
        cross = -plane @ _skew(vector)
        block[:, :3, 3:] += cross
        block[:, 3:, :3] += cross.transpose(0, 2, 1)
        block[:, 3:, 3:] += _both_turned(vector, along)
        at = np.r_[0:3, 3 + 3 * number : 6 + 3 * number]
        hessian[:, at[:, None], at] += block


def _add_twist(hessian: np.ndarray, moment: np.ndarray, first: np.ndarray, second: np.ndarray) -> None:
    """Add the second derivatives of the twist, times its moment, by the turns of both ends."""
    half = moment[:, None, None] / 2
    own = half * (_both_turned(first[:, 2], second[:, 1]) - _both_turned(first[:, 1], second[:, 2]))
    one, other = _dot(first[:, 2], second[:, 1]), _dot(first[:, 1], second[:, 2])
    mixed = (one - other)[:, None, None] * np.eye(3)
    mixed -= second[:, 1, :, None] * first[:, 2, None, :] - second[:, 2, :, None] * first[:, 1, None, :]
    mixed *= half
    hessian[:, 3:6, 3:6] += own
    hessian[:, 6:, 6:] += own
    hessian[:, 3:6, 6:] += mixed
    hessian[:, 6:, 3:6] += mixed.transpose(0, 2, 1)


def _both_turned(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return the second derivatives of the product of two vectors by a rotation vector that turns one of them."""
    outer = one[:, :, None] * other[:, None, :] / 2
    made: np.ndarray = outer + outer.transpose(0, 2, 1) - _dot(one, other)[:, None, None] * np.eye(3)
    return made


def _by_chord(vectors: np.ndarray, along: np.ndarray, length: np.ndarray) -> np.ndarray:
    """Return derivatives by the chord of its direction times (M, K, 3) vectors."""
    made: np.ndarray = (vectors - (vectors @ along[:, :, None]) * along[:, None, :]) / length[:, None, None]
    return made


def _angle_over_sine(cosine: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return angle / sine and its first two derivatives by the cosine: the sum of n! (1 - cosine)^n / (2 n + 1)!!."""
    gap = np.clip(1 - cosine, 0.0, 1 - FARTHEST_TURN)
    values = np.zeros((3, len(gap)))
    for coefficient in reversed(_SERIES):  # Horner's rule with derivatives
        values[2] = values[2] * gap + 2 * values[1]
        values[1] = values[1] * gap + values[0]
        values[0] = values[0] * gap + coefficient
    return values[0], -values[1], values[2]


def _dot(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    made: np.ndarray = (one * other).sum(axis=-1)
    return made


def _times(matrices: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    made: np.ndarray = (matrices @ vectors[:, :, None])[:, :, 0]
    return made


def _skew(vectors: np.ndarray) -> np.ndarray:
    """Return the matrices of cross products with vectors on the left."""
    x, y, z = vectors.T
    nil = np.zeros_like(x)
    return np.stack([nil, -z, y, z, nil, -x, -y, x, nil], axis=1).reshape(-1, 3, 3)
