"""Grids of quads, from the rows on the scan to nodes on it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..grid.grid import Grid
from ..grid.panels import triangles_of
from ..grid.quality import GridQuality
from ..improve.optimize import project_onto_scan
from ..improve.sliding_nodes import with_boundary_members, with_line_sets
from ..improve.working_mesh import WorkingMesh
from ..runtime.progress import Progress
from ..surface.scratch import with_own_scratch
from .collapse import collapse
from .fine_mesh import FineMesh, fine_mesh
from .lead import Panels
from .pairing import pairs_of
from .quad_mesh import QuadMesh
from .quad_search import Search, search_once
from .row_lengths import row_lengths
from .rows import Guide, RowStart, find_rows, lattice_places, offsets_of_edges, principal_directions, spread_rows
from .stops import at_stops, slide_back

if TYPE_CHECKING:
    from ..boundary.find import Boundary
    from ..constraints.find import Constraints
    from ..settings import Settings
    from ..surface.samples import SurfaceSamples

ROW_STARTS = (
    RowStart(3.0, 6.0),
    RowStart(1.5, 2.0, bent=True),
    RowStart(0.7, 1.0),
    RowStart(3.0, 0.5, bent=True),
    RowStart(0.7, 4.0),
    RowStart(0.3, 0.3, bent=True),
    RowStart(6.0, 3.0),
    RowStart(1.5, 8.0, bent=True),
    RowStart(3.0, 2.0),
    RowStart(0.3, 2.0, bent=True),
)
STARTS_TRIED = {"quick": 1, "normal": 4, "best": 10}  # of them, for each effort
LEFT_BEFORE_ROUND = {"quick": (1,), "normal": (3, 1), "best": (10, 5, 2)}  # starts that are searched in each round
MOST_ROUNDS = {"quick": 2, "normal": 6, "best": 12}  # of the search
LITTLE_LEFT = 0.01  # mean energy of a quad below which no other start can be much better
LEAST_FALL = 0.01  # share of the energy that a round must gain for another to follow
PARTS = 3  # pieces that a member of the triangles becomes in the fine mesh
FIRST_SWEEPS, LAST_SWEEPS_OF_QUADS = 25, 60  # most sweeps before the search and in the end
FIRST_NEAR, LAST_NEAR = 0.4, 0.2  # distance of a node from the centre of its patch that gets it a new one [members]


def quads_of(
    grid: Grid,
    samples: SurfaceSamples,
    boundary: Boundary,
    constraints: Constraints,
    settings: Settings,
    *,
    begin: int = 0,
    progress: Progress | None = None,
) -> Grid:
    """Return a grid of quads over the surface of one of triangles.

    Parameters
    ----------
    grid : Grid
        Of triangles, on the scan.
    samples, boundary, constraints
        What it was made with.
    settings : Settings
        `effort`, `rows`.
    begin : int
        Number of the first start of rows.

    Returns
    -------
    Grid
        With `panels`, all of four nodes, and `before`, the quality before the search; not checked.
    """
    report: Callable[[float], None] = (lambda share: progress("cells", share)) if progress else (lambda share: None)

    def opened(some: Grid) -> WorkingMesh:
        surface = with_own_scratch(samples.surface)
        return WorkingMesh.from_grid(
            some, surface, boundary.curves, boundary.stops, settings.length, constraints.lines, 0.0
        )

    report(0.0)
    grid = at_stops(grid, boundary.stops, settings.length)
    mesh = opened(grid)
    coarse, fine = fine_mesh(grid, mesh, 1), fine_mesh(grid, mesh, PARTS)
    closer = [replace(each, length=each.length * row_lengths(mesh, each.nodes)) for each in (coarse, fine)]
    guide = principal_directions(mesh, len(coarse.nodes)) if settings.rows == "curvature" else None
    starts, tried = ROW_STARTS[begin : begin + STARTS_TRIED[settings.effort]], []
    for number, start in enumerate(starts):
        report(0.5 * number / len(starts))
        on = closer if start.bent else (coarse, fine)
        first, work = _laid(grid, on[0], on[1], start, guide, opened)
        before = work.grid(first).quality
        tried.append(_Tried(work.mean_energy(), number, first, work, before))
        if tried[-1].energy < LITTLE_LEFT:
            break
    _, _, first, work, before = _best_of(tried, settings.effort, report)
    work.renew(LAST_NEAR)
    work.settle(LAST_SWEEPS_OF_QUADS)
    last = work.grid(first)
    mesh = opened(last)
    project_onto_scan(mesh, samples, boundary=not settings.boundary)
    count = len(last.nodes)
    made = last.replace(
        nodes=mesh.net.nodes[:count].copy(),
        deviation=mesh.deviation()[:count].copy(),
        desired=mesh.length * mesh.net.desired[:count] if mesh.graded else None,
    )
    made = with_boundary_members(made, constraints.lines, settings.length)
    report(1.0)
    return with_line_sets(made, constraints.lines, settings.length).replace(before=before)


class _Tried(NamedTuple):
    """A start and what has become of it."""

    energy: float  #: mean of the quads
    number: int
    first: Grid  #: before the search
    work: QuadMesh
    before: GridQuality


def _best_of(tried: list[_Tried], effort: str, report: Callable[[float], None]) -> _Tried:
    """Return the best of some starts after a search: fewer of them are searched in each round."""
    left, searches = LEFT_BEFORE_ROUND[effort], {each.number: Search(each.work) for each in tried}
    for number in range(MOST_ROUNDS[effort]):
        report(0.5 + 0.4 * number / MOST_ROUNDS[effort])
        tried = sorted(tried, key=lambda each: each[:2])[: left[min(number, len(left) - 1)]]
        last = tried[0].energy
        twice = number > 0 and effort != "quick"
        tried = [each._replace(energy=search_once(searches[each.number], twice=twice)) for each in tried]
        if min(tried, key=lambda each: each[:2]).energy > (1.0 - LEAST_FALL) * last:
            break
    return min(tried, key=lambda each: each[:2])


def _laid(
    grid: Grid,
    coarse: FineMesh,
    fine: FineMesh,
    start: RowStart,
    guide: Guide | None,
    opened: Callable[[Grid], WorkingMesh],
) -> tuple[Grid, QuadMesh]:
    """Return the quads of one start as a grid, and the same settled but not yet searched."""
    rows = spread_rows(find_rows(coarse, start, guide), coarse, fine)
    lattice = collapse(fine, lattice_places(fine, rows), offsets_of_edges(fine, rows))
    panels = Panels(lattice, *pairs_of(lattice))
    panels.lead_all()
    nodes, quads, _, chains = panels.result()
    fixed = np.zeros(len(nodes), np.bool_)
    known = lattice.source < len(grid.nodes)
    fixed[: len(known)][known] = grid.fixed[lattice.source[known]]
    used, quads = np.unique(quads, return_inverse=True)
    quads, chains = quads.reshape(-1, 4), np.searchsorted(used, chains)
    first = _grid(grid, nodes[used], quads, fixed[used], chains)
    mesh = opened(first)
    slide_back(mesh, len(first.nodes))
    work = QuadMesh(mesh, quads, chains)
    for _ in range(2):
        work.settle(FIRST_SWEEPS)
        work.renew(FIRST_NEAR)
    return first, work


def _grid(like: Grid, nodes: np.ndarray, quads: np.ndarray, fixed: np.ndarray, chains: np.ndarray) -> Grid:
    """Return quads as a grid, with the chains inside as its lines."""
    bare = like.replace(
        nodes=nodes, triangles=triangles_of(nodes, quads), panels=quads, fixed=fixed, lines=np.zeros((0, 2), np.int64),
        line_sets=(), deviation=None, desired=None,
    )  # fmt: skip
    at_boundary = np.zeros(len(nodes), np.bool_)
    single = bare.edges[bare.edge_uses == 1]
    at_boundary[single.ravel()] = True
    count = len(nodes)
    inner = np.sort(chains, axis=1)
    inner = inner[~np.isin(inner @ [count, 1], single @ [count, 1])]
    return bare.replace(lines=inner)
