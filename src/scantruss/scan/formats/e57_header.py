"""The header of an E57 file: pages of 1020 bytes with a CRC-32C each, and the XML that describes the scans."""

from __future__ import annotations

import math
import re
import struct
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from ...errors import FormatError

PAGE_BYTES = 1024  # bytes
DATA_BYTES = 1020  # bytes of a page that are data
MOST_PAGES = 1 << 14  # pages checked at a time
CHECKSUM_POLYNOMIAL = 0x82F63B78  # Castagnoli's, bits reversed
CARTESIAN = ("cartesianX", "cartesianY", "cartesianZ")
SPHERICAL = ("sphericalRange", "sphericalAzimuth", "sphericalElevation")
BITS_OF_FLOAT = {"double": 64, "single": 32}


@dataclass(frozen=True)
class E57Field:
    """One field of the records of a scan."""

    name: str
    kind: str  #: double, single, integer
    low: int = 0
    bits: int = 64
    scale: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True, eq=False)
class E57Scan:
    """One scan of a file, and where it stands."""

    name: str
    count: int
    start: int  #: [byte] of the data, where its section begins
    fields: tuple[E57Field, ...]
    rotation: np.ndarray  #: (3, 3); a place in the common frame is rotation @ place + translation
    translation: np.ndarray  #: (3,) [m]

    @property
    def axes(self) -> tuple[str, ...]:
        """The fields that hold the coordinates; () if there are none."""
        names = [field.name for field in self.fields]
        return next((axes for axes in (CARTESIAN, SPHERICAL) if set(axes) <= set(names)), ())


def read_pages(path: Path) -> np.ndarray:
    """Return the data of all pages, (N,) uint8; FormatError where the file is cut off or a checksum does not fit."""
    size = path.stat().st_size
    with path.open("rb") as file:
        head = file.read(48)
    if len(head) < 48:
        raise FormatError(f"{path} ends within its E57 header; copy it again")
    length, page = struct.unpack("<Q", head[16:24])[0], struct.unpack("<Q", head[40:48])[0]
    if page != PAGE_BYTES:
        raise FormatError(f"{path} says that its pages have {page} bytes, E57 has {PAGE_BYTES}; the file is damaged")
    if size < length or size % PAGE_BYTES:
        raise FormatError(f"{path} ends early: its header promises {length:,} bytes, got {size:,}; copy it again")
    pages = np.memmap(path, dtype=np.uint8, mode="r").reshape(-1, PAGE_BYTES)
    stated = np.ascontiguousarray(pages[:, DATA_BYTES:]).view(">u4")[:, 0]
    wrong = np.flatnonzero(checksums(pages) != stated)
    if len(wrong):
        raise FormatError(f"{path} is damaged: page {wrong[0] + 1} of {len(pages)} has a wrong checksum; copy it again")
    return pages[:, :DATA_BYTES].reshape(-1)


def logical(place: int) -> int:
    """Return the offset in the data of an offset in the file."""
    return place // PAGE_BYTES * DATA_BYTES + min(place % PAGE_BYTES, DATA_BYTES)


def checksums(pages: np.ndarray) -> np.ndarray:
    """Return the CRC-32C of the data of each page, (P,) uint32: two bytes at a time, all pages at once."""
    table = _table()
    sums = np.empty(len(pages), dtype=np.uint32)
    for begin in range(0, len(pages), MOST_PAGES):
        words = (
            np.ascontiguousarray(pages[begin : begin + MOST_PAGES, :DATA_BYTES])
            .view("<u2")
            .T.astype(np.uint32, order="C")
        )
        state = np.full(words.shape[1], 0xFFFFFFFF, dtype=np.uint32)
        for word in words:
            state = table[(state ^ word) & 0xFFFF] ^ (state >> 16)
        sums[begin : begin + MOST_PAGES] = ~state
    return sums


@cache
def _table() -> np.ndarray:
    """Return the CRC of each pair of bytes after 16 shifts, (65536,) uint32."""
    table: np.ndarray = np.arange(1 << 16, dtype=np.uint32)
    for _ in range(16):
        table = (table >> 1) ^ np.where(table & 1, np.uint32(CHECKSUM_POLYNOMIAL), np.uint32(0))
    return table


