"""What to do about a floor that a shell stands on: the crop that leaves it out, tried before it is named."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..errors import ScanTrussError, unit_words, words_of_number

if TYPE_CHECKING:
    from ..report.terminal import Bars
    from ..scan.cloud import PointCloud
    from ..settings import Settings

OVER_FLOOR = 0.2  # height over the floor from which on the scan is kept [member lengths]
RUNS_OF_CROP = 4  # grids that are made to try it


def words_of_floor(bars: Bars, cloud: PointCloud, settings: Settings) -> str:
    """Name the crop without the level floor of a scan with which a grid passes, tried by quick runs; nothing if none does."""
    from ..attempts.limit import AttemptLimit
    from ..pipeline import first_that_passes
    from ..scan.cloud import PointCloud
    from ..surface.samples import sample_surface
    from ..surface.supports import floor_below
    from .shared import box_around

    length = settings.length
    if settings.length_field or settings.boundary:
        return ""
    try:
        mean = sample_surface(cloud, settings).surface.mean
        floor = floor_below(mean, length)
        if floor is None:
            return ""
        low, high = np.array(cloud.bounds)
        low[2] = floor + 1.5 * OVER_FLOOR * length
        low, high = low + cloud.origin, high + cloud.origin
        box = box_around(low, high, 0.5 * OVER_FLOOR * length)
        corners = np.array(box.split(","), float).reshape(2, 3)
        places = cloud.points + cloud.origin
        inside = ((places >= corners[0]) & (places <= corners[1])).all(axis=1)
        tried = settings.replace(effort="quick")
        part, limit = PointCloud.from_array(places[inside], unit=cloud.unit), AttemptLimit()
        limit.allow(RUNS_OF_CROP)
        first_that_passes(part, tried, limit=limit, progress=bars)
    except ScanTrussError:
        return ""
    at = f"{words_of_number(floor + float(cloud.origin[2]), 3)}{unit_words(cloud.unit)}"
    return f"; the scan has a level floor at a height of {at}: without it, --crop box:{box}, a grid passes (tried with --effort quick)"
