"""The last step: every node comes down on the scanned surface itself, not on the smoother one that it was moved over."""

from __future__ import annotations

import numpy as np

from ...runtime.jit import kernel
from ..geometry.vectors import Vector, along, dot, fill_row, norm, row, subtract
from ..surface.folds import fit_fold, onto_crest
from ..surface.local_surface import Surface, fit_patch, onto_patch, patch_normal
from .grid import INTERIOR, Net

LIKE = 1.08  # a wider patch serves as well when the points lie as near to it, but for this factor
SETTLED = 0.03  # a node that has come down by less has found its patch, in lengths
EQUAL_PATCH_RATIO = 0.85  # patches of radii nearer to each other are as good as one
LINED = 0.75  # points less spread than this (1 in a disc, 0 on a line) lie on few scan lines
CREST_REACH = 0.4  # samples that tell where the crest of a fold is [member lengths]
TERMS = 6.0  # of a quadric: so many points it passes through
FEWEST_FOR_WIDE_PATCH = (
    24  # a patch of fewer points, as there are at a boundary, has an edge that their noise moves too much
)


@kernel
def _away(patch: np.ndarray, taken: int) -> float:
    """Mean distance of the points of a surface from a patch fitted to so many: that of the points, and what the patch used up of it."""
    return float(patch[17] * np.sqrt(taken / max(taken - TERMS, 1.0)))


@kernel
def _fit_widest(
    fine: Surface, middle: Surface, broad: Surface, patch: np.ndarray, narrow: np.ndarray, sample: int, place: Vector
) -> int:
    """Fit the widest of three patches to which the points lie as near as to the narrowest: least noise without rounding off.

    Points along one scan line tell nothing of the surface beside it, and a few too little: such a patch is too narrow, however near
    they lie.
    """
    taken = fit_patch(fine, patch, sample, place)
    fill_row(narrow, patch)
    least = _away(patch, taken)
    kept = patch.copy()
    for turn in range(2):
        if turn == 0 and middle.patch_radius > EQUAL_PATCH_RATIO * broad.patch_radius:
            continue
        more = fit_patch(middle if turn == 0 else broad, patch, sample, place)
        too_narrow = kept[18] < LINED or taken < FEWEST_FOR_WIDE_PATCH
        away = _away(patch, more)
        if more < 4 or (away > LIKE * least and not too_narrow):
            fill_row(patch, kept)
            break
        if too_narrow:
            least = away
        taken = more
        fill_row(kept, patch)
    return taken


@kernel
def project_nodes(
    net: Net,
    fine: Surface,
    middle: Surface,
    broad: Surface,
    patches: np.ndarray,
    fixed: np.ndarray,
    deviation: np.ndarray,
    folds: float,
    begin: int,
    end: int,
) -> None:
    """Move each node to its foot on the surface of the nearest points; nodes of a boundary only along the normal.

    Parameters
    ----------
    fine, middle, broad : Surface
        The same scan with narrow patches, which follow it, and with wider ones, which average its noise.
    patches : (C, PATCH), scratch; column 15 is the sample near each node
    fixed : (C,) bool, nodes that stay where they are
    deviation : (C,), filled with the distance of each node from the narrow patch fitted at its place or close by [scan unit]
    folds : weight of folds; nodes go to their crests where there is any
    begin, end : the nodes from `begin` to `end` - 1
    """
    narrow = np.empty(patches.shape[1])
    for v in range(begin, end):
        if net.degree[v] == 0:
            continue
        local, stayed = broad.length * net.desired[v], False
        for _ in range(2):
            place = row(net.nodes, v)
            taken = _fit_widest(fine, middle, broad, patches[v], narrow, int(patches[v, 15]), place)
            if taken < 4:
                break
            foot = onto_patch(patches[v], place)
            if net.kind[v] != INTERIOR:
                normal = patch_normal(patches[v], foot)
                foot = along(place, dot(subtract(foot, place), normal), normal)
            if fixed[v] or norm(subtract(foot, place)) > 0.6 * local:
                break
            net.nodes[v, 0], net.nodes[v, 1], net.nodes[v, 2] = foot
            if norm(subtract(foot, place)) < SETTLED * local:
                stayed = True
                break
        if folds > 0.0 and net.kind[v] == INTERIOR and not fixed[v]:
            patches[v, 0], patches[v, 1], patches[v, 2] = row(net.nodes, v)
            fit_fold(broad, patches[v], CREST_REACH, 1.0)
            net.nodes[v, 0], net.nodes[v, 1], net.nodes[v, 2] = onto_crest(broad, patches[v], row(net.nodes, v))
        place = row(net.nodes, v)
        if not stayed:
            fit_patch(fine, narrow, int(patches[v, 15]), place)
        deviation[v] = norm(subtract(place, onto_patch(narrow, place)))
