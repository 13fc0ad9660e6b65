"""A file of desired member lengths: x, y, z and a length on each line, in any text layout that scans may have."""

from __future__ import annotations

import math
from pathlib import Path

from ...errors import FormatError
from .text_fields import number_of, split_fields, split_line
from .text_layout import Layout, find_layout

# of the column of lengths, where a header names columns
LENGTH_COLUMN_NAMES = ("length", "member", "desired", "l", "size", "edge")


def read_lengths(path: str | Path) -> list[tuple[float, ...]]:
    """Return the rows of a file of lengths, (x, y, z, length) each [scan unit].

    The length is in the column of that name, else in the one after the coordinates.

    Raises
    ------
    FormatError
        The file cannot be read, or a line has no fourth number.
    """
    path = Path(path)
    try:
        layout = find_layout(path)
        lines = path.read_text(encoding=layout.encoding, errors="replace").splitlines()
    except OSError as error:
        raise FormatError(f"cannot read lengths {path}: {error.strerror}") from None
    coordinates = layout.columns[-3:]
    column = _length_column(lines[: layout.skip], layout)
    rows = []
    for count, line in enumerate(lines[layout.skip :], layout.skip + 1):
        fields = split_line(line, layout.separator)
        if not fields:
            continue
        try:
            rows.append(tuple(_number(fields[c], layout) for c in (*coordinates, column)))
        except (ValueError, IndexError):
            shown = " ".join(fields)[:60]
            raise FormatError(
                f"{path}, line {count}: needs four numbers, x y z and the length there, got {shown!r}"
            ) from None
    return rows


def _length_column(header: list[str], layout: Layout) -> int:
    """Column of the lengths: by its name, else the one after the coordinates."""
    for line in reversed(header):
        names = [name.strip().lower() for name in split_fields(line.strip().lstrip("#/%!;* "), layout.separator)]
        for column, name in enumerate(names if len(names) > 3 else ()):
            words = name.replace("_", " ").replace("[", " ").replace("(", " ").split()
            if words and words[0] in LENGTH_COLUMN_NAMES:
                return column
    return max(layout.columns) + 1


def _number(field: str, layout: Layout) -> float:
    """Value of a field; ValueError if it is no number or not finite."""
    value = number_of(field, layout.comma)
    if not math.isfinite(value):
        raise ValueError(field)
    return value
