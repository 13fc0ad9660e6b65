"""Nodes that hang on points off the surface, as on a scaffold or a column under a roof: their members cross empty space to get there."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..grid.certificate import Fault, place_of
from .distances import nearest_point_distances, normals_at_nodes
from .gaps import points_within
from .limits import PLACES_KEPT

if TYPE_CHECKING:
    from ..grid.grid import Grid
    from ..surface.samples import SurfaceSamples
    from .distances import Distances

HALF_EMPTY = 0.2  # distance from the nearest point at which the middle of a member is in empty space [member lengths]
SPACINGS_EMPTY = 10.0  # ... and in spacings of the points
# radius around an end of a member within which points tell how the surface lies there [member lengths]
AROUND_END = 0.35
FEWEST_AT_END = 6  # fewest such points
FLAT_AT_END = 0.1  # variance across the surface there, in the next one, above which they are none
STEEP_MEMBER_SINE = 0.6  # sine of the angle between a member and the surface above which it leaves it
# such members at a node, and half of all, from which on it hangs: at a cliff or a horn there are fewer
FEWEST_MEMBERS = 3
# a spike is a node off an even sheet, as where a grid runs down a column or up a chimney: its members leave the sheet together
LITTLE_EMPTY, SPACINGS_LITTLE_EMPTY = 0.1, 5.0  # as HALF_EMPTY and SPACINGS_EMPTY for the members of a spike
EVEN_COSINE = 0.8  # cosine of the angle between a spike and the normal of the sheet at the other end of its member
# as STEEP_MEMBER_SINE and EVEN_COSINE, of a spike that is poor: on a bent sheet one excludes the other
LESS_STEEP_MEMBER_SINE, EVEN_FLAT_COSINE = 0.3, 0.9
# a sheet that rises to a mast is not even, so that a node elsewhere on the mast is no spike: the points around it tell
AROUND_ON_MAST = 0.6  # radius around such a node [member lengths]
# variance there across a mast, in that along it, at most: on a cone of 22 degrees and more it is larger
THIN_ON_MAST = 0.15
LEAST_MAST_COSINE = 0.7  # cosine of the angle between a mast and the normal of the grid at the node, least
BESIDE_MAST = 1.2  # distance from the mast within which the sheet around it is looked for [member lengths]
EDGE_AT_MAST = 0.15  # width of the edge of that sheet, which tells where it meets the mast [member lengths]
OFF_ALONG_MAST = 1.0 / 3.0  # height over or under that edge, least [member lengths]
WIDTHS_OF_MAST = 3.0  # distance from its axis up to which points are of the mast [standard deviations across it]


def hanging_nodes(grid: Grid, samples: SurfaceSamples, found: Distances, length: float) -> list[Fault]:
    """Return a fault where nodes hang on points off the surface, with their places; nothing where there is none.

    Parameters
    ----------
    found : how far the triangles of the grid lie from the points
    length : desired member length where the grid has none of its own [scan unit]
    """
    desired = np.full(len(grid.nodes), length) if grid.desired is None else grid.desired
    nodes = np.union1d(
        _far_off(grid, samples, found, desired), _spikes(grid, samples, desired, STEEP_MEMBER_SINE, EVEN_COSINE)
    )
    return _fault("hanging", "hangs on points off the surface, across empty space", grid, nodes)


def nodes_off_sheets(grid: Grid, samples: SurfaceSamples, length: float) -> list[Fault]:
    """Return a fault where nodes stand off an even sheet but not so far that they hang, or on a mast, with their places.

    Parameters as of `hanging_nodes`.
    """
    return _fault(
        "off sheet", "has a node on points that stand off the sheet around it", grid, _off(grid, samples, length)[1]
    )


def any_stands_off(grid: Grid, samples: SurfaceSamples, length: float) -> bool:
    """Whether a node hangs on points or stands off a sheet, as far as its members tell, without distances between grid and scan.

    Then the grid has a fault of `hanging_nodes` or of `nodes_off_sheets`; parameters as of these.
    """
    return any(len(nodes) for nodes in _off(grid, samples, length))


def _off(grid: Grid, samples: SurfaceSamples, length: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the nodes that are spikes steep enough to hang (K,), and the others that stand off an even sheet or on a mast (L,)."""
    desired = np.full(len(grid.nodes), length) if grid.desired is None else grid.desired
    hanging = _spikes(grid, samples, desired, STEEP_MEMBER_SINE, EVEN_COSINE)
    standing = np.union1d(
        _spikes(grid, samples, desired, LESS_STEEP_MEMBER_SINE, EVEN_FLAT_COSINE), _on_masts(grid, samples, desired)
    )
    # the lip of a thin body is no mast: all members leave it
    return hanging, np.setdiff1d(standing, np.union1d(hanging, grid.lines))


