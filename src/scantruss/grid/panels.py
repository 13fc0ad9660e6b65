"""Panels of more than three nodes: loops of nodes, each cut into triangles, which are its surface."""

from __future__ import annotations

import numpy as np

CELL_NAMES = {
    "triangle": "triangles",
    "quad": "quads",
    "hexagon": "hexagons",
}  # what panels of each kind of cells are called
REGULAR_MEMBERS = {4: 4, 5: 3}  # members at a regular node inside, by the most nodes of a panel: of quads, of more

PLANAR_ENOUGH = 0.003  # distance of a corner from its panel's mean plane below which it is planar [mean diagonals]


def loops_of(panels: np.ndarray) -> list[list[int]]:
    """Return the nodes of each panel of a table (P, K) that is filled up with -1."""
    return [[node for node in row if node >= 0] for row in panels.tolist()]


def table_of(loops: list[list[int]]) -> np.ndarray:
    """Return loops of nodes as a table (P, K), filled up with -1."""
    table = np.full((len(loops), max(map(len, loops), default=4)), -1, np.int64)
    for row, loop in zip(table, loops, strict=True):
        row[: len(loop)] = loop
    return table


def turned_panels(panels: np.ndarray, which: np.ndarray) -> np.ndarray:
    """Return panels (P, K), those of a mask (P,) seen from the other side."""
    if not which.any():
        return panels
    return table_of([loop[::-1] if turn else loop for loop, turn in zip(loops_of(panels), which, strict=True)])


def sizes_of(panels: np.ndarray) -> np.ndarray:
    """Return the number of nodes of each panel (P,)."""
    found: np.ndarray = (panels >= 0).sum(axis=1)
    return found


def sides_of(panels: np.ndarray) -> np.ndarray:
    """Return the sides of all panels, from node to node (S, 2), panel by panel."""
    size = sizes_of(panels)
    column = np.arange(panels.shape[1])
    following = np.where(column[None] + 1 < size[:, None], column + 1, 0)
    there = panels >= 0
    return np.stack([panels[there], np.take_along_axis(panels, following, axis=1)[there]], axis=1)


def triangles_of(nodes: np.ndarray, panels: np.ndarray) -> np.ndarray:
    """Return the triangles of panels, two less than its nodes for each, panel by panel; each cut is along the shortest diagonal.

    Parameters
    ----------
    nodes : (V, 3) float64 [scan unit]
    panels : (P, K) int64, filled up with -1
    """
    if panels.shape[1] == 4 and (panels >= 0).all():
        a, b, c, d = (nodes[panels[:, k]] for k in range(4))
        other = (np.linalg.norm(b - d, axis=1) < np.linalg.norm(a - c, axis=1))[:, None]
        first = np.where(other, panels[:, [0, 1, 3]], panels[:, [0, 1, 2]])
        second = np.where(other, panels[:, [1, 2, 3]], panels[:, [0, 2, 3]])
        return np.stack([first, second], axis=1).reshape(-1, 3)
    found = []
    taken = {(min(a, b), max(a, b)) for a, b in sides_of(panels).tolist()}  # two panels may share a node of two members
    for loop in loops_of(panels):
        while len(loop) > 3:  # each turn takes a node away
            ends = np.linalg.norm(nodes[np.roll(loop, 1)] - nodes[np.roll(loop, -1)], axis=1)
            cuts = [(min(pair), max(pair)) for pair in zip(loop[-1:] + loop[:-1], loop[1:] + loop[:1], strict=True)]
            ends[[cut in taken for cut in cuts]] = np.inf
            k = int(ends.argmin())
            taken.add(cuts[k])
            found.append([loop[k - 1], loop[k], loop[(k + 1) % len(loop)]])
            del loop[k]
        found.append(loop)
    return np.array(found, np.int64).reshape(-1, 3)


def panel_of_triangles(panels: np.ndarray) -> np.ndarray:
    """Return the panel that each triangle of `triangles_of` belongs to (T,)."""
    found: np.ndarray = np.repeat(np.arange(len(panels)), sizes_of(panels) - 2)
    return found


def first_triangles(panels: np.ndarray) -> np.ndarray:
    """Return the first of the triangles of `triangles_of` that belong to each panel (P,)."""
    found: np.ndarray = np.cumsum(sizes_of(panels) - 2) - (sizes_of(panels) - 2)
    return found


def corner_angles_of(nodes: np.ndarray, panels: np.ndarray) -> np.ndarray:
    """Return the angle at each corner of panels (P, K), NaN where there is none [degree]."""
    size, column = sizes_of(panels)[:, None], np.arange(panels.shape[1])[None]
    after = np.take_along_axis(panels, np.where(column + 1 < size, column + 1, 0), axis=1)
    before = np.take_along_axis(panels, np.where(column > 0, column - 1, size - 1), axis=1)
    e, f = nodes[after] - nodes[panels], nodes[before] - nodes[panels]
    across = np.linalg.norm(np.cross(e, f), axis=2)
    angles: np.ndarray = np.degrees(np.arctan2(across, (e * f).sum(axis=2)))
    return np.where(panels >= 0, angles, np.nan)


