"""What came of a member length that was tried."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

# kinds of warnings of what shorter members may follow
CRUSHED_OR_LOST = ("crushed", "lost")

if TYPE_CHECKING:
    from ..errors import FrontError
    from ..grid.grid import Grid


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
    def leaves_out(self) -> bool:
        """Whether the first grid fails as it leaves out too much of the scan."""
        found = getattr(getattr(self.fault, "grid", None), "certificate", None)
        return found is not None and any(fault.kind == "cover" for fault in found.faults)

    @property
    def loses_limbs(self) -> bool:
        """Whether the first grid fails as limbs are too thin for its members; longer ones lose more."""
        found = getattr(getattr(self.fault, "grid", None), "certificate", None)
        return self.leaves_out and found is not None and any(part.kind == "limbs" for part in found.left_out)

    @property
    def lost(self) -> float:
        """Share of the scan that the grid does not follow by ScanTruss's own judgement; 1 where there is none."""
        if self.grid is None or self.grid.certificate is None:
            return 1.0
        return self.grid.certificate.judged_out

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
