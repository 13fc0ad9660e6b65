"""Quads on the scan while they are improved."""

from __future__ import annotations

from collections.abc import Iterable, Set

import numpy as np

from ..grid.grid import Grid
from ..grid.panels import triangles_of
from ..improve.working_mesh import WorkingMesh
from ..kernels.cells.quads import FREE_NODE, RESTING_NODE, SLIDING_NODE, QuadNet, energy_of_quads, settle_quads
from ..kernels.cells.trial import try_quads
from ..kernels.mesh.grid import INTERIOR, ON_CURVE
from ..kernels.surface.local_surface import fit_patch

QUAD_LENGTHS, QUAD_ANGLES = 3.0, 0.45  # weights of lengths and of angles in the energy
QUAD_RELAXATION = 1.5  # over-relaxation
GAIN_AT_REST = 2e-5  # gain of energy a node in a sweep below which nodes have settled
QUADS_AT_NODE = 12  # quads at a node for which there is room at first
NODES_AROUND = 400  # most nodes around a move that is tried


class QuadMesh:
    """Quads, the quads at each node, and where each node lies on the scan and the curves."""

    def __init__(self, mesh: WorkingMesh, quads: np.ndarray, chains: np.ndarray) -> None:
        net, count = mesh.net, mesh.net.used
        room = count + max(count // 2, 64)
        self.surface, self.curves, self.length = mesh.surface, mesh.curves, mesh.length
        self.nodes = _room(net.nodes[:count], room)
        kind = net.kind[:count]
        self.held = _room(
            np.where(kind == INTERIOR, FREE_NODE, np.where(kind == ON_CURVE, SLIDING_NODE, RESTING_NODE)), room
        )
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
        rows = _room(quads, len(quads) + room - count)
        rows[len(quads) :] = -1
        width = max(QUADS_AT_NODE, max(map(len, self.at)) + 4)
        self.net = QuadNet(
            self.nodes, rows, np.full((room, width), -1), np.zeros(room, np.int64), self.held, self.curve, self.arc,
            self.patches, self.curves, self.desired, np.zeros(room + len(rows), np.int64), np.zeros(1, np.int64),
        )  # fmt: skip
        self._enter(range(count))
        self.around = np.empty(NODES_AROUND, np.int64), np.empty((NODES_AROUND, 4))
        self.chains: set[tuple[int, int]] = {(min(a, b), max(a, b)) for a, b in chains.tolist()}

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
        self.settle_some(quads, some[self.held[some] != RESTING_NODE], sweeps, lengths, angles, stride, enough)

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
        of = order[np.isin(flat[order], some)] // 4
        settle_quads(
            self.net, quads, share, of, start, some, lengths, angles, sweeps, stride, enough,
        )  # fmt: skip

    def mean_energy(self) -> float:
        """Return the mean energy of a quad."""
        quads = self.live()
        out = np.zeros(len(quads))
        energy_of_quads(self.net, quads, self.shares(quads), QUAD_LENGTHS, QUAD_ANGLES, out)
        return float(out.mean())

    def _enter(self, nodes: Iterable[int]) -> None:
        """Enter the quads at some nodes into the net."""
        net = self.net
        for v in nodes:
            own = sorted(self.at[v])
            if len(own) > net.at.shape[1]:
                more = np.full((len(net.at), len(own) + QUADS_AT_NODE), -1)
                more[:, : net.at.shape[1]] = net.at
                self.net = net = net._replace(at=more)
            net.degree[v] = len(own)
            net.at[v, : len(own)] = own

    def try_quads(
        self, touched: list[int], new: dict[int, list[int]], at_boundary: np.ndarray, allowed: float, pair: tuple[int, int]
    ) -> tuple[float, int]:  # fmt: skip
        """Return by how much the energy grows where some quads have other corners, and how many nodes around may have moved.

        These are the first of `around`, with their places before; they are back there unless the growth is less than `allowed`.
        """
        numbers = [q if q >= 0 else len(self.quads) for q in new]
        corners = [ring or [-1, -1, -1, -1] for ring in new.values()]
        self._make_room(max(numbers) + 1)
        grown: tuple[float, int] = try_quads(
            self.net, np.array(touched), np.array(numbers), np.array(corners), at_boundary, QUAD_LENGTHS, QUAD_ANGLES,
            QUAD_RELAXATION, GAIN_AT_REST, *pair, allowed, *self.around,
        )  # fmt: skip
        return grown

    def _make_room(self, quads: int) -> None:
        """Make room in the net for so many quads."""
        net = self.net
        if quads > len(net.quads):
            more = _room(net.quads, 2 * quads)
            more[len(net.quads) :] = -1
            self.net = net._replace(quads=more, stamp=_room(net.stamp, len(net.nodes) + 2 * quads))

    def change(self, new: dict[int, list[int]]) -> tuple[dict[int, list[int]], list[int]]:
        """Give some quads other corners, none where one goes, key -1 for a new one; returns those before and the new quads."""
        self._make_room(len(self.quads) + 1)
        old, fresh, changed = {}, [], set()
        for q, corners in new.items():
            number = q
            if q < 0:
                number = len(self.quads)
                self.quads.append([])
                fresh.append(number)
            old[number] = self.quads[number]
            for v in self.quads[number]:
                self.at[v].discard(number)
                changed.add(v)
            self.quads[number] = corners
        for number in old:
            self.net.quads[number] = self.quads[number] or -1
            for v in self.quads[number]:
                self.at[v].add(number)
                changed.add(v)
        self._enter(changed)
        return old, fresh

    def tie(self, cut: Set[tuple[int, int]], tied: Set[tuple[int, int]]) -> None:
        """Take members from the boundary and lines, and give others to them, the smaller node first."""
        self.chains -= cut
        self.chains |= tied

    def add_node(self, beside: int, fresh: int, new: dict[int, list[int]]) -> None:
        """Put a new node near another, on the way to the others of its quads, which are among the corners that change."""
        self.patches[fresh], self.desired[fresh] = self.patches[beside], self.desired[beside]
        self.held[fresh], self.fixed[fresh] = FREE_NODE, False
        others = [w for ring in new.values() if fresh in ring for w in ring if w not in (fresh, beside)]
        self.nodes[fresh] = 0.6 * self.nodes[beside] + 0.4 * self.nodes[others].mean(axis=0)

    def renew(self, near: float) -> None:
        """Fit a new patch to each node farther from the centre of its own than `near` members."""
        used = np.unique(self.live())
        away = np.linalg.norm(self.nodes[used] - self.patches["centre"][used], axis=1)
        for v in used[away > near * self.desired[used]].tolist():
            fit_patch(self.surface, self.patches[v], self.patches[v].sample, tuple(self.nodes[v].tolist()))

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
