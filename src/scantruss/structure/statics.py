"""Linear statics: all load cases by one factorization, and what follows from the displacements."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.sparse import csc_matrix, diags, identity

from ..errors import InputError
from .frame import (
    BEND_Y1,
    BEND_Z1,
    LENGTHEN,
    TWIST,
    fixed_end_forces,
    freedoms,
    member_freedoms,
    natural_stiffness,
    stiffness_matrix,
    transforms,
)
from .mechanism import product, refuse_mechanism, softest_motion
from .ordering import dissected
from .substructures import Factor, SingularError, factor_by_parts
from .truss import GRAVITY, LoadCase, Truss

SINGULAR = 1e-12  #: smallest eigenvalue of the stiffness, its diagonal scaled to 1, at which a structure is a mechanism
NEARLY_SINGULAR = 10 * SINGULAR  #: below which it is looked at again
STIFF = 1e-8  #: smallest eigenvalue that is no mechanism, whatever it is exactly
REFINED = 1e-11  #: share of the greatest load that a solution may leave
UNSOLVED = 1e-3  #: share of a load that a factor leaves where it is none
STATIONS = 9  #: places along a member, both ends included, at which forces are given
AXIAL_FORCE, SHEAR_Y, SHEAR_Z, TORSION, MOMENT_Y, MOMENT_Z = range(
    6
)  #: columns of the forces in a member: N, Vy, Vz, T, My, Mz


@dataclass(frozen=True, eq=False)
class CaseResult:
    """What a load case or a combination does to a structure [m, rad, N, Nm]."""

    name: str
    state: str  #: "case", ULS or SLS
    truss: Truss
    displacements: np.ndarray  #: (V, 6) along and about x, y, z; the turns of a pinned structure are 0
    reactions: np.ndarray  #: (V, 6) of supports on the structure
    natural: np.ndarray  #: (M, 6) axial force, twisting moment, end moments about y and z that nodes exert on members
    line: np.ndarray  #: (M, 3) loads along the members, in local axes [N/m]
    nodal: np.ndarray  #: (V, 6) loads on the nodes

    def __repr__(self) -> str:
        """Say what it is of, and the greatest displacement and forces."""
        low, high = self.axial.min() / 1e3, self.axial.max() / 1e3
        moved = f"moves {1e3 * self.displacement_max:.3g} mm"
        return f"CaseResult({self.name!r}, {moved}, axial forces {low:.4g} to {high:.4g} kN)"

    @property
    def applied(self) -> np.ndarray:
        """(3,) sum of all loads [N]."""
        return self.nodal[:, :3].sum(axis=0) + self._line_forces.sum(axis=0)

    @property
    def reaction(self) -> np.ndarray:
        """(3,) sum of all reactions [N]."""
        return self.reactions[:, :3].sum(axis=0)

    @property
    def equilibrium_error(self) -> float:
        """What forces and moments of loads and reactions leave, over the sum of their sizes (moments: times the size of the structure)."""
        nodes = self.truss.nodes - self.truss.nodes.mean(axis=0)
        middles = nodes[self.truss.members].mean(axis=1)
        line = self._line_forces
        forces = self.nodal[:, :3] + self.reactions[:, :3]
        moments = np.cross(nodes, forces) + self.nodal[:, 3:] + self.reactions[:, 3:]
        left = forces.sum(axis=0) + line.sum(axis=0)
        turning = moments.sum(axis=0) + np.cross(middles, line).sum(axis=0)
        size = np.abs(self.nodal[:, :3]).sum() + np.abs(line).sum() + np.abs(self.reactions[:, :3]).sum()
        reach = float(np.abs(nodes).max())
        size += (np.abs(self.nodal[:, 3:]).sum() + np.abs(self.reactions[:, 3:]).sum()) / reach
        return float(max(np.abs(left).max(), np.abs(turning).max() / reach) / size) if size else 0.0

    @property
    def _line_forces(self) -> np.ndarray:
        """(M, 3) resultants of the loads along the members, in global axes [N]."""
        return np.einsum("mij,mi->mj", self.truss.axes, self.line) * self.truss.lengths[:, None]

    @cached_property
    def along(self) -> np.ndarray:
        """(M, STATIONS, 6) forces along the members: N, Vy, Vz, T, My, Mz in local axes on the face towards the end [N, Nm]."""
        share = np.linspace(0.0, 1.0, STATIONS)
        length, line = self.truss.lengths[:, None], self.line[:, None, :]
        start, end = self.natural[:, None, [BEND_Y1, BEND_Z1]], self.natural[:, None, [BEND_Y1 + 1, BEND_Z1 + 1]]
        made = np.empty((len(self.natural), STATIONS, 6))
        slope, sag = length * (1 - 2 * share) / 2, length**2 * share * (1 - share) / 2
        made[:, :, AXIAL_FORCE] = self.natural[:, LENGTHEN, None] + line[:, :, 0] * slope
        made[:, :, SHEAR_Y] = -(start + end)[:, :, 1] / length + line[:, :, 1] * slope
        made[:, :, SHEAR_Z] = (start + end)[:, :, 0] / length + line[:, :, 2] * slope
        made[:, :, TORSION] = self.natural[:, TWIST, None]
        made[:, :, MOMENT_Y] = -start[:, :, 0] * (1 - share) + end[:, :, 0] * share + line[:, :, 2] * sag
        made[:, :, MOMENT_Z] = -start[:, :, 1] * (1 - share) + end[:, :, 1] * share - line[:, :, 1] * sag
        return made

    @cached_property
    def greatest(self) -> np.ndarray:
        """(M, 6) sizes of the greatest Vy, Vz, T, My, Mz along each member, the extremes within it included; first that of N [N, Nm]."""
        made = np.abs(self.along).max(axis=1)
        length = self.truss.lengths
        for column, shear, load in (
            (MOMENT_Y, SHEAR_Z, self.line[:, 2]),
            (MOMENT_Z, SHEAR_Y, -self.line[:, 1]),
        ):  # where the shear is nil
            first = self.along[:, 0, shear] if shear == SHEAR_Z else -self.along[:, 0, shear]
            place = np.divide(
                first, load, out=np.zeros_like(first), where=np.abs(load) * length > 1e-12 * np.abs(first)
            )
            place = np.clip(place, 0.0, length)
            moment = self.along[:, 0, column] + first * place - load * place**2 / 2
            made[:, column] = np.maximum(made[:, column], np.abs(moment))
        return made

    @cached_property
    def axial(self) -> np.ndarray:
        """(M, 2) smallest and greatest axial force of each member, tension positive [N]."""
        change = self.line[:, 0] * self.truss.lengths / 2  # linear along a member, so that its ends have the extremes
        middle = self.natural[:, LENGTHEN]
        return np.stack([middle - np.abs(change), middle + np.abs(change)], axis=1)

    @property
    def stresses(self) -> np.ndarray:
        """(M, 2) axial stress of the greatest size, and the greatest bending stress [Pa]."""
        of = self.truss.of_section
        low, high = self.axial.T
        axial = np.where(-low > high, low, high) / of("area")
        bending = self.greatest[:, MOMENT_Y] / of("elastic_y") + self.greatest[:, MOMENT_Z] / of("elastic_z")
        if (round_ := np.array([s.shape == "CHS" for s in self.truss.sections])[self.truss.section_of]).any():
            both = np.hypot(self.greatest[:, MOMENT_Y], self.greatest[:, MOMENT_Z]) / of("elastic_y")
            bending = np.where(round_, both, bending)
        return np.stack([axial, bending], axis=1)

    @property
    def displacement_max(self) -> float:
        """Greatest displacement of a node [m]."""
        return float(np.linalg.norm(self.displacements[:, :3], axis=1).max())


@dataclass(frozen=True, eq=False)
class Solution:
    """The results of all load cases of a structure."""

    truss: Truss
    cases: tuple[CaseResult, ...]

    def __repr__(self) -> str:
        """Name the structure and its load cases."""
        return f"Solution({self.truss!r}: {', '.join(case.name for case in self.cases)})"

    def __getitem__(self, name: str) -> CaseResult:
        """Return the result of a load case or combination by name."""
        for case in self.cases:
            if case.name == name:
                return case
        for combination in self.truss.combinations:
            if combination.name == name:
                return self._combined(combination.name, combination.state, combination.factors)
        raise InputError(f"no load case or combination {name!r}; there are {', '.join(c.name for c in self.cases)}")

    def all_results(self) -> Iterator[CaseResult]:
        """Yield the results of the load cases, then of the combinations."""
        yield from self.cases
        for combination in self.truss.combinations:
            yield self._combined(combination.name, combination.state, combination.factors)

    def judged_results(self) -> list[CaseResult]:
        """Return the results of the ULS combinations, or of all load cases where there are none."""
        return [each for each in self.all_results() if each.state == "ULS"] or list(self.cases)

    def _combined(self, name: str, state: str, factors: tuple[tuple[str, float], ...]) -> CaseResult:
        by_name = {case.name: case for case in self.cases}
        if missing := [case for case, _ in factors if case not in by_name]:
            raise InputError(
                f"the combination {name!r} names no load case {missing[0]!r}; there are {', '.join(by_name)}"
            )
        sums = [
            sum((factor * getattr(by_name[case], part) for case, factor in factors), np.zeros(1))
            for part in ("displacements", "reactions", "natural", "line", "nodal")
        ]
        return CaseResult(name, state, self.truss, *sums)


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
        """Return the (F, C) free displacements of loads, refined once where they leave more than `REFINED` of the greatest load."""
        if self.factor is None:
            return loads
        root = self.root[:, None]
        found = self.factor.solve(loads / root)
        left = loads - root * (self.scaled @ found)
        rough = np.abs(left).max(axis=0) > REFINED * np.abs(loads).max(axis=0)
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
    value, motion = (0.0, made.root) if factor is None else softest_motion(made.scaled, factor, STIFF)
    if value < NEARLY_SINGULAR:  # the factor of a matrix that is nearly singular is not to be trusted
        shifted = (made.scaled + SINGULAR / 10 * identity(len(made.free))).tocsc()
        value, motion = softest_motion(made.scaled, factor_by_parts(shifted, made.first))
    if factor is None or value < SINGULAR:
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
    return factor if product(left, left) < UNSOLVED**2 * product(loads, loads) else None  # not a number is not less


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
        Its stiffness, where it has been factored already.

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
