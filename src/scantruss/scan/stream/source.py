"""A file of points as its header describes it, and a part of it that can be read alone."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..formats.content import Content
from ..formats.text_layout import Layout


@dataclass(frozen=True)
class Source:
    """A file of points as its header describes it."""

    path: Path
    kind: str  #: las, rows (of fixed size), text, terrain (a raster), or whole
    points: int  #: points that the header promises; a guess for text, or for a file that is read whole
    begin: int = 0  #: byte at which points begin: rows, text
    end: int = 0  #: byte after the points: text
    rows: np.dtype[np.void] | None = None  #: layout of a row
    columns: tuple[int, ...] = ()  #: of the coordinates, or of the number of a point and them: text
    layout: Layout | None = None  #: of a text
    metres: float | None = None  #: metres per unit of x and y; None if the file does not state it
    z_metres: float | None = None  #: ... of z
    system: str = ""  #: reference system
    degrees: bool = False  #: x and y are longitude and latitude
    in_one: bool = False  #: it is read from beginning to end, because it cannot be entered in the middle
    notes: tuple[str, ...] = ()  #: what a user should know

    @property
    def whole(self) -> bool:
        """Whether it can only be read whole, with memory for all of its points."""
        return self.kind == "whole"

    def applied_to(self, content: Content) -> Content:
        """Return some of its points with the units, the system and the notes of its header."""
        applied = replace(content, metres=self.metres, z_metres=self.z_metres, system=self.system, degrees=self.degrees)
        return replace(applied, notes=(*content.notes, *self.notes)) if self.notes else applied


@dataclass(frozen=True)
class Tile:
    """A part of a file: points, or bytes of a text."""

    source: Source
    begin: int
    end: int

    @property
    def points(self) -> int:
        """About how many points are in it."""
        if self.source.kind != "text":
            return self.end - self.begin
        share = (self.end - self.begin) / max(self.source.end - self.source.begin, 1)
        return max(round(share * self.source.points), 1)
