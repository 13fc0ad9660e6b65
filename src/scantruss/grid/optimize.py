"""Grid optimization and adjustment (Sec. 4): what happens to a grid after the front."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from .equalize import equalize, finish
from .fixed import check_positions, fix_nearest_nodes, fix_nodes, hold_nodes
from .flips import flip_by_angle
from .grid import Grid
from .kicks import search_widely
from .on_lines import with_rim_members
from .relief import Relief
from .smoothing import smooth

if TYPE_CHECKING:
    from ..boundary import Boundary
    from ..scan.cloud import PointCloud
    from ..scan.sites import Sites
    from ..settings import Settings

Progress = Callable[[str, float], None]


def optimize_grid(
    grid: Grid,
    cloud: PointCloud,
    settings: Settings,
    fixed: Sequence[Sequence[float]] | np.ndarray | None = None,
    *,
    boundary: Boundary | None = None,
    progress: Progress | None = None,
) -> Grid:
    """Return a grid with better triangles and more even members, on the scan, with nodes at the fixed positions.

    Parameters
    ----------
    grid : Grid
        What the front has left.
    cloud : PointCloud
        The scan it lies on, of the same origin.
    settings : Settings
        `method`: "paper" is Sec. 4 to the letter, "default" equalizes and searches.
    fixed : (K, 3), optional
        Positions that must become nodes, in the scan's own frame [scan unit]; `settings.fixed` if left out.
    boundary : Boundary, optional
        Boundary of the cloud; found anew if left out.
    progress : callable, optional
        Called with ("optimize", share); may raise to stop.

    Returns
    -------
    Grid
        With `before`, the quality of `grid`, and `deviation`. The topology is that of `grid`.

    Raises
    ------
    InputError
        A fixed position is farther than half a member from the scan or closer than that to another.
    """
    from ..boundary import find_boundary

    if boundary is None:
        boundary = find_boundary(cloud, settings)
    sites = boundary.sites
    surface = sites.surface
    positions = check_positions(settings.fixed if fixed is None else fixed, cloud, surface, settings.length)
    if len(grid.triangles) == 0:
        return grid.replace(settings=settings, before=grid.quality)
    relief = Relief.from_grid(grid, surface, boundary.rim, boundary.stops, settings.length, boundary.lines)
    before = relief.to_grid(grid).quality
    report = (lambda share: progress("optimize", share)) if progress else None
    if report:
        report(0.1)
    improve(relief, sites, positions, settings, report)
    if report:
        report(1.0)
    better = with_rim_members(relief.to_grid(grid), boundary.lines, settings.length)
    return better.replace(settings=settings, before=before)


def improve(
    relief: Relief,
    sites: Sites,
    positions: np.ndarray,
    settings: Settings,
    report: Callable[[float], None] | None = None,
) -> None:
    """Improve an opened grid by the method of the settings, make nodes at the positions (K, 3) and land on the scan."""
    if settings.method == "paper":
        flip_by_angle(relief.net)
        if len(positions):
            fix_nearest_nodes(relief, positions)
            flip_by_angle(relief.net)
        smooth(relief, settings)
        land(relief, sites)
    else:
        hold_nodes(relief, positions)
        equalize(relief, report)
        improve_further(relief, positions, settings, report)
        come_to_rest(relief, sites, settings)


def improve_further(
    relief: Relief, positions: np.ndarray, settings: Settings, report: Callable[[float], None] | None = None
) -> None:
    """Improve an equalized grid with the effort of the settings, and make the nodes that are still missing."""
    search_widely(relief, settings.effort, report)
    fix_nodes(relief, positions)


def come_to_rest(relief: Relief, sites: Sites, settings: Settings) -> None:
    """Settle a grid of which no member changes any more, and land on the scan."""
    finish(relief, settings.prefer)
    land(relief, sites)


def land(relief: Relief, sites: Sites) -> None:
    """Let the nodes down on the scan by patches as narrow as it allows."""
    from ..scan.sites import narrow_surface

    relief.land(*(narrow_surface(sites, points) for points in (40.0, 120.0, np.inf)))
    relief.tell_apart(sites.measured)
