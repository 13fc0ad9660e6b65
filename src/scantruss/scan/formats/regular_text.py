"""Regular text files of points by a compiled loop, a block at a time: what numpy reads too, but four times faster."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from .layout import Layout

LARGE = 1 << 23  # bytes of a file for which it is worth loading the compiled loop
BYTES_PER_BLOCK = 1 << 24  # bytes
LONGEST = 1 << 20  # bytes of a line
MOST_SLOW = 1 << 16  # numbers of a block that Python rounds; of more, numpy is as fast


def read_regular(path: Path, layout: Layout, columns: Sequence[int], block: int = BYTES_PER_BLOCK) -> np.ndarray | None:
    """Return some columns of a text file, (N, len(columns)) float64; None where a line is not of plain numbers.

    Parameters
    ----------
    path : Path
        One byte a letter or UTF-8; lines end with LF or CRLF.
    layout : Layout
        Separator, decimal sign, lines to skip.
    columns : sequence of int
        Wanted fields of a line.
    block : int
        Bytes read at a time.
    """
    tables = []
    with path.open("rb") as file:
        for _ in range(layout.skip):
            if not file.readline(LONGEST).endswith(b"\n"):
                return None
        while raw := bytearray(file.read(block)):
            rest = file.readline(LONGEST)
            raw += rest
            table = read_block(raw, layout, columns) if len(rest) < LONGEST else None
            if table is None:
                return None
            tables.append(table)
    return np.concatenate(tables) if tables else None


def read_block(raw: bytearray, layout: Layout, columns: Sequence[int]) -> np.ndarray | None:
    """Return some columns of whole lines of a text file; None where a line is not of plain numbers."""
    if layout.encoding == "utf-16" or not layout.plain or len(set(columns)) < len(columns):
        return None
    from ...kernels.scan.decimals import read_rows

    place = np.full(max(columns) + 1, -1, dtype=np.int64)
    place[list(columns)] = np.arange(len(columns))
    separator = ord(layout.separator) if layout.separator else 0
    data = np.frombuffer(raw, dtype=np.uint8)
    table = np.empty((int(np.count_nonzero(data == 10)) + 1, len(columns)))
    slow = np.empty((MOST_SLOW, 4), dtype=np.int64)
    rows, late = read_rows(data, len(data), separator, layout.comma, place, table, slow)
    if rows < 0:
        return None
    for row, column, start, stop in slow[:late].tolist():
        table[row, column] = float(data[start:stop].tobytes().replace(b",", b"."))
    return table[:rows]
