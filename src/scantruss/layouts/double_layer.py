"""Double layers and more: layers under a grid, along its smoothed normals, and the webs between."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from ..grid.grid import Grid
from ..grid.marks import node_marks
from ..scan.vectors import units
from .layer_parts import LAYER_EDGES, SECOND_LAYERS, LayerParts, layer_parts

DEPTH_WAYS = ("normal", "vertical")  #: along which the depth is measured
BEND_WAYS = ("refuse", "reduce")  #: what is done where the grid bends too sharply for the depth
TOP_MEMBERS, BOTTOM_MEMBERS, WEB_MEMBERS = "top", "bottom", "web"  #: groups of members
MOST_LAYERS = 9  #: that a grid can have
LEAST_CHORD = 0.25  #: of a chord of a lower layer, measured along the first, over the length there; shorter is refused
LEAST_GAP = 0.5  #: of the distance between two layers, measured along the normal of a triangle, over the depth
CROSSED_DISTANCE = 0.01  #: distance of two members that cross, over the mean length of the first layer
PLACES_NAMED = 4  #: in a refusal
DEPTH_SHRINKS = 0.8  #: of the depth at a node that is too deep, over that of the round before
LEAST_DEPTH_SHARE = 0.2  #: of the depth that is asked for, to which it may be reduced
STEEPEST_SHARE = 0.15  #: by which the share of the depth may change along a member


@dataclass(frozen=True, eq=False)
class Layers:
    """Which layer each node lies in, and the panels of the layers under the grid."""

    names: tuple[str, ...]  #: from the grid inwards: top, bottom; of more top, layer 2, ..., bottom
    depths: tuple[float, ...]  #: asked for, from each layer to the next [unit of the grid; m of a structure]
    of_nodes: np.ndarray  #: (V + W,) int64 number of the layer of each node
    share: np.ndarray  #: (V + W,) depth at each node over that asked for; 1 where it is not reduced
    panels: tuple[np.ndarray, ...]  #: nodes of each panel of the lower layers, anticlockwise seen from outside


@dataclass(frozen=True, eq=False)
class DoubleLayer:
    """Two layers or more and their webs; the nodes and members of the grid come first, as they were."""

    nodes: np.ndarray  #: (V + W, 3) of the grid, then of the lower layers [unit of the grid]
    members: np.ndarray  #: (M, 2) int64: the layers from the top to the bottom, then the webs
    normals: np.ndarray  #: (V + W, 3) smoothed unit normals of the nodes
    #: ids of members of TOP_MEMBERS, BOTTOM_MEMBERS and WEB_MEMBERS; of more layers "top", "layer 2", ..., "web 1", ...
    groups: dict[str, np.ndarray]
    under: np.ndarray  #: (V,) int64 the node of the last layer that is nearest to each node of the grid
    layers: Layers


def double_layer(
    grid: Grid,
    depth: float | Sequence[float],
    *,
    second: str = "dual",
    along: str = "normal",
    edges: str = "",
    bends: str = "refuse",
) -> DoubleLayer:
    """Return a grid as the outer of two layers, `depth` apart, or of more.

    Parameters
    ----------
    grid : Grid
        Its normals point away from the second layer.
    depth : float or sequence of float
        From the nodes of the grid, or the middles of its panels, to the second layer; of several from each layer to the next
        [unit of the grid].
    second : str
        "same": a node under each node, joined by a vertical; each member of the grid has one under it, and a diagonal from its lower
        node on the grid to the node under its higher one. Under triangles the members cut the space into tetrahedra. "dual": a node
        under each panel, joined with its corners and with the nodes under its neighbours; a third layer is under the grid again, and so on.
    along : str
        "normal", along the smoothed normals, or "vertical", along z.
    edges : str
        "tapered": both layers meet at the boundary; "closed": by verticals at the boundary; "" is tapered of the dual, else closed.
        Layers that are the same meet in the nodes of the boundary, but for corners of panels that have no inner node.
    bends : str
        "refuse" a depth that is too much where the grid bends, or "reduce" it there, to a fifth at least.

    Raises
    ------
    InputError
        The grid is no oriented manifold, a depth is not positive, or the grid bends more sharply than it allows: the places are named.
    """
    for value, known, what in (
        (second, SECOND_LAYERS, "second layer"),
        (along, DEPTH_WAYS, "way of the depth"),
        (edges or LAYER_EDGES[0], LAYER_EDGES, "edges of the layers"),
        (bends, BEND_WAYS, "way with sharp bends"),
    ):
        if value not in known:
            raise InputError(f"the {what} must be {' or '.join(known)}, got {value!r}")
    depths = tuple(float(each) for each in depth) if isinstance(depth, Sequence) else (float(depth),)
    for each in depths:
        if not (0 < each < math.inf):
            raise InputError(f"the depth of a double layer must be positive, got {each!r}")
    if not 1 <= len(depths) < MOST_LAYERS:
        raise InputError(f"a grid can have 2 to {MOST_LAYERS} layers, got {len(depths)} depths")
    if len(grid.triangles) == 0 or not (grid.topology.manifold and grid.topology.orientable):
        raise InputError("a double layer needs a manifold, oriented grid with panels")
    normals = smoothed_normals(grid)
    down = -normals if along == "normal" else np.tile([0.0, 0.0, -1.0], (len(grid.nodes), 1))
    _check_gap(grid, down, sum(depths))
    parts = layer_parts(grid, len(depths) + 1, second, edges or ("tapered" if second == "dual" else "closed"))
    share = np.ones(len(grid.nodes))
    while True:  # each turn lowers the share of a node to DEPTH_SHRINKS times it; ends below LEAST_DEPTH_SHARE
        nodes, shares = _places(parts, grid, down, depths, share)
        found = _too_deep(parts, grid, nodes)
        if found is None:
            break
        at, why = found
        lower = _eased(grid, np.where(np.isin(np.arange(len(share)), at), DEPTH_SHRINKS * share, share))
        if bends == "refuse" or lower.min() < LEAST_DEPTH_SHARE:
            _refuse(grid, at, sum(depths), why, share)
        share = lower
    return _named(parts, nodes, shares, normals, depths)


def _named(
    parts: LayerParts, nodes: np.ndarray, shares: np.ndarray, normals: np.ndarray, depths: tuple[float, ...]
) -> DoubleLayer:
    """Return the layers with the names of their members and nodes."""
    count = len(depths) + 1
    names = [TOP_MEMBERS, *(f"layer {number}" for number in range(2, count)), BOTTOM_MEMBERS]
    webs = [WEB_MEMBERS] if count == 2 else [f"{WEB_MEMBERS} {number}" for number in range(1, count)]
    starts = np.cumsum([0, *map(len, parts.chords), *map(len, parts.webs)]).tolist()
    groups = {name: np.arange(*starts[k : k + 2]) for k, name in enumerate([*names, *webs])}
    below = units(parts.means(normals))
    below[: len(normals)] = normals
    return DoubleLayer(
        nodes=nodes,
        members=np.concatenate([*parts.chords, *parts.webs]),
        normals=below,
        groups=groups,
        under=parts.under,
        layers=Layers(tuple(names), depths, parts.layer, shares, parts.panels),
    )


def _places(
    parts: LayerParts, grid: Grid, down: np.ndarray, depths: tuple[float, ...], share: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the nodes of all layers, and which share of the depth each has."""
    depth = np.cumsum([0.0, *depths])[parts.layer]
    shares = np.where(parts.layer > 0, parts.means(share), 1.0)
    way = units(parts.means(down))
    alone = (parts.owners >= 0).sum(axis=1) == 1
    base = np.where(alone[:, None], grid.nodes[parts.owners[:, 0]], parts.means(grid.nodes))
    way[alone] = down[parts.owners[alone, 0]]
    return base + (depth * shares)[:, None] * way, shares


