"""Forces of co-rotational beams, member by member: what `structure.corotational` says, without tangents."""

from __future__ import annotations

import numpy as np

from ...runtime.jit import kernel
from ..geometry.vectors import Vector, cross, dot, put_vector, row

NATURAL = 6  # deformations of a member: lengthening, twist, both ends about y, both ends about z


@kernel
def beam_forces(
    ends: np.ndarray,
    chords: np.ndarray,
    axes: np.ndarray,
    axial: np.ndarray,
    bending: np.ndarray,
    bow: np.ndarray,
    series: np.ndarray,
    moves: np.ndarray,
    turns: np.ndarray,
    strain: np.ndarray,
    natural: np.ndarray,
    forces: np.ndarray,
) -> float:
    """Fill the natural forces (M, 6) and the forces of the nodes on the members (M, 12); returns the least cosine of an end's turn.

    ends : (M, 2) int64; chords : (M, 3); axes : (M, 3, 3), rows; axial : (M,) E A; bending, bow : (M, 6, 6)
    series : (K,) coefficients of an angle over its sine, by powers of 1 - cosine
    moves : (V, 3); turns : (V, 3, 3); strain : (M,) that needs no force
    """
    least = 1.0
    deformed, answers, shares = np.empty(NATURAL), np.empty(NATURAL), np.empty(NATURAL)
    slopes = np.zeros((NATURAL, 3, 3))  # of each deformation by the chord and the turns of both ends
    frames = np.empty((2, 3, 3))
    for m in range(len(ends)):
        moved = row(moves, ends[m, 1]), row(moves, ends[m, 0])
        change = moved[0][0] - moved[1][0], moved[0][1] - moved[1][1], moved[0][2] - moved[1][2]
        before = row(chords, m)
        chord = before[0] + change[0], before[1] + change[1], before[2] + change[2]
        first, length = np.sqrt(dot(before, before)), np.sqrt(dot(chord, chord))
        along = chord[0] / length, chord[1] / length, chord[2] / length
        both = before[0] + chord[0], before[1] + chord[1], before[2] + chord[2]
        deformed[0] = dot(change, both) / (length + first)
        put_vector(slopes[0, 0], 0, along)
        for end in range(2):
            _turn(axes[m], turns[ends[m, end]], frames[end])
            cosine = _bend(frames[end], along, length, series, end, deformed, slopes)
            least = min(least, cosine)
        _twist(frames, deformed, slopes)
        _answer(bending[m], bow[m], axial[m], first, strain[m], deformed, shares, answers)
        for k in range(NATURAL):
            natural[m, k] = answers[k]
        _gather(slopes, answers, forces[m])
    return least


@kernel
def _turn(axes: np.ndarray, turn: np.ndarray, frame: np.ndarray) -> None:
    """Fill the local axes (3, 3) of an end that has turned."""
    for i in range(3):
        for k in range(3):
            frame[i, k] = axes[i, 0] * turn[k, 0] + axes[i, 1] * turn[k, 1] + axes[i, 2] * turn[k, 2]


@kernel
def _bend(
    frame: np.ndarray,
    along: Vector,
    length: float,
    series: np.ndarray,
    end: int,
    deformed: np.ndarray,
    slopes: np.ndarray,
) -> float:
    """Fill the turns of an end against the chord about y and z, with their slopes; returns the cosine."""
    axis = row(frame, 0)
    cosine = dot(axis, along)
    gap = 1.0 - cosine
    ratio, more = 0.0, 0.0  # angle over its sine, and its derivative by the gap
    for k in range(len(series) - 1, -1, -1):
        more = more * gap + ratio
        ratio = ratio * gap + series[k]
    turned = cross(axis, along)
    for number in range(2):
        sign = 1.0 - 2.0 * number
        other = row(frame, 2 - number)
        across = sign * other[0], sign * other[1], sign * other[2]
        sine = dot(across, along)
        moved = cross(across, along)
        k = 2 + 2 * number + end
        deformed[k] = ratio * sine
        for c in range(3):
            slopes[k, 0, c] = ratio * (across[c] - sine * along[c]) / length
            slopes[k, 0, c] -= more * sine * (axis[c] - cosine * along[c]) / length
            slopes[k, 1 + end, c] = ratio * moved[c] - more * sine * turned[c]
    return cosine


@kernel
def _twist(frames: np.ndarray, deformed: np.ndarray, slopes: np.ndarray) -> None:
    """Fill the twist between both ends, with its slopes."""
    one, other = (row(frames[0], 1), row(frames[0], 2)), (row(frames[1], 1), row(frames[1], 2))
    deformed[1] = (dot(one[1], other[0]) - dot(one[0], other[1])) / 2
    a, b = cross(one[1], other[0]), cross(one[0], other[1])
    for c in range(3):
        slopes[1, 1, c] = (a[c] - b[c]) / 2
        slopes[1, 2, c] = -slopes[1, 1, c]


@kernel
def _answer(
    bending: np.ndarray,
    bow: np.ndarray,
    axial: float,
    length: float,
    strain: float,
    deformed: np.ndarray,
    shares: np.ndarray,
    answers: np.ndarray,
) -> None:
    """Fill the natural forces: those of bending, and the axial force times the share of each deformation in the strain."""
    bowed = 0.0
    for i in range(NATURAL):
        shares[i] = answers[i] = 0.0
        for k in range(NATURAL):
            shares[i] += bow[i, k] * deformed[k]
            answers[i] += bending[i, k] * deformed[k]
        bowed += shares[i] * deformed[i] / 2
    shares[0] = 1.0 / length
    force = axial * (deformed[0] / length + bowed - strain)
    for i in range(NATURAL):
        answers[i] += force * length * shares[i]


@kernel
def _gather(slopes: np.ndarray, answers: np.ndarray, forces: np.ndarray) -> None:
    """Fill the forces and moments at both ends (12,) of natural forces."""
    for c in range(3):
        chord, start, end = 0.0, 0.0, 0.0
        for k in range(NATURAL):
            chord += slopes[k, 0, c] * answers[k]
            start += slopes[k, 1, c] * answers[k]
            end += slopes[k, 2, c] * answers[k]
        forces[c], forces[3 + c], forces[6 + c], forces[9 + c] = -chord, start, chord, end
