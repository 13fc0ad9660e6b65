"""The part of a COPC file that touches a part of space: COPC is LAZ whose chunks are the boxes of an octree, listed in a table.

laspy's own COPC reader is not used: on a damaged table it never ends or silently leaves points out, and it loads all points
before it crops.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from struct import unpack_from
from typing import Any, BinaryIO, NamedTuple

import numpy as np

from ...errors import FormatError
from .las_header import HEADER_14, LASZIP_RECORD, RECORD_HEAD_BYTES

RECORD_NAME = b"copc".ljust(16, b"\0") + b"\1\0"  # user and number of the record that describes the octree
RECORD_BYTES = 160  # its bytes; it is the first of the file
TABLE_ENTRY = np.dtype([("key", "<i4", 4), ("place", "<u8"), ("size", "<i4"), ("count", "<i4")])  # of the table
TABLE_ELSEWHERE = -1  # count of an entry that says where more of the table is
DEEPEST_OCTREE_LEVEL = 30  # level of an octree
OCTREE_TOLERANCE = 1e-9  # of the octree's side; coordinates are rounded


class WantedBox(NamedTuple):
    """The box around a part of space from which points are wanted, in the unit of a file."""

    words: str  #: for points outside it
    lower: np.ndarray  #: (3,)
    upper: np.ndarray  #: (3,)


class Boxes(NamedTuple):
    """The chunks of a COPC file in its order, and where their points are."""

    begin: np.ndarray  #: (K,) bytes
    size: np.ndarray  #: (K,) bytes
    points: np.ndarray  #: (K,) how many
    level: np.ndarray  #: (K,) of the octree
    lower: np.ndarray  #: (K, 3) [unit of the file]
    upper: np.ndarray  #: (K, 3)


@np.errstate(all="ignore")  # comparisons with values that are not finite fail
def find_boxes(path: Path, header: Any) -> Boxes | None:
    """Return the boxes of a file; None if it is no COPC or its table does not match its points, so that all must be read."""
    with path.open("rb") as file:
        file.seek(HEADER_14)
        record = file.read(RECORD_HEAD_BYTES + RECORD_BYTES)
        if len(record) < RECORD_HEAD_BYTES + RECORD_BYTES or record[2:20] != RECORD_NAME:
            return None
        x, y, z, half, _, place, size = unpack_from("<5d2Q", record, RECORD_HEAD_BYTES)
        entries = _read_table(file, place, size, path.stat().st_size)
        if not _fit(entries, _chunks_of(file, header), header):
            return None
    corner = np.array([x, y, z]) - half
    level, keys = entries["key"][:, 0], entries["key"][:, 1:]
    if level.min() < 0 or level.max() > DEEPEST_OCTREE_LEVEL or len(np.unique(entries["key"], axis=0)) < len(entries):
        return None
    close = 2.0 * np.abs(header.scales) + OCTREE_TOLERANCE * half
    whole = (corner - close <= header.mins) & (header.maxs <= corner + 2.0 * half + close)
    if not whole.all() or (keys < 0).any() or (keys >= 1 << level[:, None].astype(np.int64)).any():
        return None
    side = 2.0 * half * 0.5 ** level[:, None]
    lower = corner + keys * side
    begin, size, points = (entries[name].astype(np.int64) for name in ("place", "size", "count"))
    boxes = Boxes(begin, size, points, level, lower - close, lower + side + close)
    return boxes if _begin_inside(path, header, boxes) else None


def _read_table(file: BinaryIO, place: int, size: int, end: int) -> np.ndarray:
    """Return the entries of a table that have points, in the order of the file; as far as it can be followed."""
    pages, found, left = [(place, size)], [np.empty(0, TABLE_ENTRY)], end
    while pages:
        place, size = pages.pop()
        if not 0 < size <= min(end - place, left):  # nor more entries than the file holds: a page may refer to itself
            continue
        left -= size
        file.seek(place)
        entries = np.frombuffer(file.read(size // TABLE_ENTRY.itemsize * TABLE_ENTRY.itemsize), TABLE_ENTRY)
        more = entries[entries["count"] == TABLE_ELSEWHERE]
        pages += zip(more["place"].tolist(), more["size"].tolist(), strict=True)
        found.append(entries[entries["count"] > 0])
    entries = np.concatenate(found)
    return entries[np.argsort(entries["place"], kind="stable")]


def _chunks_of(file: BinaryIO, header: Any) -> np.ndarray:
    """Return count and size of each chunk, (K, 2), by the table of LAZ, which `check_header` has looked at."""
    import lazrs

    file.seek(header.offset_to_point_data)
    chunks = np.array(lazrs.read_chunk_table(file, lazrs.LazVlr(_described(header))), np.int64).reshape(-1, 2)
    return chunks[chunks.any(axis=1)]


def _described(header: Any) -> bytes:
    """Return the record that describes how points are packed."""
    return next((bytes(vlr.record_data_bytes()) for vlr in header.vlrs if vlr.record_id == LASZIP_RECORD), b"")


def _fit(entries: np.ndarray, chunks: np.ndarray, header: Any) -> bool:
    """Whether a table has exactly the chunks of a file, and these the points that its header promises."""
    if not len(chunks) or len(entries) != len(chunks) or chunks[:, 0].sum() != header.point_count:
        return False
    places = header.offset_to_point_data + 8 + np.cumsum(chunks[:, 1]) - chunks[:, 1]
    same = (entries["place"] == places) & (entries["size"] == chunks[:, 1]) & (entries["count"] == chunks[:, 0])
    return bool(same.all())


def _begin_inside(path: Path, header: Any, boxes: Boxes) -> bool:
    """Whether the first point of each chunk, which is not packed, lies in its box."""
    with path.open("rb", buffering=0) as file:
        first = b"".join(_bytes_at(file, place, 12) for place in boxes.begin)
    points = np.frombuffer(first, "<i4").reshape(-1, 3) * header.scales + header.offsets
    return bool(((points >= boxes.lower) & (points <= boxes.upper)).all())


def touching(boxes: Boxes, places: Sequence[WantedBox]) -> tuple[np.ndarray, dict[str, int]]:
    """Return the numbers of the boxes that touch all places, in order, and how many points lie in others, by the words of the places.

    The coarsest box is always included: it shows what the file holds.
    """
    left = np.ones(len(boxes.points), np.bool_)
    unread: dict[str, int] = {}
    coarsest = np.argmin(boxes.level)
    for words, lower, upper in places:
        near = np.all((boxes.lower <= upper) & (boxes.upper >= lower), axis=1)
        near[coarsest] = True
        unread[words] = unread.get(words, 0) + int(boxes.points[left & ~near].sum())
        left &= near
    return np.flatnonzero(left), unread


def read_boxes(path: Path, header: Any, boxes: Boxes, rows: np.ndarray, most: int, fields: Any) -> Iterator[Any]:
    """Yield the points of some boxes as records of laspy, about `most` at a time.

    Parameters
    ----------
    path, header, boxes
        A COPC file.
    rows : (R,) int64 array
        Numbers of boxes; the points come in their order.
    most : most points in memory at once; at least one box
    fields
        What is unpacked, as lazrs says it.

    Raises
    ------
    FormatError
        Points do not lie in their boxes, so that others may be missing.
    """
    import laspy
    import lazrs

    described = _described(header)
    after = np.cumsum(boxes.points[rows])
    begin = 0  # of a part of the rows
    with path.open("rb") as file:
        while begin < len(rows):
            before = after[begin - 1] if begin else 0
            end = max(int(np.searchsorted(after, before + most, side="right")), begin + 1)
            some, begin = rows[begin:end], end
            packed = b"".join(_bytes_at(file, boxes.begin[row], boxes.size[row]) for row in some)
            array = np.zeros(int(boxes.points[some].sum()), header.point_format.dtype())
            chunks = np.stack([boxes.points[some], boxes.size[some]], axis=1).tolist()
            lazrs.decompress_points_with_chunk_table(
                packed, described, array.view(np.uint8), [tuple(chunk) for chunk in chunks], fields
            )
            record = laspy.ScaleAwarePointRecord(array, header.point_format, header.scales, header.offsets)
            _check_places(path, record, boxes, some)
            yield record


def _bytes_at(file: BinaryIO, place: int, size: int) -> bytes:
    file.seek(place)
    return file.read(size)


def _check_places(path: Path, record: Any, boxes: Boxes, rows: np.ndarray) -> None:
    """Refuse points that do not lie in their boxes."""
    starts = np.cumsum(boxes.points[rows]) - boxes.points[rows]
    for axis, name in enumerate("XYZ"):
        ends = np.stack([one.reduceat(record[name], starts) for one in (np.minimum, np.maximum)])
        ends = np.sort(ends * record.scales[axis] + record.offsets[axis], axis=0)
        if (ends[0] < boxes.lower[rows, axis]).any() or (ends[1] > boxes.upper[rows, axis]).any():
            raise FormatError(
                f"{path} has points outside the boxes that its COPC table gives them, so --crop may miss some; write it"
                " again, or convert it to plain LAZ (PDAL)"
            )
