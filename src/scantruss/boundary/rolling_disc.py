"""A disc rolled along the edge of the scan: the loops of samples that it touches (Sec. 3.3)."""

from __future__ import annotations

import weakref
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..errors import FrontError
from ..kernels.boundary import loops as kernels
from ..kernels.surface.local_surface import Surface
from ..runtime.parallel import in_parts
from ..runtime.watch import Watch
from ..scan.normals import NORMALS_PER_THREAD
from ..scan.vectors import dots
from ..surface.scratch import with_own_scratch
from .curves import length_around

if TYPE_CHECKING:
    from ..surface.samples import SurfaceSamples

NO_FREE_DIRECTION = 9.0  # stands for no free direction
# touches that are expected however few samples are at the edge: a disc that is caught may be tried again many times
FEWEST_TOUCHES = 500
MOST_TOUCHES = 200.0  # times that the disc may touch each sample at the edge, on average
ROUND_AND_ROUND = "the boundary cannot be followed: the scan is too rough or too sparse for this length; use another, or clean the scan"
MOST_TRIES = 20  # attempts to roll the disc away from one place
SHORTEST_OPEN_LOOP = 30.0  # a loop shorter than this that does not close is dropped [disc radii]


class Rolled(NamedTuple):
    """A loop of samples along which a disc rolled."""

    samples: np.ndarray  #: (H,) in order
    piece: int  #: that they bound


_Loops = tuple[list[Rolled], list[Rolled]]
_KEPT: weakref.WeakKeyDictionary[SurfaceSamples, dict[tuple[float, float], _Loops | FrontError]] = (
    weakref.WeakKeyDictionary()
)


def loops_of_samples(samples: SurfaceSamples, surface: Surface, radius: float, least: float) -> _Loops:
    """Return what `boundary_loops` does for samples, or why it fails; kept for as long as the samples exist."""
    kept = _KEPT.setdefault(samples, {})
    if (radius, least) not in kept:
        try:
            kept[radius, least] = boundary_loops(
                surface, samples.piece, samples.kept, radius, least, samples.on_edge, samples.origin
            )
        except FrontError as error:  # without its traceback, which would keep the samples
            kept[radius, least] = FrontError(str(error), where=error.where)
    found = kept[radius, least]
    if isinstance(found, FrontError):
        raise FrontError(str(found), where=found.where)
    return found


def boundary_loops(
    surface: Surface,
    piece: np.ndarray,
    wanted: np.ndarray,
    radius: float,
    least: float,
    on_edge: np.ndarray,
    origin: np.ndarray,
) -> _Loops:
    """Return the loops of wanted samples (S,) bool that the rolled disc touches: those that are kept, and those no longer than `least`."""
    free = np.empty(len(surface.mean))
    radii = disc_radii(surface, radius)

    def look(part: int, begin: int, end: int) -> None:
        own = surface if part == 0 else with_own_scratch(surface)
        kernels.free_directions(own, radii, np.radians(75.0), free, begin, end)

    in_parts(len(free), NORMALS_PER_THREAD, look)
    free[~wanted] = NO_FREE_DIRECTION
    beside = surface.neighbors[on_edge]
    free[on_edge], free[beside[beside >= 0]] = NO_FREE_DIRECTION, NO_FREE_DIRECTION
    rolling = _RollingDisc(surface, radii, int((free < NO_FREE_DIRECTION).sum()), origin)
    loops, short, closed = list[Rolled](), list[Rolled](), np.zeros(len(free), np.bool_)
    for sample in np.flatnonzero(free < NO_FREE_DIRECTION).tolist():
        if rolling.following[sample] >= 0:
            continue
        loop = rolling.loop_at(sample, free[sample], radius)
        if len(loop) < 3 or length_around(surface.mean[loop]) <= least:  # a small gap is closed over
            if len(loop) >= 3 and not closed[loop].any():
                short.append(Rolled(loop, int(piece[loop[0]])))
            closed[loop] = True
            continue
        loop = np.roll(loop, -int(loop.argmin()))  # the same wherever the disc began
        fresh = rolling.following[loop] < 0
        rolling.following[loop], rolling.preceding[loop] = np.roll(loop, -1), np.roll(loop, 1)
        if fresh.mean() > 0.5:
            loops.append(Rolled(loop, int(piece[loop[0]])))
    return loops, short


class _RollingDisc:
    """The disc rolled from one sample after the other, and what it has touched."""

    def __init__(self, surface: Surface, radii: np.ndarray, free: int, origin: np.ndarray) -> None:
        count = len(surface.mean)
        self.origin, self.watch = origin, Watch(ROUND_AND_ROUND, FEWEST_TOUCHES + free, MOST_TOUCHES)
        self.surface, self.radii = surface, radii
        self.mirrored = surface._replace(normals=-surface.normals)
        self.path = np.empty(4 * (FEWEST_TOUCHES + free), np.int64)
        self.following, self.preceding, self.visit = (np.full(count, -1, np.int64) for _ in range(3))
        self.banned = np.zeros(count, np.bool_)

    def loop_at(self, sample: int, direction: float, radius: float) -> np.ndarray:
        """Samples of the loop that comes back to its start, empty if there is none.

        A disc that crosses from sheet to sheet may be caught in another loop. Rolled the other way round it seldom crosses at the
        same place, so that way is tried next; then the samples that caught it are left out.
        """
        centre = kernels.sample_disc(self.surface, sample, direction, self.radii[sample])
        means = self.surface.mean
        for _ in range(MOST_TRIES):
            ahead = self._roll(self.surface, sample, centre, self.following)
            if self._is_near(ahead, sample, radius):
                return ahead
            touched = np.flatnonzero(self.following >= 0)
            if len(ahead) == 0 and self._is_near(touched, sample, radius):
                break
            back = self._roll(self.mirrored, sample, centre, self.preceding)[::-1]
            if self._is_near(back, sample, radius):
                return back
            if len(ahead) == 0 or length_around(means[ahead]) > SHORTEST_OPEN_LOOP * radius:
                return ahead
            self.banned[ahead[ahead != sample]] = True
        return np.zeros(0, np.int64)

    def _roll(self, surface: Surface, sample: int, centre: tuple[float, float, float], seen: np.ndarray) -> np.ndarray:
        """Samples of the loop that the disc ends up in; empty if it falls off or meets an earlier loop."""
        own = self.radii, self.path, seen, self.visit, self.banned
        first, last, steps = kernels.roll_disc(surface, sample, centre, *own)
        self.watch.note(steps, surface.mean[sample] + self.origin)
        return self.path[first:last].copy()

    def _is_near(self, samples: np.ndarray, sample: int, radius: float) -> bool:
        """Whether any of the samples lies within two radii of a sample."""
        away = self.surface.mean[samples] - self.surface.mean[sample]
        return len(samples) > 0 and float(np.linalg.norm(away, axis=1).min()) < 2.0 * radius


def disc_radii(surface: Surface, radius: float) -> np.ndarray:
    """Radius of the disc at each sample (S,): larger where the scan is sparse, so that it does not fall between the points."""
    sixth = surface.neighbors[:, 5]
    arm = surface.mean[sixth] - surface.mean
    gap = np.sqrt(dots(arm, arm))
    radii = np.where(sixth >= 0, np.maximum(radius, 0.75 * gap), radius)
    wide = np.flatnonzero(radii > radius)
    around = surface.neighbors[wide]
    np.maximum.at(radii, around[around >= 0], np.repeat(radii[wide], (around >= 0).sum(axis=1)))
    return radii
