"""What came of a member length that was tried."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from ..attempts.looks import has_one_lattice
from ..attempts.table import Attempt
from ..errors import FrontError, InputError
from ..grid.line_sets import RIDGE, sets_of
from ..pipeline import first_that_passes

if TYPE_CHECKING:
    from ..grid.certificate import Certificate
    from ..grid.grid import Grid
    from ..runtime.progress import Progress
    from ..scan.cloud import PointCloud
    from ..settings import Settings

# kinds of warnings of what shorter members may follow
CRUSHED_OR_LOST = ("crushed", "lost")
OPENINGS_AND_LIMBS = ("hole", "gap", "limbs")  # kinds of what a grid leaves out


@dataclass(frozen=True, eq=False)
class LengthTrial:
    """The result of trying a member length."""

    length: float  #: [scan unit]
    grid: Grid | None  #: with its certificate; None if there is none
    fault: FrontError | None = None
    grids: int = 0  #: how many were made
    paused: bool = False  #: whether more might come of it

    @property
    def passed(self) -> bool:
        """Whether there is a grid, and it passes."""
        return self.grid is not None

    @property
    def _failed(self) -> Certificate | None:
        """The certificate of the first grid, where that fails."""
        return getattr(getattr(self.fault, "grid", None), "certificate", None)

    def _fails_by(self, *kinds: str) -> bool:
        """Whether the first grid has a fault of any of some kinds."""
        return self._failed is not None and any(fault.kind in kinds for fault in self._failed.faults)

    @property
    def has_one_fault(self) -> bool:
        """Whether a single fault keeps the first grid from passing."""
        return self._failed is not None and len(self._failed.faults) == 1

    @property
    def leaves_out(self) -> bool:
        """Whether the first grid fails as it leaves out too much of the scan."""
        return self._fails_by("cover", "sheets")

    @property
    def is_too_long(self) -> bool:
        """Whether the first grid fails as its members are too long for thin parts of the scan: it leaves them out or is torn there."""
        return self._fails_by("cover", "sheets", "torn")

    @property
    def loses_limbs(self) -> bool:
        """Whether the first grid fails as limbs are too thin for its members; longer ones lose more."""
        return (
            self._failed is not None and self.leaves_out and any(part.kind == "limbs" for part in self._failed.left_out)
        )

    @property
    def lost(self) -> float:
        """Share of the scan that the grid does not follow by ScanTruss's own judgement; 1 where there is none."""
        if self.grid is None or self.grid.certificate is None:
            return 1.0
        return self.grid.certificate.judged_out

    @property
    def warnings(self) -> int:
        """How many warnings the certificate of the grid has."""
        found = self.grid.certificate if self.grid is not None else None
        return 0 if found is None else len(found.warnings)

    @property
    def ridges_followed(self) -> float:
        """How long the ridges are that the grid follows [scan unit]."""
        return 0.0 if self.grid is None else sum(each["length"] for each in sets_of(self.grid, RIDGE))

    @property
    def is_whole(self) -> bool:
        """Whether the grid closes no opening and cuts off no limb."""
        found = self.grid.certificate if self.grid is not None else None
        return found is not None and not any(part.kind in OPENINGS_AND_LIMBS for part in found.left_out)

    @property
    def follows_less(self) -> int:
        """What of the scan the grid does not follow though shorter members may: 2 for openings or gaps longer than a member, 1 for ridges.

        Openings that somebody asked to be closed do not count.
        """
        found = self.grid.certificate if self.grid is not None else None
        if found is None:
            return 0
        closes_openings = any(
            part.kind in ("hole", "gap") and not part.asked and (part.size or 0.0) > self.length
            for part in found.left_out
        )
        return 2 * closes_openings + any(warning.kind in CRUSHED_OR_LOST for warning in found.warnings)


def settled(trial: LengthTrial, cloud: PointCloud, settings: Settings, progress: Progress) -> LengthTrial:
    """Return what comes of a length at which no quick run passes if it is begun as `grid` begins, where that is with more fronts."""
    usual = settings.replace(effort="normal")
    if trial.passed or trial.paused or trial.loses_limbs:
        return trial
    with suppress(FrontError, InputError):
        if not has_one_lattice(cloud, usual):
            grid = first_that_passes(cloud, usual, [Attempt(usual, is_trial=True)], progress=progress)
            return replace(trial, grid=grid, fault=None)
    return trial
