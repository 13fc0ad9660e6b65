"""The whole chain in one call: scan -> boundary -> front -> grid (Fig. 4)."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Literal

import numpy as np

from .errors import FrontError, InputError
from .settings import Settings

if TYPE_CHECKING:
    from .boundary import Boundary
    from .grid.grid import Grid
    from .scan.cloud import PointCloud
    from .scan.sites import Sites

Progress = Callable[[str, float], None]  #: progress(stage, share done); may raise to cancel

SPACINGS = 3.0  #: a member needs this many point spacings: fewer points than that do not tell a rim from a gap
GAPS = 2.2  #: ... and where points lie at random, this many distances to the sixth neighbour
USUAL_GAPS = 3.5  #: what suits evenly meshed scans, where nobody said a length
USUAL = 25.0  #: members along the longest side of a scan, where nobody said a length
LARGEST = 6.0  #: above a sixth of the scan's extent a grid says little of its shape
ATTEMPTS = (1.0, 0.97, 1.04)  #: desired lengths of the front, one after the other until a grid passes all checks
COVER = 1.2  #: members from the nearest node at which a part of the scan counts as left out
UNEVEN = 0.4  #: standard deviation of the lengths, in mean lengths, from which on a grid follows no surface
ASTRAY = 0.5  #: members from the scan, beside the radius of the holes that are closed, at which a triangle has left it
LEFT_OUT = 0.2  #: share of the scan that a grid may leave out


def grid_from_points(points: np.ndarray, settings: Settings, *, progress: Progress | None = None) -> Grid:
    """Return the grid of an array of points.

    Parameters
    ----------
    points : (N, 3) array
        Measured points [scan unit].
    settings : Settings
        Desired member length and all the rest.
    progress : callable, optional
        ``progress(stage, share)``, called now and then; may raise to cancel.

    Returns
    -------
    Grid
        With `settings`, `before` (quality before the optimization) and `seconds` of each stage.
    """
    from .scan.cloud import PointCloud

    started = perf_counter()
    cloud = PointCloud.from_array(points, unit=settings.unit)
    return grid_from_cloud(cloud, settings, progress=progress, read_seconds=perf_counter() - started)


def grid_from_scan(path: str | Path, settings: Settings, *, progress: Progress | None = None) -> Grid:
    """Return the grid of a scan file; see `grid_from_points`."""
    from .scan.readers import read_points

    started = perf_counter()
    cloud = read_points(path, unit=settings.unit)
    return grid_from_cloud(cloud, settings, progress=progress, read_seconds=perf_counter() - started)


def grid_from_cloud(
    cloud: PointCloud, settings: Settings, *, progress: Progress | None = None, read_seconds: float = 0.0
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
    read_seconds : float
        What reading took [s], for the table of times.
    """
    started = perf_counter()
    check_length(cloud, settings)
    from .boundary import find_boundary

    checked = perf_counter()
    boundary = find_boundary(cloud, settings, progress=progress)
    found = perf_counter()

    def check(grid: Grid) -> None:
        check_grid(grid)
        check_boundary(grid, boundary)
        check_cover(grid, boundary.sites, settings)

    front, grid, advanced = _checked_grid(cloud, boundary, settings, check, progress)
    ended = perf_counter()
    seconds = {
        "read": read_seconds + checked - started,
        "boundary": found - checked,
        "front": advanced - found,
        "optimize": ended - advanced,
        "total": read_seconds + ended - started,
    }
    return grid.replace(settings=settings, before=grid.before or front.quality, seconds=seconds)


