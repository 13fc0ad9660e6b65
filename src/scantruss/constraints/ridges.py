"""Sharp ridges of the scan, traced as lines."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..boundary.polylines import divide
from ..kernels.geometry.quadric import COLUMNS
from ..kernels.surface.local_surface import walk
from ..kernels.surface.ridges import FOUND, bends_of_samples, fit_fold, keep_folded
from ..surface.samples import ALL
from .fixed_lines import LINE_STEP

if TYPE_CHECKING:
    from ..settings import Settings
    from ..surface.samples import SurfaceSamples
    from .network import Network

RADIUS = 0.8  # radius around a place within which a fold is fitted [member lengths]
STRIDE = 0.25  # step from place to place along a ridge [member lengths]
BEND = 0.4  # share of the ridge angle by which neighbouring normals must differ where a ridge is looked for
LIKELY = 0.5  # share of the ridge angle above which a fold is looked at more closely
SHARPEST = 125.0  # a surface that bends by more is not folded but turns back: two sheets [degree]
FADED = 0.2  # a ridge ends where its angle has fallen to this share of the ridge angle
GAIN = 10.0  # how much better a fold must fit than a smooth surface (F statistic)
ROUGHEST = 0.12  # points farther from a fold than this follow neither side [member lengths]
LOOK_SPACING = 0.33  # places closer together than this are not looked at twice [member lengths]
LONG = 3.0  # least length of a ridge [member lengths]
FULL = 1.5  # least length of a ridge with the full angle [member lengths]
BRIDGE = 4.0  # longest gap over which the ends of two ridges are joined [member lengths]
STRAIGHT = 0.94  # least cosine of the angle between such an end and the way to the other
TOUCH = 0.6  # gap below which only one of the ends must point to the other [member lengths]
CORNER = 2.0  # ends of ridges whose continuations meet within this distance are led to the meeting [member lengths]
CLEAR = 3  # places at the end of a ridge that are left out for that, because the third side disturbs them
EVEN = 2.4  # largest change of direction and half angle from place to place along an even ridge [degree]
UNSURE = (1.0, 0.45)  # the same change of angle and direction, in units of what the noise explains
WIGGLE = 3.5  # largest change of direction that noise may explain [degree]
MOST_SAMPLES = 4000  # most samples from which ridges are looked for, the sharpest first
PATIENCE = 40  # places that look folded and are no ridge, after which the search stops: the scan is rough
ROUGH = 0.02  # thickness of the samples above which all points are used [member lengths]
MISSED = 2  # places in a row at which a ridge may not be seen and still goes on
TURNED = 0.94  # least cosine of the turn of a ridge from place to place
FARTHEST = 20_000  # most places along a ridge
OFF_SCAN = 0.3  # a place farther from the scan than this has left it [member lengths]


class Tracer:
    """Fits folds to a scan and goes along ridges."""

    def __init__(self, samples: SurfaceSamples, settings: Settings) -> None:
        rough = np.median(samples.thickness) > ROUGH * settings.length
        self.surface = samples.surface._replace(patch_points=ALL) if rough else samples.surface
        self.length = settings.length
        self.angle = float(np.radians(settings.ridge_angle))
        self.radius = max(RADIUS * settings.length, 2.6 * samples.spacing)
        self.buffer = np.empty((6000, COLUMNS))

    def fold_at(self, sample: int, place: np.ndarray, towards: np.ndarray) -> np.ndarray | None:
        """The fold around a place (see `kernels.surface.ridges.fit_fold`), None where no fold fits."""
        found = np.zeros(FOUND)
        x, y, z = place.tolist()
        a, b, c = towards.tolist()
        if not fit_fold(self.surface, sample, (x, y, z), (a, b, c), self.radius, self.buffer, found):
            return None
        if found[7] < GAIN or found[8] > ROUGHEST * self.length:
            return None
        return found

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
        return likely[: keep_folded(self.surface, likely, self.radius, least, apart, self.buffer, note)]

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
        sides = []
        for sign in (1.0, -1.0):
            steps, ring = self._march(sample, fold, sign, others)
            sides.append(steps)
            if ring:
                break
        back = sides[1][::-1] if len(sides) > 1 else []
        steps = [*back, fold, *sides[0]]
        if len(sides) == 1:
            steps.append(fold)
        folds = np.array(steps)
        folds[:, :3] = _smoothed(folds[:, :3])
        return folds

    def _march(
        self, sample: int, fold: np.ndarray, sign: float, others: list[np.ndarray]
    ) -> tuple[list[np.ndarray], bool]:
        """Folds stride by stride to one side of a first one; whether they came back to it."""
        start, ahead, at = fold[:3], sign * fold[3:6], fold
        steps: list[np.ndarray] = []
        known = np.concatenate([np.zeros((0, 3)), *others])
        missed = 0
        while len(steps) < FARTHEST and missed <= MISSED:
            place = at[:3] + (1 + missed) * STRIDE * self.length * ahead
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
            if len(steps) > 6 and np.linalg.norm(at[:3] - start) < STRIDE * self.length:
                return steps, True
            if len(known) and ((known - at[:3]) ** 2).sum(axis=1).min() < (0.3 * self.length) ** 2:
                break
        return steps, False

    def _goes_on(self, fold: np.ndarray, place: np.ndarray, ahead: np.ndarray) -> bool:
        """Whether the fold found where a ridge should go on is the same ridge."""
        return bool(
            fold[6] >= FADED * self.angle
            and np.linalg.norm(fold[:3] - place) < 0.6 * STRIDE * self.length
            and abs(fold[3:6] @ ahead) > TURNED
        )


def is_ridge(folds: np.ndarray, angle: float) -> bool:
    """Whether a row of folds (K, FOUND), a stride apart, is a ridge: long, sharp, and as even as one that was made.

    Natural crests turn and change their angle all the way. What noise explains does not count: it makes the angle uncertain by
    about the angle over the root of the F statistic, and the direction by one over that root.
    """
    angles = folds[:, 6]
    if len(folds) * STRIDE < LONG or (angles >= angle).sum() * STRIDE < FULL or angles.max() >= np.radians(SHARPEST):
        return False
    if len(folds) >= 16:  # what lies at the ends may be blurred by a third side
        folds, angles = folds[CLEAR:-CLEAR], angles[CLEAR:-CLEAR]
    ahead = np.diff(folds[:, :3], axis=0)
    ahead /= np.maximum(np.linalg.norm(ahead, axis=1), 1e-300)[:, None]
    wiggle = float(np.arccos(np.clip((ahead[1:] * ahead[:-1]).sum(axis=1), -1.0, 1.0)).mean())
    jitter = float(np.abs(np.diff(angles, 2)).mean())
    noise = 1.0 / np.sqrt(float(np.median(folds[:, 7])))
    by_noise = jitter <= UNSURE[0] * noise * float(np.median(angles)) and wiggle <= UNSURE[1] * noise
    return wiggle + 0.5 * jitter <= np.radians(EVEN) or (by_noise and wiggle <= np.radians(WIGGLE))


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
    found = [folds[:, :3] for folds in Tracer(samples, settings).trace()]
    rings = [len(r) > 8 and bool((r[0] == r[-1]).all()) for r in found]
    opened = join_ends([r for r, ring in zip(found, rings, strict=True) if not ring], settings.length)
    opened.sort(key=len, reverse=True)
    return [*((r, False) for r in opened), *((r[:-1], True) for r, ring in zip(found, rings, strict=True) if ring)]


def add_ridges(network: Network, ridges: list[tuple[np.ndarray, bool]]) -> None:
    """Add ridges to a network of lines."""
    for number, (places, ring) in enumerate(ridges, 1):
        step = LINE_STEP * network.length
        points, _ = divide(np.concatenate([places, places[:1]]) if ring else places, ring, step)
        network.add(points, ring, [], name=f"ridge {number}", sharp=True)


def join_ends(ridges: list[np.ndarray], length: float) -> list[np.ndarray]:
    """Lead the ends of ridges that make for each other, or for one corner, together."""
    lines = list(ridges)
    while (pair := _facing(lines, length)) is not None:
        i, at_i, j, at_j = pair
        first = lines[i] if at_i == -1 else lines[i][::-1]
        second = lines[j] if at_j == 0 else lines[j][::-1]
        lines = [line for k, line in enumerate(lines) if k not in (i, j)] + [np.concatenate([first, second])]
    cut = [line[CLEAR:-CLEAR] if len(line) > 2 * CLEAR + 4 else line for line in lines]
    ends = [(i, at, *_end(line, at)) for i, line in enumerate(cut) for at in (0, -1)]
    led: dict[tuple[int, int], np.ndarray] = {}
    for i, at, place, ahead in ends:
        near = [
            (other, way)
            for j, _, other, way in ends
            if j != i and np.linalg.norm(other - place) < 2.0 * CORNER * length and abs(way @ ahead) < STRAIGHT
        ]
        if near:
            meeting = _meeting([(place, ahead), *near])
            if (meeting - place) @ ahead > 0.0 and np.linalg.norm(meeting - place) < CORNER * length:
                led[i, at] = meeting
    return [
        _led(line, short, led.get((i, 0)), led.get((i, -1)))
        for i, (line, short) in enumerate(zip(lines, cut, strict=True))
    ]


def _led(line: np.ndarray, short: np.ndarray, first: np.ndarray | None, last: np.ndarray | None) -> np.ndarray:
    """A ridge with its ends led to corners, from where other sides do not yet blur it; an end without a corner stays."""
    gone = (len(line) - len(short)) // 2
    before = line[:gone] if first is None else first[None]
    after = line[len(line) - gone :] if last is None else last[None]
    return np.concatenate([before, short, after])


def _end(line: np.ndarray, at: int) -> tuple[np.ndarray, np.ndarray]:
    """The place of an end (0 or -1) and the direction in which the line would go on."""
    inner = line[min(4, len(line) - 1)] if at == 0 else line[max(-5, -len(line))]
    ahead = line[at] - inner
    return line[at], ahead / max(float(np.linalg.norm(ahead)), 1e-300)


def _facing(lines: list[np.ndarray], length: float) -> tuple[int, int, int, int] | None:
    """Two ends that make for each other over the smallest gap: (line, end, line, end)."""
    best, pair = BRIDGE * length, None
    ends = [(i, at, *_end(line, at)) for i, line in enumerate(lines) for at in (0, -1)]
    for k, (i, at_i, place, ahead) in enumerate(ends):
        for j, at_j, other, way in ends[k + 1 :]:
            gap = other - place
            size = float(np.linalg.norm(gap))
            straight = min(gap @ ahead, -(gap @ way)) > STRAIGHT * size or (
                size < TOUCH * length and way @ ahead < -STRAIGHT
            )
            if i != j and size < best and straight:
                best, pair = size, (i, at_i, j, at_j)
    return pair


def _meeting(rays: list[tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
    """The place nearest to some lines, each a place and a direction."""
    matrix, right = np.zeros((3, 3)), np.zeros(3)
    for place, ahead in rays:
        across = np.eye(3) - np.outer(ahead, ahead)
        matrix += across
        right += across @ place
    found: np.ndarray = np.linalg.lstsq(matrix, right, rcond=1e-6)[0]
    return found
