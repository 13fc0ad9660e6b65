"""Boundary of a point cloud: ordered loops, corners and the characteristic points on them (Sec. 3.3, 3.6)."""

from __future__ import annotations

import weakref
from dataclasses import dataclass, field, replace

import numpy as np

from ..errors import LengthError
from ..kernels.boundary import room as kernels
from ..kernels.boundary.curves import Curves
from ..kernels.mesh.point_location import nearest_sample
from ..kernels.surface.local_surface import Surface, walk
from ..kernels.surface.size_field import lengths_along
from ..runtime.progress import Progress
from ..scan.normals import check_two_sided
from ..settings import Settings
from ..surface.samples import SurfaceSamples, broad_normals, is_graded, samples_with
from .corners import CURVE_STEP
from .curves import area_within, length_around, resample
from .density import disc_beside
from .given import cut_along
from .holes import fill_holes
from .offset import NO_BIAS, NO_TIPS, SamplingBias, offset_curve, sampling_bias_of
from .parts import parted
from .rolling_disc import loops_of_samples
from .spikes import without_spikes
from .touched_points import boundary_points
from .tube_ends import end_of_tube
from .which_holes import is_covered, is_hole, named_holes

LEAST_OPEN_SHARE = 0.6  # share of a loop that must have room for a disc outside
# distance from a ring where a limb was cut off within which a loop of the scan is that ring [member lengths]
AT_RING = 0.6
# a hole where no more points than this are expected is random in a scan of random points, and closed up to so many times the usual length
POINTS_OF_RANDOM_HOLE, LARGER_IF_RANDOM = 24.0, 1.25
SPARSE_PART = 0.9  # quantile of the distance of the edge from the points, along a loop, that is said


@dataclass(frozen=True, eq=False)
class Loop:
    """One boundary loop, the surface to its left."""

    points: np.ndarray  #: (M, 3) smoothed closed curve, relative to the cloud's origin
    corner_at: np.ndarray  #: (C,) int64, points of the curve that are corners
    external: bool  #: the outer boundary of its piece; False: a hole
    length: float  #: [scan unit]
    piece: int  #: number of the piece of the cloud it bounds
    desired: np.ndarray | None = None  #: (M,) desired length at each point, in lengths; None if it is the same for all
    line_at: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))  #: points of the curve where lines end
    cut: str = ""  #: close or open where a limb was cut off, as the settings say
    #: how far the edge of the surface lies beyond the outermost points on the mean where they are sparse [scan unit], and where that is
    beyond: float = 0.0
    sparse_at: int = 0

    @property
    def corners(self) -> np.ndarray:
        """(C, 3) the corners."""
        return self.points[self.corner_at]

    @property
    def stop_at(self) -> np.ndarray:
        """(S,) int64, points of the curve that become nodes and stay: corners and ends of lines."""
        return np.union1d(self.corner_at, self.line_at) if len(self.line_at) else self.corner_at


@dataclass(frozen=True, eq=False)
class Boundary:
    """All boundary loops of a cloud."""

    loops: tuple[Loop, ...]
    bridged: tuple[np.ndarray, ...] = ()  #: (M, 3) closed curves around holes so small that the front runs over them

    def __repr__(self) -> str:
        """Say how long the loops are, and which are holes."""
        loops = [f"{loop.length:.4g}{'' if loop.external else ' (hole)'}" for loop in self.loops]
        return f"Boundary({len(loops)} loops{': ' + ', '.join(loops) if loops else ''})"

    @property
    def external(self) -> tuple[Loop, ...]:
        """The outer boundaries."""
        return tuple(loop for loop in self.loops if loop.external)

    @property
    def internal(self) -> tuple[Loop, ...]:
        """The boundaries of holes."""
        return tuple(loop for loop in self.loops if not loop.external)

    @property
    def corners(self) -> np.ndarray:
        """(C, 3) the corners of all loops."""
        return np.concatenate([np.zeros((0, 3)), *(loop.corners for loop in self.loops)])

    @property
    def stops(self) -> np.ndarray:
        """(S, 3) the places on all loops that become nodes and stay: corners and ends of lines."""
        return np.concatenate([np.zeros((0, 3)), *(loop.points[loop.stop_at] for loop in self.loops)])

    @property
    def curves(self) -> Curves:
        """The curves of all loops as arrays for the kernels."""
        points = [loop.points for loop in self.loops]
        steps = [np.linalg.norm(np.roll(p, -1, axis=0) - p, axis=1) for p in points]
        arcs = [np.concatenate([[0.0], np.cumsum(s)[:-1]]) for s in steps]
        start = np.cumsum([0, *(len(p) for p in points)]).astype(np.int64)
        return Curves(
            np.concatenate([np.zeros((0, 3)), *points]),
            np.concatenate([np.zeros(0), *arcs]),
            start,
            np.array([s.sum() for s in steps], float),
        )


