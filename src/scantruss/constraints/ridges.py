"""Sharp ridges of the scan, traced as lines."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..kernels.geometry.quadric import COLUMNS
from ..kernels.mesh.point_location import nearest_sample
from ..kernels.surface.local_surface import walk
from ..kernels.surface.ridges import FOUND, bends_of_samples, fit_fold, keep_folded, points_around
from ..surface.samples import ALL
from .fixed_lines import LINE_STEP, divide
from .ridge_ends import join_ends

if TYPE_CHECKING:
    from ..settings import Settings
    from ..surface.samples import SurfaceSamples
    from .network import Network

RADII = (0.8, 0.6, 0.45)  # radii around a place within which folds are fitted, in turn where one does not fit [member lengths]
FITS = 0.02  # distance of the points from a fold up to which a smaller radius is not tried [member lengths]
STRIDE = 0.25  # step from place to place along a ridge [member lengths]
BEND = 0.4  # share of the ridge angle by which neighbouring normals must differ where a ridge is looked for
LIKELY = 0.5  # share of the ridge angle above which a fold is looked at more closely
SHARPEST = 125.0  # a surface that bends by more is not folded but turns back: two sheets [degree]
FADED = 0.2  # a ridge ends where its angle has fallen to this share of the ridge angle
GAIN = 10.0  # how much better a fold must fit than a smooth surface (F statistic)
ROUGHEST = 0.12  # points farther from a fold than this follow neither side [member lengths]
LOOK_SPACING = 0.33  # places closer together than this are not looked at twice [member lengths]
LONG = 1.0  # least length of a ridge [member lengths]
FULL = 0.75  # least length of a ridge with the full angle [member lengths]
EVEN = 4.0  # median change of the bend from place to place along a ridge, at most [degree]
SURE = 30.0  # median gain along a ridge, at least (F statistic)
MOST_SAMPLES = 4000  # most samples from which ridges are looked for, the sharpest first
PATIENCE = 40  # places that look folded and are no ridge, after which the search stops: the scan is rough
MISSED = 2  # places in a row at which a ridge may not be seen and still goes on
TURNED = 0.94  # least cosine of the turn of a ridge from place to place
RING = 6  # places along the shortest ring
FARTHEST = 20_000  # most places along a ridge
LOOK_AROUND = 0.12  # radius within which the scan is looked for below a ridge [member lengths]
FEWEST_AROUND = 5  # fewest points from which it is told whether a place lies off them
OFF_SCAN = 0.3  # a place farther from the scan than this has left it [member lengths]


class Tracer:
    """Fits folds to a scan and goes along ridges."""

    def __init__(self, samples: SurfaceSamples, settings: Settings) -> None:
        self.surface = samples.surface._replace(patch_points=ALL)
        self.length = settings.length
        self.angle = float(np.radians(settings.ridge_angle))
        self.radii = [max(radius * settings.length, 2.6 * samples.spacing) for radius in RADII]
        self.spacing = samples.spacing
        self.fits = max(FITS * settings.length, 1.5 * float(np.median(samples.thickness)))
        self.buffer = np.empty((6000, COLUMNS))

    def fold_at(self, sample: int, place: np.ndarray, towards: np.ndarray) -> np.ndarray | None:
        """The fold around a place (see `kernels.surface.ridges.fit_fold`), None where no fold fits."""
        found, best = np.zeros(FOUND), None
        x, y, z = place.tolist()
        a, b, c = towards.tolist()
        for radius in self.radii:
            if fit_fold(self.surface, sample, (x, y, z), (a, b, c), radius, self.buffer, found):
                if found[7] >= GAIN and found[8] <= ROUGHEST * self.length and (best is None or found[8] < best[8]):
                    best = found.copy()
                if best is not None and best[8] <= self.fits:
                    break
        return best

    def seeds(self) -> np.ndarray:
        """Samples (K,) at which the normals turn so fast that there may be a ridge, the sharpest first."""
        bends = np.empty(len(self.surface.mean))
        bends_of_samples(self.surface, bends)
        likely = np.flatnonzero(bends < np.cos(BEND * self.angle))
        likely = likely[np.argsort(bends[likely], kind="stable")[:MOST_SAMPLES]]
        if not len(likely):
            return likely
        note = np.zeros(len(likely), np.int64)
        least, apart = LIKELY * self.angle, LOOK_SPACING * self.length
        return likely[: keep_folded(self.surface, likely, self.radii[0], least, apart, self.buffer, note)]

    def trace(self) -> list[np.ndarray]:
        """All ridges: the folds (K, FOUND) a stride apart along each."""
        seeds = self.seeds()
        fresh = np.ones(len(seeds), bool)
        places = self.surface.mean[seeds]
        ridges: list[np.ndarray] = []
        misses = 0
        for k, sample in enumerate(seeds.tolist()):
            if not fresh[k]:
                continue
            fold = self.fold_at(sample, places[k], np.zeros(3))
            misses += 1
            if misses > PATIENCE:
                break
            if fold is not None and fold[6] > self.angle and np.linalg.norm(fold[:3] - places[k]) < 0.5 * self.length:
                folds = self._follow(sample, fold, [ridge[:, :3] for ridge in ridges])
                if is_ridge(folds, self.angle):
                    ridges.append(folds)
                    misses = 0
                for place in folds[:, :3]:
                    fresh &= ((places - place) ** 2).sum(axis=1) > (2.4 * LOOK_SPACING * self.length) ** 2
        return ridges

    def _follow(self, sample: int, fold: np.ndarray, others: list[np.ndarray]) -> np.ndarray:
        """Go along a ridge to both sides until it fades, leaves the scan or comes to another; back to its start where it is a ring."""
        ahead, ring = self._march(sample, fold, 1.0, fold[:3], others)
        back: list[np.ndarray] = []
        if not ring:
            back, ring = self._march(sample, fold, -1.0, ahead[-1][:3] if len(ahead) > RING else fold[:3], others)
        steps = [*back[::-1], fold, *ahead]
        folds = np.array([*steps, steps[0]] if ring else steps)
        folds[:, :3] = _smoothed(folds[:, :3])
        return folds

    def _march(
        self, sample: int, fold: np.ndarray, sign: float, goal: np.ndarray, others: list[np.ndarray]
    ) -> tuple[list[np.ndarray], bool]:
        """Folds stride by stride to one side of a first one; whether they came to the goal, which closes a ring."""
        ahead, at = sign * fold[3:6], fold
        steps: list[np.ndarray] = []
        known = np.concatenate([np.zeros((0, 3)), *others])
        missed = 0
        while len(steps) < FARTHEST and missed <= MISSED:
            stride = (1 + missed) * STRIDE * self.length
            place = at[:3] + stride * ahead
            x, y, z = place.tolist()
            sample = walk(self.surface, sample, (x, y, z))
            if np.linalg.norm(self.surface.mean[sample] - place) > OFF_SCAN * self.length:
                break
            after = self.fold_at(sample, place, ahead)
            if after is None or not self._goes_on(after, place, ahead):
                missed += 1
                continue
            after[3:6] *= np.sign(after[3:6] @ ahead)
            steps.append(after)
            at, ahead, missed = after, after[3:6], 0
            if len(steps) > RING and np.linalg.norm(at[:3] - goal) < 0.6 * stride:
                return steps, True
            if len(known) and ((known - at[:3]) ** 2).sum(axis=1).min() < (0.3 * self.length) ** 2:
                break
        return steps, False

    def onto_scan(self, places: np.ndarray) -> np.ndarray:
        """Places (K, 3) along a ridge, moved to the scan where the fold is rounded and they lie off it."""
        above = np.array([self._above(place) for place in places])
        moved: np.ndarray = places - _smoothed(above)
        return moved

    def _above(self, place: np.ndarray) -> np.ndarray:
        """By how much a place on a ridge lies off nine tenths of the points below or above it, (3,)."""
        x, y, z = place.tolist()
        sample = nearest_sample(self.surface, x, y, z)
        *normal, taken = points_around(self.surface, sample, (x, y, z), self.radii[-1], self.buffer)
        ahead, away = np.array(normal), self.buffer[:taken, :3]
        heights = away @ ahead
        radius = max(LOOK_AROUND * self.length, 2.5 * self.spacing)
        heights = np.sort(heights[(away**2).sum(axis=1) - heights**2 < radius**2])
        tenth = len(heights) // 10
        low, high = (heights[tenth], heights[-1 - tenth]) if len(heights) >= FEWEST_AROUND else (0.0, 0.0)
        off = -low if low > 0.0 else (-high if high < 0.0 else 0.0)
        moved: np.ndarray = ahead * (off if abs(off) > self.fits + 0.1 * radius else 0.0)
        return moved

    def _goes_on(self, fold: np.ndarray, place: np.ndarray, ahead: np.ndarray) -> bool:
        """Whether the fold found where a ridge should go on is the same ridge."""
        return bool(
            fold[6] >= FADED * self.angle
            and np.linalg.norm(fold[:3] - place) < 0.6 * STRIDE * self.length
            and abs(fold[3:6] @ ahead) > TURNED
        )


def is_ridge(folds: np.ndarray, angle: float) -> bool:
    """Whether a row of folds (K, FOUND), a stride apart, is a ridge: sharp, and as even as one that was made.

    Even is what bends evenly: the change of its bend counts, not the bend. What noise explains does not count: it makes the angle
    uncertain by about the angle over the root of the F statistic, and the direction by one over that root.
    """
    angles = folds[:, 6]
    if len(folds) * STRIDE < LONG or (angles >= angle).sum() * STRIDE < FULL:
        return False
    ahead = np.diff(folds[:, :3], axis=0)
    ahead /= np.maximum(np.linalg.norm(ahead, axis=1), 1e-300)[:, None]
    bends = np.cross(ahead[1:], ahead[:-1])
    wiggle = float(np.median(np.linalg.norm(np.diff(bends, axis=0), axis=1))) if len(bends) > 1 else 0.0
    return bool(np.median(folds[:, 7]) >= SURE and wiggle <= np.radians(EVEN))


def _smoothed(places: np.ndarray) -> np.ndarray:
    """Places (K, 3) along a ridge with less of their noise; the ends stay."""
    smooth = places.copy()
    for reach in (1, 2):
        if len(places) > 2 * reach:
            weights = (reach + 1.0 - np.abs(np.arange(-reach, reach + 1))) / (reach + 1.0) ** 2
            last = len(places) - 2 * reach
            smooth[reach : len(places) - reach] = sum(w * places[o : o + last] for o, w in enumerate(weights))
    return smooth


def find_ridges(samples: SurfaceSamples, settings: Settings) -> list[tuple[np.ndarray, bool]]:
    """Return the ridges of a scan: places (K, 3) along each, and whether it is a ring; the longest first, rings last."""
    tracer = Tracer(samples, settings)
    opened, rings = join_ends([folds[:, :3] for folds in tracer.trace()], settings.length)
    opened.sort(key=len, reverse=True)
    return [(tracer.onto_scan(places), ring) for lines, ring in ((opened, False), (rings, True)) for places in lines]


def add_ridges(network: Network, ridges: list[tuple[np.ndarray, bool]]) -> None:
    """Add ridges to a network of lines."""
    for places, ring in ridges:
        step = LINE_STEP * network.length
        points, _ = divide(np.concatenate([places, places[:1]]) if ring else places, ring, step)
        network.add(points, ring, [], sharp=True)