def inner_angles_of(nodes: np.ndarray, panels: np.ndarray) -> np.ndarray:
    """Return the angle within the panel at each of its corners (P, K), above 180 where it is hollow, NaN where there is none [degree]."""
    angles, normal = corner_angles_of(nodes, panels), area_vectors_of(nodes, panels)
    size, column = sizes_of(panels)[:, None], np.arange(panels.shape[1])[None]
    after = np.take_along_axis(panels, np.where(column + 1 < size, column + 1, 0), axis=1)
    before = np.take_along_axis(panels, np.where(column > 0, column - 1, size - 1), axis=1)
    turn = np.cross(nodes[after] - nodes[panels], nodes[before] - nodes[panels])
    return np.where((turn * normal[:, None]).sum(axis=2) < 0.0, 360.0 - angles, angles)


def side_lengths_of(nodes: np.ndarray, panels: np.ndarray) -> np.ndarray:
    """Return the length of each side of panels, from node k to the next (P, K), NaN where there is none [scan unit]."""
    found = np.full(panels.shape, np.nan)
    start, end = sides_of(panels).T
    found[panels >= 0] = np.linalg.norm(nodes[end] - nodes[start], axis=1)
    return found


def across_of(nodes: np.ndarray, panels: np.ndarray) -> np.ndarray:
    """Return the distance from each node of a panel to the next but one (P, K), NaN where it has no such node [scan unit]."""
    size, column = sizes_of(panels)[:, None], np.arange(panels.shape[1])[None]
    other = np.take_along_axis(panels, np.where(column < size, (column + 2) % size, 0), axis=1)
    return np.where(panels >= 0, np.linalg.norm(nodes[panels] - nodes[other], axis=2), np.nan)


def area_vectors_of(nodes: np.ndarray, panels: np.ndarray) -> np.ndarray:
    """Return the area vector of each panel (P, 3), along its mean normal [scan unit^2]."""
    sides = sides_of(panels)
    owner = np.repeat(np.arange(len(panels)), sizes_of(panels))
    middle = _middles(nodes, panels)[owner]
    total = np.zeros((len(panels), 3))
    np.add.at(total, owner, 0.5 * np.cross(nodes[sides[:, 0]] - middle, nodes[sides[:, 1]] - middle))
    return total


def _middles(nodes: np.ndarray, panels: np.ndarray) -> np.ndarray:
    there = (panels >= 0)[:, :, None]
    middles: np.ndarray = np.where(there, nodes[panels], 0.0).sum(axis=1) / there.sum(axis=1)
    return middles


def shape_qualities_of(nodes: np.ndarray, panels: np.ndarray) -> np.ndarray:
    """Return the shape quality of each panel (P,): 4 tan(pi / n) area / (sum of squared sides), 1 of a regular one."""
    size = sizes_of(panels)
    sides = sides_of(panels)
    squares = np.bincount(
        np.repeat(np.arange(len(panels)), size),
        ((nodes[sides[:, 0]] - nodes[sides[:, 1]]) ** 2).sum(axis=1),
        len(panels),
    )
    areas = np.linalg.norm(area_vectors_of(nodes, panels), axis=1)
    return 4.0 * np.tan(np.pi / size) * areas / np.where(squares > 0, squares, 1.0)


def planarity_of(nodes: np.ndarray, panels: np.ndarray) -> np.ndarray:
    """Return the largest distance of a corner of each panel from its mean plane, over its mean diagonal (P,)."""
    off = np.abs(np.nan_to_num(heights_of(nodes, panels))).max(axis=1)
    return off / np.maximum(diagonals_of(nodes, panels), 1e-300)


def heights_of(nodes: np.ndarray, panels: np.ndarray) -> np.ndarray:
    """Return how far outside of its mean plane each node of a panel lies (P, K), NaN where it has no such node [scan unit]."""
    normal = area_vectors_of(nodes, panels)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    way = nodes[panels] - _middles(nodes, panels)[:, None]
    return np.where(panels >= 0, (way * normal[:, None]).sum(axis=2), np.nan)


def diagonals_of(nodes: np.ndarray, panels: np.ndarray) -> np.ndarray:
    """Return the mean diagonal of each panel (P,) [scan unit]; the mean side of a triangle."""
    found = np.zeros(len(panels))
    size = sizes_of(panels)
    for count in np.unique(size).tolist():
        own = panels[size == count, :count]
        i, j = np.triu_indices(count, 1)
        apart = np.minimum(j - i, count - j + i)
        far = apart > 1 if count > 3 else apart > 0
        found[size == count] = np.linalg.norm(nodes[own[:, i[far]]] - nodes[own[:, j[far]]], axis=2).mean(axis=1)
    return found
