"""Scans that a studio opens: those that are named, and the bundled ones."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from ..scan.cloud import PointCloud
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


def next_free(place: Path, is_taken: Callable[[Path], bool] = lambda other: False) -> Path:
    """Return NAME-2.scantruss, NAME-3.scantruss, ...: the first that is not there and not taken."""
    number = 2
    while True:  # ends: every turn looks at another name, of which a folder holds finitely many
        other = place.with_name(f"{place.stem}-{number}{place.suffix}")
        if not other.exists() and not is_taken(other):
            return other
        number += 1
