"""Scans of any size: thinned while they are read, tile by tile, here or by several workers."""

from __future__ import annotations

import socket
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...errors import FormatError, InputError
from ...runtime.cluster import Workers
from ...runtime.progress import Progress
from ...selection import Selection
from ..checks import extent_note, extent_of, joint_extent
from ..formats.content import surplus_note
from ..formats.paths import FileNames, name_of_files
from ..formats.reading import add_counts, left_out_note
from .chunks import Chunk, Reading, read_ahead, read_chunks
from .opened import OpenScan, open_scan
from .source import Source, Tile
from .thinning import (
    BoxRows,
    Nearest,
    Thinning,
    check_spacing,
    means_of,
    nearest_in,
    nearest_of_parts,
    points_at_boundary,
)
from .tiles import POINTS_PER_TILE, tiles_of

KEEP_CHOICES = ("mean", "nearest")
FEWEST_POINTS_OF_TILE = 500_000  # fewest points of a tile that are worth a worker
FEWEST_POINTS_OF_SURFACE = 24  # fewest points of a surface
TILES_PER_WORKER = 4  # for each worker at least, so that all end at about the same time


@dataclass(frozen=True)
class Thinned:
    """A scan with one point a box."""

    #: (C, 3) float64 in the scan's own frame [unit], by the number of their boxes; then those at the boundary
    points: np.ndarray
    read: int  #: points that were taken
    dropped: int  #: of these, points left out because a coordinate was NaN or infinite
    boundary: int  #: points that stand for the boundary, the last of `points`
    unit: str = ""  #: of the coordinates; "" if neither a file nor the user says it
    notes: tuple[str, ...] = ()  #: what was left out or converted
    system: str = ""  #: reference system of the points


def check_enough(thinned: Thinned, spacing: float, option: str) -> None:
    """Refuse a spacing that leaves hardly a point of a scan.

    Raises
    ------
    InputError
        Fewer points are left than a surface needs, of more that were read.
    """
    left, read = len(thinned.points), thinned.read - thinned.dropped
    if left < FEWEST_POINTS_OF_SURFACE <= read:
        raise InputError(
            f"{option} {spacing:g} leaves {left} of {read:,} points, too few for a surface; give a smaller spacing, in the unit of the scan"
        )


def thin_scan(
    names: FileNames,
    spacing: float,
    *,
    keep: str = "mean",
    boundary: bool = False,
    unit: str = "",
    selection: Selection | None = None,
    workers: Workers | None = None,
    progress: Progress | None = None,
) -> Thinned:
    """Return one point for each box of a scan in one or more files, with memory for the result only.

    The result is the same to the byte for any order of the files (of one unit) and any number of workers.

    Parameters
    ----------
    names : files, or patterns as ``tiles/*.laz``; all in one frame
    spacing : side of a box [unit of the scan]; the boxes are a lattice through the zero of the scan's frame
    keep : "mean" of the points in a box, or the one "nearest" to it (the scan is read twice)
    boundary : also keep the outermost points of boxes at the boundary
    unit, selection
        As for `scan.formats.reading.read_points`: unit of the coordinates, and which points are taken.
    workers : the workers to use; this process by default; optional
    progress : ``progress(stage, share)``; optional

    Raises
    ------
    FormatError
        A file is missing, damaged or no scan.
    InputError
        The spacing or the units are not accepted, or nothing is selected.
    """
    scan = open_scan(names, unit, selection)
    return thin_open_scan(scan, spacing, keep=keep, boundary=boundary, workers=workers, progress=progress)


def thin_open_scan(
    scan: OpenScan,
    spacing: float,
    *,
    keep: str = "mean",
    boundary: bool = False,
    workers: Workers | None = None,
    progress: Progress | None = None,
) -> Thinned:
    """Return one point for each box of a scan whose headers are read; see `thin_scan`."""
    check_spacing(spacing)
    if keep not in KEEP_CHOICES:
        raise InputError(f"keep must be one of {' '.join(KEEP_CHOICES)}, got {keep!r}")
    workers = workers or Workers()
    sources, reading, notes, system = scan
    rows, summary = _all_rows(sources, reading, spacing, boundary, workers, ShareDone(progress, "read", sources))
    if rows.points == rows.dropped:
        raise _nothing(sources, rows, summary)
    if keep == "nearest":
        chosen = _all_nearest(sources, reading, rows, spacing, workers, ShareDone(progress, "read again", sources))
    else:
        chosen = means_of(rows.rows, spacing)
    added = points_at_boundary(rows, spacing) if boundary else chosen[:0]
    notes = (*dict.fromkeys([*summary.notes, *notes]), *left_out_note([summary.left_out]))
    both = np.concatenate([chosen, added]) if boundary else chosen
    return Thinned(both, rows.points, rows.dropped, len(added), reading.common, notes, system)


class ShareDone:
    """Report the share of points that are done."""

    def __init__(self, progress: Progress | None, stage: str, sources: Sequence[Source]) -> None:
        self._progress, self._stage = progress, stage
        self._total = max(sum(source.points for source in sources), 1)
        self._done = 0

    def __call__(self, points: int) -> None:
        """Report more points as done."""
        self._done += points
        if self._progress:
            self._progress(self._stage, min(self._done / self._total, 1.0))


