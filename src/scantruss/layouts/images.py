"""Images: the nodes of a symmetric grid that are images of each other, so that what moves them keeps the symmetry."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..grid.grid import Grid
from ..improve.mirrored import wedge_of
from ..scan.rotation import Rotation
from ..scan.symmetry import MirrorPlane, three_of
from ..settings.values import ROTATION_NUMBERS

AT_IMAGE = 1e-6  #: farthest that a node is from the image of another, over the mean member


@dataclass(frozen=True, eq=False)
class Images:
    """The symmetries of a grid: none but that which changes nothing, where it has no other."""

    matrices: np.ndarray  #: (M, 3, 3)
    centre: np.ndarray  #: (3,) that all keep
    of: np.ndarray  #: (M, V) the node that each node comes to

    @classmethod
    def of_grid(cls, grid: Grid) -> Images:
        """Return the symmetries that the settings of a grid name and that its nodes have."""
        none = cls(np.eye(3)[None], np.zeros(3), np.arange(len(grid.nodes))[None])
        rows = () if grid.settings is None else grid.settings.symmetry
        if not rows or isinstance(rows, str):
            return none
        if len(rows[0]) == ROTATION_NUMBERS:
            point, axis = np.array(rows[0][:3]), np.array(rows[0][3:6])
            rotation = Rotation(three_of(point), three_of(axis / np.linalg.norm(axis)), round(rows[0][6]), 0.0)
            matrices, centre = [rotation.matrix(k) for k in range(rotation.order)], point - grid.origin
        else:
            planes = [MirrorPlane(three_of(np.array(row[:3])), three_of(np.array(row[3:])), 0.0) for row in rows]
            wedge = wedge_of(planes, grid.origin)
            matrices, centre = wedge.matrices(), wedge.centre
        tree, found = cKDTree(grid.nodes), []
        for matrix in matrices:
            apart, image = tree.query((grid.nodes - centre) @ matrix.T + centre)
            if apart.max() > AT_IMAGE * grid.lengths.mean() or len(np.unique(image)) < len(image):
                return none
            found.append(image)
        return cls(np.array(matrices), centre, np.array(found))

    def alike(self, nodes: np.ndarray) -> np.ndarray:
        """Return the nodes (V, 3), each the mean of what its images say: the first of them, and exactly its images."""
        if len(self.matrices) == 1:
            return nodes
        said = np.einsum("mvi,mij->mvj", nodes[self.of] - self.centre, self.matrices)  # back by the transposes
        first = self.of.min(axis=0)
        mean = said.mean(axis=0)
        which = np.argmax(
            self.of[:, first] == np.arange(len(nodes)), axis=0
        )  # the matrix that brings the first one here
        made = np.einsum("vij,vj->vi", self.matrices[which], mean[first])
        return np.asarray(made + self.centre)
