"""How a grid is written where its format leaves a choice."""

from __future__ import annotations

from dataclasses import dataclass

from ..errors import InputError
from .drawing.style import PictureStyle

OBJ_ELEMENTS = ("faces", "lines", "both")


@dataclass(frozen=True)
class FileStyle(PictureStyle):
    """How files of a grid are written: views and size of a picture, and more.

    Raises
    ------
    InputError
        A value is not one of those allowed.
    """

    obj: str = "faces"  #: what an OBJ file holds: faces for the triangles, lines for the members, or both
    decimal_comma: bool = False  #: CSV with a decimal comma and semicolons between the columns

    def __post_init__(self) -> None:
        """Check every value."""
        super().__post_init__()
        if self.obj not in OBJ_ELEMENTS:
            raise InputError(f"an OBJ file holds {', '.join(OBJ_ELEMENTS)}, got {self.obj!r}")
