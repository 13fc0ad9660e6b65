"""Several fronts, the best of their grids kept (`effort` best): what a front leaves decides how regular a grid can become."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from time import perf_counter
from typing import TYPE_CHECKING

from .errors import FrontError
from .front import advance_front
from .grid.equalize import grid_energy
from .grid.optimize import optimize_grid
from .machine import processors
from .scan.sites import with_own_scratch

if TYPE_CHECKING:
    from .boundary import Boundary
    from .grid.grid import Grid
    from .scan.cloud import PointCloud
    from .settings import Settings

Progress = Callable[[str, float], None]

FRONTS = (  # how the front chooses its triangles, and its length in desired lengths
    ("default", 1.0), ("paper", 1.0), ("default", 0.97), ("paper", 1.07), ("default", 1.03), ("paper", 0.95),
)  # fmt: skip
FINALISTS = 2  # grids that are improved to the end


def several_grids(
    cloud: PointCloud,
    boundary: Boundary,
    settings: Settings,
    check: Callable[[Grid], None],
    progress: Progress | None = None,
) -> tuple[Grid, Grid, float]:
    """Return the front and the grid of least energy a node out of several, and when the fronts were done.

    The same for any number of processors.

    Parameters
    ----------
    check : callable
        Raises `FrontError` for a grid that must not be kept.

    Raises
    ------
    FrontError
        No front has led to a grid that passes; the fault of the first.
    """
    normal = settings.replace(effort="normal")
    faults: dict[int, FrontError] = {}

    def advance(number: int) -> Grid | None:
        method, share = FRONTS[number]
        own = normal.replace(method=method, length=share * settings.length)
        return _passed(faults, number, lambda: advance_front(cloud, _own_scratch(boundary), own))

    def improve(number: int, grid: Grid, own: Settings) -> Grid | None:
        def work() -> Grid:
            better = optimize_grid(grid, cloud, own, boundary=_own_scratch(boundary))
            check(better)
            return better

        return _passed(faults, number, work)

    def badness(number: int) -> float:
        return grid_energy(grids[number], settings.length) / len(grids[number].nodes)

    fronts = _side_by_side(advance, {number: (number,) for number in range(len(FRONTS))}, progress, "front")
    advanced = perf_counter()
    if progress:
        progress("optimize", 0.0)
    half = (lambda _, share: progress("optimize", 0.5 * share)) if progress else None
    rest = (lambda _, share: progress("optimize", 0.5 + 0.5 * share)) if progress else None
    grids = _side_by_side(improve, {n: (n, front, normal) for n, front in fronts.items()}, half, "optimize")
    if not grids:
        raise faults[min(faults)]
    best = sorted(grids, key=badness)[:FINALISTS]
    for number, better in _side_by_side(improve, {n: (n, grids[n], settings) for n in best}, rest, "optimize").items():
        grids[number] = better.replace(before=grids[number].before)
    chosen = min(best, key=badness)
    return fronts[chosen], grids[chosen], advanced


def _passed(faults: dict[int, FrontError], number: int, work: Callable[[], Grid]) -> Grid | None:
    """What the work returns; None, and its fault written down, where it refuses."""
    try:
        return work()
    except FrontError as error:
        faults[number] = error
        return None


def _side_by_side(
    work: Callable[..., Grid | None], jobs: dict[int, tuple[object, ...]], progress: Progress | None, stage: str
) -> dict[int, Grid]:
    """Do the work for each job on all processors; return the grids that came out, in the order of the jobs."""
    done: dict[int, Grid] = {}
    with ThreadPoolExecutor(processors()) as pool:
        futures = {number: pool.submit(work, *arguments) for number, arguments in jobs.items()}
        for count, (number, future) in enumerate(futures.items(), 1):
            grid = future.result()
            if grid is not None:
                done[number] = grid
            if progress:
                progress(stage, count / len(jobs))
    return done


def _own_scratch(boundary: Boundary) -> Boundary:
    """The same boundary on a scan with room of its own for look-ups."""
    sites = boundary.sites
    return replace(boundary, sites=replace(sites, surface=with_own_scratch(sites.surface)))
