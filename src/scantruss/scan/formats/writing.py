"""From points to a cloud file."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...errors import FormatError, InputError
from ...runtime.files import SaveTogether
from ...runtime.ours import FORCE_ARGUMENT, check_ours
from ...runtime.places import check_place
from ..units import check_unit
from .content import Cloud
from .table import WRITERS, Writer

CUT_SHORT = "only a part of it could be written; the disk may be full"


def write_points(
    path: str | Path,
    points: np.ndarray,
    *,
    normals: np.ndarray | None = None,
    unit: str = "",
    origin: np.ndarray | None = None,
    force: bool = False,
) -> None:
    """Write a cloud to exactly this path, whole or not at all; the format is that of the suffix.

    Parameters
    ----------
    path : one of the suffixes in `WRITERS`; `check_cloud_output` says beforehand whether it can be
    points : (N, 3) array [unit]
        In the scan's own frame. Doubles are written exactly, in LAS and LAZ to less than a thousandth of the spacing.
    normals : (N, 3) array, optional
        Kept by all formats.
    unit : written if the format can hold it; text files hold it in their column names (CSV) or in a comment
    origin : (3,) array, optional
        A place near the points, from which LAS counts.
    force : bool
        Whether to write over a file that is not known as a cloud by ScanTruss. CSV and NPY files have no place for a mark, so even
        those that ScanTruss wrote are replaced by force only.

    Raises
    ------
    FormatError
        No writer for the suffix, or the file cannot be written; or one is there that is not known as ours.
    InputError
        Arrays of wrong shape, no points, or not finite.
    """
    path = Path(path)
    writer = _writer(path)
    cloud = Cloud(_checked(points, "points"), None if normals is None else _checked(normals, "normals"), unit, origin)
    if cloud.normals is not None and len(cloud.normals) != len(cloud.points):
        raise InputError(f"{len(cloud.points):,} points need as many normals, got {len(cloud.normals):,}")
    check_unit(unit)
    if not force:
        check_ours(path, "cloud", FORCE_ARGUMENT)
    try:
        with SaveTogether() as save:
            writer(save.beside(path), cloud)
    except OSError as error:
        raise FormatError(f"cannot write {path}: {error.strerror or CUT_SHORT}") from None


def check_cloud_output(path: str | Path) -> Path:
    """Return the path of a cloud to be written; FormatError where its suffix or its folder is not accepted."""
    path = Path(path)
    _writer(path)
    return check_place(path, WRITERS)


def _writer(path: Path) -> Writer:
    try:
        return WRITERS[path.suffix.lower()]
    except KeyError:
        known = " ".join(sorted(WRITERS))
        raise FormatError(f'no format for a cloud "{path.suffix}" ({path.name}); use one of {known}') from None


def _checked(values: np.ndarray, what: str) -> np.ndarray:
    array = np.asarray(values, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != 3 or not len(array):
        raise InputError(f"{what} must have shape (N, 3), got {array.shape}")
    if not np.isfinite(array).all():
        raise InputError(f"{what} must be finite numbers")
    return array
