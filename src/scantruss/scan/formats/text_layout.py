"""The layout of a text file of points, found from parts of it: separator, decimal sign, header, columns."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ...errors import FormatError
from ..units import metres_of_columns, metres_of_comments
from .columns import NORMAL_COLUMNS, check_not_degrees, find_attributes, fit_columns
from .kinds import is_text, kind_of, read_head, wrong_kind
from .own_colors import COLOR_ATTRIBUTES
from .text_fields import (
    ANY_SEPARATOR,
    NUMBER_COMMA,
    count_numbers,
    header_names,
    holds_three,
    is_number,
    number_of,
    split_line,
)

BYTES_EXAMINED = 1 << 16  # bytes examined at the start and in the middle
WIDTH_OF_PTS = 7  # x y z intensity red green blue, as scanners write it without names
LINES_EXAMINED = 1000  # lines examined in each part
# fewest rows, share of all rows, that hold a unit vector where a file has normals that no header names, and how far their length is off
FEWEST_NORMALS, MOST_UNIT, OFF_UNIT = 20, 0.95, 0.01
BOM = b"\xef\xbb\xbf"  # how UTF-8 may start
LINE_BREAK = re.compile(r"\r\n|\n|\r")
THOUSANDS = re.compile(r"[+-]?(?:[1-9]\d{0,2}(?:,\d{3})?|0)")  # 1,234 may be either
GROUPED = re.compile(r"[+-]?\d{1,3}(?:(?:\.\d{3})+,\d+|(?:,\d{3})+\.\d+)")
#: separator (None: blanks) and whether a comma may be the decimal sign; the first that fits best is taken
GRAMMARS: tuple[tuple[str | None, bool], ...] = (
    *((sign, comma) for sign in (";", "|", "\t") for comma in (False, True)),
    (",", False),
    (None, False),
    (None, True),
    (",", True),  # "1,5","2,5","3,5"
    (ANY_SEPARATOR, False),
)
_REFUSED = ("a PLY file", "an STL file", "an OFF file", "an OBJ file", "a PCD file", "a web page", "an XML file")


@dataclass(frozen=True)
class Layout:
    """Where the coordinates of a text file are."""

    encoding: str
    separator: str | None  #: one character, None for blanks, or ANY_SEPARATOR
    comma: bool  #: a comma may be the decimal sign
    skip: int  #: lines before the first point
    columns: tuple[int, ...]  #: x, y, z; or four columns of which the first may be a running number
    promised: int | None  #: points that a count line promises
    width: int = 0  #: fields of most lines
    named: bool = False  #: the header names the columns
    attributes: tuple[tuple[str, int], ...] = ()  #: wanted attributes that the header names, and their columns
    metres: float | None = None  #: metres per unit of x and y, where a comment or the names of the columns say it
    z_metres: float | None = None  #: ... of z
    header: tuple[str, ...] = ()  #: the lines before the first point

    def without_normals(self) -> Layout:
        """Return the layout with all attributes but normals."""
        others = tuple((name, column) for name, column in self.attributes if name not in NORMAL_COLUMNS)
        return replace(self, attributes=others)

    @property
    def plain(self) -> bool:
        """Whether numbers are separated by one character that is not also the decimal sign."""
        return self.separator != ANY_SEPARATOR and not (self.separator == "," and self.comma)

    @property
    def has_unnamed_first(self) -> bool:
        """Whether the first of four or more columns may be a point number, a time or x, as no header names it."""
        return not self.named and self.width > 3 and self.columns[0] == 0


def find_layout(path: Path, wanted: Sequence[str] = ()) -> Layout:
    """Return the layout of a text file of points and wanted attributes; FormatError where it is no such file."""
    head = read_head(path)
    kind = kind_of(head)
    if not is_text(head) or kind in _REFUSED or kind.startswith("a raster"):
        raise wrong_kind(path, head, "a text file of points")
    encoding = "utf-8-sig" if head.startswith(BOM) else "latin-1"
    if head.startswith((b"\xff\xfe", b"\xfe\xff")):
        encoding = "utf-16"
    start, middle = _parts(path, encoding)
    start, middle = start[:LINES_EXAMINED], middle[:LINES_EXAMINED]
    rows = [row for row in start + middle if split_line(row, ANY_SEPARATOR)]
    separator, comma = _find_grammar(rows)
    if separator == ANY_SEPARATOR:
        _check_not_grouped(path, rows)
        _check_not_two_columns(path, rows)
    if (separator, comma) == (",", True):
        _check_not_thousands(path, rows)
    if (separator, comma) == (",", False):
        _check_not_split_in_two(path, rows)
    split = [(number, split_line(line, separator)) for number, line in enumerate(start)]
    data = [(number, row) for number, row in split if holds_three(row, comma)]
    behind = sum(bool(row) for number, row in split if data and number >= data[0][0])
    columns = _numeric_columns([row for _, row in data], comma)
    if not data and not kind:
        raise FormatError(f"{path} has no line with three numbers, so no points")
    if len(data) * 2 < behind or len(columns) < 3:
        raise wrong_kind(path, head, "a text file of points")
    layout = _finish(start, data, columns, encoding, separator, comma)
    _check_no_points(path, start[: layout.skip], separator, comma)
    layout = _with_header(path, layout, start[: layout.skip], wanted)
    if layout.named or not set(NORMAL_COLUMNS) <= set(wanted):
        return layout
    return _with_unnamed_normals(layout, [row for _, row in data] + [split_line(row, separator) for row in middle])


def _with_unnamed_normals(layout: Layout, rows: Sequence[Sequence[str]]) -> Layout:
    """Return a layout with three columns behind the coordinates as normals where they are unit vectors in nearly all rows.

    Whole numbers alone are none: 0 0 1 may be marks of any kind.
    """
    for column in range(layout.columns[-1] + 1, layout.width - 2):
        vectors = np.array([_numbers_of(row[column : column + 3], layout.comma) for row in rows])
        is_unit = np.abs(np.linalg.norm(vectors, axis=1) - 1.0) < OFF_UNIT
        if (
            is_unit.sum() >= max(FEWEST_NORMALS, MOST_UNIT * len(rows))
            and (vectors[is_unit] % 1.0).any(axis=1).mean() > 0.5
        ):
            columns = zip(NORMAL_COLUMNS, range(column, column + 3), strict=True)
            return replace(layout, attributes=(*layout.attributes, *columns))
    return layout


def _numbers_of(fields: Sequence[str], comma: bool) -> tuple[float, ...]:
    """Return three fields as numbers, NaN where they are none."""
    if len(fields) < 3 or not all(is_number(field, comma) for field in fields):
        return (np.nan,) * 3
    return tuple(number_of(field, comma) for field in fields)


def _with_header(path: Path, layout: Layout, header: Sequence[str], wanted: Sequence[str]) -> Layout:
    """Return a layout with the attributes and units of its header."""
    lines = list(header_names(header, layout.separator))
    if not layout.named:
        for names in lines:
            check_not_degrees(path, names)
    fitting = [names for names in lines if len(names) == layout.width]
    found = [find_attributes(names, wanted) for names in fitting]
    metres, z_metres = metres_of_comments(header), None
    for names in fitting if layout.named else ():
        by_name = metres_of_columns(path, [names[column] for column in layout.columns])
        metres, z_metres = by_name if by_name[0] else (metres, z_metres)
    attributes = tuple(max(found, key=len, default={}).items())
    if not attributes and path.suffix.lower() == ".pts" and layout.width == WIDTH_OF_PTS:
        attributes = tuple((name, 4 + k) for k, name in enumerate(COLOR_ATTRIBUTES) if name in wanted)
    stripped = tuple(line.strip() for line in header)
    return replace(layout, attributes=attributes, metres=metres, z_metres=z_metres, header=stripped)


def _parts(path: Path, encoding: str) -> tuple[list[str], list[str]]:
    """Return the whole lines of the first part of a file and of a part in its middle."""
    size = path.stat().st_size
    with path.open("rb") as file:
        raw = file.read(BYTES_EXAMINED)
        file.seek(size // 2)
        later = file.read(BYTES_EXAMINED // 4) if size > 2 * BYTES_EXAMINED and encoding != "utf-16" else b""
    start = LINE_BREAK.split(raw.decode(encoding, errors="replace"))
    middle = LINE_BREAK.split(later.decode("latin-1"))[1:-1]
    return (start[:-1] if size > BYTES_EXAMINED and len(start) > 1 else start), middle


def _find_grammar(lines: Sequence[str]) -> tuple[str | None, bool]:
    """Return separator and decimal sign by which most lines hold three numbers."""
    split = {  # a line without the sign is one field
        sign: [split_line(line, sign) for line in lines if sign in (None, ANY_SEPARATOR) or sign in line]
        for sign in dict(GRAMMARS)
    }
    scores = [sum(holds_three(row, comma) for row in split[sign]) for sign, comma in GRAMMARS]
    best = max(scores[:-1])
    if 2 * best < scores[-1]:
        return GRAMMARS[-1]
    separator, comma = GRAMMARS[next(i for i, score in enumerate(scores) if score >= best)]
    return separator, comma or _has_decimal_commas(lines, separator)


def _has_decimal_commas(lines: Sequence[str], separator: str | None) -> bool:
    """Whether one line in ten holds more numbers if commas are decimal: 1,5;2,5;3,5;200;100;50 has only three otherwise."""
    split = [split_line(line, separator) for line in lines if "," in line]
    return 10 * sum(count_numbers(row, True) > count_numbers(row, False) for row in split) > len(lines)


def _check_not_grouped(path: Path, rows: Sequence[str]) -> None:
    """Refuse numbers such as 5.118,216 and "5,118.216", which would be split in two."""
    for separator in (";", "|", "\t", ",", None):
        for row in rows[:: len(rows) // 20 + 1]:
            fields = split_line(row, separator)
            grouped = [field for field in fields if GROUPED.fullmatch(field)]
            if grouped and len(grouped) + count_numbers(fields, True) >= 3:
                raise FormatError(
                    f"{path} has numbers with a sign between thousands ({grouped[0]}); export it without one"
                )


def _check_not_two_columns(path: Path, rows: Sequence[str]) -> None:
    """Refuse 6,1973;1,8543: two numbers with decimal commas, which would be split in four."""
    for separator in (";", "|", "\t", None):
        split = [split_line(row, separator) for row in rows]
        two = [row for row in split if len(row) == 2 and all("," in field and is_number(field, True) for field in row)]
        if 2 * len(two) > len(rows):
            raise FormatError(
                f"{path} has two numbers in a line ({' and '.join(two[0])}, with decimal commas); points need x, y and z"
            )


def _check_not_thousands(path: Path, rows: Sequence[str]) -> None:
    """Refuse "1,234","2,345" if nothing shows that the commas within the quotes are decimal signs."""
    fields = [field for row in rows for field in split_line(row, ",") if NUMBER_COMMA.fullmatch(field)]
    if any("." in field for field in fields) or all(THOUSANDS.fullmatch(field) for field in fields):
        shown = next(field for field in fields if "," in field)
        raise FormatError(
            f'{path}: the comma in "{shown}" may be a decimal sign or stand between thousands; export it with decimal points'
        )


def _check_not_split_in_two(path: Path, rows: Sequence[str]) -> None:
    """Refuse 12,045,3,210,7,008: commas as decimal signs and as separators, as zeros lead in every second field."""
    split = [row for row in (split_line(row, ",") for row in rows) if len(row) >= 6 and all(map(_is_whole, row))]
    if 2 * len(split) < len(rows):
        return
    for first in (1, 2):  # the first field may be the number of the point
        behind = [[row[first + 2 * axis] for row in split if first + 2 * axis < len(row)] for axis in range(3)]
        if all(any(re.fullmatch(r"0\d+", field) for field in fields) for fields in behind):
            shown = ",".join(split[0])[:60]
            raise FormatError(
                f"{path}: in {shown!r} commas are decimal signs and separate the numbers too; export it with decimal points, or with"
                " semicolons between the numbers"
            )


def _is_whole(field: str) -> bool:
    return re.fullmatch(r"[+-]?\d+", field) is not None


def _check_no_points(path: Path, header: Sequence[str], separator: str | None, comma: bool) -> None:
    """Refuse points above the first line with the usual separator: with another one they would be taken for a header."""
    for number, line in enumerate(header, start=1):
        fields = split_line(line, ANY_SEPARATOR)
        if len(fields) >= 3 > count_numbers(split_line(line, separator), comma) and all(
            is_number(field, False) for field in fields
        ):
            raise FormatError(
                f"{path}: line {number} ({line.strip()[:60]!r}) holds numbers with another separator than most lines;"
                " correct or delete it"
            )


def _numeric_columns(rows: Sequence[Sequence[str]], comma: bool) -> list[int]:
    """Return the columns that nearly all rows have and that hold numbers or nothing."""
    columns = []
    for column in range(max(map(len, rows), default=0)):
        fields = [row[column] for row in rows if column < len(row)]
        filled = [field for field in fields if field]
        numbers = sum(is_number(field, comma) for field in filled)
        if len(fields) >= 0.9 * len(rows) and numbers and numbers >= 0.9 * len(filled):
            columns.append(column)
    return columns


def _finish(
    start: Sequence[str],
    data: list[tuple[int, list[str]]],
    numeric: list[int],
    encoding: str,
    separator: str | None,
    comma: bool,
) -> Layout:
    """Return the layout, with the columns by name where the header names them."""
    while len(data) > 1 and not all(c < len(data[0][1]) and is_number(data[0][1][c], comma) for c in numeric[:3]):
        data = data[1:]  # a line of the header that holds three numbers
    width = Counter(len(row) for _, row in data).most_common(1)[0][0]
    if _is_counted_header(data):  # pandas names the columns of an array 0, 1, 2
        first = int(not data[0][1][0])
        skip, columns = data[1][0], (first, first + 1, first + 2)
        return Layout(encoding, separator, comma, skip, columns, None, width)
    skip = data[0][0]
    running, rising = _is_running([row[0] for _, row in data])
    named = _named_columns(start[:skip], separator, width, running or 0 not in numeric)
    counts = [line.strip() for line in start[:skip] if re.fullmatch(r"\s*\d+\s*", line)]
    four = rising and len(numeric) > 3 and numeric[0] == 0 and all(len(row) > numeric[3] for _, row in data)
    chosen = named or tuple(numeric[: 4 if four else 3])
    promised = int(counts[-1]) if counts else None
    return Layout(encoding, separator, comma, skip, chosen, promised, width, named is not None)


def _is_counted_header(data: Sequence[tuple[int, list[str]]]) -> bool:
    """Return whether the first row of numbers just counts the columns, unlike the rows that follow."""
    if len(data) < 3:
        return False
    names = data[0][1]
    counted = [str(i) for i in range(len(names))]
    if names[0] == "" and names[1:] == counted[:-1]:
        return len(data[1][1]) == len(names)
    return names == counted and any("." in field or "," in field for field in data[1][1][:3])


def _is_running(fields: Sequence[str]) -> tuple[bool, bool]:
    """Return whether the fields are whole numbers, each one more than the one before, and whether each is larger."""
    if len(fields) < 3 or not all(re.fullmatch(r"\d{1,15}", field) for field in fields):
        return False, False
    steps = np.diff([int(field) for field in fields])
    return bool((steps == 1).all()), bool((steps > 0).all())


def _named_columns(
    header: Sequence[str], separator: str | None, width: int, has_row_names: bool
) -> tuple[int, int, int] | None:
    """Return the columns of x, y, z from the header line that names them, the one nearest to the points first."""
    for exact in (True, False):
        for names in header_names(header, separator):
            if len(names) >= 3 and (len(names) == width or not exact):
                columns = fit_columns(names, width, has_row_names)
                if columns:
                    return columns
    return None
