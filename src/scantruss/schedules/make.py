"""Make the schedules of a grid."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..check.folds import fold_angles
from ..errors import InputError
from ..grid.certificate import check_passed
from ..grid.marks import member_marks, node_marks, panel_marks
from ..settings import UNITS
from .clusters import Clusters, cluster_lengths, cluster_nodes, cluster_panels
from .joints import check_grid, clear_radii, find_joints
from .parts import Parts
from .records import Schedules
from .tables import all_tables

if TYPE_CHECKING:
    from ..grid.grid import Grid
    from .settings import ScheduleSettings

SMALLEST, LARGEST = 1e-3, 1e9  # lengths of which a schedule can be made [mm]


def schedule(grid: Grid, settings: ScheduleSettings, *, keep_failed: bool = False) -> Schedules:
    """Return the schedules of nodes, members and panels, their types, quantities and warnings.

    Parameters
    ----------
    grid : Grid
        The grid; its coordinates are multiplied by the scale of the settings.
    settings : ScheduleSettings
        Tubes, balls, tolerances, building frame, limits.
    keep_failed : bool
        Take a grid that failed its certificate too.

    Raises
    ------
    InputError
        The unit is not known, or the grid is no oriented manifold of members with a length.
    CertificateError
        The grid failed its certificate.
    """
    check_passed(grid, keep_failed)
    if grid.unit and settings.unit not in ("", grid.unit):
        raise InputError(f"the grid is in {grid.unit}, so the unit cannot be {settings.unit}; leave --unit out")
    unit = grid.unit or settings.unit
    metres = UNITS[unit]
    if metres is None:
        raise InputError(
            "the unit of the grid is not known, and a schedule needs it; give --unit mm, cm, m, inch or foot"
        )
    size = 1000.0 * metres * settings.scale
    check_grid(grid)
    longest = float(grid.lengths.max()) * size
    if not SMALLEST <= longest <= LARGEST:
        raise InputError(
            f"the longest member would be {longest:g} mm long; check --scale {settings.scale:g} and the unit, {unit}"
        )
    joints = find_joints(grid)
    clear = clear_radii(joints, settings.tube)
    needed = np.where(joints.valence > 0, settings.tube / 2.0, 0.0)
    np.maximum.at(needed, joints.node[joints.pairs[:, 0]], clear)
    needed[joints.valence > 0] += settings.gap
    node_types = cluster_nodes(joints, settings.angle_tolerance)
    radius = np.where(joints.valence > 0, _radii(needed, node_types, settings.ball), 0.0)
    length = grid.lengths * size
    cut = length - radius[grid.edges].sum(axis=1)
    corners = grid.nodes[grid.triangles]
    sides = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2) * size
    return all_tables(
        Parts(
            grid=grid,
            settings=settings,
            unit=unit,
            size=size,
            joints=joints,
            clear=clear,
            needed=needed,
            radius=radius,
            length=length,
            cut=cut,
            sides=sides,
            fold=inner_folds(grid),
            node_types=node_types,
            panel_types=cluster_panels(sides, settings.tolerance),
            length_types=cluster_lengths(cut, settings.tolerance),
            node_marks=node_marks(grid),
            member_marks=member_marks(grid),
            panel_marks=panel_marks(grid),
        )
    )


def _radii(needed: np.ndarray, types: Clusters, ball: float | None) -> np.ndarray:
    """Return the radius of the balls: the given one, or for all nodes of a type the largest that one of them needs."""
    if ball is not None:
        return np.full(len(needed), ball / 2.0)
    largest = np.zeros(len(types.representative) + 1)
    np.maximum.at(largest, types.of, needed)
    return largest[types.of]


def inner_folds(grid: Grid) -> np.ndarray:
    """Return the angle between the panels at each member, inside (E,) [degree]: 180 level, less over a ridge, more in a valley."""
    fold = fold_angles(grid)
    two = np.flatnonzero(grid.edge_triangles[:, 1] >= 0)
    first, second = grid.triangles[grid.edge_triangles[two]].transpose(1, 0, 2)
    a, b, c = (grid.nodes[first[:, k]] for k in range(3))
    across = grid.nodes[
        second.sum(axis=1) - grid.edges[two].sum(axis=1)
    ]  # the node of the second that is not on the member
    valley = ((across - a) * np.cross(b - a, c - a)).sum(axis=1) > 0
    fold[two[valley]] = 360.0 - fold[two[valley]]
    return fold