class ReadSummary:
    """What the chunks of a scan, or of a part of it, report besides their points."""

    def __init__(self) -> None:
        self.read = 0  #: points that were read
        #: of these, what files call none and what each part of the selection left out
        self.left_out: dict[str, int] = {}
        self.notes: tuple[str, ...] = ()
        self.held = ""  #: what could have been selected, of a part of which nothing was
        self.promised = 0  #: points that count lines promise
        self.extent = extent_of(np.empty((0, 3)))  #: (2, 3) about where the points are

    def add(self, other: ReadSummary | Chunk) -> None:
        """Add the report of another chunk or part."""
        self.read += other.read
        self.left_out = add_counts([self.left_out, other.left_out])
        self.notes = (*self.notes, *other.notes)
        self.promised += other.promised
        self.extent = joint_extent(self.extent, extent_of(other.points) if isinstance(other, Chunk) else other.extent)
        self.held = self.held or other.held


def _all_rows(
    sources: Sequence[Source], reading: Reading, spacing: float, boundary: bool, workers: Workers, report: ShareDone
) -> tuple[BoxRows, ReadSummary]:
    """Return the boxes of all points that are taken."""
    thinning = Thinning(spacing, boundary=boundary)
    summary = {source.path.absolute(): ReadSummary() for source in sources}
    if workers.alone:
        for tile in tiles_of(sources):
            for chunk in read_ahead(read_chunks(tile, reading)):
                thinning.add(chunk.points)
                summary[tile.source.path.absolute()].add(chunk)
                report(chunk.read)
    else:
        tiles = _tiles_for(sources, workers)
        for number, (rows, part) in workers.run(_rows_of, tiles, (reading, spacing, boundary)):
            thinning.add_rows(rows)
            summary[tiles.taken[number].source.path].add(part)
            report(tiles.taken[number].points)
    whole = ReadSummary()
    for source in sources:
        part = summary[source.path.absolute()]
        _check_counts(source, part)
        whole.add(part)
    extents = [summary[source.path.absolute()].extent for source in sources]
    whole.notes = (*whole.notes, *extent_note([source.path for source in sources], extents))
    return thinning.take_rows(), whole


def _check_counts(source: Source, summary: ReadSummary) -> None:
    """Refuse a text with fewer points than its count lines promise; note one with more."""
    if source.kind == "text" and source.layout and source.layout.promised is not None:
        promised = source.layout.promised + summary.promised
        if summary.read < promised:
            raise FormatError(
                f"{source.path} ends early: its count lines promise {promised:,} points, got {summary.read:,}; copy it again"
            )
        if summary.read > promised:
            summary.notes = (*summary.notes, surplus_note(source.path.name, summary.read, promised))


class _Tiles:
    """Tiles as they are asked for; remembers those that were taken by their number."""

    def __init__(self, sources: Sequence[Source], points: int) -> None:
        self._tiles = tiles_of(sources, points)
        self.taken: list[Tile] = []

    def __iter__(self) -> Iterator[Tile]:
        for tile in self._tiles:
            self.taken.append(tile)
            yield tile


def _tiles_for(sources: Sequence[Source], workers: Workers) -> _Tiles:
    """Return tiles for several workers, which may run on other machines."""
    there = [replace(source, path=source.path.absolute()) for source in sources]
    total = sum(source.points for source in sources)
    return _Tiles(there, min(max(total // (TILES_PER_WORKER * workers.count), FEWEST_POINTS_OF_TILE), POINTS_PER_TILE))


def _rows_of(tile: Tile, shared: tuple[Reading, float, bool]) -> tuple[BoxRows, ReadSummary]:
    """Return the boxes of a tile and what its chunks report: the work of a worker."""
    reading, spacing, boundary = shared
    thinning, summary = Thinning(spacing, boundary=boundary), ReadSummary()
    for chunk in _chunks_there(tile, reading):
        thinning.add(chunk.points)
        summary.add(chunk)
    return thinning.take_rows(), summary


def _all_nearest(
    sources: Sequence[Source], reading: Reading, rows: BoxRows, spacing: float, workers: Workers, report: ShareDone
) -> np.ndarray:
    """Return the points nearest to the means of all boxes."""
    if workers.alone:

        def chunks() -> Iterator[np.ndarray]:
            for tile in tiles_of(sources):
                for chunk in read_ahead(read_chunks(tile, reading)):
                    report(chunk.read)
                    yield chunk.points

        return nearest_of_parts(len(rows.rows), [nearest_in(chunks(), rows.rows, spacing)])
    tiles = _tiles_for(sources, workers)

    def parts() -> Iterator[Nearest]:
        for number, part in workers.run(_nearest_of, tiles, (reading, rows.rows, spacing)):
            report(tiles.taken[number].points)
            yield part

    return nearest_of_parts(len(rows.rows), parts())


def _nearest_of(tile: Tile, shared: tuple[Reading, np.ndarray, float]) -> Nearest:
    """Return the points of a tile nearest to the means of boxes: the work of a worker."""
    reading, rows, spacing = shared
    return nearest_in((chunk.points for chunk in _chunks_there(tile, reading)), rows, spacing)


def _chunks_there(tile: Tile, reading: Reading) -> Iterator[Chunk]:
    """Yield the chunks of a tile; an error names the machine on which its file is missing."""
    path = tile.source.path
    if not path.exists():
        raise FormatError(f"{path} is missing on {socket.gethostname()}; all workers need the files under one name")
    return read_chunks(tile, reading, alone=False)


def _nothing(sources: Sequence[Source], rows: BoxRows, summary: ReadSummary) -> Exception:
    """Return why there is no point to keep."""
    where = str(sources[0].path) if len(sources) == 1 else f"none of the {len(sources)} files"
    if rows.points or not summary.read:
        return FormatError(f"{where} holds {'no points but NaN or infinite ones' if rows.points else 'no points'}")
    counts = ", ".join(f"{number:,} {words}" for words, number in summary.left_out.items() if number)
    name = name_of_files([source.path for source in sources])
    have = f"; some of them have{summary.held}" if summary.held else ""
    return InputError(f"no point of {name} is left: of {summary.read:,} points {counts}{have}")
