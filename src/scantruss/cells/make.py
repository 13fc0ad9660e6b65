"""Grids of quads and hexagons, made of a finished grid of triangles, with certificates of their own."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ..check.certify import certified
from ..check.limits import PLACES_KEPT
from ..errors import CertificateError
from ..grid.certificate import Fault, place_of
from ..grid.grid import Grid
from ..grid.panels import PLANAR_ENOUGH, planarity_of
from ..runtime.progress import Progress
from ..surface.scratch import with_own_scratch

#: shares of how far nodes may be off the scan with which panels are made planar, until a grid passes; with none it stays as it is
SHARES_OFF_SCAN = (1.0, 0.5, 0.0)
TIMES_ROWS_TRIED = 5  # times that other starts of rows are tried where quads fail the checks

if TYPE_CHECKING:
    from ..boundary.find import Boundary
    from ..constraints.find import Constraints
    from ..improve.working_mesh import WorkingMesh
    from ..settings import Settings
    from ..surface.samples import SurfaceSamples


def settings_of_triangles(settings: Settings) -> Settings:
    """Return the settings of the triangles that the cells are made of: larger ones for hexagons, made with little effort for quads."""
    if settings.cells == "quad":
        return settings.replace(effort="quick")
    if settings.cells == "hexagon":
        from .hexagons import TRIANGLE_MEMBER  # which other grids do not load

        closed = settings.closed_boundary_length
        return settings.replace(length=TRIANGLE_MEMBER * settings.length, fill_holes=closed, fixed=[])
    return settings


def judging_settings(settings: Settings) -> Settings:
    """Return the settings by which a certificate judges: members of the boundary of hexagons are as long as those of the triangles."""
    if settings.cells == "hexagon":
        from .hexagons import TRIANGLE_MEMBER

        return settings.replace(max_length=TRIANGLE_MEMBER * settings.max_length)
    return settings


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
        `cells`, `planar`.
    progress : callable, optional
        Called with ("cells", share); may raise to stop.

    Raises
    ------
    FrontError
        The grid does not pass the checks.
    """
    if settings.cells == "triangle":
        return grid
    if settings.cells == "hexagon":
        from .hexagons import hexagons_of

        made = hexagons_of(grid, samples, boundary, constraints, settings, progress=progress)
        return _judged(made, samples, boundary, constraints, settings)
    from .quads import ROW_STARTS, STARTS_TRIED, quads_of  # needs scipy, which other grids do not load

    first: CertificateError | None = None
    for begin in range(
        0, min(len(ROW_STARTS), TIMES_ROWS_TRIED * STARTS_TRIED[settings.effort]), STARTS_TRIED[settings.effort]
    ):
        made = quads_of(grid, samples, boundary, constraints, settings, begin=begin, progress=progress)
        try:
            return _judged(made, samples, boundary, constraints, settings)
        except CertificateError as error:
            first = first or error
    assert first is not None
    raise first


def _judged(
    made: Grid, samples: SurfaceSamples, boundary: Boundary, constraints: Constraints, settings: Settings
) -> Grid:
    """Return a grid of cells, made planar if that is wanted, with its certificate."""
    if not settings.planar:
        return certified_cells(made.replace(settings=settings), samples, boundary, settings)
    from ..improve.images import Images
    from ..improve.working_mesh import WorkingMesh
    from .hexagons import made_alike
    from .planar import make_planar  # needs scipy, which other grids do not load
    from .stops import at_stops

    surface = with_own_scratch(samples.surface)
    lines, length = constraints.lines, settings.length
    images, plain = Images.of_grid(made.replace(settings=settings)), made
    made = at_stops(made, boundary.stops, length)  # or corners, which were projected onto the scan, would slide
    made = at_stops(made, lines.stops, length, np.unique(made.lines))

    def opened(some: Grid) -> WorkingMesh:
        return WorkingMesh.from_grid(some, surface, boundary.curves, boundary.stops, length, lines)

    refused: CertificateError | None = None
    for reach in SHARES_OFF_SCAN:
        mesh, flat = opened(made), plain.replace(before=made.quality)
        if reach:
            flat = make_planar(mesh, made, reach)
            off = mesh.deviation()[: len(made.nodes)].copy()
            flat = made_alike(flat.replace(deviation=off, desired=made.desired, before=made.quality), images, opened)
        try:
            return certified_cells(flat.replace(settings=settings), samples, boundary, settings)
        except CertificateError as error:
            refused = refused or error
    assert refused is not None
    raise refused


def certified_cells(grid: Grid, samples: SurfaceSamples, boundary: Boundary, settings: Settings) -> Grid:
    """Return a grid of any cells with its certificate, and the warning of panels that should be planar and are not.

    Raises
    ------
    CertificateError
        It does not pass.
    """
    found = certified(grid, samples, boundary, judging_settings(settings))
    return with_warning_of_planes(found) if settings.planar else found


def with_warning_of_planes(grid: Grid) -> Grid:
    """Return a grid with a warning of the panels that the surface does not let be planar, the worst first."""
    assert grid.certificate is not None and grid.panels is not None
    off = planarity_of(grid.nodes, grid.panels)
    bent = np.flatnonzero(off > PLANAR_ENOUGH)
    if not len(bent):
        return grid
    worst = bent[np.argsort(-off[bent], kind="stable")]
    middles = [grid.nodes[grid.panel_loops[p]].mean(axis=0) + grid.origin for p in worst[:PLACES_KEPT].tolist()]
    first, *others = map(place_of, middles)
    words = (
        f"has {len(bent)} of {len(off)} panels that the surface does not let be planar, a corner {off[worst[0]]:.2%} of the"
        " diagonal off"
    )
    if grid.cells == "quad" and grid.settings is not None and grid.settings.rows != "curvature":
        words += "; rows along the curvature may be (--rows curvature)"
    warning = Fault("plane", words, first, tuple(others))
    return grid.replace(certificate=replace(grid.certificate, warnings=(*grid.certificate.warnings, warning)))
