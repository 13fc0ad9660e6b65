"""Points of a text file (XYZ, TXT, CSV, PTS, ASC): by a compiled loop or numpy where they can, line by line where they cannot."""

from __future__ import annotations

import mmap
from array import array
from collections.abc import Iterator, Sequence
from io import StringIO
from pathlib import Path

import numpy as np

from ..errors import FormatError
from .content import Content
from .layout import ANY, Layout, find_layout, is_number, number_of, split_line
from .lines import LARGE, read_regular


def read_text(path: Path, wanted: Sequence[str] = ()) -> Content:
    """Return the points of a text file and the wanted attributes that its header names."""
    layout = find_layout(path, wanted)
    width, promised = len(layout.columns), layout.promised
    columns = (*layout.columns, *(column for _, column in layout.attributes))
    try:
        rows = _read_fast(path, layout, columns)
    except ValueError:
        rows, promised = _read_lines(path, layout, columns)
    if promised is not None and len(rows) < promised:
        raise FormatError(
            f"{path} ends early: its count line promises {promised:,} points, got {len(rows):,}; copy it again"
        )
    points, more = rows[:, :width], rows[:, width:]
    if width == 4:  # the first column may be a running number
        running = bool((np.diff(points[:, 0]) == 1).all())
        points = points[:, 1:] if running else points[:, :3]
    attributes = {name: more[:, i] for i, (name, _) in enumerate(layout.attributes)}
    return Content(points, attributes, layout.metres, layout.z_metres)


def _read_fast(path: Path, layout: Layout, columns: Sequence[int]) -> np.ndarray:
    """Return the columns of a regular file; ValueError where it is not."""
    if layout.separator == ANY:
        raise ValueError
    if path.stat().st_size > LARGE and (rows := read_regular(path, layout, columns)) is not None:
        return rows
    if _holds(path, b".#"):
        raise ValueError
    source: Path | StringIO = path
    if layout.comma:
        source = StringIO(path.read_text(encoding=layout.encoding).replace(",", "."))
    return np.loadtxt(
        source,
        comments="#",
        delimiter=layout.separator,
        skiprows=layout.skip,
        usecols=columns,
        encoding=layout.encoding,
        ndmin=2,
    )


def _holds(path: Path, sign: bytes) -> bool:
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
        return data.find(sign) >= 0


def _read_lines(path: Path, layout: Layout, columns: Sequence[int]) -> tuple[np.ndarray, int | None]:
    """Return the columns of any file, and the sum of its count lines."""
    values, promised = array("d"), layout.promised
    for number, row in _rows(path, layout):
        try:
            point = [number_of(row[column], layout.comma) for column in columns]
        except (ValueError, IndexError):
            if promised is not None and len(row) == 1 and row[0].isdecimal():  # a PTS file of several scans
                promised += int(row[0])
            elif any(is_number(field, layout.comma) for field in row):
                raise _no_point(path, layout, number, row) from None
            continue
        if any(row[column] for column in layout.columns):
            values.extend(point)
    return np.array(values).reshape(-1, len(columns)), promised


def _rows(path: Path, layout: Layout) -> Iterator[tuple[int, list[str]]]:
    """Yield the number (from 1) and the fields of each line that is not empty, behind the header."""
    with path.open(encoding=layout.encoding, errors="replace") as file:
        for number, line in enumerate(file, start=1):
            if number > layout.skip and (row := split_line(line.rstrip("\n"), layout.separator)):
                yield number, row


def _no_point(path: Path, layout: Layout, number: int, row: list[str]) -> FormatError:
    columns = ", ".join(str(column + 1) for column in layout.columns[-3:])
    said = " ".join(row)[:60]
    return FormatError(
        f"{path}: line {number} ({said!r}) has no numbers x, y, z in columns {columns}; mend or delete it"
    )
