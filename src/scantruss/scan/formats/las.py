"""Points of a LAS or LAZ file (COPC is LAZ) by laspy: scale and offset applied in float64, a million points at a time."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import FormatError, InputError
from ...settings import UNITS
from ..cloud import measure_spacing
from .content import Cloud, Content
from .copc import WantedBox, find_boxes, read_boxes, touching
from .heights import MOST_HEIGHTS, look_like_feet
from .kinds import read_head, reading_as, wrong_kind
from .las_header import check_header
from .systems import system_of

POINTS_PER_CHUNK = 1_000_000  # points
FIELD_OF_ATTRIBUTE = {
    "class": "classification", "return_number": "return_number", "return_count": "number_of_returns",
    "red": "red", "green": "green", "blue": "blue",
}  # fmt: skip
LOST_OF_SPACING = 1e-3  # rounding of a coordinate, as a share of the spacing
LARGEST_INT32 = float(2**31 - 2)  # a coordinate is a whole number of 32 bits
UNIT_CODES = {"m": 9001, "foot": 9002}  # EPSG
WITHHELD_POINTS = "marked as withheld"  # the format's term for deleted

Places = Callable[[Content], list[WantedBox]]  # by the units that a file states


def read_las(path: Path, wanted: Sequence[str] = (), places_of: Places | None = None) -> Content:
    """Return the points of a LAS or LAZ file and the wanted attributes; of a COPC file those near some places, where they are given."""
    head = read_head(path)
    if not head.startswith(b"LASF"):
        raise wrong_kind(path, head, "a LAS or LAZ file")
    names = fields_of((*wanted, "return_count"))
    with reading_as(path, "LAS or LAZ"):
        notes = check_header(path)
        promised, described, chunks = _read(path, names, places_of)
    withheld = sum(chunk.left_out.get(WITHHELD_POINTS, 0) for chunk in chunks)
    unread = sum(described.unread.values())
    points = np.concatenate([np.empty((0, 3)), *(chunk.points for chunk in chunks)])
    check_count(path, promised, len(points) + withheld + unread)
    none = np.empty(0, dtype=np.uint8)
    held = [name for name in names if all(name in chunk.attributes for chunk in chunks)]
    attributes = {name: np.concatenate([none, *(chunk.attributes[name] for chunk in chunks)]) for name in held}
    feet = look_like_feet(points, attributes["return_count"]) if described.z_metres is None else ""
    left_out = {WITHHELD_POINTS: withheld} if withheld else {}
    return replace(described, points=points, attributes=attributes, left_out=left_out, feet=feet, notes=notes)


def fields_of(wanted: Sequence[str]) -> list[str]:
    """Return the wanted attributes that the format may have, each once."""
    return [name for name in dict.fromkeys(wanted) if name in FIELD_OF_ATTRIBUTE]


def content_of_records(record: Any, names: Sequence[str]) -> Content:
    """Return the points of some records of laspy with attributes, but for those that are marked as withheld."""
    points = np.empty((len(record), 3))
    for axis, name in enumerate("XYZ"):
        np.multiply(record[name], record.scales[axis], out=points[:, axis])
        points[:, axis] += record.offsets[axis]
    held = set(record.point_format.dimension_names)
    attributes = {
        name: np.array(record[FIELD_OF_ATTRIBUTE[name]]) for name in names if FIELD_OF_ATTRIBUTE[name] in held
    }
    kept = np.array(record["withheld"]) == 0
    if kept.all():
        return Content(points, attributes)
    left_out = {WITHHELD_POINTS: len(kept) - int(kept.sum())}
    return Content(points[kept], {name: values[kept] for name, values in attributes.items()}, left_out=left_out)


def check_count(path: Path, promised: int, got: int) -> None:
    """Refuse a file with fewer points than its header promises."""
    if got < promised:
        raise FormatError(f"{path} ends early: its header promises {promised:,} points, got {got:,}; copy it again")


def note_on_heights(path: Path) -> str:
    """Return a note if the heights of a LAS or LAZ file look like feet, by its first points; "" if it states their unit."""
    import laspy

    with reading_as(path, "LAS or LAZ"), laspy.open(path) as file:
        content = content_of_records(
            file.read_points(min(MOST_HEIGHTS, int(file.header.point_count))), ["return_count"]
        )
        return look_like_feet(content.points, content.attributes["return_count"])


def fields_for(names: Sequence[str]) -> Any:
    """Return what must be unpacked for points and some attributes, in laspy's terms."""
    from laspy import DecompressionSelection as Fields

    fields = Fields.base() | Fields.Z | Fields.FLAGS
    for name, more in (("class", Fields.CLASSIFICATION), ("red", Fields.RGB)):
        fields |= more if name in names else fields
    return fields


