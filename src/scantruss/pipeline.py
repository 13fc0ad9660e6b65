"""The whole method: scan -> boundary -> front -> grid (Fig. 1)."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from time import perf_counter

import numpy as np

from .attempts.better import follows_better, follows_ridges_as_well, places_of_poor_members
from .attempts.course import AttemptCourse
from .attempts.limit import AttemptLimit
from .attempts.table import AS_ASKED, Attempt, places_of_fault
from .boundary.find import find_boundary
from .candidates import advance_fronts, best_that_passes, fitted_at_last, improve_fronts
from .cells.make import settings_of_triangles, with_cells
from .cells.symmetric_grids import symmetric_grid, symmetric_hexagons
from .check.unfollowed import crests_cut_off
from .constraints.find import find_constraints, made_folds, wide_folds
from .errors import CertificateError, FrontError, ScanTrussError
from .front.orientation_field import orientation_fields
from .grid.grid import Grid
from .grid.upward import facing_up
from .runtime.progress import Progress, seer_of
from .scan.cloud import PointCloud
from .scan.member_length import check_length
from .scan.stream.fit import read_to_fit
from .settings import Settings
from .surface.samples import sample_surface


def grid_from_points(
    points: np.ndarray | PointCloud,
    settings: Settings,
    *,
    progress: Progress | None = None,
    keep_failed: bool = False,
) -> Grid:
    """Return the grid of an array of points, or of a cloud.

    Parameters
    ----------
    points : (N, 3) array or PointCloud
        Measured points [scan unit], or what `read_points` or `clean_points` returned.
    settings : Settings
        Desired member length and everything else.
    progress : callable, optional
        ``progress(stage, share)``, called from time to time; may raise to cancel.
    keep_failed : bool
        Return a grid even if it fails its certificate; otherwise that raises a `CertificateError`, whose `.grid` it is.

    Returns
    -------
    Grid
        With `settings`, `before` (quality before the optimization), `certificate` and `seconds` of each stage.

    Raises
    ------
    ScanTrussError
        No grid can be made, with the reason; or a setting chooses what is read of a file, and an array is taken whole.
    """
    settings, started = Settings.check(settings), perf_counter()
    if isinstance(points, PointCloud):
        cloud = points
    else:
        settings.check_for_array()
        cloud = PointCloud.from_array(points, unit=settings.unit)
    spent = perf_counter() - started
    return grid_from_cloud(cloud, settings, progress=progress, keep_failed=keep_failed, read_seconds=spent)


def grid_from_scan(
    path: str | Path, settings: Settings, *, progress: Progress | None = None, keep_failed: bool = False
) -> Grid:
    """Return the grid of a scan file; see `grid_from_points`. A scan larger than memory is thinned while it is read."""
    started = perf_counter()
    cloud, settings = read_to_fit(path, Settings.check(settings), progress=progress)
    spent = perf_counter() - started
    return grid_from_cloud(cloud, settings, progress=progress, keep_failed=keep_failed, read_seconds=spent)


def grid_from_cloud(
    cloud: PointCloud,
    settings: Settings,
    *,
    progress: Progress | None = None,
    keep_failed: bool = False,
    read_seconds: float = 0.0,
) -> Grid:
    """Return the grid of a point cloud; see `grid_from_points`.

    Parameters
    ----------
    cloud : PointCloud
        The scan.
    settings : Settings
        Desired member length and everything else.
    progress : callable, optional
        ``progress(stage, share)``.
    keep_failed : bool
        Return a grid even if it fails its certificate.
    read_seconds : float
        How long reading took [s], for the table of times.

    Returns
    -------
    Grid
        Where no grid passes the checks, one with a look at sharp edges, without the ridges of the scan, of its mean surface, with
        other samples, by the paper's method or with the least effort, if that passes; its settings say so: `plain_body`,
        `sharp_edges`, `ridge_angle` 0, a `smooth_scale`, another `box_size`, `method` "paper", `effort` "quick".
    """
    watch = Stopwatch(progress, read_seconds)
    check_length(cloud, settings)
    if settings.symmetry:
        symmetric = symmetric_hexagons if settings.cells == "hexagon" else symmetric_grid
        part_of = partial(grid_from_cloud, progress=watch)
        grid = symmetric(cloud, settings, part_of, progress=watch, keep_failed=keep_failed)
        return facing_up(grid, cloud).replace(seconds=watch.seconds())
    try:
        grid = fitted_at_last(first_that_passes(cloud, settings, progress=watch))
    except CertificateError as refused:
        if not keep_failed or not len(refused.grid.triangles):
            raise
        grid = refused.grid.replace(settings=settings)
    return facing_up(grid, cloud).replace(seconds=watch.seconds())


def make_grid(cloud: PointCloud, attempt: Attempt, *, progress: Progress | None = None) -> Grid:
    """Return the grid of one attempt, with its certificate: the method, one line a step (Fig. 1).

    Raises
    ------
    FrontError
        No grid of this attempt passes the checks.
    """
    wanted = attempt.settings
    settings = settings_of_triangles(wanted)
    samples = sample_surface(cloud, settings)  # Sec. 3.2: samples of the surface with normals, Eq. 1
    samples, boundary = find_boundary(samples, settings, progress=progress)  # Sec. 3.3; holes, Sec. 3.6
    boundary, constraints = find_constraints(samples, boundary, settings, attempt.faults, attempt.wide)  # Sec. 4.2
    fields = orientation_fields(samples, boundary, settings, attempt.starts)  # Jakob et al. 2015
    fronts = advance_fronts(samples, boundary, constraints, fields, settings, progress=progress)  # Fig. 4
    improved = improve_fronts(fronts, samples, boundary, constraints, settings, progress=progress)  # Sec. 4.1
    best = best_that_passes(
        improved,
        samples,
        boundary,
        constraints,
        settings,
        is_trial=attempt.is_trial,
        starts=attempt.starts,
        progress=progress,
    )  # certificate
    return with_cells(best, samples, boundary, constraints, wanted, progress=progress)  # quads, hexagons


def make_grid_with_wide_ridges(cloud: PointCloud, attempt: Attempt, *, progress: Progress | None = None) -> Grid:
    """Return the grid of one attempt, with ridges along wide folds where that follows the scan better.

    Where they are so even that they were made, it need only follow it as well. Others are tried where their crests are cut off.

    For effort `best` grids of effort `normal` decide it, so that the longer search starts from no worse.

    Raises
    ------
    FrontError
        No grid without such ridges passes the checks.
    """
    settings = settings_of_triangles(attempt.settings)
    samples, _ = find_boundary(sample_surface(cloud, settings), settings)
    crests = wide_folds(samples, settings)
    if not crests:
        return make_grid(cloud, attempt, progress=progress)
    is_long = attempt.settings.effort == "best"
    seen = _unseen(progress) if is_long else progress
    first = replace(attempt, settings=attempt.settings.replace(effort="normal")) if is_long else attempt
    plain = make_grid(cloud, first, progress=seen)
    made, edges = made_folds(samples, settings)
    every = tuple(sorted({*edges, *crests_cut_off(plain, crests, settings.length)}))
    # the last alone where some are the same
    tried = {every: follows_better, edges: follows_ridges_as_well, made: follows_ridges_as_well}
    for wide, is_taken in tried.items():
        if not wide:
            continue
        folded, taken = with_wide_ridges(cloud, replace(first, wide=wide), partial(is_taken, other=plain), seen)
        if folded is not None:
            with suppress(FrontError):
                return (
                    make_grid(cloud, replace(taken, settings=attempt.settings), progress=progress)
                    if is_long
                    else folded
                )
    return make_grid(cloud, attempt, progress=progress) if is_long else plain


def with_wide_ridges(
    cloud: PointCloud, attempt: Attempt, is_taken: Callable[[Grid], bool], progress: Progress | None
) -> tuple[Grid | None, Attempt]:
    """Return the grid with ridges along wide folds if it is taken, and its attempt; one more attempt is made where it is poor."""
    following: Attempt | None = attempt
    for _ in range(2):
        if following is None:
            break
        attempt = following
        try:
            grid = make_grid(cloud, attempt, progress=progress)
            if is_taken(grid):
                return grid, attempt
            places = places_of_poor_members(grid)
        except FrontError as fault:
            places = places_of_fault(fault)
        following = attempt.after_poor(places, cloud)
    return None, attempt


def _unseen(progress: Progress | None) -> Progress | None:
    """Return a progress of work that only comes before: it can be stopped, and shows that it goes on, but not how far."""
    return None if progress is None else lambda stage, share: progress("front", 0.0)


def first_that_passes(
    cloud: PointCloud,
    settings: Settings,
    tried: Iterable[Attempt] | None = None,
    *,
    limit: AttemptLimit | None = None,
    progress: Progress | None = None,
) -> Grid:
    """Return the grid of the first attempt that passes the checks.

    Parameters
    ----------
    cloud : PointCloud
    settings : Settings
        Those that were asked for.
    tried : iterable of Attempt, optional
        The attempts in their order, where they are not those of `attempts.table.ROWS_TRIED`.
    limit : AttemptLimit, optional
        How many are worth making.

    Raises
    ------
    ScanTrussError
        None passes; see `AttemptCourse.outcome`.
    """
    course = AttemptCourse(cloud, settings, tried, limit)
    first_looks = (settings, settings.replace(thin_walls=True))
    for attempt in course:
        as_first = attempt.settings in first_looks and replace(attempt, settings=settings, row=AS_ASKED) == Attempt(
            settings
        )
        make = make_grid_with_wide_ridges if as_first else make_grid
        try:
            course.passed(attempt, make(cloud, attempt, progress=progress))
        except ScanTrussError as error:
            course.failed(attempt, error)
    return course.outcome()


class Stopwatch:
    """Progress that notes how long each stage takes."""

    def __init__(self, progress: Progress | None, read_seconds: float) -> None:
        self._progress = progress
        self.see_front = seer_of(progress)
        self._seconds = {"read": read_seconds, "boundary": 0.0, "front": 0.0, "optimize": 0.0}
        self._stage, self._since = "boundary", perf_counter()

    def __call__(self, stage: str, share: float) -> None:
        """Note that a stage has come so far, and pass it on."""
        if stage != self._stage:
            self._note()
            self._stage = stage
        if self._progress:
            self._progress(stage, share)

    def _note(self) -> None:
        now = perf_counter()
        self._seconds[self._stage] = self._seconds.get(self._stage, 0.0) + now - self._since
        self._since = now

    def seconds(self) -> dict[str, float]:
        """Return how long each stage took, and all of them [s]."""
        self._note()
        return self._seconds | {"total": sum(self._seconds.values())}
