"""How files of a grid are written where their formats leave a choice."""

from __future__ import annotations

import re
from dataclasses import dataclass

from ..errors import InputError

VIEWS = ("auto", "behind", "top", "bottom", "front", "back", "left", "right")
OBJ_ELEMENTS = ("faces", "lines", "both")
SMALLEST_PICTURE, LARGEST_PICTURE = 200, 10_000  # sides of a picture [pixel]


@dataclass(frozen=True)
class FileStyle:
    """How files of a grid are written.

    Raises
    ------
    InputError
        A value is none of those that are possible.
    """

    views: tuple[str, ...] = ("auto",)  #: of a picture, side by side: names of `VIEWS`, or "AZIMUTH,ELEVATION" [degree]
    size: tuple[int, int] | None = None  #: of a picture, width and height [pixel]; None: as suits the number of views
    obj: str = "faces"  #: what an OBJ file holds: faces for the triangles, lines for the members, or both
    decimal_comma: bool = False  #: CSV with a decimal comma and semicolons between the columns

    def __post_init__(self) -> None:
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
        if self.obj not in OBJ_ELEMENTS:
            raise InputError(f"an OBJ file holds {', '.join(OBJ_ELEMENTS)}, got {self.obj!r}")


def angles_of(view: str) -> tuple[float, float] | None:
    """Return azimuth (from the front, anticlockwise seen from above) and elevation of a view [degree]; None where it names none."""
    number = r"[+-]?\d+\.?\d*"
    found = re.fullmatch(rf"({number}),({number})", view)
    if found is None or abs(float(found[2])) > 90.0:
        return None
    return float(found[1]), float(found[2])
