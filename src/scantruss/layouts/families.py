"""Few lengths: members drawn towards few values by assignment and relaxation in turn, nodes on the surface of the grid."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix, diags
from scipy.sparse.linalg import spsolve

from ..errors import InputError
from ..grid.grid import Grid
from ..grid.panels import triangles_of
from .double_layer import smoothed_normals

FAMILY_ROUNDS = 200  #: of assignment and relaxation
INNER_SHARE = 0.9  #: of the tolerance, within which a length is taken to be that of its family
BISECTIONS = 60  #: of the least misfit
STIFFNESS_OF_PLACE = 0.005  #: weight of staying where one is, over that of a length
FARTHEST_MOVE = 0.35  #: of a node along the surface, over the mean member
HIGHEST_RISE = 0.05  #: of a node off the triangles of the grid, over the mean member; by how far its quadric may rise
STAYING_TURN = 25.0  #: turn of the boundary from which a node stays [degree]
HEAVIER = 1.12  #: weight of a member that lies in no family, over that of the round before
MOST_WEIGHT = 100.0  #: of a member
LEAST_FITTED = 5  #: nodes around one, to which a quadric is fitted
USUAL_SHARE = 0.95  #: of the members, which few lengths shall hold


@dataclass(frozen=True, eq=False)
class Families:
    """Members by length: the grid after the relaxation, and how many lengths there are before and after."""

    grid: Grid
    lengths: np.ndarray  #: (K,) the length of each family, rising [unit of the grid]
    of: np.ndarray  #: (E,) the family of each member
    misfit: np.ndarray  #: (E,) length of each member minus that of its family [unit of the grid]
    moved: np.ndarray  #: (V,) how far each node has moved [unit of the grid]

    @property
    def counts(self) -> np.ndarray:
        """(K,) members of each family."""
        return np.bincount(self.of, minlength=len(self.lengths))


def lengths_needed(lengths: np.ndarray, tolerance: float, share: float = 1.0) -> np.ndarray:
    """Return the fewest lengths, rising, of which so great a share of the members differ by at most the tolerance.

    Parameters
    ----------
    lengths : (E,) float64
    tolerance : float
        Largest misfit of a member, in the unit of the lengths.
    share : float
        Of the members that must be held, above 0 to 1.
    """
    return _middles(lengths, tolerance, len(lengths), math.ceil(share * len(lengths) - 1e-9))


def _middles(lengths: np.ndarray, tolerance: float, count: int, enough: int) -> np.ndarray:
    """Return at most `count` lengths, rising, that hold the most members within the tolerance, no more lengths than hold `enough` members.

    Dynamic programming over windows of the sorted lengths, each as wide as both tolerances.
    """
    ordered = np.sort(lengths)
    total = len(ordered)
    end = np.searchsorted(ordered, ordered + 2 * tolerance * (1 + 1e-12), "right")
    most = np.zeros(total + 1, np.int64)  # members held by the windows so far that begin at each length or later
    choices: list[np.ndarray] = []
    while len(choices) < count and most[0] < enough:  # ends at `count`
        taken = end - np.arange(total) + most[end]
        choices.append(taken)
        most = np.append(np.maximum.accumulate(taken[::-1])[::-1], 0)
    middles, begin = [], 0
    for taken in reversed(choices):
        if begin >= total:
            break
        begin += int(np.argmax(taken[begin:]))
        middles.append((ordered[begin] + ordered[end[begin] - 1]) / 2)
        begin = int(end[begin])
    return np.array(middles)


def few_lengths(grid: Grid, tolerance: float, count: int) -> Families:
    """Return the grid with its nodes moved along its surface so that more members are of `count` lengths.

    The surface is a quadric at each node, of least squares through its neighbours and theirs; nodes of the boundary move along a parabola
    through their neighbours. Corners, fixed nodes and nodes on lines stay. Each round gives every member the nearest of the lengths that
    hold the most members, and moves the nodes by Gauss-Newton steps towards them; members that are in none weigh more from round to round.
    The round with the least misfits stands.

    Parameters
    ----------
    grid : Grid
    tolerance : float
        Largest misfit, over the mean member, 0.0001 to 0.2.
    count : int
        Lengths, 1 or more.

    Raises
    ------
    InputError
        A value cannot be used, or the grid has no members.
    """
    if not 1e-4 <= tolerance <= 0.2:
        raise InputError(f"the tolerance of families is a share of the mean member, 0.01% to 20%, got {tolerance!r}")
    if count < 1:
        raise InputError(f"the number of families must be 1 or more, got {count}")
    if len(grid.edges) == 0 or not grid.topology.manifold:
        raise InputError("families of members need a manifold grid with members")
    mean = float(grid.lengths.mean())
    frames, free, quadrics = _charts(grid)
    place = np.zeros((len(grid.nodes), 2))
    weight = np.ones(len(grid.edges))
    nodes, best, least = grid.nodes, grid.nodes, math.inf
    for _ in range(FAMILY_ROUNDS):
        lengths = _lengths(nodes, grid.edges)
        middles = _middles(lengths, tolerance * mean, count, len(lengths))
        target = middles[np.abs(lengths[:, None] - middles).argmin(axis=1)]
        off = lengths - target
        beyond = np.maximum(np.abs(off) / (tolerance * mean) - 1, 0)
        if (score := float((beyond > 1e-9).mean() + 1e-3 * beyond.max())) < least:
            best, least = nodes, score
        if score == 0:
            break
        weight = np.where(beyond > 0, np.minimum(weight * HEAVIER, MOST_WEIGHT), np.maximum(weight / HEAVIER, 1))
        pull = np.sign(off) * np.maximum(np.abs(off) - INNER_SHARE * tolerance * mean, 0)
        place = _step(grid, nodes, place, frames, free, quadrics, pull, weight)
        size = np.linalg.norm(place, axis=1, keepdims=True)
        place *= np.minimum(1.0, FARTHEST_MOVE * mean / np.maximum(size, 1e-300))
        nodes = _positions(grid.nodes, place, frames, quadrics, HIGHEST_RISE * mean)
    made = grid.replace(nodes=best, deviation=None)
    if made.panels is not None:  # which are cut along their shortest diagonals
        made = made.replace(triangles=triangles_of(best, made.panels), panels=made.panels)
    middles = _middles(made.lengths, tolerance * mean, count, len(made.lengths))
    of = np.abs(made.lengths[:, None] - middles).argmin(axis=1)
    return Families(made, middles, of, made.lengths - middles[of], np.linalg.norm(best - grid.nodes, axis=1))


def least_misfit(lengths: np.ndarray, count: int) -> float:
    """Return the least tolerance at which so many lengths hold all members: bisection between nil and half the range."""
    low, high = 0.0, float(np.ptp(lengths)) / 2
    ordered = np.sort(lengths)
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        begin = 0
        for _ in range(count):
            if begin < len(ordered):
                begin = int(np.searchsorted(ordered, ordered[begin] + 2 * middle, "right"))
        low, high = (low, middle) if begin >= len(ordered) else (middle, high)
    return high


def family_report(before: Grid, found: Families, tolerance: float) -> dict[str, Any]:
    """Return the figures as plain values: tolerances and misfits over the mean member of the grid before, else in its unit."""
    mean = float(before.lengths.mean())
    needed = {
        f"{100 * share:g} % within {100 * each:g} %": {
            "before": len(lengths_needed(before.lengths, each * mean, share)),
            "after": len(lengths_needed(found.grid.lengths, each * mean, share)),
        }
        for each in (tolerance, tolerance / 2)
        for share in (USUAL_SHARE, 1.0)
    }
    off = np.abs(found.misfit)
    return {
        "unit": before.unit,
        "tolerance": tolerance,
        "lengths_needed": needed,
        "families": [
            {"length": length, "members": count}
            for length, count in zip(found.lengths.tolist(), found.counts.tolist(), strict=True)
        ],
        "members_within": float((off <= tolerance * mean * (1 + 1e-9)).mean()),
        "misfit_max": float(off.max()) / mean,
        "moved_mean": float(found.moved.mean()) / mean,
        "moved_max": float(found.moved.max()) / mean,
        "length_cv_before": before.quality.length_cv,
        "length_cv": found.grid.quality.length_cv,
    }


def _lengths(nodes: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Return the lengths of the members."""
    return np.asarray(np.linalg.norm(nodes[edges[:, 1]] - nodes[edges[:, 0]], axis=1))