_Found = tuple[Settings, SurfaceSamples | None, Boundary]
_KEPT: weakref.WeakKeyDictionary[SurfaceSamples, _Found] = weakref.WeakKeyDictionary()


def find_boundary(
    samples: SurfaceSamples, settings: Settings, *, progress: Progress | None = None
) -> tuple[SurfaceSamples, Boundary]:
    """Return the ordered boundary loops of a scan (Sec. 3.3), and its samples with small holes closed (Sec. 3.6).

    The last result is cached for as long as the samples exist.

    Parameters
    ----------
    samples : SurfaceSamples
        The surface samples of the scan.
    settings : Settings
        `boundary_radius` (disc rolled along the boundary), `corner_angle`, `fill_holes`, `length`; `boundary`, given in its place.
    progress : callable, optional
        Called with ("boundary", share); may raise to stop.

    Returns
    -------
    samples : SurfaceSamples
        Those given, with generated ones over the holes that are closed.
    boundary : Boundary
        External loops first, each piece's longest loop being external; empty for a closed surface.

    Raises
    ------
    LengthError
        The scan falls apart into pieces that are all smaller than a member.
    """
    if samples.area == 0.0:
        raise LengthError(f"each piece of the scan is smaller than length {settings.length:g}; use a shorter one")
    kept = _KEPT.get(samples)
    if kept is None or kept[0] != settings:
        came_with_scan = samples.given is not None and not settings.thin_walls
        thickness = np.where(samples.kept, samples.thickness, np.inf)  # a piece that gets no grid may be one-sided
        check_two_sided(samples.surface, thickness, with_normals=came_with_scan)
        if progress:
            progress("boundary", 0.4)
        filled, boundary = (_given if settings.boundary else _close_holes)(samples, settings)
        if settings.method == "default":
            if not settings.boundary:
                filled, boundary = _parted(filled, boundary)
            boundary = _with_tube_ends(boundary, filled, settings)
        boundary = replace(boundary, loops=(*boundary.loops, *_rings(filled, settings)))
        # the value must not keep its key alive
        kept = _KEPT[samples] = (settings, filled if filled is not samples else None, boundary)
    if progress:
        progress("boundary", 1.0)
    return kept[1] or samples, kept[2]


def _close_holes(samples: SurfaceSamples, settings: Settings) -> tuple[SurfaceSamples, Boundary]:
    """Return samples with small holes closed, and the boundary that is left."""
    found, bridged = _find_loops(samples, settings)
    loops = _external_first(found)
    named = named_holes(settings.fill_at, loops, samples, settings.length)
    holes = [
        loop
        for k, loop in enumerate(loops)
        if k in named or (loop.length < settings.closed_boundary_length and is_hole(loop, samples))
    ]
    if holes:
        made_up = fill_holes(samples, [loop.points for loop in holes])
        samples = samples_with(samples, made_up, settings)
        found, bridged = _find_loops(samples, settings)
        loops = _external_first([loop for loop in found if not _over_filling(loop.points, samples)])
        bridged = [curve for curve in bridged if not _over_filling(curve, samples)]
    return samples, Boundary(loops, tuple(bridged))


def _parted(samples: SurfaceSamples, boundary: Boundary) -> tuple[SurfaceSamples, Boundary]:
    """Return samples with the pieces that a boundary parts, and that boundary, each part with an outer loop."""
    parts = parted(samples, [loop.points for loop in boundary.loops])
    if parts is samples:
        return samples, boundary
    first = [loop.points[0].tolist() for loop in boundary.loops]
    pieces = [int(parts.piece[nearest_sample(parts.surface, *place)]) for place in first]
    loops = [replace(loop, piece=piece) for loop, piece in zip(boundary.loops, pieces, strict=True)]
    return parts, replace(boundary, loops=_external_first([loop for loop in loops if loop.piece in parts.pieces]))


def _given(samples: SurfaceSamples, settings: Settings) -> tuple[SurfaceSamples, Boundary]:
    """Return the samples inside the boundary that the user gives, with the other holes of the scan closed, and that boundary."""
    scanned = [(loop.points, loop.piece) for loop in _external_first(_find_loops(samples, settings)[0])]
    inside, rings = cut_along(samples, scanned, settings)
    surface = inside.surface
    loops = [
        Loop(ring.points, ring.corner_at, ring.external, length_around(ring.points), ring.piece, field_along(surface, ring.points))
        for ring in rings
    ]  # fmt: skip
    return inside, Boundary(tuple(sorted(loops, key=lambda loop: (not loop.external, -loop.length))))


