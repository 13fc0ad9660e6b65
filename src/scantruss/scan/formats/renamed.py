"""Lines among the points of a text file that name the columns again: harmless where they stand as before."""

from __future__ import annotations

import re
from collections.abc import Sequence
from mmap import mmap
from pathlib import Path
from typing import NamedTuple

from ...errors import FormatError
from ..units import metres_of_columns
from .columns import find_columns, fit_columns
from .content import find_attributes
from .layout import COMMENT, Layout, header_names

_WORDS = re.compile(rb"^[ \t]*#[^\r\n]*[A-Za-z][^\r\n]*", re.MULTILINE)


class Names(NamedTuple):
    """A line that may name columns."""

    number: int  #: of the line, from the first that was looked at
    line: str
    names: list[str]

    @property
    def in_comment(self) -> bool:
        """Whether it may as well be prose with an x, a y and a z."""
        return bool(COMMENT.match(self.line.strip()))


def find_names(number: int, line: str, layout: Layout) -> Names | None:
    """Return the names x, y, z ... of a line; None where it has none, or is a line of the header again."""
    if not line.strip() or line.strip() in layout.header:
        return None
    for names in header_names([line], layout.separator):
        if len(names) >= 3 and find_columns(names):
            return Names(number, line, names)
    return None


def has_names_in_comments(data: bytes | mmap, layout: Layout) -> bool:
    """Whether a comment with # may name columns, which who skips comments would not see."""
    return any(find_names(0, match[0].decode("latin-1"), layout) for match in _WORDS.finditer(data))


def check_names(path: Path, names: Names, row: Sequence[str], layout: Layout, before: int) -> None:
    """Refuse names by which the row below them has its coordinates elsewhere than the header of the file says."""
    found = fit_columns(names.names, len(row), layout.columns[0] > 0)
    if found is None and names.in_comment:
        return
    if found == layout.columns and not _differs(path, names.names, found, layout):
        return
    raise FormatError(
        f"{path}: line {before + names.number} ({names.line.strip()[:60]!r}) names the columns again, in another way than"
        " before; make a file of each part"
    )


def _differs(path: Path, names: Sequence[str], columns: Sequence[int], layout: Layout) -> bool:
    """Whether attributes stand elsewhere, or lengths are in another unit."""
    if max(columns) >= len(names):
        return False
    metres, z_metres = metres_of_columns(path, [names[column] for column in columns])
    if metres and layout.metres and (metres, z_metres) != (layout.metres, layout.z_metres):
        return True
    attributes = dict(layout.attributes)
    return find_attributes(names, list(attributes)) != attributes