def _charts(grid: Grid) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return frames (V, 3, 3) of rows u, v, n, which of u and v are free (V, 2), and heights (V, 3) of u u, u v and v v along n."""
    count = len(grid.nodes)
    normal = smoothed_normals(grid)
    axis = np.eye(3)[np.abs(normal).argmin(axis=1)]
    u = axis - (axis * normal).sum(axis=1, keepdims=True) * normal
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    frames = np.stack([u, np.cross(normal, u), normal], axis=1)
    free = np.ones((count, 2), bool)
    frames, quadrics = _fitted(grid, frames)
    for loop in grid.boundary_loops:
        before, after = grid.nodes[np.roll(loop, 1)], grid.nodes[np.roll(loop, -1)]
        for node, a, b in zip(loop.tolist(), before, after, strict=True):
            here = grid.nodes[node]
            back, on = here - a, b - here
            s, t = float(np.linalg.norm(back)), float(np.linalg.norm(on))
            slope = (back / s * t + on / t * s) / (s + t)  # of the parabola through the three, at the middle one
            bend = (on / t - back / s) / (s + t)
            frames[node, 0] = slope / np.linalg.norm(slope)
            bend = bend - (bend @ frames[node, 0]) * frames[node, 0]
            size = float(np.linalg.norm(bend))
            frames[node, 2] = bend / size if size > 1e-12 / (s + t) else frames[node, 2]
            quadrics[node] = size, 0.0, 0.0
            turn = math.degrees(math.acos(min(1.0, max(-1.0, float(back @ on) / (s * t)))))
            free[node] = turn < STAYING_TURN, False
    free[grid.fixed] = False
    free[grid.lines.ravel()] = False
    return frames, free, quadrics


def _fitted(grid: Grid, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the frames (V, 3, 3) turned to the normals of quadrics fitted to the neighbours and theirs, and the quadrics (V, 3)."""
    count = len(grid.nodes)
    ends = np.concatenate([grid.edges, grid.edges[:, ::-1]])
    near = csr_matrix((np.ones(len(ends)), tuple(ends.T)), (count, count))
    near = near + near @ near
    near.setdiag(0)
    near.eliminate_zeros()
    near.sort_indices()
    node, place = np.repeat(np.arange(count), np.diff(near.indptr)), np.arange(near.nnz)
    local = np.einsum("kij,kj->ki", frames[node], grid.nodes[near.indices] - grid.nodes[node])
    around = np.zeros((count, int(np.diff(near.indptr).max(initial=1)), 3))  # rows of nil weigh nothing in the fit
    around[node, place - near.indptr[node]] = local
    x, y, z = around.transpose(2, 0, 1)
    table = np.stack([x, y, x * x, x * y, y * y], axis=2)
    fitted = (np.linalg.pinv(table) @ z[..., None])[..., 0]
    fitted[np.diff(near.indptr) < LEAST_FITTED] = 0.0
    u, v, normal = (frames[:, k] for k in range(3))
    normal = normal - fitted[:, [0]] * u - fitted[:, [1]] * v
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    u = u - (u * normal).sum(axis=1, keepdims=True) * normal
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    return np.stack([u, np.cross(normal, u), normal], axis=1), fitted[:, 2:]


