"""Where the boundary of a grid leaves that of its scan, runs beyond it over nothing, or cuts a corner of it off."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ..constraints.network import curves_of
from ..grid.certificate import Fault
from ..kernels.boundary.curves import Curves, distances_from_curves
from .distances import distances_to_grid, feet_over, nearest_point_distances
from .left_out import points_together
from .limits import HEXAGON_BOUNDARY, NOISES_OFF, Figure

if TYPE_CHECKING:
    from ..boundary.find import Boundary, Loop
    from ..grid.grid import Grid
    from ..surface.samples import SurfaceSamples
    from .distances import Distances

WARN_ASIDE = 0.25  # distance between the boundaries of grid and scan above which it is poor [member lengths]
# share of the members of a boundary at which it is left, above which that is a fault, and fewest places: 0.26 and more where a lip is
# half followed, 0.22 at most on 1,000 other grids of shells, twins and real scans
MOST_LEFT, FEWEST_LEFT = 0.25, 6
# ... above which it is a fault where the grid covers what the scan does not, and how far from triangles its boundary, or from points a
# member, must lie for that at most and at least; where a grid stops short, the share that it misses decides [member lengths]
MOST_BEYOND, COVERED_WITHIN, EMPTY_FROM = 1.0, 0.2, 0.25
SPACINGS_OUT = 5.0  # ... and in spacings of the points
# points that a grid stops short of at its boundary: how far off they are, beside the noise, at least [member lengths], how many together
# are no outliers, and how far apart they are at most [spacings of the points]
WARN_SHORT_OF, FEWEST_BEYOND, BEYOND_TOGETHER = 0.2, 3, 4.0
# height over the grid of such a point, in its distance from it, at most: others are of a wall or a beam
MOST_HEIGHT_OF_LEVEL = 0.5
# distance of a corner of the boundary from the nearest node of it above which it is cut off [member lengths]
WARN_CUT = 0.15


def places_aside(grid: Grid, boundary: Boundary, length: float, samples: SurfaceSamples | None = None) -> list[Fault]:
    """Return warnings of a boundary that leaves the scan's, and of corners that it cuts off, each with its places.

    Measured both ways: at a spike the nodes are off the curve of the scan, at a corner that is cut off the curve is off the members.

    Parameters
    ----------
    grid : Grid
        Of the same origin as the scan.
    boundary : Boundary
        Loops of the scan; those of limbs that are closed by caps are no boundary of the grid.
    length : float
        Desired member length where the grid has none of its own [scan unit].
    samples : SurfaceSamples, optional
        Of the scan: a corner with no point of it nearby was guessed from the sides of a bow, and is none to follow.
    """
    if samples is not None:
        boundary = replace(boundary, loops=tuple(_without_guesses(loop, samples, length) for loop in boundary.loops))
    warnings = (figure.beyond(figure.poor) for figure in _figures_at_boundary(grid, boundary, length))
    return [warning for warning in warnings if warning is not None]


def _without_guesses(loop: Loop, samples: SurfaceSamples, length: float) -> Loop:
    """Return a loop without the corners that lie far from all points of the scan, and without what of it leads to them."""
    if not len(loop.corner_at):
        return loop
    member = length * (np.ones(len(loop.points)) if loop.desired is None else loop.desired)
    limit = np.maximum(EMPTY_FROM * member, SPACINGS_OUT * samples.spacing)
    corners, places = loop.corner_at, loop.points
    corners = corners[nearest_point_distances(places[corners], samples, length) > limit[corners]]
    if not len(corners):
        return loop
    guessed = nearest_point_distances(places, samples, length) > limit
    gaps = np.linalg.norm(loop.points[:, None] - loop.points[corners], axis=2).min(axis=1)
    stays = ~(guessed & (gaps < member))
    numbers = np.cumsum(stays) - 1
    return replace(
        loop,
        points=loop.points[stays],
        corner_at=numbers[loop.corner_at[stays[loop.corner_at]]],
        line_at=numbers[loop.line_at[stays[loop.line_at]]],
        desired=None if loop.desired is None else loop.desired[stays],
    )


def boundary_left(grid: Grid, boundary: Boundary, length: float) -> list[Fault]:
    """Return a fault where a grid leaves the boundary of its scan all along, as where its edge runs to and fro over a rounded lip.

    Parameters as of `places_aside`.
    """
    figures = _figures_at_boundary(grid, boundary, length)
    if not figures:
        return []
    aside = figures[0]
    near = aside.values <= MOST_BEYOND  # what lies farther off is missed, or a bay
    aside = replace(aside, values=aside.values[near], places=aside.places[near])
    count, around = len(aside.values), int((grid.edge_uses == 1).sum())
    fault = aside.beyond(aside.poor)
    if fault is None or count < FEWEST_LEFT or count <= MOST_LEFT * around:
        return []
    most = float(aside.values.max())
    words = f"leaves the boundary of the scan at {count} of its {around} members, by up to {most:.2f} members"
    return [replace(fault, kind="beyond", words=words)]


def _figures_at_boundary(grid: Grid, boundary: Boundary, length: float) -> list[Figure]:
    """Return how far the boundary of a grid leaves the scan's, and how far it cuts off corners; none where there is no boundary."""
    boundary = replace(boundary, loops=tuple(loop for loop in boundary.loops if loop.cut != "close"))
    loops, chains = boundary.loops, grid.boundary_loops
    if not loops or not chains:
        return []
    at = np.concatenate(chains)
    nodes, own = grid.nodes[at], np.full(len(at), length) if grid.desired is None else grid.desired[at]
    members = [length * (np.ones(len(loop.points)) if loop.desired is None else loop.desired) for loop in loops]
    bend = HEXAGON_BOUNDARY**2 if grid.cells == "hexagon" else 1.0  # times as far long members leave a curve
    chained = curves_of([grid.nodes[chain] for chain in chains], [True] * len(chains))
    curve = np.concatenate([loop.points for loop in loops])
    off = np.concatenate(
        [_distances(boundary.curves, nodes) / own, _distances(chained, curve) / np.concatenate(members)]
    )
    corners = boundary.corners
    at_corners = np.concatenate([each[loop.corner_at] for each, loop in zip(members, loops, strict=True)])
    cut = np.array([np.linalg.norm(nodes - corner, axis=1).min() for corner in corners]) / at_corners
    found = [
        _figure("aside", "leaves the boundary of the scan by {:.2f} members", WARN_ASIDE * bend,
                off, np.concatenate([nodes, curve]), np.concatenate([own, *members])),
        _figure("cut", "cuts off a corner of the boundary by {:.2f} members", WARN_CUT, cut, corners, at_corners),
    ]  # fmt: skip
    return [replace(figure, places=figure.places + grid.origin) for figure in found]


