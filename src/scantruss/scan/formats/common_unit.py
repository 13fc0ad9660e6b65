"""One unit for all coordinates of a scan, whatever the units of its files."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from ...errors import InputError
from ...settings import UNITS
from ..units import SAME_UNIT, name_of
from .content import Content


def to_common_unit(
    path: Path, content: Content, unit: str, z_unit: str, common: str
) -> tuple[np.ndarray, str, tuple[str, ...]]:
    """Return points converted to the unit of the other files, if their own is known; see `to_one_unit`.

    Parameters
    ----------
    path, content, unit, z_unit
        As for `to_one_unit`.
    common : unit of the files before; "" if none has one
    """
    points, own, notes = to_one_unit(path, content, unit, z_unit)
    feet = (content.feet,) if content.feet and own != "foot" and not z_unit else ()
    size, metres = UNITS[common], UNITS[own]
    if size and metres and size != metres:
        notes = (*notes, f"{path.name} is in {own} and is converted to {common}, the unit of the first file")
        points, own = points * (metres / size), common
    return points, own, (*content.notes, *notes, *feet)


def to_one_unit(path: Path, content: Content, unit: str, z_unit: str) -> tuple[np.ndarray, str, tuple[str, ...]]:
    """Return points whose heights have the unit of x and y, that unit, and notes.

    Parameters
    ----------
    path : for messages
    content : what the file holds and says
    unit : what the user gives; it overrides the file
    z_unit : what the user gives for the heights

    Raises
    ------
    InputError
        The coordinates are degrees, or the user names a unit of the heights but x and y have none.
    """
    if content.degrees and not unit:
        raise InputError(
            f"{path} has longitude and latitude in degrees, and a grid needs lengths; project it to a plane system"
            " such as UTM first (QGIS, PDAL filters.reprojection); where the file is wrong, --unit says the unit"
        )
    notes = []
    named, metres, z_metres = name_of(content.metres), content.metres, content.z_metres
    name, scale = unit or named, 1.0
    if unit and metres and named != unit:
        notes.append(f"{path.name} says that its unit is {named or f'{metres:g} m'}; --unit {unit} overrides it")
        z_metres = None
    elif metres and not name:
        name, scale = "m", metres
        notes.append(f"the unit of {path.name}, {metres:g} m, is not one of ours; its points are converted to m")
    if z_unit and not name:
        raise InputError(f"{path} does not state the unit of x and y; give it with --unit, besides --z-unit {z_unit}")
    z_metres = UNITS[z_unit] or z_metres
    size = UNITS[name]
    if not size or not z_metres or math.isclose(z_metres, size * scale, rel_tol=SAME_UNIT):
        return content.points * scale if scale != 1.0 else content.points, name, tuple(notes)
    other = name_of(z_metres) or f"units of {z_metres:g} m"
    notes.append(
        f"the heights of {path.name} are in {other}, x and y in {named or name}: the heights are converted to {name}"
    )
    return content.points * [scale, scale, z_metres / size], name, tuple(notes)
