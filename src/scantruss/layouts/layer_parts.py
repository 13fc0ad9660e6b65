"""What layers under a grid are made of, apart from where it lies: nodes, chords, webs, panels."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..grid.grid import Grid

SECOND_LAYERS = ("dual", "same")  #: nodes under the triangles, or under the nodes
LAYER_EDGES = ("tapered", "closed")  #: how layers end at the boundary of the grid


@dataclass(frozen=True, eq=False)
class LayerParts:
    """Nodes, members and panels of all layers; those of the grid come first."""

    owners: (
        np.ndarray
    )  #: (N, 3) nodes of the grid over each node: the corners of its triangle, or one of them three times
    layer: np.ndarray  #: (N,) number of the layer of each node, 0 for the grid
    chords: list[np.ndarray]  #: (K, 2) of each layer
    webs: list[np.ndarray]  #: (K, 2) between each layer and the next
    panels: tuple[np.ndarray, ...]  #: nodes of each panel of the lower layers, anticlockwise seen from outside
    under: np.ndarray  #: (V,) the node of the last layer under each node of the grid


@dataclass(frozen=True, eq=False)
class _Layer:
    """Ids of the nodes of one layer under what they lie; -1 where there is none."""

    of_node: np.ndarray  #: (V,)
    of_triangle: np.ndarray  #: (T,)


def layer_parts(grid: Grid, count: int, second: str, edges: str) -> LayerParts:
    """Return the parts of so many layers, the grid among them."""
    nodes, triangles = len(grid.nodes), len(grid.triangles)
    used = np.isin(np.arange(nodes), triangles_nodes := np.unique(grid.triangles))
    at_boundary = np.zeros(nodes, bool)
    at_boundary[grid.edges[grid.edge_uses == 1]] = True
    meets = _meeting(grid, at_boundary) if edges == "tapered" and second == "same" else np.zeros(nodes, bool)
    none = np.full(triangles, -1)
    layers = [_Layer(np.arange(nodes), none)]
    owners, layer = [np.repeat(np.arange(nodes)[:, None], 3, axis=1)], [np.zeros(nodes, np.int64)]
    chords, webs, panels = [grid.edges], list[np.ndarray](), list[np.ndarray]()
    made = nodes
    for number in range(1, count):
        dual = second == "dual" and number % 2 == 1
        here = at_boundary & used if edges == "closed" else np.zeros(nodes, bool)
        own = np.flatnonzero(here if dual else used & ~meets)
        of_node = np.where(meets, np.arange(nodes), -1)
        faces = np.arange(triangles) if dual else np.zeros(0, np.int64)
        of_triangle = none.copy()
        of_triangle[faces] = made + np.arange(len(faces))
        of_node[own] = made + len(faces) + np.arange(len(own))
        owners += [grid.triangles[faces], np.repeat(own[:, None], 3, axis=1)]
        layer.append(np.full(len(faces) + len(own), number))
        made += len(faces) + len(own)
        layers.append(_Layer(of_node, of_triangle))
        chords.append(_new(_dual_chords(grid, layers[-1]) if dual else of_node[grid.edges], chords + webs, made))
        panels += _cells(grid, layers[-1]) if dual else list(of_node[grid.triangles])
    for upper, lower in pairwise(layers):
        webs.append(_new(_webs_between(grid, upper, lower), chords + webs, made))
    last = layers[-1]
    under = np.where(last.of_node >= 0, last.of_node, 0)
    if last.of_triangle[0] >= 0:
        under = np.where(last.of_node >= 0, last.of_node, last.of_triangle[_nearest_triangle(grid)])
    under = np.where(np.isin(np.arange(nodes), triangles_nodes), under, 0)
    return LayerParts(np.concatenate(owners), np.concatenate(layer), chords, webs, tuple(panels), under)


def _meeting(grid: Grid, at_boundary: np.ndarray) -> np.ndarray:
    """Return at which nodes layers that are the same meet: those of the boundary, but for corners of triangles without an inner node."""
    meets = at_boundary.copy()
    meets[grid.triangles[at_boundary[grid.triangles].all(axis=1)]] = False
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
    """Return the chords between nodes under neighbouring triangles; under a boundary along it, and to those of its triangles."""
    inner = layer.of_triangle[grid.edge_triangles[grid.edge_uses == 2]]
    if (layer.of_node < 0).all():
        return inner
    outer = grid.edge_uses == 1
    ends = layer.of_node[grid.edges[outer]]
    triangle = layer.of_triangle[grid.edge_triangles[outer, 0]]
    inwards = np.stack([ends.ravel(), np.repeat(triangle, 2)], axis=1)
    return np.concatenate([inner, ends, inwards])


def _webs_between(grid: Grid, upper: _Layer, lower: _Layer) -> np.ndarray:
    """Return the webs between two layers: verticals and diagonals under nodes, three to each node under a triangle."""
    both = (upper.of_node >= 0) & (lower.of_node >= 0)
    verticals = np.stack([upper.of_node[both], lower.of_node[both]], axis=1)
    if (upper.of_triangle < 0).all() and (lower.of_triangle < 0).all():
        rank = np.empty(len(grid.nodes), np.int64)
        rank[np.lexsort((np.arange(len(rank)), grid.nodes[:, 2]))] = np.arange(len(rank))
        lowest, rows = rank[grid.edges].argmin(axis=1), np.arange(len(grid.edges))
        ends = grid.edges[rows, lowest], grid.edges[rows, 1 - lowest]
        return np.concatenate([verticals, np.stack([upper.of_node[ends[0]], lower.of_node[ends[1]]], axis=1)])
    if (lower.of_triangle >= 0).any():
        slopes = np.stack([upper.of_node[grid.triangles].ravel(), np.repeat(lower.of_triangle, 3)], axis=1)
    else:
        slopes = np.stack([np.repeat(upper.of_triangle, 3), lower.of_node[grid.triangles].ravel()], axis=1)
    return np.concatenate([slopes, verticals])


def _cells(grid: Grid, layer: _Layer) -> list[np.ndarray]:
    """Return the panels of a layer under the triangles.

    One around each inner node, and where there are nodes under the boundary those between it and the others.
    """
    following: dict[tuple[int, int], tuple[int, int]] = {}  # node and its next corner: the triangle, the corner after
    for number, corners in enumerate(grid.triangles.tolist()):
        for k in range(3):
            following[corners[k], corners[(k + 1) % 3]] = number, corners[(k + 2) % 3]
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
        while (step := following.get((node, corner))) is not None:  # each turn takes another triangle of the node
            around.append(int(layer.of_triangle[step[0]]))
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


def _nearest_triangle(grid: Grid) -> np.ndarray:
    """Return (V,) the triangle of each node whose middle is nearest to it."""
    middles = grid.nodes[grid.triangles].mean(axis=1)
    node, triangle = grid.triangles.ravel(), np.repeat(np.arange(len(grid.triangles)), 3)
    apart = np.linalg.norm(grid.nodes[node] - middles[triangle], axis=1)
    order = np.lexsort((triangle, apart, node))
    found, begin = np.unique(node[order], return_index=True)
    nearest = np.zeros(len(grid.nodes), np.int64)
    nearest[found] = triangle[order[begin]]
    return nearest
