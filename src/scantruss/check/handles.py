"""Handles of a grid that its scan does not have: struts between sheets that it does not join, and tunnels through what is closed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..boundary.polylines import well_within
from ..errors import words_of_number
from ..grid.certificate import Fault, place_of
from .limits import PLACES_KEPT, ROUNDED_BY
from .missed import points_wanted

if TYPE_CHECKING:
    from ..grid.certificate import Certificate
    from ..grid.grid import Grid
    from ..surface.samples import SurfaceSamples

LONGEST_RING = 12  # members around a handle, up to which it is looked at
BESIDE_RING = 0.5  # samples that lie so near to the members of a ring are of the scan around it [member lengths]
# what a ring around a strut between two sheets has at least: how far they face each other, and the cosine of its axis and the way
# from one to the other; around limbs and handles of the scan the first is negative, -0.7 to -1
FACE_EACH_OTHER, ALONG_WAY = 0.4, 0.7
# samples of a sheet on either side within a ring, near its plane and facing it, from which on it is around a joint of two sheets
WITHIN_RING, FEWEST_OF_SHEET = 0.6, 3  # [member lengths]
OFF_RING, FACES_RING = 0.3, 0.7  # distance from the ring from which on they are within it [member lengths], and cosine
# points away from the grid across a tunnel, no deeper in it than this, cover what of it is so near to one [member lengths]; it is
# closed where they cover more than a share of its inner half, which the walls of a narrower tunnel leave free
DEEP_IN_TUNNEL, STEP_ACROSS, COVERS_AROUND, INNER_PART, COVERED_ACROSS = 1.5, 0.1, 0.2, 0.5, 0.75
STRUTS_APART = 2.0  # rings whose middles are nearer to each other are around one strut, or tunnel [member lengths]


def false_handles(
    grid: Grid, samples: SurfaceSamples, off: np.ndarray, found: Certificate, length: float
) -> list[Fault]:
    """Return a fault where a grid has struts that its scan does not have, and one where it has such tunnels.

    Around a limb or a handle of the scan its normals point away from the limb. Around a strut between two sheets that only lie near
    each other, as two legs do, they point along it, those of each sheet towards the other. So they may do, aslope, in a short tunnel;
    there the grid faces the axis of the ring. Across a tunnel of the scan there are no points but of other pieces; where there are,
    as on the floor of a blind hole that is thinner than the samples tell apart, the grid leaves it out.

    Parameters
    ----------
    off : (N,) float64
        Distance of each point from the grid [member lengths].
    found : of the grid, with how many handles it has
    length : desired member length [scan unit]
    """
    struts: list[np.ndarray] = []
    tunnels: list[np.ndarray] = []
    count, away = found.handles or 0, samples.scan[points_wanted(samples) & (off > ROUNDED_BY)]
    for ring in rings_around_handles(grid) if count else []:
        known = struts if faces_outwards(grid, ring) else tunnels
        if len(known) == count or _is_beside(ring, known, grid, STRUTS_APART * length):
            continue
        places = grid.nodes[ring]
        is_strut = known is struts and is_around_strut(places, samples, length)
        is_tunnel = known is tunnels and share_covered(places, away, length) > COVERED_ACROSS
        if is_strut or is_tunnel:
            known.append(ring)
    joins, opens = "joins parts of the scan that face each other by a strut", "has a tunnel where the scan is closed,"
    return [*_fault("strut", joins, struts, grid), *_fault("tunnel", opens, tunnels, grid)]


def is_around_strut(ring: np.ndarray, samples: SurfaceSamples, length: float) -> bool:
    """Whether a ring (K, 3) is around a strut between sheets of a scan."""
    facing, cosine = sheets_beside(ring, samples, length)
    return (facing > FACE_EACH_OTHER and cosine > ALONG_WAY) or has_sheets_within(ring, samples, length)


def _is_beside(ring: np.ndarray, known: list[np.ndarray], grid: Grid, apart: float) -> bool:
    """Whether a ring (K,) of nodes lies where one of those known does, or shares a node with it."""
    middle = grid.nodes[ring].mean(axis=0)
    return any(
        np.isin(ring, other).any() or np.linalg.norm(middle - grid.nodes[other].mean(axis=0)) < apart for other in known
    )


def _fault(kind: str, words: str, rings: list[np.ndarray], grid: Grid) -> list[Fault]:
    """Return the fault of some rings, of the first its girth; nothing of none."""
    if not rings:
        return []
    around = float(np.linalg.norm(grid.nodes[rings[0]] - grid.nodes[np.roll(rings[0], 1)], axis=1).sum())
    unit, more = f" {grid.unit}" if grid.unit else "", f" ({len(rings)} such places)" if len(rings) > 1 else ""
    at, *also = (place_of(grid.nodes[ring].mean(axis=0) + grid.origin) for ring in rings[:PLACES_KEPT])
    return [Fault(kind, f"{words} {words_of_number(around, 3)}{unit} around{more}", at, tuple(also))]


def share_covered(ring: np.ndarray, away: np.ndarray, length: float) -> float:
    """Return how much of the inner half of a ring (K, 3) has points before or behind it that are away from the grid (N, 3)."""
    from scipy.spatial import cKDTree

    middle = ring.mean(axis=0)
    near = away - middle
    near = near[(near**2).sum(axis=1) < (np.linalg.norm(ring - middle, axis=1).max() + length) ** 2]
    axis = _axis(ring)
    across = np.linalg.svd(axis[None])[2][1:]
    radius = INNER_PART * float(np.linalg.norm(ring - middle, axis=1).mean())
    steps = np.arange(-radius, radius, STEP_ACROSS * length)
    places = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    places = places[np.hypot(*places.T) < radius]
    near = near[np.abs(near @ axis) < DEEP_IN_TUNNEL * length] @ across.T
    if not len(places) or not len(near):
        return 0.0
    return float((cKDTree(near).query(places)[0] < COVERS_AROUND * length).mean())


def _edge(ring: np.ndarray, across: np.ndarray) -> np.ndarray:
    """Return a ring (K, 3) seen along its axis, with the middles of its members (2K, 2)."""
    edge = (ring - ring.mean(axis=0)) @ across.T
    return np.concatenate([edge, 0.5 * (edge + np.roll(edge, -1, axis=0))], axis=1).reshape(-1, 2)


def faces_outwards(grid: Grid, ring: np.ndarray) -> bool:
    """Whether a grid faces away from the axis of a ring of nodes (K,), as around a limb or a strut, not towards it, as in a tunnel."""
    own = grid.nodes[grid.triangles[np.isin(grid.triangles, ring).any(axis=1)]]
    areas = np.cross(own[:, 1] - own[:, 0], own[:, 2] - own[:, 0])
    axis = _axis(grid.nodes[ring])
    away = own.mean(axis=1) - grid.nodes[ring].mean(axis=0)
    away -= np.outer(away @ axis, axis)
    away /= np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-300)
    return bool((areas * away).sum() > 0.0)


def sheets_beside(ring: np.ndarray, samples: SurfaceSamples, length: float) -> tuple[float, float]:
    """Return how far the scan around a ring (K, 3) is two sheets that face each other, and the ring around the way between them.

    Of the direction in which most of its normals lie: how far what lies on either side of the ring in it faces the ring, the less
    of both, from -1 to 1; and the cosine between it and the axis of the ring.
    """
    axis, near, away = _around(ring, samples, length)
    places = np.concatenate([ring, 0.5 * (ring + np.roll(ring, -1, axis=0))])
    gaps = ((samples.surface.mean[near, None] - places) ** 2).sum(axis=2).min(axis=1, initial=np.inf)
    beside = gaps < (BESIDE_RING * length) ** 2
    if not beside.any():
        return 0.0, 0.0
    normals = samples.surface.normals[near[beside]]
    directions = np.linalg.eigh(normals.T @ normals)[1]
    across = directions[:, -1]
    heights, facing = away[beside] @ across, normals @ across
    sides = [facing[heights < 0.0], -facing[heights > 0.0]]
    least = min(float(side.sum() / max(np.abs(side).sum(), 1e-300)) for side in sides)
    return least, abs(float(axis @ across))


def has_sheets_within(ring: np.ndarray, samples: SurfaceSamples, length: float) -> bool:
    """Whether the scan has a sheet on either side within a ring (K, 3) that faces the other: around a limb nothing of it lies there."""
    axis, near, away = _around(ring, samples, length)
    height = away @ axis
    faces = -samples.surface.normals[near] @ axis * np.sign(height) > FACES_RING
    faces &= np.abs(height) < WITHIN_RING * length
    across = np.linalg.svd(axis[None])[2][1:]
    edge = _edge(ring, across)
    sides = height[faces][well_within(away[faces] @ across.T, edge, OFF_RING * length)] > 0.0
    return bool(min(sides.sum(), (~sides).sum()) >= FEWEST_OF_SHEET)


def _around(ring: np.ndarray, samples: SurfaceSamples, length: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the axis (3,) of a ring (K, 3), the samples (N,) around or within it, and their places from its middle (N, 3)."""
    middle = ring.mean(axis=0)
    away = samples.surface.mean - middle
    near = np.flatnonzero((away**2).sum(axis=1) < (np.linalg.norm(ring - middle, axis=1).max() + length) ** 2)
    return _axis(ring), near, away[near]


