"""Planar panels: nodes move along and off the scan, by least squares, until the corners of each panel lie in its mean plane.

Each round solves for all nodes at once, with the mean planes held, as in Bouaziz et al. (2012), "Shape-up: shaping discrete geometry
with projections", and draws harder at the planes than the round before. Where the rows do not follow conjugate directions of the
surface, quads cannot be planar and near it at once: what is left is measured and named.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix, vstack

from ..grid.grid import Grid
from ..grid.panels import (
    PLANAR_ENOUGH,
    area_vectors_of,
    diagonals_of,
    inner_angles_of,
    loops_of,
    planarity_of,
    sizes_of,
)
from ..improve.working_mesh import WorkingMesh
from ..kernels.mesh.grid import AT_REST, INTERIOR, ON_CURVE
from ..kernels.surface.local_surface import feet_on_patches
from .factor import factored
from .stops import slide_back, ways_along

FARTHEST_OFF_SCAN = 0.1  # distance of a node from the scan up to which panels are made planar [members]
PLANAR_ROUNDS = 60  # solutions
FIRST_PULL, LAST_PULL = 0.3, 3000.0  # weight of the planes in the first and the last round, against lengths
STAY_WEIGHT = 0.02  # weight of where nodes were in the round before
# weight of the distance from the scan, and of what is beyond the share that is held
NEAR_SCAN, BACK_TO_SCAN = 0.002, 30.0
HELD_FROM = 0.93  # share of `FARTHEST_OFF_SCAN` at which a node is held
BRACE_WEIGHT = 0.2  # share of that weight for the ways across panels, which keep them from becoming hollow
LEAST_LEFT = 0.7  # share of its length that each member keeps
SHORTEST_LEFT = 0.51  # length to which members may become shorter, more than the certificate asks for [desired lengths]
WIDEST_IN_ROUND = 178.0  # angle within a panel up to which a round counts [degree]
UNSOUND_ROUNDS = 3  # in a row, after which harder pulls do not help
HELD_FAST = 1e3  # weight of what does not move
SET_ASIDE = 1.2  # growth of the coefficient of variation of the lengths up to which a round counts
LEAST_VARIATION = 0.01  # coefficient of variation that any grid may have


class Feet(NamedTuple):
    """Where nodes are against the scan."""

    normal: np.ndarray  #: (V, 3) of the scan
    off: np.ndarray  #: (V,) distance along it, with its sign [scan unit]


def make_planar(mesh: WorkingMesh, grid: Grid, reach: float = 1.0) -> Grid:
    """Return a grid with its panels as planar as nodes within a tenth of a member of the scan and even lengths allow.

    Nodes of the boundary and of lines slide. The grid is returned as it is if nothing is gained.

    Parameters
    ----------
    mesh : WorkingMesh
        The grid opened; its node k is node k of the grid. Its nodes are moved.
    grid : Grid
        Of quads or hexagons, on the scan.
    reach : float
        Share of the tenth of a member that nodes may be off the scan, above 0 to 1.
    """
    most_off = reach * HELD_FROM * FARTHEST_OFF_SCAN
    net, count, panels = mesh.net, len(grid.nodes), grid.panel_table
    nodes, kind = net.nodes[:count], net.kind[:count]
    target = mesh.length * net.desired[:count]
    ends, lengths = grid.edges, grid.lengths
    braces = _braces(panels)
    spans = np.linalg.norm(nodes[braces[:, 0]] - nodes[braces[:, 1]], axis=1)
    rails = ends[(grid.edge_uses == 1) | grid.edge_on_line]
    shortest = np.maximum(LEAST_LEFT * lengths, np.minimum(lengths, SHORTEST_LEFT * target[ends].mean(axis=1)))
    most_uneven = max(SET_ASIDE * grid.quality.length_cv, LEAST_VARIATION)
    angles = inner_angles_of(nodes, panels)
    widest = max(WIDEST_IN_ROUND, float(np.nanmax(angles, initial=0.0)) + 1.0)  # those that stay turn a little
    wide = panels[(np.where(panels >= 0, angles, 0.0) > WIDEST_IN_ROUND).any(axis=1)]
    kind[wide[wide >= 0]] = AT_REST  # such panels would turn over
    kind[np.abs(_feet(mesh, count).off) > most_off * target] = AT_REST  # where the scan is not smooth
    best, least = nodes.copy(), _bent(nodes, panels)
    unsound = 0
    for number in range(PLANAR_ROUNDS):
        pull = FIRST_PULL * (LAST_PULL / FIRST_PULL) ** (number / (PLANAR_ROUNDS - 1))
        feet = _feet(mesh, count)
        parts = [
            _weighed(*_planes(nodes, panels), np.sqrt(pull)),
            _lengths_kept(nodes, ends, lengths),
            _weighed(*_lengths_kept(nodes, braces, spans), BRACE_WEIGHT),
            _near_scan(feet, kind, target, most_off),
            _held(kind, ways_along(nodes, rails), target),
        ]
        matrix = vstack([rows for rows, _ in parts]).tocsc()
        aim = np.concatenate([values for _, values in parts])
        move = factored((matrix.T @ matrix).tocsc()).solve(matrix.T @ aim).reshape(-1, 3)
        nodes += np.where((kind >= AT_REST)[:, None], 0.0, move)  # fixed nodes and corners not even by a little
        slide_back(mesh, count)
        _bring_back(mesh, count, most_off * target)
        bent = _bent(nodes, panels)
        sound = _is_sound(nodes, grid, shortest, widest, most_uneven)
        unsound = 0 if sound else unsound + 1
        if sound and bent < least:
            best, least = nodes.copy(), bent
        if least == 0.0 or unsound == UNSOUND_ROUNDS:
            break
    nodes[:] = best
    return grid.replace(nodes=best)


def _is_sound(nodes: np.ndarray, grid: Grid, shortest: np.ndarray, widest: float, most_uneven: float) -> bool:
    """Whether members are even and none is too short, and no panel hollow."""
    start, end = grid.edges.T
    sizes = np.linalg.norm(nodes[start] - nodes[end], axis=1)
    angles = inner_angles_of(nodes, grid.panel_table)
    return bool(
        sizes.std() <= most_uneven * sizes.mean()
        and (sizes >= shortest * (1.0 - 1e-9)).all()
        and np.nanmax(angles, initial=0.0) <= widest
    )


def _bent(nodes: np.ndarray, panels: np.ndarray) -> float:
    """Return by how much panels are off beyond what is planar, on the mean and a little for the worst."""
    off = np.maximum(planarity_of(nodes, panels) - PLANAR_ENOUGH, 0.0)
    return float(off.mean() + 0.1 * off.max(initial=0.0))


def _feet(mesh: WorkingMesh, count: int) -> Feet:
    """Return where the first `count` nodes are against the scan."""
    mesh.renew(0.3)
    nodes, patches = mesh.net.nodes[:count], mesh.patches[:count]
    foot = np.empty((count, 3))
    feet_on_patches(patches, nodes, foot)
    normal = patches["normal"].copy()
    return Feet(normal, ((nodes - foot) * normal).sum(axis=1))


def _bring_back(mesh: WorkingMesh, count: int, most: np.ndarray) -> None:
    """Bring nodes inside that are farther off the scan than is allowed (V,) as near as that."""
    feet, kind = _feet(mesh, count), mesh.net.kind[:count]
    beyond = np.where(kind == INTERIOR, feet.off - np.clip(feet.off, -most, most), 0.0)
    mesh.net.nodes[:count] -= beyond[:, None] * feet.normal


def _rows(at: np.ndarray, ways: np.ndarray, count: int) -> csr_matrix:
    """Return a matrix whose rows (R) are the sums of ways (R, K, 3) times the moves of nodes (R, K)."""
    columns = (3 * at[:, :, None] + np.arange(3)).reshape(len(at), 3 * at.shape[1])
    row = np.repeat(np.arange(len(at)), columns.shape[1])
    return coo_matrix((ways.reshape(-1), (row, columns.ravel())), shape=(len(at), 3 * count)).tocsr()


def _weighed(matrix: csr_matrix, aim: np.ndarray, weight: float) -> tuple[csr_matrix, np.ndarray]:
    return weight * matrix, weight * aim


def _planes(nodes: np.ndarray, panels: np.ndarray) -> tuple[csr_matrix, np.ndarray]:
    """Return what brings each corner of each panel into its mean plane [mean diagonals]."""
    normal = area_vectors_of(nodes, panels)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    diagonal, size = np.maximum(diagonals_of(nodes, panels), 1e-300), sizes_of(panels)
    found, aims = [], []
    for corners in np.unique(size).tolist():
        own = np.flatnonzero(size == corners)
        at, across = panels[own, :corners], normal[own] / diagonal[own, None]
        middle = nodes[at].mean(axis=1)
        for k in range(corners):
            share = -np.full(corners, 1.0 / corners)
            share[k] += 1.0
            found.append(_rows(at, share[None, :, None] * across[:, None, :], len(nodes)))
            aims.append(-((nodes[at[:, k]] - middle) * across).sum(axis=1))
    return vstack(found).tocsr(), np.concatenate(aims)


def _lengths_kept(nodes: np.ndarray, ends: np.ndarray, lengths: np.ndarray) -> tuple[csr_matrix, np.ndarray]:
    """Return what keeps the members as long as they were [their lengths]."""
    way = nodes[ends[:, 1]] - nodes[ends[:, 0]]
    size = np.linalg.norm(way, axis=1)
    way /= np.maximum(size * lengths, 1e-300)[:, None]
    return _rows(ends, np.stack([-way, way], axis=1), len(nodes)), (lengths - size) / lengths


def _braces(panels: np.ndarray) -> np.ndarray:
    """Return the nodes of panels that are next but one to each other (K, 2)."""
    found = {
        (min(a, b), max(a, b))
        for loop in loops_of(panels)
        for a, b in zip(loop, loop[2:] + loop[:2], strict=True)
        if len(loop) > 3
    }
    return np.array(sorted(found), np.int64).reshape(-1, 2)


def _near_scan(feet: Feet, kind: np.ndarray, target: np.ndarray, most: float) -> tuple[csr_matrix, np.ndarray]:
    """Return what holds nodes inside near the scan, hardly so within what is allowed [members]."""
    some = np.flatnonzero(kind == INTERIOR)
    off = feet.off[some] / target[some]
    beyond = np.abs(off) > most
    weight = np.sqrt(np.where(beyond, BACK_TO_SCAN, NEAR_SCAN))
    aim = np.where(beyond, np.sign(off) * most, 0.0) - off
    across = feet.normal[some] * (weight / target[some])[:, None]
    return _rows(some[:, None], across[:, None, :], len(kind)), weight * aim


def _held(kind: np.ndarray, along: np.ndarray, target: np.ndarray) -> tuple[csr_matrix, np.ndarray]:
    """Return what keeps all nodes from going far, those that slide on their curves and others where they are."""
    weight = np.where(kind >= AT_REST, HELD_FAST, STAY_WEIGHT)[:, None, None] * np.eye(3)
    slides = np.flatnonzero((kind == ON_CURVE) & (np.linalg.norm(along, axis=1) > 0.5))
    weight[slides] += HELD_FAST * (np.eye(3) - along[slides, :, None] * along[slides, None, :])
    at = np.repeat(np.arange(len(kind)), 3)[:, None]
    return _rows(at, (weight / target[:, None, None]).reshape(-1, 1, 3), len(kind)), np.zeros(3 * len(kind))
