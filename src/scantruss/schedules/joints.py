"""What meets at the nodes: normals, the ends of the members in each ball's own frame, the angles between them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..errors import InputError
from ..grid.marks import member_marks, node_marks, panel_marks
from ..grid.panels import area_vectors_of, inner_angles_of
from ..layouts.framework import Framework

if TYPE_CHECKING:
    from ..grid.grid import Grid

LEAST_ANGLE = 1e-6  # between two members that do not lie on each other [degree]


@dataclass(frozen=True, eq=False)
class Joints:
    """The member ends at all nodes, node by node, anticlockwise seen from outside, from the lowest member on.

    The frame of a ball has z along the normal of the node and x along the tangent of its first member.
    """

    normal: np.ndarray  #: (V, 3) unit normals; NaN where there is no member
    frame: np.ndarray  #: (V, 3, 3) rows: x, y, z of each ball; NaN where there is no member
    start: np.ndarray  #: (V + 1,) first end of each node in the arrays below
    node: np.ndarray  #: (2 E,)
    member: np.ndarray  #: (2 E,)
    direction: np.ndarray  #: (2 E, 3) unit, away from the node
    own: np.ndarray  #: (2 E, 3) the same in the frame of the ball: where to drill
    azimuth: np.ndarray  #: (2 E,) from the x axis, about the normal, 0 to below 360 [degree]
    tilt: np.ndarray  #: (2 E,) angle to the normal [degree]
    to_next: np.ndarray  #: (2 E,) angle to the next end in space [degree]; NaN for the only one
    turn_to_next: (
        np.ndarray
    )  #: (2 E,) the same in the tangent plane, all of a node make 360 [degree]; NaN for the only one
    pairs: np.ndarray  #: (K, 2) any two ends of one node
    angle: np.ndarray  #: (K,) angle between them in space [degree]
    bolt: np.ndarray  #: (2 E,) diameter of its bolt, 0 where there is none [mm]
    one_layer: bool  #: whether all members lie about the tangent plane, so that their order about the normal is certain

    @property
    def valence(self) -> np.ndarray:
        """(V,) number of members at each node."""
        return np.diff(self.start)


def angle_between(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the angles between vectors, along the last axis [degree]."""
    return np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), (a * b).sum(axis=-1)))


def node_normals(grid: Grid) -> np.ndarray:
    """Return the unit normal of each node (V, 3), NaN where there is no panel; of layers those of the surface.

    The mean of the normals of its panels, weighted by their angles there (Thuermer and Wuethrich, Computing vertex normals from
    polygonal facets, Journal of Graphics Tools 3(1), 1998): it does not depend on how panels are cut into triangles.
    """
    if isinstance(grid, Framework):
        return grid.own_normals
    panels = grid.panel_table
    there = panels >= 0
    angles = grid.corner_angles if grid.panels is None else inner_angles_of(grid.nodes, panels)
    with np.errstate(invalid="ignore"):  # NaN for a panel without area, and for a node without panels
        normal = area_vectors_of(grid.nodes, panels)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        total = np.zeros((len(grid.nodes), 3))
        np.add.at(total, panels[there], (angles[:, :, None] * normal[:, None])[there])
        return total / np.linalg.norm(total, axis=1, keepdims=True)


def check_grid(grid: Grid) -> None:
    """Refuse a grid of which no schedule can be made.

    Raises
    ------
    InputError
        It has no members, is no oriented manifold, or has a member or panel without size.
    """
    if len(grid.edges) == 0:
        raise InputError("the grid has no members, so there is nothing to schedule; give one with a triangle at least")
    if not (grid.topology.manifold and grid.topology.orientable):
        words = "one-sided" if grid.topology.manifold else "not manifold"
        raise InputError(
            f"the grid is {words}, so its nodes have no outer side; schedules need one that passes its certificate"
        )
    if not np.isfinite(grid.nodes[np.unique(grid.edges)]).all():
        raise InputError("a node of the grid has no position (NaN); schedules need a grid that passes its certificate")
    if (short := np.flatnonzero(grid.lengths == 0.0)).size:
        raise InputError(f"member {member_marks(grid)[short[0]]} has no length; merge its nodes first")
    if (flat := np.flatnonzero((grid.angles == 0.0).any(axis=1))).size:
        raise InputError(f"panel {panel_marks(grid)[flat[0]]} has no area; remove it first")


