"""A printed model in parts that fit a bed, with plug joints in the middle of the members between them.

The nodes are halved across their longest extent until each part fits. A member between two parts is cut in its middle, where a coupling
lies along the direction of the halving: half of it on either part, a peg on one, a socket in the other. All couplings between the two
sides of a halving are parallel, so parts slide together, those that were halved last first.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

from ...errors import InputError, unit_words
from ...grid.grid import Grid
from ...grid.marks import member_marks, numbered
from ...kernels.geometry.components import component_labels
from ...layouts.framework import outer_normals
from ..solid import balls_of, bars_of, check_diameters, marked_bars, unite
from .plates import Bed, PrintedPart

PEG_SIDES = 32  # sides of the prism that stands for a peg
PEG_RADIUS = 0.5  # radius of a peg over that of the coupling; it is as long as the coupling's radius
COUPLING_FLOOR = 0.4  # what a coupling is longer than its socket, over its radius
THINNEST_COUPLING = 1.4  # coupling over member
ROUNDED_OVERLAP = 1e-9  # of two parts over one of them, which rounding makes
MOST_HALVINGS = 40  # of one part


@dataclass(frozen=True)
class Joint:
    """Sizes of the couplings [printed unit]."""

    radius: float
    clearance: float  #: between peg and socket, all around and at the end

    @property
    def peg(self) -> float:
        """Radius of the peg."""
        return PEG_RADIUS * self.radius

    @property
    def half(self) -> float:
        """Length of half a coupling."""
        return (1.0 + COUPLING_FLOOR) * self.radius + self.clearance

    @property
    def wide(self) -> float:
        """Radius of what is free around half a coupling, to the corners."""
        return float((self.radius + self.clearance) / np.cos(np.pi / PEG_SIDES))

    @property
    def reach(self) -> float:
        """Distance from the middle of the member beyond which there is nothing of the coupling."""
        return float(np.hypot(self.wide, self.half + self.clearance))


def check_joint(grid: Grid, member: float, node: float, scale: float, clearance: float) -> Joint:
    """Return the sizes of the couplings, or refuse those that do not work.

    Parameters
    ----------
    member, node : diameters of the model [printed unit]
    """
    if not 0 < clearance < np.inf:
        raise InputError(f"the clearance must be a positive number, got {clearance}")
    joint = Joint(max(node, THINNEST_COUPLING * member) / 2, clearance)
    unit = unit_words(grid.unit)
    if clearance > joint.radius / 4:
        raise InputError(
            f"the clearance {clearance:g}{unit} leaves no wall around a socket in couplings of {2 * joint.radius:.4g}{unit};"
            f" give at most {joint.radius / 4:.3g}{unit} or a larger --node-diameter"
        )
    short = int(np.argmin(grid.lengths))
    if (room := float(grid.lengths[short]) * scale / 2 - node / 2) < joint.reach:
        raise InputError(
            f"the member {member_marks(grid)[short]} has {room:.4g}{unit} from its middle to the ball and a plug joint needs"
            f" {joint.reach:.4g}{unit}; give smaller diameters, a smaller --clearance or a larger --scale"
        )
    return joint


def flat_axes(points: np.ndarray) -> np.ndarray:
    """Return (3, 3) right-handed axes as rows: along which points (N, 3) reach farthest, and least last."""
    around = points - points.mean(axis=0)
    axes: np.ndarray = np.linalg.svd(np.concatenate([around, np.zeros((3, 3))]), full_matrices=False)[2]
    for axis in axes[:2]:
        axis *= 1.0 if axis[np.abs(axis).argmax()] > 0 else -1.0
    axes[2] = np.cross(axes[0], axes[1])
    return axes


def _outside_up(axes: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Return axes (3, 3) turned about the first one by half a turn where the outside, with the marks, would lie on the bed."""
    return axes if axes[2] @ normal >= 0 else axes * np.array([[1.0], [-1.0], [-1.0]])


