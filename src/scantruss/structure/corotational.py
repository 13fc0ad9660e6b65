"""Members under large displacements: forces and tangents of co-rotational beams and bars.

A member deforms as in `frame`, by its lengthening, its twist and the turns of its ends against the chord, however far it has moved
and turned in space (Crisfield 1990; Krenk, Non-linear Modeling and Analysis of Solids and Structures, 5.3). Its energy is

    E A L e^2 / 2 + q K q / 2,    e = (l - L) / L + q G q / 2 - initial strain,

with K the stiffness against twist and bending, and G the mean shortening by bending (Oran 1973), so that an axial force bends and
stiffens as it does in linear buckling. Forces are the gradient of the energy, and the tangent its second derivative, both by the
positions of the nodes and by rotation vectors on top of their turns: the tangent is symmetric, also away from equilibrium.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..kernels.structure.members import beam_forces, beam_tangents
from .frame import BEND_Y1, BEND_Z1, BOW, LENGTHEN, TWIST, inner_turns, natural_stiffness
from .truss import Truss

SERIES_TERMS = 24  #: of the series of an angle over its sine
FARTHEST_TURN = 0.5  #: cosine of the turn of an end against the chord beyond which an element is too coarse: 60 degrees
_SERIES = np.cumprod([1.0, *(n / (2 * n + 1) for n in range(1, SERIES_TERMS))])  # of powers of 1 - cosine
_ENDS = np.array([0, 1, 2, 3, 4, 5, 0, 1, 2, 6, 7, 8])  # of chord and turns, in the order of displacements
_SIGNS = np.repeat([-1.0, 1.0, 1.0, 1.0], 3)


@dataclass(frozen=True, eq=False)
class Members:
    """What of the members does not change as they move."""

    ends: np.ndarray  #: (M, 2) nodes
    chords: np.ndarray  #: (M, 3) from start to end [m]
    lengths: np.ndarray  #: (M,) [m]
    axes: np.ndarray  #: (M, 3, 3) local axes as rows
    axial: np.ndarray  #: (M,) E A [N]
    bending: (
        np.ndarray
    )  #: (M, 6, 6) stiffness against natural deformations but lengthening; (M, 1, 1) of 0 of a pinned structure
    bow: np.ndarray  #: (M, 6, 6) mean shortening by them

    @classmethod
    def of(cls, truss: Truss) -> Members:
        """Return the members of a structure as it stands without loads."""
        bending = natural_stiffness(truss)
        bending[:, LENGTHEN, LENGTHEN] = 0.0
        bow = np.zeros_like(bending)
        if not truss.pinned:
            inner = inner_turns(truss)
            shortening = inner.transpose(0, 1, 3, 2) @ BOW @ inner
            for axis, row in enumerate((BEND_Y1, BEND_Z1)):
                bow[:, row : row + 2, row : row + 2] = shortening[:, axis]
        start, end = truss.members.T
        return cls(
            ends=truss.members,
            chords=truss.nodes[end] - truss.nodes[start],
            lengths=truss.lengths,
            axes=truss.axes,
            axial=truss.material.young * truss.of_section("area"),
            bending=bending,
            bow=bow,
        )


@dataclass(frozen=True, eq=False)
class Answer:
    """What members answer to displacements."""

    forces: np.ndarray  #: (M, 2 d) of the nodes on the members, in global axes [N, Nm]
    natural: np.ndarray  #: (M, r) forces that belong to the natural deformations
    too_far: bool  #: an end turned too far against its chord; the other values are not to be used


@dataclass(frozen=True, eq=False)
class Response(Answer):
    """The same with its derivatives."""

    tangents: np.ndarray | None  #: (M, 2 d, 2 d) derivative of the forces
    strained: np.ndarray  #: (M, 2 d) derivative of the forces by a factor on the initial strain
    stiffness: np.ndarray  #: (M, r, r) derivative of the natural forces by the natural deformations
    slope: (
        np.ndarray
    )  #: (M, r, 9) derivative of those by the chord and the turns of both ends, or (M, 1, 3) by the chord

    def foresee(self, step: np.ndarray) -> np.ndarray:
        """Return the (M, r) natural forces after small displacements (M, 2 d) of the ends, by the derivatives here."""
        width = step.shape[1] // 2
        chord = step[:, width : width + 3] - step[:, :3]
        ways = chord if width == 3 else np.concatenate([chord, step[:, 3:6], step[:, 9:]], axis=1)
        return self.natural + _times(self.stiffness, _times(self.slope, ways))


def answer(members: Members, moves: np.ndarray, turns: np.ndarray, strain: np.ndarray, factor: float) -> Answer:
    """Return the forces of the members alone, which takes a tenth of the time of `respond`; parameters as there."""
    if members.bending.shape[1] == 1:
        return respond(members, moves, turns, strain, factor)
    natural, forces = np.empty((len(members.ends), 6)), np.empty((len(members.ends), 12))
    shape = members.ends, members.chords, members.axes, members.axial, members.bending, members.bow
    least = beam_forces(*shape, _SERIES, moves, turns, factor * strain, natural, forces)
    return Answer(forces, natural, bool(least < FARTHEST_TURN))


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
    """Return forces and tangents of the members.

    Parameters
    ----------
    members : Members
    moves : (V, 3) array
        Displacements of the nodes [m].
    turns : (V, 3, 3) array
        Rotations of the nodes; not read of a pinned structure.
    strain : (M,) array
        Strain that needs no force.
    factor : float
        By which it is there.
    foreseen : (M, r) array, optional
        Natural forces for the tangents, in place of those of the displacements. On the way to equilibrium displacements stretch stiff
        members far; forces that follow from the step before spoil no tangent (Magisano, Leonetti and Garcea 2017).
    tangents : bool
        Whether they are wanted.
    """
    start, end = members.ends.T
    moved = moves[end] - moves[start]
    chord = members.chords + moved
    length = np.linalg.norm(chord, axis=1)
    along = chord / length[:, None]
    # (l - L) from l^2 - L^2, which keeps the digits of small strains
    longer = (moved * (2 * members.chords + moved)).sum(axis=1) / (length + members.lengths)
    plane = (np.eye(3) - along[:, :, None] * along[:, None, :]) / length[:, None, None]
    if members.bending.shape[1] == 1:
        return _bars(members, longer, along, plane, strain, factor, foreseen)
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
    derivatives = None
    if tangents:
        derivatives = np.empty((len(length), 12, 12))
        ratios = np.array([each.ratio for each in ends])
        beam_tangents(within, slope, known, np.array([first, second]), ratios, along, length, derivatives)
    back = slope.transpose(0, 2, 1)
    return Response(
        forces=_times(back, answers)[:, _ENDS] * _SIGNS,
        tangents=derivatives,
        natural=answers,
        strained=_times(back, -(stiff[:, 0] * strain)[:, None] * share)[:, _ENDS] * _SIGNS,
        stiffness=within,
        slope=slope,
        too_far=bool(min(each.cosine.min() for each in ends) < FARTHEST_TURN),
    )


def _bars(
    members: Members,
    longer: np.ndarray,
    along: np.ndarray,
    plane: np.ndarray,
    strain: np.ndarray,
    factor: float,
    foreseen: np.ndarray | None,
) -> Response:
    """Return what members answer that carry axial forces only."""
    force = members.axial * (longer / members.lengths - factor * strain)
    known = force if foreseen is None else foreseen[:, 0]
    stiff = (members.axial / members.lengths)[:, None, None]
    block = stiff * along[:, :, None] * along[:, None, :] + known[:, None, None] * plane
    both = np.concatenate([-along, along], axis=1)
    return Response(
        forces=force[:, None] * both,
        tangents=np.tile(block, (1, 2, 2)) * np.kron([[1, -1], [-1, 1]], np.ones((3, 3))),
        natural=force[:, None],
        strained=-(members.axial * strain)[:, None] * both,
        stiffness=stiff,
        slope=along[:, None, :],
        too_far=False,
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
