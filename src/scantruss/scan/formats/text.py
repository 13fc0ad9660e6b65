"""Text files of points (XYZ, TXT, CSV, PTS, ASC).

A block of lines is read by pyarrow where every line has the same fields, by numpy where lines differ or end with a comment, and
line by line where values are missing or lines among the points are none.
"""

from __future__ import annotations

import re
from array import array
from collections.abc import Callable, Iterator, Sequence
from io import BytesIO
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...errors import FormatError
from ...runtime.ours import CLOUD_MARK
from ..units import metres_of_columns
from .columns import find_attributes, find_columns, fit_columns
from .content import Cloud, Content, surplus_note
from .text_fields import COMMENT, header_names, holds_numbers, number_of, split_line
from .text_layout import BOM, BYTES_EXAMINED, LINE_BREAK, Layout, find_layout

EMPTY_LINES = "without coordinates"  # words for lines whose fields are empty
BYTES_FOR_PYARROW = 1 << 22  # bytes of text for which importing pyarrow pays
TEXT_BYTES_PER_BLOCK = 1 << 24  # bytes read at a time
BYTES_PER_THREAD = 1 << 22  # bytes per thread of pyarrow
ROWS_PER_WRITE = 1 << 16  # rows written at a time
NAME_IT = "a first line that names the columns (time x y z ...) settles it"
_WORDS_IN_COMMENT = re.compile(rb"^[ \t]*#[^\r\n]*[A-Za-z][^\r\n]*", re.MULTILINE)


class TextRows(NamedTuple):
    """The content of lines of text."""

    rows: np.ndarray  #: (N, columns) float64
    promised: int  #: points that count lines among them promise
    empty: int  #: lines of separators alone


def read_text(path: Path, wanted: Sequence[str] = ()) -> Content:
    """Return the points of a text file and the wanted attributes that its header names."""
    layout = find_layout(path, wanted)
    bare = layout.without_normals()
    try:
        return _read(path, layout)
    except FormatError:
        if layout == bare:
            raise
        return _read(path, bare)  # some lines have no normal


def _read(path: Path, layout: Layout) -> Content:
    """Return the points and attributes of a layout."""
    width = len(layout.columns)
    columns = (*layout.columns, *(column for _, column in layout.attributes))
    parts = [read_lines(path, block, layout, columns, begin) for begin, block in _blocks(path, layout)]
    rows = np.concatenate([part.rows for part in parts]) if len(parts) > 1 else parts[0].rows
    empty = sum(part.empty for part in parts)
    held, promised = len(rows) + empty, sum(part.promised for part in parts) + (layout.promised or 0)
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
    left_out = {EMPTY_LINES: empty} if empty else {}
    return Content(points, attributes, layout.metres, layout.z_metres, notes=notes, left_out=left_out)


def write_text(path: Path, cloud: Cloud) -> None:
    """Write numbers with enough digits to give back the same doubles."""
    sign = "," if path.suffix.lower() == ".csv" else " "
    with path.open("w", encoding="utf-8", newline="\n") as file:
        if sign == ",":
            unit = f" [{cloud.unit}]" if cloud.unit else ""
            axes, normal = (cloud.names("nx", "ny", "nz")[part] for part in (slice(3), slice(3, None)))
            file.write(sign.join([*(axis + unit for axis in axes), *normal]) + "\n")
        else:
            file.write(f"# {CLOUD_MARK}\n" + (f"# unit: {cloud.unit}\n" if cloud.unit else ""))
        columns = cloud.columns
        for begin in range(0, len(columns), ROWS_PER_WRITE):
            rows = columns[begin : begin + ROWS_PER_WRITE].tolist()
            file.writelines(sign.join(map(repr, row)) + "\n" for row in rows)


def _blocks(path: Path, layout: Layout) -> Iterator[tuple[int, bytes]]:
    """Yield blocks of whole lines after the header, with the byte of the file at which each begins."""
    if layout.encoding == "utf-16":
        lines = LINE_BREAK.split(path.read_bytes().decode("utf-16", errors="replace"))
        yield 0, "\n".join(lines[layout.skip :]).encode()
        return
    with path.open("rb") as file:
        head = file.read(2 * BYTES_EXAMINED)
        breaks = islice(re.finditer(rb"\r\n|\n|\r", head), layout.skip - 1, None) if layout.skip else ()
        begin = next((end.end() for end in breaks), 0)
        file.seek(begin)
        while block := file.read(TEXT_BYTES_PER_BLOCK):
            block += file.readline() if not block.endswith(b"\n") else b""
            yield begin, block.removeprefix(BOM) if begin == 0 else block
            begin += len(block)


