"""Stiffness of members and of the whole: Euler-Bernoulli members in space, by their six natural deformations.

A member between two nodes deforms in six ways: it lengthens, twists, and bends at both ends about both axes (Argyris' natural
modes). `transforms` takes displacements of the nodes to these, `natural_stiffness` these to forces; rotational springs at the
ends are condensed by fixity factors (Monforton and Wu 1963). A pinned structure has the first way and three displacements a node only.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import coo_matrix, csc_matrix

if TYPE_CHECKING:
    from .truss import LoadCase, Truss

LENGTHEN, TWIST, BEND_Y1, BEND_Y2, BEND_Z1, BEND_Z2 = range(6)  #: rows of the natural deformations
BOW = (
    np.array([[4.0, -1.0], [-1.0, 4.0]]) / 30
)  #: by which turns t of both ends shorten a bent member, t BOW t / 2 of its length


def freedoms(truss: Truss) -> int:
    """Return the displacements of a node: 3 of a pinned structure, else 6."""
    return 3 if truss.pinned else 6


def member_freedoms(truss: Truss) -> np.ndarray:
    """Return the (M, 2 d) numbers of the displacements at both ends of each member."""
    count = freedoms(truss)
    return (truss.members[:, :, None] * count + np.arange(count)).reshape(len(truss.members), -1)


def transforms(truss: Truss) -> np.ndarray:
    """Return the (M, r, 2 d) matrices from displacements in global axes to natural deformations, r = 6, or 1 of a pinned structure."""
    axes, length = truss.axes, truss.lengths[:, None]
    x, y, z = axes[:, 0], axes[:, 1], axes[:, 2]
    if truss.pinned:
        return np.concatenate([-x, x], axis=1)[:, None, :]
    made = np.zeros((len(axes), 6, 12))
    made[:, LENGTHEN, 0:3], made[:, LENGTHEN, 6:9] = -x, x
    made[:, TWIST, 3:6], made[:, TWIST, 9:12] = -x, x
    for row, end in ((BEND_Y1, 3), (BEND_Y2, 9)):  # about y: a deflection along z turns the chord by -w / L
        made[:, row, end : end + 3] = y
        made[:, row, 0:3], made[:, row, 6:9] = -z / length, z / length
    for row, end in ((BEND_Z1, 3), (BEND_Z2, 9)):
        made[:, row, end : end + 3] = z
        made[:, row, 0:3], made[:, row, 6:9] = y / length, -y / length
    return made


def fixities(truss: Truss) -> np.ndarray:
    """Return the (M, 2, 2) fixity factors of the ends about y and z: 1 rigid, 0 hinged (Monforton and Wu 1963)."""
    bending = truss.material.young * np.stack([truss.of_section("inertia_y"), truss.of_section("inertia_z")], axis=1)
    flexible = 3 * (bending / truss.lengths[:, None])[:, None, :]
    rigid = np.isinf(truss.end_stiffness)
    spring = np.where(rigid, 0.0, truss.end_stiffness)
    return np.where(rigid, 1.0, spring / (spring + flexible))


def inner_turns(truss: Truss) -> np.ndarray:
    """Return the (M, 2, 2, 2) matrices, about y and z, from turns of the nodes to turns of the member's ends, behind the springs."""
    fixity = fixities(truss)
    first, second = fixity[:, 0], fixity[:, 1]
    under = 4 - first * second
    rows = (1 - 4 * (1 - first) / under, -2 * second * (1 - first) / under,
            -2 * first * (1 - second) / under, 1 - 4 * (1 - second) / under)  # fmt: skip
    return np.stack(rows, axis=2).reshape(-1, 2, 2, 2)


def natural_stiffness(truss: Truss) -> np.ndarray:
    """Return the (M, r, r) stiffness against the natural deformations."""
    young, length = truss.material.young, truss.lengths
    axial = young * truss.of_section("area") / length
    if truss.pinned:
        return axial[:, None, None]
    made = np.zeros((len(length), 6, 6))
    made[:, LENGTHEN, LENGTHEN] = axial
    made[:, TWIST, TWIST] = truss.material.shear * truss.of_section("torsion") / length
    fixity = fixities(truss)
    for axis, (one, two) in enumerate(((BEND_Y1, BEND_Y2), (BEND_Z1, BEND_Z2))):
        bending = young * truss.of_section(("inertia_y", "inertia_z")[axis]) / length
        first, second = fixity[:, 0, axis], fixity[:, 1, axis]
        share = bending / (4 - first * second)
        made[:, one, one], made[:, two, two] = 12 * first * share, 12 * second * share
        made[:, one, two] = made[:, two, one] = 6 * first * second * share
    return made


def fixed_end_forces(truss: Truss, case: LoadCase, line: np.ndarray) -> np.ndarray:
    """Return the (M, r) natural forces in members whose ends are held: of temperature, lack of fit and line loads in local axes [N, Nm]."""
    strain = np.zeros(len(truss.members))
    if case.temperature is not None:
        strain += truss.material.alpha * case.temperature
    if case.strain is not None:
        strain += case.strain
    held = np.zeros((len(truss.members), 1 if truss.pinned else 6))
    held[:, LENGTHEN] = -truss.material.young * truss.of_section("area") * strain
    if not truss.pinned:
        fixity = fixities(truss)
        for axis, (one, two, sign) in enumerate(((BEND_Y1, BEND_Y2, 1.0), (BEND_Z1, BEND_Z2, -1.0))):
            moment = sign * line[:, 2 - axis] * truss.lengths**2 / 12
            first, second = fixity[:, 0, axis], fixity[:, 1, axis]
            share = 3 * moment / (4 - first * second)
            held[:, one], held[:, two] = share * first * (2 - second), -share * second * (2 - first)
    return held


def assemble(rows: np.ndarray, matrices: np.ndarray, count: int) -> csc_matrix:
    """Return the sparse sum of (M, k, k) matrices of members with (M, k) numbers of displacements."""
    width = rows.shape[1]
    at = (np.repeat(rows, width, axis=1).ravel(), np.tile(rows, (1, width)).ravel())
    return coo_matrix((matrices.ravel(), at), shape=(count, count)).tocsc()


def stiffness_matrix(truss: Truss) -> csc_matrix:
    """Return the stiffness of all members and spring supports; held supports are left to the solution."""
    change = transforms(truss)
    matrices = change.transpose(0, 2, 1) @ natural_stiffness(truss) @ change
    count = len(truss.nodes) * freedoms(truss)
    made = assemble(member_freedoms(truss), matrices, count)
    springs = truss.supports[:, : freedoms(truss)].ravel()
    springs = np.where(np.isinf(springs), 0.0, springs)
    return (made + coo_matrix((springs, (np.arange(count), np.arange(count))), shape=(count, count))).tocsc()
