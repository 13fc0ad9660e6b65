"""A cloud as LAS or LAZ, with its unit in GeoTIFF keys."""

from __future__ import annotations

import math
import struct
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import InputError
from ...settings import UNITS
from ..cloud import measure_spacing

LOST_OF_SPACING = 1e-3  # of the spacing: what a coordinate may lose
LARGEST_INTEGER = float(2**31 - 2)  # a coordinate is a whole number of 32 bits
POINTS_PER_CHUNK = 1_000_000  # points
CODES = {"m": 9001, "foot": 9002}  # EPSG


def write_las(path: Path, points: np.ndarray, normals: np.ndarray | None, unit: str, origin: np.ndarray | None) -> None:
    """Write a LAS file, or a LAZ file by its suffix.

    Raises
    ------
    InputError
        The points lie so densely in so wide a box that whole numbers of 32 bits cannot tell them apart.
    """
    import laspy
    import lazrs

    header = laspy.LasHeader(point_format=0, version="1.2")
    header.creation_date = date(2000, 1, 1)  # the same points, the same bytes
    header.generating_software = "ScanTruss"
    scale = las_scale(points)
    lower, upper = points.min(axis=0), points.max(axis=0)
    middle = 0.5 * (lower + upper) if origin is None else np.asarray(origin, dtype=np.float64)
    if max(np.abs(upper - middle).max(), np.abs(lower - middle).max()) / scale > LARGEST_INTEGER:
        middle = 0.5 * (lower + upper)
    header.scales, header.offsets = np.full(3, scale), np.round(middle / scale) * scale
    if normals is not None:
        header.add_extra_dims([laspy.ExtraBytesParams(f"Normal{axis}", "f4") for axis in "XYZ"])
    if unit:
        header.vlrs.extend(_unit_records(unit))
    try:
        _write_points(path, header, points, normals)
    except lazrs.LazrsError as error:  # what it makes of a disk that is full
        raise OSError(str(error)) from None


def _write_points(path: Path, header: Any, points: np.ndarray, normals: np.ndarray | None) -> None:
    import laspy

    with path.open("wb") as file, laspy.open(file, "w", header=header, do_compress=_is_laz(path), closefd=False) as out:
        for begin in range(0, len(points), POINTS_PER_CHUNK):
            part = slice(begin, begin + POINTS_PER_CHUNK)
            record = laspy.ScaleAwarePointRecord.zeros(len(points[part]), header=header)
            record.x, record.y, record.z = points[part].T
            for axis, name in enumerate("XYZ" if normals is not None else ""):
                record[f"Normal{name}"] = normals[part, axis]  # type: ignore[index]
            out.write_points(record)


def las_scale(points: np.ndarray) -> float:
    """Return the step of the coordinates: a power of ten below a thousandth of the spacing."""
    extent = float(np.ptp(points, axis=0).max())
    finest = extent / (1.9 * LARGEST_INTEGER)
    wanted = LOST_OF_SPACING * measure_spacing(points) or 1e-6 * extent or 1e-3
    scale = float(f"1e{math.floor(math.log10(wanted))}")
    if scale >= finest:
        return scale
    if wanted < finest:
        raise InputError(
            f"LAS cannot hold points {wanted / LOST_OF_SPACING:.3g} apart in a box of {extent:.3g}; write PLY, or crop or thin the scan"
        )
    return wanted


def _is_laz(path: Path) -> bool:
    return path.suffix.lower() == ".laz"


def _unit_records(unit: str) -> list[Any]:
    """Return the GeoTIFF keys of a plane system that is not named, in a unit."""
    import laspy

    own = 32767  # "user defined"
    metres = UNITS[unit]
    if code := CODES.get(unit):
        keys = [(1024, 0, 1, 1), (3072, 0, 1, own), (3076, 0, 1, code), (4099, 0, 1, code)]
    else:
        keys = [(1024, 0, 1, 1), (3072, 0, 1, own), (3076, 0, 1, own), (3077, 34736, 1, 0), (4099, 0, 1, own)]
    words = [1, 1, 0, len(keys), *(word for key in keys for word in key)]
    body = struct.pack(f"<{len(words)}H", *words)
    records = [laspy.VLR("LASF_Projection", 34735, "GeoKeyDirectoryTag", body)]
    if unit not in CODES:
        records.append(laspy.VLR("LASF_Projection", 34736, "GeoDoubleParamsTag", struct.pack("<d", metres)))
    return records
