"""The advancing front (Sec. 3.5): `advance_front` is Fig. 4; it drives the kernel, slice by slice."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..boundary.find import Boundary
from ..constraints.embedded_lines import check_kept, line_members
from ..constraints.find import Constraints
from ..grid.grid import Grid
from ..kernels.front import advance as kernels
from ..kernels.front import front as lists
from ..kernels.front import gaps
from ..kernels.front.candidate_nodes import CandidateNodes
from ..runtime.progress import Progress, seer_of
from ..runtime.watch import Watch
from ..settings import Settings
from ..surface.pieces import TRIANGLE_AREA
from ..surface.samples import SurfaceSamples
from .start import grown, new_front, start_front

# strictness of each round: a segment that found no room waits for the next, more tolerant one
STRICTNESS_OF_ROUNDS = (1.0, 0.6, 0.3, 0.0)
LARGEST_GAP = 60  # most segments of a gap that is filled; larger gaps stay open
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
        front = run_in_slices(front, samples, rules._replace(strict=strict), progress, advance)
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
    count = int(front.counts.segments)
    for s in np.flatnonzero(front.state[:count] == lists.WAITING).tolist():
        lists.enqueue(front, s)


def grid_of_front(front: lists.Front, members: np.ndarray, samples: SurfaceSamples, settings: Settings) -> Grid:
    """Return the triangles of a front as a grid; `members`: (M, 2) those of its lines, all of which must be there."""
    triangles = front.triangles[: front.counts.triangles]
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
    loop = np.empty(int(front.counts.segments) + 1, np.int64)
    for s in np.flatnonzero(front.state[: front.counts.segments] != lists.GONE).tolist():
        while front.state[s] != lists.GONE:
            count = gaps.gap_loop(front, s, loop)
            segments = loop[:count].copy()
            length = settings.length * float(samples.surface.field[front.sample[front.tail[segments]]].mean())
            unreached = (front.state[segments] == lists.INACTIVE).all()
            if unreached or count > LARGEST_GAP or not gaps.close_gap(front, segments, count, length):
                gaps.cut_out(front, segments)


def run_in_slices(
    front: lists.Front, samples: SurfaceSamples, rules: lists.Rules, progress: Progress | None, step: Callable[..., int]
) -> lists.Front:
    """Advance by slices of a kernel (`step`) until no active segment is left; arrays grow as needed."""
    expected = samples.graded_area / (TRIANGLE_AREA * rules.desired**2)
    watch, made = Watch(RUNS_OVER_ITSELF, expected, MOST_TRIANGLES_MADE), int(front.counts.triangles)
    watch.note(made, samples.origin)
    see = seer_of(progress)
    while True:  # each slice makes triangles, or the queue becomes shorter
        status = step(samples.surface, front, rules, SEGMENTS_PER_REPORT if see is None else SEGMENTS_PER_LOOK)
        if see is not None:
            nodes, triangles = front.counts.nodes, front.counts.triangles
            see(front.nodes[:nodes] + samples.origin, front.triangles[:triangles].copy())
        if progress:
            progress("front", min(float(front.counts.triangles) / max(expected, 1.0), 1.0))
        if status == lists.DONE:
            return front
        watch.note(int(front.counts.triangles) - made, front.nodes[front.counts.nodes - 1] + samples.origin)
        made = int(front.counts.triangles)
        if status == lists.FULL:
            front = grown(front)
