"""Quads on the scan while they are improved."""

from __future__ import annotations

import numpy as np

from ..grid.grid import Grid
from ..grid.panels import triangles_of
from ..improve.working_mesh import WorkingMesh
from ..kernels.cells.quads import energy_of_quads, settle_quads, try_quads
from ..kernels.mesh.grid import INTERIOR, ON_CURVE
from ..kernels.surface.local_surface import CENTRE, NEAREST_SAMPLE, fit_patch
from .fine_mesh import ALONG, AT_REST_THERE, FREE

QUAD_LENGTHS, QUAD_ANGLES = 3.0, 0.5  # weights of lengths and of angles in the energy
QUAD_RELAXATION = 1.5  # over-relaxation
GAIN_AT_REST = 2e-5  # gain of energy a node in a sweep below which nodes have settled


class QuadMesh:
    """Quads, the quads at each node, and where each node lies on the scan and the curves."""

    def __init__(self, mesh: WorkingMesh, quads: np.ndarray, chains: np.ndarray) -> None:
        net, count = mesh.net, mesh.net.used
        room = count + max(count // 2, 64)
        self.surface, self.curves, self.length = mesh.surface, mesh.curves, mesh.length
        self.nodes = _room(net.nodes[:count], room)
        kind = net.kind[:count]
        self.held = _room(np.where(kind == INTERIOR, FREE, np.where(kind == ON_CURVE, ALONG, AT_REST_THERE)), room)
        self.curve, self.arc = _room(net.curve[:count], room), _room(net.arc[:count], room)
        self.patches = _room(mesh.patches[:count], room)
        self.desired = _room(mesh.length * net.desired[:count], room)
        self.fixed = _room(mesh.fixed[:count], room)
        self.free = list(range(room - 1, count - 1, -1))
        self.quads: list[list[int]] = quads.tolist()
        self.at: list[set[int]] = [set() for _ in range(room)]
        for q, corners in enumerate(self.quads):
            for v in corners:
                self.at[v].add(q)
        self.degree = np.array([len(each) for each in self.at], np.int64)
        self.chains = {tuple(sorted(pair)) for pair in chains.tolist()}

    def live(self) -> np.ndarray:
        """Return the quads that are there (Q, 4)."""
        return np.array([corners for corners in self.quads if corners], np.int64)

    def shares(self, quads: np.ndarray) -> np.ndarray:
        """Return the weight of each side of all quads (Q, 4)."""
        count, (start, end) = len(self.nodes), (quads, np.roll(quads, -1, axis=1))
        twice = np.isin(start * count + end, end * count + start)
        return np.where(twice, 0.5, 1.0)

    def settle(
        self,
        sweeps: int,
        lengths: float = QUAD_LENGTHS,
        angles: float = QUAD_ANGLES,
        stride: float = QUAD_RELAXATION,
        enough: float = GAIN_AT_REST,
    ) -> None:
        """Move all nodes downhill."""
        quads = self.live()
        some = np.unique(quads)
        self.settle_some(quads, some[self.held[some] != AT_REST_THERE], sweeps, lengths, angles, stride, enough)

    def settle_some(
        self, quads: np.ndarray, some: np.ndarray, sweeps: int, lengths: float = QUAD_LENGTHS, angles: float = QUAD_ANGLES,
        stride: float = QUAD_RELAXATION, enough: float = GAIN_AT_REST, share: np.ndarray | None = None,
    ) -> None:  # fmt: skip
        """Move some nodes downhill; all quads at them must be among those given."""
        share = self.shares(quads) if share is None else share
        flat = quads.ravel()
        order = np.argsort(flat, kind="stable")
        begin = np.searchsorted(flat[order], some)
        end = np.searchsorted(flat[order], some, side="right")
        start = np.concatenate([[0], np.cumsum(end - begin)])
        of = (
            np.concatenate([order[b:e] for b, e in zip(begin.tolist(), end.tolist(), strict=True)]) // 4
            if len(some)
            else np.zeros(0, np.int64)
        )
        settle_quads(
            self.nodes, quads, share, of, start, some, self.held, self.curve, self.arc, self.patches, self.curves,
            self.desired, lengths, angles, sweeps, stride, enough,
        )  # fmt: skip

    def energies(
        self,
        quads: np.ndarray,
        share: np.ndarray | None = None,
        lengths: float = QUAD_LENGTHS,
        angles: float = QUAD_ANGLES,
    ) -> np.ndarray:
        """Return the energy of each quad (Q,)."""
        out = np.zeros(len(quads))
        share = self.shares(quads) if share is None else share
        energy_of_quads(self.nodes, quads, share, self.patches, self.desired, lengths, angles, out)
        return out

    def try_quads(
        self, before: list[list[int]], after: list[list[int]], at_boundary: np.ndarray, sweeps: int, join: int = -1, joined: int = -1
    ) -> float:  # fmt: skip
        """Return by how much the energy grows where some quads replace others; the nodes around stay where they have settled."""
        grown: float = try_quads(
            self.nodes, np.array(before), np.array(after), self.degree, at_boundary, self.held, self.curve, self.arc, self.patches,
            self.curves, self.desired, QUAD_LENGTHS, QUAD_ANGLES, sweeps, QUAD_RELAXATION, GAIN_AT_REST, join, joined,
        )  # fmt: skip
        return grown

    def change(self, new: dict[int, list[int]]) -> tuple[dict[int, list[int]], list[int]]:
        """Give some quads other corners, none where one goes, key -1 for a new one; returns those before and the new quads."""
        old, fresh = {}, []
        for q, corners in new.items():
            number = q
            if q < 0:
                number = len(self.quads)
                self.quads.append([])
                fresh.append(number)
            old[number] = self.quads[number]
            for v in self.quads[number]:
                self.at[v].discard(number)
                self.degree[v] -= 1
            self.quads[number] = corners
        for number in old:
            for v in self.quads[number]:
                self.at[v].add(number)
                self.degree[v] += 1
        return old, fresh

    def add_node(self, beside: int, fresh: int) -> None:
        """Put a new node near another, on the way to the others of its quads."""
        self.patches[fresh], self.desired[fresh] = self.patches[beside], self.desired[beside]
        self.held[fresh], self.fixed[fresh] = FREE, False
        others = [w for q in sorted(self.at[fresh]) for w in self.quads[q] if w not in (fresh, beside)]
        self.nodes[fresh] = 0.6 * self.nodes[beside] + 0.4 * self.nodes[others].mean(axis=0)

    def renew(self, near: float) -> None:
        """Fit a new patch to each node farther from the centre of its own than `near` members."""
        used = np.unique(self.live())
        away = np.linalg.norm(self.nodes[used] - self.patches[used, CENTRE : CENTRE + 3], axis=1)
        for v in used[away > near * self.desired[used]].tolist():
            fit_patch(
                self.surface, self.patches[v], int(self.patches[v, NEAREST_SAMPLE]), tuple(self.nodes[v].tolist())
            )

    def grid(self, like: Grid) -> Grid:
        """Return the quads as a grid with all else as in another; nodes without a quad are dropped."""
        quads = self.live()
        kept, inverse = np.unique(quads, return_inverse=True)
        panels = inverse.reshape(-1, 4).astype(np.int64)
        nodes = self.nodes[kept]
        made = like.replace(
            nodes=nodes, triangles=triangles_of(nodes, panels), panels=panels, fixed=self.fixed[kept],
            lines=np.zeros((0, 2), np.int64),
        )  # fmt: skip
        number = np.full(len(self.nodes), -1)
        number[kept] = np.arange(len(kept))
        chains = np.sort(number[np.array(sorted(self.chains), np.int64).reshape(-1, 2)], axis=1)
        count, single = len(kept), made.edges[made.edge_uses == 1]
        return made.replace(lines=chains[~np.isin(chains @ [count, 1], single @ [count, 1])])


def _room(values: np.ndarray, room: int) -> np.ndarray:
    """Return a copy with room for more rows."""
    more = np.zeros((room, *values.shape[1:]), values.dtype)
    more[: len(values)] = values
    return more
