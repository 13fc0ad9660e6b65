"""The course of the attempts at one grid: which comes next, and what has come of them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import chain
from typing import TYPE_CHECKING

from ..check.limits import with_ridges_given_up, with_ridges_lost
from ..errors import CertificateError, FrontError, OneSidedError, ScanTrussError
from .better import (
    MISSING_ALIKE,
    doubts_ridges,
    follows_more,
    follows_more_edges,
    gaps_spanned,
    is_better_without_ridges,
)
from .limit import (
    AttemptLimit,
    fails_as_sparse,
    fails_by_front,
    joins_sheets,
    loses_limbs,
    only_leaves_out,
    only_sparse,
)
from .looks import (
    AskedScan,
    breaks_limb,
    jumps_between_walls,
    keeps_columns,
    runs_along_rods,
    stands_on_columns,
)
from .lost_ridges import lost_ridges
from .moved_corners import with_moved_corners
from .table import (
    AS_ASKED,
    PLAIN_BODY,
    PLAIN_NEAR_FAULTS,
    SECOND_LAYOUT,
    TIMES_OF_PLAINER,
    Attempt,
    attempts,
    judging_outliers,
    layouts_of,
)

if TYPE_CHECKING:
    from ..grid.grid import Grid
    from ..scan.cloud import PointCloud
    from ..settings import Settings

LEAST_EFFORT = "quick"
WITHOUT_RODS = "passes, but along rods: without them"
BETWEEN_WALLS = "passes, but jumps between thin walls: with their sides distinguished"
CUTS_ACROSS_EDGES = "passes, but cuts across edges: with sharp edges looked at"
BREAKS_LIMB = "the grid is torn at a limb thinner than its members"
RIDGES_GIVEN_UP = "ridges given up near the faults"
WITHOUT_DOUBTFUL_RIDGES = "passes, but with ridges that may be none: without any"
WITH_LEAST_EFFORT = "passes, but without what is taken for limbs and slits: as asked, with the least effort"
# rows of grids that pass before the sides of walls were ever distinguished, or sharp edges looked at
TRIED_FIRST = (AS_ASKED, RIDGES_GIVEN_UP)

# attempts that are made after one that passes, and when their grids are taken in its place
IS_BETTER = {
    BETWEEN_WALLS: follows_more,
    CUTS_ACROSS_EDGES: follows_more_edges,
    WITHOUT_DOUBTFUL_RIDGES: is_better_without_ridges,
    WITH_LEAST_EFFORT: follows_more,
}


class AttemptCourse:
    """The attempts in their turn, and what follows from what came of them.

    What follows is put in next, each by one law:

    - `RIDGES_GIVEN_UP`: an attempt fails near ridges; each gives up one place more at least, of `FAULTS_WITHOUT_RIDGES`.
    - `PLAIN_NEAR_FAULTS`: before the plain body is tried, the first attempt again without the thin limbs and slits near its faults; then
      without those near the faults of that too, `TIMES_OF_PLAINER` at most.
    - `WITHOUT_RODS`: a grid passes but runs along rods; once, as the last attempt. That with fewer warnings is taken, or that without
      them where it spans fewer gaps or they are columns of a shell: a grid around some of them is no part of it.
    - outliers judged: a grid fails as points too far apart lie on much of the surface; the attempt again and all after it with these
      points judged, as most may be outliers, once. None passes without.
    - `BETWEEN_WALLS`: the first grid passes but may jump between the sides of thin walls; once, as the last attempt. That which follows
      more of the scan is taken.
    - `CUTS_ACROSS_EDGES`: a grid passes but cuts across edges of a body with sharp ones; once, as the last attempt. That is taken which
      follows more of them, if it is no poorer and hardly farther from the scan.
    - `WITHOUT_DOUBTFUL_RIDGES`: a grid passes with ridges given up or broken off, as along a round tube, or with uneven members, as along
      bones; once, as the last attempt. It is taken where it is far evener and hardly farther from the scan.
    - `WITH_LEAST_EFFORT`: only the plain body passes, and leaves out a part of the scan; as asked with the least effort, as the last
      attempt, with ridges given up where it fails near them. That which follows more of the scan is taken: more effort never gives less.
    - least effort: none passes, and sheets are not too near each other; all attempts again, once: more effort never gives less. All but
      the first are left out that fail by their one front, which is the same with any effort, or by the limbs that were cut off before it.

    Parameters
    ----------
    cloud : PointCloud
    settings : Settings
        Those that were asked for.
    tried : iterable of Attempt, optional
        The attempts in their order, where it is not the table from its begin; they may be what an earlier course has left.
    limit : AttemptLimit, optional
        How many are worth making.
    """

    def __init__(
        self,
        cloud: PointCloud,
        settings: Settings,
        tried: Iterable[Attempt] | None = None,
        limit: AttemptLimit | None = None,
    ) -> None:
        self._cloud = cloud
        self._refused: FrontError | None = None  # fault of the effort asked for, where the least is tried
        self._begin(settings, attempts(cloud, settings) if tried is None else tried, limit or AttemptLimit())

    def _begin(self, settings: Settings, tried: Iterable[Attempt], limit: AttemptLimit) -> None:
        self._settings, self._tried, self._limit = settings, iter(tried), limit
        self._faults: list[ScanTrussError] = []  # of attempts with the settings asked for
        self._advice = ""
        self._follows: Attempt | None = None  # what is put in next
        self._row_begun: Attempt | None = None  # the attempt of the table that those put in follow
        self._first_fault: FrontError | None = None  # of that attempt
        self._times_plainer = 0  # times that limbs and slits near faults were left aside
        self._fails_by_front = True  # whether that attempt and all that followed it do
        self._passed: Grid | None = None
        self._around_columns = False  # whether that is a grid around columns

    def __iter__(self) -> Iterator[Attempt]:
        """Yield each attempt, once what came of the one before was noted by `passed` or `failed`."""
        # ends: the list ends, a place of ridges is given up once, rods are left out once, the effort is lowered once
        while attempt := self._next():
            self._limit.begin()
            yield attempt

    def _next(self) -> Attempt | None:
        """Return the attempt that comes next; None at the end."""
        if self._follows is not None:
            follows, self._follows = self._follows, None
            return follows
        if self._passed is not None:
            return None
        attempt = self._next_listed()
        if attempt is None and self._tries_least_effort():
            settings = self._settings.replace(effort=LEAST_EFFORT)
            self._begin(settings, attempts(self._cloud, settings), AttemptLimit(self._limit))
            attempt = self._next_listed()
        return attempt

    def _next_listed(self) -> Attempt | None:
        """Return the next attempt of the list that is worth making."""
        # ends: the list does
        while self._limit.any_left() and (attempt := next(filter(self._limit.allows, self._tried), None)) is not None:
            if (
                attempt.row == PLAIN_BODY
                and self._times_plainer == 0
                and (near := self._plain_near_first_fault(attempt)) is not None
            ):
                self._tried, attempt = chain([attempt], self._tried), near
            self._row_begun, self._first_fault, self._fails_by_front = attempt, None, True
            # the first is made with each effort: limbs and slits are left aside near the faults of that alone
            if self._limit.first_fault is None or (fault := self._limit.known_fault(attempt)) is None:
                return attempt
            self._limit.begin()
            self._note(attempt, fault)
        return None

    def _plain_near_first_fault(self, plain: Attempt) -> Attempt | None:
        """Return an attempt at a body with all of its limbs and slits but those near which the first attempt failed."""
        kept = plain.settings.replace(plain_body=False, effort=self._settings.effort)
        return self._plainer(replace(plain, settings=kept), self._limit.first_fault)

    def _plainer(self, attempt: Attempt, fault: ScanTrussError | None) -> Attempt | None:
        """Return an attempt without the limbs and slits near its fault; None where none is near, or that was done often enough."""
        if not isinstance(fault, FrontError) or self._times_plainer == TIMES_OF_PLAINER:
            return None
        self._times_plainer += 1
        return attempt.plainer(fault, self._cloud)

    def _tries_least_effort(self) -> bool:
        """Whether all attempts are made once more; where they are, what refuses the grid is noted."""
        fault = self._fault()
        if self._settings.effort == LEAST_EFFORT or not isinstance(fault, FrontError) or joins_sheets(fault):
            return False
        self._refused = fault
        return True

    def passed(self, attempt: Attempt, grid: Grid) -> None:
        """Note that a grid passes the checks; it fails all the same where it breaks a limb that could be cut off at a clean ring."""
        if (place := breaks_limb(grid, self._cloud, self._settings, attempt.settings)) is not None:
            if self._passed is None:
                self.failed(attempt, CertificateError(BREAKS_LIMB, grid, place))
            return
        given_up = attempt.ridges_given_up(self._cloud)
        lost = lost_ridges(grid, self._cloud, self._settings, given_up)
        grid = with_moved_corners(grid, self._cloud, self._settings, attempt.wide)
        grid = with_ridges_lost(with_ridges_given_up(grid, given_up), lost)
        if attempt.row in IS_BETTER:
            assert self._passed is not None
            self._passed = grid if IS_BETTER[attempt.row](grid, self._passed) else self._passed
            return
        if self._passed is not None:  # this one is without rods
            found, known = grid.certificate, self._passed.certificate
            assert found is not None and known is not None
            better = len(found.warnings) < len(known.warnings) or gaps_spanned(found) < gaps_spanned(known)
            self._passed = grid if better or self._around_columns else self._passed
            return
        self._around_columns = stands_on_columns(self._cloud, attempt.settings) and keeps_columns(
            self._cloud, attempt.settings
        )
        if self._around_columns or runs_along_rods(grid, self._cloud, attempt.settings, self._settings):
            assert self._row_begun is not None
            without = self._row_begun.settings.replace(keep_rods=False)
            self._follows = replace(self._row_begun, settings=without, row=WITHOUT_RODS)
            self._first_fault = None
        elif attempt.row in TRIED_FIRST and jumps_between_walls(grid, self._cloud, self._settings):
            self._follows = Attempt(
                self._settings.replace(thin_walls=True), is_trial=attempt.is_trial, row=BETWEEN_WALLS
            )
        elif lost and attempt.row in TRIED_FIRST and not attempt.is_trial and self._has_sharp_edges():
            self._follows = Attempt(self._settings.replace(sharp_edges=True), row=CUTS_ACROSS_EDGES)
        elif doubts_ridges(grid, self._settings) and not attempt.is_trial:
            without = attempt.settings.replace(ridge_angle=0.0)
            self._follows = Attempt(without, row=WITHOUT_DOUBTFUL_RIDGES)
        elif self._drops_parts(attempt, grid):
            self._follows = Attempt(self._settings.replace(effort=LEAST_EFFORT), row=WITH_LEAST_EFFORT)
        self._passed = grid

    def _has_sharp_edges(self) -> bool:
        """Whether the scan has sharp edges that were not asked for."""
        return AskedScan(self._cloud, self._settings).has_sharp_edges

    def _drops_parts(self, attempt: Attempt, grid: Grid) -> bool:
        """Whether a grid that passes leaves out a part of the scan that one with less effort may follow."""
        if self._settings.is_plain or self._settings.effort == LEAST_EFFORT or attempt.is_trial:
            return False
        return attempt.settings.is_plain and grid.certificate is not None and grid.certificate.missing > MISSING_ALIKE

    def failed(self, attempt: Attempt, fault: ScanTrussError) -> None:
        """Note that an attempt gives no grid that passes.

        Raises
        ------
        ScanTrussError
            The fault, where it is one of the settings that were asked for.
        """
        if attempt.row in (WITHOUT_DOUBTFUL_RIDGES, CUTS_ACROSS_EDGES):
            return
        if attempt.row == WITH_LEAST_EFFORT:
            self._follows = attempt.after(fault, self._cloud) if isinstance(fault, FrontError) else None
            return
        if attempt.row == BETWEEN_WALLS:
            if attempt.starts is None:  # once more, with a front that makes all of its nodes itself
                self._follows = replace(attempt, starts=layouts_of(attempt.settings)[SECOND_LAYOUT][0])
            return
        self._fails_by_front &= fails_by_front(fault)
        is_sparse = fails_as_sparse(fault)
        if isinstance(fault, FrontError):
            self._limit.end(fault)
            self._first_fault = self._first_fault or fault
            hopeless = loses_limbs(attempt.settings, fault)
            if attempt.row == PLAIN_NEAR_FAULTS:
                self._follows = None if hopeless else self._plainer(attempt, fault)
            elif not hopeless and self._limit.any_left() and (later := attempt.after(fault, self._cloud)) is not None:
                self._follows = replace(later, row=RIDGES_GIVEN_UP)
            if self._follows is not None:
                return
            fault = self._first_fault
        if self._passed is None and self._row_begun is not None:
            self._note(self._row_begun, fault)
            if is_sparse and AskedScan(self._cloud, self._settings).has_more_outliers(attempt.settings):
                self._tried = judging_outliers(chain([self._row_begun], self._tried))

    def _note(self, attempt: Attempt, fault: ScanTrussError) -> None:
        """Note why no grid of an attempt of the table passes, whatever followed it."""
        looks_one_sided = bool(self._faults) and isinstance(self._faults[0], OneSidedError)
        if attempt.settings == self._settings:  # what goes wrong with other settings, nobody has asked for
            if not isinstance(fault, FrontError | OneSidedError):
                raise fault
            self._faults.append(fault)
        elif looks_one_sided and isinstance(fault, FrontError):  # where its mean surface does not
            self._faults.append(fault)
        self._advice = self._advice or attempt.advice(fault)
        self._limit.note(attempt, fault)
        if self._fails_by_front and attempt.has_one_front(self._cloud):
            self._limit.note_front(attempt, fault)

    def outcome(self) -> Grid:
        """Return the grid that passes.

        Raises
        ------
        ScanTrussError
            None does; the fault with the effort asked for, of the first attempt with the settings asked for that gave a grid, else
            of the first. It says what accepts a grid of another attempt that only leaves out too much.
        """
        if self._passed is not None:
            return self._passed
        fault = self._fault()
        raise (self._refused or fault) if isinstance(fault, FrontError) else fault

    def _fault(self) -> ScanTrussError:
        """Return why no grid passes with the effort that was tried last."""
        if not self._faults:
            return FrontError("none of the attempts made gives a grid that passes")
        worst = next((fault for fault in self._faults if isinstance(fault, CertificateError)), self._faults[0])
        if isinstance(worst, CertificateError) and not (self._row_begun is not None and self._row_begun.is_trial):
            worst = worst.whole
        if self._advice and isinstance(worst, FrontError) and not (only_leaves_out(worst) or only_sparse(worst)):
            return type(worst)(f"{worst}; {self._advice}", worst.grid, worst.where)
        return worst
