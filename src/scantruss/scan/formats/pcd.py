"""Points of a PCD file: ascii, binary or compressed; any order, type and number of fields.

This reader uses numpy only: the package pypcd4 accepts neither two blanks between numbers nor fields of several values, and
allocates as many points as a header claims. LZF is unpacked by the package that pypcd4 uses.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...errors import FormatError
from ...runtime.ours import CLOUD_MARK
from ..units import PATTERN, metres_of
from .columns import find_attributes
from .content import Cloud, Content, surplus_note
from .kinds import kind_of, read_head, reading_as, wrong_kind

LONGEST_PCD_HEADER = 1 << 16  # bytes
MOST_LZF = 100  # LZF makes at most 264 bytes of 3
PCD_TYPES = {("F", s): f"<f{s}" for s in (2, 4, 8)} | {(t, s): f"<{t.lower()}{s}" for t in "IU" for s in (1, 2, 4, 8)}


@dataclass(frozen=True)
class PcdHeader:
    """What the header of a PCD file says."""

    names: tuple[str, ...]
    types: tuple[str, ...]  #: of numpy
    counts: tuple[int, ...]  #: values of each field
    points: int
    data: str  #: ascii, binary or binary_compressed
    start: int  #: [byte] of the points
    metres: float | None
    moved: bool  #: the scanner did not stand at the origin

    @property
    def row(self) -> np.dtype[np.void]:
        """The layout of a row of a binary file."""
        cells = zip(self.types, self.counts, strict=True)
        return np.dtype([(f"f{i}", kind, (count,)) for i, (kind, count) in enumerate(cells)])


def read_pcd(path: Path, wanted: Sequence[str] = ()) -> Content:
    """Return the points of a PCD file and the wanted attributes."""
    head = read_head(path)
    if kind_of(head) != "a PCD file":
        raise wrong_kind(path, head, "a PCD file")
    header = read_pcd_header(path)
    names = [name.lower() for name in header.names]
    if missing := [axis for axis in "xyz" if axis not in names]:
        raise FormatError(f"{path} has no field {missing[0]}; it has {' '.join(header.names)[:80]}")
    found = find_attributes(header.names, wanted)
    columns = [*(names.index(axis) for axis in "xyz"), *found.values()]
    read = {"ascii": _read_ascii, "binary": _read_binary, "binary_compressed": _read_compressed}[header.data]
    table = read(path, header, columns) if header.points else np.empty((0, len(columns)))
    attributes = {name: table[:, 3 + i] for i, name in enumerate(found)}
    notes = []
    if header.moved:
        notes.append(f"the viewpoint of {path.name} is where the scanner stood; the points are not moved by it")
    if len(table) > header.points:
        notes.append(surplus_note(path.name, len(table), header.points))
    more = path.stat().st_size - header.start - header.points * header.row.itemsize
    if header.data == "binary" and more >= header.row.itemsize:
        notes.append(f"{path.name} goes on for {more:,} bytes after the points that it promises; they are ignored")
    return Content(np.ascontiguousarray(table[:, :3]), attributes, metres=header.metres, notes=tuple(notes))


def read_pcd_header(path: Path) -> PcdHeader:
    """Return the header of a PCD file; FormatError if it is none."""
    with path.open("rb") as file:
        raw = file.read(LONGEST_PCD_HEADER)
    end = re.search(rb"(?:^|\n)[ \t]*DATA[ \t]+(\w+)[ \t]*\r?(\n|$)", raw)
    if not end:
        raise FormatError(f"{path} ends before the line DATA of its header; copy it again")
    text = raw[: end.start()].decode("latin-1")
    lines = [line.split() for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")]
    words = {line[0].upper(): line[1:] for line in lines}
    data = end[1].decode().lower()
    if data not in ("ascii", "binary", "binary_compressed"):
        raise FormatError(f"{path}: DATA must be ascii, binary or binary_compressed, got {data[:40]!r}")
    names = words.get("FIELDS", words.get("COLUMNS", []))
    try:
        sizes = [int(word) for word in words.get("SIZE", ["4"] * len(names))]
        counts = [int(word) for word in words.get("COUNT", ["1"] * len(names))]
        types = [PCD_TYPES[pair] for pair in zip(words.get("TYPE", ["F"] * len(names)), sizes, strict=True)]
        area = math.prod(int(words[key][0]) for key in ("WIDTH", "HEIGHT") if key in words)
        points = int(words["POINTS"][0]) if "POINTS" in words else area
        place = [float(word) for word in words.get("VIEWPOINT", [])]
    except (KeyError, ValueError, IndexError):
        raise FormatError(f"{path}: cannot understand its PCD header; export it again") from None
    if not len(names) == len(types) == len(counts) or min([*counts, 1]) < 1 or points < 0 or sum(counts) > 10_000:
        raise FormatError(f"{path}: SIZE, TYPE and COUNT of its PCD header must fit FIELDS; export it again")
    if "WIDTH" in words and area != points:
        raise FormatError(
            f"{path}: its PCD header says {points:,} points, but WIDTH x HEIGHT is {area:,}; export it again"
        )
    unit = re.search(rf"#\s*{PATTERN}", text, re.IGNORECASE)
    metres = metres_of(unit[1]) if unit else None
    moved = len(place) == 7 and place != [0, 0, 0, 1, 0, 0, 0]
    return PcdHeader(tuple(names), tuple(types), tuple(counts), points, data, end.end(), metres, moved)


def _ends_early(path: Path, header: PcdHeader, got: str) -> FormatError:
    return FormatError(f"{path} ends early: its header promises {header.points:,} points, got {got}; copy it again")


def _read_ascii(path: Path, header: PcdHeader, columns: Sequence[int]) -> np.ndarray:
    place = np.concatenate([[0], np.cumsum(header.counts)])
    if header.points > path.stat().st_size:
        raise _ends_early(path, header, f"{path.stat().st_size:,} bytes")
    with reading_as(path, "PCD"), path.open("rb") as file:
        file.seek(header.start)
        lines = (line for line in file if not line.isspace())
        usecols = [int(place[column]) for column in columns]
        table = np.loadtxt(lines, usecols=usecols, ndmin=2, comments=None)
    if len(table) < header.points:
        raise _ends_early(path, header, f"{len(table):,}")
    return table


def _read_binary(path: Path, header: PcdHeader, columns: Sequence[int]) -> np.ndarray:
    held = (path.stat().st_size - header.start) // max(header.row.itemsize, 1)
    if held < header.points:
        raise _ends_early(path, header, f"{held:,}")
    rows = np.memmap(path, header.row, "r", header.start, (header.points,))
    table = np.empty((header.points, len(columns)))
    for i, column in enumerate(columns):
        table[:, i] = rows[f"f{column}"][:, 0]
    return table


def _read_compressed(path: Path, header: PcdHeader, columns: Sequence[int]) -> np.ndarray:
    """Unpack a file that is stored field by field."""
    with path.open("rb") as file:
        file.seek(header.start)
        sizes = np.frombuffer(file.read(8), dtype="<u4")
        packed = file.read(int(sizes[0])) if len(sizes) == 2 else b""
    if len(sizes) < 2 or len(packed) < sizes[0]:
        raise _ends_early(path, header, f"{len(packed):,} packed bytes")
    size = header.points * header.row.itemsize
    if sizes[1] != size or size > MOST_LZF * len(packed):
        raise FormatError(
            f"{path}: {header.points:,} points do not fit its {int(sizes[1]):,} bytes; the file is damaged"
        )
    from lzf import decompress

    with reading_as(path, "PCD"):
        raw = decompress(packed, size)
    if raw is None or len(raw) != size:
        raise FormatError(f"{path} cannot be unpacked; copy it again")
    table = np.empty((header.points, len(columns)))
    widths = [np.dtype(kind).itemsize * count for kind, count in zip(header.types, header.counts, strict=True)]
    for i, column in enumerate(columns):
        begin = header.points * sum(widths[:column])
        shape = (header.points, header.counts[column])
        table[:, i] = np.ndarray(shape, header.types[column], raw, begin)[:, 0]
    return table


def write_pcd(path: Path, cloud: Cloud) -> None:
    """Write a binary PCD file of doubles."""
    names = cloud.names("normal_x", "normal_y", "normal_z")
    count, many = len(cloud.points), len(names)
    unit = f"# unit {cloud.unit}\n" if cloud.unit else ""
    head = (
        f"# .PCD v0.7 - Point Cloud Data file format\n# {CLOUD_MARK}\n{unit}VERSION 0.7\nFIELDS {' '.join(names)}\n"
        f"SIZE{' 8' * many}\nTYPE{' F' * many}\nCOUNT{' 1' * many}\nWIDTH {count}\nHEIGHT 1\n"
        f"VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {count}\nDATA binary\n"
    )
    with path.open("wb") as file:
        file.write(head.encode())
        file.write(np.ascontiguousarray(cloud.columns, dtype="<f8").data)