def read_lines(path: Path, block: bytes, layout: Layout, columns: Sequence[int], begin: int) -> TextRows:
    """Return the columns of whole lines after the header.

    Parameters
    ----------
    path : for messages
    block : whole lines, UTF-8 where the file is UTF-16
    layout : separator and decimal sign
    columns : wanted fields, those of the attributes last
    begin : byte of the file at which they begin

    Raises
    ------
    FormatError
        A line holds numbers but not the wanted ones, or names other columns than the header.
    """
    if is_plain(block, layout):
        if len(block) > BYTES_FOR_PYARROW and (rows := _read_by_pyarrow(block, layout, columns)) is not None:
            return TextRows(rows, 0, 0)
        lines = block.replace(b",", b".") if layout.comma else block
        try:
            rows = np.loadtxt(BytesIO(lines), delimiter=layout.separator, usecols=columns, encoding="latin-1", ndmin=2)
            return TextRows(rows, 0, 0)
        except ValueError:
            pass
    encoding = "latin-1" if layout.encoding == "latin-1" else "utf-8"
    text = LINE_BREAK.split(block.decode(encoding, errors="replace"))
    return read_ragged(path, text, layout, columns, lambda: _lines_before(path, layout, begin))


def is_plain(block: bytes, layout: Layout) -> bool:
    """Whether a reader with one separator that skips text after a # reads everything."""
    if not layout.plain or block.isspace():
        return False
    if b"#" not in block:
        return True
    comments = _WORDS_IN_COMMENT.finditer(block)
    return b".#" not in block and not any(_find_names(0, match[0].decode("latin-1"), layout) for match in comments)


def _read_by_pyarrow(block: bytes, layout: Layout, columns: Sequence[int]) -> np.ndarray | None:
    """Return some columns of lines with the same fields, (N, len(columns)); None if a line has others."""
    if b"#" in block:
        return None
    import pyarrow
    from pyarrow import csv

    block = _with_single_separators(block, layout)
    first = block[: block.find(b"\n")] if b"\n" in block else block
    separator = layout.separator or " "
    names = [str(column) for column in range(first.count(separator.encode()) + 1)]
    wanted = [str(column) for column in dict.fromkeys(columns)]
    try:
        table = csv.read_csv(
            pyarrow.BufferReader(block),
            csv.ReadOptions(column_names=names, block_size=BYTES_PER_THREAD),
            csv.ParseOptions(delimiter=separator, quote_char=False),
            csv.ConvertOptions(
                column_types=dict.fromkeys(wanted, pyarrow.float64()), include_columns=wanted, null_values=[]
            ),
        )
    except (pyarrow.ArrowInvalid, pyarrow.ArrowKeyError):
        return None
    rows = np.empty((len(table), len(columns)))
    for place, column in enumerate(columns):
        parts = [np.from_dlpack(part) for part in table.column(str(column)).chunks if len(part)]
        np.concatenate(parts, out=rows[:, place])
    return rows


def _with_single_separators(block: bytes, layout: Layout) -> bytes:
    """Return lines that end with LF, with decimal points and, where blanks separate, one blank between two fields."""
    if layout.comma:
        block = block.replace(b",", b".")
    if b"\r" in block:
        block = block.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    if layout.separator is None:
        block = block.replace(b"\t", b" ").strip(b" ")
        codes = np.frombuffer(block, np.uint8)
        space = codes <= ord(" ")
        if (space[1:] & space[:-1]).any():
            surplus = (codes[1:] == ord(" ")) & space[:-1]  # after another blank or a line's end
            block = codes[np.append(True, ~surplus)].tobytes().replace(b" \n", b"\n")
    return block.lstrip(b"\n")


def _lines_before(path: Path, layout: Layout, end: int) -> int:
    """Return how many lines of a file end before a byte."""
    count = 0
    with path.open("rb") as file:
        while raw := file.read(min(TEXT_BYTES_PER_BLOCK, end - file.tell())):
            count += raw.count(b"\n")
    return max(count, layout.skip)  # the skipped ones may end with CR


