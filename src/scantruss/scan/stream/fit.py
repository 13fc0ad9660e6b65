"""Scans that are larger than memory: thinned while they are read, as finely as a grid of the desired length needs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...runtime.memory import available_memory
from ...runtime.progress import Progress
from ..checks import POINTS_OF_BULK, degrees_note, single_precision_note, usual_extent
from ..cloud import LARGEST_COORDINATE, PointCloud
from ..formats.kinds import read_head
from ..formats.paths import FileNames, files_of, name_of_files
from ..formats.reading import read_points
from ..formats.table import PACKED
from .chunks import Reading, count_unread, read_chunks
from .opened import open_scan
from .source import Source
from .thin_scan import ShareDone, check_enough, thin_scan
from .tiles import find_source, tiles_of

if TYPE_CHECKING:
    from ...settings import Settings

BOXES_PER_MEMBER = 20.0  # boxes along a member if a scan is thinned to fit into memory
BYTES_PER_POINT = 100.0  # memory per point on the way to a grid; 55 to 90 were measured [bytes]
PACKED_POINT = 8  # bytes of a point in a packed text, about
NEVER_TOO_MANY_POINTS = 100_000  # points that are never too many
BOXES_OF_FIRST_LOOK = 1000.0  # boxes along the diagonal of a scan for a first look
MEMORY_SHARE = 0.5  # share of the available memory that a scan may take


def spacing_to_fit(names: FileNames, settings: Settings, memory: float | None = None) -> float:
    """Return the spacing to which a scan must be thinned while it is read, 0 where it need not be [scan unit].

    All points that are read count, as all of them are in memory when some are selected.

    Parameters
    ----------
    names : files or patterns
    settings : the desired length, and the spacing if one was chosen
    memory : bytes that the scan may take; half of what is available by default; optional
    """
    if settings.thin_spacing is not None:
        return float(settings.thin_spacing)
    points = sum(map(_guess, files_of(names)))
    if points <= NEVER_TOO_MANY_POINTS:
        return 0.0
    memory = MEMORY_SHARE * available_memory() if memory is None else memory
    if points * BYTES_PER_POINT > memory and settings.selection.crop:
        sources, reading, *_ = open_scan(names, settings.unit, settings.selection)
        points -= sum(count_unread(source, reading) for source in sources)
    return settings.length / BOXES_PER_MEMBER if points * BYTES_PER_POINT > memory else 0.0


def spacing_to_look(names: FileNames, settings: Settings, progress: Progress | None = None) -> float:
    """Return a spacing for a first look at a scan for which no length is chosen yet, by its extent [scan unit].

    Points far from most others do not count.
    """
    sources, reading, *_ = open_scan(names, settings.unit, settings.selection)
    some = _sample(sources, reading, ShareDone(progress, "look", sources))
    if not len(some):
        return 1.0  # thinning will report the reason
    return float(np.linalg.norm(np.ptp(usual_extent(some), axis=0))) / BOXES_OF_FIRST_LOOK or 1.0


def _sample(sources: Sequence[Source], reading: Reading, report: ShareDone) -> np.ndarray:
    """Return points from all parts of a scan, (K, 3): all of a small one, up to twice `POINTS_OF_BULK` of a large one.

    They are random, with a fixed seed, because every n-th point may be of one column of the scanner.
    """
    some, share, rng = np.empty((0, 3)), 1.0, np.random.default_rng(0)
    for tile in tiles_of(sources):
        for chunk in read_chunks(tile, reading):
            report(chunk.read)
            new = chunk.points if share == 1.0 else chunk.points[rng.random(len(chunk.points)) < share]
            some = np.concatenate([some, new[(np.abs(new) <= LARGEST_COORDINATE).all(axis=1)]])
            while len(some) > 2 * POINTS_OF_BULK:
                some, share = some[rng.random(len(some)) < 0.5], 0.5 * share
    return some


def _guess(path: Path) -> int:
    """Return about how many points a file holds; it is not unpacked for that."""
    if path.suffix.lower() != PACKED:
        return find_source(path).points
    read_head(path)
    return path.stat().st_size // PACKED_POINT


def read_thinned(names: FileNames, settings: Settings, progress: Progress | None = None) -> tuple[PointCloud, int]:
    """Return a scan thinned to `settings.thin_spacing` with its boundary kept, and how many points were read.

    The mean of a box has less noise than its points but lies up to half a box inside the boundary, so the outermost points there are kept.
    """
    thinned = thin_scan(
        names,
        float(settings.thin_spacing or 0.0),
        boundary=True,
        unit=settings.unit,
        selection=settings.selection,
        progress=progress,
    )
    check_enough(thinned, float(settings.thin_spacing or 0.0), "--thin-spacing")
    cloud = PointCloud.from_array(thinned.points, unit=thinned.unit, name=name_of_files(names))
    notes = (*thinned.notes, *cloud.notes, *degrees_note(cloud), *single_precision_note(cloud))
    return replace(cloud, dropped=thinned.dropped, notes=notes, system=thinned.system), thinned.read


def read_to_fit(
    names: FileNames, settings: Settings, *, memory: float | None = None, progress: Progress | None = None
) -> tuple[PointCloud, Settings]:
    """Return a scan, thinned if it is larger than memory, and settings that reproduce it."""
    spacing = spacing_to_fit(names, settings, memory)
    if not spacing:
        return read_points(names, unit=settings.unit, selection=settings.selection), settings
    settings = settings.replace(thin_spacing=spacing)
    return read_thinned(names, settings, progress)[0], settings
