"""Folds of the scan, fitted place by place and followed along."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ..kernels.geometry.quadric import FIT_POINT
from ..kernels.mesh.point_location import nearest_sample
from ..kernels.surface import ridges as kernels
from ..kernels.surface.local_surface import walk
from ..kernels.surface.ridges import FOLD
from ..kernels.surface.wide_folds import fit_wide_fold, keep_wide_folds
from ..runtime.jit import new_record
from ..runtime.watch import Watch
from ..surface.near_scan import distance_from_scan, noise_of_points
from .lines_of_folds import (
    FOLD_STRIDE,
    GAIN_OF_SURE,
    NEARLY_EVEN,
    SHARPEST_EDGE,
    SHARPEST_FOLD_ANGLE,
    SHARPEST_LIP,
    WIDE_UNEVEN,
    is_clear_on_rough,
    is_even,
    is_long,
    is_sure,
    parts_of_fold,
    runs_along,
    smoothed,
    squares_between,
)

if TYPE_CHECKING:
    from ..settings import Settings
    from ..surface.samples import SurfaceSamples

# radii around a place within which folds are fitted, in turn until one fits: the second for rounded folds, then for places near corners
FOLD_RADII = (0.8, 1.2, 0.6, 0.45)  # [member lengths]
FEWEST_SPACINGS = 2.6  # least radius, in distances between points
FIRST_NEAR_CORNERS = 2  # number of the first of the radii for places near corners
POINTS_OF_A_FIT = 300.0  # points to which a fold is fitted, some more or less
MOST_POINTS_OF_FIT = 6000  # points that there is room for
FEWEST_OF_A_SAMPLE = 3.0  # of each sample at least
# distance of the points from a fold up to which no smaller radius is tried, at least [member lengths], and in those that are noise
FOLD_FITS_WITHIN, NOISES_OF_FIT = 0.02, 1.5
FOLD_AHEAD, WIDE_FOLD_AHEAD = 0.6, 1.0  # farthest that the next crest lies from where it was expected [steps]
LEAST_TURN_SHARE = 0.25  # share of the ridge angle by which neighbouring normals must differ where a fold is looked for
LIKELY_FOLD = 0.35  # share of the ridge angle above which a fold is looked at more closely
WEAK_FOLD = 0.6  # share of the ridge angle from which a fold is followed
SHARP_SHARE = 1.5  # share of it from which no larger radius is tried
FADED_FOLD = 0.2  # a fold ends where its angle has fallen to this share of the ridge angle
FOLD_OVER_SMOOTH = 10.0  # how much better a fold must fit than a smooth surface (F statistic)
ROUGHEST_SIDE = 0.12  # points farther from a fold than this follow neither side [member lengths]
LOOK_SPACING = 0.33  # places closer together than this are not looked at twice [member lengths]
# farthest that the crest lies from the place at which a fold was found [member lengths]
FOLD_BESIDE, WIDE_FOLD_BESIDE = 0.5, 0.8
WIDE_LOOK_SPACING = 0.5  # distance between places at which wide folds are looked for [member lengths]
MOST_SAMPLES = 4000  # most samples from which folds are looked for, the sharpest first
# places in a row that look folded and are no ridge, after which only long ridges count: at least, and for each ridge found before, as
# a body with many edges has many corners
FALSE_FOLDS_OF_ROUGH, FALSE_FOLDS_PER_RIDGE = 12, 2
FEWEST_LONG_FOLDS = 3  # long lines of folds, at least, of which most are even where others are ridges too
MOST_FALSE_FOLDS = 80  # such places in a row after which the search stops
# places in a row at which a fold may not be seen and still goes on: beside a corner, a wide one is not for the width of its sides
MISSED_PLACES, WIDE_MISSED_PLACES = 2, 4
LEAST_TURN_COSINE = 0.94  # least cosine of the turn of a fold from place to place
PLACES_OF_SHORTEST_RING = 6  # places along the shortest ring
MOST_PLACES_OF_FOLD = 20_000  # most places along a fold
MOST_TRACED = 4.0  # times as many places as ridges can have where they lie side by side
TANGLED_RIDGES = "the ridges of the scan cannot be followed; use another length, or --ridge-angle 0"
FOLDS_MEET_WITHIN = 0.3  # a fold this near to another one has come to it [member lengths]
OFF_SCAN = 0.3  # a place nearer to a sample than this is on the scan [member lengths]
LOOK_AROUND = 0.12  # radius within which the scan is looked for below a ridge [member lengths]
SHARE_BELOW = 0.25  # share of that radius by which the scan may lie below a sharp ridge
FAR_OFF = 0.08  # a place farther from all points than this is beside the scan [member lengths]
POINTS_AT_LIP = 7  # points nearest to the line of a lip whose middle height is its own
FEWEST_AROUND = 5  # fewest points that show whether a place lies off them
HALF_NARROW_LIP = 0.3  # half the width of a lip below which one line stands for both of its edges [member lengths]
PLACES_OF_EDGE = 12  # places along a line of folds, about, at which a lip is looked for
PLACES_BETWEEN_CORNERS = (0.3, 0.5, 0.7)  # shares of the way between two corners at which a short ridge must be seen


class Tracer:
    """Fits folds to a scan and goes along them."""

    def __init__(self, samples: SurfaceSamples, settings: Settings) -> None:
        self.surface = samples.surface
        self.length = settings.length
        self.angle = float(np.radians(settings.ridge_angle))
        self.sharpest = SHARPEST_EDGE if settings.sharp_edges else SHARPEST_FOLD_ANGLE
        self.radii = [max(radius * settings.length, FEWEST_SPACINGS * samples.spacing) for radius in FOLD_RADII]
        of_sample = samples.area / len(samples.surface.mean)
        self.most = [POINTS_OF_A_FIT * of_sample / (np.pi * radius**2) for radius in self.radii]
        self.spacing = samples.spacing
        noise = max(noise_of_points(samples), float(np.median(samples.thickness)))
        self.far = max(FAR_OFF * settings.length, 4.0 * samples.spacing)
        self.fits = max(FOLD_FITS_WITHIN * settings.length, NOISES_OF_FIT * noise)
        self.buffer = np.empty(MOST_POINTS_OF_FIT, FIT_POINT)
        self.origin = samples.origin
        self.wide = False
        self.watch = Watch(
            TANGLED_RIDGES, samples.area / (FOLDS_MEET_WITHIN * FOLD_STRIDE * settings.length**2), MOST_TRACED
        )

    def fold_at(self, sample: int, place: np.ndarray, towards: np.ndarray, first: int = 0) -> np.record | None:
        """The fold around a place (see `kernels.surface.ridges.fit_fold`), None where no fold fits.

        first : number of the radius that is tried first
        """
        fold, best = new_record(FOLD), None
        x, y, z = place.tolist()
        a, b, c = towards.tolist()
        if self.wide:
            fits = fit_wide_fold(self.surface, sample, (x, y, z), (a, b, c), fold)
            return fold if fits and fold.gain >= FOLD_OVER_SMOOTH else None
        for number, (radius, most) in enumerate(zip(self.radii, self.most, strict=True)):
            if number < first or (number >= FIRST_NEAR_CORNERS and best is not None and self._is_clear(best)):
                continue
            surface = self.surface._replace(patch_points=max(most, FEWEST_OF_A_SAMPLE))
            fits = kernels.fit_fold(surface, sample, (x, y, z), (a, b, c), radius, self.buffer, fold)
            if not fits or fold.gain < FOLD_OVER_SMOOTH or fold.off > ROUGHEST_SIDE * self.length:
                continue
            if self._is_clear(fold) and fold.bend >= SHARP_SHARE * self.angle:
                return fold
            if best is None or self._rank(fold) > self._rank(best):
                best = fold.copy()
        return best

    def _is_clear(self, fold: np.record) -> bool:
        """Whether a fold fits and is one to follow."""
        return bool(fold.off <= self.fits and fold.bend >= WEAK_FOLD * self.angle)

    def _rank(self, fold: np.record) -> tuple[bool, float]:
        """What is better of two folds: clear ones that bend most, else those that fit best."""
        clear = self._is_clear(fold)
        return clear, float(fold.bend if clear else -fold.off)

    def trace(self) -> list[np.ndarray]:
        """The folds (K,) FOLD, a stride apart along each line of folds that is long and sharp enough to be a ridge."""
        return self._trace_from(self._seeds, [])

    def trace_wide(self, narrow: list[np.ndarray]) -> list[np.ndarray]:
        """The same of folds that turn over nearly a member, away from the sharp ones of the lines that are known."""
        self.wide = True
        sharp = [folds for folds in narrow if is_sure(folds, self.angle) and not self._edges_narrow_lip(folds)]
        found = self._trace_from(self._wide_seeds(sharp), sharp)[len(sharp) :]
        self.wide = False
        return [folds for folds in found if is_sure(folds, self.angle)]

    def _edges_narrow_lip(self, folds: np.ndarray) -> bool:
        """Whether most of a line of folds (K,) FOLD is an edge of a lip so narrow that one line along its middle stands for both."""
        some, beside = folds[:: max(len(folds) // PLACES_OF_EDGE, 1)], 0
        for fold in some:
            sample = nearest_sample(self.surface, *fold.place.tolist())
            lip = self.fold_at(sample, fold.place, fold.ahead)
            if lip is not None and lip.bend >= np.radians(self.sharpest):
                beside += bool(np.linalg.norm(lip.place - fold.place) < HALF_NARROW_LIP * self.length)
        return 2 * beside > len(some)

    def _trace_from(self, seeds: np.ndarray, known: list[np.ndarray]) -> list[np.ndarray]:
        """The lines of folds that are known, and those around samples (K,) that belong to none of them."""
        fresh = np.ones(len(seeds), bool)
        places = self.surface.mean[seeds]
        ridges, doubtful = list(known), list[np.ndarray]()
        misses, rough = 0, False
        for k, sample in enumerate(seeds.tolist()):
            if not fresh[k]:
                continue
            fold = self.fold_at(sample, places[k], np.zeros(3))
            misses += 1
            rough |= misses > max(FALSE_FOLDS_OF_ROUGH, FALSE_FOLDS_PER_RIDGE * (len(ridges) - len(known)))
            if misses > MOST_FALSE_FOLDS:
                break
            if (
                fold is not None
                and fold.bend > WEAK_FOLD * self.angle
                and np.linalg.norm(fold.place - places[k])
                < (WIDE_FOLD_BESIDE if self.wide else FOLD_BESIDE) * self.length
            ):
                folds = self._follow(sample, fold, [ridge["place"] for ridge in ridges])
                self.watch.note(len(folds), folds["place"][-1] + self.origin)
                for part in parts_of_fold(folds):
                    if self._is_even(part) and (not rough or is_clear_on_rough(part, self.angle)):
                        ridges.append(part)
                        misses = 0
                    else:
                        doubtful.append(part)
                for place in folds["place"]:
                    fresh &= ((places - place) ** 2).sum(axis=1) > (2.4 * LOOK_SPACING * self.length) ** 2
        return ridges if self.wide else ridges + self._also_ridges(ridges, doubtful)

    def _is_even(self, folds: np.ndarray, times: float = 1.0) -> bool:
        """Whether a line of folds (K,) FOLD is as even as a ridge, or so many times less."""
        sharpest, slack = (SHARPEST_LIP, WIDE_UNEVEN) if self.wide else (self.sharpest, 0.0)
        return is_even(folds, WEAK_FOLD * self.angle, sharpest, slack, times)

    def _also_ridges(self, ridges: list[np.ndarray], doubtful: list[np.ndarray]) -> list[np.ndarray]:
        """Doubtful lines of folds (K,) FOLD that are ridges too, where most long ones are even: even on a rough scan, or less even."""
        even = [folds for folds in ridges + doubtful if is_long(folds, self.angle) and self._is_even(folds)]
        others = [folds for folds in doubtful if is_long(folds, self.angle) and not self._is_even(folds)]
        if len(even) + len(others) < FEWEST_LONG_FOLDS or len(even) < len(others):
            return []
        also: list[np.ndarray] = []
        for folds in doubtful:
            if (
                is_long(folds, self.angle)
                and self._is_even(folds, NEARLY_EVEN)
                and not runs_along(folds, [*ridges, *also], FOLDS_MEET_WITHIN * self.length)
            ):
                also.append(folds)
        return also

    def is_folded_between(self, first: np.ndarray, last: np.ndarray) -> bool:
        """Whether the scan is folded all along the straight way from one place to another."""
        ahead = (last - first) / np.linalg.norm(last - first)
        for share in PLACES_BETWEEN_CORNERS:
            place = first + share * (last - first)
            fold = self.fold_at(nearest_sample(self.surface, *place.tolist()), place, ahead, len(self.radii) - 1)
            if fold is None or fold.bend < WEAK_FOLD * self.angle or abs(fold.ahead @ ahead) < LEAST_TURN_COSINE:
                return False
            if np.linalg.norm(fold.place - place) > FOLD_AHEAD * FOLD_STRIDE * self.length:
                return False
        return True

    def onto_scan(self, places: np.ndarray, *, lip: bool = False) -> np.ndarray:
        """Places (K, 3) along a ridge, moved to the scan where the fold is rounded and they lie off it; those of a lip all."""
        above = np.array([self._above(place, lip) for place in places])
        moved: np.ndarray = places - smoothed(above)
        return moved

    @cached_property
    def _likely(self) -> np.ndarray:
        """Samples (K,) at which the normals turn so fast that there may be a ridge, the sharpest first."""
        bends = np.empty(len(self.surface.mean))
        kernels.bends_of_samples(self.surface, bends)
        likely = np.flatnonzero(bends < np.cos(LEAST_TURN_SHARE * self.angle))
        return likely[np.argsort(bends[likely], kind="stable")[:MOST_SAMPLES]]

    @cached_property
    def _seeds(self) -> np.ndarray:
        """Those (K,) around which a few points look folded."""
        likely, note = self._likely.copy(), np.zeros(len(self._likely), np.int64)
        least, apart = LIKELY_FOLD * self.angle, LOOK_SPACING * self.length
        return likely[: kernels.keep_folded(self.surface, likely, self.radii[0], least, apart, self.buffer, note)]

    def _wide_seeds(self, sharp: list[np.ndarray]) -> np.ndarray:
        """Those (K,) away from sharp folds at which both sides of a wide fold are seen."""
        places, away = self.surface.mean[self._likely], np.ones(len(self._likely), bool)
        for folds in sharp:
            away &= squares_between(places, folds).min(axis=1) > self.length**2
        likely, note = self._likely[away], np.zeros(int(away.sum()), np.int64)
        least, apart = WEAK_FOLD * self.angle, WIDE_LOOK_SPACING * self.length
        return likely[: keep_wide_folds(self.surface, likely, apart, least, GAIN_OF_SURE, note)]

    def _follow(self, sample: int, fold: np.record, others: list[np.ndarray]) -> np.ndarray:
        """Go along a fold to both sides until it fades, leaves the scan or comes to another; back to its start where it is a ring."""
        ahead, ring = self._march(sample, fold, 1.0, fold.place, others)
        back: list[np.record] = []
        if not ring:
            back, ring = self._march(
                sample, fold, -1.0, ahead[-1].place if len(ahead) > PLACES_OF_SHORTEST_RING else fold.place, others
            )
        folds = np.array([*back[::-1], fold, *ahead])
        if not ring:
            folds["place"] = smoothed(folds["place"])
            return folds
        folds = folds[:-1]  # the last place lies beside the first
        around = np.take(
            folds["place"],
            np.arange(-PLACES_OF_SHORTEST_RING, len(folds) + PLACES_OF_SHORTEST_RING),
            axis=0,
            mode="wrap",
        )
        folds["place"] = smoothed(around)[PLACES_OF_SHORTEST_RING:-PLACES_OF_SHORTEST_RING]
        return np.concatenate([folds, folds[:1]])

    def _march(
        self, sample: int, fold: np.record, sign: float, goal: np.ndarray, others: list[np.ndarray]
    ) -> tuple[list[np.record], bool]:
        """Folds stride by stride to one side of a first one; whether they came to the goal, which closes a ring."""
        ahead, at = sign * fold.ahead, fold
        steps: list[np.record] = []
        known, own = np.concatenate([np.zeros((0, 3)), *others]), np.empty((MOST_PLACES_OF_FOLD, 3))
        meets = FOLDS_MEET_WITHIN * self.length
        missed = 0
        while len(steps) < MOST_PLACES_OF_FOLD and missed <= (WIDE_MISSED_PLACES if self.wide else MISSED_PLACES):
            stride = (1 + missed) * FOLD_STRIDE * self.length
            place = at.place + stride * ahead
            x, y, z = place.tolist()
            sample = walk(self.surface, sample, (x, y, z))
            if self._is_off_scan(sample, place):
                break
            after = self.fold_at(sample, place, ahead)
            if after is None or not self._goes_on(after, place, ahead):
                missed += 1
                continue
            after.ahead *= np.sign(after.ahead @ ahead)
            steps.append(after)
            at, ahead, missed = after, after.ahead, 0
            if len(steps) > PLACES_OF_SHORTEST_RING and np.linalg.norm(at.place - goal) < meets:
                return steps, True
            own[len(steps) - 1] = at.place
            for places in (known, own[: max(len(steps) - PLACES_OF_SHORTEST_RING, 0)]):
                if len(places) and ((places - at.place) ** 2).sum(axis=1).min() < meets**2:
                    return steps, False
        return steps, False

    def _is_off_scan(self, sample: int, place: np.ndarray) -> bool:
        """Whether a place has left the scan; in a sharp fold all samples may lie far off though points do not."""
        away = np.linalg.norm(self.surface.mean[sample] - place)
        return bool(away > OFF_SCAN * self.length and distance_from_scan(self.surface, place) > self.far)

    def _goes_on(self, fold: np.record, place: np.ndarray, ahead: np.ndarray) -> bool:
        """Whether the fold found where a line of folds should go on belongs to it."""
        return bool(
            fold.bend >= FADED_FOLD * self.angle
            and np.linalg.norm(fold.place - place)
            < (WIDE_FOLD_AHEAD if self.wide else FOLD_AHEAD) * FOLD_STRIDE * self.length
            and abs(fold.ahead @ ahead) > LEAST_TURN_COSINE
        )

    def _above(self, place: np.ndarray, lip: bool) -> np.ndarray:
        """By how much a place on a ridge lies off nine tenths of the points below or above it, on a lip off half of the nearest, (3,)."""
        x, y, z = place.tolist()
        sample = nearest_sample(self.surface, x, y, z)
        *normal, taken = kernels.points_around(self.surface, sample, (x, y, z), self.radii[-1], self.buffer)
        ahead, away = np.array(normal), self.buffer["place"][:taken]
        if taken == 0:
            return np.zeros(3)
        squares = (away**2).sum(axis=1)
        nearest = int(squares.argmin())
        if squares[nearest] > self.far**2:  # beside the scan, as a corner may be, or beside this side of it only
            beside: np.ndarray = -away[nearest]
            return beside if distance_from_scan(self.surface, place) > self.far else np.zeros(3)
        heights = away @ ahead
        if lip:
            near = np.argsort(squares - heights**2, kind="stable")[:POINTS_AT_LIP]
            up: np.ndarray = ahead * float(np.median(heights[near]))
            return -up
        radius = max(LOOK_AROUND * self.length, 2.5 * self.spacing)
        heights = np.sort(heights[squares - heights**2 < radius**2])
        tenth = len(heights) // 10
        low, high = (heights[tenth], heights[-1 - tenth]) if len(heights) >= FEWEST_AROUND else (0.0, 0.0)
        off = -low if low > 0.0 else (-high if high < 0.0 else 0.0)
        moved: np.ndarray = ahead * (off if abs(off) > self.fits + SHARE_BELOW * radius else 0.0)
        return moved
