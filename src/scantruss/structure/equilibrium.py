"""Equilibrium of a structure in its displaced state: what forces leave, and the factored tangent."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_matrix
from scipy.spatial.transform import Rotation

from .corotational import Answer, Members, Response, answer, respond
from .frame import LENGTHEN, freedoms, member_freedoms
from .mechanism import softest_motion
from .statics import SINGULAR_EIGENVALUE, Factored, dead_loads
from .substructures import Factor, SingularError, Substructures
from .truss import LoadCase


@dataclass(frozen=True, eq=False)
class LoadedState:
    """Where the nodes are, at a load factor."""

    moves: np.ndarray  #: (V, 3) [m]
    turns: np.ndarray  #: (V, 3, 3) rotations
    factor: float

    @property
    def displacements(self) -> np.ndarray:
        """(V, 6) displacements and rotation vectors [m, rad]."""
        return np.concatenate([self.moves, Rotation.from_matrix(self.turns).as_rotvec()], axis=1)


@dataclass(frozen=True, eq=False)
class Tangent:
    """The factored tangent of a state."""

    matrix: csc_matrix  #: of the free displacements, scaled
    factor: Factor
    root: np.ndarray  #: (F,) by which displacements are scaled

    @property
    def negative(self) -> int:
        """Negative pivots: as many as ways in which the state is not stable."""
        return self.factor.negative

    def solve(self, loads: np.ndarray) -> np.ndarray:
        """Return the (F,) or (F, C) displacements of loads."""
        root = self.root if loads.ndim == 1 else self.root[:, None]
        found: np.ndarray = self.factor.solve(loads / root) / root
        return found

    @property
    def smallest(self) -> float:
        """The eigenvalue nearest to nil, below it where the state is not stable."""
        value = abs(softest_motion(self.matrix, self.factor)[0])
        return -value if self.negative else value


class Equilibrium:
    """A structure under one load that grows in proportion.

    Loads keep their directions. Those along members act as forces and moments on their nodes, as on the straight member.
    """

    def __init__(self, factored: Factored, case: LoadCase) -> None:
        truss = factored.truss
        self.truss, self.members, self.rows = truss, Members.of(truss), member_freedoms(truss)
        self.free, self.root, self.width = factored.free, factored.root, freedoms(truss)
        self.count = len(truss.nodes) * self.width
        self.loads, self.held = dead_loads(truss, case)
        self.strain = np.zeros(len(truss.members))
        if case.temperature is not None:
            self.strain += truss.material.alpha * case.temperature
        if case.strain is not None:
            self.strain += case.strain
        self.settled = np.zeros_like(truss.nodes) if case.settlement is None else np.nan_to_num(case.settlement)
        self.springs = np.where(np.isinf(truss.supports), 0.0, truss.supports)
        arm = np.repeat([1.0, float(np.median(truss.lengths))], 3)[: self.width]
        self.arms = np.tile(arm, len(truss.nodes))  # which make lengths of turns
        self.weights = self.arms[self.free]
        number = np.full(self.count, -1)
        number[self.free] = np.arange(len(self.free))
        inner = number[self.rows]
        count = len(self.free)
        kept = (inner[:, None, :] >= 0) & (inner[:, :, None] >= 0)
        keys = (inner[:, None, :] * count + inner[:, :, None])[kept]  # by columns
        diagonal = np.arange(count) * (count + 1)
        found, place = np.unique(np.concatenate([keys, diagonal]), return_inverse=True)
        self._diagonal = place[len(keys) :]
        self._place = np.full(
            kept.shape, len(found)
        )  # of each value of the members' tangents; those of supports come last
        self._place[kept] = place[: len(keys)]
        column, self._row = np.divmod(found, count)
        self._first = np.searchsorted(column, np.arange(count + 1))
        self._scale = 1 / (self.root[self._row] * self.root[column])
        self._parts = Substructures.of(self._matrix(self._scale), factored.first)

    def start(self) -> LoadedState:
        """Return the state without loads."""
        return LoadedState(np.zeros_like(self.truss.nodes), np.tile(np.eye(3), (len(self.truss.nodes), 1, 1)), 0.0)

    def moved(self, state: LoadedState, step: np.ndarray, more: float) -> LoadedState:
        """Return the state after free displacements (F,) and a change of the load factor."""
        every = np.zeros(self.count)
        every[self.free] = step
        each = every.reshape(-1, self.width)
        turns = state.turns
        if self.width == 6:
            turns = Rotation.from_rotvec(each[:, 3:]).as_matrix() @ turns
            turns = 1.5 * turns - 0.5 * turns @ turns.transpose(0, 2, 1) @ turns  # as round-off does not let them be
        return LoadedState(state.moves + each[:, :3] + more * self.settled, turns, state.factor + more)

    def answer(self, state: LoadedState) -> Answer:
        """Return the forces of the members alone."""
        return answer(self.members, state.moves, state.turns, self.strain, state.factor)

    def respond(self, state: LoadedState, *, foreseen: np.ndarray | None = None, tangents: bool = False) -> Response:
        """Return what the members answer, with its derivatives."""
        given = self.members, state.moves, state.turns, self.strain, state.factor
        return respond(*given, foreseen=foreseen, tangents=tangents)

    def foresee(self, response: Response, step: np.ndarray) -> np.ndarray:
        """Return the (M, r) natural forces after a step (F,) from a response, by its derivatives."""
        every = np.zeros(self.count)
        every[self.free] = step
        return response.foresee(every[self.rows])

    def unbalanced(self, state: LoadedState, response: Answer) -> np.ndarray:
        """Return the loads less the forces of members and springs, on all displacements; at supports less the reactions."""
        made = state.factor * self.loads - self._sum(response.forces)
        return made - self._of_springs(state)

    def reactions(self, state: LoadedState, response: Answer) -> np.ndarray:
        """Return the (V, 6) reactions of held supports and springs [N, Nm]."""
        made = np.zeros(self.count)
        held = np.setdiff1d(np.arange(self.count), self.free)
        made[held] = -self.unbalanced(state, response)[held]
        made -= self._of_springs(state)
        return np.pad(made.reshape(-1, self.width), ((0, 0), (0, 6 - self.width)))

    def error(self, state: LoadedState, response: Answer, unbalanced: np.ndarray) -> float:
        """Return what is unbalanced on free displacements, over the size of loads, reactions and forces; moments count over an arm."""
        left = np.square(unbalanced / self.arms)
        free = float(left[self.free].sum())
        others = float(left.sum()) - free, float(np.square(state.factor * self.loads / self.arms).sum())
        size = max(math.sqrt(max(*others, 0.0)), float(np.abs(response.natural[:, LENGTHEN]).max()))
        return math.sqrt(free) / size if size else 0.0

    def tangent(self, response: Response) -> Tangent:
        """Return the factored tangent of a response with tangents."""
        assert response.tangents is not None
        values = np.bincount(self._place.ravel(), response.tangents.ravel(), len(self._row) + 1)[:-1]
        values[self._diagonal] += self.springs[:, : self.width].ravel()[self.free]
        matrix = self._matrix(values * self._scale)
        try:
            factor = self._parts.factor(matrix)
        except SingularError:  # take the next matrix
            shifted = matrix.data.copy()
            shifted[self._diagonal] += SINGULAR_EIGENVALUE / 10
            factor = self._parts.factor(self._matrix(shifted))
        return Tangent(matrix, factor, self.root)

    def _matrix(self, values: np.ndarray) -> csc_matrix:
        """Return the matrix of the free displacements with these values."""
        return csc_matrix((values, self._row, self._first), shape=(len(self.free),) * 2)

    def direction(self, response: Response) -> np.ndarray:
        """Return the (F,) forces by which the load factor moves the state: loads, strain and settlement, for 1."""
        made = self.loads - self._sum(response.strained)
        if self.settled.any():
            assert response.tangents is not None
            settled = np.pad(self.settled, ((0, 0), (0, self.width - 3))).ravel()[self.rows]
            made -= self._sum(np.einsum("mij,mj->mi", response.tangents, settled))
        return made[self.free]

    def _of_springs(self, state: LoadedState) -> np.ndarray:
        """Return the forces of the nodes on spring supports, on all displacements."""
        if not self.springs.any():
            return np.zeros(self.count)
        return (self.springs * state.displacements)[:, : self.width].ravel()

    def _sum(self, forces: np.ndarray) -> np.ndarray:
        """Return the sums on all displacements of forces on the ends of the members."""
        return np.bincount(self.rows.ravel(), forces.ravel(), self.count)
