"""Few joints: stars of members drawn towards few by assignment and relaxation in turn, nodes on the surface of the grid."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.sparse import coo_matrix, diags
from scipy.sparse.linalg import spsolve

from ..errors import InputError
from ..grid.grid import Grid
from ..grid.panels import triangles_of
from ..kernels.mesh.stars import star_misfits
from .charts import Charts, shortened
from .images import Images

JOINT_ROUNDS = 400  #: of assignment and relaxation
ROUNDS_OF_JOINTS = 25  #: after which nodes are assigned anew though some are beyond the tolerance
MOST_JOINTS = 6000  #: any two of which are compared
FEWER_KINDS = 0.93  #: kinds of joints, over those needed before
NEARLY_ALIKE = 0.1  #: of the tolerance, within which a star is taken to be its representative
STIFFNESS_OF_NODE = 0.02  #: weight of staying where one is
STIFFNESS_OF_STARS = 0.004  #: the same over all that pulls at a node
STEP_OF_JOINTS = 0.05  #: farthest move of a node in one round, over the mean member
UNEVEN_AT_MOST = 0.2  #: by how far lengths may be off the mean member, beside those that were before, over it
HOLD_OF_LENGTH = 1.0  #: weight of what is beyond, over that of a direction
HEAVIER_STAR = 1.15  #: weight of a star beyond the tolerance, over that of the round before
LEAST_STAR, MOST_STAR = 0.3, 50.0  #: weight of a star within the tolerance, and of one beyond it


@dataclass(frozen=True, eq=False)
class JointFamilies:
    """Nodes by their stars: the grid after the relaxation, and the kinds of joints."""

    grid: Grid
    representative: np.ndarray  #: (K,) node that stands for each kind
    of: np.ndarray  #: (V,) kind of each node, -1 of one without members
    misfit: np.ndarray  #: (V,) root mean square of what is between its unit directions and those of its kind
    moved: np.ndarray  #: (V,) how far each node has moved [unit of the grid]
    before: int  #: kinds of the grid as it was

    @property
    def counts(self) -> np.ndarray:
        """(K,) nodes of each kind."""
        return np.bincount(self.of[self.of >= 0], minlength=len(self.representative))


class _Stars(NamedTuple):
    """What is joined to what."""

    ring: np.ndarray  #: (V, W) neighbours, anticlockwise, at the boundary from its first member on; -1 for none
    valence: np.ndarray  #: (V,)
    is_open: np.ndarray  #: (V,) int64

    def directions(self, nodes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return unit vectors (V, W, 3) along the members, nil for none, and their lengths (V, W)."""
        way = np.where(self.ring[..., None] >= 0, nodes[self.ring] - nodes[:, None], 0.0)
        size = np.linalg.norm(way, axis=2)
        return way / np.maximum(size, 1e-300)[..., None], size

    def normals(self, directions: np.ndarray) -> np.ndarray:
        """Return (V, 3) unit normals: the mean of the cross products of members next to each other."""
        after = np.where(
            np.arange(self.ring.shape[1]) + 1 < self.valence[:, None], np.arange(self.ring.shape[1]) + 1, 0
        )
        crossed = np.cross(directions, np.take_along_axis(directions, after[..., None], axis=1))
        last = np.arange(self.ring.shape[1]) == self.valence[:, None] - 1
        crossed[last & (self.is_open == 1)[:, None]] = 0.0
        normal = crossed.sum(axis=1)
        return np.asarray(normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300))

    def own(self, directions: np.ndarray) -> np.ndarray:
        """Return the directions (V, W, 3) in frames with z along the normals."""
        normal = self.normals(directions)
        x = directions[:, 0] - (directions[:, 0] * normal).sum(axis=1, keepdims=True) * normal
        x /= np.maximum(np.linalg.norm(x, axis=1, keepdims=True), 1e-300)
        frame = np.stack([x, np.cross(normal, x), normal], axis=1)
        return np.ascontiguousarray(np.einsum("vwc,vkc->vwk", directions, frame))

    def misfits(self, directions: np.ndarray, others: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return misfits and shifts (V, C) of all stars to some of them; see `star_misfits`."""
        misfit, shift = np.empty((len(self.valence), len(others))), np.empty((len(self.valence), len(others)), np.int64)
        star_misfits(self.own(directions), self.valence, self.is_open, others, misfit, shift)
        return misfit, shift


def few_joints(grid: Grid, tolerance: float = 0.01) -> JointFamilies:
    """Return the grid with its nodes moved along its surface so that there are few different joints.

    Two joints are of one kind if one, turned, has its members within the tolerance of those of the other; mirror images are two kinds.
    Each round gives every node the nearest of the kinds that hold the most nodes, and moves the nodes by a damped Gauss-Newton step that
    turns the members towards the mean star of the kind; nodes beyond the tolerance weigh more from round to round. There are fewer kinds
    each time that all are within. Lengths stay within .2 of the mean member, or where they were; nodes move as in `few_lengths`, and the
    symmetry of the grid is kept.

    Parameters
    ----------
    grid : Grid
    tolerance : float
        Root mean square of what is between unit vectors along the members of two joints, 0.0001 to 0.2: freeGrid's measure (Bruno et al.
        2023), which takes .01.

    Raises
    ------
    InputError
        The tolerance cannot be used, or the grid has no members or too many nodes.
    """
    if not 1e-4 <= tolerance <= 0.2:
        raise InputError(f"the tolerance of joints is 0.01% to 20%, got {tolerance!r}")
    if len(grid.edges) == 0 or not grid.topology.manifold:
        raise InputError("few joints need a manifold grid with members")
    if len(grid.nodes) > MOST_JOINTS:
        raise InputError(f"few joints are made of {MOST_JOINTS:,} nodes at most, got {len(grid.nodes):,}")
    stars, charts, images = _stars_of(grid), Charts.of_grid(grid), Images.of_grid(grid)
    _, sizes = stars.directions(grid.nodes)
    bounds = (
        np.minimum(sizes, (1 - UNEVEN_AT_MOST) * charts.mean),
        np.maximum(sizes, (1 + UNEVEN_AT_MOST) * charts.mean),
    )
    nodes, aim = grid.nodes, len(grid.nodes)
    best, fewest, before, since = nodes, np.arange(aim), 0, 0
    weight = np.full(len(nodes), LEAST_STAR)
    for number in range(JOINT_ROUNDS):
        directions, sizes = stars.directions(nodes)
        misfit, shift = stars.misfits(directions, np.arange(len(nodes)))
        kinds = _kinds(misfit <= tolerance, stars.valence > 0)
        if number == 0:
            before = len(kinds)
        if len(kinds) < len(fewest):
            best, fewest = nodes, kinds
        if len(kinds) == 1:
            break
        since += 1
        if len(kinds) <= aim or since > ROUNDS_OF_JOINTS:
            aim, since, weight = _fewer(len(kinds)), 0, np.full(len(nodes), LEAST_STAR)
        wanted = kinds[:aim]
        near = misfit[:, wanted].argmin(axis=1)
        own = wanted[near]
        every = np.arange(len(nodes))
        beyond = misfit[every, own] > tolerance
        weight = np.where(
            beyond,
            np.minimum(np.maximum(weight, 1) * HEAVIER_STAR, MOST_STAR),
            np.maximum(weight / HEAVIER_STAR, LEAST_STAR),
        )
        turn = _aims(stars, directions, near, shift[every, own], ~beyond, len(wanted)) - directions
        size = np.sqrt((turn**2).sum(axis=(1, 2)) / np.maximum(stars.valence, 1))
        turn *= np.maximum(1 - NEARLY_ALIKE * tolerance / np.maximum(size, 1e-300), 0)[:, None, None]
        place = charts.place_of(nodes)
        place = charts.within(place + _step(stars, charts, place, directions, sizes, turn, weight, bounds))
        nodes = images.alike(charts.moved(place))
    return _found(grid, stars, best, fewest, before)


def joint_report(found: JointFamilies, tolerance: float, mean: float) -> dict[str, Any]:
    """Return the figures as plain values; mean: member of the grid before [unit of the grid]."""
    valence = np.bincount(found.grid.edges.ravel(), minlength=len(found.of))
    return {
        "tolerance": tolerance,
        "kinds_before": found.before,
        "kinds": [
            {"node": node, "members": int(valence[node]), "nodes": count}
            for node, count in zip(found.representative.tolist(), found.counts.tolist(), strict=True)
        ],
        "misfit_max": float(found.misfit.max(initial=0.0)),
        "moved_mean": float(found.moved.mean()) / mean,
        "moved_max": float(found.moved.max()) / mean,
        "length_cv": found.grid.quality.length_cv,
    }


def _fewer(count: int) -> int:
    """Return how many kinds are tried after so many."""
    return max(min(count - 1, int(FEWER_KINDS * count)), 1)


def _stars_of(grid: Grid) -> _Stars:
    """Return the rings of the nodes of a grid."""
    count = len(grid.nodes)
    ends = np.concatenate([grid.edges, grid.edges[:, ::-1]])
    corners = grid.nodes[grid.triangles]
    normal = np.zeros((count, 3))
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    for k in range(3):
        np.add.at(normal, grid.triangles[:, k], across)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    axis = np.eye(3)[np.abs(normal).argmin(axis=1)]
    x = np.cross(axis, normal)
    y = np.cross(normal, x)
    way = grid.nodes[ends[:, 1]] - grid.nodes[ends[:, 0]]
    angle = np.arctan2((way * y[ends[:, 0]]).sum(axis=1), (way * x[ends[:, 0]]).sum(axis=1))
    ends = ends[np.lexsort((angle, ends[:, 0]))]
    valence = np.bincount(ends[:, 0], minlength=count)
    ring = np.full((count, max(int(valence.max()), 1)), -1)
    start = np.cumsum(valence) - valence
    ring[ends[:, 0], np.arange(len(ends)) - start[ends[:, 0]]] = ends[:, 1]
    is_open = np.zeros(count, np.int64)
    outer = {(a, b) for a, b in _directed_boundary(grid)}
    for a, b in outer:  # the panel is on the left of it
        is_open[a] = 1
        own = ring[a, : valence[a]]
        ring[a, : valence[a]] = np.roll(own, -int(np.flatnonzero(own == b)[0]))
    return _Stars(ring, valence, is_open)


def _directed_boundary(grid: Grid) -> list[tuple[int, int]]:
    """Return the members of the boundary, each in the direction in which its triangle has it."""
    half = np.concatenate([grid.triangles[:, [0, 1]], grid.triangles[:, [1, 2]], grid.triangles[:, [2, 0]]])
    both = {(a, b) for a, b in half.tolist()}
    return sorted((a, b) for a, b in both if (b, a) not in both)


def _kinds(near: np.ndarray, used: np.ndarray) -> np.ndarray:
    """Return nodes that stand for all that are used, each time that which the most others are near to (V, V)."""
    near = near | np.eye(len(used), dtype=bool)  # whatever the rounding
    held = (near & used).sum(axis=1) * used  # how many of the nodes left each is near to
    left, found = used.copy(), []
    while left.any():  # ends: each node left is near to itself, so that each turn takes one at least
        best = int(held.argmax())
        found.append(best)
        gone = left & near[best]
        left &= ~gone
        held = held - near[:, gone].sum(axis=1) * used
    return np.array(found)


def _aims(
    stars: _Stars, directions: np.ndarray, near: np.ndarray, shift: np.ndarray, within: np.ndarray, count: int
) -> np.ndarray:
    """Return where the members (V, W, 3) of each node would be in the mean star of its kind, turned to it."""
    width = directions.shape[1]
    at = np.arange(width)
    valence = np.maximum(stars.valence, 1)[:, None]
    there = np.where(at < valence, (at + shift[:, None]) % valence, at)  # of the node, for each member of the kind
    rolled = np.take_along_axis(directions, there[..., None], axis=1)
    mean = np.zeros((count, width, 3))
    first = np.full(count, -1)
    order = np.flatnonzero(within)
    first[near[order][::-1]] = order[::-1]
    mean[first >= 0] = rolled[first[first >= 0]]
    for _ in range(2):
        turns = _turns(mean[near], rolled)  # from the kind to the node
        total = np.zeros_like(mean)
        np.add.at(total, near[within], np.einsum("vij,vwi->vwj", turns, rolled)[within])
        mean = total / np.maximum(np.linalg.norm(total, axis=2, keepdims=True), 1e-300)
    aim = np.einsum("vij,vwj->vwi", _turns(mean[near], rolled), mean[near])
    back = np.where(at < valence, (at - shift[:, None]) % valence, at)
    found = np.take_along_axis(aim, back[..., None], axis=1)
    none = np.linalg.norm(mean[near], axis=2).max(axis=1) < 0.5
    found[none] = directions[none]
    return np.asarray(found)


def _turns(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return rotations (V, 3, 3) that bring vectors (V, W, 3) nearest to others (Kabsch 1976)."""
    left, _, right = np.linalg.svd(np.einsum("vwi,vwj->vij", other, one))
    left[:, :, 2] *= np.sign(np.linalg.det(left) * np.linalg.det(right))[:, None]
    return np.asarray(left @ right)