def _checked_grid(
    cloud: PointCloud,
    boundary: Boundary,
    settings: Settings,
    check: Callable[[Grid], None],
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
            check(grid)
            return front, grid, advanced
        except FrontError as error:
            faults.append(error)
    raise faults[0]


def check_grid(grid: Grid) -> None:
    """Refuse a grid that is none: rather no result than a wrong one that looks right.

    Raises
    ------
    FrontError
        No triangles, or the grid is not manifold, not orientable, or its members differ wildly.
    """
    if len(grid.triangles) == 0:
        raise FrontError("no triangle could be made; use another length, or check the scan", grid)
    found = grid.topology
    if not (found.manifold and found.orientable):
        fault = "not manifold" if not found.manifold else "not orientable"
        raise FrontError(
            f"the grid came out {fault}, so it is not written; try a smaller length, or clean the scan", grid
        )
    uneven = grid.quality.length_cv
    if uneven > UNEVEN:
        raise FrontError(
            f"the lengths of the members came out {uneven:.0%} apart, so the grid is not written;"
            " try a smaller length, or clean the scan",
            grid,
        )


def check_boundary(grid: Grid, boundary: Boundary) -> None:
    """Refuse a grid that has come apart or has openings that the scan has not.

    Raises
    ------
    FrontError
        The grid has other components than the scan, or more boundary loops.
    """
    found, pieces, loops = grid.topology, len(boundary.sites.pieces), len(boundary.loops)
    fault = ""
    if found.components != pieces:
        fault = f"in {found.components} pieces where the scan has {pieces}"
    elif found.boundary_loops > loops:
        fault = f"with {found.boundary_loops} boundary loops where the scan has {loops}"
    if fault:
        raise FrontError(
            f"the grid came out {fault}, so it is not written; try a smaller length, or clean the scan", grid
        )


def check_cover(grid: Grid, sites: Sites, settings: Settings) -> None:
    """Refuse a grid that has left out a good part of the scan, or covers what the scan does not.

    Raises
    ------
    FrontError
        More than a fifth of the scan is farther than 1.2 members from every node; or the middle of a triangle is farther from the
        scan than the holes that are closed are wide. Names a place there.
    """
    places = np.ascontiguousarray(sites.surface.mean[np.isin(sites.piece, sites.pieces)])
    far = np.empty(len(places), np.bool_)
    count = _find_far(places, grid.nodes, COVER * settings.length, far)
    if count > LEFT_OUT * len(places):
        raise _astray(grid, places[np.argmax(far)], f"leaves out {count / len(places):.0%} of the scan")
    middles = np.ascontiguousarray(grid.nodes[grid.triangles].mean(axis=1))
    far = np.empty(len(middles), np.bool_)
    if _find_far(middles, places, (ASTRAY + settings.smallest_hole / (2 * math.pi)) * settings.length, far):
        raise _astray(grid, middles[np.argmax(far)], "covers what the scan does not")


def _find_far(places: np.ndarray, others: np.ndarray, reach: float, far: np.ndarray) -> int:
    """Mark the places that have none of the others within reach; returns their number."""
    from .kernels.boxes import new_boxes
    from .kernels.cover import mark_far

    boxes = new_boxes(others.min(axis=0), others.max(axis=0), reach, len(others), len(others))
    return mark_far(places, others, boxes, reach, far)


def _astray(grid: Grid, place: np.ndarray, what: str) -> FrontError:
    """The refusal of a grid that does not lie where the scan does."""
    x, y, z = (place + grid.origin).tolist()
    return FrontError(
        f"the grid {what}, so it is not written; try another length, or clean the scan of what is not surface",
        grid,
        (x, y, z),
    )


def check_length(cloud: PointCloud, settings: Settings) -> None:
    """Refuse a member length that this scan cannot carry.

    Raises
    ------
    InputError
        The length is larger than the scan, or smaller than about three point spacings.
    """
    extent = extent_of(cloud)
    spacing = cloud.spacing
    unit = f" {cloud.unit}" if cloud.unit else ""
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


def extent_of(cloud: PointCloud) -> float:
    """Longest side of the box around the points [scan unit]."""
    return float(np.ptp(cloud.points, axis=0).max())


def length_range(cloud: PointCloud) -> tuple[float, float]:
    """Return the smallest and the largest sensible member length, rounded to two digits [scan unit]."""
    low = max(SPACINGS * cloud.spacing, GAPS * cloud.gap)
    return round_length(low, "up"), round_length(extent_of(cloud) / LARGEST, "down")


def suggest_length(cloud: PointCloud) -> float:
    """Return a member length that suits the scan, rounded to two digits [scan unit]."""
    low, high = length_range(cloud)
    wished = max(extent_of(cloud) / USUAL, USUAL_GAPS * cloud.gap)
    return max(round_length(min(wished, high), "nearest"), low)


def round_length(value: float, way: Literal["up", "down", "nearest"]) -> float:
    """Round to two significant digits."""
    if not value > 0:
        return 0.0
    digits = 1 - math.floor(math.log10(value))
    steps = value * 10.0**digits
    whole = {"up": math.ceil(steps - 1e-9), "down": math.floor(steps + 1e-9), "nearest": round(steps)}[way]
    return float(f"{whole}e{-digits}")
