"""Working mesh: a grid opened for the kernels, on the scanned surface and its boundary curves."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..constraints.network import NO_LINES, Lines
from ..errors import FrontError
from ..grid.grid import Grid
from ..kernels.boundary.curves import Curves
from ..kernels.mesh import grid as kernels
from ..kernels.mesh import point_location
from ..kernels.mesh.grid import AT_REST, LOCKED, ON_CURVE, Net
from ..kernels.mesh.projection import project_nodes
from ..kernels.surface.local_surface import SURFACE_PATCH, Surface
from ..runtime.parallel import in_parts
from ..surface.samples import is_graded
from ..surface.scratch import with_own_scratch
from .sliding_nodes import find_on_lines, inner_lines, joined

NEAR_IN_THE_END = 0.25  # largest distance of a node from the centre of its patch in the end [member lengths]
LENGTH_WEIGHT = 1.0  # weight of the lengths of members against the shapes of triangles
WEIGHT_OF_LONGER_SEARCH = 8.0  # the same in the longer search of a grid that passes
FOLDS_OF_LONGER_SEARCH = 0.2  # weight of the distances from folds there
NODES_PER_THREAD = 300  # fewest nodes worth a thread of their own
PROJECTION_PARTS = 3  # parts per thread in projection, as nodes at the boundary take less time
LARGEST_DEGREE = 12  # most neighbours of a node while the grid is improved, unless it had more
LARGEST_DEGREE_WITH_LINES = 60  # most neighbours of a node in a grid with lines, which are bits of an integer

#: a grid but for where it lies, and the node of the net that each of its nodes is (V,)
Closed = tuple[Grid, np.ndarray]


def open_net(grid: Grid) -> tuple[Net, np.ndarray]:
    """Open a grid: return it as rings of neighbours.

    A node whose triangles form several fans becomes several nodes of the net; these and the nodes of seams (edges inside the grid
    without two triangles of one orientation) are LOCKED. Boundary nodes, fixed nodes and those of lines are AT_REST.

    Returns
    -------
    Net
    (C,) int64 : node of the grid that each node of the net stands for, -1 for none
    """
    count = len(grid.nodes)
    corner_node, partner = _half_edges(grid.triangles, count)
    valence = int(np.bincount(grid.edges.ravel(), minlength=1).max()) if len(grid.edges) else 0
    most = count + int((partner < 0).sum())  # every further fan of a node is open
    capacity = most + len(grid.triangles) // 4 + 64
    net = Net(
        nodes=np.zeros((capacity, 3)),
        ring=np.zeros((capacity, max(LARGEST_DEGREE, valence + 2)), np.int64),
        **{name: np.zeros(capacity, np.int64) for name in ("degree", "is_open", "kind", "ideal", "line")},
        curve=np.full(capacity, -1),
        arc=np.zeros(capacity),
        free=np.zeros(capacity, np.int64),
        spare=np.zeros(1, np.int64),
        in_use=np.zeros(1, np.int64),
        desired=np.ones(capacity),
    )
    if len(grid.lines) and net.ring.shape[1] > LARGEST_DEGREE_WITH_LINES:
        raise FrontError(f"a node came out with {valence} members", grid)
    source = np.full(capacity, -1, np.int64)
    fan, first = np.full(len(corner_node), -1, np.int64), np.empty(capacity, np.int64)
    used = kernels.fill_rings(corner_node, partner, fan, first, net.ring, net.degree, net.is_open, source, count)
    net.nodes[:used] = grid.nodes[source[:used]]
    spare = np.arange(capacity - 1, used - 1, -1)
    net.free[: len(spare)] = spare
    net.spare[0], net.in_use[0] = len(spare), used
    net.kind[:used][net.is_open[:used] == 1] = AT_REST
    net.kind[:count][grid.fixed] = AT_REST
    several = np.bincount(source[:used], minlength=count) > 1
    ring = np.sort(np.where(np.arange(net.ring.shape[1]) < net.degree[:used, None], net.ring[:used], -1), axis=1)
    twice = ((ring[:, 1:] == ring[:, :-1]) & (ring[:, 1:] >= 0)).any(axis=1)
    for a, b in inner_lines(grid).tolist():
        for v, u in ((a, b), (b, a)):
            kernels.mark_line(net, v, u)
            net.kind[v] = AT_REST
    net.kind[:used][several[source[:used]] | twice] = LOCKED
    return net, source


def close_net(net: Net, source: np.ndarray, grid: Grid) -> Grid:
    """Close a net: return it as a grid, with all else as in `grid`; nodes without a triangle are dropped."""
    return join_again(net, source, grid)[0]


def join_again(net: Net, source: np.ndarray, grid: Grid) -> Closed:
    """Close a net: return it as a grid, and the node of the net that each node of that stands for (V,)."""
    used = net.used
    room = np.empty((int(net.degree[:used].sum()) + 1, 3), np.int64)
    triangles = room[: kernels.list_triangles(net, room)]
    merged = np.where(source[:used] >= 0, source[:used], np.arange(used))
    kept, inverse = np.unique(merged[triangles], return_inverse=True)
    closed = grid.replace(
        nodes=net.nodes[kept],
        triangles=inverse.reshape(-1, 3).astype(np.int64),
        fixed=np.append(grid.fixed, np.zeros(used, np.bool_))[kept],
        lines=_lines_of(net, merged, kept),
        deviation=None,
        desired=None,
    )
    return closed, kept


def _lines_of(net: Net, merged: np.ndarray, kept: np.ndarray) -> np.ndarray:
    """Return the members of lines (K, 2) between the nodes kept, the lower node first, sorted."""
    pairs = set()
    for v in np.flatnonzero((net.line[: net.used] != 0) & (net.degree[: net.used] > 0)).tolist():
        for i, u in enumerate(net.ring[v, : net.degree[v]].tolist()):
            if net.line[v] >> i & 1:
                pairs.add(tuple(sorted(np.searchsorted(kept, merged[[v, u]]).tolist())))
    return np.array(sorted(pairs), np.int64).reshape(-1, 2)


class Kept(NamedTuple):
    """A working mesh as it was."""

    net: Net
    patches: np.ndarray  #: (C,) SURFACE_PATCH
    fixed: np.ndarray  #: (C,) bool
    projection_distance: np.ndarray  #: (C,)


@dataclass(frozen=True, eq=False)
class WorkingMesh:
    """What the improvement works on: the net, the scan under it and its boundary curves."""

    net: Net
    source: np.ndarray  #: (C,) int64 node of the grid that each node of the net stands for, -1 for a new one
    surface: Surface
    patches: np.ndarray  #: (C,) SURFACE_PATCH, local surface of each node
    fixed: np.ndarray  #: (C,) bool, nodes at fixed positions
    curves: Curves
    length: float  #: desired member length where the length field is 1 [scan unit]
    projection_distance: np.ndarray  #: (C,) from the scan; NaN before projection and over closed holes [scan unit]
    sharp: np.ndarray  #: (N,) bool, which of the curves are ridges, which the local surface rounds off
    folds: float  #: weight of the distances of nodes and members from the folds of the scan
    #: weight of the lengths of members against the shapes of triangles, until the last sweeps
    length_weight: float = LENGTH_WEIGHT

    @classmethod
    def from_grid(
        cls,
        grid: Grid,
        surface: Surface,
        curves: Curves,
        corners: np.ndarray,
        length: float,
        lines: Lines = NO_LINES,
        folds: float = 0.0,
    ) -> WorkingMesh:
        """Open a grid and locate its nodes on the scan, its boundary curves and lines.

        Nodes of the boundary and of lines slide along the nearest curve; corners, ends and crossings of lines and nodes far from all
        curves stay at rest.

        Parameters
        ----------
        grid : Grid
        surface : Surface
        curves : Curves
        corners : (K, 3) float64 corners of the boundary [scan unit]
        length : desired member length [scan unit]
        lines : the lines that the grid was made with
        folds : weight of the distances of nodes and members from the folds of the scan
        """
        net, source = open_net(grid)
        curves = Curves(*(np.ascontiguousarray(array) for array in curves))
        fixed = np.zeros(len(net.degree), np.bool_)
        fixed[: len(grid.fixed)] = grid.fixed
        point_location.locate_on_boundary(net, curves, np.ascontiguousarray(corners).reshape(-1, 3), fixed, length)
        sharp = np.zeros(len(curves.total), np.bool_)
        if len(lines.curves):
            find_on_lines(net, lines, len(curves.total), fixed, length)
            curves, sharp = joined(curves, lines.arrays), np.concatenate([sharp, lines.sharp])
        patches = np.zeros(len(net.degree), SURFACE_PATCH)
        queue, located = np.zeros((2, len(net.degree)), np.int64)
        point_location.locate_nodes(net, surface, patches, length, queue, located)
        mesh = cls(net, source, surface, patches, fixed, curves, length, np.full(len(patches), np.nan), sharp, folds)
        mesh.renew(0.0)
        return mesh

    def for_longer_search(self) -> WorkingMesh:
        """The same mesh, which shares its arrays, for a search in which lengths and the folds of the scan count for more.

        Between the chains of ridges members are too long or too short where triangles are still in shape; and a longer search would
        move away from folds.
        """
        folds = max(self.folds, FOLDS_OF_LONGER_SEARCH)
        mesh = replace(self, length_weight=WEIGHT_OF_LONGER_SEARCH, folds=folds)
        mesh.renew(0.0)
        return mesh

    def project_onto_scan(self, fine: Surface, middle: Surface, broad: Surface, *, boundary: bool) -> None:
        """Project each node onto the scanned surface by patches as narrow as possible, except fixed nodes and those of ridges.

        boundary : project the nodes of the boundary too
        """
        self.projection_distance[:] = 0.0
        stay = self.fixed | self._on_ridge()
        if not boundary:
            stay |= self.net.is_open == 1

        def project_part(part: int, begin: int, end: int) -> None:
            own = self._scratch(part)
            narrow, wider, widest = (
                each._replace(stamp=own.stamp, queue=own.queue, counter=own.counter) for each in (fine, middle, broad)
            )
            project_nodes(
                self.net, narrow, wider, widest, self.patches, stay, self.projection_distance, self.folds, begin, end
            )

        in_parts(self.net.used, NODES_PER_THREAD // PROJECTION_PARTS, project_part, PROJECTION_PARTS)

    @cached_property
    def graded(self) -> bool:
        """Whether the desired length differs from node to node."""
        return is_graded(self.surface)

    def _on_ridge(self) -> np.ndarray:
        """Which nodes slide on a ridge or lie at an end of one, (C,) bool."""
        net, stay = self.net, np.zeros(len(self.fixed), np.bool_)
        if self.sharp.any():
            sliding = (net.degree > 0) & (net.line != 0) & (net.kind == ON_CURVE)
            stay[sliding] = self.sharp[net.curve[sliding]]
            for v in np.flatnonzero(stay).tolist():
                stay[[u for u in net.ring[v, : net.degree[v]].tolist() if kernels.is_line(net, v, u)]] = True
        return stay

    def name_distances(self, measured: int) -> None:
        """Set the distance from the scan to NaN for nodes over closed holes, whose sample is not one of the first `measured`."""
        self.projection_distance[self.patches["sample"] >= measured] = np.nan

    def _scratch(self, part: int) -> Surface:
        """The scan with scratch arrays of one thread."""
        if part not in self._scans:
            self._scans[part] = self.surface if part == 0 else with_own_scratch(self.surface)
        return self._scans[part]

    @cached_property
    def _scans(self) -> dict[int, Surface]:
        return {}

    def renew(self, near: float) -> None:
        """Fit new patches to nodes farther than `near` lengths from the centre of theirs, and update their desired lengths."""

        def renew_part(part: int, begin: int, end: int) -> None:
            surface = self._scratch(part)
            point_location.renew_patches(self.net, surface, self.patches, near * self.length, self.folds, begin, end)
            if self.graded:
                point_location.renew_lengths(self.net, surface, self.patches, begin, end)

        in_parts(self.net.used, NODES_PER_THREAD, renew_part)

    def return_to_scan(self, near: float) -> None:
        """Return the nodes to the scan and the boundary curves, by patches centred within `near` lengths."""
        self.renew(near)
        point_location.return_to_scan(self.net, self.patches, self.curves, 0.5 * self.length)

    def deviation(self) -> np.ndarray:
        """Distance of each node of the net from the scan around it, (C,) [scan unit]."""
        if not np.isnan(self.projection_distance).all():
            return self.projection_distance
        values = np.zeros(len(self.net.degree))
        self.renew(0.05)
        point_location.distances_from_scan(self.net, self.patches, values)
        return values

    def copy(self) -> WorkingMesh:
        """The same mesh, which can be changed beside this one."""
        return replace(self, surface=with_own_scratch(self.surface), **self.copied()._asdict())

    def copied(self) -> Kept:
        """A copy of what trials change."""
        net = Net(*(array.copy() for array in self.net))
        return Kept(net, self.patches.copy(), self.fixed.copy(), self.projection_distance.copy())

    def restore(self, kept: Kept) -> None:
        """Put the mesh back to a copy."""
        own = *self.net, self.patches, self.fixed, self.projection_distance
        for array, value in zip(own, (*kept.net, *kept[1:]), strict=True):
            array[:] = value

    def close(self, grid: Grid) -> Closed:
        """Close the net, with all else as in `grid`, and compute its topology."""
        closed, kept = join_again(self.net, self.source, grid.replace(fixed=self.fixed))
        _ = closed.topology, closed.edge_triangles
        return closed, kept

    def to_grid(self, grid: Grid, closed: Closed | None = None) -> Grid:
        """Close the net, with all else as in `grid`, unless it was `closed` already, and measure the deviation."""
        deviation = self.deviation()
        again, kept = closed or join_again(self.net, self.source, grid.replace(fixed=self.fixed))
        desired = self.length * self.net.desired[kept] if self.graded else None
        return again.replace(nodes=self.net.nodes[kept], deviation=deviation[kept], desired=desired)


def _half_edges(triangles: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the node of each corner (3 T,) and the half-edge opposite to each half-edge (3 T,), -1 where there is none.

    Half-edge 3 t + k runs from corner k of triangle t to the next. Two are opposite if they are the only ones on their edge and
    run in opposite directions; the grid is cut along all other edges.
    """
    start = np.ascontiguousarray(triangles).reshape(-1).copy()
    end = np.ascontiguousarray(triangles[:, [1, 2, 0]]).reshape(-1)
    key = np.minimum(start, end) * count + np.maximum(start, end)
    order = np.argsort(key, kind="stable")
    ordered = key[order]
    new = np.ones(len(key), bool)
    new[1:] = ordered[1:] != ordered[:-1]
    first = np.flatnonzero(new)
    pairs = first[np.diff(np.append(first, len(key))) == 2]
    a, b = order[pairs], order[pairs + 1]
    opposite = start[a] == end[b]
    a, b = a[opposite & (start[a] != end[a])], b[opposite & (start[a] != end[a])]
    partner = np.full(len(key), -1, np.int64)
    partner[a], partner[b] = b, a
    return start, partner


@contextmanager
def at_rest(net: Net, which: np.ndarray) -> Iterator[None]:
    """Let some nodes of a net (C,) bool stay where they are for a while."""
    moving = which & (net.degree > 0) & (net.kind < AT_REST)
    kinds = net.kind[moving]
    net.kind[moving] = AT_REST
    try:
        yield
    finally:
        net.kind[moving] = kinds
