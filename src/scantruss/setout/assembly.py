"""The order in which rings of members are put up, and what each step needs to stand.

A step adds the nodes of a ring and all members to nodes that are there. The part built so far stands by itself if no motion is without
resistance and its self-weight moves no node by more than a limit; else nodes are named that props must hold. Symmetric elimination meets
a motion without resistance as a pivot that is nil, at the node to be held, so one factorization finds nearly all. Props stay until a step
stands without any.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import identity

from ..runtime.progress import Progress
from ..structure.frame import freedoms
from ..structure.mechanism import softest_motion
from ..structure.statics import SINGULAR_EIGENVALUE, Factored, scaled_stiffness, solve
from ..structure.substructures import factor_by_parts
from ..structure.truss import LoadCase, Truss

PIVOT_SHIFT = 1e-13  # of the scaled stiffness, so that a pivot that is nil does not end the elimination
MOST_TIMES = 2.0  # most that a step that stands moves, over the moves of the whole
MOST_MOVE = (0.01, 0.1)  # least and greatest value of that limit, over the median length of members
PROPS_APART = 3.0  # members between props that are set at once
NO_NODES = np.zeros(0, np.int64)  # no nodes
LOOSE_PIVOT = 1e-9  # a smaller pivot of the scaled stiffness is one of a motion without resistance


@dataclass(frozen=True, eq=False)
class AssemblyStep:
    """One step of the assembly."""

    nodes: np.ndarray  #: those that it adds
    members: np.ndarray  #: those that it adds
    props: np.ndarray  #: nodes that must be held until more is there
    moves: float  #: greatest displacement under self-weight, props in place [m]


def assembly_steps(truss: Truss, ring: np.ndarray, progress: Progress | None = None) -> list[AssemblyStep]:
    """Return the steps by which a structure is put up.

    Parameters
    ----------
    truss : Truss
    ring : (V,) int
        The step that adds each node, from 0; -1 for nodes without members.
    progress : callable, optional
        Called with what is done, and which share of it.
    """
    added = ring[truss.members].max(axis=1)
    _, moves = _stand(_part(truss, np.arange(len(added))), NO_NODES, 0.0, give_up=True)
    least, most = (share * float(np.median(truss.lengths)) for share in MOST_MOVE)
    limit = min(max(MOST_TIMES * moves, least), most)
    props, steps = NO_NODES, []
    for number in range(int(ring.max()) + 1):
        if progress is not None:
            progress("assembly", number / (int(ring.max()) + 1))
        built = np.flatnonzero(added <= number)
        if len(built):
            part, nodes = _part(truss, built), np.unique(truss.members[built])
            placed, moves = _stand(part, NO_NODES, limit, give_up=True)
            if moves > limit or len(placed):
                placed, moves = _stand(part, np.searchsorted(nodes, props), limit)
            props = nodes[placed]
        steps.append(
            AssemblyStep(
                np.flatnonzero(ring == number), np.flatnonzero(added == number), props, moves if len(built) else 0.0
            )
        )
    return steps


def _part(truss: Truss, members: np.ndarray) -> Truss:
    """Return the structure of some members under their self-weight."""
    nodes, ends = np.unique(truss.members[members], return_inverse=True)
    return truss.replace(
        nodes=truss.nodes[nodes],
        members=ends.reshape(-1, 2),
        triangles=np.zeros((0, 3), np.int64),
        node_normals=truss.node_normals[nodes],
        member_normals=truss.member_normals[members],
        section_of=truss.section_of[members],
        supports=truss.supports[nodes],
        end_stiffness=truss.end_stiffness[members],
        cases=(LoadCase("self", "permanent", 1.0),),
        combinations=(),
        node_sets={},
        node_marks=tuple(truss.node_marks[k] for k in nodes.tolist()),
        member_marks=tuple(truss.member_marks[k] for k in members.tolist()),
    )


def _stand(part: Truss, props: np.ndarray, limit: float, *, give_up: bool = False) -> tuple[np.ndarray, float]:
    """Return the nodes that need props, those given among them, and how much the part then moves under its self-weight [m].

    `give_up`: return once it is known that it does not stand as it is, with an infinite motion.
    """
    propped = np.zeros(len(part.nodes), bool)
    propped[props] = True
    reach = PROPS_APART * float(np.median(part.lengths))
    holds = -1
    while True:
        held = part.supports.copy()
        held[propped, :3] = np.inf
        part = part.replace(supports=held)
        if (now := int(np.isinf(held).sum())) <= holds:  # each turn holds more than the one before, or this is the last
            return np.arange(len(part.nodes)), np.inf
        holds = now
        if not isinstance(found := _examine(part), Factored):
            moving, turning = found
            if give_up and len(moving):
                return props, np.inf
            propped[moving] = True
            held[turning, 3:] = np.inf
            part = part.replace(supports=held)
            continue
        moves = np.linalg.norm(solve(part, found).cases[0].displacements[:, :3], axis=1)
        most = float(moves.max())
        if most <= limit or give_up:
            return np.flatnonzero(propped), most
        for node in np.argsort(-moves, kind="stable")[: int((moves > limit).sum())].tolist():
            if not propped[node] and not (moves[node] < most and _near(part.nodes, node, propped, reach)):
                propped[node] = True


def _near(nodes: np.ndarray, node: int, propped: np.ndarray, reach: float) -> bool:
    """Whether a prop is near a node."""
    return bool((np.linalg.norm(nodes[propped] - nodes[node], axis=1) < reach).any())


def _examine(part: Truss) -> Factored | tuple[np.ndarray, np.ndarray]:
    """Return the factored stiffness of a part, or which nodes to hold against moving and against turning without resistance."""
    made, width = scaled_stiffness(part), freedoms(part)
    if len(made.free) == 0:
        return made
    factor = factor_by_parts((made.scaled + PIVOT_SHIFT * identity(len(made.free))).tocsc(), made.first)
    nil = made.free[np.abs(factor.pivots) < LOOSE_PIVOT]
    if (nil % width < 3).any():
        return np.unique(nil[nil % width < 3] // width), NO_NODES
    value, motion = softest_motion(made.scaled, factor)
    if value >= 10 * SINGULAR_EIGENVALUE and len(nil) == 0:
        return replace(made, factor=factor)
    everywhere = np.zeros((len(part.nodes), width))
    everywhere.ravel()[made.free] = motion / made.root
    moves, turns = (np.linalg.norm(everywhere[:, k : k + 3], axis=1) for k in (0, 3))
    if moves.max() > 1e-6 * float(turns.max()) * float(part.lengths.max()):
        return np.array([moves.argmax()]), NO_NODES
    return NO_NODES, np.array([turns.argmax()])  # a straight row of members turns about itself
