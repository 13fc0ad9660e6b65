"""What of a grid was made alike: lengths of its members, its joints or its panels."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

LENGTHS, JOINTS, PANELS = "lengths", "joints", "panels"
WHAT_IS_ALIKE = (LENGTHS, JOINTS, PANELS)


@dataclass(frozen=True)
class Alike:
    """What parts of a grid are alike, and how nearly: what its kinds are follows from the grid.

    Raises
    ------
    ValueError
        A value cannot be used.
    """

    parts: str  #: one of `WHAT_IS_ALIKE`
    tolerance: float  #: largest misfit to what stands for a kind; of lengths and corners over `member`, of joints of unit directions
    count: int  #: lengths or kinds that were asked for
    member: float  #: mean member of the grid before [scan unit]
    mirrored: bool = False  #: whether mirror images are of one kind
    uneven: float | None = None  #: of joints, by how much members may differ from the mean one, over it; None: as usual

    def __post_init__(self) -> None:
        """Check what was read."""
        if self.parts not in WHAT_IS_ALIKE or not self.tolerance > 0 or not self.member > 0 or self.count < 1:
            raise ValueError(f"parts that are alike need a tolerance, a count and a mean member, got {self}")

    def to_dict(self) -> dict[str, Any]:
        """Return plain values."""
        return asdict(self)
