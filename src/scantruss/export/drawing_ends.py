"""Whether lines that others drew meet where they seem to meet: ends that stop short, and lines that run through nodes."""

from __future__ import annotations

import numpy as np

from ..errors import FormatError
from .drawing_panels import place_in_drawing


def check_ends(lines: np.ndarray, points: np.ndarray, reach: float, near: float, name: str) -> None:
    """Refuse lines that are not joined although they meet, or nearly.

    Parameters
    ----------
    lines : (L, 2) int64, nodes, the lower first, sorted
    points : (N, 3), the nodes
    reach : float
        Distance from a node within which a line runs through it [unit].
    near : float
        Distance within which two nodes that no line joins are taken for one that is badly drawn, and so is a line within it of a node
        where one line ends [unit].

    Raises
    ------
    FormatError
        There are such; the message has the first place.
    """
    from scipy.spatial import cKDTree

    tree = cKDTree(points)
    count = len(points)
    keys = lines @ [count, 1]
    pairs = np.sort(tree.query_pairs(near, output_type="ndarray").astype(np.int64).reshape(-1, 2), axis=1)
    apart = pairs[~np.isin(pairs @ [count, 1], keys)]
    if len(apart):
        raise FormatError(
            f"{name} has {len(apart):,} pairs of ends within {near:.3g} of each other that are not joined, one at"
            f" {place_in_drawing(points[apart[0, 0]])}; give a larger --merge than their distance, or draw them farther apart"
        )
    line, node = _beside(lines, points, tree, near)
    start, way = points[lines[line, 0]], points[lines[line, 1]] - points[lines[line, 0]]
    share = np.clip(((points[node] - start) * way).sum(axis=1) / (way * way).sum(axis=1), 0.0, 1.0)
    off = np.linalg.norm(points[node] - start - share[:, None] * way, axis=1)
    alone = np.bincount(lines.ravel(), minlength=count)[node] == 1
    through = off <= np.where(alone, near, reach)
    if through.any():
        raise FormatError(
            f"{name} has {len(np.unique(line[through])):,} lines that run through nodes or past loose ends, one at"
            f" {place_in_drawing(points[node[through][0]])}; split them there"
        )


def _beside(lines: np.ndarray, points: np.ndarray, tree: object, near: float) -> tuple[np.ndarray, np.ndarray]:
    """Return lines and nodes that are no ends of theirs, within the ball about each line and `near` beyond."""
    middle = points[lines].mean(axis=1)
    half = np.linalg.norm(points[lines[:, 1]] - points[lines[:, 0]], axis=1) / 2 + near
    found = tree.query_ball_point(middle, half)  # type: ignore[attr-defined]
    line = np.repeat(np.arange(len(lines)), [len(each) for each in found])
    node = np.concatenate([np.asarray(each, np.int64) for each in found])
    other = (lines[line] != node[:, None]).all(axis=1)
    return line[other], node[other]
