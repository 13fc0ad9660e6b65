"""Linear statics: all load cases by one factorization."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csc_matrix, diags, identity

from ..errors import InputError
from .frame import fixed_end_forces, freedoms, member_freedoms, natural_stiffness, stiffness_matrix, transforms
from .mechanism import product, refuse_mechanism, softest_motion
from .ordering import dissected
from .results import CaseResult, Solution
from .substructures import Factor, SingularError, factor_by_parts
from .truss import GRAVITY, LoadCase, Truss

#: smallest eigenvalue of the stiffness, its diagonal scaled to 1, at which a structure is a mechanism
SINGULAR_EIGENVALUE = 1e-12
NEARLY_SINGULAR = 10 * SINGULAR_EIGENVALUE  #: below which it is looked at again
STIFF_EIGENVALUE = 1e-8  #: smallest eigenvalue that is no mechanism, whatever it is exactly
REFINED_RESIDUAL = 1e-11  #: share of the greatest load that a solution may leave
UNSOLVED_RESIDUAL = 1e-3  #: share of a load that a factor leaves where it is none


@dataclass(frozen=True, eq=False)
class Factored:
    """A structure with its stiffness factored: the work that all analyses share."""

    truss: Truss
    stiffness: csc_matrix  #: of all displacements, supports not yet held
    free: np.ndarray  #: (F,) numbers of the displacements that are free, as they are eliminated
    first: np.ndarray  #: (S + 1,) first of each substructure among these
    root: np.ndarray  #: (F,) square roots of the diagonal, by which it is scaled
    scaled: csc_matrix  #: stiffness of the free displacements, its diagonal 1
    factor: Factor | None  #: of that; None where all is held, or it is not factored yet

    def solve(self, loads: np.ndarray) -> np.ndarray:
        """Return the (F, C) free displacements of loads, refined once where over `REFINED_RESIDUAL` of the greatest load is left."""
        if self.factor is None:
            return loads
        root = self.root[:, None]
        found = self.factor.solve(loads / root)
        left = loads - root * (self.scaled @ found)
        rough = np.abs(left).max(axis=0) > REFINED_RESIDUAL * np.abs(loads).max(axis=0)
        if rough.any():
            found[:, rough] += self.factor.solve(left[:, rough] / root)
        return found / root


def scaled_stiffness(truss: Truss) -> Factored:
    """Return the stiffness of a structure, scaled and ready to be factored."""
    stiffness, width = stiffness_matrix(truss), freedoms(truss)
    free = np.flatnonzero(~np.isinf(truss.supports[:, :width]).ravel())
    rank, first = dissected(truss)
    rank = rank[free // width]
    order = np.argsort(rank, kind="stable")
    free, first = free[order], np.unique(np.searchsorted(rank[order], first))
    part = stiffness[free][:, free]
    diagonal = part.diagonal()
    root = np.sqrt(np.where(diagonal > 1e-14 * diagonal.max(initial=0.0), diagonal, diagonal.max(initial=0.0)))
    scale = diags(1.0 / root)
    return Factored(truss, stiffness, free, first, root, (scale @ part @ scale).tocsc(), None)


def factor_stiffness(truss: Truss) -> Factored:
    """Return the factored stiffness of a structure.

    Raises
    ------
    InputError
        There is no support, or the structure is a mechanism; the message names its nodes and their motion.
    """
    check_whole(truss)
    made = scaled_stiffness(truss)
    if len(made.free) == 0:
        return made
    factor = _factor_of(made.scaled, made.first)
    value, motion = (0.0, made.root) if factor is None else softest_motion(made.scaled, factor, STIFF_EIGENVALUE)
    if value < NEARLY_SINGULAR:  # the factor of a matrix that is nearly singular is not to be trusted
        shifted = (made.scaled + SINGULAR_EIGENVALUE / 10 * identity(len(made.free))).tocsc()
        value, motion = softest_motion(made.scaled, factor_by_parts(shifted, made.first))
    if factor is None or value < SINGULAR_EIGENVALUE:
        everywhere = np.zeros(made.stiffness.shape[0])
        everywhere[made.free] = motion / made.root
        refuse_mechanism(truss, everywhere.reshape(len(truss.nodes), -1))
    return replace(made, factor=factor)


def _factor_of(matrix: csc_matrix, first: np.ndarray) -> Factor | None:
    """Return the factor of a matrix; None where a pivot is nil, or where it does not solve."""
    try:
        factor = factor_by_parts(matrix, first)
    except SingularError:
        return None
    loads = np.random.default_rng(2).standard_normal(matrix.shape[0])
    left = matrix @ factor.solve(loads) - loads
    return (
        factor if product(left, left) < UNSOLVED_RESIDUAL**2 * product(loads, loads) else None
    )  # not a number is not less


def check_whole(truss: Truss) -> None:
    """Refuse a structure without supports or load cases that it cannot carry.

    Raises
    ------
    InputError
        There is no support; a name stands twice; a load does not suit the joints; a settlement is of a node that is not held.
    """
    if not truss.supports.any():
        raise InputError("no supports: support some nodes, as with --supports boundary")
    names = [case.name for case in truss.cases] + [combination.name for combination in truss.combinations]
    if twice := next((name for name in names if names.count(name) > 1), ""):
        raise InputError(f"two load cases or combinations are named {twice!r}; give each a name of its own")
    for case in truss.cases:
        if truss.pinned and case.nodal is not None and case.nodal[:, 3:].any():
            raise InputError(f"the load case {case.name!r} has moments on nodes, which pinned members cannot carry")
        if case.settlement is not None:
            loose = ~np.isnan(case.settlement) & ~np.isinf(truss.supports[:, :3])
            if loose.any():
                mark = truss.node_marks[np.flatnonzero(loose.any(axis=1))[0]]
                raise InputError(f"the load case {case.name!r} moves {mark}, which no support holds in that direction")


def solve(truss: Truss, factored: Factored | None = None) -> Solution:
    """Return the results of all load cases of a structure, by linear statics.

    Parameters
    ----------
    truss : Truss
        With supports and load cases.
    factored : Factored, optional
        Its stiffness, if it has been factored already.

    Raises
    ------
    InputError
        There is no support, or the structure is a mechanism; the message names its nodes and their motion.
    """
    made = factored or factor_stiffness(truss)
    count, total = freedoms(truss), made.stiffness.shape[0]
    change, rows, stiff = transforms(truss), member_freedoms(truss), natural_stiffness(truss)
    parts = [_loads(truss, case, change, rows, count, total) for case in truss.cases]
    loads = np.stack([part[0] for part in parts], axis=1)
    moved = np.stack([_settled(case, count, len(truss.nodes)) for case in truss.cases], axis=1)
    moved[made.free] = made.solve((loads - made.stiffness @ moved)[made.free])
    forces = made.stiffness @ moved - loads
    held = np.isinf(truss.supports[:, :count]).ravel()
    springs = np.where(np.isinf(truss.supports), 0.0, truss.supports)[:, :count].ravel()
    results = []
    for number, case in enumerate(truss.cases):
        ends = moved[rows, number]
        natural = np.einsum("mij,mj->mi", stiff, np.einsum("mij,mj->mi", change, ends)) + parts[number][1]
        reactions = np.where(held, forces[:, number], 0.0) - springs * moved[:, number]
        results.append(
            CaseResult(
                name=case.name,
                state="case",
                truss=truss,
                displacements=_six(moved[:, number].reshape(-1, count)),
                reactions=_six(reactions.reshape(-1, count)),
                natural=_six(natural),
                line=parts[number][2],
                nodal=np.zeros((len(truss.nodes), 6)) if case.nodal is None else case.nodal,
            )
        )
    return Solution(truss, tuple(results))


def dead_loads(truss: Truss, case: LoadCase) -> tuple[np.ndarray, np.ndarray]:
    """Return the loads of a case on all displacements, without temperature and strain, and the (M, r) forces in held members."""
    part = replace(case, temperature=None, strain=None)
    count = freedoms(truss)
    found = _loads(truss, part, transforms(truss), member_freedoms(truss), count, len(truss.nodes) * count)
    return found[:2]


def _loads(
    truss: Truss, case: LoadCase, change: np.ndarray, rows: np.ndarray, count: int, total: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the loads on all displacements, the forces in held members and the loads along the members in local axes."""
    line = np.zeros((len(truss.members), 3)) if case.line is None else case.line.copy()
    weight = truss.of_section("area") * truss.material.density * GRAVITY * case.self_weight
    line[:, 2] -= weight
    local = np.einsum("mij,mj->mi", truss.axes, line)
    held = fixed_end_forces(truss, case, local)
    ends = -np.einsum("mij,mi->mj", change, held)
    half = line * truss.lengths[:, None] / 2
    ends[:, :3] += half
    ends[:, count : count + 3] += half
    loads = np.bincount(rows.ravel(), ends.ravel(), total)
    if case.nodal is not None:
        loads += case.nodal[:, :count].ravel()
    return loads, held, local


def _settled(case: LoadCase, count: int, nodes: int) -> np.ndarray:
    """Return the displacements that a case imposes, 0 elsewhere."""
    made = np.zeros((nodes, count))
    if case.settlement is not None:
        made[:, :3] = np.nan_to_num(case.settlement)
    return made.ravel()


def _six(values: np.ndarray) -> np.ndarray:
    """Return rows of six values, zeros behind where there are fewer."""
    return np.pad(values, ((0, 0), (0, 6 - values.shape[1])))
