"""Ridges of the scan: lines along which it is folded, sharp or rounded, and the corners in which they meet."""

from __future__ import annotations

import weakref
from collections.abc import Sequence
from functools import cached_property
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from ..boundary.curves import length_along
from ..boundary.polylines import divide_polyline
from .fixed_lines import LINE_STEP
from .fold_tracing import HALF_NARROW_LIP, Tracer
from .lines_of_folds import FOLD_STRIDE, is_lip, is_made, is_sharp, is_sure, runs_along
from .network import Network, runs
from .ridge_ends import Ridge, join_ends

if TYPE_CHECKING:
    from ..settings import Settings
    from ..surface.samples import SurfaceSamples

END_BESIDE_RIDGE = 0.35  # a weaker ridge whose end is so near to a ridge belongs to it [member lengths]
FAULT_REACH = 1.8  # distance from a fault within which ridges are given up [member lengths]
LEAST_REMAINDER = 2.0  # least length of what is left of such a ridge [member lengths]
AT_RIDGE = 0.75  # farthest that a ridge passes a place that names it [member lengths]
ACUTE_RIDGE = np.radians(85.0)  # median fold from which on a ridge is acute
ONE_CORNER = 0.1  # distance of the ends of ridges within which they end in one corner [member lengths]
LONGEST_BETWEEN_CORNERS = 1.8  # longest ridge that is looked for between two corners [member lengths]
OVER_OPENING = 0.75  # step of a ridge above which it goes on behind an opening [member lengths]
SHORTEST_RIDGE = 0.35  # shortest such ridge [member lengths]


class FoldLines:
    """The lines of folds of a scan."""

    def __init__(self, samples: SurfaceSamples, settings: Settings) -> None:
        self.asked = _asked(settings)
        self.length = settings.length
        self._tracer = Tracer(samples, settings)
        self.narrow = self._tracer.trace()  #: each (K,) FOLD, folded within less than a member
        self._ridges: dict[tuple[int, ...], tuple[Ridge, ...]] = {}

    @cached_property
    def _all_wide(self) -> list[np.ndarray]:
        return self._tracer.trace_wide(self.narrow)

    @cached_property
    def lips(self) -> list[np.ndarray]:
        """The lips of thin bodies, each (K,) FOLD: one line stands for both of their edges."""
        return [folds for folds in self._all_wide if self._is_made_lip(folds) and not self._has_edges(folds)]

    @cached_property
    def wide(self) -> list[np.ndarray]:
        """Other folds that turn over nearly a member, each (K,) FOLD."""
        return [folds for folds in self._all_wide if not self._is_made_lip(folds)]

    def ridges(self, numbers: tuple[int, ...]) -> tuple[Ridge, ...]:
        """The ridges along the narrow lines and along some of the wide ones; see `find_ridges`."""
        if numbers not in self._ridges:
            self._ridges[numbers] = self._joined([*self.lips, *(self.wide[number] for number in numbers)])
        return self._ridges[numbers]

    def _joined(self, wide: list[np.ndarray]) -> tuple[Ridge, ...]:
        tracer, length = self._tracer, self.length
        # pieces of a wide fold look like weak ones, or like ones in the noise
        traced = [folds for folds in self.narrow if not self._is_piece_of(folds, wide)]
        if wide:
            traced.sort(key=lambda folds: not is_sharp(folds, tracer.angle))
        traced += wide
        lines = [
            Ridge(
                folds["place"],
                is_sharp(folds, tracer.angle),
                acute=bool(np.median(folds["bend"]) >= ACUTE_RIDGE),
                lip=is_lip(folds, tracer.sharpest),
            )
            for folds in traced
        ]
        ridges = whole_lips(kept_ridges(join_ends(lines, length), length), length)
        ridges = [
            ridge.moved(tracer.onto_scan(ridge.places, lip=ridge.lip))
            for ridge in ridges + short_ridges(ridges, tracer)
        ]
        return tuple(sorted(ridges, key=lambda ridge: (ridge.ring, -len(ridge.places))))

    def _is_made_lip(self, folds: np.ndarray) -> bool:
        """Whether wide folds (K,) FOLD are the lip of a body that was made."""
        return is_lip(folds, self._tracer.sharpest) and is_made(folds)

    def _has_edges(self, lip: np.ndarray) -> bool:
        """Whether a lip (K,) FOLD is so wide that its edges are ridges of their own along most of it."""
        angle, beside = self._tracer.angle, HALF_NARROW_LIP * self.length
        edges = [folds for folds in self.narrow if is_sharp(folds, angle) and not runs_along(folds, [lip], beside)]
        return runs_along(lip, edges, self.length)

    def _is_piece_of(self, folds: np.ndarray, wide: list[np.ndarray]) -> bool:
        """Whether a narrow line (K,) FOLD runs along wide ones and says less than they do."""
        if not runs_along(folds, wide, self.length):
            return False
        lips = [each for each in wide if is_lip(each, self._tracer.sharpest)]
        return not is_sure(folds, self._tracer.angle) or runs_along(folds, lips, 2.0 * HALF_NARROW_LIP * self.length)


