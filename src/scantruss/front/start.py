"""The initial front: boundary loops, lines, candidate nodes, and a seed triangle where there is no boundary (Sec. 3.3)."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from ..boundary.find import Boundary, characteristic_points
from ..constraints.embedded_lines import add_half_edges, chain_places, check_links, link_around
from ..constraints.find import Constraints
from ..constraints.network import Lines
from ..kernels.front import front as lists
from ..kernels.front.candidate_nodes import CandidateNodes, add_candidate_nodes, add_still_nodes
from ..kernels.geometry import boxes as boxing
from ..kernels.geometry.boxes import new_boxes
from ..kernels.geometry.triangles import quality
from ..kernels.mesh.point_location import nearest_sample
from ..kernels.surface.local_surface import (
    SURFACE_PATCH,
    Surface,
    fit_patch,
    onto_patch,
    patch_normal,
    walk,
)
from ..kernels.surface.ridges import mean_normal
from ..runtime.jit import new_record
from ..settings import Settings
from ..surface.near_scan import local_field
from ..surface.pieces import TRIANGLE_AREA
from ..surface.samples import SurfaceSamples
from .orientation_field import nodes_at

FRONT_CLEARANCE = 0.6  # least distance of a candidate node from the initial front [member lengths]
FIXED_CLEARANCE = 0.33  # least distance of a fixed position from the initial front [member lengths]
SIDE_REACH = 0.6  # how far the sides of a ridge are looked at [member lengths]
# size d_B of the search boxes of the nodes (Eq. 1): as far as one step of the front looks [member lengths]
NODE_BOX = 2.4
MORE_NODES = 2000  # nodes that there is room for at first beyond twice those of regular triangles
# a seed of candidate nodes: how many of the nearest are tried, how far they may be [member lengths], how they must face, and how
# good the triangle must be
SEED_NODES, SEED_REACH, SEED_FACING, SEED_QUALITY = 12, 2.0, 0.5, 0.8


def new_front(samples: SurfaceSamples, settings: Settings) -> lists.Front:
    """Return an empty front with room for the cloud."""
    mean = samples.surface.mean
    room = int(2.0 * samples.graded_area / (TRIANGLE_AREA * settings.length**2)) + MORE_NODES
    usual = settings.length * float(np.sqrt(samples.area / samples.graded_area))
    boxes = new_boxes(mean.min(axis=0), mean.max(axis=0), NODE_BOX * usual, room, room)
    return _blank(room, settings.sharp_edges, boxes)


def _blank(room: int, sharp_edges: bool, boxes: boxing.SearchBoxes) -> lists.Front:
    def ids(*shape: int) -> np.ndarray:
        return np.full(shape, -1, np.int64)

    return lists.Front(
        np.zeros((room, 3)), np.zeros((room, 3)), ids(room), np.zeros(room, np.bool_), ids(room),
        ids(4 * room), ids(4 * room), ids(4 * room), ids(4 * room), np.zeros(4 * room, np.int64), ids(4 * room),
        ids(2 * room, 3), ids(room), ids(6 * room), ids(4 * room),
        new_record(lists.FRONT_COUNTS), sharp_edges, boxes,
    )  # fmt: skip


def grown(front: lists.Front) -> lists.Front:
    """Return the same front with arrays twice as large."""
    old = front.boxes
    room = 2 * len(front.nodes)
    boxes = new_boxes(old.lower, old.lower + old.size * (old.counts - 1), float(old.size.max()), room, room)
    larger = _blank(room, front.sharp_edges, boxes)
    for name in lists.Front._fields[: lists.Front._fields.index("queue")]:
        kept = getattr(front, name)
        getattr(larger, name)[: len(kept)] = kept
    waiting = front.queue[np.arange(front.counts.first, front.counts.last) % len(front.queue)]
    larger.queue[: len(waiting)] = waiting
    for name in ("nodes", "segments", "triangles"):
        larger.counts[name] = front.counts[name]
    larger.counts.last = len(waiting)
    for n in range(int(front.counts.nodes)):
        if front.sample[n] >= 0:  # the others were merged away
            boxing.put(boxes, n, *larger.nodes[n])
    return larger


def start_front(
    front: lists.Front,
    samples: SurfaceSamples,
    boundary: Boundary,
    constraints: Constraints,
    settings: Settings,
    candidates: CandidateNodes | None = None,
) -> lists.Front:
    """Fill the lists with the initial front: boundary loops, lines, candidate nodes, a seed triangle on closed pieces."""
    surface = samples.surface
    for loop in boundary.loops:
        active = loop.external or loop.cut != "" or settings.advance_from == "all"
        nodes, _ = characteristic_points(loop, settings.length)
        curves = np.array(add_nodes(front, surface, nodes), np.int64)
        lists.add_chain(front, curves, lists.ACTIVE if active else lists.INACTIVE)
    add_lines(front, surface, constraints.lines, settings)
    check_links(front, samples.origin)
    for place in constraints.positions if settings.method != "paper" else ():
        length = settings.length * local_field(surface, place)
        front = add_candidates(front, surface, nodes_at(place[None], surface, length), FIXED_CLEARANCE * length)
    if candidates is not None:
        front = add_candidates(front, surface, candidates, FRONT_CLEARANCE * settings.length)
    bounded = {loop.piece for loop in boundary.loops}
    bounded |= {int(samples.piece[nearest_sample(surface, *curve[0].tolist())]) for curve in constraints.lines.curves}
    for number in samples.pieces:
        if number not in bounded:
            sample = int(np.flatnonzero(samples.piece == number)[0])
            length = settings.length * local_field(surface, surface.mean[sample])
            ids = seed_of_candidates(front, surface, sample, length)
            add_seed(front, ids or new_seed(front, surface, sample, length))
    return front


def add_candidates(front: lists.Front, surface: Surface, nodes: CandidateNodes, clear: float) -> lists.Front:
    """Add candidate nodes to a front, which grows until there is room for them."""
    while int(front.counts.nodes) + len(nodes.places) + 2 > len(front.nodes):
        front = grown(front)
    add_candidate_nodes(front, surface, nodes, clear)
    return front


def add_lines(front: lists.Front, surface: Surface, lines: Lines, settings: Settings) -> None:
    """Add the lines to a front that holds the boundary loops."""
    if not lines.curves:
        return
    count = int(front.counts.nodes)
    at_stop = {}
    for stop, place in enumerate(lines.stops):
        if lines.on_loop[stop] >= 0:
            at_stop[stop] = int(((front.nodes[:count] - place) ** 2).sum(axis=1).argmin())
        else:
            at_stop[stop] = add_nodes(front, surface, place[None])[0]
    node_stop = {node: stop for stop, node in at_stop.items()}
    heads = front.head[: front.counts.segments].tolist()
    curves = zip(front.tail[: len(heads)].tolist(), heads, strict=True)
    beside = ((node_stop[a], node_stop[b]) for a, b in curves if a in node_stop and b in node_stop)
    taken = {(min(pair), max(pair)) for pair in beside}
    chains = []
    divided = chain_places(lines, surface, settings.length, taken)
    for places, (first, last), sharp in zip(divided, lines.ends.tolist(), lines.sharp.tolist(), strict=True):
        middle = add_nodes(front, surface, places)
        chain = [at_stop[first], *middle, at_stop[last]] if first >= 0 else [*middle, middle[0]]
        add_half_edges(front, chain)
        chains.append(chain)
        if sharp:
            face_both_sides(front, surface, chain, settings.length)
    for node in sorted({node for chain in chains for node in chain}):
        link_around(front, node)


def face_both_sides(front: lists.Front, surface: Surface, nodes: list[int], length: float) -> None:
    """Let nodes on a ridge face as the surface does on all of its sides together: a patch there follows one of them only."""
    for node in nodes:
        x, y, z = front.nodes[node].tolist()
        reach = SIDE_REACH * length * float(surface.field[front.sample[node]])
        front.normals[node] = mean_normal(surface, int(front.sample[node]), (x, y, z), reach)[0]


def add_nodes(front: lists.Front, surface: Surface, nodes: np.ndarray) -> list[int]:
    """Add fixed nodes (K, 3) of the boundary or of lines, each near the one before; returns their numbers."""
    first = add_still_nodes(front, surface, np.ascontiguousarray(nodes))
    return list(range(first, first + len(nodes)))


def add_seed(front: lists.Front, ids: list[int]) -> None:
    """Add a seed triangle of three nodes, and the front around it."""
    lists.add_triangle(front, *ids)
    lists.add_chain(front, np.array([ids[1], ids[0], ids[2]]), lists.ACTIVE)


def seed_of_candidates(front: lists.Front, surface: Surface, sample: int, length: float) -> list[int]:
    """Return three candidate nodes near a sample that make a good triangle; none where there are no such three."""
    count = int(front.counts.nodes)
    free = np.flatnonzero(front.out[:count] < 0)
    away = np.linalg.norm(front.nodes[free] - surface.mean[sample], axis=1)
    near = free[np.argsort(away, kind="stable")[:SEED_NODES]]
    near = near[
        (front.normals[near] @ surface.normals[sample] > SEED_FACING)
        & (np.sort(away)[: len(near)] < SEED_REACH * length)
    ]
    best, ids = SEED_QUALITY, []
    for a, b, c in combinations(near.tolist(), 3):
        pa, pb, pc = (tuple(front.nodes[q].tolist()) for q in (a, b, c))
        value = quality(pa, pb, pc, length, 0.5, 0.5)
        if value > best:
            turned = np.dot(np.cross(np.subtract(pb, pa), np.subtract(pc, pa)), surface.normals[sample]) < 0
            best, ids = value, [a, c, b] if turned else [a, b, c]
    return ids


def new_seed(front: lists.Front, surface: Surface, sample: int, length: float) -> list[int]:
    """Add three nodes of a regular triangle around a sample."""
    patch = new_record(SURFACE_PATCH)
    centre = surface.mean[sample]
    fit_patch(surface, patch, sample, tuple(centre))
    normal = patch.normal.copy()
    towards = surface.mean[surface.neighbors[sample, 0]] - centre
    u = towards - normal * (towards @ normal)
    u /= np.linalg.norm(u)
    v = np.cross(normal, u)
    ids = []
    for angle in np.radians([0.0, 120.0, 240.0]):
        place = centre + length / np.sqrt(3.0) * (np.cos(angle) * u + np.sin(angle) * v)
        own = new_record(SURFACE_PATCH)
        fit_patch(surface, own, sample, tuple(place))
        foot = onto_patch(own, tuple(place))
        near = walk(surface, own.sample, foot)
        ids.append(lists.propose_node(front, foot, patch_normal(own, foot), near, False))
        lists.add_node(front)
    return ids
