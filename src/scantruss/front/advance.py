"""The advancing front (Sec. 3.5): `advance_front` is Fig. 4; it drives the kernel, slice by slice."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations

import numpy as np

from ..boundary.find import Boundary, characteristic_points
from ..constraints.embedded_lines import (
    add_half_edges,
    chain_places,
    check_kept,
    check_links,
    line_members,
    link_around,
)
from ..constraints.find import Constraints
from ..constraints.network import Lines
from ..grid.grid import Grid
from ..kernels.front import advance as kernels
from ..kernels.front import front as lists
from ..kernels.front import gaps
from ..kernels.front.candidate_nodes import CandidateNodes, add_candidate_nodes, add_still_nodes
from ..kernels.geometry import boxes as boxing
from ..kernels.geometry.boxes import new_boxes
from ..kernels.geometry.triangles import quality
from ..kernels.mesh.point_location import nearest_sample
from ..kernels.surface.local_surface import (
    NEAREST_SAMPLE,
    NORMAL,
    PATCH_COLUMNS,
    Surface,
    fit_patch,
    onto_patch,
    patch_normal,
    walk,
)
from ..kernels.surface.ridges import mean_normal
from ..runtime.progress import Progress, seer_of
from ..runtime.watch import Watch
from ..settings import Settings
from ..surface.samples import SurfaceSamples, local_field
from .orientation_field import nodes_at

# strictness of each round: a segment that found no room waits for the next, more tolerant one
STRICTNESS_OF_ROUNDS = (1.0, 0.6, 0.3, 0.0)
LARGEST_GAP = 60  # most segments of a gap that is filled; larger gaps stay open
FRONT_CLEARANCE = 0.6  # least distance of a candidate node from the initial front [member lengths]
FIXED_CLEARANCE = 0.33  # least distance of a fixed position from the initial front [member lengths]
SIDE_REACH = 0.6  # how far the sides of a ridge are looked at [member lengths]
# size d_B of the search boxes of the nodes (Eq. 1): as far as one step of the front looks [member lengths]
NODE_BOX = 2.4
MOST_TRIANGLES_MADE = 4.0  # times as many triangles as the scan has room for that a front may make
RUNS_OVER_ITSELF = "the front runs over itself: the scan is too rough or too sparse for this length"
SEGMENTS_PER_LOOK = 60  # segments advanced between two looks at the front, where somebody sees it
SEGMENTS_PER_REPORT = 500  # segments advanced between two reports of progress


def advance_front(
    samples: SurfaceSamples,
    boundary: Boundary,
    constraints: Constraints,
    settings: Settings,
    candidates: CandidateNodes | None = None,
    *,
    progress: Progress | None = None,
) -> Grid:
    """Return the grid that a front leaves behind when it advances over a scan: Fig. 4, one line a step.

    Parameters
    ----------
    samples : SurfaceSamples
        The surface samples of the scan.
    boundary : Boundary
    constraints : Constraints
        Fixed nodes, fixed lines and ridges. Method "paper" makes the fixed nodes later.
    settings : Settings
    candidates : CandidateNodes, optional
        Nodes of the position field that the front may attach; without them it makes all nodes itself.
    progress : callable, optional
        Called with ("front", share); may raise to stop.
    """
    front = start_front(new_front(samples, settings), samples, boundary, constraints, settings, candidates)  # Sec. 3.3
    members = line_members(front) if constraints.lines.curves else np.zeros((0, 2), np.int64)
    rules = rules_of(samples, settings)
    for strict in STRICTNESS_OF_ROUNDS:  # Sec. 3.5: all active segments are advanced, then those that found no room
        activate_waiting(front)
        by_cases = settings.method == "paper" and strict == STRICTNESS_OF_ROUNDS[0]  # Table 1, else by quality
        advance = kernels.advance_by_cases if by_cases else kernels.advance
        front = run(front, samples, rules._replace(strict=strict), progress, advance)
    close_gaps(front, samples, settings)
    return grid_of_front(front, members, samples, settings)


def rules_of(samples: SurfaceSamples, settings: Settings) -> lists.Rules:
    """Return what the settings ask of a front, at strictness 1."""
    return lists.Rules(
        length=settings.length,
        desired=settings.length,
        graded=samples.graded,
        length_weight=settings.length_weight,
        shape_weight=settings.shape_weight,
        size_weight=settings.size_weight,
        search_range=settings.search_range * samples.spacing,
        nearness=settings.nearness,
        merge_angle=float(np.radians(settings.merge_angle)),
        quadrangle=settings.case3 == "quadrangle",
        strict=1.0,
    )


def activate_waiting(front: lists.Front) -> None:
    """Make the waiting segments of a front active again, in their order."""
    count = int(front.count[lists.SEGMENTS])
    for s in np.flatnonzero(front.state[:count] == lists.WAITING).tolist():
        lists.enqueue(front, s)


def grid_of_front(front: lists.Front, members: np.ndarray, samples: SurfaceSamples, settings: Settings) -> Grid:
    """Return the triangles of a front as a grid; `members`: (M, 2) those of its lines, all of which must be there."""
    triangles = front.triangles[: front.count[lists.TRIANGLES]]
    check_kept(members, triangles, front.nodes + samples.origin)
    used, numbered = np.unique(triangles, return_inverse=True)
    desired = settings.length * samples.surface.field[front.sample[used]] if samples.graded else None
    return Grid(
        front.nodes[used],
        numbered.reshape(-1, 3).astype(np.int64),
        np.zeros(len(used), np.bool_),
        samples.origin,
        samples.unit,
        system=samples.system,
        desired=desired,
        lines=np.searchsorted(used, members),
        settings=settings,
    )


def close_gaps(front: lists.Front, samples: SurfaceSamples, settings: Settings) -> None:
    """Fill the gaps that the front left open; those that cannot be filled become boundaries of the grid.

    Boundary loops that the front never reached are left out. Each turn takes the segments of one loop off the
    front, at least one, so it ends after no more turns than there are segments.
    """
    loop = np.empty(int(front.count[lists.SEGMENTS]) + 1, np.int64)
    for s in np.flatnonzero(front.state[: front.count[lists.SEGMENTS]] != lists.GONE).tolist():
        while front.state[s] != lists.GONE:
            count = gaps.gap_loop(front, s, loop)
            segments = loop[:count].copy()
            length = settings.length * float(samples.surface.field[front.sample[front.tail[segments]]].mean())
            unreached = (front.state[segments] == lists.INACTIVE).all()
            if unreached or count > LARGEST_GAP or not gaps.close_gap(front, segments, count, length):
                gaps.cut_out(front, segments)


def new_front(samples: SurfaceSamples, settings: Settings) -> lists.Front:
    """Return an empty front with room for the cloud."""
    mean, room = samples.surface.mean, int(2.0 * samples.graded_area / (0.433 * settings.length**2)) + 2000
    usual = settings.length * float(np.sqrt(samples.area / samples.graded_area))
    boxes = new_boxes(mean.min(axis=0), mean.max(axis=0), NODE_BOX * usual, room, room)
    return _blank(room, boxes)


def _blank(room: int, boxes: boxing.SearchBoxes) -> lists.Front:
    def ids(*shape: int) -> np.ndarray:
        return np.full(shape, -1, np.int64)

    return lists.Front(
        np.zeros((room, 3)), np.zeros((room, 3)), ids(room), np.zeros(room, np.bool_), ids(room),
        ids(4 * room), ids(4 * room), ids(4 * room), ids(4 * room), np.zeros(4 * room, np.int64), ids(4 * room),
        ids(2 * room, 3), ids(room), ids(6 * room), ids(4 * room), np.zeros(8, np.int64), boxes,
    )  # fmt: skip


def grown(front: lists.Front) -> lists.Front:
    """Return the same front with arrays twice as large."""
    old = front.boxes
    room = 2 * len(front.nodes)
    boxes = new_boxes(old.lower, old.lower + old.size * (old.counts - 1), float(old.size.max()), room, room)
    larger = _blank(room, boxes)
    for name in lists.Front._fields[:-3]:
        kept = getattr(front, name)
        getattr(larger, name)[: len(kept)] = kept
    waiting = front.queue[np.arange(front.count[lists.FIRST], front.count[lists.LAST]) % len(front.queue)]
    larger.queue[: len(waiting)] = waiting
    larger.count[:] = front.count
    larger.count[lists.FIRST], larger.count[lists.LAST] = 0, len(waiting)
    for n in range(int(front.count[lists.NODES])):
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
    front.count[lists.LOOK_AT_EDGES] = int(settings.sharp_edges)
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
    while int(front.count[lists.NODES]) + len(nodes.places) + 2 > len(front.nodes):
        front = grown(front)
    add_candidate_nodes(front, surface, nodes, clear)
    return front


def add_lines(front: lists.Front, surface: Surface, lines: Lines, settings: Settings) -> None:
    """Add the lines to a front that holds the boundary loops."""
    if not lines.curves:
        return
    count = int(front.count[lists.NODES])
    at_stop = {}
    for stop, place in enumerate(lines.stops):
        if lines.on_loop[stop] >= 0:
            at_stop[stop] = int(((front.nodes[:count] - place) ** 2).sum(axis=1).argmin())
        else:
            at_stop[stop] = add_nodes(front, surface, place[None])[0]
    node_stop = {node: stop for stop, node in at_stop.items()}
    heads = front.head[: front.count[lists.SEGMENTS]].tolist()
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
    count = int(front.count[lists.NODES])
    free = np.flatnonzero(front.out[:count] < 0)
    away = np.linalg.norm(front.nodes[free] - surface.mean[sample], axis=1)
    near = free[np.argsort(away, kind="stable")[:12]]
    near = near[(front.normals[near] @ surface.normals[sample] > 0.5) & (np.sort(away)[: len(near)] < 2.0 * length)]
    best, ids = 0.8, []
    for a, b, c in combinations(near.tolist(), 3):
        pa, pb, pc = (tuple(front.nodes[q].tolist()) for q in (a, b, c))
        value = quality(pa, pb, pc, length, 0.5, 0.5)
        if value > best:
            turned = np.dot(np.cross(np.subtract(pb, pa), np.subtract(pc, pa)), surface.normals[sample]) < 0
            best, ids = value, [a, c, b] if turned else [a, b, c]
    return ids


def new_seed(front: lists.Front, surface: Surface, sample: int, length: float) -> list[int]:
    """Add three nodes of a regular triangle around a sample."""
    patch = np.zeros(PATCH_COLUMNS)
    centre = surface.mean[sample]
    fit_patch(surface, patch, sample, tuple(centre))
    normal = patch[NORMAL : NORMAL + 3].copy()
    towards = surface.mean[surface.neighbors[sample, 0]] - centre
    u = towards - normal * (towards @ normal)
    u /= np.linalg.norm(u)
    v = np.cross(normal, u)
    ids = []
    for angle in np.radians([0.0, 120.0, 240.0]):
        place = centre + length / np.sqrt(3.0) * (np.cos(angle) * u + np.sin(angle) * v)
        own = np.zeros(PATCH_COLUMNS)
        fit_patch(surface, own, sample, tuple(place))
        foot = onto_patch(own, tuple(place))
        near = walk(surface, int(own[NEAREST_SAMPLE]), foot)
        ids.append(lists.propose_node(front, foot, patch_normal(own, foot), near, False))
        lists.add_node(front)
    return ids


def run(
    front: lists.Front, samples: SurfaceSamples, rules: lists.Rules, progress: Progress | None, step: Callable[..., int]
) -> lists.Front:
    """Advance by slices of a kernel (`step`) until no active segment is left; arrays grow as needed."""
    expected = samples.graded_area / (0.433 * rules.desired**2)
    watch, made = Watch(RUNS_OVER_ITSELF, expected, MOST_TRIANGLES_MADE), int(front.count[lists.TRIANGLES])
    watch.note(made, samples.origin)
    see = seer_of(progress)
    while True:  # each slice makes triangles, or the queue becomes shorter
        status = step(samples.surface, front, rules, SEGMENTS_PER_REPORT if see is None else SEGMENTS_PER_LOOK)
        if see is not None:
            nodes, triangles = front.count[lists.NODES], front.count[lists.TRIANGLES]
            see(front.nodes[:nodes] + samples.origin, front.triangles[:triangles].copy())
        if progress:
            progress("front", min(float(front.count[lists.TRIANGLES]) / max(expected, 1.0), 1.0))
        if status == lists.DONE:
            return front
        watch.note(int(front.count[lists.TRIANGLES]) - made, front.nodes[front.count[lists.NODES] - 1] + samples.origin)
        made = int(front.count[lists.TRIANGLES])
        if status == lists.FULL:
            front = grown(front)
