"""Rows of quads: a field of four directions on a fine mesh, and a lattice that lies along it.

The directions are those of Jakob et al. (2015), "Instant field-aligned meshes", but found by diffusion and normalization in turn
(Viertel and Osting 2019, "An approach to quad meshing based on harmonic cross-valued maps and the Ginzburg-Landau theory"), which keeps
singular nodes apart. The lattice is a pair of phases per node, found in the same way: they agree from node to node but for the
rotation of the axes by right angles and the way between the nodes in members.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_matrix, csc_matrix, diags
from scipy.spatial import cKDTree

from ..improve.working_mesh import WorkingMesh
from ..kernels.cells.quads import RESTING_NODE, SLIDING_NODE
from ..scan.vectors import dots
from .factor import factored
from .fine_mesh import FineMesh
from .stops import ways_along

DIRECTION_TURNS = 30  # most turns of diffusion and normalization of the directions
LATTICE_TURNS = 30  # the same of the lattice
# weight of a guide where the principal curvatures differ by one over a member, against one edge
CURVATURE_WEIGHT = 20.0
HELD_WEIGHT = 30.0  # weight of what the boundary and lines ask of the lattice, against one edge
# way from the boundary and lines over which rows that follow them come to follow a guide [members]
ROWS_TURN_OVER = 1.5
LEAST_CHAIN_AGREEMENT = 0.5  # least agreement of the ways of chains at a node for it to tell a direction


class Guide(NamedTuple):
    """Directions that rows should follow."""

    direction: np.ndarray  #: (F, 3) in the tangent planes
    weight: np.ndarray  #: (F,) against one edge of the fine mesh


class RowStart(NamedTuple):
    """Squares of the distances over which a turn diffuses [members]: where they are large, irregular nodes are fewer."""

    directions: float
    lattice: float
    bent: bool = False  #: whether rows lie closer together where the boundary bends within a member


@dataclass(frozen=True, eq=False)
class LatticeRows:
    """Axes and lattice at each node of a fine mesh."""

    angle: np.ndarray  #: (F,) of the first axis in the frame of the node
    along: np.ndarray  #: (F, 3) first axis, a unit vector
    across: np.ndarray  #: (F, 3) second axis
    turn: np.ndarray  #: (E,) right angles from the axes at the first node of each edge to those at the second
    step: np.ndarray  #: (E, 2) way from the first to the second node in the axes of the first [members]
    offset: np.ndarray  #: (F, 2) way to the nearest node of the lattice in the axes of the node [members]


def find_rows(mesh: FineMesh, start: RowStart, guide: Guide | None = None) -> LatticeRows:
    """Return the rows of quads on a fine mesh.

    Parameters
    ----------
    mesh : FineMesh
    start : RowStart
    guide : Guide, optional
        Directions that the rows should follow away from the boundary and lines.
    """
    first, second = _frames(mesh.normals)
    i, j = mesh.edges.T
    way = mesh.nodes[j] - mesh.nodes[i]
    bend = np.arctan2(dots(way, second[j]), dots(way, first[j])) - np.arctan2(dots(way, second[i]), dots(way, first[i]))
    angle = _directions(mesh, first, second, bend, start.directions, guide)
    along = np.cos(angle)[:, None] * first + np.sin(angle)[:, None] * second
    across = np.cross(mesh.normals, along)
    turn, step = _passage(-way, along[i], across[i], along[j], across[j], mesh.length[i], mesh.length[j])
    step = -step
    offset = _offsets(_lattice(mesh, along, across, turn, step, start.lattice))
    return LatticeRows(angle, along, across, turn, step, offset)


def principal_directions(mesh: WorkingMesh, count: int) -> Guide:
    """Return the direction of greatest curvature at the first nodes of an opened grid, and how much the curvatures differ there."""
    patch = mesh.patches[:count]
    u, normal, heights = patch["tangent"], patch["normal"], patch["heights"]
    v = np.cross(normal, u)
    xx, xy, yy = 2.0 * heights[:, 3], heights[:, 4], 2.0 * heights[:, 5]
    angle = 0.5 * np.arctan2(2.0 * xy, xx - yy)
    apart = np.hypot(xx - yy, 2.0 * xy) * mesh.length
    return Guide(np.cos(angle)[:, None] * u + np.sin(angle)[:, None] * v, CURVATURE_WEIGHT * apart)


def spread_rows(rows: LatticeRows, coarse: FineMesh, fine: FineMesh) -> LatticeRows:
    """Return the rows on a finer mesh of the same grid as those at the corners of its triangles say."""
    first, second = _frames(fine.normals)
    total = np.zeros(len(fine.nodes), complex)
    for k in range(3):
        own = fine.owners[:, k]
        aim = rows.along[own] - dots(rows.along[own], fine.normals)[:, None] * fine.normals
        total += fine.shares[:, k] * np.exp(4j * np.arctan2(dots(aim, second), dots(aim, first)))
    angle = np.angle(total) / 4
    along = np.cos(angle)[:, None] * first + np.sin(angle)[:, None] * second
    across = np.cross(fine.normals, along)
    phases = np.zeros((len(fine.nodes), 2), complex)
    for k in range(3):
        own = fine.owners[:, k]
        way = fine.nodes - coarse.nodes[own]
        turn, step = _passage(way, along, across, rows.along[own], rows.across[own], fine.length, coarse.length[own])
        known = np.exp(-2j * math.pi * rows.offset[own])
        u = np.choose(turn, [known[:, 0], known[:, 1], known[:, 0].conj(), known[:, 1].conj()])
        v = np.choose(turn, [known[:, 1], known[:, 0].conj(), known[:, 1].conj(), known[:, 0]])
        phases += fine.shares[:, [k]] * np.stack([u, v], axis=1) * np.exp(2j * math.pi * step)
    offset = -np.angle(phases) / (2 * math.pi)
    i, j = fine.edges.T
    turn, step = _passage(
        fine.nodes[i] - fine.nodes[j], along[i], across[i], along[j], across[j], fine.length[i], fine.length[j]
    )
    return LatticeRows(angle, along, across, turn, -step, offset)


def _passage(
    way: np.ndarray, along: np.ndarray, across: np.ndarray, other_along: np.ndarray, other_across: np.ndarray,
    length: np.ndarray, other_length: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Return the right angles from the axes at one place to those at another, and the way from the other to the one [members]."""
    x, y = dots(along, other_along), dots(along, other_across)
    turn = np.rint(np.arctan2(y, x) / (math.pi / 2)).astype(np.int64) % 4
    p, q = dots(way, other_along), dots(way, other_across)
    u = 0.5 * (dots(way, along) + np.choose(turn, [p, q, -p, -q]))
    v = 0.5 * (dots(way, across) + np.choose(turn, [q, -p, -q, p]))
    return turn, np.stack([u, v], axis=1) / (0.5 * (length + other_length))[:, None]


