"""Grid optimization and adjustment (Sec. 4): all that is done to a grid after the front."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..grid.grid import Grid
from ..runtime.parallel import side_by_side
from ..runtime.progress import Progress
from ..surface.samples import narrow_surface
from ..surface.scratch import with_own_scratch
from .equalize import equalize, finish
from .fixed_nodes import fix_nearest_nodes, fix_nodes, hold_nodes
from .flips import flip_edges
from .mend import mend_poor_places
from .off_scan import put_on_scan
from .perturbation import LONGER, Spared, search_widely
from .sliding_nodes import with_boundary_members, with_line_sets
from .smoothing import smooth
from .working_mesh import Closed, WorkingMesh

if TYPE_CHECKING:
    from ..boundary.find import Boundary
    from ..constraints.find import Constraints
    from ..settings import Settings
    from ..surface.samples import SurfaceSamples

# factor of the weight of folds: a longer search can afford more of it
FOLD_WEIGHT_OF_EFFORT = {"quick": 1.0, "normal": 1.0, "best": 1.6}
TIMES_MENDED = 2  # times that poor places are mended at most, after each of which the mesh comes to rest anew

Report = Callable[[float], None]


def optimize_grid(
    grid: Grid,
    samples: SurfaceSamples,
    boundary: Boundary,
    constraints: Constraints,
    settings: Settings,
    *,
    progress: Progress | None = None,
) -> Grid:
    """Return a grid with better triangles and more even members, on the scan, with nodes at the fixed positions.

    Parameters
    ----------
    grid : Grid
        What the front left behind.
    samples : SurfaceSamples
        The surface samples of the scan, of the same origin.
    boundary : Boundary
    constraints : Constraints
        Fixed nodes, fixed lines and ridges.
    settings : Settings
        `method`: "paper" is Sec. 4 to the letter, "default" equalizes and searches.
    progress : callable, optional
        Called with ("optimize", share); may raise to stop.

    Returns
    -------
    Grid
        With `before`, the quality of `grid`, and `deviation`. The topology is that of `grid`.

    Raises
    ------
    InputError
        No node can be moved to a fixed position.
    """
    if len(grid.triangles) == 0:
        return grid.replace(settings=settings, before=grid.quality)
    report = (lambda share: progress("optimize", share)) if progress else None
    if report:
        report(0.1)
    mesh = improve_first(grid, samples, boundary, constraints, settings, report)
    better = improve_last(mesh, grid, samples, constraints, settings, report)
    if report:
        report(1.0)
    return better


def improve_first(
    grid: Grid,
    samples: SurfaceSamples,
    boundary: Boundary,
    constraints: Constraints,
    settings: Settings,
    report: Report | None = None,
) -> WorkingMesh:
    """Open the grid that a front has left and improve it as far as all fronts are, to be compared.

    By the paper: Delaunay flips, then nodes moved to the fixed positions (Sec. 4.1, 4.2). By default: even members.
    """
    surface = with_own_scratch(samples.surface)
    mesh = WorkingMesh.from_grid(
        grid,
        surface,
        boundary.curves,
        boundary.stops,
        settings.length,
        constraints.lines,
        settings.fold_weight * FOLD_WEIGHT_OF_EFFORT[settings.effort],
    )
    if settings.method == "paper":
        flip_edges(mesh.net)
        if len(constraints.positions):
            fix_nearest_nodes(mesh, constraints.positions)
            flip_edges(mesh.net)
    else:
        hold_nodes(mesh, constraints.positions)
        equalize(mesh, report)
    return mesh


def improve_last(
    mesh: WorkingMesh,
    front: Grid,
    samples: SurfaceSamples,
    constraints: Constraints,
    settings: Settings,
    report: Report | None = None,
) -> Grid:
    """Improve an opened grid to the end, and put it down on the scan.

    By the paper: Taubin smoothing (Sec. 4.1). By default: the search that the effort allows, the fixed nodes that are still
    missing, and a last settling.
    """
    if settings.method == "default":
        search_widely(mesh, settings.effort, report)
        fix_nodes(mesh, constraints.positions)
    return put_down(mesh, front, samples, constraints, settings)


def searched_again(
    mesh: WorkingMesh,
    front: Grid,
    samples: SurfaceSamples,
    constraints: Constraints,
    settings: Settings,
    way: str = "normal",
    spared: Sequence[Spared] = (),
    turn: int = 0,
) -> Grid:
    """Return the grid of a mesh that was put down, searched again in a way of `PERTURBATIONS`, as new nodes leave others uneven."""
    mesh = mesh.for_longer_search() if way == LONGER else mesh
    search_widely(mesh, way, spared=spared, turn=turn)
    return put_down(mesh, front, samples, constraints, settings)


def put_down(
    mesh: WorkingMesh, front: Grid, samples: SurfaceSamples, constraints: Constraints, settings: Settings
) -> Grid:
    """Let a mesh come to rest, and return it as a grid on the scan."""

    def come_to_rest() -> None:
        if settings.method == "paper":
            smooth(mesh, settings)
        else:
            finish(mesh, settings.prefer)
        project_onto_scan(mesh, samples, boundary=not settings.boundary)
        if settings.method == "default":
            put_on_scan(mesh, samples, settings)

    closed, _, _ = side_by_side(lambda: mesh.close(front), lambda: front.quality, come_to_rest)
    for _ in range(TIMES_MENDED if settings.method == "default" else 0):
        if not mend_poor_places(mesh, settings):
            break
        come_to_rest()
        closed = mesh.close(front)
    return closed_grid(mesh, front, constraints, settings, closed)


def closed_grid(
    mesh: WorkingMesh, front: Grid, constraints: Constraints, settings: Settings, closed: Closed | None = None
) -> Grid:
    """Return a mesh as a grid, with the members and nodes on its lines; `closed`, if it was closed already."""
    grid = with_boundary_members(mesh.to_grid(front, closed), constraints.lines, settings.length)
    grid = with_line_sets(grid, constraints.lines, settings.length)
    return grid.replace(settings=settings, before=front.quality)


def project_onto_scan(mesh: WorkingMesh, samples: SurfaceSamples, *, boundary: bool) -> None:
    """Project the nodes onto the scan by patches as narrow as it allows; those of a given boundary stay on it."""
    mesh.project_onto_scan(*(narrow_surface(samples, points) for points in (40.0, 120.0, np.inf)), boundary=boundary)
    mesh.name_distances(samples.measured)
