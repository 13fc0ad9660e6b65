"""Which member length to take: quick grids try lengths; one that passes, as the next longer one does, is suggested.

How much is tried is counted in grids and in points, not in seconds: the same scan gets the same advice.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ..attempts.limit import AttemptLimit
from ..attempts.table import attempts
from ..errors import FrontError, InputError, LengthError, LinesError, OneSidedError
from ..pipeline import first_that_passes
from ..scan.member_length import exact_range, length_range, round_length, suggest_length
from ..surface.samples import sample_surface
from ..surface.shape import wall_of_surface
from ..surface.size_field import measured_bends
from .length_trial import LengthTrial

if TYPE_CHECKING:
    from ..attempts.table import Attempt
    from ..runtime.progress import Progress
    from ..scan.cloud import PointCloud
    from ..settings import Settings

# grids that are made of a length before others are tried: where many are to be tried, usually, and when it is tried again
FIRST_TWO, A_FEW, SOME_MORE = 2, 4, 8
#: lengths to try in turn after the usual one, as multiples of it, with how many grids are made of each
LONGER_FIRST = (
    (1.4, A_FEW), (2.0, A_FEW), (2.8, A_FEW), (1 / 1.4, A_FEW), (2.0, SOME_MORE), (1.4, SOME_MORE), (1.0, SOME_MORE),
    (2.8, SOME_MORE), (0.5, A_FEW),
)  # fmt: skip
#: the same where the usual one passes, or leaves out much: members are too long for thin parts rather than too short
SHORTER_FIRST = (
    (1 / 1.4, A_FEW), (1.4, A_FEW), (1.0, SOME_MORE), (0.5, A_FEW), (2.0, A_FEW), (1 / 1.4, SOME_MORE), (1.4, SOME_MORE),
    (2.8, A_FEW), (2.0, SOME_MORE),
)  # fmt: skip
LAST_LENGTHS = (1.4, 2.0, 2.8)  # lengths that are tried where none has passed, as multiples of the usual one
NEARLY_NEXT = 1.45  # ratio of lengths that pass up to which the longer one stands for the next to the shorter
LINES_OF_A_SCANNER = 5  # fewest lines of points that may be those of a scanner
NEXT_LENGTH = 1.4  # a length is suggested if that many times it passes too
SAME_LENGTH = 1.03  # ratio of lengths up to which what has come of one stands for the other
# lengths that are tried in place of one that failed
NEARBY_LENGTHS = (1.12, 0.9, 1.25, 0.8, 1.4, 0.7, 1.7, 0.6, 2.0, 0.5, 2.8)
# spacings in a member from which holes in the sampling are seldom taken for holes of the surface
SURE_PER_SPACING = 8.0
LENGTH_OF_WALL = 0.8  # of the thickness of a wall: at 1.4 times that, too, both of its sides are kept apart
MOSTLY_WALL = 0.4  # share of a scan on a thin wall from which on lengths are chosen for that
LEAST_OF_WALL = 5.0  # least length for a wall, in spacings
LOST_ALIKE = 0.002  # share of the scan up to which lengths lose as much as one another
MOST_LOST = 0.01  # share of the scan that may be lost at a length that is suggested
MOST_TRIED = 20.0  # grids that are made for a suggestion, or to find a length nearby, each counted by its cost
POINTS_LOOKED_AT = 2_000_000  # points that are looked at for that
LEAST_TRIED = 5.0  # grids that are made for that even where the scan has more points
TRIED_AROUND = 6.0  # grids that are made besides for the lengths of the table, one each
TRIED_LONGER = 2  # grids that are made of each longer length where no other has passed, of those for the table
# lengths that are tried then where none of these passes, as multiples of the usual one
BESIDE_USUAL = (1.12, 0.9, 1.25)
TRIED_USUAL = 4.0  # grids that are made at the usual length where no length nearby passes and it is far away
FAR_TOO_SHORT = 0.2  # share of the shortest possible length below which the usual one is looked at alone: that length is in another unit
POINTS_PER_MEMBER = 9  # points that cost as much as a member of the grid
MOST_MEMBERS = 60_000  # members of a grid that is made to try a length
CLOSE_BEND = 0.95  # share of the scan that is less bent than the radius that is named


class Advice:
    """Member lengths of a scan that were tried: each first by what usually gives a grid, then by all that may.

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
        self._is_nearby = False  #: whether a length in place of one that the settings suit is looked for
        self._found: dict[float, LengthTrial] = {}
        self._begun: dict[
            float, tuple[Settings, Iterator[Attempt], AttemptLimit]
        ] = {}  # what is left to try of each length
        self._spent = 0.0  # grids that were made, each counted by its cost
        self.is_spent = False  #: whether a suggestion was looked for
        self._has_table_grids = True  # whether the grids that the table may cost are not yet made
        self._usual = self._usual_length()
        self._count_at(self._usual, MOST_TRIED)

    def _usual_length(self) -> float:
        """Return the length that suits the scan; where the lines of a scanner are too far apart for it, the next that sees a surface.

        Raises
        ------
        LinesError
            The points lie along lines at every length, or along so few that these are none of a scanner.
        """
        usual, (_, longest) = suggest_length(self._cloud), length_range(self._cloud)
        steps = math.ceil(math.log(max(longest / usual, 1.0), NEXT_LENGTH))
        refused: LinesError | None = None
        for step in range(steps + 1):
            length = usual if step == 0 else min(_two_digits(usual * NEXT_LENGTH**step), longest)
            try:
                sample_surface(self._cloud, self._settings.replace(length=length))
            except LinesError as error:
                refused = refused or error
                if refused.lines < LINES_OF_A_SCANNER:
                    break
            else:
                return length
        assert refused is not None
        raise refused

    def _count_at(self, length: float, most: float) -> None:
        """Allow so many grids from now on, or fewer where the scan is large; a shorter length costs more than one that counts once."""
        self._counted_at = length
        self._left = min(most, max(LEAST_TRIED, POINTS_LOOKED_AT / self._cost(length)))

    def _cost(self, length: float) -> float:
        """Return what a grid of a length costs, as so many points."""
        return float(len(self._cloud.points) + POINTS_PER_MEMBER * self.members(length))

    def try_length(self, length: float, most: int = SOME_MORE) -> LengthTrial | None:
        """Return what comes of a length; None where that was not tried: it is out of range, takes too many members, or enough was tried.

        Parameters
        ----------
        length : float
            [scan unit]
        most : int
            Grids that are made at most in this call; a later one goes on from there.
        """
        known = self._found.get(length)
        if known is not None and (known.passed or not known.paused):
            return known
        low, high = exact_range(self._cloud)
        if not low * (1 - 1e-9) <= length <= high * (1 + 1e-9) or self.members(length) > MOST_MEMBERS:
            return None
        cost = max(1.0, self._cost(length) / self._cost(self._counted_at))
        allowed = min(most - (known.grids if known is not None else 0), int(self._left / cost))
        if allowed < 1:
            return known
        if length not in self._begun:
            settings = self._settings.replace(length=length)
            trials = (replace(each, is_trial=True) for each in attempts(self._cloud, settings))
            self._begun[length] = (settings, trials, AttemptLimit())
        settings, tried, limit = self._begun[length]
        before = limit.runs
        limit.allow(allowed)
        grid, fault = None, known.fault if known is not None else None
        try:
            grid = first_that_passes(self._cloud, settings, tried, limit=limit, progress=self._show(length))
            made = grid.settings or settings  # what one length needed to pass, the others will need too
            self._settings = self._settings.replace(
                keep_rods=made.keep_rods,
                judge_outliers=made.judge_outliers,
                sharp_edges=made.sharp_edges,
                plain_body=made.plain_body,
                thin_walls=made.thin_walls,
            )
        except (FrontError, InputError) as error:
            if not isinstance(error, (FrontError, LengthError, LinesError, OneSidedError)) and not self._is_nearby:
                raise  # a setting that suits no length
            fault = fault or (error if isinstance(error, FrontError) else FrontError(str(error)))
        self._left -= cost * (limit.runs - before)
        self._spent += cost * (limit.runs - before)
        paused = limit.is_paused() and limit.runs > before
        trial = LengthTrial(length, grid, None if grid is not None else fault, limit.runs, paused)
        self._found[length] = trial
        return trial

    @property
    def settings(self) -> Settings:
        """The settings, with whatever the lengths tried so far needed to pass."""
        return self._settings

    @property
    def tried(self) -> list[LengthTrial]:
        """What came of the lengths that were tried, the shortest first."""
        return [self._found[length] for length in sorted(self._found)]

    @property
    def passes(self) -> bool:
        """Whether a grid passes at any length that was tried."""
        return any(trial.passed for trial in self._found.values())

    def suggest(self) -> float:
        """Return the length to take.

        It is the first of those tried in turn that passes with what is next above it, both without much of the scan lost; else of
        those that pass with what is next above them the first that loses hardly more than the least; else the next below one that
        passes, if it passes too; else one that passes, if there is one with another not far above it that passes too; else the usual
        length. Where none passes, longer ones are looked at once more, then those beside the usual one. One that closes openings or
        loses ridges gives way to the next below it, if that passes, does neither more and loses no more.
        """
        self.is_spent = True
        low, high = length_range(self._cloud)
        both: dict[float, float] = {}  # length -> what is lost there or at the next above
        for share, most in self._ladder():
            length = min(max(_two_digits(share * self._usual), low), high)
            if most > A_FEW and self._loses_limbs() and self.passes:
                break  # a shorter length than the usual one keeps them, which more grids seldom do
            if any(trial.loses_limbs and trial.length < length for trial in self.tried):
                continue
            trial = self.try_length(length, most)
            if trial is None or not trial.passed:
                continue
            above = self.try_length(self.next_above(length), most)
            if above is not None and above.passed:
                both[length] = max(trial.lost, above.lost)
                if both[length] <= MOST_LOST:
                    return self._following_more(trial)
        if both:
            least = min(both.values())
            return next(length for length, lost in both.items() if lost <= least + LOST_ALIKE)
        if not self.passes:
            self._try_longer()
        if not self.passes:
            self._try_beside()
        passing = [trial.length for trial in self.tried if trial.passed]
        if passing:
            below = self.next_below(passing[0])
            self._count_at(below, A_FEW)
            trial = self.try_length(below, A_FEW)
            if trial is not None and trial.passed and passing[0] <= NEARLY_NEXT * below:
                return below
        followed = [one for one in passing if any(one < other <= NEARLY_NEXT * one for other in passing)]
        return min(followed or passing, key=self._far_from_usual, default=self._usual)

    def _following_more(self, trial: LengthTrial) -> float:
        """Return the length of a trial that passes, or the next below it if that follows what this one does not, and loses no more.

        That is openings which this one closes, or ridges which it loses.
        """
        below = self.next_below(trial.length)
        shorter = self.try_length(below, A_FEW) if trial.follows_less and below < trial.length else None
        if shorter is None or not shorter.passed or shorter.lost > trial.lost + LOST_ALIKE:
            return trial.length
        return below if shorter.follows_less < trial.follows_less else trial.length

    def _try_longer(self) -> None:
        """Try longer lengths than the usual one until one passes, with the grids of the table: columns are then seen for what they are.

        Not of a scan so large that fewer grids are made.
        """
        if LEAST_TRIED * self._cost(self._usual) >= POINTS_LOOKED_AT:
            return
        self._count_at(self._usual, TRIED_AROUND)
        self._has_table_grids = False
        for share in LAST_LENGTHS:
            length = min(_two_digits(share * self._usual), length_range(self._cloud)[1])
            trial = self.try_length(length, TRIED_LONGER)
            if trial is not None and trial.passed:
                return

    def _try_beside(self) -> None:
        """Try lengths beside the usual one until one passes, of a scan that leaves grids for it: steps as of the table may miss it."""
        left = MOST_TRIED + TRIED_AROUND - self._spent
        if left < FIRST_TWO or LEAST_TRIED * self._cost(self._usual) >= POINTS_LOOKED_AT:
            return
        self._count_at(self._usual, min(left, FIRST_TWO * len(BESIDE_USUAL)))
        for share in BESIDE_USUAL:
            trial = self.try_length(_two_digits(share * self._usual), FIRST_TWO)
            if trial is not None and trial.passed:
                return

    def _ladder(self) -> Iterator[tuple[float, int]]:
        """Yield the lengths to try in turn, as multiples of the usual one, with how many grids are made of each.

        That of a thin wall costs most; the next longer one, at which both sides are still apart, is looked at before it takes all of them.
        """
        yield 1.0, A_FEW
        if (wall := self._length_of_wall()) is not None:
            yield wall / self._usual, A_FEW
            yield NEXT_LENGTH * wall / self._usual, FIRST_TWO
            yield wall / self._usual, SOME_MORE
        usual = self._tried_usual()
        ladder = SHORTER_FIRST if usual is not None and (usual.passed or usual.leaves_out) else LONGER_FIRST
        yield from sorted(ladder, key=lambda step: step[1]) if self._loses_limbs() else ladder

    def _length_of_wall(self) -> float | None:
        """Return the length that keeps both sides of a thin wall apart, as of a bowl; None where there is none, or too few points."""
        half = max(0.5 * self._usual, length_range(self._cloud)[0])
        samples = sample_surface(self._cloud, self._settings.replace(length=half))
        thickness, share = wall_of_surface(samples, self._usual)
        length = LENGTH_OF_WALL * thickness
        return length if share >= MOSTLY_WALL and length >= LEAST_OF_WALL * self._cloud.spacing else None

    def _tried_usual(self) -> LengthTrial | None:
        """Return what came of the usual length, or of that tried which is nearest to it."""
        return self._found.get(min(self._found, key=self._far_from_usual)) if self._found else None

    def _loses_limbs(self) -> bool:
        """Whether limbs are too thin for the usual length."""
        usual = self._tried_usual()
        return usual is not None and usual.loses_limbs

    def _far_from_usual(self, length: float) -> float:
        """Return how far a length is from the usual one."""
        return abs(float(np.log(length / self._usual)))

    def nearby(self, length: float) -> float | None:
        """Return the nearest length that passes in place of one that does not, or the usual one; None where none of those tried does.

        For a length far too short the usual one is tried alone.
        """
        self._is_nearby = True
        low, high = length_range(self._cloud)
        if length < FAR_TOO_SHORT * low:
            return self._usual_if_it_passes()
        at = min(max(length, low), high)
        lengths = {min(max(_two_digits(share * at), low), high) for share in (1.0, *NEARBY_LENGTHS)} - {length}
        if (sure := round_length(SURE_PER_SPACING * self._cloud.spacing, "up")) > length and sure < high:
            lengths.add(sure)
        self._count_at(at, MOST_TRIED)
        for most in (FIRST_TWO, A_FEW, SOME_MORE):
            for each in sorted(lengths, key=lambda other: (abs(np.log(other / length)), other)):
                trial = self.try_length(each, most=most)
                if trial is not None and trial.passed:
                    return trial.length
        if not min(lengths, default=at) <= self._usual <= max(lengths, default=at):  # then this is cheap, or worth it
            usual = self._usual_if_it_passes()
            return None if usual is None else self._nearer(usual, at)
        return None

    def _usual_if_it_passes(self) -> float | None:
        self._count_at(self._usual, TRIED_USUAL)
        trial = self.try_length(self._usual, most=A_FEW)
        return trial.length if trial is not None and trial.passed else None

    def _nearer(self, passing: float, length: float) -> float:
        """Return the last of lengths that pass, in steps from one towards another, which is far away."""
        self._count_at(passing, TRIED_AROUND)
        steps = int(abs(math.log(length / passing)) / math.log(NEXT_LENGTH))
        for _ in range(steps):
            following = self.next_above(passing) if passing < length else self.next_below(passing)
            trial = self.try_length(following, FIRST_TWO)
            if trial is None or not trial.passed:
                break
            passing = trial.length
        return passing

    def next_above(self, length: float) -> float:
        """Return the next longer length to look at."""
        return self._as_tried(min(_two_digits(NEXT_LENGTH * length), max(length, length_range(self._cloud)[1])))

    def next_below(self, length: float) -> float:
        """Return the next shorter length to look at."""
        return self._as_tried(max(_two_digits(length / NEXT_LENGTH), min(length, length_range(self._cloud)[0])))

    def _as_tried(self, length: float) -> float:
        """Return the length that was tried already and is nearly the same, or else the same."""
        nearest = min(self._found, key=lambda tried: abs(math.log(tried / length)), default=length)
        return nearest if abs(math.log(nearest / length)) <= math.log(SAME_LENGTH) else length

    def around(self, length: float) -> list[float]:
        """Try the lengths of a table, one grid each, and return them: one, the two below and the two above."""
        below, above = self.next_below(length), self.next_above(length)
        table = list(dict.fromkeys((self.next_below(below), below, length, above, self.next_above(above))))
        if self._has_table_grids:
            self._count_at(length, TRIED_AROUND)
        for each in sorted(table, key=lambda other: (other < length, abs(np.log(other / length)))):
            self.try_length(each, most=1)
        return table

    def members(self, length: float) -> int:
        """Return about how many members a grid of a length has."""
        return round(2.0 * np.sqrt(3.0) * self._area / length**2)

    @cached_property
    def _area(self) -> float:
        """Rough area of the scan [scan unit^2]."""
        return sample_surface(self._cloud, self._settings.replace(length=self._usual)).area

    @cached_property
    def radius(self) -> float:
        """The radius to which nearly all of the scan is bent less [scan unit]; inf where all is flat."""
        samples = sample_surface(self._cloud, self._settings.replace(length=self._usual))
        bend = float(np.quantile(measured_bends(samples.surface), CLOSE_BEND))
        return 1.0 / bend if bend > 0.0 else np.inf

    def _show(self, length: float) -> Callable[[str, float], None]:
        def show(stage: str, share: float) -> None:
            if self._progress:
                self._progress(f"try {length:g}", share)

        return show


def _two_digits(length: float) -> float:
    return round_length(length, "nearest")
