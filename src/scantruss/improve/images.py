"""Images: the nodes of a symmetric grid that are images of each other, so that what moves them keeps the symmetry."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..grid.grid import Grid
from ..scan.rotation import Rotation
from ..scan.symmetry import MirrorPlane, three_of
from ..settings.values import ROTATION_NUMBERS
from .half_turned import half_turned_wedge
from .mirrored import wedge_of

AT_IMAGE = 1e-6  #: farthest that a node is from the image of another, over the mean member


@dataclass(frozen=True, eq=False)
class Images:
    """The symmetries of a grid: none but that which changes nothing, where it has no other."""

    matrices: np.ndarray  #: (M, 3, 3)
    centre: np.ndarray  #: (3,) that all keep
    of: np.ndarray  #: (M, V) the node that each node comes to

    @property
    def some(self) -> bool:
        """Whether there are any."""
        return len(self.matrices) > 1

    @classmethod
    def of_grid(cls, grid: Grid) -> Images:
        """Return the symmetries that the settings of a grid name and that its nodes have."""
        none = cls(np.eye(3)[None], np.zeros(3), np.arange(len(grid.nodes))[None])
        rows = () if grid.settings is None else grid.settings.symmetry
        if not rows or isinstance(rows, str):
            return none
        if len(rows[0]) == ROTATION_NUMBERS:
            rotation, *beside = (Rotation.of_row(row) for row in rows)
            if beside:
                wedge = half_turned_wedge(rotation, beside[0], grid.origin)
                matrices, centre = wedge.matrices(), wedge.centre
            else:
                matrices = [rotation.matrix(k) for k in range(rotation.order)]
                centre = np.array(rotation.point) - grid.origin
        else:
            planes = [MirrorPlane(three_of(np.array(row[:3])), three_of(np.array(row[3:])), 0.0) for row in rows]
            wedge = wedge_of(planes, grid.origin)
            matrices, centre = wedge.matrices(), wedge.centre
        return (
            cls(np.array(matrices), centre, none.of).of_nodes(grid.nodes, AT_IMAGE * float(grid.lengths.mean())) or none
        )

    def of_nodes(self, nodes: np.ndarray, near: float) -> Images | None:
        """Return the same symmetries of other nodes (V, 3); None where one has no image.

        near : farthest that a node may be from the image of another [scan unit]
        """
        from scipy.spatial import cKDTree  # which grids without symmetry do not load

        tree, found = cKDTree(nodes), []
        for matrix in self.matrices:
            apart, image = tree.query((nodes - self.centre) @ matrix.T + self.centre)
            if apart.max() > near or len(np.unique(image)) < len(image):
                return None
            found.append(image)
        return replace(self, of=np.array(found))

    def of_places(self, places: np.ndarray, near: float) -> np.ndarray:
        """Return places (K, 3) and their images, one of those that lie nearer to each other than `near` [scan unit]."""
        made: list[np.ndarray] = []
        for matrix in self.matrices:
            for place in (places - self.centre) @ matrix.T + self.centre:
                if all(np.linalg.norm(place - other) > near for other in made):
                    made.append(place)
        return np.array(made).reshape(-1, 3)

    def alike(self, nodes: np.ndarray) -> np.ndarray:
        """Return the nodes (V, 3), each the mean of what its images say: the first of them, and exactly its images."""
        if not self.some:
            return nodes
        turned_back = np.einsum("mvi,mij->mvj", nodes[self.of] - self.centre, self.matrices)  # back by the transposes
        first = self.of.min(axis=0)
        mean = turned_back.mean(axis=0)
        which = np.argmax(
            self.of[:, first] == np.arange(len(nodes)), axis=0
        )  # the matrix that brings the first one here
        made = np.einsum("vij,vj->vi", self.matrices[which], mean[first])
        return np.asarray(made + self.centre)