def stops_short(
    grid: Grid,
    samples: SurfaceSamples,
    found: Distances,
    chosen: np.ndarray,
    members: np.ndarray,
    said: list[Fault],
) -> list[Fault]:
    """Return a warning of places where points of the scan lie beyond the boundary of a grid, though they are few.

    The boundary that was found in the scan may leave them out too.

    Parameters
    ----------
    said : warnings of a boundary that leaves the scan's; within a member of their places nothing is said again
    chosen : (N,) bool, points of the scan that the grid is to follow
    members : (N,) desired member length at each point [scan unit]
    """
    chains = grid.boundary_loops
    least = WARN_SHORT_OF * (HEXAGON_BOUNDARY**2 if grid.cells == "hexagon" else 1.0) * members
    least = least + NOISES_OFF * float(np.median(found.noise))
    off = np.flatnonzero(chosen & (found.scan > least) & (found.scan <= members))
    if len(off) < FEWEST_BEYOND or not chains:
        return []
    chained = curves_of([grid.nodes[chain] for chain in chains], [True] * len(chains))
    places, away = samples.scan[off], found.scan[off]
    beyond = _distances(chained, places) <= away + 1e-6 * members[off]
    beyond &= np.abs(feet_over(grid, found.triangle[off], places)[0]) <= MOST_HEIGHT_OF_LEVEL * away
    off = off[beyond]
    if len(off) < FEWEST_BEYOND:
        return []
    part = points_together(samples.scan[off], np.full(len(off), BEYOND_TOGETHER * samples.spacing))
    off = off[np.bincount(part)[part] >= FEWEST_BEYOND]
    for place in (place for each in said if each.kind == "aside" for place in (each.where, *each.also) if place):
        off = off[np.linalg.norm(samples.scan[off] + samples.origin - place, axis=1) > members[off]]
    figure = _figure("stops", "stops short of the scan at its boundary by {:.2f} members", 0.0,
                     found.scan[off] / members[off], samples.scan[off] + samples.origin, members[off])  # fmt: skip
    warning = figure.beyond(figure.poor)
    return [warning] if warning is not None else []


