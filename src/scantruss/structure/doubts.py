"""What looks odd in what was given: supports, and combinations of a file."""

from __future__ import annotations

import numpy as np

from .truss import Truss

MANY_HELD = 0.8  #: share of the nodes of a structure from which supports are odd


def support_words(truss: Truss) -> str:
    """Return how many nodes are held, and how high they lie."""
    held, used = _held(truss), np.unique(truss.members)
    z = truss.nodes[:, 2]
    low, high = (float(end) - float(z[used].min()) for end in (z[held].min(), z[held].max()))
    nodes = f"{len(held):,} node{'s' if len(held) > 1 else ''}"
    if high - low < 0.0005:
        return (
            f"supports: {nodes}, {low:.3g} m above the lowest node"
            if low >= 0.0005
            else f"supports: {nodes}, the lowest"
        )
    return f"supports: {nodes}, {low:.3g} to {high:.3g} m above the lowest node"


def doubts_of(truss: Truss) -> list[str]:
    """Return warnings of supports that hold most of a structure, and of combinations that leave out what is usually looked at."""
    said = []
    held, used = _held(truss), np.unique(truss.members)
    if len(held) > MANY_HELD * len(used):
        said.append(
            f"{len(held):,} of {len(used):,} nodes are held; heights of supports are in metres, or with a unit: lowest:50mm"
        )
    states = {each.state for each in truss.combinations}
    if truss.cases and truss.combinations and states != {"ULS", "SLS"}:
        missing = (
            "SLS, so displacements are those of single cases"
            if "SLS" not in states
            else "ULS, so members are checked for single cases"
        )
        said.append(f"the combinations that were given have none of {missing}; those of EN 1990 are not added to them")
    return said


def _held(truss: Truss) -> np.ndarray:
    """Return the nodes that are held in some direction."""
    return np.flatnonzero((truss.supports > 0).any(axis=1))
