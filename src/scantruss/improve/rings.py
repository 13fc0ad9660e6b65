"""The rings where thin limbs were cut off: nodes on them, and caps."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from ..boundary.find import Boundary
    from ..grid.grid import Grid

NEAR_RING = 0.25  # median distance of the nodes of a loop from the ring that it is [girth of the ring]


def finish_rings(grid: Grid, boundary: Boundary) -> Grid:
    """Return a grid with the nodes of its rings on them, as patches at an end are one-sided, and a cap on those to be closed.

    A cap is the triangles between the nodes: a ring of three, as is usual, is closed by one triangle and gets no further member.
    """
    nodes, caps = grid.nodes.copy(), [np.zeros((0, 3), np.int64)]
    for loop in boundary.loops:
        if not loop.cut:
            continue
        away = [
            np.linalg.norm(grid.nodes[own][:, None] - loop.points, axis=2).min(axis=1) for own in grid.boundary_loops
        ]
        nearest = int(np.argmin([np.median(each) for each in away])) if away else -1
        if nearest < 0 or np.median(away[nearest]) > NEAR_RING * loop.length:
            continue
        own = np.array(grid.boundary_loops[nearest])
        nodes[own] = _on_curve(nodes[own], loop.points)
        if loop.cut == "close":
            caps.append(_cap(grid, own))
    triangles = np.concatenate(caps)
    if np.array_equal(nodes, grid.nodes) and not len(triangles):
        return grid
    return grid.replace(nodes=nodes, triangles=np.concatenate([grid.triangles, triangles]))


def _on_curve(places: np.ndarray, curve: np.ndarray) -> np.ndarray:
    """Return the place on a closed polyline (M, 3) nearest to each of some places (K, 3)."""
    ahead = np.roll(curve, -1, axis=0) - curve
    arm = places[:, None] - curve
    share = np.clip((arm * ahead).sum(axis=2) / np.maximum((ahead**2).sum(axis=1), 1e-300), 0.0, 1.0)
    feet = curve + share[:, :, None] * ahead
    nearest = ((places[:, None] - feet) ** 2).sum(axis=2).argmin(axis=1)
    found: np.ndarray = feet[np.arange(len(places)), nearest]
    return found


def _cap(grid: Grid, own: np.ndarray) -> np.ndarray:
    """Return triangles (K - 2, 3) between the nodes of a loop (K,): the fan of the node from which they are shortest."""
    if (np.roll(grid.triangles, -1, axis=1) == own[1])[
        grid.triangles == own[0]
    ].any():  # triangles run along the loop too
        own = own[::-1]
    places = grid.nodes[own]
    longest = [
        np.linalg.norm(np.delete(places, (k - 1, k, (k + 1) % len(own)), axis=0) - places[k], axis=1).sum()
        for k in range(len(own))
    ]
    own = np.roll(own, -int(np.argmin(longest)))
    return np.array([(own[0], own[k], own[k + 1]) for k in range(1, len(own) - 1)], np.int64)
