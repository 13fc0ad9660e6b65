"""Values of settings that are more than a number or a word, checked and brought into their plainest form."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from ..errors import InputError

SYMMETRIES_FOUND = ("auto", "rotation")  # words for what is found in the scan
ROTATION_NUMBERS = 7  # of a row that is a rotation: point, axis and parts of a turn; a mirror plane has six
MOST_PARTS = 12  # of a turn
CURVATURE = "curvature:"  # start of a length field that follows the curvature


class Lengths(tuple[tuple[float, float, float, float], ...]):
    """Rows of a length field that have been checked: x, y, z and the desired length there [scan unit]."""


def check_piece(given: Any) -> str:
    """Return which pieces are chosen, "auto", "all", "largest" or numbers from 1 with commas between them, or refuse it."""
    text = str(given).replace(" ", "").lower()
    if text in ("auto", "all", "largest") or all(word.isdecimal() and int(word) > 0 for word in text.split(",")):
        return text
    raise InputError(f"piece must be auto, all, largest or numbers from 1 such as 1 or 1,3, got {given!r}")


def check_positions(given: Any) -> tuple[tuple[float, ...], ...]:
    """Return fixed positions as tuples of numbers, or refuse them."""
    return _coordinates(given, f"fixed must be positions of three numbers, got {given!r}", "a fixed node needs")


def check_places(name: str, given: Any) -> tuple[tuple[float, ...], ...]:
    """Return the places of a setting as tuples of numbers, or refuse them."""
    return _coordinates(given, f"{name} must be places of three numbers, got {given!r}", f"a place of {name} needs")


def check_line(line: Any, name: str = "fixed_lines", what: str = "a fixed line") -> tuple[tuple[float, ...], ...]:
    """Return a polyline as tuples of numbers, no point twice in a row, or refuse it."""
    refusal = f"{name} must be polylines of positions of three numbers, got {line!r}"
    points = _coordinates(line, refusal, f"{what} needs points of")
    points = tuple(p for i, p in enumerate(points) if i == 0 or p != points[i - 1])
    if len(points) < 2:
        raise InputError(f"{what} needs at least two different points, got {len(points)}")
    return points


def check_ring(ring: Any) -> tuple[tuple[float, ...], ...]:
    """Return a closed polyline as tuples of numbers, its first point not repeated, or refuse it."""
    points = check_line(ring, "boundary", "a boundary")
    points = points[:-1] if points[0] == points[-1] else points
    if len(set(points)) < 3:
        raise InputError(f"a boundary needs at least three different points, got {len(set(points))}")
    return points


def check_arrow(given: Any) -> tuple[float, ...]:
    """Return an arrow as a place and a direction, six finite numbers, or none at all, or refuse it."""
    refusal = f"rows_along must be six numbers, a place and a direction, x y z dx dy dz, got {given!r}"
    try:
        arrow = tuple(float(number) for number in given or ())
    except (TypeError, ValueError):
        raise InputError(refusal) from None
    if arrow and (len(arrow) != 6 or not all(map(math.isfinite, arrow)) or not any(arrow[3:])):
        raise InputError(refusal)
    return arrow


def check_names(given: Any, count: int) -> tuple[str, ...]:
    """Return the names of so many fixed lines, or none at all, or refuse them."""
    if isinstance(given, str) or not all(isinstance(name, str) and name.strip() for name in given):
        raise InputError(f"line_names must be words, one for each fixed line, got {given!r}")
    if len(given) not in (0, count):
        raise InputError(f"line_names has {len(given)} names for {count} fixed lines")
    return tuple(given)


def _coordinates(given: Any, refusal: str, needs: str) -> tuple[tuple[float, ...], ...]:
    """Return positions as tuples of three finite numbers; `refusal` where they are no numbers, `needs` begins the message otherwise."""
    try:
        found = tuple(tuple(float(c) for c in position) for position in given)
    except (TypeError, ValueError):
        raise InputError(refusal) from None
    for position in found:
        if len(position) != 3 or not all(map(math.isfinite, position)):
            raise InputError(f"{needs} three finite coordinates, got {position}")
    return found


def check_symmetry(given: Any) -> str | tuple[tuple[float, ...], ...]:
    """Return a symmetry as the settings hold it, or refuse it.

    "" for none, "auto", "rotation", rows of a point and a normal for mirror planes, or one row of a point, an axis and the parts of a turn,
    and perhaps a second of a half turn about a line of the surface.
    """
    if given is None or (isinstance(given, str) and given in ("", *SYMMETRIES_FOUND)):
        return given or ""
    refusal = f"symmetry must be auto, rotation, or rows of six numbers, a point and a normal, got {given!r}"
    if isinstance(given, str):
        raise InputError(refusal)
    try:
        rows = tuple(tuple(float(c) for c in row) for row in given)
    except (TypeError, ValueError):
        raise InputError(refusal) from None
    for row in rows:
        finite = all(map(math.isfinite, row)) and any(row[3:6])
        if len(row) == ROTATION_NUMBERS and (not finite or row[6] != round(row[6]) or not 2 <= row[6] <= MOST_PARTS):
            raise InputError(f"a rotation needs a point, an axis and the parts of a turn, 2 to {MOST_PARTS}, got {row}")
        if len(row) not in (6, ROTATION_NUMBERS) or not finite:
            raise InputError(f"a mirror plane needs a point and a normal, six finite numbers, got {row}")
    turns = [row for row in rows if len(row) == ROTATION_NUMBERS]
    if turns and (len(rows) > 2 or len(turns) < len(rows) or (len(rows) == 2 and turns[1][6] != 2)):
        raise InputError(
            f"a rotation stands alone or before a half turn, a row of which the last number is 2, got {len(rows)} rows"
        )
    return rows or ""


def check_length_field(given: Any) -> str | Lengths:
    """Return a length field as the settings hold it: "" for none, "curvature:MIN:MAX", or rows of x, y, z, length.

    Raises
    ------
    InputError
        It is none of these, a length is not positive, or MIN is larger than MAX.
    """
    if given is None or (isinstance(given, str) and not given):
        return ""
    if isinstance(given, str):
        return _check_curvature(given)
    if isinstance(given, Lengths):
        return given
    try:
        rows = Lengths((float(x), float(y), float(z), float(length)) for x, y, z, length in given)
    except (TypeError, ValueError):
        raise InputError("length_field must be rows of four numbers, x y z length, or curvature:MIN:MAX") from None
    if not rows:
        raise InputError("length_field has no rows; it needs x, y, z, length at one place at least")
    for row in rows:
        if not all(map(math.isfinite, row)):
            raise InputError(f"length_field must be finite numbers, got {row}")
        if row[3] <= 0:
            raise InputError(f"length_field must have positive lengths, got {row[3]:g} at {row[:3]}")
    return rows


def _check_curvature(text: str) -> str:
    """Return "curvature:MIN:MAX" in its plainest writing, or refuse it."""
    try:
        low, high = (float(part) for part in text.removeprefix(CURVATURE).split(":"))
    except ValueError:
        low = high = math.nan
    if not (text.startswith(CURVATURE) and math.isfinite(low) and math.isfinite(high)):
        raise InputError(f"a length field must be curvature:MIN:MAX with two lengths, got {text!r}")
    if low <= 0:
        raise InputError(f"{text}: the shortest length must be positive, got {low:g}")
    if low > high:
        raise InputError(f"{text}: the shortest length is above the longest; write {CURVATURE}{high:g}:{low:g}")
    return f"{CURVATURE}{low!r}:{high!r}"


def shortest_and_longest(field: str | Sequence[Sequence[float]]) -> tuple[float, float]:
    """Return the bounds of a length field as it is given [scan unit]."""
    if isinstance(field, str):
        low, high = (float(part) for part in field.removeprefix(CURVATURE).split(":"))
        return low, high
    lengths = [row[3] for row in field]
    return min(lengths), max(lengths)