def find_joints(grid: Grid) -> Joints:
    """Return the member ends at all nodes of a grid that `check_grid` has passed.

    Raises
    ------
    InputError
        Two members or panels lie on each other.
    """
    node = np.concatenate([grid.edges[:, 0], grid.edges[:, 1]])
    other = np.concatenate([grid.edges[:, 1], grid.edges[:, 0]])
    member = np.tile(np.arange(len(grid.edges)), 2)
    order = np.lexsort((member, node))
    node, other, member = node[order], other[order], member[order]
    start = np.searchsorted(node, np.arange(len(grid.nodes) + 1))
    normal = node_normals(grid)
    direction = grid.nodes[other] - grid.nodes[node]
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    if (bad := np.flatnonzero(np.isnan(normal[node]).any(axis=1))).size:
        raise InputError(f"node {node_marks(grid)[node[bad[0]]]} has no normal: its panels lie on each other")
    frame = _frames(normal, direction, start)
    own = np.einsum("kij,kj->ki", frame[node], direction)
    azimuth = np.degrees(np.arctan2(own[:, 1], own[:, 0])) % 360.0
    used = start[:-1] < start[1:]
    azimuth[start[:-1][used]] = 0.0  # not 360 less a rounding error
    order = np.lexsort((azimuth, node))
    member, direction, own, azimuth = member[order], direction[order], own[order], azimuth[order]
    following = np.arange(len(node)) + 1
    following[start[1:][used] - 1] = start[:-1][used]
    alone = following == np.arange(len(node))
    turn = np.where(alone, np.nan, (azimuth[following] - azimuth) % 360.0)
    pairs, angle = _pairs(node, start, direction)
    if (lying := np.flatnonzero(angle < LEAST_ANGLE)).size:
        one, two = (member_marks(grid)[member[k]] for k in pairs[lying[0]])
        raise InputError(
            f"members {one} and {two} lie on each other at node {node_marks(grid)[node[pairs[lying[0], 0]]]}"
        )
    return Joints(
        normal=normal,
        frame=frame,
        start=start,
        node=node,
        member=member,
        direction=direction,
        own=own,
        azimuth=azimuth,
        tilt=angle_between(direction, normal[node]),
        to_next=np.where(alone, np.nan, angle_between(direction, direction[following])),
        turn_to_next=turn,
        pairs=pairs,
        angle=angle,
        bolt=np.zeros(len(node), np.int64),
        one_layer=not isinstance(grid, Framework),
    )


def _frames(normal: np.ndarray, direction: np.ndarray, start: np.ndarray) -> np.ndarray:
    """Return x, y, z of each ball; a first member along the normal leaves x to the axis of the scan that is most across."""
    frame = np.full((len(normal), 3, 3), np.nan)
    used = np.flatnonzero(start[:-1] < start[1:])
    z = normal[used]
    first = direction[start[used]]
    tangent = first - (first * z).sum(axis=1, keepdims=True) * z
    along = np.linalg.norm(tangent, axis=1) < 1e-9
    axes = np.eye(3)[np.argmin(np.abs(z), axis=1)]
    tangent[along] = (axes - (axes * z).sum(axis=1, keepdims=True) * z)[along]
    x = tangent / np.linalg.norm(tangent, axis=1, keepdims=True)
    frame[used] = np.stack([x, np.cross(z, x), z], axis=1)
    return frame


def _pairs(node: np.ndarray, start: np.ndarray, direction: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return any two ends of one node and the angle between them, sorted by the ends."""
    place = np.arange(len(node))
    left = start[node + 1] - place  # ends of the node from this one on
    found = [np.stack([place[left > step], place[left > step] + step], axis=1) for step in range(1, int(left.max()))]
    pairs = np.concatenate(found)
    pairs = pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]
    return pairs, angle_between(direction[pairs[:, 0]], direction[pairs[:, 1]])


def clear_radii(joints: Joints, width: np.ndarray) -> np.ndarray:
    """Return for each pair of ends the distance from the node at which their members part (K,) [unit of `width`].

    In the plane of two axes at the angle a the edges of members of widths d and e, d / 2 and e / 2 from them, meet at
    (e / sin a + d / tan a) / 2 from the node along the axis of d, and likewise along the other. A square end no nearer than that, of
    either, lies beyond the edge of the other member; out of the plane round members are narrower. Beyond 90 degrees e / 2 and d / 2
    suffice, as a plane across one axis keeps them apart.

    Parameters
    ----------
    joints : Joints
    width : (E,) diameter of each member
    """
    own = width[joints.member[joints.pairs]]
    other, turn = own[:, ::-1], np.radians(joints.angle)[:, None]
    apart = (other + own * np.cos(turn)) / np.sin(turn) / 2
    radii: np.ndarray = np.where(joints.angle > 90.0, np.minimum(apart, other / 2).max(axis=1), apart.min(axis=1))
    return radii
