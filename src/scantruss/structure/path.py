"""What a nonlinear path is: the states of equilibrium of a structure under a growing load."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .imperfections import Imperfection
from .truss import Truss


@dataclass(frozen=True, eq=False)
class Path:
    """The equilibrium states of a structure under a load that grows from nothing; the first is without it."""

    truss: Truss  #: as it stands without loads, with its imperfection
    name: str  #: of the load case or combination
    imperfection: Imperfection
    factors: np.ndarray  #: (S,) load factors
    displacements: np.ndarray  #: (S, V, 6) displacements and rotation vectors [m, rad]
    reactions: np.ndarray  #: (S, V, 6) [N, Nm]
    axial: np.ndarray  #: (S, M) axial forces, tension positive [N]
    equilibrium_errors: np.ndarray  #: (S,) what forces leave on free nodes, over their size
    negative_pivots: np.ndarray  #: (S,) ways in which a state is not stable
    critical: int | None  #: the last stable state, where the structure loses its stability, refined
    kind: str  #: of that: limit point, bifurcation or ""
    ended: str  #: why the path ends, in words
    linear_factor: float | None  #: the linear buckling factor of the structure without imperfection

    @property
    def limit_factor(self) -> float | None:
        """The load factor at which the structure loses its stability; None where it does not on this path."""
        return None if self.critical is None else float(self.factors[self.critical])

    @property
    def node(self) -> int:
        """The node that moves most, where stability is lost or at the end."""
        at = len(self.factors) - 1 if self.critical is None else self.critical
        return int(np.linalg.norm(self.displacements[at, :, :3], axis=1).argmax())

    @property
    def moves(self) -> np.ndarray:
        """(S,) displacement of that node, along the direction it has then [m]."""
        at = len(self.factors) - 1 if self.critical is None else self.critical
        way = self.displacements[at, self.node, :3]
        made: np.ndarray = self.displacements[:, self.node, :3] @ way / max(float(np.linalg.norm(way)), 1e-300)
        return made
