"""Grids of quads and hexagons, made of a finished grid of triangles, with certificates of their own."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..check.certify import certified
from ..grid.grid import Grid
from ..runtime.progress import Progress
from .quads import quads_of

if TYPE_CHECKING:
    from ..boundary.find import Boundary
    from ..constraints.find import Constraints
    from ..settings import Settings
    from ..surface.samples import SurfaceSamples


def with_cells(
    grid: Grid,
    samples: SurfaceSamples,
    boundary: Boundary,
    constraints: Constraints,
    settings: Settings,
    *,
    progress: Progress | None = None,
) -> Grid:
    """Return the grid of the cells that the settings ask for, made of one of triangles, with its certificate.

    Parameters
    ----------
    grid : Grid
        Of triangles, that passes the checks.
    samples, boundary, constraints
        What it was made with.
    settings : Settings
        `cells`.
    progress : callable, optional
        Called with ("cells", share); may raise to stop.

    Raises
    ------
    FrontError
        The grid does not pass the checks.
    """
    if settings.cells == "triangle":
        return grid
    made = quads_of(grid, samples, boundary, constraints, settings, progress=progress)
    return certified(made.replace(settings=settings), samples, boundary, settings)
