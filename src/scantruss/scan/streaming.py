"""Scans of any size: thinned while they are read, tile by tile, here or by several workers."""

from __future__ import annotations

import socket
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..errors import FormatError, InputError
from ..machine import available_memory
from ..workers import Workers
from .chunks import read_ahead, read_chunks
from .cloud import PointCloud
from .readers import read_points
from .thin import Nearest, Rows, Thinning, check_spacing, means_of, nearest_in, nearest_points, points_at_rim
from .tiles import TILE, Source, Tile, find_files, find_source, tiles_of

if TYPE_CHECKING:
    from ..settings import Settings

Progress = Callable[[str, float], None]

KEEP = ("mean", "nearest")
SMALLEST = 500_000  # points of a tile that is worth a worker
TILES = 4  # for each worker at least, so that all end at about the same time
FINENESS = 20.0  # boxes along a member, where a scan is thinned to fit into memory
BYTES = 100.0  # of memory that a point takes on its way to a grid; 55 to 90 were measured
FEWEST = 100_000  # points that are never too many
SHARE = 0.5  # of the memory at hand that a scan may take


@dataclass(frozen=True)
class Thinned:
    """A scan with one point a box."""

    points: (
        np.ndarray
    )  #: (C, 3) float64 in the scan's own frame [scan unit], by the number of their boxes; then those at the rim
    read: int  #: points that were read
    dropped: int  #: of these, points left out because a coordinate was NaN or infinite
    rim: int  #: points that stand for the rim, the last of `points`


def thin_scan(
    names: Sequence[str | Path],
    spacing: float,
    *,
    keep: str = "mean",
    rim: bool = False,
    workers: Workers | None = None,
    progress: Progress | None = None,
) -> Thinned:
    """Return one point for each box of a scan in one or more files, with memory for the result only.

    The same to the byte for any order of the files, and for any number of workers.

    Parameters
    ----------
    names : sequence of str or Path
        Files, or patterns as ``tiles/*.laz``; all in one frame.
    spacing : float
        Side of a box [scan unit]; the boxes are a lattice through the zero of the scan's frame.
    keep : str
        "mean" of the points in a box, or the one "nearest" to it (the scan is read twice).
    rim : bool
        Also keep the outermost points of boxes at the rim.
    workers : Workers, optional
        Who does it; this process by default.
    progress : callable, optional
        ``progress(stage, share)``.

    Raises
    ------
    FormatError
        A file is missing, damaged or no scan.
    InputError
        The spacing does not do.
    """
    check_spacing(spacing)
    if keep not in KEEP:
        raise InputError(f"keep must be one of {' '.join(KEEP)}, got {keep!r}")
    workers = workers or Workers()
    sources = [find_source(path) for path in find_files(names)]
    if not sources:
        raise InputError("no scan is named")
    stages = ("read", "read again") if keep == "nearest" else ("read",)
    rows = _all_rows(sources, spacing, rim, workers, _Share(progress, stages[0], sources))
    if rows.points == rows.dropped:
        raise FormatError(f"{_words(sources)} holds no points" + (" but NaN or infinite ones" if rows.dropped else ""))
    if keep == "nearest":
        chosen = _all_nearest(sources, rows, spacing, workers, _Share(progress, stages[-1], sources))
    else:
        chosen = means_of(rows.rows, spacing)
    if not rim:
        return Thinned(chosen, rows.points, rows.dropped, 0)
    added = points_at_rim(rows, spacing)
    return Thinned(np.concatenate([chosen, added]), rows.points, rows.dropped, len(added))


class _Share:
    """Report the share of points that are done."""

    def __init__(self, progress: Progress | None, stage: str, sources: Sequence[Source]) -> None:
        self._progress, self._stage = progress, stage
        self._total = max(sum(source.points for source in sources), 1)
        self._done = 0

    def __call__(self, points: int) -> None:
        self._done += points
        if self._progress:
            self._progress(self._stage, min(self._done / self._total, 1.0))


