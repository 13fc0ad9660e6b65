"""Orientation field and position field of the surface: candidate nodes on a lattice for the front (Jakob et al. 2015)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

from ..boundary.find import Boundary, Loop, characteristic_points
from ..errors import InputError, words_of_place
from ..kernels.front.candidate_nodes import CandidateNodes
from ..kernels.geometry.vectors import Vector
from ..kernels.surface import orientation_field as kernels
from ..kernels.surface.local_surface import Surface
from ..kernels.surface.orientation_field import Level
from ..runtime.parallel import side_by_side, two_at_once
from ..scan.vectors import dots
from ..settings import Settings
from ..surface.samples import SurfaceSamples

LEVEL_SPACING = 0.55  # distance between the samples of the finest level [member lengths]
LEVEL_RATIO = 2.0  # ratio of the distances from one level to the next
FEWEST_SAMPLES_OF_A_LEVEL = 12  # fewest samples of the coarsest level
LINKS_IN_A_LEVEL = 12  # most links of a sample to its neighbours
SMOOTHING_PASSES = 3  # passes of smoothing on each level
SAMPLES_FOR_THREADS = 5000  # fewest samples of a level that two threads smooth at once
CANDIDATE_REACH = 0.7  # candidate nodes farther from their sample than this are dropped [member lengths]
# lattice spacing on a closed surface, where the search adds nodes and never removes any [member lengths]
CLOSED_SPACING = 1.02
LEAST_ALONG = 0.1  # least part of an arrow along the scan [its length]
CANDIDATE_DISTANCE = 0.6  # least distance between candidate nodes [member lengths]


@dataclass(frozen=True)
class FieldStart:
    """How the candidate nodes of one front are laid out."""

    turn: float = 0.0  #: angle of the lattice to the longest side of the boundary, where it starts [degree]
    scale: float = 1.0  #: spacing of the lattice, in desired lengths
    laid: bool = True  #: False: no lattice, the front makes all of its nodes itself


STARTS_OF_EFFORTS = {  # lattice directions of the fronts, by effort
    "quick": (FieldStart(),),
    "normal": tuple(FieldStart(10.0 * turn) for turn in range(6)),
    "best": tuple(FieldStart(5.0 * turn, scale) for scale in (1.0, 1.02) for turn in range(12)),
}
SCALES_OF_EFFORTS = {  # lengths of the fronts instead, where the desired length varies over the scan and no lattice fits
    "quick": (1.0,),
    "normal": (1.0, 0.97, 1.03),
    "best": (1.0, 0.97, 1.03, 0.94, 1.06, 0.985, 1.015, 0.955, 1.045),
}
# largest area for which `normal` tries all directions: there the boundary decides [member lengths squared]
SMALL_AREA = 600.0


class Field(NamedTuple):
    """The candidate nodes of one front, and how they were laid out."""

    start: FieldStart
    nodes: CandidateNodes | None  #: on the lattice; None if the front makes all of its nodes itself


class Hierarchy(NamedTuple):
    """The multiresolution hierarchy of a scan, from fine to coarse; see `make_levels`."""

    levels: list[Level]
    owners: list[np.ndarray]  #: for each level the sample of each place of the level below (samples at first)
    independent_sets: list[tuple[np.ndarray, ...]]  #: samples of each level that are smoothed at once

    def copy(self) -> Hierarchy:
        """Return a copy whose directions and lattices can be changed."""
        own = [p._replace(direction=p.direction.copy(), node=p.node.copy(), mark=p.mark.copy()) for p in self.levels]
        return self._replace(levels=own)


def usual_starts(samples: SurfaceSamples, settings: Settings) -> tuple[FieldStart, ...]:
    """Return the layouts of the fronts, as many as the effort allows."""
    if settings.method == "paper":
        return (FieldStart(laid=False),)
    if settings.rows_along:
        return tuple(start for start in STARTS_OF_EFFORTS[settings.effort] if start.turn == 0.0)
    if samples.graded:
        return tuple(FieldStart(scale=scale, laid=False) for scale in SCALES_OF_EFFORTS[settings.effort])
    large = samples.graded_area > SMALL_AREA * settings.length**2
    return STARTS_OF_EFFORTS[settings.effort][: 1 if settings.effort == "normal" and large else None]


def orientation_fields(
    samples: SurfaceSamples, boundary: Boundary, settings: Settings, starts: Sequence[FieldStart] | None = None
) -> list[Field]:
    """Return the candidate nodes of each front, from an orientation field and a position field (Jakob et al. 2015).

    Both fields are smoothed over a hierarchy of levels from coarse to fine, starting at the boundary.

    Parameters
    ----------
    samples : SurfaceSamples
        The surface samples of the scan.
    boundary : Boundary
    settings : Settings
        `length`; `effort` decides how many fields there are.
    starts : sequence of FieldStart, optional
        How they are laid out; by default as the effort allows.
    """
    starts = usual_starts(samples, settings) if starts is None else starts
    closed = 1.0 if boundary.loops else CLOSED_SPACING
    scales = {start.scale for start in starts if start.laid}
    hierarchies = {scale: make_levels(samples.surface, closed * scale * settings.length) for scale in scales}

    def field_of(start: FieldStart) -> Field:
        if not start.laid:
            return Field(start, None)
        length, arrow = closed * start.scale * settings.length, settings.rows_along
        begin = lattice_along(samples, arrow) if arrow else lattice_start(samples, boundary, length, start.turn)
        return Field(start, orientation_field(hierarchies[start.scale].copy(), begin, length))

    return list(side_by_side(*(partial(field_of, start) for start in starts)))


LatticeStart = tuple[int, Vector, Vector]  # sample, direction and node from which a lattice is laid out


def orientation_field(hierarchy: Hierarchy, begin: LatticeStart, length: float) -> CandidateNodes:
    """Return the nodes of a lattice of a spacing [scan unit], laid out from a sample."""
    levels, owners, independent_sets = hierarchy
    start, direction, node = begin
    for owner in owners:
        start = int(owner[start])
    kernels.lay_first(levels[-1], start, direction, node, length, np.empty(len(levels[-1].mean), np.int64))
    for smooth in (_smooth_directions, kernels.smooth_lattice):
        for k in range(len(levels) - 1, -1, -1):
            if k < len(levels) - 1:
                kernels.hand_down(levels[k + 1], owners[k + 1], levels[k], length)
            for _ in range(SMOOTHING_PASSES):
                two_at_once(partial(smooth, levels[k], length), independent_sets[k])
    return _chosen(levels[0], owners[0], length)


def _smooth_directions(level: Level, _: float, some: np.ndarray) -> None:
    kernels.smooth_directions(level, some)


def _chosen(level: Level, owner: np.ndarray, length: float) -> CandidateNodes:
    """Lattice nodes of the finest samples, each once, those nearest to their samples first."""
    away = ((level.node - level.mean) ** 2).sum(axis=1)
    order = np.argsort(away, kind="stable")
    order = order[away[order] < (CANDIDATE_REACH * length) ** 2]
    chosen = np.empty(len(away), np.int64)
    chosen = chosen[: kernels.list_nodes(level, order, length, CANDIDATE_DISTANCE * length, chosen)]
    first = np.empty(len(away), np.int64)
    first[owner[::-1]] = np.arange(len(owner) - 1, -1, -1)
    return CandidateNodes(level.node[chosen], level.normals[chosen], first[chosen], length)


def make_levels(surface: Surface, length: float) -> Hierarchy:
    """Return the samples of a surface for members of a length [scan unit], level by level from fine to coarse."""
    mean, normals, neighbors = surface.mean, surface.normals, surface.neighbors
    levels: list[Level] = []
    owners: list[np.ndarray] = []
    radius = LEVEL_SPACING * length
    while True:
        owner, chosen = np.full(len(mean), -1, np.int64), np.empty(len(mean), np.int64)
        count = kernels.choose_level(mean, neighbors, radius, owner, chosen)
        if levels and (count < FEWEST_SAMPLES_OF_A_LEVEL or count > 0.8 * len(mean)):
            return Hierarchy(levels, owners, [_independent_sets(level) for level in levels])
        level = Level(
            np.zeros((count, 3)), np.zeros((count, 3)), np.full((count, LINKS_IN_A_LEVEL), -1, np.int64),
            np.zeros((count, 3)), np.zeros((count, 3)), np.zeros(count, np.int64),
        )  # fmt: skip
        kernels.link_level(mean, normals, neighbors, owner, level)
        levels.append(level)
        owners.append(owner)
        mean, normals, neighbors = level.mean, level.normals, level.neighbors
        radius *= LEVEL_RATIO


def _independent_sets(level: Level) -> tuple[np.ndarray, ...]:
    """Two sets of samples that threads may smooth at once, and those between, which depend on both; few are not divided."""
    count = len(level.mean)
    if count < SAMPLES_FOR_THREADS:
        return (np.arange(count),)
    away, queue = np.empty((2, count), np.int64), np.empty(count, np.int64)
    end = kernels.links_away(level.neighbors, 0, away[0], queue)  # by the links, not by how the scan is placed
    kernels.links_away(level.neighbors, kernels.links_away(level.neighbors, end, away[0], queue), away[1], queue)
    ahead = away[0] - away[1]
    late = ahead > np.median(ahead)
    across = (level.neighbors >= 0) & (late[level.neighbors] != late[:, None])
    between = across.any(axis=1)
    between[level.neighbors[across]] = True
    return np.flatnonzero(~late & ~between), np.flatnonzero(late & ~between), np.flatnonzero(between)


def lattice_along(samples: SurfaceSamples, arrow: Sequence[float]) -> LatticeStart:
    """Return the start of a lattice whose rows run along an arrow, a place and a direction in the frame of the scan.

    Raises
    ------
    InputError
        The place lies off the scan, or the arrow is square to it.
    """
    surface = samples.surface
    arm = surface.mean - (np.array(arrow[:3]) - samples.origin)
    away = dots(arm, arm)
    sample = int(away.argmin())
    if away[sample] > surface.length**2:
        raise InputError(f"the arrow of rows_along begins off the scan, at {words_of_place(arrow[:3])}")
    ahead, normal = np.array(arrow[3:]) / np.linalg.norm(arrow[3:]), surface.normals[sample]
    ahead = ahead - normal * (ahead @ normal)
    if np.linalg.norm(ahead) < LEAST_ALONG:
        raise InputError("the arrow of rows_along is square to the scan; give a direction along it")
    return sample, (*ahead.tolist(),), (*surface.mean[sample].tolist(),)


def lattice_start(samples: SurfaceSamples, boundary: Boundary, length: float, turn: float) -> LatticeStart:
    """Return the sample, the direction and the node where the lattice starts: in the middle of the longest side of the boundary.

    On a closed surface it starts anywhere.
    """
    surface = samples.surface
    if not boundary.loops:
        sample = int(np.flatnonzero(samples.piece == samples.pieces[0])[0])
        ahead, place = surface.mean[max(surface.neighbors[sample, 0], 0)] - surface.mean[sample], surface.mean[sample]
    else:
        loop, at = longest_side(boundary.loops)
        count = len(loop.points)
        nodes, _ = characteristic_points(loop, length)
        middle = loop.points[at]
        place = nodes[((nodes - middle) ** 2).sum(axis=1).argmin()]
        half = min(round(length / np.linalg.norm(loop.points[(at + 1) % count] - middle)), count // 4)
        ahead = loop.points[(at + half) % count] - loop.points[at - half]
        arm = surface.mean - place
        sample = int(dots(arm, arm).argmin())
    normal = surface.normals[sample]
    ahead = ahead - normal * (ahead @ normal)
    angle = np.radians(turn)
    ahead = np.cos(angle) * ahead + np.sin(angle) * np.cross(normal, ahead)
    return sample, (*ahead.tolist(),), (*place.tolist(),)


def longest_side(loops: tuple[Loop, ...]) -> tuple[Loop, int]:
    """Return the loop that has the longest side between two corners, and the point in the middle of that side."""
    best, found = -1.0, (loops[0], 0)
    for loop in loops:
        ends = loop.corner_at if len(loop.corner_at) else np.zeros(1, np.int64)
        sides = np.diff(ends, append=ends[:1] + len(loop.points))
        longest = int(sides.argmax())
        share = loop.length * sides[longest] / len(loop.points)
        if share > best:
            best, found = share, (loop, int(ends[longest] + sides[longest] // 2) % len(loop.points))
    return found


def nodes_at(positions: np.ndarray, surface: Surface, length: float) -> CandidateNodes:
    """Return candidate nodes at fixed positions (K, 3) [scan unit]; those far from the scan are left out."""
    samples = np.array([((surface.mean - place) ** 2).sum(axis=1).argmin() for place in positions], np.int64)
    near = np.linalg.norm(surface.mean[samples] - positions, axis=1) < length
    return CandidateNodes(np.ascontiguousarray(positions[near]), surface.normals[samples[near]], samples[near], length)
