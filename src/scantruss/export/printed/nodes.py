"""A printed ball for each node, with sockets for rods."""

from __future__ import annotations

import numpy as np

from ...errors import InputError, unit_words
from ...grid.grid import Grid
from ...grid.marks import node_marks
from ...schedules.joints import check_grid, clear_radii, find_joints
from ..solid import balls_of, bars_of, check_diameters, unite
from .plates import PrintedPart

LEAST_WALL = 0.2  # least wall between two sockets over the diameter of the rod
LEAST_DEPTH = 0.5  # of a socket over the diameter of the rod
DEEPEST_SOCKET = 0.7  # of a socket over the radius of the ball
SOCKET_SIDES = 32  # sides of the prism that stands for a socket


def build_nodes(
    grid: Grid, *, member: float, node: float, scale: float, clearance: float, sides: int, marks: bool
) -> tuple[list[PrintedPart], np.ndarray]:
    """Return a ball with sockets for each node with members, lying with its normal up, and how far its sockets begin from its middle.

    Parameters
    ----------
    member, node : diameters of rods and balls [printed unit]
    clearance : between rod and socket, all around [printed unit]

    Raises
    ------
    InputError
        Sockets of a node meet, or leave too little depth.
    """
    check_diameters(grid, member, node, scale, sides)
    check_grid(grid)
    if not 0 <= clearance < np.inf:
        raise InputError(f"the clearance must be a number from 0, got {clearance}")
    joints = find_joints(grid)
    wide = member + 2 * clearance
    apart = np.zeros(len(joints.valence))
    at = joints.node[joints.pairs[:, 0]]
    np.maximum.at(apart, at, clear_radii(joints, np.full(len(grid.edges), wide + LEAST_WALL * member)))
    floor = np.maximum(apart, (1.0 - DEEPEST_SOCKET) * node / 2)
    needed = 2 * (floor + LEAST_DEPTH * member)
    used = np.flatnonzero(joints.valence)
    names = node_marks(grid)
    if (worst := used[needed[used].argmax()]) >= 0 and needed[worst] > node:
        unit = unit_words(grid.unit)
        raise InputError(
            f"the sockets of {names[worst]} would meet in a ball of {node:g}{unit}; it needs a --node-diameter of"
            f" {needed[worst]:.4g}{unit}, or thinner members"
        )
    balls = balls_of(grid, used, np.zeros((len(used), 3)), node / 2, sides, marks)
    made = []
    for ball, number in zip(balls, used.tolist(), strict=True):
        ways = joints.direction[joints.start[number] : joints.start[number + 1]]
        ends = np.concatenate([ways * floor[number], ways * node])
        pairs = np.stack([np.arange(len(ways)), np.arange(len(ways)) + len(ways)], axis=1)
        radius = wide / 2 / np.cos(np.pi / SOCKET_SIDES)
        body = ball - unite(bars_of(ends, pairs, radius, SOCKET_SIDES))
        made.append(PrintedPart(names[number], body, joints.frame[number], 0, np.array([number])))
    return made, floor