_KEPT: weakref.WeakKeyDictionary[SurfaceSamples, FoldLines] = weakref.WeakKeyDictionary()


def fold_lines(samples: SurfaceSamples, settings: Settings) -> FoldLines:
    """Return the lines of folds of a scan; the last are cached for as long as the samples exist."""
    kept = _KEPT.get(samples)
    if kept is None or kept.asked != _asked(settings):
        kept = _KEPT[samples] = FoldLines(samples, settings)
    return kept


def _asked(settings: Settings) -> tuple[float, float, bool]:
    """What of the settings the lines of folds depend on."""
    return settings.length, settings.ridge_angle, settings.sharp_edges


def find_ridges(samples: SurfaceSamples, settings: Settings, wide: tuple[int, ...] = ()) -> list[Ridge]:
    """Return the ridges of a scan, open ones first, the longest first.

    A ridge turns by `ridge_angle` within a member. Weaker ones count where they come to one: a roof has all of its hips or none.

    wide : numbers of those of `FoldLines.wide` that are ridges too
    """
    return list(fold_lines(samples, settings).ridges(wide))


def add_ridges(network: Network, ridges: list[Ridge]) -> None:
    """Add ridges to a network of lines."""
    for number, ridge in enumerate(ridges, 1):
        places = np.concatenate([ridge.places, ridge.places[:1]]) if ridge.ring else ridge.places
        points, _ = divide_polyline(places, ridge.ring, LINE_STEP * network.length)
        others = [other for other in ridges if other is not ridge and not other.ring]
        meets = [at for at in (0, -1) if any(_ends_at(other, ridge.places[at], network.length) for other in others)]
        network.add(points, ridge.ring, [], name=f"ridge {number}", sharp=True, meets=meets)


def _ends_at(ridge: Ridge, place: np.ndarray, length: float) -> bool:
    """Whether a ridge ends at a place (3,)."""
    return bool(np.linalg.norm(ridge.places[[0, -1]] - place, axis=1).min() < ONE_CORNER * length)


def kept_ridges(ridges: list[Ridge], length: float) -> list[Ridge]:
    """Return the sharp ridges, and those that come to one that is kept; each turn keeps one more."""
    kept = [ridge for ridge in ridges if ridge.sharp]
    others = [ridge for ridge in ridges if not ridge.sharp]
    while kept and others:
        places = np.concatenate([ridge.places for ridge in kept])
        joined = [ridge for ridge in others if ridge.is_near(places, END_BESIDE_RIDGE * length)]
        if not joined:
            break
        kept.append(joined[0])
        others = [ridge for ridge in others if ridge is not joined[0]]
    return kept


def whole_lips(ridges: list[Ridge], length: float) -> list[Ridge]:
    """Return the ridges but the lips with a free end: a sheet that is folded back on itself has one, a thin body none."""
    return [
        ridge
        for ridge in ridges
        if not ridge.lip
        or ridge.ring
        or all(
            any(other.distance(end) < END_BESIDE_RIDGE * length for other in ridges if other is not ridge)
            for end in ridge.places[[0, -1]]
        )
    ]


