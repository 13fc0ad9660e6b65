"""E57 files (ASTM E2807) of one scan or several with their poses, for the tests of the reader."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from uuid import NAMESPACE_URL, uuid5
from zlib import crc32

import numpy as np

from scantruss.scan.formats.e57_header import DATA_BYTES, PAGE_BYTES, checksums

SPACE = "http://www.astm.org/COMMIT/E57/2010-e57-v1.0"
LARGEST_PACKET = 60_000  # bytes; the format allows 65,536
HEADER = 48  # bytes


@dataclass(frozen=True, eq=False)
class Column:
    """One field of the records of a scan, and how it is stored."""

    name: str
    values: np.ndarray  #: (N,)
    kind: str = "double"  #: double, single, integer; scaled: integers behind which stand value / scale
    low: int = 0  #: least and largest integer; they decide how many bits are stored
    high: int = 0
    scale: float = 1.0

    @property
    def bits(self) -> int:
        """Bits a record takes."""
        return {"double": 64, "single": 32}.get(self.kind) or int(self.high - self.low).bit_length()

    @property
    def prototype(self) -> str:
        """How the header describes it."""
        limits = f'minimum="{self.low}" maximum="{self.high}"'
        return {
            "double": f'<{self.name} type="Float"/>',
            "single": f'<{self.name} type="Float" precision="single"/>',
            "integer": f'<{self.name} type="Integer" {limits}/>',
            "scaled": f'<{self.name} type="ScaledInteger" {limits} scale="{self.scale!r}"/>',
        }[self.kind]

    def stored(self, begin: int, end: int) -> bytes:
        """Return the bytes of some records."""
        values = self.values[begin:end]
        if self.kind in ("double", "single"):
            return values.astype("<f8" if self.kind == "double" else "<f4").tobytes()
        whole = np.round(values / self.scale if self.kind == "scaled" else values).astype(np.int64) - self.low
        bits = whole[:, None] >> np.arange(self.bits, dtype=np.int64) & 1
        return np.packbits(bits.astype(np.uint8).ravel(), bitorder="little").tobytes()


Scan = tuple[Sequence[Column], str]  # its columns and the XML of its pose, "" for none


def physical(place: int) -> int:
    """Return the byte of the file that holds a byte of the data."""
    return place // DATA_BYTES * PAGE_BYTES + place % DATA_BYTES


def to_pages(data: bytes) -> np.ndarray:
    """Return data, filled up with zeros, as pages with their checksums, (P, 1024) uint8."""
    count = -(-len(data) // DATA_BYTES)
    pages = np.zeros((count, PAGE_BYTES), dtype=np.uint8)
    whole = len(data) // DATA_BYTES
    flat = np.frombuffer(data, dtype=np.uint8)
    pages[:whole, :DATA_BYTES] = flat[: whole * DATA_BYTES].reshape(whole, DATA_BYTES)
    if whole < count:
        pages[whole, : len(data) - whole * DATA_BYTES] = flat[whole * DATA_BYTES :]
    pages[:, DATA_BYTES:] = checksums(pages)[:, None].astype(">u4").view(np.uint8)
    return pages


def write_scans(path: Path, scans: Sequence[Scan]) -> None:
    """Write several scans."""
    data = bytearray(HEADER)
    children = []
    for number, (columns, pose) in enumerate(scans):
        records = len(columns[0].values)
        section = _section(columns, len(data))
        guid = uuid5(NAMESPACE_URL, f"{number} {records} {crc32(section)}")
        children.append(
            f'<vectorChild type="Structure"><guid type="String">{{{guid}}}</guid>{pose}'
            f'<points type="CompressedVector" fileOffset="{physical(len(data))}" recordCount="{records}">'
            f'<prototype type="Structure">{"".join(c.prototype for c in columns)}</prototype>'
            '<codecs type="Vector" allowHeterogeneousChildren="1"/></points></vectorChild>\n'
        )
        data += section
    xml = _document("".join(children), crc32(data)).encode()
    start = len(data)
    data += xml
    pages = -(-len(data) // 1020)
    struct.pack_into("<8sIIQQQQ", data, 0, b"ASTM-E57", 1, 0, 1024 * pages, physical(start), len(xml), 1024)
    to_pages(bytes(data)).tofile(path)


def _section(columns: Sequence[Column], place: int) -> bytes:
    """Return the records of a scan as packets behind their header; a number of bytes that four divides."""
    records = len(columns[0].values)
    width = sum(column.bits for column in columns)
    step = max(8, 8 * LARGEST_PACKET // max(width, 1) // 8 * 8)  # whole bytes of any number of bits
    packets = [_packet([c.stored(i, i + step) for c in columns]) for i in range(0, records, step)]
    body = b"".join(packets)
    return struct.pack("<B7xQQQ", 1, 32 + len(body), physical(place + 32), 0) + body


def _packet(streams: Sequence[bytes]) -> bytes:
    lengths = struct.pack(f"<{len(streams)}H", *map(len, streams))
    size = 6 + len(lengths) + sum(map(len, streams))
    fill = -size % 4
    return struct.pack("<BBHH", 1, 0, size + fill - 1, len(streams)) + lengths + b"".join(streams) + bytes(fill)


def _document(scans: str, key: int) -> str:
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        f'<e57Root type="Structure" xmlns="{SPACE}">\n'
        '<formatName type="String">ASTM E57 3D Imaging Data File</formatName>'
        f'<guid type="String">{{{uuid5(NAMESPACE_URL, str(key))}}}</guid>'
        '<versionMajor type="Integer">1</versionMajor><versionMinor type="Integer">0</versionMinor>'
        '<e57LibraryVersion type="String">ScanTruss</e57LibraryVersion>'
        '<coordinateMetadata type="String"></coordinateMetadata>\n'
        f'<data3D type="Vector" allowHeterogeneousChildren="1">\n{scans}</data3D>\n'
        '<images2D type="Vector" allowHeterogeneousChildren="1"/>\n</e57Root>\n'
    )
