"""What is set out: size, supports, building frame, sections, paper."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..errors import InputError

PAPERS = {"A4": (297, 210), "A3": (420, 297), "A2": (594, 420), "A1": (841, 594), "A0": (1189, 841)}  #: ISO 216 [mm]
MOST_SECTIONS = 200  # sections above which their spacing is refused
Cut = tuple[str, float]  # a vertical plane of the building frame: "x" or "y", and where [mm]


@dataclass(frozen=True, kw_only=True)
class SetoutSettings:
    """Size and supports of a grid (a structure has its own), building frame, sections and paper.

    Raises
    ------
    InputError
        A value cannot be used; the message names it.
    """

    scale: float = 1.0  #: size of the structure over the size of the grid
    unit: str = ""  #: unit of a grid that has none
    supports: str = ""  #: of a grid: corners, boundary, lowest:H, ..., as in `Truss.from_grid`
    joints: str = "rigid"  #: of a grid: rigid or pinned, while it is put up
    origin: tuple[float, float, float] | None = None  #: of the building frame; None: lowest corner [scan unit]
    rotation: float = 0.0  #: from the scan's x axis to the building's, anticlockwise about z [degree]
    sections: tuple[
        Cut, ...
    ] = ()  #: planes in which heights are given; none: with `spacing`, or the middle of both axes
    spacing: float | None = None  #: planes across both axes at multiples of it [mm]
    paper: str = "A3"  #: A4 to A0, of drawings to scale

    def __post_init__(self) -> None:
        """Check every value."""
        for name in ("scale", "spacing"):
            value = getattr(self, name)
            if value is not None and not 0 < value < math.inf:
                raise InputError(f"{name} must be a positive number, got {value!r}")
        if not math.isfinite(self.rotation) or not all(map(math.isfinite, self.origin or ())):
            raise InputError("rotation and origin must be numbers")
        if self.paper not in PAPERS:
            raise InputError(f"paper must be one of {' '.join(PAPERS)}, got {self.paper!r}")
        for axis, place in self.sections:
            if axis not in ("x", "y") or not math.isfinite(place):
                raise InputError(f"a section must be x=MM or y=MM, got {axis}={place}")
