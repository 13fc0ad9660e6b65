"""The tables that follow from the nodes and triangles of a grid."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from ..kernels.mesh import figures
from .panels import corner_angles_of, loops_of, panel_of_triangles, sides_of


class GridTables:
    """Edges, boundary loops, lengths and angles of a grid, each computed when it is first asked for."""

    nodes: np.ndarray  #: (V, 3) float64 [scan unit]
    triangles: np.ndarray  #: (T, 3) int64, anticlockwise seen from outside
    panels: (
        np.ndarray | None
    )  #: (P, K) int64 nodes of panels of more than three, filled up with -1; None: the triangles are the panels
    lines: np.ndarray  #: (K, 2) members along fixed lines, ridges
    deviation: np.ndarray | None  #: (V,) distance of each node from the scan, NaN over closed holes [scan unit]
    desired: np.ndarray | None  #: (V,) desired member length at each node, where it is not the same for all [scan unit]
    unit: str
    origin: np.ndarray  #: (3,) [scan unit]

    @cached_property
    def _half_edges(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        ends = np.concatenate([self.triangles[:, [0, 1]], self.triangles[:, [1, 2]], self.triangles[:, [2, 0]]])
        low, high = ends.min(axis=1), ends.max(axis=1)
        key = low * max(len(self.nodes), 1) + high
        _, first, inverse = np.unique(key, return_index=True, return_inverse=True)
        return ends, np.stack([low[first], high[first]], axis=1), inverse.ravel()

    @property
    def measured_deviation(self) -> np.ndarray:
        """(K,) distances from the scan of all nodes that are not over closed holes; none before they are measured."""
        return np.zeros(0) if self.deviation is None else self.deviation[~np.isnan(self.deviation)]

    @cached_property
    def _member_of_side(self) -> np.ndarray:
        """(S,) the member that each side of a triangle is, -1 for a diagonal of a panel."""
        ends = self._half_edges[1]
        if self.panels is None:
            return np.arange(len(ends))
        count = max(len(self.nodes), 1)
        low, high = np.sort(sides_of(self.panels), axis=1).T
        found = np.isin(ends[:, 0] * count + ends[:, 1], low * count + high)
        return np.where(found, np.cumsum(found) - 1, -1)

    @property
    def triangulated(self) -> GridTables:
        """The same surface with each side of a triangle as an edge, also the diagonals of panels."""
        return self if self.panels is None else self._with_diagonals

    @cached_property
    def _with_diagonals(self) -> GridTables:
        return _Triangulated(self)

    @cached_property
    def panel_loops(self) -> list[list[int]]:
        """The nodes of each panel, anticlockwise seen from outside."""
        loops: list[list[int]] = self.triangles.tolist() if self.panels is None else loops_of(self.panels)
        return loops

    @property
    def panel_table(self) -> np.ndarray:
        """(P, K) the nodes of each panel, filled up with -1."""
        return self.triangles if self.panels is None else self.panels

    @cached_property
    def corner_angles(self) -> np.ndarray:
        """(P, K) the angle of each panel at each of its nodes, NaN where it has none [degree]."""
        return self.angles if self.panels is None else corner_angles_of(self.nodes, self.panels)

    @cached_property
    def half_edge_edges(self) -> np.ndarray:
        """(3 T,) the member at each half-edge, -1 for a diagonal of a panel; half-edge k of triangle t stands at k T + t."""
        return self._half_edges[2] if self.panels is None else self._member_of_side[self._half_edges[2]]

    @cached_property
    def edge_uses(self) -> np.ndarray:
        """(E,) the number of panels at each member."""
        return np.bincount(self.half_edge_edges[self.half_edge_edges >= 0], minlength=len(self.edges))

    @cached_property
    def edge_on_line(self) -> np.ndarray:
        """(E,) bool, the members along fixed lines and ridges."""
        count = max(len(self.nodes), 1)
        low, high = np.sort(self.lines, axis=1).T
        found: np.ndarray = np.isin(self.edges[:, 0] * count + self.edges[:, 1], low * count + high)
        return found

    @property
    def edges(self) -> np.ndarray:
        """(E, 2) the members, smaller node first, sorted."""
        return self._half_edges[1] if self.panels is None else self._half_edges[1][self._member_of_side >= 0]

    @property
    def members(self) -> np.ndarray:
        """(E, 2) the members as pairs of nodes: another name of `edges`."""
        return self.edges

    @property
    def scan_nodes(self) -> np.ndarray:
        """(V, 3) float64 the nodes in the scan's own frame, `nodes` + `origin` [scan unit]."""
        return np.asarray(self.nodes, np.float64).reshape(-1, 3) + np.asarray(self.origin, np.float64)

    @cached_property
    def edge_triangles(self) -> np.ndarray:
        """(E, 2) the triangles at each member, -1 where the boundary is; (E, 2) needs a manifold grid."""
        _, sides, inverse = self._half_edges
        triangle = np.tile(np.arange(len(self.triangles)), 3)
        order = np.argsort(inverse, kind="stable")
        count = np.bincount(inverse, minlength=len(sides))
        start = np.cumsum(count) - count
        table = np.full((len(sides), 2), -1, np.int64)
        used = count > 0
        table[used, 0] = triangle[order[start[used]]]
        two = count > 1
        table[two, 1] = triangle[order[start[two] + 1]]
        return table if self.panels is None else table[self._member_of_side >= 0]

    @cached_property
    def edge_panels(self) -> np.ndarray:
        """(E, 2) the panels at each member, -1 where the boundary is."""
        if self.panels is None:
            return self.edge_triangles
        owner = np.append(panel_of_triangles(self.panels), -1)
        return owner[self.edge_triangles]

    @cached_property
    def panel_members(self) -> np.ndarray:
        """(P, K) the member at each side of each panel, from its node k to the next, -1 where it has none."""
        if self.panels is None:
            return self.half_edge_edges.reshape(3, -1).T
        table = self.panel_table
        sides, count = np.sort(sides_of(table), axis=1), max(len(self.nodes), 1)
        found = np.full(table.shape, -1)
        keys = np.sort(self.edges, axis=1) @ [count, 1]
        order = np.argsort(keys, kind="stable")
        found[table >= 0] = order[np.searchsorted(keys[order], sides @ [count, 1])]
        return found

    @cached_property
    def boundary_loops(self) -> list[np.ndarray]:
        """Ordered node ids of each boundary loop, in the direction of its triangles."""
        ends, _, inverse = self._half_edges
        single = np.bincount(inverse)[inverse] == 1
        following: dict[int, list[int]] = {}
        for a, b in ends[single].tolist():
            following.setdefault(a, []).append(b)
        loops = []
        for start in sorted(following):
            while following.get(start):
                loop, node = [start], following[start].pop()
                while node != start and following.get(node):
                    loop.append(node)
                    node = following[node].pop()
                loops.append(np.array(loop, np.int64))
        return loops

    @cached_property
    def lengths(self) -> np.ndarray:
        """(E,) length of each member [scan unit]."""
        return np.linalg.norm(self.nodes[self.edges[:, 0]] - self.nodes[self.edges[:, 1]], axis=1)

    @cached_property
    def angles(self) -> np.ndarray:
        """(T, 3) angle of each triangle at each of its nodes [degree]."""
        angles = np.empty((len(self.triangles), 3))
        figures.angles_of_triangles(self.nodes, self.triangles, angles)
        return angles

    def stretches(self, length: float) -> np.ndarray:
        """(E,) length of each member over the desired one: the mean of that at its nodes, or `length` where it is the same for all."""
        if self.desired is None:
            return self.lengths / length
        return self.lengths / self.desired[self.edges].mean(axis=1)


class _Triangulated(GridTables):
    """The triangles of a grid of other panels."""

    def __init__(self, grid: GridTables) -> None:
        self.nodes, self.triangles, self.lines = grid.nodes, grid.triangles, grid.lines
        self.deviation, self.desired, self.unit, self.origin = grid.deviation, grid.desired, grid.unit, grid.origin
        self.panels = None