def _all_rows(sources: Sequence[Source], spacing: float, rim: bool, workers: Workers, report: _Share) -> Rows:
    """Return the boxes of all points."""
    thinning = Thinning(spacing, rim=rim)
    read: dict[Path, int] = {}
    if workers.alone:
        for tile in tiles_of(sources):
            for points in read_ahead(read_chunks(tile)):
                thinning.add(points)
                read[tile.source.path] = read.get(tile.source.path, 0) + len(points)
                report(len(points))
    else:
        tiles = _tiles_for(sources, workers)
        for number, part in workers.run(_rows_of, tiles, (spacing, rim)):
            thinning.add_rows(part)
            path = tiles.taken[number].source.path
            read[path] = read.get(path, 0) + part.points
            report(tiles.taken[number].points)
    for source in sources:
        promised = source.layout.promised if source.layout else None
        if promised and read.get(source.path, promised) < promised:
            raise FormatError(
                f"{source.path} ends early: its count line promises {promised:,} points,"
                f" got {read[source.path]:,}; copy it again"
            )
    return thinning.take_rows()


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
    """Return tiles for several workers, who may not be where we are."""
    there = [replace(source, path=source.path.resolve()) for source in sources]
    total = sum(source.points for source in sources)
    return _Tiles(there, min(max(total // (TILES * workers.count), SMALLEST), TILE))


def _rows_of(tile: Tile, shared: tuple[float, bool]) -> Rows:
    """Return the boxes of a tile: the work of a worker."""
    spacing, rim = shared
    thinning = Thinning(spacing, rim=rim)
    for points in _chunks_there(tile):
        thinning.add(points)
    return thinning.take_rows()


def _all_nearest(sources: Sequence[Source], rows: Rows, spacing: float, workers: Workers, report: _Share) -> np.ndarray:
    """Return the points nearest to the means of all boxes."""
    if workers.alone:

        def chunks() -> Iterator[np.ndarray]:
            for tile in tiles_of(sources):
                for points in read_ahead(read_chunks(tile)):
                    report(len(points))
                    yield points

        return nearest_points(len(rows.rows), [nearest_in(chunks(), rows.rows, spacing)])
    tiles = _tiles_for(sources, workers)

    def parts() -> Iterator[Nearest]:
        for number, part in workers.run(_nearest_of, tiles, (rows.rows, spacing)):
            report(tiles.taken[number].points)
            yield part

    return nearest_points(len(rows.rows), parts())


def _nearest_of(tile: Tile, shared: tuple[np.ndarray, float]) -> Nearest:
    """Return the points of a tile nearest to the means of boxes: the work of a worker."""
    return nearest_in(_chunks_there(tile), *shared)


def _chunks_there(tile: Tile) -> Iterator[np.ndarray]:
    """Yield the chunks of a tile; say which machine does not have it."""
    path = tile.source.path
    if not path.exists():
        raise FormatError(f"{path} is not there on {socket.gethostname()}; all workers need the files under one name")
    return read_chunks(tile, alone=False)


def _words(sources: Sequence[Source]) -> str:
    return str(sources[0].path) if len(sources) == 1 else f"none of the {len(sources)} files"


def spacing_to_fit(names: Sequence[str | Path], settings: Settings, memory: float | None = None) -> float:
    """Return the spacing to which a scan must be thinned while it is read, 0 where it need not be [scan unit].

    Parameters
    ----------
    names : sequence of str or Path
        Files or patterns.
    settings : Settings
        Tell the desired length, and a spacing that somebody has chosen.
    memory : float, optional
        Bytes that the scan may take; half of what is available by default.
    """
    if settings.thin_spacing is not None:
        return float(settings.thin_spacing)
    points = sum(find_source(path).points for path in find_files(names))
    if points <= FEWEST:
        return 0.0
    memory = SHARE * available_memory() if memory is None else memory
    return settings.length / FINENESS if points * BYTES > memory else 0.0


def read_thinned(
    names: Sequence[str | Path], settings: Settings, progress: Progress | None = None
) -> tuple[PointCloud, int]:
    """Return a scan thinned to `settings.thin_spacing` with its rim kept, and how many points were read.

    The mean of a box has less noise than its points, but lies up to half a box inside at the rim; so the outermost points there stay.
    """
    thinned = thin_scan(names, float(settings.thin_spacing or 0.0), rim=True, progress=progress)
    name = Path(names[0]).name if len(names) == 1 else ""
    cloud = PointCloud.from_array(thinned.points, unit=settings.unit, name=name)
    return replace(cloud, dropped=thinned.dropped), thinned.read


def read_to_fit(
    names: Sequence[str | Path], settings: Settings, *, memory: float | None = None, progress: Progress | None = None
) -> tuple[PointCloud, Settings]:
    """Return a scan as it is, or thinned where it is larger than memory, and the settings with which it comes out so again."""
    spacing = spacing_to_fit(names, settings, memory)
    if not spacing:
        return read_points(names[0], unit=settings.unit), settings
    settings = settings.replace(thin_spacing=spacing)
    return read_thinned(names, settings, progress)[0], settings