def read_ragged(
    path: Path, lines: Sequence[str], layout: Layout, columns: Sequence[int], count_before: Callable[[], int]
) -> TextRows:
    """Return the columns of lines that no faster reader can handle; see `read_lines`."""
    values, promised, empty = array("d"), 0, 0
    names: _Names | None = None
    needed = columns[: len(columns) - len(layout.attributes)]
    for number, line in enumerate(lines, start=1):
        row = split_line(line, layout.separator)
        try:
            point = [number_of(row[column], layout.comma) for column in columns]
        except (ValueError, IndexError):
            if layout.promised is not None and len(row) == 1 and row[0].isdecimal():  # a PTS file of several scans
                promised += int(row[0])
            elif holds_numbers(row, layout.comma):
                raise _no_point(path, layout, count_before() + number, row) from None
            elif row and not any(row):
                empty += 1
            else:
                names = _find_names(number, line, layout) or names
            continue
        if names:
            _check_names(path, names, row, layout, count_before)
            names = None
        if any(row[column] for column in needed):
            values.extend(point)
        else:
            empty += 1
    if names and not names.in_comment:  # its points are in the next block
        _check_names(path, names, names.names, layout, count_before)
    return TextRows(np.array(values).reshape(-1, len(columns)), promised, empty)


def _no_point(path: Path, layout: Layout, number: int, row: Sequence[str]) -> FormatError:
    columns = ", ".join(str(column + 1) for column in layout.columns[-3:])
    shown = " ".join(row)[:60]
    return FormatError(
        f"{path}: line {number} ({shown!r}) has no numbers x, y, z in columns {columns}; correct or delete it"
    )


class _Names(NamedTuple):
    """A line among the points that may name the columns again."""

    number: int  #: of the line in its block, from 1
    line: str
    names: list[str]

    @property
    def in_comment(self) -> bool:
        """Whether it might as well be prose that contains x, y and z."""
        return bool(COMMENT.match(self.line.strip()))


def _find_names(number: int, line: str, layout: Layout) -> _Names | None:
    """Return the names x, y, z ... of a line; None if it has none, or repeats a line of the header."""
    if not line.strip() or line.strip() in layout.header:
        return None
    for names in header_names([line], layout.separator):
        if len(names) >= 3 and find_columns(names):
            return _Names(number, line, names)
    return None


def _check_names(
    path: Path, names: _Names, row: Sequence[str], layout: Layout, count_before: Callable[[], int]
) -> None:
    """Refuse names that put the coordinates of the rows below into other columns than the header does."""
    found = fit_columns(names.names, len(row), layout.columns[0] > 0)
    if found is None and names.in_comment:
        return
    if found is None or found != layout.columns or _differs(path, names.names, found, layout):
        raise FormatError(
            f"{path}: line {count_before() + names.number} ({names.line.strip()[:60]!r}) names the columns again,"
            " but not as before; save each part as a file"
        )


def _differs(path: Path, names: Sequence[str], columns: Sequence[int], layout: Layout) -> bool:
    """Whether attributes are in other columns, or lengths in another unit."""
    if max(columns) >= len(names):
        return False
    metres, z_metres = metres_of_columns(path, [names[column] for column in columns])
    if metres and layout.metres and (metres, z_metres) != (layout.metres, layout.z_metres):
        return True
    attributes = dict(layout.attributes)
    return find_attributes(names, list(attributes)) != attributes


def _rises(values: np.ndarray) -> bool:
    """Whether each value is larger than the one before; missing ones do not count."""
    return bool((np.diff(values[np.isfinite(values)]) > 0).all())


def is_number_of_point(values: np.ndarray) -> bool:
    """Whether values are integers that only increase, with or without gaps."""
    return _rises(values) and not (values[np.isfinite(values)] % 1).any()


def first_column_note(name: str, layout: Layout, *parts: np.ndarray) -> tuple[str, ...]:
    """Return a note on how the first column of a file, or of parts of it, is read; () if that is obvious."""
    if not layout.has_unnamed_first or sum(map(len, parts)) < 3:
        return ()
    values = np.concatenate(parts)
    how = ""
    if len(layout.columns) == 4 and is_number_of_point(values):
        if any((np.diff(part[np.isfinite(part)]) != 1).any() for part in parts):
            how = ", whole numbers that only rise, is taken as the number of a point"
    elif len(layout.columns) == 4:
        how = " counts up at the start, but not all through, and is taken as x"
    elif _rises(values):
        how = " only rises, as times do, and is taken as x"
    return (f"the first column of {name}{how}; {NAME_IT}",) if how else ()
