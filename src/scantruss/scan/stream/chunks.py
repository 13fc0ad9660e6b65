"""The points of a tile in chunks, so that memory does not grow with the scan."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ...errors import FormatError
from ...selection import Selection
from ..formats.columns import find_attributes
from ..formats.content import Content
from ..formats.copc import WantedBox
from ..formats.geotiff import terrain_chunks
from ..formats.kinds import reading_as
from ..formats.las import POINTS_PER_CHUNK, check_count, content_of_records, fields_for, fields_of, records_near
from ..formats.reading import places_in_file, read_content, select
from ..formats.text import EMPTY_LINES, NAME_IT, is_number_of_point, read_lines

if TYPE_CHECKING:
    from pathlib import Path

    from .source import Source, Tile


POINTS_DESCRIBED = 10_000  # points that are described if none is taken
CHUNK_BYTES = 1 << 24  # bytes of text


@dataclass(frozen=True)
class Reading:
    """How points are read from all files of a scan."""

    unit: str = ""  #: given by the user
    selection: Selection = field(default_factory=Selection)
    common: str = ""  #: unit of the first file that states one; others are converted to it


class Chunk(NamedTuple):
    """Some points of a file after selection."""

    points: np.ndarray  #: (K, 3) float64 [unit of the scan], in the scan's own frame
    read: int  #: points that were read
    left_out: dict[str, int]  #: of these, what the file calls none and what each part of the selection left out
    notes: tuple[str, ...] = ()  #: of the reader of a whole file
    held: str = ""  #: what could have been selected, if nothing was
    promised: int = 0  #: points that count lines among them promise: texts of several scans


def read_chunks(
    tile: Tile, reading: Reading | None = None, size: int = POINTS_PER_CHUNK, *, alone: bool = True
) -> Iterator[Chunk]:
    """Yield the points of a tile: those that are selected, in the unit of the scan.

    Parameters
    ----------
    tile : a part of a file
    reading : unit and selection; all points in the file's own unit by default; optional
    size : most points of a chunk, where the file can be read in chunks
    alone : no other tile is read at the same time, so that a reader may use all processors

    Raises
    ------
    FormatError
        The file is damaged, or ends before its points do.
    InputError
        The file does not hold what is to be selected.
    """
    reading = reading or Reading()
    kind, wanted = tile.source.kind, reading.selection.needs
    counts: list[int] = []
    if kind == "las":
        contents = _las(tile, reading, size, alone)
    elif kind == "rows":
        contents = _fixed_rows(tile, wanted, size)
    elif kind == "terrain":
        contents = terrain_chunks(tile.source.path)
    else:
        contents = _text(tile, counts) if kind == "text" else _whole(tile, wanted)
    for content in contents:
        yield _taken(tile.source.path, content, reading)._replace(promised=sum(counts))
        counts.clear()


def _taken(path: Path, content: Content, reading: Reading) -> Chunk:
    """Return what is selected of some points, in the unit of the scan."""
    part = select(path, content, reading.unit, reading.selection, reading.common, POINTS_DESCRIBED)
    with np.errstate(over="ignore", invalid="ignore"):  # what is not finite is left out later
        points = np.ascontiguousarray(part.points, np.float64)
    return Chunk(points, part.count, part.left_out, content.notes, part.held)


def read_ahead(chunks: Iterator[Chunk]) -> Iterator[Chunk]:
    """Yield the same chunks, each read while the previous one is processed."""
    with ThreadPoolExecutor(1) as pool:
        waiting = pool.submit(next, chunks, None)
        while (chunk := waiting.result()) is not None:
            waiting = pool.submit(next, chunks, None)
            yield chunk


def _las(tile: Tile, reading: Reading, size: int, alone: bool) -> Iterator[Content]:
    import laspy

    path = tile.source.path
    names = fields_of(reading.selection.needs)
    backend = (laspy.LazBackend.LazrsParallel,) if alone else (laspy.LazBackend.Lazrs,)
    begin, short = tile.begin, False
    with (
        reading_as(path, "LAS or LAZ"),
        laspy.open(path, laz_backend=backend, decompression_selection=fields_for(names)) as file,
    ):
        if near := records_near(path, file.header, _places_of(tile.source, reading), names, size):
            yield from _near(tile.source, names, *near)
            return
        if begin:
            file.seek(begin)
        while begin < tile.end and not short:
            expected = min(size, tile.end - begin)
            record: Any = file.read_points(expected)
            short = len(record) < expected
            begin += len(record)
            yield tile.source.applied_to(content_of_records(record, names))
    if short:
        check_count(path, tile.source.points, begin)


def _near(source: Source, names: Sequence[str], records: Iterator[Any], unread: dict[str, int]) -> Iterator[Content]:
    for record in records:
        yield replace(source.applied_to(content_of_records(record, names)), unread=unread)
        unread = {}


def _places_of(source: Source, reading: Reading) -> list[WantedBox]:
    """Return the boxes around what is cropped in the unit of a file that may be COPC; none of others."""
    if not (source.in_one and reading.selection.crop):
        return []
    header = source.applied_to(Content(np.empty((0, 3))))
    return places_in_file(source.path, header, reading.unit, reading.selection, reading.common)


def count_unread(source: Source, reading: Reading) -> int:
    """Return how many points of a file are never read, because their part of it is outside the crop."""
    if not (places := _places_of(source, reading)):
        return 0
    import laspy

    with laspy.open(source.path) as file:
        near = records_near(source.path, file.header, places, ())
    return sum(near[1].values()) if near else 0


def _fixed_rows(tile: Tile, wanted: Sequence[str], size: int) -> Iterator[Content]:
    source, kind = tile.source, tile.source.rows
    assert kind is not None
    names = kind.names or ()
    found = {attribute: names[place] for attribute, place in find_attributes(names, wanted).items()}
    with source.path.open("rb") as file:
        file.seek(source.begin + tile.begin * kind.itemsize)
        for begin in range(tile.begin, tile.end, size):
            expected = min(size, tile.end - begin)
            rows = np.fromfile(file, kind, expected)
            if len(rows) < expected:
                raise FormatError(f"{source.path} ends early: it has become shorter while it was read")
            with np.errstate(over="ignore", invalid="ignore"):  # what is not finite is left out later
                points = np.stack([rows[axis].astype(np.float64, copy=False) for axis in "xyz"], axis=1)
            yield source.applied_to(Content(points, {attribute: rows[name] for attribute, name in found.items()}))


def _whole(tile: Tile, wanted: Sequence[str]) -> Iterator[Content]:
    source = tile.source
    content = read_content(source.path, wanted)
    if (content.metres, content.z_metres) != (source.metres, source.z_metres):
        raise FormatError(f"{source.path} states another unit than before; thin it while nothing writes to it")
    yield content


def _text(tile: Tile, counts: list[int]) -> Iterator[Content]:
    """Read the lines that begin in a range of bytes; `counts` receives the numbers of count lines."""
    source, layout = tile.source, tile.source.layout
    assert layout is not None
    columns = (*source.columns, *(column for _, column in layout.attributes))
    with source.path.open("rb") as file:
        file.seek(tile.begin)
        if tile.begin > source.begin:
            file.seek(tile.begin - 1)
            file.readline()  # the rest of a line that belongs to the previous tile
        while (at := file.tell()) < tile.end:
            block = file.read(min(CHUNK_BYTES, tile.end - at))
            if not block.endswith(b"\n"):
                block += file.readline()
            if block.strip():
                rows, promised, empty = read_lines(source.path, block, layout, columns, at)
                counts.append(promised)
                if len(source.columns) == 4:
                    if not is_number_of_point(rows[:, 0]):
                        raise FormatError(
                            f"{source.path}: its first column counts up at the start, but not all through; {NAME_IT}"
                        )
                    rows = rows[:, 1:]
                more = {name: rows[:, 3 + i] for i, (name, _) in enumerate(layout.attributes)}
                left_out = {EMPTY_LINES: empty} if empty else {}
                yield source.applied_to(Content(rows[:, :3], more, left_out=left_out))
