"""Points of a LAS or LAZ file (COPC is LAZ) by laspy: scale and offset applied in float64, a million points at a time."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import FormatError
from .content import Content
from .heights import SAMPLE, look_like_feet
from .kinds import read_head, unreadable, wrong_kind
from .las_header import check_header
from .systems import System, system_of

CHUNK = 1_000_000  # points
FIELDS = {"class": "classification", "return_number": "return_number", "return_count": "number_of_returns"}


def read_las(path: Path, wanted: Sequence[str] = ()) -> Content:
    """Return the points of a LAS or LAZ file and the wanted attributes."""
    head = read_head(path)
    if not head.startswith(b"LASF"):
        raise wrong_kind(path, head, "a LAS or LAZ file")
    names = [name for name in dict.fromkeys([*wanted, "return_count"]) if name in FIELDS]
    points, columns = np.empty((0, 3)), [np.empty(0)] * len(names)
    try:
        check_header(path)
        promised, system, chunks = _read(path, names)
        if chunks:
            points = np.concatenate([chunk[0] for chunk in chunks])
            columns = [np.concatenate([chunk[1 + i] for chunk in chunks]) for i in range(len(names))]
    except FormatError:
        raise
    except BaseException as error:
        raise unreadable(path, "LAS or LAZ", error) from None
    if len(points) < promised:
        raise FormatError(
            f"{path} ends early: its header promises {promised:,} points, got {len(points):,}; copy it again"
        )
    attributes = dict(zip(names, columns, strict=True))
    feet = look_like_feet(points, attributes["return_count"]) if system.z_metres is None else ""
    return Content(points, attributes, system.metres, system.z_metres, system.name, system.degrees, feet=feet)


def note_on_heights(path: Path) -> str:
    """Return a note where the heights of a LAS or LAZ file look like feet, by its first points; "" where it says their unit."""
    import laspy

    try:
        with laspy.open(path) as file:
            record: Any = file.read_points(min(SAMPLE, int(file.header.point_count)))
            points = np.column_stack([record[name] for name in "xyz"]).astype(float, copy=False)
            return look_like_feet(points, np.array(record[FIELDS["return_count"]]))
    except BaseException as error:
        raise unreadable(path, "LAS or LAZ", error) from None


def _read(path: Path, names: Sequence[str]) -> tuple[int, System, list[list[np.ndarray]]]:
    """Return how many points the header promises, the reference system, and the points in chunks with their attributes."""
    import laspy

    chunks: list[list[np.ndarray]] = []
    with laspy.open(path) as file:
        header: Any = file.header
        system = system_of([*header.vlrs, *(header.evlrs or [])])
        for record in file.chunk_iterator(CHUNK):
            points = np.empty((len(record), 3))
            for axis, name in enumerate("XYZ"):
                np.multiply(record[name], header.scales[axis], out=points[:, axis])
                points[:, axis] += header.offsets[axis]
            chunks.append([points, *(np.array(record[FIELDS[name]]) for name in names)])
    return header.point_count, system, chunks
