"""What a reader returns and what a writer takes."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np


@dataclass(frozen=True, eq=False)
class Content:
    """The points of one file as they stand in it."""

    points: np.ndarray  #: (N, 3) numbers, in the unit and frame of the file
    attributes: dict[str, np.ndarray] = field(default_factory=dict)  #: class, return_number ... (N,) each
    metres: float | None = None  #: metres per unit of x and y; None if the file does not state it
    z_metres: float | None = None  #: metres per unit of z
    system: str = ""  #: reference system, "EPSG:32642" or its name
    degrees: bool = False  #: x and y are longitude and latitude
    notes: tuple[str, ...] = ()  #: what a user should know
    left_out: dict[str, int] = field(
        default_factory=dict
    )  #: points that the file itself marks as none, by words for them
    unread: dict[str, int] = field(
        default_factory=dict
    )  #: points that a reader skipped because they lie outside a part of the selection, by words for them
    normals: np.ndarray | None = None  #: (N, 3)
    feet: str = ""  #: note that heights look like feet, used unless their unit is known


class Cloud(NamedTuple):
    """What a writer is given."""

    points: np.ndarray  #: (N, 3) float64 [unit], in the scan's own frame
    normals: np.ndarray | None  #: (N, 3)
    unit: str
    origin: np.ndarray | None  #: (3,) a place near the points

    @property
    def columns(self) -> np.ndarray:
        """Coordinates and, where they are known, normals; (N, 3) or (N, 6)."""
        return self.points if self.normals is None else np.column_stack([self.points, self.normals])

    def names(self, *normal: str) -> list[str]:
        """Names of the columns."""
        return ["x", "y", "z", *(() if self.normals is None else normal)]


def surplus_note(name: str, held: int, promised: int) -> str:
    """Return a note on a file with more points than its header promises."""
    return f"{name} promises {promised:,} points and holds {held:,}; all of them are read"
