"""The network of lines: where they meet the boundary and each other, and the stretches between."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise

import numpy as np

from ..kernels.boundary.curves import Curves, at_arc, nearest_on_curves

MEETING_DISTANCE = 0.3  # a line this close to the boundary or another line meets it [member lengths]
# the same distance for the end of a line; an end that stands out farther is more than a stub [member lengths]
AT_END = 0.5
# a line that stays close for longer than this runs alongside, and that part is left out [member lengths]
ALONGSIDE_WITHIN = 1.2
ONE_STOP = 0.6  # corners and meetings closer together than this are one [member lengths]
FADE_LENGTH = 0.6  # length over which a line is bent towards a meeting [member lengths]


@dataclass(frozen=True, eq=False)
class WholeLine:
    """A fixed line or ridge as a whole, parts included that run along the boundary or another line."""

    name: str
    ridge: bool
    points: np.ndarray  #: (K, 3) on the scan
    closed: bool


@dataclass(frozen=True, eq=False)
class Lines:
    """Curves of which each becomes a chain of members from stop to stop."""

    stops: np.ndarray  #: (P, 3) ends, corners and meetings of the lines: each becomes a node
    on_loop: np.ndarray  #: (P,) int64 boundary loop on which a stop lies, -1: inside
    curves: tuple[np.ndarray, ...]  #: (K, 3) each, on the scan
    ends: np.ndarray  #: (S, 2) int64 stops at the ends of each curve, -1 for a ring without stops
    sharp: np.ndarray  #: (S,) bool, a ridge: the local surface would round it off
    along: tuple[np.ndarray, ...] = ()  #: (K, 3) each, parts of lines that run along the boundary or another line
    whole: tuple[WholeLine, ...] = ()  #: all lines, fixed ones first

    @cached_property
    def arrays(self) -> Curves:
        """The curves as arrays for the kernels; all are open but rings without stops."""
        return curves_of(self.curves, [bool(first < 0) for first, _ in self.ends])

    def stops_on(self, loop: int) -> np.ndarray:
        """Stops (K, 3) on a boundary loop."""
        found: np.ndarray = self.stops[self.on_loop == loop]
        return found


NO_LINES = Lines(np.zeros((0, 3)), np.zeros(0, np.int64), (), np.zeros((0, 2), np.int64), np.zeros(0, np.bool_))


def curves_of(curves: Sequence[np.ndarray], closed: Sequence[bool]) -> Curves:
    """Return polylines as arrays for the kernels; see `kernels.boundary.curves.Curves`."""
    arcs = [np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(c, axis=0), axis=1))]) for c in curves]
    back = [float(np.linalg.norm(c[0] - c[-1])) if ring else 0.0 for c, ring in zip(curves, closed, strict=True)]
    return Curves(
        np.ascontiguousarray(np.concatenate([np.zeros((0, 3)), *curves])),
        np.concatenate([np.zeros(0), *arcs]),
        np.cumsum([0, *(len(c) for c in curves)]).astype(np.int64),
        np.array([arc[-1] + more for arc, more in zip(arcs, back, strict=True)], float),
    )


@dataclass(eq=False)
class Track:
    """A boundary loop or a line with the stops on it."""

    points: np.ndarray  #: (K, 3)
    closed: bool
    loop: int = -1  #: number of the boundary loop, -1: a line
    sharp: bool = False
    stops: list[tuple[float, int]] = field(default_factory=list)  #: arc length and number of each stop

    def __post_init__(self) -> None:
        """Prepare the look-up of the nearest place."""
        self.arrays = curves_of([self.points], [self.closed])
        self.total = float(self.arrays.total[0])

    def nearest(self, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Distance (M,) of places from the track and the arc length (M,) there."""
        found = [nearest_on_curves(self.arrays, *place) for place in places.tolist()]
        return np.array([f[2] for f in found]), np.array([f[1] for f in found])

    def gap(self, a: float, b: float) -> float:
        """Arc length between two places."""
        away = abs(a - b)
        return min(away, self.total - away) if self.closed else away


