"""What layers under a grid are made of, apart from where it lies: nodes, chords, webs, panels."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..grid.grid import Grid
from ..grid.panels import sizes_of

SECOND_LAYERS = ("dual", "same")  #: nodes under the panels, or under the nodes
LAYER_EDGES = ("tapered", "closed")  #: how layers end at the boundary of the grid


@dataclass(frozen=True, eq=False)
class LayerParts:
    """Nodes, members and panels of all layers; those of the grid come first."""

    owners: (
        np.ndarray
    )  #: (N, K) nodes of the grid over each node: the corners of its panel or a single one, filled up with -1
    layer: np.ndarray  #: (N,) number of the layer of each node, 0 for the grid
    chords: list[np.ndarray]  #: (K, 2) of each layer
    webs: list[np.ndarray]  #: (K, 2) between each layer and the next
    panels: tuple[np.ndarray, ...]  #: nodes of each panel of the lower layers, anticlockwise seen from outside
    under: np.ndarray  #: (V,) the node of the last layer under each node of the grid

    def means(self, values: np.ndarray) -> np.ndarray:
        """Return the mean over the owners of each node of values at the nodes of the grid (V,) or (V, D)."""
        there = (self.owners >= 0).reshape(*self.owners.shape, *[1] * (values.ndim - 1))
        return np.asarray(np.where(there, values[self.owners], 0.0).sum(axis=1) / there.sum(axis=1))

    def owners_of(self, nodes: np.ndarray) -> np.ndarray:
        """Return the nodes of the grid over some nodes, sorted, each once."""
        found = np.unique(self.owners[nodes])
        return np.asarray(found[found >= 0])


@dataclass(frozen=True, eq=False)
class _Layer:
    """Ids of the nodes of one layer under what they lie; -1 where there is none."""

    of_node: np.ndarray  #: (V,)
    of_panel: np.ndarray  #: (P,)


def layer_parts(grid: Grid, count: int, second: str, edges: str) -> LayerParts:
    """Return the parts of so many layers, the grid among them."""
    nodes, table = len(grid.nodes), grid.panel_table
    used = np.isin(np.arange(nodes), table)
    at_boundary = np.zeros(nodes, bool)
    at_boundary[grid.edges[grid.edge_uses == 1]] = True
    meets = _meeting(grid, at_boundary) if edges == "tapered" and second == "same" else np.zeros(nodes, bool)
    none = np.full(len(table), -1)
    layers = [_Layer(np.arange(nodes), none)]
    alone = np.full((nodes, table.shape[1]), -1)
    alone[:, 0] = np.arange(nodes)
    owners, layer = [alone], [np.zeros(nodes, np.int64)]
    chords, webs, panels = [grid.edges], list[np.ndarray](), list[np.ndarray]()
    made = nodes
    for number in range(1, count):
        dual = second == "dual" and number % 2 == 1
        here = at_boundary & used if edges == "closed" else np.zeros(nodes, bool)
        own = np.flatnonzero(here if dual else used & ~meets)
        of_node = np.where(meets, np.arange(nodes), -1)
        faces = np.arange(len(table)) if dual else np.zeros(0, np.int64)
        of_panel = none.copy()
        of_panel[faces] = made + np.arange(len(faces))
        of_node[own] = made + len(faces) + np.arange(len(own))
        owners += [table[faces], alone[own]]
        layer.append(np.full(len(faces) + len(own), number))
        made += len(faces) + len(own)
        layers.append(_Layer(of_node, of_panel))
        chords.append(_new(_dual_chords(grid, layers[-1]) if dual else of_node[grid.edges], chords + webs, made))
        panels += _cells(grid, layers[-1]) if dual else [of_node[loop] for loop in grid.panel_loops]
    for upper, lower in pairwise(layers):
        webs.append(_new(_webs_between(grid, upper, lower), chords + webs, made))
    last = layers[-1]
    under = np.where(last.of_node >= 0, last.of_node, 0)
    if last.of_panel[0] >= 0:
        under = np.where(last.of_node >= 0, last.of_node, last.of_panel[_nearest_panel(grid)])
    under = np.where(used, under, 0)
    return LayerParts(np.concatenate(owners), np.concatenate(layer), chords, webs, tuple(panels), under)


def _meeting(grid: Grid, at_boundary: np.ndarray) -> np.ndarray:
    """Return at which nodes layers that are the same meet: those of the boundary, but for corners of panels without an inner node."""
    meets, table = at_boundary.copy(), grid.panel_table
    outer = table[(at_boundary[table] | (table < 0)).all(axis=1)]
    meets[outer[outer >= 0]] = False
    return meets


def _new(members: np.ndarray, before: list[np.ndarray], count: int) -> np.ndarray:
    """Return the members that are none of those before and have two ends, each once, in their order."""
    members = members[members[:, 0] != members[:, 1]]
    keys = np.sort(members, axis=1) @ [count, 1]
    _, first = np.unique(keys, return_index=True)
    known = np.concatenate([np.sort(each, axis=1) @ [count, 1] for each in before])
    first = np.sort(first)
    return np.asarray(members[first[~np.isin(keys[first], known)]])


def _dual_chords(grid: Grid, layer: _Layer) -> np.ndarray:
    """Return the chords between nodes under neighbouring panels; under a boundary along it, and to those of its panels."""
    inner = layer.of_panel[grid.edge_panels[grid.edge_uses == 2]]
    if (layer.of_node < 0).all():
        return inner
    outer = grid.edge_uses == 1
    ends = layer.of_node[grid.edges[outer]]
    panel = layer.of_panel[grid.edge_panels[outer, 0]]
    inwards = np.stack([ends.ravel(), np.repeat(panel, 2)], axis=1)
    return np.concatenate([inner, ends, inwards])


def _webs_between(grid: Grid, upper: _Layer, lower: _Layer) -> np.ndarray:
    """Return the webs between two layers: verticals and diagonals under nodes, one from each corner to a node under a panel."""
    both = (upper.of_node >= 0) & (lower.of_node >= 0)
    verticals = np.stack([upper.of_node[both], lower.of_node[both]], axis=1)
    if (upper.of_panel < 0).all() and (lower.of_panel < 0).all():
        rank = np.empty(len(grid.nodes), np.int64)
        rank[np.lexsort((np.arange(len(rank)), grid.nodes[:, 2]))] = np.arange(len(rank))
        lowest, rows = rank[grid.edges].argmin(axis=1), np.arange(len(grid.edges))
        ends = grid.edges[rows, lowest], grid.edges[rows, 1 - lowest]
        return np.concatenate([verticals, np.stack([upper.of_node[ends[0]], lower.of_node[ends[1]]], axis=1)])
    table, sizes = grid.panel_table, sizes_of(grid.panel_table)
    corners = table[table >= 0]
    if (lower.of_panel >= 0).any():
        slopes = np.stack([upper.of_node[corners], np.repeat(lower.of_panel, sizes)], axis=1)
    else:
        slopes = np.stack([np.repeat(upper.of_panel, sizes), lower.of_node[corners]], axis=1)
    return np.concatenate([slopes, verticals])


def _cells(grid: Grid, layer: _Layer) -> list[np.ndarray]:
    """Return the panels of a layer under the panels of the grid.

    One around each inner node, and where there are nodes under the boundary those between it and the others.
    """
    following: dict[tuple[int, int], tuple[int, int]] = {}  # node and its next corner: the panel, the corner before
    for number, corners in enumerate(grid.panel_loops):
        for k in range(len(corners)):
            following[corners[k], corners[(k + 1) % len(corners)]] = number, corners[k - 1]
    first: dict[int, int] = {}
    for node, corner in sorted(following):
        first.setdefault(node, corner)
    begins = {
        a: b for loop in grid.boundary_loops for a, b in zip(loop.tolist(), np.roll(loop, -1).tolist(), strict=True)
    }
    found = []
    for node in sorted(first):
        start = corner = begins.get(node, first[node])
        around: list[int] = []
        while (step := following.get((node, corner))) is not None:  # each turn takes another panel of the node
            around.append(int(layer.of_panel[step[0]]))
            if (corner := step[1]) == start:
                break
        below = int(layer.of_node[node])
        if node not in begins:
            found.append(np.array(around, np.int64))
        elif below >= 0:
            found.append(np.array([below, int(layer.of_node[start]), around[0]], np.int64))
            if len(around) > 1:
                found.append(np.array([below, *around], np.int64))
    return found


def _nearest_panel(grid: Grid) -> np.ndarray:
    """Return (V,) the panel of each node whose middle is nearest to it."""
    table, sizes = grid.panel_table, sizes_of(grid.panel_table)
    node, panel = table[table >= 0], np.repeat(np.arange(len(table)), sizes)
    middles = np.stack([np.bincount(panel, grid.nodes[node, k]) for k in range(3)], axis=1) / sizes[:, None]
    apart = np.linalg.norm(grid.nodes[node] - middles[panel], axis=1)
    order = np.lexsort((panel, apart, node))
    found, begin = np.unique(node[order], return_index=True)
    nearest = np.zeros(len(grid.nodes), np.int64)
    nearest[found] = panel[order[begin]]
    return nearest
