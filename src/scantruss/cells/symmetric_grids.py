"""Grids that keep mirror planes or a rotation exactly: made of grids without, cut along the planes and put together of images."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from ..boundary.find import find_boundary
from ..constraints.find import find_constraints
from ..errors import CertificateError, FrontError
from ..surface.samples import sample_surface
from .make import certified_cells, settings_of_triangles, with_cells

if TYPE_CHECKING:
    from ..grid.grid import Grid
    from ..runtime.progress import Progress
    from ..scan.cloud import PointCloud
    from ..settings import Settings

    GridOf = Callable[[PointCloud, Settings], Grid]


def symmetric_grid(
    cloud: PointCloud,
    settings: Settings,
    grid_of: GridOf,
    *,
    progress: Progress | None = None,
    keep_failed: bool = False,
) -> Grid:
    """Return a grid that keeps mirror planes or a rotation exactly: one part with rows on its edges, and its images.

    A first grid shows where the planes cut the surface; a second has these lines as fixed lines and is cut off along them.

    Parameters
    ----------
    cloud : PointCloud
    settings : Settings
        `symmetry` and all others.
    grid_of : callable
        Makes a grid of a cloud by settings without symmetry.
    progress : callable, optional
        ``progress(stage, share)``.
    keep_failed : bool
        Return a grid even if it fails its certificate.

    Raises
    ------
    InputError
        The scan is not symmetric within a tenth of a member.
    FrontError
        No grid passes the checks, or the rows do not follow the edges of the part.
    """
    from ..improve.symmetric import EDGE_LINE, check_boundary_kept, find_symmetries

    symmetries = find_symmetries(np.asarray(cloud.points) + cloud.origin, settings)
    plain = settings.replace(symmetry="")
    refused: FrontError | None = None
    surface = grid_of(cloud, plain.replace(cells="triangle", rows="boundary", planar=False))
    for symmetry, lines in ((each, lines) for each in symmetries for lines in each.edges(surface, settings.length)):
        names = plain.line_names or [f"line {number}" for number in range(1, len(plain.fixed_lines) + 1)]
        lined = plain.replace(
            fixed_lines=[*plain.fixed_lines, *(line.tolist() for line in lines)],
            line_names=[*names, *(f"{EDGE_LINE} {number}" for number in range(1, len(lines) + 1))],
        )
        half = grid_of(cloud, lined)
        own = (half.settings or lined).replace(fixed_lines=plain.fixed_lines, line_names=plain.line_names)
        samples, boundary = find_boundary(sample_surface(cloud, own), own, progress=progress)
        kept = own.replace(symmetry=symmetry.rows)
        for part in range(symmetry.parts):
            try:
                made = symmetry.made(half, lines, settings.length, part)
                check_boundary_kept(made, boundary, settings.length)
                return certified_cells(made.replace(settings=kept), samples, boundary, own)
            except FrontError as error:
                refused = refused or error
    assert refused is not None
    if keep_failed and isinstance(refused, CertificateError):
        return refused.grid
    raise refused


def symmetric_hexagons(
    cloud: PointCloud,
    settings: Settings,
    grid_of: GridOf,
    *,
    progress: Progress | None = None,
    keep_failed: bool = False,
) -> Grid:
    """Return a grid of hexagons that keeps mirror planes or a rotation exactly: the dual of triangles that do.

    Parameters as of `symmetric_grid`.

    Raises
    ------
    InputError
        The scan is not symmetric within a tenth of a member.
    FrontError
        No grid passes the checks.
    """
    from ..improve.mirrored import without_edge_lines
    from ..improve.symmetric import find_symmetries

    *others, last = (each.rows for each in find_symmetries(np.asarray(cloud.points) + cloud.origin, settings))
    asked = settings_of_triangles(settings).replace(cells="triangle", planar=False, symmetry=last)
    for rows in others:
        try:
            triangles = symmetric_grid(cloud, asked.replace(symmetry=rows), grid_of, progress=progress)
            break
        except FrontError:
            continue
    else:
        triangles = symmetric_grid(cloud, asked, grid_of, progress=progress)
    own = triangles.settings or asked
    samples, boundary = find_boundary(sample_surface(cloud, own), own, progress=progress)
    boundary, constraints = find_constraints(samples, boundary, own, ())
    wanted = own.replace(
        cells="hexagon", length=settings.length, fill_holes=settings.fill_holes, fixed=settings.fixed, planar=settings.planar
    )  # fmt: skip
    try:
        return with_cells(without_edge_lines(triangles), samples, boundary, constraints, wanted, progress=progress)
    except CertificateError as error:
        if keep_failed:
            return error.grid
        raise