def records_near(
    path: Path, header: Any, places: Sequence[WantedBox], names: Sequence[str], most: int = POINTS_PER_CHUNK
) -> tuple[Iterator[Any], dict[str, int]] | None:
    """Return the records of a COPC file near all places, and how many others there are by the words of these; None of other files."""
    boxes = find_boxes(path, header) if places else None
    if boxes is None:
        return None
    rows, unread = touching(boxes, places)
    return read_boxes(path, header, boxes, rows, most, fields_for(names).to_lazrs()), unread


def _read(path: Path, names: Sequence[str], places_of: Places | None) -> tuple[int, Content, list[Content]]:
    """Return how many points the header promises, what it says of them, and the points in chunks with their attributes."""
    import laspy

    with laspy.open(path) as file:
        header: Any = file.header
        system = system_of([*header.vlrs, *(header.evlrs or [])])
        head = Content(np.empty((0, 3)), {}, system.metres, system.z_metres, system.name, system.degrees)
        near = records_near(path, header, places_of(head), names) if places_of else None
        records, unread = near or (file.chunk_iterator(POINTS_PER_CHUNK), {})
        chunks = [content_of_records(record, names) for record in records]
    return header.point_count, replace(head, unread=unread), chunks


def write_las(path: Path, cloud: Cloud) -> None:
    """Write a LAS file, or a LAZ file by its suffix, with the unit in GeoTIFF keys.

    Raises
    ------
    InputError
        The points lie so densely in so wide a box that whole numbers of 32 bits cannot distinguish them.
    """
    import laspy
    import lazrs

    points, normals = cloud.points, cloud.normals
    header = laspy.LasHeader(point_format=0, version="1.2")
    header.creation_date = date(2000, 1, 1)  # the same points, the same bytes
    header.generating_software = "ScanTruss"
    scale = las_scale(points)
    lower, upper = points.min(axis=0), points.max(axis=0)
    middle = 0.5 * (lower + upper) if cloud.origin is None else np.asarray(cloud.origin, dtype=np.float64)
    if max(np.abs(upper - middle).max(), np.abs(lower - middle).max()) / scale > LARGEST_INT32:
        middle = 0.5 * (lower + upper)
    header.scales, header.offsets = np.full(3, scale), np.round(middle / scale) * scale
    if normals is not None:
        header.add_extra_dims([laspy.ExtraBytesParams(f"Normal{axis}", "f4") for axis in "XYZ"])
    if cloud.unit:
        header.vlrs.extend(_unit_records(cloud.unit))
    try:
        _write_points(path, header, points, normals)
    except lazrs.LazrsError as error:  # raised when the disk is full
        raise OSError(str(error)) from None


def _write_points(path: Path, header: Any, points: np.ndarray, normals: np.ndarray | None) -> None:
    import laspy

    with (
        path.open("wb") as file,
        laspy.open(file, "w", header=header, do_compress=path.suffix.lower() == ".laz", closefd=False) as out,
    ):
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
    finest = extent / (1.9 * LARGEST_INT32)
    wanted = LOST_OF_SPACING * measure_spacing(points) or 1e-6 * extent or 1e-3
    scale = float(f"1e{math.floor(math.log10(wanted))}")
    if scale >= finest:
        return scale
    if wanted < finest:
        raise InputError(
            f"LAS cannot hold points {wanted / LOST_OF_SPACING:.3g} apart in a box of {extent:.3g}; write PLY, or crop or thin the scan"
        )
    return wanted


def _unit_records(unit: str) -> list[Any]:
    """Return the GeoTIFF keys of a plane system that is not named, in a unit."""
    import laspy

    own = 32767  # "user defined"
    metres = UNITS[unit]
    if code := UNIT_CODES.get(unit):
        keys = [(1024, 0, 1, 1), (3072, 0, 1, own), (3076, 0, 1, code), (4099, 0, 1, code)]
    else:
        keys = [(1024, 0, 1, 1), (3072, 0, 1, own), (3076, 0, 1, own), (3077, 34736, 1, 0), (4099, 0, 1, own)]
    words = [1, 1, 0, len(keys), *(word for key in keys for word in key)]
    body = struct.pack(f"<{len(words)}H", *words)
    records = [laspy.VLR("LASF_Projection", 34735, "GeoKeyDirectoryTag", body)]
    if unit not in UNIT_CODES:
        records.append(laspy.VLR("LASF_Projection", 34736, "GeoDoubleParamsTag", struct.pack("<d", metres)))
    return records
