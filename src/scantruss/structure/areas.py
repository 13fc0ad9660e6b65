"""The areas that carry loads, which way they face, and how nodes share what acts on them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix

from ..grid.panels import sides_of, sizes_of
from ..kernels.geometry.components import component_labels

CLEARLY_DOWN = 0.5  #: share of the plan area from which a piece faces up or down; else it encloses, or stands


@dataclass(frozen=True, eq=False)
class LoadedAreas:
    """The surface of a structure in parts, each of which is loaded as a whole.

    A panel of three nodes is one part, and each node takes a third. A panel of more is cut from its middle, the mean of its nodes, to
    its sides: both nodes of a side and the middle take a third of what acts there, and the nodes share evenly what the middle takes.
    So it makes no difference where a panel would be cut in triangles, and forces and moments of the nodes are those of the area.
    """

    vectors: np.ndarray  #: (K, 3) area vectors along the outer normals [m2]
    middles: np.ndarray  #: (K, 3) [m]
    shares: csr_matrix  #: (V, K) of each node in what acts on a part
    signs: (
        np.ndarray
    )  #: (K,) -1 of a part that another one of its panel lies upon, where a corner turns inwards; else 1

    @cached_property
    def surface(self) -> np.ndarray:
        """(K,) areas [m2]."""
        made: np.ndarray = self.signs * np.linalg.norm(self.vectors, axis=1)
        return made

    @cached_property
    def plan(self) -> np.ndarray:
        """(K,) plan areas of what faces up [m2]."""
        made: np.ndarray = self.signs * np.maximum(self.signs * self.vectors[:, 2], 0.0)
        return made

    def on_nodes(self, forces: np.ndarray) -> np.ndarray:
        """Return the (V, 6) loads on nodes of (K, 3) forces on the parts."""
        return np.pad(self.shares @ forces, ((0, 0), (0, 3)))


def loaded_areas(nodes: np.ndarray, panels: np.ndarray) -> LoadedAreas:
    """Return the parts of panels that carry loads.

    Parameters
    ----------
    nodes : (V, 3) array [m]
    panels : (P, K) int64
        Nodes of the panels, anticlockwise seen from outside, filled up with -1.
    """
    sizes = sizes_of(panels)
    small = panels[sizes == 3][:, :3]
    large = panels[sizes > 3]
    counts = sizes[sizes > 3]
    ends = sides_of(large) if len(large) else np.zeros((0, 2), np.int64)
    panel = np.repeat(np.arange(len(large)), counts)  # of each part of a large panel
    there = large >= 0
    middle = np.where(there[:, :, None], nodes[large], 0.0).sum(axis=1) / np.maximum(counts, 1)[:, None]
    a = nodes[np.concatenate([small[:, 0], ends[:, 0]])]
    b = nodes[np.concatenate([small[:, 1], ends[:, 1]])]
    c = np.concatenate([nodes[small[:, 2]], middle[panel]])
    vectors = np.cross(b - a, c - a) / 2
    signs = np.ones(len(vectors))
    whole = np.zeros((len(large), 3))
    np.add.at(whole, panel, vectors[len(small) :])
    signs[len(small) :] = np.where((vectors[len(small) :] * whole[panel]).sum(axis=1) < 0, -1.0, 1.0)
    parts = np.arange(len(small), len(vectors))
    rows = [small.ravel(), ends.ravel(), large[panel][there[panel]]]
    columns = [np.repeat(np.arange(len(small)), 3), np.repeat(parts, 2), np.repeat(parts, counts[panel])]
    thirds = [np.full(small.size + ends.size, 1 / 3), np.repeat(1 / (3 * counts[panel]), counts[panel])]
    at = np.concatenate(rows), np.concatenate(columns)
    shares = csr_matrix(coo_matrix((np.concatenate(thirds), at), (len(nodes), len(vectors))))
    return LoadedAreas(vectors, (a + b + c) / 3, shares, signs)


def turned_pieces(nodes: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return which triangles (T,) belong to a piece that has to be turned over, so that its normals point out.

    A piece that faces down as a whole is loaded from above. One that faces neither up nor down encloses something, or nearly: its
    normals point away from its middle.
    """
    a, b, c = (nodes[corner] for corner in triangles.T)
    areas, middles = np.cross(b - a, c - a) / 2, (a + b + c) / 3
    label = component_labels(len(nodes), triangles[:, [0, 1]].ravel(), triangles[:, [1, 2]].ravel())[triangles[:, 0]]
    turned = np.zeros(len(triangles), bool)
    for piece in np.unique(label):
        mine = label == piece
        up, flat = areas[mine, 2].sum(), np.abs(areas[mine, 2]).sum()
        size = np.linalg.norm(areas[mine], axis=1)
        around = middles[mine] - np.average(middles[mine], axis=0, weights=np.maximum(size, 1e-300))
        out = (areas[mine] * around).sum()
        reach = (size * np.linalg.norm(around, axis=1)).sum()
        if abs(up) > CLEARLY_DOWN * flat and flat > 1e-9 * size.sum():
            turned[mine] = up < 0
        else:
            turned[mine] = out < -1e-9 * reach
    return turned
