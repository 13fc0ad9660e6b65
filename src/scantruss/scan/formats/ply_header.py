"""The header of a PLY file: its elements and where the data starts."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from ...errors import FormatError
from ..units import PATTERN

PLY_TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "long": "i8", "ulong": "u8",
    "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4", "int64": "i8",
    "uint64": "u8", "float": "f4", "float32": "f4", "double": "f8", "float64": "f8",
}  # fmt: skip
COUNT_TYPES = {word: code for word, code in PLY_TYPES.items() if code[0] != "f"}
PLY = re.compile(rb"ply[ \t]*[\r\n]")  # how a file starts
LONGEST_PLY_HEADER = 1 << 20  # bytes


@dataclass(frozen=True)
class Property:
    """One property of an element; a list has a type for its count."""

    name: str
    type: str
    count_type: str = ""


@dataclass(frozen=True)
class Element:
    """One element of the header."""

    name: str
    count: int
    properties: tuple[Property, ...]

    @property
    def has_lists(self) -> bool:
        """Whether rows may differ in length."""
        return any(p.count_type for p in self.properties)


@dataclass(frozen=True)
class PlyHeader:
    """The content of the header, and where the data starts."""

    order: str  #: "" for ascii, "<" or ">" for binary
    elements: tuple[Element, ...]
    start: int  #: [byte]
    unit: str = ""  #: unit, if a comment names it


def read_header(path: Path) -> PlyHeader:
    """Return the header of a PLY file; FormatError where it cannot be understood."""
    with path.open("rb") as file:
        raw = file.read(LONGEST_PLY_HEADER)
    end = re.search(rb"(?:^|[\r\n])end_header[ \t]*(\r\n|\n|\r)", raw)
    if not end:
        raise FormatError(f"{path} ends before its PLY header does; the file is damaged")
    start = end.end()
    if end[1] == b"\r\n" and re.match(rb"ply[ \t]*\r[^\n]", raw):  # lines end with CR alone, the data starts with LF
        start -= 1
    order: str | None = None
    elements: list[tuple[str, int, list[Property]]] = []
    for line in re.split(r"\r\n|\n|\r", raw[: end.start()].decode("latin-1")):
        words = line.split()
        try:
            match words:
                case ["format", word, *_]:
                    order = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}[word]
                case ["element", name, count, *_]:
                    elements.append((name, int(count), []))
                case ["property", "list", count_type, type_, name, *_]:
                    elements[-1][2].append(Property(name, PLY_TYPES[type_], COUNT_TYPES[count_type]))
                case ["property", type_, name, *_]:
                    elements[-1][2].append(Property(name, PLY_TYPES[type_]))
        except (KeyError, ValueError, IndexError):
            raise FormatError(f"{path}: cannot understand {line.strip()[:80]!r} in the PLY header") from None
    if order is None:
        raise FormatError(f"{path}: the PLY header has no line format")
    if any(count < 0 for _, count, _ in elements):
        raise FormatError(f"{path}: the PLY header promises a negative number of rows")
    unit = re.search(
        rf"(?:^|[\r\n])(?:comment|obj_info)\s[^\r\n]*?\b{PATTERN}", raw[: end.start()].decode("latin-1"), re.I
    )
    return PlyHeader(
        order, tuple(Element(name, count, tuple(p)) for name, count, p in elements), start, unit[1] if unit else ""
    )


def ends_early(path: Path, element: Element) -> FormatError:
    """Return the error for a file with fewer rows than its header promises."""
    return FormatError(
        f"{path} ends early: its header promises {element.count:,} rows of {element.name}; copy it again"
    )
