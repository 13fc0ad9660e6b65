"""Mechanisms: the motion against which a structure has no stiffness, and its words."""

from __future__ import annotations

import math
from typing import NoReturn

import numpy as np
from scipy.sparse import csc_matrix

from ..errors import InputError
from ..kernels.geometry.components import component_labels
from .substructures import Factor
from .truss import Truss

MOST_NAMED = 4  #: nodes of a mechanism that are named
INVERSE_STEPS = 6  #: of inverse iteration, which converges in two where an eigenvalue is nil


def softest_motion(stiffness: csc_matrix, factor: Factor, stiff: float = math.inf) -> tuple[float, np.ndarray]:
    """Return the smallest eigenvalue of a stiffness matrix, or one little above it, with its motion: inverse iteration.

    Parameters
    ----------
    stiffness : (F, F) sparse matrix
        Symmetric, not negative, diagonal 1.
    factor : Factor
        Of that matrix, or of one shifted a little.
    stiff : float
        Eigenvalue that matters no more: once all are seen to be larger the value is only some larger one.
    """
    motion = np.random.default_rng(1).standard_normal(stiffness.shape[0])
    for step in range(INVERSE_STEPS):
        motion /= math.sqrt(product(motion, motion))
        found = factor.solve(motion)
        if step > 0 and product(found, found) < 1 / stiff**2:  # the first step has brought a nil motion forward
            motion = found
            break
        if not np.isfinite(found).all() or not found.any():
            break
        motion = found
    motion /= math.sqrt(product(motion, motion))
    return product(motion, stiffness @ motion), motion


def product(one: np.ndarray, other: np.ndarray) -> float:
    """Return the scalar product of two long vectors; BLAS would wake threads for it, which wait for each other on a busy machine."""
    return float((one * other).sum())


def refuse_mechanism(truss: Truss, motion: np.ndarray) -> NoReturn:
    """Say which nodes move and how.

    Parameters
    ----------
    truss : Truss
    motion : (V, 3) or (V, 6) array
        A motion without stiffness, of any size.

    Raises
    ------
    InputError
        Always.
    """
    alone = np.setdiff1d(np.arange(len(truss.nodes)), truss.members)
    if len(alone):
        raise InputError(f"a mechanism: no member holds the node {truss.node_marks[alone[0]]}; remove it from the grid")
    piece = component_labels(len(truss.nodes), *truss.members.T)
    loose = np.setdiff1d(piece, piece[truss.supports.any(axis=1)])
    if len(loose):
        more = int((piece == loose[0]).sum()) - 1
        raise InputError(
            f"a mechanism: the piece of the node {truss.node_marks[loose[0]]} and {more:,} more has no support; support it too"
        )
    length = float(np.median(truss.lengths))
    moves = np.linalg.norm(motion[:, :3], axis=1)
    turns = length * np.linalg.norm(motion[:, 3:], axis=1)
    if moves.max() > 1e-6 * max(turns.max(initial=0.0), 1e-300) and _is_rigid(truss.nodes, motion[:, :3]):
        held = truss.supports[:, :3][truss.supports.any(axis=1)] > 0
        advice = "use more supports" if held.all() else "hold more directions, as with --support-type pinned"
        raise InputError(f"a mechanism: the supports let the whole structure move; {advice}")
    sizes, part, verb = (moves, motion[:, :3], "moves along") if moves.max() >= turns.max(initial=0.0) else (
        turns, motion[:, 3:], "turns about"
    )  # fmt: skip
    first = int(sizes.argmax())
    named = [node for node in np.argsort(-sizes, kind="stable")[:MOST_NAMED] if sizes[node] > 0.1 * sizes[first]]
    vector = part[first] / np.abs(part[first]).max()
    turned = np.round(vector if vector[np.abs(vector).argmax()] > 0 else -vector, 2) + 0.0
    direction = ", ".join(f"{c:g}" for c in turned)
    names = ", ".join(truss.node_marks[node] for node in named[1:])
    more = int((sizes > 0.1 * sizes[first]).sum()) - len(named)
    others = f"; with it {names}" + (f" and {more:,} more" if more > 0 else "") if names else ""
    raise InputError(
        f"a mechanism: {truss.node_marks[first]} {verb} ({direction}) without resistance{others};"
        f" {'use --joints rigid or' if truss.pinned else 'use stiffer joints or'} more supports"
    )


def _is_rigid(nodes: np.ndarray, moves: np.ndarray) -> bool:
    """Whether displacements are those of a rigid body."""
    around = nodes - nodes.mean(axis=0)
    ways = [np.tile(axis, (len(nodes), 1)) for axis in np.eye(3)] + [np.cross(axis, around) for axis in np.eye(3)]
    basis = np.stack([way.ravel() for way in ways], axis=1)
    fitted = basis @ np.linalg.lstsq(basis, moves.ravel(), rcond=None)[0]
    return bool(np.linalg.norm(fitted - moves.ravel()) < 1e-4 * np.linalg.norm(moves))
