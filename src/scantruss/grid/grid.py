"""Grid: nodes, triangles and the tables that follow from them."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from ..settings import Settings
    from .certificate import Certificate
    from .quality import GridQuality, Topology


PROVENANCE = {"settings", "before", "certificate", "seconds"}  # fields that no figure of a grid depends on
OF_TRIANGLES = {  # what follows from the triangles alone
    "_half_edges", "edge_uses", "edge_triangles", "boundary_loops", "topology",
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Grid:
    """A triangular grid truss: its nodes lie on the scan, its edges are the members."""

    nodes: np.ndarray  #: (V, 3) float64 [scan unit], relative to `origin`
    triangles: np.ndarray  #: (T, 3) int64, anticlockwise seen from outside
    fixed: np.ndarray  #: (V,) bool, nodes at positions that the user appointed
    origin: np.ndarray  #: (3,) float64 [scan unit]
    unit: str = ""  #: mm, cm, m, inch, foot, or "" where it is not known
    lines: np.ndarray = field(
        default_factory=lambda: np.zeros((0, 2), np.int64)
    )  #: (K, 2) members along fixed lines, ridges
    deviation: np.ndarray | None = None  #: (V,) distance of each node from the scan, NaN over closed holes [scan unit]
    desired: np.ndarray | None = (
        None  #: (V,) desired member length at each node, where it is not the same for all [scan unit]
    )
    settings: Settings | None = None  #: what the grid was made with
    before: GridQuality | None = None  #: quality before the optimization (Table 2)
    certificate: Certificate | None = None  #: what was checked against the scan
    seconds: dict[str, float] = field(default_factory=dict)  #: time of each stage [s]; never written with the grid

    def __repr__(self) -> str:
        """Say what it is made of, not every number."""
        unit = f" {self.unit}" if self.unit else ""
        length = f" of {self.lengths.mean():.4g}{unit}" if len(self.edges) else ""
        return (
            f"Grid({len(self.nodes):,} nodes, {len(self.edges):,} members{length}, {len(self.triangles):,} triangles)"
        )

    def replace(self, **changes: Any) -> Grid:
        """Return a copy with some fields changed; a certificate holds only for the nodes and triangles it was made of.

        What has been measured goes along where it is the same.
        """
        if not changes.keys().isdisjoint(("nodes", "triangles", "fixed", "origin")):
            changes = {"certificate": None, **changes}
        copy = replace(self, **changes)
        known = {name: value for name, value in vars(self).items() if name not in vars(copy)}
        if changes.keys() <= PROVENANCE:
            vars(copy).update(known)
        elif "triangles" not in changes and len(copy.nodes) == len(self.nodes):
            vars(copy).update({name: known[name] for name in OF_TRIANGLES & known.keys()})
        return copy

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

    @property
    def half_edge_edges(self) -> np.ndarray:
        """(3 T,) the edge of each half-edge; half-edge k of triangle t (from its node k on) stands at k T + t."""
        return self._half_edges[2]

    @cached_property
    def edge_uses(self) -> np.ndarray:
        """(E,) the number of triangles at each member."""
        return np.bincount(self.half_edge_edges, minlength=len(self.edges))

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
        return self._half_edges[1]

    @cached_property
    def edge_triangles(self) -> np.ndarray:
        """(E, 2) the triangles at each member, -1 where the boundary is; (E, 2) needs a manifold grid."""
        _, edges, inverse = self._half_edges
        triangle = np.tile(np.arange(len(self.triangles)), 3)
        order = np.argsort(inverse, kind="stable")
        count = self.edge_uses
        start = np.cumsum(count) - count
        table = np.full((len(edges), 2), -1, np.int64)
        table[:, 0] = triangle[order[start]]
        two = count > 1
        table[two, 1] = triangle[order[start[two] + 1]]
        return table

    @cached_property
    def boundary_loops(self) -> list[np.ndarray]:
        """Ordered node ids of each boundary loop, in the direction of its triangles."""
        ends, _, inverse = self._half_edges
        single = self.edge_uses[inverse] == 1
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
        from .quality import corner_angles

        return corner_angles(self.nodes, self.triangles)

    def stretches(self, length: float) -> np.ndarray:
        """(E,) length of each member over the desired one: the mean of that at its nodes, or `length` where it is the same for all."""
        if self.desired is None:
            return self.lengths / length
        return self.lengths / self.desired[self.edges].mean(axis=1)

    @cached_property
    def quality(self) -> GridQuality:
        """The figures of Table 2 and more."""
        from .quality import measure_quality

        return measure_quality(self)

    @cached_property
    def topology(self) -> Topology:
        """Components, boundary loops, Euler number, manifold, orientable."""
        from .quality import measure_topology

        return measure_topology(self)
