"""Where a grid runs beyond the boundary of its scan: over more than a member of it, or over most of an opening."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..constraints.network import curves_of
from ..grid.certificate import Fault, place_of
from ..kernels.boundary.curves import distances_from_curves
from ..scan.formats.choose import in_polygon
from .boundaries import COVERED_WITHIN, boundary_beyond, boundary_left
from .distances import distances_to_grid, shares_of_corners
from .limits import HEXAGON_BOUNDARY

if TYPE_CHECKING:
    from ..boundary.find import Boundary, Loop
    from ..grid.grid import Grid
    from ..surface.samples import SurfaceSamples

# distance of the boundary of the scan from that of the grid above which the grid has left it, and over how much of it that is a fault
# where the grid covers it: of 190 grids of shells, twins and real scans one, of a quarry, leaves it so far, over 0.94 [member lengths]
LEFT_BY, LEFT_OVER = 0.75, 1.0
# share of an opening that is left so far, above which it is bridged: 0.42 at most on those
MOST_OF_OPENING = 0.5
FLAT_OPENING = 0.25  # distance of its edge from its mean plane up to which that share is known [member lengths]
LARGEST_OPENING = 25.0  # length around an opening up to which it may be bridged by a grid that passes [member lengths]
AT_OPENING = 0.5  # distance from that plane within which a triangle may lie over it [member lengths]
ALONG_SIDE = 8  # places along a side of a triangle that are looked at


def boundary_faults(grid: Grid, samples: SurfaceSamples, boundary: Boundary, length: float) -> list[Fault]:
    """Return the fault of a grid that does not keep to the boundary of its scan, the gravest of these; parameters as of the others."""
    beyond = boundary_beyond(grid, samples, boundary, length) or boundary_overrun(grid, boundary, length)
    return beyond or boundary_left(grid, boundary, length)


def boundary_overrun(grid: Grid, boundary: Boundary, length: float) -> list[Fault]:
    """Return a fault where a grid runs beyond the boundary of its scan over much of it, though nowhere as far as `boundary_beyond` refuses.

    Parameters as of `boundaries.places_aside`.
    """
    loops = [loop for loop in boundary.loops if loop.cut != "close"]
    chains = grid.boundary_loops
    if not loops or not chains:
        return []
    chained = curves_of([grid.nodes[chain] for chain in chains], [True] * len(chains))
    limit = LEFT_BY * (HEXAGON_BOUNDARY**2 if grid.cells == "hexagon" else 1.0)
    unit = f" {grid.unit}" if grid.unit else ""
    found: list[tuple[float, Fault]] = []
    for loop in loops:
        members = length * (np.ones(len(loop.points)) if loop.desired is None else loop.desired)
        off = np.empty(len(loop.points))
        distances_from_curves(chained, loop.points, off)
        off /= members
        worst = int(off.argmax())
        if off[worst] <= limit:
            continue
        member = float(members.mean())
        beyond = off > limit  # where the grid stops short, the share of the scan that it misses decides
        beyond[beyond] = distances_to_grid(loop.points[beyond], grid, length)[0] <= COVERED_WITHIN * members[beyond]
        words, over = "", _longest_run(beyond) * loop.length / len(off) / member
        if (share := _bridged_share(grid, loop, member)) > MOST_OF_OPENING:
            across = float(np.ptp(loop.points, axis=0).max())
            words = f"bridges {share:.0%} of an opening {across:.3g}{unit} across"
        elif over > LEFT_OVER:
            words = f"runs beyond the boundary of the scan by {off[worst]:.2f} members, over {over:.1f} members of its length"
        if words:
            found.append((float(off[worst]), Fault("beyond", words, place_of(loop.points[worst] + grid.origin))))
    return [max(found, key=lambda each: each[0])[1]] if found else []


def _longest_run(chosen: np.ndarray) -> int:
    """Return how many points of a closed curve that are chosen (M,) bool follow one another."""
    if chosen.all():
        return len(chosen)
    gaps = np.flatnonzero(~chosen)
    return int(np.diff(gaps, append=gaps[0] + len(chosen)).max()) - 1


def _bridged_share(grid: Grid, loop: Loop, member: float) -> float:
    """Return the share of an opening that triangles cover; 0 where that is not known: it is too large, or no plane goes along its edge."""
    if loop.external or loop.length > LARGEST_OPENING * member:
        return 0.0
    middle = loop.points.mean(axis=0)
    axes = np.linalg.svd(loop.points - middle, full_matrices=False)[2]
    edge = (loop.points - middle) @ axes.T
    if np.abs(edge[:, 2]).max() > FLAT_OPENING * member:
        return 0.0
    corners = (grid.nodes[grid.triangles] - middle) @ axes.T
    reach = float(np.linalg.norm(edge, axis=1).max()) + member
    corners = corners[(np.linalg.norm(corners, axis=2) < reach).any(axis=1)]
    places = np.einsum("pc,tcx->tpx", shares_of_corners(ALONG_SIDE), corners)
    inside = in_polygon(places[..., :2].reshape(-1, 2), [edge[:, :2]]).reshape(places.shape[:2])
    inside &= np.abs(places[..., 2]) < AT_OPENING * member
    one, other = (corners[:, 1] - corners[:, 0]).T, (corners[:, 2] - corners[:, 0]).T
    covered = 0.5 * float(inside.mean(axis=1) @ np.abs(one[0] * other[1] - one[1] * other[0])) if len(corners) else 0.0
    x, y = edge[:, 0], edge[:, 1]
    area = 0.5 * abs(float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum()))
    return covered / area if area > 0.0 else 0.0
