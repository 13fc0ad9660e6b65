"""The whole chain in one call: scan -> boundary -> front -> grid (Fig. 4)."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Literal

import numpy as np

from .errors import CertificateError, FrontError, InputError, ScanTrussError
from .settings import SITE, Settings, shortest_and_longest

if TYPE_CHECKING:
    from .boundary import Boundary
    from .grid.grid import Grid
    from .scan.cloud import PointCloud

Progress = Callable[[str, float], None]  #: progress(stage, share done); may raise to cancel

SPACINGS = 3.0  #: a member needs this many point spacings: fewer points than that do not tell a rim from a gap
GAPS = 2.2  #: ... and where points lie at random, this many distances to the sixth neighbour
USUAL_GAPS = 3.5  #: what suits evenly meshed scans, where nobody said a length
USUAL = 25.0  #: members along the longest side of a scan, where nobody said a length
LARGEST = 6.0  #: above a sixth of the scan's extent a grid says little of its shape
COARSER = (1.1, 1.2, 1.3)  #: sizes of the sites where none passes, in those of the settings
COARSEST = 0.5  #: of all, in lengths
ATTEMPTS = (1.0, 0.97, 1.04)  #: desired lengths of the front, one after the other until a grid passes all checks


def grid_from_points(
    points: np.ndarray, settings: Settings, *, progress: Progress | None = None, keep_failed: bool = False
) -> Grid:
    """Return the grid of an array of points.

    Parameters
    ----------
    points : (N, 3) array
        Measured points [scan unit].
    settings : Settings
        Desired member length and all the rest.
    progress : callable, optional
        ``progress(stage, share)``, called now and then; may raise to cancel.
    keep_failed : bool
        Return a grid that fails its certificate too; else that is a `CertificateError`, which has it as `.grid`.

    Returns
    -------
    Grid
        With `settings`, `before` (quality before the optimization), `certificate` and `seconds` of each stage.
    """
    from .scan.cloud import PointCloud

    started = perf_counter()
    cloud = PointCloud.from_array(points, unit=settings.unit)
    spent = perf_counter() - started
    return grid_from_cloud(cloud, settings, progress=progress, keep_failed=keep_failed, read_seconds=spent)


def grid_from_scan(
    path: str | Path, settings: Settings, *, progress: Progress | None = None, keep_failed: bool = False
) -> Grid:
    """Return the grid of a scan file; see `grid_from_points`. One that is larger than memory is thinned while it is read."""
    from .scan.fit import read_to_fit

    started = perf_counter()
    cloud, settings = read_to_fit(path, settings, progress=progress)
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
        What was read.
    settings : Settings
        Desired member length and all the rest.
    progress : callable, optional
        ``progress(stage, share)``.
    keep_failed : bool
        Return a grid that fails its certificate too.
    read_seconds : float
        What reading took [s], for the table of times.

    Returns
    -------
    Grid
        Where no grid passes the checks, one without the ridges of the scan, with other sites or by the paper's method, if that
        passes; its settings say so: `ridge_angle` 0, another `box_size`, `method` "paper".
    """
    started = perf_counter()
    from .boundary import find_boundary
    from .rows import begin_rows
    from .scan.sites import begin_sites

    begin_sites(cloud, settings)
    check_length(cloud, settings)

    checked = perf_counter()
    begin_rows(cloud, settings)
    boundary = find_boundary(cloud, settings, progress=progress)
    found = perf_counter()
    try:
        grid, advanced = _attempt(cloud, boundary, settings, progress)
    except FrontError as error:
        other = _other_attempt(cloud, boundary, settings, progress)
        if other is not None:
            grid, advanced = other
        elif keep_failed and isinstance(error, CertificateError) and len(error.grid.triangles):
            grid, advanced = error.grid.replace(settings=settings), found
        else:
            raise
    ended = perf_counter()
    seconds = {
        "read": read_seconds + checked - started,
        "boundary": found - checked,
        "front": advanced - found,
        "optimize": ended - advanced,
        "total": read_seconds + ended - started,
    }
    return grid.replace(seconds=seconds)


def _attempt(
    cloud: PointCloud, boundary: Boundary, settings: Settings, progress: Progress | None
) -> tuple[Grid, float]:
    """Return a grid that passes the checks, and when its front was done; `FrontError` where there is none."""

    def check(grid: Grid) -> Grid:
        return certified(grid, boundary, settings)

    front, grid, advanced = _checked_grid(cloud, boundary, settings, check, progress)
    return grid.replace(settings=settings, before=grid.before or front.quality), advanced


def _other_attempt(
    cloud: PointCloud, boundary: Boundary, settings: Settings, progress: Progress | None
) -> tuple[Grid, float] | None:
    """Return the same by other settings than those that failed; None where none passes either."""
    from .boundary import find_boundary

    for other in _others(boundary, settings):
        with suppress(ScanTrussError):
            return _attempt(cloud, find_boundary(cloud, other, progress=progress), other, progress)
    return None


def _others(boundary: Boundary, settings: Settings) -> Iterator[Settings]:
    """Settings that may lead to a grid where these do not: rather one without ridges, or a less even one, than none.

    A scan so rough that hardly a grid passes is another one to sites that are a little coarser.
    """
    if boundary.lines.sharp.any():
        settings = settings.replace(ridge_angle=0.0)
        yield settings
    if settings.method == "default":
        if boundary.sites.smooth:
            yield settings.replace(box_size=SITE)
        for size in (share * (settings.box_size or SITE) for share in COARSER):
            if size <= COARSEST:
                yield settings.replace(box_size=size)
        yield settings.replace(method="paper")


