"""The whole method: scan -> boundary -> front -> grid (Fig. 1)."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from time import perf_counter

import numpy as np

from .attempts import (
    Attempt,
    AttemptLimit,
    attempts,
    follows_better,
    joins_sheets,
    only_leaves_out,
    runs_along_rods,
)
from .boundary.find import find_boundary
from .candidates import advance_fronts, best_that_passes, improve_fronts
from .cells.make import certified_cells, settings_of_triangles, with_cells
from .check.limits import with_ridges_given_up
from .check.unfollowed import crests_cut_off
from .constraints.find import find_constraints, wide_folds
from .errors import CertificateError, FrontError, OneSidedError, ScanTrussError
from .front.orientation_field import orientation_fields
from .grid.grid import Grid
from .runtime.progress import Progress, seer_of
from .scan.cloud import PointCloud
from .scan.member_length import check_length
from .scan.stream.fit import read_to_fit
from .settings import Settings
from .surface.samples import sample_surface

LEAST_EFFORT = "quick"


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
        made = symmetric(cloud, settings, progress=watch, keep_failed=keep_failed)
        return made.replace(seconds=watch.seconds())
    refused: FrontError | None = None
    for effort in dict.fromkeys((settings.effort, LEAST_EFFORT)):  # more effort never gives less
        tried = settings.replace(effort=effort)
        try:
            grid = first_that_passes(cloud, tried, attempts(cloud, tried), progress=watch)
            return grid.replace(seconds=watch.seconds())
        except FrontError as error:
            refused = refused or error
            if joins_sheets(error):
                break
    assert refused is not None
    if not keep_failed or not isinstance(refused, CertificateError) or not len(refused.grid.triangles):
        raise refused
    return refused.grid.replace(settings=settings, seconds=watch.seconds())


def symmetric_grid(
    cloud: PointCloud, settings: Settings, *, progress: Progress | None = None, keep_failed: bool = False
) -> Grid:
    """Return a grid that keeps mirror planes or a rotation exactly: one part with rows on its edges, and its images.

    A first grid shows where the planes cut the surface; a second has these lines as fixed lines and is cut off along them.

    Raises
    ------
    InputError
        The scan is not symmetric within a tenth of a member.
    FrontError
        No grid passes the checks, or the rows do not follow the edges of the part.
    """
    from .improve.symmetric import EDGE_LINE, check_boundary_kept, find_symmetries

    symmetries = find_symmetries(np.asarray(cloud.points) + cloud.origin, settings)
    plain = settings.replace(symmetry="")
    refused: FrontError | None = None
    surface = grid_from_cloud(cloud, plain.replace(cells="triangle", rows="boundary", planar=False), progress=progress)
    for symmetry, lines in ((each, lines) for each in symmetries for lines in each.edges(surface, settings.length)):
        names = plain.line_names or [f"line {number}" for number in range(1, len(plain.fixed_lines) + 1)]
        lined = plain.replace(
            fixed_lines=[*plain.fixed_lines, *(line.tolist() for line in lines)],
            line_names=[*names, *(f"{EDGE_LINE} {number}" for number in range(1, len(lines) + 1))],
        )
        half = grid_from_cloud(cloud, lined, progress=progress)
        own = (half.settings or lined).replace(fixed_lines=plain.fixed_lines, line_names=plain.line_names)
        samples, boundary = find_boundary(sample_surface(cloud, own), own, progress=progress)
        kept = own.replace(symmetry=symmetry.rows)
        for part in range(symmetry.parts):
            try:
                made = symmetry.made(half, lines, settings.length, part)
                check_boundary_kept(made, boundary, settings.length)
                return certified_cells(made.replace(settings=kept), samples, boundary, own)
            except FrontError as error:
                refused = refused or error
    assert refused is not None
    if keep_failed and isinstance(refused, CertificateError):
        return refused.grid
    raise refused


def symmetric_hexagons(
    cloud: PointCloud, settings: Settings, *, progress: Progress | None = None, keep_failed: bool = False
) -> Grid:
    """Return a grid of hexagons that keeps mirror planes or a rotation exactly: the dual of triangles that do.

    Raises
    ------
    InputError
        The scan is not symmetric within a tenth of a member.
    FrontError
        No grid passes the checks.
    """
    from .improve.mirrored import without_edge_lines
    from .improve.symmetric import find_symmetries

    *others, last = (each.rows for each in find_symmetries(np.asarray(cloud.points) + cloud.origin, settings))
    asked = settings_of_triangles(settings).replace(cells="triangle", planar=False, symmetry=last)
    for rows in others:
        try:
            triangles = symmetric_grid(cloud, asked.replace(symmetry=rows), progress=progress)
            break
        except FrontError:
            continue
    else:
        triangles = symmetric_grid(cloud, asked, progress=progress)
    own = triangles.settings or asked
    samples, boundary = find_boundary(sample_surface(cloud, own), own, progress=progress)
    boundary, constraints = find_constraints(samples, boundary, own, ())
    wanted = own.replace(
        cells="hexagon", length=settings.length, fill_holes=settings.fill_holes, fixed=settings.fixed, planar=settings.planar
    )  # fmt: skip
    try:
        return with_cells(without_edge_lines(triangles), samples, boundary, constraints, wanted, progress=progress)
    except CertificateError as error:
        if keep_failed:
            return error.grid
        raise


def first_that_passes(
    cloud: PointCloud,
    settings: Settings,
    tried: Iterable[Attempt],
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
    tried : iterable of Attempt
        The attempts in their order.
    limit : AttemptLimit, optional
        How many are worth making.

    Raises
    ------
    ScanTrussError
        None passes; the fault of the first with the settings asked for that gave a grid, else of the first. It names the settings
        of a grid of the mean surface that only leaves out too much.
    """
    faults: list[ScanTrussError] = []
    limit, advice = limit or AttemptLimit(), ""
    for attempt in tried:
        if not limit.allows(attempt):
            continue
        try:
            make = make_grid_with_wide_ridges if attempt == Attempt(settings) else make_grid_with_most_ridges
            grid = make(cloud, attempt, limit, progress=progress)
            return without_rods_if_better(grid, cloud, attempt, limit, progress=progress)
        except ScanTrussError as error:
            looks_one_sided = bool(faults) and isinstance(faults[0], OneSidedError)  # where its mean surface does not
            if attempt.settings == settings:  # what goes wrong with other settings, nobody has asked for
                if not isinstance(error, FrontError | OneSidedError):
                    raise
                faults.append(error)
            elif looks_one_sided and isinstance(error, FrontError):
                faults.append(error)
            advice = advice or attempt.advice(error)
            limit.note(attempt, error)
        if not limit.any_left():
            break
    if not faults:
        raise FrontError("none of the attempts made gives a grid that passes")
    worst = next((fault for fault in faults if isinstance(fault, CertificateError)), faults[0])
    if advice and isinstance(worst, FrontError) and not only_leaves_out(worst):
        raise type(worst)(f"{worst}; {advice}", worst.grid, worst.where)
    raise worst