def read_scans(path: Path, data: np.ndarray) -> list[E57Scan]:
    """Return all scans that an E57 file describes."""
    start, length = struct.unpack("<QQ", data[24:40].tobytes())
    start = logical(start)
    if not length or start + length > len(data):
        raise FormatError(f"{path}: the description of the scans lies behind the end of the file; copy it again")
    text = data[start : start + length].tobytes().decode("utf-8", errors="replace").strip("\0 \ufeff")
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise FormatError(f"{path}: its XML declares entities, which E57 does not have; export it again")
    text = re.sub(r'\sxmlns(?::[\w.-]+)?\s*=\s*("[^"]*"|\'[^\']*\')', "", text)
    text = re.sub(r"<(/?)([A-Za-z_][\w.-]*):", r"<\1\2_", text)  # extensions, declared or not
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise FormatError(f"{path}: its XML cannot be read ({error}); export it again") from None
    scans = []
    for number, entry in enumerate(root.findall("data3D/vectorChild")):
        points = entry.find("points")
        if points is not None:
            try:
                scans.append(_scan(entry, points, number))
            except (KeyError, ValueError, OverflowError) as error:
                raise FormatError(f"{path}: cannot understand scan {number + 1} ({error}); export it again") from None
    return scans


def _scan(entry: ElementTree.Element, points: ElementTree.Element, number: int) -> E57Scan:
    prototype = points.find("prototype")
    fields = tuple(_field(child) for child in (prototype if prototype is not None else ()))
    count, offset = int(points.attrib["recordCount"]), int(points.attrib["fileOffset"])
    if count < 0 or offset < 0:
        raise ValueError("negative recordCount or fileOffset")
    rotation, translation = _pose(entry.find("pose"))
    name = (entry.findtext("name") or "").strip() or f"scan {number + 1}"
    return E57Scan(name, count, logical(offset), fields, rotation, translation)


def _field(child: ElementTree.Element) -> E57Field:
    kind = child.attrib.get("type", "")
    if kind == "Float":
        precision = "single" if child.attrib.get("precision") == "single" else "double"
        return E57Field(child.tag, precision, bits=BITS_OF_FLOAT[precision])
    if kind not in ("Integer", "ScaledInteger"):
        raise ValueError(f"field {child.tag} of type {kind!r}")
    low, high = int(child.attrib.get("minimum", -(2**63))), int(child.attrib.get("maximum", 2**63 - 1))
    bits = (high - low).bit_length() if high >= low else -1
    scale, offset = float(child.attrib.get("scale", 1)), float(child.attrib.get("offset", 0))
    if not 0 <= bits <= 64 or not -(2**63) <= low < 2**63 or not math.isfinite(scale + offset):
        raise ValueError(f"limits of field {child.tag}")
    return E57Field(child.tag, "integer", low, bits, *((scale, offset) if kind == "ScaledInteger" else (1.0, 0.0)))


def _pose(pose: ElementTree.Element | None) -> tuple[np.ndarray, np.ndarray]:
    """Return rotation and translation of a scan; none where it has no pose, or only a part of one."""
    rotation, translation = np.eye(3), np.zeros(3)
    if pose is None:
        return rotation, translation
    moved, turned = pose.find("translation"), pose.find("rotation")
    if moved is not None:
        translation = np.array([_value(moved, axis) for axis in "xyz"])
    if turned is not None:
        w, x, y, z = (_value(turned, axis) for axis in "wxyz")
        norm = math.sqrt(w * w + x * x + y * y + z * z)
        if not 0.5 < norm < 2.0:
            raise ValueError(f"a rotation of length {norm:.3g}")
        w, x, y, z = w / norm, x / norm, y / norm, z / norm
        rotation = np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        )
    if not (np.isfinite(rotation).all() and np.isfinite(translation).all()):
        raise ValueError("a pose that is not finite")
    return rotation, translation


def _value(parent: ElementTree.Element, name: str) -> float:
    return float((parent.findtext(name) or "0").strip() or "0")
