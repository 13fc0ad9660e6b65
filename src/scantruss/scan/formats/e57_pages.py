"""Pages of an E57 file: 1020 bytes of data and a CRC-32C each, so that a damaged file shows."""

from __future__ import annotations

from functools import cache

import numpy as np

PAGE = 1024  # bytes
DATA = 1020  # ... of which these are data
MOST_PAGES = 1 << 14  # checked in one go
POLYNOMIAL = 0x82F63B78  # Castagnoli's, bits reversed


def physical(place: int) -> int:
    """Return the byte of the file that holds a byte of the data."""
    return place // DATA * PAGE + place % DATA


def logical(place: int) -> int:
    """Return the byte of the data that a byte of the file holds."""
    return place // PAGE * DATA + min(place % PAGE, DATA)


def to_pages(data: bytes) -> np.ndarray:
    """Return data, filled up with zeros, as pages with their checksums, (P, 1024) uint8."""
    count = -(-len(data) // DATA)
    pages = np.zeros((count, PAGE), dtype=np.uint8)
    whole = len(data) // DATA
    flat = np.frombuffer(data, dtype=np.uint8)
    pages[:whole, :DATA] = flat[: whole * DATA].reshape(whole, DATA)
    if whole < count:
        pages[whole, : len(data) - whole * DATA] = flat[whole * DATA :]
    pages[:, DATA:] = checksums(pages)[:, None].astype(">u4").view(np.uint8)
    return pages


def checksums(pages: np.ndarray) -> np.ndarray:
    """Return the CRC-32C of the data of each page, (P,) uint32: two bytes at a time, all pages at once."""
    table = _table()
    sums = np.empty(len(pages), dtype=np.uint32)
    for begin in range(0, len(pages), MOST_PAGES):
        words = (
            np.ascontiguousarray(pages[begin : begin + MOST_PAGES, :DATA]).view("<u2").T.astype(np.uint32, order="C")
        )
        state = np.full(words.shape[1], 0xFFFFFFFF, dtype=np.uint32)
        for word in words:
            state = table[(state ^ word) & 0xFFFF] ^ (state >> 16)
        sums[begin : begin + MOST_PAGES] = ~state
    return sums


@cache
def _table() -> np.ndarray:
    """Return what 16 shifts make of each pair of bytes, (65536,) uint32."""
    table: np.ndarray = np.arange(1 << 16, dtype=np.uint32)
    for _ in range(16):
        table = (table >> 1) ^ np.where(table & 1, np.uint32(POLYNOMIAL), np.uint32(0))
    return table
