"""Forces and tangents of co-rotational beams, member by member: see `structure.corotational`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...runtime.jit import kernel
from ..geometry.vectors import Vector, cross, dot, put_vector, row

NATURAL_DEFORMATIONS = 6  # deformations of a member: lengthening, twist, both ends about y, both ends about z
MEMBER_WAYS = 9  # by which it deforms: the chord, the turns of both ends


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
    deformed, answers, shares = (
        np.empty(NATURAL_DEFORMATIONS),
        np.empty(NATURAL_DEFORMATIONS),
        np.empty(NATURAL_DEFORMATIONS),
    )
    slopes = np.zeros((NATURAL_DEFORMATIONS, 3, 3))  # of each deformation by the chord and the turns of both ends
    frames, ratios = np.empty((2, 3, 3)), np.empty((2, 3))
    for m in range(len(ends)):
        chord = _deform(ends[m], row(chords, m), axes[m], series, moves, turns, frames, ratios, deformed, slopes)
        least = min(least, chord.cosine)
        _answer(bending[m], bow[m], axial[m], chord.first, strain[m], deformed, shares, answers)
        for k in range(NATURAL_DEFORMATIONS):
            natural[m, k] = answers[k]
        _gather(slopes, answers, forces[m])
    return least


@kernel
def beam_tangents(
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
    factor: float,
    foreseen: np.ndarray,
    natural: np.ndarray,
    forces: np.ndarray,
    strained: np.ndarray,
    stiffness: np.ndarray,
    slope: np.ndarray,
    tangents: np.ndarray,
) -> float:
    """Fill what `beam_forces` does with its derivatives; returns the least cosine of an end's turn.

    strain is there `factor` times; what is not said here is as there
    foreseen : (M, 6) natural forces for the tangents, or none: those that are found
    strained : (M, 12) derivatives of the forces by the factor; stiffness : (M, 6, 6) of the natural forces by the deformations
    slope : (M, 6, 9) of these by the chord and the turns of both ends
    tangents : (M, 12, 12) of the forces by displacements and turns of both ends; none if they are not wanted
    """
    least = 1.0
    deformed, answers, shares = (
        np.empty(NATURAL_DEFORMATIONS),
        np.empty(NATURAL_DEFORMATIONS),
        np.empty(NATURAL_DEFORMATIONS),
    )
    slopes = np.zeros((NATURAL_DEFORMATIONS, 3, 3))
    frames, ratios, by_ways = np.empty((2, 3, 3)), np.empty((2, 3)), np.empty((MEMBER_WAYS, MEMBER_WAYS))
    for m in range(len(ends)):
        chord = _deform(ends[m], row(chords, m), axes[m], series, moves, turns, frames, ratios, deformed, slopes)
        least = min(least, chord.cosine)
        _answer(bending[m], bow[m], axial[m], chord.first, factor * strain[m], deformed, shares, answers)
        for k in range(NATURAL_DEFORMATIONS):
            natural[m, k] = answers[k]
            for way in range(MEMBER_WAYS):
                slope[m, k, way] = slopes[k, way // 3, way % 3]
        _gather(slopes, answers, forces[m])
        for k in range(NATURAL_DEFORMATIONS):
            answers[k] = -axial[m] * chord.first * strain[m] * shares[k]
        _gather(slopes, answers, strained[m])
        known = foreseen[m] if len(foreseen) else natural[m]
        for i in range(NATURAL_DEFORMATIONS):
            for k in range(NATURAL_DEFORMATIONS):
                stiffness[m, i, k] = bending[m, i, k] + known[0] * chord.first * bow[m, i, k]
                stiffness[m, i, k] += axial[m] * chord.first * shares[i] * shares[k]
        if len(tangents):
            _add_stiffness(stiffness[m], slope[m], by_ways)
            _add_turned(known[0], chord.along, chord.length, by_ways)
            _add_twisted(frames[0], frames[1], known[1], by_ways)
            for end in range(2):
                moments = known[2 + end], known[4 + end]
                _add_bent(frames[end], moments, ratios[end], chord.along, chord.length, 3 + 3 * end, by_ways)
            _spread(by_ways, tangents[m])
    return least


class Chord(NamedTuple):
    """The straight line between the ends of a member."""

    cosine: float  # the least of an end's turn against the chord
    first: float  # length without loads
    length: float
    along: Vector


@kernel
def _deform(
    ends: np.ndarray,
    before: Vector,
    axes: np.ndarray,
    series: np.ndarray,
    moves: np.ndarray,
    turns: np.ndarray,
    frames: np.ndarray,
    ratios: np.ndarray,
    deformed: np.ndarray,
    slopes: np.ndarray,
) -> Chord:
    """Fill the axes of both ends, the deformations with their slopes, and of each angle over its sine the derivatives by the cosine."""
    moved = row(moves, ends[1]), row(moves, ends[0])
    change = moved[0][0] - moved[1][0], moved[0][1] - moved[1][1], moved[0][2] - moved[1][2]
    chord = before[0] + change[0], before[1] + change[1], before[2] + change[2]
    first, length = np.sqrt(dot(before, before)), np.sqrt(dot(chord, chord))
    along = chord[0] / length, chord[1] / length, chord[2] / length
    both = before[0] + chord[0], before[1] + chord[1], before[2] + chord[2]
    deformed[0] = dot(change, both) / (length + first)
    put_vector(slopes[0, 0], along)
    least = 1.0
    for end in range(2):
        _turn(axes, turns[ends[end]], frames[end])
        least = min(least, _bend(frames[end], along, length, series, end, ratios[end], deformed, slopes))
    _twist(frames, deformed, slopes)
    return Chord(least, first, length, along)


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
    ratios: np.ndarray,
    deformed: np.ndarray,
    slopes: np.ndarray,
) -> float:
    """Fill the turns of an end against the chord about y and z, with their slopes; returns the cosine."""
    axis = row(frame, 0)
    cosine = dot(axis, along)
    gap = 1.0 - cosine
    ratio, more, most = 0.0, 0.0, 0.0  # angle over its sine, and its derivatives by the gap
    for k in range(len(series) - 1, -1, -1):
        most = most * gap + 2 * more
        more = more * gap + ratio
        ratio = ratio * gap + series[k]
    ratios[0], ratios[1], ratios[2] = ratio, -more, most
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
    for i in range(NATURAL_DEFORMATIONS):
        shares[i] = answers[i] = 0.0
        for k in range(NATURAL_DEFORMATIONS):
            shares[i] += bow[i, k] * deformed[k]
            answers[i] += bending[i, k] * deformed[k]
        bowed += shares[i] * deformed[i] / 2
    shares[0] = 1.0 / length
    force = axial * (deformed[0] / length + bowed - strain)
    for i in range(NATURAL_DEFORMATIONS):
        answers[i] += force * length * shares[i]


@kernel
def _gather(slopes: np.ndarray, answers: np.ndarray, forces: np.ndarray) -> None:
    """Fill the forces and moments at both ends (12,) of natural forces."""
    for c in range(3):
        chord, start, end = 0.0, 0.0, 0.0
        for k in range(NATURAL_DEFORMATIONS):
            chord += slopes[k, 0, c] * answers[k]
            start += slopes[k, 1, c] * answers[k]
            end += slopes[k, 2, c] * answers[k]
        forces[c], forces[3 + c], forces[6 + c], forces[9 + c] = -chord, start, chord, end


@kernel
def _add_stiffness(stiffness: np.ndarray, slope: np.ndarray, by_ways: np.ndarray) -> None:
    """Fill the derivatives (9, 9) of the forces by chord and turns that come of the stiffness: lower triangle."""
    for a in range(MEMBER_WAYS):
        for b in range(a + 1):
            by_ways[a, b] = 0.0
    for i in range(NATURAL_DEFORMATIONS):
        for b in range(MEMBER_WAYS):
            half = 0.0
            for k in range(NATURAL_DEFORMATIONS):
                half += stiffness[i, k] * slope[k, b]
            for a in range(b, MEMBER_WAYS):
                by_ways[a, b] += slope[i, a] * half


@kernel
def _add_turned(force: float, along: Vector, length: float, by_ways: np.ndarray) -> None:
    """Add the second derivatives of the length, times the axial force, by the chord: lower triangle."""
    for i in range(3):
        for j in range(i + 1):
            by_ways[i, j] += force * ((1.0 if i == j else 0.0) - along[i] * along[j]) / length


@kernel
def _add_twisted(first: np.ndarray, second: np.ndarray, moment: float, by_ways: np.ndarray) -> None:
    """Add the second derivatives of the twist, times its moment, by the turns of both ends: lower triangle."""
    one, other = dot(row(first, 2), row(second, 1)), dot(row(first, 1), row(second, 2))
    for i in range(3):
        for j in range(3):
            same = (1.0 if i == j else 0.0) * (one - other)
            outer = first[2, i] * second[1, j] - first[1, i] * second[2, j]
            back = first[2, j] * second[1, i] - first[1, j] * second[2, i]
            by_ways[6 + i, 3 + j] += moment / 2 * (same - outer)
            if j <= i:
                by_ways[3 + i, 3 + j] += moment / 2 * ((outer + back) / 2 - same)
                by_ways[6 + i, 6 + j] += moment / 2 * ((outer + back) / 2 - same)


@kernel
def _add_bent(
    frame: np.ndarray,
    moments: tuple[float, float],
    ratio: np.ndarray,
    along: Vector,
    length: float,
    turn: int,
    by_ways: np.ndarray,
) -> None:
    """Add the second derivatives of the angles of an end, times the moments, by the chord and by its turn: lower triangle."""
    axis = row(frame, 0)
    y, z = row(frame, 1), row(frame, 2)
    across = (
        moments[0] * z[0] - moments[1] * y[0],
        moments[0] * z[1] - moments[1] * y[1],
        moments[0] * z[2] - moments[1] * y[2],
    )
    cosine, sine = dot(axis, along), dot(across, along)
    more, most = ratio[1], ratio[2] * sine
    turned, swung = cross(axis, along), cross(across, along)
    vector = (  # its product with the chord has the second derivatives that are left
        more * sine * axis[0] + ratio[0] * across[0],
        more * sine * axis[1] + ratio[0] * across[1],
        more * sine * axis[2] + ratio[0] * across[2],
    )
    product = dot(vector, along)
    beside = cross(along, vector)
    for i in range(3):
        cosine_i, sine_i = (axis[i] - cosine * along[i]) / length, (across[i] - sine * along[i]) / length
        for j in range(3):
            cosine_j, sine_j = (axis[j] - cosine * along[j]) / length, (across[j] - sine * along[j]) / length
            same = 1.0 if i == j else 0.0
            if j <= i:
                flat = (vector[i] - product * along[i]) * along[j] + (vector[j] - product * along[j]) * along[i]
                by_ways[i, j] += more * (cosine_i * sine_j + sine_i * cosine_j) + most * cosine_i * cosine_j
                by_ways[i, j] -= (flat + product * (same - along[i] * along[j])) / length**2
                by_ways[turn + i, turn + j] += (
                    more * (turned[i] * swung[j] + swung[i] * turned[j])
                    + most * turned[i] * turned[j]
                    + (vector[i] * along[j] + vector[j] * along[i]) / 2
                    - product * same
                )
            by_ways[turn + i, j] += (
                more * (turned[i] * sine_j + swung[i] * cosine_j)
                + most * turned[i] * cosine_j
                + along[j] * beside[i] / length
            )
            if i != j:  # of the cross product of the turn with the vector
                third = 3 - i - j
                by_ways[turn + i, j] -= (1.0 if (i - j) % 3 == 2 else -1.0) * vector[third] / length


@kernel
def _spread(by_ways: np.ndarray, tangents: np.ndarray) -> None:
    """Fill the derivatives (12, 12) by displacements and turns of both ends of those by chord and turns: the chord is a difference."""
    for i in range(12):
        for j in range(12):
            a, b = i if i < 6 else i - 6 + 3 * (i // 9), j if j < 6 else j - 6 + 3 * (j // 9)
            sign = (-1.0 if i < 3 else 1.0) * (-1.0 if j < 3 else 1.0)
            tangents[i, j] = sign * by_ways[max(a, b), min(a, b)]
