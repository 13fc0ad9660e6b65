"""Lines of text that need tolerance, one by one: missing values, comments, headers and count lines among the points."""

from __future__ import annotations

import re
from array import array
from collections.abc import Callable, Iterable, Sequence
from mmap import mmap
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...errors import FormatError
from .layout import NUMBER, NUMBER_COMMA, Layout, is_number, number_of, split_line
from .renamed import Names, check_names, find_names, has_names_in_comments

EMPTY = "without coordinates"  # what is said of lines whose fields are empty
_BREAKS = re.compile(r"[,;|\s]+")


class Ragged(NamedTuple):
    """What lines hold."""

    rows: np.ndarray  #: (N, columns) float64
    promised: int  #: points that count lines among them promise
    empty: int  #: lines of separators alone


def is_plain(data: bytes | mmap, layout: Layout) -> bool:
    """Whether a reader that knows one separator and skips what follows a # misses nothing."""
    if not layout.plain:
        return False
    if data.find(b"#") < 0:
        return True
    return layout.encoding != "utf-16" and data.find(b".#") < 0 and not has_names_in_comments(data, layout)


def read_ragged(
    path: Path, lines: Iterable[str], layout: Layout, columns: Sequence[int], count_before: Callable[[], int]
) -> Ragged:
    """Return the columns of lines that no faster way can read.

    Parameters
    ----------
    path : Path
        For messages.
    lines : iterable of str
        Lines behind the header.
    layout : Layout
        Separator and decimal sign.
    columns : sequence of int
        Wanted fields, those of the attributes last.
    count_before : callable
        Returns how many lines of the file come before; asked only where a line is refused.

    Raises
    ------
    FormatError
        A line holds numbers, but not those that are wanted; or it names other columns than the header.
    """
    values, promised, empty = array("d"), 0, 0
    names: Names | None = None
    needed = columns[: len(columns) - len(layout.attributes)]
    for number, line in enumerate(lines, start=1):
        row = split_line(line.rstrip("\n"), layout.separator)
        try:
            point = [number_of(row[column], layout.comma) for column in columns]
        except (ValueError, IndexError):
            if layout.promised is not None and len(row) == 1 and row[0].isdecimal():  # a PTS file of several scans
                promised += int(row[0])
            elif _holds_numbers(row, layout.comma):
                raise _no_point(path, layout, count_before() + number, row) from None
            elif row and not any(row):
                empty += 1
            else:
                names = find_names(number, line, layout) or names
            continue
        if names:
            check_names(path, names, row, layout, count_before())
            names = None
        if any(row[column] for column in needed):
            values.extend(point)
        else:
            empty += 1
    if names and not names.in_comment:  # its points are in the next block
        check_names(path, names, names.names, layout, count_before())
    return Ragged(np.array(values).reshape(-1, len(columns)), promised, empty)


def _holds_numbers(row: Sequence[str], comma: bool) -> bool:
    """Whether a field is a number, or two are in the line when it is split by any separator: it may have another one."""
    if any(is_number(field, comma) for field in row):
        return True
    words = [word for field in row for word in _BREAKS.split(field)]
    return sum(bool(NUMBER.fullmatch(word) or NUMBER_COMMA.fullmatch(word)) for word in words) >= 2


def _no_point(path: Path, layout: Layout, number: int, row: Sequence[str]) -> FormatError:
    columns = ", ".join(str(column + 1) for column in layout.columns[-3:])
    said = " ".join(row)[:60]
    return FormatError(
        f"{path}: line {number} ({said!r}) has no numbers x, y, z in columns {columns}; mend or delete it"
    )
