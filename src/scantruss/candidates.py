"""Multi-start: several fronts for an attempt, and the best of their grids that passes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from .attempts import VERY_ROUGH_SCAN
from .check.certify import Judged, judge, passed_grid
from .errors import FrontError
from .front.advance import advance_front
from .front.orientation_field import Field, orientation_fields
from .improve.equalize import energy_of_node
from .improve.optimize import improve_first, improve_last, put_down, searched_again
from .improve.rings import finish_rings
from .improve.tips import find_tips, put_on_tips, suspects_apart
from .runtime.parallel import threaded_map
from .runtime.progress import Progress, WatchedProgress, seer_of
from .surface.scratch import with_own_scratch

if TYPE_CHECKING:
    from .boundary.find import Boundary
    from .constraints.find import Constraints
    from .grid.grid import Grid
    from .improve.working_mesh import WorkingMesh
    from .settings import Settings
    from .surface.samples import SurfaceSamples

FULLY_IMPROVED = {"quick": 1, "normal": 1, "best": 3}  # fronts that are improved to the end
# energy a node of the share of the scan that is missed, of its distance at 95 %, and at 99 % where tips count [members]
MISSING_ENERGY, DISTANCE_ENERGY, TIPS_ENERGY = 4.0, 0.1, 0.3
MISSED_MORE = 0.002  # share of the scan that the grid of a longer search may miss beyond that of a shorter one
TURNS_OF_TIPS = 5  # times that nodes are put on tips
MOST_MISSED = 0.2  # largest share of the scan that a grid may miss where they are put on tips
TURNS_OF_SEARCH = 12  # times that the grid of effort `normal` is searched again where none of `best` is better
POOR_SHAPE = 0.4  # shape quality of its worst triangle below which a grid is poor: more finalists are tried
FINALIST_BATCHES = 2  # times that finalists are tried


@dataclass(eq=False)
class Candidate:
    """A front on its way to a grid."""

    front: Grid
    settings: Settings  #: how it is improved
    mesh: WorkingMesh
    judged: Judged | None = None  #: its grid, improved to the end, with what is wrong with it
    grid: Grid | None = None  #: that grid with its certificate
    fault: FrontError | None = None  #: why it is not to be used

    @property
    def energy(self) -> float:
        """The energy that falls, for a node: grids of other numbers of nodes can be compared."""
        return energy_of_node(self.mesh)

    @property
    def cost(self) -> float:
        """The energy for a node, and what the grid misses of the scan."""
        return self._cost("p95", DISTANCE_ENERGY)

    @property
    def cost_of_tips(self) -> float:
        """The same where tips count, which are no more than a few hundredths of a scan."""
        return self._cost("p99", TIPS_ENERGY)

    def _cost(self, quantile: str, distance_energy: float) -> float:
        found = self.grid.certificate if self.grid is not None else None
        if found is None or found.scan_distance is None:
            return self.energy
        distance = getattr(found.scan_distance, quantile) / self.settings.length
        return self.energy + MISSING_ENERGY * found.missing + distance_energy * float(distance)

    def take(self, judged: Judged) -> None:
        """Take a grid that was judged."""
        self.judged, self.grid = judged, judged.checked_grid

    def end(self) -> None:
        """Make the whole certificate of the grid taken, and refuse it if it does not pass."""
        assert self.judged is not None
        self.grid = passed_grid(self.judged.certified_grid())

    @property
    def is_poor(self) -> bool:
        """Whether its worst triangle is a poor one."""
        return self.grid is not None and self.grid.quality.shape_min < POOR_SHAPE


def advance_fronts(
    samples: SurfaceSamples,
    boundary: Boundary,
    constraints: Constraints,
    fields: Sequence[Field],
    settings: Settings,
    *,
    progress: Progress | None = None,
) -> list[Grid]:
    """Return the grids that fronts leave behind, one front for each field; a front is `front.advance.advance_front`.

    Parameters
    ----------
    samples : SurfaceSamples
        The surface samples of the scan.
    boundary : Boundary
    constraints : Constraints
        Fixed nodes, fixed lines and ridges.
    fields : sequence of Field
        Those of `orientation_fields`.
    settings : Settings
    progress : callable, optional
        Called with ("front", share); may raise to stop.

    Raises
    ------
    FrontError
        No front came to its end; the fault of the first.
    """
    see = seer_of(progress)
    first = progress if len(fields) == 1 or see is None else WatchedProgress(None, see)  # of several one is seen
    lone = first if len(fields) == 1 or see is not None else None

    def advance(field: Field) -> Grid | FrontError:
        start, nodes = field
        own = settings if start.laid else settings.replace(length=start.scale * settings.length)
        scratch = replace(samples, surface=with_own_scratch(samples.surface))
        try:
            return advance_front(
                scratch, boundary, constraints, own, nodes, progress=lone if field is fields[0] else None
            )
        except FrontError as error:
            return error

    found = threaded_map(advance, fields, _part(progress, "front", 0.0, 1.0))
    fronts = [front for front in found if not isinstance(front, FrontError)]
    if not fronts:
        raise next(error for error in found if isinstance(error, FrontError))
    return fronts


def improve_fronts(
    fronts: Sequence[Grid],
    samples: SurfaceSamples,
    boundary: Boundary,
    constraints: Constraints,
    settings: Settings,
    *,
    progress: Progress | None = None,
) -> list[Candidate]:
    """Return the fronts, opened and improved alike, that of least energy a node first (Sec. 4)."""
    if progress:
        progress("optimize", 0.0)

    def improve(front: Grid) -> Candidate:
        mesh = improve_first(front, samples, boundary, constraints, settings)
        return Candidate(front, settings, mesh)

    found = threaded_map(improve, fronts, _part(progress, "optimize", 0.0, 0.5))
    ordered = sorted(found, key=lambda candidate: candidate.energy) if len(found) > 1 else found
    return ordered


def best_that_passes(
    candidates: Sequence[Candidate],
    samples: SurfaceSamples,
    boundary: Boundary,
    constraints: Constraints,
    settings: Settings,
    *,
    progress: Progress | None = None,
) -> Grid:
    """Improve the first candidates to the end, check them, and return the best that passes, with its certificate.

    Raises
    ------
    FrontError
        None passes; the fault of the first.
    """
    if settings.effort == "best" and settings.method == "default":
        return no_worse(candidates, samples, boundary, constraints, settings, progress=progress)
    return grid_of(chosen(those_that_pass(candidates, samples, boundary, constraints, settings, progress=progress)))


def those_that_pass(
    candidates: Sequence[Candidate],
    samples: SurfaceSamples,
    boundary: Boundary,
    constraints: Constraints,
    settings: Settings,
    *,
    progress: Progress | None = None,
) -> list[Candidate]:
    """Improve the first candidates to the end, check them, and return those that pass, with their certificates.

    Raises
    ------
    FrontError
        None passes; the fault of the first.
    """

    def finish(candidate: Candidate) -> None:
        try:
            grid = improve_last(candidate.mesh, candidate.front, samples, constraints, candidate.settings)
            grid = finish_rings(grid, boundary)
            candidate.take(judge(grid.replace(settings=settings), samples, boundary, settings))
            if samples.rough <= VERY_ROUGH_SCAN and misses_at_most(grid_of(candidate), MOST_MISSED):
                reach_tips_of(candidate, samples, boundary, constraints, settings)
            candidate.end()
        except FrontError as error:
            candidate.grid, candidate.fault = None, error

    passed: list[Candidate] = []
    size = FULLY_IMPROVED[settings.effort]
    for begin in range(0, min(len(candidates), FINALIST_BATCHES * size), size):
        batch = candidates[begin : begin + size]
        threaded_map(finish, batch, _part(progress, "optimize", 0.5, 1.0))
        passed += [candidate for candidate in batch if candidate.grid is not None]
        if any(not candidate.is_poor for candidate in passed):
            break
    if not passed:
        fault = candidates[0].fault
        assert fault is not None
        raise fault
    return passed


def misses_at_most(grid: Grid, share: float) -> bool:
    """Whether nothing is wrong with a grid but that it misses some share of the scan at most."""
    found = grid.certificate
    return found is not None and found.missing <= share and all(fault.kind == "cover" for fault in found.faults)


def reach_tips_of(
    candidate: Candidate, samples: SurfaceSamples, boundary: Boundary, constraints: Constraints, settings: Settings
) -> None:
    """Put nodes on the tips of the scan that a grid misses, as long as it is better for it and nothing else goes wrong.

    Each turn finds those that the grid misses by then. In the end the grid is searched again.
    """
    search = TipSearch(candidate, samples, boundary, constraints, settings)
    mesh, reached = candidate.mesh, False
    for _ in range(TURNS_OF_TIPS if settings.method == "default" else 0):
        kept, cost = mesh.copied(), candidate.cost_of_tips
        now = search.reach(find_tips(mesh, candidate.front, samples, search.given_up))
        if now is None or not search.is_taken(now, cost):
            mesh.restore(kept)
            break
        reached = True
    if reached and settings.effort != "quick":
        kept, cost = mesh.copied(), candidate.cost_of_tips
        if not search.is_taken(search.judged(searched_again(mesh, *search.of_scan)), cost):
            mesh.restore(kept)


@dataclass(eq=False)
class TipSearch:
    """Nodes on their way to the tips of a scan."""

    candidate: Candidate
    samples: SurfaceSamples
    boundary: Boundary
    constraints: Constraints
    settings: Settings
    given_up: list[np.ndarray] = field(default_factory=list)  #: tips (3,) that no node can be put on

    @property
    def of_scan(self) -> tuple[Grid, SurfaceSamples, Constraints, Settings]:
        """What a mesh needs to be put down."""
        return self.candidate.front, self.samples, self.constraints, self.candidate.settings

    def judged(self, grid: Grid) -> Judged:
        """Return a grid that was put down, finished and judged."""
        finished = finish_rings(grid, self.boundary).replace(settings=self.settings)
        return judge(finished, self.samples, self.boundary, self.settings)

    def reach(self, tips: Sequence[np.ndarray]) -> Judged | None:
        """Put nodes on the tips (3,) where nothing goes wrong, and give up the others; the grid then, None where it is as before.

        Tips near a fault are tried one by one. Ends: each call has fewer tips than the one that made it.
        """
        mesh = self.candidate.mesh
        kept = mesh.copied()
        if put_on_tips(mesh, tips):
            now = self.judged(put_down(mesh, *self.of_scan))
            if misses_at_most(now.checked_grid, MOST_MISSED):
                return now
            mesh.restore(kept)
            if len(tips) > 1:
                faults = [np.array(each.where) - self.samples.origin for each in now.certificate.faults if each.where]
                harmless, suspects = suspects_apart(tips, faults, mesh.length)
                found = self.reach(harmless)
                for tip in suspects:
                    found = self.reach([tip]) or found
                return found
        self.given_up.extend(tips)
        return None

    def is_taken(self, now: Judged, cost: float) -> bool:
        """Take the grid that the mesh has become where it passes as far and is better than one of some cost."""
        candidate, before = self.candidate, self.candidate.judged
        assert before is not None
        candidate.take(now)
        better = misses_at_most(grid_of(candidate), MOST_MISSED) and candidate.cost_of_tips < cost
        if not better:
            candidate.take(before)
        return better


def chosen(passed: Sequence[Candidate]) -> Candidate:
    """Return the best of candidates that pass: of those without a poor triangle the one of least `cost`."""
    return min(passed, key=lambda candidate: (candidate.is_poor, candidate.cost)) if len(passed) > 1 else passed[0]


def grid_of(candidate: Candidate) -> Grid:
    """Return the grid of a candidate that passes."""
    assert candidate.grid is not None
    return candidate.grid


def no_worse(
    candidates: Sequence[Candidate],
    samples: SurfaceSamples,
    boundary: Boundary,
    constraints: Constraints,
    settings: Settings,
    *,
    progress: Progress | None = None,
) -> Grid:
    """Return the best grid that is in no figure worse than that of effort `normal`; where there is none, that one, searched on.

    Raises
    ------
    FrontError
        With effort `normal` none passes, so that this attempt is no better than a later one.
    """
    lower = settings.replace(effort="normal")
    fields = orientation_fields(samples, boundary, lower)
    fronts = advance_fronts(samples, boundary, constraints, fields, lower)
    improved = improve_fronts(fronts, samples, boundary, constraints, lower)
    usual = chosen(those_that_pass(improved, samples, boundary, constraints, lower))
    better = []
    with suppress(FrontError):
        passed = those_that_pass(candidates, samples, boundary, constraints, settings, progress=progress)
        better = [each for each in passed if _is_no_worse(grid_of(each), grid_of(usual))]
    if better:
        return grid_of(chosen(better))
    search_on(usual, samples, boundary, constraints, lower)
    return grid_of(usual).replace(settings=settings)


def search_on(
    candidate: Candidate, samples: SurfaceSamples, boundary: Boundary, constraints: Constraints, settings: Settings
) -> None:
    """Search a grid that passes again and again, and take the most even one that is in no figure worse than it was."""
    usual = grid_of(candidate)
    for _ in range(TURNS_OF_SEARCH):
        grid = searched_again(candidate.mesh, candidate.front, samples, constraints, candidate.settings)
        judged = judge(finish_rings(grid, boundary).replace(settings=settings), samples, boundary, settings)
        grid = judged.checked_grid
        passes = judged.certificate.passed and _is_no_worse(grid, usual)
        if passes and grid.quality.length_cv < grid_of(candidate).quality.length_cv:
            candidate.take(judged)
    candidate.end()


def _is_no_worse(grid: Grid, other: Grid) -> bool:
    """Whether a grid is as even, as regular and as near to the scan as another, and reaches as much of it."""
    one, two = grid.certificate, other.certificate
    if one is None or two is None or one.scan_distance is None or two.scan_distance is None:
        return True
    return (
        grid.quality.length_cv <= other.quality.length_cv
        and grid.quality.shape_mean >= other.quality.shape_mean
        and one.scan_distance.p95 <= two.scan_distance.p95
        and one.scan_distance.p99 <= two.scan_distance.p99
        and one.missing <= two.missing + MISSED_MORE
    )


def optimize_fronts(
    fronts: Sequence[Grid],
    samples: SurfaceSamples,
    boundary: Boundary,
    constraints: Constraints,
    settings: Settings,
    *,
    progress: Progress | None = None,
) -> Grid:
    """Return the best grid that can be made of some fronts and passes the checks, with its certificate (Sec. 4).

    Parameters
    ----------
    fronts : sequence of Grid
        Those of `advance_fronts`.
    samples : SurfaceSamples
        The surface samples of the scan.
    boundary : Boundary
    constraints : Constraints
        Fixed nodes, fixed lines and ridges.
    settings : Settings
    progress : callable, optional
        Called with ("optimize", share); may raise to stop.

    Raises
    ------
    FrontError
        No grid passes; the fault of the first.
    """
    improved = improve_fronts(fronts, samples, boundary, constraints, settings, progress=progress)
    return best_that_passes(improved, samples, boundary, constraints, settings, progress=progress)


def _part(progress: Progress | None, stage: str, begin: float, end: float) -> Callable[[float], None] | None:
    """Report a share of a part of a stage."""
    return (lambda share: progress(stage, begin + (end - begin) * share)) if progress else None
