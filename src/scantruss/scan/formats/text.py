"""Points of a text file (XYZ, TXT, CSV, PTS, ASC): by a compiled loop or numpy where they can, line by line where they cannot."""

from __future__ import annotations

import mmap
from collections.abc import Sequence
from io import StringIO
from itertools import islice
from pathlib import Path

import numpy as np

from ...errors import FormatError
from .content import Content, surplus_note
from .layout import Layout, find_layout
from .ragged_text import EMPTY, Ragged, is_plain, read_ragged
from .regular_text import LARGE, read_regular
from .rising import first_column_note, is_number_of_point


def read_text(path: Path, wanted: Sequence[str] = ()) -> Content:
    """Return the points of a text file and the wanted attributes that its header names."""
    layout = find_layout(path, wanted)
    width = len(layout.columns)
    columns = (*layout.columns, *(column for _, column in layout.attributes))
    try:
        rows, promised, empty = Ragged(_read_fast(path, layout, columns), 0, 0)
    except ValueError:
        rows, promised, empty = _read_lines(path, layout, columns)
    held, promised = len(rows) + empty, promised + (layout.promised or 0)
    if held < promised:
        raise FormatError(
            f"{path} ends early: its count line promises {promised:,} points, got {held:,}; copy it again"
        )
    points, more = rows[:, :width], rows[:, width:]
    if width == 4:  # the first column may be a running number
        points = points[:, 1:] if is_number_of_point(rows[:, 0]) else points[:, :3]
    attributes = {name: more[:, i] for i, (name, _) in enumerate(layout.attributes)}
    notes = first_column_note(path.name, layout, rows[:, 0])
    if layout.promised is not None and held > promised:
        notes = (*notes, surplus_note(path.name, held, promised))
    left_out = {EMPTY: empty} if empty else {}
    return Content(points, attributes, layout.metres, layout.z_metres, notes=notes, left_out=left_out)


def _read_fast(path: Path, layout: Layout, columns: Sequence[int]) -> np.ndarray:
    """Return the columns of a regular file; ValueError where it is not."""
    if not layout.plain:
        raise ValueError
    if path.stat().st_size > LARGE and (rows := read_regular(path, layout, columns)) is not None:
        return rows
    if not _is_plain(path, layout):
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


def _is_plain(path: Path, layout: Layout) -> bool:
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
        return is_plain(data, layout)


def _read_lines(path: Path, layout: Layout, columns: Sequence[int]) -> Ragged:
    """Return the columns of any file."""
    with path.open(encoding=layout.encoding, errors="replace") as file:
        return read_ragged(path, islice(file, layout.skip, None), layout, columns, lambda: layout.skip)
