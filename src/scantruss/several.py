"""Several fronts, the best of their grids kept: rows laid in other directions meet the boundary better or worse."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import replace
from time import perf_counter
from typing import TYPE_CHECKING, Any, TypeVar

from .errors import FrontError
from .front import advance_front
from .grid.cover import begin_places
from .grid.equalize import energy_of_node, equalize
from .grid.fixed import check_positions, hold_nodes
from .grid.on_lines import with_rim_members
from .grid.optimize import come_to_rest, improve_further
from .grid.relief import Relief
from .kernels import advance as advancing
from .kernels import landing
from .kernels import search as searching
from .kernels.compile import is_compiled
from .machine import alongside, processors
from .rows import Rows
from .scan.sites import with_own_scratch

if TYPE_CHECKING:
    from .boundary import Boundary
    from .grid.grid import Grid
    from .scan.cloud import PointCloud
    from .settings import Settings

Progress = Callable[[str, float], None]
Result = TypeVar("Result")

WAYS = {  # rows that are tried
    "quick": (Rows(),),
    "normal": tuple(Rows(10.0 * turn) for turn in range(6)),
    "best": tuple(Rows(5.0 * turn, scale) for scale in (1.0, 1.02) for turn in range(12)),
}
SCALES = {  # lengths of the fronts instead, where no rows can be laid: the desired length differs from place to place
    "quick": (1.0,),
    "normal": (1.0, 0.97, 1.03),
    "best": (1.0, 0.97, 1.03, 0.94, 1.06, 0.985, 1.015, 0.955, 1.045),
}
FINALISTS = {"quick": 1, "normal": 1, "best": 3}  # grids that are improved to the end
SMALL = 600.0  # area, in squares of the desired length, up to which `normal` tries all its rows: the rim decides there
BATCHES = 2  # of finalists, where none of the first passes, or all have a triangle worse than this:
POOR = 0.4


def several_grids(
    cloud: PointCloud,
    boundary: Boundary,
    settings: Settings,
    check: Callable[[Grid], Grid],
    progress: Progress | None = None,
) -> tuple[Grid, Grid, float]:
    """Return the front and the grid of least energy a node out of several, and when the fronts were done.

    The same for any number of processors.

    Parameters
    ----------
    check : callable
        Returns the grid with its certificate; raises `FrontError` for one that must not be kept.

    Raises
    ------
    FrontError
        No front has led to a grid that passes; the fault of the best.
    """
    ways, finalists = WAYS[settings.effort], FINALISTS[settings.effort]
    if settings.effort == "normal" and boundary.sites.graded_area > SMALL * settings.length**2:
        ways = ways[:1]
    graded = boundary.sites.graded
    if graded:
        ways = tuple(Rows(scale=scale) for scale in SCALES[settings.effort])
    positions = check_positions(settings.fixed, cloud, boundary.sites.surface, settings.length)
    faults: dict[int, FrontError] = {}

    def advance(number: int) -> Grid | None:
        way = ways[number]
        own = settings.replace(length=way.scale * settings.length) if graded else settings
        return _passed(faults, number, lambda: advance_front(cloud, _own_scratch(boundary), own, rows=way))

    def improve(front: Grid) -> Relief:
        surface = with_own_scratch(boundary.sites.surface)
        relief = Relief.from_grid(front, surface, boundary.rim, boundary.stops, settings.length, boundary.lines)
        hold_nodes(relief, positions)
        equalize(relief)
        return relief

    def finish(number: int, relief: Relief) -> Grid | None:
        def work() -> Grid:
            own = settings if number < len(ways) else settings.replace(effort="normal")
            front = fronts[number % len(ways)]
            improve_further(relief, positions, own)
            closed, before = relief.begin_to_close(front), alongside(lambda: front.quality)
            come_to_rest(relief, boundary.sites, own)
            grid = with_rim_members(relief.to_grid(front, closed()), boundary.lines, settings.length)
            return check(grid.replace(settings=settings, before=before()))

        return _passed(faults, number, work)

    begin_places(boundary.sites, settings.length)  # for the certificate
    fronts = _side_by_side(
        advance, {number: (number,) for number in range(len(ways))}, _part(progress, "front", 0.0, 1.0)
    )
    advanced = perf_counter()
    if progress:
        progress("optimize", 0.0)
    reliefs = _side_by_side(
        improve, {n: (front,) for n, front in fronts.items()}, _part(progress, "optimize", 0.0, 0.5)
    )
    order = _in_order(reliefs, lambda number: energy_of_node(reliefs[number]))
    if order and settings.effort == "best":  # the first once more as normal ends it: on thin parts annealing may lose
        reliefs[order[0] + len(ways)] = improve(fronts[order[0]])
        order.insert(finalists - 1, order[0] + len(ways))
    grids: dict[int, Grid] = {}
    for begin in range(0, min(len(order), BATCHES * finalists), finalists):
        jobs = {number: (number, reliefs[number]) for number in order[begin : begin + finalists]}
        grids |= _side_by_side(finish, jobs, _part(progress, "optimize", 0.5, 1.0))
        if any(grid.quality.shape_min >= POOR for grid in grids.values()):
            break
    if not grids:
        raise faults[order[0] if order else 0]
    best = _in_order(grids, lambda number: (grids[number].quality.shape_min < POOR, energy_of_node(reliefs[number])))[0]
    return fronts[best % len(ways)], grids[best], advanced


def _in_order(numbers: Iterable[int], key: Callable[[int], Any]) -> list[int]:
    """Return the numbers in the order of their keys, which take time: that of a lone one is not asked for."""
    listed = list(numbers)
    return sorted(listed, key=key) if len(listed) > 1 else listed


def _part(progress: Progress | None, stage: str, begin: float, end: float) -> Callable[[float], None] | None:
    """Report a share of a part of a stage."""
    return (lambda share: progress(stage, begin + (end - begin) * share)) if progress else None


def _passed(faults: dict[int, FrontError], number: int, work: Callable[[], Grid]) -> Grid | None:
    """What the work returns; None, and its fault written down, where it refuses."""
    try:
        return work()
    except FrontError as error:
        faults[number] = error
        return None


def _side_by_side(
    work: Callable[..., Result | None],
    jobs: Mapping[int, tuple[object, ...]],
    report: Callable[[float], None] | None,
) -> dict[int, Result]:
    """Do the work for each job on all processors; return what came out, in the order of the jobs."""
    done: dict[int, Result] = {}
    workers = min(processors(), len(jobs))
    if workers > 1 and not is_compiled(advancing.advance, searching.search, landing.land_nodes):
        workers = 1  # one thread compiles, others would only wait for it
    with ExitStack() as stack:
        results: Iterable[Result | None]
        if workers < 2:
            results = (work(*arguments) for arguments in jobs.values())
        else:
            pool = stack.enter_context(ThreadPoolExecutor(workers))
            futures = [pool.submit(work, *arguments) for arguments in jobs.values()]
            stack.callback(lambda: [future.cancel() for future in futures])
            results = (future.result() for future in futures)
        for count, (number, result) in enumerate(zip(jobs, results, strict=True), 1):
            if result is not None:
                done[number] = result
            if report:
                report(count / len(jobs))
    return done


def _own_scratch(boundary: Boundary) -> Boundary:
    """Return the same boundary with room of its own for look-ups."""
    sites = boundary.sites
    return replace(boundary, sites=replace(sites, surface=with_own_scratch(sites.surface)))