def _fault(kind: str, words: str, grid: Grid, nodes: np.ndarray) -> list[Fault]:
    """Return what is wrong with some nodes (K,), with their places; nothing where there is none."""
    if not len(nodes):
        return []
    where, *others = (place_of(grid.nodes[node] + grid.origin) for node in nodes[:PLACES_KEPT])
    more = f" ({len(nodes)} such places)" if len(nodes) > 1 else ""
    return [Fault(kind, words + more, where, tuple(others))]


def _far_off(grid: Grid, samples: SurfaceSamples, found: Distances, desired: np.ndarray) -> np.ndarray:
    """Return the nodes (K,) most of whose members cross space that is empty and leave the surface steeply."""
    members, uses = desired[grid.edges].mean(axis=1), np.bincount(grid.edges.ravel(), minlength=len(grid.nodes))
    least = np.maximum(HALF_EMPTY * members, SPACINGS_EMPTY * samples.spacing)
    away = np.where(np.isfinite(found.triangles), found.triangles, 0.0)[grid.edge_triangles]
    doubted = np.where(grid.edge_triangles >= 0, away, np.inf).min(axis=1) > least
    doubted &= _hangs(grid, doubted, uses)[grid.edges].any(axis=1)
    which = np.flatnonzero(doubted)
    if not len(which):
        return which
    doubted[which[_middles_away(grid, samples, which, desired) <= least[which]]] = False
    hanging = _hangs(grid, doubted, uses)
    which = np.flatnonzero(doubted & hanging[grid.edges].any(axis=1))
    if not len(which):
        return which
    points = samples.points_by_x
    normals = {
        node: _normal(grid.nodes[node], AROUND_END * desired[node], points) for node in set(grid.edges[which].flat)
    }
    for member in which.tolist():
        one, other = grid.edges[member]
        way = (grid.nodes[other] - grid.nodes[one]) / np.linalg.norm(grid.nodes[other] - grid.nodes[one])
        doubted[member] = max(abs(normals[one] @ way), abs(normals[other] @ way)) > STEEP_MEMBER_SINE
    return np.flatnonzero(_hangs(grid, doubted, uses))


@dataclass(frozen=True, eq=False)
class PointedNodes:
    """Nodes whose members leave to one side, as at the tip of a pyramid, and those of their members that cross empty space."""

    axes: np.ndarray  #: (V, 3) mean of the unit vectors along the members of each node of the grid
    uses: np.ndarray  #: (V,) members at each node
    node: np.ndarray  #: (K,) pointed node of each such member
    foot: np.ndarray  #: (K,) its other end
    ways: np.ndarray  #: (K, 3) unit vector from the node to the foot

    def mostly(self, chosen: np.ndarray) -> np.ndarray:
        """Return the nodes (N,) of which enough of all members are chosen ones (K,) bool."""
        count = np.bincount(self.node[chosen], minlength=len(self.uses))
        return np.flatnonzero((count >= FEWEST_MEMBERS) & (2 * count >= self.uses))


