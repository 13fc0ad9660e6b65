"""Voxels: what triangles wall off on a lattice, and distances, openings, the Euler characteristic and the surface of what they enclose."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..kernels.surface.voxels import squares_across_rows, squares_in_rows
from ..runtime.parallel import run_in_parts

Voxels = NDArray[np.bool_]
DistanceField = NDArray[np.float64]  # a value for each voxel

PLANES_PER_THREAD = 16  # planes of voxels that a thread looks at, at least
WALL_STEP = 0.9  # distance of places on a wall [voxels]


class VoxelLattice(NamedTuple):
    """Where the voxels are."""

    low: np.ndarray  #: (3,) middle of the first [scan unit]
    size: float  #: [scan unit]
    shape: tuple[int, int, int]

    def of(self, places: np.ndarray) -> np.ndarray:
        """Return places (N, 3) in voxels."""
        voxels: np.ndarray = (places - self.low) / self.size
        return voxels


def mark_triangles(wall: Voxels, triangles: Iterable[np.ndarray], lattice: VoxelLattice) -> None:
    """Mark the voxels in which triangles lie, each (K, 3, 3)."""
    for corners in map(lattice.of, triangles):
        edge = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
        parts = np.maximum(np.ceil(edge / WALL_STEP).astype(int), 1)
        for count in np.unique(parts):  # places a step apart, by their shares of the corners
            some = corners[parts == count]
            for i in range(count + 1):
                for j in range(count + 1 - i):
                    share = np.array([count - i - j, i, j]) / count
                    wall[tuple(np.rint(np.einsum("c,kci->ik", share, some)).astype(int))] = True


def enclosed_by(wall: Voxels, gap: int = 1) -> Voxels:
    """Return the voxels that cannot be reached from outside through a wall, those of the wall included.

    gap : half the width of the gaps in the wall that are closed [voxels]
    """
    from scipy import ndimage

    free = ~ndimage.binary_dilation(wall)
    label = ndimage.label(free if gap == 1 else ~ndimage.binary_dilation(wall, iterations=gap))[0]
    outside = label == label[0, 0, 0]
    for _ in range(gap - 1):
        outside = ndimage.binary_dilation(outside, mask=free)
    # farther from outside than 1.5 voxels: half of one, and the thickness of a wall
    enclosed: Voxels = ~ndimage.binary_dilation(outside, ndimage.generate_binary_structure(3, 2))
    return enclosed


def distance_from(voxels: Voxels, lattice: VoxelLattice, reach: float) -> DistanceField:
    """Return the distance of each voxel from the nearest of some (X, Y, Z) [scan unit]; one beyond the reach where that is farther."""
    far = int(np.ceil(reach / lattice.size))
    rows, squares = np.empty(lattice.shape, np.int16), np.empty(lattice.shape, np.int16)
    run_in_parts(lattice.shape[0], PLANES_PER_THREAD, squares_in_rows, voxels, far, rows)
    run_in_parts(lattice.shape[0], PLANES_PER_THREAD, squares_across_rows, rows, False, far, squares)
    run_in_parts(lattice.shape[0], PLANES_PER_THREAD, squares_across_rows, squares, True, far, rows)
    distance: DistanceField = np.sqrt(rows, dtype=np.float64)
    distance *= lattice.size
    return distance


def beyond_ball(voxels: Voxels, radius: float, deep: float, lattice: VoxelLattice) -> Voxels:
    """Return the voxels that a ball within them does not reach, where they lie deeper than corners and edges, and what is around those."""
    reached = distance_from(distance_from(~voxels, lattice, radius) >= radius, lattice, radius + deep) - radius
    beyond = voxels & (reached > 0.0)
    far = beyond & (reached > deep)
    if not far.any():
        return far
    edge = deep + 2.0 * lattice.size
    near: Voxels = beyond & (distance_from(far, lattice, edge) < edge)
    return near


def euler_of_voxels(voxels: Voxels) -> int:
    """Return the Euler characteristic of some voxels (X, Y, Z) that hang together where they touch: parts less tunnels plus hollows."""
    filled = np.pad(voxels, 1)
    total = 0
    # cells of the lattice: corners, which are wide along no axis, edges along one, sides along two, voxels along all
    for axes in product((False, True), repeat=3):
        cells = filled
        for axis, wide in enumerate(axes):
            if not wide:
                one, other = (
                    tuple(slice(begin, end) if each == axis else slice(None) for each in range(3))
                    for begin, end in ((0, -1), (1, None))
                )
                cells = cells[one] | cells[other]
        total += (-1) ** sum(axes) * int(cells.sum())
    return total


def crossings_of(field: DistanceField, where: Voxels, lattice: VoxelLattice) -> np.ndarray:
    """Return the places (M, 3) between neighbouring voxels at which a field is 0, beside some voxels."""
    places = []
    for axis in range(3):
        here, there = (
            tuple(slice(begin, end) if each == axis else slice(None) for each in range(3))
            for begin, end in ((0, -1), (1, None))
        )
        one, other = field[here], field[there]
        crosses = ((one > 0.0) != (other > 0.0)) & where[here]
        voxel = np.argwhere(crosses).astype(float)
        voxel[:, axis] += one[crosses] / (one[crosses] - other[crosses])
        places.append(voxel * lattice.size + lattice.low)
    return np.concatenate(places)