def make_grid_with_wide_ridges(
    cloud: PointCloud, attempt: Attempt, limit: AttemptLimit, *, progress: Progress | None = None
) -> Grid:
    """Return the grid of one attempt; where it cuts off the crests of wide folds, with ridges there, if that follows the scan better.

    For effort `best` a grid of effort `normal` shows it, so that the longer search starts from no worse.
    """
    settings = settings_of_triangles(attempt.settings)
    samples, _ = find_boundary(sample_surface(cloud, settings), settings)
    crests = wide_folds(samples, settings)
    if not crests:
        return make_grid_with_most_ridges(cloud, attempt, limit, progress=progress)
    lower = replace(attempt, settings=attempt.settings.replace(effort="normal"))
    first = lower if attempt.settings.effort == "best" else attempt
    plain = make_grid_with_most_ridges(cloud, first, limit, progress=progress)
    chosen, found = first, plain
    with suppress(ScanTrussError):
        wide = replace(first, wide=crests_cut_off(plain, crests, settings.length))
        other = make_grid_with_most_ridges(cloud, wide, limit, progress=progress) if wide.wide else plain
        chosen, found = (wide, other) if follows_better(other, plain) else (first, plain)
    if first is attempt:
        return found
    return make_grid_with_most_ridges(cloud, replace(attempt, wide=chosen.wide), limit, progress=progress)


def without_rods_if_better(
    grid: Grid, cloud: PointCloud, attempt: Attempt, limit: AttemptLimit, *, progress: Progress | None = None
) -> Grid:
    """Return a grid that passes, or, where it runs along columns or scaffold, one without these if that has fewer warnings."""
    if not runs_along_rods(grid, cloud, attempt.settings):
        return grid
    without = replace(attempt, settings=attempt.settings.replace(keep_rods=False))
    try:
        other = make_grid_with_most_ridges(cloud, without, limit, progress=progress)
    except ScanTrussError:
        return grid
    assert grid.certificate is not None and other.certificate is not None
    return other if len(other.certificate.warnings) < len(grid.certificate.warnings) else grid


def make_grid_with_most_ridges(
    cloud: PointCloud, attempt: Attempt, limit: AttemptLimit, *, progress: Progress | None = None
) -> Grid:
    """Return the grid of one attempt; where it fails, ridges are given up near the faults, a few times, and a warning says so."""
    first: FrontError | None = None
    later: Attempt | None = attempt
    while later is not None and (
        first is None or limit.any_left()
    ):  # each turn gives up ridges at one more place at least
        limit.begin()
        try:
            return with_ridges_given_up(make_grid(cloud, later, progress=progress), later.faults)
        except FrontError as error:
            limit.end(error)
            first, later = first or error, later.after(error, cloud)
    assert first is not None
    raise first


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
    boundary, constraints = find_constraints(
        samples, boundary, settings, attempt.faults, attempt.wide
    )  # Sec. 4.2, lines, ridges
    fields = orientation_fields(samples, boundary, settings, attempt.starts)  # Jakob et al. 2015
    fronts = advance_fronts(samples, boundary, constraints, fields, settings, progress=progress)  # Fig. 4
    improved = improve_fronts(fronts, samples, boundary, constraints, settings, progress=progress)  # Sec. 4.1
    best = best_that_passes(
        improved, samples, boundary, constraints, settings, is_trial=attempt.is_trial, progress=progress
    )  # certificate
    return with_cells(best, samples, boundary, constraints, wanted, progress=progress)  # quads, hexagons


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
