"""VTP and VTU files, the XML formats of VTK and ParaView: the points of all pieces, with their normals.

The reader is our own: meshio reads no VTP, and vtk (over 100 MB) ends the process on some damaged files.
"""

from __future__ import annotations

import base64
import binascii
import lzma
import re
import zlib
from collections.abc import Callable, Sequence
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from ...errors import FormatError
from .content import Content
from .kinds import kind_of, read_head, reading_as, wrong_kind
from .packed import check_size

RAW = re.compile(rb"<AppendedData[^>]*encoding\s*=\s*[\"']raw[\"'][^>]*>\s*_")  # then the bytes as they are
VTK_NUMBERS = {
    "Float32": "f4", "Float64": "f8", "Int8": "i1", "UInt8": "u1", "Int16": "i2", "UInt16": "u2", "Int32": "i4", "UInt32": "u4",
    "Int64": "i8", "UInt64": "u8",
}  # fmt: skip
UNPACKERS: dict[str, Callable[[bytes, int], bytes]] = {  # of bytes, up to a size
    "vtkZLibDataCompressor": lambda data, most: zlib.decompressobj().decompress(data, most),
    "vtkLZMADataCompressor": lambda data, most: lzma.LZMADecompressor().decompress(data, most),
}
BLOCK_NUMBERS = 3  # numbers before the sizes of packed blocks: how many there are, the size of each, that of the last


class _Data:
    """The numbers of a file: how they are coded, and what is appended to it."""

    def __init__(self, path: Path, root: ElementTree.Element, raw: bytes | None) -> None:
        self.path, self.order = path, "<" if root.get("byte_order", "LittleEndian") == "LittleEndian" else ">"
        self.head = np.dtype(self.order + VTK_NUMBERS[root.get("header_type", "UInt32")])
        self.packed = root.get("compressor", "")
        if self.packed and self.packed not in UNPACKERS:
            raise FormatError(
                f"{path} is packed by {self.packed}, which is not read; save it with zlib or without compression"
            )
        appended = root.find("AppendedData")
        self.raw = raw
        self.text = "" if appended is None or raw is not None else (appended.text or "").strip().removeprefix("_")

    def numbers(self, array: ElementTree.Element) -> np.ndarray:
        """Return the numbers of an array (N,)."""
        kind = np.dtype(self.order + VTK_NUMBERS[array.get("type", "")])
        form = array.get("format", "ascii")
        if form == "ascii":
            return np.array((array.text or "").split(), kind)
        if form == "binary":
            return np.frombuffer(self._coded((array.text or "").strip()), kind)
        place = int(array.get("offset", ""))
        return np.frombuffer(
            self._coded(self.text[place:]) if self.raw is None else self._plain(self.raw[place:]), kind
        )

    def _plain(self, data: bytes) -> bytes:
        """Return the bytes of an array that begins with the size of its parts."""
        size = self.head.itemsize
        if not self.packed:
            return self._cut(data, size, int(np.frombuffer(data, self.head, 1)[0]))
        sizes = self._sizes(data)
        whole = max(int(np.frombuffer(data, self.head, BLOCK_NUMBERS)[1]), 1)
        place, blocks = size * (BLOCK_NUMBERS + len(sizes)), []
        for each in sizes:
            blocks.append(UNPACKERS[self.packed](self._cut(data, place, each), whole))
            place += each
        return b"".join(blocks)

    def _sizes(self, data: bytes) -> list[int]:
        """Return the packed sizes of blocks, once what they unpack to is known to be no more than a scan has."""
        count, whole, _ = (int(n) for n in np.frombuffer(data, self.head, BLOCK_NUMBERS))
        sizes = self._cut(data, BLOCK_NUMBERS * self.head.itemsize, count * self.head.itemsize)
        check_size(self.path, count * whole)
        return [int(each) for each in np.frombuffer(sizes, self.head)]

    def _coded(self, text: str) -> bytes:
        """Return the bytes of an array in base64; the sizes of packed blocks are coded apart."""
        if not self.packed:
            (size,) = np.frombuffer(_decoded(text[: _coded_size(self.head.itemsize)])[: self.head.itemsize], self.head)
            return self._plain(_decoded(text[: _coded_size(self.head.itemsize + int(size))]))
        (count,) = np.frombuffer(_decoded(text[: _coded_size(self.head.itemsize)])[: self.head.itemsize], self.head)
        length = _coded_size(self.head.itemsize * (BLOCK_NUMBERS + int(count)))
        heads = _decoded(text[:length])
        return self._plain(heads + _decoded(text[length : length + _coded_size(sum(self._sizes(heads)))]))

    def _cut(self, data: bytes, start: int, size: int) -> bytes:
        if start + size > len(data):
            raise FormatError(
                f"{self.path} ends early: an array has {max(len(data) - start, 0):,} of {size:,} bytes; copy it again"
            )
        return data[start : start + size]


def read_vtk_xml(path: Path, wanted: Sequence[str] = ()) -> Content:
    """Return the points of a .vtp or .vtu file, with normals where all pieces have them."""
    head = read_head(path)
    if kind_of(head) != "an XML file" and b"<VTKFile" not in head:
        raise wrong_kind(path, head, "a VTP or VTU file")
    text, raw = path.read_bytes(), None
    if b"<!DOCTYPE" in text[: text.find(b"<VTKFile")]:
        raise FormatError(f"{path} has entities of its own, which no VTK file needs; export it again")
    if found := RAW.search(text):
        end = text.rfind(b"</AppendedData>")
        if end < found.end():
            raise FormatError(f"{path} ends early: its appended data has no end; copy it again")
        text, raw = text[: found.end()] + text[end:], text[found.end() : end]
    with reading_as(path, "VTK XML"):
        root = ElementTree.fromstring(text)
        if root.tag != "VTKFile" or root.get("type") not in ("PolyData", "UnstructuredGrid"):
            raise FormatError(
                f"{path} holds {root.get('type') or 'no VTKFile'}; points of PolyData or UnstructuredGrid are read"
            )
        data = _Data(path, root, raw)
        points, normals = list[np.ndarray](), list[np.ndarray]()
        for piece in root.iter("Piece"):
            array = piece.find("Points/DataArray")
            places = np.empty((0, 3)) if array is None else data.numbers(array).reshape(-1, 3).astype(np.float64)
            if len(places) != int(piece.get("NumberOfPoints", "-1")):
                raise FormatError(
                    f"{path} has {len(places):,} points where it promises {piece.get('NumberOfPoints')}; copy it again"
                )
            points.append(places)
            held = piece.find("PointData")
            name = None if held is None else held.get("Normals")
            for each in () if held is None or name is None else held.iter("DataArray"):
                if each.get("Name") == name:
                    normals.append(data.numbers(each).reshape(-1, 3).astype(np.float64))
    if not sum(map(len, points)):
        raise FormatError(f"{path} holds no points")
    together = np.concatenate(points)
    whole = np.concatenate(normals) if normals else np.empty((0, 3))
    return Content(together, normals=whole if len(whole) == len(together) else None)


def _coded_size(size: int) -> int:
    """Return how many letters of base64 some bytes take."""
    return -(-size // 3) * 4


def _decoded(text: str) -> bytes:
    try:
        return base64.b64decode(text, validate=True)
    except binascii.Error:
        raise ValueError("damaged base64") from None