def boundary_beyond(grid: Grid, samples: SurfaceSamples, boundary: Boundary, length: float) -> list[Fault]:
    """Return a fault where a grid runs far beyond the boundary of its scan: over a bay, or out to points that stand alone.

    Parameters as of `places_aside`; samples : of the scan.
    """
    loops = [loop for loop in boundary.loops if loop.cut != "close"]
    ends = grid.edges[grid.edge_uses == 1]
    if not loops or not len(ends):
        return []
    own = np.full(len(grid.nodes), length) if grid.desired is None else grid.desired
    bend = HEXAGON_BOUNDARY**2 if grid.cells == "hexagon" else 1.0
    chained = curves_of([grid.nodes[chain] for chain in grid.boundary_loops], [True] * len(grid.boundary_loops))
    curve, middles = np.concatenate([loop.points for loop in loops]), grid.nodes[ends].mean(axis=1)
    at_middles, limit = own[ends].mean(axis=1), MOST_BEYOND * bend
    at_curve = np.concatenate(
        [length * (np.ones(len(loop.points)) if loop.desired is None else loop.desired) for loop in loops]
    )
    off_curve = _distances(chained, curve) / at_curve
    off_middles = _distances(replace(boundary, loops=tuple(loops)).curves, middles) / at_middles
    over, out = np.flatnonzero(off_curve > limit), np.flatnonzero(off_middles > limit)
    if len(over):
        over = over[distances_to_grid(curve[over], grid, length)[0] <= COVERED_WITHIN * at_curve[over]]
    if len(out):
        away = nearest_point_distances(middles[out], samples, length)
        out = out[away > np.maximum(EMPTY_FROM * at_middles[out], SPACINGS_OUT * samples.spacing)]
    off, places = np.concatenate([off_curve[over], off_middles[out]]), np.concatenate([curve[over], middles[out]])
    members = np.concatenate([at_curve[over], at_middles[out]])
    words = "runs beyond the boundary of the scan by {:.2f} members, over nothing that was measured"
    figure = _figure("beyond", words, limit, off, places + grid.origin, members)
    fault = figure.beyond(figure.poor)
    return [fault] if fault is not None else []


def _distances(curves: Curves, places: np.ndarray) -> np.ndarray:
    """Return the distance of each place (K, 3) from the nearest curve (K,)."""
    distance = np.empty(len(places))
    distances_from_curves(curves, places, distance)
    return distance


def _figure(
    kind: str, words: str, poor: float, values: np.ndarray, places: np.ndarray, members: np.ndarray
) -> Figure:  # fmt: skip
    """Return a figure of values (K,) at places (K, 3) of which it keeps the worst within a member (K,) that are poor."""
    kept: list[int] = []
    for k in np.argsort(-values, kind="stable")[: int((values > poor).sum())].tolist():
        if (np.linalg.norm(places[kept] - places[k], axis=1) > members[k]).all():
            kept.append(k)
    return Figure(kind, values[kept], places[kept], np.inf, poor, words)
