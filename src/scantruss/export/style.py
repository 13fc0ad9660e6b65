"""How a grid is written where its format leaves a choice."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..errors import InputError
from .drawing.style import PictureStyle

OBJ_ELEMENTS = ("faces", "lines", "both")
INP_PROGRAMS = ("abaqus", "calculix")
STEP_PARTS = ("axes", "bodies")
IFC_EDITIONS = ("IFC4", "IFC4X3")
PAGE_POINTS = 60_000  #: of the scan that are drawn in a page
IFC_VIEWS = ("auto", "physical", "analysis", "both")


@dataclass(frozen=True)
class FileStyle(PictureStyle):
    """How files of a grid are written: views and size of a picture, and more.

    Raises
    ------
    InputError
        A value is not one of those allowed.
    """

    obj: str = "faces"  #: what an OBJ file holds: faces for the triangles, lines for the members, or both
    tube: tuple[float, float | None] | None = (
        None  #: diameter and wall of the members of a grid, which has no sections [mm]
    )
    ball: float | None = (
        None  #: diameter of the nodes, 0 for none; None: twice the greatest diameter of the members [mm]
    )
    ifc: str = "auto"  #: what an IFC file holds of a structure: physical parts, the analysis model, or (auto) both
    ifc_schema: str = "IFC4"  #: edition of IFC: IFC4, or IFC4X3 (4.3 ADD2)
    step: str = "axes"  #: what a STEP file holds: axes of the members, or bodies of members and nodes
    inp: str = "abaqus"  #: program that an .inp file with rigid joints is for: abaqus, or calculix
    decimal_comma: bool = False  #: CSV with a decimal comma and semicolons between the columns

    def __post_init__(self) -> None:
        """Check every value."""
        super().__post_init__()
        if self.obj not in OBJ_ELEMENTS:
            raise InputError(f"an OBJ file holds {', '.join(OBJ_ELEMENTS)}, got {self.obj!r}")
        if self.ifc not in IFC_VIEWS:
            raise InputError(f"an IFC file holds {', '.join(IFC_VIEWS)}, got {self.ifc!r}")
        if self.ifc_schema not in IFC_EDITIONS:
            raise InputError(f"the edition of IFC is {' or '.join(IFC_EDITIONS)}, got {self.ifc_schema!r}")
        if self.step not in STEP_PARTS:
            raise InputError(f"a STEP file holds {' or '.join(STEP_PARTS)}, got {self.step!r}")
        if self.inp not in INP_PROGRAMS:
            raise InputError(f"an .inp file is for {' or '.join(INP_PROGRAMS)}, got {self.inp!r}")
        if self.tube is not None and (self.tube[1] is None or not 0 < 2 * self.tube[1] < self.tube[0]):
            raise InputError("a tube has a diameter and a wall of less than half of it in mm, such as 60x3")
        if self.ball is not None and not 0 <= self.ball < math.inf:
            raise InputError(f"the diameter of the balls must be a number of mm, got {self.ball!r}")