def _positions(
    nodes: np.ndarray, place: np.ndarray, frames: np.ndarray, quadrics: np.ndarray, most: float
) -> np.ndarray:
    """Return where nodes are that have moved by (V, 2) along their charts."""
    u, v = place.T
    height = np.clip(quadrics[:, 0] * u * u + quadrics[:, 1] * u * v + quadrics[:, 2] * v * v, -most, most)
    return np.asarray(nodes + u[:, None] * frames[:, 0] + v[:, None] * frames[:, 1] + height[:, None] * frames[:, 2])


def _step(
    grid: Grid, nodes: np.ndarray, place: np.ndarray, frames: np.ndarray, free: np.ndarray, quadrics: np.ndarray,
    pull: np.ndarray, weight: np.ndarray,
) -> np.ndarray:  # fmt: skip
    """Return the charts' coordinates after a Gauss-Newton step that takes `pull` off the lengths."""
    u, v = place.T
    rise = np.stack([2 * quadrics[:, 0] * u + quadrics[:, 1] * v, quadrics[:, 1] * u + 2 * quadrics[:, 2] * v], axis=1)
    moves = (frames[:, :2] + rise[:, :, None] * frames[:, 2:]) * free[:, :, None]  # (V, 2, 3)
    a, b = grid.edges.T
    along = nodes[b] - nodes[a]
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    rows = np.repeat(np.arange(len(along)), 4)
    columns = np.stack([2 * a, 2 * a + 1, 2 * b, 2 * b + 1], axis=1).ravel()
    at_a, at_b = (np.einsum("ekc,ec->ek", moves[end], along) for end in (a, b))
    table = coo_matrix(
        (np.concatenate([-at_a, at_b], axis=1).ravel(), (rows, columns)), (len(along), place.size)
    ).tocsr()
    stiff = table.T @ diags(weight) @ table + diags(np.where(free.ravel(), STIFFNESS_OF_PLACE, 1.0))
    found = spsolve(stiff.tocsc(), -(table.T @ (weight * pull)))
    return np.asarray(place + found.reshape(place.shape) * free)