def _step(
    stars: _Stars, charts: Charts, place: np.ndarray, directions: np.ndarray, sizes: np.ndarray, turn: np.ndarray, weight: np.ndarray,
    bounds: tuple[np.ndarray, np.ndarray],
) -> np.ndarray:  # fmt: skip
    """Return moves (V, 2) on the charts by a damped Gauss-Newton step that adds `turn` (V, W, 3) to the directions of the members.

    bounds : (V, W) least and greatest lengths of the members, which are held
    """
    ways = charts.ways(place)
    node, column = np.nonzero(stars.ring >= 0)
    other, along, size = stars.ring[node, column], directions[node, column], sizes[node, column]
    pull = np.sqrt(weight[node]) * charts.mean
    low, high = (each[node, column] for each in bounds)
    excess = np.clip(size, low, high) - size
    rows_of = np.empty((len(node), 4, 3))  # of each member at each of its ends: its direction, and its length
    rows_of[:, :3] = (pull / size)[:, None, None] * (np.eye(3) - along[:, :, None] * along[:, None, :])
    rows_of[:, 3] = np.where(excess == 0, 0.0, HOLD_OF_LENGTH)[:, None] * along
    aim = np.concatenate([turn[node, column] * pull[:, None], HOLD_OF_LENGTH * excess[:, None]], axis=1)
    rows = np.broadcast_to((4 * np.arange(len(node)))[:, None, None] + np.arange(4)[:, None], (len(node), 4, 2))
    values, columns = [], []
    for sign, at in ((1.0, other), (-1.0, node)):
        values.append(sign * np.einsum("eij,ekj->eik", rows_of, ways[at]))
        columns.append(np.broadcast_to(2 * at[:, None, None] + np.arange(2), (len(node), 4, 2)))
    table = coo_matrix(
        (np.concatenate(values).ravel(), (np.concatenate([rows, rows]).ravel(), np.concatenate(columns).ravel())),
        (4 * len(node), place.size),
    ).tocsr()
    stiff = table.T @ table
    damping = STIFFNESS_OF_NODE + STIFFNESS_OF_STARS * stiff.diagonal()
    stiff = stiff + diags(np.where(charts.free.ravel(), damping, 1.0))
    found = spsolve(stiff.tocsc(), table.T @ aim.ravel()).reshape(place.shape) * charts.free
    return shortened(found, STEP_OF_JOINTS * charts.mean)


def _found(grid: Grid, stars: _Stars, nodes: np.ndarray, kinds: np.ndarray, before: int) -> JointFamilies:
    """Return the record of the grid with its nodes moved."""
    made = grid.replace(nodes=nodes, deviation=None)
    if made.panels is not None:  # which are cut along their shortest diagonals
        made = made.replace(triangles=triangles_of(nodes, made.panels), panels=made.panels)
    misfit, _ = stars.misfits(stars.directions(nodes)[0], kinds)
    of = np.where(stars.valence > 0, misfit.argmin(axis=1), -1)
    off = np.where(of >= 0, misfit.min(axis=1), 0.0)
    return JointFamilies(made, kinds, of, off, np.linalg.norm(nodes - grid.nodes, axis=1), before)