def _axis(ring: np.ndarray) -> np.ndarray:
    """Return the axis (3,) of a ring (K, 3)."""
    off = ring - ring.mean(axis=0)
    axis = np.cross(off, np.roll(off, -1, axis=0)).sum(axis=0)
    return np.asarray(axis / max(float(np.linalg.norm(axis)), 1e-300))


def rings_around_handles(grid: Grid) -> list[np.ndarray]:
    """Return rings of at most `LONGEST_RING` members that no part of the grid lies within, the shortest first, each its nodes (K,).

    Each crosses a cut. From each node at one the shortest is found by going outwards: two ways to the ends of a member that cross other
    cuts close such a ring.
    """
    cuts = cuts_of_members(grid)
    if not any(cuts):
        return []
    beside: list[list[tuple[int, int]]] = [[] for _ in grid.nodes]
    for (one, other), cut in zip(grid.edges.tolist(), cuts, strict=True):
        beside[one].append((other, cut))
        beside[other].append((one, cut))
    found: dict[frozenset[int], list[int]] = {}
    for root in np.unique(grid.edges[np.array(cuts) != 0]).tolist():
        ring = _shortest_ring(root, beside)
        if ring:
            found.setdefault(frozenset(ring), ring)
    return [np.array(ring) for ring in sorted(found.values(), key=lambda ring: (len(ring), ring))]


