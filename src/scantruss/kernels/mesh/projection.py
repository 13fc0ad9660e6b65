"""Projection: in the end each node goes onto the scanned surface itself, not the smoother one over which it was moved."""

from __future__ import annotations

import numpy as np

from ...runtime.jit import kernel
from ..geometry.quadric import TERMS_OF_QUADRIC
from ..geometry.vectors import Vector, along, dot, norm, put_vector, row, subtract
from ..surface.folds import add_fold, onto_crest
from ..surface.local_surface import (
    SURFACE_PATCH,
    Surface,
    fit_patch,
    onto_patch,
    patch_normal,
)
from .grid import INTERIOR, Net

EQUALLY_NEAR = 1.08  # largest distance of the points from a wider patch that fits as well [that from the narrow one]
SMALL_MOVE = 0.03  # distance below which a projected node keeps its patch [member lengths]
EQUAL_PATCH_RATIO = 0.85  # ratio of the radii of two patches above which one of them is enough
ROUND_ENOUGH = 0.75  # least roundness of the points of a patch; below it they lie on few scan lines
CREST_REACH = 0.4  # distance up to which samples count for the crest of a fold [member lengths]
FEWEST_FOR_WIDE_PATCH = 24  # fewest points of a patch; the noise of fewer, as at a boundary, moves its edge too much
LONGEST_WAY_TO_SURFACE = 0.6  # longest way of a node to the surface [member lengths]


@kernel
def _away(patch: np.record, taken: int) -> float:
    """Mean distance of the points from a patch fitted to `taken` of them, corrected for the coefficients fitted."""
    return float(patch.mean_distance * np.sqrt(taken / max(taken - TERMS_OF_QUADRIC, 1.0)))


@kernel
def _fit_widest(
    fine: Surface,
    middle: Surface,
    broad: Surface,
    patches: np.ndarray,
    v: int,
    narrow: np.ndarray,
    kept: np.ndarray,
    place: Vector,
) -> int:
    """Fit the widest of three patches that the points fit as well as the narrowest: least noise, and nothing is rounded off.

    A patch of few points, or of points along one scan line, is too narrow however well they fit. Returns the number of points.
    patches[v] : where the search begins, replaced. narrow, kept : (1,) the narrowest, filled; scratch
    """
    sample = patches[v].sample
    taken = fit_patch(fine, patches[v], sample, place)
    narrow[0] = kept[0] = patches[v]
    least = _away(patches[v], taken)
    for turn in range(2):
        if turn == 0 and middle.patch_radius > EQUAL_PATCH_RATIO * broad.patch_radius:
            continue
        more = fit_patch(middle if turn == 0 else broad, patches[v], sample, place)
        too_narrow = kept[0].roundness < ROUND_ENOUGH or taken < FEWEST_FOR_WIDE_PATCH
        away = _away(patches[v], more)
        if more < 4 or (away > EQUALLY_NEAR * least and not too_narrow):
            patches[v] = kept[0]
            break
        if too_narrow:
            least = away
        taken = more
        kept[0] = patches[v]
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
    """Move each node to its foot on the surface of the nearest points, nodes of a boundary only along the normal.

    Parameters
    ----------
    fine, middle, broad : the same scan with narrow patches, which follow it, and with wider ones, which average out its noise
    patches : (C,) SURFACE_PATCH of the nodes, replaced
    fixed : (C,) bool, nodes that are not moved
    deviation : (C,), filled with the distance of each node from a narrow patch fitted at its place or close by [scan unit]
    folds : weight of folds; if it is positive, nodes near folds go to their crests
    begin, end : the nodes from `begin` to `end` - 1
    """
    narrow, kept = np.empty(1, SURFACE_PATCH), np.empty(1, SURFACE_PATCH)
    for v in range(begin, end):
        if net.degree[v] == 0:
            continue
        local, stayed = broad.length * net.desired[v], False
        for _ in range(2):
            place = row(net.nodes, v)
            taken = _fit_widest(fine, middle, broad, patches, v, narrow, kept, place)
            if taken < 4:
                break
            foot = onto_patch(patches[v], place)
            if net.kind[v] != INTERIOR:
                normal = patch_normal(patches[v], foot)
                foot = along(place, dot(subtract(foot, place), normal), normal)
            if fixed[v] or norm(subtract(foot, place)) > LONGEST_WAY_TO_SURFACE * local:
                break
            net.nodes[v, 0], net.nodes[v, 1], net.nodes[v, 2] = foot
            if norm(subtract(foot, place)) < SMALL_MOVE * local:
                stayed = True
                break
        if folds > 0.0 and net.kind[v] == INTERIOR and not fixed[v]:
            put_vector(patches[v].centre, row(net.nodes, v))
            add_fold(broad, patches[v], CREST_REACH, 1.0)
            net.nodes[v, 0], net.nodes[v, 1], net.nodes[v, 2] = onto_crest(broad, patches[v], row(net.nodes, v))
        place = row(net.nodes, v)
        if not stayed:
            fit_patch(fine, narrow[0], patches[v].sample, place)
        deviation[v] = norm(subtract(place, onto_patch(narrow[0], place)))