def _checked_grid(
    cloud: PointCloud,
    boundary: Boundary,
    settings: Settings,
    check: Callable[[Grid], Grid],
    progress: Progress | None = None,
) -> tuple[Grid, Grid, float]:
    """Return the front and the grid of the first attempt that passes, and when its front was done.

    Method "default" begins with fronts that come to rows, several of them for an effort above quick.
    """
    from .front import advance_front
    from .grid.optimize import optimize_grid
    from .several import several_grids

    faults = []
    if settings.method == "default":
        try:
            return several_grids(cloud, boundary, settings, check, progress)
        except FrontError as error:
            faults.append(error)
    for share in ATTEMPTS:
        try:
            own = settings.replace(length=share * settings.length)
            front = advance_front(cloud, boundary, own, rows=None, progress=progress)
            advanced = perf_counter()
            if progress:
                progress("optimize", 0.0)
            grid = optimize_grid(front, cloud, settings, boundary=boundary, progress=progress)
            return front, check(grid), advanced
        except FrontError as error:
            faults.append(error)
    raise next((fault for fault in faults if isinstance(fault, CertificateError)), faults[0])


def certified(grid: Grid, boundary: Boundary, settings: Settings) -> Grid:
    """Return the grid with its certificate: rather no result than a wrong one that looks right.

    Raises
    ------
    CertificateError
        The grid does not pass. Names the first place of a fault.
    """
    from .grid.proof import certify

    certificate = certify(grid, boundary, settings)
    grid = grid.replace(certificate=certificate)
    if certificate.passed:
        return grid
    words = " and ".join(fault.words for fault in certificate.faults)
    where = next((fault.where for fault in certificate.faults if fault.where), None)
    advice = "try another length, or clean the scan; --keep-failed gives the grid all the same"
    raise CertificateError(f"the grid {words}; {advice}", grid, where)


def check_length(cloud: PointCloud, settings: Settings) -> None:
    """Refuse a member length that this scan cannot carry.

    Raises
    ------
    InputError
        The length is larger than the scan, or smaller than about three point spacings.
    """
    extent = cloud.extent
    spacing = cloud.spacing
    unit = f" {cloud.unit}" if cloud.unit else ""
    if settings.length_field:
        _check_field(settings, extent, spacing)
    if settings.length > extent:
        raise InputError(
            f"length {settings.length:g}{unit} is larger than the scan, whose longest side is {extent:.4g}{unit};"
            f" use at most {length_range(cloud)[1]:g}"
        )
    if settings.length < SPACINGS * spacing * (1 - 1e-9):
        raise InputError(
            f"length {settings.length:g}{unit} is too small for points that are {spacing:.3g}{unit} apart;"
            f" use at least {length_range(cloud)[0]:g}"
        )


def _check_field(settings: Settings, extent: float, spacing: float) -> None:
    """Refuse a length field of which a part cannot be carried."""
    shortest, longest = shortest_and_longest(settings.length_field)
    scale = settings.length / shortest
    unit = f" {settings.unit}" if settings.unit else ""
    if scale * longest > extent:
        raise InputError(
            f"the longest length of the length field, {scale * longest:g}{unit}, is larger than the scan,"
            f" whose longest side is {extent:.4g}{unit}; use shorter ones"
        )
    if settings.length < SPACINGS * spacing * (1 - 1e-9):
        raise InputError(
            f"the shortest length of the length field, {settings.length:g}{unit}, is too small for points that are"
            f" {spacing:.3g}{unit} apart; use at least {round_length(SPACINGS * spacing, 'up'):g}"
        )


def length_range(cloud: PointCloud) -> tuple[float, float]:
    """Return the smallest and the largest sensible member length, rounded to two digits [scan unit]."""
    low = max(SPACINGS * cloud.spacing, GAPS * cloud.gap)
    return round_length(low, "up"), round_length(_usual_extent(cloud) / LARGEST, "down")


def _usual_extent(cloud: PointCloud) -> float:
    """Return the longest side of a scan; of its bulk where a few points lie so far away that they are none of it [scan unit]."""
    from .scan.apart import usual_extent

    usual = float(np.ptp(usual_extent(cloud.points), axis=0).max())
    return usual if 0.0 < usual < 0.5 * cloud.extent else cloud.extent


def suggest_length(cloud: PointCloud) -> float:
    """Return a member length that suits the scan, rounded to two digits [scan unit]."""
    low, high = length_range(cloud)
    wished = max(_usual_extent(cloud) / USUAL, USUAL_GAPS * cloud.gap)
    return max(round_length(min(wished, high), "nearest"), low)


def round_length(value: float, way: Literal["up", "down", "nearest"]) -> float:
    """Round to two significant digits."""
    if not value > 0:
        return 0.0
    digits = 1 - math.floor(math.log10(value))
    steps = value * 10.0**digits
    whole = {"up": math.ceil(steps - 1e-9), "down": math.floor(steps + 1e-9), "nearest": round(steps)}[way]
    return float(f"{whole}e{-digits}")
