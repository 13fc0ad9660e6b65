"""ESRI ASCII grids (.asc): heights on a raster; the points are the centres of its cells."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ...errors import FormatError
from .content import Content
from .kinds import kind_of, read_head
from .text import read_text

RASTER = "a raster (ESRI ASCII grid)"  # of `kinds`
RASTER_HEAD = re.compile(
    r"\s*(ncols|nrows|xll(?:corner|center)|yll(?:corner|center)|cellsize|dx|dy|nodata_value)[ \t]+(\S+)[ \t]*\r?\n?",
    re.IGNORECASE,
)
MOST_CELLS = 1 << 31  # cells above which a raster is refused


def read_asc(path: Path, wanted: Sequence[str] = ()) -> Content:
    """Return the points of an .asc file: a raster with its head, or else columns of text."""
    if kind_of(read_head(path)) != RASTER:
        return read_text(path, wanted)
    text = path.read_text(encoding="latin-1")
    head, start = dict[str, float](), 0
    while found := RASTER_HEAD.match(text, start):  # a match is not empty
        try:
            head[found[1].lower()] = float(found[2])
        except ValueError:
            raise FormatError(f"{path}: {found[1]} is not a number; the file is damaged") from None
        start = found.end()
    columns, rows = (head.get(name, 0.0) for name in ("ncols", "nrows"))
    wide, high = (head.get(name, head.get("cellsize", 0.0)) for name in ("dx", "dy"))
    corner = []
    for axis, size in (("x", wide), ("y", high)):
        middle, edge = head.get(f"{axis}llcenter"), head.get(f"{axis}llcorner")
        if middle is None and edge is None:
            raise FormatError(f"{path} has no {axis}llcorner; export the raster again")
        corner.append(middle if middle is not None else edge + size / 2 if edge is not None else 0.0)
    whole = columns.is_integer() and rows.is_integer() and 0 < columns * rows <= MOST_CELLS and columns > 0
    if not whole or not (0 < wide < np.inf and 0 < high < np.inf) or not np.isfinite(corner).all():
        raise FormatError(f"{path} has no usable ncols, nrows and cellsize; export the raster again")
    words = text[start:].split()
    if len(words) != columns * rows:
        raise FormatError(
            f"{path} has {len(words):,} heights where its head promises {int(columns * rows):,}; copy it again"
        )
    try:
        heights = np.array(words, dtype=np.float64).reshape(int(rows), int(columns))
    except ValueError:
        raise FormatError(f"{path} has a height that is not a number; the file is damaged") from None
    known = np.isfinite(heights) & (heights != head.get("nodata_value", np.nan))
    row, column = np.nonzero(known)
    x, y = corner[0] + column * wide, corner[1] + (int(rows) - 1 - row) * high  # the first row is the northernmost
    missing = int(known.size - known.sum())
    return Content(
        np.stack([x, y, heights[known]], axis=1), left_out={"in cells without data": missing} if missing else {}
    )