def _too_deep(parts: LayerParts, grid: Grid, nodes: np.ndarray) -> tuple[np.ndarray, str] | None:
    """Return the nodes of the grid where it bends too sharply for the depth, and what would happen; None where it does not."""
    base = parts.means(grid.nodes)
    turned = []
    for chords in parts.chords[1:]:
        step, under_step = (places[chords[:, 1]] - places[chords[:, 0]] for places in (base, nodes))
        turned.append(chords[(step * under_step).sum(axis=1) < LEAST_CHORD * (step**2).sum(axis=1)])
    if len(at := np.concatenate(turned)):
        return parts.owners_of(at), "the second layer would fold" if len(turned) == 1 else "a layer would fold"
    members = np.concatenate([*parts.chords, *parts.webs])
    from .clearance import close_pairs

    pairs, _ = close_pairs(nodes, members, CROSSED_DISTANCE * float(grid.lengths.mean()))
    if len(pairs):
        ends = members[pairs].ravel()
        own = ends[ends < len(grid.nodes)]
        return (np.unique(own) if len(own) else parts.owners_of(ends)), "members of both layers would cross"
    return None


def _check_gap(grid: Grid, down: np.ndarray, depth: float) -> None:
    """Refuse a depth along directions that hardly leave the grid; less of it would be no better."""
    triangles = grid.triangles
    areas = np.cross(*(grid.nodes[triangles[:, k]] - grid.nodes[triangles[:, 0]] for k in (1, 2)))
    level = -(down[triangles].mean(axis=1) * areas).sum(axis=1) / np.linalg.norm(areas, axis=1)
    if (at := np.unique(triangles[level < LEAST_GAP])).size:
        _refuse(grid, at, depth, f"both layers are less than {LEAST_GAP:g} of it apart", np.ones(len(grid.nodes)))


