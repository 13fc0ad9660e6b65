"""Units of coordinates: from the file, from the user, and of heights that have another one."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from pathlib import Path

from ..errors import InputError
from ..settings import UNITS

SAME_UNIT = 1e-5  # US survey feet are feet, to two parts in a million
_NAMES = "mm|cm|m|inch|inches|foot|feet|ft|met(?:er|re)s?|millimet(?:er|re)s?|centimet(?:er|re)s?"
_INCH = r"in(?![ \t]*[-:=]|[ \t]+\w)"  # distinguished from the word by what follows: "the unit in this file is mm"
_GAP = r"[^\w\r\n]"
PATTERN = rf"(?:units?|einheit){_GAP}{{0,3}}(?:in{_GAP}{{1,3}})?({_NAMES}|{_INCH})\b"  #: in a comment of a file
_IN_NAME = re.compile(rf"[(\[<]\s*({_NAMES}|in)\s*[)\]>]$|[\s_]({_NAMES})$", re.IGNORECASE)  # x_in may be an input
_WORDS = {"feet": "foot", "ft": "foot", "in": "inch", "inches": "inch"}


def check_unit(unit: str) -> None:
    """Refuse an unknown unit."""
    if unit not in UNITS:
        meant = f" (write {usual_unit(unit)})" if usual_unit(unit) in UNITS else ""
        raise InputError(f"unit must be one of {' '.join(u for u in UNITS if u)}, got {unit!r}{meant}")


def usual_unit(word: str) -> str:
    """Return our name of a unit that has several, such as foot for ft, feet or FEET; any other word as it is."""
    known = re.fullmatch(f"{_NAMES}|in", word, re.IGNORECASE)
    return name_of(metres_of(word)) or word if known else word


def metres_of(word: str) -> float | None:
    """Return the metres of a named unit; None for "" and unknown ones."""
    word = word.lower()
    for start, unit in (("mi", "mm"), ("ce", "cm"), ("me", "m")):
        word = unit if word.startswith(start) else word
    return UNITS.get(_WORDS.get(word, word))


def metres_of_comments(lines: Iterable[str]) -> float | None:
    """Return the metres of a unit that a comment of a text file names; None if there is none."""
    found = (re.match(rf"\s*(?:#|//).*?\b{PATTERN}", line, re.IGNORECASE) for line in lines)
    return next((metres_of(match[1]) for match in found if match), None)


def metres_of_columns(path: Path, names: Sequence[str]) -> tuple[float | None, float | None]:
    """Return the metres per unit of x and y, and of z, that names of columns tell, as ``X [mm]`` or ``z_ft``; None if they do not.

    Parameters
    ----------
    path : for messages
    names : names of the columns of x, y, z

    Raises
    ------
    InputError
        x and y are in different units.
    """
    found = [_IN_NAME.search(name.strip().strip("\"'").strip()) for name in names]
    x, y, z = (metres_of(match[1] or match[2]) if match else None for match in found)
    if x and y and x != y:
        raise InputError(
            f"{path} has x in {name_of(x)} and y in {name_of(y)} by the names of its columns; a grid needs one unit, so"
            " export it again in one"
        )
    return (x, z) if x and y else (None, None)


def name_of(metres: float | None) -> str:
    """Return the name of a unit; "" if we have none for it."""
    for name, size in UNITS.items():
        if size and metres and math.isclose(size, metres, rel_tol=SAME_UNIT):
            return name
    return ""
