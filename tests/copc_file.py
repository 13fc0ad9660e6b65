"""A COPC file as its specification has it: LAZ 1.4 whose chunks are the boxes of an octree, with a table of them behind."""

from __future__ import annotations

import io
import struct
from collections.abc import Sequence

import laspy
import lazrs
import numpy as np

HEADER = 375  # bytes of a LAS 1.4 header
ENTRY = struct.Struct("<4iQ2i")  # key, place, bytes and points of a chunk
Boxes = list[tuple[tuple[int, ...], np.ndarray]]


def copc(
    points: np.ndarray,
    *,
    levels: int = 3,
    pages: bool = False,
    records: Sequence[tuple[bytes, int, bytes]] = (),
    **fields: np.ndarray,
) -> tuple[bytes, np.ndarray]:
    """Return a file of (N, 3) points with attributes, and the order in which it holds them, (N,).

    Its octree has some levels, and its table a page for each box of level 1 where `pages`; `records` (user, number, data) say more.
    """
    lower, side = points.min(axis=0), float(np.ptp(points, axis=0).max()) * 1.001
    boxes = _boxes((points - lower) / side, levels)
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales, header.offsets = [0.001] * 3, np.floor(lower)
    record = laspy.ScaleAwarePointRecord.zeros(len(points), header=header)
    record.x, record.y, record.z = points.T
    for name, values in fields.items():
        record[name] = values
    described = lazrs.LazVlr.new_for_compression(6, 0, use_variable_size_chunks=True)
    start = HEADER + 54 + 160 + 54 + len(described.record_data()) + sum(54 + len(data) for _, _, data in records)
    file = io.BytesIO(bytes(start))
    file.seek(start)
    packer = lazrs.LasZipCompressor(file, described)
    for _, rows in boxes:
        packer.compress_many(np.frombuffer(record.array[rows].tobytes(), dtype=np.uint8))
        packer.finish_current_chunk()
    packer.done()
    entries = _entries(file, start, described, boxes)
    behind = file.seek(0, io.SEEK_END)
    root, table = _table(entries, behind + 60, pages)
    file.write(struct.pack("<H16sHQ32s", 0, b"copc", 1000, len(table), b"") + table)
    file.seek(0)
    file.write(_header(header, points, start, behind, 2 + len(records)))
    center = lower + 0.5 * side
    info = struct.pack("<5d2Q2d", *center, 0.5 * side, side / 64, behind + 60, root, 0.0, 0.0)
    for user, number, data in (
        (b"copc", 1, info.ljust(160, b"\0")),
        (b"laszip encoded", 22204, described.record_data()),
        *records,
    ):
        file.write(struct.pack("<H16sHH32s", 0, user, number, len(data), b"") + bytes(data))
    return file.getvalue(), np.concatenate([rows for _, rows in boxes])


def _boxes(places: np.ndarray, levels: int) -> Boxes:
    """Return key (level, x, y, z) and points of each box; every level has some of the points everywhere."""
    shares = 4.0 ** np.arange(levels)
    level = np.random.default_rng(1).choice(levels, len(places), p=shares / shares.sum())
    keys = np.column_stack([level, np.floor(places * 2.0 ** level[:, None]).astype(int)])
    found, which = np.unique(keys, axis=0, return_inverse=True)
    return [(tuple(key), np.flatnonzero(which.ravel() == number)) for number, key in enumerate(found.tolist())]


def _entries(file: io.BytesIO, start: int, described: lazrs.LazVlr, boxes: Boxes) -> list[tuple[int, ...]]:
    """Return key, place, bytes and points of every chunk."""
    file.seek(start)
    entries, place = [], start + 8
    for (key, rows), (count, size) in zip(boxes, lazrs.read_chunk_table(file, described), strict=False):
        assert count == len(rows)
        entries.append((*key, place, size, count))
        place += size
    return entries


def _table(entries: list[tuple[int, ...]], place: int, pages: bool) -> tuple[int, bytes]:
    """Return the hierarchy, and how many of its bytes are the first page."""
    if not pages:
        table = b"".join(ENTRY.pack(*entry) for entry in entries)
        return len(table), table
    under: dict[tuple[int, ...], list[tuple[int, ...]]] = {}
    for entry in entries:
        level = entry[0]
        key = (min(level, 1), *(c >> max(level - 1, 0) for c in entry[1:4]))
        under.setdefault(key, []).append(entry)
    first = [entry for entry in entries if entry[0] == 0]
    del under[(0, 0, 0, 0)]
    at = place + ENTRY.size * (len(first) + len(under))
    rest = b""
    for key, some in under.items():
        page = b"".join(ENTRY.pack(*entry) for entry in some)
        first.append((*key, at + len(rest), len(page), -1))
        rest += page
    root = b"".join(ENTRY.pack(*entry) for entry in first)
    return len(root), root + rest


def _header(header: laspy.LasHeader, points: np.ndarray, start: int, behind: int, records: int) -> bytes:
    data = bytearray(HEADER)
    struct.pack_into("<4s20xBB", data, 0, b"LASF", 1, 4)
    struct.pack_into("<HIIBH", data, 94, HEADER, start, records, 6 | 128, 30)
    corners = np.column_stack([points.max(axis=0), points.min(axis=0)]).ravel()
    struct.pack_into("<12d", data, 131, *header.scales, *header.offsets, *corners)
    struct.pack_into("<QIQQ", data, 235, behind, 1, len(points), len(points))
    return bytes(data)