def divide_for_bed(
    nodes: np.ndarray, edges: np.ndarray, bed: Bed, pad: float, pad_cut: float, unit: str = ""
) -> tuple[np.ndarray, np.ndarray]:
    """Return the part of each node (V,), and for each member (E, 3) the direction in which its two parts come apart; 0 within one.

    Parameters
    ----------
    nodes : (V, 3) [printed unit]
    edges : (E, 2)
    pad, pad_cut : what a part reaches beyond its nodes, and beyond the middles of members cut [printed unit]

    Raises
    ------
    InputError
        A single node with half of its members does not fit.
    """
    part = np.full(len(nodes), -1)
    pulled = np.zeros((len(edges), 3))
    middles = nodes[edges].mean(axis=1)
    count = 0
    open_sets = [(ids, 0) for ids in reversed(_connected(np.arange(len(nodes)), edges, len(nodes)))]
    while open_sets:  # a set is a half of the one before it, MOST_HALVINGS times at most
        ids, depth = open_sets.pop()
        inside = np.zeros(len(nodes), bool)
        inside[ids] = True
        cut = inside[edges].sum(axis=1) == 1
        axes = flat_axes(np.concatenate([nodes[ids], middles[cut]])).T
        pads = np.repeat([pad, pad_cut], [len(ids), cut.sum()])[:, None]
        flat = np.concatenate([nodes[ids], middles[cut]]) @ axes
        size = (flat + pads).max(axis=0) - (flat - pads).min(axis=0)
        across = (size[:2] <= bed[:2]).all() or (size[1::-1] <= bed[:2]).all()
        if across and size[2] <= bed[2]:
            part[ids] = count
            count += 1
            continue
        if len(ids) == 1 or depth == MOST_HALVINGS:
            words = " x ".join(f"{side:.4g}" for side in size)
            raise InputError(
                f"a node with half of its members needs {words}{unit_words(unit)} and the bed is"
                f" {' x '.join(f'{b:g}' for b in bed)}{unit_words(unit)};"
                " give a larger --bed or a smaller --scale"
            )
        axis = flat_axes(nodes[ids])[0]
        order = np.lexsort((ids, nodes[ids] @ axis))
        far = np.zeros(len(nodes), bool)
        far[ids[order[len(ids) // 2 :]]] = True
        crossing = inside[edges].all(axis=1) & (far[edges].sum(axis=1) == 1)
        pulled[crossing] = axis
        for side in (far, inside & ~far):
            open_sets += [(each, depth + 1) for each in reversed(_connected(np.flatnonzero(side), edges, len(nodes)))]
    return part, pulled


def _connected(ids: np.ndarray, edges: np.ndarray, count: int) -> list[np.ndarray]:
    """Return the connected sets of some nodes."""
    inside = np.zeros(count, bool)
    inside[ids] = True
    inner = edges[inside[edges].all(axis=1)]
    label = component_labels(count, inner[:, 0], inner[:, 1])[ids]
    return [ids[label == each] for each in np.unique(label)]


def build_parts(
    grid: Grid, *, member: float, node: float, scale: float, bed: Bed, clearance: float, sides: int, marks: bool
) -> list[PrintedPart]:
    """Return the printed model in parts that fit the bed; see `print_parts`."""
    check_diameters(grid, member, node, scale, sides)
    joint = check_joint(grid, member, node, scale, clearance)
    used, edges = np.unique(grid.edges, return_inverse=True)
    edges = edges.reshape(-1, 2)
    nodes = np.asarray(grid.nodes[used], np.float64) * scale
    part_of, pulled = divide_for_bed(nodes, edges, bed, node / 2, joint.reach, grid.unit)
    if (along := (np.diff(nodes[edges], axis=1)[:, 0] * pulled).sum(axis=1)).any():
        edges = np.where((along < 0)[:, None], edges[:, ::-1], edges)  # from the side with pegs to that with sockets
    balls = balls_of(grid, used, nodes, node / 2, sides, marks)
    whole = bars_of(nodes, edges, member / 2, sides)
    half_members = _half_members(nodes, edges)
    at_ends = [bars_of(*half, member / 2, sides) for half in half_members]
    if marks:
        whole = marked_bars(grid, nodes, edges, whole, member / 2, (node / 2,) * 2, sides)
        taken = node / 2, joint.reach
        at_ends = [
            marked_bars(grid, *half, bars, member / 2, taken, sides)
            for half, bars in zip(half_members, at_ends, strict=True)
        ]
    normals = outer_normals(grid)[used]
    names = numbered("part ", int(part_of.max()) + 1, 1)
    made = []
    for number, name in enumerate(names):
        ids = np.flatnonzero(part_of == number)
        mine = part_of[edges] == number
        inner = np.flatnonzero(mine.all(axis=1))
        bodies = [*(balls[k] for k in ids.tolist()), *(whole[k] for k in inner.tolist())]
        sockets, middles = [], []
        for k in np.flatnonzero(mine.sum(axis=1) == 1).tolist():
            middle, plug = nodes[edges[k]].mean(axis=0), bool(mine[k, 0])
            end, hollow = _coupled(at_ends[0 if plug else 1][k], middle, pulled[k], joint, plug=plug)
            bodies.append(end)
            sockets += [] if hollow is None else [hollow]
            middles.append(middle)
        body = unite(bodies)
        if sockets:
            body -= unite(sockets)
        points = np.concatenate([nodes[ids], np.reshape(middles, (-1, 3))])
        made.append(
            PrintedPart(
                name,
                body,
                _outside_up(flat_axes(points), normals[ids].sum(axis=0)),
                len(inner) - len(ids) + 1,
                used[ids],
            )
        )
    check_apart(made, grid.unit)
    return made


def check_apart(parts: list[PrintedPart], unit: str = "") -> None:
    """Refuse parts that overlap, where couplings lie too near to other members."""
    boxes = np.array([part.body.bounding_box() for part in parts])
    for a, b in combinations(range(len(parts)), 2):
        if (boxes[a, :3] > boxes[b, 3:]).any() or (boxes[b, :3] > boxes[a, 3:]).any():
            continue
        if (shared := (parts[a].body ^ parts[b].body).volume()) > ROUNDED_OVERLAP * parts[a].body.volume():
            raise InputError(
                f"{parts[a].name} and {parts[b].name} would overlap by {shared:.3g}{unit_words(unit, power=3)},"
                " where plug joints lie close; give smaller diameters or a larger --scale"
            )


def _half_members(nodes: np.ndarray, edges: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return the members from start to middle, then from end to middle: nodes and middles (V + E, 3), and their numbers (E, 2)."""
    middles = len(nodes) + np.arange(len(edges))
    places = np.concatenate([nodes, nodes[edges].mean(axis=1)])
    return [(places, np.stack([end, middles], axis=1)) for end in edges.T]


def _coupled(bar: Any, middle: np.ndarray, pull: np.ndarray, joint: Joint, *, plug: bool) -> tuple[Any, Any]:
    """Return half a member with its half of the coupling, and what is to be taken off for the socket; None on the side of the peg."""
    way = pull if plug else -pull  # towards the other part
    bar = bar - _cylinder(middle, way, joint.wide, joint.half + joint.clearance)
    own = _cylinder(middle, -way, joint.radius, joint.half)
    if plug:
        start = middle - way * joint.half / 2
        peg = _cylinder(start, way, joint.peg, joint.half / 2 + joint.radius)
        return unite([bar, own, peg]), None
    wide = (joint.peg + joint.clearance) / np.cos(np.pi / PEG_SIDES)
    start = middle + way * joint.half / 2
    return unite([bar, own]), _cylinder(start, -way, wide, joint.half / 2 + joint.radius + joint.clearance)


def _cylinder(start: np.ndarray, way: np.ndarray, radius: float, length: float) -> Any:
    """Return a cylinder from a place along a unit vector."""
    [made] = bars_of(np.stack([start, start + way * length]), np.array([[0, 1]]), radius, PEG_SIDES)
    return made