def cut_around(ridges: list[Ridge], places: np.ndarray, length: float) -> list[Ridge]:
    """Return the ridges without what lies near some places (M, 3), where no grid could follow them; parts that are too short go."""
    found = []
    for ridge in ridges:
        if (line := _opened_at(ridge, places, length)) is None:
            found.append(ridge)
        else:
            found += [Ridge(line[begin:end], ridge.sharp) for begin, end in runs(_is_left(line, places, length))]
    return found


def given_up(ridges: list[Ridge], places: np.ndarray, length: float) -> list[np.ndarray]:
    """Return the parts (K, 3), the longest first, that `cut_around` leaves out, each up to where the ridge goes on or an opening lies."""
    found = []
    for ridge in ridges:
        if (line := _opened_at(ridge, places, length)) is None:
            continue
        gone = ~_is_left(line, places, length)
        if ridge.ring:  # from a place that is left on
            first = int(gone.argmin())
            line, gone = (np.concatenate([each[first:], each[: first + 1]]) for each in (line, gone))
        for begin, end in runs(gone):
            part = line[max(begin - 1, 0) : end + 1]
            steps = np.linalg.norm(np.diff(part, axis=0), axis=1)
            found += np.split(part, np.flatnonzero(steps > OVER_OPENING * length) + 1)
    found.sort(key=length_along, reverse=True)
    return [part for part in found if length_along(part) >= SHORTEST_RIDGE * length]


def _opened_at(ridge: Ridge, places: np.ndarray, length: float) -> np.ndarray | None:
    """Return the places (K, 3) of a ridge that passes near some others (M, 3), a ring from the nearest on; None where it passes none."""
    if not len(places):
        return None
    away = _distances(ridge.places, places)
    first = int(away.argmin())
    if away[first] > FAULT_REACH * length:
        return None
    return np.roll(ridge.places, -first, axis=0) if ridge.ring else ridge.places


def _is_left(line: np.ndarray, places: np.ndarray, length: float) -> np.ndarray:
    """Return which places of a line (K, 3) lie away from some others (M, 3), in parts that are long enough."""
    left: np.ndarray = _distances(line, places) > FAULT_REACH * length
    for begin, end in runs(left):
        left[begin:end] = length_along(line[begin:end]) >= LEAST_REMAINDER * length
    return left


def _distances(line: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Return the distance of each place of a line (K, 3) from the nearest of some others (M, 3)."""
    away: np.ndarray = np.linalg.norm(line[:, None] - places, axis=2).min(axis=1)
    return away


def without(ridges: list[Ridge], places: Sequence[np.ndarray], length: float) -> list[Ridge]:
    """Return the ridges but the nearest to each place (3,), where one passes it."""
    unwanted = set()
    for place in places:
        gaps = [ridge.distance(place) for ridge in ridges]
        if gaps and min(gaps) <= AT_RIDGE * length:
            unwanted.add(int(np.argmin(gaps)))
    return [ridge for k, ridge in enumerate(ridges) if k not in unwanted]


def short_ridges(ridges: list[Ridge], tracer: Tracer) -> list[Ridge]:
    """Return the ridges between corners that are too short to be followed."""
    length = tracer.length
    ends: list[np.ndarray] = []
    for place in (place for ridge in ridges if not ridge.ring for place in ridge.places[[0, -1]]):
        if all(np.linalg.norm(place - other) > SHORTEST_RIDGE * length for other in ends):
            ends.append(place)
    found: list[Ridge] = []
    for first, last in combinations(ends, 2):
        if SHORTEST_RIDGE * length < np.linalg.norm(last - first) <= LONGEST_BETWEEN_CORNERS * length:
            middle = 0.5 * (first + last)[None]
            taken = any(ridge.distance(middle[0]) < END_BESIDE_RIDGE * length for ridge in ridges + found)
            if not taken and tracer.is_folded_between(first, last):
                steps = max(int(np.linalg.norm(last - first) / (FOLD_STRIDE * length)), 1) + 1
                found.append(Ridge(np.linspace(first, last, steps), True))
    return found
