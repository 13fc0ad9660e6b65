"""The fields of a line of text: separators, comments, quotes, numbers and words for missing values."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterator, Sequence
from itertools import islice

ANY_SEPARATOR = "any"  # blanks, commas and semicolons in one line
COMMENT = re.compile(r"(?<!\.)#|//")  # 1.#IND is how some programs write NaN
NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][+-]?\d+)?")
NUMBER_COMMA = re.compile(r"[+-]?(?:\d+(?:\.\d*|,\d+)?|[.,]\d+)(?:[eEdD][+-]?\d+)?")
_BREAKS = re.compile(r"[,;|\s]+")
MISSING_VALUES = frozenset(
    [
        *(sign + word for sign in ("", "+", "-") for word in ("nan", "nan(ind)", "inf", "infinity")),
        *(sign + word for sign in ("", "-") for word in ("1.#qnan", "1.#ind", "1.#inf")),
        *("na", "n/a", "null", "none", "-", "--"),
    ]
)


def split_line(line: str, separator: str | None) -> list[str]:
    """Return the fields of a line without its comment; [] if nothing is left."""
    if "#" in line or "//" in line:
        line = COMMENT.split(line, maxsplit=1)[0]
    return split_fields(line.strip(" \r\n") if separator == "\t" else line.strip(), separator)


def split_fields(text: str, separator: str | None) -> list[str]:
    """Return the fields of a text, without blanks and quotes around them; [] for an empty text."""
    if not text:
        return []
    if separator == ANY_SEPARATOR:
        fields = re.split(r"[,;\s]+", text.strip(" ,;\t"))
    elif separator is None:
        fields = text.split()
    elif '"' in text:
        fields = _split_quoted(text, separator)
    else:
        fields = text.split(separator)
    return [field.strip().strip("\"'").strip() for field in fields]


def _split_quoted(text: str, separator: str) -> list[str]:
    try:
        return next(csv.reader([text], delimiter=separator, skipinitialspace=True))
    except csv.Error:
        return text.split(separator)


def is_number(field: str, comma: bool) -> bool:
    """Return whether a field is a number, or a word for a missing one."""
    return bool((NUMBER_COMMA if comma else NUMBER).fullmatch(field)) or _is_missing(field)


def number_of(field: str, comma: bool) -> float:
    """Return the value of a field, NaN if it is empty or marked as missing; ValueError if it is no number."""
    if (NUMBER_COMMA if comma else NUMBER).fullmatch(field):
        return float(re.sub("[dD]", "e", field.replace(",", ".")))
    if not field or _is_missing(field):
        return math.nan
    raise ValueError(field)


def _is_missing(field: str) -> bool:
    """Whether a field is a word for a missing number, or the stars of a number too wide for its column."""
    return field.lower() in MISSING_VALUES or (len(field) > 1 and not field.strip("*"))


def count_numbers(row: Sequence[str], comma: bool) -> int:
    """Return how many fields are numbers, or words for missing ones."""
    return sum(is_number(field, comma) for field in row)


def holds_three(row: Sequence[str], comma: bool) -> bool:
    """Return whether three fields or more are numbers, or words for missing ones: of a long row the first three are enough."""
    numbers = (field for field in row if is_number(field, comma))
    return len(list(islice(numbers, 3))) == 3


def holds_numbers(row: Sequence[str], comma: bool) -> bool:
    """Whether a field is a number, or the line holds two numbers when split by any separator."""
    if any(is_number(field, comma) for field in row):
        return True
    words = [word for field in row for word in _BREAKS.split(field)]
    return sum(bool(NUMBER.fullmatch(word) or NUMBER_COMMA.fullmatch(word)) for word in words) >= 2


def header_names(header: Sequence[str], separator: str | None) -> Iterator[list[str]]:
    """Yield the header lines split by every separator in turn, the line nearest to the points first."""
    for line in reversed(header):
        text = line.strip().lstrip("#/%!;* \t").strip()
        for sign in dict.fromkeys((separator, ",", ";", "\t", None, ANY_SEPARATOR)):
            yield split_fields(text, sign)