def axes_of_nodes(grid: Grid) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return the ends of all members, each way (2 E, 2), the unit vectors along them (2 E, 3), how many a node has and their mean."""
    ends = np.concatenate([grid.edges, grid.edges[:, ::-1]])
    ways = grid.nodes[ends[:, 1]] - grid.nodes[ends[:, 0]]
    ways /= np.maximum(np.linalg.norm(ways, axis=1), 1e-300)[:, None]
    uses = np.maximum(np.bincount(ends[:, 0], minlength=len(grid.nodes)), 1)
    axes = np.stack([np.bincount(ends[:, 0], ways[:, k], len(grid.nodes)) for k in range(3)], axis=1) / uses[:, None]
    return ends, ways, uses, axes


def _pointed_nodes(grid: Grid, samples: SurfaceSamples, desired: np.ndarray, steep: float) -> PointedNodes:
    """Return the nodes within a grid whose mean unit vector along members (V, 3) is longer than `steep`."""
    ends, ways, uses, axes = axes_of_nodes(grid)
    pointed = np.linalg.norm(axes, axis=1) > steep
    pointed[grid.edges[grid.edge_triangles[:, 1] < 0]] = False
    which = np.flatnonzero(pointed[ends[:, 0]])
    if len(which):
        least = np.maximum(LITTLE_EMPTY * desired[ends[which, 0]], SPACINGS_LITTLE_EMPTY * samples.spacing)
        which = which[_middles_away(grid, samples, which % len(grid.edges), desired) > least]
    node, foot = ends[which].T
    return PointedNodes(axes, uses, node, foot, ways[which])


def _spikes(grid: Grid, samples: SurfaceSamples, desired: np.ndarray, steep: float, even: float) -> np.ndarray:
    """Return the nodes (K,) that lie off an even sheet, from which most of their members leave for them, beside points.

    steep : sine of the angle between such a member and the sheet, least
    even : cosine of the angle between the spike and the normals of the sheet, least
    """
    tips = _pointed_nodes(grid, samples, desired, steep)
    if not len(tips.node):
        return tips.node
    points = samples.points_by_x
    found, of = np.unique(tips.foot, return_inverse=True)
    normals = np.array([_normal(grid.nodes[k], AROUND_END * desired[k], points) for k in found]).reshape(-1, 3)[of]
    axes = tips.axes[tips.node]
    leaves = abs((normals * tips.ways).sum(axis=1)) > steep
    leaves &= abs((normals * axes).sum(axis=1)) > even * np.linalg.norm(axes, axis=1)
    return tips.mostly(leaves)


def _on_masts(grid: Grid, samples: SurfaceSamples, desired: np.ndarray) -> np.ndarray:
    """Return the nodes (K,) far up or down a mast or a column from where the sheet meets it, most of whose members cross empty space."""
    tips = _pointed_nodes(grid, samples, desired, 0.0)
    nodes = tips.mostly(np.ones(len(tips.node), np.bool_))
    if not len(nodes):
        return nodes
    points, normals = samples.points_by_x, normals_at_nodes(grid)
    off = [_is_off_along(grid.nodes[node], normals[node], desired[node], points) for node in nodes]
    return nodes[np.array(off)]


def _is_off_along(place: np.ndarray, normal: np.ndarray, length: float, points: np.ndarray) -> bool:
    """Whether a place lies on a mast that stands across the sheet, and well over or under the edge of the sheet around that.

    Parameters
    ----------
    normal : (3,) of the grid there
    length : desired member length there [scan unit]
    points : (N, 3), by ascending x
    """
    around = points_within(place, AROUND_ON_MAST * length, points)
    if len(around) < FEWEST_AT_END:
        return False
    variances, axes = np.linalg.eigh(np.cov(around.T))
    axis = axes[:, 2]
    if variances[1] > THIN_ON_MAST * variances[2] or abs(axis @ normal) < LEAST_MAST_COSINE:
        return False
    beside = points_within(place, 2.0 * BESIDE_MAST * length, points) - around.mean(axis=0)
    height = beside @ axis
    level = np.sqrt(np.maximum((beside**2).sum(axis=1) - height**2, 0.0))
    own = WIDTHS_OF_MAST * math.sqrt(variances[1])
    sheet = (level > own) & (level < BESIDE_MAST * length)
    if sheet.sum() < FEWEST_AT_END:
        return True
    edge = height[sheet & (level < level[sheet].min() + EDGE_AT_MAST * length)]
    here = float((place - around.mean(axis=0)) @ axis)
    return bool(np.abs(edge - here).min() > OFF_ALONG_MAST * length)


def _middles_away(grid: Grid, samples: SurfaceSamples, which: np.ndarray, desired: np.ndarray) -> np.ndarray:
    """Return the distance of the middle of each of some members (K,) from the nearest point (K,)."""
    middles = grid.nodes[grid.edges[which]].mean(axis=1)
    return nearest_point_distances(middles, samples, float(desired.mean()))


def _hangs(grid: Grid, chosen: np.ndarray, uses: np.ndarray) -> np.ndarray:
    """Return at which nodes (V,) bool enough of all members (V,) are chosen (E,) bool."""
    count = np.bincount(grid.edges[chosen].ravel(), minlength=len(uses))
    enough: np.ndarray = (count >= FEWEST_MEMBERS) & (2 * count >= uses)
    return enough


def _normal(place: np.ndarray, reach: float, points: np.ndarray) -> np.ndarray:
    """Return the normal (3,) of the surface of the points by ascending x (N, 3) around a place, (0, 0, 0) where they form none."""
    around = points_within(place, reach, points)
    if len(around) < FEWEST_AT_END:
        return np.zeros(3)
    variances, axes = np.linalg.eigh(np.cov(around.T))
    normal: np.ndarray = axes[:, 0] if variances[0] < FLAT_AT_END * variances[1] else np.zeros(3)
    return normal
