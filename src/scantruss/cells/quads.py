"""Grids of quads, from the rows on the scan to nodes on it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..grid.grid import Grid
from ..grid.panels import triangles_of
from ..improve.optimize import project_onto_scan
from ..improve.sliding_nodes import with_boundary_members, with_line_sets
from ..improve.working_mesh import WorkingMesh
from ..runtime.progress import Progress
from ..surface.scratch import with_own_scratch
from .collapse import collapse_to_lattice
from .fine_mesh import FineMesh, fine_mesh
from .last_settling import settle_last, shortfall, wide_corners
from .lead import Panels
from .pairing import pairs_of
from .quad_mesh import QuadMesh
from .quad_search import IRREGULAR_PRICE, LED_IRREGULAR_PRICE, Search, search_quads_once
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
    RowStart(1.5, 1.0),
    RowStart(3.0, 4.0, bent=True),
    RowStart(0.3, 2.0),
    RowStart(0.7, 0.5, bent=True),
    RowStart(1.5, 8.0),
    RowStart(6.0, 1.0, bent=True),
    RowStart(3.0, 1.0),
    RowStart(0.7, 2.0, bent=True),
    RowStart(0.3, 8.0),
    RowStart(3.0, 8.0, bent=True),
)
STARTS_TRIED = {"quick": 1, "normal": 4, "best": 20}  # of them, for each effort
LEFT_BEFORE_ROUND = {
    "quick": (1,),
    "normal": (2,),
    "best": (10, 5, 4),
}  # starts that are searched in each further round
MOST_ROUNDS = {"quick": 1, "normal": 6, "best": 12}  # further rounds of the search
LITTLE_LEFT = 0.05  # cost of a quad after a search below which no other start can be much better
LEAST_FALL = 0.01  # share of the cost that a round must gain for another to follow
PARTS_OF_MEMBER = 3  # pieces that a member of the triangles becomes in the fine mesh
FIRST_SWEEPS = 25  # most sweeps before the search
FIRST_NEAR = 0.4  # distance of a node from the centre of its patch that gets it a new one before the search [members]


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
    coarse, fine = fine_mesh(grid, mesh, 1), fine_mesh(grid, mesh, PARTS_OF_MEMBER)
    closer = [replace(each, length=each.length * row_lengths(mesh, each.nodes)) for each in (coarse, fine)]
    guide = principal_directions(mesh, len(coarse.nodes)) if settings.rows == "curvature" else None
    price = IRREGULAR_PRICE if guide is None else LED_IRREGULAR_PRICE
    starts, tried = ROW_STARTS[begin : begin + STARTS_TRIED[settings.effort]], []
    for number, start in enumerate(starts):
        report(0.6 * number / len(starts))
        on = closer if start.bent else (coarse, fine)
        first, work = _laid(grid, on[0], on[1], start, guide, opened)
        before, search = work.grid(first), Search(work, price)
        tried.append(_Tried(search_quads_once(search, twice=False), number, first, search, before))
        if tried[-1].cost < LITTLE_LEFT and not wide_corners(work):
            break
    tried = _best_of(tried, settings.effort, report)
    for each in tried:
        settle_last(each.search.mesh)
    best = min(tried, key=lambda each: (wide_corners(each.search.mesh), shortfall(each.search), each.number))
    last = best.search.mesh.grid(best.first)
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
    return with_line_sets(made, constraints.lines, settings.length).replace(before=best.before.quality)


class _Tried(NamedTuple):
    """A start and what has become of it."""

    cost: float  #: of a quad
    number: int
    first: Grid  #: before the search
    search: Search
    before: Grid  #: after the first settling


def _best_of(tried: list[_Tried], effort: str, report: Callable[[float], None]) -> list[_Tried]:
    """Return the best few of some starts that were searched once after further rounds: fewer of them are searched in each.

    Those with a panel that is all but a triangle are left where another has none.
    """
    left, refined = LEFT_BEFORE_ROUND[effort], effort != "best"
    for number in range(MOST_ROUNDS[effort]):
        report(0.6 + 0.3 * number / MOST_ROUNDS[effort])
        sound = [each for each in tried if not wide_corners(each.search.mesh)]
        tried = sorted(sound or tried, key=lambda each: each[:2])[: left[min(number, len(left) - 1)]]
        last = tried[0].cost
        tried = [each._replace(cost=search_quads_once(each.search, twice=effort != "quick")) for each in tried]
        stagnates = number >= len(left) - 1 and tried[0].cost > (1.0 - LEAST_FALL) * last
        if stagnates and refined:
            break
        if stagnates:
            for each in tried:
                each.search.refine()
            refined = True
    return tried


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
    lattice = collapse_to_lattice(fine, lattice_places(fine, rows), offsets_of_edges(fine, rows))
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