def _shortest_ring(root: int, beside: list[list[tuple[int, int]]]) -> list[int]:
    """Return the nodes of the shortest ring through a node that crosses the cuts an odd number of times; none if it is too long."""
    before, crossed, layer = {root: -1}, {root: 0}, [root]
    for _ in range(LONGEST_RING // 2):
        after: list[int] = []
        for node in layer:
            for other, cut in beside[node]:
                through = crossed[node] ^ cut
                if other not in crossed:
                    before[other], crossed[other] = node, through
                    after.append(other)
                elif crossed[other] != through:
                    one, two = _way(node, before), _way(other, before)
                    return one[::-1] + two[:-1] if len(set(one) & set(two)) == 1 else []
        layer = after
    return []


def _way(node: int, before: dict[int, int]) -> list[int]:
    """Return the nodes from one back to the root."""
    way = [node]
    while before[way[-1]] >= 0:  # ends at the root: each node was reached after the one before it
        way.append(before[way[-1]])
    return way


def cuts_of_members(grid: Grid) -> list[int]:
    """Return by which of the cuts that open all handles each member is crossed (E,), a bit for each cut.

    Members outside of a tree of members, and of a tree of triangles across the others, are two for each handle; with the tree of
    triangles each closes a cut. Boundary loops count as closed: each is one more face.
    """
    faces = grid.edge_triangles.copy()
    count, of_node = len(grid.triangles), {}
    for number, loop in enumerate(grid.boundary_loops):
        of_node.update({int(node): count + number for node in loop})
    outer = np.flatnonzero(faces[:, 1] < 0)
    faces[outer, 1] = [of_node[int(node)] for node in grid.edges[outer, 0]]
    in_tree, _ = _tree(grid.edges, np.ones(len(grid.edges), bool), len(grid.nodes))
    across, parents = _tree(faces, ~in_tree, count + len(grid.boundary_loops))
    cuts = [0] * len(grid.edges)
    for bit, member in enumerate(np.flatnonzero(~in_tree & ~across).tolist()):
        ways: list[set[int]] = []
        for face in faces[member].tolist():
            way, at = set(), face
            while parents[at][0] >= 0:  # ends at the root of the tree
                at, edge = parents[at]
                way.add(edge)
            ways.append(way)
        for edge in (ways[0] ^ ways[1]) | {member}:
            cuts[edge] |= 1 << bit
    return cuts


def _tree(ends: np.ndarray, allowed: np.ndarray, count: int) -> tuple[np.ndarray, list[tuple[int, int]]]:
    """Return which links (E, 2) a breadth-first tree takes of those allowed (E,), and parent and link of each of `count` things."""
    beside: list[list[tuple[int, int]]] = [[] for _ in range(count)]
    for number in np.flatnonzero(allowed).tolist():
        one, other = ends[number].tolist()
        beside[one].append((other, number))
        beside[other].append((one, number))
    taken, parents, seen = np.zeros(len(ends), bool), [(-1, -1)] * count, [False] * count
    for root in range(count):
        if seen[root]:
            continue
        seen[root], layer = True, [root]
        for at in layer:  # grows; each is put in once
            for other, number in beside[at]:
                if not seen[other]:
                    seen[other], taken[number], parents[other] = True, True, (at, number)
                    layer.append(other)
    return taken, parents
