"""What looks odd in what was given: which way is up, supports, and combinations of a file."""

from __future__ import annotations

import numpy as np

from ..grid.certificate import near
from ..grid.grid import Grid
from ..grid.upward import OPEN_SHELL, facing_of, guessed_up
from .options import StructureSettings, units_taken
from .truss import Truss

#: share of the surface that faces one way on the mean; ratio of its parts along x or y and along z: it may lie on its side
ONE_WAY_SHARE, SIDEWAYS_RATIO = 0.6, 2.0
MANY_HELD = 0.8  #: share of the nodes of a structure from which supports are odd


def support_words(truss: Truss) -> str:
    """Return how many nodes are supported, and how high they lie."""
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
    """Return warnings of a structure on its side, of supports that hold most of it, and of combinations that leave out something."""
    warnings = [*_sideways(truss), *_weightless(truss)]
    held, used = _held(truss), np.unique(truss.members)
    if len(held) > MANY_HELD * len(used):
        warnings.append(
            f"{len(held):,} of {len(used):,} nodes are supported; heights of supports are in metres, or with a unit: lowest:50mm"
        )
    states = {each.state for each in truss.combinations}
    if truss.cases and truss.combinations and states != {"ULS", "SLS"}:
        missing = (
            "SLS, so displacements are those of single cases"
            if "SLS" not in states
            else "ULS, so members are checked for single cases"
        )
        warnings.append(
            f"the combinations that were given have none of {missing}; those of EN 1990 are not added to them"
        )
    return warnings


def certificate_words(grid: Grid) -> list[str]:
    """Return the faults and warnings of the certificate of a grid, of which a structure is made all the same."""
    found = grid.certificate
    if found is None:
        return []
    faults = [f"the grid FAILED its certificate: it {fault.words}{near(fault.where)}" for fault in found.faults]
    return [*faults, *(f"the grid {warning.words}{near(warning.where)}" for warning in found.warnings)]


def doubts_of_settings(settings: StructureSettings, grid: Grid) -> list[str]:
    """Return warnings of what was taken for granted of the loads, and of which way is up."""
    words = [str(load.get("load", "")) if isinstance(load, dict) else str(load) for load in settings.loads]
    notes = units_taken(settings.loads)
    if any(word.startswith("wind:") and ":" not in word[5:] for word in words):
        notes += ["wind without a coefficient presses with 1.0 everywhere; give one, as in wind:0.8kN/m2:-0.7"]
    return [*notes, *_lying(grid)]


def _lying(grid: Grid) -> list[str]:
    """Return a warning where pictures of a closed grid, as of a sculpture with y up, show another axis up than that of weight."""
    up = guessed_up(grid)
    if not up or np.linalg.norm(facing_of(grid.nodes, grid.triangles)) > OPEN_SHELL:  # which `_sideways` judges
        return []
    return [
        f"weight acts along -z, and pictures of the structure have z up; pictures of the grid show {up} up, as its shape tells:"
        f" where {up} is up in the file, turn the scan first, as scantruss studio does"
    ]


def _sideways(truss: Truss) -> list[str]:
    """Return a warning where the surface faces x or y, as that of a roof whose file has y up."""
    areas = truss.triangle_areas
    facing = np.abs(areas.sum(axis=0))
    axis = int(facing[:2].argmax())
    if (
        np.linalg.norm(facing) < ONE_WAY_SHARE * np.linalg.norm(areas, axis=1).sum()
        or facing[axis] <= SIDEWAYS_RATIO * facing[2]
    ):
        return []
    name = "xy"[axis]
    return [
        f"the surface faces {name} and weight acts along z; where {name} is up in the file, turn the scan first, so that z is"
    ]


def _weightless(truss: Truss) -> list[str]:
    """Return a warning where loads are given and none is the weight of the members."""
    if not truss.cases or any(case.self_weight for case in truss.cases):
        return []
    return ["the weight of the members is not among the loads; self adds it, as in --loads self,snow:1kN/m2"]


def _held(truss: Truss) -> np.ndarray:
    """Return the nodes that are held in some direction."""
    return np.flatnonzero((truss.supports > 0).any(axis=1))
