"""Points of a LAS or LAZ file by laspy: scale and offset applied in float64, a million points at a time."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..errors import FormatError
from .kinds import read_head, unreadable, wrong_kind

CHUNK = 1_000_000  # points


def read_las(path: Path) -> np.ndarray:
    """Return the points of a LAS or LAZ file, (N, 3) float64 [scan unit]."""
    head = read_head(path)
    if not head.startswith(b"LASF"):
        raise wrong_kind(path, head, "a LAS or LAZ file")
    import laspy

    chunks = []
    try:
        with laspy.open(path) as file:
            promised = file.header.point_count
            for record in file.chunk_iterator(CHUNK):
                chunks.append(np.column_stack([record.x, record.y, record.z]))
    except BaseException as error:
        raise unreadable(path, "LAS or LAZ", error) from None
    count = sum(map(len, chunks))
    if count < promised:
        raise FormatError(f"{path} ends early: its header promises {promised:,} points, got {count:,}; copy it again")
    return np.concatenate(chunks) if chunks else np.empty((0, 3))
