"""Imperfections of the shape: a buckling mode, or what the scan shows against its fair surface."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix, identity

from ..errors import InputError
from .checks import span_of
from .modes import Modes
from .quantities import LENGTH, quantity
from .truss import Truss

SPAN_OVER = 300.0  #: span over the amplitude of a mode
FAIR_RINGS = 3  #: members on the way to the nodes that a quadric is fitted to
FEWEST_IN_QUADRIC = 9  #: nodes that a quadric, of six coefficients, is fitted to
IMPERFECTIONS = "mode, mode:30mm, scan, scan:30mm or none"


@dataclass(frozen=True, eq=False)
class Imperfection:
    """How a structure differs from the one that is meant."""

    kind: str  #: mode, scan, none or given
    perfect: np.ndarray  #: (V, 3) nodes of the structure that is meant [m]
    moves: np.ndarray  #: (V, 3) what is added to them [m]

    @property
    def largest(self) -> float:
        """The greatest displacement of a node [m]."""
        return float(np.linalg.norm(self.moves, axis=1).max())

    @property
    def node(self) -> int:
        """The node of that."""
        return int(np.linalg.norm(self.moves, axis=1).argmax())


def imperfection_of(truss: Truss, wanted: str | np.ndarray, modes: Modes) -> Iterator[Imperfection]:
    """Yield the imperfections to try: a mode with both signs, any other as it is.

    Parameters
    ----------
    truss : Truss
    wanted : str or (V, 3) array
        As in `solve_path`.
    modes : Modes
        Linear buckling of the load; without one there is no imperfection of this shape.

    Raises
    ------
    InputError
        The words are not understood, or there is no surface to compare with.
    """
    if not isinstance(wanted, str):
        moves = np.asarray(wanted, float)
        if moves.shape != truss.nodes.shape or not np.isfinite(moves).all():
            raise InputError(f"an imperfection is {len(truss.nodes):,} displacements of nodes, got {moves.shape}")
        yield Imperfection("given", truss.nodes, moves)
        return
    kind, size = check_imperfection(wanted)
    if kind == "scan":
        deviation = fair_deviation(truss)
        most = float(np.linalg.norm(deviation, axis=1).max())
        scaled = deviation * (size / most if size and most else 1.0)
        yield Imperfection("scan", truss.nodes - deviation, scaled)
    elif kind == "mode" and len(modes.values):
        shape = modes.shapes[0] / np.linalg.norm(modes.shapes[0], axis=1).max(initial=1e-300)
        amplitude = span_of(truss) / SPAN_OVER if size is None else size
        for sign in (1.0, -1.0):
            yield Imperfection("mode", truss.nodes, sign * amplitude * shape)
    else:
        yield Imperfection("none", truss.nodes, np.zeros_like(truss.nodes))


def check_imperfection(wanted: str) -> tuple[str, float | None]:
    """Return the kind of an imperfection and its size, where one is given [m].

    Raises
    ------
    InputError
        The words are not understood.
    """
    kind, colon, words = wanted.partition(":")
    size = quantity(words, LENGTH, "the largest imperfection") if colon else None
    if kind not in ("mode", "scan", "none") or (kind == "none" and colon) or (size is not None and size <= 0):
        raise InputError(f"an imperfection is {IMPERFECTIONS}, got {wanted!r}")
    return kind, size


def fair_deviation(truss: Truss) -> np.ndarray:
    """Return the (V, 3) displacements of the nodes from their fair surface, along their normals [m].

    The fair surface at a node is the quadric fitted by least squares to the nodes within `FAIR_RINGS` members, in the frame of its
    normal: waves longer than about twice that many members are the shape that is meant, shorter ones deviate from it. Fixed lines and
    ridges are meant as they are: their nodes keep their places, and no quadric reaches across them.

    Raises
    ------
    InputError
        The grid has no triangles, and so no surface.
    """
    if len(truss.triangles) == 0:
        raise InputError("an imperfection of the scan needs a surface, and the grid has no triangles")
    count = len(truss.nodes)
    on_line = np.zeros(count, bool)
    for name, nodes in truss.node_sets.items():
        on_line[nodes] |= name.startswith("line:")
    one, other = truss.members.T
    ones = np.ones(2 * len(one))
    next_to = coo_matrix((ones, (np.r_[one, other], np.r_[other, one])), shape=(count, count)).tocsr()
    onwards = next_to.multiply((~on_line)[:, None]).tocsr()  # no way leads on from a line
    near = (identity(count) + next_to).tocsr()
    for _ in range(FAIR_RINGS - 1):
        near = (near + near @ onwards).tocsr()
        near.data[:] = 1.0
    near.sort_indices()
    made = np.zeros((count, 3))
    for node in np.flatnonzero(~on_line & truss.node_normals.any(axis=1)):
        made[node] = _above_quadric(truss, near, int(node)) * truss.node_normals[node]
    return made


def _above_quadric(truss: Truss, near: csr_matrix, node: int) -> float:
    """Return how far a node lies above the quadric of the nodes around it, along its normal [m]."""
    around = near.indices[near.indptr[node] : near.indptr[node + 1]]
    normal = truss.node_normals[node]
    around = around[truss.node_normals[around] @ normal > 0]  # the surface is a height there
    if len(around) < FEWEST_IN_QUADRIC:
        return 0.0
    along = np.eye(3)[np.abs(normal).argmin()]
    along = along - (along @ normal) * normal
    along /= np.linalg.norm(along)
    away = truss.nodes[around] - truss.nodes[node]
    x, y, height = away @ along, away @ np.cross(normal, along), away @ normal
    columns = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1)
    return -float(np.linalg.lstsq(columns, height, rcond=None)[0][0])
