"""Points of an E57 file (ASTM E2807): all its scans by their poses, or each in its own frame.

This reader uses numpy only: on a damaged file the package e57 prints a Rust panic, and it ends the process if a header claims
more points than fit into memory.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...errors import FormatError
from .columns import find_attributes
from .content import Content
from .e57_header import SPHERICAL, E57Field, E57Scan, logical, read_pages, read_scans
from .kinds import read_head, wrong_kind
from .las_header import room_note

LEAST_SURPLUS = 64  # bits of a field after those of its records that may be padding
RECORDS_PER_BLOCK = 1 << 18  # records unpacked at a time


class ScanPoints(NamedTuple):
    """One scan of a file, in its own frame."""

    name: str
    points: np.ndarray  #: (N, 3) float64 [m]
    rotation: np.ndarray  #: (3, 3); the place in the common frame is rotation @ place + translation
    translation: np.ndarray  #: (3,) [m]
    invalid: int  #: points that the scanner marked as invalid; they are left out
    attributes: dict[str, np.ndarray]  #: wanted ones that the scan has, (N,) each
    notes: tuple[str, ...]  #: what a user should know


def read_e57(path: Path, wanted: Sequence[str] = ()) -> Content:
    """Return the points of all scans of an E57 file in their common frame [m] and the wanted attributes that all of them have."""
    parts, found, invalid, notes = [], [], 0, tuple[str, ...]()
    for scan in e57_scans(path, wanted):
        parts.append(_in_common_frame(scan))
        found.append(scan.attributes)
        invalid += scan.invalid
        notes += scan.notes
    points = parts[0] if len(parts) == 1 else np.concatenate([np.empty((0, 3)), *parts])
    everywhere = [name for name in wanted if found and all(name in each for each in found)]
    attributes = {name: np.concatenate([each[name] for each in found]) for name in everywhere}
    left_out = {"that the scanner marked as invalid": invalid} if invalid else {}
    return Content(points, attributes, metres=1.0, z_metres=1.0, left_out=left_out, notes=notes)


def _in_common_frame(scan: ScanPoints) -> np.ndarray:
    points = scan.points
    if not np.array_equal(scan.rotation, np.eye(3)):
        points = points @ scan.rotation.T
    return points + scan.translation if scan.translation.any() else points


def e57_scans(path: Path, wanted: Sequence[str] = ()) -> Iterator[ScanPoints]:
    """Yield the scans of an E57 file, each in its own frame, with the wanted attributes that it has.

    Raises
    ------
    FormatError
        The file is no E57 file, cut off or damaged, or a scan has no coordinates.
    """
    head = read_head(path)
    if not head.startswith(b"ASTM-E57"):
        raise wrong_kind(path, head, "an E57 file")
    data = read_pages(path)
    for scan in read_scans(path, data):
        axes = scan.axes
        if not axes:
            raise FormatError(f"{path}: {scan.name} has neither cartesian nor spherical coordinates")
        state = "sphericalInvalidState" if axes == SPHERICAL else "cartesianInvalidState"
        named = _attribute_fields(scan, wanted)
        columns, room = _read_columns(path, data, scan, (*axes, state, *named.values()))
        points = np.column_stack([columns[axis] for axis in axes])
        if axes == SPHERICAL:
            points = _to_cartesian(points)
        attributes = {name: columns[field] for name, field in named.items()}
        if named.get("return_number") == "returnIndex":
            attributes["return_number"] += 1  # this format counts them from 0
        kept = columns[state] == 0 if state in columns else np.ones(len(points), dtype=bool)
        if not kept.all():
            points, attributes = points[kept], {name: values[kept] for name, values in attributes.items()}
        invalid = len(kept) - int(kept.sum())
        notes = room_note(path, scan.count, room, f" in {scan.name}")
        yield ScanPoints(scan.name, points, scan.rotation, scan.translation, invalid, attributes, notes)


def _attribute_fields(scan: E57Scan, wanted: Sequence[str]) -> dict[str, str]:
    """Return the fields that hold the wanted attributes, those of extensions too."""
    names = [field.name for field in scan.fields]
    known = ["return_number" if name == "returnIndex" else name.partition("_")[2] or name for name in names]
    return {attribute: names[place] for attribute, place in find_attributes(known, wanted).items()}


def _to_cartesian(places: np.ndarray) -> np.ndarray:
    distance, azimuth, elevation = places.T
    flat = distance * np.cos(elevation)
    return np.column_stack([flat * np.cos(azimuth), flat * np.sin(azimuth), distance * np.sin(elevation)])


def _read_columns(
    path: Path, data: np.ndarray, scan: E57Scan, names: tuple[str, ...]
) -> tuple[dict[str, np.ndarray], int]:
    """Return the named fields of all records, float64 each, and how many records there are, promised or not.

    Fields that a scan does not have are left out.
    """
    place = [field.name for field in scan.fields]
    wanted = [place.index(name) for name in dict.fromkeys(names) if name in place]
    width = sum(field.bits for field in scan.fields)
    if scan.count * max(width, 1) > 8 * len(data):
        raise FormatError(
            f"{path} ends early: its header promises {scan.count:,} points, but it has {len(data):,} bytes; copy it again"
        )
    if not scan.count:
        return {place[i]: np.empty(0) for i in wanted}, 0
    streams = _collect(path, data, scan, wanted)
    stored = [(8 * len(s), bits) for s, i in zip(streams, wanted, strict=True) if (bits := scan.fields[i].bits)]
    sure = all(held - bits * scan.count >= LEAST_SURPLUS for held, bits in stored)
    room = min((held // bits for held, bits in stored), default=0) if sure else 0
    found = {place[i]: _decode(stream, scan.fields[i], scan.count) for stream, i in zip(streams, wanted, strict=True)}
    return found, room


def _collect(path: Path, data: np.ndarray, scan: E57Scan, wanted: list[int]) -> list[np.ndarray]:
    """Return the bytes of the wanted fields, gathered from the data packets."""
    early = FormatError(f"{path} ends early: {scan.name} promises {scan.count:,} points; copy it again")
    try:
        kind, _, first = struct.unpack("<B7xQQ", data[scan.start : scan.start + 24].tobytes())
    except struct.error:
        raise early from None
    if kind != 1:
        raise FormatError(f"{path}: no points where {scan.name} should have them; the file is damaged")
    place = logical(first)
    parts: list[list[np.ndarray]] = [[] for _ in wanted]
    missing = [scan.count * scan.fields[i].bits for i in wanted]
    while max(missing) > 0:
        if place + 6 > len(data):
            raise early
        kind, size = int(data[place]), int(data[place + 2]) + 256 * int(data[place + 3]) + 1
        if kind > 2 or size < 4 or place + size > len(data):
            raise early
        if kind == 1:
            streams = _streams(data[place : place + size], len(scan.fields))
            if streams is None:
                raise FormatError(f"{path}: a packet of {scan.name} does not hold its fields; the file is damaged")
            for number, i in enumerate(wanted):
                parts[number].append(streams[i])
                missing[number] -= 8 * len(streams[i])
        place += size
    return [np.concatenate(found) if found else np.empty(0, dtype=np.uint8) for found in parts]


def _streams(packet: np.ndarray, count: int) -> list[np.ndarray] | None:
    """Return the bytes of each field in a data packet; None if it holds another number of fields."""
    stated, begin = int(packet[4]) + 256 * int(packet[5]), 6 + 2 * count
    if stated != count or begin > len(packet):
        return None
    ends = begin + np.cumsum(packet[6:begin].view("<u2").astype(np.int64))
    if ends[-1] > len(packet):
        return None
    return [packet[a:b] for a, b in zip([begin, *ends[:-1]], ends, strict=True)]


def _decode(stream: np.ndarray, field: E57Field, count: int) -> np.ndarray:
    """Return the values of a field, (count,) float64."""
    if field.kind != "integer":
        size = field.bits // 8
        return stream[: count * size].view(f"<f{size}").astype(np.float64, copy=False)
    values = np.empty(count)
    padded = np.concatenate([stream, np.zeros(16, dtype=np.uint8)])
    for begin in range(0, count, RECORDS_PER_BLOCK):
        end = min(begin + RECORDS_PER_BLOCK, count)
        whole = _unpack(padded, field.bits, begin, end) + np.uint64(field.low % (1 << 64))  # wraps to the signed number
        values[begin:end] = whole.view(np.int64)
    if (field.scale, field.offset) != (1.0, 0.0):
        values = values * field.scale + field.offset
    return values


def _unpack(stream: np.ndarray, bits: int, begin: int, end: int) -> np.ndarray:
    """Return whole numbers of some bits, lowest bit first, (end - begin,) uint64; 16 bytes follow the last of them."""
    if bits == 0:
        return np.zeros(end - begin, dtype=np.uint64)
    first = np.arange(begin, end, dtype=np.int64) * bits
    place, shift = first >> 3, (first & 7).astype(np.uint64)
    words = np.ndarray((len(stream) - 7,), "<u8", stream, strides=(1,))
    found = words[place] >> shift
    if bits > 57:
        late = shift > 0
        found[late] |= stream[place[late] + 8].astype(np.uint64) << (np.uint64(64) - shift[late])
    return found & np.uint64((1 << bits) - 1)
