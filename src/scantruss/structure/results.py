"""What load cases and combinations do to a structure: displacements, reactions, forces along members and stresses."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..errors import InputError
from .frame import BEND_Y1, BEND_Z1, LENGTHEN, TWIST
from .truss import Truss

STATIONS_OF_MEMBER = 9  #: places along a member, both ends included, at which forces are given
#: columns of the forces in a member: N, Vy, Vz, T, My, Mz
AXIAL_FORCE, SHEAR_Y, SHEAR_Z, TORSION, MOMENT_Y, MOMENT_Z = range(6)


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
        """(M, STATIONS_OF_MEMBER, 6) forces along the members: N, Vy, Vz, T, My, Mz in local axes on the face towards the end [N, Nm]."""
        share = np.linspace(0.0, 1.0, STATIONS_OF_MEMBER)
        length, line = self.truss.lengths[:, None], self.line[:, None, :]
        start, end = self.natural[:, None, [BEND_Y1, BEND_Z1]], self.natural[:, None, [BEND_Y1 + 1, BEND_Z1 + 1]]
        made = np.empty((len(self.natural), STATIONS_OF_MEMBER, 6))
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
