"""Multi-start: several fronts for an attempt, and the best of their grids that passes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING

from .attempts.looks import VERY_ROUGH_SCAN
from .errors import CertificateError, FrontError
from .front.advance import advance_front
from .front.orientation_field import Field, FieldStart, orientation_fields
from .improve.candidate import Candidate, grid_of, judged, misses_at_most
from .improve.fit import FARTHER_IF_EVENER, take_fit
from .improve.longer_search import Turns, is_no_worse, search_on, unevenness
from .improve.optimize import improve_first, improve_last
from .improve.tip_search import MOST_MISSED, end_with_tips
from .runtime.parallel import threaded_map
from .runtime.progress import Progress, WatchedProgress, seer_of
from .surface.scratch import with_own_scratch

if TYPE_CHECKING:
    from .boundary.find import Boundary
    from .constraints.find import Constraints
    from .grid.grid import Grid
    from .settings import Settings
    from .surface.samples import SurfaceSamples

FULLY_IMPROVED = {"quick": 1, "normal": 1, "best": 3}  # fronts that are improved to the end
FINALIST_BATCHES = 2  # times that finalists are tried
LONGER_SEARCHES = 4  # longer searches of effort `best`, of which the most even grid is taken
TURNS_OF_BEST = Turns(free=18, sparing=18)
NODES_OF_SEVERAL_SEARCHES = 3000  # nodes of a grid above which there is one only, and with `normal` none
SEARCHED_ON_FROM = 0.055  # variation of the lengths from which on effort `normal` searches a folded grid on
SHORT_SEARCHES = 2  # searches then, at once
TURNS_OF_NORMAL = Turns(free=0, sparing=8)


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
    is_trial: bool = False,
    starts: Sequence[FieldStart] | None = None,
    progress: Progress | None = None,
) -> Grid:
    """Improve the first candidates to the end, check them, and return the best that passes, with its certificate.

    Its nodes are still to be fitted to the scan (`Grid.fit`), after all comparisons with grids of other attempts: a fitted one comes nearer
    to folds that it cuts across. One of effort `best`, which is fitted as it is searched, is compared as that of `normal`.

    is_trial : a grid that passes is left as it is, without nodes on the tips of the scan
    starts : how their fronts were laid out, if not as usual

    Raises
    ------
    FrontError
        None passes; the fault of the first.
    """
    if settings.effort == "best" and settings.method == "default":
        return no_worse(candidates, samples, boundary, constraints, settings, starts, progress=progress)
    passed = those_that_pass(candidates, samples, boundary, constraints, settings, is_trial=is_trial, progress=progress)
    best = chosen(passed)
    if is_trial or settings.effort == "quick" or settings.method == "paper":
        return grid_of(best)

    def fit(grid: Grid) -> Grid:
        before = grid_of(best)
        ended = fitted_and_evened(best, samples, boundary, constraints, settings)
        return with_warnings_of(grid, before, grid_of(ended))

    return grid_of(best).replace(fit=fit)


def those_that_pass(
    candidates: Sequence[Candidate],
    samples: SurfaceSamples,
    boundary: Boundary,
    constraints: Constraints,
    settings: Settings,
    *,
    is_trial: bool = False,
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
            candidate.take(judged(grid, samples, boundary, settings))
            done = is_trial and candidate.passes  # nodes on tips would only make it better
            if not done and samples.rough <= VERY_ROUGH_SCAN and misses_at_most(grid_of(candidate), MOST_MISSED):
                end_with_tips(candidate, samples, boundary, constraints, settings)
            else:
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


def chosen(passed: Sequence[Candidate]) -> Candidate:
    """Return the best of candidates that pass: of those without a poor triangle the one of least `cost`."""
    return min(passed, key=lambda candidate: (candidate.is_poor, candidate.cost)) if len(passed) > 1 else passed[0]


def no_worse(
    candidates: Sequence[Candidate],
    samples: SurfaceSamples,
    boundary: Boundary,
    constraints: Constraints,
    settings: Settings,
    starts: Sequence[FieldStart] | None = None,
    *,
    progress: Progress | None = None,
) -> Grid:
    """Return the best grid that is in no figure worse than that of effort `normal`, or that one, searched on.

    Raises
    ------
    FrontError
        With effort `normal` none passes, so that this attempt is no better than a later one.
    """
    lower = settings.replace(effort="normal")
    fields = orientation_fields(samples, boundary, lower, starts)
    fronts = advance_fronts(samples, boundary, constraints, fields, lower)
    improved = improve_fronts(fronts, samples, boundary, constraints, lower)
    usual = chosen(those_that_pass(improved, samples, boundary, constraints, lower))
    compared = grid_of(usual)
    usual = fitted_and_evened(usual, samples, boundary, constraints, lower)
    passed: list[Candidate] = []
    with suppress(FrontError):
        passed = those_that_pass(candidates, samples, boundary, constraints, settings, progress=progress)
    for each in passed:
        take_fit(each, samples, boundary, constraints, settings)
    better = [each for each in passed if is_no_worse(grid_of(each), grid_of(usual))]
    best = chosen(better) if better else usual
    if best.mesh.sharp.any() or not better:  # elsewhere its own search leaves little
        best = searched_on(best, usual, passed, samples, boundary, constraints, lower)
    return compared.replace(settings=settings, fit=lambda grid: with_warnings_of(grid, compared, grid_of(best)))


def fitted_and_evened(
    candidate: Candidate, samples: SurfaceSamples, boundary: Boundary, constraints: Constraints, settings: Settings
) -> Candidate:
    """Return a candidate of effort `normal`, fitted to the scan, and after short longer searches where it is folded and uneven."""
    take_fit(candidate, samples, boundary, constraints, settings)
    grid, least = grid_of(candidate), candidate.judged
    assert least is not None
    is_folded = candidate.fit is not None or bool(candidate.mesh.sharp.any())
    if not is_folded or grid.quality.length_cv <= SEARCHED_ON_FROM or len(grid.nodes) > NODES_OF_SEVERAL_SEARCHES:
        return candidate
    turns = TURNS_OF_NORMAL
    if candidate.fit is not None:  # which has come much nearer
        turns = turns._replace(farther=FARTHER_IF_EVENER)
    begun = [candidate, *(candidate.copy() for _ in range(SHORT_SEARCHES - 1))]

    def search(number: int) -> None:
        search_on(begun[number], samples, boundary, constraints, settings, least, turns, number)

    threaded_map(search, range(len(begun)), None)
    return min(begun, key=lambda each: unevenness(grid_of(each), settings.length))


def fitted_at_last(grid: Grid) -> Grid:
    """Return a grid whose nodes are fitted to the scan, if they are still to be."""
    return grid if grid.fit is None else grid.fit(grid)


def with_warnings_of(grid: Grid, before: Grid, fitted: Grid) -> Grid:
    """Return a fitted grid with the settings of the grid it was, and with what was said of that since."""
    now, then, found = grid.certificate, before.certificate, fitted.certificate
    assert now is not None
    assert then is not None
    assert found is not None
    said = tuple(each for each in now.warnings if each not in then.warnings)
    whole = replace(found, warnings=(*found.warnings, *said))
    return fitted.replace(settings=grid.settings, certificate=whole, fit=None)


def searched_on(
    best: Candidate,
    usual: Candidate,
    passed: Sequence[Candidate],
    samples: SurfaceSamples,
    boundary: Boundary,
    constraints: Constraints,
    settings: Settings,
) -> Candidate:
    """Return the most even candidate after longer searches of several, that is in no figure worse than the usual one.

    How even the grid of a search is depends on where it begins and on chance.
    """
    least = usual.judged
    assert least is not None
    begun = [best]
    if len(grid_of(usual).nodes) <= NODES_OF_SEVERAL_SEARCHES:
        begun = [usual, *passed][:LONGER_SEARCHES]
        begun += [usual.copy() for _ in range(LONGER_SEARCHES - len(begun))]

    def search(number: int) -> None:
        search_on(begun[number], samples, boundary, constraints, settings, least, TURNS_OF_BEST, number)

    threaded_map(search, range(len(begun)), None)
    fit = [each for each in begun if is_no_worse(grid_of(each), least.checked_grid)]
    if not best.mesh.sharp.any():
        return chosen(fit)
    return min(fit, key=lambda each: unevenness(grid_of(each), settings.length))


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
    try:
        return fitted_at_last(best_that_passes(improved, samples, boundary, constraints, settings, progress=progress))
    except CertificateError as refused:
        raise refused.whole from None


def _part(progress: Progress | None, stage: str, begin: float, end: float) -> Callable[[float], None] | None:
    """Report a share of a part of a stage."""
    return (lambda share: progress(stage, begin + (end - begin) * share)) if progress else None
