"""Few joints: stars of members drawn towards few kinds, nodes on the surface of the grid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from ..grid.alike import JOINTS, Alike
from ..grid.grid import Grid
from ..runtime.progress import Progress
from .alike import PartKinds, check_alike, few_kinds
from .part_vectors import PartVectors

#: by how far lengths may be off the mean member, beside those that were before, over it; usually
USUAL_UNEVENNESS = 0.2
MOST_UNEVEN = 0.9  #: that can be asked for
HOLD_OF_LENGTH = 10.0  #: weight of what is beyond, over that of a direction


def few_joints(
    grid: Grid,
    tolerance: float = 0.01,
    count: int = 1,
    *,
    mirrored: bool = False,
    uneven: float = USUAL_UNEVENNESS,
    progress: Progress | None = None,
) -> PartKinds:
    """Return the grid with its nodes moved along its surface so that there are few different joints.

    Two joints are of one kind if one, turned, has its members within the tolerance of those of the other; see `few_kinds`. Nodes move
    as in `few_lengths`, and the symmetry of the grid is kept.

    Parameters
    ----------
    grid : Grid
    tolerance : float
        Root mean square of what is between unit vectors along the members of two joints, 0.0001 to 0.2: freeGrid's measure (Bruno et al.
        2023), which takes .01.
    count : int
        Kinds that are few enough.
    mirrored : bool
        Whether mirror images are of one kind; freeGrid counts two.
    uneven : float
        By how much members may differ from the mean one, over it, 0 to 0.9; those that did before stay as they were. They are held by a
        weight, and may exceed it by a hundredth.
    progress : callable, optional
        See `few_kinds`.

    Raises
    ------
    InputError
        A value cannot be used, or the grid has no members or too many nodes.
    """
    check_alike(grid, tolerance, count, "joints", len(grid.nodes))
    if not 0.0 <= uneven <= MOST_UNEVEN:
        raise InputError(f"members can differ from the mean one by 0% to 90% of it, got {uneven!r}")
    asked = Alike(JOINTS, tolerance, count, float(grid.lengths.mean()), mirrored, uneven)
    return few_kinds(grid, stars_of(grid, uneven), asked, progress)


@dataclass(frozen=True, eq=False)
class Stars(PartVectors):
    """Joints as unit vectors along their members."""

    called, size_is, over = "node", "members", True

    least: np.ndarray  #: (V, W) least length of each member [unit of the grid]
    greatest: np.ndarray  #: (V, W) greatest length of each [unit of the grid]

    @property
    def ring(self) -> np.ndarray:
        """(V, W) neighbours, anticlockwise, at the boundary from its first member on; -1 for none."""
        return self.nodes_of[:, 1:]

    def members(self, nodes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return unit vectors (V, W, 3) along the members, nil for none, and their lengths (V, W)."""
        way = np.where(self.ring[..., None] >= 0, nodes[self.ring] - nodes[:, None], 0.0)
        size = np.linalg.norm(way, axis=2)
        return way / np.maximum(size, 1e-300)[..., None], size

    def vectors(self, nodes: np.ndarray) -> np.ndarray:
        """Return the vectors, see `PartVectors`."""
        return self.members(nodes)[0]

    def slopes(self, nodes: np.ndarray, ways: np.ndarray) -> np.ndarray:
        """Return how the vectors change, see `PartVectors`."""
        along, size = self.members(nodes)
        across = np.eye(3) - along[..., None] * along[..., None, :]
        across *= np.where(self.ring >= 0, 1.0 / np.maximum(size, 1e-300), 0.0)[..., None, None]
        return self._by_node(np.swapaxes(across, -1, -2), ways)

    def held(self, nodes: np.ndarray, ways: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return by how much members are too long or too short, see `PartVectors`."""
        along, size = self.members(nodes)
        excess = np.clip(size, self.least, self.greatest) - size
        holds = np.where(excess == 0, 0.0, HOLD_OF_LENGTH)
        return HOLD_OF_LENGTH * excess, self._by_node((holds[..., None] * along)[..., None], ways)[:, :, 0]

    def _by_node(self, slopes: np.ndarray, ways: np.ndarray) -> np.ndarray:
        """Return slopes (V, W, D, 1 + W, 2) of what changes by (V, W, 3, D) with the way from the node to a neighbour."""
        number, width = self.ring.shape
        found = np.zeros((number, width, slopes.shape[-1], 1 + width, ways.shape[1]))
        found[:, :, :, 0] = -np.einsum("vwcd,vkc->vwdk", slopes, ways)
        place = np.arange(width)
        found[:, place, :, 1 + place] = np.einsum("vwcd,vwkc->wvdk", slopes, ways[self.ring])
        return found

    def shaped(self, vectors: np.ndarray) -> np.ndarray:
        """Return the means as unit vectors, see `PartVectors`."""
        return vectors / np.maximum(np.linalg.norm(vectors, axis=2, keepdims=True), 1e-300)


def stars_of(grid: Grid, uneven: float = USUAL_UNEVENNESS) -> Stars:
    """Return the stars of the nodes of a grid."""
    count = len(grid.nodes)
    ends = np.concatenate([grid.edges, grid.edges[:, ::-1]])
    corners = grid.nodes[grid.triangles]
    normal = np.zeros((count, 3))
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    for k in range(3):
        np.add.at(normal, grid.triangles[:, k], across)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    axis = np.eye(3)[np.abs(normal).argmin(axis=1)]
    x = np.cross(axis, normal)
    y = np.cross(normal, x)
    way = grid.nodes[ends[:, 1]] - grid.nodes[ends[:, 0]]
    angle = np.arctan2((way * y[ends[:, 0]]).sum(axis=1), (way * x[ends[:, 0]]).sum(axis=1))
    ends = ends[np.lexsort((angle, ends[:, 0]))]
    valence = np.bincount(ends[:, 0], minlength=count)
    ring = np.full((count, max(int(valence.max()), 1)), -1)
    start = np.cumsum(valence) - valence
    ring[ends[:, 0], np.arange(len(ends)) - start[ends[:, 0]]] = ends[:, 1]
    is_open = np.zeros(count, np.int64)
    for a, b in _directed_boundary(grid):  # the panel is on the left of it
        is_open[a] = 1
        own = ring[a, : valence[a]]
        ring[a, : valence[a]] = np.roll(own, -int(np.flatnonzero(own == b)[0]))
    mean = float(grid.lengths.mean())
    size = np.where(ring >= 0, np.linalg.norm(grid.nodes[ring] - grid.nodes[:, None], axis=2), 0.0)
    return Stars(
        nodes_of=np.concatenate([np.arange(count)[:, None], ring], axis=1),
        count=valence,
        is_open=is_open,
        least=np.where(ring >= 0, np.minimum(size, (1 - uneven) * mean), 0.0),
        greatest=np.maximum(size, (1 + uneven) * mean),
    )


def _directed_boundary(grid: Grid) -> list[tuple[int, int]]:
    """Return the members of the boundary, each in the direction in which its triangle has it."""
    half = np.concatenate([grid.triangles[:, [0, 1]], grid.triangles[:, [1, 2]], grid.triangles[:, [2, 0]]])
    both = {(a, b) for a, b in half.tolist()}
    return sorted((a, b) for a, b in both if (b, a) not in both)