class Network:
    """Lines put together one after the other; later ones are bent to earlier ones where they meet."""

    def __init__(self, loops: Sequence[tuple[np.ndarray, np.ndarray]], length: float) -> None:
        """Begin with the boundary loops: their points (K, 3), and which of these are corners."""
        self.length = length
        self.places: list[np.ndarray] = []
        self.tracks: list[Track] = []
        self.along: list[np.ndarray] = []
        self.whole: list[WholeLine] = []
        # stops at ends and corners of parts of fixed lines that run along the boundary
        self.ends_along: set[int] = set()
        for number, (points, corners) in enumerate(loops):
            track = Track(points, True, number)
            for i in corners.tolist():
                track.stops.append((float(track.arrays.arc[i]), self._new_stop(points[i])))
            self.tracks.append(track)

    def add(
        self,
        points: np.ndarray,
        closed: bool,
        corners: Sequence[int],
        *,
        name: str = "",
        sharp: bool = False,
        meets: Sequence[int] = (),
    ) -> None:
        """Add a line.

        Parameters
        ----------
        points : (M, 3), on the scan, in small steps; the first of a closed line is not repeated
        corners : points of it that become nodes, the sharpest first
        name : of the set of its nodes
        sharp : whether it is a ridge
        meets : its ends, 0 the first and -1 the last, in which other lines end: corners that no line beside them takes up
        """
        marks = {int(i) for i in corners}
        order = list(dict.fromkeys(int(i) for i in corners))
        if not closed:
            points, shift = self._lengthened(points, meets)
            marks, order = {i + shift for i in marks}, [i + shift for i in order]
        near = [track.nearest(points) for track in self.tracks]
        if closed and near:
            far = int(np.argmax(np.min([distance for distance, _ in near], axis=0)))
            points = np.roll(points, -far, axis=0)
            near = [(np.roll(distance, -far), np.roll(arc, -far)) for distance, arc in near]
            order = [(i - far) % len(points) for i in order]
        self.whole.append(WholeLine(name, sharp, points, closed))
        joints, dropped = self._joints(self.whole[-1], near, order)
        if closed and not joints:
            if not near or min(float(distance.max()) for distance, _ in near) > MEETING_DISTANCE * self.length:
                self._add_track(points, True, order, [], sharp)
            return
        for begin, end in self._pieces(points, closed, joints):
            if not any(low <= begin[0] and end[0] <= high for low, high in dropped):
                self._add_piece(points, begin, end, order, sharp)

    def lines(self) -> Lines:
        """The lines so far, cut at all stops."""
        curves, ends, sharp = [], [], []
        for track in self.tracks:
            if track.loop < 0:
                for curve, first, last in self._cut(track):
                    curves.append(curve)
                    ends.append((first, last))
                    sharp.append(track.sharp)
        on_loop = np.full(len(self.places), -1, np.int64)
        for track in self.tracks:
            if track.loop >= 0:
                on_loop[[stop for _, stop in track.stops]] = track.loop
        used = np.array(sorted({stop for pair in ends for stop in pair if stop >= 0} | self.ends_along), np.int64)
        number = np.full(len(self.places) + 1, -1, np.int64)
        number[used] = np.arange(len(used))
        return Lines(
            np.array(self.places, float).reshape(-1, 3)[used],
            on_loop[used],
            tuple(curves),
            number[np.array(ends, np.int64).reshape(-1, 2)],
            np.array(sharp, np.bool_),
            tuple(self.along),
            tuple(self.whole),
        )

    def _new_stop(self, place: np.ndarray) -> int:
        self.places.append(np.array(place, float))
        return len(self.places) - 1

    def _stop_on(self, track: Track, arc: float) -> int:
        """The stop at an arc length of a track: one that is there already, or a new one."""
        gaps = [(track.gap(arc, at), stop) for at, stop in track.stops]
        if gaps and min(gaps)[0] < ONE_STOP * self.length:
            return min(gaps)[1]
        arc, *place = at_arc(track.arrays, 0, float(arc))
        track.stops.append((arc, self._new_stop(np.array(place))))
        return track.stops[-1][1]

    def _lengthened(self, points: np.ndarray, meets: Sequence[int]) -> tuple[np.ndarray, int]:
        """A line with its ends led to what they nearly reach, corners only to the boundary; how many points were put before it."""
        shift = 0
        for at in (0, -1):
            best, foot = np.inf, points[at]
            for track in self.tracks:
                if at in meets and track.loop < 0:
                    continue
                distance, arc = track.nearest(points[at][None])
                if distance[0] < best:
                    best, foot = float(distance[0]), np.array(at_arc(track.arrays, 0, float(arc[0]))[1:])
            if MEETING_DISTANCE * self.length <= best <= AT_END * self.length:
                points = np.concatenate([foot[None], points] if at == 0 else [points, foot[None]])
                shift += at == 0
        return points, shift

    def _joints(
        self, line: WholeLine, near: list[tuple[np.ndarray, np.ndarray]], corners: Sequence[int]
    ) -> tuple[list[tuple[int, int]], set[tuple[int, int]]]:
        """Where a line meets tracks: (point, stop) in order; and between which such points it runs along one.

        corners : points of the line that become nodes; those of a fixed line, and its ends, also where it runs along the boundary
        """
        points, arc = line.points, _arc(line.points)
        found: list[tuple[float, int, int]] = []
        dropped = set()
        for track, (distance, foot) in zip(self.tracks, near, strict=True):
            for begin, end in runs(distance < MEETING_DISTANCE * self.length):
                whole = end - begin == len(points)
                if arc[end - 1] - arc[begin] <= ALONGSIDE_WITHIN * self.length and not whole:
                    at = begin + int(distance[begin:end].argmin())
                    found.append((float(distance[at]), at, self._stop_on(track, foot[at])))
                    continue
                ring = line.closed and whole
                ends = [] if ring else [begin, end - 1]
                turns = [] if line.ridge else [i for i in corners if begin <= i < end]
                stops = {at: self._stop_on(track, foot[at]) for at in (*ends, *turns)}
                if track.loop >= 0 and not line.ridge:
                    self.ends_along.update(stops.values())
                self.along.append(np.concatenate([points, points[:1]]) if ring else points[begin:end])
                if not ring:
                    found += [(-1.0, at, stops[at]) for at in ends]
                    dropped.add((begin, end - 1))
        kept: list[tuple[int, int]] = []
        for _, at, stop in sorted(found):
            if all(
                abs(arc[at] - arc[other]) > (1.0 if stop == taken else 0.5 * ONE_STOP) * self.length
                for other, taken in kept
            ):
                kept.append((at, stop))
        return sorted(kept), dropped

    def _pieces(
        self, points: np.ndarray, closed: bool, joints: list[tuple[int, int]]
    ) -> list[tuple[tuple[int, int], tuple[int, int]]]:
        """Parts of a line from joint to joint, and its free ends where they are more than stubs."""
        arc = _arc(points)
        pieces = list(pairwise(joints))
        if closed:
            return [*pieces, (joints[-1], (joints[0][0] + len(points), joints[0][1]))]
        first, last = (joints[0][0], joints[-1][0]) if joints else (len(points) - 1, 0)
        if not joints:
            return [((0, -1), (len(points) - 1, -1))]
        if arc[first] > AT_END * self.length:
            pieces.insert(0, ((0, -1), joints[0]))
        if arc[-1] - arc[last] > AT_END * self.length:
            pieces.append((joints[-1], (len(points) - 1, -1)))
        return pieces

    def _add_piece(
        self, points: np.ndarray, begin: tuple[int, int], end: tuple[int, int], order: list[int], sharp: bool
    ) -> None:
        """Add a part of a line from one (point, stop) to another; stop -1 is a free end."""
        at = np.arange(begin[0], end[0] + 1) % len(points)
        part = points[at].copy()
        size = float(_arc(part)[-1])
        if len(part) < 2 or size < (2.0 if begin[1] == end[1] >= 0 else 0.25) * self.length:
            return
        ends = [self._new_stop(part[k]) if stop < 0 else stop for k, stop in ((0, begin[1]), (-1, end[1]))]
        arc = _arc(part)
        for k, stop in ((0, ends[0]), (-1, ends[1])):
            share = np.clip(1.0 - np.abs(arc - arc[k]) / (FADE_LENGTH * self.length), 0.0, 1.0)
            part += share[:, None] * (self.places[stop] - part[k])
        place_of = {int(i): k for k, i in enumerate(at.tolist())}
        self._add_track(part, False, [place_of[i] for i in order if i in place_of], ends, sharp)

    def _add_track(self, points: np.ndarray, closed: bool, corners: list[int], ends: list[int], sharp: bool) -> None:
        """Add a line that meets nothing but at its ends (two stops); corners too near to ends and others are left out."""
        track = Track(points, closed, sharp=sharp)
        track.stops = list(zip((0.0, track.total), ends, strict=False))
        for i in corners:
            arc = float(track.arrays.arc[i])
            if all(track.gap(arc, at) >= ONE_STOP * self.length for at, _ in track.stops):
                track.stops.append((arc, self._new_stop(points[i])))
        self.tracks.append(track)

    def _cut(self, track: Track) -> list[tuple[np.ndarray, int, int]]:
        """The stretches of a line between its stops."""
        stops = sorted(track.stops)
        if not stops:
            return [(track.points, -1, -1)]
        pairs = list(pairwise(stops))
        if track.closed:
            pairs.append((stops[-1], (stops[0][0] + track.total, stops[0][1])))
        arcs = track.arrays.arc
        found = []
        for (low, first), (high, last) in pairs:
            inner = np.flatnonzero((arcs > low + 1e-9 * track.total) & (arcs < high - 1e-9 * track.total))
            if track.closed and high > track.total:
                again = np.flatnonzero(arcs + track.total < high - 1e-9 * track.total)
                inner = np.concatenate([inner, again])
            parts = [self.places[first][None], track.points[inner], self.places[last][None]]
            found.append((np.concatenate(parts), first, last))
        return found


def _arc(points: np.ndarray) -> np.ndarray:
    """Arc length (M,) of each point of an open polyline from its start."""
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])


def runs(marked: np.ndarray) -> list[tuple[int, int]]:
    """Return first and one past the last index of each run of marked places (K,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], marked, [False]]).astype(np.int8)))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]
