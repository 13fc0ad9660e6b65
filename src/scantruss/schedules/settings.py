"""What schedules are made for: tubes, balls, tolerances, the building frame and the limits of the warnings."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from ..errors import InputError
from ..settings import UNITS
from .bolts import GRADES, NO_BOLTS

ABOVE_0 = (
    "tube",
    "wall",
    "ball",
    "tolerance",
    "angle_tolerance",
    "scale",
    "density",
    "slenderness",
    "thread",
    "sleeve",
)
NOT_NUMBERS = ("unit", "origin", "bolts")
LEAST_TOLERANCE = 1e-6  # below which rounding decides what is equal [mm, degree]


@dataclass(frozen=True, kw_only=True)
class ScheduleSettings:
    """Tubes and balls, tolerances, building frame and limits; lengths in millimetres, as built.

    Raises
    ------
    InputError
        A value cannot be used; the message names it.
    """

    tube: float | None = None  #: outer diameter of the members of a grid; a structure has its sections [mm]
    wall: float | None = None  #: wall of the tubes, half the diameter for solid bars; masses need it [mm]
    ball: float | None = (
        None  #: diameter of every ball; None: the smallest that clears the members, by type of node [mm]
    )
    clearance: float | None = (
        None  #: along each member, from where tubes meet to the ball's surface; None: a tenth of `tube` [mm]
    )
    tolerance: float = 1.0  #: largest misfit of members and panels of one type [mm]
    angle_tolerance: float = 0.5  #: largest misfit of nodes of one type [degree]
    scale: float = 1.0  #: size of the structure over the size of the grid
    unit: str = ""  #: unit of a grid that has none
    density: float | None = None  #: of members and balls; of a structure of the balls only; None: no masses [kg/m3]
    origin: tuple[float, float, float] | None = (
        None  #: origin of the building frame, in the scan's frame; None: lowest corner of the nodes [scan unit]
    )
    rotation: float = 0.0  #: from the scan's x axis to the building's, anticlockwise about z [degree]
    least_angle: float = 30.0  #: smaller angles between members are warned of [degree]
    least_fold: float = 150.0  #: sharper folds between panels, 180 where level, are warned of [degree]
    slenderness: float = 200.0  #: more slender members of a structure are warned of: length over radius of gyration
    bolts: str = "10.9"  #: grade of the bolts of a structure, or none
    thread: float = 1.1  #: depth of a bolt's thread in the ball over its diameter
    sleeve: float = 1.8  #: diameter around the sleeve of a bolt over its diameter

    def __post_init__(self) -> None:
        """Check every value."""
        for spec in fields(self):
            value = getattr(self, spec.name)
            if spec.name in NOT_NUMBERS or (value is None and spec.default is None):
                continue
            if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
                raise InputError(f"{spec.name} must be a number, got {value!r}")
            if spec.name in ABOVE_0 and value <= 0:
                raise InputError(f"{spec.name} must be a positive number, got {value:g}")
            if spec.name.endswith("tolerance") and value < LEAST_TOLERANCE:
                raise InputError(f"{spec.name} must be at least {LEAST_TOLERANCE:g}, got {value:g}")
        if self.clearance is not None and self.clearance < 0:
            raise InputError(f"clearance must be at least 0, got {self.clearance:g}")
        if self.wall is not None and self.tube is None:
            raise InputError("a wall needs the tube that it is of")
        if self.wall is not None and self.tube is not None and self.wall > self.tube / 2:
            raise InputError(
                f"the wall of a tube of {self.tube:g} mm must be at most {self.tube / 2:g}, got {self.wall:g}"
            )
        if self.density is not None and self.tube is not None and self.wall is None:
            raise InputError(
                f"a mass needs the wall of the tubes, such as --tube {self.tube:g}x4, or half the diameter"
            )
        if self.bolts not in (*GRADES, NO_BOLTS):
            raise InputError(f"bolts must be one of {' '.join((*GRADES, NO_BOLTS))}, got {self.bolts!r}")
        if self.unit not in UNITS:
            raise InputError(f"unit must be one of {' '.join(unit for unit in UNITS if unit)}, got {self.unit!r}")
        if self.origin is not None and (len(self.origin) != 3 or not all(map(math.isfinite, self.origin))):
            raise InputError(f"origin must be three numbers, got {self.origin!r}")
