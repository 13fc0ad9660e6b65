"""What a reader returns: points, the attributes that were asked for, and what the file says of its units."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from .columns import clean_name


@dataclass(frozen=True, eq=False)
class Content:
    """The points of one file as they stand in it."""

    points: np.ndarray  #: (N, 3) numbers, in the unit and frame of the file
    attributes: dict[str, np.ndarray] = field(default_factory=dict)  #: class, return_number ... (N,) each
    metres: float | None = None  #: metres a unit of x and y; None where the file does not say it
    z_metres: float | None = None  #: metres a unit of z
    system: str = ""  #: reference system, "EPSG:32642" or its name
    degrees: bool = False  #: x and y are longitude and latitude
    notes: tuple[str, ...] = ()  #: what a user should know
    left_out: dict[str, int] = field(
        default_factory=dict
    )  #: points that the file itself says are none, by words for them
    unread: dict[str, int] = field(
        default_factory=dict
    )  #: points that a reader passed over as they lie outside a part of the selection, by words for them
    feet: str = ""  #: ... unless heights are in feet, or their unit is said


#: attribute -> names that columns and properties have for it, in lower case, letters and digits only
NAMES = {
    "class": ("classification", "class", "scalarclassification", "classid"),
    "return_number": ("returnnumber", "return", "scalarreturnnumber", "returnnum"),
    "return_count": ("numberofreturns", "returns", "scalarnumberofreturns", "numreturns", "returncount"),
    "confidence": ("confidence", "scalarconfidence", "conf"),
}


def find_attributes(names: Sequence[str], wanted: Sequence[str]) -> dict[str, int]:
    """Return the columns that hold the wanted attributes, by their names; those that are not there are left out."""
    clean = [clean_name(name) for name in names]
    return {
        attribute: column
        for attribute in wanted
        if (column := next((clean.index(name) for name in NAMES[attribute] if name in clean), -1)) >= 0
    }


def surplus_note(name: str, held: int, promised: int) -> str:
    """Return what should be said of a file with more points than it promises."""
    return f"{name} promises {promised:,} points and holds {held:,}; all of them are read"
