"""How long attempts at a grid are worth making."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .errors import CertificateError, OneSidedError, ScanTrussError

if TYPE_CHECKING:
    from .candidates import Attempt
    from .settings import Settings

FAR_FROM_PASSING = 12  # cuts and missing boundary loops above which other fronts with the same samples do not help
# share of the scan that a grid misses above which the same holds, in shares that may be missing; of thin limbs 1
FAR_MISSING = 2.0
MOST_RUNS = 24  # grids that are made at most, before a scan is refused
MOST_RUNS_OF_CELLS = 3  # the same for quads and hexagons, which are made of triangles that pass
MOST_FAR, MOST_GIVEN_UP = 2, 3  # attempts in a row of the same settings that are so far from passing, and such settings


class Hope:
    """Which attempts are still worth making.

    After two in a row that come nowhere near a grid that passes, others of the same settings would come no nearer; after three
    such settings none would. A scan that looks one-sided may only be rough: then its mean surface is not. How much is tried is
    counted in grids that are made, not in seconds: the same scan gets the same result.
    """

    def __init__(self, cells: str = "triangle") -> None:
        self._most = MOST_RUNS if cells == "triangle" else min(MOST_RUNS, MOST_RUNS_OF_CELLS)
        self._allowed = self._most
        self._settings: Settings | None = None
        self._far = self._given_up = 0
        self.runs, self._looks_one_sided = 0, False  #: grids that were made

    def allow(self, more: int) -> None:
        """Pause after some more grids."""
        self._allowed = min(self._most, self.runs + more)

    def is_left(self) -> bool:
        """Whether any attempt is worth making, and allowed."""
        return self._given_up < MOST_GIVEN_UP and self.runs < self._allowed

    def is_paused(self) -> bool:
        """Whether attempts would be worth making that are not allowed."""
        return self._given_up < MOST_GIVEN_UP and self._allowed <= self.runs < self._most

    def begin(self) -> None:
        """Note that a grid is made."""
        self.runs += 1

    def allows(self, attempt: Attempt) -> bool:
        """Whether an attempt is worth making."""
        if self._looks_one_sided and not attempt.settings.smooth_scale:
            return False
        return attempt.settings is not self._settings or self._far < MOST_FAR

    def note(self, attempt: Attempt, fault: ScanTrussError) -> None:
        """Note what has come of an attempt."""
        if attempt.settings is not self._settings:
            self._settings, self._far = attempt.settings, 0
        self._looks_one_sided |= isinstance(fault, OneSidedError)
        self._far = self._far + 1 if _is_far_from_passing(attempt, fault) else 0
        self._given_up += self._far == MOST_FAR and not attempt.settings.smooth_scale  # of those there are four


def _is_far_from_passing(attempt: Attempt, fault: ScanTrussError) -> bool:
    """Whether a grid misses many loops or much of the scan, or limbs as every front will, or many of its triangles cut each other."""
    if isinstance(fault, OneSidedError):
        return True
    if not isinstance(fault, CertificateError) or fault.grid.certificate is None:
        return False
    found = fault.grid.certificate
    limbs = sum(part.share for part in found.left_out if part.kind == "limbs")
    if found.missing > FAR_MISSING * attempt.settings.allow_missing or limbs > attempt.settings.allow_missing:
        return True
    return found.crossings + abs(found.boundary_loops - found.scan_loops) > FAR_FROM_PASSING
