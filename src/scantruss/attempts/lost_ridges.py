"""Folds of a scan that its grid cuts across, where members are too long for them or a ridge ends too early."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..boundary.curves import length_along
from ..check.distances import distances_to_grid
from ..check.left_out import points_together
from ..check.limits import COVER_REACH, NOISES_OFF
from ..constraints.lines_of_folds import FOLD_STRIDE, GAIN_OF_SURE, is_long_edge, is_made
from ..constraints.network import runs
from ..constraints.ridges import fold_lines
from ..errors import ScanTrussError
from ..grid.line_sets import RIDGE, sets_of
from ..surface.chosen_samples import KEPT
from ..surface.samples import sample_surface

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..grid.grid import Grid
    from ..scan.cloud import PointCloud
    from ..settings import Settings

FINER = 0.5  # member length at which the folds are looked for, in that of the grid
FEWEST_SPACINGS_OF_FINER = 4.0  # ... and at least, in spacings of the points
COARSEST_FINER = 0.8  # ... and at most, in that of the grid
# distance of points from the grid, noise aside, from which on they may be of a fold that is cut off, how far these lie apart at most, and
# the least length of a patch of them [member lengths]
OFF_AT_FOLD, APART_AT_FOLD, LONG_AT_FOLD = 0.05, 0.25, 0.7
# mean distance of a member's length of a fold from the grid from which on it is cut off: where a ridge follows it it is 0.02 at most
FOLD_OFF = 0.035  # [member lengths]
# ... from which on it is cut off however unsure, and however short the others: its points alone show it
DEEPLY_OFF = 0.25  # [member lengths]
# distance from a chain of the grid, or from a part of a ridge that is given up, within which a fold is that one [member lengths]
SAME_FOLD = 0.2
PLACES_ON_MEMBER = 6  # places on each member of a chain from which that is measured
# shortest part of a fold that is lost, and least length of all together [member lengths]
SHORTEST_LOST, LEAST_LOST = 1.0, 2.0

ClearFold = tuple[np.ndarray, bool]  # (K,) FOLD, and whether it is clearly one


def lost_ridges(
    grid: Grid, cloud: PointCloud, asked: Settings, given_up: Sequence[np.ndarray] = ()
) -> list[np.ndarray]:
    """Return the parts of folds of a scan that a grid cuts across, the longest first, each (K, 3) [scan unit].

    They are looked for at half of the member length: folds too close together, or too short, to be ridges at the whole are seen there.
    Wide folds are looked for at the whole, too. Those that are sure or were made are lost, and what is cut off deeply.

    Parameters
    ----------
    asked : Settings
        Those that were asked for; where they want no ridges, none is lost.
    given_up : parts of ridges, each (K, 3) [scan unit], that are said already
    """
    made = grid.settings or asked
    if asked.ridge_angle <= 0.0 or asked.method != "default" or made.smooth_scale:
        return []
    length = float(made.length if grid.desired is None else grid.desired.min())
    finer = max(FINER * length, FEWEST_SPACINGS_OF_FINER * cloud.spacing)
    if finer > COARSEST_FINER * length or not _may_cut_folds(grid, cloud, made, length):
        return []
    known = np.concatenate([places_on_chains(grid), *(part - cloud.origin for part in given_up)])
    found: list[np.ndarray] = []
    is_deep = False
    looked = made.replace(length_field="", ridge_angle=asked.ridge_angle, limb_girth=0.0)
    # first at the length of the grid, whose samples are still kept
    folds_at = {step: _folds(cloud, looked.replace(length=step)) for step in (length, finer)}
    for step in (finer, length):
        narrow, wide = folds_at[step]
        window = round(length / (FOLD_STRIDE * step))
        for folds, is_clear in narrow + wide if step == finer else wide:
            places = folds["place"]
            off = _distance_off(places, grid, length, window)
            cut = (off > (FOLD_OFF if is_clear else DEEPLY_OFF) * length) & _is_away(
                places, np.concatenate([known, *found]), length
            )
            for begin, end in runs(cut):
                if length_along(places[begin:end]) >= SHORTEST_LOST * length:
                    found.append(places[begin:end])
                    is_deep |= bool(np.median(off[begin:end]) > DEEPLY_OFF * length)
    found = sorted((part + cloud.origin for part in found), key=length_along, reverse=True)
    return found if is_deep or sum(map(length_along, found)) >= LEAST_LOST * length else []


def _folds(cloud: PointCloud, settings: Settings) -> tuple[list[ClearFold], list[ClearFold]]:
    """Return the narrow folds of a scan and the wide ones, each with whether it is clearly one: sure, made or long."""
    try:
        samples = sample_surface(cloud, settings)
        found = None if samples.smooth else fold_lines(samples, settings)
    except ScanTrussError:  # it carries no grid of such members, or its folds are a tangle
        found = None
    if found is None:
        return [], []
    narrow = [(folds, bool(np.median(folds["gain"]) >= GAIN_OF_SURE)) for folds in found.narrow]
    return narrow, [(folds, is_made(folds) or is_long_edge(folds)) for folds in found.wide]


def _may_cut_folds(grid: Grid, cloud: PointCloud, made: Settings, length: float) -> bool:
    """Whether points that lie off a grid are of a patch as long as the shortest part of a fold that counts."""
    samples = sample_surface(cloud, made)
    points = np.ascontiguousarray(samples.scan[(samples.judged == KEPT) & ~samples.elsewhere])
    noise = grid.certificate.noise if grid.certificate is not None else 0.0
    away = distances_to_grid(points, grid, length)[0]
    off = points[(away > OFF_AT_FOLD * length + NOISES_OFF * noise) & (away < length)]
    if not len(off):
        return False
    patch = points_together(off, np.full(len(off), APART_AT_FOLD * length))
    large = np.flatnonzero(np.bincount(patch) * cloud.spacing >= LONG_AT_FOLD * length)
    return any(np.ptp(off[patch == number], axis=0).max() >= LONG_AT_FOLD * length for number in large)


def _distance_off(places: np.ndarray, grid: Grid, length: float, window: int) -> np.ndarray:
    """Return how far each place along a fold (K, 3) lies off a grid, in the mean of so many beside each other; 0 where it is missed."""
    away = distances_to_grid(np.ascontiguousarray(places), grid, length)[0]
    around = np.ones(min(window, len(places)))
    mean = np.convolve(away, around, "same") / np.convolve(np.ones(len(places)), around, "same")
    off: np.ndarray = np.where(away < COVER_REACH * length, mean, 0.0)
    return off


def _is_away(places: np.ndarray, known: np.ndarray, length: float) -> np.ndarray:
    """Return which places along a fold (K, 3) lie away from places (M, 3) of folds that are known."""
    gaps = np.linalg.norm(places[:, None] - known, axis=2).min(axis=1, initial=np.inf)
    away: np.ndarray = gaps > SAME_FOLD * length
    return away


def places_on_chains(grid: Grid) -> np.ndarray:
    """Return places along the chains of the ridges that a grid follows (K, 3)."""
    chains = [grid.nodes[np.array(each["nodes"], np.int64)] for each in sets_of(grid, RIDGE)]
    shares = np.linspace(0.0, 1.0, PLACES_ON_MEMBER)[:, None, None]
    along = [(chain[:-1] + shares * np.diff(chain, axis=0)).reshape(-1, 3) for chain in chains]
    return np.concatenate([np.zeros((0, 3)), *along])
