"""The points of a tile, some at a time, so that memory does not grow with the scan."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from io import BytesIO
from typing import TYPE_CHECKING

import numpy as np

from ..errors import FormatError
from .kinds import unreadable
from .layout import MISSING, NUMBER, NUMBER_COMMA, Layout, split_line

if TYPE_CHECKING:
    from pathlib import Path

    from .tiles import Tile

CHUNK = 1_000_000  # points
BLOCK = 1 << 24  # bytes of text


def read_chunks(tile: Tile, size: int = CHUNK, *, alone: bool = True) -> Iterator[np.ndarray]:
    """Yield the points of a tile, (K, 3) float64 each in the scan's own frame [scan unit].

    Parameters
    ----------
    tile : Tile
        A part of a file.
    size : int
        Most points of a chunk, where the file can be read in chunks.
    alone : bool
        Nobody else reads, so that a reader may use all processors.

    Raises
    ------
    FormatError
        The file is damaged, or ends before its points do.
    """
    kind = tile.source.kind
    if kind == "las":
        return _las(tile, size, alone)
    if kind == "rows":
        return _fixed_rows(tile, size)
    return _text(tile) if kind == "text" else _whole(tile)


def read_ahead(chunks: Iterator[np.ndarray]) -> Iterator[np.ndarray]:
    """Yield the same chunks, each read while the one before is worked on."""
    with ThreadPoolExecutor(1) as pool:
        waiting = pool.submit(next, chunks, None)
        while (chunk := waiting.result()) is not None:
            waiting = pool.submit(next, chunks, None)
            yield chunk


def _las(tile: Tile, size: int, alone: bool) -> Iterator[np.ndarray]:
    import laspy

    path = tile.source.path
    backend = (laspy.LazBackend.LazrsParallel,) if alone else (laspy.LazBackend.Lazrs,)
    begin, short = tile.begin, False
    try:
        selection = laspy.DecompressionSelection.base() | laspy.DecompressionSelection.Z
        with laspy.open(path, laz_backend=backend, decompression_selection=selection) as file:
            if begin:
                file.seek(begin)
            while begin < tile.end and not short:
                wanted = min(size, tile.end - begin)
                record = file.read_points(wanted)
                short = len(record) < wanted
                begin += len(record)
                points = np.empty((len(record), 3))
                for axis, name in enumerate("xyz"):
                    points[:, axis] = record[name]
                yield points
    except BaseException as error:
        raise unreadable(path, "LAS or LAZ", error) from None
    if short:
        promised = tile.source.points
        raise FormatError(f"{path} ends early: its header promises {promised:,} points, got {begin:,}; copy it again")


def _fixed_rows(tile: Tile, size: int) -> Iterator[np.ndarray]:
    source, kind = tile.source, tile.source.rows
    assert kind is not None
    with source.path.open("rb") as file:
        file.seek(source.begin + tile.begin * kind.itemsize)
        for begin in range(tile.begin, tile.end, size):
            wanted = min(size, tile.end - begin)
            rows = np.fromfile(file, kind, wanted)
            if len(rows) < wanted:
                raise FormatError(f"{source.path} ends early: it has become shorter while it was read")
            yield np.stack([rows[axis].astype(np.float64, copy=False) for axis in "xyz"], axis=1)


def _whole(tile: Tile) -> Iterator[np.ndarray]:
    from .readers import read_points

    cloud = read_points(tile.source.path)
    points = cloud.points + cloud.origin
    if cloud.dropped:
        points = np.concatenate([points, np.full((cloud.dropped, 3), np.nan)])  # so that they are counted
    yield points


def _text(tile: Tile) -> Iterator[np.ndarray]:
    """Read the lines that begin in a range of bytes."""
    source, layout = tile.source, tile.source.layout
    assert layout is not None
    with source.path.open("rb") as file:
        file.seek(tile.begin)
        if tile.begin > source.begin:
            file.seek(tile.begin - 1)
            file.readline()  # of a line that began before: another tile has it
        while (at := file.tell()) < tile.end:
            block = file.read(min(BLOCK, tile.end - at))
            if not block.endswith(b"\n"):
                block += file.readline()
            if block.strip():
                yield text_rows(source.path, block, layout, source.columns, at=f", after byte {at:,}")


def text_rows(path: Path, block: bytes, layout: Layout, columns: Sequence[int], at: str) -> np.ndarray:
    """Return the columns of the lines of a block of text, (K, columns) float64."""
    try:
        if b".#" in block:
            raise ValueError
        lines = block.replace(b",", b".") if layout.comma else block
        return np.loadtxt(
            BytesIO(lines), comments="#", delimiter=layout.separator, usecols=columns, encoding="latin-1", ndmin=2
        )
    except ValueError:
        return _line_by_line(path, block, layout, columns, at)


def _line_by_line(path: Path, block: bytes, layout: Layout, columns: Sequence[int], at: str) -> np.ndarray:
    """Return the columns of lines that numpy cannot read: missing values, other comments, lines that count."""
    rows = []
    encoding = "utf-8" if layout.encoding.startswith("utf-8") else layout.encoding
    for line in block.decode(encoding, errors="replace").splitlines():
        fields = split_line(line, layout.separator)
        if not fields or (len(fields) == 1 and fields[0].isdecimal()):
            continue
        try:
            row = [_number(fields[column], layout) for column in columns]
        except (ValueError, IndexError):
            if not any(NUMBER.fullmatch(field) for field in fields):
                continue
            said = " ".join(fields)[:60]
            raise FormatError(f"{path}{at}: {said!r} has no numbers x, y, z; mend or delete the line") from None
        if any(fields[column] for column in columns):
            rows.append(row)
    return np.array(rows).reshape(-1, len(columns))


def _number(field: str, layout: Layout) -> float:
    """Return the value of a field, NaN where it is empty or says that it is missing."""
    if (NUMBER_COMMA if layout.comma else NUMBER).fullmatch(field):
        return float(re.sub("[dD]", "e", field.replace(",", ".")))
    if not field or field.lower() in MISSING:
        return math.nan
    raise ValueError(field)
