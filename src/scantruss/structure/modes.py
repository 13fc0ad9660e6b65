"""Linear buckling and natural frequencies: the eigenmodes of a structure.

Both are the largest eigenvalues of A x = mu K x, with the factored stiffness K: A is the mass, or less the geometric stiffness.
Modes of shells lie close together, so the largest is found roughly, and K - A / mu factored a little before it: there they lie far apart.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import csc_matrix, diags
from scipy.sparse.linalg import LinearOperator, eigsh

from ..errors import InputError
from .frame import BEND_Y1, BEND_Z1, BOW, LENGTHEN, assemble, freedoms, inner_turns, member_freedoms, transforms
from .lanczos import largest_eigenpairs
from .mechanism import product
from .results import CaseResult, Solution
from .statics import Factored
from .substructures import Factor, SingularError, factor_by_parts
from .truss import GRAVITY, Truss

FEW_FREEDOMS = 200  #: up to which all modes are found at once by dense matrices
SEVERAL_LEADING = 3  #: combinations of which buckling is looked at, with different leading actions
ROUGH_RESIDUAL, EXACT_RESIDUAL = 3e-2, 1e-9  #: what is left of an eigenvector, for the first estimate and in the end
#: shares of the first value about which the others are looked for, until none lies before
MODE_SHIFTS = (0.97, 0.8, 0.5)
NEGLIGIBLE_EIGENVALUE = 1e-9  #: share of the largest eigenvalue below which one is nil


@dataclass(frozen=True, eq=False)
class Modes:
    """Eigenvalues and shapes of a structure."""

    values: np.ndarray  #: (K,) load factors, or frequencies [Hz], smallest first
    shapes: np.ndarray  #: (K, V, 3) displacements of the nodes, the greatest of each mode 1
    of: str  #: name of the load case or combination; "" of vibration


def buckling_modes(factored: Factored, result: CaseResult, count: int) -> Modes:
    """Return the smallest positive factors of a load case at which the structure buckles, by linear theory.

    The geometric stiffness is the consistent one (Przemieniecki, Theory of Matrix Structural Analysis, 15.2), with springs at the ends
    condensed as in `frame`. Members that are long enough for half waves need nodes within them: here a member is one element, so that
    the buckling of single members is left to the check of EN 1993-1-1 6.3.1.

    Raises
    ------
    InputError
        `count` is not a positive number.
    """
    truss = factored.truss
    matrices = _geometric(truss, result.natural[:, LENGTHEN])
    geometric = assemble(member_freedoms(truss), matrices, factored.stiffness.shape[0])
    values, shapes = _largest(factored, -geometric, count)
    return Modes(1 / values, shapes, result.name)


def vibration_modes(factored: Factored, count: int) -> Modes:
    """Return the lowest natural frequencies; masses are lumped at the nodes and those of the permanent loads.

    Raises
    ------
    InputError
        `count` is not a positive number.
    """
    truss = factored.truss
    mass = np.zeros((len(truss.nodes), freedoms(truss)))
    mass[:, :3] = node_masses(truss)[:, None]
    values, shapes = _largest(factored, diags(mass.ravel()).tocsc(), count)
    return Modes(1 / (2 * math.pi * np.sqrt(values)), shapes, "")


def node_masses(truss: Truss) -> np.ndarray:
    """Return the (V,) masses that the permanent loads mean, or the members alone where there are none [kg]."""
    mass = np.zeros(len(truss.nodes))
    permanent = [case for case in truss.cases if case.action == "permanent"]
    share = sum(case.self_weight for case in permanent)
    members = truss.member_mass * (share or float(not permanent))
    for case in permanent:
        if case.line is not None:
            members = members + np.maximum(-case.line[:, 2], 0.0) * truss.lengths / GRAVITY
        if case.nodal is not None:
            mass += np.maximum(-case.nodal[:, 2], 0.0) / GRAVITY
    for end in truss.members.T:
        np.add.at(mass, end, members / 2)
    return mass


def worst_buckling(factored: Factored, solution: Solution, count: int) -> Modes:
    """Return the modes of the combination that buckles first.

    Looked at are the ULS combinations with the greatest compression, at most `SEVERAL_LEADING` with different leading actions; all
    load cases where there are no combinations.
    """
    permanent = {case.name for case in factored.truss.cases if case.action == "permanent"}
    leading = {
        each.name: next((name for name, _ in each.factors if name not in permanent), "")
        for each in factored.truss.combinations
    }
    chosen: dict[str, tuple[float, CaseResult]] = {}
    every = list(solution.all_results())
    for result in [each for each in every if each.state == "ULS"] or every:
        pressed = float((np.maximum(-result.natural[:, LENGTHEN], 0.0) * factored.truss.lengths).sum())
        lead = leading.get(result.name, result.name)
        if lead not in chosen or pressed > chosen[lead][0]:
            chosen[lead] = pressed, result
    most = sorted(chosen.values(), key=lambda pair: -pair[0])[:SEVERAL_LEADING]
    found = [buckling_modes(factored, result, count) for _, result in most]
    return min(found, key=lambda modes: float(modes.values.min(initial=math.inf)))


def _geometric(truss: Truss, axial: np.ndarray) -> np.ndarray:
    """Return the (M, 2 d, 2 d) geometric stiffness of members with axial forces, tension positive."""
    length, axes = truss.lengths, truss.axes
    count = freedoms(truss)
    across = np.zeros((len(length), 2, 2 * count))
    across[:, :, :3], across[:, :, count : count + 3] = -axes[:, 1:], axes[:, 1:]
    made = (axial / length)[:, None, None] * (across.transpose(0, 2, 1) @ across)
    if truss.pinned:
        return made
    change, inner = transforms(truss), inner_turns(truss)
    for axis, row in enumerate((BEND_Y1, BEND_Z1)):
        turns = inner[:, axis] @ change[:, row : row + 2]
        weight = (axial * length)[:, None, None] * BOW
        made += turns.transpose(0, 2, 1) @ weight @ turns
    return made


def _of_many(part: csc_matrix, stiff: csc_matrix, factored: Factored, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return `count` largest eigenvalues of `part` x = mu `stiff` x (K,) with their vectors (F, K), or one that is not positive."""
    factor = factored.factor
    assert factor is not None
    first, vectors = _of_factor(part, stiff, factor, 1, ROUGH_RESIDUAL)
    usual = np.random.default_rng(1).standard_normal(stiff.shape[0])
    made = factor.solve(part @ usual)
    if first[0] ** 2 * product(usual, usual) <= NEGLIGIBLE_EIGENVALUE**2 * product(made, made) or first[0] < 0:
        return first, vectors
    for share in MODE_SHIFTS:
        shift = share / float(first[0])
        matrix = (stiff - shift * part).tocsc()
        try:
            moved = factor_by_parts(matrix, factored.first)
        except SingularError:  # an eigenvalue lies there
            continue
        if moved.negative == 0:  # none lies before
            near = largest_eigenpairs(moved, stiff, stiff, count, EXACT_RESIDUAL)
            if near is not None:
                return (near[0] - 1) / (shift * near[0]), near[1]  # near: factors over what they are beyond the shift
    return _of_factor(part, stiff, factor, count, EXACT_RESIDUAL)


