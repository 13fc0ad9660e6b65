"""How the certificate of a grid is made.

A grid that does not pass is refused by `pipeline`: rather no result than a wrong one that looks right.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import CertificateError
from ..grid.certificate import Certificate, Fault, Worst, place_of
from ..kernels.mesh.figures import folds_of
from ..runtime.parallel import side_by_side
from .coverage import distances_to_grid, distances_to_scan, places_to_reach
from .crossings import find_crossings
from .defects import faults_in_space, faults_of_topology
from .irregular import count_irregular
from .sheets import faults_on_sheets, nodes_of_samples

if TYPE_CHECKING:
    from ..boundary.find import Boundary
    from ..grid.grid import Grid
    from ..kernels.geometry.boxes import SearchBoxes
    from ..settings import Settings
    from ..surface.samples import SurfaceSamples

COVER_REACH = 0.5  # distance within which a part of the scan and a triangle are in reach of each other [member lengths]


def certify(grid: Grid, samples: SurfaceSamples, boundary: Boundary, settings: Settings) -> Certificate:
    """Return the certificate of a grid.

    Parameters
    ----------
    grid : Grid
        Of the same origin as the scan.
    samples : SurfaceSamples
        The surface samples of the scan.
    boundary : Boundary
        Boundary loops of the scan.
    settings : Settings
        `length` is the desired member length, `fill_holes` tells which holes are closed, `fixed` where nodes must be.

    Returns
    -------
    Certificate
        Nothing is raised where it does not pass; see `Certificate.faults`.
    """
    empty = "has no triangles" if len(grid.triangles) == 0 else ""
    if empty or not np.isfinite(grid.nodes).all():
        fault = Fault("empty", empty or "has nodes that are nowhere")
        return replace(_topology(grid, samples, boundary, settings), faults=(fault,))
    length = settings.length
    places, boxes = places_to_reach(samples, length)
    nearest, left, certificate = side_by_side(
        lambda: nodes_of_samples(grid, samples, length),
        lambda: distances_to_grid(places, boxes, grid, length),
        lambda: replace(_topology(grid, samples, boundary, settings), **_extremes(grid, settings)),
    )
    cuts = find_crossings(grid.nodes, grid.triangles)
    certificate = replace(certificate, crossings=len(cuts), **_from_scan(grid, length, places, boxes))
    on_sheets = faults_on_sheets(grid, samples, nearest)
    certificate = replace(certificate, **_from_grid(grid, samples, length, places, left))
    faults = [*faults_of_topology(grid, certificate, boundary), *faults_in_space(grid, certificate, cuts, settings)]
    known = {fault.kind for fault in faults}
    faults += [fault for fault in on_sheets if fault.kind not in known]
    return replace(certificate, faults=tuple(faults))


def certified(grid: Grid, samples: SurfaceSamples, boundary: Boundary, settings: Settings) -> Grid:
    """Return the grid with its certificate: rather no result than a wrong one that looks right.

    Raises
    ------
    CertificateError
        The grid does not pass. Names the first place of a fault.
    """
    certificate = certify(grid, samples, boundary, settings)
    grid = grid.replace(certificate=certificate)
    if certificate.passed:
        return grid
    words = " and ".join(fault.words for fault in certificate.faults)
    where = next((fault.where for fault in certificate.faults if fault.where), None)
    advice = "try another length, or clean the scan; --keep-failed gives the grid all the same"
    raise CertificateError(f"the grid {words}; {advice}", grid, where)


def _topology(grid: Grid, samples: SurfaceSamples, boundary: Boundary, settings: Settings) -> Certificate:
    """Return what a grid is and what its scan is, apart from where they lie."""
    found = grid.topology
    closed = found.manifold and found.orientable
    return Certificate(
        unit=grid.unit,
        reach=COVER_REACH * settings.length,
        manifold=found.manifold,
        orientable=found.orientable,
        pieces=found.components,
        scan_pieces=len(samples.pieces),
        boundary_loops=found.boundary_loops,
        scan_loops=len(boundary.loops),
        euler=found.euler,
        handles=(2 * found.components - found.boundary_loops - found.euler) // 2 if closed else None,
    )


def _from_scan(grid: Grid, length: float, places: np.ndarray, boxes: SearchBoxes) -> dict[str, Any]:
    """Return how far the grid lies from the scan, places (P, 3) of which are given by box."""
    middles = grid.nodes[grid.triangles].mean(axis=1)
    members = np.full(len(middles), length) if grid.desired is None else grid.desired[grid.triangles].mean(axis=1)
    at_nodes = np.full(len(grid.nodes), length) if grid.desired is None else grid.desired
    away = distances_to_scan(np.concatenate([middles, grid.nodes]), places, boxes, length)
    off_surface, off = away[: len(middles)], away[len(middles) :]
    if grid.deviation is not None:  # where a patch ends at a boundary it may say more than there is
        off = np.where(np.isnan(grid.deviation), np.nan, np.fmin(off, grid.deviation))  # not over closed holes
    return {
        "grid_within_reach": float((off_surface <= COVER_REACH * members).mean()),
        "farthest_triangle": _worst(off_surface, middles, grid, length / members),
        "node_deviation": _worst(off, grid.nodes, grid, length / at_nodes),
    }


def _from_grid(
    grid: Grid, samples: SurfaceSamples, length: float, places: np.ndarray, left: np.ndarray
) -> dict[str, Any]:
    """Return how far the scan lies from the grid; `left` (P,) is the distance of places (P, 3) of the scan from it."""
    local = length * samples.surface.field[samples.kept]
    return {
        "scan_within_reach": float((left <= COVER_REACH * local).mean()),
        "farthest_scan": _worst(left, places, grid, length / local),
    }


def _extremes(grid: Grid, settings: Settings) -> dict[str, Any]:
    """Return the worst members, angles, fold and fixed node, and how many irregular nodes there are."""
    halves = grid.nodes[grid.edges].mean(axis=1)
    corners = grid.nodes[grid.triangles].reshape(-1, 3)
    irregular, forced = count_irregular(grid)
    return {
        "shortest_member": _worst(grid.lengths, halves, grid, -1.0),
        "longest_member": _worst(grid.lengths, halves, grid),
        "smallest_angle": _worst(grid.angles.ravel(), corners, grid, -1.0),
        "largest_angle": _worst(grid.angles.ravel(), corners, grid),
        "sharpest_fold": _worst(fold_angles(grid), halves, grid, -1.0),
        "fixed_error": _fixed_error(grid, settings),
        "irregular": irregular,
        "irregular_forced": forced,
    }


def _worst(values: np.ndarray, places: np.ndarray, grid: Grid, weight: float | np.ndarray = 1.0) -> Worst | None:
    """Return the value (K,) that is largest times its weight, the smallest for weight -1, and its place (K, 3); None of none."""
    known = np.flatnonzero(np.isfinite(values))
    if len(known) == 0:
        return None
    at = known[np.argmax((weight * values)[known])]
    return Worst(float(values[at]), place_of(places[at] + grid.origin))


def fold_angles(grid: Grid) -> np.ndarray:
    """Return the angle between the first two triangles at each member, (E,) [degree]: 180 level, 0 folded flat; NaN at the boundary."""
    angles = np.empty(len(grid.edges))
    folds_of(grid.nodes, grid.triangles, grid.edge_triangles, angles)
    return angles


def _fixed_error(grid: Grid, settings: Settings) -> Worst | None:
    """Return the largest distance of a position of the settings from the nearest fixed node."""
    if not settings.fixed:
        return None
    positions = np.array(settings.fixed) - grid.origin
    nodes = grid.nodes[grid.fixed] if grid.fixed.any() else grid.nodes
    return _worst(np.linalg.norm(positions[:, None] - nodes, axis=2).min(axis=1), positions, grid)
