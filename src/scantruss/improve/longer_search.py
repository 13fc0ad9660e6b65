"""A longer search of a grid that passes, in turns: each leaves alone the places where one before it went wrong."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..check.distances import distances_to_grid
from ..errors import CertificateError
from .candidate import Candidate, grid_of, judged
from .fit import fitted
from .optimize import searched_again
from .perturbation import LONGER, Spared
from .working_mesh import at_rest

if TYPE_CHECKING:
    from ..boundary.find import Boundary
    from ..check.certify import Judged
    from ..constraints.find import Constraints
    from ..grid.grid import Grid
    from ..settings import Settings
    from ..surface.samples import SurfaceSamples

LEAST_EVENED = 0.001  # fall of `unevenness` that is worth another grid
FAR_UNEVENNESS = 0.1  # share of the distance of the scan at 99 % [member lengths] that counts as uneven
MISSED_MORE = 0.002  # share of the scan that the grid of a longer search may miss beyond that of a shorter one
LEAST_FARTHER = 0.05  # by how much farther from the grid than before a place of the scan is lost [member lengths]
# distance from a fault, and from a place that was lost, within which no later turn begins [member lengths]
SPARED_AT_FAULT, SPARED_AT_LOSS = 3.0, 1.5
LEAST_OF_WORST = 0.8  # shape quality of the worst triangle that is left at least, in that of before
FAR_PLACES = 0.95  # share of the places of the scan that are nearer to the grid than one that counts as lost

_NOWHERE = np.empty((0, 3))


class Turns(NamedTuple):
    """How often a grid is searched again."""

    free: int  #: turns of which each goes on from the one before, if that passes
    sparing: int  #: turns after these, which go on from grids only that could be taken
    farther: float = 0.0  #: by how much farther at 95 and 99 % the scan may be from a grid taken [member lengths]


def search_on(
    candidate: Candidate,
    samples: SurfaceSamples,
    boundary: Boundary,
    constraints: Constraints,
    settings: Settings,
    usual: Judged,
    turns: Turns,
    number: int = 0,
) -> None:
    """Search a grid that passes again and again, and take the most even one that is as near to the scan and as regular as the usual one.

    A turn that ends in a fault is taken back, and the places where it went wrong are spared from then on. Most of them are tips, limbs and
    clefts about a member wide, which hold up all the rest. Where a spared place fails again, as its nodes still settle, they stay where
    they are. After the free turns it is searched on from the grid taken; those that end farther off or poorer are taken back, too.

    usual : the grid that it has to be no worse than
    number : of this search, each of which makes other random moves
    """
    mesh, first, begun, least = candidate.mesh, candidate.judged, grid_of(candidate), usual.checked_grid
    assert first is not None
    off, faulty, lost, held = _distances_off(begun, samples), _NOWHERE, _NOWHERE, _NOWHERE
    start = taken = last = mesh.copied()
    farther = turns.farther * mesh.length
    most = unevenness(begun, mesh.length) - LEAST_EVENED if is_no_worse(begun, least, farther) else np.inf
    for turn in range(turns.free + turns.sparing):
        is_free = turn < turns.free
        if turn == turns.free:
            mesh.restore(taken)
            last = taken
        spared = Spared(faulty, SPARED_AT_FAULT * mesh.length), Spared(lost, SPARED_AT_LOSS * mesh.length)
        chance = number * (turns.free + turns.sparing) + (0 if is_free else turn - turns.free + 1)
        with at_rest(mesh.net, ~Spared(held, spared[0].reach).away(mesh.net.nodes)):
            grid = searched_again(
                mesh, candidate.front, samples, constraints, candidate.settings, LONGER, spared, chance
            )
        if candidate.fit is not None:
            grid, _ = fitted(mesh, candidate.front, samples, constraints, candidate.settings, candidate.fit)
        now = judged(grid, samples, boundary, settings)
        grid, passes = now.checked_grid, now.certificate.passed
        is_near = passes and is_as_near(grid, least, farther)
        is_fit, uneven = is_near and _is_no_poorer(now, first), unevenness(grid, mesh.length)
        if is_fit and uneven < most and is_no_worse(grid, least, farther):
            candidate.take(now)
            most, taken = uneven, mesh.copied()
        if is_fit or (passes and is_free):
            last = mesh.copied()
            continue
        mesh.restore(last)
        wrong = [place for fault in now.certificate.faults for place in (fault.where, *fault.also) if place]
        if wrong:
            places = np.array(wrong) - samples.origin
            held = np.concatenate([held, places[~spared[0].away(places)]])
            faulty = np.concatenate([faulty, places])
        elif passes and not is_near:
            away = _distances_off(grid, samples)
            is_lost = (away > off + LEAST_FARTHER) & (away > np.quantile(off, FAR_PLACES))
            lost = np.concatenate([lost, _places(samples)[is_lost]])
    mesh.restore(taken)
    if candidate.judged is not first:
        try:
            candidate.end()
        except CertificateError:  # nothing but the whole certificate tells
            candidate.judged, candidate.grid = first, begun
            mesh.restore(start)


def _is_no_poorer(now: Judged, first: Judged) -> bool:
    """Whether a grid has no more warnings than the first one and hardly a worse triangle."""
    as_few = len(now.certificate.warnings) <= len(first.certificate.warnings)
    return as_few and now.grid.quality.shape_min >= LEAST_OF_WORST * first.grid.quality.shape_min


def unevenness(grid: Grid, length: float) -> float:
    """Return the variation of the lengths, and a share of the distance of the scan from a grid at 99 %: of grids as even the nearer."""
    found = grid.certificate
    away = found.scan_distance.p99 / length if found is not None and found.scan_distance is not None else 0.0
    return grid.quality.length_cv + FAR_UNEVENNESS * float(away)


def is_as_near(grid: Grid, other: Grid, farther: float = 0.0) -> bool:
    """Whether a grid is no more than so much `farther` from the scan than another [scan unit], and reaches as much of it."""
    one, two = grid.certificate, other.certificate
    if one is None or two is None or one.scan_distance is None or two.scan_distance is None:
        return True
    return (
        one.scan_distance.p95 <= two.scan_distance.p95 + farther
        and one.scan_distance.p99 <= two.scan_distance.p99 + farther
        and one.missing <= two.missing + MISSED_MORE
    )


def is_no_worse(grid: Grid, other: Grid, farther: float = 0.0) -> bool:
    """Whether a grid is as even, as regular and as near to the scan as another (`is_as_near`)."""
    as_even = grid.quality.length_cv <= other.quality.length_cv
    return as_even and grid.quality.shape_mean >= other.quality.shape_mean and is_as_near(grid, other, farther)


def _places(samples: SurfaceSamples) -> np.ndarray:
    """Return the samples of the scan itself (K, 3)."""
    return samples.surface.mean[: samples.measured][samples.kept[: samples.measured]]


def _distances_off(grid: Grid, samples: SurfaceSamples) -> np.ndarray:
    """Return how far `_places` lie off a grid (K,) [member lengths]."""
    length = samples.surface.length
    local = samples.surface.field[: samples.measured][samples.kept[: samples.measured]]
    return distances_to_grid(_places(samples), grid, length)[0] / (length * local)
