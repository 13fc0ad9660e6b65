"""Checks of the header of a LAS file against the size of the file: laspy would follow any claim, up to four billion records."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import BinaryIO

import numpy as np

from ...errors import FormatError

LEAST_HEADER = 227  # bytes, of LAS 1.0 to 1.2
HEADER_14 = 375  # bytes of the header of LAS 1.4
WAVES_AT = 227  # where a header from LAS 1.3 on says where packets of waves begin
LASZIP_RECORD = 22204  # number of the record that describes how points are packed
MOST_IN_CHUNK = 1 << 20  # points of one chunk, where the file holds fewer; room is made for all of them
UNKNOWN_COUNT = (1 << 64) - 1  # a count of 64 bits that is not known yet
# bytes of the header of a variable length record, and of an extended one
RECORD_HEAD_BYTES, EXTENDED_HEAD_BYTES = 54, 60


def check_header(path: Path) -> tuple[str, ...]:
    """Refuse a LAS or LAZ file whose header promises more than the file can hold; return a note where it promises less."""
    size = path.stat().st_size
    with path.open("rb") as file:
        head = file.read(HEADER_14)
        if len(head) < LEAST_HEADER:
            raise FormatError(f"{path} ends within its LAS header; copy it again")
        length, start, records = struct.unpack_from("<HII", head, 94)
        form, width, count = struct.unpack_from("<BHI", head, 104)
        scales = np.frombuffer(head, "<f8", 6, 131)
        if not np.isfinite(scales).all() or not scales[:3].all() or np.abs(scales).max() > 1e50:
            raise FormatError(f"{path}: scale and offset of its LAS header are not sensible numbers; export it again")
        if length < LEAST_HEADER or start > size or length + RECORD_HEAD_BYTES * records > start:
            raise FormatError(
                f"{path} ends early: its LAS header promises records and points behind its end; copy it again"
            )
        end, promised = size, count
        if head[25] >= 4 and len(head) == HEADER_14 and length >= HEADER_14:
            promised = struct.unpack_from("<Q", head, 247)[0]
            count = max(count, promised)
            place, extended = struct.unpack_from("<QI", head, 235)
            end = min(place, size) if extended else size
            for _ in range(extended):
                file.seek(min(place, size))
                entry = file.read(EXTENDED_HEAD_BYTES)
                place += EXTENDED_HEAD_BYTES + (
                    struct.unpack_from("<Q", entry, 20)[0] if len(entry) == EXTENDED_HEAD_BYTES else size
                )
                if place > size:
                    raise FormatError(
                        f"{path} ends early: its LAS header promises records behind its end; copy it again"
                    )
        if head[25] >= 3 and length >= WAVES_AT + 8 and (waves := struct.unpack_from("<Q", head, WAVES_AT)[0]):
            end = min(waves, end)
        if form & 0xC0:
            room = _check_packed(path, size, length, records, start, width, count)
            return room_note(path, promised, room)
    held = (size - start) // max(width, 1)
    if form < 64 and count > held:
        raise FormatError(f"{path} ends early: its header promises {count:,} points, got {held:,}; copy it again")
    whole = form < 64 and width > 0 and (end - start) % width == 0
    return room_note(path, promised, (end - start) // width if whole else 0)


def room_note(path: Path, count: int, room: int, of: str = "") -> tuple[str, ...]:
    """Return a note if a file certainly holds more points than its header promises."""
    if room <= count:
        return ()
    return (f"the header of {path.name} promises {count:,} points{of}, the file has {room:,}; the others are left out",)


def _check_packed(path: Path, size: int, length: int, records: int, start: int, width: int, count: int) -> int:
    """Refuse packed points with more or larger chunks than the file can hold; return the least number of points."""
    import lazrs

    early = FormatError(f"{path} ends early: the table of its packed points is not whole; copy it again")
    with path.open("rb") as file:
        described = _find_record(file, length, records, LASZIP_RECORD)
        file.seek(start)
        words = file.read(8)
        table = struct.unpack("<Q", words)[0] if len(words) == 8 else 0
        if table == UNKNOWN_COUNT:  # a writer that could not seek wrote it at the end
            file.seek(size - 8)
            table = struct.unpack("<Q", file.read(8))[0]
        if len(described) < 34 or not start + 8 <= table <= size - 8:
            raise early
        _, items = struct.unpack_from("<qH", described, 24)
        parts = [struct.unpack_from("<HH", described, 34 + 6 * i) for i in range(items) if 40 + 6 * i <= len(described)]
        if sum(part[1] for part in parts) != width or len(parts) != items:
            raise FormatError(
                f"{path}: its packed points do not have the {width} bytes of its header; the file is damaged"
            )
        file.seek(table)
        _, chunks = struct.unpack("<II", file.read(8))
        if chunks * max(width, 1) > table - start:
            raise early
        file.seek(start)
        entries = lazrs.read_chunk_table(file, lazrs.LazVlr(described))
        entries = [entry for entry in entries if entry != (0, 0)]  # some writers put these after the last chunk
        if not all(0 < entry[0] <= max(count, MOST_IN_CHUNK) for entry in entries):
            raise FormatError(f"{path}: its packed points come in chunks of no sensible size; the file is damaged")
        layers = sum({10: 9, 11: 1, 12: 2, 13: 1, 14: long}.get(kind, 0) for kind, long in parts)
        place = start + 8
        for _, long in entries:
            file.seek(place + width + 4)
            stated = np.frombuffer(file.read(4 * layers), dtype="<u4")
            place += long
            if place > table or len(stated) < layers or int(stated.sum(dtype=np.int64)) > long:
                raise early
        if lazrs.LazVlr(described).uses_variable_size_chunks():
            return sum(points for points, _ in entries)
        return sum(points for points, _ in entries[:-1]) + 1 if entries else 0


def _find_record(file: BinaryIO, place: int, records: int, number: int) -> bytes:
    """Return the content of a variable length record; empty if there is none."""
    for _ in range(records):
        file.seek(place)
        entry = file.read(RECORD_HEAD_BYTES)
        if len(entry) < RECORD_HEAD_BYTES:
            return b""
        found, long = struct.unpack_from("<HH", entry, 18)
        if found == number:
            return file.read(long)
        place += RECORD_HEAD_BYTES + long
    return b""
