"""Claims in the header of a LAS file that its size belies: laspy would follow them, four billion records if need be."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np

from ..errors import FormatError

LEAST_HEADER = 227  # bytes, of LAS 1.0 to 1.2
HEADER_14 = 375
RECORD, EXTENDED = 54, 60  # bytes of the header of a variable length record, and of an extended one


def check_header(path: Path) -> None:
    """Refuse a LAS or LAZ file whose header promises more than the file can hold."""
    size = path.stat().st_size
    with path.open("rb") as file:
        head = file.read(HEADER_14)
        if len(head) < LEAST_HEADER:
            raise FormatError(f"{path} ends within its LAS header; copy it again")
        length, start, records = struct.unpack_from("<HII", head, 94)
        form, width, count = struct.unpack_from("<BHI", head, 104)
        scales = np.frombuffer(head, "<f8", 6, 131)
        if not np.isfinite(scales).all() or not scales[:3].all() or np.abs(scales).max() > 1e50:
            raise FormatError(f"{path}: scale and offset of its LAS header are no sensible numbers; export it again")
        if length < LEAST_HEADER or start > size or length + RECORD * records > start:
            raise FormatError(
                f"{path} ends early: its LAS header promises records and points behind its end; copy it again"
            )
        if head[25] >= 4 and len(head) == HEADER_14 and length >= HEADER_14:
            count = max(count, struct.unpack_from("<Q", head, 247)[0])
            place, extended = struct.unpack_from("<QI", head, 235)
            for _ in range(extended):
                file.seek(min(place, size))
                entry = file.read(EXTENDED)
                place += EXTENDED + (struct.unpack_from("<Q", entry, 20)[0] if len(entry) == EXTENDED else size)
                if place > size:
                    raise FormatError(
                        f"{path} ends early: its LAS header promises records behind its end; copy it again"
                    )
    held = (size - start) // max(width, 1)
    if form < 64 and count > held:
        raise FormatError(f"{path} ends early: its header promises {count:,} points, got {held:,}; copy it again")
