"""Places at which the boundary of a grid may not be that of the scanned object: zigzags, and holes that may be none."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..grid.certificate import Fault, place_of
from ..kernels.geometry.components import component_labels
from ..scan.cloud import by_x
from ..surface.chosen_samples import DUPLICATE, KEPT
from .filled import goes_on_within
from .gaps import PLACES_ACROSS_GAP, is_empty_within
from .limits import PLACES_KEPT

if TYPE_CHECKING:
    from ..grid.grid import Grid
    from ..surface.samples import SurfaceSamples

NODES_TURNED_OVER = 6  # nodes along a boundary in which turns are summed
AT_CORNER = 0.1  # distance of a node from a corner of the scan up to which it is that corner [member lengths]
SPIKE_TURN = 130.0  # turn at a node from which on it is the tip of a spike, of the scan or not [degree]
NO_CORNERS = np.zeros((0, 3))
ZIGZAG_TURN = 130.0  # sum of the turns to either side among them from which on a boundary runs zigzag [degree]
SMALL_HOLE = 12  # nodes around a hole up to which it may be none
TORN_HOLE = 40  # ... where the scan goes on in it
# share of a hole that must be filled by points that were left out for it to be none: a few outliers in a courtyard, or a mast, fill less
FILLED_SHARE = 0.25
# distance within which a point fills its surface, in that of the points around the hole from their sixth neighbours: of nine places in
# ten one is as near
FILLS_WITHIN = 0.62
POINTS_AROUND_HOLE, POINTS_COMPARED, NEIGHBOR_COUNTED = 3000, 200, 6  # by how many points that is found


def doubtful_places(
    grid: Grid,
    samples: SurfaceSamples,
    length: float,
    corners: np.ndarray = NO_CORNERS,
    off_grid: np.ndarray | None = None,
) -> list[Fault]:
    """Return warnings of boundaries that run zigzag and of holes that may be none; desired member length given [scan unit].

    Parameters
    ----------
    corners : (C, 3) of the scan's boundary, which turns there
    off_grid : (N,) distance of each point that was read from the grid, by which holes are known in which the scan goes on
    """
    label = component_labels(len(grid.nodes), grid.edges[:, 0], grid.edges[:, 1])
    loops = sorted(grid.boundary_loops, key=len, reverse=True)
    pieces = [int(label[loop[0]]) for loop in loops]
    torn = [] if off_grid is None else [loop for loop in loops if _is_torn(grid.nodes[loop], samples, off_grid, length)]
    known = {int(loop[0]) for loop in torn}
    holes = [
        loop
        for at, loop in enumerate(loops)
        if pieces[at] in pieces[:at] and len(loop) <= SMALL_HOLE and int(loop[0]) not in known
    ]
    kinds = [_kind_of_hole(grid.nodes[loop], samples, length) for loop in holes] if holes else []
    left_out = [grid.nodes[loop].mean(axis=0) for loop, kind in zip(holes, kinds, strict=True) if kind == "left out"]
    sparse = [grid.nodes[loop].mean(axis=0) for loop, kind in zip(holes, kinds, strict=True) if kind == "sparse"]
    in_torn = np.array([grid.nodes[loop].mean(axis=0) for loop in torn])
    found = (
        _warning("hole", "has a hole where the scan has none; shorter members close it", in_torn, grid.origin),
        _warning("zigzag", "runs zigzag at its boundary", grid.nodes[zigzags(grid, corners, length)], grid.origin),
        _warning("hole", "has a hole where points were left out", np.array(left_out), grid.origin),
        _warning("hole", "has a hole that may be none, so far apart are the points", np.array(sparse), grid.origin),
    )
    return [warning for warning in found if warning is not None]


def _warning(kind: str, words: str, places: np.ndarray, origin: np.ndarray) -> Fault | None:
    """Return a warning of all places (K, 3); None of none."""
    if not len(places):
        return None
    more = f" ({len(places)} such places)" if len(places) > 1 else ""
    first, *others = (place_of(place + origin) for place in places[:PLACES_KEPT])
    return Fault(kind, words + more, first, tuple(others))


def zigzags(grid: Grid, corners: np.ndarray = NO_CORNERS, length: float = 0.0) -> np.ndarray:
    """Return the nodes (K,) in the middle of zigzags: on a few members around them a boundary turns much to both sides.

    A turn at a corner of the scan (C, 3), as at the peak of a gable, is none, but beside a spike; desired member length given [scan unit].
    """
    a, b, c = grid.nodes[grid.triangles.T]
    upward = np.zeros_like(grid.nodes)
    for corner in grid.triangles.T:
        np.add.at(upward, corner, np.cross(b - a, c - a))
    found = [np.zeros(0, np.int64)]
    for loop in grid.boundary_loops:
        if len(loop) <= 2 * NODES_TURNED_OVER:
            continue
        ahead = grid.nodes[np.roll(loop, -1)] - grid.nodes[loop]
        behind = np.roll(ahead, 1, axis=0)
        across = np.cross(behind, ahead)
        turn = np.degrees(np.arctan2(np.linalg.norm(across, axis=1), (behind * ahead).sum(axis=1)))
        turn *= np.sign((across * upward[loop]).sum(axis=1))
        gaps = np.linalg.norm(grid.nodes[loop][:, None] - corners, axis=2).min(axis=1, initial=np.inf)
        spiked = np.abs(turn) > SPIKE_TURN
        beside = np.any(
            [np.roll(spiked, k) for k in range(-NODES_TURNED_OVER // 2, NODES_TURNED_OVER // 2 + 1)], axis=0
        )
        turn[(gaps <= AT_CORNER * length) & ~beside] = 0.0
        around = np.array([np.roll(turn, NODES_TURNED_OVER // 2 - k) for k in range(NODES_TURNED_OVER)])
        least = np.minimum(np.maximum(around, 0.0).sum(axis=0), np.maximum(-around, 0.0).sum(axis=0))
        highest = least >= np.max([np.roll(least, k) for k in range(-NODES_TURNED_OVER, NODES_TURNED_OVER + 1)], axis=0)
        found.append(loop[(least > ZIGZAG_TURN) & highest & (least > np.roll(least, 1))])
    return np.concatenate(found)


def _is_torn(around: np.ndarray, samples: SurfaceSamples, off_grid: np.ndarray, length: float) -> bool:
    """Return whether the scan goes on within nodes around a hole (K, 3), so few that it may be none."""
    return len(around) <= TORN_HOLE and goes_on_within(around, samples, off_grid, length)


def _kind_of_hole(around: np.ndarray, samples: SurfaceSamples, length: float) -> str:
    """Return why a hole with nodes around it (K, 3) may be none: "left out", "sparse", or "" where it is one."""
    middle = around.mean(axis=0)
    normal = np.linalg.svd(around - middle)[2][2]
    radius = float(np.linalg.norm(around - middle, axis=1).max())
    near = samples.scan[:, 0] - middle[0]
    which = np.flatnonzero(np.abs(near) <= 3.0 * radius)
    points, judged = samples.scan[which], samples.judged[which]
    across, off = np.linalg.svd(normal[None])[2][1:], points - middle
    height, plan = off @ normal, off @ across.T
    level = np.linalg.norm(plan, axis=1)
    inside = (level <= 0.7 * radius) & (np.abs(height) <= 0.25 * length)
    left_out = inside & ~np.isin(judged, (KEPT, DUPLICATE))
    if left_out.any():
        beside = np.flatnonzero((judged == KEPT) & (level <= 3.0 * radius) & (np.abs(height) <= radius))
        beside = beside[np.argsort(level[beside], kind="stable")[:POINTS_AROUND_HOLE]]
        if _filled_share(radius, plan[left_out], plan[beside]) > FILLED_SHARE:
            return "left out"
    return "" if is_empty_within(around, by_x(points[judged == KEPT])) else "sparse"


def _filled_share(radius: float, inside: np.ndarray, beside: np.ndarray) -> float:
    """Return the share of a hole around (0, 0) that points in it (K, 2) fill as closely as those beside it (M, 2) do there."""
    if len(beside) <= NEIGHBOR_COUNTED:
        return 1.0
    some = beside[:: -(-len(beside) // POINTS_COMPARED)]
    apart = np.linalg.norm(some[:, None] - beside, axis=2)
    within = FILLS_WITHIN * float(np.median(np.partition(apart, NEIGHBOR_COUNTED, axis=1)[:, NEIGHBOR_COUNTED]))
    away = np.array([np.linalg.norm(inside - place, axis=1).min() for place in radius * PLACES_ACROSS_GAP])
    return float((away <= within).mean())