def _find_loops(samples: SurfaceSamples, settings: Settings) -> tuple[list[Loop], list[np.ndarray]]:
    """All loops except those of small gaps, none marked external yet; and the curves (M, 3) around these gaps."""
    length = settings.length
    radius = max(settings.boundary_radius * length, 1.3 * samples.surface.radius, 1.9 * samples.spacing)
    found: list[tuple[np.ndarray, int, SamplingBias, np.ndarray]] = []
    surface = samples.surface._replace(normals=broad_normals(samples.surface))
    loops, short = loops_of_samples(samples, surface, radius, 0.8 * settings.bridged_boundary_length)
    bridged = [surface.mean[loop.samples] for loop in short]
    paper = settings.method == "paper"
    disc = disc_beside(samples, surface, radius, widens=not paper)
    slid, whole = boundary_points(samples, surface, [loop.samples for loop in loops], disc, CURVE_STEP * length)
    for points, (loop, piece) in zip(slid, loops, strict=True):
        if len(points) < 3:
            continue
        if kernels.open_share(surface, samples.boxes, points, loop[0], radius) < LEAST_OPEN_SHARE:
            continue
        curve, tips = without_spikes(surface, resample(points, CURVE_STEP * length), length, keeps_tips=not paper)
        if len(curve) >= 8:
            bias = NO_BIAS if paper else sampling_bias_of(whole, points, curve, disc)
            found.append((curve, piece, bias, tips))
    found = [each for each in found if not _at_ring(each[0], samples, length)]
    bridged = [curve for curve in bridged if not _at_ring(curve, samples, length)]
    kept: list[Loop] = []
    for curve, piece, bias, tips in found:
        smoothed = smooth_loop(curve, piece, bias, settings, whole, tips)
        if smoothed is None or (not paper and is_covered(smoothed, bias.density, whole, samples.piece)):
            bridged.append(curve)
        else:
            kept.append(smoothed)
    return kept, bridged


def _at_ring(curve: np.ndarray, samples: SurfaceSamples, length: float) -> bool:
    """Whether a curve (M, 3) runs mostly along a ring where a limb was cut off."""
    for ring in samples.rings:
        away = np.linalg.norm(curve[:, None] - ring.points, axis=2).min(axis=1)
        if ring.bounds and np.median(away) < AT_RING * length:
            return True
    return False


def _rings(samples: SurfaceSamples, settings: Settings) -> list[Loop]:
    """Return the boundaries where limbs were cut off, of the pieces that get a grid."""
    loops = []
    for ring in samples.rings:
        nearest = nearest_sample(samples.surface, *ring.points[0].tolist())
        piece = int(samples.piece[nearest])
        if ring.bounds and piece in samples.pieces:
            desired = field_along(samples.surface, ring.points)
            loops.append(
                Loop(ring.points, np.zeros(0, np.int64), False, ring.girth, piece, desired, cut=settings.cut_thin)
            )
    return loops


def _with_tube_ends(boundary: Boundary, samples: SurfaceSamples, settings: Settings) -> Boundary:
    """Return a boundary with the open ends of thin tubes among its loops, closed or left open like those of limbs that were cut off."""
    surface, loops, bridged = samples.surface, list(boundary.loops), []
    for curve in boundary.bridged:
        ring = end_of_tube(surface, curve)
        if ring is not None:
            piece = int(samples.piece[nearest_sample(surface, *ring[0].tolist())])
            desired = field_along(surface, ring)
            loops.append(
                Loop(ring, np.zeros(0, np.int64), False, length_around(ring), piece, desired, cut=settings.cut_thin)
            )
        if ring is None or settings.cut_thin == "close":
            bridged.append(curve)
    return replace(boundary, loops=tuple(loops), bridged=tuple(bridged))


def _over_filling(curve: np.ndarray, samples: SurfaceSamples) -> bool:
    """Whether a curve (M, 3) runs mostly over generated samples."""
    surface, over = samples.surface, 0
    sample = nearest_sample(surface, *curve[0].tolist())
    for place in curve:
        sample = walk(surface, sample, tuple(place))
        over += sample >= samples.measured
    return over > 0.5 * len(curve)


