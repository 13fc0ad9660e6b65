"""GeoTIFF rasters: heights on a raster in a reference system; the points are the centres of its cells."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...errors import FormatError
from ..units import metres_of
from .content import Content
from .extras import need_library
from .kinds import kind_of, read_head, reading_as, wrong_kind
from .packed import check_size
from .systems import System, from_wkt

if TYPE_CHECKING:
    from rasterio import DatasetReader

WITHOUT_DATA = "in cells without data"  # why cells are no points
CELLS_PER_CHUNK = 1 << 22  # cells that are read at a time
MOST_TIFF_CELLS = 1 << 33  # cells of a raster that is read at all


class TerrainHead(NamedTuple):
    """What a raster says of itself."""

    cells: int
    system: System
    z_metres: float | None  #: metres per unit of the heights
    notes: tuple[str, ...]


def read_geotiff(path: Path, wanted: Sequence[str] = ()) -> Content:
    """Return the points of a GeoTIFF raster; cells without data are left out and counted."""
    head = terrain_head(path)
    parts = list(terrain_chunks(path))
    missing = sum(content.left_out.get(WITHOUT_DATA, 0) for content in parts)
    points = np.concatenate([content.points for content in parts])
    return _content(head, points, missing, head.notes)


def terrain_head(path: Path) -> TerrainHead:
    """Return what a raster says of itself, once it is known to hold heights.

    Raises
    ------
    FormatError
        It is no GeoTIFF of heights, or rasterio is not installed.
    """
    head = read_head(path)
    if kind_of(head) != "a TIFF picture" and head[:4] not in (b"II+\0", b"MM\0+"):  # the latter: larger than 4 GB
        raise wrong_kind(path, head, "a GeoTIFF")
    with _opened(path) as raster:
        kind = np.dtype(raster.dtypes[0])
        if raster.count > 1 and kind.itemsize == 1:
            raise FormatError(
                f"{path} is a picture of {raster.count} colours, not heights; name the raster of the terrain"
            )
        if kind.kind not in "iuf":
            raise FormatError(f"{path} has heights of type {kind}; numbers are needed, so export it again")
        if raster.transform.is_identity:
            raise FormatError(f"{path} has no georeference, so its cells have no size; export it as GeoTIFF again")
        if not 0 < raster.width * raster.height <= MOST_TIFF_CELLS:
            raise FormatError(f"{path} has {raster.width:,} x {raster.height:,} cells; cut it first")
        check_size(path, raster.width * raster.height * kind.itemsize)
        notes = (f"{path.name} has {raster.count} bands; the first is taken",) if raster.count > 1 else ()
        system = System() if raster.crs is None else from_wkt(raster.crs.to_wkt())
        z_metres = metres_of(str(raster.units[0] or "").removeprefix("US survey ")) or system.z_metres
        return TerrainHead(raster.width * raster.height, system, z_metres, notes)


def terrain_chunks(path: Path) -> Iterator[Content]:
    """Yield the points of a raster some rows at a time, from the first row, with units and reference system."""
    from rasterio.windows import Window

    head = terrain_head(path)
    with _opened(path) as raster:
        rows = max(CELLS_PER_CHUNK // raster.width, 1)
        a, b, c, d, e, f = tuple(raster.transform)[:6]
        for begin in range(0, raster.height, rows):
            window = Window(0, begin, raster.width, min(rows, raster.height - begin))
            heights = raster.read(1, window=window, masked=True)
            values = np.asarray(heights.data, np.float64) * raster.scales[0] + raster.offsets[0]
            known = np.isfinite(values) & ~np.ma.getmaskarray(heights)
            row, column = np.nonzero(known)
            x, y = column + 0.5, row + begin + 0.5
            points = np.stack([a * x + b * y + c, d * x + e * y + f, values[known]], axis=1)
            yield _content(head, points, int(known.size - known.sum()), head.notes if begin == 0 else ())


def _content(head: TerrainHead, points: np.ndarray, missing: int, notes: tuple[str, ...]) -> Content:
    system = head.system
    return Content(
        points,
        metres=system.metres,
        z_metres=head.z_metres,
        system=system.name,
        degrees=system.degrees,
        notes=notes,
        left_out={WITHOUT_DATA: missing} if missing else {},
    )


@contextmanager
def _opened(path: Path) -> Iterator[DatasetReader]:
    """Open a raster; what GDAL cannot read of it is said in one line."""
    need_library("GeoTIFF", "rasterio", "terrain")
    import rasterio
    from rasterio.errors import NotGeoreferencedWarning, RasterioError

    with reading_as(path, "a GeoTIFF"):
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", NotGeoreferencedWarning)  # it is refused below
                raster = rasterio.open(path, driver="GTiff")
            with raster:
                yield raster
        except RasterioError as error:  # also an OSError, which would pass
            cause = error.__cause__ or error
            raise ValueError(str(cause).replace(str(path), path.name)) from None
