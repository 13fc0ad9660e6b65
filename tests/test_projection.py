"""Landing: nodes come down on the scanned surface and not on its noise, however the points lie."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree
from shapes import Shape, make

import scantruss as st
from scantruss.attempts.table import Attempt
from scantruss.pipeline import make_grid


@pytest.mark.parametrize("lines", [0.0, 1.1])
def test_nodes_lie_nearer_to_the_true_surface_than_half_the_noise(lines: float) -> None:
    """Also between scan lines: points along one line tell nothing of the surface beside it."""
    shape = make("scallop", 40_000, scan_lines=lines)
    grid = st.grid_from_points(shape.points, st.Settings(length=shape.length, effort="quick"))
    assert shape.distance(grid.nodes + grid.origin).mean() <= 0.5 * shape.noise


def heights(shape: Shape, nodes: np.ndarray) -> np.ndarray:
    """How far nodes lie off the plane of the nearest true triangle: beside the boundary too, where the surface itself has ended."""
    corners = shape.surface.nodes[shape.surface.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    near = cKDTree(corners.mean(axis=1)).query(nodes)[1]
    off = ((nodes - corners[near, 0]) * normals[near]).sum(axis=1) / np.linalg.norm(normals[near], axis=1)
    return np.minimum(abs(off), shape.distance(nodes))


@pytest.mark.parametrize("name", ["scallop", "cloth"])
def test_noise_is_averaged_at_a_rim_too_and_moves_corners_little(name: str) -> None:
    """Off by as little as the mean of 17 points would be, at the boundary of 5: there a patch has half of its points, all to one side.

    At a corner it has a quarter of them, so nothing is averaged there, but the noise is hardly made larger either.
    """
    inside, curves, corners = [], [], []
    for seed in range(4):
        shape = make(name, 100_000, seed=seed, noise=0.01 * make(name, 10).length)
        asked = st.Settings(length=shape.length, effort="quick")
        grid = make_grid(st.PointCloud.from_array(shape.points), Attempt(asked))  # without the looks for wide folds
        nodes = grid.nodes + grid.origin
        off = heights(shape, nodes) / shape.noise
        at_corner = cKDTree(nodes).query(shape.corners)[1]
        at_boundary = np.zeros(len(nodes), bool)
        at_boundary[grid.edges[grid.edge_uses == 1]] = True
        inside.append(off[~at_boundary].mean())
        corners.append(off[at_corner].mean())
        at_boundary[at_corner] = False
        curves.append(off[at_boundary].mean())
    one_point = np.sqrt(2 / np.pi)  # mean distance of a measured point from its true place along the normal, in noises
    assert np.mean(inside) <= one_point / np.sqrt(17) and np.mean(curves) <= one_point / np.sqrt(5)
    assert np.mean(corners) <= 1.5
