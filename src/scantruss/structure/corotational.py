"""Members under large displacements: forces and tangents of co-rotational beams and bars.

A member deforms as in `frame`, by its lengthening, its twist and the turns of its ends against the chord, however far it has moved
and turned in space (Crisfield 1990; Krenk, Non-linear Modeling and Analysis of Solids and Structures, 5.3). Its energy is

    E A L e^2 / 2 + q K q / 2,    e = (l - L) / L + q G q / 2 - initial strain,

with K the stiffness against twist and bending, and G the mean shortening by bending (Oran 1973), so that an axial force bends and
stiffens as it does in linear buckling. Forces are the gradient of the energy, and the tangent its second derivative, both by the
positions of the nodes and by rotation vectors on top of their turns: the tangent is symmetric, also away from equilibrium.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..kernels.structure.members import beam_forces, beam_tangents
from .frame import BEND_Y1, BEND_Z1, BOW, LENGTHEN, inner_turns, natural_stiffness
from .truss import Truss

SERIES_TERMS = 24  #: of the series of an angle over its sine
FARTHEST_TURN = 0.5  #: cosine of the turn of an end against the chord beyond which an element is too coarse: 60 degrees
_SERIES = np.cumprod([1.0, *(n / (2 * n + 1) for n in range(1, SERIES_TERMS))])  # of powers of 1 - cosine


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
    if members.bending.shape[1] == 1:
        return _bars(members, moves, strain, factor, foreseen)
    count = len(members.ends)
    derivatives = np.empty((count if tangents else 0, 12, 12))
    made = Response(
        natural=np.empty((count, 6)),
        forces=np.empty((count, 12)),
        strained=np.empty((count, 12)),
        stiffness=np.empty((count, 6, 6)),
        slope=np.empty((count, 6, 9)),
        tangents=derivatives if tangents else None,
        too_far=False,
    )
    shape = members.ends, members.chords, members.axes, members.axial, members.bending, members.bow
    known = np.empty((0, 6)) if foreseen is None else foreseen
    filled = made.natural, made.forces, made.strained, made.stiffness, made.slope, derivatives
    least = beam_tangents(*shape, _SERIES, moves, turns, strain, float(factor), known, *filled)
    return replace(made, too_far=bool(least < FARTHEST_TURN))


def _bars(
    members: Members, moves: np.ndarray, strain: np.ndarray, factor: float, foreseen: np.ndarray | None
) -> Response:
    """Return what members answer that carry axial forces only."""
    start, end = members.ends.T
    moved = moves[end] - moves[start]
    chord = members.chords + moved
    length = np.linalg.norm(chord, axis=1)
    along = chord / length[:, None]
    # (l - L) from l^2 - L^2, which keeps the digits of small strains
    longer = (moved * (2 * members.chords + moved)).sum(axis=1) / (length + members.lengths)
    plane = (np.eye(3) - along[:, :, None] * along[:, None, :]) / length[:, None, None]
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


def _times(matrices: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    made: np.ndarray = (matrices @ vectors[:, :, None])[:, :, 0]
    return made