def _of_factor(
    part: csc_matrix, stiff: csc_matrix, factor: Factor, count: int, tolerance: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return `count` largest eigenpairs of the factored matrix alone, by ARPACK where they lie too close together."""
    found = largest_eigenpairs(factor, part, stiff, count, tolerance, block=min(count, 2))
    if found is None:
        start = np.random.default_rng(1).standard_normal(stiff.shape[0])
        solver = LinearOperator(stiff.shape, matvec=factor.solve, dtype=float)
        found = eigsh(part, k=count, M=stiff, Minv=solver, which="LA", tol=tolerance, v0=start)
    return found


def _largest(factored: Factored, matrix: csc_matrix, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the largest positive eigenvalues of `matrix` x = mu K x, largest first, and (K, V, 3) shapes."""
    if not isinstance(count, int) or count < 1:
        raise InputError(f"the number of modes must be 1 or more, got {count!r}")
    free, root = factored.free, factored.root
    nodes, width = len(factored.truss.nodes), freedoms(factored.truss)
    scale = diags(1 / root)
    part = (scale @ matrix[free][:, free] @ scale).tocsc()
    if factored.factor is None or not np.any(part.data):
        return np.zeros(0), np.zeros((0, nodes, 3))
    stiff = factored.scaled
    if len(free) <= max(FEW_FREEDOMS, 3 * count):
        values, vectors = eigh(part.toarray(), stiff.toarray())
    else:
        values, vectors = _of_many(part, stiff, factored, count)
    order = [k for k in np.argsort(-values)[:count] if values[k] > NEGLIGIBLE_EIGENVALUE * np.abs(values).max()]
    shapes = np.zeros((len(order), nodes, 3))
    for number, k in enumerate(order):
        moves = np.zeros(nodes * width)
        moves[free] = vectors[:, k] / root
        shapes[number] = moves.reshape(nodes, width)[:, :3]
        most = shapes[number].flat[np.abs(shapes[number]).argmax()]
        shapes[number] /= most if most else 1.0  # a mode of turns alone moves no node
    return values[order], shapes