def with_line_ends(loop: Loop, places: np.ndarray) -> Loop:
    """Return a loop with the ends of lines (K, 3) inserted among its points."""
    points, corner_at, line_at, desired = loop.points, loop.corner_at, loop.line_at, loop.desired
    for place in places:
        ahead = np.roll(points, -1, axis=0) - points
        share = ((place - points) * ahead).sum(axis=1) / np.maximum((ahead**2).sum(axis=1), 1e-300)
        share = np.clip(share, 0.0, 1.0)
        i = int(((points + share[:, None] * ahead - place) ** 2).sum(axis=1).argmin())
        if share[i] * np.linalg.norm(ahead[i]) < 1e-9 * loop.length:
            line_at = np.append(line_at, i)
        elif (1.0 - share[i]) * np.linalg.norm(ahead[i]) < 1e-9 * loop.length:
            line_at = np.append(line_at, (i + 1) % len(points))
        else:
            points = np.insert(points, i + 1, place, axis=0)
            desired = None if desired is None else np.insert(desired, i + 1, desired[i])
            corner_at, line_at = corner_at + (corner_at > i), np.append(line_at + (line_at > i), i + 1)
    return replace(loop, points=points, corner_at=corner_at, line_at=line_at.astype(np.int64), desired=desired)


def smooth_loop(
    curve: np.ndarray, piece: int, bias: SamplingBias, settings: Settings, surface: Surface, tips: np.ndarray = NO_TIPS
) -> Loop | None:
    """Make a loop of a closed curve of equal steps through boundary points, tips as of `offset_curve`; None if it is too short to keep."""
    smoothed, corner_at = offset_curve(curve, bias, settings, surface, tips)
    length, field = length_around(smoothed), field_along(surface, smoothed)
    in_lengths = length if field is None else float((_steps(smoothed) / _between(field)).sum())
    beyond, density = bias.along(surface, smoothed)
    least = settings.bridged_boundary_length
    if settings.fill_holes is None and bias.beyond > 0.0:
        random = area_within(smoothed) * float(np.median(density)) <= POINTS_OF_RANDOM_HOLE
        least *= LARGER_IF_RANDOM if random else 1.0
    if (in_lengths if settings.fill_holes is None else length) < least:
        return None
    sparse = float(np.quantile(beyond, SPARSE_PART))
    return Loop(smoothed, corner_at, False, length, piece, field, beyond=sparse, sparse_at=int(beyond.argmax()))


def field_along(surface: Surface, curve: np.ndarray) -> np.ndarray | None:
    """Return the desired length at each point of a curve (M, 3), in lengths; None if it is the same for all."""
    if not is_graded(surface):
        return None
    field = np.empty(len(curve))
    lengths_along(surface, np.ascontiguousarray(curve), field)
    return field


def _steps(curve: np.ndarray) -> np.ndarray:
    """Distance of each point of a closed curve to the next (M,)."""
    return np.linalg.norm(np.roll(curve, -1, axis=0) - curve, axis=1)


def _between(field: np.ndarray) -> np.ndarray:
    """Mean of each value along a closed curve and the next (M,)."""
    return 0.5 * (field + np.roll(field, -1))


def _external_first(loops: list[Loop]) -> tuple[Loop, ...]:
    """Mark the longest loop of each piece as external; external loops first, then by length."""
    longest: dict[int, int] = {}
    for i, loop in enumerate(loops):
        if loop.piece not in longest or loop.length > loops[longest[loop.piece]].length:
            longest[loop.piece] = i
    marked = [replace(p, external=longest[p.piece] == i) for i, p in enumerate(loops)]
    return tuple(sorted(marked, key=lambda p: (not p.external, -p.length)))


def characteristic_points(loop: Loop, length: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the characteristic points of a loop (Sec. 3.3): about `length` apart, evenly spaced between corners, corners included.

    With a length field they are evenly spaced in desired lengths: in the integral of ds / l. The ends of lines are nodes too.

    Returns
    -------
    nodes : (H, 3), at least three
    is_corner : (H,) bool, corners and ends of lines
    """
    count = len(loop.points)
    stops = loop.stop_at
    ends = stops if len(stops) else np.zeros(1, np.int64)
    least = 3 if len(ends) == 1 else (2 if len(ends) == 2 else 1)
    nodes, is_corner = [], []
    for i, begin in enumerate(ends):
        end = ends[i + 1] if i + 1 < len(ends) else ends[0] + count
        at_curve = np.arange(begin, end + 1) % count
        part = loop.points[at_curve]
        steps = np.linalg.norm(np.diff(part, axis=0), axis=1)
        if loop.desired is not None:
            steps /= 0.5 * (loop.desired[at_curve[1:]] + loop.desired[at_curve[:-1]])
        arc = np.concatenate([[0.0], np.cumsum(steps)])
        pieces = max(int(round(arc[-1] / length)), least)
        at = np.arange(pieces) * (arc[-1] / pieces)
        nodes.append(np.stack([np.interp(at, arc, part[:, c]) for c in range(3)], axis=1))
        is_corner += [len(stops) > 0] + [False] * (pieces - 1)
    return np.concatenate(nodes), np.array(is_corner, bool)
