"""Scans that a studio opens: those that are named, and the bundled ones."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from ..errors import ScanTrussError
from ..scan.cloud import PointCloud
from ..scan.formats.reading import read_content
from ..scan.stream.fit import read_to_fit, spacing_to_fit, spacing_to_look
from ..settings import Settings

DATA_FOLDER = Path(__file__).parents[1] / "data"
EXAMPLES = {
    "shell": ("shell.ply", Settings(length=1.0, unit="m")),
    "bust": ("nefertiti.ply", Settings(length=24.0, unit="mm")),
}  #: bundled scans and usual lengths


def read_whole(path: Path) -> PointCloud:
    """Read a scan; one that is larger than memory is thinned while it is read, as for a first look."""
    settings = Settings(length=1.0)
    if spacing_to_fit(path, settings):
        settings = settings.replace(thin_spacing=spacing_to_look(path, settings))
    cloud, _ = read_to_fit(path, settings)
    return cloud


def classes_of(path: Path, cloud: PointCloud) -> np.ndarray | None:
    """Return the classes of the points of a scan (N,), None where its file has none or some of its points were left out."""
    if path.suffix.lower() not in (".las", ".laz"):
        return None
    try:
        found = read_content(path, ("class",)).attributes.get("class")
    except ScanTrussError:  # several files, or one that is read otherwise
        return None
    return found if found is not None and len(found) == len(cloud.points) and len(np.unique(found)) > 1 else None


def next_free(place: Path, is_taken: Callable[[Path], bool] = lambda other: False) -> Path:
    """Return NAME-2.scantruss, NAME-3.scantruss, ...: the first that is not there and not taken."""
    number = 2
    while True:  # ends: every turn looks at another name, of which a folder holds finitely many
        other = place.with_name(f"{place.stem}-{number}{place.suffix}")
        if not other.exists() and not is_taken(other):
            return other
        number += 1