def _eased(grid: Grid, share: np.ndarray) -> np.ndarray:
    """Return shares of the depth that change along no member by more than STEEPEST_SHARE, none of them greater."""
    share = share.copy()
    one, two = grid.edges.T
    for _ in range(math.ceil(1 / STEEPEST_SHARE)):  # farther no share can be lower by so much
        np.minimum.at(share, one, share[two] + STEEPEST_SHARE)
        np.minimum.at(share, two, share[one] + STEEPEST_SHARE)
    return share


def smoothed_normals(grid: Grid) -> np.ndarray:
    """Return (V, 3) unit normals of the nodes: those of the triangles by their angles, then the mean with those of all neighbours."""
    corners = grid.nodes[grid.triangles]
    normal = units(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    at = np.zeros_like(grid.nodes, float)
    for k in range(3):
        np.add.at(at, grid.triangles[:, k], normal * grid.angles[:, [k]])
    at = units(at)
    smooth, neighbors = np.zeros_like(at), np.zeros((len(at), 1))
    for one, other in (grid.edges.T, grid.edges[:, ::-1].T):
        np.add.at(smooth, one, at[other])
        np.add.at(neighbors, one, 1.0)
    return units(at + smooth / np.maximum(neighbors, 1.0))


def _refuse(grid: Grid, nodes: np.ndarray, depth: float, why: str, share: np.ndarray) -> None:
    """Refuse a depth that the places at some nodes do not allow."""
    marks = node_marks(grid)
    named = "; ".join(
        f"{marks[node]} ({', '.join(f'{c:.5g}' for c in grid.scan_nodes[node])})" for node in nodes[:PLACES_NAMED]
    )
    more = f" and {len(nodes) - PLACES_NAMED:,} more" if len(nodes) > PLACES_NAMED else ""
    unit = f" {grid.unit}" if grid.unit else ""
    reduced = f", even reduced to {depth * share.min():.3g}{unit} there," if share.min() < 1 else ""
    raise InputError(
        f"a depth of {depth:.4g}{unit}{reduced} is too much where the grid bends: {why} at {named}{more}; use a smaller depth"
    )
