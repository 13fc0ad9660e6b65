"""Which member length to take: quick runs try lengths; the first that passes, as the next longer one does, is suggested."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np

from ..check.certify import SURE_PER_SPACING
from ..errors import FrontError
from ..pipeline import grid_from_cloud
from ..scan.member_length import exact_range, length_range, round_length, suggest_length
from ..surface.samples import sample_surface
from ..surface.size_field import measured_bends

if TYPE_CHECKING:
    from ..grid.grid import Grid
    from ..runtime.progress import Progress
    from ..scan.cloud import PointCloud
    from ..settings import Settings

LADDER = (1.0, 1.4, 1 / 1.4, 2.0, 0.5)  # lengths to try until one is found, as multiples of the usual one
NEXT = 1.4  # a length is suggested if that many times it passes too
NEARBY = (1.12, 0.9, 1.25, 0.8, 1.4, 0.7, 1.7, 0.6, 2.0, 0.5)  # lengths to try in place of one that failed
MOST_LOST = 0.01  # share of the scan that may be lost at a length that is suggested
ENOUGH_TIME = 20.0  # time after which no further length is tried [s]
MOST_MEMBERS = 60_000  # most members of a grid made to try a length
CLOSE_BEND = 0.95  # share of the scan with a larger radius of curvature than the one reported


@dataclass(frozen=True, eq=False)
class Trial:
    """The result of trying a member length."""

    length: float  #: [scan unit]
    grid: Grid | None  #: with its certificate; None if there is none
    fault: FrontError | None = None

    @property
    def passed(self) -> bool:
        """Whether there is a grid, and it passes."""
        return self.grid is not None

    @property
    def lost(self) -> float:
        """Share of the scan that the grid does not follow by ScanTruss's own judgement; 1 where there is none."""
        if self.grid is None or self.grid.certificate is None:
            return 1.0
        return self.grid.certificate.judged_out


class Advice:
    """Member lengths of a scan that were tried, each once.

    Parameters
    ----------
    cloud : PointCloud
    settings : Settings
        Of the grid; its length does not matter.
    progress : callable, optional
        ``progress(stage, share)``.
    """

    def __init__(self, cloud: PointCloud, settings: Settings, progress: Progress | None = None) -> None:
        self._cloud, self._progress = cloud, progress
        self._settings = settings.replace(effort="quick", length_field="")
        self._found: dict[float, Trial] = {}
        self._since = perf_counter()

    def try_length(self, length: float) -> Trial | None:
        """Try a length; None if it was not tried: it is out of range, needs too many members, or no time is left."""
        if length in self._found:
            return self._found[length]
        low, high = exact_range(self._cloud)
        if not low * (1 - 1e-9) <= length <= high * (1 + 1e-9):
            return None
        if self._found and perf_counter() - self._since > ENOUGH_TIME:
            return None
        if self.members(length) > MOST_MEMBERS:
            return None
        settings = self._settings.replace(length=length)
        try:
            grid = grid_from_cloud(self._cloud, settings, progress=self._show(length))
            trial = Trial(length, grid)
            made = grid.settings or settings  # what one length needed to pass, the others will need too
            self._settings = self._settings.replace(keep_rods=made.keep_rods, judge_outliers=made.judge_outliers)
        except FrontError as error:
            trial = Trial(length, None, error)
        return self._found.setdefault(length, trial)

    @property
    def settings(self) -> Settings:
        """The settings, with whatever the lengths tried so far needed to pass."""
        return self._settings

    def suggest(self) -> float:
        """Return the length to take: the first of a ladder that passes together with the next longer one, else the first that passes."""
        usual = suggest_length(self._cloud)
        low, high = length_range(self._cloud)
        lengths = list(dict.fromkeys(min(max(_two_digits(share * usual), low), high) for share in LADDER))
        some = usual
        for length in lengths:
            trial = self.try_length(length)
            if trial is None or not trial.passed:
                continue
            some = length if some == usual else some
            above = self.try_length(self.next_above(length))
            if trial.lost <= MOST_LOST and (above is None or (above.passed and above.lost <= MOST_LOST)):
                return length
        first = self._found.get(usual)
        return usual if first is None or first.passed else some

    def nearby(self, length: float) -> float | None:
        """Return the nearest length that passes in place of one that does not; None if none of those tried did."""
        sure = round_length(SURE_PER_SPACING * self._cloud.spacing, "up")
        first = (sure,) if length < sure else ()  # holes in the sampling spoil the others first
        for each in (*first, *(_two_digits(share * length) for share in NEARBY)):
            trial = self.try_length(each)
            if trial is not None and trial.passed:
                return trial.length
        return None

    def next_above(self, length: float) -> float:
        """Return the next longer length to look at."""
        return min(_two_digits(NEXT * length), max(length, length_range(self._cloud)[1]))

    def next_below(self, length: float) -> float:
        """Return the next shorter length to look at."""
        return max(_two_digits(length / NEXT), min(length, length_range(self._cloud)[0]))

    def members(self, length: float) -> int:
        """Return about how many members a grid of a length has."""
        area = sample_surface(self._cloud, self._settings.replace(length=suggest_length(self._cloud))).area
        return round(2.0 * np.sqrt(3.0) * area / length**2)

    def radius(self) -> float:
        """Return the radius of curvature that nearly all of the scan exceeds [scan unit]; inf if it is flat."""
        samples = sample_surface(self._cloud, self._settings.replace(length=suggest_length(self._cloud)))
        bend = float(np.quantile(measured_bends(samples.surface, 1.0), CLOSE_BEND))
        return 1.0 / bend if bend > 0.0 else np.inf

    def _show(self, length: float) -> Callable[[str, float], None]:
        def show(stage: str, share: float) -> None:
            if self._progress:
                self._progress(f"try {length:g}", share)

        return show


def _two_digits(length: float) -> float:
    return round_length(length, "nearest")
