"""Several fronts, the best of their grids kept (`effort` best): what a front leaves decides how regular a grid can become."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
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
) -> tuple[Grid, Grid]:
    """Return the front and the grid of least energy a node out of several; the same for any number of processors.

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
    todo, done = len(FRONTS) + FINALISTS, 0

    def tick() -> None:
        nonlocal done
        done += 1
        if progress:
            progress("optimize", done / todo)

    def first(place: tuple[str, float]) -> tuple[Grid, Grid] | FrontError:
        own = _own_scratch(boundary)
        method, share = place
        try:
            front = advance_front(cloud, own, normal.replace(method=method, length=share * settings.length))
            grid = optimize_grid(front, cloud, normal, boundary=own)
            check(grid)
        except FrontError as error:
            return error
        return front, grid

    def last(pair: tuple[Grid, Grid]) -> tuple[Grid, Grid] | FrontError:
        front, grid = pair
        better = optimize_grid(grid, cloud, settings, boundary=_own_scratch(boundary))
        try:
            check(better)
        except FrontError:
            return pair
        return front, better.replace(before=grid.before)

    def run(work: Callable[..., object], jobs: Sequence[object]) -> list[tuple[Grid, Grid] | FrontError]:
        futures = [pool.submit(work, job) for job in jobs]
        results = []
        for future in futures:
            results.append(future.result())
            tick()
        return results  # type: ignore[return-value]

    with ThreadPoolExecutor(processors()) as pool:
        found = run(first, FRONTS)
        pairs = [pair for pair in found if not isinstance(pair, FrontError)]
        if not pairs:
            assert isinstance(found[0], FrontError)
            raise found[0]
        pairs.sort(key=lambda pair: _badness(pair[1], settings.length))
        finals = [pair for pair in run(last, pairs[:FINALISTS]) if not isinstance(pair, FrontError)]
    return min(finals, key=lambda pair: _badness(pair[1], settings.length))


def _badness(grid: Grid, length: float) -> float:
    return grid_energy(grid, length) / len(grid.nodes)


def _own_scratch(boundary: Boundary) -> Boundary:
    """The same boundary on a scan with room of its own for look-ups."""
    sites = boundary.sites
    return replace(boundary, sites=replace(sites, surface=with_own_scratch(sites.surface)))
