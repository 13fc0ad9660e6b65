"""Double layers: a second layer under a grid, along its smoothed normals, and the webs between."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from ..grid.grid import Grid
from ..grid.marks import node_marks
from .clearance import close_pairs

SECOND_LAYERS = ("dual", "same")  #: nodes under the triangles, or under the nodes
DEPTH_WAYS = ("normal", "vertical")  #: along which the depth is measured
TOP, BOTTOM, WEB = "top", "bottom", "web"  #: groups of members
LEAST_CHORD = (
    0.25  #: of a chord of the second layer, measured along the first, over the length there; shorter is refused
)
LEAST_GAP = 0.5  #: of the distance between both layers, measured along the normal of a triangle, over the depth
CROSSED = 0.01  #: distance of two members that cross, over the mean length of the first layer
PLACES_NAMED = 4  #: in a refusal


@dataclass(frozen=True, eq=False)
class DoubleLayer:
    """Two layers and their webs; the nodes and members of the grid come first, as they were."""

    nodes: np.ndarray  #: (V + W, 3) of the grid, then of the second layer [unit of the grid]
    members: np.ndarray  #: (M, 2) int64: top, then bottom, then web
    normals: np.ndarray  #: (V + W, 3) smoothed unit normals of the nodes
    groups: dict[str, np.ndarray]  #: TOP, BOTTOM and WEB: ids of their members
    under: np.ndarray  #: (V,) int64 the node of the second layer that is nearest to each node of the grid


def double_layer(grid: Grid, depth: float, *, second: str = "dual", along: str = "normal") -> DoubleLayer:
    """Return a grid as the outer of two layers, `depth` apart.

    Parameters
    ----------
    grid : Grid
        Its normals point away from the second layer.
    depth : float
        From the nodes of the grid, or the middles of its triangles, to the second layer [unit of the grid].
    second : str
        "same": a node under each node, joined by a vertical; each member of the grid has one under it, and a diagonal from its lower
        node on the grid to the node under its higher one. The members cut the space into tetrahedra. "dual": a node under each
        triangle, joined with its corners and with the nodes under its neighbours; edges are tapered.
    along : str
        "normal", along the smoothed normals, or "vertical", along z.

    Raises
    ------
    InputError
        The grid is no oriented manifold, the depth is not positive, or the grid bends more sharply than it allows: the places are named.
    """
    for value, known, what in ((second, SECOND_LAYERS, "second layer"), (along, DEPTH_WAYS, "way of the depth")):
        if value not in known:
            raise InputError(f"the {what} must be {' or '.join(known)}, got {value!r}")
    if not (0 < depth < math.inf):
        raise InputError(f"the depth of a double layer must be positive, got {depth!r}")
    if grid.panels is not None:
        raise InputError(
            f"a double layer needs a grid of triangles, and this one has {grid.panels_are}; make it with --cells triangle"
        )
    if len(grid.triangles) == 0 or not (grid.topology.manifold and grid.topology.orientable):
        raise InputError("a double layer needs a manifold, oriented grid with triangles")
    triangles, count = grid.triangles, len(grid.nodes)
    normals = smoothed_normals(grid)
    down = -normals if along == "normal" else np.tile([0.0, 0.0, -1.0], (count, 1))
    areas = np.cross(*(grid.nodes[triangles[:, k]] - grid.nodes[triangles[:, 0]] for k in (1, 2)))
    level = -(down[triangles].mean(axis=1) * areas).sum(axis=1) / np.linalg.norm(areas, axis=1)
    _refuse(grid, triangles[level < LEAST_GAP].ravel(), depth, f"both layers are less than {LEAST_GAP:g} of it apart")
    if second == "same":
        below = grid.nodes + depth * down
        over, chords = np.arange(count), grid.edges
        heights = np.lexsort((np.arange(count), grid.nodes[:, 2]))
        rank = np.empty(count, np.int64)
        rank[heights] = np.arange(count)
        lower = rank[grid.edges].argmin(axis=1)
        rows = np.arange(len(chords))
        diagonals = np.stack([grid.edges[rows, lower], grid.edges[rows, 1 - lower] + count], axis=1)
        webs = np.concatenate([np.stack([over, over + count], axis=1)[np.isin(over, triangles)], diagonals])
        first, below_normals = grid.nodes, normals
    else:
        first, below_normals = grid.nodes[triangles].mean(axis=1), _unit(normals[triangles].mean(axis=1))
        below = first + depth * _unit(down[triangles].mean(axis=1))
        chords = grid.edge_triangles[grid.edge_triangles[:, 1] >= 0]
        webs = np.stack([triangles.ravel(), np.repeat(np.arange(len(triangles)), 3) + count], axis=1)
    step, under_step = (places[chords[:, 1]] - places[chords[:, 0]] for places in (first, below))
    turned = (step * under_step).sum(axis=1) < LEAST_CHORD * (step**2).sum(axis=1)
    at = chords[turned] if second == "same" else triangles[chords[turned]]
    _refuse(grid, at.ravel(), depth, "the second layer would fold")
    nodes = np.concatenate([grid.nodes, below])
    members = np.concatenate([grid.edges, chords + count, webs])
    pairs, _ = close_pairs(nodes, members, CROSSED * float(grid.lengths.mean()))
    ends = members[pairs].ravel()
    _refuse(grid, ends[ends < count], depth, "members of both layers would cross")
    starts = np.cumsum([0, len(grid.edges), len(chords), len(webs)]).tolist()
    return DoubleLayer(
        nodes=nodes,
        members=members,
        normals=np.concatenate([normals, below_normals]),
        groups={name: np.arange(*starts[k : k + 2]) for k, name in enumerate((TOP, BOTTOM, WEB))},
        under=_under(grid, first, second) + count,
    )


def smoothed_normals(grid: Grid) -> np.ndarray:
    """Return (V, 3) unit normals of the nodes: those of the triangles by their angles, then the mean with those of all neighbours."""
    corners = grid.nodes[grid.triangles]
    normal = _unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    at = np.zeros_like(grid.nodes, float)
    for k in range(3):
        np.add.at(at, grid.triangles[:, k], normal * grid.angles[:, [k]])
    at = _unit(at)
    smooth, neighbors = np.zeros_like(at), np.zeros((len(at), 1))
    for one, other in (grid.edges.T, grid.edges[:, ::-1].T):
        np.add.at(smooth, one, at[other])
        np.add.at(neighbors, one, 1.0)
    return _unit(at + smooth / np.maximum(neighbors, 1.0))


def _under(grid: Grid, first: np.ndarray, second: str) -> np.ndarray:
    """Return (V,) the node of the second layer under each node: its own, or that of the triangle whose middle is nearest."""
    count = len(grid.nodes)
    if second == "same":
        return np.arange(count)
    node, triangle = grid.triangles.ravel(), np.repeat(np.arange(len(grid.triangles)), 3)
    apart = np.linalg.norm(grid.nodes[node] - first[triangle], axis=1)
    order = np.lexsort((triangle, apart, node))
    found, begin = np.unique(node[order], return_index=True)
    under = np.zeros(count, np.int64)
    under[found] = triangle[order[begin]]
    return under


def _refuse(grid: Grid, nodes: np.ndarray, depth: float, why: str) -> None:
    """Refuse a depth that the places at some nodes do not allow, if there are any."""
    if len(nodes) == 0:
        return
    found = np.unique(nodes)
    marks = node_marks(grid)
    named = "; ".join(
        f"{marks[node]} ({', '.join(f'{c:.5g}' for c in grid.scan_nodes[node])})" for node in found[:PLACES_NAMED]
    )
    more = f" and {len(found) - PLACES_NAMED:,} more" if len(found) > PLACES_NAMED else ""
    raise InputError(
        f"a depth of {depth:.4g}{' ' + grid.unit if grid.unit else ''} is too much where the grid bends: {why} at {named}{more};"
        " use a smaller depth"
    )


def _unit(vectors: np.ndarray) -> np.ndarray:
    """Return vectors of length 1; those without length stay as they are."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0)
