"""How many attempts are worth making."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeGuard

from ..check.crossings import MOST_CROSSINGS
from ..errors import CertificateError, FrontError, OneSidedError, ScanTrussError

if TYPE_CHECKING:
    from ..settings import Settings
    from .table import Attempt

FAR_FROM_PASSING = 12  # cuts and missing boundary loops above which other fronts with the same samples do not help
# share of the scan that a grid misses above which other fronts do not help either, in shares that may be missing; of thin limbs 1
FAR_MISSING = 2.0
MOST_RUNS = 24  # grids that are made at most, before a scan is refused
MOST_RUNS_OF_CELLS = 3  # grids of quads or hexagons that are made at most; they are made of triangles that pass
MOST_FAR, MOST_GIVEN_UP = 2, 3  # attempts in a row of the same settings that are so far from passing, and such settings
# such attempts in a row for a body without thin limbs, which is so smooth that other fronts come no nearer
MOST_FAR_OF_BODY = 1
# by how much more than may be missing is cut off where no front leaves out less: some follows the ends of a limb a little farther
LIMBS_BY_FRONT = 1.1
FAULTS_OF_FRONTS = {"manifold", "orientable", "pieces", "loops"}  # kinds of faults that no search changes
# settings by which limbs are cut off, and what may be left of them, beside how far the samples are apart
CUTS_BY = (
    "limb_girth",
    "keep_rods",
    "judge_outliers",
    "smooth_scale",
    "thin_walls",
    "sharp_edges",
    "plain_body",
    "plain_at",
)


def only_leaves_out(fault: ScanTrussError) -> TypeGuard[CertificateError]:
    """Whether a grid only leaves out too much of the scan."""
    return _fails_only_by("cover", fault)


def only_sparse(fault: ScanTrussError) -> TypeGuard[CertificateError]:
    """Whether all that is wrong with a grid is that it leaves out surface where points are too far apart for its members."""
    return _fails_only_by("sparse", fault)


def _fails_only_by(kind: str, fault: ScanTrussError) -> bool:
    """Whether all faults of a grid are of a kind; its whole certificate is made only where those that were looked for are."""
    return isinstance(fault, CertificateError) and _kinds_of(fault) == {kind} and _kinds_of(fault.whole) == {kind}


def _kinds_of(fault: CertificateError) -> set[str]:
    """Return of which kinds the faults of a grid are."""
    found = fault.grid.certificate if fault.grid is not None else None
    return set() if found is None else {each.kind for each in found.faults}


def fails_by_front(fault: ScanTrussError) -> bool:
    """Whether a grid hangs together as its scan does not: as its front has left it, and no search changes that."""
    return isinstance(fault, CertificateError) and bool(_kinds_of(fault) & FAULTS_OF_FRONTS)


def fails_as_sparse(fault: ScanTrussError) -> bool:
    """Whether points too far apart for the members lie on more of the surface than may be missing: with any front."""
    return isinstance(fault, CertificateError) and "sparse" in _kinds_of(fault)


def cuts_everywhere(fault: ScanTrussError | None) -> bool:
    """Whether so many triangles of a grid cut each other that they were not all counted."""
    found = fault.grid.certificate if isinstance(fault, CertificateError) else None
    return found is not None and found.crossings >= MOST_CROSSINGS


def joins_sheets(fault: ScanTrussError | None) -> bool:
    """Whether a grid cuts itself everywhere since it joins sheets of the scan that lie too near each other: no other look parts them.

    It has fewer pieces than the scan, or falls into more where the sheets are one piece of the scan, and is no manifold.
    """
    found = fault.grid.certificate if isinstance(fault, CertificateError) else None
    if found is None or not cuts_everywhere(fault):
        return False
    return found.pieces < found.scan_pieces or (found.pieces > found.scan_pieces and not found.manifold)


def loses_limbs(settings: Settings, fault: ScanTrussError, margin: float = LIMBS_BY_FRONT) -> bool:
    """Whether more of the scan was cut off as limbs too thin than may be missing, times a margin: no other front changes that."""
    found = fault.grid.certificate if isinstance(fault, CertificateError) else None
    if found is None:
        return False
    return sum(part.share for part in found.left_out if part.kind == "limbs") > margin * settings.allow_missing


class AttemptLimit:
    """Which attempts are still worth making.

    After two in a row that come nowhere near a grid that passes, others of the same settings would come no nearer; after three
    such settings none would. A scan that looks one-sided may only be rough: then its mean surface is not. How much is tried is
    counted in grids that are made, not in seconds: the same scan gets the same result.

    Parameters
    ----------
    earlier : AttemptLimit, optional
        Of the same attempts with more effort. What less effort leaves as it was is not made again: which limbs are cut off, and
        how a grid hangs together.
    """

    def __init__(self, earlier: AttemptLimit | None = None) -> None:
        self._allowed, self._stops_early = MOST_RUNS, False
        self._far: list[tuple[Settings, int]] = []  # settings, and how many attempts in a row were far from passing
        self._given_up: set[Settings] = set()
        self._of_cells = 0
        # for each fault that was noted, whether it is neither far from passing nor the front's
        self._hopes: list[bool] = []
        self._all_far = self._all_cut = True  # whether all grids are far from passing, and cut themselves everywhere
        # settings with which more is cut off than may be missing
        self._losing_limbs: list[Settings] = [] if earlier is None else earlier._losing_limbs
        # attempts of one front that no search makes pass
        self._failing_by_front: list[tuple[Attempt, ScanTrussError]] = []
        self._known_to_fail = [] if earlier is None else earlier._failing_by_front
        self.runs = 0  #: grids that were made
        self.first_fault: ScanTrussError | None = None  #: why the first attempt gives no grid that passes
        self._looks_one_sided = self._joins_sheets = False

    def allow(self, more: int, stops_early: bool = False) -> None:
        """Pause after some more grids.

        stops_early : pause too after a first grid that cuts itself everywhere, or two far from passing, where no other is nearer
        """
        self._allowed, self._stops_early = min(MOST_RUNS, self.runs + more), stops_early

    def any_left(self) -> bool:
        """Whether any attempt is worth making, and allowed."""
        return self._is_hopeful() and not self._is_stopped()

    def is_paused(self) -> bool:
        """Whether attempts would be worth making that are not allowed."""
        return self._is_hopeful() and self._is_stopped() and self.runs < MOST_RUNS

    def _is_stopped(self) -> bool:
        """Whether no more grids are allowed."""
        is_far = self._all_cut or (self._all_far and len(self._hopes) >= MOST_FAR)
        return self.runs >= self._allowed or (self._stops_early and bool(self._hopes) and is_far)

    def _is_hopeful(self) -> bool:
        """Whether any attempt is worth making."""
        return not self._joins_sheets and len(self._given_up) < MOST_GIVEN_UP and self._of_cells < MOST_RUNS_OF_CELLS

    @property
    def all_hopeless(self) -> bool:
        """Whether grids were made, and all are far from passing, or fail by their fronts."""
        return bool(self._hopes) and not any(self._hopes)

    def begin(self) -> None:
        """Note that a grid is made."""
        self.runs += 1

    def end(self, fault: FrontError) -> None:
        """Note why a grid that was made does not pass."""
        self._of_cells += fault.grid is not None and fault.grid.cells != "triangle"

    def allows(self, attempt: Attempt) -> bool:
        """Whether an attempt is worth making."""
        if self._looks_one_sided and not attempt.settings.smooth_scale:
            return False
        if any(_cuts_alike(attempt.settings, known) for known in self._losing_limbs):
            return False
        return self._far_in_a_row(attempt.settings) < (MOST_FAR_OF_BODY if attempt.settings.plain_body else MOST_FAR)

    def _far_in_a_row(self, settings: Settings) -> int:
        """Return how many attempts of some settings, one after the other, were far from passing."""
        return next((count for known, count in self._far if known == settings), 0)

    def known_fault(self, attempt: Attempt) -> ScanTrussError | None:
        """Return why an attempt fails with more effort that fails with this one too; None where that is not known."""
        own = attempt.settings
        return next(
            (
                fault
                for known, fault in self._known_to_fail
                if known.starts == attempt.starts and known.settings.replace(effort=own.effort) == own
            ),
            None,
        )

    def note_front(self, attempt: Attempt, fault: ScanTrussError) -> None:
        """Note why an attempt of one front, and what followed it, failed by that front."""
        self._failing_by_front.append((attempt, fault))

    def note(self, attempt: Attempt, fault: ScanTrussError) -> None:
        """Note what has come of an attempt."""
        self.first_fault = self.first_fault or fault
        self._looks_one_sided |= isinstance(fault, OneSidedError)
        if loses_limbs(attempt.settings, fault):
            self._losing_limbs.append(attempt.settings)
        is_far = _is_far_from_passing(attempt, fault)
        self._hopes.append(not is_far and not fails_by_front(fault))
        self._all_far &= is_far
        self._all_cut &= cuts_everywhere(fault)
        far = self._far_in_a_row(attempt.settings) + 1 if is_far else 0
        self._far = [pair for pair in self._far if pair[0] != attempt.settings] + [(attempt.settings, far)]
        if far < MOST_FAR:
            return
        if joins_sheets(fault):
            self._joins_sheets = True
        elif not attempt.settings.smooth_scale:  # of those there are four
            self._given_up.add(_as_given_up(attempt.settings))


def _is_far_from_passing(attempt: Attempt, fault: ScanTrussError) -> bool:
    """Whether a grid misses many loops or much of the scan, or limbs as every front will, or many of its triangles cut each other."""
    if isinstance(fault, OneSidedError):
        return True
    if not isinstance(fault, CertificateError) or fault.grid.certificate is None:
        return False
    found = fault.grid.certificate
    if found.missing > FAR_MISSING * attempt.settings.allow_missing or loses_limbs(attempt.settings, fault, 1.0):
        return True
    return found.crossings + abs(found.boundary_loops - found.scan_loops) > FAR_FROM_PASSING


def _as_given_up(settings: Settings) -> Settings:
    """Return the settings that count as one where they are given up: for thin walls, with whatever distance of the samples."""
    return settings.replace(box_size=None) if settings.thin_walls else settings


def _cuts_alike(settings: Settings, other: Settings) -> bool:
    """Whether two settings cut the same limbs off a scan: it is cut before the first front, whatever is done later."""
    return all(getattr(settings, name) == getattr(other, name) for name in CUTS_BY)
