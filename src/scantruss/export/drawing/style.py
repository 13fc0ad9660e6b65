"""From where a picture is seen, and how large it is."""

from __future__ import annotations

import re
from dataclasses import dataclass

from ...errors import InputError

VIEWS = ("auto", "behind", "top", "bottom", "front", "back", "left", "right")
SMALLEST_PICTURE, LARGEST_PICTURE = 200, 10_000  # sides of a picture [pixel]


@dataclass(frozen=True)
class PictureStyle:
    """How a picture is drawn.

    Raises
    ------
    InputError
        A value is not one of those allowed.
    """

    views: tuple[str, ...] = ("auto",)  #: side by side: names of `VIEWS`, or "AZIMUTH,ELEVATION" [degree]
    size: tuple[int, int] | None = None  #: width and height [pixel]; None: as suits the number of views

    def __post_init__(self) -> None:
        """Check every value."""
        for view in self.views:
            if view not in VIEWS and angles_of(view) is None:
                raise InputError(f"view must be {', '.join(VIEWS)} or AZIMUTH,ELEVATION in degrees, got {view!r}")
        if not self.views:
            raise InputError("a picture needs at least one view")
        if self.size is not None and not all(SMALLEST_PICTURE <= side <= LARGEST_PICTURE for side in self.size):
            raise InputError(
                f"a picture must be {SMALLEST_PICTURE} to {LARGEST_PICTURE} pixels wide and high,"
                f" got {self.size[0]}x{self.size[1]}"
            )


def angles_of(view: str) -> tuple[float, float] | None:
    """Return azimuth (from the front, anticlockwise seen from above) and elevation of a view [degree]; None if it names none."""
    number = r"[+-]?\d+\.?\d*"
    found = re.fullmatch(rf"({number}),({number})", view)
    if found is None or abs(float(found[2])) > 90.0:
        return None
    return float(found[1]), float(found[2])
