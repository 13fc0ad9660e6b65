"""Collapse: the nodes of a fine mesh that belong to one node of the lattice become one, edge by edge, so that the mesh stays manifold."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..kernels.cells.collapse import collapse_edges
from ..kernels.cells.quads import RESTING_NODE
from .fine_mesh import FineMesh

SAME_NODE = 0.5  # way in either axis up to which two lattice nodes are one [members]


@dataclass(frozen=True, eq=False)
class LatticeMesh:
    """A triangulation of the nodes of a lattice."""

    nodes: np.ndarray  #: (V, 3) [scan unit]
    triangles: np.ndarray  #: (T, 3) int64
    held: np.ndarray  #: (V,) int64 as in a `FineMesh`
    chains: np.ndarray  #: (C, 2) int64 edges along the boundary and lines
    source: np.ndarray  #: (V,) int64 node of the fine mesh that each was


def collapse_to_lattice(mesh: FineMesh, places: np.ndarray, ways: np.ndarray) -> LatticeMesh:
    """Return the fine mesh with all edges collapsed that join nodes of one lattice node.

    Parameters
    ----------
    mesh : FineMesh
    places : (F, 3) place of the lattice node of each node [scan unit]
    ways : (E, 2) way from lattice node to lattice node along each edge [members]
    """
    size = np.abs(ways).max(axis=1)
    order = np.argsort(size, kind="stable")
    into, triangles = np.arange(len(mesh.nodes)), mesh.triangles.copy()
    ends = np.unique(np.sort(mesh.chains, axis=1), axis=0).ravel()
    collapse_edges(mesh.edges[order[size[order] < SAME_NODE]], mesh.held, triangles, ends, into)
    root = into
    while not np.array_equal(into[root], root):  # ends: each was collapsed into one that was there later
        root = into[root]
    kept, inverse = np.unique(root, return_inverse=True)
    held = mesh.held[kept]
    counts = (mesh.held == held[inverse]).astype(float)  # a node of the boundary stays there
    mean: np.ndarray = np.stack([np.bincount(inverse, counts * places[:, k]) for k in range(3)], axis=1)
    mean = mean / np.bincount(inverse, counts)[:, None]
    nodes = np.where((held == RESTING_NODE)[:, None], mesh.nodes[kept], mean)
    number = np.full(len(into), -1)
    number[kept] = np.arange(len(kept))
    pairs = ends.reshape(-1, 2)
    chains = np.unique(np.sort(number[pairs[pairs[:, 0] >= 0]], axis=1), axis=0)
    return LatticeMesh(nodes, number[triangles[triangles[:, 0] >= 0]], held, chains, kept)
