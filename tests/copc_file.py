"""A COPC file as its specification has it: LAZ 1.4 whose chunks are the boxes of an octree, with a table of them behind."""

from __future__ import annotations

import io
import struct

import laspy
import lazrs
import numpy as np

HEADER = 375  # bytes of a LAS 1.4 header
LEVELS = 3


def copc(points: np.ndarray, **fields: np.ndarray) -> tuple[bytes, np.ndarray]:
    """Return a file of (N, 3) points with attributes, and the order in which it holds them, (N,)."""
    lower, side = points.min(axis=0), float(np.ptp(points, axis=0).max()) * 1.001
    boxes = _boxes((points - lower) / side)
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales, header.offsets = [0.001] * 3, np.floor(lower)
    record = laspy.ScaleAwarePointRecord.zeros(len(points), header=header)
    record.x, record.y, record.z = points.T
    for name, values in fields.items():
        record[name] = values
    described = lazrs.LazVlr.new_for_compression(6, 0, use_variable_size_chunks=True)
    start = HEADER + 54 + 160 + 54 + len(described.record_data())
    file = io.BytesIO(bytes(start))
    file.seek(start)
    packer = lazrs.LasZipCompressor(file, described)
    for _, rows in boxes:
        packer.compress_many(np.frombuffer(record.array[rows].tobytes(), dtype=np.uint8))
        packer.finish_current_chunk()
    packer.done()
    table = _table(file, start, described, boxes)
    behind = file.seek(0, io.SEEK_END)
    file.write(struct.pack("<H16sHQ32s", 0, b"copc", 1000, len(table), b"") + table)
    file.seek(0)
    file.write(_header(header, points, start, behind))
    center = lower + 0.5 * side
    info = struct.pack("<5d2Q2d", *center, 0.5 * side, side / 64, behind + 60, len(table), 0.0, 0.0)
    for user, number, data in (
        (b"copc", 1, info.ljust(160, b"\0")),
        (b"laszip encoded", 22204, described.record_data()),
    ):
        file.write(struct.pack("<H16sHH32s", 0, user, number, len(data), b"") + bytes(data))
    return file.getvalue(), np.concatenate([rows for _, rows in boxes])


def _boxes(places: np.ndarray) -> list[tuple[tuple[int, ...], np.ndarray]]:
    """Return key (level, x, y, z) and points of each box; every level has some of the points everywhere."""
    level = np.random.default_rng(1).choice(LEVELS, len(places), p=[0.05, 0.2, 0.75])
    keys = np.column_stack([level, np.floor(places * 2.0 ** level[:, None]).astype(int)])
    found, which = np.unique(keys, axis=0, return_inverse=True)
    return [(tuple(key), np.flatnonzero(which.ravel() == number)) for number, key in enumerate(found.tolist())]


def _table(file: io.BytesIO, start: int, described: lazrs.LazVlr, boxes: list) -> bytes:
    """Return the hierarchy: key, place, bytes and points of every chunk."""
    file.seek(start)
    entries, place = b"", start + 8
    for (key, rows), (count, size) in zip(boxes, lazrs.read_chunk_table(file, described), strict=False):
        assert count == len(rows)
        entries += struct.pack("<4iQ2i", *key, place, size, count)
        place += size
    return entries


def _header(header: laspy.LasHeader, points: np.ndarray, start: int, behind: int) -> bytes:
    data = bytearray(HEADER)
    struct.pack_into("<4s20xBB", data, 0, b"LASF", 1, 4)
    struct.pack_into("<HIIBH", data, 94, HEADER, start, 2, 6 | 128, 30)
    corners = np.column_stack([points.max(axis=0), points.min(axis=0)]).ravel()
    struct.pack_into("<12d", data, 131, *header.scales, *header.offsets, *corners)
    struct.pack_into("<QIQQ", data, 235, behind, 1, len(points), len(points))
    return bytes(data)