def _frames(normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return two unit vectors at right angles in each tangent plane."""
    axis = np.eye(3)[np.abs(normals).argmin(axis=1)]
    first = np.cross(axis, normals)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return first, np.cross(normals, first)


def _directions(
    mesh: FineMesh,
    first: np.ndarray,
    second: np.ndarray,
    bend: np.ndarray,
    diffusion: float,
    guide: Guide | None,
) -> np.ndarray:
    """Return the angle of the first axis in the frame of each node (F,)."""
    count, (i, j) = len(mesh.nodes), mesh.edges.T
    carried = np.exp(-4j * bend)  # from the second node to the first
    ones = np.ones(len(i))
    laplacian = coo_matrix(
        (
            np.concatenate([ones, ones, -carried, -carried.conj()]),
            (np.concatenate([i, j, i, j]), np.concatenate([i, j, j, i])),
        ),
        shape=(count, count),
    ).tocsc()
    aim = np.zeros(count, complex)
    a, b = mesh.chains.T
    for v, w in ((a, b), (b, a)):
        run = mesh.nodes[w] - mesh.nodes[v]
        np.add.at(aim, v, np.exp(4j * np.arctan2(dots(run, second[v]), dots(run, first[v]))))
    ends = np.bincount(mesh.chains.ravel(), minlength=count)
    size = np.abs(aim) / np.maximum(ends, 1)
    aim /= np.maximum(np.abs(aim), 1e-300)
    strength = np.where((ends > 0) & (size > LEAST_CHAIN_AGREEMENT), 1e4, 0.0)
    if guide is not None:
        wanted = np.exp(4j * np.arctan2(dots(guide.direction, second), dots(guide.direction, first)))
        led = strength > 0.0  # by the boundary or a line
        share = np.minimum(_distances_from(mesh, led) / ROWS_TURN_OVER, 1.0)
        aim, strength = np.where(led, aim, wanted), np.where(led, strength, share**2 * guide.weight)
    if not strength.any():
        aim[0], strength[0] = 1.0, 1e-3
    field = factored(laplacian + diags(strength + 1e-9, format="csc")).solve(strength * aim)
    rate = 1.0 / diffusion
    solver = factored(laplacian + diags(strength + rate, format="csc"))
    for _ in range(DIRECTION_TURNS):
        unit = field / np.maximum(np.abs(field), 1e-300)
        field = solver.solve(strength * aim + rate * unit)
    return np.angle(field) / 4


def _distances_from(mesh: FineMesh, some: np.ndarray) -> np.ndarray:
    """Return the distance of each node from the nearest of some (F,) bool, in members (F,)."""
    if not some.any():
        return np.full(len(some), np.inf)
    away: np.ndarray = cKDTree(mesh.nodes[some]).query(mesh.nodes)[0]
    return away / mesh.length


def _lattice(
    mesh: FineMesh, along: np.ndarray, across: np.ndarray, turn: np.ndarray, step: np.ndarray, diffusion: float
) -> np.ndarray:
    """Return the phases of the lattice at each node, in its axes, as cosine and sine (F, 2, 2)."""
    count, (i, j) = len(mesh.nodes), mesh.edges.T
    degree = np.bincount(mesh.edges.ravel(), minlength=count)
    rows, columns, values = [np.arange(4 * count)], [np.arange(4 * count)], [np.repeat(degree, 4).astype(float)]
    # coordinate p of the first node is coordinate `source` of the second, or its negative
    for p in (0, 1):
        source = (p + turn) % 2
        sign = np.where(((p == 0) & (turn >= 2)) | ((p == 1) & ((turn == 1) | (turn == 2))), -1.0, 1.0)
        c, s = np.cos(2 * math.pi * step[:, p]), np.sin(2 * math.pi * step[:, p])
        # phase at i = conj or not (phase at j) times exp(-2 pi i step)
        for r, k, value in ((0, 0, c), (0, 1, s * sign), (1, 0, -s), (1, 1, c * sign)):
            at_i, at_j = 4 * i + 2 * p + r, 4 * j + 2 * source + k
            rows += [at_i, at_j]
            columns += [at_j, at_i]
            values += [-value, -value]
    matrix = csc_matrix(
        (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape=(4 * count, 4 * count)
    )
    weight = np.zeros((count, 2))
    a, b = mesh.chains.T
    for v, w in ((a, b), (b, a)):
        run = mesh.nodes[w] - mesh.nodes[v]
        runs_along = np.abs(dots(run, along[v])) > np.abs(dots(run, across[v]))
        weight[v[runs_along], 1] = HELD_WEIGHT
        weight[v[~runs_along], 0] = HELD_WEIGHT
    weight[mesh.held == RESTING_NODE] = HELD_WEIGHT
    if not weight.any():
        weight[0] = 1e-3
    pull = np.repeat(weight.ravel(), 2)
    aim = np.zeros((count, 2, 2))
    aim[:, :, 0] = 1.0
    held = pull * aim.ravel()
    field = factored(matrix + diags(pull + 1e-6, format="csc")).solve(held)
    rate = 1.0 / diffusion
    solver = factored(matrix + diags(pull + rate, format="csc"))
    for _ in range(LATTICE_TURNS):
        pairs = field.reshape(-1, 2)
        unit = pairs / np.maximum(np.linalg.norm(pairs, axis=1, keepdims=True), 1e-300)
        field = solver.solve(held + rate * unit.ravel())
    return field.reshape(count, 2, 2)


def _offsets(field: np.ndarray) -> np.ndarray:
    """Return the way to the nearest node of the lattice for phases (F, 2, 2) (F, 2) [members]."""
    return -np.arctan2(field[:, :, 1], field[:, :, 0]) / (2 * math.pi)


def offsets_of_edges(mesh: FineMesh, rows: LatticeRows) -> np.ndarray:
    """Return the way from the lattice node of the first to that of the second node of each edge, in the axes of the first (E, 2)."""
    i, j = mesh.edges.T
    other, turn = rows.offset[j], rows.turn
    # the axes of the second, turned by `turn`, are those of the first: a = R^turn a', so a' = R^-turn a
    u, v = (
        np.choose(turn, [other[:, 0], other[:, 1], -other[:, 0], -other[:, 1]]),
        np.choose(turn, [other[:, 1], -other[:, 0], -other[:, 1], other[:, 0]]),
    )
    return rows.step + np.stack([u, v], axis=1) - rows.offset[i]


def lattice_places(mesh: FineMesh, rows: LatticeRows) -> np.ndarray:
    """Return the place of the lattice node nearest to each node of the fine mesh (F, 3), for those of chains as near on the chain."""
    offset = rows.offset * mesh.length[:, None]
    way = offset[:, :1] * rows.along + offset[:, 1:] * rows.across
    slides, run = mesh.held == SLIDING_NODE, ways_along(mesh.nodes, mesh.chains)
    way[slides] = dots(way[slides], run[slides])[:, None] * run[slides]
    return mesh.nodes + way
