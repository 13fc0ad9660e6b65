"""Scans that a studio opens: those that are named, and the bundled ones."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from ..errors import FormatError, InputError, ScanTrussError
from ..scan.cloud import PointCloud
from ..scan.formats.own_colors import COLOR_ATTRIBUTES, PACKED_COLOR, own_colors
from ..scan.formats.reading import read_content
from ..scan.stream.fit import read_to_fit, spacing_to_fit, spacing_to_look
from ..settings import Settings

FILES_WITH_MARKS = (".las", ".laz", ".ply", ".pcd", ".e57", ".pts", ".ptx", ".xyz", ".txt", ".csv", ".parquet")
DATA_FOLDER = Path(__file__).parents[1] / "data"
EXAMPLES = {
    "shell": ("shell.ply", Settings(length=1.0, unit="m")),
    "bust": ("nefertiti.ply", Settings(length=24.0, unit="mm")),
}  #: bundled scans and usual lengths


@contextmanager
def called(name: str, path: Path) -> Iterator[None]:
    """Let what is refused of a file say the name that a person gave it, in place of its path."""
    try:
        yield
    except (FormatError, InputError) as error:
        error.args = (str(error).replace(str(path), name),)
        raise


def read_whole(path: Path) -> PointCloud:
    """Read a scan; one that is larger than memory is thinned while it is read, as for a first look."""
    settings = Settings(length=1.0)
    if spacing_to_fit(path, settings):
        settings = settings.replace(thin_spacing=spacing_to_look(path, settings))
    cloud, _ = read_to_fit(path, settings)
    return cloud


def marks_of(path: Path, cloud: PointCloud) -> tuple[np.ndarray | None, np.ndarray | None]:
    """Return the classes (N,) and the colours (N, 3) uint8 of the points of a scan; None where its file has none.

    Neither is known of a scan of several files, or of one that is thinned while it is read.
    """
    if Path(path.stem if path.suffix.lower() == ".gz" else path.name).suffix.lower() not in FILES_WITH_MARKS:
        return None, None
    try:
        content = read_content(path, ("class", *COLOR_ATTRIBUTES, PACKED_COLOR))
    except ScanTrussError:  # several files, or one that is read otherwise
        return None, None
    kept = np.isfinite(content.points).all(axis=1)
    if int(kept.sum()) != len(cloud.points):
        return None, None
    attributes = {name: values[kept] for name, values in content.attributes.items()}
    classes = attributes.get("class")
    if classes is not None and (path.suffix.lower() not in (".las", ".laz") or len(np.unique(classes)) < 2):
        classes = None
    return classes, own_colors(attributes)


def next_free(place: Path, is_taken: Callable[[Path], bool] = lambda other: False) -> Path:
    """Return NAME-2.scantruss, NAME-3.scantruss, ...: the first that is not there and not taken."""
    number = 2
    while True:  # ends: every turn looks at another name, of which a folder holds finitely many
        other = place.with_name(f"{place.stem}-{number}{place.suffix}")
        if not other.exists() and not is_taken(other):
            return other
        number += 1
