"""Which member length to take: quick grids try lengths; one that passes, as the next longer one does, is suggested.

How much is tried is counted in grids and in points, not in seconds: the same scan gets the same advice.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ..attempts.limit import MOST_RUNS, AttemptLimit, cuts_everywhere, loses_limbs
from ..attempts.table import ROWS_OF_TRIALS, attempts
from ..errors import FrontError, InputError, LengthError, LinesError, OneSidedError, ScanTrussError
from ..pipeline import first_that_passes
from ..scan.member_length import exact_range, length_range, round_length
from ..surface.samples import sample_surface
from ..surface.size_field import measured_bends
from . import ladder
from .following import length_that_follows, shorter_with_next_above
from .length_trial import LengthTrial, settled

if TYPE_CHECKING:
    from ..attempts.table import Attempt
    from ..runtime.progress import Progress
    from ..scan.cloud import PointCloud
    from ..settings import Settings


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
        self._too_long = math.inf  # length at which too much of the scan is on limbs too thin for the members
        self._spent = 0.0  # grids that were made, each counted by its cost
        self.is_spent = False  #: whether a suggestion was looked for
        self._has_table_grids = True  # whether the grids that the table may cost are not yet made
        self._usual = ladder.usual_length(cloud, self._settings)
        self._count_at(self._usual, ladder.MOST_TRIED)

    def _count_at(self, length: float, most: float) -> None:
        """Allow so many grids from now on, or fewer where the scan is large; a shorter length costs more than one that counts once."""
        self._counted_at = length
        self._left = min(most, max(ladder.LEAST_TRIED, ladder.POINTS_LOOKED_AT / self._cost(length)))

    def _cost(self, length: float) -> float:
        """Return what a grid of a length costs, as so many points."""
        return float(len(self._cloud.points) + ladder.POINTS_PER_MEMBER * self.members(length))

    def try_length(self, length: float, most: int = ladder.SOME_MORE) -> LengthTrial | None:
        """Return what comes of a length; None where that was not tried: it is out of range, takes too many members, or enough was tried.

        Parameters
        ----------
        length : float
            [scan unit]
        most : int
            Grids that are made at most in this call; a later one goes on from there.
        """
        known = self._found.get(length)
        if self._is_outdated(length):  # others passed with the outliers judged
            known = None
            del self._begun[length]
        elif known is not None and (known.passed or not known.paused):
            return known
        low, high = exact_range(self._cloud)
        if not low * (1 - 1e-9) <= length <= high * (1 + 1e-9) or self.members(length) > ladder.MOST_MEMBERS:
            return None
        cost = max(1.0, self._cost(length) / self._cost(self._counted_at))
        allowed = min(most - (known.grids if known is not None else 0), int(self._left / cost))
        if allowed < 1:
            return known
        if length not in self._begun:
            settings = self._settings.replace(length=length)
            trials = (replace(each, is_trial=True) for each in attempts(self._cloud, settings, ROWS_OF_TRIALS))
            self._begun[length] = (settings, trials, AttemptLimit())
        settings, tried, limit = self._begun[length]
        before = limit.runs
        takes_all = self._is_nearby or length == self._usual or (self._loses_limbs() and not self._has_table_grids)
        limit.allow(allowed, stops_early=not (takes_all or self.passes))
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
            self._note_lost_limbs(length, error)
            fault = fault or (error if isinstance(error, FrontError) else FrontError(str(error)))
        self._left -= cost * (limit.runs - before)
        self._spent += cost * (limit.runs - before)
        paused = limit.is_paused() and limit.runs > before
        trial = LengthTrial(length, grid, None if grid is not None else fault, limit.runs, paused)
        self._found[length] = trial
        return trial

    def _is_outdated(self, length: float) -> bool:
        """Whether no grid has passed at a length that was tried before the outliers of the scan were judged."""
        if length not in self._begun or (length in self._found and self._found[length].passed):
            return False
        return self._begun[length][0].judge_outliers != self._settings.judge_outliers

    def settle(self) -> None:
        """Begin once as `grid` does at each length at which no quick run passes."""
        self._found = {
            length: settled(trial, self._cloud, self._settings.replace(length=length), self._show(length))
            for length, trial in self._found.items()
        }

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
        passes, if it passes too, or one between the two that passes with what is next above it; else one that passes, if there is
        one with another not far above it that passes too, and rather one that loses little; else the usual length. Where none
        passes, some more are looked at. One that closes openings or loses ridges gives way to one that does not, if that passes and
        loses no more.
        """
        self.is_spent = True
        low, high = length_range(self._cloud)
        both: dict[float, float] = {}  # length -> what is lost there or at the next above
        for share, most in self._ladder():
            length = self._as_tried(min(max(ladder.two_digits(share * self._usual), low), high))
            if most > ladder.A_FEW and self._loses_limbs() and self.passes:
                break  # a shorter length than the usual one keeps them, which more grids seldom do
            if self._is_hopeless():
                break
            if any(trial.loses_limbs and trial.length < length for trial in self.tried):
                continue
            trial = self.try_length(length, most)
            if trial is None or not trial.passed:
                continue
            if self._is_outdated(self._usual):
                usual = self.try_length(self._usual, most)
                trial = usual if usual is not None and usual.passed else trial
                length = trial.length
            above = self.try_length(self.next_above(length), most)
            if above is not None and above.passed:
                both[length] = max(trial.lost, above.lost)
                if both[length] <= ladder.MOST_LOST:
                    return self._following_more(trial)
        if both:
            least = min(both.values())
            most_lost = max(least + ladder.LOST_ALIKE, ladder.LOST_ALIKE_SHARE * least)
            length = self._losing_less(next(length for length, lost in both.items() if lost <= most_lost))
            return self._following_more(self._found[length])
        if not self.passes and ladder.LEAST_TRIED * self._cost(self._usual) < ladder.POINTS_LOOKED_AT:
            self._try_last()
        passing = [trial.length for trial in self.tried if trial.passed]
        if passing:
            left = max(ladder.MOST_IN_ALL - self._spent, ladder.A_FEW)
            self._count_at(self.next_below(passing[0]), min(left, 3 * ladder.A_FEW))
            if (shorter := shorter_with_next_above(self, passing[0])) is not None:
                return shorter
        followed = [one for one in passing if any(one < other <= ladder.NEARLY_NEXT * one for other in passing)]
        complete = [one for one in followed if self._found[one].lost <= ladder.MOST_LOST]
        return min(complete or followed or passing, key=self._far_from_usual, default=self._usual)

    def _is_hopeless(self) -> bool:
        """Whether some lengths were tried, and the grids of all of them are far from passing or fail by their fronts."""
        keeps_limbs = self._too_long == math.inf  # else shorter members may
        enough = keeps_limbs and len(self._begun) >= ladder.HOPELESS_LENGTHS
        return enough and all(limit.all_hopeless for _, _, limit in self._begun.values())

    def _losing_less(self, length: float) -> float:
        """Return the next length below one, at which much is lost, that passes and loses little, if that above it passes at last."""
        shorter = [trial for trial in self.tried if trial.passed and trial.length < length]
        if not shorter or shorter[-1].lost > ladder.MOST_LOST:
            return length
        above = self.next_above(shorter[-1].length)
        self._count_at(above, MOST_RUNS)
        trial = self.try_length(above, MOST_RUNS)
        return shorter[-1].length if trial is not None and trial.passed else length

    def _following_more(self, trial: LengthTrial) -> float:
        """Return the length of a trial that passes, or one that follows what this one does not; see `length_that_follows`."""
        self._count_at(trial.length, ladder.FIRST_TWO * ladder.STEPS_TO_FOLLOW)
        return length_that_follows(self, trial)

    def _try_last(self) -> None:
        """Try more lengths until one passes, with the grids of the table, then those beside the usual one.

        The first are longer than the usual one, as columns are then seen for what they are; where limbs are too thin, some shorter first.
        """
        self._has_table_grids = False
        steps = ladder.LAST_WITH_LIMBS if self._loses_limbs() else ladder.LAST_LENGTHS
        self._count_at(self._usual, ladder.LAST_PER_LENGTH * len(steps))
        self._try_each(
            (min(ladder.two_digits(share * self._usual), length_range(self._cloud)[1]), most) for share, most in steps
        )
        if not self.passes:
            self._try_beside()

    def _try_beside(self) -> None:
        """Try lengths until one passes, where grids and hope are left: that which came nearest, then those beside the usual one.

        Steps as of the table may miss them.
        """
        left = ladder.MOST_IN_ALL - self._spent
        usual = self._begun.get(self._usual)
        if left < ladder.FIRST_TWO or (usual is not None and usual[2].all_hopeless):
            return
        steps = [(ladder.two_digits(share * self._usual), ladder.FIRST_TWO) for share in ladder.BESIDE_USUAL]
        nearest = next((trial for trial in self.tried if trial.paused and trial.has_one_fault), None)
        if nearest is not None:
            steps.insert(0, (nearest.length, nearest.grids + ladder.FIRST_TWO))
        self._count_at(self._usual, min(left, ladder.FIRST_TWO * len(steps)))
        self._try_each(steps)

    def _try_each(self, steps: Iterable[tuple[float, int]]) -> None:
        """Try lengths, with so many grids of each, until one passes."""
        for length, most in steps:
            if (trial := self.try_length(length, most)) is not None and trial.passed:
                return

    def _ladder(self) -> Iterator[tuple[float, int]]:
        """Yield the lengths to try in turn, as multiples of the usual one, with how many grids are made of each.

        That of a thin wall costs most; the next longer one, at which both sides are still apart, is looked at before it takes all of them.
        """
        yield 1.0, ladder.A_FEW
        if (wall := ladder.length_of_wall(self._cloud, self._settings, self._usual)) is not None:
            yield wall / self._usual, ladder.A_FEW
            if not cuts_everywhere(getattr(self._found.get(self._as_tried(wall)), "fault", None)):
                yield ladder.NEXT_LENGTH * wall / self._usual, ladder.FIRST_TWO
        usual = self._tried_usual()
        shorter = usual is not None and (usual.passed or usual.is_too_long)
        first, *others = ladder.SHORTER_FIRST if shorter else ladder.LONGER_FIRST
        steps = [first, *([] if wall is None else [(wall / self._usual, ladder.SOME_MORE)]), *others]
        yield from sorted(steps, key=lambda step: step[1]) if self._loses_limbs() else steps

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

    def nearby(self, length: float, refused: ScanTrussError | None = None) -> float | None:
        """Return the nearest length that passes in place of one that does not, or the usual one; None where none of those tried does.

        For a length far too short the usual one is tried alone. None is tried that is longer than one whose limbs are too thin.

        refused : why no grid of that length passes
        """
        self._is_nearby = True
        if refused is not None:
            self._note_lost_limbs(length, refused)
        low, high = length_range(self._cloud)
        if length < ladder.FAR_TOO_SHORT * low:
            return self._usual_if_it_passes()
        at = min(max(length, low), high)
        lengths = {min(max(ladder.two_digits(share * at), low), high) for share in (1.0, *ladder.NEARBY_LENGTHS)} - {
            length
        }
        if (sure := round_length(ladder.SURE_PER_SPACING * self._cloud.spacing, "up")) > length and sure < high:
            lengths.add(sure)
        self._count_at(at, ladder.MOST_TRIED - ladder.TRIED_USUAL)
        for most in (ladder.FIRST_TWO, ladder.A_FEW, ladder.SOME_MORE):
            hopeless = {True: 0, False: 0}  # shorter and longer lengths in a row
            for each in sorted(lengths, key=lambda other: (abs(np.log(other / length)), other)):
                is_shorter = each < length
                if each > self._too_long or hopeless[is_shorter] == ladder.HOPELESS_NEARBY:
                    continue
                trial = self.try_length(each, most=most)
                if trial is not None and trial.passed:
                    return trial.length
                is_hopeless = each in self._begun and self._begun[each][2].all_hopeless
                hopeless[is_shorter] = hopeless[is_shorter] + 1 if is_hopeless else 0
            if min(hopeless.values()) == ladder.HOPELESS_NEARBY:
                break
        usual = self._usual_if_it_passes()
        return None if usual is None else self._nearer(usual, at)

    def _note_lost_limbs(self, length: float, fault: ScanTrussError) -> None:
        """Note a length at which more of the scan than may be missing is on limbs too thin for its members."""
        if loses_limbs(self._settings, fault):
            self._too_long = min(self._too_long, length)

    def _usual_if_it_passes(self) -> float | None:
        self._count_at(self._usual, ladder.TRIED_USUAL)
        trial = self.try_length(self._usual, most=ladder.A_FEW)
        return trial.length if trial is not None and trial.passed else None

    def _nearer(self, passing: float, length: float) -> float:
        """Return the last of lengths that pass, in steps from one towards another, which is far away."""
        self._count_at(passing, ladder.TRIED_AROUND)
        steps = int(abs(math.log(length / passing)) / math.log(ladder.NEXT_LENGTH))
        for _ in range(steps):
            following = self.next_above(passing) if passing < length else self.next_below(passing)
            trial = self.try_length(following, ladder.FIRST_TWO)
            if trial is None or not trial.passed:
                break
            passing = trial.length
        return passing

    def next_above(self, length: float) -> float:
        """Return the next longer length to look at."""
        return self._as_tried(
            min(ladder.two_digits(ladder.NEXT_LENGTH * length), max(length, length_range(self._cloud)[1]))
        )

    def next_below(self, length: float) -> float:
        """Return the next shorter length to look at."""
        return self._as_tried(
            max(ladder.two_digits(length / ladder.NEXT_LENGTH), min(length, length_range(self._cloud)[0]))
        )

    def _as_tried(self, length: float) -> float:
        """Return the length that was tried already and is nearly the same, or else the same."""
        nearest = min(self._found, key=lambda tried: abs(math.log(tried / length)), default=length)
        return nearest if abs(math.log(nearest / length)) <= math.log(ladder.SAME_LENGTH) else length

    def around(self, length: float) -> list[float]:
        """Try the lengths of a table, one grid each, and return them: one, the two below and the two above."""
        below, above = self.next_below(length), self.next_above(length)
        table = list(dict.fromkeys((self.next_below(below), below, length, above, self.next_above(above))))
        if self._has_table_grids:
            self._count_at(length, ladder.TRIED_AROUND)
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
    def wall(self) -> tuple[float, float]:
        """How thick the walls are that are thinner than the usual length [scan unit], and their share of the scan."""
        return ladder.thin_wall(self._cloud, self._settings, self._usual)

    @cached_property
    def radius(self) -> float:
        """The radius to which nearly all of the scan is bent less [scan unit]; inf where all is flat."""
        samples = sample_surface(self._cloud, self._settings.replace(length=self._usual))
        bend = float(np.quantile(measured_bends(samples.surface), ladder.CLOSE_BEND))
        return 1.0 / bend if bend > 0.0 else np.inf

    def _show(self, length: float) -> Callable[[str, float], None]:
        def show(stage: str, share: float) -> None:
            if self._progress:
                self._progress(f"try {length:g}", share)

        return show
