"""Points of a LAS or LAZ file (COPC is LAZ) by laspy: scale and offset applied in float64, a million points at a time."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import FormatError, ScanTrussError
from .content import Content
from .copc import Place, find_boxes, read_boxes, touching
from .heights import POINTS_LOOKED_AT, look_like_feet
from .kinds import read_head, unreadable, wrong_kind
from .las_header import check_header
from .systems import system_of

POINTS_PER_CHUNK = 1_000_000  # points
FIELDS = {"class": "classification", "return_number": "return_number", "return_count": "number_of_returns"}
WITHHELD = "marked as withheld"  # the format's word for deleted

Places = Callable[[Content], list[Place]]  # by what a file says of its units


def read_las(path: Path, wanted: Sequence[str] = (), places_of: Places | None = None) -> Content:
    """Return the points of a LAS or LAZ file and the wanted attributes; of a COPC file those near some places, where they are told."""
    head = read_head(path)
    if not head.startswith(b"LASF"):
        raise wrong_kind(path, head, "a LAS or LAZ file")
    names = fields_of((*wanted, "return_count"))
    try:
        notes = check_header(path)
        promised, said, chunks = _read(path, names, places_of)
    except ScanTrussError:
        raise
    except BaseException as error:
        raise unreadable(path, "LAS or LAZ", error) from None
    withheld = sum(chunk.left_out.get(WITHHELD, 0) for chunk in chunks)
    unread = sum(said.unread.values())
    points = np.concatenate([np.empty((0, 3)), *(chunk.points for chunk in chunks)])
    check_count(path, promised, len(points) + withheld + unread)
    none = np.empty(0, dtype=np.uint8)
    attributes = {name: np.concatenate([none, *(chunk.attributes[name] for chunk in chunks)]) for name in names}
    feet = look_like_feet(points, attributes["return_count"]) if said.z_metres is None else ""
    left_out = {WITHHELD: withheld} if withheld else {}
    return replace(said, points=points, attributes=attributes, left_out=left_out, feet=feet, notes=notes)


def fields_of(wanted: Sequence[str]) -> list[str]:
    """Return the wanted attributes that the format has, each once."""
    return [name for name in dict.fromkeys(wanted) if name in FIELDS]


def take(record: Any, names: Sequence[str]) -> Content:
    """Return the points of some records of laspy with attributes, but for those that are marked as withheld."""
    points = np.empty((len(record), 3))
    for axis, name in enumerate("XYZ"):
        np.multiply(record[name], record.scales[axis], out=points[:, axis])
        points[:, axis] += record.offsets[axis]
    attributes = {name: np.array(record[FIELDS[name]]) for name in names}
    kept = np.array(record["withheld"]) == 0
    if kept.all():
        return Content(points, attributes)
    left_out = {WITHHELD: len(kept) - int(kept.sum())}
    return Content(points[kept], {name: values[kept] for name, values in attributes.items()}, left_out=left_out)


def check_count(path: Path, promised: int, got: int) -> None:
    """Refuse a file with fewer points than its header promises."""
    if got < promised:
        raise FormatError(f"{path} ends early: its header promises {promised:,} points, got {got:,}; copy it again")


def note_on_heights(path: Path) -> str:
    """Return a note where the heights of a LAS or LAZ file look like feet, by its first points; "" where it says their unit."""
    import laspy

    try:
        with laspy.open(path) as file:
            content = take(file.read_points(min(POINTS_LOOKED_AT, int(file.header.point_count))), ["return_count"])
            return look_like_feet(content.points, content.attributes["return_count"])
    except BaseException as error:
        raise unreadable(path, "LAS or LAZ", error) from None


def fields_for(names: Sequence[str]) -> Any:
    """Return what must be unpacked for points and some attributes, as laspy says it."""
    from laspy import DecompressionSelection as Fields

    fields = Fields.base() | Fields.Z | Fields.FLAGS
    return fields | Fields.CLASSIFICATION if "class" in names else fields


def records_near(
    path: Path, header: Any, places: Sequence[Place], names: Sequence[str], most: int = POINTS_PER_CHUNK
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
        said = Content(np.empty((0, 3)), {}, system.metres, system.z_metres, system.name, system.degrees)
        near = records_near(path, header, places_of(said), names) if places_of else None
        records, unread = near or (file.chunk_iterator(POINTS_PER_CHUNK), {})
        chunks = [take(record, names) for record in records]
    return header.point_count, replace(said, unread=unread), chunks
